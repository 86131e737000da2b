//! Products of an operator inside a linear solve, whose residual the next step of the solver corrects.

use nalgebra::Matrix3;

use crate::flexibility::per_cell::PerCell;
use crate::flexibility::{Flexibility, TangentialFlexibility};

/// Digits of products inside a linear solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// About six, faster.
    #[default]
    Single,
    /// All.
    Double,
}

/// An operator whose products are needed to some precision only.
pub struct WithPrecision<'a> {
    /// The operator.
    pub operator: &'a dyn Flexibility,
    /// Of its products.
    pub precision: Precision,
}

impl WithPrecision<'_> {
    fn part(&self) -> &dyn TangentialFlexibility {
        self.operator.tangential().expect("it has one, or this would not be asked for it")
    }
}

impl TangentialFlexibility for WithPrecision<'_> {
    fn apply_tangential(&self, tractions: &[f64], gap: &mut [f64]) {
        match self.precision {
            Precision::Single => self.part().apply_tangential_single(tractions, gap),
            Precision::Double => self.part().apply_tangential(tractions, gap),
        }
    }

    fn apply_tangential_single(&self, tractions: &[f64], gap: &mut [f64]) {
        self.part().apply_tangential_single(tractions, gap);
    }

    fn precondition_tangential(&self, gap: &[f64], tractions: &mut [f64]) {
        self.part().precondition_tangential(gap, tractions);
    }
}

impl Flexibility for WithPrecision<'_> {
    fn n_cells(&self) -> usize {
        self.operator.n_cells()
    }

    fn tangential(&self) -> Option<&dyn TangentialFlexibility> {
        self.operator.tangential().is_some().then_some(self)
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        match self.precision {
            Precision::Single => self.operator.apply_single(tractions, gap),
            Precision::Double => self.operator.apply(tractions, gap),
        }
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        match self.precision {
            Precision::Single => self.operator.apply_normal_single(pressure, normal_gap),
            Precision::Double => self.operator.apply_normal(pressure, normal_gap),
        }
    }

    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        self.operator.diagonal_blocks()
    }

    fn couples_normal_tangential(&self) -> bool {
        self.operator.couples_normal_tangential()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One cell; products in single precision are those of another operator, so that they can be told.
    struct Told;

    impl Flexibility for Told {
        fn n_cells(&self) -> usize {
            1
        }

        fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
            gap.copy_from_slice(tractions);
        }

        fn apply_single(&self, _: &[f64], gap: &mut [f64]) {
            gap.fill(0.0);
        }

        fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
            normal_gap.copy_from_slice(pressure);
        }

        fn apply_normal_single(&self, _: &[f64], normal_gap: &mut [f64]) {
            normal_gap.fill(0.0);
        }

        fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
            PerCell::Same(Matrix3::identity(), 1)
        }

        fn couples_normal_tangential(&self) -> bool {
            false
        }
    }

    /// Truth: the product asked for is the product taken.
    #[test]
    fn products_are_of_the_precision_asked_for() {
        for (precision, expected) in [(Precision::Single, 0.0), (Precision::Double, 2.0)] {
            let operator = WithPrecision { operator: &Told, precision };
            let (mut gap, mut normal) = ([9.0; 3], [9.0]);
            operator.apply(&[2.0; 3], &mut gap);
            operator.apply_normal(&[2.0], &mut normal);
            assert_eq!((gap, normal), ([expected; 3], [expected]));
        }
    }
}
