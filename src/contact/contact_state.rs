//! The state of an increment that is being solved.

use serde::{Deserialize, Serialize};

use super::balance::MAX_RIGID_MODES;

/// What all of a state follows from.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Unknowns {
    scaled: Vec<f64>,
    rigid_motion: Vec<[f64; 3]>,
    mode_amplitudes: Vec<[f64; MAX_RIGID_MODES]>,
}

impl Unknowns {
    /// Those of a state.
    pub fn from_state(it: &ContactState) -> Self {
        Self {
            scaled: it.scaled.clone(),
            rigid_motion: it.rigid_motion.clone(),
            mode_amplitudes: it.mode_amplitudes.clone(),
        }
    }

    /// Takes those of a state of the same size.
    pub fn copy_from(&mut self, it: &ContactState) {
        self.scaled.copy_from_slice(&it.scaled);
        self.rigid_motion.copy_from_slice(&it.rigid_motion);
        self.mode_amplitudes.copy_from_slice(&it.mode_amplitudes);
    }

    /// Puts them into a state of the same size, which has to be evaluated then.
    pub fn restore_into(&self, it: &mut ContactState) {
        it.scaled.copy_from_slice(&self.scaled);
        it.rigid_motion.copy_from_slice(&self.rigid_motion);
        it.mode_amplitudes.copy_from_slice(&self.mode_amplitudes);
    }
}

/// Tractions and what follows from them; the buffers are made once and reused.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(from = "Unknowns", into = "Unknowns")]
pub struct ContactState {
    /// Hatted tractions, per end `[3, N]`.
    pub scaled: Vec<f64>,
    /// Rigid motion of body 2 along the frame's (x, y, n), per end.
    pub rigid_motion: Vec<[f64; 3]>,
    /// Amount of each further motion, per end; zero beyond their number.
    pub mode_amplitudes: Vec<[f64; MAX_RIGID_MODES]>,
    /// Physical tractions, per end `[3, N]`, MPa.
    pub tractions: Vec<f64>,
    /// S P, per end `[3, N]`, mm (tangential planes are not computed without friction).
    pub elastic: Vec<f64>,
    /// Gap with rigid motion and wear, per end `[3, N]`, mm.
    pub gap: Vec<f64>,
    /// Slip, per end `[2, N]`, mm.
    pub slip: Vec<f64>,
    /// |Δg|_i of each end, `[N]` per end, mm/MPa: depth worn per pressure, the diagonal that wear adds to S_nn.
    pub wear_path: Vec<f64>,
    /// Depth worn by the slip of one pass through the ends, `[N]`, mm (not yet times `slip_repeats`).
    pub wear_rate: Vec<f64>,
    /// Hatted slip and normal gap, per end `[3, N]`.
    pub gradient: Vec<f64>,
}

impl From<Unknowns> for ContactState {
    /// A state that has to be evaluated.
    fn from(unknowns: Unknowns) -> Self {
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
    /// Zero tractions with given rigid motions, one per end.
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
            wear_path: vec![0.0; n * ends],
            wear_rate: vec![0.0; n],
            gradient: zeros(),
        }
    }

    /// Takes the unknowns of another state of the same size; it has to be evaluated then.
    pub(crate) fn copy_unknowns(&mut self, other: &Self) {
        self.scaled.copy_from_slice(&other.scaled);
        self.rigid_motion.copy_from_slice(&other.rigid_motion);
        self.mode_amplitudes.copy_from_slice(&other.mode_amplitudes);
    }

    /// Cuts the hatted tractions to p >= 0 and |q̂| <= p.
    pub(crate) fn project_to_cone(&mut self) {
        let n = self.wear_rate.len();
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
