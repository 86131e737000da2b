//! Transition between two run segments: a larger frame, or meshes moved with wear.

use std::sync::atomic::AtomicBool;

use crate::error::ErrorKind;
use crate::evolution::{RunCheckpoint, RunResult};
use crate::frame::ContactFrame;
use crate::output::checkpoint_writer::MeshUpdates;
use crate::output::recorder::ProgressEvent;
use crate::scene::Plan;
use crate::simulation::failure::AtKey;
use crate::simulation::grown_frame::{self, why_not_growable};
use crate::simulation::mesh_motion;
use crate::simulation::worn_meshes::{WornMeshes, worn_meshes};
use crate::simulation::{self, SceneError, Simulation};

/// Changes of frame and meshes so far.
#[derive(Clone, Default)]
pub(super) struct RebuildState {
    /// Number of frame enlargements.
    pub frame_growths: usize,
    /// Mesh motions with wear.
    pub mesh_updates: MeshUpdates,
}

/// Continuation of a run after a segment.
pub(super) enum Continuation {
    /// On a larger frame.
    GrownFrame(RunCheckpoint),
    /// With moved meshes.
    MovedMeshes(RunCheckpoint, WornMeshes),
    /// With the same operators.
    SameOperators(RunCheckpoint),
    /// The run ends, with a warning.
    Stop(String),
}

/// Next segment of a run.
pub(super) struct NextSegment<'p> {
    pub study: Simulation<'p>,
    pub snapshot: RunCheckpoint,
    pub stage: RebuildState,
    /// Indices of the old cells on the new frame, if the frame changed.
    pub cell_map: Option<Vec<usize>>,
}

/// Builds simulations on a given frame or the plan's frame.
pub(super) struct SimulationBuilder<'a> {
    /// Frame that was made for another plan and that this run also uses.
    pub frame: Option<&'a ContactFrame>,
    /// Receives progress events.
    pub show: &'a mut (dyn FnMut(ProgressEvent) + Send),
    /// Cancellation flag.
    pub stop: &'a AtomicBool,
}

impl SimulationBuilder<'_> {
    /// Builds the simulation of the plan with the meshes as moved so far. Its frame is the plan's frame as enlarged so far, or the
    /// shared frame.
    pub fn build<'p>(
        &mut self,
        plan: &'p Plan,
        stage: &RebuildState,
    ) -> std::result::Result<Simulation<'p>, SceneError> {
        let larger = frame_of_state(plan, stage)?;
        let frame = larger.as_ref().or(self.frame);
        let meshes = worn_meshes(plan, frame, &stage.mesh_updates.wear_depth_at_last_update)?;
        simulation::build_with(plan, (frame, meshes), self.show, self.stop)
    }

    fn grow_frame<'p>(
        &mut self,
        plan: &'p Plan,
        (study, snapshot): (Simulation<'p>, RunCheckpoint),
        stage: &RebuildState,
    ) -> std::result::Result<NextSegment<'p>, SceneError> {
        let outgrown = study.into_frame_growth(snapshot);
        let frame_growths = stage.frame_growths + 1;
        let frame = grown_frame::grown_frame(plan, frame_growths)?;
        outgrown.ensure_half_spaces_fit(plan, &frame)?;
        let moves = stage.mesh_updates.clone();
        let mesh_updates = match outgrown.frame.grid.zip(frame.grid) {
            Some((before, now)) => moves.transfer_to(&before.indices_in(&now), frame.n_cells()),
            None => moves,
        };
        let stage = RebuildState { frame_growths, mesh_updates };
        let study = self.build(plan, &stage)?;
        let onto = outgrown.transfer_to(plan, &study);
        let (snapshot, places) = onto.at("frame.grow")?;
        Ok(NextSegment { study, snapshot, stage, cell_map: Some(places) })
    }

    fn move_meshes<'p>(
        &mut self,
        plan: &'p Plan,
        (study, snapshot): (Simulation<'p>, RunCheckpoint),
        (stage, meshes): (&RebuildState, WornMeshes),
    ) -> std::result::Result<NextSegment<'p>, SceneError> {
        let stage =
            RebuildState { mesh_updates: stage.mesh_updates.after_update(snapshot.wear_depth()), ..*stage };
        let larger = frame_of_state(plan, &stage)?;
        let outdated = study.into_stiffness_update(snapshot);
        let frame = larger.as_ref().or(self.frame);
        let study = simulation::build_with(plan, (frame, meshes), self.show, self.stop)?;
        let onto = outdated.transfer_to(plan, &study);
        let snapshot = onto.at("wear.move_mesh")?;
        Ok(NextSegment { study, snapshot, stage, cell_map: None })
    }

    /// Builds the next segment of a run. `study` is the simulation of the previous segment, `way` the continuation, which must not
    /// be `Stop`.
    ///
    /// # Errors
    /// If the next simulation cannot be built, the state cannot be transferred to it, or the run was cancelled meanwhile.
    pub fn build_next<'p>(
        &mut self,
        plan: &'p Plan,
        (study, way): (Simulation<'p>, Continuation),
        stage: &RebuildState,
    ) -> std::result::Result<NextSegment<'p>, SceneError> {
        match way {
            Continuation::GrownFrame(snapshot) => self.grow_frame(plan, (study, snapshot), stage),
            Continuation::MovedMeshes(snapshot, meshes) => {
                self.move_meshes(plan, (study, snapshot), (stage, meshes))
            }
            Continuation::SameOperators(snapshot) => {
                let mesh_updates = MeshUpdates { stopped: true, ..stage.mesh_updates.clone() };
                let stage = RebuildState { mesh_updates, ..*stage };
                Ok(NextSegment { study, snapshot, stage, cell_map: None })
            }
            Continuation::Stop(_) => unreachable!("a run that stops has no next part"),
        }
    }
}

/// Enlarged frame of `stage`; `None` if it has not grown.
fn frame_of_state(
    plan: &Plan,
    stage: &RebuildState,
) -> std::result::Result<Option<ContactFrame>, SceneError> {
    (stage.frame_growths > 0).then(|| grown_frame::grown_frame(plan, stage.frame_growths)).transpose()
}

impl Continuation {
    /// Decides after a segment how the run continues; `None` if it is finished. A frame of several runs (`shared`) never grows.
    ///
    /// # Errors
    /// If the run was cancelled meanwhile.
    pub fn after(
        result: &mut RunResult,
        (plan, study): (&Plan, &Simulation),
        (stage, shared): (&RebuildState, bool),
    ) -> std::result::Result<Option<Self>, SceneError> {
        if let Some(snapshot) = result.frame_edge_checkpoint.take() {
            let refusal = match shared {
                true => Some(
                    "the frame is not enlarged, because all variants of a comparison share one frame"
                        .to_owned(),
                ),
                false => why_not_growable(plan, stage.frame_growths),
            };
            return Ok(Some(refusal.map_or(Self::GrownFrame(*snapshot), Self::Stop)));
        }
        let Some(mut snapshot) = result.rebuild_checkpoint.take() else { return Ok(None) };
        Ok(Some(match worn_meshes(plan, Some(&study.model().frame), snapshot.wear_depth()) {
            Ok(meshes) => Self::MovedMeshes(*snapshot, meshes),
            Err(failure) if failure.error.kind() == ErrorKind::Interrupted => return Err(failure),
            Err(failure) => {
                snapshot.add_warning(mesh_motion::mesh_not_moved_warning(plan, &snapshot, &failure.error));
                Self::SameOperators(*snapshot)
            }
        }))
    }
}
