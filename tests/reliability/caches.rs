//! Damaged cache files: with changed bytes, truncated, extended, and with invalid numbers and a matching checksum.
//! Names after "Truth" are cases of docs/verification.md.

use std::fs;
use std::path::PathBuf;

use orthowear::fem::{CacheKey, CacheLookup, FlexibilityCache, FlexibilityEntry};
use orthowear::linalg::dense::SymmetricDense;
use orthowear::linalg::sparse::SymmetricTriplets;
use sha2::{Digest, Sha256};

use crate::harness::{Reader, put};

/// Number of rows of the flexibility.
const N: usize = 5;
const CHECKSUM: usize = 32;

struct Place {
    _folder: tempfile::TempDir,
    cache: FlexibilityCache,
    key: CacheKey,
    entry: FlexibilityEntry,
    list: Vec<f64>,
    paths: [PathBuf; 2],
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let cache = FlexibilityCache::new(folder.path(), 1 << 20);
        let mut triplets = SymmetricTriplets::new(1);
        triplets.add(0, 0, 1.0);
        let key = CacheKey::new(&triplets.build(), &[0], "method");
        let mut flexibility = SymmetricDense::zeros(N).expect("memory");
        for i in 0..N * N {
            flexibility.values_mut()[i] = 1.0 / (1.0 + (i / N + i % N) as f64);
        }
        let entry = FlexibilityEntry { flexibility, residual: 1e-15, factorisation_bytes: 77 };
        let triangle = (0..N).flat_map(|i| entry.flexibility.row(i)[..=i].to_vec());
        let list: Vec<f64> = [1e-15, 77.0].into_iter().chain(triangle).collect();
        cache.write(&key, &entry).expect("a file");
        cache.write_list(&key, "list", &list).expect("a file");
        let path = |ending: &str| {
            let files =
                fs::read_dir(folder.path()).expect("a folder").map(|file| file.expect("a file").path());
            files.into_iter().find(|path| path.extension().is_some_and(|is| is == ending)).expect("a file")
        };
        let paths = ["list", "flexibility"].map(path);
        Self { cache, key, entry, list, paths, _folder: folder }
    }

    /// Replaces both files by `bytes`, and returns the outcomes of reading them. Unless `sealed` (the checksum
    /// matches), values that are read must be the original values.
    fn examine(&self, bytes: &[u8], sealed: bool) -> String {
        self.paths.iter().for_each(|path| put(path, bytes));
        let _found =
            (self.cache.has_list(&self.key, "list"), self.cache.peek_factorisation_bytes(&self.key, N));
        let list = self.cache.read_list(&self.key, "list").expect("memory");
        let entry = self.cache.read(&self.key, N).expect("memory");
        if !sealed {
            assert!(
                !matches!(&list, CacheLookup::Hit(values) if *values != self.list),
                "a list that was not written"
            );
            assert!(
                !matches!(&entry, CacheLookup::Hit(found) if *found != self.entry),
                "an entry that was not written"
            );
        }
        let text = |how: &str, hit: bool| format!("{how} {hit};");
        let list = match list {
            CacheLookup::Damaged(how) => text(&how, false),
            found => text("", found != CacheLookup::Miss),
        };
        let entry = match entry {
            CacheLookup::Damaged(how) => text(&how, false),
            found => text("", found != CacheLookup::Miss),
        };
        list + &entry
    }
}

/// Truth (docs/command-line.md: a damaged cache file is computed again): each changed byte, each truncation and each
/// extension is detected.
#[test]
fn every_damage_of_cached_files_is_found() {
    let place = Place::new();
    let files = place.paths.each_ref().map(|path| fs::read(path).expect("a file"));
    for whole in &files {
        assert!(place.examine(whole, false).contains("true"));
        let flipped =
            (0..whole.len()).flat_map(|at| [1, 0x80, 0xff].map(|bits| (at, bits))).map(|(at, bits)| {
                let mut bytes = whole.clone();
                bytes[at] ^= bits;
                bytes
            });
        let cut = (0..whole.len()).map(|length| whole[..length].to_vec());
        let longer = [1, 8, 512].map(|more| [whole.clone(), vec![0; more]].concat());
        for bytes in flipped.chain(cut).chain(longer) {
            let found = place.examine(&bytes, false);
            assert!(!found.contains("true"), "{found}");
        }
    }
}

/// Truth (rel-no-panics): arbitrary files are refused or read, also with a matching checksum. The sizes in their
/// headers cause no large allocations.
#[test]
fn cached_files() {
    let place = Place::new();
    let seeds: Vec<Vec<u8>> = place.paths.iter().map(|path| fs::read(path).expect("a file")).collect();
    let words = vec!["ORTHOLST".to_owned()];
    let cases = 4000;
    Reader { name: "cache", read: "", seeds: seeds.clone(), words: words.clone(), cases }
        .check(|bytes| place.examine(bytes, false));
    let seeds = seeds.iter().map(|seed| seed[..seed.len() - CHECKSUM].to_vec()).collect();
    Reader { name: "cache-sealed", read: "", seeds, words, cases }.check(|bytes| {
        let sealed = [bytes, Sha256::digest(bytes).as_slice()].concat();
        place.examine(&sealed, true)
    });
}
