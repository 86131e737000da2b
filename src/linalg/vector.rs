//! Products and sums of vectors. Each function has a fixed order of summation, because this order determines the last bits.

/// Scalar product aᵀ b, summed sequentially.
#[inline]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Scalar product aᵀ b in four partial sums.
#[inline]
pub(crate) fn dot4(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (heads, tail) = (a.chunks_exact(4).zip(b.chunks_exact(4)), a.len() / 4 * 4);
    for (x, y) in heads {
        for k in 0..4 {
            sums[k] += x[k] * y[k];
        }
    }
    let rest: f64 = a[tail..].iter().zip(&b[tail..]).map(|(x, y)| x * y).sum();
    sums.iter().sum::<f64>() + rest
}

/// Scalar product aᵀ b in eight partial sums. The order of summation depends only on the length of the vectors.
#[inline]
pub(crate) fn dot8<T: Copy + Into<f64>>(a: &[T], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    let (chunks_a, chunks_b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest = chunks_a.remainder().iter().zip(chunks_b.remainder());
    let rest: f64 = rest.map(|(&x, y)| Into::<f64>::into(x) * y).sum();
    for (x, y) in chunks_a.zip(chunks_b) {
        for lane in 0..8 {
            lanes[lane] += Into::<f64>::into(x[lane]) * y[lane];
        }
    }
    lanes.iter().sum::<f64>() + rest
}

/// Larger of two numbers, NaN if either is NaN.
pub(crate) fn nan_max(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Euclidean norm, summed sequentially.
#[inline]
pub(crate) fn norm(x: &[f64]) -> f64 {
    x.iter().map(|value| value * value).sum::<f64>().sqrt()
}

/// Computes `y += factor * x`.
#[inline]
pub(crate) fn axpy<T: Copy + Into<f64>>(y: &mut [f64], factor: f64, x: &[T]) {
    y.iter_mut().zip(x).for_each(|(y, &x)| *y += factor * Into::<f64>::into(x));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the maximum of several numbers is NaN if one of them is NaN, at any position.
    #[test]
    fn maximum_keeps_nan() {
        for values in [[f64::NAN, 1.0, 2.0], [1.0, f64::NAN, 2.0], [1.0, 2.0, f64::NAN]] {
            assert!(values.into_iter().fold(0.0, nan_max).is_nan());
        }
        assert_eq!([3.0, 1.0, 2.0].into_iter().fold(0.0, nan_max), 3.0);
    }
}
