use super::RulePoint;
use super::gauss::{gauss_legendre, quadrilateral};
use super::simplex::triangle;

/// Rule on the wedge, which is the triangle (0,0), (1,0), (0,1) times [-1, 1]. It is the product of the triangle rule
/// of `degree` and the `n`-point Gauss rule. The weights sum to 1.
pub fn wedge(degree: usize, n: usize) -> Vec<RulePoint<3>> {
    let line = gauss_legendre(n);
    triangle(degree)
        .into_iter()
        .flat_map(|([x, y], u)| line.iter().map(move |&(z, v)| ([x, y, z], u * v)))
        .collect()
}

/// Rule on the pyramid with the base [-1, 1]^2 at z = 0 and the apex (0, 0, 1), exact to degree 2n - 1. It has `n` x
/// `n` Gauss points on each of `n + 1` horizontal sections. The weights sum to 4/3.
pub fn pyramid(n: usize) -> Vec<RulePoint<3>> {
    let square = quadrilateral(n);
    // The area of a section is quadratic in z, so one more point along z is needed.
    gauss_legendre(n + 1)
        .into_iter()
        .flat_map(|(z, v)| {
            let (z, side) = (0.5 * (1.0 + z), 0.5 * (1.0 - z));
            square.iter().map(move |&([x, y], u)| ([x * side, y * side, z], 0.5 * v * u * side * side))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: for even i and j, the integral of x^i y^j z^k over the pyramid is 4 B(i + j + 3, k + 1) / ((i + 1) (j +
    /// 1)), with the beta function B. For odd i or j the integral is 0. Over the wedge, the integral is the product of
    /// the integrals over the triangle and the line.
    #[test]
    fn moments() {
        let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
        let power = |x: f64, k: usize| x.powi(k as i32);
        for n in 1..=4 {
            let degree = 2 * n - 1;
            for (i, j, k) in (0..=degree).flat_map(|i| (0..=degree - i).map(move |j| (i, j, degree - i - j)))
            {
                let sum: f64 = pyramid(n)
                    .iter()
                    .map(|([x, y, z], w)| w * power(*x, i) * power(*y, j) * power(*z, k))
                    .sum();
                let beta = factorial(i + j + 2) * factorial(k) / factorial(i + j + k + 3);
                let even = i % 2 == 0 && j % 2 == 0;
                let exact = if even { 4.0 * beta / ((i + 1) * (j + 1)) as f64 } else { 0.0 };
                assert!((sum - exact).abs() < 1e-14, "pyramid {n}: x^{i} y^{j} z^{k}");
                let sum: f64 = wedge(degree, n)
                    .iter()
                    .map(|([x, y, z], w)| w * power(*x, i) * power(*y, j) * power(*z, k))
                    .sum();
                let line = if k % 2 == 0 { 2.0 / (k + 1) as f64 } else { 0.0 };
                let exact = factorial(i) * factorial(j) / factorial(i + j + 2) * line;
                assert!((sum - exact).abs() < 1e-14, "wedge {n}: x^{i} y^{j} z^{k}");
            }
        }
    }
}
