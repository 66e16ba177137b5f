//! Whether a mesh is as whole as it looks: what touches must share nodes and faces.
//!
//! Elements hang together by their faces, so all that can be wrong lies between faces that have one element only. Two such
//! faces may have nodes in common; beyond these they must be apart, by more than [`NEAR`] times the least height of the
//! elements there. Through an element two faces are at least as far apart as it is high, so that flat elements, layers and
//! wedges raise no alarm, nor do slits that are wider than that. Nodes that coincide and nodes that hang are told from faces
//! that cross. Quadratic faces count as the four triangles between their nodes, quadrilaterals as the four around their
//! centre, so where they are curved the sides of a slit must be farther apart than these triangles are from the faces.
//!
//! Other flaws are found without geometry: cells on both sides of quadrilaterals that are cut along different diagonals leave
//! holes of the shape of a tetrahedron, quadratic elements can share corners but not middles, and pieces can hang together by
//! nodes without a face. Several pieces that do not touch are sound, unless one is inside of another.

//!
//! Each rank has some of the elements, looks at these, and at what others have beside them. All hear the same of what was found.
//! What shows first belongs to the mesh: it is that of the least elements.

mod facet;

use std::collections::{BTreeMap, HashSet};

use thiserror::Error;

use super::boxes::{Box3, BoxTree, around};
use super::faces::OUTSIDE;
use super::joints::Joints;
use super::near::{of_points, pierces, to_triangle, volume};
use super::portion::Portion;
use crate::comm::words::{least, sum};
use crate::comm::{Comm, all_gather_u64};

pub use facet::NEAR;
use facet::{Facet, facets, hole_between, sorted, with_others};

/// Why a mesh only looks whole, with what to do about it in Gmsh.
#[derive(Debug, Error, PartialEq)]
pub enum Flaw {
    /// Boundary faces that touch without being joined.
    #[error(
        "the mesh is torn where it looks whole: {}; mesh both sides alike, with `Coherence;` or `BooleanFragments` before `Mesh 3;` \
         (`Coherence Mesh;` joins nodes that coincide); what only touches is a body of its own, with a contact; a slit must be wider \
         than {NEAR:e} of its elements, and than the facets of its sides are deep",
        torn(*coincident, *hanging, *crossing)
    )]
    Torn {
        /// Nodes that lie where other nodes do.
        coincident: usize,
        /// Nodes that lie elsewhere in faces without them.
        hanging: usize,
        /// Faces that have points with others in common, but no nodes near them.
        crossing: usize,
    },
    /// Faces around four nodes without an element between them.
    #[error(
        "there are {0} holes of one tetrahedron: an element is missing, or hexahedra, prisms or pyramids meet other cells that cut \
         their quadrilaterals along the other diagonal; let pyramids go between, or mesh both sides with `Recombine`"
    )]
    Holes(usize),
    /// Faces that share corners, but not the middles of their edges.
    #[error(
        "{0} faces between elements share their corners, but not the nodes in the middle of their edges: save the mesh again after \
         `Coherence Mesh;` or `SetOrder 1; SetOrder 2;`"
    )]
    Middles(usize),
    /// Pieces with nodes in common but no face.
    #[error(
        "{0} nodes alone join parts that have no face in common, so that these turn about a corner or an edge; join them by faces, \
         or take them apart"
    )]
    Hinge(usize),
    /// Pieces inside of others.
    #[error(
        "{0} pieces lie inside of others and have no node in common with them: cut them out (`BooleanFragments` joins, \
         `BooleanDifference` leaves room)"
    )]
    Inside(usize),
}

fn torn(coincident: usize, hanging: usize, crossing: usize) -> String {
    let parts = [
        (coincident, "nodes coincide with others"),
        (hanging, "nodes hang in faces or on edges of elements that do not have them"),
        (crossing, "faces cross others"),
    ];
    let parts = parts.into_iter().filter(|(count, _)| *count > 0);
    parts.map(|(count, what)| format!("{count} {what}")).collect::<Vec<_>>().join(", ")
}

/// A flaw and where it shows first.
#[derive(Debug, PartialEq)]
pub struct Found {
    /// What is wrong.
    pub flaw: Flaw,
    /// Where.
    pub near: [f64; 3],
    /// Regions of the elements there.
    pub regions: [usize; 2],
}

/// Where a flaw shows: what orders it, then the place, then the regions of two elements.
type Site = [u64; 7];

fn site(order: [u64; 2], near: [f64; 3], regions: [u32; 2]) -> Site {
    let [x, y, z] = near.map(f64::to_bits);
    [order[0], order[1], x, y, z, regions[0].into(), regions[1].into()]
}

/// The flaw, if it was found somewhere.
fn found(flaw: Flaw, first: Option<Site>) -> Result<(), Found> {
    let Some([_, _, x, y, z, one, other]) = first else { return Ok(()) };
    Err(Found { flaw, near: [x, y, z].map(f64::from_bits), regions: [one as usize, other as usize] })
}

/// The face-connected piece of each own element, numbered by their first elements, and how many there are. Collective.
///
/// # Errors
/// If the mesh only looks whole.
pub fn pieces(comm: &dyn Comm, portion: &Portion, joints: &Joints) -> Result<(Vec<u32>, usize), Found> {
    middles(comm, portion, joints)?;
    let (pieces, count) = joints.pieces(comm, portion, &vec![0; portion.len()]);
    let facets = with_others(comm, facets(comm, portion, joints));
    let boxes: Vec<Box3> = facets.iter().map(Facet::room).collect();
    let tree = BoxTree::new(&boxes);
    apart(comm, portion, &facets, &tree)?;
    if count > 1 {
        hinges(comm, portion, joints, &pieces)?;
        inside(comm, portion, (&facets, &tree), &pieces)?;
    }
    Ok((pieces, count))
}

/// Refuses elements that share corners of a face, but not its middles.
fn middles(comm: &dyn Comm, portion: &Portion, joints: &Joints) -> Result<(), Found> {
    let kind = portion.elements.kind();
    if kind.middles().is_empty() {
        return Ok(());
    }
    let (mut count, mut first) = (0, None::<Site>);
    let mut look = |element: usize, side: usize, region: u32, has: &dyn Fn(u32) -> bool| {
        let face = portion.elements.face(element, side);
        if let Some(&lost) = face[kind.cell().corners_of_face()..].iter().find(|&&node| !has(node)) {
            count += 1;
            let order = [portion.numbers[element].into(), side as u64];
            let lost = site(order, portion.points[lost as usize], [portion.wholes[element], region]);
            first = Some(first.map_or(lost, |first| first.min(lost)));
        }
    };
    for (element, side) in joints.inner(portion) {
        let other = joints.own.behind(element)[side] as usize;
        if other != OUTSIDE as usize {
            look(element, side, portion.wholes[other], &|node| portion.elements.get(other).contains(&node));
        }
    }
    for across in joints.across.iter().flatten() {
        let (element, side) = (across.face as usize / kind.faces().len(), across.face as usize % kind.faces().len());
        if portion.numbers[element] < across.element {
            look(element, side, across.region, &|node| across.middles.contains(&portion.nodes[node as usize]));
        }
    }
    found(Flaw::Middles(sum(comm, vec![count])[0] as usize), least(comm, first))
}

/// Refuses boundary faces that touch beyond the nodes that they share.
fn apart(comm: &dyn Comm, portion: &Portion, facets: &[Facet], tree: &BoxTree) -> Result<(), Found> {
    let boundary: HashSet<[u64; 3]> = match portion.elements.kind().gmsh().is_split() {
        true => facets.iter().map(|facet| sorted(facet.ids)).collect(),
        false => HashSet::new(),
    };
    let (mut tears, mut holes, mut hole) = (Tears::default(), Marks::new(), None::<Site>);
    tree.pairs(|one, other| {
        let [one, other] = [one, other].map(|k| &facets[k as usize]);
        let (one, other) = if one.number < other.number { (one, other) } else { (other, one) };
        // The rank of the first looks at both.
        if one.face() == other.face() || one.element.is_none() {
            return;
        }
        match hole_between(one, other, &boundary) {
            Some(nodes) => {
                let corners = || [one, other].into_iter().flat_map(|facet| facet.ids.into_iter().zip(facet.corners));
                let near = corners().find(|(id, _)| *id == nodes[0]).expect("it is a corner of one of them").1;
                let here = site([one.number, other.number], near, [one.region, other.region]);
                hole = Some(hole.map_or(here, |first| first.min(here)));
                holes.insert([nodes[0] << 32 | nodes[1], nodes[2] << 32 | nodes[3]], FIRST);
            }
            None => tears.add(one, other),
        }
    });
    let first = least(comm, tears.first);
    if first.is_some() {
        found(tears.flaw(comm), first)?;
    }
    match least(comm, hole) {
        Some(first) => found(Flaw::Holes(count(comm, holes)[0]), Some(first)),
        None => Ok(()),
    }
}

/// What is known of nodes, faces or holes.
type Marks = BTreeMap<[u64; 2], u64>;
const FIRST: u64 = 1;
const SECOND: u64 = 2;

/// How many have the first mark on some rank, and how many only the second. Collective.
fn count(comm: &dyn Comm, marks: Marks) -> [usize; 2] {
    let mut outgoing = vec![Vec::new(); comm.size()];
    for ([a, b], mark) in marks {
        outgoing[((a ^ b) % comm.size() as u64) as usize].extend([a, b, mark]);
    }
    let mut all = Marks::new();
    for &[a, b, mark] in comm.all_to_all(outgoing).iter().flat_map(|theirs| theirs.as_chunks::<3>().0) {
        *all.entry([a, b]).or_default() |= mark;
    }
    let first = all.values().filter(|mark| **mark & FIRST > 0).count();
    let sums = sum(comm, vec![first as u64, (all.len() - first) as u64]);
    [sums[0] as usize, sums[1] as usize]
}

/// Where boundary faces touch that should not.
#[derive(Default)]
struct Tears {
    /// First those that coincide, second those that hang.
    nodes: Marks,
    /// First those with nodes near them, second those that cross.
    faces: Marks,
    first: Option<Site>,
}

impl Tears {
    /// Looks at two facets.
    fn add(&mut self, a: &Facet, b: &Facet) {
        let near = a.near.min(b.near);
        if a.is_aside(b, near) || b.is_aside(a, near) {
            return;
        }
        let mut place = None;
        for (one, two) in [(a, b), (b, a)] {
            for (node, x) in one.own(two).filter(|(node, _)| Facet::is_node(*node)) {
                if to_triangle(x, &two.corners) <= near * near {
                    let met = two.own(one).any(|(id, y)| Facet::is_node(id) && of_points(x, y) <= near * near);
                    *self.nodes.entry([node, 0]).or_default() |= if met { FIRST } else { SECOND };
                    place.get_or_insert(x);
                }
            }
        }
        let mark = if place.is_some() { FIRST } else { SECOND };
        if place.is_none() && a.crosses(b, near) {
            place = Some(a.corners[0]);
        }
        let Some(place) = place else { return };
        [a, b].into_iter().for_each(|facet| *self.faces.entry([facet.face(), 0]).or_default() |= mark);
        let here = site([a.number, b.number], place, [a.region, b.region]);
        self.first = Some(self.first.map_or(here, |first| first.min(here)));
    }

    fn flaw(self, comm: &dyn Comm) -> Flaw {
        let [coincident, hanging] = count(comm, self.nodes);
        let [_, crossing] = count(comm, self.faces);
        Flaw::Torn { coincident, hanging, crossing }
    }
}

/// Refuses pieces that share nodes.
fn hinges(comm: &dyn Comm, portion: &Portion, joints: &Joints, pieces: &[u32]) -> Result<(), Found> {
    // The first element around each node, its piece and its region.
    let mut firsts = vec![[u64::MAX; 3]; portion.nodes.len()];
    for (element, nodes) in portion.elements.iter().enumerate() {
        let its = [portion.numbers[element], pieces[element], portion.wholes[element]].map(u64::from);
        nodes.iter().for_each(|&node| firsts[node as usize] = firsts[node as usize].min(its));
    }
    joints.agree(comm, &mut firsts, |mine, theirs| *mine = (*mine).min(theirs));
    let (mut nodes, mut first) = (Marks::new(), None::<Site>);
    for (element, its) in portion.elements.iter().enumerate() {
        for (k, &node) in (0..).zip(its) {
            let [_, piece, region] = firsts[node as usize];
            if piece != u64::from(pieces[element]) {
                nodes.insert([portion.nodes[node as usize].into(), 0], FIRST);
                let order = [portion.numbers[element].into(), k];
                let here = site(order, portion.points[node as usize], [region as u32, portion.wholes[element]]);
                first = Some(first.map_or(here, |first| first.min(here)));
            }
        }
    }
    found(Flaw::Hinge(count(comm, nodes)[0]), least(comm, first))
}

/// Refuses pieces inside of others: a ray from there leaves another piece once more than it enters it.
fn inside(
    comm: &dyn Comm,
    portion: &Portion,
    (facets, tree): (&[Facet], &BoxTree),
    pieces: &[u32],
) -> Result<(), Found> {
    // A place within the first element of each piece that lines through nodes hardly meet.
    let mut firsts: BTreeMap<u32, (u32, usize)> = BTreeMap::new();
    for (element, (&piece, &number)) in pieces.iter().zip(&portion.numbers).enumerate() {
        let first = firsts.entry(piece).or_insert((number, element));
        *first = (*first).min((number, element));
    }
    let place = |(&piece, &(number, element)): (&u32, &(u32, usize))| {
        let corners = portion.elements.get(element)[..4].iter().map(|&n| portion.points[n as usize]);
        let weighted: Vec<_> = corners.zip([0.2137, 0.3391, 0.1873, 0.2599]).collect();
        let x = std::array::from_fn(|i| weighted.iter().map(|(corner, weight)| weight * corner[i]).sum());
        site([piece.into(), number.into()], x, [portion.wholes[element], 0])
    };
    let mut places: Vec<Site> =
        all_gather_u64(comm, firsts.iter().map(place).collect::<Vec<_>>().as_flattened()).as_chunks().0.to_vec();
    places.sort_unstable();
    places.dedup_by_key(|place| place[0]);
    // How often rays leave own faces of each piece, and the first element that they leave with its region.
    let mut mine = Vec::new();
    for &[piece, _, x, y, z, ..] in &places {
        let x = [x, y, z].map(f64::from_bits);
        let mut leaves: BTreeMap<u32, (i64, u64, u32)> = BTreeMap::new();
        tree.meeting(&[x, [f64::INFINITY, x[1], x[2]]], |k| {
            let Facet { corners, element: Some(element), number, region, .. } = &facets[k as usize] else { return };
            let away = [x, [2.0 * around(corners)[1][0] - x[0], x[1], x[2]]];
            if pierces(&away, corners, 0.0) {
                let [a, b, c] = *corners;
                let its = leaves.entry(pieces[*element as usize]).or_insert((0, u64::MAX, 0));
                its.0 += if volume(a, b, c, x) < 0.0 { 1 } else { -1 };
                (its.1, its.2) = (its.1, its.2).min((*number, *region));
            }
        });
        let packed = |(other, (sum, number, region))| [piece, u64::from(other), sum as u64, number, u64::from(region)];
        mine.extend(leaves.into_iter().map(packed));
    }
    let mut leaves: BTreeMap<[u64; 2], (i64, [u64; 2])> = BTreeMap::new();
    for &[piece, other, sum, number, region] in all_gather_u64(comm, mine.as_flattened()).as_chunks::<5>().0 {
        let its = leaves.entry([piece, other]).or_insert((0, [u64::MAX; 2]));
        *its = (its.0.wrapping_add(sum as i64), its.1.min([number, region]));
    }
    let is_inside = |place: &&Site| {
        let of_piece = leaves.range([place[0], 0]..=[place[0], u64::MAX]);
        of_piece.clone().find(|(key, (sum, _))| key[1] != key[0] && *sum > 0).map(|(_, (_, [_, region]))| *region)
    };
    let inner = places.iter().filter(|place| is_inside(place).is_some()).count();
    let first = places.iter().find_map(|place| {
        let [a, b, x, y, z, region, _] = *place;
        Some([a, b, x, y, z, region, is_inside(&place)?])
    });
    found(Flaw::Inside(inner), first)
}

#[cfg(test)]
mod tests;
