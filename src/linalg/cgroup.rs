//! Memory that the Linux control groups of this process still allow. Containers and batch systems limit memory by
//! control groups.
//!
//! # Source
//! cgroups(7); Linux kernel documentation, "Control Group v2" (memory.max, memory.current) and "Memory Resource Controller".

use std::fs;
use std::path::Path;

struct InterfaceFiles {
    limit: &'static str,
    usage: &'static str,
    /// Name of the entry in memory.stat that counts the file cache. The operating system can reclaim this memory.
    cache: &'static str,
}

const CGROUP_V1: InterfaceFiles = InterfaceFiles {
    limit: "memory.limit_in_bytes",
    usage: "memory.usage_in_bytes",
    cache: "total_inactive_file",
};
const CGROUP_V2: InterfaceFiles =
    InterfaceFiles { limit: "memory.max", usage: "memory.current", cache: "inactive_file" };

/// Memory that the control groups of this process still allow, bytes. The groups are mounted at `root`. `None` without
/// control groups or without a limit.
pub(super) fn available_bytes(root: &Path) -> Option<u64> {
    available_in_groups(root, &fs::read_to_string("/proc/self/cgroup").ok()?)
}

/// Does the same as [`available_bytes`] for `groups`, the text of `/proc/self/cgroup`.
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

/// Smallest available memory among the group at `path` and all its parent groups, bytes.
///
/// Groups without files are skipped. In a container, `root` may be the group of the container itself, so that its path
/// on the host does not exist.
fn available_along_path(root: &Path, path: &str, names: &InterfaceFiles) -> Option<u64> {
    let folder = root.join(path.trim_start_matches('/'));
    let folders = folder.ancestors().take_while(|folder| folder.starts_with(root));
    folders.filter_map(|folder| available_in_group(folder, names)).min()
}

fn available_in_group(folder: &Path, names: &InterfaceFiles) -> Option<u64> {
    let number = |name: &str| fs::read_to_string(folder.join(name)).ok()?.trim().parse::<u64>().ok();
    // Without a limit, version 2 writes "max", which is not a number. Version 1 writes a number larger than any memory.
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

    /// Truth: the documentation of versions 1 and 2. The smallest limit along the path applies, and cached files do not
    /// count as used. "max" and groups without files set no limit.
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
