//! Memory that Linux control groups still allow this process to use. Containers and batch systems set the limits of control groups.
//!
//! # Source
//! cgroups(7); Linux kernel documentation, "Control Group v2" (memory.max, memory.current) and "Memory Resource Controller".

use std::fs;
use std::path::Path;

struct InterfaceFiles {
    limit: &'static str,
    usage: &'static str,
    /// Entry of memory.stat with the file cache that the operating system can reclaim.
    cache: &'static str,
}

const CGROUP_V1: InterfaceFiles = InterfaceFiles {
    limit: "memory.limit_in_bytes",
    usage: "memory.usage_in_bytes",
    cache: "total_inactive_file",
};
const CGROUP_V2: InterfaceFiles =
    InterfaceFiles { limit: "memory.max", usage: "memory.current", cache: "inactive_file" };

/// Bytes that the control groups of this process, mounted at `root`, still allow; `None` without control groups or without a limit.
pub(super) fn available_bytes(root: &Path) -> Option<u64> {
    available_in_groups(root, &fs::read_to_string("/proc/self/cgroup").ok()?)
}

/// `groups` has the format of `/proc/self/cgroup`.
fn available_in_groups(root: &Path, groups: &str) -> Option<u64> {
    let rooms = groups.lines().filter_map(|line| {
        let mut parts = line.splitn(3, ':').skip(1);
        let (controllers, path) = (parts.next()?, parts.next()?);
        if controllers.is_empty() {
            available_along_path(root, path, &CGROUP_V2)
        } else if controllers.split(',').any(|name| name == "memory") {
            available_along_path(&root.join("memory"), path, &CGROUP_V1)
        } else {
            None
        }
    });
    rooms.min()
}

/// Smallest available memory among the group at `path` and all groups above it, bytes.
///
/// Groups without files are skipped: a container may see its own group at `root`, but not its path on the host.
fn available_along_path(root: &Path, path: &str, names: &InterfaceFiles) -> Option<u64> {
    let folder = root.join(path.trim_start_matches('/'));
    let folders = folder.ancestors().take_while(|folder| folder.starts_with(root));
    folders.filter_map(|folder| available_in_group(folder, names)).min()
}

fn available_in_group(folder: &Path, names: &InterfaceFiles) -> Option<u64> {
    let number = |name: &str| fs::read_to_string(folder.join(name)).ok()?.trim().parse::<u64>().ok();
    // Without a limit, version 2 writes "max", which is not a number. Version 1 writes a number that is larger than any memory.
    let limit = number(names.limit)?;
    let stat = fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
    let cache = stat.lines().find_map(|line| line.strip_prefix(names.cache)?.trim().parse::<u64>().ok());
    let usage = number(names.usage).unwrap_or(0).saturating_sub(cache.unwrap_or(0));
    Some(limit.saturating_sub(usage))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(root: &Path, files: &[(&str, &str)]) {
        for (name, text) in files {
            let path = root.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
    }

    /// Truth: documentation of both interfaces. The tightest limit along the path applies, and cached files do not count as used.
    /// "max" and invisible groups set no limit.
    #[test]
    fn the_tightest_group_counts() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        write(
            root,
            &[
                ("a/memory.max", "1000\n"),
                ("a/memory.current", "700\n"),
                ("a/memory.stat", "anon 500\ninactive_file 200\n"),
                ("a/b/memory.max", "max\n"),
                ("a/b/memory.current", "700\n"),
                ("memory/job/memory.limit_in_bytes", "900\n"),
                ("memory/job/memory.usage_in_bytes", "500\n"),
                ("memory/memory.limit_in_bytes", "9223372036854771712\n"),
            ],
        );
        assert_eq!(available_in_groups(root, "0::/a/b\n"), Some(500));
        assert_eq!(available_in_groups(root, "4:memory:/job\n0::/a/b\n"), Some(400));
        assert_eq!(available_in_groups(root, "5:cpu,memory:/gone/away\n"), Some(9_223_372_036_854_771_712));
        assert_eq!(available_in_groups(root, "0::/b\n3:cpu:/a\n"), None);
    }
}
