//! Gross sliding: under a given normal force, the total friction depends only on the direction of slip. Cases are those of the
//! catalogue (docs/verification.md).

use orthowear::evolution::records::Outcome;
use orthowear::laws::friction::FrictionLaw;
use orthowear::material::Stiffness;

use crate::common::{half_spaces, im7, press, shift, solve};

const MU: [f64; 2] = [0.1, 0.2];

fn profile(name: &str) -> impl Fn(f64, f64) -> f64 {
    let name = name.to_owned();
    move |x, y| match name.as_str() {
        "flat punch" => f64::from(u8::from(x.hypot(y) > 0.5)),
        "sphere" => (x * x + y * y) / 20.0,
        "cone" => 0.05 * x.hypot(y),
        _ => ((x - 0.4).powi(2) + y * y).min((x + 0.4).powi(2) + y * y) / 4.0,
    }
}

/// Truth: case `gross-slip-any-pressure`. The normal force is 1000 N, and slip is at 30 degrees from the first axis of the
/// friction ellipse. The friction is (65.46536707, 151.1857892) N under any profile, to 1e-6. At four angles it agrees with the
/// formula of case `ellipse-sliding-direction`, to 1e-8 of the largest friction, 200 N. The displacement is 1e10 mm, so that
/// elastic displacements do not change the direction of slip.
#[test]
fn total_friction_does_not_depend_on_the_profile() {
    let steel = Stiffness::isotropic(210e3, 0.3).expect("steel");
    for (material, turned) in [(steel, 0.0), (im7(30.0), 25.0)] {
        for name in ["flat punch", "sphere", "cone", "two spots"] {
            let mut model = half_spaces(&material, None, (1.2, 24), profile(name));
            model.friction = FrictionLaw::Elliptic { mu: MU, angle: f64::to_radians(turned) };
            for theta in [0.0_f64, 30.0, 60.0, 90.0] {
                let result = solve(&model, &[press(1000.0), shift(1e10, theta + turned)]);
                assert_eq!(result.outcome, Outcome::Converged, "{name} {theta}");
                let (s, c) = theta.to_radians().sin_cos();
                let size = 1000.0 / (MU[0] * c).hypot(MU[1] * s);
                let wanted = [MU[0].powi(2) * c * size, MU[1].powi(2) * s * size];
                let [x, y] = result.records[1].tangential_force;
                let (st, ct) = turned.to_radians().sin_cos();
                let found = [ct * x + st * y, ct * y - st * x];
                for k in 0..2 {
                    assert!(
                        (found[k] - wanted[k]).abs() < 1e-8 * 200.0,
                        "{name} {theta} {turned}: {found:?} {wanted:?}"
                    );
                }
                if theta == 30.0 {
                    let published = [65.46536707, 151.1857892];
                    assert!((0..2).all(|k| (found[k] - published[k]).abs() < 1e-6), "{name}: {found:?}");
                }
            }
        }
    }
}
