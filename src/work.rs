//! Work that kernels did: operations, and bytes that they read.
//!
//! A kernel books its work where it does it, by a formula from its sizes; [`Timer`](crate::monitor::timing::Timer) asks how much
//! that was in each phase. So counts have no noise: two runs have the same. Nothing here is read back by the numerics.
//!
//! - `flops` are additions and multiplications in floating point, divisions and roots among them, of every loop over elements,
//!   entries of matrices or rows that costs time. A formula may be off by a few per cent where a material law takes one branch or
//!   the other. Right-hand sides that only fill up a vector register do not count.
//! - `bytes` are those of matrices with their indices, of elements, and of multipliers in inner products: what streams through the
//!   processor. Vectors that belong to a matrix in use are left out, for they stay in its caches.
//!
//! Searches, integers, files and the sums of what several subdomains tell of a row are in neither.
//!
//! A rank is a thread, and so is the sum.

use std::cell::Cell;

use serde::Serialize;

/// Operations and bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Work {
    /// Additions and multiplications.
    pub flops: f64,
    /// Bytes read.
    pub bytes: f64,
}

thread_local! {
    static DONE: Cell<Work> = const { Cell::new(Work { flops: 0.0, bytes: 0.0 }) };
}

/// Books `flops` operations and `bytes` read on this thread. Both are whole numbers, so that sums of them are exact up to 2^53.
#[inline]
pub fn add(flops: usize, bytes: usize) {
    let Work { flops: before, bytes: read } = DONE.get();
    DONE.set(Work { flops: before + flops as f64, bytes: read + bytes as f64 });
}

/// Books so many operations on each of some items, and so many bytes of each.
#[inline]
pub fn each(items: usize, flops: usize, bytes: usize) {
    add(items * flops, items * bytes);
}

/// All that was booked on this thread so far.
pub fn done() -> Work {
    DONE.get()
}
