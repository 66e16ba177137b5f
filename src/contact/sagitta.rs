//! Whether facets of curved surfaces that are meant to fit resolve their gap or overlap.
//!
//! Facets of width `w` whose normals differ by the angle `t` across an edge stand for a curvature `t / w`, and off the surface
//! by the sagitta `w t / 8`. Two surfaces that are curved alike, one convex and the other concave, and whose meshes do not
//! match, so have distances that are wrong by as much, in turns from facet to facet. Evening that out takes a strain of
//! `t / 8`, an overlap `g` itself one of about `g t / w`, its share in the radius. So pressures follow the facets where `g` is
//! less than a part of `w`: at a half they are off by a quarter, measured on press fits of cylinders. That says more than
//! `g` below the sagitta. A ball on a plane is no such case: its distance grows as fast as the sagitta, and the error falls.
//!
//! Faces with quadratic functions are asked for their normals in the middle of edges: curved ones have no kink there. Edges
//! with a kink of more than half a right angle are edges of the body.

use std::collections::BTreeMap;

use super::ContactPair;
use super::patch::Patch;
use super::surface::GatheredSurface;
use crate::comm::exact::exact_sums;
use crate::comm::meeting::look_up;
use crate::comm::{Comm, maximum, sums};
use crate::mesh::surface::{area, normal, quadratic_normal};
use crate::vector::{difference, dot};

/// Kinks (radians) that are round-off, and that are edges of the body.
const KINKS: [f64; 2] = [1e-3, 0.8];

/// Curvatures that differ by less than this share are alike.
const ALIKE: f64 = 0.5;

/// Distances below this share of a facet's width are not resolved.
const RESOLVED: f64 = 0.5;

/// So many conditions are no point from where curved surfaces part.
const SEVERAL: usize = 4;

/// Mean distance over a facet from the arc above it, in sagittas.
const MEAN: f64 = 2.0 / 3.0;

/// Conditions that facets do not resolve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unresolved {
    /// How many.
    pub conditions: usize,
    /// Largest sagitta there (length).
    pub sagitta: f64,
    /// Mean distance there of the surfaces that facets stand for (length).
    pub distance: f64,
}

/// A surface at a node, by the edge that stands off most.
#[derive(Clone, Copy, Default)]
struct Bend {
    sagitta: f64,
    /// Of its facets.
    width: f64,
    /// Positive where the body is convex.
    curvature: f64,
}

/// The conditions of non-matching surfaces that are not resolved, if there are several. Collective.
pub fn unresolved(comm: &dyn Comm, slave: &Patch, master: &Patch, pairs: &[ContactPair]) -> Option<Unresolved> {
    let (slave, master) = (&slave.surface, &master.surface);
    let (of_slave, of_master) = (bends(slave), bends(master));
    let opposite = |pair: &ContactPair| pair.masters.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(node, _)| *node);
    // Of a node with several parts the first counts, as look_up has it.
    let bend = |index: usize| {
        let Bend { sagitta, width, curvature } = of_master[index];
        ([master.nodes[index]], [sagitta, width, curvature].map(f64::to_bits).to_vec())
    };
    let known = (0..master.nodes.len()).filter(|&index| master.tells(index)).map(bend);
    let told = |pair: &&ContactPair| slave.index(pair.slave, pair.part).is_some_and(|index| slave.tells(index));
    let wanted = pairs.iter().filter(told).filter_map(opposite).map(|node| [node]);
    let of_masters = look_up(comm, known, wanted);
    let mut found = Unresolved { conditions: 0, sagitta: 0.0, distance: 0.0 };
    let mut distances = Vec::new();
    for pair in pairs.iter().filter(told) {
        let Some([sagitta, width, curvature]) = opposite(pair).and_then(|node| {
            of_masters.get(&[node]).and_then(|of| of.first_chunk::<3>()).map(|of| of.map(f64::from_bits))
        }) else {
            continue;
        };
        let of_slave = slave.index(pair.slave, pair.part).map_or(Bend::default(), |index| of_slave[index]);
        let sides = [of_slave, Bend { sagitta, width, curvature }];
        let [one, other] = sides.map(|side| side.curvature);
        let sagitta = sides[0].sagitta.max(sides[1].sagitta);
        let is_alike = one * other < 0.0 && (one + other).abs() < ALIKE * one.abs().max(other.abs());
        let distance = pair.gap;
        if is_alike && distance.abs() <= RESOLVED * sides[0].width.max(sides[1].width) {
            let off: f64 = sides.iter().map(|side| MEAN * side.sagitta * side.curvature.signum()).sum();
            found.conditions += 1;
            found.sagitta = found.sagitta.max(sagitta);
            distances.push([pair.area * (distance - off), pair.area]);
        }
    }
    let [distance, area] = exact_sums(comm, &distances);
    let [conditions] = sums(comm, [found.conditions as u64]).map(|count| count as usize);
    let found = Unresolved { conditions, sagitta: maximum(comm, &[found.sagitta])[0], distance: distance / area };
    (conditions >= SEVERAL).then_some(found)
}

/// A face beside an edge: its normal in the middle of the edge, its centre and its width across the edge.
type Beside = ([f64; 3], [f64; 3], f64);

fn bends(surface: &GatheredSurface) -> Vec<Bend> {
    let mut edges: BTreeMap<Vec<usize>, Vec<Beside>> = BTreeMap::new();
    let mut add = |nodes: &[usize], corners: [usize; 3], along: Option<[f64; 3]>| {
        let [a, b, c] = corners.map(|node| surface.points[node]);
        let edge = difference(b, a);
        let width = 2.0 * area(&[a, b, c]) / dot(edge, edge).sqrt();
        let centre = std::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0);
        let mut key = nodes.to_vec();
        key.sort_unstable();
        edges.entry(key).or_default().extend(along.map(|along| (along, centre, width)));
    };
    if surface.quadratic.is_empty() {
        for &[a, b, c] in &surface.triangles {
            let along = normal(&[a, b, c].map(|node| surface.points[node]));
            [[a, b, c], [b, c, a], [c, a, b]].into_iter().for_each(|turned| add(&turned[..2], turned, along));
        }
    }
    for &[a, b, c, ab, bc, ca] in &surface.quadratic {
        for turned in [[a, b, c, ab, bc, ca], [b, c, a, bc, ca, ab], [c, a, b, ca, ab, bc]] {
            let along = middle_normal(turned.map(|node| surface.points[node]));
            add(&[turned[0], turned[1], turned[3]], [turned[0], turned[1], turned[2]], along);
        }
    }
    let mut bends = vec![Bend::default(); surface.nodes.len()];
    for (nodes, beside) in &edges {
        for (k, one) in beside.iter().enumerate() {
            for other in &beside[..k] {
                let bend = bend(one, other);
                let larger = |node: &&usize| bend.sagitta > bends[**node].sagitta;
                let raised: Vec<usize> = nodes.iter().filter(larger).copied().collect();
                raised.into_iter().for_each(|node| bends[node] = bend);
            }
        }
    }
    bends
}

/// Normal of a quadratic face in the middle of its first edge.
fn middle_normal(face: [[f64; 3]; 6]) -> Option<[f64; 3]> {
    let vector = quadratic_normal(&face, [0.5, 0.5, 0.0]);
    let size = dot(vector, vector).sqrt();
    (size > 0.0).then(|| vector.map(|x| x / size))
}

fn bend(one: &Beside, other: &Beside) -> Bend {
    let cosine = dot(one.0, other.0).clamp(-1.0, 1.0);
    let chord = difference(one.0, other.0);
    let kink = if cosine > 0.0 { 2.0 * (0.5 * dot(chord, chord).sqrt()).min(1.0).asin() } else { f64::INFINITY };
    if !(KINKS[0]..KINKS[1]).contains(&kink) {
        return Bend::default();
    }
    let width = one.2.max(other.2);
    // Seen from a convex body's face its neighbour is below.
    let sign = if dot(one.0, difference(other.1, one.1)) < 0.0 { 1.0 } else { -1.0 };
    Bend { sagitta: width * kink / 8.0, width, curvature: sign * kink / width }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::solo::Solo;
    use crate::contact::mortar;
    use crate::contact::mortar::tests::grid;

    const RADIUS: f64 = 2.0;

    /// A strip of a cylinder about the y axis of `n` facets over 1.2 radians, the outside of a body if `outside`.
    fn strip(n: usize, first: u64, outside: bool, radius: f64) -> GatheredSurface {
        grid([n, 3], first, !outside, |x, y| {
            let angle = 1.2 * (x - 0.5);
            [radius * angle.sin(), y, radius * angle.cos()]
        })
    }

    fn sides(n: usize, m: usize, socket: f64) -> Option<Unresolved> {
        let (inner, outer) = (strip(n, 100, true, RADIUS), strip(m, 900, false, socket));
        let held = vec![[false; 3]; inner.nodes.len()];
        let pairs = mortar::pair(0, "fit", &inner, &outer, &held).expect("they face each other").pairs;
        unresolved(&Solo, &Patch::alone(inner), &Patch::alone(outer), &pairs)
    }

    #[test]
    fn facets_that_fit_are_told_with_their_sagitta_and_the_distance_that_is_meant() {
        for (n, m) in [(6, 7), (9, 4), (4, 9)] {
            let found = sides(n, m, RADIUS).expect("all distances are those of facets");
            let angle = 1.2 / n.min(m) as f64;
            let exact = RADIUS * (1.0 - (0.5 * angle).cos());
            assert!((found.sagitta / exact - 1.0).abs() < 0.01, "{found:?} {exact}");
            assert!(found.distance.abs() < 0.4 * exact, "{found:?} {exact}");
            assert!(found.conditions > 8, "{found:?}");
        }
    }

    #[test]
    fn wide_gaps_and_surfaces_curved_otherwise_are_not_told() {
        assert!(sides(6, 7, RADIUS + 0.1).is_some());
        assert_eq!(sides(6, 7, RADIUS + 0.3), None);
        assert_eq!(sides(6, 7, 10.0 * RADIUS), None);
        let flat = grid([5, 4], 900, true, |x, y| [3.0 * x - 1.5, y, RADIUS]);
        let inner = strip(6, 100, true, RADIUS);
        let held = vec![[false; 3]; inner.nodes.len()];
        let pairs = mortar::pair(0, "roll", &inner, &flat, &held).expect("they face each other").pairs;
        assert_eq!(unresolved(&Solo, &Patch::alone(inner), &Patch::alone(flat), &pairs), None);
    }
}
