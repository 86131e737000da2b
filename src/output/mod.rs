//! Results of a run in memory and as files: `summary.json`, `history.csv`, fields for ParaView, figures, checkpoints.
//!
//! [`recorder::Recorder`] observes the run, [`field_writer::FieldWriter`] writes fields, [`summary::Summary`] holds the results.
//! Files are staged in an [`output_dir::OutputDir`]. NaN and infinity are errors.

pub mod accuracy;
pub mod atomic_file;
pub mod body_fields;
pub mod body_peaks;
pub mod boundary_elements;
pub mod cell_locator;
pub mod checkpoint;
pub mod checkpoint_writer;
pub mod condensation;
pub mod field_writer;
pub mod frame_fields;
pub mod history_table;
pub mod interior_points;
pub mod line_profile;
pub mod near_field;
pub mod number_format;
pub mod output_dir;
pub mod peak_memory;
pub mod plot;
pub mod provenance;
pub mod recorder;
pub mod report_file;
pub mod run_figures;
pub mod summary;
pub mod surface_properties;
pub mod surface_stress;
pub mod truncation;
pub mod volume;
pub mod vtu;
