//! Results: what a run computed, in memory and as files: `summary.json`, `history.csv`, fields for ParaView, plots.
//!
//! Every file is written under a temporary name and renamed when it is complete ([`output`]), so that a failed run
//! loses nothing that was there before. No number that is not finite is written silently.

pub mod accuracy;
pub mod along;
pub mod body_fields;
pub mod body_peaks;
pub mod boundary_elements;
pub mod checkpoint;
pub mod comparison;
pub mod condensation;
pub mod fields;
pub mod file;
pub mod frame_fields;
pub mod inside;
pub mod keeper;
pub mod locate;
pub mod memory;
pub mod near_field;
pub mod origin;
pub mod output;
pub mod pictures;
pub mod plot;
pub mod recorder;
pub mod report;
pub mod short;
pub mod step_ends;
pub mod summary;
pub mod surface;
pub mod surface_stress;
pub mod table;
pub mod truncation;
pub mod volume;
pub mod vtu;
