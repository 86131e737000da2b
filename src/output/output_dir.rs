//! Output directory of a run. Files are staged in a hidden folder inside it and get their final names when the run ends. A failed
//! or killed run thus loses no earlier results.

use std::collections::HashSet;
use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result, Warning};
pub use crate::output::atomic_file::write_atomically;
use crate::output::atomic_file::{HashingWriter, hexadecimal, sha256_of, sync_folder};
pub(crate) use crate::output::atomic_file::{file_error, write_error};
use crate::output::checkpoint;
use crate::output::report_file::remove_stale_report;
use crate::output::summary::{Status, Summary};

/// Name of the summary file.
pub const SUMMARY_FILE: &str = "summary.json";

/// Staging folder; it lies inside the target, because files can be renamed only within a file system.
const STAGING_DIR: &str = ".incoming";

/// Staged file of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StagedFile {
    /// Name.
    pub name: String,
    /// Length, bytes.
    pub bytes: u64,
    /// SHA-256 of the content, hexadecimal.
    pub sha256: String,
}

/// Directory that receives the results of one run at a time.
#[derive(Debug)]
pub struct OutputDir {
    target: PathBuf,
    staging: PathBuf,
    files: Vec<StagedFile>,
    /// True while the directory holds an earlier unfinished run that this run neither resumes nor has moved to `previous-N`.
    holds_unfinished_run: bool,
    resumes: bool,
    keep_staging: bool,
    warnings: Vec<Warning>,
    _lock: Option<File>,
}

impl OutputDir {
    /// Prepares `target`, and creates it if necessary. Earlier results stay until the first file or checkpoint is written, or the
    /// run ends.
    ///
    /// # Errors
    /// If `target` is not a directory (kind `Input`). If it is not writable or in use by another run (kind `Resources`).
    pub fn open(target: &Path) -> Result<Self> {
        if target.exists() && !target.is_dir() {
            return Err(Error::input(format!(
                "the output directory {} is a file; give a directory with --out",
                target.display()
            )));
        }
        fs::create_dir_all(target)
            .map_err(|e| file_error("cannot create the output directory", target, &e))?;
        let lock = lock(target)?;
        checkpoint::remove_temporary_files(target, SUMMARY_FILE);
        let holds_unfinished_run = checkpoint::are_in(target);
        let staging = target.join(STAGING_DIR);
        if staging.exists() && !holds_unfinished_run {
            // Without a checkpoint no run can resume from these files.
            fs::remove_dir_all(&staging).map_err(|e| file_error("cannot remove", &staging, &e))?;
        }
        fs::create_dir_all(&staging)
            .map_err(|e| file_error("cannot create the output directory", &staging, &e))?;
        Ok(Self {
            target: target.to_owned(),
            staging,
            files: Vec::new(),
            holds_unfinished_run,
            resumes: false,
            keep_staging: holds_unfinished_run,
            warnings: Vec::new(),
            _lock: lock,
        })
    }

    /// Path of the directory.
    pub fn path(&self) -> &Path {
        &self.target
    }

    /// Staged files.
    pub fn files(&self) -> &[StagedFile] {
        &self.files
    }

    /// Removes all but the first `n` files from the list of staged files.
    pub fn truncate_staged(&mut self, n: usize) {
        self.files.truncate(n);
    }

    /// Whether this run resumes a run of this directory.
    pub fn is_resumed(&self) -> bool {
        self.resumes
    }

    /// Takes over the staged `files` of the run that is resumed. Searches them in the staging folder, in the directory,
    /// and in `previous-N`. Returns the names of the files that were not found.
    ///
    /// # Errors
    /// If a file cannot be moved or copied (kind `Resources`).
    pub fn restage(&mut self, files: Vec<StagedFile>) -> Result<Vec<String>> {
        (self.holds_unfinished_run, self.resumes, self.keep_staging) = (false, true, true);
        let mut missing = Vec::new();
        for file in files {
            if self.restage_file(&file)? {
                self.files.push(file);
            } else {
                missing.push(file.name);
            }
        }
        Ok(missing)
    }

    /// Restores a file in the staging folder. Returns false if the file was not found.
    fn restage_file(&self, file: &StagedFile) -> Result<bool> {
        let to = self.staging.join(&file.name);
        if fs::metadata(&to).is_ok_and(|found| found.len() == file.bytes) {
            return Ok(true);
        }
        let is_it = |path: &Path| {
            fs::metadata(path).is_ok_and(|found| found.len() == file.bytes)
                && sha256_of(path).is_ok_and(|sha256| sha256 == file.sha256)
        };
        let moved = self.target.join(&file.name);
        if is_it(&moved) {
            fs::rename(&moved, &to).map_err(|e| file_error("cannot move", &moved, &e))?;
            return Ok(true);
        }
        let asides =
            (1..).map(|number| previous_dir(&self.target, number)).take_while(|folder| folder.exists());
        let Some(found) = asides.map(|folder| folder.join(&file.name)).find(|path| is_it(path)) else {
            return Ok(false);
        };
        fs::copy(&found, &to).map_err(|e| file_error("cannot write", &to, &e))?;
        Ok(true)
    }

    /// Moves an earlier unfinished run to `previous-N`. From then on, the staged files stay even if this run ends
    /// early, because a checkpoint lists them.
    ///
    /// # Errors
    /// If an earlier unfinished run cannot be moved to `previous-N` (kind `Resources`).
    pub fn keep_staged_files(&mut self) -> Result<()> {
        self.set_aside_unfinished_run()?;
        self.keep_staging = true;
        sync_folder(Some(&self.staging));
        Ok(())
    }

    /// Moves an earlier unfinished run with its staged files to `previous-N`, where it can still be resumed.
    fn set_aside_unfinished_run(&mut self) -> Result<()> {
        if !std::mem::take(&mut self.holds_unfinished_run) {
            return Ok(());
        }
        let interrupted =
            read_json(&self.target.join(SUMMARY_FILE)).is_some_and(|s| s["status"] != "converged");
        let mut names = if interrupted { earlier_files(&self.target) } else { Vec::new() };
        names.extend(checkpoint::FILES.map(str::to_owned));
        names.extend(interrupted.then(|| SUMMARY_FILE.to_owned()));
        let gathered = fs::read_dir(&self.staging).into_iter().flatten().flatten();
        let gathered = gathered.map(|entry| entry.path()).filter(|path| path.is_file());
        let paths: Vec<PathBuf> = names
            .iter()
            .map(|name| self.target.join(name))
            .filter(|path| path.is_file())
            .chain(gathered)
            .collect();
        let folder = move_to_previous(&self.target, &paths)?;
        self.keep_staging = false;
        self.warnings.extend(folder.map(|folder| {
            Warning::note(format!(
                "{} contained an unfinished run, which is kept in {}. To resume it: the same command with --resume --out {}",
                self.target.display(),
                folder.display(),
                folder.display()
            ))
        }));
        Ok(())
    }

    /// Stages a file with the content `text`.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn write_text(&mut self, name: &str, text: &str) -> Result<()> {
        self.write(name, |out| out.write_all(text.as_bytes()).map_err(|e| write_error(&e)))
    }

    /// Stages a file whose content `fill` writes, in place of a staged file of the same name.
    ///
    /// # Errors
    /// If the file cannot be written or an earlier unfinished run cannot be moved (kind `Resources`). If `fill` fails.
    pub fn write(&mut self, name: &str, fill: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
        self.set_aside_unfinished_run()?;
        let path = self.staging.join(name);
        let shown = self.target.join(name);
        let is_new = !path.exists();
        let written = (|| {
            let file = File::create(&path).map_err(|e| file_error("cannot write", &shown, &e))?;
            let mut buffered = io::BufWriter::with_capacity(1 << 16, HashingWriter::new(file));
            fill(&mut buffered).map_err(|error| error.context(format!("writing {}", shown.display())))?;
            let hashed = buffered.into_inner().map_err(|e| file_error("cannot write", &shown, e.error()))?;
            let (file, bytes, hash) = hashed.end();
            file.sync_all().map_err(|e| file_error("cannot write", &shown, &e))?;
            Ok(StagedFile { name: name.to_owned(), bytes, sha256: hexadecimal(&hash) })
        })();
        if !is_new {
            self.files.retain(|known| known.name != name);
        }
        match written {
            Ok(file) => self.files.push(file),
            Err(error) => {
                // An incomplete file takes space that the summary may need.
                let _ = fs::remove_file(&path);
                return Err(error);
            }
        }
        Ok(())
    }

    /// Moves the staged files to their final names, then writes the summary, which lists them.
    ///
    /// A converged run replaces the files of an earlier run and removes its own checkpoints. Any other run first moves earlier
    /// results to `previous-1` (or the next free number), unless it resumes the earlier run with at least as many entries.
    ///
    /// # Errors
    /// If a file cannot be moved or written (kind `Resources`). If a number of the summary is not finite (kind `Numerical`); the
    /// run then counts as failed.
    pub fn finish(mut self, summary: &mut Summary) -> Result<()> {
        summary.warnings.append(&mut self.warnings);
        summary.files = self.files.iter().map(|file| file.name.clone()).collect();
        let (finite, text) = summary.to_json();
        let converged = summary.status == Status::Converged && finite.is_ok();
        if converged || self.supersedes_earlier(summary) {
            self.remove_stale()?;
        } else {
            self.set_aside_earlier_results()?;
        }
        remove_stale_report(&self.target);
        if let Err(error) = self.move_to_names() {
            summary.set_failure(&error);
            summary.files.retain(|name| self.target.join(name).is_file());
            write_atomically(&self.target.join(SUMMARY_FILE), summary.to_json().1.as_bytes())?;
            return Err(error);
        }
        // The summary comes last, so that it never lists missing results.
        write_atomically(&self.target.join(SUMMARY_FILE), text.as_bytes())?;
        if converged && !self.holds_unfinished_run {
            checkpoint::remove(&self.target)?;
        }
        // An earlier unfinished run that this run did not touch keeps its staged files.
        self.keep_staging = self.holds_unfinished_run;
        finite
    }

    fn move_to_names(&self) -> Result<()> {
        self.files.iter().try_for_each(|file| {
            let to = self.target.join(&file.name);
            fs::rename(self.staging.join(&file.name), &to).map_err(|e| file_error("cannot write", &to, &e))
        })
    }

    /// Leaves staged files and checkpoints for a later resume, and writes only the summary. As in [`OutputDir::finish`], earlier
    /// results move to `previous-N`, unless this run resumes the earlier run with at least as many entries.
    ///
    /// # Errors
    /// As [`OutputDir::finish`].
    pub fn suspend(mut self, summary: &mut Summary) -> Result<()> {
        summary.warnings.append(&mut self.warnings);
        if !self.supersedes_earlier(summary) {
            self.set_aside_earlier_results()?;
        }
        summary.files = earlier_files(&self.target);
        summary.files.retain(|name| self.target.join(name).is_file());
        remove_stale_report(&self.target);
        let (finite, text) = summary.to_json();
        write_atomically(&self.target.join(SUMMARY_FILE), text.as_bytes())?;
        finite
    }

    /// Whether the existing summary may be replaced: this run resumes an unconverged run of the same scene, and has no fewer
    /// entries.
    fn supersedes_earlier(&self, summary: &Summary) -> bool {
        let Some(earlier) = read_json(&self.target.join(SUMMARY_FILE)).filter(|_| self.resumes) else {
            return false;
        };
        earlier["status"] != "converged"
            && earlier["scene_sha256"] == summary.scene_sha256.as_str()
            && earlier["steps"].as_array().is_some_and(|steps| steps.len() <= summary.steps.len())
    }

    /// Removes files that only the earlier summary lists; they would look like results of this run.
    fn remove_stale(&self) -> Result<()> {
        let own: HashSet<&str> = self.files.iter().map(|file| file.name.as_str()).collect();
        for name in earlier_files(&self.target) {
            let path = self.target.join(&name);
            if !own.contains(name.as_str()) && path.is_file() {
                fs::remove_file(&path).map_err(|e| file_error("cannot remove", &path, &e))?;
            }
        }
        Ok(())
    }

    /// Moves the files of the earlier run, and other files that this run would replace, to `previous-N`.
    fn set_aside_earlier_results(&self) -> Result<()> {
        let mut replaced = earlier_files(&self.target);
        replaced.extend(self.files.iter().map(|file| file.name.clone()));
        if !is_summary_without_steps(&self.target.join(SUMMARY_FILE)) {
            replaced.push(SUMMARY_FILE.to_owned());
        }
        replaced.sort();
        replaced.dedup();
        let paths: Vec<PathBuf> =
            replaced.iter().map(|name| self.target.join(name)).filter(|path| path.is_file()).collect();
        move_to_previous(&self.target, &paths)?;
        Ok(())
    }
}

impl Drop for OutputDir {
    fn drop(&mut self) {
        if !self.keep_staging {
            let _ = fs::remove_dir_all(&self.staging);
        }
    }
}

/// Number of attempts to lock a directory. After a process is killed or has just started another process, its lock may
/// last a moment longer.
const LOCK_ATTEMPTS: usize = 40;
const LOCK_RETRY_DELAY: Duration = Duration::from_millis(50);

/// Locks a directory against other runs; `None` if the file system has no locks.
fn lock(target: &Path) -> Result<Option<File>> {
    let folder = File::open(target).map_err(|e| file_error("cannot open", target, &e))?;
    for _ in 0..LOCK_ATTEMPTS {
        match folder.try_lock() {
            Ok(()) => return Ok(Some(folder)),
            Err(TryLockError::WouldBlock) => std::thread::sleep(LOCK_RETRY_DELAY),
            Err(TryLockError::Error(_)) => return Ok(None),
        }
    }
    Err(Error::resources(format!(
        "another run is writing into {}: wait until it ends, or choose another directory with --out",
        target.display()
    )))
}

fn previous_dir(target: &Path, number: usize) -> PathBuf {
    target.join(format!("previous-{number}"))
}

/// Moves files into the next free `previous-N`. Returns this folder, or `None` without files.
fn move_to_previous(target: &Path, files: &[PathBuf]) -> Result<Option<PathBuf>> {
    if files.is_empty() {
        return Ok(None);
    }
    let free = (1..).map(|number| previous_dir(target, number)).find(|folder| !folder.exists());
    let folder = free.expect("there are more numbers than folders");
    fs::create_dir(&folder).map_err(|e| file_error("cannot create", &folder, &e))?;
    for from in files {
        let Some(name) = from.file_name() else { continue };
        fs::rename(from, folder.join(name)).map_err(|e| file_error("cannot move", from, &e))?;
    }
    Ok(Some(folder))
}

/// Files that the summary in `target` lists; only plain names, so that no file outside of `target` is touched.
fn earlier_files(target: &Path) -> Vec<String> {
    let Some(summary) = read_json(&target.join(SUMMARY_FILE)) else { return Vec::new() };
    let names = summary["files"].as_array().cloned().unwrap_or_default();
    let plain = |name: &str| Path::new(name).file_name().is_some_and(|file| file == name);
    names.iter().filter_map(|name| name.as_str()).filter(|name| plain(name)).map(str::to_owned).collect()
}

/// Whether the file is the summary of a run that ended before its first increment.
fn is_summary_without_steps(path: &Path) -> bool {
    read_json(path).is_some_and(|summary| summary["steps"].as_array().is_some_and(Vec::is_empty))
}

/// Reads a JSON file, if it exists and is valid.
pub fn read_json(path: &Path) -> Option<serde_json::Value> {
    serde_json::from_slice(&fs::read(path).ok()?).ok()
}
