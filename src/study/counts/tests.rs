//! Counts against problems that were built.
