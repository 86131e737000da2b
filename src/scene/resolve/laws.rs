//! Friction and wear laws with the fibre they take.

use super::Resolver;
use crate::friction::FrictionLaw;
use crate::scene::keys::laws::{Friction, Integrator, Wear};
use crate::scene::plan::{BodySpec, FibreAngles};
use crate::wear::WearLaw;

/// The laws of a scene.
pub(super) struct Laws {
    pub friction: FrictionLaw,
    pub wear: WearLaw,
    pub share: f64,
    pub integrator: Integrator,
}

/// The laws, with angles from the frame's x, which is turned by `azimuth` (radians).
pub(super) fn resolve(
    r: &mut Resolver,
    bodies: &[Option<BodySpec>; 2],
    friction: Option<Friction>,
    wear: Option<Wear>,
    azimuth: f64,
) -> Option<Laws> {
    let friction_body = match friction {
        Some(Friction::Frp { body, .. }) => body,
        _ => None,
    };
    let law = friction.and_then(|friction| friction_law(r, bodies, &friction, azimuth));
    let wear = wear.and_then(|wear| wear_law(r, bodies, &wear, friction_body, azimuth));
    let (friction, (wear, share, integrator)) = (law?, wear?);
    if matches!(wear, WearLaw::Energy { .. }) && matches!(friction, FrictionLaw::None) {
        let message = "the wear law takes the friction energy, but there is no friction";
        r.wrong("wear.law", message, "needs friction", "add a [friction] law, or use law = \"archard\"");
    }
    Some(Laws { friction, wear, share, integrator })
}

fn friction_law(
    r: &mut Resolver,
    bodies: &[Option<BodySpec>; 2],
    law: &Friction,
    azimuth: f64,
) -> Option<FrictionLaw> {
    let law = match *law {
        Friction::None => FrictionLaw::None,
        Friction::Coulomb { mu } => FrictionLaw::Coulomb { mu },
        Friction::Elliptic { mu1, mu2, angle } => {
            FrictionLaw::Elliptic { mu: [mu1, mu2], angle: angle.to_radians() - azimuth }
        }
        Friction::Frp { mu_L, mu_T, mu_N, body } => {
            let fibre = fibre(r, bodies, "friction", body)?;
            FrictionLaw::Frp {
                mu_l: mu_L,
                mu_t: mu_T,
                mu_n: mu_N,
                tilt: fibre.tilt,
                azimuth: fibre.azimuth - azimuth,
            }
        }
    };
    let Some(ellipse) = law.ellipse() else { return Some(FrictionLaw::None) };
    if ellipse.mu.contains(&0.0) {
        let message =
            format!("friction is {} along one axis and 0 along the other", ellipse.mu[0].max(ellipse.mu[1]));
        let mend = "make both coefficients positive (a small one will do), or both 0 for no friction at all";
        r.wrong("friction", message, "0 in one direction only", mend);
    }
    Some(law)
}

fn wear_law(
    r: &mut Resolver,
    bodies: &[Option<BodySpec>; 2],
    law: &Wear,
    friction_body: Option<u8>,
    azimuth: f64,
) -> Option<(WearLaw, f64, Integrator)> {
    Some(match *law {
        Wear::None => (WearLaw::None, 1.0, Integrator::default()),
        Wear::Archard { i, share, integrator } => (WearLaw::Archard { i }, share, integrator),
        Wear::Orthotropic { i1, i2, angle, share, integrator } => {
            (WearLaw::Orthotropic { i: [i1, i2], angle: angle.to_radians() - azimuth }, share, integrator)
        }
        Wear::Frp { i_L, i_T, i_N, body, share, integrator } => {
            let fibre = fibre(r, bodies, "wear", body.or(friction_body))?;
            let law = WearLaw::Frp {
                i_l: i_L,
                i_t: i_T,
                i_n: i_N,
                tilt: fibre.tilt,
                azimuth: fibre.azimuth - azimuth,
            };
            (law, share, integrator)
        }
        Wear::Energy { k, share, integrator } => (WearLaw::Energy { k }, share, integrator),
    })
}

/// The fibre that the law of `section` takes: that of the one body that has one, or of the body named.
fn fibre(
    r: &mut Resolver,
    bodies: &[Option<BodySpec>; 2],
    section: &str,
    body: Option<u8>,
) -> Option<FibreAngles> {
    // A body that is wrong itself is reported elsewhere.
    let [Some(body1), Some(body2)] = bodies else { return None };
    let fibres = [body1, body2].map(|body| body.elastic().and_then(|elastic| elastic.fibre));
    match (body, fibres) {
        (Some(number), fibres) => {
            let fibre = fibres[usize::from(number == 2)];
            if fibre.is_none() {
                let message = format!("{section} takes the fibre of body {number}, which has no `fibre`");
                let mend = format!("add fibre = {{ tilt = ..., azimuth = ... }} to [body{number}]");
                r.wrong(&format!("{section}.body"), message, "has no fibre", mend);
            }
            fibre
        }
        (None, [Some(fibre), None] | [None, Some(fibre)]) => Some(fibre),
        (None, [None, None]) => {
            let message = format!("{section}.law = \"frp\" needs a fibre, but neither body has one");
            let mend = "add fibre = { tilt = 0.0, azimuth = 0.0 } to the fibre-reinforced body";
            r.wrong(&format!("{section}.law"), message, "needs a fibre", mend);
            None
        }
        (None, [Some(_), Some(_)]) => {
            let message = format!("both bodies have a fibre; {section} does not say whose counts");
            r.wrong(
                &format!("{section}.law"),
                message,
                "whose fibre?",
                "add `body = 1` or `body = 2` to [friction]",
            );
            None
        }
    }
}
