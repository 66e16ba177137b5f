//! Friction rows: `t . (weighted means over the copies of the slave side's nodes - the master's) = slip`, for directions `t` in the
//! plane of a contact pair.
//!
//! A pair with friction has two more rows of B, for orthonormal directions orthogonal to its normal. A direction that supports
//! hold on both sides of the pair has no row: what slides along it is prescribed, and friction along it acts on supports. A side is
//! held where the weights of its free nodes add up to less than a half. Next to a plane of symmetry the master has free nodes in the
//! pair, but they count for little: such a row has next to no flexibility, and forces without limit. Rows of one pair have one
//! scale, so that a disc of forces is a disc of multipliers. Where a node has several conditions (edges, corners) only directions
//! have rows that are independent of all its normals: others would be held twice.

use super::contact::{Side, row_along};
use super::prescribed::Prescribed;
use super::{Constraints, Fixed, Kind, Row};
use crate::contact::ContactPair;
use crate::contact::known::Pairs;
use crate::vector::{cross, dot, length};

/// Friction at a contact pair whose rows are on this rank.
#[derive(Clone, Debug, PartialEq)]
pub struct Slider {
    /// Number of the pair.
    pub pair: usize,
    /// Index of the contact in the scene.
    pub contact: usize,
    /// Row of the normal.
    pub normal: usize,
    /// Rows along the surface, one or two.
    pub tangents: Vec<Tangent>,
    /// Area of the pair that the limit of Tresca's law acts on.
    pub limit_area: f64,
}

/// A friction row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tangent {
    /// The row.
    pub row: usize,
    /// Unit vector along the surface.
    pub direction: [f64; 3],
}

/// A pair with friction that has less than two friction rows, as supports hold both of its sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Guided {
    /// Number of the pair.
    pub pair: usize,
    /// Unit normal of the pair.
    pub normal: [f64; 3],
    /// The axes that supports hold.
    pub held: [bool; 3],
    /// What they fix along these.
    pub fixed: Vec<Fixed>,
}

/// A side of a pair moves along an axis if the weights of its nodes that supports leave free add up to more than this.
const FREE: f64 = 0.5;

/// A direction is in the plane of others up to this sine.
const FLAT: f64 = 1e-6;

/// Orthonormal directions for the friction rows of a pair: orthogonal to its normal, to the directions `taken` at its node, and to
/// axes that are not `free`.
pub(super) fn directions(normal: [f64; 3], free: [bool; 3], taken: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let axis = |a: usize| std::array::from_fn(|b| f64::from(a == b));
    let fixed = (0..3).filter(|&a| !free[a]).map(axis);
    let mut basis: Vec<[f64; 3]> = Vec::new();
    let mut add = |vector: [f64; 3]| {
        let mut left = vector;
        // Twice is enough.
        for _ in 0..2 {
            for known in &basis {
                let along = dot(left, *known);
                left = std::array::from_fn(|a| left[a] - along * known[a]);
            }
        }
        let size = length(left);
        (size > FLAT).then(|| {
            basis.push(left.map(|x| x / size));
            basis[basis.len() - 1]
        })
    };
    add(normal);
    for known in fixed.chain(taken.iter().copied()) {
        add(known);
    }
    // The axis that is farthest from the normal first.
    let least = (0..3).min_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs())).unwrap_or(0);
    let first = add(axis(least));
    let second = first.and_then(|first| add(cross(normal, first)));
    let rest = [add(axis((least + 1) % 3)), add(axis((least + 2) % 3))];
    [first, second].into_iter().chain(rest).flatten().collect()
}

/// The friction rows of pair `number`, with their directions; `taken` are the directions of other rows at its node.
pub(super) fn rows<'a>(
    number: usize,
    pair: &ContactPair,
    sides: &impl Fn(u64) -> Side<'a>,
    taken: &[[f64; 3]],
) -> Vec<(Row, [f64; 3])> {
    let found = directions(pair.normal, free(pair, sides), taken).into_iter().zip(0..);
    let row = |(direction, axis): ([f64; 3], u8)| {
        let row = row_along(direction, Kind::Friction { pair: number, axis }, pair, sides).ok()?;
        Some((row, direction))
    };
    let mut rows: Vec<(Row, [f64; 3])> = found.filter_map(row).collect();
    let scale = rows.iter().fold(f64::INFINITY, |scale, (row, _)| row.scale.min(scale));
    rows.iter_mut().for_each(|(row, _)| row.lengthen(scale / row.scale));
    rows
}

/// The axes along which supports leave a side of the pair free.
fn free<'a>(pair: &ContactPair, sides: &impl Fn(u64) -> Side<'a>) -> [bool; 3] {
    std::array::from_fn(|a| {
        let of = |nodes: &[(u64, f64)]| -> f64 {
            nodes.iter().filter(|(node, _)| sides(*node).1[a].is_none()).map(|(_, weight)| weight).sum()
        };
        of(&pair.slaves).max(of(&pair.masters)) > FREE
    })
}

/// What supports hold on both sides of pair `number`, if they do along any axis.
pub(super) fn guided<'a>(number: usize, pair: &ContactPair, sides: &impl Fn(u64) -> Side<'a>) -> Option<Guided> {
    let held = free(pair, sides).map(|free| !free);
    let axes = || (0..3).filter(|&axis| held[axis]);
    let of_node = |(node, weight): (u64, f64)| {
        let supports = sides(node).1;
        axes().filter_map(move |axis| Some(Fixed { support: supports[axis]?, axis, weight }))
    };
    let fixed = pair.nodes().flat_map(of_node).collect();
    held.contains(&true).then_some(Guided { pair: number, normal: pair.normal, held, fixed })
}

impl Guided {
    /// How far its sides slide along each other by what moves supports and obstacles (length).
    pub(super) fn slide(&self, at: &Prescribed) -> f64 {
        let drag = at.drags.get(&self.pair).copied().unwrap_or_default();
        let mut slide: [f64; 3] = std::array::from_fn(|axis| if self.held[axis] { -drag[axis] } else { 0.0 });
        self.fixed.iter().for_each(|f| slide[f.axis] += f.weight * at.displacements[f.support][f.axis]);
        let across = dot(slide, self.normal);
        slide.iter_mut().zip(self.normal).for_each(|(slide, n)| *slide -= across * n);
        length(slide)
    }
}

impl Constraints {
    /// Finds the sliders, once all rows are there; `directions` are those of the friction rows, in their order.
    pub(super) fn find_sliders(&mut self, pairs: &Pairs, directions: Vec<[f64; 3]>) {
        let mut directions = directions.into_iter();
        let mut normals = std::collections::HashMap::new();
        for (row, of) in self.rows.iter().enumerate() {
            match of.kind {
                Kind::Contact { pair } => {
                    normals.insert(pair, row);
                }
                Kind::Friction { pair, .. } => {
                    let tangent = Tangent { row, direction: directions.next().expect("one for each row") };
                    match self.sliders.last_mut().filter(|last| last.pair == pair) {
                        Some(last) => last.tangents.push(tangent),
                        None => {
                            let ContactPair { contact, limit_area, .. } = pairs[pair];
                            let tangents = vec![tangent];
                            self.sliders.push(Slider { pair, contact, normal: normals[&pair], tangents, limit_area });
                        }
                    }
                }
                Kind::Gluing | Kind::Support { .. } => {}
            }
        }
    }

    /// Adds to right-hand sides how far obstacles are moved along friction rows.
    pub(super) fn add_drags(&self, at: &Prescribed, rhs: &mut [f64]) {
        for Slider { pair, tangents, .. } in &self.sliders {
            let Some(drag) = at.drags.get(pair) else { continue };
            for Tangent { row, direction } in tangents {
                rhs[*row] += self.rows[*row].scale * dot(*direction, *drag);
            }
        }
    }
}

#[cfg(test)]
mod tests;
