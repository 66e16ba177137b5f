//! What solving a scene would take, without solving it.
//!
//! [`sizes`] counts what a discrete problem has, [`counts`] counts from the scene alone where the problem is too large to be built,
//! [`memory`] turns counts into MiB, [`held`] says who holds them, [`forecast`] how long it takes. [`likeness`] looks at the same scene with larger cells.

pub mod counts;
pub mod forecast;
pub mod held;
pub mod likeness;
pub mod memory;
pub mod sizes;

pub use likeness::look;
pub use sizes::{memory, sizes};
