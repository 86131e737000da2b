//! Resolves fretting cycles and steady sliding.

use super::laws::{Laws, lacks_friction};
use super::resolver::Resolver;
use crate::evolution::step::{
    ClosedPath, Correction, Cycles, Drive, JumpPolicy, ResolvedCycleSettings, StepKind,
};
use crate::laws::friction::FrictionLaw;
use crate::laws::wear::WearLaw;
use crate::scene::spec::frame::PositiveCount;
use crate::scene::spec::step::{
    AutoKeyword, CyclePath, Cycles as Keys, Sliding, Step as StepKeys, StrokeIncrements,
};

const DEFAULT_ELLIPSE_INCREMENTS: usize = 8;

pub(super) fn resolve(r: &mut Resolver, key: &str, step: &StepKeys, laws: Option<&Laws>) -> Option<StepKind> {
    let before = r.diagnostics.len();
    let cycles_in_jumps = |count: f64, jumps: Option<PositiveCount>| {
        let integration = laws?.integration;
        let tolerance = JumpPolicy::Tolerance(integration.tolerance.0);
        let jumps = jumps.map_or(tolerance, |jumps| JumpPolicy::Number(jumps.0));
        Some(Cycles { count, jumps, integrator: integration.integrator })
    };
    let kind = match (&step.cycles, &step.sliding) {
        (Some(cycles), sliding) => {
            if sliding.is_some() {
                let message = "a step has either `cycles` or `sliding`, not both";
                r.report(
                    &format!("{key}.sliding"),
                    message,
                    "together with `cycles`",
                    "move it to a step of its own",
                );
            }
            reject_other_controls(r, key, "cycles", step);
            let tolerance = laws.map(|laws| laws.integration.tolerance.0);
            let path = closed_cycle(r, &format!("{key}.cycles"), cycles, tolerance);
            check_force_amplitude(r, key, step, cycles, laws);
            if let Some(jumps) = cycles.jumps
                && jumps.0 as u64 > cycles.count
            {
                let message = format!("{} jumps for {} cycles", jumps.0, cycles.count);
                let mend = "a wear jump covers at least one cycle: jumps <= count";
                r.report(&format!("{key}.cycles.jumps"), message, "more jumps than cycles", mend);
            }
            StepKind::Fretting { path: path?, cycles: cycles_in_jumps(cycles.count as f64, cycles.jumps)? }
        }
        (None, Some(Sliding { distance, angle, jumps })) => {
            reject_other_controls(r, key, "sliding", step);
            StepKind::Sliding { angle: angle.to_radians(), cycles: cycles_in_jumps(distance.0, *jumps)? }
        }
        (None, None) => return None,
    };
    check_friction_energy(r, key, step, laws);
    (r.diagnostics.len() == before).then_some(kind)
}

/// Reports a step without friction but with wear, if the wear law depends on the friction energy.
fn check_friction_energy(r: &mut Resolver, key: &str, step: &StepKeys, laws: Option<&Laws>) {
    let by_energy = laws.is_some_and(|laws| {
        matches!(laws.wear, WearLaw::Energy { .. }) && laws.friction != FrictionLaw::None
    });
    if by_energy && step.wear && !step.friction {
        let message = "wear law \"energy\" wears by the friction energy, but this step has `friction = false`: nothing would wear";
        let mend =
            "remove `friction = false`; or add `wear = false` to the step; or use wear.law = \"archard\"";
        r.report(&format!("{key}.friction"), message, "no friction energy", mend);
    }
}

/// Quantity that follows the path (displacement or force), and its amplitude along the path's angle. If only loads of
/// the bodies vary, the amplitude is 0.
fn drive_and_amplitude(r: &mut Resolver, key: &str, cycles: &Keys) -> Option<(Drive, f64)> {
    Some(match (cycles.amplitude, cycles.force_amplitude) {
        (Some(amplitude), None) => (Drive::Shift, amplitude.0),
        (None, Some(amplitude)) => (Drive::Force, amplitude.0),
        // Body 2 keeps its position or its tangential force; `keep_tangential_control` in `steps` decides which.
        (None, None) if cycles.path == CyclePath::Line && cycles.loads.values().any(|by| *by != 0.0) => {
            if cycles.angle != 0.0 {
                let message = "`angle` is the direction of the stroke, but only loads of the bodies vary";
                let mend = "remove it, or give `amplitude` or `force_amplitude`";
                r.report(&format!("{key}.angle"), message, "without an amplitude", mend);
            }
            (Drive::Shift, 0.0)
        }
        (both, _) => {
            let (message, label) = if both.is_some() {
                ("cycles prescribe `amplitude` or `force_amplitude`, not both", "together with `amplitude`")
            } else {
                ("cycles prescribe `amplitude` or `force_amplitude`: both are missing", "lacks an amplitude")
            };
            let key = if both.is_some() { format!("{key}.force_amplitude") } else { key.to_owned() };
            let mend = "`amplitude` is the displacement amplitude (±) of body 2, `force_amplitude` the amplitude (±) \
                        of the tangential force; on a line `loads` may vary alone";
            return r.refuse(&key, message, label, mend);
        }
    })
}

fn closed_cycle(r: &mut Resolver, key: &str, cycles: &Keys, tolerance: Option<f64>) -> Option<ClosedPath> {
    let (drive, amplitude) = drive_and_amplitude(r, key, cycles)?;
    let across = match (cycles.path, cycles.amplitude2) {
        (CyclePath::Line, None) => 0.0,
        (CyclePath::Ellipse, Some(across)) => across.0,
        (CyclePath::Line, Some(_)) => {
            let message = "`amplitude2` is the second semi-axis of an elliptic path, but the path is a line";
            let mend = "add path = \"ellipse\", or remove it";
            return r.refuse(&format!("{key}.amplitude2"), message, "needs path = \"ellipse\"", mend);
        }
        (CyclePath::Ellipse, None) => {
            let message = "an elliptic path has two semi-axes, but `amplitude2` is missing";
            return r.refuse(
                &format!("{key}.path"),
                message,
                "lacks `amplitude2`",
                "add `amplitude2`, the semi-axis perpendicular to `angle`",
            );
        }
    };
    let usual = if cycles.path == CyclePath::Ellipse { DEFAULT_ELLIPSE_INCREMENTS } else { 1 };
    let (increments, correction, resolved) = match cycles.increments {
        None => (usual, Correction::WhereNeeded, None),
        Some(StrokeIncrements::Given(number)) if number.0 > usual => {
            (usual, Correction::Always, Some(number.0))
        }
        Some(StrokeIncrements::Given(number)) => (number.0, Correction::Never, None),
        Some(StrokeIncrements::Automatic(AutoKeyword::Auto)) => (usual, Correction::Always, None),
    };
    let resolved_cycles = tolerance.map(|tolerance| ResolvedCycleSettings {
        increments: resolved,
        tolerance,
        correction,
        error_warning: tolerance,
    });
    if cycles.path == CyclePath::Ellipse && increments < 2 {
        let message = "with one increment per half cycle an elliptic path degenerates to a line";
        r.report(
            &format!("{key}.increments"),
            message,
            "too few",
            "use 4 or more, or omit the key for the default of 8",
        );
    }
    let angle = cycles.angle.to_radians();
    Some(ClosedPath { drive, amplitude: [amplitude, across], angle, increments, resolved_cycles })
}

fn check_force_amplitude(r: &mut Resolver, key: &str, step: &StepKeys, cycles: &Keys, laws: Option<&Laws>) {
    if cycles.force_amplitude.is_some() && lacks_friction(laws, step.friction) {
        let message = "`force_amplitude` needs friction: this step has none to transmit a tangential force";
        let mend = "give [friction] a law and remove `friction = false`, or prescribe `amplitude`";
        r.report(&format!("{key}.cycles.force_amplitude"), message, "needs friction", mend);
    }
}

/// Reports `increments` and all controls except `approach` and `normal_force`. These two may change linearly over the
/// step.
fn reject_other_controls(r: &mut Resolver, key: &str, what: &str, step: &StepKeys) {
    let [_, others @ ..] = prescribed_controls(step);
    for (name, _) in others.iter().flatten().filter(|(_, there)| *there) {
        let message = format!(
            "`{name}` cannot be combined with `{what}`, whose motion starts from the position at the start of the step"
        );
        let label = format!("together with `{what}`");
        r.report(&format!("{key}.{name}"), message, &label, "prescribe it in an earlier step");
    }
    if step.increments.0 != 1 {
        let message = format!("`increments` of the step does not apply to `{what}`");
        let label = format!("together with `{what}`");
        let mend = format!(
            "remove it; `{what}.jumps` sets the number of wear jumps, `cycles.increments` the increments per stroke"
        );
        r.report(&format!("{key}.increments"), message, &label, &mend);
    }
}

/// Keys of the prescribed displacement and force of each direction: normal, tangential, tilt and spin. The flag states
/// whether the step gives the key.
pub(super) fn prescribed_controls(keys: &StepKeys) -> [[(&'static str, bool); 2]; 4] {
    [
        [("approach", keys.approach.is_some()), ("normal_force", keys.normal_force.is_some())],
        [("shift", keys.shift.is_some()), ("tangential_force", keys.tangential_force.is_some())],
        [("rotation", keys.rotation.is_some()), ("moment", keys.moment.is_some())],
        [("twist", keys.twist.is_some()), ("spin_moment", keys.spin_moment.is_some())],
    ]
}
