//! Partition of each body's dual graph by METIS (Karypis and Kumar 1998), on rank 0. The others receive their own
//! subdomains: the numbers of elements of bricks, which they generate, and all of other bodies.
//!
//! Regions of bodies are cut one by one: a part never spans two bodies or two materials. Elements of a body cost the same,
//! as they have one kind; between bodies they count as so many linear tetrahedra. Contact surfaces start on few
//! subdomains because cutting between two elements at them counts as much as cutting `AT_CONTACT` other faces.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};

use metis::Graph;
use metis::option::{Contig, Seed};

use super::compact::compact;
use super::diffusion::smooth;
use super::pieces::join;
use super::shares::{by_cost, interleave};
use super::{Bodies, BodyMesh, Clusters, Patch, Shape, Subdomain};
use crate::comm::{Comm, Shares};
use crate::heap::exhausted;
use crate::mesh::Elements;
use crate::mesh::brick::indices;
use crate::mesh::connectivity::split_into_pieces;
use crate::mesh::faces::{Neighbours, key};
use crate::sparse::ordering::alone;

/// How much dearer it is to cut between two elements at a contact surface.
const AT_CONTACT: i32 = 5;

/// No part of a piece may have more than so many times the mean number of elements, unless METIS's own have.
const LARGEST: f64 = 1.25;

/// Cuts all bodies into about `parts` parts (more where a part had to be split to be face-connected), in clusters of about
/// `cluster` neighbouring ones. Returns the clusters, the shares and this rank's subdomains. Collective.
pub(crate) fn own_subdomains(
    bodies: &Bodies,
    parts: usize,
    cluster: usize,
    comm: &dyn Comm,
) -> (Clusters, Shares, Vec<Subdomain>) {
    let mut outgoing = vec![Vec::new(); comm.size()];
    if comm.rank() == 0 {
        let cuts = cut_all(bodies, parts, cluster);
        let order = interleave(&cuts.iter().map(|cut| cut.clusters.len()).collect::<Vec<_>>());
        let members = |&(body, cluster): &(usize, usize)| cuts[body].clusters[cluster].as_slice();
        let elements = |(body, cluster): &(usize, usize)| -> u64 {
            let elements =
                members(&(*body, *cluster)).iter().map(|&part| cuts[*body].parts[part as usize].len() as u64);
            elements.sum::<u64>() * bodies.bodies[*body].kind.tetrahedra()
        };
        let costs: Vec<u64> = order.iter().map(elements).collect();
        let sizes: Vec<u64> = order.iter().map(|at| members(at).len() as u64).collect();
        let shares = by_cost(&costs, comm.size());
        for message in &mut outgoing {
            message.extend(shares.0.iter().map(|&count| count as u64));
            message.push(sizes.len() as u64);
            message.extend(&sizes);
        }
        let surfaces: HashMap<_, _> = bodies.meshes.keys().map(|&body| (body, faces(bodies, body))).collect();
        let mut id = 0;
        for (cluster, at) in order.iter().enumerate() {
            let message = &mut outgoing[shares.owner(cluster)];
            for &part in members(at) {
                let (body, elements) = (at.0, &cuts[at.0].parts[part as usize]);
                message.push(body as u64);
                if let Some(mesh) = bodies.meshes.get(&body) {
                    let of_body = &bodies.bodies[body];
                    Subdomain::of_mesh((id, body), of_body, mesh, elements, &surfaces[&body]).pack(message);
                } else {
                    message.extend([id as u64, elements.len() as u64]);
                    message.extend(elements);
                }
                id += 1;
            }
        }
    }
    let mut message = comm.all_to_all(outgoing).swap_remove(0).into_iter();
    let mut counts = |length| message.by_ref().take(length).map(|n| n as usize).collect::<Vec<_>>();
    let shares = Shares(counts(comm.size()));
    let length = counts(1)[0];
    let (clusters, shares) = Clusters::new(shares, &counts(length));
    let mut own = Vec::new();
    while let Some(body) = message.next() {
        own.extend(match bodies.bodies[body as usize].shape {
            Shape::Mesh(_) => Subdomain::unpack(bodies.bodies[body as usize].kind, &mut message),
            Shape::Brick(_) => {
                let [id, length] = [(); 2].map(|()| message.next().expect("a list is whole") as usize);
                let elements: Vec<u64> = message.by_ref().take(length).collect();
                Some(Subdomain::of_brick(id, bodies, body as usize, &elements))
            }
        });
    }
    (clusters, shares, own)
}

/// How a body is cut.
struct BodyCut {
    /// Elements of each part, numbered within the body, ascending.
    parts: Vec<Vec<u64>>,
    /// Parts of each cluster, ascending.
    clusters: Vec<Vec<u32>>,
}

/// The cuts of all bodies.
fn cut_all(bodies: &Bodies, parts: usize, cluster: usize) -> Vec<BodyCut> {
    let graphs: Vec<DualGraph> = (0..bodies.bodies.len()).map(|body| DualGraph::new(bodies, body)).collect();
    let size = |(graph, body): (&DualGraph, &BodyMesh)| -> Vec<u64> {
        graph.pieces.iter().map(|piece| piece.len() as u64 * body.kind.tetrahedra()).collect()
    };
    let sizes: Vec<u64> = graphs.iter().zip(bodies.bodies).flat_map(size).collect();
    let mut wanted = spread(parts, &sizes).into_iter();
    let of_body = |graph: &DualGraph| {
        let (part, count) = graph.partition(&mut wanted);
        let mut parts = vec![Vec::new(); count];
        part.iter().enumerate().for_each(|(element, &p)| parts[p as usize].push(element as u64));
        BodyCut { parts, clusters: graph.clusters(&part, count, cluster) }
    };
    graphs.iter().map(of_body).collect()
}

/// Shares `parts` out over pieces of these sizes: one each, the others one by one to the piece that is farthest below its
/// quota.
fn spread(parts: usize, sizes: &[u64]) -> Vec<usize> {
    let total: u64 = sizes.iter().sum();
    let quota: Vec<f64> = sizes.iter().map(|&n| parts as f64 * n as f64 / total as f64).collect();
    let mut result = vec![1; sizes.len()];
    while result.iter().sum::<usize>() < parts {
        let missing = |k: &usize| quota[*k] - result[*k] as f64;
        let next = (0..sizes.len()).max_by(|a, b| missing(a).total_cmp(&missing(b)).then(b.cmp(a)));
        result[next.expect("a scene has bodies")] += 1;
    }
    result
}

/// Named surfaces of the boundary faces of a mesh, by ascending nodes.
fn faces(bodies: &Bodies, body: usize) -> HashMap<Vec<u32>, Vec<usize>> {
    let mut result: HashMap<_, Vec<usize>> = HashMap::new();
    for (index, surface) in bodies.surfaces.iter().enumerate().filter(|(_, s)| s.body == body) {
        if let Patch::Named(name) = &surface.patch {
            for face in bodies.meshes[&body].surface(name) {
                result.entry(key(face)).or_default().push(index);
            }
        }
    }
    result
}

/// The elements of a body, those that share a face being neighbours.
struct DualGraph<'a> {
    elements: Cow<'a, Elements>,
    /// Mean of each element's corners.
    centres: Vec<[f64; 3]>,
    neighbours: Neighbours,
    /// Elements of each face-connected piece of each region of the body, ascending.
    pieces: Vec<Vec<u32>>,
    /// Piece of each element.
    piece_of: Vec<i32>,
    /// Whether an element has a node on a contact surface.
    at_contact: Vec<bool>,
}

impl<'a> DualGraph<'a> {
    fn new(bodies: &Bodies<'a>, body: usize) -> Self {
        let mesh = &bodies.bodies[body];
        let elements = match mesh.shape {
            Shape::Brick(_) => {
                let nodes = (0..mesh.counts().elements).flat_map(|element| mesh.element(element));
                Cow::Owned(Elements::new(mesh.kind, nodes.map(|n| n as u32).collect()))
            }
            Shape::Mesh(_) => Cow::Borrowed(&bodies.meshes[&body].elements),
        };
        let nodes = mesh.counts().nodes as usize;
        let neighbours = Neighbours::new(nodes, &elements);
        let region = |element| bodies.meshes.get(&body).map_or(0, |mesh| mesh.region(element) as i32);
        let mut piece_of: Vec<i32> = (0..elements.len()).map(region).collect();
        let mut pieces = vec![Vec::new(); split_into_pieces(&mut piece_of, |e| neighbours.of(e))];
        (0..).zip(&piece_of).for_each(|(element, &piece)| pieces[piece as usize].push(element));
        let mut touching = vec![false; nodes];
        contact_nodes(bodies, body).into_iter().for_each(|node| touching[node as usize] = true);
        let at_contact = elements.iter().map(|nodes| nodes.iter().any(|&n| touching[n as usize])).collect();
        let centres = centres(bodies, body, &elements);
        Self { elements, centres, neighbours, pieces, piece_of, at_contact }
    }

    /// Part of each element, and the number of parts, each of which is face-connected; `wanted` tells how many parts to
    /// ask for, piece after piece.
    fn partition(&self, wanted: &mut impl Iterator<Item = usize>) -> (Vec<i32>, usize) {
        let mut parts = vec![0; self.at_contact.len()];
        let mut first = 0;
        let mut local = vec![0; parts.len()];
        for (piece, wanted) in self.pieces.iter().zip(wanted) {
            (0..).zip(piece).for_each(|(k, &element)| local[element as usize] = k);
            let cut = if wanted > 1 { self.cut(piece, &local, wanted) } else { vec![0; piece.len()] };
            piece.iter().zip(&cut).for_each(|(&element, part)| parts[element as usize] = first + part);
            first += cut.iter().max().map_or(0, |last| last + 1);
        }
        let count = split_into_pieces(&mut parts, |e| self.neighbours.of(e));
        (parts, count)
    }

    /// Connected groups of about so many parts of one region, with few faces between them.
    fn clusters(&self, part: &[i32], parts: usize, cluster: usize) -> Vec<Vec<u32>> {
        if cluster == 1 {
            return (0..parts as u32).map(|part| vec![part]).collect();
        }
        let mut faces: BTreeMap<(i32, i32), i32> = BTreeMap::new();
        for (element, &own) in part.iter().enumerate() {
            let inside = |other: &usize| self.piece_of[*other] == self.piece_of[element] && part[*other] != own;
            for other in self.neighbours.of(element).map(|other| other as usize).filter(inside) {
                *faces.entry((own, part[other])).or_default() += 1;
            }
        }
        let pairs: Vec<(i32, i32)> = faces.keys().copied().collect();
        let begin: Vec<i32> = (0..=parts).map(|p| pairs.partition_point(|pair| (pair.0 as usize) < p) as i32).collect();
        let adjacency: Vec<i32> = pairs.iter().map(|pair| pair.1).collect();
        let weights: Vec<i32> = faces.into_values().collect();
        let wanted = parts.div_ceil(cluster) as i32;
        let mut group = if wanted > 1 { kway((&begin, &adjacency), &weights, wanted, false) } else { vec![0; parts] };
        let neighbours =
            |p: usize| adjacency[begin[p] as usize..begin[p + 1] as usize].iter().map(|&other| other as u32);
        let mut clusters = vec![Vec::new(); split_into_pieces(&mut group, neighbours)];
        (0..).zip(group).for_each(|(part, cluster)| clusters[cluster as usize].push(part));
        clusters
    }

    /// Part of each element of a piece; `local` has the places of its elements. METIS's parts are rods and have tongues, which
    /// bend easily and cost iterations: they are made compact, then their faces smooth. Where that leaves too few parts or a
    /// large one, as on meshes whose sizes differ much, only faces are made smooth, or nothing is done.
    fn cut(&self, piece: &[u32], local: &[i32], wanted: usize) -> Vec<i32> {
        let (begin, adjacency, weights) = self.graph(piece, local);
        let start = kway((&begin, &adjacency), &weights, wanted as i32, true);
        let centres: Vec<_> = piece.iter().map(|&element| self.centres[element as usize]).collect();
        let neighbours =
            |k: usize| adjacency[begin[k] as usize..begin[k + 1] as usize].iter().map(|&other| other as u32);
        let mut part = start.clone();
        compact(&centres, &mut part, wanted);
        join(&mut part, wanted, neighbours);
        for mut part in [part, start.clone()] {
            let before = part.iter().max().map_or(1, |last| *last as usize + 1);
            smooth(&self.elements, piece, &mut part, before);
            let parts = join(&mut part, wanted, neighbours);
            let mut sizes = vec![0; parts];
            part.iter().for_each(|&part| sizes[part as usize] += 1);
            let largest = sizes.into_iter().max().unwrap_or(0);
            if parts >= wanted && largest as f64 <= LARGEST * piece.len() as f64 / wanted as f64 {
                return part;
            }
        }
        start
    }

    /// Begins, neighbours and weights of the graph of a piece.
    fn graph(&self, piece: &[u32], local: &[i32]) -> (Vec<i32>, Vec<i32>, Vec<i32>) {
        let (mut begin, mut adjacency, mut weights) = (vec![0], Vec::new(), Vec::new());
        for &element in piece {
            let inside = |other: &u32| self.piece_of[*other as usize] == self.piece_of[element as usize];
            for other in self.neighbours.of(element as usize).filter(inside) {
                adjacency.push(local[other as usize]);
                let both = self.at_contact[element as usize] && self.at_contact[other as usize];
                weights.push(if both { AT_CONTACT } else { 1 });
            }
            begin.push(adjacency.len() as i32);
        }
        (begin, adjacency, weights)
    }
}

/// Mean of the corners of each element of a body.
fn centres(bodies: &Bodies, body: usize, elements: &Elements) -> Vec<[f64; 3]> {
    let lattice = bodies.bodies[body].lattice();
    let point = |&node: &u32| match &lattice {
        Some(lattice) => lattice.coordinates(lattice.node_position(u64::from(node))),
        None => bodies.meshes[&body].points[node as usize],
    };
    let corners = elements.kind().cell().corners();
    let mean = |nodes: &[u32]| {
        let sum = nodes[..corners].iter().map(point).fold([0.0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]]);
        sum.map(|x| x / corners as f64)
    };
    elements.iter().map(mean).collect()
}

/// Part of each vertex of a graph, given by begins and neighbours, with little weight between the parts; contiguous ones need
/// a connected graph.
fn kway((begin, adjacency): (&[i32], &[i32]), weights: &[i32], wanted: i32, contiguous: bool) -> Vec<i32> {
    let mut parts = vec![0; begin.len() - 1];
    let _alone = alone();
    let cut = Graph::new(1, wanted, begin, adjacency)
        .expect("the rows are in order")
        .set_adjwgt(weights)
        .set_option(Contig(contiguous))
        .set_option(Seed(1))
        .part_kway(&mut parts);
    match cut {
        Err(metis::Error::Memory) => exhausted(size_of_val(adjacency)),
        cut => cut.expect("the graph is one that METIS can cut"),
    };
    parts
}

/// Nodes of a body on contact surfaces, some several times.
fn contact_nodes(bodies: &Bodies, body: usize) -> Vec<u64> {
    let nodes = |patch: &Patch| -> Vec<u64> {
        match (bodies.bodies[body].lattice(), patch) {
            (Some(lattice), Patch::Face(face)) => {
                indices(&lattice.nodes_on(*face)).map(|at| lattice.node(at)).collect()
            }
            (_, Patch::Named(name)) => {
                bodies.meshes[&body].surface(name).iter().flatten().map(|&n| u64::from(n)).collect()
            }
            (None, Patch::Face(_)) => Vec::new(),
        }
    };
    let surfaces = bodies.contact.iter().map(|&index| &bodies.surfaces[index]).filter(|s| s.body == body);
    surfaces.flat_map(|surface| nodes(&surface.patch)).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use super::super::number_bodies;
    use super::*;
    use crate::element::Kind;
    use crate::mesh::Brick;

    #[test]
    fn parts_are_balanced_and_more_compact_than_those_of_metis_with_as_few_shared_nodes() {
        let brick = Brick { origin: [0.0; 3], size: [3.0, 1.0, 1.0], cells: [24, 8, 8] };
        for (kind, wanted) in [(Kind::Tet4, 24), (Kind::Tet4, 60), (Kind::Hex8, 24)] {
            let bodies = number_bodies([(kind, Shape::Brick(brick), vec![0])]);
            let torn = Bodies { bodies: &bodies, meshes: &BTreeMap::new(), surfaces: &[], contact: &[] };
            let graph = DualGraph::new(&torn, 0);
            let (part, count) = graph.partition(&mut std::iter::once(wanted));
            assert_eq!(count, wanted);
            let mean = part.len() as f64 / wanted as f64;
            for k in 0..wanted as i32 {
                let size = part.iter().filter(|&&part| part == k).count() as f64;
                assert!((size / mean - 1.0).abs() < 0.25, "{size} instead of {mean}");
            }
            let local: Vec<i32> = (0..part.len() as i32).collect();
            let (begin, adjacency, weights) = graph.graph(&graph.pieces[0], &local);
            let metis = kway((&begin, &adjacency), &weights, wanted as i32, true);
            let shared = |part: &[i32]| {
                let copies = graph.elements.iter().zip(part).flat_map(|(nodes, p)| nodes.iter().map(move |&n| (n, *p)));
                copies.collect::<BTreeSet<_>>().len() - brick.node_count() as usize
            };
            let inertia = |part: &[i32]| -> f64 {
                let of_part = |k: i32| -> f64 {
                    let points: Vec<_> = graph.centres.iter().zip(part).filter(|(_, p)| **p == k).collect();
                    let mean = [0, 1, 2].map(|a| points.iter().map(|p| p.0[a]).sum::<f64>() / points.len() as f64);
                    points.iter().map(|p| (0..3).map(|a| (p.0[a] - mean[a]).powi(2)).sum::<f64>()).sum()
                };
                (0..wanted as i32).map(of_part).sum()
            };
            let found = [&part, &metis].map(|part| (shared(part), inertia(part)));
            assert!(found[0].1 < found[1].1 && found[0].0 * 10 <= found[1].0 * 11, "{kind:?}, {wanted}: {found:?}");
        }
    }

    #[test]
    fn parts_are_spread_by_size_and_every_piece_gets_one() {
        assert_eq!(spread(10, &[600, 300, 100]), [6, 3, 1]);
        assert_eq!(spread(3, &[1000, 1, 1]), [1, 1, 1]);
        assert_eq!(spread(7, &[1, 1]), [4, 3]);
    }
}
