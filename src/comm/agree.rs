//! One outcome for all ranks: nobody waits in a collective call that another rank has given up.

use std::fmt::Display;

use crate::comm::{Comm, all_gather_text, from_root};

/// The value if every rank succeeded; otherwise, on every rank, the text of the first rank that failed at `task`.
/// Collective.
///
/// # Errors
/// If any rank hands in an error.
pub fn agree<T>(comm: &dyn Comm, task: &str, outcome: Result<T, impl Display>) -> Result<T, String> {
    let (value, mine) = match outcome {
        Ok(value) => (Some(value), String::new()),
        Err(error) => (None, format!("{task}, rank {}: {error}", comm.rank())),
    };
    match (all_gather_text(comm, &mine).into_iter().find(|text| !text.is_empty()), value) {
        (None, Some(value)) => Ok(value),
        (first, _) => Err(first.unwrap_or(mine)),
    }
}

/// What rank 0 does for all, and its outcome on every rank. Collective.
///
/// # Errors
/// If rank 0 fails.
pub fn on_root<E: Display>(comm: &dyn Comm, task: &str, work: impl FnOnce() -> Result<(), E>) -> Result<(), String> {
    agree(comm, task, if comm.rank() == 0 { work() } else { Ok(()) })
}

/// Rank 0's texts, on every rank. Collective. A text ends at its first NUL.
pub fn root_texts<'a>(comm: &dyn Comm, texts: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let mut packed = Vec::new();
    if comm.rank() == 0 {
        for text in texts {
            packed.extend(text.bytes().take_while(|&b| b != 0).map(u64::from));
            packed.push(0);
        }
    }
    from_root(comm, packed)
        .split_inclusive(|&b| b == 0)
        .map(|text| {
            let bytes: Vec<u8> = text[..text.len() - 1].iter().map(|&b| b as u8).collect();
            String::from_utf8_lossy(&bytes).into_owned()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;

    #[test]
    fn one_failure_is_everybodys() {
        let outcomes = threads::run(4, |comm| {
            let mine = if comm.rank() % 2 == 1 { Err("") } else { Ok(comm.rank()) };
            agree(comm, "reading", mine)
        });
        assert!(outcomes.iter().all(|o| *o == Err("reading, rank 1: ".into())));
        let outcomes = threads::run(3, |comm| agree(comm, "reading", Ok::<_, String>(comm.rank())));
        assert_eq!(outcomes, [Ok(0), Ok(1), Ok(2)]);
    }

    #[test]
    fn texts_of_rank_0_reach_all() {
        let texts = threads::run(3, |comm| match comm.rank() {
            0 => root_texts(comm, ["straße", "", "b\0c"]),
            _ => root_texts(comm, ["mine"]),
        });
        assert!(texts.iter().all(|t| *t == ["straße", "", "b"]));
    }
}
