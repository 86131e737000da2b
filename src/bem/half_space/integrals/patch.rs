//! Displacement due to a patch of constant traction: exact integrals for near targets, Gauss rules for distant ones.

use nalgebra::Matrix3;

use crate::bem::half_space::green::angular_table::{AngularTable, matrix};
use crate::bem::half_space::green::{HARMONIC_CUTOFF, SurfaceGreen};
use crate::bem::half_space::integrals::polygon;
use crate::quadrature::gauss_legendre;

/// Maximum number of Gauss points per direction.
const MAX_POINTS: usize = 16;

/// Polygons use Gauss rules whenever this many points per direction suffice. That is the case only far away, where the
/// exact integral loses accuracy.
const FEW_POINTS: usize = 4;
/// Cost of one Gauss point, divided by the cost of one harmonic of the exact integral.
const SLOWER: usize = 2;

/// Negative natural logarithm of the accuracy of the Gauss rules (1e-14).
const LN_ACCURACY: f64 = 32.3;

/// Integrates the surface Green's function over patches, with an error of about 1e-13.
#[derive(Debug, Clone)]
pub struct PatchIntegrator {
    green: SurfaceGreen,
    table: AngularTable,
    /// Singularity distance of the Green's function, as defined for [`SurfaceGreen::singularity_distance`].
    singularity_distance: f64,
    /// Gauss-Legendre rules on [-1, 1] with 1, 2, ... points.
    rules: Vec<Vec<(f64, f64)>>,
}

impl PatchIntegrator {
    /// Prepares the integration of a Green's function.
    pub fn new(green: &SurfaceGreen) -> Self {
        // Same estimate as in [`SurfaceGreen::singularity_distance`].
        let strip = -HARMONIC_CUTOFF.ln() / green.order().max(1) as f64;
        Self {
            green: green.clone(),
            table: AngularTable::from_green(green),
            singularity_distance: strip.tanh(),
            rules: (1..=MAX_POINTS).map(gauss_legendre).collect(),
        }
    }

    /// Green's function that is integrated.
    pub fn green(&self) -> &SurfaceGreen {
        &self.green
    }

    /// `∫ G(offset - y) dA_y` over the rectangle with the given sides (mm) and its centre at the origin, mm/MPa.
    pub fn rectangle(&self, sides: [f64; 2], offset: [f64; 2]) -> Matrix3<f64> {
        let [a, b] = sides.map(|side| side / 2.0);
        let distance = offset[0].hypot(offset[1]) - a.hypot(b);
        let (Some(nx), Some(ny)) = (self.points(sides[0], distance), self.points(sides[1], distance)) else {
            return polygon::integrate(&self.green, &[[-a, -b], [a, -b], [a, b], [-a, b]], offset);
        };
        let mut sum = [0.0; 9];
        for &(s, ws) in &self.rules[nx - 1] {
            for &(t, wt) in &self.rules[ny - 1] {
                self.add_point([offset[0] - a * s, offset[1] - b * t], ws * wt * a * b, &mut sum);
            }
        }
        matrix(&sum)
    }

    /// `∫ G(target - y) dA_y` over a polygon (corners counter-clockwise, star-shaped about their mean), mm/MPa.
    pub fn polygon(&self, corners: &[[f64; 2]], target: [f64; 2]) -> Matrix3<f64> {
        let count = corners.len() as f64;
        let center = [0, 1].map(|c| corners.iter().map(|p| p[c]).sum::<f64>() / count);
        let radius = corners.iter().map(|p| (p[0] - center[0]).hypot(p[1] - center[1])).fold(0.0, f64::max);
        let distance = (target[0] - center[0]).hypot(target[1] - center[1]) - radius;
        match self.points(2.0 * radius, distance) {
            // The rule has one more point, because the Jacobian of the triangles about the centre is linear in one
            // direction.
            Some(n) if n <= FEW_POINTS || SLOWER * (n + 1) * (n + 1) < self.green.order() => {
                self.fan(corners, center, target, n + 1)
            }
            _ => polygon::integrate(&self.green, corners, target),
        }
    }

    /// Integral by Gauss rules with `n` points per direction on the triangles between the centre and the edges.
    fn fan(&self, corners: &[[f64; 2]], center: [f64; 2], target: [f64; 2], n: usize) -> Matrix3<f64> {
        let mut sum = [0.0; 9];
        for (k, from) in corners.iter().enumerate() {
            let to = corners[(k + 1) % corners.len()];
            let (u, v) = ([0, 1].map(|c| from[c] - center[c]), [0, 1].map(|c| to[c] - center[c]));
            let twice_area = u[0] * v[1] - u[1] * v[0];
            for &(s, ws) in &self.rules[n - 1] {
                let radial = (1.0 + s) / 2.0;
                for &(t, wt) in &self.rules[n - 1] {
                    let along = (1.0 + t) / 2.0;
                    let source = [0, 1].map(|c| center[c] + radial * (u[c] + along * (v[c] - u[c])));
                    let weight = ws * wt / 4.0 * radial * twice_area;
                    self.add_point([target[0] - source[0], target[1] - source[1]], weight, &mut sum);
                }
            }
        }
        matrix(&sum)
    }

    fn add_point(&self, x: [f64; 2], weight: f64, sum: &mut [f64; 9]) {
        self.table.add(x[0], x[1], weight / (x[0] * x[0] + x[1] * x[1]).sqrt(), sum);
    }

    /// Number of Gauss points along a `side` for a target at least `distance` away; `None` if the exact integral is
    /// required.
    ///
    /// If the nearest complex singularity is x half-lengths away from a segment, n points have the error ρ^(-2n) with
    /// ρ = x + sqrt(1 + x^2).
    fn points(&self, side: f64, distance: f64) -> Option<usize> {
        let x = 2.0 * distance * self.singularity_distance / side;
        if x <= 0.0 {
            return None;
        }
        let n = (LN_ACCURACY / (2.0 * x.asinh())).ceil();
        (n <= MAX_POINTS as f64).then_some(n as usize)
    }
}
