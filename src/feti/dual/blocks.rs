//! Blocks of `G G'`: six lines and six columns between two groups of subdomains, one for each rigid mode.

use std::collections::BTreeMap;

use crate::feti::inverse::kernel::MODES;

/// A block, row by row.
pub type Block = [f64; MODES * MODES];
/// The row and the column of a block, by numbers of groups.
pub type Place = (usize, usize);
/// Blocks of the lower triangle.
pub type Blocks = BTreeMap<Place, Block>;

/// Sums in few places, as those of one subdomain and its neighbours are: looking at all of them finds one.
#[derive(Default)]
pub struct FewBlocks {
    blocks: Vec<(Place, Block)>,
}

impl FewBlocks {
    /// The block of a place, at first of zeros.
    #[inline]
    pub fn at(&mut self, place: Place) -> &mut Block {
        let known = self.blocks.iter().position(|block| block.0 == place);
        let at = known.unwrap_or_else(|| {
            self.blocks.push((place, [0.0; MODES * MODES]));
            self.blocks.len() - 1
        });
        &mut self.blocks[at].1
    }

    /// All of them, in the order in which they were asked for.
    pub fn into_blocks(self) -> Vec<(Place, Block)> {
        self.blocks
    }
}

/// `block += a b'`.
#[inline]
pub fn add_product(block: &mut Block, a: &[f64; MODES], b: &[f64; MODES]) {
    for (line, a) in block.as_chunks_mut::<MODES>().0.iter_mut().zip(a) {
        line.iter_mut().zip(b).for_each(|(x, b)| *x += a * b);
    }
}

/// Adds to the block of a place.
pub fn add_block(blocks: &mut Blocks, place: Place, block: Block) {
    let sum = blocks.entry(place).or_insert([0.0; MODES * MODES]);
    sum.iter_mut().zip(block).for_each(|(sum, x)| *sum += x);
}

/// Blocks as a message.
pub fn pack(blocks: &[(Place, Block)]) -> Vec<u64> {
    let mut message = Vec::with_capacity((2 + MODES * MODES) * blocks.len());
    for ((row, column), block) in blocks {
        message.extend([*row as u64, *column as u64]);
        message.extend(block.map(f64::to_bits));
    }
    message
}

/// The blocks of such a message.
pub fn unpack(message: &[u64]) -> impl Iterator<Item = (Place, Block)> {
    let blocks = message.as_chunks::<{ 2 + MODES * MODES }>().0.iter();
    blocks.map(|&[row, column, ref block @ ..]| ((row as usize, column as usize), block.map(f64::from_bits)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_few_places_arrive_as_they_were_sent() {
        let [a, b] = [[1.0, -2.0, 0.0, 4.0, 0.5, 3.0], [2.0, 1.0, -1.0, 0.0, 8.0, 0.25]];
        let mut few = FewBlocks::default();
        for place in [(7, 3), (2, 2), (7, 3)] {
            add_product(few.at(place), &a, &b);
        }
        let few = few.into_blocks();
        assert_eq!(few.iter().map(|block| block.0).collect::<Vec<_>>(), [(7, 3), (2, 2)]);
        let mut sums = Blocks::new();
        unpack(&pack(&few)).for_each(|(place, block)| add_block(&mut sums, place, block));
        for (i, j) in (0..MODES).flat_map(|i| (0..MODES).map(move |j| (i, j))) {
            assert_eq!(sums[&(7, 3)][MODES * i + j], 2.0 * a[i] * b[j]);
            assert_eq!(sums[&(2, 2)][MODES * i + j], a[i] * b[j]);
        }
    }
}
