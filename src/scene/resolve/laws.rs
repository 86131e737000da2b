//! Resolves the friction and wear laws with their fibre directions.

use super::resolver::Resolver;
use crate::geometry::Point;
use crate::laws::friction::FrictionLaw;
use crate::laws::wear::WearLaw;
use crate::mesh::faces::group_faces;
use crate::scene::mean_material::mean_material_under_frame;
use crate::scene::plan::{BodyPlan, FibreAngles, FramePlan, MeshedBodyPlan};
use crate::scene::spec::body::UniformFibre;
use crate::scene::spec::laws::{Friction, Wear, WearIntegration};

/// Largest allowed ratio of the two friction coefficients. Above it, rounding errors dominate in some cells.
const MAX_FRICTION_RATIO: f64 = 1e6;

pub(super) struct Laws {
    pub friction: FrictionLaw,
    pub wear: WearLaw,
    pub integration: WearIntegration,
    /// Indices of the bodies whose fibres the friction law and the wear law use; see
    /// [`crate::scene::plan::Plan::fibre_bodies`].
    pub fibre_bodies: [Option<usize>; 2],
}

/// Whether a step has no friction; `friction` is the key `friction` of the step. Unknown laws (`None`) count as
/// friction.
pub(super) fn lacks_friction(laws: Option<&Laws>, friction: bool) -> bool {
    !friction || laws.is_some_and(|laws| matches!(laws.friction, FrictionLaw::None))
}

#[derive(Clone, Copy)]
pub(super) struct LawContext<'a> {
    pub bodies: &'a [Option<BodyPlan>; 2],
    pub frame: Option<&'a FramePlan>,
}

impl LawContext<'_> {
    /// Azimuth of the frame's x, radians.
    fn azimuth(self) -> f64 {
        self.frame.map_or(0.0, FramePlan::azimuth)
    }
}

/// Fibre direction of a law as the scene gives it in `section`: the number of a body, or angles.
#[derive(Clone, Copy)]
struct FibreChoice {
    section: &'static str,
    body: Option<u8>,
    fibre: Option<UniformFibre>,
}

/// Resolves the laws. Their angles are measured from the frame's x axis.
pub(super) fn resolve(
    r: &mut Resolver,
    ground: LawContext<'_>,
    friction: Option<Friction>,
    wear: Option<Wear>,
) -> Option<Laws> {
    let of_friction = match friction {
        Some(Friction::Frp { body, fibre, .. }) => FibreChoice { section: "friction", body, fibre },
        _ => FibreChoice { section: "friction", body: None, fibre: None },
    };
    let mut fibre_bodies = [None; 2];
    let [of_law, of_wear] = &mut fibre_bodies;
    let law = friction.and_then(|friction| friction_law(r, ground, &friction, of_law));
    let wear = wear.and_then(|wear| wear_law(r, ground, &wear, of_friction, of_wear));
    let (friction, (wear, integration)) = (law?, wear?);
    if matches!(wear, WearLaw::Energy { .. }) && matches!(friction, FrictionLaw::None) {
        let message = "wear law \"energy\" uses the friction energy, but there is no friction";
        r.report("wear.law", message, "needs friction", "add a [friction] law, or use law = \"archard\"");
    }
    Some(Laws { friction, wear, integration, fibre_bodies })
}

fn friction_law(
    r: &mut Resolver,
    ground: LawContext<'_>,
    law: &Friction,
    fibre_body: &mut Option<usize>,
) -> Option<FrictionLaw> {
    let azimuth = ground.azimuth();
    let coefficients = match *law {
        Friction::None => [0.0; 3],
        Friction::Coulomb { mu } => [mu; 3],
        Friction::Elliptic { mu1, mu2, .. } => [mu1, mu2, mu2],
        Friction::Frp { mu_L, mu_T, mu_N, .. } => [mu_L, mu_T, mu_N],
    };
    let law = match *law {
        Friction::None => FrictionLaw::None,
        Friction::Coulomb { mu } => FrictionLaw::Coulomb { mu },
        Friction::Elliptic { mu1, mu2, angle } => {
            FrictionLaw::Elliptic { mu: [mu1, mu2], angle: angle.to_radians() - azimuth }
        }
        Friction::Frp { mu_L, mu_T, mu_N, body, fibre } => {
            let wish = FibreChoice { section: "friction", body, fibre };
            let fibre = law_fibre(r, ground, "friction", wish, fibre_body)?;
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
    // Negative coefficients are reported elsewhere.
    if coefficients.iter().any(|mu| *mu < 0.0) {
        return Some(law);
    }
    if ellipse.mu.contains(&0.0) {
        let message =
            format!("friction is {} along one axis and 0 along the other", ellipse.mu[0].max(ellipse.mu[1]));
        let mend = "make the smaller coefficient at least a hundredth of the larger one (smaller values converge slowly), or both 0 for frictionless contact";
        r.report("friction", message, "0 in one direction only", mend);
    } else if ellipse.mu.iter().all(|mu| *mu > 0.0)
        && (ellipse.mu[0] > MAX_FRICTION_RATIO * ellipse.mu[1]
            || ellipse.mu[1] > MAX_FRICTION_RATIO * ellipse.mu[0])
    {
        let message =
            format!("friction is {} along one axis and {} along the other", ellipse.mu[0], ellipse.mu[1]);
        let mend = "reduce the ratio of the two coefficients to at most 100; ratios up to 1e6 are allowed, but converge slowly";
        r.report("friction", message, "more than a million times apart", mend);
    }
    Some(law)
}

fn wear_law(
    r: &mut Resolver,
    ground: LawContext<'_>,
    law: &Wear,
    of_friction: FibreChoice,
    fibre_body: &mut Option<usize>,
) -> Option<(WearLaw, WearIntegration)> {
    let azimuth = ground.azimuth();
    let (law, integration) = match *law {
        Wear::None => (WearLaw::None, WearIntegration::default()),
        Wear::Archard { i, integration } => (WearLaw::Archard { i }, integration),
        Wear::Orthotropic { i1, i2, angle, integration } => {
            let law = WearLaw::Orthotropic { i: [i1, i2], angle: angle.to_radians() - azimuth };
            (law, integration)
        }
        Wear::Frp { i_L, i_T, i_N, body, fibre, integration } => {
            let own = FibreChoice { section: "wear", body, fibre };
            let wish = if body.is_some() || fibre.is_some() { own } else { of_friction };
            let fibre = law_fibre(r, ground, "wear", wish, fibre_body)?;
            let law = WearLaw::Frp {
                i_l: i_L,
                i_t: i_T,
                i_n: i_N,
                tilt: fibre.tilt,
                azimuth: fibre.azimuth - azimuth,
            };
            (law, integration)
        }
        Wear::Energy { k, integration } => (WearLaw::Energy { k }, integration),
    };
    if integration.move_mesh.is_some() {
        check_mesh_motion(r, ground, integration.share);
    }
    Some((law, integration))
}

fn check_mesh_motion(r: &mut Resolver, ground: LawContext<'_>, share: f64) {
    // Errors of a body itself are reported elsewhere.
    let [Some(body1), Some(body2)] = ground.bodies else { return };
    let parts = [(body1, share), (body2, 1.0 - share)];
    if parts.iter().any(|(body, part)| body.as_fe().is_some() && *part > 0.0) {
        return;
    }
    let message = "`move_mesh` needs a finite-element body that wears, but no finite-element body wears";
    let mend = "remove it, or set `share` (the fraction of the wear depth assigned to body 1) so that the meshed body wears";
    r.report("wear.move_mesh", message, "no mesh that wears", mend);
}

/// Fibre direction for the law of `section`. The angles of the law come first, then the fibre of the named body, then
/// the fibre of the only body with a fibre. If the fibre of a body varies, the law uses the mean direction under the
/// frame.
fn law_fibre(
    r: &mut Resolver,
    ground: LawContext<'_>,
    section: &str,
    wish: FibreChoice,
    fibre_body: &mut Option<usize>,
) -> Option<FibreAngles> {
    if let Some(fibre) = wish.fibre {
        return Some(fibre.into());
    }
    // Errors of a body itself are reported elsewhere.
    let [Some(body1), Some(body2)] = ground.bodies else { return None };
    let has_fibre = [body1, body2].map(BodyPlan::has_fibre);
    let index = match (wish.body, has_fibre) {
        (Some(number), has_fibre) => {
            let index = usize::from(number == 2);
            if !has_fibre[index] {
                // A wear law may use `friction.body`. Then the errors of both laws name [friction] and are equal.
                let section = wish.section;
                let message = format!("{section}.body = {number}, but body {number} has no `fibre`");
                let mend = format!("add fibre = {{ tilt = ..., azimuth = ... }} to [body{number}]");
                return r.refuse(&format!("{section}.body"), message, "has no fibre", mend);
            }
            index
        }
        (None, [true, false]) => 0,
        (None, [false, true]) => 1,
        (None, [false, false]) => {
            // The schema check reports a fibre of a rigid body as an unknown key.
            if r.unknown_keys.iter().any(|key| key == "body1.fibre" || key == "body2.fibre") {
                return None;
            }
            let message = format!("{section}.law = \"frp\" needs a fibre, but neither body has one");
            let mend = "add fibre = { tilt = 0.0, azimuth = 0.0 } to the fibre-reinforced body, which must not be rigid";
            return r.refuse(&format!("{section}.law"), message, "needs a fibre", mend);
        }
        (None, [true, true]) => {
            let message =
                format!("both bodies have a fibre direction; {section} does not say which one to use");
            return r.refuse(
                &format!("{section}.law"),
                message,
                "which body?",
                format!("add `body = 1` or `body = 2` to [{section}]"),
            );
        }
    };
    *fibre_body = Some(index);
    refuse_inclined_frame(r, ground, section)?;
    let body = if index == 0 { body1 } else { body2 };
    match (body.material().and_then(|elastic| elastic.fibre), body.as_fe()) {
        (Some(fibre), _) => Some(fibre),
        (None, Some(fe)) => fibre_under_frame(r, ground, section, index, fe),
        (None, None) => None,
    }
}

/// Refuses (`None`) a curved or inclined contact frame. The tilt of a body's fibre is the angle to the plane z = 0, but
/// the law needs the angle to the contact surface.
fn refuse_inclined_frame(r: &mut Resolver, ground: LawContext<'_>, section: &str) -> Option<()> {
    // Errors of the frame or the contact group are reported elsewhere.
    let &FramePlan::Mesh { body, .. } = ground.frame? else { return Some(()) };
    let meshed = ground.bodies[body].as_ref().and_then(BodyPlan::as_meshed)?;
    let faces = group_faces(&meshed.mesh, &meshed.contact).ok()?;
    let areas: Vec<Point> = faces.iter().map(|face| face.area_vector(&meshed.mesh)).collect();
    let mean: Point = areas.iter().sum();
    let angle = |a: &Point, b: &Point| a.cross(b).norm().atan2(a.dot(b)).to_degrees();
    let spread = areas.iter().map(|area| angle(area, &mean)).fold(0.0, f64::max);
    let inclination = angle(&mean, &(Point::z() * mean.z.signum()));
    let what = if spread > MAX_NORMAL_SPREAD_DEG {
        format!(
            "its normals deviate by up to {spread:.1} degrees from their mean (limit: {MAX_NORMAL_SPREAD_DEG})"
        )
    } else if inclination > MAX_FRAME_INCLINATION_DEG {
        format!(
            "its mean normal is {inclination:.1} degrees away from z (limit: {MAX_FRAME_INCLINATION_DEG})"
        )
    } else {
        return Some(());
    };
    let message = format!(
        "{section}.law = \"frp\" measures the angle between fibre and contact surface from the plane z = 0, but the contact frame is not parallel to that plane: {what}"
    );
    let help = format!(
        "give the angles to the contact surface, the same in all cells: {section}.fibre = {{ tilt = .., azimuth = .. }}; \
         or use law \"{}\"",
        if section == "wear" { "orthotropic" } else { "elliptic" }
    );
    r.refuse(&format!("{section}.law"), message, "frame is not parallel to z = 0", help)
}

/// Mean fibre direction of a meshed body under the frame. Refused if a fibre deviates too much from the mean.
fn fibre_under_frame(
    r: &mut Resolver,
    ground: LawContext<'_>,
    section: &str,
    index: usize,
    fe: &MeshedBodyPlan,
) -> Option<FibreAngles> {
    // Errors of elements or the contact group are reported elsewhere.
    let surface = mean_material_under_frame(fe, ground.frame?).ok()?;
    let spread = surface.fibre_spread.to_degrees();
    let fibre = surface.material.fibre?;
    if spread > MAX_FIBRE_SPREAD_DEG {
        let message = format!(
            "{section} uses one fibre direction, but the fibres of body {} under the frame deviate by up to \
             {spread:.1} degrees from their mean (limit: {MAX_FIBRE_SPREAD_DEG})",
            index + 1
        );
        let mend = format!("set the direction to use: {section}.fibre = {{ tilt = .., azimuth = .. }}");
        return r.refuse(&format!("{section}.law"), message, "which direction?", mend);
    }
    r.note(format!(
        "{section} uses the mean fibre direction of body {} under the frame: tilt {:.2}, azimuth {:.2} degrees{}",
        index + 1,
        fibre.tilt.to_degrees(),
        fibre.azimuth.to_degrees(),
        if spread > 1e-6 {
            format!("; the fibres deviate from it by up to {spread:.2} degrees")
        } else {
            String::new()
        }
    ));
    Some(fibre)
}

/// Maximum angle, degrees, between a face normal and the mean normal. Laws with one fibre angle need a nearly plane
/// frame.
const MAX_NORMAL_SPREAD_DEG: f64 = 5.0;

/// Maximum angle, degrees, between the frame's mean normal and z. Above 0, because meshes of flat surfaces are
/// inaccurate.
const MAX_FRAME_INCLINATION_DEG: f64 = 1.0;

/// Maximum angle, degrees, between a fibre and the mean fibre direction.
const MAX_FIBRE_SPREAD_DEG: f64 = 5.0;
