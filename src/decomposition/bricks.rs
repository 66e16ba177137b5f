//! Cutting brick bodies into boxes of cells, each rank generating only its own.

use super::shares::{by_cost, interleave};
use super::{BodyMesh, ElementList};
use crate::comm::{Comm, Shares};
use crate::mesh::Brick;

/// The boxes of some bodies and their numbers.
struct Boxes<'a> {
    bodies: &'a [BodyMesh],
    cells: [usize; 3],
    /// Body and number within it, x fastest, of each box.
    order: Vec<(usize, usize)>,
}

impl<'a> Boxes<'a> {
    /// Boxes of so many cells; all bodies are bricks, and these divide their cells. `yielding` says of each body's boxes
    /// whether they are expected to yield, which makes them dearer in every phase: a part of the order has its part of
    /// both kinds.
    fn new(bodies: &'a [BodyMesh], cells: [usize; 3], yielding: Option<&[Vec<bool>]>) -> Self {
        let mut lists = Vec::new();
        for (body, mesh) in bodies.iter().enumerate() {
            let yields = |&(_, k): &(usize, usize)| yielding.is_some_and(|yielding| yielding[body][k]);
            let (dear, cheap): (Vec<_>, Vec<_>) = (0..count(mesh, cells)).map(|k| (body, k)).partition(yields);
            lists.extend([cheap, dear]);
        }
        let lengths: Vec<usize> = lists.iter().map(Vec::len).collect();
        let order = interleave(&lengths).into_iter().map(|(list, k)| lists[list][k]).collect();
        Self { bodies, cells, order }
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
                let per_cell = self.bodies[body].kind.per_cell();
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
fn along(body: &BodyMesh, cells: [usize; 3]) -> [usize; 3] {
    std::array::from_fn(|a| brick(body).cells[a] / cells[a])
}

/// Returns the shares and this rank's element lists, as many boxes for every rank; see [`Boxes::new`] for `yielding`.
pub(crate) fn own_elements(
    bodies: &[BodyMesh],
    cells: [usize; 3],
    yielding: Option<&[Vec<bool>]>,
    comm: &dyn Comm,
) -> (Shares, Vec<ElementList>) {
    let boxes = Boxes::new(bodies, cells, yielding);
    let shares = by_cost(&vec![1; boxes.order.len()], comm.size());
    let first = shares.begin(comm.rank());
    let lists = (first..first + shares.0[comm.rank()]).map(|number| boxes.elements(number)).collect();
    (shares, lists)
}
