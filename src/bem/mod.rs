//! Boundary-element bodies: what is known of a body from its surface alone.

pub mod half_space;
