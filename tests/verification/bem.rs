//! Half-spaces: surface Green's function, polygon integrals, operators on the frame.

mod green;
mod operators;
mod patches;
mod periodic;

use nalgebra::Matrix3;
use orthowear::bem::half_space::{Side, SurfaceGreen};
use orthowear::geometry::fibre_axes;
use orthowear::material::{Orthotropic, Stiffness};
use serde_json::Value;

fn steel() -> Stiffness {
    Stiffness::isotropic(210e3, 0.3).expect("steel")
}

fn cfrp(tilt_degrees: f64) -> Stiffness {
    let im7 = Orthotropic {
        e1: 167230.0,
        e2: 9544.0,
        e3: 9544.0,
        g12: 5292.0,
        g13: 5292.0,
        g23: 3483.0,
        nu12: 0.272,
        nu13: 0.272,
        nu23: 0.369,
    };
    Stiffness::orthotropic(&im7).expect("CFRP").rotated(&fibre_axes(tilt_degrees.to_radians(), 0.0))
}

fn green(stiffness: &Stiffness, side: Side) -> SurfaceGreen {
    SurfaceGreen::new(stiffness, side).expect("a converged Green's function")
}

/// CFRP below steel.
fn pair(tilt_degrees: f64) -> SurfaceGreen {
    SurfaceGreen::sum(&[&green(&cfrp(tilt_degrees), Side::Lower), &green(&steel(), Side::Upper)])
}

fn matrix(value: &Value) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| value[i][j].as_f64().expect("a number of the table"))
}

fn relative(found: &Matrix3<f64>, expected: &Matrix3<f64>) -> f64 {
    (found - expected).amax() / expected.amax()
}

fn entries(value: &Value) -> impl Iterator<Item = (&str, &Value)> {
    value.as_object().expect("an object of the table").iter().map(|(key, entry)| (key.as_str(), entry))
}

/// Equal numbers in [0, 1) on every machine.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| 2.0 * self.next() - 1.0).collect()
    }
}
