//! Elliptic friction: direction of forces and slip, audits of whole states, one point with several solutions.

mod single_cell;
mod sliding;
mod states;
