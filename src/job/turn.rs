//! Between two parts of a run: a larger frame, or meshes that have moved.

use std::sync::atomic::AtomicBool;

use crate::error::Kind;
use crate::frame::ContactFrame;
use crate::history::{RunResult, Snapshot};
use crate::results::keeper::Moves;
use crate::scene::Plan;
use crate::study::grow;
use crate::study::moving::{self, Meshes};
use crate::study::{self, Failure, Study};

/// What has become of frame and meshes.
#[derive(Clone, Default)]
pub(super) struct Stage {
    /// How often the frame was enlarged.
    pub growths: usize,
    /// How the meshes moved with wear.
    pub moves: Moves,
}

/// How a run goes on.
pub(super) enum Way {
    /// On a larger frame.
    Larger(Snapshot),
    /// With moved meshes.
    Moved(Snapshot, Meshes),
    /// With the same operators.
    Same(Snapshot),
    /// Not at all, with what the user should know.
    End(String),
    /// Not now: a signal came.
    Interrupted,
}

/// The next part of a run.
pub(super) struct Next<'p> {
    pub study: Study<'p>,
    pub snapshot: Snapshot,
    pub stage: Stage,
    /// Numbers there of the cells so far, where the frame is another one.
    pub places: Option<Vec<usize>>,
}

/// A study on frame and meshes that are given, or the plan's.
pub(super) struct Maker<'a> {
    /// The frame, if it was made for another plan.
    pub frame: Option<&'a ContactFrame>,
    /// Shows stage, fraction done, residual.
    pub show: &'a mut (dyn FnMut(&str, f64, Option<f64>) + Send),
    /// Whether to stop.
    pub stop: &'a AtomicBool,
}

impl Maker<'_> {
    /// Makes the plan ready on its frame as it has grown, or that of the job, with the meshes as they have moved; `None` if a
    /// signal came meanwhile.
    pub fn ready<'p>(
        &mut self,
        plan: &'p Plan,
        stage: &Stage,
    ) -> std::result::Result<Option<Study<'p>>, Failure> {
        let larger = if stage.growths > 0 { Some(grow::frame(plan, stage.growths)?) } else { None };
        let frame = larger.as_ref().or(self.frame);
        let meshes = moving::meshes(plan, frame, &stage.moves.worn)?;
        let show = &mut |stage: &str, done: f64| (self.show)(stage, done, None);
        study::prepare_worn(plan, (frame, meshes), show, self.stop)
    }

    fn larger<'p>(
        &mut self,
        plan: &'p Plan,
        (study, snapshot): (Study<'p>, Snapshot),
        stage: &Stage,
    ) -> std::result::Result<Option<Next<'p>>, Failure> {
        let outgrown = study.outgrown(snapshot);
        let growths = stage.growths + 1;
        let frame = grow::frame(plan, growths)?;
        outgrown.ensure_places(plan, &frame)?;
        let moves = stage.moves.clone();
        let moves = match outgrown.frame.grid.zip(frame.grid) {
            Some((before, now)) => moves.onto(&before.places_in(&now), frame.n_cells()),
            None => moves,
        };
        let stage = Stage { growths, moves };
        let Some(study) = self.ready(plan, &stage)? else { return Ok(None) };
        let onto = outgrown.onto(plan, &study);
        let (snapshot, places) = onto.map_err(|error| Failure { error, key: "frame.grow".to_owned() })?;
        Ok(Some(Next { study, snapshot, stage, places: Some(places) }))
    }

    fn moved<'p>(
        &mut self,
        plan: &'p Plan,
        (study, snapshot): (Study<'p>, Snapshot),
        (stage, meshes): (&Stage, Meshes),
    ) -> std::result::Result<Option<Next<'p>>, Failure> {
        let stage = Stage { moves: stage.moves.to(snapshot.worn()), ..*stage };
        let larger = if stage.growths > 0 { Some(grow::frame(plan, stage.growths)?) } else { None };
        let outdated = study.outdated(snapshot);
        let frame = larger.as_ref().or(self.frame);
        let show = &mut |stage: &str, done: f64| (self.show)(stage, done, None);
        let Some(study) = study::prepare_worn(plan, (frame, meshes), show, self.stop)? else {
            return Ok(None);
        };
        let onto = outdated.onto(plan, &study);
        let snapshot = onto.map_err(|error| Failure { error, key: "wear.move_mesh".to_owned() })?;
        Ok(Some(Next { study, snapshot, stage, places: None }))
    }

    /// Takes the way of a study that has ended there; `None` if a signal came meanwhile.
    ///
    /// # Errors
    /// If the next study cannot be made.
    pub fn take<'p>(
        &mut self,
        plan: &'p Plan,
        (study, way): (Study<'p>, Way),
        stage: &Stage,
    ) -> std::result::Result<Option<Next<'p>>, Failure> {
        match way {
            Way::Larger(snapshot) => self.larger(plan, (study, snapshot), stage),
            Way::Moved(snapshot, meshes) => self.moved(plan, (study, snapshot), (stage, meshes)),
            Way::Same(snapshot) => {
                let moves = Moves { over: true, ..stage.moves.clone() };
                let stage = Stage { moves, ..*stage };
                Ok(Some(Next { study, snapshot, stage, places: None }))
            }
            Way::End(_) | Way::Interrupted => Ok(None),
        }
    }
}

impl Way {
    /// How the run of `study` goes on from its end; `None` if that was the end of all. `shared`: the frame is that of several runs.
    pub fn of(
        result: &mut RunResult,
        (plan, study): (&Plan, &Study),
        (stage, shared): (&Stage, bool),
    ) -> Option<Self> {
        if let Some(snapshot) = result.outgrown.take() {
            let refusal = match shared {
                true => Some("a comparison has one frame for all".to_owned()),
                false => grow::refusal(plan, stage.growths),
            };
            return Some(refusal.map_or(Self::Larger(*snapshot), Self::End));
        }
        let mut snapshot = *result.outdated.take()?;
        Some(match moving::meshes(plan, Some(&study.model().frame), snapshot.worn()) {
            Ok(meshes) => Self::Moved(snapshot, meshes),
            Err(failure) if failure.error.kind() == Kind::Interrupted => Self::Interrupted,
            Err(failure) => {
                snapshot.tell(moving::stays(plan, &snapshot, &failure.error));
                Self::Same(snapshot)
            }
        })
    }
}
