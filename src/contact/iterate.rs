//! The state of an increment that is being solved.

use serde::{Deserialize, Serialize};

use super::balance::FLOATING;

/// What all of a state follows from.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Unknowns {
    hatted: Vec<f64>,
    rigid: Vec<[f64; 3]>,
    floating: Vec<[f64; FLOATING]>,
}

impl Unknowns {
    /// Those of a state.
    pub fn of(it: &Iterate) -> Self {
        Self { hatted: it.hatted.clone(), rigid: it.rigid.clone(), floating: it.floating.clone() }
    }

    /// Takes those of a state of the same size.
    pub fn take(&mut self, it: &Iterate) {
        self.hatted.copy_from_slice(&it.hatted);
        self.rigid.copy_from_slice(&it.rigid);
        self.floating.copy_from_slice(&it.floating);
    }

    /// Puts them into a state of the same size, which has to be evaluated then.
    pub fn put(&self, it: &mut Iterate) {
        it.hatted.copy_from_slice(&self.hatted);
        it.rigid.copy_from_slice(&self.rigid);
        it.floating.copy_from_slice(&self.floating);
    }
}

/// Tractions and what follows from them; the buffers are made once and reused.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(from = "Unknowns", into = "Unknowns")]
pub struct Iterate {
    /// Hatted tractions, per end `[3, N]`.
    pub hatted: Vec<f64>,
    /// Rigid motion of body 2 along the frame's (x, y, n), per end.
    pub rigid: Vec<[f64; 3]>,
    /// Amount of each further motion, per end; zero beyond their number.
    pub floating: Vec<[f64; FLOATING]>,
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
    /// Depth worn by the slip of one pass through the ends, `[N]`, mm (not yet times `repeats`).
    pub wear_rate: Vec<f64>,
    /// Hatted slip and normal gap, per end `[3, N]`.
    pub gradient: Vec<f64>,
}

impl From<Unknowns> for Iterate {
    /// A state that has to be evaluated.
    fn from(unknowns: Unknowns) -> Self {
        let ends = unknowns.rigid.len();
        let mut it = Self::new(unknowns.hatted.len() / (3 * ends), unknowns.rigid.clone());
        unknowns.put(&mut it);
        it
    }
}

impl From<Iterate> for Unknowns {
    fn from(it: Iterate) -> Self {
        Self { hatted: it.hatted, rigid: it.rigid, floating: it.floating }
    }
}

impl Iterate {
    /// Zero tractions with given rigid motions, one per end.
    pub fn new(n: usize, rigid: Vec<[f64; 3]>) -> Self {
        let ends = rigid.len();
        let zeros = || vec![0.0; 3 * n * ends];
        Self {
            hatted: zeros(),
            rigid,
            floating: vec![[0.0; FLOATING]; ends],
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
    pub(crate) fn follow(&mut self, other: &Self) {
        self.hatted.copy_from_slice(&other.hatted);
        self.rigid.copy_from_slice(&other.rigid);
        self.floating.copy_from_slice(&other.floating);
    }

    /// Cuts the hatted tractions to p >= 0 and |q̂| <= p.
    pub(crate) fn cut(&mut self) {
        let n = self.wear_rate.len();
        for planes in self.hatted.chunks_exact_mut(3 * n) {
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
