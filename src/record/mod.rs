//! Plain records of a run: what the log tells, what the summary holds, what checkpoints carry. Nothing is computed here.
//!
//! [`summary`] is all of a run, of [`counts`], [`rows`] and the last [`state`].

pub mod counts;
pub mod forecast;
pub mod rows;
pub mod state;
pub mod summary;
