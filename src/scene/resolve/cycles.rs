//! Fretting cycles and steady sliding.

use super::Resolver;
use super::laws::Laws;
use super::steps::controls;
use crate::friction::FrictionLaw;
use crate::history::step::{
    Closed, Correction, CycleMotion, Cycles, Drive, Integrator, Jumps, ResolvedCycles,
};
use crate::scene::keys::{
    self,
    step::{Cycles as Keys, Path, Resolved, Sliding, Step as StepKeys, Strokes},
};

/// Increments per stroke of an ellipse, if none are given.
const ROUND: usize = 8;

/// The cycles or the sliding of the step at `key`.
pub(super) fn resolve(r: &mut Resolver, key: &str, step: &StepKeys, laws: Option<&Laws>) -> Option<Cycles> {
    let before = r.mistakes.len();
    let (count, motion, jumps) = match (&step.cycles, &step.sliding) {
        (Some(cycles), sliding) => {
            if sliding.is_some() {
                let message = "a step has either `cycles` or `sliding`, not both";
                r.wrong(
                    &format!("{key}.sliding"),
                    message,
                    "together with `cycles`",
                    "move it to a step of its own",
                );
            }
            alone(r, key, "cycles", step);
            let tolerance = laws.map(|laws| laws.integration.tolerance);
            let closed = closed(r, &format!("{key}.cycles"), cycles, tolerance);
            needs_friction(r, key, (step, cycles), laws);
            if let Some(jumps) = cycles.jumps
                && jumps.0 as u64 > cycles.count
            {
                let message = format!("{} jumps for {} cycles", jumps.0, cycles.count);
                let mend = "a wear jump covers at least one cycle: jumps <= count";
                r.wrong(&format!("{key}.cycles.jumps"), message, "more jumps than cycles", mend);
            }
            (cycles.count as f64, CycleMotion::Closed(closed?), cycles.jumps)
        }
        (None, Some(Sliding { distance, angle, jumps })) => {
            alone(r, key, "sliding", step);
            (*distance, CycleMotion::Sliding { angle: angle.to_radians() }, *jumps)
        }
        (None, None) => return None,
    };
    let integration = laws?.integration;
    let jumps = jumps.map_or(Jumps::Tolerance(integration.tolerance), |jumps| Jumps::Number(jumps.0));
    let integrator = match integration.integrator {
        keys::laws::Integrator::Sdirk2 => Integrator::Sdirk2,
        keys::laws::Integrator::BackwardEuler => Integrator::BackwardEuler,
        keys::laws::Integrator::Explicit => Integrator::Explicit,
    };
    let cycles = Cycles { count, motion, jumps, integrator, beyond_critical: integration.beyond_critical };
    (r.mistakes.len() == before).then_some(cycles)
}

/// The path of a cycle.
fn closed(r: &mut Resolver, key: &str, cycles: &Keys, tolerance: Option<f64>) -> Option<Closed> {
    let (drive, amplitude) = match (cycles.amplitude, cycles.force_amplitude) {
        (Some(amplitude), None) => (Drive::Shift, amplitude),
        (None, Some(amplitude)) => (Drive::Force, amplitude),
        (both, _) => {
            let (message, label) = if both.is_some() {
                ("cycles prescribe `amplitude` or `force_amplitude`, not both", "together with `amplitude`")
            } else {
                ("cycles prescribe `amplitude` or `force_amplitude`: both are missing", "lacks an amplitude")
            };
            let key = if both.is_some() { format!("{key}.force_amplitude") } else { key.to_owned() };
            let mend = "`amplitude` is the displacement amplitude (±) of body 2, `force_amplitude` the amplitude (±) \
                        of the tangential force";
            r.wrong(&key, message, label, mend);
            return None;
        }
    };
    let across = match (cycles.path, cycles.amplitude2) {
        (Path::Line, None) => 0.0,
        (Path::Ellipse, Some(across)) => across,
        (Path::Line, Some(_)) => {
            let message = "`amplitude2` is the second semi-axis of an elliptic path, but the path is a line";
            let mend = "add path = \"ellipse\", or remove it";
            r.wrong(&format!("{key}.amplitude2"), message, "needs path = \"ellipse\"", mend);
            return None;
        }
        (Path::Ellipse, None) => {
            let message = "an elliptic path has two semi-axes, but `amplitude2` is missing";
            r.wrong(
                &format!("{key}.path"),
                message,
                "lacks `amplitude2`",
                "add `amplitude2`, the semi-axis perpendicular to `angle`",
            );
            return None;
        }
    };
    let usual = if cycles.path == Path::Ellipse { ROUND } else { 1 };
    let (increments, correction) = match cycles.increments {
        None => (usual, Correction::WhereNeeded),
        Some(Strokes::Number(number)) => (number.0, Correction::Never),
        Some(Strokes::Word(Resolved::Auto)) => (usual, Correction::Always),
    };
    let resolve = tolerance.map(|tolerance| ResolvedCycles { tolerance, correction });
    if cycles.path == Path::Ellipse && increments < 2 {
        let message = "with one increment per half cycle an elliptic path degenerates to a line";
        r.wrong(
            &format!("{key}.increments"),
            message,
            "too few",
            "use 4 or more, or omit the key for the default of 8",
        );
    }
    let angle = cycles.angle.to_radians();
    Some(Closed { drive, amplitude: [amplitude, across], angle, increments, resolve })
}

/// Only friction carries a tangential force.
fn needs_friction(r: &mut Resolver, key: &str, (step, cycles): (&StepKeys, &Keys), laws: Option<&Laws>) {
    let none = !step.friction || laws.is_some_and(|laws| matches!(laws.friction, FrictionLaw::None));
    if cycles.force_amplitude.is_some() && none {
        let message = "`force_amplitude` needs friction: this step has none to transmit a tangential force";
        let mend = "give [friction] a law and leave out `friction = false`, or prescribe `amplitude`";
        r.wrong(&format!("{key}.cycles.force_amplitude"), message, "needs friction", mend);
    }
}

/// Cycles and sliding stand alone in their step but for the normal control, which goes to its end linearly over them.
fn alone(r: &mut Resolver, key: &str, what: &str, step: &StepKeys) {
    let [_, others @ ..] = controls(step);
    for (name, _) in others.iter().flatten().filter(|(_, there)| *there) {
        let message = format!(
            "`{name}` cannot be combined with `{what}`, whose motion starts from the position at the start of the step"
        );
        let label = format!("together with `{what}`");
        r.wrong(&format!("{key}.{name}"), message, &label, "prescribe it in an earlier step");
    }
    if step.increments.0 != 1 {
        let message = format!("`increments` of the step does not apply to `{what}`");
        let label = format!("together with `{what}`");
        let mend = format!(
            "remove it; `{what}.jumps` sets the number of wear jumps, `cycles.increments` the increments per stroke"
        );
        r.wrong(&format!("{key}.increments"), message, &label, &mend);
    }
}
