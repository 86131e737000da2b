//! Moves meshes with wear, so that the stiffness follows the decreasing thickness of the bodies.
//!
//! Wear always changes the gap on the frame. With `wear.move_mesh`, the worn bodies are also rebuilt with moved meshes. This
//! happens whenever the wear depth since the last motion exceeds a share of the element height ([`WearBudget`]).

use crate::body::FeBody;
use crate::body::worn_mesh::element_height_at_nodes;
use crate::error::{Error, Result};
use crate::evolution::{PreviousModel, RunCheckpoint};
use crate::geometry::format_number;
use crate::output::checkpoint_writer::MeshUpdates;
use crate::scene::plan::Plan;
use crate::simulation::build::Simulation;
use crate::simulation::plan_bodies::{BODY_KEYS, worn_bodies};

/// Wear depths at which the meshes move next.
#[derive(Debug, Clone)]
pub struct WearBudget {
    /// Wear depth at the last mesh motion, sum of both bodies, `[N]`, mm.
    worn_at_last_move: Vec<f64>,
    /// Additional wear depth beyond which the meshes move, sum of both bodies, `[N]`, mm.
    allowed_depth: Vec<f64>,
}

impl WearBudget {
    /// Budget of `simulation` after the mesh motions `moves`. `None` if the scene requests no mesh motion, or if the
    /// motion has stopped.
    ///
    /// # Errors
    /// If the contact group of a body is invalid.
    pub fn new(plan: &Plan, simulation: &Simulation, moves: &MeshUpdates) -> Result<Option<Self>> {
        let Some(share) = plan.mesh_motion_threshold.filter(|_| !moves.stopped) else { return Ok(None) };
        let n = simulation.model().frame.n_cells();
        let mut allowed_depth = vec![f64::INFINITY; n];
        for (index, fe, part) in worn_bodies(plan) {
            let heights = element_height_at_nodes(&fe.mesh, &fe.contact)?;
            let Some(map) = simulation.fe_body(index).map(FeBody::map) else { continue };
            for (cell, depth) in allowed_depth.iter_mut().enumerate() {
                let behind = map.row(cell).map(|(node, _)| heights[map.nodes()[node]]);
                *depth = behind.map(|height| share * height / part).fold(*depth, f64::min);
            }
        }
        let worn_at_last_move = if moves.wear_depth_at_last_update.is_empty() {
            vec![0.0; n]
        } else {
            moves.wear_depth_at_last_update.clone()
        };
        Ok(Some(Self { worn_at_last_move, allowed_depth }))
    }

    /// Whether the wear depth `worn` of both bodies (`[N]`, mm) exceeds the budget in a cell.
    pub fn is_exceeded(&self, worn: &[f64]) -> bool {
        worn.iter()
            .zip(&self.worn_at_last_move)
            .zip(&self.allowed_depth)
            .any(|((worn, before), depth)| worn - before > *depth)
    }
}

/// State from which a run continues with moved meshes.
pub struct StiffnessUpdate {
    previous: PreviousModel,
    checkpoint: RunCheckpoint,
}

impl Simulation<'_> {
    /// Keeps the data to continue from `checkpoint` with moved meshes. Bodies and operators are dropped.
    pub fn into_stiffness_update(self, checkpoint: RunCheckpoint) -> StiffnessUpdate {
        StiffnessUpdate { previous: PreviousModel::of(self.model()), checkpoint }
    }
}

impl StiffnessUpdate {
    /// Transfers the state to the bodies of `simulation`, and adds a note.
    ///
    /// # Errors
    /// As [`RunCheckpoint::transfer_to`].
    pub fn transfer_to(self, plan: &Plan, simulation: &Simulation) -> Result<RunCheckpoint> {
        let places: Vec<usize> = (0..self.checkpoint.n_cells()).collect();
        let mut checkpoint =
            self.checkpoint.transfer_to(&places, simulation.model(), &plan.steps, Some(&self.previous))?;
        let deepest = checkpoint.wear_depth().iter().copied().fold(0.0, f64::max);
        let moved = worn_bodies(plan).map(|(index, _, part)| {
            format!("{} by up to {} {}", BODY_KEYS[index], format_number(part * deepest), plan.units.length)
        });
        let moved: Vec<String> = moved.collect();
        checkpoint.add_warning(format!(
            "the mesh was moved with wear{}: {}",
            position_in_run(plan, &checkpoint),
            moved.join(", ")
        ));
        Ok(checkpoint)
    }
}

/// Warning that the meshes no longer move with wear, with the reason.
pub fn mesh_not_moved_warning(plan: &Plan, checkpoint: &RunCheckpoint, error: &Error) -> String {
    format!(
        "the mesh is no longer moved with wear{}: {}; the run continues with the last stiffness of the bodies",
        position_in_run(plan, checkpoint),
        error.message()
    )
}

pub(super) fn position_in_run(plan: &Plan, checkpoint: &RunCheckpoint) -> String {
    checkpoint.records().last().map_or_else(String::new, |last| {
        let mut text = format!(" in step \"{}\" after entry {}", last.name, last.increment);
        if last.cycles_done > 0 {
            text.push_str(&format!(" ({} cycles)", last.cycles_done));
        }
        if last.distance_slid > 0.0 {
            let distance = format_number(last.distance_slid);
            text.push_str(&format!(" ({distance} {} of sliding)", plan.units.length));
        }
        text
    })
}
