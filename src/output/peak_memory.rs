//! Peak memory of the process.

/// Peak resident memory of this process in bytes; 0 if the system does not report it.
pub fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    kib_of(&status, "VmHWM:").unwrap_or(0) * 1024
}

/// Resets the peak of [`peak_bytes`] to the present memory (Linux only).
pub fn restart_peak() {
    // If the reset fails, the peak covers the whole process so far.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

fn kib_of(status: &str, key: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix(key))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: lines of /proc/self/status as in proc(5).
    #[test]
    fn reads_the_high_water_mark() {
        let status = "VmPeak:\t  900 kB\nVmHWM:\t    1234 kB\nVmRSS:\t  1000 kB\n";
        assert_eq!(kib_of(status, "VmHWM:"), Some(1234));
        assert_eq!(kib_of("VmRSS:\t 1 kB\n", "VmHWM:"), None);
    }

    #[test]
    fn peak_grows_with_the_memory_touched() {
        if !std::path::Path::new("/proc/self/status").exists() {
            return;
        }
        let block = vec![1_u8; 64 << 20];
        assert!(std::hint::black_box(&block).iter().map(|b| u64::from(*b)).sum::<u64>() == 64 << 20);
        assert!(peak_bytes() >= 64 << 20);
    }
}
