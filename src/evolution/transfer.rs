//! Transfer of a checkpoint to a frame with more cells, or to bodies that have changed.

use crate::error::{Error, Result};
use crate::evolution::checkpoint::{RunCheckpoint, StepProgress};
use crate::evolution::fretting::cycle_state::CycleUnknowns;
use crate::evolution::fretting::wear_step_state::{SlipSource, WearStepState};
use crate::evolution::model::{Model, PreparedModel, first_touch_approach};
use crate::evolution::state::RunState;
use crate::evolution::step::Step;
use crate::frame::grid::extend_field;

/// Gaps of the model with which a checkpoint was computed.
#[derive(Debug, Clone)]
pub struct PreviousModel {
    /// Initial gap, `[3, N]` by components, mm.
    pub initial_gap: Vec<f64>,
    /// Change of the gap by each load at amplitude 1, `[3, N]`, mm.
    pub loads: Vec<Vec<f64>>,
    /// Gap per unit of each rigid-body mode, `[3, N]`.
    pub floating: Vec<Vec<f64>>,
}

impl PreviousModel {
    /// Gaps of `model`.
    pub fn of(model: &Model) -> Self {
        let motions = model.floating.iter().flat_map(|body| &body.modes);
        Self {
            initial_gap: model.initial_gap.clone(),
            loads: model.loads.iter().map(|load| load.gap.clone()).collect(),
            floating: motions.map(|motion| motion.gap.clone()).collect(),
        }
    }

    /// Tangential gap, `[2, N]`, mm, without the prescribed motion of body 2. The prescribed motion is left out,
    /// because it does not depend on the bodies.
    fn tangential_gap(&self, elastic: &[f64], state: &RunState) -> Vec<f64> {
        let loads = self.loads.iter().zip(&state.load_amplitudes);
        let parts: Vec<_> = loads.chain(self.floating.iter().zip(&state.mode_amplitudes)).collect();
        let gap = |k: usize| {
            let moved = parts.iter().map(|(gap, amount)| *amount * gap[k]);
            moved.fold(self.initial_gap[k] + elastic[k], |sum, by| sum + by)
        };
        (0..2 * elastic.len() / 3).map(gap).collect()
    }

    fn fits(&self, n: usize) -> bool {
        let gaps = std::iter::once(&self.initial_gap).chain(&self.loads).chain(&self.floating);
        gaps.into_iter().all(|gap| gap.len() == 3 * n)
    }
}

impl RunCheckpoint {
    /// Transfers the checkpoint to the operators of `model`. `new_cell_indices` contains the new index of each cell,
    /// `[N]`. `previous` contains the gaps of the previous model if the bodies have changed.
    ///
    /// Tractions and depths stay identical to the last bit. If the bodies have not changed, elastic displacements and
    /// gaps also stay identical. On changed bodies, the elastic displacements are recomputed from the tractions. The
    /// slip reference changes by the same amount as the tangential gap, so the transfer causes no slip. New cells have
    /// no wear and no tractions.
    ///
    /// # Errors
    /// If the model is invalid, the checkpoint is within a monotone step, or the frames do not match. If a body cannot be solved or
    /// memory does not suffice.
    pub fn transfer_to(
        self,
        new_cell_indices: &[usize],
        model: &Model,
        steps: &[Step],
        previous: Option<&PreviousModel>,
    ) -> Result<Self> {
        let mut prepared = PreparedModel::new(model, steps)?;
        prepared.apply_loads(&self.state.load_amplitudes);
        let n = prepared.n();
        let misfit =
            new_cell_indices.len() != self.n_cells() || new_cell_indices.iter().any(|&place| place >= n);
        let larger = n > new_cell_indices.len();
        if misfit
            || previous.is_some_and(|before| !before.fits(new_cell_indices.len()))
            || (larger && !model.frame.has_uniform_axes())
        {
            return Err(Error::input("the checkpoint does not match this frame"));
        }
        let formed_cells: Vec<Vec<usize>> = self
            .formed_cells
            .iter()
            .map(|cells| cells.iter().map(|&cell| new_cell_indices[cell]).collect())
            .collect();
        for cells in &formed_cells {
            prepared.form_flexibility(cells)?;
        }
        let onto = StateTransfer { new_cell_indices, prepared: &prepared, previous };
        let (state, change) = onto.transfer_state(self.state)?;
        let progress =
            match self.progress {
                StepProgress::NotStarted => StepProgress::NotStarted,
                StepProgress::WearStep(wear_step) => StepProgress::WearStep(Box::new(
                    onto.transfer_wear_step(*wear_step, &state.slip_reference, change.as_ref()),
                )),
                StepProgress::Monotone(_) => {
                    return Err(Error::input(
                        "the frame or the meshes cannot change within a step of increments",
                    ));
                }
            };
        Ok(Self { progress, state, formed_cells, ..self })
    }
}

struct StateTransfer<'a> {
    new_cell_indices: &'a [usize],
    prepared: &'a PreparedModel<'a>,
    previous: Option<&'a PreviousModel>,
}

struct OperatorChange {
    /// Change of the tangential gap in the cells of the previous frame, `[2, N]`, mm.
    gap: Vec<f64>,
    /// Change of the approach at which the first cell closes, mm.
    touch: f64,
}

impl StateTransfer<'_> {
    fn transfer_state(&self, state: RunState) -> Result<(RunState, Option<OperatorChange>)> {
        let Self { new_cell_indices, prepared, previous } = *self;
        let (n, n_before) = (prepared.n(), new_cell_indices.len());
        let tractions = extend_field(&state.tractions, new_cell_indices, n, |_| 0.0);
        let mut elastic = vec![0.0; 3 * n];
        let operator = prepared.model.flexibility.as_ref();
        operator.apply(&tractions, &mut elastic);
        operator.complete_gap(&tractions, &mut elastic)?;
        let change = previous.map(|before| {
            let was = before.tangential_gap(&state.elastic, &state);
            let is = PreviousModel::of(prepared.model).tangential_gap(&elastic, &state);
            let changed = |k: usize| is[(k / n_before) * n + new_cell_indices[k % n_before]] - was[k];
            OperatorChange {
                gap: (0..2 * n_before).map(changed).collect(),
                touch: prepared.first_touch
                    - first_touch_approach(
                        prepared.model.frame.has_uniform_axes(),
                        &before.initial_gap[2 * n_before..],
                    ),
            }
        });
        let gap = |k: usize| {
            let mut gap = prepared.loaded_gap[k] + state.rigid_motion[k / n] + elastic[k];
            for (motion, amount) in prepared.mode_gaps.iter().zip(&state.mode_amplitudes) {
                gap += amount * motion[k];
            }
            gap
        };
        let mut reference = state.slip_reference;
        let mut rigid_motion = state.rigid_motion;
        if let Some(change) = &change {
            reference.iter_mut().zip(&change.gap).for_each(|(reference, by)| *reference += by);
            rigid_motion[2] += change.touch;
        }
        let slip_reference = extend_field(&reference, new_cell_indices, n, gap);
        if change.is_none() {
            elastic = extend_field(&state.elastic, new_cell_indices, n, |k| elastic[k]);
        }
        let state = RunState {
            slip_reference,
            elastic,
            wear_depth: extend_field(&state.wear_depth, new_cell_indices, n, |_| 0.0),
            depth_errors: extend_field(&state.depth_errors, new_cell_indices, n, |_| 0.0),
            tractions,
            rigid_motion,
            ..state
        };
        Ok((state, change))
    }

    /// Transfers the state of a wear step. `reference` is the slip reference on the new frame, `[2, N]`, mm.
    fn transfer_wear_step(
        &self,
        mut wear_step: WearStepState,
        reference: &[f64],
        change: Option<&OperatorChange>,
    ) -> WearStepState {
        let (n, places) = (self.prepared.n(), self.new_cell_indices);
        let CycleUnknowns { contact, stick_zone } = &mut wear_step.cycle;
        contact.scaled = extend_field(&contact.scaled, places, n, |_| 0.0);
        stick_zone.mask = extend_field(&stick_zone.mask, places, n, |_| false);
        if let Some(change) = change {
            stick_zone.gap.iter_mut().zip(&change.gap).for_each(|(at, by)| *at += by);
            contact.rigid_motion.iter_mut().for_each(|rigid| rigid[2] += change.touch);
            wear_step.load_path = wear_step.load_path.with_later_first_touch(change.touch);
            wear_step.rates_outdated = true;
        }
        stick_zone.gap = extend_field(&stick_zone.gap, places, n, |k| reference[k]);
        wear_step.wear_rate = extend_field(&wear_step.wear_rate, places, n, |_| 0.0);
        wear_step.path_correction = wear_step.path_correction.map(|resolved| resolved.transfer_to(places, n));
        if let (SlipSource::Sliding(slip), true) = (&mut wear_step.slip_source, n > places.len()) {
            // All cells of a frame with new cells have the same axes, so their slip is the same.
            let along = [slip[0], slip[places.len()]];
            *slip = extend_field(slip, places, n, |k| along[k / n]);
        }
        wear_step
    }
}
