//! Boundary-element bodies: what is known of a body from its surface alone.

pub mod finite;
pub mod full_space;
pub mod half_space;
