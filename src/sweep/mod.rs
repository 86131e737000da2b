//! Studies: a scene run for all combinations of some of its values.
//!
//! [`spec`] are the keys of a study file, [`mod@read`] reads it and finds what is wrong with it, its scenes included; `axes` are lists,
//! `range`s and what is zipped or sampled (`sample`), `require` leaves out combinations;
//! [`collect`] takes numbers out of the results of the runs, [`table`] holds them, [`plots`] draws them.

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
