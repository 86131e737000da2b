//! Checks of the prescribed controls of steps, mainly on unconstrained bodies.

use nalgebra::Vector3;

use crate::body::rigid_body_modes::{have_common_motion, relative_motion, unconstrained_translations};
use crate::coupling::Coupling;
use crate::error::Error;
use crate::evolution::step::{Drive, Normal, Spin, Step, StepKind, Tangential, Tilt};
use crate::fem::RigidBodyModes;
use crate::frame::ContactFrame;
use crate::scene::plan::{MeshedBodyPlan, Plan};
use crate::simulation::failure::{SceneError, step_key};
use crate::simulation::plan_bodies::{BODY_KEYS, SIDES, free_motions};
use crate::simulation::validate::symmetry_planes::{self, ROUNDING_SHARE};

/// Refuses friction on an unconstrained boundary-element body. Slip is measured from the position before contact, which
/// such a body does not have.
fn refuse_friction_on_unconstrained_be(
    plan: &Plan,
    index: usize,
    motions: &RigidBodyModes,
) -> Result<(), SceneError> {
    if plan.bodies[index].as_be().is_none() || plan.friction.ellipse().is_none() {
        return Ok(());
    }
    let error = Error::input(format!(
        "{} is a boundary-element body with unconstrained rigid-body modes ({}), which friction does not allow: its position before contact, from which slip is measured, is not determined. Support the body (`fixed`, `symmetry`), use kind = \"fe\", or remove friction",
        BODY_KEYS[index],
        motion_names(motions)
    ));
    Err(SceneError { error, key: BODY_KEYS[index].to_owned() })
}

/// Refuses controls that the model cannot satisfy:
///
/// - moments about an axis that contains all cell centres,
/// - loads and motions that contradict a symmetry plane,
/// - two bodies that can move together as one rigid body,
/// - on unconstrained bodies: rotations, moments, displacements along unconstrained directions, the block system, and
///   friction on boundary elements.
///
/// Displacements that later steps keep need no check, because the check refuses the step that prescribes them.
///
/// # Errors
/// If a control is impossible. The error has the key of the first impossible control.
pub(crate) fn refuse_impossible_controls(plan: &Plan, frame: &ContactFrame) -> Result<(), SceneError> {
    refuse_moments_without_lever(plan, frame)?;
    symmetry_planes::refuse_symmetry_contradictions(plan, frame)?;
    let mut floating = Vec::new();
    for (index, key) in BODY_KEYS.into_iter().enumerate() {
        if let Some(motions) = free_motions(&plan.bodies[index], key)? {
            refuse_friction_on_unconstrained_be(plan, index, &motions)?;
            let relative = |j: usize| relative_motion(&motions, j, frame, SIDES[index]);
            let relative = (0..motions.n_modes()).map(relative).collect();
            floating.push(UnconstrainedBody { index, motions, relative });
        }
    }
    let Some(UnconstrainedBody { index, motions, .. }) = floating.first() else { return Ok(()) };
    if plan.solver.coupling == Coupling::Block {
        let error = Error::input(format!(
            "{} has unconstrained rigid-body modes ({}), but the block system needs fixed bodies: use \"schur\", or support the body",
            SIDES[*index].name(),
            motions.names.join(", ")
        ));
        return Err(SceneError { error, key: "solver.coupling".to_owned() });
    }
    if let [lower, upper] = &floating[..]
        && have_common_motion(&lower.relative, &upper.relative, frame.size())
    {
        let error = Error::input(format!(
            "both bodies are unconstrained and can move together without force (body 1 by {}; body 2 by {}), so that their position is not determined. Fix more components in the supports of one body",
            motion_names(&lower.motions),
            motion_names(&upper.motions)
        ));
        return Err(SceneError { error, key: BODY_KEYS[1].to_owned() });
    }
    refuse_undetermined_displacements(plan, frame, &floating)
}

struct UnconstrainedBody {
    index: usize,
    motions: RigidBodyModes,
    /// [`relative_motion`] of each mode.
    relative: Vec<[f64; 6]>,
}

fn refuse_undetermined_displacements(
    plan: &Plan,
    frame: &ContactFrame,
    floating: &[UnconstrainedBody],
) -> Result<(), SceneError> {
    let all: Vec<[f64; 6]> = floating.iter().flat_map(|body| &body.relative).copied().collect();
    let free = unconstrained_translations(&all, frame.size());
    let supports: Vec<String> =
        floating.iter().map(|body| format!("`{}.fixed`", BODY_KEYS[body.index])).collect();
    let loaded = plan.bodies.iter().any(|body| body.as_meshed().is_some_and(MeshedBodyPlan::is_loaded));
    let describe = |body: &UnconstrainedBody| {
        format!("{} is unconstrained: {}", SIDES[body.index].name(), motion_names(&body.motions))
    };
    let who: Vec<String> = floating.iter().map(describe).collect();
    plan.steps.iter().enumerate().try_for_each(|(index, step)| {
        if let Some(key) = rotation_key(step) {
            let error = Error::input(format!(
                "step \"{}\" prescribes a rotation or a moment, which needs fixed bodies ({}): support the body, or remove `{key}`",
                step.name,
                who.join("; ")
            ));
            return Err(SceneError { error, key: step_key(&plan.steps, index, key) });
        }
        let Some((key, instead)) = displacement_along_free_direction(step, &free, loaded) else {
            return Ok(());
        };
        let error = Error::input(format!(
            "step \"{}\" prescribes a displacement along a direction in which the body is unconstrained ({}). Only loads determine its position along this direction; {instead}, or support the body along this direction ({})",
            step.name,
            who.join("; "),
            supports.join(", ")
        ));
        Err(SceneError { error, key: step_key(&plan.steps, index, key) })
    })
}

/// Refuses a moment about an axis that contains all cell centres, because neither pressures nor friction resist this
/// moment. Frames with inclined cells are not checked.
fn refuse_moments_without_lever(plan: &Plan, frame: &ContactFrame) -> Result<(), SceneError> {
    if !frame.has_uniform_axes() {
        return Ok(());
    }
    let mut reach = [0.0_f64; 2];
    for [x, y] in (0..frame.n_cells()).map(|cell| frame.plane_coordinates(cell)) {
        reach = [reach[0].max(x.abs()), reach[1].max(y.abs())];
    }
    let least = ROUNDING_SHARE * frame.size();
    for (index, step) in plan.steps.iter().enumerate() {
        let [about_x, about_y] = if let Some(Tilt::Moment(moment)) = step.tilt { moment } else { [0.0; 2] };
        let about_n = if let Some(Spin::Moment(moment)) = step.spin { moment } else { 0.0 };
        let loads = [
            ("x", "moment", about_x, reach[1]),
            ("y", "moment", about_y, reach[0]),
            ("n", "spin_moment", about_n, reach[0].max(reach[1])),
        ];
        for (axis, key, moment, lever) in loads {
            if moment != 0.0 && lever <= least {
                let error = Error::input(format!(
                    "step \"{}\" prescribes a moment about {axis}, but the centres of all cells lie on this axis, so that nothing resists it; use a frame with more cells across, or remove `{key}`",
                    step.name
                ));
                return Err(SceneError { error, key: step_key(&plan.steps, index, key) });
            }
        }
    }
    Ok(())
}

fn rotation_key(step: &Step) -> Option<&'static str> {
    let tilt = step.tilt.map(|tilt| match tilt {
        Tilt::Rotation(_) => "rotation",
        Tilt::Moment(_) => "moment",
    });
    let spin = step.spin.map(|spin| match spin {
        Spin::Twist(_) => "twist",
        Spin::Moment(_) => "spin_moment",
    });
    tilt.or(spin)
}

/// Key of a displacement of `step` along one of the `free` translations, and the control to use instead. `loaded`
/// states whether a body has its own loads. Forces of the step are added to these loads.
fn displacement_along_free_direction(
    step: &Step,
    free: &[Vector3<f64>],
    loaded: bool,
) -> Option<(&'static str, &'static str)> {
    let along = |direction: Vector3<f64>| {
        free.iter().any(|free| free.dot(&direction).abs() > ROUNDING_SHARE * direction.norm())
    };
    if matches!(step.normal, Some(Normal::Approach(_))) && along(Vector3::z()) {
        return Some((
            "approach",
            if loaded {
                "prescribe `normal_force`, which is added to these loads, or remove the key"
            } else {
                "prescribe `normal_force`"
            },
        ));
    }
    if let Some(Tangential::Shift([x, y])) = step.tangential
        && along(Vector3::new(x, y, 0.0))
    {
        return Some((
            "shift",
            if loaded {
                "prescribe `tangential_force`, which is added to these loads, or remove the key"
            } else {
                "prescribe `tangential_force`"
            },
        ));
    }
    let (key, moved) = match &step.kind {
        StepKind::Fretting { path, .. } if path.drive == Drive::Shift => ("cycles", path.offsets()),
        StepKind::Sliding { angle, .. } => ("sliding", vec![[angle.cos(), angle.sin()]]),
        _ => return None,
    };
    let moves = moved.iter().any(|[x, y]| along(Vector3::new(*x, *y, 0.0)));
    moves.then_some((key, "move the supports of the other body"))
}

fn motion_names(motions: &RigidBodyModes) -> String {
    if motions.names.len() == 6 {
        return "translations along x, y and z, and rotations about x, y and z".to_owned();
    }
    motions.names.join(", ")
}
