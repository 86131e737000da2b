//! Shapes of gaps against closed forms of indenters. Cases are those of the catalogue (docs/verification.md).

use std::f64::consts::PI;

use orthowear::evolution::records::{IncrementRecord, Outcome};
use orthowear::evolution::{Model, RunResult};
use orthowear::frame::height_table::HeightTable;
use orthowear::frame::{ContactFrame, GapShape, InitialGap};

use crate::common::{half_spaces, indent, press, relative, solve, steel};

fn pressed_by(gap: &InitialGap, (half_width, cells): (f64, usize)) -> Model {
    let mut model = half_spaces(&steel(), None, (half_width, cells), |_, _| 0.0);
    let n = model.frame.n_cells();
    model.initial_gap[2 * n..].copy_from_slice(&gap.evaluate(&model.frame).expect("an admissible gap"));
    model
}

fn shape(shape: GapShape) -> InitialGap {
    shape.into()
}

fn first(result: &RunResult) -> &IncrementRecord {
    assert_eq!(result.outcome, Outcome::Converged);
    &result.records[0]
}

fn radius(record: &IncrementRecord) -> f64 {
    (record.contact_area / PI).sqrt()
}

/// Truth: case `cone-sneddon`. For the slope angle b and the contact radius a, the approach is (pi / 2) a tan b, to 5e-3. The
/// contact radius agrees within a cell. The pressure agrees to 1e-2 at half the contact radius, away from the singularity at the
/// tip.
#[test]
fn a_cone() {
    let (a, cells) = (0.177_572_3, 50);
    let model = pressed_by(&shape(GapShape::Cone { slope: 5f64.to_radians() }), (1.25 * a, cells));
    let result = solve(&model, &[press(1000.0)]);
    let found = first(&result);
    assert!(relative(found.approach, 0.024_403_205_57) < 5e-3, "{}", found.approach);
    assert!((radius(found) - a).abs() < 2.5 * a / cells as f64);
    let n = model.frame.n_cells();
    let slope = 5f64.to_radians().tan();
    for (center, p) in model.frame.centers.iter().zip(&result.state.tractions[2 * n..]) {
        let r = center.x.hypot(center.y);
        if (0.45 * a..0.55 * a).contains(&r) {
            let wanted = 210e3 / 0.91 * slope / 2.0 * (a / r).acosh();
            assert!(relative(*p, wanted) < 1e-2, "{r}: {p} {wanted}");
        }
    }
}

/// Truth: case `power-law-quartic`. For the gap B r^4 the approach agrees to 5e-3, the contact radius within a cell.
#[test]
fn a_quartic() {
    let (a, cells) = (1.003_105_65, 50);
    let gap = shape(GapShape::Power { exponent: 4.0, coefficient: 0.001 });
    let result = solve(&pressed_by(&gap, (1.25 * a, cells)), &[press(1000.0)]);
    let found = first(&result);
    assert!(relative(found.approach, 0.002_699_948_239) < 5e-3, "{}", found.approach);
    assert!((radius(found) - a).abs() < 2.5 * a / cells as f64);
}

/// Truth: case `sphere-exact-profile` (Segedin 1957), with a contact radius of 0.4 times the sphere radius. The force on the
/// exact sphere agrees to 5e-3. The force on the paraboloid at the same contact radius is 7 % smaller.
#[test]
fn an_exact_sphere() {
    for gap in [GapShape::Sphere { radius: 10.0 }, GapShape::SemiAxes { semi_axes: [10.0; 3], angle: 0.4 }] {
        let gap = InitialGap { exact: true, ..gap.into() };
        let result = solve(&pressed_by(&gap, (5.0, 60)), &[indent(1.694_595_721)]);
        let found = first(&result);
        assert!(relative(found.normal_force, 2_109_986.747) < 5e-3, "{}", found.normal_force);
        assert!((radius(found) - 4.0).abs() < 10.0 / 60.0);
    }
}

/// Truth: case `hertz-conforming-socket`. A steel ball of radius 10 mm in a steel socket of radius 10.5 mm follows Hertz with the
/// relative radius 210 mm, to 1e-2.
#[test]
fn a_ball_in_a_socket() {
    let (a, cells) = (0.880_442_270_8, 50);
    let mut model = half_spaces(&steel(), Some(&steel()), (1.25 * a, cells), |_, _| 0.0);
    let n = model.frame.n_cells();
    // The gap is the distance between the exact spheres, not between their paraboloids.
    for (cell, center) in model.frame.centers.iter().enumerate() {
        let height = |r: f64| r - (r * r - center.x * center.x - center.y * center.y).sqrt();
        model.initial_gap[2 * n + cell] = height(10.0) - height(10.5);
    }
    let result = solve(&model, &[press(500.0)]);
    let found = first(&result);
    assert!(relative(found.approach, 0.003_691_326_63) < 1e-2, "{}", found.approach);
    assert!(relative(found.peak_pressure, 307.970_856_1) < 1e-2, "{}", found.peak_pressure);
    assert!(relative(radius(found), a) < 1e-2 + 1.25 / cells as f64, "{}", radius(found));
}

/// Truth: the contact of a rotated and displaced ellipsoid is the same if a table of heights describes the ellipsoid. The points
/// of the table have the distance h, a fifth of a cell. Bilinear interpolation has an error of h^2 / 8R, 2e-4 of the approach.
/// Pressures have a similar relative error.
#[test]
fn a_turned_height_map_is_its_surface() {
    let (offset, angle) = ([0.1, -0.05], 0.6);
    let ellipsoid = GapShape::Ellipsoid { radii: [20.0, 8.0], angle };
    let (n, spacing) = (401, 0.005);
    let mut values = Vec::with_capacity(n * n);
    for ix in 0..n {
        for iy in 0..n {
            let [x, y] = [ix, iy].map(|i| (i as f64 - 200.0) * spacing);
            values.push(x * x / 40.0 + y * y / 16.0 + 3.0);
        }
    }
    let map = HeightTable { values, shape: [n, n], spacing: Some([spacing; 2]), angle };
    let grid = (0.5, 40);
    let [smooth, sampled] = [ellipsoid, GapShape::Heights(map)].map(|shape| {
        let gap = InitialGap { offset, ..shape.into() };
        let model = pressed_by(&gap, grid);
        let frame: &ContactFrame = &model.frame;
        assert!(frame.n_cells() == 1600);
        first(&solve(&model, &[press(300.0)])).clone()
    });
    assert!(relative(sampled.peak_pressure, smooth.peak_pressure) < 1e-3);
    assert!((sampled.moment[0] - smooth.moment[0]).abs() < 1e-3 * 300.0 * 0.1);
    assert!(relative(sampled.contact_area, smooth.contact_area) < 1e-2);
}
