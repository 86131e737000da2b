//! Factors kept beside the flexibilities of the cache: fields of a second run need no factorisation either.
//!
//! ```text
//! 8 bytes "ORTHOFCT", u64 format, u64 n, f64 [n] stored values of L, 32 bytes SHA-256 of all before; little-endian
//! ```
//!
//! The structure of L is not kept: the analysis finds it again in a few per cent of the time.

use std::fs::{self, File};
use std::io::{self, BufWriter, Read, Write};
use std::path::Path;
use std::time::SystemTime;

use sha2::{Digest, Sha256};

use super::cache::{CacheKey, FORMAT, FlexibilityCache};
use crate::error::Result;
use crate::linalg::dense::zeroed;

const MAGIC: &[u8; 8] = b"ORTHOFCT";
const HEAD: usize = 24;
const CHECKSUM: usize = 32;
/// Values converted at a time.
const CHUNK: usize = 1 << 13;
/// Names of kept factors end so.
pub(super) const ENDING: &str = "factor";

fn file_bytes(n: usize) -> u64 {
    (HEAD + CHECKSUM) as u64 + 8 * n as u64
}

impl FlexibilityCache {
    /// Whether there is a whole factor under a key, judged by head and size.
    pub(super) fn expects_factor(&self, key: &CacheKey) -> bool {
        let values = || -> Option<usize> {
            let mut file = File::open(self.path(key, ENDING)).ok()?;
            let n = read_head(&mut file).ok()??;
            (file.metadata().ok()?.len() == file_bytes(n)).then_some(n)
        };
        values().is_some()
    }

    /// The `n` stored values of the factor under a key; `None` if there is no such file, or it is damaged.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub(super) fn read_factor(&self, key: &CacheKey, n: usize) -> Result<Option<Vec<f64>>> {
        let Ok(mut file) = File::open(self.path(key, ENDING)) else { return Ok(None) };
        if file.metadata().map_or(0, |found| found.len()) != file_bytes(n) {
            return Ok(None);
        }
        let mut values = zeroed(n)?;
        let whole = read_values(&mut file, &mut values).unwrap_or(false);
        // Only the order of removal depends on it.
        let _ = file.set_modified(SystemTime::now());
        Ok(whole.then_some(values))
    }

    /// Keeps the stored values of a factor, unless they take more than half of the cache.
    ///
    /// # Errors
    /// If the directory cannot be made or written.
    pub(super) fn write_factor(&self, key: &CacheKey, values: &[f64]) -> Result<()> {
        if file_bytes(values.len()) > self.limit_bytes() / 2 {
            return Ok(());
        }
        self.put(key, ENDING, |path| write_values(path, values))
    }
}

/// The number of values; `None` if it is no head of a factor.
fn read_head(file: &mut File) -> io::Result<Option<usize>> {
    let mut head = [0; HEAD];
    file.read_exact(&mut head)?;
    let number = |i: usize| u64::from_le_bytes(head[8 * i..8 * i + 8].try_into().expect("eight bytes"));
    Ok((head[..8] == *MAGIC && number(1) == FORMAT).then_some(number(2) as usize))
}

/// Whether head and checksum fit.
fn read_values(file: &mut File, values: &mut [f64]) -> io::Result<bool> {
    if read_head(file)? != Some(values.len()) {
        return Ok(false);
    }
    let mut hash = Sha256::new();
    hash.update(head(values.len()));
    let mut bytes = vec![0; 8 * CHUNK];
    for chunk in values.chunks_mut(CHUNK) {
        let bytes = &mut bytes[..8 * chunk.len()];
        file.read_exact(bytes)?;
        hash.update(&*bytes);
        for (value, bytes) in chunk.iter_mut().zip(bytes.chunks_exact(8)) {
            *value = f64::from_le_bytes(bytes.try_into().expect("eight bytes"));
        }
    }
    let mut checksum = [0; CHECKSUM];
    file.read_exact(&mut checksum)?;
    Ok(hash.finalize()[..] == checksum)
}

fn head(n: usize) -> Vec<u8> {
    [&MAGIC[..], &FORMAT.to_le_bytes(), &(n as u64).to_le_bytes()].concat()
}

fn write_values(path: &Path, values: &[f64]) -> io::Result<()> {
    let mut file = BufWriter::new(fs::File::create_new(path)?);
    let mut hash = Sha256::new();
    let mut put = |bytes: &[u8]| {
        hash.update(bytes);
        file.write_all(bytes)
    };
    put(&head(values.len()))?;
    for chunk in values.chunks(CHUNK) {
        put(&chunk.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>())?;
    }
    let checksum = hash.finalize();
    file.write_all(&checksum)?;
    file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::sparse::SymmetricTriplets;

    /// Truth: what was written is read, to the last bit; what is damaged, of another size or too large is not.
    #[test]
    fn factors_come_back_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let cache = FlexibilityCache::new(folder.path(), 1 << 20);
        let mut triplets = SymmetricTriplets::new(1);
        triplets.add(0, 0, 1.0);
        let key = CacheKey::new(&triplets.build(), &[0], "method");
        let values: Vec<f64> = (0..20_000).map(|i| 1.0 / (1.0 + f64::from(i))).collect();
        assert!(!cache.expects_factor(&key) && cache.read_factor(&key, 20_000).unwrap().is_none());
        cache.write_factor(&key, &values).unwrap();
        assert!(cache.expects_factor(&key));
        assert_eq!(cache.read_factor(&key, 20_000).unwrap(), Some(values.clone()));
        assert_eq!(cache.read_factor(&key, 19_999).unwrap(), None);
        let path = folder.path().read_dir().unwrap().next().unwrap().unwrap().path();
        let mut bytes = fs::read(&path).unwrap();
        bytes[100_000] ^= 1;
        fs::write(&path, &bytes).unwrap();
        assert_eq!(cache.read_factor(&key, 20_000).unwrap(), None);
        let small = FlexibilityCache::new(folder.path().join("small"), 300_000);
        small.write_factor(&key, &values).unwrap();
        assert!(!small.expects_factor(&key));
    }
}
