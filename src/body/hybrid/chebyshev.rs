//! Chebyshev nodes along the sides of a patch, and the polynomials through these nodes.

use std::f64::consts::PI;

/// Chebyshev nodes of the first kind on an interval, and the Lagrange polynomials through them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chebyshev {
    nodes: Vec<f64>,
    /// Barycentric weights.
    weights: Vec<f64>,
}

impl Chebyshev {
    /// Creates `m` nodes on the interval [-half, half].
    pub fn new(m: usize, half: f64) -> Self {
        let angle = |k: usize| (2 * k + 1) as f64 * PI / (2 * m) as f64;
        let nodes = (0..m).map(|k| half * angle(k).cos()).collect();
        let weights = (0..m).map(|k| if k % 2 == 0 { angle(k).sin() } else { -angle(k).sin() }).collect();
        Self { nodes, weights }
    }

    pub fn nodes(&self) -> &[f64] {
        &self.nodes
    }

    /// Writes the values of the m Lagrange polynomials at `x` to `values`, `[m]`.
    pub fn lagrange(&self, x: f64, values: &mut [f64]) {
        if let Some(at) = self.nodes.iter().position(|node| *node == x) {
            values.fill(0.0);
            values[at] = 1.0;
            return;
        }
        for ((value, node), weight) in values.iter_mut().zip(&self.nodes).zip(&self.weights) {
            *value = weight / (x - node);
        }
        let sum: f64 = values.iter().sum();
        values.iter_mut().for_each(|value| *value /= sum);
    }

    /// Chebyshev coefficients of the Lagrange polynomials through m nodes, `[degree][node]`.
    pub fn coefficients(m: usize) -> Vec<Vec<f64>> {
        let row = |degree: usize| {
            let scale = if degree == 0 { 1.0 } else { 2.0 } / m as f64;
            let cosine = |k: usize| ((degree * (2 * k + 1)) as f64 * PI / (2 * m) as f64).cos();
            (0..m).map(|k| scale * cosine(k)).collect()
        };
        (0..m).map(row).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: interpolation reproduces polynomials of degree below the number of nodes. T_2 has a single coefficient.
    #[test]
    fn polynomials_are_reproduced() {
        let nodes = Chebyshev::new(5, 1.2);
        let f = |x: f64| 1.0 + x - 2.0 * x.powi(3) + 0.5 * x.powi(4);
        let mut values = [0.0; 5];
        for x in [-1.2, -0.3, 0.0, nodes.nodes()[1], 0.77, 1.2] {
            nodes.lagrange(x, &mut values);
            let sum: f64 = values.iter().zip(nodes.nodes()).map(|(l, &node)| l * f(node)).sum();
            assert!((sum - f(x)).abs() < 1e-13, "{x}");
        }
        let unit = Chebyshev::new(4, 1.0);
        for (degree, row) in Chebyshev::coefficients(4).iter().enumerate() {
            let of_t2: f64 = row.iter().zip(unit.nodes()).map(|(c, x)| c * (2.0 * x * x - 1.0)).sum();
            assert!((of_t2 - if degree == 2 { 1.0 } else { 0.0 }).abs() < 1e-14, "{degree}");
        }
    }
}
