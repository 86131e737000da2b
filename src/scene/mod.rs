//! The scene a user writes (TOML), and the validated plan it becomes.
//!
//! [`keys`] are the keys as written; [`document`] holds the file with the place of every value; [`check`] finds
//! what the schema does not allow; [`resolve`] finds what makes no sense and builds the [`plan::Plan`]. Every
//! mistake is collected, so that a user mends them all at once.

pub mod check;
pub mod document;
pub mod keys;
pub mod mistake;
pub mod not_yet;
pub mod parse;
pub mod schema;
mod suggest;
