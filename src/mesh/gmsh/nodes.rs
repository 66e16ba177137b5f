//! From the numbers of nodes in a file to indices.

use std::collections::HashMap;

use super::error::Problem;

/// Index of each node by its number. Numbers are any, but mostly without large gaps.
pub(super) enum NodeTags {
    /// Indices from the least number on; `u32::MAX` in gaps.
    Dense { least: u64, index: Vec<u32> },
    /// Where gaps would take more room.
    Sparse(HashMap<u64, u32>),
}

impl NodeTags {
    /// # Errors
    /// If a number is there twice (the least of these), or there are more than 32 bits can count.
    pub fn new(tags: &[u64]) -> Result<Self, Problem> {
        if tags.len() >= u32::MAX as usize {
            let limit = format!("{} are not read", u32::MAX);
            return Err(Problem::TooMany { section: "Nodes", items: "nodes", announced: tags.len() as u64, limit });
        }
        let (least, greatest) = (tags.iter().min().copied().unwrap_or(0), tags.iter().max().copied().unwrap_or(0));
        let mut twice = None;
        let numbered = tags.iter().enumerate();
        let result = if greatest - least < 4 * tags.len() as u64 {
            let mut index = vec![u32::MAX; (greatest - least) as usize + 1];
            for (k, tag) in numbered {
                if std::mem::replace(&mut index[(tag - least) as usize], k as u32) != u32::MAX {
                    twice = Some(twice.map_or(*tag, |least: u64| least.min(*tag)));
                }
            }
            Self::Dense { least, index }
        } else {
            let mut index = HashMap::with_capacity(tags.len());
            for (k, tag) in numbered {
                if index.insert(*tag, k as u32).is_some() {
                    twice = Some(twice.map_or(*tag, |least: u64| least.min(*tag)));
                }
            }
            Self::Sparse(index)
        };
        twice.map_or(Ok(result), |tag| Err(Problem::NodeTwice(tag)))
    }

    /// The index of a node.
    pub fn index(&self, tag: u64) -> Option<u32> {
        match self {
            Self::Dense { least, index } => {
                let place = usize::try_from(tag.checked_sub(*least)?).ok()?;
                index.get(place).copied().filter(|&k| k != u32::MAX)
            }
            Self::Sparse(index) => index.get(&tag).copied(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_whatever_the_gaps_and_never_twice() {
        for tags in [vec![7, 5, 6, 9], vec![1_u64 << 60, 3, 0, u64::MAX], vec![]] {
            let found = NodeTags::new(&tags).unwrap();
            assert!((0..).zip(&tags).all(|(k, &tag)| found.index(tag) == Some(k)));
            assert!([4, 8, 10, 1 << 59].iter().all(|&tag| found.index(tag).is_none()));
        }
        for tags in [[3, 4, 3], [3, 1 << 60, 3]] {
            assert!(matches!(NodeTags::new(&tags), Err(Problem::NodeTwice(3))));
        }
    }
}
