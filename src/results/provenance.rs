//! Where results come from: program, libraries, machine, command and scene, as texts to be kept with them.
//!
//! Never the environment as a whole: only the batch system's job number is taken from it.

use std::time::{SystemTime, UNIX_EPOCH};

use crate::comm::{Comm, Shares, all_gather_text, world};

/// Version of the program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Git commit of the build, `-dirty` if tracked files differed from it; "unknown" outside a repository.
pub const COMMIT: &str = env!("FETIPLAST_COMMIT");

/// Names and texts of all that is known of this run; the same on every rank but for the command line. Collective.
/// `scene` is the effective scene in TOML, `meshes` what tells its meshes apart, `shares` the subdomains of each rank.
pub fn collect(
    comm: &dyn Comm,
    scene: &str,
    meshes: &str,
    shares: &Shares,
    started: SystemTime,
) -> Vec<(String, String)> {
    let (major, minor, patch) = hdf5_metno::library_version();
    let subdomains: Vec<String> = shares.0.iter().map(usize::to_string).collect();
    [
        ("version", VERSION.to_owned()),
        ("commit", COMMIT.to_owned()),
        ("rustc", env!("FETIPLAST_RUSTC").to_owned()),
        ("target", env!("FETIPLAST_TARGET").to_owned()),
        ("profile", env!("FETIPLAST_PROFILE").to_owned()),
        ("mpi_library", world::library()),
        ("hdf5_version", format!("{major}.{minor}.{patch}")),
        ("ranks", comm.size().to_string()),
        ("hosts", all_gather_text(comm, &host()).join(" ")),
        ("subdomains_per_rank", subdomains.join(" ")),
        ("command_line", std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")),
        ("start_time", utc(started)),
        ("slurm_job_id", std::env::var("SLURM_JOB_ID").unwrap_or_else(|_| "none".into())),
        ("scene_hash", hash(scene)),
        ("mesh_hash", hash(meshes)),
        ("scene", scene.to_owned()),
    ]
    .map(|(name, text)| (name.to_owned(), text))
    .to_vec()
}

/// FNV-1a, 64 bit, in hexadecimal (Fowler, Noll, Vo; draft-eastlake-fnv): tells scenes and meshes apart, protects nothing.
pub fn hash(text: &str) -> String {
    let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    format!("{:016x}", text.bytes().fold(0xcbf2_9ce4_8422_2325, step))
}

/// Name of this machine.
pub fn host() -> String {
    std::fs::read_to_string("/proc/sys/kernel/hostname").map_or_else(|_| "unknown".into(), |name| name.trim().into())
}

/// Date and time of day in UTC to the second, ISO 8601. Days to dates as in H. Hinnant, "chrono-compatible low-level date
/// algorithms": years begin in March, so that the leap day is the last.
fn utc(time: SystemTime) -> String {
    let seconds = time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let (hour, minute, second) = (seconds / 3600 % 24, seconds / 60 % 60, seconds % 60);
    let days = seconds / 86_400 + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = (month_from_march + 2) % 12 + 1;
    let year = 400 * era + year_of_era + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use std::time::Duration;

    #[test]
    fn dates_are_those_of_the_calendar() {
        let at = |seconds| utc(UNIX_EPOCH + Duration::from_secs(seconds));
        assert_eq!(at(0), "1970-01-01T00:00:00Z");
        assert_eq!(at(951_827_696), "2000-02-29T12:34:56Z");
        assert_eq!(at(1_000_000_000), "2001-09-09T01:46:40Z");
        assert_eq!(at(4_107_542_399), "2100-02-28T23:59:59Z");
        assert_eq!(at(4_107_542_400), "2100-03-01T00:00:00Z");
    }

    #[test]
    fn hashes_are_the_published_ones() {
        assert_eq!(hash(""), "cbf29ce484222325");
        assert_eq!(hash("foobar"), "85944171f73967e8");
    }

    #[test]
    fn every_rank_is_named() {
        let entries = threads::run(3, |comm| {
            collect(comm, "title = \"a\"", "", &Shares::new(vec![2, 0, 1]), UNIX_EPOCH).into_iter().collect::<Vec<_>>()
        });
        let text = |name: &str| entries[0].iter().find(|(n, _)| n == name).map(|(_, t)| t.clone()).unwrap();
        assert_eq!(text("subdomains_per_rank"), "2 0 1");
        assert_eq!(text("hosts").split(' ').count(), 3);
        assert!(entries[0].iter().all(|(name, text)| !text.is_empty() || name == "mpi_library"));
    }
}
