//! Finite bodies with the near field of a half-space.

mod blocks;
mod correction;
mod hertz;
mod operator;
