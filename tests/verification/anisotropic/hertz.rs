//! Hertz contact on anisotropic half-spaces: the exact ellipse (Willis 1966).
//!
//! Case names refer to the catalogue in docs/verification.md.

use orthowear::bem::half_space::Side;
use orthowear::bem::half_space::SurfaceGreen;
use orthowear::evolution::records::Outcome;
use orthowear::material::Stiffness;
use std::f64::consts::PI;

use super::green::about_y;
use crate::common::{half_spaces, indent, press, relative, solve, sphere};
use crate::crystals::{cfrp_of_tables, cubic, with_ratio, zinc};
use crate::observed::{hertz_ellipse, radius};
use nalgebra::{Rotation3, Vector3};

/// Published contact under a rigid sphere: `force` (N), semi-axes (mm), `angle` of the long axis from x (degrees; `None` for a
/// circle). `peak` is the largest pressure (MPa), `approach` is in mm.
struct Case {
    name: &'static str,
    material: Stiffness,
    force: f64,
    axes: [f64; 2],
    angle: Option<f64>,
    peak: f64,
    approach: f64,
}

fn in_plane(stiffness: &Stiffness, degrees: f64) -> Stiffness {
    stiffness.rotated(Rotation3::from_axis_angle(&Vector3::z_axis(), degrees.to_radians()).matrix())
}

fn cases() -> Vec<Case> {
    let fibre = |name, material, angle| Case {
        name,
        material,
        force: 100.0,
        axes: [0.4326918164, 0.3842083658],
        angle: Some(angle),
        peak: 287.2075736,
        approach: 0.01674191382,
    };
    vec![
        fibre("fibre along x", cfrp_of_tables(), 90.0),
        fibre("fibre turned by 30 degrees", in_plane(&cfrp_of_tables(), 30.0), -60.0),
        Case {
            name: "fibre along the normal",
            material: about_y(&cfrp_of_tables(), 90.0),
            force: 100.0,
            axes: [0.2514225177, 0.2483075916],
            angle: Some(0.0),
            peak: 764.7988351,
            approach: 0.006243497122,
        },
        Case {
            name: "zinc, axis in the surface",
            material: about_y(&zinc(1e3), 90.0),
            force: 1000.0,
            axes: [0.4029720023, 0.3594186597],
            angle: Some(0.0),
            peak: 3296.597256,
            approach: 0.01457841038,
        },
        Case {
            name: "zinc, axis along the normal",
            material: zinc(1e3),
            force: 1000.0,
            axes: [0.4758239482; 2],
            angle: None,
            peak: 2108.865071,
            approach: 0.02264084297,
        },
        Case {
            name: "copper",
            material: cubic(168.4e3, 121.4e3, 75.4e3),
            force: 1000.0,
            axes: [0.3825058375; 2],
            angle: None,
            peak: 3263.361996,
            approach: 0.01463107157,
        },
    ]
}

/// Angle between two axes with the directions `a` and `b`, degrees in [0, 90].
fn between(a: f64, b: f64) -> f64 {
    let d = (a - b).rem_euclid(180.0);
    d.min(180.0 - d)
}

/// Truth: the exact ellipses of the cases `aniso-hertz-cfrp` and `aniso-hertz-zinc-copper` under a rigid sphere of R = 10 mm. The
/// catalogue's tolerances are 5e-3 for the approach and one cell for the semi-axes. The direction of the long axis agrees to 1
/// degree, or to 5 degrees where a / b < 1.05. The peak pressure agrees to 1e-2.
#[test]
fn spheres_on_crystals_and_cfrp() {
    for case in cases() {
        let [a, b] = case.axes;
        let cells = 64;
        let half_width = 1.2 * a;
        let model = half_spaces(&case.material, None, (half_width, cells), sphere(10.0));
        let result = solve(&model, &[press(case.force)]);
        assert_eq!(result.outcome, Outcome::Converged, "{}", case.name);
        let (record, n) = (&result.records[0], model.frame.n_cells());
        assert!(relative(record.approach, case.approach) < 5e-3, "{}: {}", case.name, record.approach);
        assert!(relative(record.peak_pressure, case.peak) < 1e-2, "{}: {}", case.name, record.peak_pressure);
        let (long, short, angle) = hertz_ellipse(&model.frame, &result.state.tractions[2 * n..]);
        let cell = 2.0 * half_width / cells as f64;
        assert!((long - a).abs() < cell && (short - b).abs() < cell, "{}: {long} {short}", case.name);
        assert!((radius(record.contact_area) - (a * b).sqrt()).abs() < cell, "{}", case.name);
        if let Some(wanted) = case.angle {
            let tolerance = if a / b < 1.05 { 5.0 } else { 1.0 };
            assert!(between(angle, wanted) < tolerance, "{}: {angle} degrees", case.name);
        }
    }
}

/// Truth: case `swanson-vs-average-modulus`. With the mean indentation modulus 10919.77 MPa the contact on CFRP would be a circle
/// of radius 0.40953 mm. The exact semi-axes differ from this radius by 6 %. The computed semi-axes agree with the exact
/// semi-axes to 1 % and differ from the radius by more than 4 %. The computed approach agrees with the approach for the mean
/// modulus to 5e-3.
#[test]
fn the_mean_modulus_is_not_the_answer() {
    let model = half_spaces(&cfrp_of_tables(), None, (0.52, 64), sphere(10.0));
    let result = solve(&model, &[press(100.0)]);
    let n = model.frame.n_cells();
    let (long, short, _) = hertz_ellipse(&model.frame, &result.state.tractions[2 * n..]);
    assert!(relative(long, 0.4326918164) < 1e-2 && relative(short, 0.3842083658) < 1e-2, "{long} {short}");
    assert!(long > 1.04 * 0.4095269879 && short < 0.96 * 0.4095269879);
    assert!(relative(result.records[0].approach, 0.01677123538) < 5e-3);
}

/// Truth: case `indentation-modulus-cubic`. The force under a flat circular punch of radius a at the approach delta is F = 2 M a
/// delta, with the indentation modulus M. The tolerance is 1e-2. The radius a is the radius of a circle with the total area of
/// the cells. The singular pressure at the edge limits convergence to first order. With half the cell size, the error must
/// therefore fall below 0.75 times its value.
#[test]
fn flat_punches_on_crystals() {
    let copper = cubic(168.4, 121.4, 75.4);
    let to_normal = |stiffness: &Stiffness, direction: Vector3<f64>| {
        let rotation = Rotation3::rotation_between(&direction, &Vector3::z()).expect("not opposite");
        stiffness.rotated(rotation.matrix())
    };
    for (name, material, modulus) in [
        ("copper (100)", copper.clone(), 134.0130407),
        ("copper (111)", to_normal(&copper, Vector3::new(1.0, 1.0, 1.0)), 151.5844949),
        ("silicon (110)", to_normal(&cubic(165.7, 63.9, 79.6), Vector3::new(1.0, 1.0, 0.0)), 172.8121713),
    ] {
        let errors = [48, 96].map(|cells| {
            let flat = |x: f64, y: f64| if x.hypot(y) < 1.0 { 0.0 } else { 1.0 };
            let model = half_spaces(&material, None, (1.1, cells), flat);
            let result = solve(&model, &[indent(1e-3)]);
            let record = &result.records[0];
            let found = record.normal_force / (2.0 * radius(record.contact_area) * record.approach);
            found / modulus - 1.0
        });
        assert!(errors[1].abs() < 1e-2, "{name}: {errors:?}");
        assert!(errors[1].abs() < 0.75 * errors[0].abs(), "{name}: {errors:?}");
    }
}

/// Truth: case `str-modulus-ratio`. The ratio of the semi-axes under a sphere increases with E1 / E2 from 1 to 1e4. The solver
/// takes less than five times as many iterations as for E1 = E2.
#[test]
fn extreme_ratios_make_longer_ellipses() {
    let mut ratios = Vec::new();
    let mut iterations = Vec::new();
    for ratio in [1.0, 10.0, 100.0, 1e3, 1e4] {
        let material = with_ratio(ratio);
        let green = SurfaceGreen::new(&material, Side::Lower).expect("a Green's function");
        let mean = (0..64).map(|k| green.symbol(PI * k as f64 / 64.0)[(2, 2)].re).sum::<f64>() / 64.0;
        let a = (3.0 * 100.0 * 10.0 * mean / 8.0).cbrt();
        let model = half_spaces(&material, None, (2.0 * a, 64), sphere(10.0));
        let result = solve(&model, &[press(100.0)]);
        assert_eq!(result.outcome, Outcome::Converged, "{ratio}");
        let n = model.frame.n_cells();
        let (long, short, angle) = hertz_ellipse(&model.frame, &result.state.tractions[2 * n..]);
        assert!(ratio == 1.0 || between(angle, 90.0) < 0.1, "{ratio}: {angle}");
        assert!(!result.records[0].contact_touches_edge);
        ratios.push(long / short);
        iterations.push(result.records[0].iterations);
    }
    assert!(ratios.windows(2).all(|pair| pair[0] < pair[1]), "{ratios:?}");
    assert!(iterations.iter().all(|i| *i < 5 * iterations[0]), "{iterations:?}");
}
