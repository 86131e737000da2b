//! Equations of one contact increment: gap, slip and wear for given tractions.

use std::sync::Arc;

use super::balance::{BalanceCells, MAX_RIGID_MODES};
use super::contact_state::ContactState;
use super::control::{NormalControl, PathPoint, Pressures, SlipReference, TangentialControl};
use super::friction_scaling::FrictionScaling;
use super::scales::ContactScales;
use crate::error::Result;
use crate::flexibility::{Flexibility, TangentialFlexibility};
use crate::laws::friction::FrictionEllipse;
use crate::laws::wear::SpecificWearRate;
use crate::omitted::{AllowedOmissions, OmittableWork};

/// Data and equations of one contact increment.
pub struct Increment<'a> {
    /// Flexibility operator S, from tractions (MPa) to elastic displacements of the gap (mm).
    pub flexibility: &'a dyn Flexibility,
    /// Cell areas, `[N]`.
    pub areas: &'a [f64],
    /// Gap at zero tractions and zero rigid motion, without wear, `[3, N]`, mm.
    pub initial_gap: &'a [f64],
    /// Change of the gap by loads that vary within a cycle, at the + reversal point, `[3, N]`, mm; `None` without such loads.
    pub cyclic_gap: Option<&'a [f64]>,
    /// Matrix of each cell, `[N]`, that turns a translation of body 2 along x, y, n into components along the axes of
    /// the cell. `None` if every matrix is the identity.
    pub rigid_axes: Option<&'a [nalgebra::Matrix3<f64>]>,
    /// Gap per unit of each additional rigid mode, `[3, N]` each.
    pub mode_gaps: &'a [Vec<f64>],
    /// Friction ellipse, `None` without friction.
    pub friction: Option<FrictionEllipse>,
    /// Specific wear rate, `None` without wear.
    pub wear: Option<SpecificWearRate>,
    /// Factors on the wear path of each cell, `[N]`, that correct the wear between the path points of a cycle. `None` stands for 1.
    pub wear_path_factors: Option<&'a [f64]>,
    /// Local stiffnesses and largest eigenvalues for this operator and this friction ellipse.
    pub scales: Arc<ContactScales>,
    /// Patch of neighbouring cells to which each cell belongs, `[N]`. Empty without meshed bodies.
    pub patches: &'a [usize],
    /// Wear depth at the start, `[N]`, mm.
    pub wear_depth: &'a [f64],
    /// Number of passes through the path points whose wear opens the gap: 1, or the cycles of an implicit stage of a
    /// wear jump. 0 if wear does not change the gap.
    pub implicit_passes: f64,
    /// Whether the pressures are unknown.
    pub pressures: Pressures,
    /// Work that the solver may omit.
    pub skip: AllowedOmissions,
    /// Path points, which are solved together.
    pub path_points: Vec<PathPoint>,
}

impl Increment<'_> {
    /// Number of cells.
    pub fn n(&self) -> usize {
        self.areas.len()
    }

    pub(crate) fn friction_scaling(&self) -> Option<FrictionScaling> {
        self.friction.as_ref().map(FrictionScaling::new)
    }

    /// Computes the scaled tractions, `[3, N]` per path point. Without friction the scaled tangential tractions are zero.
    pub fn scale_tractions(&self, tractions: &[f64], hatted: &mut [f64]) {
        let (n, hat) = (self.n(), self.friction_scaling());
        for (physical, out) in tractions.chunks(3 * n).zip(hatted.chunks_mut(3 * n)) {
            out[2 * n..].copy_from_slice(&physical[2 * n..]);
            for i in 0..n {
                let q = hat.map_or([0.0; 2], |hat| hat.scaled_traction([physical[i], physical[n + i]]));
                out[i] = q[0];
                out[n + i] = q[1];
            }
        }
    }

    /// Returns whether the iterations compute only normal components.
    pub fn normal_only(&self) -> bool {
        let given = |end: &PathPoint| matches!(end.reference, SlipReference::Prescribed(_));
        self.skip.allows(OmittableWork::TangentialUnknowns)
            && self.friction.is_none()
            && (self.wear.is_none() || self.path_points.iter().all(given))
    }

    pub(super) fn tangential_operator(&self) -> Option<&dyn TangentialFlexibility> {
        if self.pressures == Pressures::Given { self.flexibility.tangential() } else { None }
    }

    /// Linear equations for changes of tractions and motions, without wear. Newton's tangent adds the change of the
    /// wear. `flexibility` may be less accurate than the operator of the increment. `nothing` contains zeros, `[3, N]`.
    pub(super) fn linearised<'b>(
        &'b self,
        flexibility: &'b dyn Flexibility,
        nothing: &'b [f64],
    ) -> Increment<'b> {
        let ends = self.path_points.iter().map(|end| PathPoint {
            normal: NormalControl::Approach,
            tangential: TangentialControl::Shift,
            balance: None,
            reference: end.reference.linearised(self.n()),
            load_phase: 0.0,
        });
        Increment {
            flexibility,
            initial_gap: nothing,
            cyclic_gap: None,
            wear_depth: &nothing[..self.n()],
            wear: None,
            scales: self.scales.clone(),
            path_points: ends.collect(),
            ..*self
        }
    }

    /// Number of operator applications of one [`Increment::evaluate`].
    pub fn applications(&self) -> usize {
        self.path_points.len()
    }

    /// Computes the derived fields of `it` from its unknowns. Does not allocate.
    pub fn evaluate(&self, it: &mut ContactState) {
        self.apply_flexibility(it);
        self.fill_from_elastic(it);
    }

    /// Computes the normal gap at the path point `end` from the initial gap, S P, the rigid motion and the wear depth
    /// at the start.
    pub(super) fn fill_normal_gap(&self, it: &mut ContactState, end: usize) {
        let n = self.n();
        let normal = end * 3 * n + 2 * n..end * 3 * n + 3 * n;
        let level = self.rigid_axes.is_none() && self.mode_gaps.is_empty();
        let (motion, floating) = (it.rigid_motion[end], it.mode_amplitudes[end]);
        let gap = it.gap[normal.clone()].iter_mut().zip(&it.elastic[normal]);
        for (i, ((gap, elastic), worn)) in gap.zip(self.wear_depth).enumerate() {
            let closing = if level { motion[2] } else { self.rigid_gap(i, motion, &floating)[2] };
            *gap = self.undeformed_gap(2 * n + i, end) + closing + elastic + worn;
        }
    }

    /// Computes gap, slip, wear and gradient from the tractions and S P.
    pub(super) fn fill_from_elastic(&self, it: &mut ContactState) {
        self.fill_gap(it);
        self.fill_slip(it);
        self.fill_wear(it);
        self.fill_gradient(it);
    }

    /// Returns the cells without formed flexibility in which undeformed bodies would overlap at the motions of `it`, in
    /// ascending order.
    pub fn closed_by_motion(&self, it: &ContactState) -> Vec<usize> {
        let mut cells = self.flexibility.unformed_cells();
        let gap = |cell: usize, end: usize| {
            let [.., closing] = self.rigid_gap(cell, it.rigid_motion[end], &it.mode_amplitudes[end]);
            self.undeformed_gap(2 * self.n() + cell, end) + closing + self.wear_depth[cell]
        };
        cells.retain(|&cell| (0..self.path_points.len()).any(|end| gap(cell, end) < 0.0));
        cells
    }

    /// Completes elastic displacement, gap and slip of an evaluated state in the cells whose flexibility is not formed.
    /// Of these cells, returns the cells with overlap or pressure, in ascending order.
    ///
    /// # Errors
    /// If the equations of a body cannot be solved.
    pub fn complete_unformed_cells(&self, it: &mut ContactState) -> Result<Vec<usize>> {
        let unformed = self.flexibility.unformed_cells();
        if unformed.is_empty() {
            return Ok(unformed);
        }
        let n = self.n();
        for end in 0..self.path_points.len() {
            let planes = end * 3 * n..(end + 1) * 3 * n;
            self.flexibility.complete_gap(&it.tractions[planes.clone()], &mut it.elastic[planes])?;
        }
        self.fill_from_elastic(it);
        let closed = |&cell: &usize| {
            let mut normal = (0..self.path_points.len()).map(|end| end * 3 * n + 2 * n + cell);
            normal.any(|k| it.gap[k] < 0.0 || it.tractions[k] > 0.0)
        };
        Ok(unformed.into_iter().filter(closed).collect())
    }

    fn apply_flexibility(&self, it: &mut ContactState) {
        let n = self.n();
        for end in 0..self.path_points.len() {
            let planes = end * 3 * n..(end + 1) * 3 * n;
            let hatted = &it.scaled[planes.clone()];
            let tractions = &mut it.tractions[planes.clone()];
            tractions[2 * n..].copy_from_slice(&hatted[2 * n..]);
            let elastic = &mut it.elastic[planes];
            match self.friction_scaling() {
                Some(hat) => {
                    for i in 0..n {
                        let q = hat.physical_traction([hatted[i], hatted[n + i]]);
                        tractions[i] = q[0];
                        tractions[n + i] = q[1];
                    }
                    match self.tangential_operator() {
                        Some(part) => part.apply_tangential(&tractions[..2 * n], &mut elastic[..2 * n]),
                        None => self.flexibility.apply(tractions, elastic),
                    }
                }
                None => {
                    tractions[..2 * n].fill(0.0);
                    if self.normal_only() {
                        self.flexibility.apply_normal(&tractions[2 * n..], &mut elastic[2 * n..]);
                    } else {
                        self.flexibility.apply(tractions, elastic);
                    }
                }
            }
        }
    }

    /// Computes the gap without the wear depth. [`Self::fill_wear`] adds the wear depth.
    fn fill_gap(&self, it: &mut ContactState) {
        let n = self.n();
        for end in 0..self.path_points.len() {
            let base = end * 3 * n;
            let motion = it.rigid_motion[end];
            for i in 0..n {
                let local = self.rigid_gap(i, motion, &it.mode_amplitudes[end]);
                for (plane, shift) in local.iter().enumerate() {
                    let k = base + plane * n + i;
                    it.gap[k] = self.undeformed_gap(plane * n + i, end) + shift + it.elastic[k];
                }
            }
        }
    }

    /// Gap at zero tractions and zero rigid motion at a path point, without wear, mm. `k` is an index into a field
    /// `[3, N]`.
    fn undeformed_gap(&self, k: usize, point: usize) -> f64 {
        match self.cyclic_gap {
            Some(gap) => self.initial_gap[k] + self.path_points[point].load_phase * gap[k],
            None => self.initial_gap[k],
        }
    }

    /// Local gap in cell `i` from a rigid motion along x, y, n and the amplitudes `floating` of the additional modes.
    pub fn rigid_gap(&self, i: usize, motion: [f64; 3], floating: &[f64; MAX_RIGID_MODES]) -> [f64; 3] {
        let mut local = match self.rigid_axes {
            None => motion,
            Some(axes) => (axes[i] * nalgebra::Vector3::from(motion)).into(),
        };
        let n = self.n();
        for (gap, amount) in self.mode_gaps.iter().zip(floating) {
            local.iter_mut().enumerate().for_each(|(plane, sum)| *sum += amount * gap[plane * n + i]);
        }
        local
    }

    pub(super) fn cells(&self) -> BalanceCells<'_> {
        BalanceCells { areas: self.areas, hat: self.friction_scaling() }
    }

    pub(super) fn fill_slip(&self, it: &mut ContactState) {
        let n = self.n();
        for (end, spec) in self.path_points.iter().enumerate() {
            if let SlipReference::Upstream(upstream) = &spec.reference {
                for plane in 0..2 {
                    let elastic = &it.elastic[end * 3 * n + plane * n..end * 3 * n + (plane + 1) * n];
                    let (slip, creep) = (end * 2 * n + plane * n, &upstream.rigid_slip[plane * n..]);
                    for (i, &from) in upstream.source_cell.iter().enumerate() {
                        it.slip[slip + i] = creep[i] + elastic[i] - elastic[from];
                    }
                }
                continue;
            }
            if let SlipReference::Prescribed(slip) = &spec.reference {
                it.slip[end * 2 * n..(end + 1) * 2 * n].copy_from_slice(slip);
                continue;
            }
            let before = self.previous_path_point(end);
            for plane in 0..2 {
                for i in 0..n {
                    let here = it.gap[end * 3 * n + plane * n + i];
                    let from = match &spec.reference {
                        SlipReference::Previous { gap, .. } => gap[plane * n + i],
                        SlipReference::PreviousPoint { stick_mask, stick_gap, .. } if stick_mask[i] => {
                            stick_gap[plane * n + i]
                        }
                        SlipReference::PreviousPoint { origin: Some(origin), .. } if before == 0 => {
                            let rigid = it.rigid_motion[0];
                            let drift = [rigid[0] - origin[0], rigid[1] - origin[1], 0.0];
                            it.gap[plane * n + i] - self.rigid_gap(i, drift, &[0.0; MAX_RIGID_MODES])[plane]
                        }
                        SlipReference::PreviousPoint { .. } => it.gap[before * 3 * n + plane * n + i],
                        SlipReference::Upstream(_) | SlipReference::Prescribed(_) => {
                            unreachable!("they need no gap")
                        }
                    };
                    it.slip[end * 2 * n + plane * n + i] = here - from;
                }
            }
        }
    }

    pub(super) fn previous_path_point(&self, end: usize) -> usize {
        (end + self.path_points.len() - 1) % self.path_points.len()
    }

    /// Computes the wear depth dw = Σ p̄ |Δg|_i of one pass through the path points. p̄ is the mean pressure
    /// ([`Self::mean_pressure`]). |Δg|_i is the slip, weighted with the specific wear rates and the wear path factor of
    /// the cell.
    ///
    /// Adds the wear depth at the start and `implicit_passes` dw to the normal gap (docs/theory-wear.md). In rolling
    /// `implicit_passes` is 0, because the wear is spread over a track of unknown length.
    ///
    /// The modules `residual`, `solver::newton::unknowns` and `solver::newton::tangent` use the derivative of dw with
    /// respect to the pressures.
    fn fill_wear(&self, it: &mut ContactState) {
        let n = self.n();
        it.wear_per_pass.fill(0.0);
        if let Some(wear) = &self.wear {
            let path_of = wear.path_per_slip();
            for end in 0..self.path_points.len() {
                for i in 0..n {
                    let slip = [it.slip[end * 2 * n + i], it.slip[end * 2 * n + n + i]];
                    let path = self.path_factor(i) * path_of(slip);
                    it.wear_per_pressure[end * n + i] = path;
                    let gap = it.gap[end * 3 * n + 2 * n + i] + self.wear_depth[i];
                    it.wear_per_pass[i] += self.mean_pressure(it, end, i, gap) * path;
                }
            }
            self.differentiate_wear(&mut it.wear_per_pressure);
        }
        for end in 0..self.path_points.len() {
            for i in 0..n {
                it.gap[end * 3 * n + 2 * n + i] +=
                    self.wear_depth[i] + self.implicit_passes * it.wear_per_pass[i];
            }
        }
    }

    /// Mean pressure for wear and dissipation on the path segment that ends at the path point `end`. It is the mean of
    /// the pressures at both ends of the segment. Steady sliding and rolling use the pressure at the end.
    ///
    /// If a cell opens in an increment, its pressure p falls at the rate of the local stiffness c. The pressure is zero
    /// after the share p / (p + c `gap`) of the increment. `gap` is the normal gap at the end without the wear of this
    /// pass, mm.
    pub(super) fn mean_pressure(&self, it: &ContactState, end: usize, i: usize, gap: f64) -> f64 {
        let n = self.n();
        let pressure = |end: usize| it.tractions[end * 3 * n + 2 * n + i];
        let p = pressure(end);
        match &self.path_points[end].reference {
            SlipReference::Previous { pressures, .. } => {
                let before = pressures[i];
                let mean = 0.5 * (before + p);
                let opens = p <= 0.0 && before > 0.0;
                if opens { mean * before / (before + self.scales.c_normal[i] * gap.max(0.0)) } else { mean }
            }
            SlipReference::PreviousPoint { .. } => 0.5 * (pressure(self.previous_path_point(end)) + p),
            SlipReference::Prescribed(_) | SlipReference::Upstream(_) => p,
        }
    }

    /// Replaces wear paths, `[N]` per path point, by derivatives of the wear depth with respect to the pressures. The
    /// pressure of a path point has the weight ½ on the path segment before the point and on the segment after it.
    fn differentiate_wear(&self, wear_path: &mut [f64]) {
        let cyclic = match &self.path_points[0].reference {
            SlipReference::PreviousPoint { .. } => true,
            SlipReference::Previous { .. } => false,
            SlipReference::Prescribed(_) | SlipReference::Upstream(_) => return,
        };
        let n = self.n();
        for i in 0..n {
            let first = if cyclic { wear_path[i] } else { 0.0 };
            for at in (i..wear_path.len()).step_by(n) {
                let next = wear_path.get(at + n).copied().unwrap_or(first);
                wear_path[at] = 0.5 * (wear_path[at] + next);
            }
        }
    }

    pub(super) fn path_factor(&self, i: usize) -> f64 {
        self.wear_path_factors.map_or(1.0, |factors| factors[i])
    }

    fn fill_gradient(&self, it: &mut ContactState) {
        let n = self.n();
        let hat = self.friction_scaling();
        for end in 0..self.path_points.len() {
            let base = end * 3 * n;
            for i in 0..n {
                it.gradient[base + 2 * n + i] = it.gap[base + 2 * n + i];
                if let Some(hat) = &hat {
                    let s = hat.scaled_slip([it.slip[end * 2 * n + i], it.slip[end * 2 * n + n + i]]);
                    it.gradient[base + i] = s[0];
                    it.gradient[base + n + i] = s[1];
                }
            }
        }
    }

    /// Returns whether cell `i` carries pressure and sticks: |q|_μ < p (1 - 1e-6).
    pub fn sticks(&self, it: &ContactState, end: usize, i: usize) -> bool {
        self.friction.is_some() && it.is_inside_cone(end, i)
    }
}
