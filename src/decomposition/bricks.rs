//! Cutting brick bodies into boxes of cells, each rank generating only its own.

use std::ops::Range;

use super::shares::{interleave, whole_groups};
use super::{BodyMesh, Clusters, ElementList};
use crate::comm::{Comm, Shares};
use crate::mesh::Brick;

/// The boxes of some bodies and their numbers.
struct Boxes<'a> {
    bodies: &'a [BodyMesh],
    cells: [usize; 3],
    /// Body and number within it, x fastest, of each box.
    order: Vec<(usize, usize)>,
    clusters: Clusters,
}

impl<'a> Boxes<'a> {
    /// Boxes of so many cells in groups of about so many on each level; all bodies are bricks, and the cells divide theirs.
    /// `yielding` says of each body's boxes whether they are expected to yield, which makes them dearer in every phase: a part of
    /// the order has its part of clusters with and without such.
    fn new(bodies: &'a [BodyMesh], cells: [usize; 3], groups: &[usize], yielding: Option<&[Vec<bool>]>) -> Self {
        let mut lists = Vec::new();
        for (body, mesh) in bodies.iter().enumerate() {
            let yields =
                |block: &Block| yielding.is_some_and(|yielding| block.boxes.iter().any(|&k| yielding[body][k]));
            let (dear, cheap): (Vec<_>, Vec<_>) = blocks(along(mesh, cells), groups).into_iter().partition(yields);
            lists.extend([(body, cheap), (body, dear)]);
        }
        let lengths: Vec<usize> = lists.iter().map(|list| list.1.len()).collect();
        let (mut order, mut sizes) = (Vec::new(), vec![Vec::new(); groups.len()]);
        for (list, k) in interleave(&lengths) {
            let (body, list) = &lists[list];
            order.extend(list[k].boxes.iter().map(|&number| (*body, number)));
            sizes.iter_mut().zip(&list[k].sizes).for_each(|(all, sizes)| all.extend(sizes));
        }
        let clusters = Clusters::new(order.len(), &sizes);
        Self { bodies, cells, order, clusters }
    }

    /// Elements of a box, by their numbers within its body.
    fn elements(&self, number: usize) -> ElementList {
        let (body, k) = self.order[number];
        let brick = brick(&self.bodies[body]);
        let [nx, ny, _] = along(&self.bodies[body], self.cells);
        let at = [k % nx, k / nx % ny, k / (nx * ny)];
        let low: [usize; 3] = std::array::from_fn(|a| at[a] * self.cells[a]);
        let mut elements = Vec::new();
        for k in low[2]..low[2] + self.cells[2] {
            for j in low[1]..low[1] + self.cells[1] {
                let row = brick.cell([low[0], j, k]);
                let per_cell = self.bodies[body].kind.cell().per_hexahedron();
                elements.extend(per_cell * row..per_cell * (row + self.cells[0] as u64));
            }
        }
        (body, elements)
    }
}

fn brick(body: &BodyMesh) -> &Brick {
    body.brick().expect("only bricks are cut into boxes")
}

/// Number of boxes of so many cells in a body.
pub fn count(body: &BodyMesh, cells: [usize; 3]) -> usize {
    along(body, cells).iter().product()
}

/// Number within its body, x fastest, of the box around a place, given in parts of the body's size.
pub fn around(body: &BodyMesh, cells: [usize; 3], place: [f64; 3]) -> usize {
    let counts = along(body, cells);
    let at = |a: usize| ((place[a] * counts[a] as f64).max(0.0) as usize).min(counts[a] - 1);
    at(0) + counts[0] * (at(1) + counts[1] * at(2))
}

/// Number of boxes along each axis.
pub(crate) fn along(body: &BodyMesh, cells: [usize; 3]) -> [usize; 3] {
    std::array::from_fn(|a| brick(body).cells[a] / cells[a])
}

/// Number of blocks of about `cluster` neighbouring boxes along each axis of a body of so many: blocks are as near to cubes as
/// the body lets them.
pub(crate) fn parts(counts: [usize; 3], cluster: usize) -> [usize; 3] {
    let (mut parts, mut left) = ([1; 3], cluster as f64);
    let mut axes = [0, 1, 2];
    axes.sort_by_key(|&a| counts[a]);
    // Where a body is thin, blocks are the wider.
    for (&a, others) in axes.iter().zip([3.0_f64, 2.0, 1.0]) {
        parts[a] = ((counts[a] as f64 / left.powf(1.0 / others)).round() as usize).clamp(1, counts[a]);
        left = (left * parts[a] as f64 / counts[a] as f64).max(1.0);
    }
    parts
}

/// Neighbouring boxes, in groups.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Block {
    /// Numbers of the boxes.
    boxes: Vec<usize>,
    /// For each level the sizes of its groups, in groups of the level below.
    sizes: Vec<Vec<usize>>,
}

/// The blocks of the highest level; groups of one level are as equal as can be.
fn blocks(counts: [usize; 3], groups: &[usize]) -> Vec<Block> {
    let mut grids = vec![counts];
    groups.iter().for_each(|&size| grids.push(parts(grids[grids.len() - 1], size)));
    let block = |place: [usize; 3]| {
        let mut block = Block { boxes: Vec::new(), sizes: vec![Vec::new(); groups.len()] };
        block.fill(&grids, place);
        block
    };
    places(grids[groups.len()].map(|n| 0..n)).map(block).collect()
}

/// Places in a grid, x fastest.
fn places([x, y, z]: [Range<usize>; 3]) -> impl Iterator<Item = [usize; 3]> {
    z.flat_map(move |k| {
        let x = x.clone();
        y.clone().flat_map(move |j| x.clone().map(move |i| [i, j, k]))
    })
}

impl Block {
    /// Adds the group at a place of the last grid.
    fn fill(&mut self, grids: &[[usize; 3]], place: [usize; 3]) {
        let [.., finer, coarser] = grids else {
            let [nx, ny, _] = grids[0];
            return self.boxes.push(place[0] + nx * (place[1] + ny * place[2]));
        };
        let range = |a: usize| place[a] * finer[a] / coarser[a]..(place[a] + 1) * finer[a] / coarser[a];
        let children = [range(0), range(1), range(2)];
        self.sizes[grids.len() - 2].push(children.iter().map(Range::len).product());
        places(children).for_each(|place| self.fill(&grids[..grids.len() - 1], place));
    }
}

/// Returns the clusters, the shares and this rank's element lists, about as many boxes for every rank; see [`Boxes::new`].
pub(crate) fn own_elements(
    bodies: &[BodyMesh],
    cells: [usize; 3],
    groups: &[usize],
    yielding: Option<&[Vec<bool>]>,
    comm: &dyn Comm,
) -> (Clusters, Shares, Vec<ElementList>) {
    let boxes = Boxes::new(bodies, cells, groups, yielding);
    let shares = whole_groups(&boxes.clusters, |_| 1, comm.size());
    let first = shares.begin(comm.rank());
    let lists = (first..first + shares.0[comm.rank()]).map(|number| boxes.elements(number)).collect();
    (boxes.clusters, shares, lists)
}

#[cfg(test)]
mod tests {
    use super::{Block, blocks};

    fn boxes(counts: [usize; 3], groups: &[usize]) -> Vec<Vec<usize>> {
        blocks(counts, groups).into_iter().map(|block| block.boxes).collect()
    }

    #[test]
    fn blocks_fill_the_body_with_parts_as_equal_as_can_be() {
        assert_eq!(boxes([3, 2, 1], &[]), [[0], [1], [2], [3], [4], [5]]);
        assert_eq!(
            boxes([5, 2, 2], &[12]),
            [vec![0, 1, 5, 6, 10, 11, 15, 16], vec![2, 3, 4, 7, 8, 9, 12, 13, 14, 17, 18, 19]]
        );
        assert_eq!(boxes([45, 15, 15], &[27]).len(), 15 * 5 * 5);
        assert_eq!(boxes([2, 1, 1], &[2]), [[0, 1]]);
        assert_eq!(boxes([12, 6, 1], &[9]).len(), 8);
        for groups in [&[][..], &[1], &[8], &[20], &[27, 8], &[1000], &[2, 2, 2]] {
            let mut all = boxes([7, 5, 3], groups).concat();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..105), "{groups:?}");
        }
    }

    #[test]
    fn blocks_of_blocks_are_nested() {
        let block = |boxes: [usize; 4]| Block { boxes: boxes.to_vec(), sizes: vec![vec![2, 2], vec![2]] };
        assert_eq!(blocks([4, 2, 1], &[2, 2]), [block([0, 4, 1, 5]), block([2, 6, 3, 7])]);
    }
}
