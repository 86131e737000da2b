//! A state carried over to a frame with more cells, where contact has outgrown the one that it was found on.

use super::model::{Model, Prepared};
use super::snapshot::{Snapshot, Within};
use super::state::State;
use super::step::Step;
use crate::contact::Iterate;
use crate::error::{Error, Result};
use crate::frame::grid::spread;

use super::cycling::{Cycling, Way};

impl Snapshot {
    /// The same state on the larger frame of `model`; `places`: the number of each cell there, `[N]`.
    ///
    /// The cells so far keep what they have bit by bit. The others are unworn and carry nothing; their elastic displacement is that
    /// of the tractions, and slip will be measured from the tangential gap that they have.
    ///
    /// # Errors
    /// If the state is within a step of increments, the frames do not belong together, or a body cannot be solved.
    pub fn onto(self, places: &[usize], model: &Model, steps: &[Step]) -> Result<Self> {
        let prepared = Prepared::new(model, steps)?;
        let n = prepared.n();
        let misfit = places.len() != self.n_cells() || places.iter().any(|&place| place >= n);
        if misfit || !model.frame.is_level() {
            return Err(Error::input("the state to go on from does not belong to this frame"));
        }
        let formed: Vec<Vec<usize>> =
            self.formed.iter().map(|cells| cells.iter().map(|&cell| places[cell]).collect()).collect();
        for cells in &formed {
            prepared.form(cells)?;
        }
        let state = onto_state(self.state, places, &prepared)?;
        let within = match self.within {
            Within::Start => Within::Start,
            Within::Cycles(cycling) => {
                Within::Cycles(Box::new(onto_cycling(*cycling, places, &state.reference)))
            }
            Within::Increments(_) => {
                return Err(Error::input(
                    "a run within a step of increments does not go on with a larger frame",
                ));
            }
        };
        Ok(Self { within, state, formed, ..self })
    }
}

fn onto_state(state: State, places: &[usize], prepared: &Prepared) -> Result<State> {
    let n = prepared.n();
    let tractions = spread(&state.tractions, places, n, |_| 0.0);
    let mut elastic = vec![0.0; 3 * n];
    let operator = prepared.model.flexibility.as_ref();
    operator.apply(&tractions, &mut elastic);
    operator.complete(&tractions, &mut elastic)?;
    let tangential_gap = |k: usize| {
        let mut gap = prepared.initial_gap[k] + state.rigid[k / n] + elastic[k];
        for (motion, amount) in prepared.floating_gaps.iter().zip(&state.floating) {
            gap += amount * motion[k];
        }
        gap
    };
    let reference = spread(&state.reference, places, n, tangential_gap);
    Ok(State {
        reference,
        elastic: spread(&state.elastic, places, n, |k| elastic[k]),
        worn: spread(&state.worn, places, n, |_| 0.0),
        depth_errors: spread(&state.depth_errors, places, n, |_| 0.0),
        tractions,
        ..state
    })
}

/// A step in progress; `reference`: tangential gap on the larger frame, `[2, N]`.
fn onto_cycling(mut cycling: Cycling, places: &[usize], reference: &[f64]) -> Cycling {
    let n = reference.len() / 2;
    let ring = &mut cycling.ring;
    let mut it = Iterate::new(n, ring.it.rigid.clone());
    it.hatted = spread(&ring.it.hatted, places, n, |_| 0.0);
    it.floating.clone_from(&ring.it.floating);
    ring.it = it;
    ring.stuck = spread(&ring.stuck, places, n, |_| false);
    ring.at = spread(&ring.at, places, n, |k| reference[k]);
    cycling.rate = spread(&cycling.rate, places, n, |_| 0.0);
    if let Way::Along(slip) = &mut cycling.way {
        // The same everywhere, for the frame is level.
        let along = [slip[0], slip[places.len()]];
        *slip = spread(slip, places, n, |k| along[k / n]);
    }
    cycling
}
