//! Resolves the load steps.

use super::cycles::prescribed_controls;
use super::friction_loads::{self, NumberedStep};
use super::laws::{Laws, lacks_friction};
use super::load_points;
use super::resolver::Resolver;
use crate::evolution::step::{Drive, HistoryRow, Normal, Spin, Step, StepKind, Tangential, Tilt};
use crate::scene::document::Location;
use crate::scene::plan::FramePlan;
use crate::scene::spec::step::Step as Keys;

/// Largest rotation, degrees, without a note. At 5 degrees, the tangent exceeds the angle by 0.25 %.
const MAX_ROTATION_DEG: f64 = 5.0;

/// Steps of the scene. `loads` contains the names of the loads of the bodies; `None` if the bodies are invalid.
pub(super) fn resolve(
    r: &mut Resolver,
    laws: Option<&Laws>,
    frame: Option<&FramePlan>,
    loads: Option<&[String]>,
) -> Option<Vec<Step>> {
    let n = r.list_length("steps");
    let level = !matches!(frame, Some(FramePlan::Mesh { .. }));
    let mut steps: Vec<NumberedStep> = (0..n).flat_map(|i| step(r, i, (laws, loads), level)).collect();
    keep_tangential_control(&mut steps, laws);
    friction_loads::check_inherited_loads(r, &steps, laws, level);
    if let Some(FramePlan::Grid { periodic, .. }) = frame {
        check_periodic_rotations(r, &steps, *periodic);
    }
    note_large_rotations(r, &steps);
    note_duplicate_names(r, &steps);
    let steps: Option<Vec<Step>> = steps.into_iter().map(|(_, step)| step).collect();
    // With `gap.reference = "as-meshed"`, approach 0 is the position of the meshes, and their overlap causes pressure.
    let as_meshed = r.document.get("gap.reference").is_some_and(|node| node.to_serde_json() == "as-meshed");
    if let Some(steps) = &steps
        && !as_meshed
        && steps.first().is_some_and(|step| step.normal.is_none())
    {
        r.note(format!(
            "step \"{}\" has neither approach nor normal_force (approach 0 is where the surfaces first touch). Only the bodies' own loads can press them together",
            steps[0].name
        ));
    }
    steps
}

/// Sets what stays constant in cycles in which only loads of the bodies vary: the tangential force, or the position of
/// body 2. The last earlier step that prescribes one of them decides. Without friction the position stays.
fn keep_tangential_control(steps: &mut [NumberedStep], laws: Option<&Laws>) {
    let mut by_force = false;
    for step in steps.iter_mut().filter_map(|(_, step)| step.as_mut()) {
        by_force = step.tangential.map_or(by_force, |control| matches!(control, Tangential::Force(_)));
        let frictionless = lacks_friction(laws, step.friction);
        match &mut step.kind {
            StepKind::Fretting { path, .. } if path.amplitude == [0.0; 2] => {
                by_force &= !frictionless;
                path.drive = if by_force { Drive::Force } else { Drive::Shift };
            }
            StepKind::Fretting { path, .. } => by_force = path.drive == Drive::Force,
            StepKind::Sliding { .. } | StepKind::Rolling(_) => by_force = false,
            StepKind::Monotone => {}
        }
    }
}

/// The step of entry `i` of `steps`, or one step per row of its load history.
fn step(
    r: &mut Resolver,
    i: usize,
    (laws, loads): (Option<&Laws>, Option<&[String]>),
    level: bool,
) -> Vec<NumberedStep> {
    let key = format!("steps.{i}");
    let Some(keys) = r.section::<Keys>(&key) else { return vec![(i, None)] };
    let before = r.diagnostics.len();
    if keys.name.as_deref().is_some_and(|name| name.trim().is_empty()) {
        r.report(
            &format!("{key}.name"),
            "a step has an empty name",
            "empty",
            "name it, or leave the key out",
        );
    }
    if keys.name.as_deref().is_some_and(|name| name.contains(char::is_control)) {
        let message = "the name of a step contains line breaks or control characters";
        r.report(&format!("{key}.name"), message, "this name", "use printable characters on one line");
    }
    check_exclusive_controls(r, &key, &keys);
    friction_loads::check_step(r, &key, &keys, laws, level);
    let cycles = super::cycles::resolve(r, &key, &keys, laws);
    let rolling = keys.rolling.and_then(|rolling| super::rolling::resolve(r, &key, &keys, rolling, laws));
    let points = keys.history.as_ref().map(|history| {
        check_history_alone(r, &key, &keys);
        load_points::read(r, &format!("{key}.history"), history, loads).unwrap_or_default()
    });
    if r.diagnostics.len() != before {
        return vec![(i, None)];
    }
    let kind = cycles.or(rolling.map(StepKind::Rolling)).unwrap_or(StepKind::Monotone);
    let plain = Step { kind, ..monotone_step(&keys, i) };
    let Some(points) = points else { return vec![(i, Some(plain))] };
    let count = points.len();
    let steps: Vec<Step> = (points.iter().enumerate())
        .map(|(index, point)| Step {
            normal: point.normal,
            tangential: point.tangential,
            tilt: point.tilt,
            spin: point.spin,
            loads: point.loads.clone(),
            history_row: Some(HistoryRow { index, count }),
            ..plain.clone()
        })
        .collect();
    // Errors of a law itself are reported elsewhere.
    if laws.is_some() && lacks_friction(laws, plain.friction) {
        friction_loads::check_load_points(r, &key, &points, &steps, level);
    }
    if r.diagnostics.len() != before {
        return vec![(i, None)];
    }
    steps.into_iter().map(|step| (i, Some(step))).collect()
}

/// The step with the controls in `keys`, without history, cycles, sliding and rolling.
fn monotone_step(keys: &Keys, i: usize) -> Step {
    Step {
        name: keys.name.clone().unwrap_or_else(|| format!("step {}", i + 1)),
        normal: keys.approach.map(Normal::Approach).or(keys.normal_force.map(Normal::Force)),
        tangential: tangential(keys),
        tilt: keys
            .rotation
            .map(|angles| Tilt::Rotation(angles.map(f64::to_radians)))
            .or(keys.moment.map(Tilt::Moment)),
        spin: keys.twist.map(|angle| Spin::Twist(angle.to_radians())).or(keys.spin_moment.map(Spin::Moment)),
        loads: keys.loads.clone().into_iter().collect(),
        cyclic_loads: keys.cycles.iter().flat_map(|cycles| cycles.loads.clone()).collect(),
        increments: keys.increments.0,
        friction: keys.friction,
        wear: keys.wear,
        kind: StepKind::Monotone,
        history_row: None,
    }
}

fn check_history_alone(r: &mut Resolver, key: &str, keys: &Keys) {
    let others = prescribed_controls(keys).into_iter().flatten().chain([
        ("cycles", keys.cycles.is_some()),
        ("sliding", keys.sliding.is_some()),
        ("rolling", keys.rolling.is_some()),
    ]);
    for (name, _) in others.filter(|(_, there)| *there) {
        let message =
            format!("`{name}` cannot be combined with `history`, which prescribes all loads of its step");
        r.report(
            &format!("{key}.{name}"),
            message,
            "together with `history`",
            "make it a column of the file, or move it to a step of its own",
        );
    }
}

/// Notes steps with equal names. Results reported by step name are then the results of the last of these steps.
fn note_duplicate_names(r: &mut Resolver, steps: &[NumberedStep]) {
    let first = |step: &&Step| step.history_row.is_none_or(|row| row.index == 0);
    let steps = steps.iter().filter_map(|(_, step)| step.as_ref()).filter(first);
    let names: Vec<&str> = steps.map(|step| step.name.as_str()).collect();
    for (i, name) in names.iter().enumerate() {
        if names[..i].contains(name) {
            r.note(format!(
                "two steps are named \"{name}\": results reported by step name are those of the last of them"
            ));
        }
    }
}

fn tangential(keys: &Keys) -> Option<Tangential> {
    keys.shift
        .map(|shift| {
            let (s, c) = shift.angle.to_radians().sin_cos();
            Tangential::Shift([shift.distance * c, shift.distance * s])
        })
        .or(keys.tangential_force.map(Tangential::Force))
}

fn check_exclusive_controls(r: &mut Resolver, key: &str, keys: &Keys) {
    for [(motion, moved), (load, loaded)] in prescribed_controls(keys) {
        if moved && loaded {
            let message = format!("a step prescribes `{motion}` or `{load}`, not both");
            let label = format!("together with `{motion}`");
            let mend = match r.document.location(&format!("{key}.{motion}")) {
                Location::SetOption(option) => {
                    format!("remove one of the two; `{motion}` is given by --set {option}")
                }
                _ => "remove one of the two".to_owned(),
            };
            r.report(&format!("{key}.{load}"), message, &label, mend);
        }
    }
}

/// Notes large rotations. Rotations are linearised: the gap changes in proportion to the angle, not to its tangent.
fn note_large_rotations(r: &mut Resolver, steps: &[NumberedStep]) {
    let mut told = Vec::new();
    for step in steps.iter().filter_map(|(_, step)| step.as_ref()) {
        let tilt = if let Some(Tilt::Rotation([x, y])) = step.tilt { x.hypot(y) } else { 0.0 };
        let twist = if let Some(Spin::Twist(angle)) = step.spin { angle.abs() } else { 0.0 };
        let largest = tilt.max(twist).to_degrees();
        if largest > MAX_ROTATION_DEG && !told.contains(&&step.name) {
            told.push(&step.name);
            r.note(format!(
                "step \"{}\" rotates body 2 by {largest:.3} degrees: rotations are linearised (change of gap = angle x \
                 distance), and the axes of the friction law do not rotate",
                step.name
            ));
        }
    }
}

/// Reports rotations and moments that a periodic frame excludes, because their displacement is not periodic.
///
/// These are all moments, nonzero twists, and rotations that change the gap along a periodic direction.
fn check_periodic_rotations(r: &mut Resolver, steps: &[NumberedStep], periodic: [bool; 2]) {
    if periodic == [false; 2] {
        return;
    }
    let mut told = Vec::new();
    for (i, step) in steps.iter().filter_map(|(i, step)| step.as_ref().map(|step| (i, step))) {
        let tilt = match step.tilt {
            // A rotation about y changes the gap along x.
            Some(Tilt::Rotation([x, y])) if (periodic[1] && x != 0.0) || (periodic[0] && y != 0.0) => {
                Some("rotation")
            }
            Some(Tilt::Moment(_)) => Some("moment"),
            _ => None,
        };
        let spin = match step.spin {
            Some(Spin::Twist(angle)) if angle != 0.0 => Some("twist"),
            Some(Spin::Moment(_)) => Some("spin_moment"),
            _ => None,
        };
        for key in [tilt, spin].into_iter().flatten().filter(|_| !told.contains(i)) {
            let place = if step.history_row.is_some() {
                format!("steps.{i}.history")
            } else {
                format!("steps.{i}.{key}")
            };
            let message = if key.ends_with("moment") {
                "a moment is not possible on a periodic frame: its lever arm would differ from period to period"
            } else {
                "on a periodic frame this rotation is not possible: its displacement would grow from period to period"
            };
            r.report(&place, message, "with frame.periodic", "remove it, or make the frame non-periodic");
        }
        if tilt.or(spin).is_some() {
            told.push(*i);
        }
    }
}
