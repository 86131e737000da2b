//! Low-rank blocks Σ u vᵀ with orthogonal vectors u. The number of terms is small for the given error bound. Small
//! terms are stored in single precision.

use super::cross_approximation::OuterProducts;
use crate::linalg::vector::dot8;

/// Relative rounding error of a term in single precision.
const SINGLE_PRECISION_ERROR: f64 = 5e-8;

/// Part of the error bound that omitted terms may use.
const TRUNCATION_SHARE: f64 = 0.7;
/// Part of the error bound that the rounding of each term to single precision may use.
const ROUNDING_SHARE: f64 = 0.5;

/// A vector counts as linearly dependent on earlier vectors if orthogonalisation reduces its norm to at most this share.
const DEPENDENCE_TOLERANCE: f64 = 1e-13;

/// Low-rank block Σ u vᵀ. Each term is stored as u, then v. Small terms are in single precision.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct LowRank {
    pub double: Vec<f64>,
    pub single: Vec<f32>,
}

impl LowRank {
    /// Compresses the sum `terms` of a block `[m, n]`. In the Frobenius norm, the omitted terms are at most
    /// [`TRUNCATION_SHARE`] times `bound`. The rounding of each term to single precision is at most [`ROUNDING_SHARE`]
    /// times `bound`.
    ///
    /// # Source
    /// Golub and Van Loan 2013, Matrix Computations, 5.2.8 (modified Gram-Schmidt) and 5.4.2 (column pivoting).
    pub fn new(terms: &OuterProducts, (m, n): (usize, usize), bound: f64) -> Self {
        let (q, mut w) = orthogonal(terms, (m, n));
        let mut shrunk = Self::default();
        let mut free: Vec<usize> = (0..terms.rank).collect();
        let mut sizes: Vec<f64> = w.chunks_exact(m).map(squares).collect();
        while free.iter().map(|&p| sizes[p]).sum::<f64>().sqrt() > TRUNCATION_SHARE * bound {
            let most = (0..free.len()).max_by(|&a, &b| sizes[free[a]].total_cmp(&sizes[free[b]]));
            let Some(most) = most else { break };
            let p = free.swap_remove(most);
            let size = sizes[p].sqrt();
            let u: Vec<f64> = w[p * m..(p + 1) * m].iter().map(|value| value / size).collect();
            // The parts of the other terms along u are added to the term of u.
            let mut v: Vec<f64> = q[p * n..(p + 1) * n].iter().map(|value| value * size).collect();
            for &other in &free {
                let rest = &mut w[other * m..(other + 1) * m];
                let share = dot8(&u, rest);
                rest.iter_mut().zip(&u).for_each(|(value, u)| *value -= share * u);
                sizes[other] = squares(rest);
                v.iter_mut().zip(&q[other * n..(other + 1) * n]).for_each(|(v, q)| *v += share * q);
            }
            if dot8(&v, &v).sqrt() * SINGLE_PRECISION_ERROR > ROUNDING_SHARE * bound {
                shrunk.double.extend_from_slice(&u);
                shrunk.double.extend_from_slice(&v);
            } else {
                shrunk.single.extend(u.iter().chain(&v).map(|&value| value as f32));
            }
        }
        shrunk.double.shrink_to_fit();
        shrunk.single.shrink_to_fit();
        shrunk
    }

    pub fn bytes(&self) -> usize {
        size_of_val(self.double.as_slice()) + size_of_val(self.single.as_slice())
    }
}

/// Computes orthonormal vectors q `[rank][n]` and vectors w `[rank][m]` with Σ w qᵀ = Σ u vᵀ. If v depends linearly on
/// earlier v, its q is zero.
fn orthogonal(terms: &OuterProducts, (m, n): (usize, usize)) -> (Vec<f64>, Vec<f64>) {
    let rank = terms.rank;
    let (mut q, mut w) = (terms.v.clone(), vec![0.0; rank * m]);
    for l in 0..rank {
        let (before, from) = q.split_at_mut(l * n);
        let v = &mut from[..n];
        let u = &terms.u[l * m..(l + 1) * m];
        let size = squares(v).sqrt();
        for (p, q) in before.chunks_exact(n).enumerate() {
            let share = dot8(q, v);
            v.iter_mut().zip(q).for_each(|(v, q)| *v -= share * q);
            w[p * m..(p + 1) * m].iter_mut().zip(u).for_each(|(w, u)| *w += share * u);
        }
        let left = squares(v).sqrt();
        if left > DEPENDENCE_TOLERANCE * size {
            v.iter_mut().for_each(|v| *v /= left);
            w[l * m..(l + 1) * m].iter_mut().zip(u).for_each(|(w, u)| *w += left * u);
        } else {
            v.fill(0.0);
        }
    }
    (q, w)
}

fn squares(values: &[f64]) -> f64 {
    dot8(values, values)
}

#[cfg(test)]
mod tests {
    use super::super::cross_approximation::{ComponentLines, KernelBlock, approximate};
    use super::*;

    fn entry(block: &LowRank, (m, n): (usize, usize), (i, j): (usize, usize)) -> f64 {
        let double: f64 = block.double.chunks_exact(m + n).map(|t| t[i] * t[m + j]).sum();
        let single: f64 =
            block.single.chunks_exact(m + n).map(|t| f64::from(t[i]) * f64::from(t[m + j])).sum();
        double + single
    }

    fn rank(block: &LowRank, (m, n): (usize, usize)) -> usize {
        (block.double.len() + block.single.len()) / (m + n)
    }

    /// Truth: a sum of five outer products has rank five. The three components of the kernel have rank five, zero and
    /// one, and the approximation finds these ranks. The Frobenius norm of the error is at most the bound.
    #[test]
    fn sums_of_products_have_their_rank() {
        let (m, n) = (40, 57);
        let term =
            |k: usize, i: usize, j: usize| ((k * i) as f64 * 0.3).sin() * ((k * (j + 1)) as f64 * 0.23).cos();
        let entries = |i: usize, j: usize, values: &mut [f64]| {
            let j = j - m;
            values[0] = (1..=5).map(|k| term(k, i, j)).sum();
            values[1] = 0.0;
            values[2] = 3.0 * term(7, i, j);
        };
        let mut lines = KernelBlock::new(&entries, 0..m, m..m + n, 3);
        for (component, expected) in [(0, 5), (1, 0), (2, 1)] {
            let bound = 1e-9 * lines.norm();
            let block = LowRank::new(
                &approximate(ComponentLines { lines: &mut lines, component }, 0.3 * bound),
                (m, n),
                bound,
            );
            assert_eq!(rank(&block, (m, n)), expected, "component {component}");
            let mut error = 0.0;
            for (i, j) in (0..m * n).map(|k| (k / n, k % n)) {
                let mut values = [0.0; 3];
                entries(i, m + j, &mut values);
                error += (entry(&block, (m, n), (i, j)) - values[component]).powi(2);
            }
            assert!(error.sqrt() <= bound, "component {component}: {} for {bound}", error.sqrt());
        }
    }

    /// Truth: entries of the kernel 1 / r between two unit squares, whose distance is about their diagonal. The
    /// Frobenius norm of the error is at most the bound. The rank grows with -log(tolerance), and small terms are in
    /// single precision.
    #[test]
    fn error_follows_the_bound() {
        let m = 144;
        let at = |k: usize| [(k % 12) as f64 / 11.0, (k / 12) as f64 / 11.0];
        let entries = |i: usize, j: usize, values: &mut [f64]| {
            let (a, b) = (at(i), at(j - m));
            values[0] = 1.0 / (b[0] + 2.4 - a[0]).hypot(b[1] - a[1]);
        };
        let mut ranks = Vec::new();
        for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
            let mut lines = KernelBlock::new(&entries, 0..m, m..2 * m, 1);
            let norm = lines.norm();
            let bound = tolerance * norm;
            let block = LowRank::new(
                &approximate(ComponentLines { lines: &mut lines, component: 0 }, 0.3 * bound),
                (m, m),
                bound,
            );
            let (mut error, mut all) = (0.0, 0.0);
            for (i, j) in (0..m * m).map(|k| (k / m, k % m)) {
                let mut value = [0.0];
                entries(i, m + j, &mut value);
                error += (entry(&block, (m, m), (i, j)) - value[0]).powi(2);
                all += value[0] * value[0];
            }
            assert!((norm / f64::sqrt(all) - 1.0).abs() < 0.2);
            assert!(
                error.sqrt() <= bound && error.sqrt() > 1e-2 * bound,
                "{tolerance}: {}",
                error.sqrt() / bound
            );
            ranks.push(rank(&block, (m, m)));
            let double = block.double.len() / (2 * m);
            assert!(if tolerance >= 1e-6 { double == 0 } else { double > 0 }, "{tolerance}: {double}");
        }
        assert!(ranks.windows(2).all(|pair| pair[0] < pair[1] && pair[1] < pair[0] + 12), "{ranks:?}");
    }
}
