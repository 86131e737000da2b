//! What this module is.

pub mod fft;
pub mod kernel_cache;
pub(crate) mod fft_plan;
pub(crate) mod grid_symbol;
pub(crate) mod half_grid;
pub(crate) mod half_grid_plan;
pub(crate) mod kernel_table;
pub(crate) mod preconditioner;
pub(crate) mod spectral_filter;
pub(crate) mod symbol;
pub(crate) mod toeplitz_entries;
