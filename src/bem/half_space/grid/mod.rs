//! Operators on grid frames: kernel tables, fast Fourier transforms, spectral filters and preconditioners.

pub mod fft;
pub(super) mod fft_plan;
mod grid_symbol;
mod kernel_table;
pub(super) mod preconditioner;
pub(super) mod spectral_filter;
pub(super) mod symbol;
pub(super) mod toeplitz;
