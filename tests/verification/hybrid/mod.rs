//! Finite bodies with the near field of a half-space.

mod blocks;
mod correction;
mod curved;
mod fields;
mod friction;
mod hertz;
mod operator;
mod patches;
