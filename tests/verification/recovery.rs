//! Recovered stress, its error estimate, and derived quantities.

mod estimate;
mod manufactured;
mod patches;
mod surfaces;
