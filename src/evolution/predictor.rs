//! Initial guess of an increment: linear extrapolation of the last two states.

use serde::{Deserialize, Serialize};

use crate::contact::balance::MAX_RIGID_MODES;
use crate::contact::{ContactState, Increment};
use crate::evolution::state::RunState;

#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Predictor {
    /// Tractions `[3, N]` and motions at the start of the previous increment.
    previous_start: Option<(Vec<f64>, [f64; 3], [f64; MAX_RIGID_MODES])>,
}

fn beyond(now: f64, before: f64) -> f64 {
    2.0 * now - before
}

impl Predictor {
    pub fn note(&mut self, state: &RunState) {
        let (rigid, floating) = (state.rigid_motion, state.mode_amplitudes);
        match &mut self.previous_start {
            Some(before) => {
                before.0.copy_from_slice(&state.tractions);
                (before.1, before.2) = (rigid, floating);
            }
            None => self.previous_start = Some((state.tractions.clone(), rigid, floating)),
        }
    }

    pub fn motions(&self, state: &RunState) -> ([f64; 3], [f64; MAX_RIGID_MODES]) {
        let Some((_, rigid, floating)) = &self.previous_start else {
            return (state.rigid_motion, state.mode_amplitudes);
        };
        (
            std::array::from_fn(|k| beyond(state.rigid_motion[k], rigid[k])),
            std::array::from_fn(|k| beyond(state.mode_amplitudes[k], floating[k])),
        )
    }

    /// Stores in `it` the initial guess of the scaled tractions for the next increment. Projects extrapolated tractions
    /// onto the friction cone.
    pub fn extrapolate_tractions(&self, state: &RunState, problem: &Increment, it: &mut ContactState) {
        let Some((before, ..)) = &self.previous_start else {
            problem.scale_tractions(&state.tractions, &mut it.scaled);
            return;
        };
        let tractions = state.tractions.iter().zip(before);
        it.tractions.iter_mut().zip(tractions).for_each(|(out, (now, before))| *out = beyond(*now, *before));
        problem.scale_tractions(&it.tractions, &mut it.scaled);
        it.project_to_cone();
    }
}
