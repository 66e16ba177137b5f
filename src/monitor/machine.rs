//! The memory that this machine has left for a process, by Linux's `/proc` and the control groups that it is in.
//!
//! A group's limit counts what is in the page cache, which gives way: of the limit is left what is neither used nor cache
//! that was not used lately. Groups of version 2 (one tree) and 1 (one tree for memory) are looked at, with all above them.
//! Limits of single processes (`ulimit -v`) are not: they are about addresses, of which MPI takes more than it uses.

use std::fs::read_to_string;
use std::path::{Path, PathBuf};

const MB: f64 = (1 << 20) as f64;

/// Memory that can be had without swapping, in MiB; `None` where nothing tells.
pub fn available_mb() -> Option<f64> {
    let free = free_mb(&read_to_string("/proc/meminfo").ok()?)?;
    let groups = read_to_string("/proc/self/cgroup").unwrap_or_default();
    Some(groups.lines().filter_map(left_to_group).fold(free, f64::min))
}

/// What `/proc/meminfo` says is available.
fn free_mb(meminfo: &str) -> Option<f64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes / 1024.0)
}

/// What the group of a line of `/proc/self/cgroup`, and those above it, have left; `None` without a limit.
fn left_to_group(line: &str) -> Option<f64> {
    let (controllers, path) = line.split_once(':')?.1.split_once(':')?;
    let is_memory = |name| name == "memory";
    let (root, [limit, used], cache) = match controllers {
        "" => ("/sys/fs/cgroup", ["memory.max", "memory.current"], "inactive_file"),
        some if some.split(',').any(is_memory) => {
            ("/sys/fs/cgroup/memory", ["memory.limit_in_bytes", "memory.usage_in_bytes"], "total_inactive_file")
        }
        _ => return None,
    };
    let left = |group: &Path| {
        let number = |file| read_to_string(group.join(file)).ok()?.trim().parse::<f64>().ok();
        let stat = read_to_string(group.join("memory.stat")).unwrap_or_default();
        Some((number(limit)? - number(used)? + of_stat(&stat, cache)).max(0.0) / MB)
    };
    let group = PathBuf::from(format!("{root}{path}"));
    // In a container the path may be that outside; its own group is the root then.
    group.ancestors().filter(|group| group.starts_with(root)).filter_map(left).reduce(f64::min)
}

/// The number under this key of `memory.stat`, in bytes.
fn of_stat(stat: &str, key: &str) -> f64 {
    let value = |line: &str| line.split_once(' ').filter(|(name, _)| *name == key)?.1.parse().ok();
    stat.lines().find_map(value).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_in_the_texts_of_linux() {
        let text = "MemTotal:       24684092 kB\nMemFree:  1 kB\nMemAvailable:   2048 kB\n";
        assert_eq!(free_mb(text), Some(2.0));
        assert_eq!(free_mb("MemTotal: 1 kB"), None);
        assert_eq!(of_stat("anon 7\ntotal_inactive_file 9\ninactive_file 4096\n", "inactive_file"), 4096.0);
        assert_eq!(of_stat("", "inactive_file"), 0.0);
        assert_eq!(left_to_group("3:cpuset:/"), None);
        assert_eq!(left_to_group("no line"), None);
    }

    #[test]
    fn this_machine_has_memory_left_but_no_more_than_it_has() {
        let total = read_to_string("/proc/meminfo").unwrap();
        let total: f64 = total.split_whitespace().nth(1).unwrap().parse().unwrap();
        assert!(available_mb().is_some_and(|left| left > 1.0 && left < total / 1024.0));
    }
}
