//! Fill-reducing ordering by METIS nested dissection of a graph whose nodes have some unknowns each.

use std::sync::{Mutex, PoisonError};

use signal_hook::consts::SIGTERM;
use signal_hook::low_level;

use crate::heap::exhausted;

/// The unknown at each place of the elimination, from the adjacency of the nodes with `width` unknowns each.
///
/// # Panics
/// If METIS refuses the graph: a bug, since the adjacency is symmetric and free of loops.
pub fn nested_dissection(adjacency: &(Vec<i32>, Vec<i32>), width: u32) -> Vec<u32> {
    let (begins, neighbours) = adjacency;
    let nodes = begins.len() - 1;
    let mut count = nodes as metis_sys::idx_t;
    let (mut forward, mut inverse) = (vec![0; nodes], vec![0; nodes]);
    let ordered = || {
        // Safety: METIS reads the graph and writes `count` entries to each permutation; pointers and lengths agree.
        unsafe {
            metis_sys::METIS_NodeND(
                &mut count,
                begins.as_ptr().cast_mut(),
                neighbours.as_ptr().cast_mut(),
                std::ptr::null_mut(),
                std::ptr::null_mut(),
                forward.as_mut_ptr(),
                inverse.as_mut_ptr(),
            )
        }
    };
    let status = undisturbed(ordered, |status| *status == metis_sys::rstatus_et_METIS_ERROR);
    if status == metis_sys::rstatus_et_METIS_ERROR_MEMORY {
        exhausted(size_of_val(neighbours));
    }
    assert_eq!(status, metis_sys::rstatus_et_METIS_OK, "METIS orders a valid graph");
    forward.iter().flat_map(|&n| (0..width).map(move |a| width * n as u32 + a)).collect()
}

/// What METIS finds, for one thread at a time; once more if it ended with its general error. METIS draws from the C library's one
/// generator, so results would depend on what other threads do. It takes SIGTERM for an error of its own while it works, so the
/// signal is sent on to who waits for it.
pub(crate) fn undisturbed<T>(mut metis: impl FnMut() -> T, is_error: impl Fn(&T) -> bool) -> T {
    static LOCK: Mutex<()> = Mutex::new(());
    let _alone = LOCK.lock().unwrap_or_else(PoisonError::into_inner);
    let found = metis();
    if !is_error(&found) {
        return found;
    }
    // Where no one waits for it this ends the process, as the signal would have done.
    drop(low_level::raise(SIGTERM));
    metis()
}
