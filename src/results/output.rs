//! The output directory of a run. Files are gathered in a hidden folder inside it and moved to their names when the
//! run has ended, so that a run that fails or is killed loses nothing that was there.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::results::summary::{Status, Summary};

/// Name of the summary's file.
pub const SUMMARY: &str = "summary.json";

/// A directory that receives the results of one run.
#[derive(Debug)]
pub struct OutputDir {
    target: PathBuf,
    staging: PathBuf,
    files: Vec<String>,
}

impl OutputDir {
    /// Prepares `target` (made if absent) to receive results; nothing in it changes before [`OutputDir::finish`].
    ///
    /// # Errors
    /// Input, if `target` is not a directory; resources, if it cannot be made or written to.
    pub fn open(target: &Path) -> Result<Self> {
        if target.exists() && !target.is_dir() {
            return Err(Error::input(format!(
                "the output directory {} is a file; name a directory with --out",
                target.display()
            )));
        }
        // Inside the target, for a rename works only within one file system.
        let staging = target.join(format!(".incoming-{}", std::process::id()));
        if staging.exists() {
            fs::remove_dir_all(&staging).map_err(|e| failure("cannot remove", &staging, &e))?;
        }
        fs::create_dir_all(&staging)
            .map_err(|e| failure("cannot make the output directory", &staging, &e))?;
        Ok(Self { target: target.to_owned(), staging, files: Vec::new() })
    }

    /// Where the results will be.
    pub fn path(&self) -> &Path {
        &self.target
    }

    /// Names of the files gathered so far.
    pub fn files(&self) -> &[String] {
        &self.files
    }

    /// Gathers a file: `fill` writes its content. A file of the same name gathered before is replaced.
    ///
    /// # Errors
    /// Resources, if the disk is full or not writable; the error of `fill`.
    pub fn write(&mut self, name: &str, fill: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
        let path = self.staging.join(name);
        let shown = self.target.join(name);
        let file = File::create(&path).map_err(|e| failure("cannot write", &shown, &e))?;
        let mut buffered = io::BufWriter::with_capacity(1 << 16, file);
        fill(&mut buffered).map_err(|error| error.context(format!("writing {}", shown.display())))?;
        let file = buffered.into_inner().map_err(|e| failure("cannot write", &shown, e.error()))?;
        file.sync_all().map_err(|e| failure("cannot write", &shown, &e))?;
        if !self.files.iter().any(|known| known == name) {
            self.files.push(name.to_owned());
        }
        Ok(())
    }

    /// Moves the gathered files to their names, then writes the summary, which lists them.
    ///
    /// A converged run replaces the files of an earlier one. Any other run first moves all results of the earlier one
    /// to `previous-1` (or the next free number): they outlive the failure, and nobody takes them for new ones.
    ///
    /// # Errors
    /// Resources, if a file cannot be moved or written; numerical, if the summary holds a number that is not
    /// finite (it is written all the same, as a failed run).
    pub fn finish(self, summary: &mut Summary) -> Result<()> {
        summary.files.clone_from(&self.files);
        let (finite, text) = summary.to_json();
        if summary.status == Status::Converged && finite.is_ok() {
            self.remove_stale()?;
        } else {
            self.set_aside()?;
        }
        for name in &self.files {
            let to = self.target.join(name);
            fs::rename(self.staging.join(name), &to).map_err(|e| failure("cannot write", &to, &e))?;
        }
        // Last, so that a summary never names results that are not there.
        write_atomically(&self.target.join(SUMMARY), text.as_bytes())?;
        finite
    }

    /// Removes files that the earlier run's summary lists and this run did not write: fields of steps that no
    /// longer exist would be taken for results of this run.
    fn remove_stale(&self) -> Result<()> {
        for name in earlier_files(&self.target) {
            let path = self.target.join(&name);
            if !self.files.contains(&name) && path.is_file() {
                fs::remove_file(&path).map_err(|e| failure("cannot remove", &path, &e))?;
            }
        }
        Ok(())
    }

    /// Moves the files of the earlier run, and others that this one is going to replace, into a folder of their own.
    fn set_aside(&self) -> Result<()> {
        let mut replaced = earlier_files(&self.target);
        replaced.extend(self.files.iter().cloned());
        if !is_summary_without_steps(&self.target.join(SUMMARY)) {
            replaced.push(SUMMARY.to_owned());
        }
        replaced.sort();
        replaced.dedup();
        replaced.retain(|name| self.target.join(name).is_file());
        if replaced.is_empty() {
            return Ok(());
        }
        let aside = (1_usize..)
            .map(|number| self.target.join(format!("previous-{number}")))
            .find(|folder| !folder.exists())
            .expect("there are more numbers than folders");
        fs::create_dir(&aside).map_err(|e| failure("cannot make", &aside, &e))?;
        for name in replaced {
            let from = self.target.join(&name);
            fs::rename(&from, aside.join(&name)).map_err(|e| failure("cannot move", &from, &e))?;
        }
        Ok(())
    }
}

impl Drop for OutputDir {
    fn drop(&mut self) {
        // Best effort: what remains is hidden and harmless.
        let _ = fs::remove_dir_all(&self.staging);
    }
}

/// Files that the summary in `target` lists; plain names only, so that nothing outside is ever touched.
fn earlier_files(target: &Path) -> Vec<String> {
    let Some(summary) = read_json(&target.join(SUMMARY)) else { return Vec::new() };
    let names = summary["files"].as_array().cloned().unwrap_or_default();
    let plain = |name: &str| Path::new(name).file_name().is_some_and(|file| file == name);
    names.iter().filter_map(|name| name.as_str()).filter(|name| plain(name)).map(str::to_owned).collect()
}

/// Whether the file is the summary of a run that ended before its first increment: not worth keeping.
fn is_summary_without_steps(path: &Path) -> bool {
    read_json(path).is_some_and(|summary| summary["steps"].as_array().is_some_and(Vec::is_empty))
}

fn read_json(path: &Path) -> Option<serde_json::Value> {
    serde_json::from_slice(&fs::read(path).ok()?).ok()
}

/// Writes `bytes` to `path` so that a reader sees either what was there before or all of it.
///
/// # Errors
/// Resources, if the file cannot be written; what was at `path` is then unchanged.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or("file");
    let temporary = path.with_file_name(format!(".{name}.{}", std::process::id()));
    let written = (|| {
        let mut file = File::create(&temporary)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&temporary, path)
    })();
    written.map_err(|e| {
        let _ = fs::remove_file(&temporary);
        failure("cannot write", path, &e)
    })
}

/// A file-system failure as an error with the path, the reason and the mend.
pub(crate) fn failure(what: &str, path: &Path, reason: &io::Error) -> Error {
    let mend = match reason.kind() {
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "; make it writable or choose another directory with --out"
        }
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "; free some space or choose another disk with --out"
        }
        _ => "",
    };
    Error::resources(format!("{what} {}: {reason}{mend}", path.display()))
}

/// The same for a failure while the content is being written.
pub(crate) fn write_failure(reason: &io::Error) -> Error {
    Error::resources(reason.to_string())
}
