//! Symmetry planes at the contact: finds the nodal cells on these planes, and refuses scenes that contradict the
//! symmetry.
//!
//! Supports fix the nodes on a symmetry plane along the normal of the plane. Therefore, the equations do not determine
//! a traction along this normal. By symmetry, the traction vanishes.

use nalgebra::Vector3;

use crate::error::Error;
use crate::evolution::step::{Drive, Normal, Spin, Step, StepKind, Tangential, Tilt};
use crate::fem::symmetry_component;
use crate::frame::ContactFrame;
use crate::frame::symmetry::SymmetryNodes;
use crate::geometry::{AXIS_NAMES, Point, Triad, format_direction, format_number};
use crate::mesh::faces::group_faces;
use crate::scene::plan::{BodyPlan, FramePlan, Plan, PrescribedDisplacement};
use crate::scene::spec::frame::FramePoints;
use crate::simulation::failure::{SceneError, step_key};
use crate::simulation::plan_bodies::{BODY_KEYS, SIDES};

/// Relative size below which a component of a vector, or a lever arm, results from rounding. The component is relative
/// to the vector's length, the lever arm to the frame's size.
pub(super) const ROUNDING_SHARE: f64 = 1e-9;

/// Largest distance of two coincident planes, relative to the size of the group.
const SAME_PLANE: f64 = 1e-6;

/// Largest angle between an axis of the friction ellipse and a symmetry plane that count as parallel, radians.
const MAX_MISALIGNMENT_RAD: f64 = 1e-9;

/// Group of coplanar faces of a body, with a prescribed displacement along their normal.
struct SupportPlane {
    key: String,
    is_symmetry: bool,
    /// Global axis along the normal.
    component: usize,
    /// Coordinate of the plane along the axis `component`, mm.
    coordinate: f64,
    /// Largest distance from the plane at which points count as points of the plane, mm.
    tolerance: f64,
    nodes: Vec<usize>,
    /// Prescribed displacement along the normal (mm) and its gradient.
    displacement: (f64, [f64; 3]),
}

impl SupportPlane {
    fn name(&self) -> String {
        let coordinate = if self.coordinate.abs() <= self.tolerance { 0.0 } else { self.coordinate };
        format!("{} = {}", AXIS_NAMES[self.component], format_number(coordinate))
    }

    fn coincides_with(&self, other: &Self) -> bool {
        self.component == other.component
            && (self.coordinate - other.coordinate).abs() <= self.tolerance.max(other.tolerance)
    }

    /// Whether the frame ends at the plane: the plane contains an edge of a cell, but not the whole cell.
    fn bounds(&self, frame: &ContactFrame) -> bool {
        let on = |x: &Point| (x[self.component] - self.coordinate).abs() <= self.tolerance;
        frame.all_corners().any(|corners| {
            let n = corners.len();
            let edge = (0..n).any(|k| on(&corners[k]) && on(&corners[(k + 1) % n]));
            edge && !corners.iter().all(on)
        })
    }
}

/// Corresponding plane on the other body.
enum OppositePlane {
    /// The plane has the same normal displacement. The flag states whether the scene declares it a symmetry plane.
    SameDisplacement(bool),
    OtherDisplacement,
    Missing,
}

/// Support planes of a body that reach its contact surface.
fn support_planes(body: &BodyPlan) -> Vec<SupportPlane> {
    let mut planes = Vec::new();
    let Some(body) = body.as_meshed() else { return planes };
    let nodes_of = |group: &str| {
        let group = body.mesh.group_of_dim(group, 2);
        group.map(|group| body.mesh.nodes_of(group)).unwrap_or_default()
    };
    let mut touches = vec![false; body.mesh.points.len()];
    nodes_of(&body.contact).into_iter().for_each(|node| touches[node] = true);
    // Planes away from the contact are dropped first, because the search for outer faces is slow on large meshes.
    let reaches =
        |support: &&PrescribedDisplacement| nodes_of(&support.group).into_iter().any(|node| touches[node]);
    for support in body.supports.iter().filter(reaches) {
        let Ok(component) = symmetry_component(&body.mesh, &support.group) else { continue };
        let (Some(value), Ok(faces)) = (support.values[component], group_faces(&body.mesh, &support.group))
        else {
            continue;
        };
        let mut nodes: Vec<usize> = faces.iter().flat_map(|face| face.nodes.iter().copied()).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let points = || nodes.iter().map(|&node| Point::from(body.mesh.points[node]));
        let Some(first) = points().next() else { continue };
        let size = points().map(|x| (x - first).norm()).fold(0.0, f64::max);
        planes.push(SupportPlane {
            key: support.key.clone(),
            is_symmetry: support.key.contains(".symmetry."),
            component,
            coordinate: points().map(|x| x[component]).sum::<f64>() / nodes.len() as f64,
            tolerance: SAME_PLANE * size,
            displacement: (value, support.gradient[component]),
            nodes,
        });
    }
    planes
}

fn partner(other: &BodyPlan, planes: &[SupportPlane], plane: &SupportPlane) -> OppositePlane {
    if matches!(other, BodyPlan::Rigid) {
        return if plane.displacement == (0.0, [0.0; 3]) {
            OppositePlane::SameDisplacement(false)
        } else {
            OppositePlane::OtherDisplacement
        };
    }
    let there: Vec<&SupportPlane> = planes.iter().filter(|other| other.coincides_with(plane)).collect();
    match there.iter().find(|other| other.displacement == plane.displacement) {
        Some(same) => OppositePlane::SameDisplacement(same.is_symmetry),
        None if there.is_empty() => OppositePlane::Missing,
        None => OppositePlane::OtherDisplacement,
    }
}

/// Whether `plane` of body `own` is a symmetry plane of both bodies. A rigid body shares every fixed plane.
fn is_shared_symmetry(
    plan: &Plan,
    planes: &[Vec<SupportPlane>; 2],
    own: usize,
    plane: &SupportPlane,
) -> bool {
    let other = partner(&plan.bodies[1 - own], &planes[1 - own], plane);
    matches!(other, OppositePlane::SameDisplacement(declared) if declared || plane.is_symmetry)
}

/// Body whose nodes define the frame, and the frame's axes; `None` for other frames.
fn nodal_frame(plan: &Plan) -> Option<(usize, Triad)> {
    match plan.frame {
        FramePlan::Mesh { body, points: FramePoints::Nodes, azimuth, normal, .. } => {
            let toward = Point::new(azimuth.cos(), azimuth.sin(), 0.0);
            Some((body, Triad::from_normal(normal.into(), toward)))
        }
        _ => None,
    }
}

/// Nodes of the frame's body on planes of symmetry. Tractions and relative displacements across these planes vanish.
///
/// Both bodies have the plane with the same normal displacement; a rigid body shares every fixed plane. One body at
/// least declares the plane a symmetry plane. Otherwise, no step may act across the plane, and reflection must preserve
/// the friction law.
pub(crate) fn symmetry_nodes(plan: &Plan) -> SymmetryNodes {
    let mut found = SymmetryNodes::new();
    let Some((body, axes)) = nodal_frame(plan) else { return found };
    let other = &plan.bodies[1 - body];
    let others = support_planes(other);
    for plane in support_planes(&plan.bodies[body]) {
        let OppositePlane::SameDisplacement(declared) = partner(other, &others, &plane) else { continue };
        let is_symmetric = || {
            first_step_across(plan, &axes, plane.component).is_none()
                && !breaks_friction_symmetry(plan, &axes.to_local(&Vector3::ith(plane.component, 1.0)))
        };
        if declared || plane.is_symmetry || is_symmetric() {
            plane.nodes.iter().for_each(|&node| found.entry(node).or_default()[plane.component] = true);
        }
    }
    found
}

/// Global axes (x, y, z) along the normals of the symmetry planes at which the frame ends. Both bodies share these
/// planes, and at least one body declares them symmetry planes.
pub(crate) fn symmetry_axes_at_frame_edge(plan: &Plan, frame: &ContactFrame) -> [bool; 3] {
    let planes = plan.bodies.each_ref().map(support_planes);
    let mut found = [false; 3];
    for own in 0..2 {
        for plane in &planes[own] {
            found[plane.component] |= is_shared_symmetry(plan, &planes, own, plane) && plane.bounds(frame);
        }
    }
    found
}

fn pressing_key(step: &Step) -> &'static str {
    if matches!(step.normal, Some(Normal::Force(_))) { "normal_force" } else { "approach" }
}

/// Refuses a contact that becomes a closed ring by reflection at symmetry planes, if body 2 moves along n across a
/// plane. Body 2 moves because of the gap (`moves`), or because a step presses the bodies together. The error has the
/// key of the gap or of the first such step.
pub(super) fn refuse_closed_contact(
    plan: &Plan,
    frame: &ContactFrame,
    moves: bool,
) -> Result<(), SceneError> {
    let n = frame.axes.normal();
    let planes = plan.bodies.each_ref().map(support_planes);
    let closes = |own: usize, plane: &SupportPlane| {
        n[plane.component].abs() > ROUNDING_SHARE
            && is_shared_symmetry(plan, &planes, own, plane)
            && plane.bounds(frame)
    };
    let closing = (0..2).find_map(|own| planes[own].iter().find(|plane| closes(own, plane)));
    let Some(plane) = closing else { return Ok(()) };
    let pressed = plan.steps.iter().position(|step| match step.normal {
        Some(Normal::Approach(value) | Normal::Force(value)) => value != 0.0,
        None => false,
    });
    let what = match pressed {
        _ if moves => "gap.kind = \"mesh\" moves".to_owned(),
        Some(step) => format!("step \"{}\" moves", plan.steps[step].name),
        None => return Ok(()),
    };
    let error = Error::input(format!(
        "{what} body 2 along n = {}, across the symmetry plane {} at which the contact ends. The mirrored contact closes around body 2. For a press fit, set gap.reference = \"as-meshed\" and prescribe no motion along n. Otherwise use a model without this plane and set frame.normal",
        format_direction(&n),
        plane.name()
    ));
    let key = match pressed {
        Some(step) if !moves => step_key(&plan.steps, step, pressing_key(&plan.steps[step])),
        _ => "gap".to_owned(),
    };
    Err(SceneError { error, key })
}

/// Refuses scenes with friction that contradict symmetry planes at the contact:
///
/// - loads and motions across a plane,
/// - friction ellipses that are oblique to a plane,
/// - on nodal frames: planes of one body only, and planes that move relative to each other.
///
/// The error has the key of the first contradiction.
pub(super) fn refuse_symmetry_contradictions(plan: &Plan, frame: &ContactFrame) -> Result<(), SceneError> {
    if plan.friction.ellipse().is_none() || plan.steps.iter().all(|step| !step.friction) {
        return Ok(());
    }
    if let Some((body, _)) = nodal_frame(plan) {
        refuse_unmatched_planes(plan, frame, body)?;
    }
    let bounds =
        |c: usize| frame.symmetry_bounds[c] || frame.symmetry_planes.iter().flatten().any(|planes| planes[c]);
    for component in (0..3).filter(|&c| bounds(c)) {
        if let Some((step, key, what)) = first_step_across(plan, &frame.axes, component) {
            let error = Error::input(format!(
                "step \"{}\" {what} across the symmetry plane at the contact with its normal along {}: the symmetric model cannot represent this. Remove the part of `{key}` that violates the symmetry, or use a full model",
                plan.steps[step].name, AXIS_NAMES[component]
            ));
            return Err(SceneError { error, key: step_key(&plan.steps, step, key) });
        }
        let normal = |triad: &Triad| triad.to_local(&Vector3::ith(component, 1.0));
        let oblique = |(cell, planes): (usize, &[bool; 3])| {
            planes[component] && breaks_friction_symmetry(plan, &normal(&frame.triads[cell]))
        };
        let level = frame.symmetry_bounds[component]
            && frame.has_uniform_axes()
            && breaks_friction_symmetry(plan, &normal(&frame.axes));
        if level || frame.symmetry_planes.iter().flatten().enumerate().any(oblique) {
            let error = Error::input(format!(
                "the axes of the friction ellipse are oblique to the symmetry plane at the contact (normal along {}), so that friction is not symmetric about it. Rotate an axis of the law (or its fibre) into the plane, or use a full model",
                AXIS_NAMES[component]
            ));
            return Err(SceneError { error, key: "friction".to_owned() });
        }
    }
    Ok(())
}

fn refuse_unmatched_planes(plan: &Plan, frame: &ContactFrame, body: usize) -> Result<(), SceneError> {
    let planes = plan.bodies.each_ref().map(support_planes);
    for (own, other) in [(body, 1 - body), (1 - body, body)] {
        for plane in planes[own].iter().filter(|plane| plane.bounds(frame)) {
            let (has, lacks, name) = (BODY_KEYS[own], BODY_KEYS[other], plane.name());
            let message = match partner(&plan.bodies[other], &planes[other], plane) {
                OppositePlane::Missing if plane.is_symmetry => format!(
                    "{has} has the symmetry plane {name} at the contact, but {lacks} has none there, so that tractions across it are undetermined; make {lacks} a meshed body with `symmetry` in this plane, or use a full model"
                ),
                OppositePlane::OtherDisplacement => format!(
                    "the plane {name} of {has} at the contact and {} move relative to each other along the normal of this plane, so that tractions across it are undetermined; prescribe the same displacement, or use frame.points = \"faces\" or a full model",
                    SIDES[other].name()
                ),
                OppositePlane::Missing | OppositePlane::SameDisplacement(_) => continue,
            };
            return Err(SceneError { error: Error::input(message), key: plane.key.clone() });
        }
    }
    Ok(())
}

/// Whether reflection at a plane with the normal `m` (in the axes of a cell) changes the friction law.
fn breaks_friction_symmetry(plan: &Plan, m: &Vector3<f64>) -> bool {
    let Some(ellipse) = plan.friction.ellipse().filter(|ellipse| ellipse.mu[0] != ellipse.mu[1]) else {
        return false;
    };
    let angle = m.y.atan2(m.x) - ellipse.angle;
    (2.0 * angle).sin().abs() > 2.0 * MAX_MISALIGNMENT_RAD
}

/// First step that acts across planes whose normal is the global axis `component`: index of the step, its key, and a
/// description.
fn first_step_across(
    plan: &Plan,
    axes: &Triad,
    component: usize,
) -> Option<(usize, &'static str, &'static str)> {
    let normal = axes.to_local(&Vector3::ith(component, 1.0));
    let of_step = |(index, step): (usize, &Step)| {
        let (key, what) = control_across_plane(step, &normal)?;
        Some((index, key, what))
    };
    plan.steps.iter().enumerate().find_map(of_step)
}

/// Key of a control of `step` that acts across planes with the given normal (frame axes), and a description.
fn control_across_plane(step: &Step, normal: &Vector3<f64>) -> Option<(&'static str, &'static str)> {
    let along = |x: f64, y: f64, n: f64| {
        let vector = Vector3::new(x, y, n);
        vector.dot(normal).abs() > ROUNDING_SHARE * vector.norm()
    };
    // Only rotations about the normal preserve the plane.
    let turns = |x: f64, y: f64, n: f64| {
        let vector = Vector3::new(x, y, n);
        vector.cross(normal).norm() > ROUNDING_SHARE * vector.norm()
    };
    match step.normal {
        Some(Normal::Approach(value)) if along(0.0, 0.0, value) => return Some(("approach", "moves body 2")),
        Some(Normal::Force(value)) if along(0.0, 0.0, value) => {
            return Some(("normal_force", "prescribes a force"));
        }
        _ => {}
    }
    match step.tangential {
        Some(Tangential::Shift([x, y])) if along(x, y, 0.0) => return Some(("shift", "moves body 2")),
        Some(Tangential::Force([x, y])) if along(x, y, 0.0) => {
            return Some(("tangential_force", "prescribes a force"));
        }
        _ => {}
    }
    match step.tilt {
        Some(Tilt::Rotation([x, y])) if turns(x, y, 0.0) => return Some(("rotation", "rotates body 2")),
        Some(Tilt::Moment([x, y])) if turns(x, y, 0.0) => return Some(("moment", "prescribes a moment")),
        _ => {}
    }
    match step.spin {
        Some(Spin::Twist(angle)) if turns(0.0, 0.0, angle) => return Some(("twist", "rotates body 2")),
        Some(Spin::Moment(moment)) if turns(0.0, 0.0, moment) => {
            return Some(("spin_moment", "prescribes a moment"));
        }
        _ => {}
    }
    match &step.kind {
        StepKind::Fretting { path, .. } => {
            let moves = path.offsets().iter().any(|[x, y]| along(*x, *y, 0.0));
            let what = if path.drive == Drive::Shift { "moves body 2" } else { "prescribes a force" };
            moves.then_some(("cycles", what))
        }
        StepKind::Sliding { angle, .. } => {
            along(angle.cos(), angle.sin(), 0.0).then_some(("sliding", "moves body 2"))
        }
        StepKind::Monotone | StepKind::Rolling(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evolution::step::{ClosedPath, Cycles, Integrator, JumpPolicy};

    fn step() -> Step {
        Step {
            name: String::new(),
            normal: Some(Normal::Approach(1.0)),
            tangential: Some(Tangential::Shift([1.0, 0.0])),
            tilt: None,
            spin: None,
            loads: Vec::new(),
            cyclic_loads: Vec::new(),
            increments: 1,
            friction: true,
            wear: false,
            kind: StepKind::Monotone,
            history_row: None,
        }
    }

    const CYCLES: Cycles =
        Cycles { count: 1.0, jumps: JumpPolicy::Number(1), integrator: Integrator::Explicit };

    fn fretting(drive: Drive, angle: f64) -> StepKind {
        let path = ClosedPath { drive, amplitude: [1.0, 0.0], angle, increments: 1, resolved_cycles: None };
        StepKind::Fretting { path, cycles: CYCLES }
    }

    /// Truth: motions and forces preserve a plane if they have no component along its normal. Rotations and moments preserve a
    /// plane only if their axis is along its normal.
    #[test]
    fn controls_across_a_plane() {
        let y = Vector3::y();
        assert_eq!(control_across_plane(&step(), &y), None);
        let zero = Step { spin: Some(Spin::Twist(0.0)), tilt: Some(Tilt::Moment([0.0, 1.0])), ..step() };
        assert_eq!(control_across_plane(&zero, &y), None);
        let cases = [
            (Step { tangential: Some(Tangential::Shift([1.0, 1e-6])), ..step() }, "shift"),
            (Step { tangential: Some(Tangential::Force([0.0, 1.0])), ..step() }, "tangential_force"),
            (Step { tilt: Some(Tilt::Rotation([1.0, 0.0])), ..step() }, "rotation"),
            (Step { tilt: Some(Tilt::Moment([1.0, 1.0])), ..step() }, "moment"),
            (Step { spin: Some(Spin::Twist(1.0)), ..step() }, "twist"),
            (Step { spin: Some(Spin::Moment(1.0)), ..step() }, "spin_moment"),
            (Step { kind: fretting(Drive::Shift, 0.5), ..step() }, "cycles"),
            (Step { kind: fretting(Drive::Force, 0.5), ..step() }, "cycles"),
            (Step { kind: StepKind::Sliding { angle: 0.5, cycles: CYCLES }, ..step() }, "sliding"),
        ];
        for (step, key) in cases {
            assert_eq!(control_across_plane(&step, &y).map(|found| found.0), Some(key));
        }
        let keeps = Step { kind: fretting(Drive::Shift, 0.0), ..step() };
        assert_eq!(control_across_plane(&keeps, &y), None);
        let inclined = Vector3::new(0.0, 0.6, 0.8);
        assert_eq!(control_across_plane(&step(), &inclined).map(|found| found.0), Some("approach"));
    }
}
