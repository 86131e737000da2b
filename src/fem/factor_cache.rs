//! Cache of factors on disk. With a cached factor, the recovery of fields needs no factorisation.
//!
//! An entry is the list of the stored values of L. The structure of L is not stored: the symbolic analysis recomputes it in a few
//! per cent of the time of a factorisation.

use super::flexibility_cache::{CacheKey, FlexibilityCache};
use crate::error::Result;
use crate::linalg::cache::{CacheLookup, list_bytes};

pub(super) const FILE_EXTENSION: &str = "factor";

impl FlexibilityCache {
    /// Whether a complete factor exists for a key, judged by the header and the size of the file.
    pub(super) fn has_factor(&self, key: &CacheKey) -> bool {
        self.has_list(key, FILE_EXTENSION)
    }

    /// Reads the `n` stored values of the factor of a key. `None` if the file does not exist, is damaged or has another size.
    pub(super) fn read_factor(&self, key: &CacheKey, n: usize) -> Result<Option<Vec<f64>>> {
        Ok(match self.read_list(key, FILE_EXTENSION)? {
            CacheLookup::Hit(values) => Some(values).filter(|values| values.len() == n),
            CacheLookup::Miss | CacheLookup::Damaged(_) => None,
        })
    }

    /// Writes the stored values of a factor, unless they exceed half of the cache limit.
    pub(super) fn write_factor(&self, key: &CacheKey, values: &[f64]) -> Result<()> {
        if list_bytes(values.len() as u64) > self.limit_bytes() / 2 {
            return Ok(());
        }
        self.write_list(key, FILE_EXTENSION, values)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::linalg::sparse::SymmetricTriplets;

    /// Truth: the cache returns written values to the last bit, but no damaged entry and no entry of another size. The cache stores
    /// no factor larger than half of its limit.
    #[test]
    fn factors_come_back_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let cache = FlexibilityCache::new(folder.path(), 1 << 20);
        let mut triplets = SymmetricTriplets::new(1);
        triplets.add(0, 0, 1.0);
        let key = CacheKey::new(&triplets.build(), &[0], "method");
        let values: Vec<f64> = (0..20_000).map(|i| 1.0 / (1.0 + f64::from(i))).collect();
        assert!(!cache.has_factor(&key) && cache.read_factor(&key, 20_000).unwrap().is_none());
        cache.write_factor(&key, &values).unwrap();
        assert!(cache.has_factor(&key));
        assert_eq!(cache.read_factor(&key, 20_000).unwrap(), Some(values.clone()));
        assert_eq!(cache.read_factor(&key, 19_999).unwrap(), None);
        let path = folder.path().read_dir().unwrap().next().unwrap().unwrap().path();
        let mut bytes = fs::read(&path).unwrap();
        bytes[100_000] ^= 1;
        fs::write(&path, &bytes).unwrap();
        assert_eq!(cache.read_factor(&key, 20_000).unwrap(), None);
        // A file in an older format counts as damaged and is overwritten.
        bytes[..8].copy_from_slice(b"ORTHOFCT");
        fs::write(&path, &bytes).unwrap();
        assert!(!cache.has_factor(&key) && cache.read_factor(&key, 20_000).unwrap().is_none());
        cache.write_factor(&key, &values).unwrap();
        assert_eq!(cache.read_factor(&key, 20_000).unwrap(), Some(values.clone()));
        let small = FlexibilityCache::new(folder.path().join("small"), 300_000);
        small.write_factor(&key, &values).unwrap();
        assert!(!small.has_factor(&key));
    }
}
