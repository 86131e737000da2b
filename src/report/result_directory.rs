//! Directory of results. Damaged and missing files are reported as problems.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::error::{Error, Result};

/// Largest size of text and SVG files, bytes. Larger files are omitted.
const MAX_TEXT_BYTES: u64 = 512 << 20;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ResultKind {
    Run,
    Comparison,
    Study,
}

impl ResultKind {
    const ALL: [Self; 3] = [Self::Run, Self::Comparison, Self::Study];

    pub(super) fn summary_file(self) -> &'static str {
        match self {
            Self::Run => "summary.json",
            Self::Comparison => "compare.json",
            Self::Study => "study.json",
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Run => "run",
            Self::Comparison => "compare",
            Self::Study => "study",
        }
    }
}

pub(super) struct ResultDirectory {
    directory: PathBuf,
    pub kind: ResultKind,
    /// Content of the summary file; null if it is damaged.
    pub summary: Value,
    pub problems: Vec<String>,
    names: Vec<String>,
}

impl ResultDirectory {
    /// Lists the directory and reads its summary.
    pub(super) fn open(directory: &Path) -> Result<Self> {
        let names = names(directory)?;
        let found =
            ResultKind::ALL.into_iter().find(|what| names.iter().any(|name| name == what.summary_file()));
        let kind = found.ok_or_else(|| no_results_error(directory, &names))?;
        let mut source =
            Self { directory: directory.to_owned(), kind, summary: Value::Null, problems: Vec::new(), names };
        match source.json(kind.summary_file()) {
            Ok(said) => source.summary = said,
            Err(error) => source.problems.push(error.to_string()),
        }
        Ok(source)
    }

    /// Reads the JSON object in the file `name`.
    pub(super) fn json(&self, name: &str) -> Result<Value> {
        let text = self.text(name)?;
        let read: Value = serde_json::from_str(&text)
            .map_err(|error| Error::input(format!("{name} is damaged: {error}")))?;
        if read.is_object() {
            Ok(read)
        } else {
            Err(Error::input(format!("{name} is damaged: it is not a JSON object")))
        }
    }

    pub(super) fn text(&self, name: &str) -> Result<String> {
        let path = self.path(name);
        let length = fs::metadata(&path).map_or(0, |found| found.len());
        if length > MAX_TEXT_BYTES {
            return Err(Error::input(format!(
                "{name} is too large: it has {length} bytes; at most {MAX_TEXT_BYTES} are read"
            )));
        }
        fs::read_to_string(&path).map_err(|error| Error::input(format!("{name} cannot be read: {error}")))
    }

    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.directory.join(name)
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.names.binary_search_by(|known| known.as_str().cmp(name)).is_ok()
    }

    /// Names of the files with the prefix `begin` and the suffix `end`, sorted. If the summary lists files, only listed
    /// files are included.
    pub(super) fn files(&self, begin: &str, end: &str) -> Vec<String> {
        let own: Option<HashSet<&str>> =
            self.summary["files"].as_array().map(|list| list.iter().filter_map(Value::as_str).collect());
        let counted = |name: &&String| own.as_ref().is_none_or(|own| own.contains(name.as_str()));
        let named = |name: &&String| name.starts_with(begin) && name.ends_with(end);
        self.names.iter().filter(named).filter(counted).cloned().collect()
    }

    /// Files that the summary lists, but that do not exist.
    pub(super) fn missing(&self) -> Vec<String> {
        let own = self.summary["files"].as_array().into_iter().flatten().filter_map(Value::as_str);
        own.filter(|name| !self.has(name)).map(str::to_owned).collect()
    }

    /// Files `NAME_0001.vtu`, ... of a series with their numbers, in ascending order.
    pub(super) fn series(&self, name: &str) -> Vec<(usize, String)> {
        let begin = format!("{name}_");
        let number = |file: &String| {
            let digits = file.strip_prefix(&begin)?.strip_suffix(".vtu")?;
            let plain = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
            plain.then(|| digits.parse().ok()).flatten()
        };
        let files = self.files(&begin, ".vtu");
        let mut list: Vec<(usize, String)> =
            files.into_iter().filter_map(|file| number(&file).map(|number| (number, file))).collect();
        list.sort();
        list
    }
}

fn names(directory: &Path) -> Result<Vec<String>> {
    let wrong = |error: std::io::Error| {
        Error::input(format!(
            "{} cannot be read: {error}; give the output directory of orthowear run, compare or study",
            directory.display()
        ))
    };
    let entries = fs::read_dir(directory).map_err(wrong)?;
    let mut names: Vec<String> =
        entries.flatten().filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    Ok(names)
}

fn no_results_error(directory: &Path, names: &[String]) -> Error {
    const SHOWN: usize = 5;
    let visible: Vec<&str> = names.iter().map(String::as_str).filter(|name| !name.starts_with('.')).collect();
    let found = match visible.len() {
        0 => "it is empty".to_owned(),
        n if n > SHOWN => format!("found: {} and {} more", visible[..SHOWN].join(", "), n - SHOWN),
        _ => format!("found: {}", visible.join(", ")),
    };
    let begun = if names.iter().any(|name| name == ".incoming") {
        "; a run is active in it, or was killed before it wrote a summary (orthowear run --resume resumes from its checkpoint, if there is one)"
    } else {
        "; give the output directory of orthowear run, compare or study"
    };
    Error::input(format!(
        "{} holds no results: expected summary.json (of a run), compare.json or study.json, {found}{begun}",
        directory.display()
    ))
}
