//! Quadrature rules on the reference triangle (0,0), (1,0), (0,1) and on the reference tetrahedron. All weights are
//! positive.

use super::RulePoint;
use super::gauss::gauss_legendre;

/// Gauss rule with `n` points on [0, 1].
fn unit_line(n: usize) -> Vec<(f64, f64)> {
    gauss_legendre(n).into_iter().map(|(x, w)| (0.5 * (1.0 + x), 0.5 * w)).collect()
}

/// Rule on the reference triangle, exact to `degree`. The weights sum to 1/2.
///
/// Degrees 0 and 1 use the centroid, degree 2 the three-point rule of Strang and Fix (1973). Higher degrees map a Gauss
/// rule on the square to the triangle; one side of the square collapses to a corner.
pub fn triangle(degree: usize) -> Vec<RulePoint<2>> {
    const SIXTH: f64 = 1.0 / 6.0;
    match degree {
        0 | 1 => vec![([1.0 / 3.0, 1.0 / 3.0], 0.5)],
        2 => [[SIXTH, SIXTH], [4.0 * SIXTH, SIXTH], [SIXTH, 4.0 * SIXTH]].map(|x| (x, SIXTH)).to_vec(),
        _ => {
            // The Jacobian determinant 1 - u of this map adds one degree in u.
            let line = unit_line(degree / 2 + 1 + degree % 2);
            line.iter()
                .flat_map(|&(u, a)| line.iter().map(move |&(v, b)| ([u, v * (1.0 - u)], a * b * (1.0 - u))))
                .collect()
        }
    }
}

/// Rule on the reference tetrahedron (0,0,0), (1,0,0), (0,1,0), (0,0,1), exact to `degree`. The weights sum to 1/6.
///
/// Degrees 0 and 1 use the centroid, degree 2 the four-point rule of Hammer, Marlowe and Stroud (1956), degree 3 a rule
/// of eight points. Higher degrees map a Gauss rule on the cube to the tetrahedron; faces of the cube collapse to edges
/// and corners.
pub fn tetrahedron(degree: usize) -> Vec<RulePoint<3>> {
    if degree <= 1 {
        return vec![([0.25; 3], 1.0 / 6.0)];
    }
    if degree == 2 {
        let [near, far] = [3.0, -1.0].map(|s| (5.0 + s * 5f64.sqrt()) / 20.0);
        let points = [[far; 3], [near, far, far], [far, near, far], [far, far, near]];
        return points.map(|x| (x, 1.0 / 24.0)).to_vec();
    }
    if degree == 3 {
        return eight_points();
    }
    // The Jacobian determinant (1 - u)^2 (1 - v) of the map adds two degrees in u.
    let line = unit_line((degree + 4) / 2);
    let mut rule = Vec::with_capacity(line.len().pow(3));
    for &(u, a) in &line {
        for &(v, b) in &line {
            for &(w, c) in &line {
                let (p, q) = (1.0 - u, 1.0 - v);
                rule.push(([u, v * p, w * p * q], a * b * c * p * p * q));
            }
        }
    }
    rule
}

/// Rule of degree 3 with eight points of equal weight. Each point lies on the line through the centroid and a corner.
/// Its distance from the centroid, as a fraction of the distance to the corner, is t for four points and u for four
/// points. A negative fraction is on the side opposite to the corner.
///
/// Degree 2 requires t² + u² = 2/5, and degree 3 requires t³ + u³ = 2/15. Therefore s = t + u solves s³ - 6/5 s +
/// 4/15 = 0. Viète's formula gives the root for which all points lie inside.
fn eight_points() -> Vec<RulePoint<3>> {
    let radius = 2.0 * 0.4f64.sqrt();
    let angle = (-(4.0 / 15.0) / (2.0 * 0.4f64.powf(1.5))).acos() / 3.0;
    let s = radius * (angle - 2.0 * std::f64::consts::FRAC_PI_3).cos();
    let root = (0.8 - s * s).sqrt();
    [0.5 * (s + root), 0.5 * (s - root)]
        .into_iter()
        .flat_map(|share| {
            let (far, near) = (0.25 * (1.0 - share), 0.25 * (1.0 + 3.0 * share));
            [[far; 3], [near, far, far], [far, near, far], [far, far, near]]
        })
        .map(|x| (x, 1.0 / 48.0))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factorial(n: usize) -> f64 {
        (1..=n).map(|k| k as f64).product()
    }

    /// Truth: the integral of x^i y^j is i! j! / (i + j + 2)!.
    #[test]
    fn triangle_moments() {
        for degree in 0..=7 {
            for i in 0..=degree {
                for j in 0..=degree - i {
                    let sum: f64 = triangle(degree)
                        .iter()
                        .map(|([x, y], w)| w * x.powi(i as i32) * y.powi(j as i32))
                        .sum();
                    let exact = factorial(i) * factorial(j) / factorial(i + j + 2);
                    assert!((sum - exact).abs() < 1e-15, "degree {degree}, x^{i} y^{j}");
                }
            }
        }
    }

    /// Truth: the rule has n³ points. n is the smallest number for which 2n - 1 is at least degree + 2, because the
    /// collapse adds two degrees.
    #[test]
    fn no_more_points_than_the_degree_takes() {
        for degree in 4..12 {
            let along = (1..).find(|n| 2 * n > degree + 2).expect("a number of points");
            assert_eq!(tetrahedron(degree).len(), along * along * along, "degree {degree}");
        }
    }

    /// Truth: the integral of x^i y^j z^k is i! j! k! / (i + j + k + 3)!.
    #[test]
    fn tetrahedron_moments() {
        for degree in 0..=5 {
            for i in 0..=degree {
                for j in 0..=degree - i {
                    let k = degree - i - j;
                    let sum: f64 = tetrahedron(degree)
                        .iter()
                        .map(|([x, y, z], w)| w * x.powi(i as i32) * y.powi(j as i32) * z.powi(k as i32))
                        .sum();
                    let exact = factorial(i) * factorial(j) * factorial(k) / factorial(degree + 3);
                    assert!((sum - exact).abs() < 1e-15, "degree {degree}, x^{i} y^{j} z^{k}");
                }
            }
        }
    }
}
