//! Cutting brick bodies into boxes of cells, each rank generating only its own.

use super::shares::{by_cost, interleave};
use super::{BodyMesh, Clusters, ElementList};
use crate::comm::{Comm, Shares};
use crate::mesh::Brick;

/// The boxes of some bodies and their numbers.
struct Boxes<'a> {
    bodies: &'a [BodyMesh],
    cells: [usize; 3],
    /// Body and number within it, x fastest, of each box.
    order: Vec<(usize, usize)>,
    /// Number of boxes in each cluster.
    clusters: Vec<usize>,
}

impl<'a> Boxes<'a> {
    /// Boxes of so many cells in clusters of about so many; all bodies are bricks, and the cells divide theirs. `yielding`
    /// says of each body's boxes whether they are expected to yield, which makes them dearer in every phase: a part of the
    /// order has its part of clusters with and without such.
    fn new(bodies: &'a [BodyMesh], cells: [usize; 3], cluster: usize, yielding: Option<&[Vec<bool>]>) -> Self {
        let mut lists = Vec::new();
        for (body, mesh) in bodies.iter().enumerate() {
            let yields = |boxes: &Vec<usize>| yielding.is_some_and(|yielding| boxes.iter().any(|&k| yielding[body][k]));
            let (dear, cheap): (Vec<_>, Vec<_>) = blocks(along(mesh, cells), cluster).into_iter().partition(yields);
            lists.extend([(body, cheap), (body, dear)]);
        }
        let lengths: Vec<usize> = lists.iter().map(|list| list.1.len()).collect();
        let (mut order, mut clusters) = (Vec::new(), Vec::new());
        for (list, k) in interleave(&lengths) {
            let (body, list) = &lists[list];
            clusters.push(list[k].len());
            order.extend(list[k].iter().map(|&number| (*body, number)));
        }
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

/// The boxes of each block, as their numbers, ascending; blocks are as equal as can be.
fn blocks(counts: [usize; 3], cluster: usize) -> Vec<Vec<usize>> {
    let parts = parts(counts, cluster);
    let range = |a: usize, part: usize| part * counts[a] / parts[a]..(part + 1) * counts[a] / parts[a];
    let mut blocks = Vec::new();
    for z in 0..parts[2] {
        for y in 0..parts[1] {
            for x in 0..parts[0] {
                let rows = range(2, z).flat_map(|k| range(1, y).map(move |j| counts[0] * (j + counts[1] * k)));
                blocks.push(rows.flat_map(|row| range(0, x).map(move |i| i + row)).collect());
            }
        }
    }
    blocks
}

/// Returns the clusters, the shares and this rank's element lists, about as many boxes for every rank; see [`Boxes::new`].
pub(crate) fn own_elements(
    bodies: &[BodyMesh],
    cells: [usize; 3],
    cluster: usize,
    yielding: Option<&[Vec<bool>]>,
    comm: &dyn Comm,
) -> (Clusters, Shares, Vec<ElementList>) {
    let boxes = Boxes::new(bodies, cells, cluster, yielding);
    let costs: Vec<u64> = boxes.clusters.iter().map(|&size| size as u64).collect();
    let (clusters, shares) = Clusters::new(by_cost(&costs, comm.size()), &boxes.clusters);
    let first = shares.begin(comm.rank());
    let lists = (first..first + shares.0[comm.rank()]).map(|number| boxes.elements(number)).collect();
    (clusters, shares, lists)
}

#[cfg(test)]
mod tests {
    use super::blocks;

    #[test]
    fn blocks_fill_the_body_with_parts_as_equal_as_can_be() {
        assert_eq!(blocks([3, 2, 1], 1), [[0], [1], [2], [3], [4], [5]]);
        assert_eq!(
            blocks([5, 2, 2], 12),
            [vec![0, 1, 5, 6, 10, 11, 15, 16], vec![2, 3, 4, 7, 8, 9, 12, 13, 14, 17, 18, 19]]
        );
        assert_eq!(blocks([45, 15, 15], 27).len(), 15 * 5 * 5);
        assert_eq!(blocks([2, 1, 1], 2), [[0, 1]]);
        assert_eq!(blocks([12, 6, 1], 9).len(), 8);
        for cluster in [1, 8, 20, 27, 1000] {
            let mut all = blocks([7, 5, 3], cluster).concat();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..105), "{cluster}");
        }
    }
}
