//! Parts with flat faces: an element goes to the part that most of its surface is in.
//!
//! Faces count by the squares of their areas, which is what resists a change of the displacement across the element. So no part
//! keeps a layer of flat elements between layers of another: that would be a tongue as thin as they are.

use std::collections::HashMap;

use crate::comm::Comm;
use crate::comm::common::common;
use crate::mesh::Portion;
use crate::mesh::faces::{Neighbours, OUTSIDE};
use crate::mesh::surface::area_vector;
use crate::mesh::wholes::Wholes;
use crate::vector::dot;

/// How often elements may move; to parts of higher and of lower number by turns, so that no two neighbours change places.
const SWEEPS: usize = 12;

/// The faces of elements, and the parts behind them.
pub struct Sides<'a> {
    comm: &'a dyn Comm,
    neighbours: Neighbours,
    /// Faces of an element.
    faces: usize,
    /// Square of the area of each face, element by element.
    weights: Vec<f64>,
    /// Own faces behind which each rank has the element, in the same order there.
    common: Vec<Vec<u32>>,
}

impl<'a> Sides<'a> {
    /// Of a body's elements. Collective.
    pub fn new(comm: &'a dyn Comm, portion: &Portion) -> Self {
        let neighbours = Neighbours::new(portion.nodes.len(), &portion.elements);
        let kind = portion.elements.kind();
        let faces = kind.faces().len();
        let corners = kind.cell().corners_of_face();
        let nodes = |face: usize| portion.elements.face(face / faces, face % faces);
        let weight = |face: usize| {
            let points: Vec<[f64; 3]> =
                nodes(face)[..corners].iter().map(|&node| portion.points[node as usize]).collect();
            let fan = (2..corners).map(|k| area_vector(&[points[0], points[k - 1], points[k]]));
            let area = fan.fold([0.0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]]);
            dot(area, area)
        };
        let count = faces * portion.len();
        let is_open = |face: &u32| neighbours.behind(*face as usize / faces)[*face as usize % faces] == OUTSIDE;
        let open: Vec<u32> = (0..count as u32).filter(is_open).collect();
        let key = |&face: &u32| portion.face_key(face as usize / faces, face as usize % faces);
        let common = common(comm, &open.iter().map(key).collect::<Vec<_>>());
        let common =
            common.into_iter().map(|places| places.into_iter().map(|at| open[at as usize]).collect()).collect();
        Self { comm, faces, weights: (0..count).map(weight).collect(), common, neighbours }
    }

    /// Moves elements to the part that most of their surface is in. Collective.
    pub fn flatten(&self, part: &mut [u32], wholes: &Wholes) {
        for sweep in 0..SWEEPS {
            let (old, foreign) = (part.to_vec(), self.foreign(part));
            for (element, part) in part.iter_mut().enumerate() {
                let own = *part;
                // Faces to each part that it may move to, and to its own, which comes first.
                let mut sums = vec![(own, 0.0)];
                for face in self.faces * element..self.faces * (element + 1) {
                    let other = self.behind(&old, &foreign, face);
                    let may_move =
                        |other: u32| (other > own) == (sweep % 2 == 0) && wholes.of_part(other) == wholes.of_part(own);
                    match sums.iter_mut().find(|sum| Some(sum.0) == other) {
                        Some(sum) => sum.1 += self.weights[face],
                        None => {
                            sums.extend(other.filter(|&other| may_move(other)).map(|other| (other, self.weights[face])))
                        }
                    }
                }
                let mut best = sums[0];
                sums[1..].iter().for_each(|&sum| {
                    if sum.1 > best.1 * (1.0 + ROUNDING) || (best.0 != own && sum.1 == best.1 && sum.0 < best.0) {
                        best = sum;
                    }
                });
                *part = best.0;
            }
        }
    }

    /// The parts that other ranks have behind own faces. Collective.
    fn foreign(&self, part: &[u32]) -> HashMap<u32, u32> {
        let own = |&face: &u32| u64::from(part[face as usize / self.faces]);
        let outgoing = self.common.iter().map(|faces| faces.iter().map(own).collect()).collect();
        let received = self.comm.all_to_all(outgoing);
        let each = self.common.iter().zip(received).flat_map(|(faces, theirs)| faces.iter().copied().zip(theirs));
        each.map(|(face, part)| (face, part as u32)).collect()
    }

    /// The part behind a face, if there is one.
    fn behind(&self, part: &[u32], foreign: &HashMap<u32, u32>, face: usize) -> Option<u32> {
        match self.neighbours.behind(face / self.faces)[face % self.faces] {
            OUTSIDE => foreign.get(&(face as u32)).copied(),
            other => Some(part[other as usize]),
        }
    }
}

/// Sums that differ by less are equal.
const ROUNDING: f64 = 1e-9;

#[cfg(test)]
mod tests;
