//! Records of increments and jumps, and their delivery to the observer.

use std::time::Instant;

use crate::contact::ContactState;
use crate::contact::certificate::StateChecks;
use crate::contact::solver::{SolveReport, Stagnation, StopReason};
use crate::error::{Result, warning};
use crate::evolution::field_measures::{root_mean_square, volume};
use crate::evolution::given_warnings::StepWarning;
use crate::evolution::large_sliding::large_sliding_warning;
use crate::evolution::records::{Certificate, Divergence, FrameState, IncrementRecord, Resultants};
use crate::evolution::run::{Run, RunEnd};
use crate::evolution::state;
use crate::evolution::step::{Normal, Tangential};

/// Smallest number of cells across a grid for which the frame-edge warning does not advise smaller cells. Coarser grids
/// may not resolve the distance between the contact and the edge of the frame.
const MIN_CELLS_ACROSS: usize = 12;

/// Largest rotation that loads may cause, radians. At this angle, linearisation neglects a shortening of lever arms by
/// 1 - cos = 0.5 %.
const MAX_ROTATION: f64 = 0.1;

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

    /// Completes the record from the state of the run, and gives warnings. Returns `Err` if the run ends with this
    /// record.
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
        let both = self.state.wear_depth.iter().zip(&self.state.depth_errors);
        let deepest = both.max_by(|one, other| one.0.total_cmp(other.0));
        (record.max_wear_depth, record.max_wear_depth_error) =
            deepest.map_or((0.0, 0.0), |(depth, error)| (*depth, *error));
        record.worn_volume_by_energy =
            self.prepared.volume_per_energy.zip(self.state.wear_dissipation).map(|(k, energy)| k * energy);
        record.wear_depth_error =
            root_mean_square(&self.state.depth_errors, areas, |i| self.state.wear_depth[i] > 0.0);
        record.worn_volume_error = self.state.volume_errors.sum();
        record.worn_volume_error_by_source = self.state.volume_errors;
        let loads = self.prepared.model.loads.iter().zip(&self.state.load_amplitudes);
        record.loads =
            loads.filter_map(|(load, amplitude)| Some((load.case.name.clone()?, *amplitude))).collect();
        record.cycles_done = self.state.cycles_done;
        record.distance_slid = self.state.distance_slid;
        record.dissipation = self.state.dissipation;
        record.method.clone_from(&report.method);
        record.iterations = report.iterations;
        record.operator_applications = report.applications;
        let solved = report.stop == StopReason::Converged && checks.natural_residual <= tolerance;
        let turn = self.rotation_under_loads(record);
        // The strokes before the first jump are not results, so their rotation is not limited.
        let is_result = record.jump.is_some() || self.step().kind.cycles().is_none();
        record.converged = solved && !(is_result && turn > MAX_ROTATION);
        if solved && !record.converged {
            let note = self.prepared.large_rotation_message(record, turn.to_degrees());
            self.result.warnings.push(note);
        }
        if let Some(sliding) = &report.loss_of_equilibrium {
            let note = self.prepared.loss_of_equilibrium_message(&record.name, record.increment, sliding);
            self.result.warnings.push(note);
        }
        if let (Some(stagnation), false) = (&report.stagnation, record.converged) {
            let note = stagnation_message(record, stagnation, self.advises_displacements());
            self.result.warnings.push(note);
        }
        let no_contact = (record.contact_area == 0.0 && record.converged)
            .then(|| self.prepared.no_contact_message(record, &self.controls, checks.min_gap))
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
            _ if solved => Err(RunEnd::Diverged(Divergence::LargeRotation)),
            _ => Err(RunEnd::Diverged(Divergence::Iterations)),
        }
    }

    /// Whether the step prescribes forces although the supports also allow prescribed displacements.
    fn advises_displacements(&self) -> bool {
        let supported = self.prepared.model.floating.is_empty();
        let normal = matches!(self.controls.normal, Normal::Force(_));
        supported && (normal || matches!(self.controls.tangential, Tangential::Force(_)))
    }

    /// Magnitude of the rotation of body 2 relative to body 1 about the axes without a prescribed rotation, radians.
    fn rotation_under_loads(&self, record: &IncrementRecord) -> f64 {
        let moment = self.effective_loads(self.controls.loads_at_shift()).moment;
        let floating = !self.prepared.model.floating.is_empty();
        let turn = [record.rotation[0], record.rotation[1], record.twist];
        let unknown = (0..3).filter(|&axis| floating || moment[axis].is_some());
        unknown.map(|axis| turn[axis].to_radians().powi(2)).sum::<f64>().sqrt()
    }

    fn frame_edge_warning(&self, record: &IncrementRecord) -> String {
        let frame = &self.prepared.model.frame;
        let fewest = frame.grid.and_then(|grid| grid.cells.into_iter().filter(|n| *n > 1).min());
        let coarse = fewest.filter(|n| *n < MIN_CELLS_ACROSS && frame.grid_indices.is_none());
        let finer = coarse.map(|n| {
            format!("enlarge frame.half_width, or use smaller cells (now only {n} across the frame) and, on meshed bodies, contact faces no larger than the cells")
        });
        let larger = if frame.grid.is_none() && frame.n_excluded > 0 {
            "take the frame from the body whose surface ends there (frame.body), or use smaller faces"
        } else if frame.grid_indices.is_some() {
            "enlarge frame.half_width or use smaller cells, until the outermost cells lie outside frame.outline"
        } else if frame.grid.is_some() {
            "enlarge frame.half_width, or give the edge of a flat punch as frame.outline"
        } else {
            "add more faces to the contact groups"
        };
        let larger = finer.as_deref().unwrap_or(larger);
        // An outline may end inside the outermost cells.
        let beyond =
            if frame.grid_indices.is_some() { "" } else { ", although the bodies continue beyond it" };
        warning(&format!(
            "step \"{}\" ({}): the contact reaches the edge of the frame{beyond}. Contact outside the frame is not computed, so that loads and pressures may be wrong; {larger}",
            record.name, record.increment
        ))
    }

    /// Amplitudes of the loads of the bodies at the phase `phase` of a cycle, from -1 to 1 at the + reversal point.
    pub(super) fn amplitudes_at_phase(&self, phase: f64) -> Vec<f64> {
        let cyclic = self.prepared.cyclic_amplitudes.iter().map(|amplitude| phase * amplitude);
        self.state.load_amplitudes.iter().zip(cyclic).map(|(mean, by)| mean + by).collect()
    }

    pub(super) fn deliver(&mut self, record: IncrementRecord, mut fields: FrameState) -> Result<()> {
        fields.wear_depth_error.clone_from(&self.state.depth_errors);
        if fields.load_amplitudes.is_empty() {
            fields.load_amplitudes.clone_from(&self.state.load_amplitudes);
        }
        self.observer.increment_done(&record, &fields)?;
        if record.converged
            && let Some(note) = large_sliding_warning(&self.prepared.model.frame, &record, &fields)
        {
            self.warn_once(StepWarning::LargeSliding, |_| note);
        }
        self.result.records.push(record);
        self.result.state = fields;
        Ok(())
    }
}

/// Largest residual for which the message advises a larger tolerance.
const MAX_ADVISED_TOLERANCE: f64 = 1e-5;

/// Message about a solver that did not reach its tolerance. `displacements` states whether the message may advise
/// prescribed displacements instead of forces.
fn stagnation_message(record: &IncrementRecord, stagnation: &Stagnation, displacements: bool) -> String {
    let Stagnation { residual, tolerance, iterations, .. } = stagnation;
    let course: Vec<String> =
        stagnation.history.iter().map(|(k, best)| format!("{best:.0e} after {k}")).collect();
    let course = if course.is_empty() { String::new() } else { format!(" (best: {})", course.join(", ")) };
    let cells = |count: usize, law: &str| {
        let unit = if count == 1 { "cell" } else { "cells" };
        (count > 0).then(|| format!("{law} in {count} {unit}"))
    };
    let violated: Vec<String> = [
        cells(stagnation.contact_cells, "the contact conditions are violated"),
        cells(stagnation.friction_cells, "the friction law is violated"),
    ]
    .into_iter()
    .flatten()
    .collect();
    let violated = if violated.is_empty() {
        "prescribed forces or moments are not reached".to_owned()
    } else {
        violated.join(", ")
    };
    let (finer, otherwise) = (
        if record.jump.is_some() { "jumps" } else { "`increments`" },
        if displacements { ", or prescribe displacements instead of forces" } else { "" },
    );
    let advice = if stagnation.needs_iterations {
        "increase solver.max_iterations".to_owned()
    } else if *residual <= MAX_ADVISED_TOLERANCE {
        "relax solver.tolerance".to_owned()
    } else {
        format!("use more {finer}{otherwise}")
    };
    format!(
        "step \"{}\" ({}): residual {residual:.1e} instead of {tolerance:e} after {iterations} iterations{course}; {violated}: {advice}",
        record.name, record.increment
    )
}
