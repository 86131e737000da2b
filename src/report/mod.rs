//! The report: one page of HTML that shows what lies in a directory of results, with everything that it needs inside.
//!
//! Files are read back as they were written, whatever is damaged is named on the page. The same directory gives the same bytes.

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

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

use crate::error::Result;
use crate::output::output_dir::write_atomically;
use crate::report::result_directory::{ResultDirectory, ResultKind};

/// Name of the page in the directory.
pub const REPORT: &str = "report.html";

/// A page.
#[derive(Debug, Clone)]
pub struct Report {
    /// The text of the file.
    pub html: String,
    /// What it lacks, and why.
    pub problems: Vec<String>,
}

impl Report {
    /// The page of the results in `directory`: of a run, a comparison or a study.
    ///
    /// # Errors
    /// Input, if there are none.
    pub fn of(directory: &Path) -> Result<Self> {
        let mut source = ResultDirectory::open(directory)?;
        let html = match source.kind {
            ResultKind::Run => run_page::render_run_page(&mut source),
            ResultKind::Comparison | ResultKind::Study => overview::overview(&mut source),
        }?;
        Ok(Self { html, problems: source.problems })
    }

    /// Writes it to `path`, or leaves what was there unchanged.
    ///
    /// # Errors
    /// Resources, if it cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        write_atomically(path, self.html.as_bytes())
    }
}

/// Whether the file at `path` is a page of this program.
pub fn is_report(path: &Path) -> bool {
    // Pipes and devices would be waited for.
    if !path.is_file() {
        return false;
    }
    let mut head = [0; 512];
    let read = File::open(path).and_then(|mut file| file.read(&mut head)).unwrap_or(0);
    String::from_utf8_lossy(&head[..read]).contains(r#"<meta name="generator" content="orthowear">"#)
}

/// Removes the page in `directory` that was made of results before those that are written there now; a file of that name which is no
/// page of this program stays.
pub fn remove_stale_report(directory: &Path) {
    let path = directory.join(REPORT);
    if is_report(&path) {
        // What cannot be removed says by its fingerprint of the scene what it is of.
        let _ = fs::remove_file(path);
    }
}
