//! Recovered stress, its error estimate, and what is derived from them.

mod estimate;
mod manufactured;
mod patches;
mod surfaces;
