//! Checkpoint files, from which an interrupted run resumes as if it had not stopped.
//!
//! Two files are written alternately, so that one always stays intact. Numbers are little-endian:
//!
//! | bytes | content |
//! |---|---|
//! | 16 | `orthowear-check` and a line end |
//! | 4 | version of the format |
//! | 8 | number of the checkpoint; the file with the larger number is the newer one |
//! | 8 | length of the [`Provenance`] |
//! | .. | the [`Provenance`], JSON |
//! | .. | the state, MessagePack with the names of the fields |
//! | 32 | SHA-256 of all bytes before |

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};

use crate::error::{Error, Result};
use crate::output::atomic_file::{self, HashingWriter, file_error, temporary_prefix};
use crate::output::provenance::Provenance;

/// Names of the checkpoint files.
pub const FILES: [&str; 2] = ["checkpoint-1.bin", "checkpoint-2.bin"];

const MAGIC: &[u8; 16] = b"orthowear-check\n";
const FORMAT: u32 = 13;
const HEADER_BYTES: usize = 36;
const CHECKSUM_BYTES: usize = 32;

const RESTART_HINT: &str = "run without --resume to start again";

/// Checkpoint read from a file.
#[derive(Debug)]
pub struct Checkpoint {
    /// Number of the checkpoint, from 1.
    pub number: u64,
    /// Program, scene and files of the run.
    pub provenance: Provenance,
    /// Warnings about a damaged checkpoint file.
    pub warnings: Vec<String>,
    path: PathBuf,
    bytes: Vec<u8>,
    state_offset: usize,
}

enum UnusableCheckpoint {
    Absent,
    Damaged(&'static str),
    OtherFormat(u32),
}

/// Whether `folder` contains checkpoint files, intact or not.
pub fn are_in(folder: &Path) -> bool {
    FILES.iter().any(|name| folder.join(name).exists())
}

/// Removes the checkpoint files from `folder`.
///
/// # Errors
/// If a file cannot be removed (kind `Resources`).
pub fn remove(folder: &Path) -> Result<()> {
    for path in FILES.map(|name| folder.join(name)) {
        match fs::remove_file(&path) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => {
                return Err(file_error("cannot remove", &path, &e));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Removes the temporary files that killed runs left: those of checkpoints, and those of the file `other`.
pub(super) fn remove_temporary_files(folder: &Path, other: &str) {
    let prefixes = [FILES[0], FILES[1], other].map(|name| temporary_prefix(Path::new(name)));
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_str().is_some_and(|name| prefixes.iter().any(|p| name.starts_with(p))) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Writes checkpoint `number` (from 1) into `folder`: odd numbers into the first of [`FILES`], even numbers into the
/// second.
///
/// # Errors
/// If the checkpoint cannot be written (kind `Resources`). Existing checkpoints then stay unchanged.
pub fn write(folder: &Path, number: u64, origin: &Provenance, state: &impl Serialize) -> Result<()> {
    let path = folder.join(FILES[usize::from(number.is_multiple_of(2))]);
    atomic_file::write_atomically_with(&path, |file| {
        let origin = serde_json::to_vec(origin).map_err(io::Error::other)?;
        let mut out = HashingWriter::new(file);
        out.write_all(MAGIC)?;
        out.write_all(&FORMAT.to_le_bytes())?;
        out.write_all(&number.to_le_bytes())?;
        out.write_all(&(origin.len() as u64).to_le_bytes())?;
        out.write_all(&origin)?;
        let mut encoder = rmp_serde::Serializer::new(&mut out).with_struct_map();
        state.serialize(&mut encoder).map_err(|error| match error {
            rmp_serde::encode::Error::InvalidValueWrite(error) => error.into(),
            other => io::Error::other(other),
        })?;
        let (file, _, checksum) = out.end();
        file.write_all(&checksum)
    })
}

/// Reads the newest intact checkpoint in `folder`; `None` if there is no checkpoint file.
///
/// # Errors
/// If checkpoint files exist, but none is intact and of this format (kind `Input`). If a file cannot be read (kind `Resources`).
pub fn read(folder: &Path) -> Result<Option<Checkpoint>> {
    let mut newest: Option<Checkpoint> = None;
    let (mut notes, mut unfit) = (Vec::new(), Vec::new());
    for path in FILES.map(|name| folder.join(name)) {
        match read_one(&path)? {
            Ok(one) if newest.as_ref().is_none_or(|newest| newest.number < one.number) => newest = Some(one),
            Ok(_) | Err(UnusableCheckpoint::Absent) => {}
            Err(UnusableCheckpoint::Damaged(how)) => {
                notes.push(format!("{} is damaged ({how}); the other checkpoint is used", path.display()));
                unfit.push(format!("{} is damaged ({how})", path.display()));
            }
            Err(UnusableCheckpoint::OtherFormat(format)) => unfit.push(format!(
                "{} has format {format}, but this version reads {FORMAT}; resume with the version that wrote it",
                path.display()
            )),
        }
    }
    if let Some(newest) = &mut newest {
        newest.warnings = notes;
    } else if !unfit.is_empty() {
        return Err(Error::input(format!(
            "no checkpoint to resume from: {}; {RESTART_HINT}",
            unfit.join("; ")
        )));
    }
    Ok(newest)
}

fn read_one(path: &Path) -> Result<std::result::Result<Checkpoint, UnusableCheckpoint>> {
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Err(UnusableCheckpoint::Absent)),
        Err(e) => return Err(file_error("cannot read", path, &e)),
    };
    Ok(parse(path, bytes))
}

fn parse(path: &Path, bytes: Vec<u8>) -> std::result::Result<Checkpoint, UnusableCheckpoint> {
    let end = bytes
        .len()
        .checked_sub(CHECKSUM_BYTES)
        .filter(|&end| end >= HEADER_BYTES)
        .ok_or(UnusableCheckpoint::Damaged("too short"))?;
    let (content, checksum) = bytes.split_at(end);
    if !content.starts_with(MAGIC) {
        return Err(UnusableCheckpoint::Damaged("not a checkpoint"));
    }
    if Sha256::digest(content).as_slice() != checksum {
        return Err(UnusableCheckpoint::Damaged("wrong checksum"));
    }
    let format = u32::from_le_bytes([content[16], content[17], content[18], content[19]]);
    if format != FORMAT {
        return Err(UnusableCheckpoint::OtherFormat(format));
    }
    let long = |at: usize| u64::from_le_bytes(std::array::from_fn(|i| content[at + i]));
    let state = usize::try_from(long(28)).ok().and_then(|length| HEADER_BYTES.checked_add(length));
    let state_offset =
        state.filter(|&state| state <= end).ok_or(UnusableCheckpoint::Damaged("wrong length"))?;
    let provenance = serde_json::from_slice(&content[HEADER_BYTES..state_offset])
        .map_err(|_| UnusableCheckpoint::Damaged("its origin cannot be read"))?;
    let (number, warnings, path) = (long(20), Vec::new(), path.to_owned());
    Ok(Checkpoint { number, provenance, warnings, path, state_offset, bytes })
}

impl Checkpoint {
    /// Deserialises the state.
    ///
    /// # Errors
    /// If the state does not fit the types of this program (kind `Input`).
    pub fn state<T: DeserializeOwned>(&self) -> Result<T> {
        let state = &self.bytes[self.state_offset..self.bytes.len() - CHECKSUM_BYTES];
        rmp_serde::from_slice(state).map_err(|error| {
            Error::input(format!(
                "{} was written by another build of orthowear {} ({error}). Resume with that build, or {RESTART_HINT}",
                self.path.display(),
                self.provenance.version
            ))
        })
    }
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;
    use serde_json::json;

    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct State {
        values: Vec<f64>,
        #[serde(skip_serializing_if = "Option::is_none")]
        sometimes: Option<f64>,
        last: String,
    }

    fn state(last: &str) -> State {
        State {
            values: vec![0.1, -0.0, f64::MIN_POSITIVE, f64::INFINITY],
            sometimes: None,
            last: last.into(),
        }
    }

    fn origin() -> Provenance {
        Provenance::new(json!({ "gap": { "radius": 50 } }), Vec::new())
    }

    fn last(folder: &Path) -> String {
        read(folder).unwrap().unwrap().state::<State>().unwrap().last
    }

    /// Truth: the read state has the same bits as the written one, and the newer file is read.
    #[test]
    fn the_newest_is_read() {
        let dir = tempfile::tempdir().unwrap();
        assert!(read(dir.path()).unwrap().is_none());
        for (number, name) in ["a", "b", "c"].into_iter().enumerate() {
            write(dir.path(), number as u64 + 1, &origin(), &state(name)).unwrap();
            let found = read(dir.path()).unwrap().unwrap();
            assert_eq!((found.number, &found.provenance), (number as u64 + 1, &origin()));
            let back: State = found.state().unwrap();
            assert_eq!(back, state(name));
            assert!(back.values[1].is_sign_negative() && found.warnings.is_empty());
        }
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2);
        remove(dir.path()).unwrap();
        assert!(!are_in(dir.path()));
    }

    /// Truth (`rel-corrupt-checkpoint` in docs/verification.md): every flipped bit, truncation or extension is
    /// detected, and the other checkpoint is read. If both checkpoints are damaged, the error names both files.
    #[test]
    fn damage_is_found() {
        let dir = tempfile::tempdir().unwrap();
        write(dir.path(), 1, &origin(), &state("before")).unwrap();
        write(dir.path(), 2, &origin(), &state("newest")).unwrap();
        assert_eq!(last(dir.path()), "newest");
        let path = dir.path().join(FILES[1]);
        let whole = fs::read(&path).unwrap();
        let flips = (0..8 * whole.len()).map(|bit| {
            let mut bytes = whole.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            bytes
        });
        let cuts = (0..whole.len()).map(|length| whole[..length].to_vec());
        let longer = [1, 512].map(|more| [whole.clone(), vec![0; more]].concat());
        for bytes in flips.chain(cuts).chain(longer) {
            fs::write(&path, bytes).unwrap();
            let found = read(dir.path()).unwrap().unwrap();
            assert_eq!(found.state::<State>().unwrap().last, "before");
            assert!(found.warnings.len() == 1 && found.warnings[0].contains("checkpoint-2.bin is damaged"));
        }
        fs::write(dir.path().join(FILES[0]), "orthowear-check\n").unwrap();
        let error = read(dir.path()).unwrap_err();
        let text = error.to_string();
        assert_eq!(error.exit_code(), 2);
        assert!(FILES.iter().all(|name| text.contains(name)) && text.contains("without --resume"), "{text}");
    }

    /// Truth (docs/checkpoints.md): a checkpoint of another format is refused, and the error names this format. A state
    /// with other fields is refused as the state of another build.
    #[test]
    fn foreign_checkpoints_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        write(dir.path(), 1, &origin(), &json!({ "other": 1 })).unwrap();
        let error = read(dir.path()).unwrap().unwrap().state::<State>().unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains("another build"), "{error}");
        let path = dir.path().join(FILES[0]);
        let mut bytes = fs::read(&path).unwrap();
        let other = FORMAT + 1;
        bytes[16..20].copy_from_slice(&other.to_le_bytes());
        let end = bytes.len() - CHECKSUM_BYTES;
        let checksum = Sha256::digest(&bytes[..end]);
        bytes[end..].copy_from_slice(&checksum);
        fs::write(&path, bytes).unwrap();
        let error = read(dir.path()).unwrap_err().to_string();
        assert!(error.contains(&format!("format {other}")), "{error}");
    }

    /// Truth: a failed write (to a full device) leaves the existing checkpoint intact. Temporary files of killed runs are removed.
    #[cfg(unix)]
    #[test]
    fn a_failure_leaves_the_last_one() {
        use std::os::unix::fs::symlink;
        let dir = tempfile::tempdir().unwrap();
        write(dir.path(), 1, &origin(), &state("kept")).unwrap();
        let temporary = format!("{}{}", temporary_prefix(Path::new(FILES[1])), std::process::id());
        symlink("/dev/full", dir.path().join(&temporary)).unwrap();
        let error = write(dir.path(), 2, &origin(), &state("lost")).unwrap_err();
        assert!(error.exit_code() == 4 && error.to_string().contains("free some space"), "{error}");
        assert_eq!(last(dir.path()), "kept");
        fs::write(dir.path().join(&temporary), "half of one").unwrap();
        fs::write(dir.path().join(".summary.json.7"), "{").unwrap();
        remove_temporary_files(dir.path(), "summary.json");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }
}
