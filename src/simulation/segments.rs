//! Runs a plan segment by segment. A new segment starts when the frame is enlarged or the meshes move with wear.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use crate::error::{Error, ErrorKind, Result, Warning, exit, panic_message};
use crate::evolution::observer::{CheckpointEvent, Observer};
use crate::evolution::records::{FrameState, IncrementRecord, Outcome};
use crate::evolution::{RunCheckpoint, RunResult};
use crate::flexibility::operator_history::OperatorHistory;
use crate::frame::ContactFrame;
use crate::output::checkpoint_writer::{CheckpointData, CheckpointWriter};
use crate::output::field_writer::{FieldWriter, WrittenFields};
use crate::output::output_dir::OutputDir;
use crate::output::recorder::{ProgressEvent, Recorder, RecorderParts};
use crate::output::summary::{FrameRecord, Status, Summary};
use crate::output::surface_properties::SurfaceProperties;
use crate::scene::Plan;
use crate::simulation::mesh_motion::WearBudget;
use crate::simulation::rebuild::{Change, Continuation, RebuildState, Rebuilt, SimulationBuilder};
use crate::simulation::resume::CheckpointSettings;
use crate::simulation::{SceneError, Simulation};

/// Options of a run.
pub struct RunOptions<'a> {
    /// Frame of another plan, which this run uses instead of the frame of its own plan.
    pub frame: Option<&'a ContactFrame>,
    /// Receives progress events.
    pub on_progress: &'a mut (dyn FnMut(ProgressEvent) + Send),
    /// Receives each increment.
    pub observer: &'a mut dyn Observer,
    /// Cancellation flag.
    pub stop: &'a AtomicBool,
    /// Checkpoint settings; `None` disables checkpoints.
    pub checkpoints: Option<CheckpointSettings>,
    /// Called once when the run ends, before the summary is written. Returns whether to keep the run's files; `None` keeps them.
    pub on_end: Option<OnEnd<'a>>,
}

type OnEnd<'a> = &'a mut dyn FnMut(&[IncrementRecord], &mut Summary) -> bool;

impl<'a> RunOptions<'a> {
    /// Options for a run on its own frame, without checkpoints.
    pub fn new(
        on_progress: &'a mut (dyn FnMut(ProgressEvent) + Send),
        observer: &'a mut dyn Observer,
        stop: &'a AtomicBool,
    ) -> Self {
        Self { frame: None, on_progress, observer, stop, checkpoints: None, on_end: None }
    }

    fn builder<'p>(&mut self, plan: &'p Plan) -> SimulationBuilder<'_, 'p> {
        SimulationBuilder { plan, frame: self.frame, show: &mut *self.on_progress, stop: self.stop }
    }
}

/// Observer that ignores all events.
pub struct NullObserver;

impl Observer for NullObserver {
    fn increment_done(&mut self, _record: &IncrementRecord, _state: &FrameState) -> Result<()> {
        Ok(())
    }

    fn wants_tangential_gap(&self) -> bool {
        false
    }
}

struct RunObserver<'a, 'r> {
    recorder: &'a mut Recorder<'r>,
    user_observer: &'a mut dyn Observer,
    wear_budget: Option<WearBudget>,
}

impl Observer for RunObserver<'_, '_> {
    fn progress(&mut self, stage: &str, fraction: f64, residual: Option<f64>) {
        self.recorder.progress(stage, fraction, residual);
    }

    fn increment_done(&mut self, record: &IncrementRecord, state: &FrameState) -> Result<()> {
        self.recorder.increment_done(record, state)?;
        self.user_observer.increment_done(record, state)
    }

    fn on_checkpoint(&mut self, moment: CheckpointEvent, snapshot: &dyn Fn() -> RunCheckpoint) -> Result<()> {
        self.recorder.on_checkpoint(moment, snapshot)
    }

    fn cancelled(&self) -> bool {
        self.recorder.cancelled()
    }

    fn wants_rebuild(&self, worn: &[f64]) -> bool {
        self.wear_budget.as_ref().is_some_and(|room| room.is_exceeded(worn))
    }

    fn wants_loops(&self) -> bool {
        self.recorder.wants_loops()
    }

    fn wants_tangential_gap(&self) -> bool {
        self.recorder.wants_tangential_gap() || self.user_observer.wants_tangential_gap()
    }
}

/// Part of a run on one frame with one set of meshes.
struct Segment<'p> {
    simulation: Simulation<'p>,
    parts: RecorderParts,
    /// Checkpoint from which the segment starts, with the history of the operators that must be replayed.
    from: Option<(RunCheckpoint, OperatorHistory)>,
    rebuilds: RebuildState,
}

/// Runs the plan into `output`, if given, and completes `summary`. Returns the exit code, or the failure that ended the run.
pub fn run_simulation(
    plan: &Plan,
    output: Option<OutputDir>,
    summary: &mut Summary,
    mut job: RunOptions<'_>,
) -> std::result::Result<u8, SceneError> {
    match Segment::first(plan, output, &mut job) {
        Ok(segment) => run_segments(plan, segment, summary, &mut job),
        Err((recorder, failure)) => conclude_unstarted(*recorder, summary, failure),
    }
}

pub(crate) fn conclude_refused(
    output: Option<OutputDir>,
    summary: &mut Summary,
    failure: SceneError,
) -> std::result::Result<u8, SceneError> {
    conclude_unstarted(Recorder::writing_to(output), summary, failure)
}

fn conclude_unstarted(
    recorder: Recorder<'_>,
    summary: &mut Summary,
    failure: SceneError,
) -> std::result::Result<u8, SceneError> {
    summary.set_failure(&failure.error);
    recorder.finish(summary).map_err(|error| error.followed_by(&failure.error))?;
    match failure.error.exit_code() {
        exit::INTERRUPTED => Ok(exit::INTERRUPTED),
        _ => Err(failure),
    }
}

fn catch_panic<T>(
    plan: &Plan,
    work: impl FnOnce() -> std::result::Result<T, SceneError>,
) -> std::result::Result<T, SceneError> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| Err(internal(plan, &*panic).into()))
}

impl<'p> Segment<'p> {
    fn first(
        plan: &'p Plan,
        output: Option<OutputDir>,
        options: &mut RunOptions<'_>,
    ) -> std::result::Result<Self, (Box<Recorder<'static>>, SceneError)> {
        let saved = options.checkpoints.as_mut().and_then(|checkpoints| checkpoints.from.take());
        let rebuilds = saved.as_ref().map_or_else(RebuildState::default, |saved| RebuildState {
            frame_growths: saved.checkpoint_data.frame_growths,
            mesh_updates: saved.checkpoint_data.mesh_updates.clone(),
        });
        let records =
            saved.as_ref().map_or_else(Vec::new, |saved| saved.checkpoint_data.snapshot.records().to_vec());
        let simulation = match catch_panic(plan, || options.builder(plan).build(&rebuilds)) {
            Ok(simulation) => simulation,
            Err(failure) => {
                return Err((Box::new(Recorder::writing_to(output).with_records(records)), failure));
            }
        };
        let writer = options
            .checkpoints
            .take()
            .map(|CheckpointSettings { origin, interval, .. }| CheckpointWriter::new(origin, interval));
        let checkpoint_writer =
            writer.map(|writer| saved.iter().fold(writer, |writer, saved| saved.keeper(writer)));
        let (written, from) = match saved.map(|saved| saved.checkpoint_data) {
            Some(CheckpointData { snapshot, operator_history, written, .. }) => {
                (written, Some((snapshot, operator_history)))
            }
            None => (WrittenFields::default(), None),
        };
        Ok(Self {
            simulation,
            parts: RecorderParts { output, records, written, checkpoint_writer },
            from,
            rebuilds,
        })
    }

    fn next(
        plan: &'p Plan,
        simulation: Simulation<'p>,
        change: Change,
        mut parts: RecorderParts,
        rebuilds: &RebuildState,
        options: &mut RunOptions<'_>,
    ) -> std::result::Result<Self, (Box<FinalParts>, SceneError)> {
        let last = (simulation.model().frame.clone(), simulation.surface());
        match catch_panic(plan, || options.builder(plan).rebuild(simulation, change, rebuilds)) {
            Ok(Rebuilt { simulation, checkpoint, rebuilds, cell_map }) => {
                if let Some(places) = cell_map {
                    parts.written = parts.written.transfer_to(&places, simulation.model().frame.n_cells());
                }
                let from = Some((checkpoint, simulation.model().flexibility.history()));
                Ok(Self { simulation, parts, from, rebuilds })
            }
            Err(failure) => Err((Box::new(FinalParts { frame: last.0, surface: last.1, parts }), failure)),
        }
    }
}

struct FinalParts {
    frame: ContactFrame,
    surface: SurfaceProperties,
    parts: RecorderParts,
}

fn run_segments<'p>(
    plan: &'p Plan,
    mut segment: Segment<'p>,
    summary: &mut Summary,
    options: &mut RunOptions<'_>,
) -> std::result::Result<u8, SceneError> {
    let initial = (summary.warnings.clone(), summary.skipped.clone());
    loop {
        let Segment { simulation, parts, from, rebuilds } = segment;
        // The summary keeps its initial warnings and omitted work. Warnings and omitted work of the present simulation
        // replace the entries of the previous segment.
        summary.warnings = initial.0.iter().chain(&simulation.report.warnings).cloned().collect();
        summary.skipped = initial.1.iter().chain(&simulation.report.skipped).cloned().collect();
        fill_from_build(summary, &simulation);
        summary.mesh_moves = plan.mesh_motion_threshold.map(|_| rebuilds.mesh_updates.count);
        let mut recorder = segment_recorder(plan, &simulation, &rebuilds, parts);
        recorder.progress = Some(Box::new(&mut *options.on_progress));
        recorder.cancel_flag = Some(options.stop);
        let wear_budget = match WearBudget::new(plan, &simulation, &rebuilds.mesh_updates) {
            Ok(wear_budget) => wear_budget,
            Err(error) => return conclude(recorder, options.on_end.as_mut(), Err(error), summary),
        };
        options.observer.on_frame(&simulation.model().frame);
        let mut observer =
            RunObserver { recorder: &mut recorder, user_observer: &mut *options.observer, wear_budget };
        let (checkpoint, history) = from.unzip();
        let from = checkpoint.zip(history.as_ref());
        let result = catch_unwind(AssertUnwindSafe(|| simulation.run_from(from, &mut observer)));
        let result = result.unwrap_or_else(|panic| Err(internal(plan, &*panic)));
        let (shared, clock) = (options.frame.is_some(), Instant::now());
        let continuation =
            catch_panic(plan, || Ok(Continuation::after(result, plan, &simulation, &rebuilds, shared)));
        let (change, result) = match continuation {
            Ok(Continuation::Rebuild(change, result)) => (*change, result),
            Ok(Continuation::End(result)) => {
                return conclude(recorder, options.on_end.as_mut(), result, summary);
            }
            Err(failure) => {
                return conclude(recorder, options.on_end.as_mut(), Err(failure.error), summary);
            }
        };
        let grows = matches!(change, Change::GrownFrame(_));
        if !grows {
            summary.timings.add("moving meshes", clock.elapsed().as_secs_f64());
        }
        let parts = recorder.into_parts();
        segment = match Segment::next(plan, simulation, change, parts, &rebuilds, options) {
            Ok(next) => next,
            Err((last, failure)) => {
                let result = if grows && failure.error.kind() != ErrorKind::Interrupted {
                    Ok(result.with_warning(format!("the frame is not enlarged: {}", failure.error)))
                } else {
                    result.ended_by(failure.error)
                };
                let recorder = final_recorder(plan, &last.frame, last.surface, last.parts);
                return conclude(recorder, options.on_end.as_mut(), result, summary);
            }
        };
    }
}

fn fill_from_build(summary: &mut Summary, simulation: &Simulation) {
    summary.condensation.clone_from(&simulation.report.condensation);
    summary.boundary_elements.clone_from(&simulation.report.boundary_elements);
    summary.truncations.clone_from(&simulation.report.truncations);
    summary.near_fields.clone_from(&simulation.report.near_fields);
    summary.frame = simulation.model().frame.grid.as_ref().map(FrameRecord::from);
    simulation.report.timings.iter().for_each(|(stage, seconds)| summary.timings.add(stage, seconds));
}

fn segment_recorder<'r>(
    plan: &Plan,
    simulation: &'r Simulation<'_>,
    rebuilds: &RebuildState,
    RecorderParts { output, records, written, checkpoint_writer }: RecorderParts,
) -> Recorder<'r> {
    let mut fields = FieldWriter::new(&simulation.model().frame, simulation.outputs(), &plan.output.fields);
    (fields.surface, fields.written) = (simulation.surface(), written);
    fields.interior_points.clone_from(&plan.interior_requests);
    fields.increment_stride = plan.fields_every;
    let recorder = Recorder::writing_to(output).with_records(records).with_fields(fields);
    match checkpoint_writer {
        Some(keeper) => {
            let keeper = keeper.with_rebuilds(rebuilds.frame_growths, &rebuilds.mesh_updates);
            recorder.with_checkpoints(keeper, simulation.model().flexibility.as_ref())
        }
        None => recorder,
    }
}

/// Recorder for the remaining output of a run whose next segment cannot be built. The previous bodies no longer exist,
/// so it writes no body fields.
fn final_recorder<'r>(
    plan: &Plan,
    frame: &'r ContactFrame,
    surface: SurfaceProperties,
    parts: RecorderParts,
) -> Recorder<'r> {
    let mut fields = FieldWriter::new(frame, Vec::new(), &plan.output.fields);
    (fields.surface, fields.written) = (surface, parts.written);
    let mut recorder = Recorder::writing_to(parts.output).with_records(parts.records).with_fields(fields);
    recorder.has_checkpoint_files = parts.checkpoint_writer.is_some_and(|keeper| keeper.has_written());
    recorder
}

fn conclude(
    recorder: Recorder<'_>,
    on_end: Option<&mut OnEnd<'_>>,
    result: Result<RunResult>,
    summary: &mut Summary,
) -> std::result::Result<u8, SceneError> {
    let outcome = result.map(|result| {
        summary.skipped.extend(result.skipped);
        summary.warnings.extend(result.warnings.into_iter().map(Warning::from));
        summary.loops = result.fretting_loops;
        result.timings.iter().for_each(|(stage, seconds)| summary.timings.add(stage, *seconds));
        result.outcome
    });
    summary.set_outcome(&outcome);
    let kept = on_end.is_none_or(|on_end| on_end(recorder.records(), summary));
    let code = exit_code(&outcome);
    let doubted = code == exit::DONE && summary.status == Status::NotConverged;
    let code = if doubted { exit::NOT_CONVERGED } else { code };
    let ended = if kept { recorder.finish(summary) } else { recorder.discard(summary) };
    match (outcome, ended) {
        (Err(error), Err(written)) => Err(written.followed_by(&error).into()),
        (_, Err(written)) => Err(written.into()),
        (Err(error), Ok(())) if error.kind() != ErrorKind::Interrupted => Err(error.into()),
        _ => Ok(code),
    }
}

fn exit_code(outcome: &Result<Outcome>) -> u8 {
    match outcome {
        Ok(Outcome::Converged) => exit::DONE,
        Ok(Outcome::NotConverged(_)) => exit::NOT_CONVERGED,
        Ok(Outcome::Interrupted) => exit::INTERRUPTED,
        Err(error) => error.exit_code(),
    }
}

fn internal(plan: &Plan, panic: &(dyn Any + Send)) -> Error {
    let text = panic_message(panic);
    let scene = &plan.document.sha256;
    Error::numerical(format!("internal error, please report it with the scene (SHA-256 {scene}): {text}"))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::output::checkpoint;
    use crate::output::summary::Status;
    use crate::scene;

    fn small_scene() -> (&'static Path, Vec<String>) {
        let few = ["frame.cells=[4, 4]", "steps.press.increments=4"];
        let output = "output={ fields = [], checkpoint = { seconds = 1e-9 } }";
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hertz.toml"));
        (path, few.into_iter().chain([output]).map(str::to_owned).collect())
    }

    /// Records the cell count of each frame. At each increment, records the cell counts of the last frame and of the state.
    #[derive(Default)]
    struct Frames {
        heard: Vec<usize>,
        at_entries: Vec<[usize; 2]>,
    }

    impl Observer for Frames {
        fn on_frame(&mut self, frame: &ContactFrame) {
            self.heard.push(frame.n_cells());
        }

        fn increment_done(&mut self, _record: &IncrementRecord, state: &FrameState) -> Result<()> {
            let last = self.heard.last().copied().unwrap_or_default();
            self.at_entries.push([last, state.wear_depth.len()]);
            Ok(())
        }
    }

    /// Truth: the observer receives the frame of 4 x 4 = 16 cells once, before the four increments. A scene read from
    /// text has the same SHA-256 as a scene read from its file.
    #[test]
    fn who_watches_hears_of_the_frame_first() {
        let (path, overrides) = small_scene();
        let plan = scene::read_text(path, std::fs::read_to_string(path).unwrap(), &overrides).unwrap();
        assert_eq!(plan.document.sha256, scene::read(path, &overrides).unwrap().document.sha256);
        let (mut frames, stop) = (Frames::default(), AtomicBool::new(false));
        let on_progress = &mut |_: ProgressEvent| {};
        let job = RunOptions::new(on_progress, &mut frames, &stop);
        let mut summary = crate::simulation::job::new_summary(&plan);
        assert_eq!(run_simulation(&plan, None, &mut summary, job).unwrap(), exit::DONE);
        assert_eq!((frames.heard, frames.at_entries), (vec![16], vec![[16, 16]; 4]));
    }

    struct Breaks(usize);

    impl Observer for Breaks {
        fn increment_done(&mut self, record: &IncrementRecord, _state: &FrameState) -> Result<()> {
            assert!(record.increment != self.0, "an invariant is broken");
            Ok(())
        }
    }

    /// Truth (docs/verification.md: rel-no-panics; docs/command-line.md: code 1): a panic is reported as an internal
    /// error with the scene's SHA-256, also in the summary. The checkpoint contains the two increments before the
    /// panic.
    #[test]
    fn panics_are_internal_errors() {
        let folder = tempfile::tempdir().unwrap();
        let (path, overrides) = small_scene();
        let plan = scene::read(path, &overrides).unwrap();
        let out = folder.path().join("out");
        let mut summary = crate::simulation::job::new_summary(&plan);
        let (stop, checkpoints) = (AtomicBool::new(false), CheckpointSettings::for_new_run(&plan).unwrap());
        let (on_progress, mut breaks) = (&mut |_: ProgressEvent| {}, Breaks(3));
        let job =
            RunOptions { checkpoints: Some(checkpoints), ..RunOptions::new(on_progress, &mut breaks, &stop) };
        let failure =
            run_simulation(&plan, Some(OutputDir::open(&out).unwrap()), &mut summary, job).err().unwrap();
        let text = failure.error.to_string();
        assert_eq!(failure.error.exit_code(), exit::FAILED);
        for words in ["internal error, please report", &plan.document.sha256, "an invariant is broken"] {
            assert!(text.contains(words), "{text}");
        }
        let written: serde_json::Value =
            serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
        assert!(summary.status == Status::Failed && written["status"] == "failed", "{written}");
        assert!(written["error"].as_str().is_some_and(|error| error.contains("internal error")), "{written}");
        let kept: CheckpointData<RunCheckpoint> = checkpoint::read(&out).unwrap().unwrap().state().unwrap();
        assert_eq!(kept.snapshot.records().len(), 2);
    }
}
