//! Planes of symmetry under a contact whose cells are those of nodes: which cells they constrain, and which scenes contradict them.
//!
//! The supports hold the nodes on a plane across it, so that a traction across moves almost nothing and would stay undetermined; in
//! the full model it vanishes by symmetry.

use nalgebra::Vector3;

use super::bodies::{KEYS, SIDES};
use super::controls::{NO_PART, place};
use super::failure::Failure;
use crate::error::Error;
use crate::fem::symmetry_component;
use crate::frame::ContactFrame;
use crate::frame::symmetry::NodePlanes;
use crate::geometry::{Point, Triad, number};
use crate::history::step::{CycleMotion, Drive, Normal, Spin, Step, Tangential, Tilt};
use crate::mesh::faces::group_faces;
use crate::scene::keys::frame::FramePoints;
use crate::scene::plan::{BodySpec, FrameSpec, Plan, Support};

/// Names of the global axes.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Largest distance of two planes that are one, over the size of the group.
const SAME_PLANE: f64 = 1e-6;

/// Largest angle, radians, between an axis of the friction ellipse and a plane of symmetry that contains it.
const ALIGNED: f64 = 1e-9;

/// A plane group of a body whose displacement along the normal is prescribed.
struct Plane {
    /// Key of the support in the scene.
    key: String,
    /// Whether the scene calls it a plane of symmetry.
    declared: bool,
    /// The global axis along its normal.
    component: usize,
    /// Its coordinate along that axis, mm.
    coordinate: f64,
    /// Distance within which points lie on it, mm.
    tolerance: f64,
    /// Nodes of the group.
    nodes: Vec<usize>,
    /// Prescribed displacement along the normal: its value (mm) and its gradient.
    displacement: (f64, [f64; 3]),
}

impl Plane {
    fn name(&self) -> String {
        format!("{} = {}", AXES[self.component], number(self.coordinate))
    }

    fn is_at(&self, other: &Self) -> bool {
        self.component == other.component
            && (self.coordinate - other.coordinate).abs() <= self.tolerance.max(other.tolerance)
    }

    /// Whether cells of the frame end on the plane.
    fn bounds(&self, frame: &ContactFrame) -> bool {
        let on = |x: &Point| (x[self.component] - self.coordinate).abs() <= self.tolerance;
        frame.all_corners().any(|corners| {
            let n = corners.len();
            let edge = (0..n).any(|k| on(&corners[k]) && on(&corners[(k + 1) % n]));
            edge && !corners.iter().all(on)
        })
    }
}

/// What the other body has at a plane.
enum Partner {
    /// The same displacement along the normal; whether the scene calls it a plane of symmetry.
    Same(bool),
    /// Another displacement along the normal.
    Other,
    /// No plane.
    None,
}

/// The planes among the supports of a body that reach its contact surface; none of a body without a mesh.
fn planes_of(body: &BodySpec) -> Vec<Plane> {
    let mut planes = Vec::new();
    let Some(body) = body.meshed() else { return planes };
    let nodes_of = |group: &str| {
        let group = body.mesh.group_of_dim(group, 2);
        group.map(|group| body.mesh.nodes_of(group)).unwrap_or_default()
    };
    let mut touches = vec![false; body.mesh.points.len()];
    nodes_of(&body.contact).into_iter().for_each(|node| touches[node] = true);
    // Outer faces are looked for in the groups that matter only: it takes time on large meshes.
    let reaches = |support: &&Support| nodes_of(&support.group).into_iter().any(|node| touches[node]);
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
        planes.push(Plane {
            key: support.key.clone(),
            declared: support.key.contains(".symmetry."),
            component,
            coordinate: points().map(|x| x[component]).sum::<f64>() / nodes.len() as f64,
            tolerance: SAME_PLANE * size,
            displacement: (value, support.gradient[component]),
            nodes,
        });
    }
    planes
}

/// What the body `other`, whose planes are `planes`, has at a plane.
fn partner(other: &BodySpec, planes: &[Plane], plane: &Plane) -> Partner {
    if matches!(other, BodySpec::Rigid) {
        return if plane.displacement == (0.0, [0.0; 3]) { Partner::Same(false) } else { Partner::Other };
    }
    let there: Vec<&Plane> = planes.iter().filter(|other| other.is_at(plane)).collect();
    match there.iter().find(|other| other.displacement == plane.displacement) {
        Some(same) => Partner::Same(same.declared),
        None if there.is_empty() => Partner::None,
        None => Partner::Other,
    }
}

/// The body whose nodes are the cells of the frame, with the frame's axes.
fn nodal(plan: &Plan) -> Option<(usize, Triad)> {
    match plan.frame {
        FrameSpec::Mesh { body, points: FramePoints::Nodes, azimuth, normal, .. } => {
            let toward = Point::new(azimuth.cos(), azimuth.sin(), 0.0);
            Some((body, Triad::from_normal(normal.into(), toward)))
        }
        _ => None,
    }
}

/// The nodes of the frame's body on planes across which tractions and relative displacements vanish.
///
/// A plane group that both bodies have with the same displacement along its normal is one, and one that a body has against a rigid
/// one. Planes that the scene does not call planes of symmetry are walls, and constrain nothing, where steps move the bodies
/// across them.
pub(super) fn constraining(plan: &Plan) -> NodePlanes {
    let mut found = NodePlanes::new();
    let Some((body, axes)) = nodal(plan) else { return found };
    let other = &plan.bodies[1 - body];
    let others = planes_of(other);
    for plane in planes_of(&plan.bodies[body]) {
        let Partner::Same(declared) = partner(other, &others, &plane) else { continue };
        let is_symmetric = || {
            across(plan, &axes, plane.component).is_none()
                && !is_oblique(plan, &axes.to_local(&Vector3::ith(plane.component, 1.0)))
        };
        if declared || plane.declared || is_symmetric() {
            plane.nodes.iter().for_each(|&node| found.entry(node).or_default()[plane.component] = true);
        }
    }
    found
}

/// Which of the global axes are normal to a plane at which the frame ends, of any kind, and which both bodies (or one and a rigid one) have
/// and one at least calls a plane of symmetry.
pub(super) fn bounding(plan: &Plan, frame: &ContactFrame) -> [bool; 3] {
    let planes = plan.bodies.each_ref().map(planes_of);
    let mut found = [false; 3];
    for (own, other) in [(0, 1), (1, 0)] {
        for plane in &planes[own] {
            let shared = matches!(partner(&plan.bodies[other], &planes[other], plane), Partner::Same(declared) if declared || plane.declared);
            found[plane.component] |= shared && plane.bounds(frame);
        }
    }
    found
}

/// Refuses what contradicts planes of symmetry under the contact where friction acts: loads and motions across them, friction ellipses
/// oblique to them; on frames of nodes also planes that one body has alone, or that move past one another.
///
/// # Errors
/// At the key of the first one.
pub(super) fn refuse_contradictions(plan: &Plan, frame: &ContactFrame) -> Result<(), Failure> {
    if plan.friction.ellipse().is_none() || plan.steps.iter().all(|step| !step.friction) {
        return Ok(());
    }
    if let Some((body, _)) = nodal(plan) {
        refuse_lone_planes(plan, frame, body)?;
    }
    let bounds = |c: usize| frame.bounded[c] || frame.planes.iter().flatten().any(|planes| planes[c]);
    for component in (0..3).filter(|&c| bounds(c)) {
        if let Some((step, key, what)) = across(plan, &frame.axes, component) {
            let error = Error::input(format!(
                "step \"{}\" {what} across the plane of symmetry under the contact whose normal is {}: a part of the model cannot stand \
                 for the whole; leave out the part of `{key}` across, or take a full model",
                plan.steps[step].name, AXES[component]
            ));
            return Err(Failure { error, key: place(&plan.steps, step, key) });
        }
        let normal = |triad: &Triad| triad.to_local(&Vector3::ith(component, 1.0));
        let oblique = |(cell, planes): (usize, &[bool; 3])| {
            planes[component] && is_oblique(plan, &normal(&frame.triads[cell]))
        };
        let level = frame.bounded[component] && frame.is_level() && is_oblique(plan, &normal(&frame.axes));
        if level || frame.planes.iter().flatten().enumerate().any(oblique) {
            let error = Error::input(format!(
                "the axes of the friction ellipse are oblique to the plane of symmetry under the contact whose normal is {}: friction is \
                 then not symmetric about it; turn an axis of the law (or the fibre that it follows) into the plane, or take a full model",
                AXES[component]
            ));
            return Err(Failure { error, key: "friction".to_owned() });
        }
    }
    Ok(())
}

fn refuse_lone_planes(plan: &Plan, frame: &ContactFrame, body: usize) -> Result<(), Failure> {
    let planes = plan.bodies.each_ref().map(planes_of);
    for (own, other) in [(body, 1 - body), (1 - body, body)] {
        for plane in planes[own].iter().filter(|plane| plane.bounds(frame)) {
            let (has, lacks, name) = (KEYS[own], KEYS[other], plane.name());
            let message = match partner(&plan.bodies[other], &planes[other], plane) {
                Partner::None if plane.declared => format!(
                    "{has} has the plane of symmetry {name} under the contact, {lacks} has none there: tractions across it are then \
                     undetermined; make {lacks} a meshed body with `symmetry` in this plane, or take a full model"
                ),
                Partner::Other => format!(
                    "the plane {name} of {has} under the contact and {} move past one another along its normal: tractions across it are \
                     then undetermined; prescribe the same displacement, or take frame.points = \"faces\" or a full model",
                    SIDES[other].name()
                ),
                Partner::None | Partner::Same(_) => continue,
            };
            return Err(Failure { error: Error::input(message), key: plane.key.clone() });
        }
    }
    Ok(())
}

/// Whether the friction law is not its own mirror image at a plane with the normal `m` in a cell's axes.
fn is_oblique(plan: &Plan, m: &Vector3<f64>) -> bool {
    let Some(ellipse) = plan.friction.ellipse().filter(|ellipse| ellipse.mu[0] != ellipse.mu[1]) else {
        return false;
    };
    let angle = m.y.atan2(m.x) - ellipse.angle;
    (2.0 * angle).sin().abs() > 2.0 * ALIGNED
}

/// The first step that moves or loads a body across planes with the normal `component`: its index, its key, what it does.
fn across(plan: &Plan, axes: &Triad, component: usize) -> Option<(usize, &'static str, &'static str)> {
    let normal = axes.to_local(&Vector3::ith(component, 1.0));
    let of_step = |(index, step): (usize, &Step)| {
        let (key, what) = step_across(step, &normal)?;
        Some((index, key, what))
    };
    plan.steps.iter().enumerate().find_map(of_step)
}

/// The key by which a step moves or loads a body across planes with the given normal (frame's axes), and what it does.
fn step_across(step: &Step, normal: &Vector3<f64>) -> Option<(&'static str, &'static str)> {
    let along = |x: f64, y: f64, n: f64| {
        let vector = Vector3::new(x, y, n);
        vector.dot(normal).abs() > NO_PART * vector.norm()
    };
    // Rotations about the normal alone keep to the plane.
    let turns = |x: f64, y: f64, n: f64| {
        let vector = Vector3::new(x, y, n);
        vector.cross(normal).norm() > NO_PART * vector.norm()
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
        Some(Tilt::Rotation([x, y])) if turns(x, y, 0.0) => return Some(("rotation", "turns body 2")),
        Some(Tilt::Moment([x, y])) if turns(x, y, 0.0) => return Some(("moment", "prescribes a moment")),
        _ => {}
    }
    match step.spin {
        Some(Spin::Twist(angle)) if turns(0.0, 0.0, angle) => return Some(("twist", "turns body 2")),
        Some(Spin::Moment(moment)) if turns(0.0, 0.0, moment) => {
            return Some(("spin_moment", "prescribes a moment"));
        }
        _ => {}
    }
    match &step.cycles.as_ref()?.motion {
        CycleMotion::Closed(closed) => {
            let moves = closed.offsets().iter().any(|[x, y]| along(*x, *y, 0.0));
            let what = if closed.drive == Drive::Shift { "moves body 2" } else { "prescribes a force" };
            moves.then_some(("cycles", what))
        }
        CycleMotion::Sliding { angle } => {
            along(angle.cos(), angle.sin(), 0.0).then_some(("sliding", "moves body 2"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::history::step::{Closed, Cycles, Integrator, Jumps};

    fn step() -> Step {
        Step {
            name: String::new(),
            normal: Some(Normal::Approach(1.0)),
            tangential: Some(Tangential::Shift([1.0, 0.0])),
            tilt: None,
            spin: None,
            increments: 1,
            friction: true,
            wear: false,
            cycles: None,
            row: None,
            rolling: None,
        }
    }

    fn cycles(motion: CycleMotion) -> Option<Cycles> {
        let jumps = Jumps::Number(1);
        Some(Cycles { count: 1.0, motion, jumps, integrator: Integrator::Explicit, beyond_critical: false })
    }

    fn closed(drive: Drive, angle: f64) -> CycleMotion {
        CycleMotion::Closed(Closed { drive, amplitude: [1.0, 0.0], angle, increments: 1, resolve: None })
    }

    /// Truth: a motion or force keeps a plane where it has no part along its normal, a rotation or moment where it has no other part.
    #[test]
    fn controls_across_a_plane() {
        let y = Vector3::y();
        assert_eq!(step_across(&step(), &y), None);
        let zero = Step { spin: Some(Spin::Twist(0.0)), tilt: Some(Tilt::Moment([0.0, 1.0])), ..step() };
        assert_eq!(step_across(&zero, &y), None);
        let cases = [
            (Step { tangential: Some(Tangential::Shift([1.0, 1e-6])), ..step() }, "shift"),
            (Step { tangential: Some(Tangential::Force([0.0, 1.0])), ..step() }, "tangential_force"),
            (Step { tilt: Some(Tilt::Rotation([1.0, 0.0])), ..step() }, "rotation"),
            (Step { tilt: Some(Tilt::Moment([1.0, 1.0])), ..step() }, "moment"),
            (Step { spin: Some(Spin::Twist(1.0)), ..step() }, "twist"),
            (Step { spin: Some(Spin::Moment(1.0)), ..step() }, "spin_moment"),
            (Step { cycles: cycles(closed(Drive::Shift, 0.5)), ..step() }, "cycles"),
            (Step { cycles: cycles(closed(Drive::Force, 0.5)), ..step() }, "cycles"),
            (Step { cycles: cycles(CycleMotion::Sliding { angle: 0.5 }), ..step() }, "sliding"),
        ];
        for (step, key) in cases {
            assert_eq!(step_across(&step, &y).map(|found| found.0), Some(key));
        }
        let keeps = Step { cycles: cycles(closed(Drive::Shift, 0.0)), ..step() };
        assert_eq!(step_across(&keeps, &y), None);
        let inclined = Vector3::new(0.0, 0.6, 0.8);
        assert_eq!(step_across(&step(), &inclined).map(|found| found.0), Some("approach"));
    }
}
