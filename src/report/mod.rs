//! Report: a self-contained HTML page of the results in a directory (run, comparison or study).
//!
//! [`Report::of`] renders the page. Equal directories give equal pages, byte by byte.

mod body_surfaces;
mod drawing;
mod encode;
mod frame_maps;
mod overview;
mod page;
mod result_directory;
mod run_page;
mod value_text;
pub mod vtu_reader;

use std::path::Path;

use crate::error::Result;
use crate::output::output_dir::write_atomically;
use crate::report::result_directory::{ResultDirectory, ResultKind};

/// Rendered report.
#[derive(Debug, Clone)]
pub struct Report {
    /// HTML text.
    pub html: String,
    /// Missing, damaged or omitted content, with reasons.
    pub problems: Vec<String>,
}

impl Report {
    /// Renders the report of the results in `directory`.
    ///
    /// # Errors
    /// If the directory cannot be read or holds no results (kind `Input`), or the page cannot be created (kind `Numerical`).
    pub fn of(directory: &Path) -> Result<Self> {
        let mut source = ResultDirectory::open(directory)?;
        let html = match source.kind {
            ResultKind::Run => run_page::render_run_page(&mut source),
            ResultKind::Comparison | ResultKind::Study => overview::overview(&mut source),
        }?;
        Ok(Self { html, problems: source.problems })
    }

    /// Writes the page to `path`. On failure, an existing file stays unchanged.
    ///
    /// # Errors
    /// If the file cannot be written (kind `Resources`).
    pub fn write(&self, path: &Path) -> Result<()> {
        write_atomically(path, self.html.as_bytes())
    }
}
