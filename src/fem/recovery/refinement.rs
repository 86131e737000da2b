//! Element sizes of the next mesh, from the estimated error on the present mesh.
//!
//! Let e be the error of an element and p the local rate of convergence. The next mesh fills the region of this element
//! with elements of r times its size. The squared error of the region is then e² r^2p, spread over r^-3 elements. The
//! mesh with the fewest elements for a given total error has the same error c in each new element, e² r^(2p+3) = c².
//! Hence r = (c/e)^(2/(2p+3)), and c follows from Σ e² r^2p = (wanted error)².
//!
//! At singularities (edges of contact, corners, supports) the error decreases more slowly than the rate p predicts. The
//! change of size per round is therefore limited, and several rounds reach any grading.
//!
//! # Source
//! Li and Bettess (1995), Commun. Numer. Meth. Engng 11, 1-9, on the optimality of equal error per element.

use super::estimate::ErrorEstimate;

/// Smallest and largest size of the next elements, relative to the present elements.
pub const SIZE_RATIO_BOUNDS: [f64; 2] = [0.25, 2.0];

/// Size of the next elements relative to the present elements, `[n_cells]`. `wanted` is the wanted error relative to
/// the estimated norm of the true stress. `degree` is the rate of convergence p.
pub fn size_ratios(estimate: &ErrorEstimate, degree: usize, wanted: f64) -> Vec<f64> {
    let rate = degree as f64;
    let exponent = 2.0 / (2.0 * rate + 3.0);
    let ratio = |c: f64, e: f64| {
        if e > 0.0 {
            (c / e).powf(exponent).clamp(SIZE_RATIO_BOUNDS[0], SIZE_RATIO_BOUNDS[1])
        } else {
            SIZE_RATIO_BOUNDS[1]
        }
    };
    let squared =
        |c: f64| -> f64 { estimate.cell_errors.iter().map(|&e| e * e * ratio(c, e).powf(2.0 * rate)).sum() };
    let target = wanted * wanted * estimate.norm_squared();
    let positive = || estimate.cell_errors.iter().copied().filter(|e| *e > 0.0);
    let mut low = positive().fold(f64::INFINITY, f64::min) * SIZE_RATIO_BOUNDS[0].powf(1.0 / exponent);
    let mut high = positive().fold(0.0, f64::max) * SIZE_RATIO_BOUNDS[1].powf(1.0 / exponent);
    if high == 0.0 {
        return vec![SIZE_RATIO_BOUNDS[1]; estimate.cell_errors.len()];
    }
    for _ in 0..200 {
        let middle = (low * high).sqrt();
        if squared(middle) > target { high = middle } else { low = middle }
    }
    estimate.cell_errors.iter().map(|&e| ratio(low, e)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(cell_errors: Vec<f64>) -> ErrorEstimate {
        let n = cell_errors.len();
        ErrorEstimate {
            cell_errors,
            cell_volumes: vec![1.0; n],
            cell_centres: vec![[0.0; 3]; n],
            stress_norm: 10.0,
        }
    }

    /// Truths: the predicted error equals the wanted error; the predicted elements have equal errors.
    #[test]
    fn predicted_errors_are_equal_and_add_up() {
        for degree in [1, 2] {
            let estimate = estimate(vec![1.0, 0.7, 1.2, 0.9]);
            let wanted = 0.6 * estimate.relative_error();
            let ratios = size_ratios(&estimate, degree, wanted);
            let p = degree as i32;
            let total: f64 =
                estimate.cell_errors.iter().zip(&ratios).map(|(e, r)| e * e * r.powi(2 * p)).sum();
            assert!((total.sqrt() / (wanted * estimate.norm_squared().sqrt()) - 1.0).abs() < 1e-12);
            let each: Vec<f64> =
                estimate.cell_errors.iter().zip(&ratios).map(|(e, r)| e * e * r.powi(2 * p + 3)).collect();
            assert!(each.iter().all(|e| (e / each[0] - 1.0).abs() < 1e-12), "{each:?}");
        }
    }

    /// Truth: the largest error gives the smallest allowed ratio, and a zero error gives the largest.
    #[test]
    fn changes_are_limited() {
        let ratios = size_ratios(&estimate(vec![1e3, 1.0, 1e-6, 0.0]), 1, 1e-3);
        assert_eq!((ratios[0], ratios[3]), (SIZE_RATIO_BOUNDS[0], SIZE_RATIO_BOUNDS[1]));
        assert!(ratios.windows(2).all(|pair| pair[0] <= pair[1]));
        assert_eq!(size_ratios(&estimate(vec![0.0; 2]), 1, 0.01), [SIZE_RATIO_BOUNDS[1]; 2]);
    }
}
