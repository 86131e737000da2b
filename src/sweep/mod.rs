//! Studies: a scene is computed for all combinations of some of its values.
//!
//! [`spec`] defines the keys of a study file. [`mod@read`] reads the file and checks it with its scenes ([`Sweep`]).
//! `axes`, with `range` and `sample`, gives the values, and `require` omits combinations. [`run`] computes the runs,
//! and [`collect`] takes numbers from the results of the runs. [`table`] writes these numbers, and [`plots`] draws
//! them.

pub mod axes;
pub mod collect;
pub mod plots;
mod range;
pub mod read;
mod require;
pub mod run;
mod sample;
mod scenes;
pub mod share;
pub mod spec;
pub mod table;

pub use crate::sweep::axes::Axis;
pub use crate::sweep::read::{RunSpec, Sweep, read};
