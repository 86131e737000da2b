//! A run in the thread that computes.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};

use orthowear::error::{Error, Result};
use orthowear::frame::ContactFrame;
use orthowear::history::record::{FrameState, IncrementRecord, Observer};
use orthowear::interrupt;
use orthowear::job::resume::Checkpoints;
use orthowear::job::{self, Job, Shares, nothing};
use orthowear::results::output::OutputDir;
use orthowear::results::summary::Summary;
use orthowear::scene::Plan;
use orthowear::study::Failure;

use crate::engine::{Line, PAUSE};
use crate::fields::Fields;

/// What a run tells on its way.
pub enum Message {
    /// Stage, fraction done, residual.
    Progress(String, f64, Option<f64>),
    /// An increment or cycle jump.
    Entry(Box<(IncrementRecord, Fields)>),
}

/// What a run has come to.
pub struct Ended {
    pub summary: Summary,
    /// Those of the last entry.
    pub fields: Option<Fields>,
    pub failure: Option<Failure>,
}

/// Keeps the fields of the last entry, and hands each over where somebody asks for them.
struct Watcher<'a> {
    line: &'a Line<Message>,
    /// Each word asks for one more entry.
    asks: Option<Receiver<()>>,
    /// The frame that entries are on.
    frame: Option<ContactFrame>,
    fields: Option<Fields>,
}

impl Watcher<'_> {
    /// Waits until the entry is asked for; whether it is.
    fn is_asked(&self, asks: &Receiver<()>) -> bool {
        loop {
            match asks.recv_timeout(PAUSE) {
                Ok(()) => return true,
                Err(RecvTimeoutError::Disconnected) => return false,
                Err(RecvTimeoutError::Timeout) => {
                    let stop = self.line.stop.load(Ordering::Relaxed);
                    if stop || interrupt::flag().load(Ordering::Relaxed) {
                        return false;
                    }
                }
            }
        }
    }
}

impl Observer for Watcher<'_> {
    fn progress(&mut self, _stage: &str, _fraction: f64, _residual: Option<f64>) {}

    fn on_frame(&mut self, frame: &ContactFrame) {
        self.frame = Some(frame.clone());
    }

    fn increment_done(&mut self, record: &IncrementRecord, state: &FrameState) -> Result<()> {
        let Some(frame) = &self.frame else {
            return Err(Error::numerical("an entry without a frame"));
        };
        let fields = Fields { frame: frame.clone(), state: state.clone() };
        match &self.asks {
            Some(asks) if self.is_asked(asks) => {
                self.line.tell(Message::Entry(Box::new((record.clone(), fields))));
            }
            Some(_) => self.line.stop.store(true, Ordering::Relaxed),
            None => self.fields = Some(fields),
        }
        Ok(())
    }
}

/// How a plan is run.
pub struct Wishes {
    pub plan: Arc<Plan>,
    /// Directory of the results.
    pub out: Option<PathBuf>,
    /// Whether progress is told.
    pub progress: bool,
    /// Where entries are asked for one by one.
    pub asks: Option<Receiver<()>>,
}

/// Runs a plan as the command line does.
pub fn run(wishes: Wishes, line: &Line<Message>) -> Ended {
    let Wishes { plan, out, progress, asks } = wishes;
    let mut summary = job::summary(&plan);
    let mut watcher = Watcher { line, asks, frame: None, fields: None };
    let begun = match out {
        None => Ok((None, None)),
        Some(path) => {
            OutputDir::open(&path).and_then(|output| Ok((Some(output), Some(Checkpoints::of(&plan)?))))
        }
    };
    let failure = match begun {
        Err(error) => Some(Failure { error, key: String::new() }),
        Ok((output, checkpoints)) => {
            let show = &mut |stage: &str, done, residual| {
                if progress {
                    line.tell(Message::Progress(stage.to_owned(), done, residual));
                }
            };
            let job = Job {
                frame: None,
                show,
                watch: &mut watcher,
                stop: &line.stop,
                checkpoints,
                shares: Shares::default(),
                complete: &mut nothing,
            };
            job::run(&plan, output, &mut summary, job).err()
        }
    };
    Ended { summary, fields: watcher.fields, failure }
}
