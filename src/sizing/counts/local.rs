//! Lengths of a subdomain's factor and matrix from one like it, which is analysed.
//!
//! A box of cells is analysed as it is if it is small. A larger one is like a small cube: the factor grows with the nodes to the
//! power 4/3 (nested dissection: George 1973), the matrix with the nodes.

use crate::decomposition::{Bodies, Shape, Subdomain, number_bodies};
use crate::element::Kind;
use crate::feti::inverse::factor::Symbolic;
use crate::mesh::Brick;
use crate::sizing::memory::Lengths;

/// Boxes with more nodes are not analysed.
const MOST_NODES: u64 = 2500;

/// A box of so many cells.
pub(super) fn of_box(kind: Kind, cells: [usize; 3]) -> Lengths {
    let nodes = brick(cells).refined(kind.degree()).node_count();
    if nodes <= MOST_NODES {
        return analysed(kind, cells);
    }
    let edge = ((MOST_NODES as f64).cbrt() as usize - 1) / kind.degree();
    scaled(kind, [edge; 3], nodes as f64)
}

/// A subdomain of so many nodes, as round as a cube.
pub(super) fn of_nodes(kind: Kind, nodes: f64) -> Lengths {
    let degree = kind.degree() as f64;
    let edge = ((nodes.cbrt() - 1.0) / degree).round().max(1.0) as usize;
    scaled(kind, [edge; 3], nodes)
}

/// Of so many nodes, from a box of so many cells.
fn scaled(kind: Kind, cells: [usize; 3], nodes: f64) -> Lengths {
    let Lengths { factor, matrix, unknowns } = of_box(kind, cells);
    let larger = 3.0 * nodes / unknowns;
    Lengths { factor: factor * larger.powf(4.0 / 3.0), matrix: matrix * larger, unknowns: 3.0 * nodes }
}

fn analysed(kind: Kind, cells: [usize; 3]) -> Lengths {
    let bodies = number_bodies([(kind, Shape::Brick(brick(cells)), vec![0])]);
    let all = Bodies { bodies: &bodies, surfaces: &[] };
    let elements: Vec<u64> = (0..bodies[0].counts().elements).collect();
    let subdomain = Subdomain::of_brick(0, &all, 0, &elements);
    let symbolic = Symbolic::new(&subdomain);
    let (factor, matrix) = (symbolic.analysis().factor_length(), symbolic.pattern.rows.len());
    Lengths { factor: factor as f64, matrix: matrix as f64, unknowns: subdomain.dofs() as f64 }
}

fn brick(cells: [usize; 3]) -> Brick {
    Brick { origin: [0.0; 3], size: cells.map(|n| n as f64), cells }
}
