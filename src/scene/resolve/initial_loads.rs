//! Loads of the bodies themselves in scenes with friction.

use crate::error::Warning;
use crate::evolution::step::Step;
use crate::laws::friction::FrictionLaw;
use crate::scene::plan::{BodyPlan, PrescribedDisplacement};

/// Warns about loads and prescribed displacements of a body in scenes with friction. They act in full before the first increment,
/// so the surface motion that they cause does not count as slip.
pub(super) fn friction_warnings(
    bodies: &[Option<BodyPlan>; 2],
    friction: &FrictionLaw,
    steps: &[Step],
) -> Vec<Warning> {
    if matches!(friction, FrictionLaw::None) || !steps.iter().any(|step| step.friction) {
        return Vec::new();
    }
    let warn = |(index, body): (usize, &Option<BodyPlan>)| {
        let loads = own_loads(body.as_ref()?);
        (!loads.is_empty()).then(|| {
            Warning::uncertain(&format!(
                "body{} has loads of its own ({}) that act in full before contact. The surface deformation that they cause does not count as slip. Stick zones, slip and tangential forces omit its effect. Load the contact through body 2 (approach, normal_force, shift), or use `friction = false`",
                index + 1,
                loads.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ")
            ))
        })
    };
    bodies.iter().enumerate().filter_map(warn).collect()
}

fn own_loads(body: &BodyPlan) -> Vec<&'static str> {
    let Some(meshed) = body.as_meshed() else { return Vec::new() };
    let found = [
        ("pressure", meshed.pressures.iter().any(|(_, pressure)| *pressure != 0.0)),
        ("traction", meshed.tractions.iter().any(|(_, traction)| *traction != [0.0; 3])),
        ("body_force", meshed.body_force != [0.0; 3]),
        ("displaced", meshed.supports.iter().any(PrescribedDisplacement::is_moving)),
    ];
    found.into_iter().filter(|(_, acts)| *acts).map(|(key, _)| key).collect()
}
