//! Load steps, cycles and cycle jumps: the main loop.

pub mod step;
