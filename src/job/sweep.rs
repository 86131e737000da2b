//! The runs of a study: side by side, each into a folder of its own; those that begin alike go their common steps once, and what is the image of
//! another run is made of that one.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::Instant;

use super::compute::{Job, Nobody, nothing};
use super::fork::{Forks, Shares};
use super::image::{ForImages, Original, most_bytes};
use super::queue::{Known, Queue, Taken};
use super::resume::{Checkpoints, Start, recall, start};
use super::{STACK, run, summary};
use crate::error::{Error, Result, exit};
use crate::fem::FlexibilityCache;
use crate::history::image::Recording;
use crate::results::output::{OutputDir, SUMMARY, failure, write_atomically};
use crate::results::report::forget_report;
use crate::results::summary::{Status, Summary};
use crate::scene::{self, Plan};
use crate::skip::Work;
use crate::study::sweep::plots::pictures;
use crate::study::sweep::share::{Share, share};
use crate::study::sweep::table::{RunResult, StudyResult};
use crate::study::sweep::{ImageOf, RunSpec, Sweep};
use crate::study::{Failure, forecast};

/// Why a folder does not count.
const OTHER: &str = "what is in its folder is of another scene, other values or another version, or older than a file that the scene names";

/// A study and how it is run.
pub struct StudyJob<'a> {
    /// The study.
    pub sweep: &'a Sweep,
    /// Where the folders of the runs are.
    pub directory: &'a Path,
    /// Flexibilities of meshed bodies that are kept.
    pub cache: Option<&'a FlexibilityCache>,
    /// Whether to stop.
    pub stop: &'a AtomicBool,
    /// Whether to leave what has converged, and to go on with what is unfinished.
    pub resume: bool,
}

/// What the runs of a study came to.
#[derive(Debug, Default)]
pub struct StudyEnded {
    /// All of its runs, in its order; those that were not run have no status.
    pub runs: Vec<RunResult>,
    /// The gravest exit code.
    pub code: u8,
    /// Number of runs that were left as they were.
    pub kept: usize,
    /// Number of runs that were made of those that they are images of.
    pub images: usize,
    /// Why runs could not be begun.
    pub problems: Vec<String>,
}

/// A run that ended.
struct RunEnded {
    number: usize,
    result: RunResult,
    code: u8,
    kept: bool,
    image: bool,
}

/// What a worker says.
enum Said {
    Ended(Box<RunEnded>),
    Problem(String),
}

impl StudyJob<'_> {
    /// How the runs of these numbers share `threads` and what memory there is.
    pub fn share(&self, numbers: &[usize], threads: usize) -> Share {
        let runs = &self.sweep.runs;
        // Images are made one after the other from what is computed.
        let computed = numbers.iter().map(|&number| runs[number].image_of.map_or(number, |image| image.run));
        let computed: BTreeSet<usize> = computed.collect();
        let images = numbers.iter().any(|&number| runs[number].image_of.is_some());
        let entries = runs.first().filter(|_| images).map_or(0, |run| most_bytes(&run.memory));
        let needed = forecast(&self.sweep.first).ok().map(|forecast| forecast.memory_bytes + entries as f64);
        let free = runs.first().and_then(|run| run.memory.remaining());
        share(computed.len(), threads, needed, free)
    }

    /// Runs those of these numbers; `show` hears of each that ends how many have.
    pub fn run(&self, numbers: &[usize], shared: Share, show: &mut dyn FnMut(usize)) -> StudyEnded {
        let runs = (0..self.sweep.runs.len()).map(|number| RunResult::new(self.sweep, number)).collect();
        let mut ended = StudyEnded { runs, ..StudyEnded::default() };
        let queue = Queue::new(&self.sweep.runs, numbers);
        let (sender, receiver) = channel();
        std::thread::scope(|scope| {
            for _ in 0..shared.side_by_side {
                let (sender, queue) = (sender.clone(), &queue);
                let builder = std::thread::Builder::new().stack_size(STACK);
                let work = move || self.worker(shared.threads, queue, &sender);
                if let Err(error) = builder.spawn_scoped(scope, work) {
                    ended.problems.push(format!("no thread for a run: {error}"));
                }
            }
            drop(sender);
            let mut done = 0;
            for said in &receiver {
                match said {
                    Said::Problem(problem) => ended.problems.push(problem),
                    Said::Ended(one) => {
                        let RunEnded { number, result, code, kept, image } = *one;
                        ended.runs[number] = result;
                        ended.code = exit::worse(ended.code, code);
                        ended.kept += usize::from(kept);
                        ended.images += usize::from(image);
                        done += 1;
                        show(done);
                    }
                }
            }
        });
        let unknown = numbers.iter().any(|&number| ended.runs[number].status.is_none());
        if self.stop.load(Ordering::Relaxed) {
            ended.code = exit::INTERRUPTED;
        } else if unknown {
            ended.code = exit::worse(ended.code, exit::FAILED);
        }
        ended
    }

    /// Takes one run after the other until there is none left.
    fn worker(&self, threads: usize, queue: &Queue, said: &Sender<Said>) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).stack_size(STACK).build();
        let pool = match pool {
            Ok(pool) => pool,
            Err(error) => {
                // Whoever listens has gone only with the study.
                let _ = said.send(Said::Problem(format!("no threads for a run: {error}")));
                return;
            }
        };
        while let Some(taken) = queue.take(self.stop) {
            let ended = pool.install(|| match taken.hidden {
                true => {
                    self.hidden(&taken);
                    None
                }
                false => Some(self.one(&taken)),
            });
            drop(taken);
            let Some(ended) = ended else { continue };
            if said.send(Said::Ended(Box::new(ended))).is_err() {
                return;
            }
        }
    }

    fn one(&self, taken: &Taken<'_>) -> RunEnded {
        let started = Instant::now();
        let number = taken.number;
        let mut result = RunResult::new(self.sweep, number);
        let mut summary = Summary::new(&self.sweep.title, "", self.sweep.units.clone());
        let mut kept = false;
        let code = self.compute(taken, &mut summary, &mut kept).unwrap_or_else(|failed| {
            if summary.error.is_none() {
                summary.fail(&failed.error);
            }
            failed.error.exit_code()
        });
        let seconds = if kept { summary.timings.sum() } else { started.elapsed().as_secs_f64() };
        result.take(self.sweep, &summary, seconds);
        let image = summary.skipped.iter().any(|entry| entry.work == Work::Image);
        RunEnded { number, result, code, kept, image }
    }

    fn compute(
        &self,
        taken: &Taken<'_>,
        summary: &mut Summary,
        kept: &mut bool,
    ) -> std::result::Result<u8, Failure> {
        let spec = &self.sweep.runs[taken.number];
        let unkeyed = |error: Error| Failure { error, key: String::new() };
        let plan = self.plan(taken.queue, spec).map_err(unkeyed)?;
        *summary = super::summary(&plan);
        let directory = self.directory.join(&spec.folder);
        if self.resume && recall(&plan, &directory, &[Status::Converged], summary) {
            *kept = true;
            return Ok(exit::DONE);
        }
        let mut output = OutputDir::open(&directory).map_err(unkeyed)?;
        let mut checkpoints = Checkpoints::of(&plan).map_err(unkeyed)?;
        if self.resume && plan.accuracy.is_none() {
            let begun = start(&plan, &checkpoints.origin, (&mut output, summary), &mut |_| {});
            if let Start::From(resumed) = begun.map_err(unkeyed)? {
                checkpoints.from = Some(resumed);
            }
        }
        let anew = checkpoints.from.is_none();
        let recording = spec.image_of.filter(|_| anew).and_then(|image| self.recording(taken, image));
        let original = spec.image_of.zip(recording.as_deref()).map(|(image, recording)| {
            let folder = self.sweep.runs[image.run].folder.as_str();
            Original { recording, symmetry: image.symmetry, folder }
        });
        let mut forks = Forks { after: taken.after.clone(), made: Vec::new() };
        let mut for_images = taken.records.then(|| ForImages::within(&plan.memory));
        let from = taken.from.as_deref();
        let shares = Shares { from, forks: Some(&mut forks), for_images: for_images.as_mut(), original };
        let code = self.run_alone(&plan, (Some(output), Some(checkpoints)), summary, shares);
        taken.leave(forks.made, for_images);
        code
    }

    /// A run that is not wanted but for its images: without files.
    fn hidden(&self, taken: &Taken<'_>) {
        if self.resume && taken.images().all(|number| self.is_done(number)) {
            return;
        }
        let Ok(plan) = self.plan(taken.queue, &self.sweep.runs[taken.number]) else { return };
        let mut forks = Forks { after: taken.after.clone(), made: Vec::new() };
        let mut for_images = ForImages::within(&plan.memory);
        let from = taken.from.as_deref();
        let shares =
            Shares { from, forks: Some(&mut forks), for_images: Some(&mut for_images), original: None };
        // What is wrong with it is told by its images.
        let _ = self.run_alone(&plan, (None, None), &mut super::summary(&plan), shares);
        taken.leave(forks.made, Some(for_images));
    }

    /// Whether a run has converged before.
    fn is_done(&self, number: usize) -> bool {
        let spec = &self.sweep.runs[number];
        let directory = self.directory.join(&spec.folder);
        plan(self.sweep, spec)
            .is_ok_and(|plan| recall(&plan, &directory, &[Status::Converged], &mut super::summary(&plan)))
    }

    /// Runs a plan of which nobody hears before it ends.
    fn run_alone(
        &self,
        plan: &Plan,
        (output, checkpoints): (Option<OutputDir>, Option<Checkpoints>),
        summary: &mut Summary,
        shares: Shares<'_>,
    ) -> std::result::Result<u8, Failure> {
        let show = &mut |_: &str, _: f64, _: Option<f64>| {};
        let (watch, complete) = (&mut Nobody, &mut nothing);
        let job = Job { frame: None, show, watch, stop: self.stop, checkpoints, shares, complete };
        run(plan, output, summary, job)
    }

    /// The plan of a run, with what all runs share.
    fn plan(&self, queue: &Queue, spec: &RunSpec) -> Result<Plan> {
        let mut plan = plan(self.sweep, spec)?;
        plan.cache = self.cache.cloned();
        plan.kernels = Some(queue.kernels.clone());
        Ok(plan)
    }

    /// What a run is an image of: that run's results, which are computed once more where it was left as it was or went on from a checkpoint; `None`
    /// where there are none.
    fn recording(&self, taken: &Taken<'_>, image: ImageOf) -> Option<Arc<Recording>> {
        match &taken.original {
            Known::Recording(recording) => return Some(recording.clone()),
            Known::NoImages => return None,
            Known::Nothing => {}
        }
        let plan = self.plan(taken.queue, &self.sweep.runs[image.run]).ok()?;
        let mut for_images = ForImages::within(&plan.memory);
        let shares = Shares { for_images: Some(&mut for_images), ..Shares::default() };
        // What is wrong with it is told by its own run, and by this one.
        let _ = self.run_alone(&plan, (None, None), &mut super::summary(&plan), shares);
        taken.queue.keep(image.run, for_images.made()?)
    }

    /// Collects the runs from their folders, whatever made them; none is begun.
    pub fn collect(&self) -> StudyEnded {
        let mut ended = StudyEnded::default();
        for (number, spec) in self.sweep.runs.iter().enumerate() {
            let mut result = RunResult::new(self.sweep, number);
            let folder = self.directory.join(&spec.folder);
            let found = plan(self.sweep, spec).ok().and_then(|plan| {
                let mut summary = summary(&plan);
                recall(&plan, &folder, &Status::ALL, &mut summary).then_some(summary)
            });
            if found.is_none() && folder.join(SUMMARY).exists() {
                result.reason = Some(OTHER.to_owned());
            }
            let code = match found {
                None => exit::FAILED,
                Some(summary) => {
                    result.take(self.sweep, &summary, summary.timings.sum());
                    ended.kept += 1;
                    match summary.status {
                        Status::Converged => exit::DONE,
                        Status::NotConverged => exit::NOT_CONVERGED,
                        Status::Failed => exit::FAILED,
                        Status::Interrupted => exit::INTERRUPTED,
                    }
                }
            };
            ended.code = exit::worse(ended.code, code);
            ended.runs.push(result);
        }
        ended
    }

    /// Writes the table and the pictures of the study; `study.json` last.
    ///
    /// # Errors
    /// Resources, if a file cannot be written.
    pub fn write(&self, result: &StudyResult) -> Result<()> {
        let json = result.to_json()?;
        write_atomically(&self.directory.join("study.csv"), result.to_csv().as_bytes())?;
        write_atomically(&self.directory.join("study.npz"), &result.to_npz()?)?;
        for (name, picture) in pictures(self.sweep, result) {
            write_atomically(&self.directory.join(name), picture.as_bytes())?;
        }
        forget_report(self.directory);
        write_atomically(&self.directory.join("study.json"), json.as_bytes())
    }

    /// Looks for the directory.
    ///
    /// # Errors
    /// Input, if there is none.
    pub fn find_directory(&self) -> Result<()> {
        let place = self.directory.display();
        let none = || Error::input(format!("there is no folder {place}; name that of the runs with --out"));
        self.directory.is_dir().then_some(()).ok_or_else(none)
    }

    /// Makes the directory.
    ///
    /// # Errors
    /// Input, if it is a file; resources, if it cannot be made.
    pub fn make_directory(&self) -> Result<()> {
        let place = self.directory;
        if place.exists() && !place.is_dir() {
            return Err(Error::input(format!(
                "the output directory {} is a file; name a directory with --out",
                place.display()
            )));
        }
        std::fs::create_dir_all(place).map_err(|e| failure("cannot make the output directory", place, &e))
    }
}

/// The plan of a run. Its scene was right when the study was read; what has changed since then is told.
fn plan(sweep: &Sweep, spec: &RunSpec) -> Result<Plan> {
    let mut plan = scene::read(&sweep.scene, &spec.overrides).map_err(|mistakes| mistakes.to_error())?;
    plan.memory = spec.memory;
    Ok(plan)
}
