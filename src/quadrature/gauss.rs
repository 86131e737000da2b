use super::RulePoint;

/// Abscissae and weights of the `n`-point Gauss-Legendre rule on [-1, 1], ascending; exact to degree 2n - 1.
///
/// # Source
/// Abramowitz and Stegun (1964), 25.4.29 and 22.16.6.
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let mut rule = vec![(0.0, 0.0); n];
    for i in 0..n.div_ceil(2) {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (value, derivative) = legendre(n, x);
            slope = derivative;
            let step = value / derivative;
            x -= step;
            if step.abs() < 1e-16 {
                slope = legendre(n, x).1;
                break;
            }
        }
        if 2 * i + 1 == n {
            x = 0.0;
            slope = legendre(n, x).1;
        }
        let weight = 2.0 / ((1.0 - x * x) * slope * slope);
        rule[i] = (-x, weight);
        rule[n - 1 - i] = (x, weight);
    }
    rule
}

/// Legendre polynomial P_n(x) and its derivative.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut previous, mut current) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (previous, current) = (current, ((2.0 * k - 1.0) * x * current - (k - 1.0) * previous) / k);
    }
    (current, n as f64 * (x * current - previous) / (x * x - 1.0))
}

/// `n` x `n` Gauss rule on the square [-1, 1]^2. It is exact to degree 2n - 1 along each axis; the weights sum to 4.
pub fn quadrilateral(n: usize) -> Vec<RulePoint<2>> {
    let line = gauss_legendre(n);
    line.iter().flat_map(|&(x, u)| line.iter().map(move |&(y, v)| ([x, y], u * v))).collect()
}

/// `n` x `n` x `n` Gauss rule on the cube [-1, 1]^3. It is exact to degree 2n - 1 along each axis; the weights sum
/// to 8.
pub fn hexahedron(n: usize) -> Vec<RulePoint<3>> {
    let line = gauss_legendre(n);
    quadrilateral(n)
        .into_iter()
        .flat_map(|([x, y], u)| line.iter().map(move |&(z, v)| ([x, y, z], u * v)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the rule is exact for x^k with k <= 2n - 1. For n < 10, the test also requires an error for k = 2n. The
    /// tolerance 1e-14 allows for rounding.
    #[test]
    fn exact_to_degree_2n_minus_1() {
        for n in 1..=20 {
            let integral = |k: i32| gauss_legendre(n).iter().map(|(x, w)| w * x.powi(k)).sum::<f64>();
            for k in 0..2 * n as i32 {
                let exact = if k % 2 == 0 { 2.0 / (f64::from(k) + 1.0) } else { 0.0 };
                assert!((integral(k) - exact).abs() < 1e-14, "n = {n}, k = {k}");
            }
            if n < 10 {
                let k = 2 * n as i32;
                assert!((integral(k) - 2.0 / (f64::from(k) + 1.0)).abs() > 1e-8, "n = {n}");
            }
        }
    }

    /// Truth: moments of the cube are products of moments of the line [-1, 1].
    #[test]
    fn cube_moments() {
        let integral: f64 =
            hexahedron(2).iter().map(|([x, y, z], w)| w * (1.0 + x * x * y * y * z * z + x * y)).sum();
        assert!((integral - (8.0 + 8.0 / 27.0)).abs() < 1e-14);
    }
}
