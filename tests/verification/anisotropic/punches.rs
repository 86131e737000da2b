//! Flat punches on anisotropic half-spaces (Willis 1966).
//!
//! Case names refer to the catalogue in docs/verification.md.

use std::f64::consts::PI;

use orthowear::evolution::records::Outcome;
use orthowear::frame::{GapShape, Outline};

use crate::common::{press, relative, solve, steel};
use crate::crystals::cfrp_of_tables;
use crate::punches::{frame, model};

/// Truth: case `aniso-punch-circular-elliptic`, CFRP with the fibre along x and a force F = 100 N. The approach agrees to 1e-2.
/// Anisotropy does not change the pressure p = F / (2 pi a b sqrt(1 - x²/a² - y²/b²)) under a punch with the semi-axes a and b.
/// Within 0.8 of the semi-axes the computed pressure agrees with the computed pressure on steel to 1e-2. It agrees with p only to
/// 2.5e-2, because the cells approximate the edge of the punch.
#[test]
fn discs_and_ellipses_on_cfrp() {
    let force = 100.0;
    let ellipse = |angle: f64| Outline::Ellipse { semi_axes: [3.0, 1.0], angle, center: [0.0; 2] };
    for (outline, [a, b], angle, approach) in [
        (Outline::Circle { radius: 2.0, center: [0.0; 2] }, [2.0, 2.0], 0.0, 0.002289425),
        (ellipse(0.0), [3.0, 1.0], 0.0, 0.002570639),
        (ellipse(PI / 2.0), [3.0, 1.0], PI / 2.0, 0.002345543),
    ] {
        let cells = (40.0 * a / b) as usize * 3 / 2;
        let punch = model(&cfrp_of_tables(), None, frame(&outline, a, cells), GapShape::Flat);
        let result = solve(&punch, &[press(force)]);
        let isotropic = solve(&model(&steel(), None, punch.frame.clone(), GapShape::Flat), &[press(force)]);
        assert!([&result, &isotropic].iter().all(|run| run.outcome == Outcome::Converged));
        let found = &result.records[0];
        assert!(relative(found.approach, approach) < 1e-2, "{a} {angle}: {}", found.approach);
        let n = punch.frame.n_cells();
        let (sin, cos) = f64::sin_cos(angle);
        for (cell, center) in punch.frame.centers.iter().enumerate() {
            let [pressure, on_steel] = [&result, &isotropic].map(|run| run.state.tractions[2 * n + cell]);
            let (x, y) = (cos * center.x + sin * center.y, cos * center.y - sin * center.x);
            let share = (x / a).hypot(y / b);
            let wanted = force / (2.0 * PI * a * b * (1.0 - share * share).max(0.0).sqrt());
            if share < 0.8 {
                assert!(relative(pressure, on_steel) < 1e-2, "{x} {y}: {pressure} {on_steel}");
                assert!(relative(pressure, wanted) < 2.5e-2, "{x} {y}: {pressure} {wanted}");
            }
        }
    }
}
