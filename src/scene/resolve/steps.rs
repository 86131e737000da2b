//! Load steps.

use super::Resolver;
use super::laws::Laws;
use crate::friction::FrictionLaw;
use crate::history::step::{Cycles, Integrator, Normal, Step, Tangential};
use crate::scene::keys;
use crate::scene::keys::step::Step as Keys;

/// The steps in order.
pub(super) fn resolve(r: &mut Resolver, laws: Option<&Laws>) -> Option<Vec<Step>> {
    let n = r.list_length("steps");
    let steps: Vec<Option<Step>> = (0..n).map(|i| step(r, i, laws)).collect();
    held_forces(r, &steps, laws);
    same_names(r, &steps);
    let steps: Option<Vec<Step>> = steps.into_iter().collect();
    if let Some(steps) = &steps
        && steps.first().is_some_and(|step| step.normal.is_none())
    {
        r.notes.push(format!(
            "step \"{}\" starts at first touch: it has neither approach nor normal_force",
            steps[0].name
        ));
    }
    steps
}

fn step(r: &mut Resolver, i: usize, laws: Option<&Laws>) -> Option<Step> {
    let key = format!("steps.{i}");
    let keys: Keys = r.section(&key)?;
    let before = r.mistakes.len();
    if keys.name.as_deref().is_some_and(|name| name.trim().is_empty()) {
        r.wrong(&format!("{key}.name"), "a step has an empty name", "empty", "name it, or leave the key out");
    }
    exclusive(r, &key, &keys);
    forces(r, &key, &keys, laws);
    if keys.cycles.is_some() {
        cycles_alone(r, &key, &keys);
    }
    let integrator = laws.map_or(keys::laws::Integrator::default(), |laws| laws.integrator);
    (r.mistakes.len() == before).then(|| Step {
        name: keys.name.clone().unwrap_or_else(|| format!("step {}", i + 1)),
        normal: keys.approach.map(Normal::Approach).or(keys.normal_force.map(Normal::Force)),
        tangential: tangential(&keys),
        increments: keys.increments.0,
        friction: keys.friction,
        wear: keys.wear,
        cycles: keys.cycles.map(|cycles| Cycles {
            count: cycles.count,
            amplitude: cycles.amplitude,
            angle: cycles.angle.to_radians(),
            jumps: cycles.jumps.0,
            integrator: match integrator {
                keys::laws::Integrator::Sdirk2 => Integrator::Sdirk2,
                keys::laws::Integrator::BackwardEuler => Integrator::BackwardEuler,
                keys::laws::Integrator::Explicit => Integrator::Explicit,
            },
        }),
    })
}

/// Results are found by the names of steps: of two with one name only the last is.
fn same_names(r: &mut Resolver, steps: &[Option<Step>]) {
    let names: Vec<&str> = steps.iter().flatten().map(|step| step.name.as_str()).collect();
    for (i, name) in names.iter().enumerate() {
        if names[..i].contains(name) {
            r.notes
                .push(format!("two steps have the name \"{name}\": results by name are those of the last"));
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

/// Displacement and force of one direction cannot both be prescribed.
fn exclusive(r: &mut Resolver, key: &str, keys: &Keys) {
    if keys.approach.is_some() && keys.normal_force.is_some() {
        let message = "a step prescribes `approach` or `normal_force`, not both";
        r.wrong(&format!("{key}.normal_force"), message, "besides `approach`", "remove one of the two");
    }
    if keys.shift.is_some() && keys.tangential_force.is_some() {
        let message = "a step prescribes `shift` or `tangential_force`, not both";
        r.wrong(&format!("{key}.tangential_force"), message, "besides `shift`", "remove one of the two");
    }
}

/// A tangential force needs friction to carry it.
fn forces(r: &mut Resolver, key: &str, keys: &Keys, laws: Option<&Laws>) {
    let frictionless = !keys.friction || laws.is_some_and(|l| matches!(l.friction, FrictionLaw::None));
    if keys.tangential_force.is_some_and(|q| q != [0.0; 2]) && frictionless {
        let message = "nothing can carry a tangential force: this step has no friction";
        let mend = "add a [friction] law and leave out `friction = false`, or prescribe `shift`";
        r.wrong(&format!("{key}.tangential_force"), message, "needs friction", mend);
    }
}

/// A tangential force that an earlier step left in force needs friction too, until a shift or cycles replace it.
fn held_forces(r: &mut Resolver, steps: &[Option<Step>], laws: Option<&Laws>) {
    let Some(laws) = laws else { return };
    let mut holder: Option<&Step> = None;
    for (i, step) in steps.iter().enumerate() {
        // A step that is wrong itself may prescribe anything.
        let Some(step) = step else {
            holder = None;
            continue;
        };
        match step.tangential {
            Some(Tangential::Force(force)) if force != [0.0; 2] => holder = Some(step),
            Some(_) => holder = None,
            None if step.cycles.is_some() => holder = None,
            None => {}
        }
        let frictionless = !step.friction || matches!(laws.friction, FrictionLaw::None);
        let (Some(from), None, true) = (holder, step.tangential, frictionless) else { continue };
        let message = format!("nothing carries the tangential force held from step \"{}\"", from.name);
        let mend = "leave out `friction = false`, or prescribe `shift` or tangential_force = [0.0, 0.0] here";
        let place = format!("steps.{i}.friction");
        let place = if r.document.get(&place).is_some() { place } else { format!("steps.{i}") };
        r.wrong(&place, message, "no friction", mend);
    }
}

/// Cycles stand alone in their step.
fn cycles_alone(r: &mut Resolver, key: &str, keys: &Keys) {
    let others = [
        ("approach", keys.approach.is_some()),
        ("normal_force", keys.normal_force.is_some()),
        ("shift", keys.shift.is_some()),
        ("tangential_force", keys.tangential_force.is_some()),
    ];
    for (name, _) in others.iter().filter(|(_, there)| *there) {
        let message =
            format!("`{name}` stands besides `cycles`, which move about the position at the step's start");
        r.wrong(&format!("{key}.{name}"), message, "besides `cycles`", "prescribe it in a step before");
    }
    if keys.increments.0 != 1 {
        let message = "`increments` does not apply to `cycles`";
        r.wrong(
            &format!("{key}.increments"),
            message,
            "besides `cycles`",
            "remove it; `cycles.jumps` divides cycles",
        );
    }
    if let Some(cycles) = keys.cycles
        && cycles.jumps.0 as u64 > cycles.count
    {
        let message = format!("{} jumps for {} cycles", cycles.jumps.0, cycles.count);
        let mend = "a jump is at least one cycle: jumps <= count";
        r.wrong(&format!("{key}.cycles.jumps"), message, "more jumps than cycles", mend);
    }
}
