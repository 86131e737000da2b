//! Correction of the wear rates of coupled cycles (path points solved together).

use serde::{Deserialize, Serialize};

use crate::frame::grid::extend_field;

/// Correction r = f c + a of the wear c per coupled cycle. The factor f acts on the implicit wear of a jump. The added
/// wear a is the wear of cells that slip within a stroke, but little or not at all between the path points.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct RateCorrection {
    /// Factors f, `[N]`.
    pub factors: Vec<f64>,
    /// Added wear a per cycle, `[N]`, mm.
    pub added: Vec<f64>,
}

impl RateCorrection {
    /// Correction without effect for `n` cells: f = 1, a = 0.
    pub fn none(n: usize) -> Self {
        Self { factors: vec![1.0; n], added: vec![0.0; n] }
    }

    /// Interpolates linearly from this correction (`share` = 0) to the correction `end` (`share` = 1).
    pub(super) fn between(&self, end: &Self, share: f64) -> Self {
        let between = |from: &[f64], to: &[f64]| {
            from.iter().zip(to).map(|(from, to)| from + share * (to - from)).collect()
        };
        Self { factors: between(&self.factors, &end.factors), added: between(&self.added, &end.added) }
    }

    /// Wear of `passes` cycles with this correction minus the wear `worn` of these cycles with the correction `used`,
    /// `[N]`, mm.
    pub(super) fn missed_by(&self, used: &Self, worn: &[f64], passes: f64) -> Vec<f64> {
        let missed = |i: usize| {
            let coupled = (worn[i] - passes * used.added[i]) / used.factors[i];
            (self.factors[i] - used.factors[i]) * coupled + passes * (self.added[i] - used.added[i])
        };
        (0..worn.len()).map(missed).collect()
    }

    /// Transfers the correction to a larger frame of `n` cells. `places` contains the new index of each cell.
    pub fn transfer_to(&self, places: &[usize], n: usize) -> Self {
        Self {
            factors: extend_field(&self.factors, places, n, |_| 1.0),
            added: extend_field(&self.added, places, n, |_| 0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: N cycles with the coupled rates c wear w = N (f c + a). With another correction f', a' the wear differs
    /// by N ((f' - f) c + a' - a). Halfway between the two corrections it differs by half of this amount.
    #[test]
    fn missed_wear_is_the_difference() {
        let used = RateCorrection { factors: vec![0.5, 2.0], added: vec![0.0, 3.0] };
        let other = RateCorrection { factors: vec![0.75, 1.5], added: vec![0.25, 1.0] };
        let (passes, coupled) = (8.0, [4.0, 2.0]);
        let wear = |by: &RateCorrection, i: usize| passes * (by.factors[i] * coupled[i] + by.added[i]);
        let worn = [wear(&used, 0), wear(&used, 1)];
        let missed = other.missed_by(&used, &worn, passes);
        let half = used.between(&other, 0.5).missed_by(&used, &worn, passes);
        for i in 0..2 {
            assert_eq!(missed[i], wear(&other, i) - worn[i]);
            assert_eq!(2.0 * half[i], missed[i]);
        }
    }
}
