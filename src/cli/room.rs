//! Whether a run has room: what it would take on each host, beside what is left there.
//!
//! Estimates are rough (see `bench-results` for how rough), and so is what the system calls available: a run is refused only
//! if it would take [`BEYOND`] times what is left, and warned of if it would take most of it.

use std::collections::BTreeMap;

use super::Failure;
use crate::comm::{Comm, all_gather_text};
use crate::monitor::machine::available_mb;
use crate::results::provenance::host;
use crate::sizing::counts::Counted;
use crate::sizing::memory::Memory;

/// So many times what is left is refused.
const BEYOND: f64 = 1.5;
/// More than this share of what is left is worth a word.
const MOST: f64 = 0.9;

/// What a run takes and what there is, in MiB, on the host where that is tightest.
pub(super) struct Room {
    host: String,
    ranks: usize,
    needed_mb: f64,
    available_mb: f64,
    /// What is left on all hosts.
    pub everywhere_mb: f64,
}

impl Room {
    /// Compares all hosts; `None` where no host tells what it has. Collective.
    pub(super) fn find(comm: &dyn Comm, memory: &Memory) -> Option<Self> {
        let mine = available_mb().map_or_else(String::new, |left| format!("{left} {}", host()));
        // Ranks, needed, available.
        let mut hosts: BTreeMap<String, (usize, f64, f64)> = BTreeMap::new();
        for text in all_gather_text(comm, &mine) {
            let Some((left, host)) = text.split_once(' ') else { continue };
            let left: f64 = left.parse().unwrap_or(f64::INFINITY);
            let (ranks, needed, available) = hosts.entry(host.to_owned()).or_insert((0, 0.0, left));
            *ranks += 1;
            *needed += memory.of_rank_mb(comm.size());
            *available = available.min(left);
        }
        let everywhere_mb = hosts.values().map(|(.., available)| available).sum();
        let share = |(_, needed, available): &(usize, f64, f64)| needed / available;
        let (host, (ranks, needed_mb, available_mb)) =
            hosts.into_iter().max_by(|(_, a), (_, b)| share(a).total_cmp(&share(b)))?;
        Some(Self { host, ranks, needed_mb, available_mb, everywhere_mb })
    }

    /// What to tell where it is narrow.
    pub(super) fn warning(&self) -> Option<String> {
        let end = if self.is_beyond() { "`solve` refuses that" } else { "it may run out of memory on the way" };
        (self.needed_mb > MOST * self.available_mb).then(|| format!("{}: {end}", self.compared()))
    }

    /// Refuses what is clearly beyond.
    pub(super) fn refuse(&self) -> Result<(), Failure> {
        if !self.is_beyond() {
            return Ok(());
        }
        Err(Failure::Memory(format!(
            "{}; take more hosts, a lower level or larger cells, or --ignore-memory if you know better",
            self.compared()
        )))
    }

    fn is_beyond(&self) -> bool {
        self.needed_mb > BEYOND * self.available_mb
    }

    fn compared(&self) -> String {
        let Self { host, ranks, needed_mb, available_mb, .. } = self;
        let ranks = if *ranks == 1 { "1 rank".to_owned() } else { format!("{ranks} ranks") };
        format!("the run would take about {needed_mb:.0} MiB on {host} ({ranks}), which has {available_mb:.0} MiB left")
    }
}

/// Refuses a run that cannot fit, unless told to begin; what to tell where it hardly does. Collective.
pub(super) fn make_room(comm: &dyn Comm, counted: &Counted, ignore: bool) -> Result<Option<String>, Failure> {
    let Some(room) = Room::find(comm, &counted.memory()) else { return Ok(None) };
    if !ignore {
        room.refuse()?;
    }
    Ok(room.warning())
}
