//! Friction and wear laws.

use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;

/// Traction q = -p M² v / |M v| of the slip rule for the pressure p and the slip v, with M = diag(mu) (docs/theory-contact.md).
fn slip_rule(p: f64, mu: [f64; 2], v: [f64; 2]) -> [f64; 2] {
    let norm = (mu[0] * v[0]).hypot(mu[1] * v[1]);
    [-p * mu[0] * mu[0] * v[0] / norm, -p * mu[1] * mu[1] * v[1] / norm]
}

/// Truth: docs/theory-contact.md. Let q be the traction of the slip rule for the slip v. After the step q - r M² v with any r >
/// 0, radial return to the friction ellipse gives q again. After the step q - r v, the return misses q by more than 1e-3 p,
/// except near the axes.
#[test]
fn radial_return_goes_with_the_metric_step() {
    let (mu, p, r) = ([0.4, 0.55], 7.0, 3.0);
    let radial = |q: [f64; 2]| {
        let norm = (q[0] / mu[0]).hypot(q[1] / mu[1]);
        if norm > p { [q[0] * p / norm, q[1] * p / norm] } else { q }
    };
    for k in 1..12 {
        let angle = 0.5 * f64::from(k);
        let v = [angle.cos(), angle.sin()];
        let q = slip_rule(p, mu, v);
        let metric = radial([q[0] - r * mu[0] * mu[0] * v[0], q[1] - r * mu[1] * mu[1] * v[1]]);
        assert!((metric[0] - q[0]).hypot(metric[1] - q[1]) < 1e-14 * p);
        let euclid = radial([q[0] - r * v[0], q[1] - r * v[1]]);
        if (2.0 * angle).sin().abs() > 0.5 {
            assert!((euclid[0] - q[0]).hypot(euclid[1] - q[1]) > 1e-3 * p);
        }
    }
}

/// Truth: friction coefficients of the FRP law in docs/scene.md, for `mu_l`, `mu_t` and `mu_n` of the reference scene.
#[test]
fn frp_interpolation() {
    for (tilt, mu) in [(0.0_f64, [0.4, 0.5]), (30.0, [0.45, 0.516_666_666_666_666_7]), (90.0, [0.55, 0.55])] {
        for sign in [1.0, -1.0] {
            let law = FrictionLaw::Frp {
                mu_l: 0.4,
                mu_t: 0.5,
                mu_n: 0.55,
                tilt: sign * tilt.to_radians(),
                azimuth: 0.3,
            };
            let ellipse = law.ellipse().expect("friction");
            assert!((ellipse.mu[0] - mu[0]).abs() < 1e-15 && (ellipse.mu[1] - mu[1]).abs() < 1e-15);
            assert_eq!(ellipse.angle, 0.3);
            // Here `i_l`, `i_t` and `i_n` are k times `mu_l`, `mu_t` and `mu_n`. Both wear laws therefore agree for every tilt.
            let wear = WearLaw::Energy { k: 1.25e-9 }.specific_rate(Some(ellipse)).expect("wear");
            let frp = WearLaw::Frp {
                i_l: 5.0e-10,
                i_t: 6.25e-10,
                i_n: 6.875e-10,
                tilt: sign * tilt.to_radians(),
                azimuth: 0.3,
            };
            let direct = frp.specific_rate(None).expect("wear");
            for k in 0..2 {
                assert!((wear.i[k] - direct.i[k]).abs() < 1e-24);
            }
        }
    }
}

/// Truth: without coefficients there is neither friction nor wear.
#[test]
fn nothing_from_nothing() {
    assert!(FrictionLaw::None.ellipse().is_none());
    assert!(FrictionLaw::Coulomb { mu: 0.0 }.ellipse().is_none());
    assert!(WearLaw::None.specific_rate(None).is_none());
    assert!(WearLaw::Energy { k: 1.0 }.specific_rate(None).is_none());
}
