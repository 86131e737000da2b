//! Refusal of tables that would not fit into the memory, before they are allocated.

use crate::error::{Error, Result};

/// Checks that `bytes` are free for `what`; `mend` says what the user can change.
///
/// # Errors
/// If the system reports less memory available (Linux; elsewhere nothing is checked).
pub fn ensure(bytes: u128, what: &str, mend: &str) -> Result<()> {
    let available = available();
    if available.is_some_and(|free| bytes > u128::from(free)) || bytes > isize::MAX as u128 {
        let free =
            available.map_or("less".to_owned(), |free| format!("{} ({free} bytes)", readable(free.into())));
        return Err(Error::resources(format!(
            "{what} needs {} ({bytes} bytes) of memory, available is {free}; {mend}",
            readable(bytes)
        )));
    }
    Ok(())
}

/// Memory that can be had without swapping, bytes.
fn available() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("MemAvailable:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kibibytes| kibibytes * 1024)
}

fn readable(bytes: u128) -> String {
    let gibibytes = bytes as f64 / (1u64 << 30) as f64;
    if gibibytes >= 1.0 { format!("{gibibytes:.1} GiB") } else { format!("{:.1} MiB", gibibytes * 1024.0) }
}
