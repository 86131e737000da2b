//! Transition between two run segments: a larger frame, or meshes moved with wear.

use std::sync::atomic::AtomicBool;

use crate::error::{ErrorKind, Result};
use crate::evolution::{RunCheckpoint, RunResult, Suspended};
use crate::frame::ContactFrame;
use crate::output::checkpoint_writer::MeshUpdates;
use crate::output::recorder::ProgressEvent;
use crate::scene::Plan;
use crate::simulation::failure::AtKey;
use crate::simulation::grown_frame::{self, why_not_growable};
use crate::simulation::mesh_motion;
use crate::simulation::worn_meshes::{WornMeshes, worn_meshes};
use crate::simulation::{self, SceneError, Simulation};

#[derive(Clone, Default)]
pub(super) struct RebuildState {
    pub frame_growths: usize,
    pub mesh_updates: MeshUpdates,
}

pub(super) enum Change {
    GrownFrame(RunCheckpoint),
    MovedMeshes(RunCheckpoint, WornMeshes),
    /// The meshes could not be moved. The run continues with the same operators.
    SameOperators(RunCheckpoint),
}

pub(super) enum Continuation {
    Rebuild(Box<Change>, RunResult),
    End(Result<RunResult>),
}

pub(super) struct Rebuilt<'p> {
    pub simulation: Simulation<'p>,
    pub checkpoint: RunCheckpoint,
    pub rebuilds: RebuildState,
    /// Indices of the old cells on the new frame, if the frame changed.
    pub cell_map: Option<Vec<usize>>,
}

pub(super) struct SimulationBuilder<'a, 'p> {
    pub plan: &'p Plan,
    /// Frame of another plan, which this run uses instead of the frame of its own plan.
    pub frame: Option<&'a ContactFrame>,
    pub show: &'a mut (dyn FnMut(ProgressEvent) + Send),
    pub stop: &'a AtomicBool,
}

impl<'p> SimulationBuilder<'_, 'p> {
    /// Builds the simulation with the worn meshes of `rebuilds`. The frame is the enlarged frame, if any; otherwise
    /// `self.frame`, if any; otherwise the frame of the plan.
    pub fn build(&mut self, rebuilds: &RebuildState) -> std::result::Result<Simulation<'p>, SceneError> {
        let larger = frame_of_state(self.plan, rebuilds)?;
        let frame = larger.as_ref().or(self.frame);
        let meshes = worn_meshes(self.plan, frame, &rebuilds.mesh_updates.wear_depth_at_last_update)?;
        simulation::build_with(self.plan, frame, meshes, self.show, self.stop)
    }

    fn grow_frame(
        &mut self,
        simulation: Simulation<'p>,
        checkpoint: RunCheckpoint,
        rebuilds: &RebuildState,
    ) -> std::result::Result<Rebuilt<'p>, SceneError> {
        let outgrown = simulation.into_frame_growth(checkpoint);
        let frame_growths = rebuilds.frame_growths + 1;
        let frame = grown_frame::grown_frame(self.plan, frame_growths)?;
        outgrown.ensure_half_spaces_fit(self.plan, &frame)?;
        let updates = rebuilds.mesh_updates.clone();
        let mesh_updates = match outgrown.frame.grid.zip(frame.grid) {
            Some((before, now)) => updates.transfer_to(&before.indices_in(&now), frame.n_cells()),
            None => updates,
        };
        let rebuilds = RebuildState { frame_growths, mesh_updates };
        let simulation = self.build(&rebuilds)?;
        let (checkpoint, cell_map) = outgrown.transfer_to(self.plan, &simulation).at("frame.grow")?;
        Ok(Rebuilt { simulation, checkpoint, rebuilds, cell_map: Some(cell_map) })
    }

    fn move_meshes(
        &mut self,
        simulation: Simulation<'p>,
        checkpoint: RunCheckpoint,
        rebuilds: &RebuildState,
        meshes: WornMeshes,
    ) -> std::result::Result<Rebuilt<'p>, SceneError> {
        let rebuilds = RebuildState {
            mesh_updates: rebuilds.mesh_updates.after_update(checkpoint.wear_depth()),
            ..*rebuilds
        };
        let larger = frame_of_state(self.plan, &rebuilds)?;
        let outdated = simulation.into_stiffness_update(checkpoint);
        let frame = larger.as_ref().or(self.frame);
        let simulation = simulation::build_with(self.plan, frame, meshes, self.show, self.stop)?;
        let checkpoint = outdated.transfer_to(self.plan, &simulation).at("wear.move_mesh")?;
        Ok(Rebuilt { simulation, checkpoint, rebuilds, cell_map: None })
    }

    /// Applies `change` after a segment. Returns the simulation of the next segment, and the state transferred to this
    /// simulation.
    pub fn rebuild(
        &mut self,
        simulation: Simulation<'p>,
        change: Change,
        rebuilds: &RebuildState,
    ) -> std::result::Result<Rebuilt<'p>, SceneError> {
        match change {
            Change::GrownFrame(checkpoint) => self.grow_frame(simulation, checkpoint, rebuilds),
            Change::MovedMeshes(checkpoint, meshes) => {
                self.move_meshes(simulation, checkpoint, rebuilds, meshes)
            }
            Change::SameOperators(checkpoint) => {
                let mesh_updates = MeshUpdates { stopped: true, ..rebuilds.mesh_updates.clone() };
                let rebuilds = RebuildState { mesh_updates, ..*rebuilds };
                Ok(Rebuilt { simulation, checkpoint, rebuilds, cell_map: None })
            }
        }
    }
}

fn frame_of_state(
    plan: &Plan,
    rebuilds: &RebuildState,
) -> std::result::Result<Option<ContactFrame>, SceneError> {
    (rebuilds.frame_growths > 0).then(|| grown_frame::grown_frame(plan, rebuilds.frame_growths)).transpose()
}

impl Continuation {
    /// Decides whether and how the run continues after a segment. A frame that several runs share (`shared`) never grows.
    pub fn after(
        result: Result<RunResult>,
        plan: &Plan,
        simulation: &Simulation,
        rebuilds: &RebuildState,
        shared: bool,
    ) -> Self {
        let mut result = match result {
            Ok(result) => result,
            Err(error) => return Self::End(Err(error)),
        };
        let mut checkpoint = match result.suspended.take() {
            None => return Self::End(Ok(result)),
            Some(Suspended::FrameEdge(checkpoint)) => {
                return Self::on_larger_frame(plan, *checkpoint, result, rebuilds, shared);
            }
            Some(Suspended::Rebuild(checkpoint)) => checkpoint,
        };
        match worn_meshes(plan, Some(&simulation.model().frame), checkpoint.wear_depth()) {
            Ok(meshes) => Self::Rebuild(Box::new(Change::MovedMeshes(*checkpoint, meshes)), result),
            Err(failure) if failure.error.kind() == ErrorKind::Interrupted => {
                Self::End(result.ended_by(failure.error))
            }
            Err(failure) => {
                let warning = mesh_motion::mesh_not_moved_warning(plan, &checkpoint, &failure.error);
                checkpoint.add_warning(warning);
                Self::Rebuild(Box::new(Change::SameOperators(*checkpoint)), result)
            }
        }
    }

    fn on_larger_frame(
        plan: &Plan,
        checkpoint: RunCheckpoint,
        result: RunResult,
        rebuilds: &RebuildState,
        shared: bool,
    ) -> Self {
        let refusal = match shared {
            true => Some(
                "the frame is not enlarged, because all variants of a comparison share one frame".to_owned(),
            ),
            false => why_not_growable(plan, rebuilds.frame_growths),
        };
        match refusal {
            Some(why) => Self::End(Ok(result.with_warning(why))),
            None => Self::Rebuild(Box::new(Change::GrownFrame(checkpoint)), result),
        }
    }
}
