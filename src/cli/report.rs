use std::path::PathBuf;

use clap::Args;

use super::console::{print_error, to_stderr, to_stdout};
use super::options::CommandResult;
use crate::error::exit;
use crate::error::{Error, Result};
use crate::output::report_file::{REPORT, is_report};
use crate::report::Report;

#[derive(Debug, Args)]
pub(super) struct ReportArgs {
    /// Output directory of a run, a comparison or a study.
    directory: PathBuf,
    /// File of the report; default: report.html in the directory.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(super) fn report(arguments: &ReportArgs) -> CommandResult {
    write_report(arguments).map_err(|error| print_error(&error))
}

fn write_report(arguments: &ReportArgs) -> Result<u8> {
    let path = arguments.out.clone().unwrap_or_else(|| arguments.directory.join(REPORT));
    if path.is_dir() {
        return Err(Error::input(format!("{} is a directory; give a file with --out", path.display())));
    }
    if path.symlink_metadata().is_ok() && !is_report(&path) {
        return Err(Error::input(format!(
            "{} exists and is not overwritten, because it is not recognised as a report of orthowear (it may be incomplete or of another version). Remove it, or choose another file with --out",
            path.display()
        )));
    }
    let report = Report::of(&arguments.directory)?;
    report.write(&path)?;
    for problem in &report.problems {
        to_stderr(&format!("note: {problem}\n"));
    }
    to_stdout(&format!("report: {}\n", path.display()));
    Ok(exit::DONE)
}
