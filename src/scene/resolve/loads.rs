//! Checks loads of the bodies and their amplitudes: loads of half-spaces, temperature, `steps.loads` and
//! `cycles.loads`.

use std::collections::BTreeMap;

use super::resolver::Resolver;
use crate::body::{INTERFERENCE, LoadCase};
use crate::scene::document::join_key;
use crate::scene::plan::{BodyPlan, HalfSpaceLoads};
use crate::scene::spec::body::Body;
use crate::scene::spec::step::Step as Keys;

const BODY_KEYS: [&str; 2] = ["body1", "body2"];

/// Loads of body 1 and body 2 as half-spaces; empty for other kinds of bodies. `None` if the body is invalid, which is
/// reported elsewhere.
pub(super) fn half_space_loads(r: &mut Resolver) -> [Option<HalfSpaceLoads>; 2] {
    BODY_KEYS.map(|key| {
        let found = r.document.get(key)?.to_serde_json();
        match serde_json::from_value(found).ok()? {
            Body::HalfSpace { bulk_stress, temperature_change, truncated: None, .. } => {
                Some(HalfSpaceLoads { bulk_stress, temperature: temperature_change.map(Into::into) })
            }
            Body::HalfSpace { bulk_stress, temperature_change, .. } => {
                let given = [
                    ("bulk_stress", bulk_stress.is_some()),
                    ("temperature_change", temperature_change.is_some()),
                ];
                for (load, _) in given.into_iter().filter(|(_, given)| *given) {
                    r.report(
                        &format!("{key}.{load}"),
                        "a truncated half-space has no loads of its own",
                        "with `truncated`",
                        "omit `truncated`",
                    );
                }
                // The loads are returned nevertheless: their names are then known, and amplitudes in steps cause no
                // further errors.
                Some(HalfSpaceLoads { bulk_stress, temperature: temperature_change.map(Into::into) })
            }
            _ => Some(HalfSpaceLoads::default()),
        }
    })
}

/// Reports invalid loads of bodies, and invalid amplitudes in steps.
///
/// `as_meshed` states whether the overlap of the meshes is a load, `friction` whether friction acts in any step.
pub(super) fn check(
    r: &mut Resolver,
    half_spaces: &[Option<HalfSpaceLoads>; 2],
    (bodies, as_meshed): (&[Option<BodyPlan>; 2], bool),
    friction: bool,
) {
    // Without valid bodies and loads, nothing is checked here.
    let ([Some(lower), Some(upper)], [Some(body1), Some(body2)]) = (half_spaces, bodies) else { return };
    let (half_spaces, bodies) = ([lower, upper], [body1, body2]);
    let surface_loads = surface_loads(half_spaces);
    for (key, _, name) in &surface_loads {
        refuse_empty_name(r, key, name.as_deref());
        if !friction {
            r.note(format!("{key} does not change the pressures, because no step has friction"));
        }
    }
    check_temperatures(r, half_spaces, bodies);
    let cases = load_cases(half_spaces, bodies, as_meshed);
    check_cases(r, &cases);
    if as_meshed && cases.iter().filter(|(_, case)| *case == LoadCase::interference()).count() > 1 {
        r.report(
            "gap.reference",
            format!("a load of a body has the name \"{INTERFERENCE}\", which is reserved for the overlap of the meshes"),
            "names the overlap",
            "choose another name for the load",
        );
    }
    let names = names_of_cases(&cases);
    for i in 0..r.list_length("steps") {
        let key = format!("steps.{i}");
        let Some(keys) = r.section::<Keys>(&key) else { continue };
        if keys.rolling.is_some() {
            refuse_rolling(r, &surface_loads);
        }
        check_names(r, &format!("{key}.loads"), &keys.loads, &names);
        if as_meshed && keys.loads.get(INTERFERENCE).is_some_and(|amplitude| *amplitude < 0.0) {
            r.report(
                &format!("{key}.loads.{INTERFERENCE}"),
                "the amplitude of the interference is negative: the bodies would be apart where their meshes overlap",
                "negative",
                "give the share of the overlap that acts, 0 or more",
            );
        }
        if let Some(cycles) = &keys.cycles {
            check_names(r, &format!("{key}.cycles.loads"), &cycles.loads, &names);
            if !cycles.loads.is_empty() && r.document.get("wear.move_mesh").is_some() {
                r.report(
                    &format!("{key}.cycles.loads"),
                    "loads cannot vary in phase with the strokes while meshes follow the wear",
                    "with `wear.move_mesh`",
                    "remove `loads` from the cycles, so that the amplitudes stay constant, or remove wear.move_mesh",
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

/// Names of all loads. `None` if a body is invalid.
pub(super) fn load_names(
    half_spaces: &[Option<HalfSpaceLoads>; 2],
    bodies: &[Option<BodyPlan>; 2],
    as_meshed: bool,
) -> Option<Vec<String>> {
    let ([Some(lower), Some(upper)], [Some(body1), Some(body2)]) = (half_spaces, bodies) else { return None };
    Some(names_of_cases(&load_cases([lower, upper], [body1, body2], as_meshed)))
}

fn names_of_cases(cases: &[(&str, LoadCase)]) -> Vec<String> {
    let mut names: Vec<String> = cases.iter().filter_map(|(_, case)| case.name.clone()).collect();
    names.sort_unstable();
    names.dedup();
    names
}

/// Key of the body and load case (name, preload) of each load.
fn load_cases(
    half_spaces: [&HalfSpaceLoads; 2],
    bodies: [&BodyPlan; 2],
    as_meshed: bool,
) -> Vec<(&'static str, LoadCase)> {
    let mut cases = Vec::new();
    for ((key, loads), body) in BODY_KEYS.into_iter().zip(half_spaces).zip(bodies) {
        cases.extend(loads.cases().into_iter().map(|case| (key, case)));
        cases.extend(
            body.as_meshed().iter().flat_map(|meshed| meshed.load_cases()).map(|case| (key, case.clone())),
        );
    }
    cases.extend(as_meshed.then(|| ("gap", LoadCase::interference())));
    cases
}

/// Reports loads that have the same name but differ in `preload`.
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

/// Key, kind and name of each load of a half-space.
fn surface_loads(half_spaces: [&HalfSpaceLoads; 2]) -> Vec<(String, &'static str, Option<String>)> {
    let of_body = |(key, loads): (&str, &HalfSpaceLoads)| {
        let stress = loads.bulk_stress.as_ref();
        let stress = stress.map(|load| (format!("{key}.bulk_stress"), "bulk stress", load.name.clone()));
        let temperature = loads.temperature.as_ref().map(|load| {
            (format!("{key}.temperature_change"), "change of temperature", load.case.name.clone())
        });
        stress.into_iter().chain(temperature).collect::<Vec<_>>()
    };
    BODY_KEYS.into_iter().zip(half_spaces).flat_map(of_body).collect()
}

/// Reports changes of temperature of bodies whose materials have no coefficient of thermal expansion.
fn check_temperatures(r: &mut Resolver, half_spaces: [&HalfSpaceLoads; 2], bodies: [&BodyPlan; 2]) {
    for ((key, loads), body) in BODY_KEYS.into_iter().zip(half_spaces).zip(bodies) {
        let temperature = match body.as_meshed() {
            Some(meshed) => &meshed.temperature,
            None => &loads.temperature,
        };
        if temperature.is_none() {
            continue;
        }
        for (name, _) in body.expansions().into_iter().filter(|(_, expansion)| expansion.is_none()) {
            r.report(
                &format!("{key}.temperature_change"),
                format!("the material `{name}` has no coefficient of thermal expansion"),
                "its material has no such coefficient",
                format!("add it to [{}], in 1/K: `alpha` of an isotropic material (12e-6 for steel), otherwise `alpha1`, `alpha2` and, if the model has three axes, `alpha3`", join_key("materials", &name)),
            );
        }
    }
}

fn refuse_rolling(r: &mut Resolver, surface_loads: &[(String, &str, Option<String>)]) {
    for (key, kind, _) in surface_loads {
        r.report(
            key,
            format!(
                "a {kind} cannot be combined with rolling: its displacement would grow with the rolled distance"
            ),
            "with a rolling step",
            "remove one of the two",
        );
    }
}

/// Reports amplitudes for load names that no body has.
fn check_names(r: &mut Resolver, place: &str, loads: &BTreeMap<String, f64>, names: &[String]) {
    for name in loads.keys().filter(|name| !names.contains(name)) {
        let known = if names.is_empty() {
            "no load has a name: name it, as in pressure = [{ group = \"top\", value = 50.0, name = \"clamp\" }]"
                .to_owned()
        } else {
            format!("named loads: {}", names.join(", "))
        };
        r.report(&join_key(place, name), format!("no body has a load \"{name}\""), "unknown", known);
    }
}

/// Reports the key `loads` in a step whose kind excludes it.
fn refuse_constant_amplitudes(r: &mut Resolver, key: &str, keys: &Keys) {
    let kinds = [
        ("cycles", keys.cycles.is_some()),
        ("sliding", keys.sliding.is_some()),
        ("rolling", keys.rolling.is_some()),
        ("history", keys.history.is_some()),
    ];
    let Some((kind, _)) = kinds.into_iter().find(|(_, there)| *there) else { return };
    let mend = match kind {
        "cycles" => "change them in a step before, or let them vary in phase with the strokes (cycles.loads)",
        "history" => "give them columns of the file",
        _ => "change them in a step before; they keep their values",
    };
    r.report(
        &format!("{key}.loads"),
        format!("the amplitudes of loads cannot change in a step with `{kind}`"),
        &format!("together with `{kind}`"),
        mend,
    );
}
