//! Condensed flexibilities kept on disk: a second run of the same body skips its factorisation.
//!
//! An entry is a file named by the SHA-256 of all that determines its content:
//!
//! ```text
//! 8 bytes "ORTHOFLX", u64 format, u64 n, f64 residual of the solution, f64 seconds that it took,
//! u64 bytes that a factorisation takes,
//! f64 [n (n + 1) / 2] lower triangle row by row, 32 bytes SHA-256 of all before; little-endian
//! ```
//!
//! Besides them a cache holds the factors of bodies, and what else runs keep in [`crate::linalg::cache`].

use std::fs::File;
use std::io::{self, BufWriter, Read, Write};
use std::path::Path;
use std::time::SystemTime;

use sha2::{Digest, Sha256};

use crate::error::Result;
use crate::linalg::cache::CacheKeyBuilder;
pub use crate::linalg::cache::{Cache as FlexibilityCache, CacheKey};
use crate::linalg::dense::SymmetricDense;
use crate::linalg::sparse::SymmetricSparse;

const MAGIC: &[u8; 8] = b"ORTHOFLX";
/// Raised whenever layout or arithmetic change.
const FORMAT: u64 = 2;
const HEAD: usize = 48;
const CHECKSUM: usize = 32;
/// Names of entries end so.
const FILE_EXTENSION: &str = "flexibility";

/// What an entry holds.
#[derive(Debug, Clone, PartialEq)]
pub struct FlexibilityEntry {
    /// (K^-1)_cc of the free contact dofs, `[n, n]`, mm/N.
    pub flexibility: SymmetricDense,
    /// Relative residual of the check of factorisation or solutions.
    pub residual: f64,
    /// Seconds that it took.
    pub computing_seconds: f64,
    /// Bytes that a factorisation takes.
    pub factorisation_bytes: usize,
}

/// What the cache has under a key.
#[derive(Debug, Clone, PartialEq)]
pub enum CacheLookup {
    /// The entry.
    Hit(Box<FlexibilityEntry>),
    /// Nothing.
    Miss,
    /// A file that is not a whole entry, and what is wrong with it.
    Damaged(String),
}

impl CacheKey {
    /// The key of the flexibility of the rows `contact` of `stiffness` by `method`: of the matrix, the rows in their
    /// order, the method, the version of the program, and the instructions that its dense kernels choose among.
    pub fn new(stiffness: &SymmetricSparse, contact: &[usize], method: &str) -> Self {
        let mut hash = CacheKeyBuilder::new(&format!("format {FORMAT} {method}"));
        let (offsets, rows, values) = stiffness.lower();
        for list in [&[stiffness.n(), contact.len()], contact, offsets, rows] {
            hash.update(list, |&i| (i as u64).to_le_bytes());
        }
        hash.update(values, |v| v.to_le_bytes());
        hash.finish()
    }
}

impl FlexibilityCache {
    /// The bytes that a factorisation takes by the entry of a flexibility of `n` rows, of which size and head alone are
    /// read; `None` if there is none.
    pub fn peek_factorisation_bytes(&self, key: &CacheKey, n: usize) -> Option<usize> {
        let mut file = File::open(self.path(key, FILE_EXTENSION)).ok()?;
        let mut head = [0; HEAD];
        file.read_exact(&mut head).ok()?;
        (file.metadata().ok()?.len() == file_bytes(n)).then(|| u64::from_le_bytes(word(&head, 5)) as usize)
    }

    /// Reads the entry of a flexibility of `n` rows, and marks it as used.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn read(&self, key: &CacheKey, n: usize) -> Result<CacheLookup> {
        let path = self.path(key, FILE_EXTENSION);
        let Ok(mut file) = File::open(&path) else { return Ok(CacheLookup::Miss) };
        if file.metadata().map_or(0, |found| found.len()) != file_bytes(n) {
            return Ok(CacheLookup::Damaged("its size is wrong".to_owned()));
        }
        let mut flexibility = SymmetricDense::zeros(n)?;
        match read_entry(&mut file, &mut flexibility) {
            Ok(Some(head)) => {
                // Only the order of removal depends on it.
                let _ = file.set_modified(SystemTime::now());
                let [residual, computing_seconds] = [3, 4].map(|i| f64::from_le_bytes(word(&head, i)));
                let factorisation_bytes = u64::from_le_bytes(word(&head, 5)) as usize;
                Ok(CacheLookup::Hit(Box::new(FlexibilityEntry {
                    flexibility,
                    residual,
                    computing_seconds,
                    factorisation_bytes,
                })))
            }
            Ok(None) => Ok(CacheLookup::Damaged("its checksum is wrong".to_owned())),
            Err(error) => Ok(CacheLookup::Damaged(error.to_string())),
        }
    }

    /// Writes an entry, and removes others beyond the limit. One that is larger than the limit is not written.
    ///
    /// # Errors
    /// If the directory cannot be made or written.
    pub fn write(&self, key: &CacheKey, entry: &FlexibilityEntry) -> Result<()> {
        if file_bytes(entry.flexibility.n()) > self.limit_bytes() {
            return Ok(());
        }
        self.write_atomically(key, FILE_EXTENSION, |path| write_entry(path, entry))
    }
}

fn file_bytes(n: usize) -> u64 {
    (HEAD + CHECKSUM) as u64 + 4 * (n as u64) * (n as u64 + 1)
}

/// Word `i` of a head.
fn word(head: &[u8; HEAD], i: usize) -> [u8; 8] {
    head[8 * i..8 * i + 8].try_into().expect("eight bytes")
}

/// The head; `None` if it or the checksum do not fit.
fn read_entry(file: &mut File, flexibility: &mut SymmetricDense) -> io::Result<Option<[u8; HEAD]>> {
    let n = flexibility.n();
    let mut hash = Sha256::new();
    let mut head = [0; HEAD];
    file.read_exact(&mut head)?;
    hash.update(head);
    let number = |i| u64::from_le_bytes(word(&head, i));
    if word(&head, 0) != *MAGIC || number(1) != FORMAT || number(2) != n as u64 {
        return Ok(None);
    }
    let mut bytes = vec![0; 8 * n];
    for i in 0..n {
        let row = &mut bytes[..8 * (i + 1)];
        file.read_exact(row)?;
        hash.update(&*row);
        for (j, value) in row.chunks_exact(8).enumerate() {
            let value = f64::from_le_bytes(value.try_into().expect("eight bytes"));
            flexibility.values_mut()[i * n + j] = value;
            flexibility.values_mut()[j * n + i] = value;
        }
    }
    let mut checksum = [0; CHECKSUM];
    file.read_exact(&mut checksum)?;
    let whole = hash.finalize()[..] == checksum;
    Ok(whole.then_some(head))
}

fn write_entry(path: &Path, entry: &FlexibilityEntry) -> io::Result<()> {
    let n = entry.flexibility.n();
    let mut file = BufWriter::new(File::create_new(path)?);
    let mut hash = Sha256::new();
    let mut put = |bytes: &[u8]| {
        hash.update(bytes);
        file.write_all(bytes)
    };
    put(MAGIC)?;
    put(&FORMAT.to_le_bytes())?;
    put(&(n as u64).to_le_bytes())?;
    put(&entry.residual.to_le_bytes())?;
    put(&entry.computing_seconds.to_le_bytes())?;
    put(&(entry.factorisation_bytes as u64).to_le_bytes())?;
    for i in 0..n {
        put(&entry.flexibility.row(i)[..=i].iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())?;
    }
    let checksum = hash.finalize();
    file.write_all(&checksum)?;
    file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::time::Duration;

    use super::*;
    use crate::linalg::sparse::SymmetricTriplets;

    /// Unfinished files of this age have no writer any more.
    const STALE: Duration = Duration::from_secs(86_400);

    fn key(number: usize) -> CacheKey {
        let mut triplets = SymmetricTriplets::new(3);
        (0..3).for_each(|i| triplets.add(i, i, 1.0));
        CacheKey::new(&triplets.build(), &[number], "method")
    }

    fn entry(n: usize) -> FlexibilityEntry {
        let mut flexibility = SymmetricDense::zeros(n).unwrap();
        for i in 0..n * n {
            flexibility.values_mut()[i] = 1.0 / (1.0 + (i / n + i % n) as f64);
        }
        FlexibilityEntry { flexibility, residual: 1e-15, computing_seconds: 2.5, factorisation_bytes: 77 }
    }

    /// Truth: what was written is read, to the last bit; another matrix or other rows have another key.
    #[test]
    fn entries_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let cache = FlexibilityCache::new(folder.path().join("made/by/it"), 1 << 20);
        assert_eq!(cache.read(&key(0), 7).unwrap(), CacheLookup::Miss);
        cache.write(&key(0), &entry(7)).unwrap();
        assert_eq!(cache.read(&key(0), 7).unwrap(), CacheLookup::Hit(Box::new(entry(7))));
        assert_eq!(
            (cache.peek_factorisation_bytes(&key(0), 7), cache.peek_factorisation_bytes(&key(1), 7)),
            (Some(77), None)
        );
        assert!(key(0) != key(1) && cache.read(&key(1), 7).unwrap() == CacheLookup::Miss);
    }

    /// Truth: any changed bit and any missing end is found; a new write mends it.
    #[test]
    fn damage_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let cache = FlexibilityCache::new(folder.path(), 1 << 20);
        cache.write(&key(0), &entry(5)).unwrap();
        let path = cache.path(&key(0), FILE_EXTENSION);
        let whole = fs::read(&path).unwrap();
        for place in [0, 8, 16, 30, 39, 40, 100, whole.len() - 1] {
            let mut bytes = whole.clone();
            bytes[place] ^= 1;
            fs::write(&path, bytes).unwrap();
            assert!(matches!(cache.read(&key(0), 5).unwrap(), CacheLookup::Damaged(_)), "byte {place}");
        }
        for length in [0, 39, whole.len() - 1] {
            fs::write(&path, &whole[..length]).unwrap();
            assert!(matches!(cache.read(&key(0), 5).unwrap(), CacheLookup::Damaged(_)), "{length} bytes");
        }
        cache.write(&key(0), &entry(5)).unwrap();
        assert!(matches!(cache.read(&key(0), 5).unwrap(), CacheLookup::Hit(_)));
    }

    /// Truth: the entry used longest ago goes first; one larger than the limit is not kept, nor are stale leftovers.
    #[test]
    fn the_limit_holds() {
        let folder = tempfile::tempdir().unwrap();
        let cache = FlexibilityCache::new(folder.path(), 2 * file_bytes(9) + 10);
        let old = SystemTime::now() - 2 * STALE;
        let leftover = folder.path().join("x.1-0.unfinished");
        File::create(&leftover).unwrap().set_modified(old).unwrap();
        for number in 0..2 {
            cache.write(&key(number), &entry(9)).unwrap();
            File::options()
                .append(true)
                .open(cache.path(&key(number), FILE_EXTENSION))
                .unwrap()
                .set_modified(old)
                .unwrap();
        }
        assert!(matches!(cache.read(&key(0), 9).unwrap(), CacheLookup::Hit(_)), "used again");
        cache.write(&key(2), &entry(9)).unwrap();
        assert_eq!(
            [0, 1, 2].map(|number| cache.peek_factorisation_bytes(&key(number), 9).is_some()),
            [true, false, true]
        );
        cache.write(&key(3), &entry(90)).unwrap();
        assert!(cache.peek_factorisation_bytes(&key(3), 90).is_none() && !leftover.exists());
    }

    /// Truth: runs that write the same entry at the same time leave one whole entry.
    #[test]
    fn writers_do_not_disturb_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let cache = FlexibilityCache::new(folder.path(), 1 << 20);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| (0..10).for_each(|_| cache.write(&key(0), &entry(20)).unwrap()));
            }
        });
        assert!(matches!(cache.read(&key(0), 20).unwrap(), CacheLookup::Hit(_)));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
