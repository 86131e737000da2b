//! Approach of repeated cycles to the steady state.
//!
//! Tractions of sticking cells, and of cells that slip only in a part of a stroke, change from cycle to cycle. In
//! random scenes the changes decrease by only 2 to 20 % per cycle. Similar changes by two cycles form a geometric
//! series, which is extrapolated. The cycles after the extrapolation confirm or correct it.

use crate::evolution::fretting::cycle_increment::IncrementStart;
use crate::evolution::fretting::settings::SETTLING;

pub(super) struct Settling {
    may_drift: bool,
    /// Tangential gap at the + reversal point, `[2, N]`, mm. If body 2 may drift, the gap is relative to its position.
    gap: Vec<f64>,
    /// Position of body 2 along x, y, mm.
    position: [f64; 2],
    /// Change of the gap by the last cycle. `None` before the first cycle, and if the gap was extrapolated before the
    /// last cycle.
    change: Option<Vec<f64>>,
    /// Ratio of the changes of the gap by two successive cycles, where these changes were similar for the last time. It
    /// remains known in cycles with more increments.
    ratio: Option<f64>,
    /// Whether the changes by the last two cycles form a geometric series.
    is_series: bool,
    is_extrapolated: bool,
    /// Completed cycles.
    pub cycles: usize,
    /// Change of the position of body 2 by the last cycle along x, y, mm.
    pub body_drift: [f64; 2],
}

/// Ratio of two successive changes, both `[2, N]`. Only cells with `loaded` count. `None` if the directions of the
/// changes differ.
fn series_ratio(before: &[f64], now: &[f64], loaded: impl Fn(usize) -> bool) -> Option<f64> {
    let n = now.len() / 2;
    let dot = |a: &[f64], b: &[f64]| {
        let both = a.iter().zip(b).enumerate().filter(|(k, _)| loaded(k % n));
        both.map(|(_, (a, b))| a * b).sum::<f64>()
    };
    let (product, square) = (dot(before, now), dot(before, before));
    (product > SETTLING.min_cosine * (square * dot(now, now)).sqrt()).then(|| product / square)
}

impl Settling {
    pub fn new(may_drift: bool) -> Self {
        Self {
            may_drift,
            gap: Vec::new(),
            position: [0.0; 2],
            change: None,
            ratio: None,
            is_series: false,
            is_extrapolated: false,
            cycles: 0,
            body_drift: [0.0; 2],
        }
    }

    /// Begins with the state at the + reversal point before the first cycle.
    pub fn restart(&mut self, state: &IncrementStart) {
        let (gap, position) = self.gap_and_position(state);
        *self = Self { gap, position, ratio: self.ratio, ..Self::new(self.may_drift) };
    }

    fn gap_and_position(&self, state: &IncrementStart) -> (Vec<f64>, [f64; 2]) {
        let [x, y, _] = state.contact.rigid_motion[0];
        let origin = if self.may_drift { [x, y] } else { [0.0; 2] };
        let (along_x, along_y) = state.reference.split_at(state.reference.len() / 2);
        let both = along_x.iter().map(|gap| gap - origin[0]).chain(along_y.iter().map(|gap| gap - origin[1]));
        (both.collect(), [x, y])
    }

    /// Takes the state at the + reversal point after the next cycle.
    pub fn advance(&mut self, state: &IncrementStart) {
        let (gap, position) = self.gap_and_position(state);
        let change: Vec<f64> = gap.iter().zip(&self.gap).map(|(now, before)| now - before).collect();
        let pressures = &state.contact.scaled[gap.len()..];
        let loaded = |i: usize| pressures[i] > 0.0;
        let before = self.change.as_ref().filter(|_| !self.is_extrapolated);
        let ratio = before.and_then(|before| series_ratio(before, &change, loaded));
        self.is_series = ratio.is_some_and(|ratio| (SETTLING.min_ratio..1.0).contains(&ratio));
        self.ratio = ratio.or(self.ratio);
        self.change = (!self.is_extrapolated).then_some(change);
        self.body_drift = [0, 1].map(|k| position[k] - self.position[k]);
        (self.gap, self.position) = (gap, position);
        self.is_extrapolated = false;
        self.cycles += 1;
    }

    /// Whether the last cycle can be compared with the cycle before. After an extrapolation it cannot.
    pub fn is_comparable(&self) -> bool {
        self.change.is_some()
    }

    /// Estimated change over all further cycles, divided by the change by the last cycle.
    pub fn remaining_sum(&self) -> f64 {
        match self.ratio {
            None => SETTLING.unknown_remaining_sum,
            Some(ratio) if ratio < 1.0 => (ratio / (1.0 - ratio)).clamp(1.0, SETTLING.max_remaining_sum),
            Some(_) => SETTLING.max_remaining_sum,
        }
    }

    /// Extrapolates the tangential gap `gap` at the + reversal point, `[2, N]`, mm, to the steady state, if its changes
    /// form a geometric series.
    pub fn extrapolate(&mut self, gap: &mut [f64]) {
        let Some(change) = self.change.as_ref().filter(|_| self.is_series) else { return };
        // Without a second cycle after the extrapolation, the result would have no error estimate.
        if self.cycles + 2 > SETTLING.max_cycles {
            return;
        }
        let share = self.remaining_sum().min(SETTLING.max_extrapolation);
        gap.iter_mut().zip(change).for_each(|(gap, change)| *gap += share * change);
        self.is_extrapolated = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ContactState;

    const RATIO: f64 = 0.9;
    const LIMIT: [f64; 4] = [1.0, -2.0, 0.5, 3.0];

    /// State after `cycle` cycles. The gap is a geometric series plus the position of body 2.
    fn after(cycle: i32, drift: f64) -> IncrementStart {
        let position = drift * f64::from(cycle);
        let mut contact = ContactState::new(2, vec![[position, 0.0, 0.0]]);
        contact.scaled[4..].fill(1.0);
        let start = [0.4, 0.1, -0.3, 0.2];
        let gap = |k: usize| LIMIT[k] + start[k] * RATIO.powi(cycle) + if k < 2 { position } else { 0.0 };
        IncrementStart { reference: (0..4).map(gap).collect(), contact }
    }

    /// Truth: the limit of the geometric series g + a r^k is g, and its remaining change is r / (1 - r) of the last change. A
    /// drift of body 2 moves all gaps equally.
    #[test]
    fn a_geometric_series_is_extrapolated_to_its_limit() {
        for drift in [0.0, 0.7] {
            let mut settling = Settling::new(drift != 0.0);
            settling.restart(&after(0, drift));
            settling.advance(&after(1, drift));
            assert_eq!(settling.remaining_sum(), SETTLING.unknown_remaining_sum);
            let mut end = after(2, drift);
            settling.advance(&end);
            assert!((settling.remaining_sum() - RATIO / (1.0 - RATIO)).abs() < 1e-12);
            settling.extrapolate(&mut end.reference);
            for (k, limit) in LIMIT.into_iter().enumerate() {
                let wanted = limit + if k < 2 { 2.0 * drift } else { 0.0 };
                assert!((end.reference[k] - wanted).abs() < 1e-12, "{k}: {} {wanted}", end.reference[k]);
            }
            assert!(settling.is_comparable());
            settling.advance(&end);
            assert!(!settling.is_comparable());
        }
    }

    /// Truth: changes in different directions form no geometric series. A constant change has no limit, so its gap is
    /// not extrapolated.
    #[test]
    fn other_changes_are_not_extrapolated() {
        for now in [[-0.5, -0.5], [0.5, -0.5], [0.0, 0.0]] {
            assert_eq!(series_ratio(&[1.0, 1.0], &now, |_| true), None, "{now:?}");
        }
        assert_eq!(series_ratio(&[0.0, 0.0], &[0.0, 0.0], |_| true), None);
        let mut settling = Settling::new(false);
        settling.restart(&after(100, 0.7));
        settling.advance(&after(101, 0.7));
        let mut end = after(102, 0.7);
        settling.advance(&end);
        let before = end.reference.clone();
        settling.extrapolate(&mut end.reference);
        assert_eq!(end.reference, before);
        assert_eq!(settling.remaining_sum(), SETTLING.max_remaining_sum);
    }
}
