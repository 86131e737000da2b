//! Tests a reader with many inputs, and reports the inputs that fail.

use std::any::Any;
use std::collections::{BTreeMap, HashSet};
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::meter::measured;
use crate::mutate::{Random, mutate};

/// Stack size, bytes. The threads of the program have the same stack size.
const STACK: usize = 8 << 20;
/// Maximum number of inputs that are kept for further mutation.
const POOL: usize = 600;
/// Limit of processor time for an input, s (docs/verification.md: rel-no-panics).
const SECONDS: f64 = 10.0;
/// Memory limit for an input of n bytes: BYTES + TIMES * n bytes.
const BYTES: u64 = 64 << 20;
const TIMES: u64 = 400;

pub struct Reader<'a> {
    /// Name of the reader. The folder `corpus/NAME` contains inputs that failed once.
    pub name: &'a str,
    pub seeds: Vec<Vec<u8>>,
    pub words: Vec<String>,
    /// Prefix of the outcome by which accepted inputs are recognised.
    pub read: &'a str,
    /// Number of mutated inputs, unless `ORTHOWEAR_FUZZ_SECONDS` sets a time.
    pub cases: u64,
}

impl Reader<'_> {
    /// Calls `examine` for all inputs. `examine` returns a short description of the outcome, and panics if the outcome
    /// is wrong.
    pub fn check(self, examine: impl FnMut(&[u8]) -> String + Send) {
        std::thread::scope(|scope| {
            let work = std::thread::Builder::new().stack_size(STACK).name(self.name.to_owned());
            let ended = work.spawn_scoped(scope, || self.feed(examine)).expect("a thread").join();
            if let Err(panic) = ended {
                std::panic::resume_unwind(panic);
            }
        });
    }

    fn feed(&self, mut examine: impl FnMut(&[u8]) -> String) {
        let mut failed: BTreeMap<String, PathBuf> = BTreeMap::new();
        let mut one = |input: &[u8], number: u64| {
            self.note(input);
            let (ended, bytes, seconds) = measured(|| catch_unwind(AssertUnwindSafe(|| examine(input))));
            let wrong = match ended {
                Err(panic) => said(&*panic),
                Ok(_) if seconds > SECONDS => format!("{seconds} s"),
                Ok(_) if bytes > BYTES + TIMES * input.len() as u64 => format!("{bytes} bytes"),
                Ok(outcome) => return Some(outcome),
            };
            failed.entry(plain(&wrong)).or_insert_with(|| self.keep(input, number, &wrong));
            None
        };
        let mut pool = self.seeds.clone();
        for (number, input) in self.seeds.iter().enumerate() {
            let outcome = one(input, number as u64);
            let is_read = outcome.as_ref().is_none_or(|outcome| outcome.starts_with(self.read));
            assert!(is_read, "{}: the seed {number} is refused: {outcome:?}", self.name);
        }
        for (number, input) in corpus(self.name).iter().enumerate() {
            one(input, number as u64);
        }
        let mut known = HashSet::new();
        let started = Instant::now();
        let limit = setting("ORTHOWEAR_FUZZ_SECONDS").map(Duration::from_secs);
        let begin = setting("ORTHOWEAR_FUZZ_SEED").unwrap_or(1) << 32;
        let goes_on = |number| limit.map_or(number < self.cases, |limit| started.elapsed() < limit);
        let mut number = 0;
        while goes_on(number) {
            let mut random = Random::new(begin + number);
            let input = mutate(&pool, &self.words, &mut random);
            // An input with a new outcome is added to the pool of inputs that are mutated.
            if let Some(outcome) = one(&input, begin + number)
                && known.insert(plain(&outcome))
                && pool.len() < POOL
            {
                pool.push(input);
            }
            number += 1;
        }
        println!("{}: {number} inputs, {} ways to end", self.name, known.len());
        assert!(failed.is_empty(), "{}: {failed:#?}", self.name);
    }

    /// Writes the input to a file, so that it is known if the process dies.
    fn note(&self, input: &[u8]) {
        put(&place(&format!("{}-last", self.name)), input);
    }

    fn keep(&self, input: &[u8], number: u64, wrong: &str) -> PathBuf {
        let path = place(&format!("{}-{number}", self.name));
        fs::write(&path, input).expect("a file");
        eprintln!("{}, {}: {wrong}", self.name, path.display());
        path
    }
}

/// Writes a file after removing it. Some file systems flush a file that is overwritten, which would take most of the
/// time.
pub fn put(path: &Path, bytes: &[u8]) {
    let _absent = fs::remove_file(path);
    fs::write(path, bytes).expect("a file");
}

fn place(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// Inputs that failed once, sorted by name.
fn corpus(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reliability/corpus").join(name);
    let mut paths: Vec<PathBuf> =
        fs::read_dir(folder).into_iter().flatten().map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    paths.iter().map(|path| fs::read(path).expect("a file")).collect()
}

fn setting(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name} is \"{text}\", not a whole number")))
}

fn said(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message").to_owned()
}

/// Removes numbers and quoted texts from a message, because they belong to the input.
fn plain(text: &str) -> String {
    let mut quoted = false;
    let mut short = String::new();
    for c in text.chars().take(400) {
        if "\"`'".contains(c) {
            quoted = !quoted;
        } else if !quoted {
            let c = if c.is_ascii_digit() { '#' } else { c };
            if !(c == '#' && short.ends_with('#')) {
                short.push(c);
            }
        }
    }
    short
}

/// First number that is not finite in a debug text, with its surroundings: `NaN` or, with `infinite`, `inf`. Quoted
/// texts are ignored.
pub fn not_finite(debug: &str, infinite: bool) -> Option<String> {
    let mut outside = String::with_capacity(debug.len());
    let (mut quoted, mut escaped) = (false, false);
    for c in debug.chars() {
        match (c, quoted, escaped) {
            ('"', _, false) => quoted = !quoted,
            (_, false, _) => outside.push(c),
            _ => {}
        }
        escaped = quoted && c == '\\' && !escaped;
    }
    let is_bad = |word: &str| word == "NaN" || (infinite && word == "inf");
    let words = outside.match_indices(['N', 'i']).map(|(at, _)| at);
    let mut words = words.filter(|&at| !outside[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_'));
    let found = words.find(|&at| {
        let end = outside[at..]
            .find(|c: char| !(c.is_alphanumeric() || c == '_'))
            .map_or(outside.len(), |n| at + n);
        is_bad(&outside[at..end])
    })?;
    let start = outside[..found].char_indices().rev().nth(80).map_or(0, |(at, _)| at);
    Some(outside[start..].chars().take(100).collect())
}

/// Truth: "NaN" and "inf" in quoted texts and in longer names are no numbers.
#[test]
fn numbers_that_are_none_are_found() {
    assert_eq!(not_finite(r#"A { t: "NaN \" inf", NaNo: 1, infinite: 2.0 }"#, true), None);
    assert!(not_finite("A { x: NaN }", true).is_some() && not_finite("[1.0, -inf]", true).is_some());
    assert_eq!(not_finite("[1.0, -inf]", false), None);
}
