//! Loads of the bodies with amplitudes: bulk stresses, and `steps.loads`.

use super::resolver::Resolver;
use crate::scene::document::join_key;
use crate::scene::spec::body::{Body, BulkStress};
use crate::scene::spec::step::Step as Keys;

/// The bulk stress of the body at `key`. Errors of the body itself are reported elsewhere.
pub(super) fn bulk_stress(r: &mut Resolver, key: &str) -> Option<BulkStress> {
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
}

/// Reports amplitudes of loads that no body has, and steps in which amplitudes cannot change.
pub(super) fn check(r: &mut Resolver, bulk_stresses: &[Option<BulkStress>; 2], friction: bool) {
    let unread = |(key, stress): (&str, &Option<BulkStress>)| {
        stress.is_none() && r.document.get(&format!("{key}.bulk_stress")).is_some()
    };
    // Reported with the body.
    if ["body1", "body2"].into_iter().zip(bulk_stresses).any(unread) {
        return;
    }
    for (key, stress) in ["body1", "body2"].into_iter().zip(bulk_stresses) {
        if stress.as_ref().is_some_and(|stress| stress.name.as_deref() == Some("")) {
            let mend = "name it, or leave the key out";
            r.report(&format!("{key}.bulk_stress.name"), "a load has an empty name", "empty", mend);
        }
        if stress.is_some() && !friction {
            r.note(format!("{key}.bulk_stress has no effect on the contact, because no step has friction"));
        }
    }
    let stresses = bulk_stresses.iter().flatten();
    let names: Vec<&str> = stresses.clone().filter_map(|stress| stress.name.as_deref()).collect();
    for i in 0..r.list_length("steps") {
        let key = format!("steps.{i}");
        let Some(keys) = r.section::<Keys>(&key) else { continue };
        if keys.rolling.is_some() && stresses.clone().next().is_some() {
            let body = if bulk_stresses[0].is_some() { "body1" } else { "body2" };
            r.report(
                &format!("{body}.bulk_stress"),
                "a bulk stress cannot be combined with rolling: its strain would grow along the rolled distance",
                "with a rolling step",
                "remove one of the two",
            );
        }
        if keys.loads.is_empty() {
            continue;
        }
        let kinds = [
            ("cycles", keys.cycles.is_some()),
            ("sliding", keys.sliding.is_some()),
            ("rolling", keys.rolling.is_some()),
            ("history", keys.history.is_some()),
        ];
        if let Some((kind, _)) = kinds.into_iter().find(|(_, there)| *there) {
            r.report(
                &format!("{key}.loads"),
                format!("the amplitudes of loads cannot change in a step with `{kind}`"),
                &format!("together with `{kind}`"),
                "change them in a step before; they keep their values",
            );
        }
        for name in keys.loads.keys().filter(|name| !names.contains(&name.as_str())) {
            let known = if names.is_empty() {
                "no load has a name: name it, as in bulk_stress = { name = \"bulk\", value = [100.0, 0.0, 0.0] }".to_owned()
            } else {
                format!("named loads: {}", names.join(", "))
            };
            r.report(
                &join_key(&format!("{key}.loads"), name),
                format!("no body has a load \"{name}\""),
                "unknown",
                known,
            );
        }
    }
}
