//! Cutting brick bodies into boxes of cells, each rank generating only its own.

use super::{BodyMesh, ElementList, even_shares};
use crate::comm::{Comm, Shares};

/// Boxes are numbered body by body, x fastest. Returns the shares and this rank's element lists.
pub(crate) fn own_elements(bodies: &[BodyMesh], cells: [usize; 3], comm: &dyn Comm) -> (Shares, Vec<ElementList>) {
    let counts = |body: &BodyMesh| -> [usize; 3] { std::array::from_fn(|a| body.brick.cells[a] / cells[a]) };
    let boxes: Vec<usize> = bodies.iter().map(|body| counts(body).iter().product()).collect();
    let shares = even_shares(boxes.iter().sum(), comm.size());
    let first = shares.begin(comm.rank());
    let mut body = 0;
    let mut before = 0;
    let lists = (first..first + shares.0[comm.rank()])
        .map(|subdomain| {
            while subdomain >= before + boxes[body] {
                before += boxes[body];
                body += 1;
            }
            let [nx, ny, _] = counts(&bodies[body]);
            let number = subdomain - before;
            let at = [number % nx, number / nx % ny, number / (nx * ny)];
            let low: [usize; 3] = std::array::from_fn(|a| at[a] * cells[a]);
            let mut elements = Vec::new();
            for k in low[2]..low[2] + cells[2] {
                for j in low[1]..low[1] + cells[1] {
                    let row = bodies[body].brick.cell([low[0], j, k]);
                    elements.extend(6 * row..6 * (row + cells[0] as u64));
                }
            }
            (body, elements)
        })
        .collect();
    (shares, lists)
}
