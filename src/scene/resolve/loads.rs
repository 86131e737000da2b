//! Loads of the bodies with amplitudes: bulk stresses, `steps.loads` and `cycles.loads`.

use std::collections::BTreeMap;

use super::resolver::Resolver;
use crate::body::{INTERFERENCE, LoadCase};
use crate::scene::document::join_key;
use crate::scene::plan::BodyPlan;
use crate::scene::spec::body::{Body, BulkStress};
use crate::scene::spec::step::Step as Keys;

const BODY_KEYS: [&str; 2] = ["body1", "body2"];

/// Bulk stresses of both bodies. Errors of the bodies themselves are reported elsewhere.
pub(super) fn bulk_stresses(r: &mut Resolver) -> [Option<BulkStress>; 2] {
    BODY_KEYS.map(|key| {
        let found = r.document.get(key)?.to_serde_json();
        match serde_json::from_value(found).ok()? {
            Body::HalfSpace { bulk_stress, truncated: None, .. } => bulk_stress,
            Body::HalfSpace { bulk_stress: Some(_), .. } => r.refuse(
                &format!("{key}.bulk_stress"),
                "a truncated half-space has no bulk stress",
                "with `truncated`",
                "omit `truncated`",
            ),
            _ => None,
        }
    })
}

/// Reports loads of bodies and amplitudes in steps that are not admissible. `as_meshed` states
/// whether overlap is a load, `friction` whether friction acts in any step.
pub(super) fn check(
    r: &mut Resolver,
    stresses: &[Option<BulkStress>; 2],
    (bodies, as_meshed): (&[Option<BodyPlan>; 2], bool),
    friction: bool,
) {
    let unread = |(key, stress): (&str, &Option<BulkStress>)| {
        stress.is_none() && r.document.get(&format!("{key}.bulk_stress")).is_some()
    };
    // Reported with the body.
    if bodies.iter().any(Option::is_none) || BODY_KEYS.into_iter().zip(stresses).any(unread) {
        return;
    }
    for (key, stress) in BODY_KEYS.into_iter().zip(stresses) {
        let name = stress.as_ref().and_then(|stress| stress.name.as_deref());
        refuse_empty_name(r, &format!("{key}.bulk_stress"), name);
    }
    let stressed = BODY_KEYS.into_iter().zip(stresses).filter(|(_, stress)| stress.is_some());
    for (key, _) in stressed.filter(|_| !friction) {
        r.note(format!("{key}.bulk_stress does not change the pressures, because no step has friction"));
    }
    let mut cases = load_cases(stresses, bodies);
    cases.extend(as_meshed.then(|| ("gap", LoadCase::interference())));
    check_cases(r, &cases);
    if as_meshed && cases.iter().filter(|(_, case)| *case == LoadCase::interference()).count() > 1 {
        r.report(
            "gap.reference",
            format!("a load of a body has the name \"{INTERFERENCE}\", which the overlap of the meshes has"),
            "names the overlap",
            "choose another name for the load",
        );
    }
    let mut names: Vec<&str> = cases.iter().filter_map(|(_, case)| case.name.as_deref()).collect();
    names.sort_unstable();
    names.dedup();
    for i in 0..r.list_length("steps") {
        let key = format!("steps.{i}");
        let Some(keys) = r.section::<Keys>(&key) else { continue };
        if keys.rolling.is_some() {
            refuse_rolling(r, stresses);
        }
        check_names(r, &format!("{key}.loads"), &keys.loads, &names);
        if let Some(cycles) = &keys.cycles {
            check_names(r, &format!("{key}.cycles.loads"), &cycles.loads, &names);
            if !cycles.loads.is_empty() && r.document.get("wear.move_mesh").is_some() {
                r.report(
                    &format!("{key}.cycles.loads"),
                    "loads cannot vary in phase with the strokes while meshes follow the wear",
                    "with `wear.move_mesh`",
                    "keep the amplitudes in the cycles, or remove wear.move_mesh",
                );
            }
        }
        if !keys.loads.is_empty() {
            refuse_constant_amplitudes(r, &key, &keys);
        }
    }
}

/// Reports an empty `name` of the load at `key`.
pub(super) fn refuse_empty_name(r: &mut Resolver, key: &str, name: Option<&str>) {
    if name == Some("") {
        r.report(
            &format!("{key}.name"),
            "a load has an empty name",
            "empty",
            "name it, or leave the key out",
        );
    }
}

/// Key of the body and case of each load.
fn load_cases(
    stresses: &[Option<BulkStress>; 2],
    bodies: &[Option<BodyPlan>; 2],
) -> Vec<(&'static str, LoadCase)> {
    let mut cases = Vec::new();
    for ((key, stress), body) in BODY_KEYS.into_iter().zip(stresses).zip(bodies) {
        cases.extend(stress.iter().map(|BulkStress { name, preload, .. }| {
            (key, LoadCase { name: name.clone(), preload: *preload })
        }));
        let meshed = body.as_ref().and_then(BodyPlan::as_meshed);
        cases.extend(meshed.iter().flat_map(|meshed| meshed.load_cases()).map(|case| (key, case.clone())));
    }
    cases
}

/// Reports names of loads that are preloads in one place only.
fn check_cases(r: &mut Resolver, cases: &[(&'static str, LoadCase)]) {
    for (i, (key, case)) in cases.iter().enumerate() {
        let Some(name) = &case.name else { continue };
        let differs =
            |(_, other): &&(&str, LoadCase)| other.name == case.name && other.preload != case.preload;
        if cases[..i].iter().any(|other| differs(&other)) {
            r.report(
                key,
                format!("the load \"{name}\" has `preload` in one place and not in another, but loads with one name have one amplitude"),
                "has this load",
                "set `preload` for all loads of this name, or choose another name",
            );
        }
    }
}

fn refuse_rolling(r: &mut Resolver, stresses: &[Option<BulkStress>; 2]) {
    for (key, _) in BODY_KEYS.into_iter().zip(stresses).filter(|(_, stress)| stress.is_some()) {
        r.report(
            &format!("{key}.bulk_stress"),
            "a bulk stress cannot be combined with rolling: its strain would grow along the rolled distance",
            "with a rolling step",
            "remove one of the two",
        );
    }
}

/// Reports amplitudes of loads that no body has.
fn check_names(r: &mut Resolver, place: &str, loads: &BTreeMap<String, f64>, names: &[&str]) {
    for name in loads.keys().filter(|name| !names.contains(&name.as_str())) {
        let known = if names.is_empty() {
            "no load has a name: name it, as in pressure = [{ group = \"top\", value = 50.0, name = \"clamp\" }]"
                .to_owned()
        } else {
            format!("named loads: {}", names.join(", "))
        };
        r.report(&join_key(place, name), format!("no body has a load \"{name}\""), "unknown", known);
    }
}

/// Reports amplitudes at the end of a step whose kind keeps them.
fn refuse_constant_amplitudes(r: &mut Resolver, key: &str, keys: &Keys) {
    let kinds = [
        ("cycles", keys.cycles.is_some()),
        ("sliding", keys.sliding.is_some()),
        ("rolling", keys.rolling.is_some()),
        ("history", keys.history.is_some()),
    ];
    let Some((kind, _)) = kinds.into_iter().find(|(_, there)| *there) else { return };
    let mend = if kind == "cycles" {
        "change them in a step before, or let them vary in phase with the strokes (cycles.loads)"
    } else {
        "change them in a step before; they keep their values"
    };
    r.report(
        &format!("{key}.loads"),
        format!("the amplitudes of loads cannot change in a step with `{kind}`"),
        &format!("together with `{kind}`"),
        mend,
    );
}
