//! Head of every table: date, machine and versions.

use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

/// Date, machine and versions as comment lines of a CSV file.
pub fn comment() -> String {
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    format!(
        "# date: {}\n# machine: {}, {cores} cores, {:.0} GiB\n# versions: orthowear {}, {}\n",
        today(),
        first_value("/proc/cpuinfo", "model name").unwrap_or_else(|| "unknown".to_owned()),
        memory_gib(),
        env!("CARGO_PKG_VERSION"),
        first_line("rustc", "--version"),
    )
}

/// Value of the first line `key : value` of a system file.
fn first_value(path: &str, key: &str) -> Option<String> {
    let text = std::fs::read_to_string(path).ok()?;
    let line = text.lines().find(|line| line.starts_with(key))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

fn memory_gib() -> f64 {
    let kib = first_value("/proc/meminfo", "MemTotal").and_then(|v| v.split(' ').next()?.parse::<f64>().ok());
    kib.unwrap_or(0.0) / (1 << 20) as f64
}

fn first_line(program: &str, argument: &str) -> String {
    let output = Command::new(program).arg(argument).output().map(|output| output.stdout).unwrap_or_default();
    String::from_utf8_lossy(&output).lines().next().unwrap_or("unknown").to_owned()
}

/// Current date as year-month-day (UTC), computed from the days since 1970-01-01.
fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let (mut year, mut day) = (1970, seconds / 86400);
    let leap = |y: u64| y.is_multiple_of(4) && (!y.is_multiple_of(100) || y.is_multiple_of(400));
    while day >= 365 + u64::from(leap(year)) {
        day -= 365 + u64::from(leap(year));
        year += 1;
    }
    let mut month = 1;
    let lengths = [31, 28 + u64::from(leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    for length in lengths {
        if day < length {
            break;
        }
        day -= length;
        month += 1;
    }
    format!("{year}-{month:02}-{:02}", day + 1)
}
