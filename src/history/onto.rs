//! A state carried over to other operators: those of a frame with more cells, where contact has outgrown the one that it was found
//! on, or of bodies that have changed under it.

use super::model::{Model, Prepared, first_touch};
use super::snapshot::{Snapshot, Within};
use super::state::State;
use super::step::Step;
use crate::contact::Iterate;
use crate::contact::balance::FLOATING;
use crate::error::{Error, Result};
use crate::frame::grid::spread;

use super::cycling::{Cycling, Way};

/// What the gap of a state came from besides its elastic part.
#[derive(Debug, Clone)]
pub struct Before {
    /// Initial gap, `[3, N]` by planes, mm.
    pub initial_gap: Vec<f64>,
    /// Gap per unit of each motion in which the bodies floated, `[3, N]`.
    pub floating: Vec<Vec<f64>>,
}

impl Before {
    /// That of a state on `model`.
    pub fn of(model: &Model) -> Self {
        let motions = model.floating.iter().flat_map(|body| &body.motions);
        Self {
            initial_gap: model.initial_gap.clone(),
            floating: motions.map(|motion| motion.gap.clone()).collect(),
        }
    }

    /// The tangential gap of tractions under which the bodies deform by `elastic`, `[2, N]`, without the motion of body 2 that
    /// does not depend on the bodies.
    fn tangential_gap(&self, elastic: &[f64], floating: &[f64; FLOATING]) -> Vec<f64> {
        let gap = |k: usize| {
            let moved = self.floating.iter().zip(floating).map(|(motion, amount)| amount * motion[k]);
            moved.fold(self.initial_gap[k] + elastic[k], |sum, by| sum + by)
        };
        (0..2 * elastic.len() / 3).map(gap).collect()
    }

    fn fits(&self, n: usize) -> bool {
        std::iter::once(&self.initial_gap).chain(&self.floating).all(|gap| gap.len() == 3 * n)
    }
}

impl Snapshot {
    /// The same state with the operators of `model`; `places`: the number of each cell there, `[N]`. `before`: where the
    /// bodies have changed, what the gap of the state came from.
    ///
    /// Tractions and depths stay, bit by bit. On bodies that are the same so do elastic displacement and gap; where they have
    /// changed, the elastic displacement is that of the tractions on the new ones, and what slip is measured from moves with it, so that
    /// no cell slips. Cells that are new are unworn and carry nothing; slip will be measured from the tangential gap that they have.
    ///
    /// # Errors
    /// If the state is within a step of increments, the frames do not belong together, or a body cannot be solved.
    pub fn onto(
        self,
        places: &[usize],
        model: &Model,
        steps: &[Step],
        before: Option<&Before>,
    ) -> Result<Self> {
        let prepared = Prepared::new(model, steps)?;
        let n = prepared.n();
        let misfit = places.len() != self.n_cells() || places.iter().any(|&place| place >= n);
        let larger = n > places.len();
        if misfit
            || before.is_some_and(|before| !before.fits(places.len()))
            || (larger && !model.frame.is_level())
        {
            return Err(Error::input("the state to go on from does not belong to this frame"));
        }
        let formed: Vec<Vec<usize>> =
            self.formed.iter().map(|cells| cells.iter().map(|&cell| places[cell]).collect()).collect();
        for cells in &formed {
            prepared.form(cells)?;
        }
        let onto = Onto { places, prepared: &prepared, before };
        let (state, change) = onto.state(self.state)?;
        let within = match self.within {
            Within::Start => Within::Start,
            Within::Cycles(cycling) => {
                Within::Cycles(Box::new(onto.cycling(*cycling, &state.reference, change.as_ref())))
            }
            Within::Increments(_) => {
                return Err(Error::input(
                    "a run within a step of increments does not go on with other operators",
                ));
            }
        };
        Ok(Self { within, state, formed, ..self })
    }
}

/// Where a state goes.
struct Onto<'a> {
    places: &'a [usize],
    prepared: &'a Prepared<'a>,
    before: Option<&'a Before>,
}

/// What changes with the bodies.
struct Change {
    /// Tangential gap, in the cells so far, `[2, N]`.
    gap: Vec<f64>,
    /// Approach at which the first cell closes.
    touch: f64,
}

impl Onto<'_> {
    fn state(&self, state: State) -> Result<(State, Option<Change>)> {
        let Self { places, prepared, before } = *self;
        let (n, n_before) = (prepared.n(), places.len());
        let tractions = spread(&state.tractions, places, n, |_| 0.0);
        let mut elastic = vec![0.0; 3 * n];
        let operator = prepared.model.flexibility.as_ref();
        operator.apply(&tractions, &mut elastic);
        operator.complete(&tractions, &mut elastic)?;
        let change = before.map(|before| {
            let was = before.tangential_gap(&state.elastic, &state.floating);
            let is = Before::of(prepared.model).tangential_gap(&elastic, &state.floating);
            let changed = |k: usize| is[(k / n_before) * n + places[k % n_before]] - was[k];
            Change {
                gap: (0..2 * n_before).map(changed).collect(),
                touch: prepared.first_touch
                    - first_touch(prepared.model.frame.is_level(), &before.initial_gap[2 * n_before..]),
            }
        });
        let gap = |k: usize| {
            let mut gap = prepared.initial_gap[k] + state.rigid[k / n] + elastic[k];
            for (motion, amount) in prepared.floating_gaps.iter().zip(&state.floating) {
                gap += amount * motion[k];
            }
            gap
        };
        let mut reference = state.reference;
        let mut rigid = state.rigid;
        if let Some(change) = &change {
            reference.iter_mut().zip(&change.gap).for_each(|(reference, by)| *reference += by);
            rigid[2] += change.touch;
        }
        let reference = spread(&reference, places, n, gap);
        if change.is_none() {
            elastic = spread(&state.elastic, places, n, |k| elastic[k]);
        }
        let state = State {
            reference,
            elastic,
            worn: spread(&state.worn, places, n, |_| 0.0),
            depth_errors: spread(&state.depth_errors, places, n, |_| 0.0),
            tractions,
            rigid,
            ..state
        };
        Ok((state, change))
    }

    /// A step in progress; `reference`: tangential gap with the new operators, `[2, N]`.
    fn cycling(&self, mut cycling: Cycling, reference: &[f64], change: Option<&Change>) -> Cycling {
        let (n, places) = (self.prepared.n(), self.places);
        let ring = &mut cycling.ring;
        let mut it = Iterate::new(n, ring.it.rigid.clone());
        it.hatted = spread(&ring.it.hatted, places, n, |_| 0.0);
        it.floating.clone_from(&ring.it.floating);
        ring.it = it;
        ring.stuck = spread(&ring.stuck, places, n, |_| false);
        if let Some(change) = change {
            ring.at.iter_mut().zip(&change.gap).for_each(|(at, by)| *at += by);
            ring.it.rigid.iter_mut().for_each(|rigid| rigid[2] += change.touch);
            cycling.path = cycling.path.touching_later(change.touch);
            cycling.stale = true;
        }
        ring.at = spread(&ring.at, places, n, |k| reference[k]);
        cycling.rate = spread(&cycling.rate, places, n, |_| 0.0);
        cycling.resolved = cycling.resolved.map(|resolved| resolved.onto(places, n));
        if let (Way::Along(slip), true) = (&mut cycling.way, n > places.len()) {
            // The same everywhere, for the frame is level.
            let along = [slip[0], slip[places.len()]];
            *slip = spread(slip, places, n, |k| along[k / n]);
        }
        cycling
    }
}
