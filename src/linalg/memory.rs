//! Memory limits of a run. The program checks them before it allocates large arrays.

use std::cell::Cell;

use super::cgroup;
use crate::error::{Error, Result};

/// Default memory limit of a run, percent of the available memory. The rest is a reserve for other programs and for
/// memory that estimates omit.
pub const DEFAULT_SHARE_PERCENT: f64 = 80.0;

/// Memory limit of a run, and the part of it that is already reserved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MemoryLimit {
    /// Total limit, bytes; `None` if the available memory is unknown.
    bytes: Option<u64>,
    reserved: u64,
    source: LimitSource,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum LimitSource {
    /// `--max-memory`: a percentage of the available memory, or `None` if the limit is a number of bytes.
    CommandLine(Option<f64>),
    Scene,
    /// [`DEFAULT_SHARE_PERCENT`] of the available memory.
    DefaultShare,
    /// All available memory.
    Machine,
}

impl MemoryLimit {
    /// Limit from the scene (`solver.memory_limit`), bytes.
    pub fn of_scene(bytes: u64) -> Self {
        Self { bytes: Some(bytes), reserved: 0, source: LimitSource::Scene }
    }

    /// Limit from the command line (`--max-memory`), bytes.
    pub fn of_command_line(bytes: u64) -> Self {
        Self { bytes: Some(bytes), reserved: 0, source: LimitSource::CommandLine(None) }
    }

    /// Limit from the command line (`--max-memory`) as a percentage of the available memory.
    pub fn of_command_line_percent(percent: f64) -> Self {
        Self {
            bytes: share_of_available(percent),
            reserved: 0,
            source: LimitSource::CommandLine(Some(percent)),
        }
    }

    /// Default limit: [`DEFAULT_SHARE_PERCENT`] of the available memory.
    ///
    /// On Linux, available memory is the memory that the system can provide without swapping, within the limits of the
    /// process and its control groups. On other systems, the available memory is unknown and there is no limit.
    pub fn of_machine() -> Self {
        Self {
            bytes: share_of_available(DEFAULT_SHARE_PERCENT),
            reserved: 0,
            source: LimitSource::DefaultShare,
        }
    }

    /// Limit after `bytes` more are reserved.
    pub fn after_reserving(self, bytes: usize) -> Self {
        Self { reserved: self.reserved.saturating_add(bytes as u64), ..self }
    }

    /// Whether `bytes` fit into the remaining memory. If the remaining memory is unknown, up to `isize::MAX` bytes fit.
    pub fn allows(&self, bytes: u128) -> bool {
        let fits = self.remaining().is_none_or(|remaining| bytes <= remaining.into());
        fits && bytes <= isize::MAX as u128
    }

    /// Remaining bytes of the limit; `None` if the available memory is unknown.
    pub fn remaining(&self) -> Option<u64> {
        self.bytes.map(|bytes| bytes.saturating_sub(self.reserved))
    }

    /// Checks that `bytes` for `what` fit into the remaining memory. `mend` is the advice to the user in the error
    /// message.
    ///
    /// # Errors
    /// If `bytes` do not fit (kind `Resources`).
    pub fn ensure_available(&self, bytes: u128, what: &str, mend: &str) -> Result<()> {
        if self.allows(bytes) {
            return Ok(());
        }
        let raise = self.how_to_raise(bytes + u128::from(self.reserved));
        Err(Error::resources(format!(
            "{what} needs {} of memory, but {self}; {mend}{raise}",
            format_bytes_exactly(bytes)
        )))
    }

    /// Advice to raise the limit so that `total` bytes fit. Empty if a higher limit cannot help.
    fn how_to_raise(&self, total: u128) -> String {
        if share_of_available(100.0).is_some_and(|available| total > available.into()) {
            return String::new();
        }
        let least = format!(
            "to at least \"{} MiB\" (rounded up; later parts of the run may need more)",
            total.div_ceil(1 << 20)
        );
        match self.source {
            LimitSource::CommandLine(Some(percent)) if percent >= 100.0 => String::new(),
            LimitSource::CommandLine(_) => format!(", or raise --max-memory {least}"),
            LimitSource::Scene => {
                format!(", or raise solver.memory_limit (or --max-memory, which overrides it) {least}")
            }
            LimitSource::DefaultShare => {
                format!(", or raise the limit by --max-memory or solver.memory_limit {least}")
            }
            LimitSource::Machine => String::new(),
        }
    }

    fn name(&self) -> String {
        match self.source {
            LimitSource::CommandLine(None) => "the limit of --max-memory".to_owned(),
            LimitSource::CommandLine(Some(percent)) => {
                format!("the limit of --max-memory ({percent} % of the available memory)")
            }
            LimitSource::Scene => "the limit of solver.memory_limit".to_owned(),
            LimitSource::DefaultShare => format!("{DEFAULT_SHARE_PERCENT} % of the available memory"),
            LimitSource::Machine => "the available memory".to_owned(),
        }
    }

    /// Description of the limit, for example "80 % of the available memory is 12.0 GiB". `None` if the available memory is unknown.
    pub fn description(&self) -> Option<String> {
        self.bytes.map(|bytes| format!("{} is {}", self.name(), format_bytes(bytes.into())))
    }

    /// Whether the user set the limit as a size, and this size exceeds the available memory.
    pub fn exceeds_available(&self) -> bool {
        let is_size = matches!(self.source, LimitSource::CommandLine(None) | LimitSource::Scene);
        is_size && self.bytes.zip(available()).is_some_and(|(bytes, available)| bytes > available)
    }

    /// Whether the limit comes from the command line.
    pub fn is_of_command_line(&self) -> bool {
        matches!(self.source, LimitSource::CommandLine(_))
    }
}

impl std::fmt::Display for MemoryLimit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Some(remaining) = self.remaining() else { return f.write_str("less memory is available") };
        let of = self.name();
        let held = format_bytes(self.reserved.into());
        match (remaining, self.reserved) {
            (_, 0) => write!(f, "{of} is {}", format_bytes_exactly(remaining.into())),
            (0, _) => {
                let all = format_bytes_exactly(self.bytes.unwrap_or(0).into());
                write!(f, "{of} is {all}, and the rest of the scene ({held}) already takes all of it")
            }
            _ => {
                write!(
                    f,
                    "{of} is {} after subtracting the {held} of the rest of the scene",
                    format_bytes_exactly(remaining.into())
                )
            }
        }
    }
}

/// Does the same as [`MemoryLimit::ensure_available`]. The limit is all memory that is available now.
///
/// # Errors
/// If `bytes` exceed the available memory (kind `Resources`). If the available memory is unknown (not Linux), only more
/// than `isize::MAX` bytes are refused.
pub fn ensure(bytes: u128, what: &str, mend: &str) -> Result<()> {
    MemoryLimit { bytes: available(), reserved: 0, source: LimitSource::Machine }
        .ensure_available(bytes, what, mend)
}

/// Available memory as in [`MemoryLimit::of_machine`], bytes; `None` if unknown.
fn available() -> Option<u64> {
    let of_group = cgroup::available_bytes(std::path::Path::new("/sys/fs/cgroup"));
    [available_in_machine(), available_in_process(), of_group].into_iter().flatten().min()
}

fn share_of_available(percent: f64) -> Option<u64> {
    available().map(|bytes| (bytes as f64 * percent / 100.0) as u64)
}

/// Available memory of the machine, bytes (`MemAvailable` of `/proc/meminfo`).
fn available_in_machine() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("MemAvailable:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kibibytes| kibibytes * 1024)
}

/// Address space that the limit of the process (`ulimit -v`) still allows, bytes; `None` without a limit.
fn available_in_process() -> Option<u64> {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: the pointer refers to a valid `rlimit`.
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
    static FAILURE_HANDLED: Cell<bool> = const { Cell::new(false) };
}

/// Runs `work`. During this time, [`allocation_failure_is_handled`] is true on this thread, because the caller handles
/// failed allocations.
pub(crate) fn handling_allocation_failure<T>(work: impl FnOnce() -> T) -> T {
    let before = FAILURE_HANDLED.replace(true);
    let done = work();
    FAILURE_HANDLED.set(before);
    done
}

/// Whether the current thread handles a failed allocation itself.
pub(crate) fn allocation_failure_is_handled() -> bool {
    FAILURE_HANDLED.try_with(Cell::get).unwrap_or(false)
}

/// Formats a number of bytes in a suitable unit.
pub fn format_bytes(bytes: u128) -> String {
    let mebibytes = bytes as f64 / (1u64 << 20) as f64;
    match bytes {
        1 => "1 byte".to_owned(),
        0..1024 => format!("{bytes} bytes"),
        1024..104_858 => format!("{:.1} KiB", mebibytes * 1024.0),
        _ if mebibytes < 1024.0 => format!("{mebibytes:.1} MiB"),
        _ => format!("{:.1} GiB", mebibytes / 1024.0),
    }
}

fn format_bytes_exactly(bytes: u128) -> String {
    if bytes < 1024 { format_bytes(bytes) } else { format!("{} ({bytes} bytes)", format_bytes(bytes)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ErrorKind;

    /// Truth: docs/DESIGN.md requires that the message contains the required bytes, the available bytes and the remedy for the
    /// user.
    #[test]
    fn refusals_have_the_numbers() {
        let limit = MemoryLimit::of_scene(3 << 20).after_reserving(1 << 20);
        assert!(limit.allows(2 << 20) && !limit.allows((2 << 20) + 1));
        let error = limit.ensure_available(5 << 20, "the factor", "take a coarser mesh").unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Resources);
        for words in [
            "5.0 MiB (5242880 bytes)",
            "2.0 MiB (2097152 bytes)",
            "the 1.0 MiB of",
            "coarser",
            "memory_limit",
            "to at least \"6 MiB\"",
        ] {
            assert!(error.message().contains(words), "{error}");
        }
    }

    /// Truth: docs/command-line.md. The message names the exceeded limit and how to raise it. The advice is omitted if
    /// the limit is 100 % of the available memory, or if the machine has too little memory.
    #[test]
    fn refusals_name_the_limit() {
        let refusal = |limit: MemoryLimit, bytes: u128| {
            limit
                .after_reserving(1)
                .ensure_available(bytes, "a body", "take less")
                .unwrap_err()
                .message()
                .to_owned()
        };
        let told = |limit: MemoryLimit| refusal(limit, 5 << 20);
        let cases: [(MemoryLimit, &[&str]); 3] = [
            (
                MemoryLimit::of_command_line(3 << 20),
                &["the limit of --max-memory is 3.0 MiB", "or raise --max-memory"],
            ),
            (
                MemoryLimit::of_scene(3 << 20),
                &["the limit of solver.memory_limit is", "or raise solver.memory_limit"],
            ),
            (
                MemoryLimit { bytes: Some(3 << 20), reserved: 0, source: LimitSource::DefaultShare },
                &[
                    "80 % of the available memory is",
                    "or raise the limit by --max-memory or solver.memory_limit to at least \"6 MiB\"",
                ],
            ),
        ];
        for (limit, words) in cases {
            let text = told(limit);
            assert!(words.iter().all(|word| text.contains(word)), "{text}");
        }
        let of_share = |percent| MemoryLimit {
            bytes: Some(3 << 20),
            reserved: 0,
            source: LimitSource::CommandLine(Some(percent)),
        };
        let text = told(of_share(12.5));
        assert!(
            text.contains("--max-memory (12.5 % of the available memory)")
                && text.contains("raise --max-memory")
        );
        assert!(told(of_share(100.0)).ends_with("take less"), "{}", told(of_share(100.0)));
        let hopeless = refusal(MemoryLimit::of_command_line(3 << 20), 1 << 62);
        assert!(available().is_none() || hopeless.ends_with("take less"), "{hopeless}");
    }

    /// Truth: docs/command-line.md. The limit is 80 % of the available memory, or the percentage that `--max-memory`
    /// gives. The tolerance is 20 %, because the available memory changes during the test.
    #[test]
    fn shares_of_what_is_available() {
        let (Some(all), Some(most)) = (available(), MemoryLimit::of_machine().remaining()) else { return };
        let half = MemoryLimit::of_command_line_percent(50.0).remaining().unwrap();
        let near = |is: u64, wanted: f64| (is as f64 / wanted - 1.0).abs() < 0.2;
        assert!(near(most, 0.8 * all as f64) && near(half, 0.5 * all as f64), "{all} {most} {half}");
    }

    /// Truth: the singular "1 byte" is correct English. If more memory is reserved than the limit allows, nothing
    /// remains.
    #[test]
    fn small_limits_are_told_in_words() {
        let error = MemoryLimit::of_scene(1).ensure_available(3 << 20, "a", "b").unwrap_err().to_string();
        assert!(error.contains("but the limit of solver.memory_limit is 1 byte;"), "{error}");
        let error = MemoryLimit::of_scene(1 << 20)
            .after_reserving(30 << 20)
            .ensure_available(1, "a", "b")
            .unwrap_err()
            .to_string();
        assert!(error.contains("needs 1 byte of memory") && !error.contains("0 bytes after"), "{error}");
        assert!(error.contains("and the rest of the scene (30.0 MiB) already takes all of it"), "{error}");
        assert_eq!(format_bytes(50 << 10), "50.0 KiB");
    }

    /// Truth: no machine has 2^62 bytes. Every machine that runs this test has one byte of available memory.
    #[test]
    fn the_machine_has_some() {
        assert!(ensure(1, "a byte", "").is_ok());
        if std::path::Path::new("/proc/meminfo").exists() {
            assert!(ensure(1 << 62, "all of it", "").is_err());
        }
    }
}
