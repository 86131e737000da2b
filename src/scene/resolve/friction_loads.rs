//! Checks of loads that only friction can transmit: tangential force and spin moment.

use super::laws::{Laws, lacks_friction};
use super::load_points::LoadPoint;
use super::resolver::Resolver;
use crate::evolution::step::{Spin, Step, StepKind, Tangential};
use crate::scene::document::TomlValue;
use crate::scene::spec::step::Step as Keys;

/// Index of an entry of `steps` in the scene, and a step that results from it. The step is `None` if the entry is
/// invalid. An entry with a load history results in several steps.
pub(super) type NumberedStep = (usize, Option<Step>);

/// Name of a load, its key, and the key of the displacement to prescribe instead.
const FRICTION_LOADS: [(&str, &str, &str); 2] =
    [("tangential force", "tangential_force", "shift"), ("spin moment", "spin_moment", "twist")];

const FRICTION_LOAD_COLUMNS: [&str; 2] = ["`tangential_x`, `tangential_y`", "`spin_moment`"];

/// Reports a tangential force in a step without friction. On a plane frame (`level` is true), also reports a spin
/// moment. On a mesh frame, pressures on inclined cells can transmit spin moments without friction.
pub(super) fn check_step(r: &mut Resolver, key: &str, keys: &Keys, laws: Option<&Laws>, level: bool) {
    let frictionless = lacks_friction(laws, keys.friction);
    let loaded = [
        keys.tangential_force.is_some_and(|q| q != [0.0; 2]),
        keys.spin_moment.is_some_and(|moment| moment != 0.0) && level,
    ];
    for ((what, load, motion), _) in
        FRICTION_LOADS.iter().zip(loaded).filter(|(_, loaded)| *loaded && frictionless)
    {
        let message = format!("a {what} is prescribed, but this step has no friction to transmit it");
        let friction = friction_remedy(r, keys.friction);
        let mend = format!("{friction}, or prescribe the displacement `{motion}` instead");
        r.report(&format!("{key}.{load}"), message, "needs friction", mend);
    }
}

fn friction_remedy(r: &Resolver, friction: bool) -> &'static str {
    let law = r.document.get("friction.law").map(|node| &node.value);
    let has_law = matches!(law, Some(TomlValue::String(law)) if law != "none");
    match (has_law, friction) {
        (true, true) => "give coefficients above 0 in [friction]",
        (true, false) => "remove `friction = false`",
        (false, true) => "add a [friction] law",
        (false, false) => "add a [friction] law and remove `friction = false`",
    }
}

/// What a step prescribes for a load.
enum LoadState {
    Unspecified,
    Active,
    /// The step prescribes zero, a displacement instead of the load, or cycles, sliding or rolling.
    Released,
}

fn load_states(step: &Step) -> [LoadState; 2] {
    let tangential = match step.tangential {
        Some(Tangential::Force(force)) if force != [0.0; 2] => LoadState::Active,
        Some(_) => LoadState::Released,
        // In cycles of loads of the bodies alone, the tangential force stays.
        None if step.kind.closed_path().is_some_and(|path| path.amplitude == [0.0; 2]) => {
            LoadState::Unspecified
        }
        None if !matches!(step.kind, StepKind::Monotone) => LoadState::Released,
        None => LoadState::Unspecified,
    };
    let spin = match step.spin {
        Some(Spin::Moment(moment)) if moment != 0.0 => LoadState::Active,
        Some(_) => LoadState::Released,
        None => LoadState::Unspecified,
    };
    [tangential, spin]
}

/// Reports the first load point with a tangential force, and the first with a spin moment if `level` is true. Called
/// for steps without friction.
pub(super) fn check_load_points(
    r: &mut Resolver,
    key: &str,
    points: &[LoadPoint],
    steps: &[Step],
    level: bool,
) {
    for (kind, (what, ..)) in FRICTION_LOADS.iter().enumerate().take(if level { 2 } else { 1 }) {
        let loaded =
            points.iter().zip(steps).find(|(_, step)| matches!(load_states(step)[kind], LoadState::Active));
        if let Some((point, step)) = loaded {
            let message = format!(
                "line {}: a {what} is prescribed, but this step has no friction to transmit it",
                point.line
            );
            let friction = friction_remedy(r, step.friction);
            let mend = format!("{friction}, or remove the columns {}", FRICTION_LOAD_COLUMNS[kind]);
            r.report(&format!("{key}.history.file"), message, "needs friction", mend);
        }
    }
}

/// Reports loads of an earlier step that still act in a step without friction, or in a rolling step. The loads are
/// tangential forces and, if `level` is true, spin moments.
pub(super) fn check_inherited_loads(
    r: &mut Resolver,
    steps: &[NumberedStep],
    laws: Option<&Laws>,
    level: bool,
) {
    if laws.is_none() {
        return;
    }
    let kinds = if level { 2 } else { 1 };
    for (kind, (what, load, motion)) in FRICTION_LOADS.iter().enumerate().take(kinds) {
        let mut holder: Option<&Step> = None;
        for (i, step) in steps {
            // After an invalid step, the active loads are unknown.
            let Some(step) = step else {
                holder = None;
                continue;
            };
            if let Some(from) = holder.filter(|_| step.kind.rolling().is_some()) {
                let message = format!(
                    "the {what} of step \"{}\" is still active, but in rolling the tangential forces follow from the creepages",
                    from.name
                );
                let mend = format!(
                    "remove the load in a step before the rolling: prescribe `{motion}`, or {load} = 0"
                );
                r.report(&format!("steps.{i}.rolling"), message, "load still active", mend);
                holder = None;
                continue;
            }
            let frictionless = lacks_friction(laws, step.friction);
            match (&load_states(step)[kind], holder) {
                (LoadState::Active, _) => holder = Some(step),
                (LoadState::Released, _) => holder = None,
                (LoadState::Unspecified, Some(from)) if frictionless => {
                    let message = format!(
                        "the {what} of step \"{}\" is still active, but this step has no friction to transmit it",
                        from.name
                    );
                    let friction = friction_remedy(r, step.friction);
                    let mend = format!("{friction}, or prescribe `{motion}` or {load} = 0 in this step");
                    let place = format!("steps.{i}.friction");
                    let place = if r.document.get(&place).is_some() { place } else { format!("steps.{i}") };
                    r.report(&place, message, "no friction", mend);
                }
                (LoadState::Unspecified, _) => {}
            }
        }
    }
}
