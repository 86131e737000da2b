//! Resolves steady rolling.

use super::laws::{Laws, lacks_friction};
use super::resolver::Resolver;
use crate::evolution::step::Rolling;
use crate::scene::plan::{BodyPlan, FramePlan};
use crate::scene::spec::step::{Rolling as Keys, Step as StepKeys};

/// Maximum angle between the rolling direction and an axis of the frame, in quarter turns.
const AXIS_TOLERANCE_QUARTER_TURNS: f64 = 1e-9;

pub(super) fn resolve(
    r: &mut Resolver,
    key: &str,
    step: &StepKeys,
    rolling: Keys,
    laws: Option<&Laws>,
) -> Option<Rolling> {
    let before = r.diagnostics.len();
    let others = [
        ("shift", step.shift.is_some()),
        ("tangential_force", step.tangential_force.is_some()),
        ("twist", step.twist.is_some()),
        ("spin_moment", step.spin_moment.is_some()),
        ("cycles", step.cycles.is_some()),
        ("sliding", step.sliding.is_some()),
    ];
    for (name, _) in others.iter().filter(|(_, there)| *there) {
        let message = format!(
            "`{name}` cannot be combined with `rolling`, whose tangential tractions follow from the creepages"
        );
        r.report(&format!("{key}.{name}"), message, "together with `rolling`", "remove one of the two");
    }
    if lacks_friction(laws, step.friction) {
        let message = "rolling needs friction, but this step has none";
        let mend = "add a [friction] law and leave out `friction = false`, or remove `rolling`";
        r.report(&format!("{key}.rolling"), message, "needs friction", mend);
    }
    let turns = rolling.direction / 90.0;
    if (turns - turns.round()).abs() > AXIS_TOLERANCE_QUARTER_TURNS {
        let message = format!(
            "the rolling direction of {} degrees is not along an axis of the frame",
            rolling.direction
        );
        let mend = "use 0, 90, 180 or 270 degrees; for other directions rotate the frame with frame.azimuth";
        r.report(&format!("{key}.rolling.direction"), message, "not along a frame axis", mend);
    }
    (r.diagnostics.len() == before).then(|| Rolling {
        quarter_turns: turns.round().rem_euclid(4.0) as u8,
        creepage: rolling.creepage,
        spin: rolling.spin,
        distance: rolling.distance,
    })
}

/// Reports a frame or a body that does not allow steady rolling, and a spin creepage on a periodic frame.
pub(super) fn check_model(r: &mut Resolver, frame: Option<&FramePlan>, bodies: &[Option<BodyPlan>; 2]) {
    let keys = (0..r.list_length("steps")).map(|i| format!("steps.{i}.rolling"));
    let rolling: Vec<String> = keys.filter(|key| r.document.get(key).is_some()).collect();
    let Some(key) = rolling.first() else { return };
    if let Some(FramePlan::Mesh { .. }) = frame {
        let message = "rolling needs a grid frame, but frame.kind = \"mesh\"";
        r.report(key, message, "needs a grid", "write frame.kind = \"grid\" with half_width and cells");
    }
    for (number, body) in bodies.iter().enumerate() {
        let meshed =
            |body: &BodyPlan| body.as_meshed().is_some() || matches!(body, BodyPlan::TruncatedHalfSpace(_));
        if body.as_ref().is_some_and(meshed) {
            let message = format!(
                "steady rolling needs bodies that do not change along the rolling direction, but body{} has a mesh",
                number + 1
            );
            r.report(key, message, "needs half-spaces", "make the body a half-space or rigid");
        }
    }
    let periodic = matches!(frame, Some(FramePlan::Grid { periodic, .. }) if *periodic != [false; 2]);
    for key in rolling.iter().map(|key| format!("{key}.spin")).filter(|_| periodic) {
        let spin = r.document.get(&key).map(|node| node.to_serde_json());
        if spin.is_some_and(|spin| spin.as_f64() != Some(0.0)) {
            let message =
                "spin is not possible on a periodic frame: its slip grows with the distance from the centre";
            r.report(&key, message, "with a periodic frame", "remove it, or frame.periodic");
        }
    }
}
