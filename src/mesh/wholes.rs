//! How many parts each whole of a body is cut into: each face-connected piece of each of its regions.

/// The wholes of a body, and their parts in one numbering.
pub struct Wholes {
    sizes: Vec<u64>,
    parts: Vec<u32>,
    /// Whole of each part.
    of_part: Vec<u32>,
    /// First part of each.
    firsts: Vec<u32>,
}

impl Wholes {
    /// Of so many elements each, in so many parts.
    pub fn new(sizes: Vec<u64>, parts: Vec<u32>) -> Self {
        let of_part =
            (0..).zip(&parts).flat_map(|(whole, &parts)| std::iter::repeat_n(whole, parts as usize)).collect();
        let firsts = parts.iter().scan(0, |end, parts| {
            *end += parts;
            Some(*end - parts)
        });
        Self { firsts: firsts.collect(), sizes, parts, of_part }
    }

    /// Number of wholes.
    pub fn count(&self) -> usize {
        self.sizes.len()
    }

    /// Number of parts of all wholes.
    pub fn parts(&self) -> usize {
        self.of_part.len()
    }

    /// Elements of a whole.
    pub fn size(&self, whole: u32) -> u64 {
        self.sizes[whole as usize]
    }

    /// Number of parts of a whole.
    pub fn parts_of(&self, whole: u32) -> u32 {
        self.parts[whole as usize]
    }

    /// First part of a whole.
    pub fn first(&self, whole: u32) -> u32 {
        self.firsts[whole as usize]
    }

    /// The whole that a part is of.
    pub fn of_part(&self, part: u32) -> u32 {
        self.of_part[part as usize]
    }

    /// Mean number of elements of the parts of a whole.
    pub fn mean(&self, whole: u32) -> f64 {
        self.size(whole) as f64 / f64::from(self.parts_of(whole))
    }
}

/// Shares `parts` out over wholes of these sizes: one each, the others one by one to the one that is farthest below its
/// quota.
pub fn spread(parts: usize, sizes: &[u64]) -> Vec<u32> {
    let total: u64 = sizes.iter().sum();
    let quota: Vec<f64> = sizes.iter().map(|&n| parts as f64 * n as f64 / total as f64).collect();
    let mut result = vec![1; sizes.len()];
    let mut left = parts.saturating_sub(sizes.len());
    while left > 0 {
        let missing = |k: &usize| quota[*k] - f64::from(result[*k]);
        let next = (0..sizes.len()).max_by(|a, b| missing(a).total_cmp(&missing(b)).then(b.cmp(a)));
        result[next.expect("a scene has bodies")] += 1;
        left -= 1;
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_spread_by_size_and_every_whole_gets_one() {
        assert_eq!(spread(10, &[600, 300, 100]), [6, 3, 1]);
        assert_eq!(spread(3, &[1000, 1, 1]), [1, 1, 1]);
        assert_eq!(spread(7, &[1, 1]), [4, 3]);
        assert_eq!(spread(1, &[1, 1]), [1, 1]);
    }

    #[test]
    fn parts_of_wholes_are_numbered_one_behind_the_other() {
        let wholes = Wholes::new(vec![10, 4], vec![3, 2]);
        assert_eq!((wholes.count(), wholes.parts(), wholes.first(1), wholes.mean(1)), (2, 5, 3, 2.0));
        assert_eq!((0..5).map(|part| wholes.of_part(part)).collect::<Vec<_>>(), [0, 0, 0, 1, 1]);
    }
}
