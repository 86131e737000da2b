//! Solvers for contact without friction: compares projected conjugate gradients with the projected Barzilai-Borwein method.

use std::sync::Arc;

use orthowear::contact::{Method, SolverOptions};
use orthowear::evolution::Model;
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::Step;
use orthowear::flexibility::Flexibility;
use orthowear::frame::ContactFrame;

use crate::common::{half_spaces, im7, indent, press, solve_with, sphere, steel};

/// Gap of a wavy sphere. Its contact consists of several separate areas.
fn rough(x: f64, y: f64) -> f64 {
    let wave = |k: f64, angle: f64| (k * (angle.cos() * x + angle.sin() * y)).cos();
    sphere(20.0)(x, y) + 5e-4 * (3.0 + wave(9.0, 0.3) + wave(17.0, 1.4) + wave(31.0, 2.2))
}

/// A flexibility without preconditioner.
struct Bare(Arc<dyn Flexibility>);

impl Flexibility for Bare {
    fn n_cells(&self) -> usize {
        self.0.n_cells()
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        self.0.apply(tractions, gap);
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        self.0.apply_normal(pressure, normal_gap);
    }

    fn diagonal_blocks(&self) -> orthowear::flexibility::per_cell::PerCell<nalgebra::Matrix3<f64>> {
        self.0.diagonal_blocks()
    }
}

fn bare(model: Model) -> Model {
    Model { flexibility: Arc::new(Bare(model.flexibility)), ..model }
}

fn steps() -> [Step; 5] {
    [indent(0.004), indent(0.012), press(150.0), press(90.0), indent(-0.001)]
        .map(|step| Step { friction: false, ..step })
}

/// Truth: the problem is strictly convex, so that all solvers converge to its unique solution. The condition number of the normal
/// flexibility is below 100, so residuals of 1e-10 allow differences of 1e-8. The tolerance is 1e-7 of the peak pressure.
#[test]
fn conjugate_gradients_end_where_projection_does() {
    let options = SolverOptions { tolerance: 1e-10, ..SolverOptions::default() };
    let slow = SolverOptions { method: Method::BarzilaiBorwein, ..options };
    for (name, model, share) in [
        ("isotropic", half_spaces(&steel(), None, (0.8, 48), rough), 0.5),
        ("tilted fibre", half_spaces(&im7(30.0), Some(&steel()), (0.8, 48), rough), 0.5),
        ("without preconditioner", bare(half_spaces(&steel(), None, (0.8, 48), rough)), 1.0),
    ] {
        let fast = solve_with(&model, &steps(), &options);
        let slow = solve_with(&model, &steps(), &slow);
        assert_eq!((&fast.outcome, &slow.outcome), (&Outcome::Converged, &Outcome::Converged), "{name}");
        let mut products = [0, 0];
        for (a, b) in fast.records.iter().zip(&slow.records) {
            assert!(a.certificate.natural_residual <= 1e-10, "{name} {}", a.name);
            let apart =
                (a.normal_force - b.normal_force).abs().max((a.peak_pressure - b.peak_pressure).abs());
            assert!(apart <= 1e-7 * b.peak_pressure, "{name} {}: {apart:e}", a.name);
            assert!((a.approach - b.approach).abs() < 1e-7 * 0.012, "{name} {}", a.name);
            assert_eq!(a.contact_area, b.contact_area, "{name} {}", a.name);
            products[0] += a.operator_applications;
            products[1] += b.operator_applications;
        }
        assert!((products[0] as f64) < share * products[1] as f64, "{name}: {products:?}");
        let last = fast.records.last().unwrap();
        assert!(last.normal_force == 0.0 && last.contact_area == 0.0, "{name}: {last:?}");
    }
}

/// Truth: the approximate inverse M of the half-space operator S is symmetric and positive definite. For wave packets r with
/// wavelengths of 3 to 12 cells, r·(S M r) / r·r lies between 0.5 and 2 (Vollebregt 2014).
#[test]
fn the_approximate_inverse_is_one() {
    let (n, half_width) = (48, 0.8);
    let model = half_spaces(&im7(30.0), Some(&steel()), (half_width, n), sphere(20.0));
    let operator = model.flexibility.as_ref();
    let ContactFrame { centers, .. } = &model.frame;
    let bump = |k: f64, angle: f64| -> Vec<f64> {
        let at = |x: f64, y: f64| {
            (-(x * x + y * y) / 0.08).exp() * (k * (angle.cos() * x + angle.sin() * y)).cos()
        };
        centers.iter().map(|center| at(center.x, center.y)).collect()
    };
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let apply = |r: &[f64]| {
        let (mut z, mut back) = (vec![0.0; n * n], vec![0.0; n * n]);
        assert!(operator.precondition_normal(r, &mut z));
        operator.apply_normal(&z, &mut back);
        (z, back)
    };
    let cell = 2.0 * half_width / n as f64;
    let waves: Vec<f64> =
        [3.0, 5.0, 8.0, 12.0].map(|length| 2.0 * std::f64::consts::PI / (length * cell)).into();
    for (i, k) in waves.iter().enumerate() {
        let r = bump(*k, i as f64);
        let (z, back) = apply(&r);
        let share = dot(&r, &back) / dot(&r, &r);
        assert!((0.5..2.0).contains(&share), "wavenumber {k}: {share}");
        assert!(dot(&r, &z) > 0.0);
        let other = bump(7.0, 0.4 + i as f64);
        let (a, b) = (dot(&other, &z), dot(&r, &apply(&other).0));
        let size = (dot(&z, &z) * dot(&other, &other)).sqrt();
        // The approximate inverse is computed in single precision.
        assert!((a - b).abs() < 1e-5 * size, "{a} {b}");
    }
}
