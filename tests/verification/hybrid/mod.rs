//! Finite bodies with the near field of a half-space.

pub mod blocks;
mod correction;
mod curved;
mod fields;
mod flat_faces;
mod friction;
mod hertz;
mod operator;
mod own_loads;
