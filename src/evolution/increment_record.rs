//! Records of increments and jumps, and their delivery to the observer.

use std::time::Instant;

use crate::contact::ContactState;
use crate::contact::certificate::StateChecks;
use crate::contact::solver::{SolveReport, StopReason};
use crate::error::{Result, warning};
use crate::evolution::field_measures::{root_mean_square, volume};
use crate::evolution::given_warnings::StepWarning;
use crate::evolution::large_sliding::large_sliding_warning;
use crate::evolution::records::{Certificate, Divergence, FrameState, IncrementRecord, Resultants};
use crate::evolution::run::{Run, RunEnd};
use crate::evolution::state;

/// Grids with fewer cells across may be too coarse to show the gap between the contact and the edge of the frame.
const MIN_CELLS_ACROSS: usize = 12;

pub(super) struct SolvedState<'s> {
    /// Number of the increment or jump in its step, from 1.
    pub number: usize,
    pub approach: f64,
    pub values: &'s Resultants,
    pub contact: &'s ContactState,
    pub certificate: Certificate,
    pub clock: Instant,
}

impl Run<'_> {
    /// Record of a solved state, without the values that [`Run::complete_record`] fills.
    pub(super) fn new_record(&self, solved: SolvedState) -> IncrementRecord {
        let record = IncrementRecord {
            name: self.step().name.clone(),
            increment: solved.number,
            approach: solved.approach,
            contact_touches_edge: state::touches_edge(&self.prepared, &solved.contact.scaled),
            certificate: solved.certificate,
            seconds: solved.clock.elapsed().as_secs_f64(),
            ..IncrementRecord::default()
        };
        record.with_resultants(solved.values)
    }

    /// Completes the record from the state of the run, and gives warnings. `Err` if the run ends with this record.
    pub(super) fn complete_record(
        &mut self,
        record: &mut IncrementRecord,
        report: &SolveReport,
        checks: &StateChecks,
        tolerance: f64,
    ) -> std::result::Result<(), RunEnd> {
        let areas = &self.prepared.model.frame.areas;
        let volume = volume(&self.state.wear_depth, areas) + self.state.rolling_wear_volume;
        let share = self.prepared.model.wear_share;
        record.worn_volume = volume;
        record.worn_volume_by_body = [share * volume, (1.0 - share) * volume];
        record.max_wear_depth = self.state.wear_depth.iter().copied().fold(0.0, f64::max);
        record.worn_volume_by_energy =
            self.prepared.volume_per_energy.zip(self.state.wear_dissipation).map(|(k, energy)| k * energy);
        record.wear_depth_error =
            root_mean_square(&self.state.depth_errors, areas, |i| self.state.wear_depth[i] > 0.0);
        record.worn_volume_error = self.state.volume_error;
        record.cycles_done = self.state.cycles_done;
        record.distance_slid = self.state.distance_slid;
        record.dissipation = self.state.dissipation;
        record.method.clone_from(&report.method);
        record.iterations = report.iterations;
        record.operator_applications = report.applications;
        record.converged = report.stop == StopReason::Converged && checks.natural_residual <= tolerance;
        if let Some(sliding) = &report.loss_of_equilibrium {
            let note = self.prepared.loss_of_equilibrium_message(&record.name, record.increment, sliding);
            self.result.warnings.push(note);
        }
        let no_contact = (record.contact_area == 0.0 && record.converged)
            .then(|| self.prepared.no_contact_message(record, self.controls.normal, checks.min_gap))
            .flatten();
        if let Some((kind, note)) = no_contact {
            self.warn_once(kind, |_| note);
        }
        if record.contact_touches_edge {
            self.warn_once(StepWarning::FrameEdge, |run| run.frame_edge_warning(record));
        }
        match report.stop {
            StopReason::Interrupted => Err(RunEnd::Interrupted),
            StopReason::GrossSliding => Err(RunEnd::Diverged(Divergence::GrossSliding)),
            StopReason::ContactLost => Err(RunEnd::Diverged(Divergence::ContactLost)),
            StopReason::StickZoneNotConverged => Err(RunEnd::Diverged(Divergence::StickZone)),
            _ if record.converged => Ok(()),
            _ => Err(RunEnd::Diverged(Divergence::Iterations)),
        }
    }

    fn frame_edge_warning(&self, record: &IncrementRecord) -> String {
        let frame = &self.prepared.model.frame;
        let fewest = frame.grid.and_then(|grid| grid.cells.into_iter().filter(|n| *n > 1).min());
        let coarse = fewest.filter(|n| *n < MIN_CELLS_ACROSS && frame.grid_indices.is_none());
        let finer = coarse.map(|n| {
            format!("enlarge frame.half_width, or increase frame.cells ({n} cells across the frame)")
        });
        let larger = if frame.grid.is_none() && frame.n_excluded > 0 {
            "take the frame from the body whose surface ends there (frame.body), or use smaller faces"
        } else if frame.grid_indices.is_some() {
            "enlarge frame.half_width beyond frame.outline"
        } else if frame.grid.is_some() {
            "enlarge frame.half_width, or give the edge of a flat punch as frame.outline"
        } else {
            "add more faces to the contact groups"
        };
        let larger = finer.as_deref().unwrap_or(larger);
        warning(&format!(
            "step \"{}\" ({}): the contact reaches the edge of the frame, although the bodies continue beyond it. Contact outside the frame is not computed, so that loads and pressures may be wrong; {larger}",
            record.name, record.increment
        ))
    }

    pub(super) fn deliver(&mut self, record: IncrementRecord, fields: FrameState) -> Result<()> {
        self.observer.increment_done(&record, &fields)?;
        if let Some(note) = large_sliding_warning(&self.prepared.model.frame, &record, &fields) {
            self.warn_once(StepWarning::LargeSliding, |_| note);
        }
        self.result.records.push(record);
        self.result.state = fields;
        Ok(())
    }
}
