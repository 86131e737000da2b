use crate::linalg::memory::MemoryLimit;
use crate::scene::spec::solver::MemorySize;

/// Memory limit from the command line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MaxMemory {
    /// Bytes.
    Bytes(u64),
    /// Percentage of the available memory.
    Percent(f64),
}

impl MaxMemory {
    /// Converts the value to a memory limit. A percentage refers to the memory that is available now.
    pub fn limit(self) -> MemoryLimit {
        match self {
            Self::Bytes(bytes) => MemoryLimit::of_command_line(bytes),
            Self::Percent(percent) => MemoryLimit::of_command_line_percent(percent),
        }
    }
}

impl std::fmt::Display for MaxMemory {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Bytes(bytes) => write!(f, "{bytes}"),
            Self::Percent(percent) => write!(f, "{percent}%"),
        }
    }
}

/// Parses a size or a percentage.
///
/// # Errors
/// If `text` is neither a size nor a percentage. The error text lists the accepted forms.
pub fn parse_max_memory(text: &str) -> Result<MaxMemory, String> {
    let text = text.trim();
    let percent = |number: &str| {
        let percent = number.trim_end().parse::<f64>().ok();
        percent.filter(|percent| *percent > 0.0 && *percent <= 100.0).map(MaxMemory::Percent)
    };
    let size = || {
        let size = text.parse().map_or_else(|_| MemorySize::Text(text.to_owned()), MemorySize::Bytes);
        size.bytes().map(MaxMemory::Bytes)
    };
    text.strip_suffix('%').map_or_else(size, percent).ok_or_else(|| {
        "give a number of bytes, a size like \"4 GiB\" or \"500 MB\", or a percentage of the available memory (above \
         0, at most 100) like \"80 %\""
            .to_owned()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: docs/command-line.md. In IEC 80000-13, kibi is 1024 and kilo 1000.
    #[test]
    fn sizes_and_percentages() {
        assert_eq!(parse_max_memory("4 GiB"), Ok(MaxMemory::Bytes(4 << 30)));
        assert_eq!(parse_max_memory(" 1.5kB "), Ok(MaxMemory::Bytes(1500)));
        assert_eq!(parse_max_memory("60000000"), Ok(MaxMemory::Bytes(60_000_000)));
        assert_eq!(parse_max_memory("1.5e9"), Ok(MaxMemory::Bytes(1_500_000_000)));
        assert_eq!(parse_max_memory("80%"), Ok(MaxMemory::Percent(80.0)));
        assert_eq!(parse_max_memory(" 12.5 % "), Ok(MaxMemory::Percent(12.5)));
        assert_eq!(parse_max_memory("100%"), Ok(MaxMemory::Percent(100.0)));
        for wrong in [
            "",
            "0",
            "-1",
            "2.5",
            "4 G",
            "GiB",
            "much",
            "%",
            "0 %",
            "-5 %",
            "101 %",
            "nan %",
            "inf%",
            "80 % of it",
        ] {
            let told = parse_max_memory(wrong).unwrap_err();
            assert!(told.contains("4 GiB") && told.contains("80 %"), "{wrong}: {told}");
        }
    }
}
