//! What an element with `N` nodes and `D` reference coordinates gives: its shape functions and their gradients.

use super::dual::Dual;

/// Shape functions of an element; node order is gmsh's.
pub trait ShapeFunctions<const N: usize, const D: usize> {
    /// Reference coordinates of the nodes.
    const NODES: [[f64; D]; N];

    /// Values at the reference point `xi`.
    fn values(xi: [f64; D]) -> [f64; N];

    /// Derivatives by the reference coordinates at `xi`.
    fn gradients(xi: [f64; D]) -> [[f64; D]; N];
}

/// Shape functions of a solid written once, in dual numbers: values and gradients follow.
pub(super) trait DualShapeFunctions<const N: usize> {
    /// As [`ShapeFunctions::NODES`].
    const NODES: [[f64; 3]; N];

    /// Values with their gradients, `xi` being the reference coordinates with theirs.
    fn dual_values(xi: [Dual; 3]) -> [Dual; N];
}

impl<const N: usize, T: DualShapeFunctions<N>> ShapeFunctions<N, 3> for T {
    const NODES: [[f64; 3]; N] = <T as DualShapeFunctions<N>>::NODES;

    fn values(xi: [f64; 3]) -> [f64; N] {
        T::dual_values(Dual::coordinates(xi)).map(|n| n.value)
    }

    fn gradients(xi: [f64; 3]) -> [[f64; 3]; N] {
        T::dual_values(Dual::coordinates(xi)).map(|n| n.gradient)
    }
}

#[cfg(test)]
pub(super) mod checks {
    use super::ShapeFunctions;

    /// Truths: N_a(x_b) = delta_ab; sum N = 1; the gradients are the derivatives of the values (central differences
    /// with step 1e-5: rounding only where functions are quadratic along a coordinate, 1e-10 times the third derivative
    /// of rational ones, 1e-9; sums of more than nine terms round to 1e-14).
    pub fn check<S: ShapeFunctions<N, D>, const N: usize, const D: usize>(at: [f64; D]) {
        for (a, node) in S::NODES.iter().enumerate() {
            for (b, value) in S::values(*node).into_iter().enumerate() {
                assert!((value - f64::from(u8::from(a == b))).abs() < 1e-15);
            }
        }
        let polynomial = N <= 9 && N != 5;
        let (sum, slope) = if polynomial { (1e-15, 1e-10) } else { (1e-14, 1e-9) };
        assert!((S::values(at).iter().sum::<f64>() - 1.0).abs() < sum);
        let gradients = S::gradients(at);
        for d in 0..D {
            let moved = |h: f64| {
                let mut x = at;
                x[d] += h;
                S::values(x)
            };
            let (forward, backward) = (moved(1e-5), moved(-1e-5));
            for a in 0..N {
                assert!(((forward[a] - backward[a]) / 2e-5 - gradients[a][d]).abs() < slope);
            }
        }
    }
}
