//! Restriction of an operator to some of its cells.

use std::sync::{Arc, Mutex};

use nalgebra::Matrix3;

use crate::flexibility::per_cell::PerCell;
use crate::flexibility::{Flexibility, TangentialFlexibility};

/// Flexibility of the cells of `whole` that may carry tractions. Other cells carry no tractions, and their gap is not returned.
pub struct SubsetFlexibility {
    whole: Arc<dyn Flexibility>,
    /// Index in `whole` of each cell of the subset.
    cells: Vec<usize>,
    /// Tractions and gap of `whole`, `[3, N]` each. Tractions outside of `cells` are zero.
    scratch: Mutex<[Vec<f64>; 2]>,
}

impl SubsetFlexibility {
    /// Restricts `whole` to the cells `cells`, ascending.
    ///
    /// # Panics
    /// If an index is not below the number of cells of `whole`.
    pub fn new(whole: Arc<dyn Flexibility>, cells: Vec<usize>) -> Self {
        let n = whole.n_cells();
        assert!(cells.iter().all(|&place| place < n), "a cell outside of the operator");
        Self { whole, cells, scratch: Mutex::new([vec![0.0; 3 * n], vec![0.0; 3 * n]]) }
    }

    /// Expands tractions `[3, M]` of the subset to `[3, N]`, with zeros in the other cells of `whole`.
    fn scattered(&self, tractions: &[f64]) -> Vec<f64> {
        let (n, m) = (self.whole.n_cells(), self.cells.len());
        let mut whole = vec![0.0; 3 * n];
        for (i, traction) in tractions.iter().enumerate() {
            whole[i / m * n + self.cells[i % m]] = *traction;
        }
        whole
    }

    /// Applies `product` of `whole` to the expanded `values` and gathers the resulting vector in `out`. The vectors
    /// `values` and `out` have `planes` components per cell. Returns the value that `product` returns.
    fn apply_whole(
        &self,
        planes: usize,
        values: &[f64],
        out: &mut [f64],
        product: impl FnOnce(&[f64], &mut [f64]) -> bool,
    ) -> bool {
        let (n, m) = (self.whole.n_cells(), self.cells.len());
        let mut scratch = self.scratch.lock().expect("no panic while the scratch is held");
        let [whole, result] = &mut *scratch;
        for plane in 0..planes {
            for (place, value) in self.cells.iter().zip(&values[plane * m..(plane + 1) * m]) {
                whole[plane * n + place] = *value;
            }
        }
        let done = product(&whole[..planes * n], &mut result[..planes * n]);
        for plane in 0..planes {
            for (place, value) in self.cells.iter().zip(&mut out[plane * m..(plane + 1) * m]) {
                *value = result[plane * n + place];
            }
        }
        done
    }
}

impl Flexibility for SubsetFlexibility {
    fn n_cells(&self) -> usize {
        self.cells.len()
    }

    fn tangential(&self) -> Option<&dyn TangentialFlexibility> {
        self.whole.tangential().map(|_| self as &dyn TangentialFlexibility)
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        let product = |whole: &[f64], result: &mut [f64]| {
            self.whole.apply(whole, result);
            true
        };
        self.apply_whole(3, tractions, gap, product);
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        let product = |whole: &[f64], result: &mut [f64]| {
            self.whole.apply_normal(whole, result);
            true
        };
        self.apply_whole(1, pressure, normal_gap, product);
    }

    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        match self.whole.diagonal_blocks() {
            PerCell::Same(block, _) => PerCell::Same(block, self.cells.len()),
            PerCell::Each(whole) => self.cells.iter().map(|&place| whole[place]).collect(),
        }
    }

    fn couples_normal_tangential(&self) -> bool {
        self.whole.couples_normal_tangential()
    }

    fn direct_sums(&self, cells: &[usize], tractions: &[f64]) -> Option<Vec<[f64; 3]>> {
        let whole = self.scattered(tractions);
        let places: Vec<usize> = cells.iter().map(|&cell| self.cells[cell]).collect();
        self.whole.direct_sums(&places, &whole)
    }

    /// Applies the block of the approximate inverse of `whole` that belongs to the subset. Like the approximate inverse, this block
    /// is symmetric positive definite.
    fn precondition_normal(&self, normal_gap: &[f64], pressure: &mut [f64]) -> bool {
        let product = |whole: &[f64], result: &mut [f64]| self.whole.precondition_normal(whole, result);
        self.apply_whole(1, normal_gap, pressure, product)
    }

    fn precondition(&self, gap: &[f64], tractions: &mut [f64]) -> bool {
        let product = |whole: &[f64], result: &mut [f64]| self.whole.precondition(whole, result);
        self.apply_whole(3, gap, tractions, product)
    }
}

impl SubsetFlexibility {
    fn whole_tangential(&self) -> &dyn TangentialFlexibility {
        self.whole.tangential().expect("the whole has a tangential part")
    }
}

impl TangentialFlexibility for SubsetFlexibility {
    fn apply_tangential(&self, tractions: &[f64], gap: &mut [f64]) {
        let product = |whole: &[f64], result: &mut [f64]| {
            self.whole_tangential().apply_tangential(whole, result);
            true
        };
        self.apply_whole(2, tractions, gap, product);
    }

    fn precondition_tangential(&self, gap: &[f64], tractions: &mut [f64]) {
        let product = |whole: &[f64], result: &mut [f64]| {
            self.whole_tangential().precondition_tangential(whole, result);
            true
        };
        self.apply_whole(2, gap, tractions, product);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// S of three cells as a full matrix; the tangential blocks are twice the normal block.
    struct Three;

    impl Flexibility for Three {
        fn n_cells(&self) -> usize {
            3
        }

        fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
            for plane in 0..3 {
                let part = plane * 3..plane * 3 + 3;
                self.apply_normal(&tractions[part.clone()], &mut gap[part]);
            }
            gap[..6].iter_mut().for_each(|g| *g *= 2.0);
        }

        fn apply_normal(&self, p: &[f64], gap: &mut [f64]) {
            for (i, g) in gap.iter_mut().enumerate() {
                *g = (0..3).map(|j| p[j] / (1.0 + (i as f64 - j as f64).abs())).sum();
            }
        }

        fn tangential(&self) -> Option<&dyn TangentialFlexibility> {
            Some(self)
        }

        fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
            (0..3).map(|i| Matrix3::identity() * f64::from(i + 1)).collect()
        }
    }

    impl TangentialFlexibility for Three {
        fn apply_tangential(&self, tractions: &[f64], gap: &mut [f64]) {
            let mut all = [0.0; 9];
            self.apply(&[tractions, &[0.0; 3]].concat(), &mut all);
            gap.copy_from_slice(&all[..6]);
        }

        /// Divides by the diagonal of S_tt, which is 2.
        fn precondition_tangential(&self, gap: &[f64], tractions: &mut [f64]) {
            tractions.iter_mut().zip(gap).for_each(|(traction, gap)| *traction = 0.5 * gap);
        }
    }

    /// Truth: the subset of a decoupled operator is decoupled, too. Its tangential product equals the tangential part of its full
    /// product for the same tractions.
    #[test]
    fn tangential_part_of_the_whole() {
        let part = SubsetFlexibility::new(Arc::new(Three), vec![0, 2]);
        let tangential = part.tangential().expect("a whole that falls apart");
        let mut all = [0.0; 6];
        part.apply(&[1.0, 0.0, 0.0, 3.0, 0.0, 0.0], &mut all);
        let mut gap = [0.0; 4];
        tangential.apply_tangential(&[1.0, 0.0, 0.0, 3.0], &mut gap);
        assert_eq!(gap, all[..4]);
        let mut tractions = [0.0; 4];
        tangential.precondition_tangential(&gap, &mut tractions);
        assert_eq!(tractions, gap.map(|gap| 0.5 * gap));
    }

    /// Truth: sums over rows and columns of the full matrix, computed by hand. Earlier products leave no values in the work space.
    #[test]
    fn rows_and_columns_of_the_whole() {
        let part = SubsetFlexibility::new(Arc::new(Three), vec![0, 2]);
        let mut gap = [0.0; 6];
        part.apply(&[1.0, 0.0, 0.0, 3.0, 0.0, 6.0], &mut gap);
        assert_eq!(gap, [2.0, 2.0 / 3.0, 2.0, 6.0, 2.0, 6.0]);
        let mut normal = [0.0; 2];
        part.apply_normal(&[3.0, 0.0], &mut normal);
        assert_eq!(normal, [3.0, 1.0]);
        assert_eq!(part.diagonal_blocks()[1][(2, 2)], 3.0);
        assert!(!part.precondition_normal(&[1.0, 1.0], &mut normal));
    }
}
