//! Cache directory with files that later runs reuse. The name of a file is the SHA-256 hash of all data that determine
//! its content.
//!
//! A file is written under a temporary name, flushed to disk and renamed. A reader therefore finds either a complete
//! file or no file. A list of numbers has the format
//!
//! ```text
//! 8 bytes "ORTHOLST", u64 format, u64 n, f64 [n], 32 bytes SHA-256 of all before; little-endian
//! ```

use std::fs::{self, File};
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use sha2::{Digest, Sha256};

use super::dense::try_zeroed;
use crate::error::{Error, Result};

const MAGIC: &[u8; 8] = b"ORTHOLST";
/// Version of the file format. Increase it whenever the layout changes.
const FORMAT: u64 = 1;
const HEADER_BYTES: usize = 24;
const CHECKSUM_BYTES: usize = 32;
const VALUES_PER_CHUNK: usize = 1 << 13;
/// Age above which temporary files are removed. Runs that were killed leave such files.
const UNFINISHED_FILE_LIFETIME: Duration = Duration::from_secs(86_400);
const DEFAULT_LIMIT_MIB: u64 = 2048;

/// Cache directory and the limit of its total size in bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cache {
    directory: PathBuf,
    limit_bytes: u64,
}

/// File name without extension: the SHA-256 hash of all data that determine the content, in hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CacheKey(String);

/// Hash of the data that determine the content of a file.
pub(crate) struct CacheKeyBuilder(Sha256);

/// Result of a lookup in the cache.
#[derive(Debug, Clone, PartialEq)]
pub enum CacheLookup<T> {
    /// The stored entry.
    Hit(T),
    /// No entry exists.
    Miss,
    /// The file is incomplete or corrupt; the text names the defect.
    Damaged(String),
}

impl CacheKeyBuilder {
    /// Starts the hash with the kind of content (`kind`), the program version and the instruction set. The rounding of
    /// results depends on the instruction set.
    pub(crate) fn new(kind: &str) -> Self {
        let version = env!("CARGO_PKG_VERSION");
        Self(Sha256::new_with_prefix(format!("orthowear {version} {kind} {}", instruction_set())))
    }

    /// Adds a list of numbers to the hash.
    pub(crate) fn update<T>(&mut self, list: &[T], bytes: impl Fn(&T) -> [u8; 8]) {
        for chunk in list.chunks(VALUES_PER_CHUNK) {
            self.0.update(chunk.iter().flat_map(&bytes).collect::<Vec<u8>>());
        }
    }

    /// Returns the key of all added data.
    pub(crate) fn finish(self) -> CacheKey {
        CacheKey(self.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
    }
}

/// Name of the instruction set that numerical libraries use on this processor.
fn instruction_set() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        if std::arch::is_x86_feature_detected!("avx512f") {
            return "avx512";
        }
        if std::arch::is_x86_feature_detected!("fma") {
            return "fma";
        }
    }
    std::env::consts::ARCH
}

impl Cache {
    /// Cache in `directory`. The first write creates the directory.
    ///
    /// A write removes the least recently used files until the total size is at most `limit_bytes`.
    pub fn new(directory: impl Into<PathBuf>, limit_bytes: u64) -> Self {
        Self { directory: directory.into(), limit_bytes }
    }

    /// Cache of the user in `$XDG_CACHE_HOME/orthowear` or `~/.cache/orthowear`.
    ///
    /// The limit is `$ORTHOWEAR_CACHE_LIMIT` MiB, by default 2048. `None` if neither `$XDG_CACHE_HOME` nor `$HOME` is an absolute
    /// path, or if the limit is 0.
    ///
    /// # Errors
    /// If the limit is not a whole number.
    pub fn of_environment() -> Result<Option<Self>> {
        let mebibytes = match std::env::var("ORTHOWEAR_CACHE_LIMIT") {
            Err(_) => DEFAULT_LIMIT_MIB,
            Ok(text) => text.trim().parse().map_err(|_| {
                Error::input(format!(
                    "the environment variable ORTHOWEAR_CACHE_LIMIT is \"{text}\", but it must be a whole number of MiB (0 for no cache)"
                ))
            })?,
        };
        // The XDG specification requires that relative paths are ignored.
        let absolute =
            |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
        let base = absolute("XDG_CACHE_HOME").or_else(|| absolute("HOME").map(|home| home.join(".cache")));
        let directory = base.map(|base| base.join("orthowear")).filter(|_| mebibytes > 0);
        Ok(directory.map(|directory| Self::new(directory, mebibytes.saturating_mul(1 << 20))))
    }

    /// Path of the file for a key and a file extension.
    pub(crate) fn path(&self, key: &CacheKey, ending: &str) -> PathBuf {
        self.directory.join(format!("{}.{ending}", key.0))
    }

    /// Limit of the total size of all files, bytes.
    pub(crate) fn limit_bytes(&self) -> u64 {
        self.limit_bytes
    }

    /// Whether a list exists under a key. Only the header and the file size are checked.
    pub fn has_list(&self, key: &CacheKey, ending: &str) -> bool {
        self.peek_list::<0>(key, ending).is_some()
    }

    /// Number of values of the list under a key, and its first `K` values.
    ///
    /// `None` if no list exists, or if header and file size do not match. The checksum is not verified.
    pub fn peek_list<const K: usize>(&self, key: &CacheKey, ending: &str) -> Option<(u64, [f64; K])> {
        let mut file = File::open(self.path(key, ending)).ok()?;
        let n = read_head(&mut file).ok()??;
        if file.metadata().ok()?.len() != list_bytes(n) {
            return None;
        }
        let mut first = [0.0; K];
        for value in &mut first {
            let mut bytes = [0; 8];
            file.read_exact(&mut bytes).ok()?;
            *value = f64::from_le_bytes(bytes);
        }
        Some((n, first))
    }

    /// Reads the list under a key, verifies its checksum and marks the file as used.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn read_list(&self, key: &CacheKey, ending: &str) -> Result<CacheLookup<Vec<f64>>> {
        let Ok(mut file) = File::open(self.path(key, ending)) else { return Ok(CacheLookup::Miss) };
        let n = match read_head(&mut file) {
            Ok(Some(n)) => n,
            Ok(None) => return Ok(CacheLookup::Damaged("its header is wrong".to_owned())),
            Err(error) => return Ok(CacheLookup::Damaged(error.to_string())),
        };
        if file.metadata().map_or(0, |found| found.len()) != list_bytes(n) {
            return Ok(CacheLookup::Damaged("its size is wrong".to_owned()));
        }
        let mut values = try_zeroed(n as usize)?;
        Ok(match read_values(&mut file, &mut values) {
            Ok(true) => {
                // A failure to set the time only changes the order in which files are removed.
                let _ = file.set_modified(SystemTime::now());
                CacheLookup::Hit(values)
            }
            Ok(false) => CacheLookup::Damaged("its checksum is wrong".to_owned()),
            Err(error) => CacheLookup::Damaged(error.to_string()),
        })
    }

    /// Writes a list, unless it is larger than the limit of the cache.
    ///
    /// # Errors
    /// If the directory cannot be created, read or written.
    pub fn write_list(&self, key: &CacheKey, ending: &str, values: &[f64]) -> Result<()> {
        self.write_values(key, ending, values.len(), values.iter().copied())
    }

    /// Writes a list of `n` values from an iterator, as [`Self::write_list`] does.
    ///
    /// # Errors
    /// If the directory cannot be created, read or written.
    pub(crate) fn write_values(
        &self,
        key: &CacheKey,
        ending: &str,
        n: usize,
        values: impl Iterator<Item = f64>,
    ) -> Result<()> {
        if list_bytes(n as u64) > self.limit_bytes {
            return Ok(());
        }
        self.write_atomically(key, ending, |path| write_values(path, n, values))
    }

    fn write_atomically(
        &self,
        key: &CacheKey,
        ending: &str,
        write: impl FnOnce(&Path) -> io::Result<()>,
    ) -> Result<()> {
        let failed = |error: io::Error| {
            Error::resources(format!("the cache {} cannot be written: {error}", self.directory.display()))
        };
        fs::create_dir_all(&self.directory).map_err(failed)?;
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let unfinished = self.directory.join(format!("{}.{}-{count}.unfinished", key.0, std::process::id()));
        let written = write(&unfinished).and_then(|()| fs::rename(&unfinished, self.path(key, ending)));
        if let Err(error) = written {
            let _ = fs::remove_file(&unfinished);
            return Err(failed(error));
        }
        self.remove_oldest().map_err(failed)
    }

    /// Removes temporary files older than a day. Then removes the least recently used lists while the total size
    /// exceeds the limit.
    fn remove_oldest(&self) -> io::Result<()> {
        let mut entries = Vec::new();
        for item in fs::read_dir(&self.directory)? {
            let path = item?.path();
            // Another run may have removed the file in the meantime.
            let Ok(found) = fs::metadata(&path) else { continue };
            let used = found.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            if path.extension().is_some_and(|ending| ending == "unfinished") {
                if used.elapsed().is_ok_and(|age| age > UNFINISHED_FILE_LIFETIME) {
                    let _ = fs::remove_file(&path);
                }
            } else if is_named_by_key(&path) {
                entries.push((used, found.len(), path));
            }
        }
        entries.sort();
        let mut total: u64 = entries.iter().map(|(_, bytes, _)| bytes).sum();
        for (_, bytes, path) in entries {
            if total <= self.limit_bytes {
                break;
            }
            let _ = fs::remove_file(&path);
            total -= bytes;
        }
        Ok(())
    }
}

/// Whether the file name without extension is a cache key. Other files are kept, except old temporary files.
fn is_named_by_key(path: &Path) -> bool {
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    stem.len() == 64 && stem.bytes().all(|byte| byte.is_ascii_hexdigit())
}

/// File size of a list of `n` values, bytes. The arithmetic saturates, so that a corrupt `n` in the header matches no
/// file size.
pub(crate) fn list_bytes(n: u64) -> u64 {
    n.saturating_mul(8).saturating_add((HEADER_BYTES + CHECKSUM_BYTES) as u64)
}

fn head(n: usize) -> Vec<u8> {
    [&MAGIC[..], &FORMAT.to_le_bytes(), &(n as u64).to_le_bytes()].concat()
}

/// Number of values according to the header. `None` if the file does not start with the header of a list in the current
/// format.
fn read_head(file: &mut File) -> io::Result<Option<u64>> {
    let mut head = [0; HEADER_BYTES];
    file.read_exact(&mut head)?;
    let number = |i: usize| u64::from_le_bytes(head[8 * i..8 * i + 8].try_into().expect("eight bytes"));
    Ok((head[..8] == *MAGIC && number(1) == FORMAT).then_some(number(2)))
}

/// Reads the values. Returns whether the checksum matches.
fn read_values(file: &mut File, values: &mut [f64]) -> io::Result<bool> {
    let mut hash = Sha256::new_with_prefix(head(values.len()));
    let mut bytes = vec![0; 8 * VALUES_PER_CHUNK];
    for chunk in values.chunks_mut(VALUES_PER_CHUNK) {
        let bytes = &mut bytes[..8 * chunk.len()];
        file.read_exact(bytes)?;
        hash.update(&*bytes);
        for (value, bytes) in chunk.iter_mut().zip(bytes.chunks_exact(8)) {
            *value = f64::from_le_bytes(bytes.try_into().expect("eight bytes"));
        }
    }
    let mut checksum = [0; CHECKSUM_BYTES];
    file.read_exact(&mut checksum)?;
    Ok(hash.finalize()[..] == checksum)
}

fn write_values(path: &Path, n: usize, mut values: impl Iterator<Item = f64>) -> io::Result<()> {
    let mut file = BufWriter::new(File::create_new(path)?);
    let mut hash = Sha256::new();
    let mut put = |bytes: &[u8]| {
        hash.update(bytes);
        file.write_all(bytes)
    };
    put(&head(n))?;
    for start in (0..n).step_by(VALUES_PER_CHUNK) {
        let chunk = values.by_ref().take(VALUES_PER_CHUNK.min(n - start));
        put(&chunk.flat_map(f64::to_le_bytes).collect::<Vec<u8>>())?;
    }
    let checksum = hash.finalize();
    file.write_all(&checksum)?;
    file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(number: u64) -> CacheKey {
        let mut hash = CacheKeyBuilder::new("numbers");
        hash.update(&[number], |number| number.to_le_bytes());
        hash.finish()
    }

    /// Truth: a list that is written is read back to the last bit, and a different key has no entry. A changed bit or a
    /// truncated file is detected. A new write replaces the damaged file.
    #[test]
    fn lists_come_back_whole_or_damaged() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path().join("made/by/it"), 1 << 20);
        let values: Vec<f64> = (0..10_000).map(|i| 1.0 / (1.0 + f64::from(i))).collect();
        assert_eq!(cache.read_list(&key(0), "list").unwrap(), CacheLookup::Miss);
        cache.write_list(&key(0), "list", &values).unwrap();
        assert_eq!(cache.read_list(&key(0), "list").unwrap(), CacheLookup::Hit(values.clone()));
        assert_eq!(cache.read_list(&key(1), "list").unwrap(), CacheLookup::Miss);
        let path = cache.path(&key(0), "list");
        let whole = fs::read(&path).unwrap();
        for place in [0, 8, 16, 23, 24, 70_000, whole.len() - 1] {
            let mut bytes = whole.clone();
            bytes[place] ^= 1;
            fs::write(&path, bytes).unwrap();
            assert!(
                matches!(cache.read_list(&key(0), "list").unwrap(), CacheLookup::Damaged(_)),
                "byte {place}"
            );
        }
        for length in [0, 23, whole.len() - 1] {
            fs::write(&path, &whole[..length]).unwrap();
            assert!(
                matches!(cache.read_list(&key(0), "list").unwrap(), CacheLookup::Damaged(_)),
                "{length} bytes"
            );
        }
        cache.write_list(&key(0), "list", &values).unwrap();
        assert_eq!(cache.read_list(&key(0), "list").unwrap(), CacheLookup::Hit(values));
    }

    /// Truth: lists count towards the limit, and the least recently used list is removed first. A file whose name is
    /// not a cache key is kept. A list larger than the limit is not written.
    #[test]
    fn lists_keep_the_limit() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path(), 2 * list_bytes(100) + 10);
        let other = folder.path().join("notes.list");
        fs::write(&other, vec![0; 5000]).unwrap();
        for number in 0..3 {
            cache.write_list(&key(number), "list", &[1.5; 100]).unwrap();
            let file = File::options().append(true).open(cache.path(&key(number), "list")).unwrap();
            file.set_modified(
                SystemTime::now() - UNFINISHED_FILE_LIFETIME.mul_f64(1.0 / (1.0 + number as f64)),
            )
            .unwrap();
        }
        let found = [0, 1, 2].map(|number| cache.path(&key(number), "list").exists());
        assert!(found == [false, true, true] && other.exists());
        cache.write_list(&key(4), "list", &[1.5; 300]).unwrap();
        assert!(!cache.path(&key(4), "list").exists());
    }
}
