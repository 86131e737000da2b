use super::dual::Dual;

/// Shape functions of an element with `N` nodes in gmsh's order and `D` reference coordinates.
pub trait ShapeFunctions<const N: usize, const D: usize> {
    /// Reference coordinates of the nodes.
    const NODES: [[f64; D]; N];

    /// Values at the reference point `xi`.
    fn values(xi: [f64; D]) -> [f64; N];

    /// Derivatives with respect to the reference coordinates at `xi`.
    fn gradients(xi: [f64; D]) -> [[f64; D]; N];
}

/// Shape functions of a solid in dual numbers, which give values and gradients from one formula.
pub(super) trait DualShapeFunctions<const N: usize> {
    const NODES: [[f64; 3]; N];

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
mod tests {
    use super::ShapeFunctions;
    use crate::element::*;

    #[test]
    fn shape_functions() {
        check::<Tri3, 3, 2>([0.2, 0.3]);
        check::<Tri6, 6, 2>([0.2, 0.3]);
        check::<Quad4, 4, 2>([0.3, -0.6]);
        check::<Quad8, 8, 2>([0.3, -0.6]);
        check::<Quad9, 9, 2>([0.3, -0.6]);
        check::<Tet4, 4, 3>([0.2, 0.3, 0.1]);
        check::<Tet10, 10, 3>([0.2, 0.3, 0.1]);
        check::<Hex8, 8, 3>([0.3, -0.6, 0.2]);
        check::<Hex20, 20, 3>([0.3, -0.6, 0.2]);
        check::<Hex27, 27, 3>([0.3, -0.6, 0.2]);
        check::<Wedge6, 6, 3>([0.2, 0.3, 0.1]);
        check::<Wedge15, 15, 3>([0.2, 0.3, 0.1]);
        check::<Wedge18, 18, 3>([0.2, 0.3, 0.1]);
        check::<Pyramid5, 5, 3>([0.2, -0.3, 0.1]);
        check::<Pyramid13, 13, 3>([0.2, -0.3, 0.1]);
        check::<Pyramid14, 14, 3>([0.2, -0.3, 0.1]);
    }

    /// Truths: N_a(x_b) = delta_ab; sum N = 1; gradients equal central differences. The error of the differences is zero for
    /// functions that are quadratic along each coordinate. For rational functions it is h² / 6 times the third derivative.
    fn check<S: ShapeFunctions<N, D>, const N: usize, const D: usize>(at: [f64; D]) {
        let name = std::any::type_name::<S>();
        for (a, node) in S::NODES.iter().enumerate() {
            for (b, value) in S::values(*node).into_iter().enumerate() {
                assert!((value - f64::from(u8::from(a == b))).abs() < 1e-15, "{name}");
            }
        }
        let polynomial = N <= 9 && N != 5;
        let (sum, slope) = if polynomial { (1e-15, 1e-10) } else { (1e-14, 1e-9) };
        assert!((S::values(at).iter().sum::<f64>() - 1.0).abs() < sum, "{name}");
        let gradients = S::gradients(at);
        for d in 0..D {
            let moved = |h: f64| {
                let mut x = at;
                x[d] += h;
                S::values(x)
            };
            let (forward, backward) = (moved(1e-5), moved(-1e-5));
            for a in 0..N {
                assert!(((forward[a] - backward[a]) / 2e-5 - gradients[a][d]).abs() < slope, "{name}");
            }
        }
    }
}
