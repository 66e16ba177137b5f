//! Counts the elements of a mesh that no computation could use, before anything is computed with them.
//!
//! Only solvability is judged here: a small positive shape (`Kind::shape`) costs accuracy
//! and is merely reported.

use super::portion::Portion;
use crate::comm::Comm;
use crate::comm::words::{least, sum};
use crate::element::DEGENERATE;

/// What is wrong with a mesh, if anything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Elements looked at.
    pub elements: u64,
    /// Elements with negative volume: their corners are listed in the wrong sense.
    pub inverted: u64,
    /// Elements without volume: flat, or with coincident corners.
    pub degenerate: u64,
    /// Least shape among the sound elements, in (0, 1]; 1 if there is none.
    pub worst_shape: f64,
    /// Centre of the first element that is not sound.
    pub first: Option<[f64; 3]>,
}

impl Quality {
    /// Judges the elements that all ranks have of a mesh. Collective.
    pub fn of(comm: &dyn Comm, portion: &Portion) -> Self {
        let (mut inverted, mut degenerate, mut worst, mut first) = (0, 0, 1.0_f64, None::<[u64; 4]>);
        for (element, &number) in portion.numbers.iter().enumerate() {
            let places = portion.places(element);
            let shape = portion.elements.kind().shape(&places);
            if shape > DEGENERATE {
                worst = worst.min(shape);
                continue;
            }
            if shape < -DEGENERATE {
                inverted += 1;
            } else {
                degenerate += 1;
            }
            if first.is_none_or(|[first, ..]| u64::from(number) < first) {
                let count = places.len() as f64;
                let [x, y, z] = [0, 1, 2].map(|a| places.iter().map(|place| place[a] / count).sum::<f64>().to_bits());
                first = Some([number.into(), x, y, z]);
            }
        }
        let sums = sum(comm, vec![portion.len() as u64, inverted, degenerate]);
        // Numbers that are not negative are in the order of their bits.
        let worst = least(comm, Some([worst.to_bits()])).map_or(1.0, |[bits]| f64::from_bits(bits));
        let first = least(comm, first).map(|[_, x, y, z]| [x, y, z].map(f64::from_bits));
        Self { elements: sums[0], inverted: sums[1], degenerate: sums[2], worst_shape: worst, first }
    }

    /// Whether every element has a positive volume.
    pub fn is_sound(&self) -> bool {
        self.inverted == 0 && self.degenerate == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::solo::Solo;
    use crate::element::Kind;

    fn of_tets(tets: &[[[f64; 3]; 4]]) -> Quality {
        let (nodes, points) = ((0..4 * tets.len() as u32).collect::<Vec<_>>(), tets.concat());
        Quality::of(&Solo, &Portion::new(Kind::Tet4, 0, &nodes, |node| points[node as usize]))
    }

    #[test]
    fn inverted_and_flat_tetrahedra_are_counted() {
        let [a, b, c, d] = [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]];
        let regular = of_tets(&[[a, b, c, d]]);
        assert!(regular.is_sound() && (regular.worst_shape - 1.0).abs() < 1e-14 && regular.first.is_none());
        let bad = of_tets(&[[a, b, c, d], [a, c, b, d], [a, b, c, [0.0, 0.5, -0.5]], [a, a, b, c], [a; 4]]);
        assert_eq!((bad.elements, bad.inverted, bad.degenerate, bad.is_sound()), (5, 1, 3, false));
        assert_eq!(bad.first, Some([0.0; 3]));
    }
}
