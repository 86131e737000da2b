//! Slip between the path points of a coupled cycle.

use crate::contact::{ContactState, Increment};
use crate::evolution::fretting::cycle_state::CycleState;
use crate::evolution::fretting::path_correction::CycleSlip;
use crate::evolution::fretting::settings::REFINEMENT;
use crate::evolution::run::Run;

impl Run<'_> {
    /// Evaluates the slip of `cycle` between its path points. The contact state of `cycle` must have been evaluated
    /// with `problem`.
    pub(super) fn cycle_slip(&self, problem: &Increment, cycle: &CycleState) -> CycleSlip {
        let (it, n, areas) = (&cycle.contact, self.prepared.n(), &self.prepared.model.frame.areas);
        let points = it.rigid_motion.len();
        let mut found = CycleSlip { full_slip: true, slip_spread_share: 0.0, lag: 0.0 };
        let (mut lags, mut slips) = (0.0, 0.0);
        for point in 0..points {
            let before = (point + points - 1) % points;
            let mut from = it.rigid_motion[before];
            if let (0, true, Some(origin)) = (before, cycle.stick_zone.may_drift(), cycle.stick_zone.origin) {
                from[..2].copy_from_slice(&origin);
            }
            let moved = [0, 1, 2].map(|k| it.rigid_motion[point][k] - from[k]);
            let turned =
                std::array::from_fn(|k| it.mode_amplitudes[point][k] - it.mode_amplitudes[before][k]);
            let [x, y, _] = self.prepared.motion(&moved, &turned);
            let stroke = x.hypot(y);
            for i in (0..n).filter(|i| it.tractions[point * 3 * n + 2 * n + i] > 0.0) {
                let motion = problem.rigid_gap(i, moved, &turned);
                let slip = [it.slip[point * 2 * n + i], it.slip[point * 2 * n + n + i]];
                let lag = (motion[0] - slip[0]).hypot(motion[1] - slip[1]);
                let force = areas[i] * it.tractions[point * 3 * n + 2 * n + i];
                lags += force * lag;
                slips += force * slip[0].hypot(slip[1]);
                found.full_slip &= !cycle.stick_zone.mask[i] && !problem.sticks(it, point, i);
                found.slip_spread_share =
                    f64::max(found.slip_spread_share, if stroke > 0.0 { lag / stroke } else { 1.0 });
            }
        }
        found.slip_spread_share = found.slip_spread_share.clamp(REFINEMENT.min_slip_spread_share, 1.0);
        found.lag = if slips > 0.0 { lags / slips } else { f64::INFINITY };
        found
    }

    /// Relative change of the slip between the path points since the slip `before`: root mean square over the cells in
    /// contact at any path point.
    pub(super) fn slip_change(&self, it: &ContactState, before: &[f64]) -> f64 {
        let n = self.prepared.n();
        let (touching, areas) = (self.cells_in_contact(&it.scaled), &self.prepared.model.frame.areas);
        let (mut change, mut sum) = (0.0, 0.0);
        for (k, (now, before)) in it.slip.iter().zip(before).enumerate().filter(|(k, _)| touching[k % n]) {
            change += areas[k % n] * (now - before).powi(2);
            sum += areas[k % n] * now * now;
        }
        if sum > 0.0 { (change / sum).sqrt() } else { 0.0 }
    }
}
