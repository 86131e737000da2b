//! Where an increment begins: the state before it, gone on as the increment before changed it.

use serde::{Deserialize, Serialize};

use crate::contact::balance::FLOATING;
use crate::contact::{Increment, Iterate};

use super::state::State;

/// What the increments of a step begin from. They are alike, so that the change of one is a good guess of that of the next.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Predictor {
    /// Tractions `[3, N]` and motions at the start of the increment before.
    before: Option<(Vec<f64>, [f64; 3], [f64; FLOATING])>,
}

/// `now` and as much more as it is from `before`.
fn beyond(now: f64, before: f64) -> f64 {
    2.0 * now - before
}

impl Predictor {
    /// Notes the state at the start of an increment.
    pub fn note(&mut self, state: &State) {
        let (rigid, floating) = (state.rigid, state.floating);
        match &mut self.before {
            Some(before) => {
                before.0.copy_from_slice(&state.tractions);
                (before.1, before.2) = (rigid, floating);
            }
            None => self.before = Some((state.tractions.clone(), rigid, floating)),
        }
    }

    /// Rigid motion and further motions that the next increment begins from.
    pub fn motions(&self, state: &State) -> ([f64; 3], [f64; FLOATING]) {
        let Some((_, rigid, floating)) = &self.before else { return (state.rigid, state.floating) };
        (
            std::array::from_fn(|k| beyond(state.rigid[k], rigid[k])),
            std::array::from_fn(|k| beyond(state.floating[k], floating[k])),
        )
    }

    /// Puts the tractions that the next increment begins from into `it`, cut to what friction admits.
    pub fn start(&self, state: &State, problem: &Increment, it: &mut Iterate) {
        let Some((before, ..)) = &self.before else {
            problem.hat_tractions(&state.tractions, &mut it.hatted);
            return;
        };
        let tractions = state.tractions.iter().zip(before);
        it.tractions.iter_mut().zip(tractions).for_each(|(out, (now, before))| *out = beyond(*now, *before));
        problem.hat_tractions(&it.tractions, &mut it.hatted);
        it.cut();
    }
}
