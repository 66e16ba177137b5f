//! Cutting brick bodies into boxes of cells, each rank generating only its own.

use super::shares::{by_cost, interleave};
use super::{BodyMesh, ElementList};
use crate::comm::{Comm, Shares};
use crate::mesh::Brick;

/// The boxes of some bodies and their numbers.
pub struct Boxes<'a> {
    bodies: &'a [BodyMesh],
    cells: [usize; 3],
    /// Body and number within it, x fastest, of each box.
    order: Vec<(usize, usize)>,
}

impl<'a> Boxes<'a> {
    /// Boxes of so many cells; all bodies are bricks, and these divide their cells.
    pub fn new(bodies: &'a [BodyMesh], cells: [usize; 3]) -> Self {
        let counts: Vec<usize> = bodies.iter().map(|body| along(body, cells).iter().product()).collect();
        Self { bodies, cells, order: interleave(&counts) }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.order.len()
    }

    /// For each body the numbers of its boxes among all, x fastest.
    pub fn numbers(&self) -> Vec<Vec<usize>> {
        let mut numbers = vec![Vec::new(); self.bodies.len()];
        // Every body's boxes come in their own order.
        self.order.iter().enumerate().for_each(|(number, &(body, _))| numbers[body].push(number));
        numbers
    }

    /// Number within its body of the box around a place, given in parts of the body's size.
    pub fn around(&self, body: usize, place: [f64; 3]) -> usize {
        let counts = along(&self.bodies[body], self.cells);
        let at = |a: usize| ((place[a] * counts[a] as f64).max(0.0) as usize).min(counts[a] - 1);
        at(0) + counts[0] * (at(1) + counts[1] * at(2))
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

/// Number of boxes along each axis.
fn along(body: &BodyMesh, cells: [usize; 3]) -> [usize; 3] {
    std::array::from_fn(|a| brick(body).cells[a] / cells[a])
}

/// Returns the shares and this rank's element lists; `costs` are those of the boxes, by default equal.
pub(crate) fn own_elements(
    bodies: &[BodyMesh],
    cells: [usize; 3],
    costs: Option<&[u64]>,
    comm: &dyn Comm,
) -> (Shares, Vec<ElementList>) {
    let boxes = Boxes::new(bodies, cells);
    let shares = match costs {
        Some(costs) => by_cost(costs, comm.size()),
        None => by_cost(&vec![1; boxes.count()], comm.size()),
    };
    let first = shares.begin(comm.rank());
    let lists = (first..first + shares.0[comm.rank()]).map(|number| boxes.elements(number)).collect();
    (shares, lists)
}
