//! Warnings that follow from the model and its steps before the first increment.

use crate::evolution::omitted::quoted_names;
use crate::evolution::step::{Step, StepKind};
use crate::flexibility::Flexibility;
use crate::laws::friction::{FrictionEllipse, FrictionLaw};

const LARGE_FRICTION_COEFFICIENT: f64 = 1.0;

/// Warning that a large friction coefficient may admit several solutions (Klarbring 1990: "Examples of non-uniqueness
/// and non-existence of solutions to quasistatic contact problems with friction").
///
/// `None` for small coefficients. `None` also if tangential tractions do not change the pressures, because the solution
/// is then unique.
pub(super) fn large_friction_warning(
    ellipse: Option<FrictionEllipse>,
    operator: &dyn Flexibility,
) -> Option<String> {
    let mu = ellipse.map(|ellipse| ellipse.mu[0].max(ellipse.mu[1]))?;
    (mu >= LARGE_FRICTION_COEFFICIENT && operator.couples_normal_tangential()).then(|| {
        format!(
            "the friction coefficient {mu} is large, and tangential tractions change the pressures: the contact may have several solutions. Which one is found depends on the load path and on the tractions from which the iteration starts. Check whether more increments, or solver.skip = false, give the same result"
        )
    })
}

/// Warning about monotone steps with friction that have a single increment. With friction, the results depend on the
/// number of increments.
pub(super) fn path_dependence_warning(friction: &FrictionLaw, steps: &[Step]) -> Option<String> {
    // A load history prescribes its load path, and steady states do not depend on the load path.
    let by_path = |step: &&Step| matches!(step.kind, StepKind::Monotone) && step.history_row.is_none();
    let frictional = steps.iter().filter(|step| step.friction).filter(by_path);
    let single: Vec<&str> =
        frictional.filter(|step| step.increments == 1).map(|step| step.name.as_str()).collect();
    let tilted = match friction {
        FrictionLaw::Frp { tilt, .. } if *tilt != 0.0 => " for tilted fibres",
        _ => "",
    };
    let (which, these) = match single.as_slice() {
        [] => return None,
        [name] => (format!("step \"{name}\" has one increment"), "this step"),
        _ => (format!("steps {} have one increment each", quoted_names(&single)), "these steps"),
    };
    Some(format!(
        "friction depends on the load path, but {which}. More increments may change the tangential force by a few percent{tilted}, and dissipation and wear by more. To check, compare with `increments = 4` in {these}"
    ))
}
