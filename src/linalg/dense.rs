//! Dense symmetric matrices, and allocation of zeros with an error if memory does not suffice.

use super::memory::handling_allocation_failure;
use crate::error::{Error, Result};

/// Dense symmetric matrix `[n, n]` with both triangles stored.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SymmetricDense {
    n: usize,
    values: Vec<f64>,
}

impl SymmetricDense {
    /// Creates a zero matrix `[n, n]`.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn zeros(n: usize) -> Result<Self> {
        Ok(Self { n, values: try_zeroed(n.saturating_mul(n))? })
    }

    /// Number of rows.
    pub fn n(&self) -> usize {
        self.n
    }

    /// All entries, `[n, n]`. Row-major and column-major order coincide.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// All entries, `[n, n]`, mutable. The caller must keep both triangles equal.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// Row `i`, which equals column `i`.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.n..(i + 1) * self.n]
    }

    /// Entry (i, j).
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.values[i * self.n + j]
    }
}

/// Allocates `len` zeros.
///
/// # Errors
/// If memory does not suffice (kind `Resources`).
pub(crate) fn try_zeroed(len: usize) -> Result<Vec<f64>> {
    let error = || {
        Error::resources(format!(
            "not enough memory for a matrix of {:.2} GiB; use a coarser mesh, or fewer nodes in the contact group",
            len as f64 * 8.0 / f64::from(1 << 30)
        ))
    };
    if len == 0 {
        return Ok(Vec::new());
    }
    let layout = std::alloc::Layout::array::<f64>(len).map_err(|_| error())?;
    // SAFETY: the layout has a non-zero size. `alloc_zeroed` can use fresh pages of the system, which are already zero;
    // `Vec::resize` would write the zeros.
    let start = handling_allocation_failure(|| unsafe { std::alloc::alloc_zeroed(layout) });
    if start.is_null() {
        return Err(error());
    }
    // SAFETY: the global allocator returned memory for `len` numbers, all of them zero.
    Ok(unsafe { Vec::from_raw_parts(start.cast(), len, len) })
}
