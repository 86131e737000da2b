//! Boundary-element bodies: surface Green's function, polygon integrals, operators on the frame, finite bodies.

mod compressed;
pub mod bodies;
mod finite;
mod finite_compressed;
mod full_space;
mod graded;
mod green;
mod inside;
mod operators;
mod patches;
mod periodic;
mod point_force;
mod truncated;

use nalgebra::Matrix3;
use orthowear::bem::half_space::{Side, SurfaceGreen};
use orthowear::material::Stiffness;
use serde_json::Value;

use crate::common::{im7 as cfrp, steel};

fn green(stiffness: &Stiffness, side: Side) -> SurfaceGreen {
    SurfaceGreen::new(stiffness, side).expect("a converged Green's function")
}

/// Sum of the Green's functions of CFRP (lower body, fibre tilted by `tilt_degrees`) and steel (upper body).
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

/// Pseudo-random numbers that are the same on every machine. `next` lies in [0, 1), the entries of `vector` in [-1, 1).
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
