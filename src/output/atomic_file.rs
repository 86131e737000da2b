//! Files that are there as a whole or not at all, and their checksums.

use std::fs::{self, File};
use std::io::{self, BufWriter, Read, Write};
use std::path::Path;

use sha2::{Digest, Sha256};

use crate::error::{Error, Result};

/// Bytes written or read at once.
const BLOCK: usize = 1 << 16;

/// A writer that counts and hashes what goes through it.
pub struct HashingWriter<W> {
    inner: W,
    hash: Sha256,
    bytes: u64,
}

impl<W: Write> HashingWriter<W> {
    /// A writer into `inner`.
    pub fn new(inner: W) -> Self {
        Self { inner, hash: Sha256::new(), bytes: 0 }
    }

    /// The writer within, the bytes written and their SHA-256.
    pub fn end(self) -> (W, u64, [u8; 32]) {
        (self.inner, self.bytes, self.hash.finalize().into())
    }
}

impl<W: Write> Write for HashingWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.hash.update(&bytes[..written]);
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

/// A hash as hexadecimal digits.
pub fn hexadecimal(hash: &[u8]) -> String {
    hash.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// SHA-256 of a file's content, hexadecimal.
///
/// # Errors
/// If it cannot be read.
pub fn sha256_of(path: &Path) -> io::Result<String> {
    let (mut file, mut hash, mut block) = (File::open(path)?, Sha256::new(), vec![0; BLOCK]);
    loop {
        match file.read(&mut block)? {
            0 => return Ok(hexadecimal(&hash.finalize())),
            read => hash.update(&block[..read]),
        }
    }
}

/// Writes `bytes` to `path` so that a reader sees either what was there before or all of it.
///
/// # Errors
/// Resources, if the file cannot be written; what was at `path` is then unchanged.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    write_atomically_with(path, |file| file.write_all(bytes))
}

/// The same for a content that `fill` writes.
///
/// # Errors
/// As [`write_atomically`].
pub fn write_atomically_with(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<()> {
    let temporary = path.with_file_name(format!("{}{}", temporary_prefix(path), std::process::id()));
    let written = (|| {
        let mut file = BufWriter::with_capacity(BLOCK, File::create(&temporary)?);
        fill(&mut file)?;
        file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()?;
        fs::rename(&temporary, path)?;
        sync_folder(path.parent());
        Ok(())
    })();
    written.map_err(|e: io::Error| {
        let _ = fs::remove_file(&temporary);
        file_error("cannot write", path, &e)
    })
}

/// What the names of the files begin with under which [`write_atomically_with`] writes the one at `path`.
pub(super) fn temporary_prefix(path: &Path) -> String {
    format!(".{}.", path.file_name().and_then(|name| name.to_str()).unwrap_or("file"))
}

/// Has the names in a folder written to the disk; where the system cannot, they get there by themselves.
pub(super) fn sync_folder(folder: Option<&Path>) {
    let _ = folder.map(|folder| File::open(folder).and_then(|folder| folder.sync_all()));
}

/// How to get rid of a file-system failure, as the end of a message; empty where there is no advice.
fn advice(reason: &io::Error) -> &'static str {
    match reason.kind() {
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "; make it writable or choose another directory with --out"
        }
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "; free some space or choose another disk with --out"
        }
        io::ErrorKind::FileTooLarge => "; raise the limit of file sizes of the shell (ulimit -f)",
        _ => "",
    }
}

/// A file-system failure as an error with the path, the reason and advice.
pub(crate) fn file_error(what: &str, path: &Path, reason: &io::Error) -> Error {
    Error::resources(format!("{what} {}: {reason}{}", path.display(), advice(reason)))
}

/// A failure while the content of a file is written, as an error with the reason and advice.
pub(crate) fn write_error(reason: &io::Error) -> Error {
    Error::resources(format!("{reason}{}", advice(reason)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: docs/command-line.md: exit code 4; a disk that fills while a content is written has the advice of one that is full before.
    #[test]
    fn disks_that_fill_have_advice() {
        let reason = io::Error::from(io::ErrorKind::StorageFull);
        for error in [write_error(&reason), file_error("cannot write", Path::new("a"), &reason)] {
            assert!(error.exit_code() == 4 && error.to_string().contains("free some space"), "{error}");
        }
    }
}
