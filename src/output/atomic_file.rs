//! Atomic file writes and checksums.

use std::fs::{self, File};
use std::io::{self, BufWriter, Read, Write};
use std::path::Path;

use sha2::{Digest, Sha256};

use crate::error::{Error, Result};

const BLOCK: usize = 1 << 16;

/// Writer that counts and hashes the bytes written.
pub struct HashingWriter<W> {
    inner: W,
    hash: Sha256,
    bytes: u64,
}

impl<W: Write> HashingWriter<W> {
    /// Creates a writer into `inner`.
    pub fn new(inner: W) -> Self {
        Self { inner, hash: Sha256::new(), bytes: 0 }
    }

    /// Returns the inner writer, the number of bytes written and their SHA-256.
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

/// Formats a hash as hexadecimal digits.
pub fn hexadecimal(hash: &[u8]) -> String {
    hash.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// SHA-256 of the content of a file, hexadecimal.
///
/// # Errors
/// If the file cannot be read.
pub fn sha256_of(path: &Path) -> io::Result<String> {
    let (mut file, mut hash, mut block) = (File::open(path)?, Sha256::new(), vec![0; BLOCK]);
    loop {
        match file.read(&mut block)? {
            0 => return Ok(hexadecimal(&hash.finalize())),
            read => hash.update(&block[..read]),
        }
    }
}

/// Writes `bytes` to `path` atomically: a reader sees either the previous content or all of `bytes`.
///
/// # Errors
/// If the file cannot be written (kind `Resources`). The previous content of `path` then stays unchanged.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    write_atomically_with(path, |file| file.write_all(bytes))
}

/// As [`write_atomically`], with content from `fill`.
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

/// Prefix of the temporary files of [`write_atomically_with`].
pub(super) fn temporary_prefix(path: &Path) -> String {
    format!(".{}.", path.file_name().and_then(|name| name.to_str()).unwrap_or("file"))
}

/// Flushes the entries of a folder to the disk, if the operating system supports this.
pub(super) fn sync_folder(folder: Option<&Path>) {
    let _ = folder.map(|folder| File::open(folder).and_then(|folder| folder.sync_all()));
}

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

pub(crate) fn file_error(what: &str, path: &Path, reason: &io::Error) -> Error {
    Error::resources(format!("{what} {}: {reason}{}", path.display(), advice(reason)))
}

pub(crate) fn write_error(reason: &io::Error) -> Error {
    Error::resources(format!("{reason}{}", advice(reason)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth (docs/command-line.md): the exit code for a full disk is 4. The errors of `write_error` and `file_error`
    /// advise to free some space.
    #[test]
    fn disks_that_fill_have_advice() {
        let reason = io::Error::from(io::ErrorKind::StorageFull);
        for error in [write_error(&reason), file_error("cannot write", Path::new("a"), &reason)] {
            assert!(error.exit_code() == 4 && error.to_string().contains("free some space"), "{error}");
        }
    }
}
