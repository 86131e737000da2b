//! Runs a plan into a directory of results, on a larger frame where contact outgrows the first one, and on moved meshes where
//! bodies wear.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::fork::{Fork, Forks, Shares, TakenUp};
use super::resume::Checkpoints;
use super::turn::{Maker, Stage, Way};
use crate::error::{Error, Kind, Result, exit};
use crate::frame::ContactFrame;
use crate::history::image::Entries;
use crate::history::record::{FrameState, IncrementRecord, Moment, Observer, Outcome};
use crate::history::{RunResult, Snapshot};
use crate::linalg::course::Course;
use crate::results::fields::{FieldKind, FieldWriter, Written};
use crate::results::keeper::{Keeper, Kept, Moves, Progress};
use crate::results::output::OutputDir;
use crate::results::recorder::{Parts, Recorder};
use crate::results::summary::{FrameRecord, Status, Summary};
use crate::scene::Plan;
use crate::study::moving::Room;
use crate::study::saved::{self, Spent};
use crate::study::{Failure, Study};

/// How a plan is run.
pub struct Job<'a> {
    /// The frame, if it was made for another plan.
    pub frame: Option<&'a ContactFrame>,
    /// Shows stage, fraction done, residual.
    pub show: &'a mut (dyn FnMut(&str, f64, Option<f64>) + Send),
    /// Hears of each increment.
    pub watch: &'a mut dyn Observer,
    /// Whether to stop.
    pub stop: &'a AtomicBool,
    /// Its checkpoints; `None` if it has none.
    pub checkpoints: Option<Checkpoints>,
    /// What it shares with other runs.
    pub shares: Shares<'a>,
    /// Looks at the entries when the run ends, before its summary is written; whether its files are kept.
    pub complete: &'a mut dyn FnMut(&[IncrementRecord], &mut Summary) -> bool,
}

impl Job<'_> {
    fn maker(&mut self) -> Maker<'_> {
        Maker { frame: self.frame, show: &mut *self.show, stop: self.stop }
    }
}

/// Completes nothing.
pub fn nothing(_: &[IncrementRecord], _: &mut Summary) -> bool {
    true
}

/// Hears nothing.
pub struct Nobody;

impl Observer for Nobody {
    fn progress(&mut self, _stage: &str, _fraction: f64, _residual: Option<f64>) {}

    fn increment_done(&mut self, _record: &IncrementRecord, _state: &FrameState) -> Result<()> {
        Ok(())
    }

    fn wants_tangential_gap(&self) -> bool {
        false
    }
}

/// The recorder of a run, and somebody who watches besides.
struct Watched<'a, 'r, 'p> {
    recorder: &'a mut Recorder<'r>,
    watch: &'a mut dyn Observer,
    room: Option<Room>,
    /// The run, and what others go on from, on its first frame and with unmoved meshes.
    forks: Option<(&'a Study<'p>, &'a mut Forks)>,
    /// Its entries for runs that are its images, and whether they need fretting loops.
    entries: Option<(&'a mut Entries, bool)>,
}

impl Observer for Watched<'_, '_, '_> {
    fn progress(&mut self, stage: &str, fraction: f64, residual: Option<f64>) {
        self.recorder.progress(stage, fraction, residual);
    }

    fn increment_done(&mut self, record: &IncrementRecord, state: &FrameState) -> Result<()> {
        self.recorder.increment_done(record, state)?;
        if let Some((entries, _)) = &mut self.entries {
            entries.add(record, state);
        }
        self.watch.increment_done(record, state)
    }

    fn keep(&mut self, moment: Moment, snapshot: &dyn Fn() -> Snapshot) -> Result<()> {
        self.recorder.keep(moment, snapshot)?;
        let Some((study, forks)) = self.forks.as_mut().filter(|(_, forks)| forks.are_due(moment)) else {
            return Ok(());
        };
        let snapshot = snapshot();
        if forks.after.contains(&snapshot.n_steps()) {
            let entries = self.entries.as_ref().map(|(entries, _)| (**entries).clone());
            let (written, folder) = (self.recorder.written(), self.recorder.folder());
            forks.made.push(Fork::new((study, snapshot), written, folder, entries));
        }
        Ok(())
    }

    fn interrupted(&self) -> bool {
        self.recorder.interrupted()
    }

    fn is_outdated(&self, worn: &[f64]) -> bool {
        self.room.as_ref().is_some_and(|room| room.is_exceeded(worn))
    }

    fn wants_loops(&self) -> bool {
        self.recorder.wants_loops() || self.entries.as_ref().is_some_and(|(_, loops)| *loops)
    }

    fn wants_tangential_gap(&self) -> bool {
        self.recorder.wants_tangential_gap() || self.watch.wants_tangential_gap() || self.entries.is_some()
    }
}

/// What a part of a run, on one frame with bodies of one shape, begins with.
struct Leg {
    parts: Parts,
    from: Option<(Snapshot, Course)>,
    stage: Stage,
}

/// Runs the plan into `output`, if there is one, and completes `summary`; the exit code, or the failure that ended it, which is in the
/// summary too.
pub fn compute(
    plan: &Plan,
    mut output: Option<OutputDir>,
    summary: &mut Summary,
    mut job: Job<'_>,
) -> std::result::Result<u8, Failure> {
    let from = job.checkpoints.as_mut().and_then(|checkpoints| checkpoints.from.take());
    let stage = from.as_ref().map_or_else(Stage::default, |from| Stage {
        growths: from.kept.growths,
        moves: from.kept.moves.clone(),
    });
    let records = from.as_ref().map_or_else(Vec::new, |from| from.kept.snapshot.records().to_vec());
    let early = |output| Recorder::writing_to(output).with_records(records.clone());
    let study = match safely(plan, || job.maker().ready(plan, &stage)) {
        Ok(Some(study)) => study,
        Ok(None) => {
            summary.conclude(&Ok(Outcome::Interrupted));
            return early(output).finish(summary).map(|()| exit::INTERRUPTED).map_err(unkeyed);
        }
        Err(failure) => return failed(early(output), summary, failure),
    };
    if from.is_some() {
        // The fields before the checkpoint are not known.
        job.shares.for_images.iter_mut().for_each(|for_images| for_images.go_on(None));
        job.shares.original = None;
    }
    let fork = job.shares.from;
    let begun = job.shares.from.take().filter(|_| from.is_none());
    let begun = match begun.map(|fork| fork.take_up(&study, output.as_mut())).transpose() {
        Ok(taken) => taken.flatten(),
        Err(error) => return failed(early(output), summary, unkeyed(error)),
    };
    let keeper =
        job.checkpoints.take().map(|Checkpoints { origin, interval, .. }| Keeper::new(origin, interval));
    let keeper = keeper.map(|keeper| from.iter().fold(keeper, |keeper, from| from.keeper(keeper)));
    if let Some(TakenUp { snapshot, course, written, skipped }) = begun {
        summary.skipped.push(skipped);
        let entries = || fork.and_then(|fork| fork.entries.clone());
        job.shares.for_images.iter_mut().for_each(|for_images| for_images.go_on(entries()));
        let records = snapshot.records().to_vec();
        let keeper = keeper.map(|keeper| keeper.after(0, Progress::of(&records)));
        let parts = Parts { output, records, written, keeper };
        return legs(plan, study, Leg { parts, from: Some((snapshot, course)), stage }, summary, &mut job);
    }
    let (written, from) = match from.map(|from| from.kept) {
        Some(Kept { snapshot, course, written, .. }) => (written, Some((snapshot, course))),
        None => (Written::default(), None),
    };
    let parts = Parts { output, records, written, keeper };
    legs(plan, study, Leg { parts, from, stage }, summary, &mut job)
}

/// Leaves a summary of what stood in the way before anything was computed.
pub(super) fn refused(
    output: Option<OutputDir>,
    summary: &mut Summary,
    failure: Failure,
) -> std::result::Result<u8, Failure> {
    failed(Recorder::writing_to(output), summary, failure)
}

/// Writes what there is of a run that a failure ended before anything was computed.
fn failed(
    recorder: Recorder<'_>,
    summary: &mut Summary,
    failure: Failure,
) -> std::result::Result<u8, Failure> {
    summary.fail(&failure.error);
    recorder.finish(summary).map_err(|error| unkeyed(error.besides(&failure.error)))?;
    match failure.error.exit_code() {
        exit::INTERRUPTED => Ok(exit::INTERRUPTED),
        _ => Err(failure),
    }
}

/// An error that concerns no key of the scene.
fn unkeyed(error: Error) -> Failure {
    Failure { error, key: String::new() }
}

/// A panic as a failure.
fn safely<T>(
    plan: &Plan,
    work: impl FnOnce() -> std::result::Result<T, Failure>,
) -> std::result::Result<T, Failure> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| Err(unkeyed(internal(plan, &*panic))))
}

/// Runs the plan to its end, from frame to frame.
fn legs<'p>(
    plan: &'p Plan,
    mut study: Study<'p>,
    mut leg: Leg,
    summary: &mut Summary,
    job: &mut Job<'_>,
) -> std::result::Result<u8, Failure> {
    let told = (summary.warnings.clone(), summary.skipped.clone());
    loop {
        // Of the last frame alone, whether the run was interrupted or not.
        summary.warnings = told.0.iter().chain(&study.notes).cloned().collect();
        summary.skipped = told.1.iter().chain(&study.skipped).cloned().collect();
        summary.condensation.clone_from(&study.condensation);
        summary.boundary_elements.clone_from(&study.boundary_elements);
        summary.truncations.clone_from(&study.truncations);
        summary.near_fields.clone_from(&study.near_fields);
        summary.frame = study.model().frame.grid.as_ref().map(FrameRecord::from);
        study.timings.iter().for_each(|(stage, seconds)| summary.timings.add(stage, seconds));
        let Leg { parts: Parts { output, records, written, keeper }, from, stage } = leg;
        summary.mesh_moves = plan.move_mesh.map(|_| stage.moves.count);
        let fields = FieldWriter::new(&study.model().frame, study.outputs(), &plan.output.fields);
        let fields = fields.on_surface(study.surface()).with_inside(&plan.inside);
        let fields = fields.every(plan.fields_every).after(written);
        let recorder = Recorder::writing_to(output).with_records(records).with_fields(fields);
        let recorder = recorder.with_progress(&mut *job.show).with_stop(job.stop);
        let mut recorder = match keeper {
            Some(keeper) => {
                let keeper = keeper.on_frame(stage.growths, &stage.moves);
                recorder.with_checkpoints(keeper, study.model().flexibility.as_ref())
            }
            None => recorder,
        };
        let ledger = (plan, &study.model().frame);
        let room = match Room::new(plan, &study, &stage.moves) {
            Ok(room) => room,
            Err(error) => return conclude(recorder, &mut *job.complete, Err(error), (summary, ledger)),
        };
        job.watch.on_frame(&study.model().frame);
        let is_first = stage.growths == 0 && stage.moves == Moves::default();
        let forks = job.shares.forks.as_deref_mut().filter(|_| is_first).map(|forks| (&study, forks));
        let loops = plan.output.fields.contains(&FieldKind::Loops);
        let entries = job.shares.for_images.as_deref_mut().filter(|_| is_first);
        let entries =
            entries.and_then(|for_images| for_images.entries.as_mut()).map(|entries| (entries, loops));
        let mut watched = Watched { recorder: &mut recorder, watch: &mut *job.watch, room, forks, entries };
        let (snapshot, course) = from.unzip();
        let from = snapshot.zip(course.as_ref());
        let original = job.shares.original.take();
        let result = catch_unwind(AssertUnwindSafe(|| {
            let image = original.map(|original| original.deliver(&study, &mut watched)).transpose()?;
            image.flatten().map_or_else(|| study.run_from(from, &mut watched), Ok)
        }));
        let mut result = result.unwrap_or_else(|panic| Err(internal(plan, &*panic)));
        job.shares.for_images.iter_mut().for_each(|for_images| for_images.conclude(&study, &result));
        let (shared, clock) = (job.frame.is_some(), Instant::now());
        let way = safely(plan, || {
            Ok(result.as_mut().ok().and_then(|result| Way::of(result, (plan, &study), (&stage, shared))))
        });
        let way = match way.unwrap_or_else(|failure| {
            result = Err(failure.error);
            None
        }) {
            None => return conclude(recorder, &mut *job.complete, result, (summary, ledger)),
            Some(Way::End(why)) => {
                return conclude(recorder, &mut *job.complete, tell(result, Some(why)), (summary, ledger));
            }
            Some(Way::Interrupted) => {
                return conclude(recorder, &mut *job.complete, interrupted(result), (summary, ledger));
            }
            Some(way) => way,
        };
        let grows = matches!(way, Way::Larger(_));
        if !grows {
            summary.timings.add("moving meshes", clock.elapsed().as_secs_f64());
        }
        let (mut parts, surface, frame) =
            (recorder.into_parts(), study.surface(), study.model().frame.clone());
        match safely(plan, || job.maker().take(plan, (study, way), &stage)) {
            Ok(Some(next)) => {
                if let Some(places) = next.places {
                    parts.written = parts.written.onto(&places, next.study.model().frame.n_cells());
                }
                let course = next.study.model().flexibility.course();
                leg = Leg { parts, from: Some((next.snapshot, course)), stage: next.stage };
                study = next.study;
            }
            ended => {
                let result = match ended {
                    Err(failure) if failure.error.kind() == Kind::Interrupted => interrupted(result),
                    Err(failure) if grows => {
                        tell(result, Some(format!("the frame is not enlarged: {}", failure.error)))
                    }
                    Err(failure) => Err(failure.error),
                    Ok(_) => interrupted(result),
                };
                let fields = FieldWriter::new(&frame, Vec::new(), &plan.output.fields);
                let fields = fields.on_surface(surface).after(parts.written);
                let resumes = parts.keeper.is_some_and(|keeper| keeper.has_any());
                let recorder =
                    Recorder::writing_to(parts.output).with_records(parts.records).with_fields(fields);
                return conclude(
                    recorder.that_resumes(resumes),
                    &mut *job.complete,
                    result,
                    (summary, (plan, &frame)),
                );
            }
        }
    }
}

fn interrupted(result: Result<RunResult>) -> Result<RunResult> {
    result.map(|result| RunResult { outcome: Outcome::Interrupted, ..result })
}

/// The result with one more warning.
fn tell(result: Result<RunResult>, warning: Option<String>) -> Result<RunResult> {
    result.map(|mut result| {
        result.warnings.extend(warning);
        result
    })
}

/// Completes the summary and writes what there is.
fn conclude(
    recorder: Recorder<'_>,
    complete: &mut dyn FnMut(&[IncrementRecord], &mut Summary) -> bool,
    result: Result<RunResult>,
    (summary, (plan, frame)): (&mut Summary, (&Plan, &ContactFrame)),
) -> std::result::Result<u8, Failure> {
    let outcome = result.map(|result| {
        summary.skipped.extend(result.skipped);
        summary.warnings.extend(result.warnings);
        summary.loops = result.loops;
        result.timings.iter().for_each(|(stage, seconds)| summary.timings.add(stage, *seconds));
        result.outcome
    });
    summary.conclude(&outcome);
    let making = ["body1", "body2", "flexibility"].map(|stage| summary.timings.of(stage));
    let spent = Spent::of(plan, frame, recorder.records(), [making[0] + making[1], making[2]]);
    saved::estimate(plan, frame, &spent, &mut summary.skipped);
    let kept = complete(recorder.records(), summary);
    let code = exit_code(&outcome);
    let doubted = code == exit::DONE && summary.status == Status::NotConverged;
    let code = if doubted { exit::NOT_CONVERGED } else { code };
    let ended = if kept { recorder.finish(summary) } else { recorder.discard(summary) };
    match (outcome, ended) {
        (Err(error), Err(written)) => Err(unkeyed(written.besides(&error))),
        (_, Err(written)) => Err(unkeyed(written)),
        (Err(error), Ok(())) if error.kind() != Kind::Interrupted => Err(unkeyed(error)),
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

/// The error that a panic is; its message was printed when it happened.
fn internal(plan: &Plan, panic: &(dyn Any + Send)) -> Error {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
    let scene = &plan.document.sha256;
    Error::numerical(format!("internal error, please report it with the scene (SHA-256 {scene}): {text}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::checkpoint;
    use crate::results::summary::Status;
    use crate::scene;

    const SCENE: &str = r#"
[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[body1]
kind = "half-space"
material = "steel"
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [0.6, 0.6]
cells = [4, 4]
[gap]
kind = "sphere"
radius = 50.0
[[steps]]
name = "press"
normal_force = 100.0
increments = 4
[output]
fields = []
checkpoint = { seconds = 1e-9 }
"#;

    /// Counts the frames it hears of, and the cells of the last one at each entry.
    #[derive(Default)]
    struct Frames {
        heard: Vec<usize>,
        at_entries: Vec<[usize; 2]>,
    }

    impl Observer for Frames {
        fn progress(&mut self, _stage: &str, _fraction: f64, _residual: Option<f64>) {}

        fn on_frame(&mut self, frame: &ContactFrame) {
            self.heard.push(frame.n_cells());
        }

        fn increment_done(&mut self, _record: &IncrementRecord, state: &FrameState) -> Result<()> {
            let last = self.heard.last().copied().unwrap_or_default();
            self.at_entries.push([last, state.wear_depth.len()]);
            Ok(())
        }
    }

    /// Truth: the frame of the scene has 16 cells and does not grow; a scene from text is the one from the file.
    #[test]
    fn who_watches_hears_of_the_frame_first() {
        let plan = scene::read_text(std::path::Path::new("scene.toml"), SCENE.to_owned(), &[]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, SCENE).unwrap();
        assert_eq!(plan.document.sha256, scene::read(&path, &[]).unwrap().document.sha256);
        let (mut frames, stop) = (Frames::default(), AtomicBool::new(false));
        let job = Job {
            frame: None,
            show: &mut |_, _, _| {},
            watch: &mut frames,
            stop: &stop,
            checkpoints: None,
            shares: Shares::default(),
            complete: &mut nothing,
        };
        let mut summary = super::super::summary(&plan);
        assert_eq!(compute(&plan, None, &mut summary, job).unwrap(), exit::DONE);
        assert_eq!((frames.heard, frames.at_entries), (vec![16], vec![[16, 16]; 4]));
    }

    /// Breaks down at an entry.
    struct Breaks(usize);

    impl Observer for Breaks {
        fn progress(&mut self, _stage: &str, _fraction: f64, _residual: Option<f64>) {}

        fn increment_done(&mut self, record: &IncrementRecord, _state: &FrameState) -> Result<()> {
            assert!(record.increment != self.0, "an invariant is broken");
            Ok(())
        }
    }

    /// Truth (rel-no-panics; docs/command-line.md: code 1): a panic in the middle of a run is an internal error with the fingerprint of
    /// the scene; the summary says so with the entries before it, and the checkpoint of those is kept.
    #[test]
    fn panics_are_internal_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, SCENE).unwrap();
        let plan = scene::read(&path, &[]).unwrap();
        let out = folder.path().join("out");
        let mut summary = super::super::summary(&plan);
        let (stop, checkpoints) = (AtomicBool::new(false), Checkpoints::of(&plan).unwrap());
        let job = Job {
            frame: None,
            show: &mut |_, _, _| {},
            watch: &mut Breaks(3),
            stop: &stop,
            checkpoints: Some(checkpoints),
            shares: Shares::default(),
            complete: &mut nothing,
        };
        let failure = compute(&plan, Some(OutputDir::open(&out).unwrap()), &mut summary, job).err().unwrap();
        let text = failure.error.to_string();
        assert_eq!(failure.error.exit_code(), exit::FAILED);
        for words in ["internal error, please report", &plan.document.sha256, "an invariant is broken"] {
            assert!(text.contains(words), "{text}");
        }
        let written: serde_json::Value =
            serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
        assert!(summary.status == Status::Failed && written["status"] == "failed", "{written}");
        assert!(written["error"].as_str().is_some_and(|error| error.contains("internal error")), "{written}");
        let kept: Kept<Snapshot> = checkpoint::read(&out).unwrap().unwrap().state().unwrap();
        assert_eq!(kept.snapshot.records().len(), 2);
    }
}
