//! Refusal of work that would not fit into the memory, before anything is allocated for it.

use std::cell::Cell;

use super::cgroup;
use crate::error::{Error, Result};

/// Memory that a run may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryLimit {
    /// All of it; `None` where nothing is known of the machine.
    bytes: Option<u64>,
    /// The part of it that is spoken for.
    held: u64,
    given: bool,
}

impl MemoryLimit {
    /// A limit that the user gave.
    pub fn given(bytes: u64) -> Self {
        Self { bytes: Some(bytes), held: 0, given: true }
    }

    /// What can be had now without swapping and within the limits of the process and its control groups (Linux; elsewhere
    /// nothing is refused).
    pub fn of_machine() -> Self {
        let of_group = cgroup::free(std::path::Path::new("/sys/fs/cgroup"));
        let bytes = [free_of_machine(), free_of_process(), of_group].into_iter().flatten().min();
        Self { bytes, held: 0, given: false }
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
        let raise = if self.given { ", or raise solver.memory_limit" } else { "" };
        Err(Error::resources(format!("{what} needs {} of memory, {self}; {mend}{raise}", exactly(bytes))))
    }
}

impl std::fmt::Display for MemoryLimit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Some(remaining) = self.remaining() else { return f.write_str("available is less") };
        let of = if self.given { "allowed by solver.memory_limit" } else { "available" };
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
    MemoryLimit::of_machine().ensure(bytes, what, mend)
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
