//! Cache of condensed flexibilities on disk. With a cached flexibility, a later run of the same body needs no
//! factorisation to condense the body.
//!
//! An entry is one list of [`crate::linalg::cache`]: residual of the solution, peak memory of a factorisation in bytes,
//! and the lower triangle of the flexibility row by row, `[n (n + 1) / 2]`.

use crate::error::Result;
use crate::linalg::cache::CacheKeyBuilder;
pub use crate::linalg::cache::{Cache as FlexibilityCache, CacheKey, CacheLookup};
use crate::linalg::dense::SymmetricDense;
use crate::linalg::sparse::SymmetricSparse;

/// Version of the entries. Increase it whenever the layout or the arithmetic changes.
const FORMAT: u64 = 4;
const HEADER_VALUES: usize = 2;
const FILE_EXTENSION: &str = "flexibility";

/// Cached flexibility of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct FlexibilityEntry {
    /// (K^-1)_cc of the free contact dofs, `[n, n]`, mm/N.
    pub flexibility: SymmetricDense,
    /// Relative residual of the check of the factorisation, or largest relative residual of the iterative solutions.
    pub residual: f64,
    /// Peak memory of a factorisation, bytes.
    pub factorisation_bytes: usize,
}

impl CacheKey {
    /// Key of the flexibility of the rows `contact` of `stiffness`, computed by `method`.
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
    /// Peak memory of a factorisation, bytes; `None` if the cache has no entry for `n` rows. Reads only the size and the header of
    /// the entry.
    pub fn peek_factorisation_bytes(&self, key: &CacheKey, n: usize) -> Option<usize> {
        let (found, [_, bytes]) = self.peek_list::<HEADER_VALUES>(key, FILE_EXTENSION)?;
        (found == n_values(n) as u64).then_some(bytes as usize)
    }

    /// Reads the entry of a flexibility of `n` rows, and marks the entry as used.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn read(&self, key: &CacheKey, n: usize) -> Result<CacheLookup<FlexibilityEntry>> {
        let values = match self.read_list(key, FILE_EXTENSION)? {
            CacheLookup::Hit(values) => values,
            CacheLookup::Miss => return Ok(CacheLookup::Miss),
            CacheLookup::Damaged(how) => return Ok(CacheLookup::Damaged(how)),
        };
        if values.len() != n_values(n) {
            return Ok(CacheLookup::Damaged("its size is wrong".to_owned()));
        }
        let mut flexibility = SymmetricDense::zeros(n)?;
        let entries = flexibility.values_mut();
        let mut triangle = values[HEADER_VALUES..].iter();
        for i in 0..n {
            for (j, &value) in triangle.by_ref().take(i + 1).enumerate() {
                entries[i * n + j] = value;
                entries[j * n + i] = value;
            }
        }
        Ok(CacheLookup::Hit(FlexibilityEntry {
            flexibility,
            residual: values[0],
            factorisation_bytes: values[1] as usize,
        }))
    }

    /// Writes an entry and removes old entries beyond the size limit. An entry larger than the limit is not written.
    ///
    /// # Errors
    /// If the directory cannot be made or written.
    pub fn write(&self, key: &CacheKey, entry: &FlexibilityEntry) -> Result<()> {
        let n = entry.flexibility.n();
        let head: [f64; HEADER_VALUES] = [entry.residual, entry.factorisation_bytes as f64];
        let triangle = (0..n).flat_map(|i| entry.flexibility.row(i)[..=i].iter().copied());
        self.write_values(key, FILE_EXTENSION, n_values(n), head.into_iter().chain(triangle))
    }
}

fn n_values(n: usize) -> usize {
    HEADER_VALUES + n * (n + 1) / 2
}

#[cfg(test)]
mod tests {
    use std::fs::{self, File};
    use std::time::{Duration, SystemTime};

    use super::*;
    use crate::linalg::cache::list_bytes;
    use crate::linalg::sparse::SymmetricTriplets;

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
        FlexibilityEntry { flexibility, residual: 1e-15, factorisation_bytes: 77 }
    }

    /// Truth: the cache returns written entries to the last bit. Other contact rows have another key. An entry read with a wrong
    /// number of rows is reported as damaged.
    #[test]
    fn entries_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let cache = FlexibilityCache::new(folder.path().join("made/by/it"), 1 << 20);
        assert_eq!(cache.read(&key(0), 7).unwrap(), CacheLookup::Miss);
        cache.write(&key(0), &entry(7)).unwrap();
        assert_eq!(cache.read(&key(0), 7).unwrap(), CacheLookup::Hit(entry(7)));
        assert_eq!(
            (cache.peek_factorisation_bytes(&key(0), 7), cache.peek_factorisation_bytes(&key(1), 7)),
            (Some(77), None)
        );
        assert!(key(0) != key(1) && cache.read(&key(1), 7).unwrap() == CacheLookup::Miss);
        assert!(matches!(cache.read(&key(0), 6).unwrap(), CacheLookup::Damaged(_)));
        assert_eq!(cache.peek_factorisation_bytes(&key(0), 6), None);
    }

    /// Truth: the least recently used entry is removed first. An entry larger than the limit is not stored, and stale unfinished
    /// files are removed.
    #[test]
    fn the_limit_holds() {
        let folder = tempfile::tempdir().unwrap();
        let cache = FlexibilityCache::new(folder.path(), 2 * list_bytes(n_values(9) as u64) + 10);
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

    /// Truth: concurrent writes of the same entry leave one complete entry.
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
