//! Linear system of a Newton step, reduced to its unknowns. These are the pressure and up to two tangential tractions of each
//! cell in contact, and the rigid motions that follow from prescribed forces.
//!
//! Rows are multiplied by the local stiffness c, so that all rows have the unit of a traction.

use faer::Par;

use super::super::super::balance::{MOTION_COMPONENTS, RigidMotion};
use super::super::super::{ContactState, Increment, Pressures, SlipReference};
use super::factorised_systems::Entries;
use super::patches::{self, PatchFactors};
use super::preconditioner::{ActiveSetInverse, MotionSchurComplement};
use super::unknowns::{
    ActiveCell, CellStatus, FIXED_ENTRY, FreeMotion, active_cells, free_motions, perpendicular,
};
use crate::contact::friction_scaling::FrictionScaling;
use crate::flexibility::Flexibility;
use crate::linalg::dense_lu::DenseLu;
use crate::linalg::dense_matrix::DenseMatrix;
use crate::linalg::gmres::LinearSystem;

/// Linear system of a Newton step.
pub(super) struct NewtonSystem<'s, 'p> {
    pub(super) problem: &'s Increment<'p>,
    pub(super) hat: Option<FrictionScaling>,
    pub(super) active: Vec<ActiveCell>,
    pub(super) free: Vec<FreeMotion>,
    /// Number of unknown tractions. In the vector of unknowns, the motions follow the tractions.
    pub(super) tractions: usize,
    /// Scale of the unknown motions relative to the tractions: the inverse of the mean normal stiffness, mm/MPa.
    motion_unit: f64,
    /// Change of the state: change of the tractions, and the change of the gradient that the equations `linear` give.
    pub(super) change: &'s mut ContactState,
    /// Equations for the changes: without initial gap, wear and constant terms of the slip.
    linear: Increment<'s>,
    inverse: &'s mut ActiveSetInverse,
    bordered: MotionSchurComplement,
    /// Flexibility between the cells in contact, kept for several steps.
    pub(super) entries: &'s mut Option<Entries>,
    /// Factors of the whole system.
    pub(super) factors: Option<DenseLu>,
    /// Factors for the patches of a large system.
    pub(super) patches: Vec<PatchFactors>,
}

/// Operator and zero fields of the linear equations.
pub(super) struct LinearModel<'p> {
    /// Flexibility of both bodies.
    pub flexibility: &'p dyn Flexibility,
    /// Zeros, `[3, N]`.
    pub zeros: Vec<f64>,
}

/// Buffers for all steps of a solve.
pub(super) struct Workspace {
    change: ContactState,
    inverse: ActiveSetInverse,
    entries: Option<Entries>,
}

impl Workspace {
    pub fn new(problem: &Increment) -> Self {
        let (n, ends) = (problem.n(), problem.path_points.len());
        let change = ContactState::new(n, vec![[0.0; 3]; ends]);
        Self { change, inverse: ActiveSetInverse::new(n), entries: None }
    }
}

/// Rows in a column of the border. The border of the matrix contains the columns and rows of the unknown motions.
#[derive(Clone, Copy)]
pub(super) enum Rows {
    All,
    /// Only the rows of the path point to which the motion belongs. In a cycle without sticking cells, a motion common
    /// to all path points changes no slip, so that complete columns are linearly dependent.
    OwnPathPoint,
}

fn product(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

impl<'s, 'p> NewtonSystem<'s, 'p> {
    /// Assembles the system at an evaluated state.
    pub fn new(
        problem: &'s Increment<'p>,
        it: &ContactState,
        given: &'s LinearModel<'p>,
        workspace: &'s mut Workspace,
    ) -> Self {
        let (n, ends) = (problem.n(), problem.path_points.len());
        let (active, tractions) = active_cells(problem, it);
        let free: Vec<FreeMotion> = (0..ends).flat_map(|end| free_motions(problem, end)).collect();
        let stiffness = problem.scales.c_normal.iter().sum::<f64>() / n as f64;
        let mut tangent = Self {
            problem,
            hat: problem.friction_scaling(),
            active,
            free,
            tractions,
            motion_unit: 1.0 / stiffness,
            change: &mut workspace.change,
            linear: problem.linearised(given.flexibility, &given.zeros),
            inverse: &mut workspace.inverse,
            bordered: MotionSchurComplement::new(Vec::new(), Vec::new()),
            entries: &mut workspace.entries,
            factors: None,
            patches: Vec::new(),
        };
        tangent.update_border();
        tangent.keep_wear(it);
        tangent
    }

    fn keep_wear(&mut self, it: &ContactState) {
        self.change.wear_per_pressure.copy_from_slice(&it.wear_per_pressure);
    }

    /// Number of unknowns.
    pub(super) fn len(&self) -> usize {
        self.tractions + self.free.len()
    }

    /// Scaled gap in a cell per unit of a free motion.
    fn column(&self, free: &FreeMotion, cell: usize) -> [f64; 3] {
        let rigid = [free.motion[0], free.motion[1], free.motion[2]];
        let mut floating = [0.0; MOTION_COMPONENTS - 3];
        floating.copy_from_slice(&free.motion[3..]);
        let gap = self.problem.rigid_gap(cell, rigid, &floating);
        let tangential = self.hat.map_or([0.0; 2], |hat| hat.scaled_slip([gap[0], gap[1]]));
        [tangential[0], tangential[1], gap[2]]
    }

    /// Computes the gradient of `self.change` by the equations `linear`. Adds the wear depth that the change of the pressures
    /// causes at the present slip.
    fn evaluate(&mut self) {
        let problem = self.problem;
        let n = problem.n();
        self.linear.evaluate(self.change);
        if problem.wear.is_some() {
            for cell in 0..n {
                let worn: f64 = (0..problem.path_points.len())
                    .map(|end| {
                        self.change.wear_per_pressure[end * n + cell]
                            * self.change.scaled[end * 3 * n + 2 * n + cell]
                    })
                    .sum();
                for end in 0..problem.path_points.len() {
                    self.change.gradient[end * 3 * n + 2 * n + cell] += problem.implicit_passes * worn;
                }
            }
        }
    }

    /// Copies the unknowns `x` into `self.change`.
    fn spread(&mut self, x: &[f64]) {
        let n = self.problem.n();
        self.change.scaled.fill(0.0);
        for active in &self.active {
            let base = active.end * 3 * n + active.cell;
            let p = active.pressure_row.map_or(0.0, |k| x[k]);
            self.change.scaled[base + 2 * n] = p;
            let q = match active.state {
                CellStatus::PressureOnly => [0.0; 2],
                CellStatus::Stick => [x[active.tangential_row], x[active.tangential_row + 1]],
                CellStatus::Slip { direction, .. } => {
                    let (e, s) = (direction, x[active.tangential_row]);
                    let left = perpendicular(e);
                    [p * e[0] + s * left[0], p * e[1] + s * left[1]]
                }
                CellStatus::PrescribedSlip { direction } => direction.map(|e| p * e),
            };
            (self.change.scaled[base], self.change.scaled[base + n]) = (q[0], q[1]);
        }
        self.change.rigid_motion.fill([0.0; 3]);
        self.change.mode_amplitudes.iter_mut().for_each(|floating| floating.fill(0.0));
        for (free, amount) in self.free.iter().zip(&x[self.tractions..]) {
            add_motion(self.change, free.end, &free.motion, amount * self.motion_unit);
        }
    }

    /// Computes the rows of the equations from `self.change`, which must be evaluated.
    fn gather(&self, x: &[f64], rows: &mut [f64]) {
        let n = self.problem.n();
        let gradient = &self.change.gradient;
        for active in &self.active {
            let base = active.end * 3 * n + active.cell;
            if let Some(k) = active.pressure_row {
                rows[k] = self.problem.scales.c_normal[active.cell] * gradient[base + 2 * n];
            }
            let slip = [gradient[base], gradient[base + n]];
            match active.state {
                CellStatus::PressureOnly | CellStatus::PrescribedSlip { .. } => {}
                CellStatus::Stick => {
                    let c = self.problem.scales.c_tangential[active.cell];
                    (rows[active.tangential_row], rows[active.tangential_row + 1]) =
                        (c * slip[0], c * slip[1]);
                }
                CellStatus::Slip { direction, beta_ratio, .. } => {
                    let c = self.problem.scales.c_tangential[active.cell];
                    let sideways = x.get(active.tangential_row).copied().unwrap_or(0.0);
                    rows[active.tangential_row] =
                        beta_ratio * sideways + c * product(perpendicular(direction), slip);
                }
            }
            if !x.is_empty() {
                let first = active.tangential_row;
                for (i, j, factor) in self.fixed_entries(active) {
                    rows[first + i] += factor * x[first + j];
                }
            }
        }
    }

    /// Entries (row, column, value) that are added to the tangential block of a cell along its fixed directions. They stand for the
    /// missing compliance, so that the equations determine the tractions. A state without slip along these directions stays a
    /// solution.
    pub(super) fn fixed_entries(
        &self,
        active: &ActiveCell,
    ) -> impl Iterator<Item = (usize, usize, f64)> + use<> {
        let fixed = self.problem.scales.fixed_directions.get(active.cell).copied().unwrap_or_default();
        let (size, block) = match active.state {
            CellStatus::PressureOnly | CellStatus::PrescribedSlip { .. } => (0, fixed),
            CellStatus::Stick => (2, FIXED_ENTRY * fixed),
            CellStatus::Slip { fixed_entry, .. } => (1, nalgebra::Matrix2::from_element(fixed_entry)),
        };
        (0..size).flat_map(move |i| (0..size).map(move |j| (i, j, block[(i, j)])))
    }

    /// Right-hand side of the step from the evaluated state `it`. It includes the known part of the step: open cells lose their
    /// tractions, and slipping cells move to their friction limit.
    pub fn rhs(&mut self, it: &ContactState) -> Vec<f64> {
        self.change.rigid_motion.fill([0.0; 3]);
        self.change.mode_amplitudes.iter_mut().for_each(|floating| floating.fill(0.0));
        self.apply_known_part(it);
        self.evaluate();
        let n = self.problem.n();
        let total: f64 = self.problem.areas.iter().sum();
        let mut rhs = vec![0.0; self.len()];
        self.gather(&[], &mut rhs);
        rhs.iter_mut().for_each(|row| *row = -*row);
        for active in &self.active {
            let base = active.end * 3 * n + active.cell;
            if let Some(k) = active.pressure_row {
                rhs[k] -= self.problem.scales.c_normal[active.cell] * it.gradient[base + 2 * n];
            }
            match active.state {
                CellStatus::PressureOnly | CellStatus::PrescribedSlip { .. } => {}
                CellStatus::Stick => {
                    let c = self.problem.scales.c_tangential[active.cell];
                    rhs[active.tangential_row] -= c * it.gradient[base];
                    rhs[active.tangential_row + 1] -= c * it.gradient[base + n];
                }
                CellStatus::Slip { direction, beta_ratio, .. } => {
                    // -e⊥·q̂ / β, with e the direction of the augmented traction and e⊥ perpendicular to e. Slip does not enter,
                    // because the augmented traction has no component along e⊥.
                    let q = [it.scaled[base], it.scaled[base + n]];
                    rhs[active.tangential_row] -= (1.0 + beta_ratio) * product(perpendicular(direction), q);
                }
            }
        }
        for (k, free) in self.free.iter().enumerate() {
            rhs[self.tractions + k] = free.work / total - self.work_everywhere(free, &it.scaled);
        }
        rhs
    }

    fn work_everywhere(&self, free: &FreeMotion, hatted: &[f64]) -> f64 {
        let n = self.problem.n();
        let total: f64 = self.problem.areas.iter().sum();
        let base = free.end * 3 * n;
        let after = |k: usize| hatted[k] + self.change.scaled[k];
        let sum: f64 = (0..n)
            .map(|cell| {
                let column = self.column(free, cell);
                let work: f64 = (0..3).map(|plane| column[plane] * after(base + plane * n + cell)).sum();
                self.problem.areas[cell] * work
            })
            .sum();
        sum / total
    }

    /// Writes the known part of the step into the tractions of `self.change`.
    fn apply_known_part(&mut self, it: &ContactState) {
        let n = self.problem.n();
        self.change.scaled.iter_mut().zip(&it.scaled).for_each(|(change, traction)| *change = -traction);
        if self.problem.pressures == Pressures::Given {
            self.change.scaled.chunks_exact_mut(3 * n).for_each(|planes| planes[2 * n..].fill(0.0));
        }
        for active in &self.active {
            let base = active.end * 3 * n + active.cell;
            let p = it.scaled[base + 2 * n];
            let q = [it.scaled[base], it.scaled[base + n]];
            let tangential = match active.state {
                CellStatus::PressureOnly | CellStatus::Stick => [0.0; 2],
                CellStatus::Slip { direction, .. } => {
                    let missing = p - product(direction, q);
                    direction.map(|e| missing * e)
                }
                CellStatus::PrescribedSlip { direction } => {
                    [p * direction[0] - q[0], p * direction[1] - q[1]]
                }
            };
            self.change.scaled[base + 2 * n] = 0.0;
            (self.change.scaled[base], self.change.scaled[base + n]) = (tangential[0], tangential[1]);
        }
    }

    /// Adds the smallest change to the unknown tractions `x` after which the tractions do the prescribed works to
    /// rounding.
    pub fn restore_prescribed_forces(&self, rhs: &[f64], x: &mut [f64]) {
        self.bordered.restore_work(&rhs[self.tractions..], &mut x[..self.tractions]);
    }

    /// Adds the step with the unknowns `x` to the state `it`.
    pub fn advance(&mut self, x: &[f64], it: &mut ContactState) {
        self.apply_known_part(it);
        it.scaled.iter_mut().zip(&self.change.scaled).for_each(|(traction, change)| *traction += change);
        self.spread(x);
        it.scaled.iter_mut().zip(&self.change.scaled).for_each(|(traction, change)| *traction += change);
        for (free, amount) in self.free.iter().zip(&x[self.tractions..]) {
            add_motion(it, free.end, &free.motion, amount * self.motion_unit);
        }
    }

    /// Computes approximate tractions `x` for the equations `rows` of the tractions, with zero rigid motions.
    fn solve_tractions(&mut self, rows: &[f64], x: &mut [f64]) {
        if self.patches.is_empty() || !patches::solve(&self.patches, rows, x) {
            self.inverse.apply(self.problem, &self.active, rows, x);
        }
    }

    /// Computes the Schur complement of the free motions, for the preconditioner.
    pub(super) fn update_border(&mut self) {
        let (mut columns, mut constraints) = (Vec::new(), Vec::new());
        for (rows, work) in self.border_vectors(Rows::OwnPathPoint) {
            let mut solved = vec![0.0; self.tractions];
            self.solve_tractions(&rows, &mut solved);
            columns.push(solved);
            constraints.push(work);
        }
        self.bordered = MotionSchurComplement::new(columns, constraints);
    }

    /// Column and row of the border for each free motion. The column contains the values of the rows `which` per unit
    /// of the motion. The row contains the work of a unit of each traction, divided by the total cell area.
    pub(super) fn border_vectors(&self, which: Rows) -> Vec<(Vec<f64>, Vec<f64>)> {
        let total: f64 = self.problem.areas.iter().sum();
        let vectors = |free: &FreeMotion| {
            let (mut rows, mut work) = (vec![0.0; self.tractions], vec![0.0; self.tractions]);
            for active in &self.active {
                let [x, y, normal] = self.column(free, active.cell);
                let same = active.end == free.end;
                let share = if same { self.problem.areas[active.cell] / total } else { 0.0 };
                if let (true, Some(k)) = (same, active.pressure_row) {
                    rows[k] = self.problem.scales.c_normal[active.cell] * normal * self.motion_unit;
                    work[k] = share * normal;
                }
                let (first, tangential) = (active.tangential_row, [x, y]);
                if let (
                    CellStatus::Slip { direction, .. } | CellStatus::PrescribedSlip { direction },
                    Some(k),
                ) = (active.state, active.pressure_row)
                {
                    work[k] += share * product(direction, tangential);
                }
                let axes: &[[f64; 2]] = match active.state {
                    CellStatus::PressureOnly | CellStatus::PrescribedSlip { .. } => &[],
                    CellStatus::Stick => &[[1.0, 0.0], [0.0, 1.0]],
                    CellStatus::Slip { direction, .. } => &[perpendicular(direction)],
                };
                let factor = match (which, same) {
                    (Rows::All, _) => self.slip_factor(active, free.end),
                    (Rows::OwnPathPoint, true) => 1.0,
                    (Rows::OwnPathPoint, false) => 0.0,
                };
                let c = factor
                    * self.problem.scales.c_tangential.get(active.cell).copied().unwrap_or(0.0)
                    * self.motion_unit;
                let moved = if !same && self.drifts(active, free.end) {
                    let mut motion = free.motion;
                    (motion[0], motion[1]) = (0.0, 0.0);
                    let [x, y, _] = self.column(&FreeMotion { motion, ..*free }, active.cell);
                    [x, y]
                } else {
                    tangential
                };
                for (k, axis) in axes.iter().enumerate() {
                    rows[first + k] = c * product(*axis, moved);
                    work[first + k] = share * product(*axis, tangential);
                }
            }
            (rows, work)
        };
        self.free.iter().map(vectors).collect()
    }

    /// Returns whether the slip of cell `to` does not depend on the translation at the path point `from`, because this
    /// point drifts.
    fn drifts(&self, to: &ActiveCell, from: usize) -> bool {
        let reference = &self.problem.path_points[to.end].reference;
        from == 0
            && self.problem.previous_path_point(to.end) == 0
            && matches!(reference, SlipReference::PreviousPoint { origin: Some(_), .. })
    }

    /// Derivative of the slip of cell `to` with respect to its tangential gap at the path point `from`. In a cycle,
    /// slip is a difference of the gaps of two path points.
    pub(super) fn slip_factor(&self, to: &ActiveCell, from: usize) -> f64 {
        let same = if to.end == from { 1.0 } else { 0.0 };
        match &self.problem.path_points[to.end].reference {
            SlipReference::PreviousPoint { stick_mask, .. }
                if !stick_mask[to.cell] && self.problem.previous_path_point(to.end) == from =>
            {
                same - 1.0
            }
            _ => same,
        }
    }

    /// Whether the system is factorised. Steps are then exact, and tractions need not be admissible between steps.
    pub fn is_factorised(&self) -> bool {
        self.factors.is_some()
    }
}

impl LinearSystem for NewtonSystem<'_, '_> {
    fn apply(&mut self, x: &[f64], image: &mut [f64]) {
        self.spread(x);
        self.evaluate();
        self.gather(x, image);
        let works = self.bordered.works(&x[..self.tractions]);
        image[self.tractions..].iter_mut().zip(works).for_each(|(row, work)| *row = work);
    }

    fn precondition(&mut self, image: &[f64], x: &mut [f64]) {
        if let Some(factors) = &self.factors {
            let mut column = DenseMatrix::from_values(image.len(), 1, image.to_vec());
            // With several threads, the rounding errors of the sums would depend on the number of threads.
            if factors.solve_in_place(&mut column, Par::Seq).is_ok() {
                x.copy_from_slice(column.values());
                return;
            }
        }
        let (rows, motions) = image.split_at(self.tractions);
        let (tractions, amounts) = x.split_at_mut(self.tractions);
        self.solve_tractions(rows, tractions);
        self.bordered.eliminate_motions(motions, tractions, amounts);
    }
}

fn add_motion(it: &mut ContactState, end: usize, motion: &RigidMotion, amount: f64) {
    it.rigid_motion[end].iter_mut().zip(motion).for_each(|(r, m)| *r += amount * m);
    it.mode_amplitudes[end].iter_mut().zip(&motion[3..]).for_each(|(f, m)| *f += amount * m);
}
