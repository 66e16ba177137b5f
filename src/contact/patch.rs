//! What a rank has of a surface: its own faces and two layers around them, and the faces of all ranks along lines.
//!
//! What is said of a node depends on the faces around it (normal, smooth parts, area), and a condition also on what is said of the
//! nodes of these: so all is here that the conditions on own nodes need. Faces are in the order of their subdomains, as they are
//! on the whole surface: sums over those around a node have the same bits on any ranks.
//!
//! Every rank knows [`BOXES`] boxes of each rank that has faces. Lines go to the ranks whose boxes they meet, and faces come
//! back that are near them.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::surface::{GatheredSurface, Layer, PartOf};
use super::tree::BallTree;
use super::{opposite, smooth};
use crate::comm::exact::exact_sums;
use crate::comm::{Comm, all_gather_u64};
use crate::decomposition::Decomposition;
use crate::mesh::surface::area_vector;
use crate::vector::{dot, length};

/// Boxes that stand for a rank's faces.
const BOXES: usize = 8;

/// An endless line, and how near to it something must be.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// A point on it.
    pub point: [f64; 3],
    /// Unit vector.
    pub direction: [f64; 3],
    /// Distance (length).
    pub distance: f64,
}

/// A rank's part of a surface.
pub struct Patch {
    /// Own faces, and those around them.
    pub surface: GatheredSurface,
    /// Whether faces are quadratic, on any rank.
    pub is_quadratic: bool,
    /// Own faces, and the tree of their triangles.
    own: Vec<Face>,
    tree: BallTree,
    /// The face of each triangle.
    face_of: Vec<usize>,
    /// Boxes of all ranks, and whose they are.
    boxes: BallTree,
    rank_of: Vec<usize>,
}

/// A face as it travels.
#[derive(Clone)]
struct Face {
    /// Subdomain, and which of its facets: the order on the whole surface.
    key: u64,
    nodes: Vec<u64>,
    points: Vec<[f64; 3]>,
    /// Numbers of the smooth parts around its nodes, where its owner knows all faces around them.
    parts: Vec<u32>,
}

impl Face {
    fn pack(&self, message: &mut Vec<u64>) {
        message.extend([self.key, self.nodes.len() as u64]);
        for ((node, point), part) in self.nodes.iter().zip(&self.points).zip(&self.parts) {
            message.extend([*node, u64::from(*part)]);
            message.extend(point.map(f64::to_bits));
        }
    }

    fn unpack(message: &[u64]) -> Vec<Self> {
        let (mut faces, mut rest) = (Vec::new(), message);
        while let [key, count, behind @ ..] = rest {
            let (corners, behind) = behind.split_at(5 * *count as usize);
            let corners = corners.as_chunks::<5>().0;
            faces.push(Self {
                key: *key,
                nodes: corners.iter().map(|corner| corner[0]).collect(),
                parts: corners.iter().map(|corner| corner[1] as u32).collect(),
                points: corners.iter().map(|corner| [corner[2], corner[3], corner[4]].map(f64::from_bits)).collect(),
            });
            rest = behind;
        }
        faces
    }
}

impl Patch {
    /// Of surface number `surface`. Collective.
    pub fn new(comm: &dyn Comm, decomposition: &Decomposition, surface: usize) -> Self {
        let mut own = own_faces(decomposition, surface);
        let owned: BTreeSet<u64> = own.iter().map(|face| face.key).collect();
        let faces = with_layers(comm, decomposition, &own);
        let nodes: Vec<Vec<u64>> = faces.iter().map(|face| face.nodes.clone()).collect();
        let places = places(&faces);
        let parts = smooth::parts(&nodes, |node| places[&node]);
        let of_key: HashMap<u64, &Vec<u32>> = faces.iter().map(|face| face.key).zip(&parts).collect();
        own.iter_mut().for_each(|face| face.parts.clone_from(of_key[&face.key]));
        let mut here = GatheredSurface::of_parts(&nodes, &parts, &places);

        let only_own = surface_of(&own);
        let corners: Vec<[[f64; 3]; 3]> = only_own.corners().collect();
        let tree = BallTree::new(&corners);
        let face_of = own.iter().enumerate().flat_map(|(k, face)| std::iter::repeat_n(k, triangles_of(face))).collect();
        let Everywhere { spacing, diameter, is_quadratic, boxes } = everywhere(comm, &only_own, &tree);
        let (rank_of, boxes): (Vec<usize>, Vec<_>) = boxes.into_iter().map(|(rank, [l, h])| (rank, [l, h, h])).unzip();
        here.of = Some(PartOf {
            spacing,
            diameter,
            layers: layers(&here, &faces, &owned),
            told: told(&here, &faces, &owned),
            own: faces.iter().flat_map(|f| std::iter::repeat_n(owned.contains(&f.key), triangles_of(f))).collect(),
        });
        let boxes = BallTree::new(&boxes);
        Self { surface: here, is_quadratic, own, tree, face_of, boxes, rank_of }
    }

    /// A surface that is here as a whole.
    #[cfg(test)]
    pub fn alone(surface: GatheredSurface) -> Self {
        let is_quadratic = !surface.quadratic.is_empty();
        let nothing = || BallTree::new(&[]);
        let (own, tree, face_of, boxes, rank_of) = (Vec::new(), nothing(), Vec::new(), nothing(), Vec::new());
        Self { surface, is_quadratic, own, tree, face_of, boxes, rank_of }
    }

    /// Own faces: which of the faces that are here, of which subdomain, and which of its facets.
    pub fn own(&self) -> impl Iterator<Item = (usize, usize, usize)> {
        let numbers = opposite::faces(&self.surface).enumerate();
        let numbers = numbers.filter(|(_, face)| self.surface.owns(face.triangles.start)).map(|(number, _)| number);
        let places = self.own.iter().map(|face| ((face.key >> 32) as usize, (face.key & u64::from(u32::MAX)) as usize));
        numbers.zip(places).map(|(number, (subdomain, facet))| (number, subdomain, facet))
    }

    /// The faces of all ranks that have a triangle near one of these lines. Collective.
    pub fn near(&self, comm: &dyn Comm, lines: &[Line]) -> Cow<'_, GatheredSurface> {
        if comm.size() == 1 {
            return Cow::Borrowed(&self.surface);
        }
        let mut outgoing = vec![Vec::new(); comm.size()];
        for Line { point, direction, distance } in lines {
            let mut ranks: Vec<usize> =
                self.boxes.along(*point, *direction, *distance).into_iter().map(|b| self.rank_of[b]).collect();
            ranks.sort_unstable();
            ranks.dedup();
            for rank in ranks {
                outgoing[rank].extend(point.iter().chain(direction).chain([distance]).map(|x| x.to_bits()));
            }
        }
        let answer = |asked: Vec<u64>| {
            let mut found = BTreeSet::new();
            for line in asked.as_chunks::<7>().0 {
                let [x, y, z, dx, dy, dz, distance] = line.map(f64::from_bits);
                let triangles = self.tree.along([x, y, z], [dx, dy, dz], distance);
                found.extend(triangles.into_iter().map(|triangle| self.face_of[triangle]));
            }
            let mut message = Vec::new();
            found.into_iter().for_each(|face| self.own[face].pack(&mut message));
            message
        };
        let answers = comm.all_to_all(outgoing).into_iter().map(answer).collect();
        // Ranks own subdomains in their order, so the faces are in theirs.
        let faces: Vec<Face> = comm.all_to_all(answers).iter().flat_map(|message| Face::unpack(message)).collect();
        let mut found = surface_of(&faces);
        let of = self.surface.of.as_ref();
        found.of = of.map(|of| PartOf { layers: Vec::new(), told: Vec::new(), own: Vec::new(), ..of.clone() });
        Cow::Owned(found)
    }
}

/// This rank's faces.
fn own_faces(decomposition: &Decomposition, surface: usize) -> Vec<Face> {
    let mut own = Vec::new();
    for subdomain in &decomposition.subdomains {
        for (number, facet) in subdomain.facets.iter().enumerate().filter(|(_, facet)| facet.surface == surface) {
            let local = || facet.nodes.iter().map(|&node| node as usize);
            own.push(Face {
                key: (subdomain.id as u64) << 32 | number as u64,
                nodes: local().map(|node| subdomain.nodes[node]).collect(),
                points: local().map(|node| subdomain.points[node]).collect(),
                parts: vec![0; facet.nodes.len()],
            });
        }
    }
    own
}

/// Own faces, those that touch them, and those that touch these, in order. Collective.
fn with_layers(comm: &dyn Comm, decomposition: &Decomposition, own: &[Face]) -> Vec<Face> {
    // The other ranks that have copies of a node.
    let elsewhere = |node: u64| {
        let at = decomposition.interface.binary_search_by_key(&node, |n| n.node).expect("it is on a named surface");
        let mut ranks: Vec<usize> =
            decomposition.interface[at].copies.iter().map(|&copy| decomposition.owner(copy)).collect();
        ranks.dedup();
        ranks.retain(|&rank| rank != comm.rank());
        ranks
    };
    let mut sent: Vec<Vec<usize>> = vec![Vec::new(); comm.size()];
    for (number, face) in own.iter().enumerate() {
        let ranks: BTreeSet<usize> = face.nodes.iter().flat_map(|&node| elsewhere(node)).collect();
        ranks.into_iter().for_each(|rank| sent[rank].push(number));
    }
    let exchange = |outgoing: Vec<Vec<&Face>>, known: Vec<Face>| {
        let pack = |faces: Vec<&Face>| {
            let mut message = Vec::new();
            faces.into_iter().for_each(|face| face.pack(&mut message));
            message
        };
        let incoming = comm.all_to_all(outgoing.into_iter().map(pack).collect());
        // Of what comes that counts which touches what was known before.
        let nodes: BTreeSet<u64> = known.iter().flat_map(|face| face.nodes.iter().copied()).collect();
        let touches = |face: &Face| face.nodes.iter().any(|node| nodes.contains(node));
        let new = incoming.iter().flat_map(|message| Face::unpack(message)).filter(touches);
        let faces: BTreeMap<u64, Face> = known.iter().cloned().chain(new).map(|face| (face.key, face)).collect();
        faces.into_values().collect::<Vec<Face>>()
    };
    let first = exchange(sent.iter().map(|of| of.iter().map(|&k| &own[k]).collect()).collect(), own.to_vec());
    // What touches the faces that another rank has got: it may know of no other who would tell.
    let mut around: HashMap<u64, Vec<usize>> = HashMap::new();
    for (number, face) in first.iter().enumerate() {
        face.nodes.iter().for_each(|&node| around.entry(node).or_default().push(number));
    }
    let second = |of: &Vec<usize>| {
        let touching: BTreeSet<usize> =
            of.iter().flat_map(|&k| &own[k].nodes).flat_map(|node| around[node].iter().copied()).collect();
        touching.into_iter().map(|number| &first[number]).collect()
    };
    exchange(sent.iter().map(second).collect(), first.clone())
}

/// Where nodes of faces are.
fn places(faces: &[Face]) -> BTreeMap<u64, [f64; 3]> {
    faces.iter().flat_map(|face| face.nodes.iter().copied().zip(face.points.iter().copied())).collect()
}

/// A surface of faces whose parts are known.
fn surface_of(faces: &[Face]) -> GatheredSurface {
    let nodes: Vec<Vec<u64>> = faces.iter().map(|face| face.nodes.clone()).collect();
    let parts: Vec<Vec<u32>> = faces.iter().map(|face| face.parts.clone()).collect();
    GatheredSurface::of_parts(&nodes, &parts, &places(faces))
}

/// Triangles that a face is cut into.
fn triangles_of(face: &Face) -> usize {
    if face.nodes.len() == 3 { 1 } else { 4 }
}

/// How far nodes are from own faces.
fn layers(surface: &GatheredSurface, faces: &[Face], owned: &BTreeSet<u64>) -> Vec<Layer> {
    let nodes = |faces: &mut dyn Iterator<Item = &Face>| -> BTreeSet<u64> {
        faces.flat_map(|face| face.nodes.iter().copied()).collect()
    };
    let own = nodes(&mut faces.iter().filter(|face| owned.contains(&face.key)));
    let beside = nodes(&mut faces.iter().filter(|face| face.nodes.iter().any(|node| own.contains(node))));
    let layer = |node: &u64| match node {
        node if own.contains(node) => Layer::Own,
        node if beside.contains(node) => Layer::Beside,
        _ => Layer::Rim,
    };
    surface.nodes.iter().map(layer).collect()
}

/// Nodes whose first face is an own one.
fn told(surface: &GatheredSurface, faces: &[Face], owned: &BTreeSet<u64>) -> Vec<bool> {
    let mut first: HashMap<u64, u64> = HashMap::new();
    for face in faces {
        face.nodes.iter().for_each(|&node| {
            first.entry(node).or_insert(face.key);
        });
    }
    surface.nodes.iter().map(|node| owned.contains(&first[node])).collect()
}

/// What every rank knows of a surface.
struct Everywhere {
    spacing: f64,
    diameter: f64,
    is_quadratic: bool,
    /// With the ranks that have what is inside.
    boxes: Vec<(usize, [[f64; 3]; 2])>,
}

/// From the own faces of all ranks. Collective.
fn everywhere(comm: &dyn Comm, own: &GatheredSurface, tree: &BallTree) -> Everywhere {
    let areas: Vec<[f64; 2]> = own.corners().map(|corners| [length(area_vector(&corners)), 1.0]).collect();
    let [area, triangles] = exact_sums(comm, &areas);
    let mut extent = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for point in &own.points {
        (0..3).for_each(|a| {
            extent[0][a] = extent[0][a].min(point[a]);
            extent[1][a] = extent[1][a].max(point[a]);
        });
    }
    let mut mine = Vec::new();
    if !own.points.is_empty() {
        mine.extend([comm.rank() as u64, u64::from(!own.quadratic.is_empty())]);
        mine.extend(extent.as_flattened().iter().map(|x| x.to_bits()));
        let mut boxes = tree.boxes(BOXES);
        boxes.resize(BOXES, *boxes.first().expect("there are triangles"));
        mine.extend(boxes.as_flattened().as_flattened().iter().map(|x| x.to_bits()));
    }
    let (mut boxes, mut is_quadratic) = (Vec::new(), false);
    let mut whole = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for message in all_gather_u64(comm, &mine).as_chunks::<{ 2 + 6 * (BOXES + 1) }>().0 {
        is_quadratic |= message[1] == 1;
        let of_rank = message[2..].as_chunks::<6>().0.iter().map(|six| six.map(f64::from_bits));
        for (k, [a, b, c, d, e, f]) in of_rank.enumerate() {
            let [low, high] = [[a, b, c], [d, e, f]];
            if k == 0 {
                (0..3).for_each(|a| {
                    whole[0][a] = whole[0][a].min(low[a]);
                    whole[1][a] = whole[1][a].max(high[a]);
                });
            } else {
                boxes.push((message[0] as usize, [low, high]));
            }
        }
    }
    let diagonal: [f64; 3] = std::array::from_fn(|a| whole[1][a] - whole[0][a]);
    let spacing = (2.0 * area / triangles.max(1.0)).sqrt();
    Everywhere { spacing, diameter: dot(diagonal, diagonal).sqrt(), is_quadratic, boxes }
}

#[cfg(test)]
mod tests;
