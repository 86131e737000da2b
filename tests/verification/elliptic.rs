//! Elliptic friction: direction of forces and slip, audits of contact states, and a contact point with several solutions.

mod single_cell;
mod sliding;
mod states;
