//! State that each increment passes to the next increment, and results derived from this state. N is the number of
//! cells.

use serde::{Deserialize, Serialize};

use crate::contact::balance::MAX_RIGID_MODES;
use crate::contact::certificate::StateChecks;
use crate::contact::{ContactState, Increment};
use crate::evolution::model::PreparedModel;
use crate::evolution::records::{Certificate, FrameState, Resultants, WearErrors};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct RunState {
    /// Tractions on body 2, `[3, N]`, MPa.
    pub tractions: Vec<f64>,
    /// Elastic displacement S P of the tractions P with the flexibility S, `[3, N]`, mm.
    pub elastic: Vec<f64>,
    /// Tangential gap from which the next increment measures its slip, `[2, N]`, mm.
    pub slip_reference: Vec<f64>,
    /// Wear depth, `[N]`, mm.
    pub wear_depth: Vec<f64>,
    /// Rigid motion of body 2 along the frame's x, y, n, without the additional modes (`mode_amplitudes`), mm.
    pub rigid_motion: [f64; 3],
    pub mode_amplitudes: [f64; MAX_RIGID_MODES],
    /// Amplitudes of the loads of the bodies.
    pub load_amplitudes: Vec<f64>,
    /// Cumulative friction dissipation, N mm.
    pub dissipation: f64,
    /// Wear volume caused by rolling, mm3.
    pub rolling_wear_volume: f64,
    pub cycles_done: u64,
    /// Cumulative distance of steady sliding, mm.
    pub distance_slid: f64,
    /// Friction dissipation in steps with wear, N mm; `None` after a step with wear but without friction.
    pub wear_dissipation: Option<f64>,
    /// Estimated error of the wear depth, `[N]`, mm: sum of error magnitudes over all jumps. The errors include the
    /// path between path points.
    pub depth_errors: Vec<f64>,
    /// Estimated errors of the wear volume, mm3.
    pub volume_errors: WearErrors,
}

impl RunState {
    pub fn undeformed(prepared: &PreparedModel) -> Self {
        let n = prepared.n();
        Self {
            tractions: vec![0.0; 3 * n],
            elastic: vec![0.0; 3 * n],
            slip_reference: prepared.loaded_gap[..2 * n].to_vec(),
            wear_depth: vec![0.0; n],
            rigid_motion: [0.0, 0.0, if prepared.normal_is_free() { 0.0 } else { prepared.first_touch }],
            mode_amplitudes: [0.0; MAX_RIGID_MODES],
            load_amplitudes: prepared.model.first_amplitudes(),
            dissipation: 0.0,
            rolling_wear_volume: 0.0,
            cycles_done: 0,
            distance_slid: 0.0,
            wear_dissipation: Some(0.0),
            depth_errors: vec![0.0; n],
            volume_errors: WearErrors::default(),
        }
    }

    pub fn add_wear_dissipation(&mut self, dissipation: f64, friction: bool) {
        self.wear_dissipation = self.wear_dissipation.filter(|_| friction).map(|energy| energy + dissipation);
    }

    pub fn set_from(&mut self, it: &ContactState, end: usize) {
        let n = self.wear_depth.len();
        let planes = end * 3 * n..(end + 1) * 3 * n;
        self.tractions.copy_from_slice(&it.tractions[planes.clone()]);
        self.elastic.copy_from_slice(&it.elastic[planes.clone()]);
        self.slip_reference.copy_from_slice(&it.gap[planes.start..planes.start + 2 * n]);
        self.rigid_motion = it.rigid_motion[end];
        self.mode_amplitudes = it.mode_amplitudes[end];
    }
}

pub(super) fn resultants(
    prepared: &PreparedModel,
    problem: &Increment,
    it: &ContactState,
    end: usize,
) -> Resultants {
    let n = prepared.n();
    let base = end * 3 * n;
    let (force, moment) = prepared.resultants(&it.tractions[base..base + 3 * n]);
    let motion = prepared.motion(&it.rigid_motion[end], &it.mode_amplitudes[end]);
    let turn = prepared.rotation(&it.mode_amplitudes[end]).map(f64::to_degrees);
    let mut result = Resultants {
        shift: [motion[0], motion[1]],
        rotation: [turn[0], turn[1]],
        twist: turn[2],
        // The sum avoids a normal force of -0 without contact.
        normal_force: 0.0 - force[2],
        tangential_force: [force[0] + 0.0, force[1] + 0.0],
        moment,
        ..Resultants::default()
    };
    for i in 0..n {
        let p = it.tractions[base + 2 * n + i];
        let area = prepared.model.frame.areas[i];
        result.peak_pressure = result.peak_pressure.max(p);
        if p > 0.0 {
            result.contact_area += area;
            if problem.sticks(it, end, i) {
                result.stick_area += area;
            }
        }
    }
    result
}

/// Returns whether any cell carries pressure at an edge of the frame beyond which the bodies continue.
///
/// `scaled` are the scaled tractions, `[3, N]` per path point.
pub(super) fn touches_edge(prepared: &PreparedModel, scaled: &[f64]) -> bool {
    let n = prepared.n();
    scaled
        .chunks_exact(3 * n)
        .any(|planes| planes[2 * n..].iter().zip(&prepared.edge).any(|(p, edge)| *edge && *p > 0.0))
}

pub(super) fn frame_state(problem: &Increment, it: &ContactState, end: usize, worn: &[f64]) -> FrameState {
    let n = worn.len();
    let base = end * 3 * n;
    let status = (0..n)
        .map(|i| {
            let open = it.tractions[base + 2 * n + i] <= 0.0;
            if open { 0 } else { 1 + u8::from(!problem.sticks(it, end, i)) }
        })
        .collect();
    FrameState {
        tractions: it.tractions[base..base + 3 * n].to_vec(),
        gap: it.gap[base..base + 3 * n].to_vec(),
        slip: it.slip[end * 2 * n..(end + 1) * 2 * n].to_vec(),
        status,
        wear_depth: worn.to_vec(),
        wear_depth_error: vec![0.0; n],
        load_amplitudes: Vec::new(),
    }
}

/// Relative error of the energy balance: the change ½ Δ(Pᵀ A S P) of the elastic energy minus the work Σ A P̄·Δ(S P) of
/// the tractions.
///
/// P are the tractions, A the areas of the cells, and S is the flexibility. Δ is the change since the state `before`,
/// and P̄ the mean traction before and after. For a symmetric operator, energy and work are equal except for rounding
/// (docs/theory-contact.md).
pub(super) fn energy_balance(
    prepared: &PreparedModel,
    before: &RunState,
    it: &ContactState,
    end: usize,
) -> f64 {
    let n = prepared.n();
    let (mut change, mut work, mut scale) = (0.0, 0.0, 0.0);
    for plane in 0..3 {
        for i in 0..n {
            let area = prepared.model.frame.areas[i];
            let k = plane * n + i;
            let (p0, u0) = (before.tractions[k], before.elastic[k]);
            let (p1, u1) = (it.tractions[end * 3 * n + k], it.elastic[end * 3 * n + k]);
            change += 0.5 * area * (p1 * u1 - p0 * u0);
            work += 0.5 * area * (p0 + p1) * (u1 - u0);
            scale += 0.5 * area * ((p1 * u1).abs() + (p0 * u0).abs());
        }
    }
    if scale > 0.0 { (change - work).abs() / scale } else { 0.0 }
}

/// Certificate of a solution. `min_gap` is divided by the magnitude of the approach, unless the approach is 0.
pub(super) fn certificate(checks: &StateChecks, approach: f64, energy_balance: f64) -> Certificate {
    let depth = if approach == 0.0 { 1.0 } else { approach.abs() };
    Certificate {
        natural_residual: checks.natural_residual,
        min_gap: checks.min_gap / depth,
        max_cone_violation: checks.max_cone_violation,
        normal_gap_energy: checks.normal_gap_energy,
        tangential_gap_energy: checks.tangential_gap_energy,
        operator_defect: checks.operator_defect,
        energy_balance,
    }
}
