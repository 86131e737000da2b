//! Refusal of work that would not fit into the memory, before anything is allocated for it.

use std::cell::Cell;

use super::cgroup;
use crate::error::{Error, Result};

/// Percent of what is available that a run may take where nobody says otherwise: the rest is for what is not foreseen, and for others.
pub const SHARE: f64 = 80.0;

/// Memory that a run may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MemoryLimit {
    /// All of it; `None` where nothing is known of the machine.
    bytes: Option<u64>,
    /// The part of it that is spoken for.
    held: u64,
    origin: Origin,
}

/// Who set a limit.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Origin {
    /// `--max-memory` with a size, or with percent of what is available.
    Option(Option<f64>),
    /// `solver.memory_limit`.
    Key,
    /// Nobody: [`SHARE`] of what is available.
    Share,
    /// The machine: all that is available.
    Machine,
}

impl MemoryLimit {
    /// A limit that the scene gives.
    pub fn given(bytes: u64) -> Self {
        Self { bytes: Some(bytes), held: 0, origin: Origin::Key }
    }

    /// A limit that the command line gives.
    pub fn of_option(bytes: u64) -> Self {
        Self { bytes: Some(bytes), held: 0, origin: Origin::Option(None) }
    }

    /// `percent` of what is available, as the command line gives it.
    pub fn share_of_option(percent: f64) -> Self {
        Self { bytes: share(percent), held: 0, origin: Origin::Option(Some(percent)) }
    }

    /// Four fifths of what can be had now without swapping and within the limits of the process and its control groups (Linux; elsewhere
    /// nothing is refused).
    pub fn of_machine() -> Self {
        Self { bytes: share(SHARE), held: 0, origin: Origin::Share }
    }

    /// What remains of it when `bytes` are held by something else.
    pub fn less(self, bytes: usize) -> Self {
        Self { held: self.held.saturating_add(bytes as u64), ..self }
    }

    /// Whether `bytes` fit into what remains.
    pub fn allows(&self, bytes: u128) -> bool {
        let fits = self.remaining().is_none_or(|remaining| bytes <= remaining.into());
        fits && bytes <= isize::MAX as u128
    }

    /// Bytes that remain; `None` where nothing is known of the machine.
    pub fn remaining(&self) -> Option<u64> {
        self.bytes.map(|bytes| bytes.saturating_sub(self.held))
    }

    /// Checks that `bytes` fit for `what`; `mend` says what the user can change.
    ///
    /// # Errors
    /// If they do not (kind `Resources`).
    pub fn ensure(&self, bytes: u128, what: &str, mend: &str) -> Result<()> {
        if self.allows(bytes) {
            return Ok(());
        }
        let raise = self.raise();
        Err(Error::resources(format!("{what} needs {} of memory, {self}; {mend}{raise}", exactly(bytes))))
    }

    /// What raises the limit.
    fn raise(&self) -> &'static str {
        match self.origin {
            Origin::Option(Some(percent)) if percent >= 100.0 => "",
            Origin::Option(_) => ", or raise --max-memory",
            Origin::Key => ", or raise solver.memory_limit (or give --max-memory, which wins over it)",
            Origin::Share => ", or allow more with --max-memory or solver.memory_limit",
            Origin::Machine => "",
        }
    }

    /// What the limit is called.
    fn name(&self) -> String {
        match self.origin {
            Origin::Option(None) => "allowed by --max-memory".to_owned(),
            Origin::Option(Some(percent)) => {
                format!("allowed by --max-memory ({percent} % of what is available)")
            }
            Origin::Key => "allowed by solver.memory_limit".to_owned(),
            Origin::Share => format!("{SHARE} % of what is available"),
            Origin::Machine => "available".to_owned(),
        }
    }

    /// The limit in words, like "80 % of what is available is 12.0 GiB"; `None` where nothing is known of the machine.
    pub fn words(&self) -> Option<String> {
        self.bytes.map(|bytes| format!("{} is {}", self.name(), readable(bytes.into())))
    }

    /// Whether it is a size that somebody gave, and more than can be had.
    pub fn is_beyond_machine(&self) -> bool {
        let is_size = matches!(self.origin, Origin::Option(None) | Origin::Key);
        is_size && self.bytes.zip(available()).is_some_and(|(bytes, available)| bytes > available)
    }

    /// Whether the command line gives it.
    pub fn is_of_option(&self) -> bool {
        matches!(self.origin, Origin::Option(_))
    }
}

impl std::fmt::Display for MemoryLimit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Some(remaining) = self.remaining() else { return f.write_str("available is less") };
        let of = self.name();
        let held = readable(self.held.into());
        match (remaining, self.held) {
            (_, 0) => write!(f, "{of} is {}", exactly(remaining.into())),
            (0, _) => {
                let all = exactly(self.bytes.unwrap_or(0).into());
                write!(f, "{of} is {all}, which the rest of the scene ({held}) takes up already")
            }
            _ => {
                write!(f, "{of} is {} beside the {held} of the rest of the scene", exactly(remaining.into()))
            }
        }
    }
}

/// As [`MemoryLimit::ensure`], by what the machine has now.
///
/// # Errors
/// If the system reports less memory available (Linux; elsewhere nothing is checked).
pub fn ensure(bytes: u128, what: &str, mend: &str) -> Result<()> {
    MemoryLimit { bytes: available(), held: 0, origin: Origin::Machine }.ensure(bytes, what, mend)
}

/// What can be had now without swapping and within the limits of the process and its control groups, bytes; `None` where that is not
/// known.
fn available() -> Option<u64> {
    let of_group = cgroup::free(std::path::Path::new("/sys/fs/cgroup"));
    [free_of_machine(), free_of_process(), of_group].into_iter().flatten().min()
}

/// `percent` of it.
fn share(percent: f64) -> Option<u64> {
    available().map(|bytes| (bytes as f64 * percent / 100.0) as u64)
}

/// Memory that can be had without swapping, bytes.
fn free_of_machine() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("MemAvailable:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kibibytes| kibibytes * 1024)
}

/// Addresses that the limit of the process (`ulimit -v`) leaves it; `None` without one.
fn free_of_process() -> Option<u64> {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: the place is that of a limit.
    let done = unsafe { libc::getrlimit(libc::RLIMIT_AS, &raw mut limit) } == 0;
    if !done || limit.rlim_cur == libc::RLIM_INFINITY {
        return None;
    }
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmSize:"))?;
    let held = line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024;
    Some(limit.rlim_cur.saturating_sub(held))
}

thread_local! {
    static MAY_FAIL: Cell<bool> = const { Cell::new(false) };
}

/// Does `work`, which asks for memory and has an answer where there is none.
pub(crate) fn may_fail<T>(work: impl FnOnce() -> T) -> T {
    let before = MAY_FAIL.replace(true);
    let done = work();
    MAY_FAIL.set(before);
    done
}

/// Whether this thread has an answer where there is no memory.
pub(crate) fn has_answer() -> bool {
    MAY_FAIL.try_with(Cell::get).unwrap_or(false)
}

/// Bytes in a unit that suits their number.
pub fn readable(bytes: u128) -> String {
    let mebibytes = bytes as f64 / (1u64 << 20) as f64;
    match bytes {
        1 => "1 byte".to_owned(),
        0..1024 => format!("{bytes} bytes"),
        1024..104_858 => format!("{:.1} KiB", mebibytes * 1024.0),
        _ if mebibytes < 1024.0 => format!("{mebibytes:.1} MiB"),
        _ => format!("{:.1} GiB", mebibytes / 1024.0),
    }
}

/// The same with the bytes themselves.
fn exactly(bytes: u128) -> String {
    if bytes < 1024 { readable(bytes) } else { format!("{} ({bytes} bytes)", readable(bytes)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Kind;

    /// Truth: docs/DESIGN.md: the message has the bytes needed, those there are, and what can be changed.
    #[test]
    fn refusals_have_the_numbers() {
        let limit = MemoryLimit::given(3 << 20).less(1 << 20);
        assert!(limit.allows(2 << 20) && !limit.allows((2 << 20) + 1));
        let error = limit.ensure(5 << 20, "the factor", "take a coarser mesh").unwrap_err();
        assert_eq!(error.kind(), Kind::Resources);
        for words in [
            "5.0 MiB (5242880 bytes)",
            "2.0 MiB (2097152 bytes)",
            "the 1.0 MiB of",
            "coarser",
            "memory_limit",
        ] {
            assert!(error.message().contains(words), "{error}");
        }
    }

    /// Truth: docs/command-line.md: the message names the limit that was exceeded and what raises it; all of what is available cannot be raised.
    #[test]
    fn refusals_name_the_limit() {
        let told = |limit: MemoryLimit| {
            limit.less(1).ensure(1 << 62, "a body", "take less").unwrap_err().message().to_owned()
        };
        let cases: [(MemoryLimit, &[&str]); 3] = [
            (
                MemoryLimit::of_option(1 << 30),
                &["allowed by --max-memory is 1024.0 MiB", "or raise --max-memory"],
            ),
            (
                MemoryLimit::given(1 << 30),
                &["allowed by solver.memory_limit is", "or raise solver.memory_limit"],
            ),
            (
                MemoryLimit { bytes: Some(1 << 30), held: 0, origin: Origin::Share },
                &["80 % of what is available is", "or allow more with --max-memory or solver.memory_limit"],
            ),
        ];
        for (limit, words) in cases {
            let text = told(limit);
            assert!(words.iter().all(|word| text.contains(word)), "{text}");
        }
        let of_share =
            |percent| MemoryLimit { bytes: Some(1 << 30), held: 0, origin: Origin::Option(Some(percent)) };
        let text = told(of_share(12.5));
        assert!(
            text.contains("--max-memory (12.5 % of what is available)")
                && text.contains("raise --max-memory")
        );
        assert!(told(of_share(100.0)).ends_with("take less"), "{}", told(of_share(100.0)));
    }

    /// Truth: docs/command-line.md: 80 % by default, any other share by the option; the machine has the same memory within a fifth in one moment and the next.
    #[test]
    fn shares_of_what_is_available() {
        let (Some(all), Some(most)) = (available(), MemoryLimit::of_machine().remaining()) else { return };
        let half = MemoryLimit::share_of_option(50.0).remaining().unwrap();
        let near = |is: u64, wanted: f64| (is as f64 / wanted - 1.0).abs() < 0.2;
        assert!(near(most, 0.8 * all as f64) && near(half, 0.5 * all as f64), "{all} {most} {half}");
    }

    /// Truth: English, and that nothing is left where more is held than allowed.
    #[test]
    fn small_limits_are_told_in_words() {
        let error = MemoryLimit::given(1).ensure(3 << 20, "a", "b").unwrap_err().to_string();
        assert!(error.contains("allowed by solver.memory_limit is 1 byte;"), "{error}");
        let error = MemoryLimit::given(1 << 20).less(30 << 20).ensure(1, "a", "b").unwrap_err().to_string();
        assert!(error.contains("needs 1 byte of memory") && !error.contains("0 bytes beside"), "{error}");
        assert!(error.contains("which the rest of the scene (30.0 MiB) takes up already"), "{error}");
        assert_eq!(readable(50 << 10), "50.0 KiB");
    }

    /// Truth: no machine has 2^62 bytes, every one that runs this has one.
    #[test]
    fn the_machine_has_some() {
        assert!(ensure(1, "a byte", "").is_ok());
        if std::path::Path::new("/proc/meminfo").exists() {
            assert!(ensure(1 << 62, "all of it", "").is_err());
        }
    }
}
