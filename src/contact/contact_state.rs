//! State of a contact increment: unknowns and the fields derived from them.

use serde::{Deserialize, Serialize};

use super::balance::MAX_RIGID_MODES;

/// Relative margin of the stick condition |q|_μ < p (1 - margin). |q|_μ is the magnitude of the scaled tangential traction.
const STICK_MARGIN: f64 = 1e-6;

/// Unknowns of a contact increment.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Unknowns {
    /// Scaled tractions, `[3, N]` per path point, MPa.
    pub scaled: Vec<f64>,
    /// Rigid motion of body 2 along the frame's (x, y, n), per path point, mm.
    pub rigid_motion: Vec<[f64; 3]>,
    /// Amplitude of each additional rigid mode, per path point; zero beyond the number of modes.
    pub mode_amplitudes: Vec<[f64; MAX_RIGID_MODES]>,
}

impl Unknowns {
    /// Copies the unknowns of a state.
    pub fn from_state(it: &ContactState) -> Self {
        Self {
            scaled: it.scaled.clone(),
            rigid_motion: it.rigid_motion.clone(),
            mode_amplitudes: it.mode_amplitudes.clone(),
        }
    }

    /// Copies the unknowns of a state of the same size into `self`.
    pub fn copy_from(&mut self, it: &ContactState) {
        self.scaled.copy_from_slice(&it.scaled);
        self.rigid_motion.copy_from_slice(&it.rigid_motion);
        self.mode_amplitudes.copy_from_slice(&it.mode_amplitudes);
    }

    /// Copies the unknowns into a state of the same size. The state must be evaluated afterwards.
    pub fn restore_into(&self, it: &mut ContactState) {
        it.scaled.copy_from_slice(&self.scaled);
        it.rigid_motion.copy_from_slice(&self.rigid_motion);
        it.mode_amplitudes.copy_from_slice(&self.mode_amplitudes);
    }
}

/// Tractions, rigid motions and the fields derived from them.
#[derive(Debug, Clone)]
pub struct ContactState {
    /// Scaled tractions, `[3, N]` per path point, MPa.
    pub scaled: Vec<f64>,
    /// Rigid motion of body 2 along the frame's (x, y, n), per path point, mm.
    pub rigid_motion: Vec<[f64; 3]>,
    /// Amplitude of each additional rigid mode, per path point.
    pub mode_amplitudes: Vec<[f64; MAX_RIGID_MODES]>,
    /// Physical tractions, `[3, N]` per path point, MPa.
    pub tractions: Vec<f64>,
    /// Elastic displacement S P, `[3, N]` per path point, mm. Without friction the solver may omit the tangential components.
    pub elastic: Vec<f64>,
    /// Gap including rigid motion and wear, `[3, N]` per path point, mm.
    pub gap: Vec<f64>,
    /// Slip, `[2, N]` per path point, mm.
    pub slip: Vec<f64>,
    /// Derivative of the wear depth of a pass with respect to the pressure at each path point, `[N]` per path point, mm/MPa. Wear
    /// adds `implicit_passes` times this derivative to the diagonal of S_nn.
    pub wear_per_pressure: Vec<f64>,
    /// Wear depth of one pass through the path points, `[N]`, mm.
    pub wear_per_pass: Vec<f64>,
    /// Scaled slip and normal gap, `[3, N]` per path point, mm.
    pub gradient: Vec<f64>,
}

impl From<&Unknowns> for ContactState {
    /// State with these unknowns. It must be evaluated afterwards.
    fn from(unknowns: &Unknowns) -> Self {
        let ends = unknowns.rigid_motion.len();
        let mut it = Self::new(unknowns.scaled.len() / (3 * ends), unknowns.rigid_motion.clone());
        unknowns.restore_into(&mut it);
        it
    }
}

impl From<ContactState> for Unknowns {
    fn from(it: ContactState) -> Self {
        Self { scaled: it.scaled, rigid_motion: it.rigid_motion, mode_amplitudes: it.mode_amplitudes }
    }
}

impl ContactState {
    /// State with zero tractions and given rigid motions, one per path point.
    pub fn new(n: usize, rigid_motion: Vec<[f64; 3]>) -> Self {
        let ends = rigid_motion.len();
        let zeros = || vec![0.0; 3 * n * ends];
        Self {
            scaled: zeros(),
            rigid_motion,
            mode_amplitudes: vec![[0.0; MAX_RIGID_MODES]; ends],
            tractions: zeros(),
            elastic: zeros(),
            gap: zeros(),
            slip: vec![0.0; 2 * n * ends],
            wear_per_pressure: vec![0.0; n * ends],
            wear_per_pass: vec![0.0; n],
            gradient: zeros(),
        }
    }

    /// Copies the unknowns of `other`. The state must be evaluated afterwards.
    pub(crate) fn copy_unknowns(&mut self, other: &Self) {
        self.scaled.copy_from_slice(&other.scaled);
        self.rigid_motion.copy_from_slice(&other.rigid_motion);
        self.mode_amplitudes.copy_from_slice(&other.mode_amplitudes);
    }

    /// Halves the step from `start`: every unknown becomes the mean of its value in `start` and its present value.
    /// Admissible tractions stay admissible, because the admissible set is convex. The state must be evaluated
    /// afterwards.
    pub(crate) fn halve_step(&mut self, start: &Self) {
        let halve = |(from, to): (&f64, &mut f64)| *to = from + 0.5 * (*to - from);
        start.scaled.iter().zip(&mut self.scaled).for_each(halve);
        start.rigid_motion.iter().flatten().zip(self.rigid_motion.iter_mut().flatten()).for_each(halve);
        start.mode_amplitudes.iter().flatten().zip(self.mode_amplitudes.iter_mut().flatten()).for_each(halve);
    }

    /// Returns whether cell `i` carries pressure and |q̂| < p (1 - 1e-6). With friction, this cell sticks.
    pub(super) fn is_inside_cone(&self, end: usize, i: usize) -> bool {
        let n = self.wear_per_pass.len();
        let planes = &self.scaled[end * 3 * n..];
        let p = planes[2 * n + i];
        p > 0.0 && planes[i].hypot(planes[n + i]) < p * (1.0 - STICK_MARGIN)
    }

    /// Whether any cell carries pressure at any path point.
    pub fn has_contact(&self) -> bool {
        let n = self.wear_per_pass.len();
        self.scaled.chunks_exact(3 * n).any(|planes| planes[2 * n..].iter().any(|p| *p > 0.0))
    }

    /// Returns whether cell `i` slips or carries no pressure at any path point, for a problem with friction.
    pub fn slips(&self, i: usize) -> bool {
        (0..self.rigid_motion.len()).any(|end| !self.is_inside_cone(end, i))
    }

    /// Projects the scaled tractions onto p >= 0 and |q̂| <= p, by radial return.
    pub(crate) fn project_to_cone(&mut self) {
        let n = self.wear_per_pass.len();
        for planes in self.scaled.chunks_exact_mut(3 * n) {
            let (tangential, pressures) = planes.split_at_mut(2 * n);
            let (first, second) = tangential.split_at_mut(n);
            for ((a, b), p) in first.iter_mut().zip(second).zip(pressures) {
                *p = p.max(0.0);
                let size = (*a * *a + *b * *b).sqrt();
                if size > *p {
                    (*a, *b) = (*a * *p / size, *b * *p / size);
                }
            }
        }
    }
}
