//! Compact parts of any bodies, cut by all ranks together.
//!
//! Each rank has a share of a mesh, and generates one of a brick. Parts start as pieces of a
//! space-filling curve ([`curve`]), which are rods here and there and have tongues: these bend easily and cost iterations.
//! They are made compact ([`compact`]), then their faces smooth ([`diffusion`]) and flat ([`sides`]), then whole ([`pieces`]). Regions of bodies
//! are cut one by one: a part never spans two bodies or two materials. Elements of a body cost the same, as they have one
//! kind; between bodies they count as so many linear tetrahedra. In the end each rank gets the elements of its own
//! subdomains, which are shared out by the size of their factors.

mod compact;
mod diffusion;
mod groups;
mod pieces;
mod sides;

use std::collections::BTreeMap;
use std::mem::replace;

use self::compact::compact;
use self::diffusion::Ground;
use self::groups::{Cluster, Faces, clusters, groups};
use self::pieces::Pieces;
use self::sides::Sides;
use super::shares::{interleave, whole_groups};
use super::{Bodies, BodyMesh, Clusters, Patch, Shape, Subdomain};
use crate::comm::words::{share, sum};
use crate::comm::{Comm, Shares, all_gather_u64, from_root};
use crate::mesh::curve::{self, on_grid};
use crate::mesh::faces::key;
use crate::mesh::joints::Joints;
use crate::mesh::marked::{Marked, forward};
use crate::mesh::solid::NamedSurface;
use crate::mesh::wholes::{Wholes, spread};
use crate::mesh::{Portion, SolidMesh};

/// No part may have more than so many times the mean number of elements.
const LARGEST: f64 = 1.25;

/// Cuts all bodies into about `parts` parts (more where a part had to be split to be face-connected), in groups of about so many
/// on each level. Returns the clusters, the shares and this rank's subdomains. Collective.
pub(crate) fn own_subdomains(
    bodies: &Bodies,
    mut meshes: BTreeMap<usize, SolidMesh>,
    parts: usize,
    sizes_of_groups: &[usize],
    comm: &dyn Comm,
) -> (Clusters, Shares, Vec<Subdomain>) {
    let mut deal = |(index, body)| Dealt::new(body, meshes.remove(&index), comm);
    let dealt: Vec<Dealt> = bodies.bodies.iter().enumerate().map(&mut deal).collect();
    let size = |(dealt, body): (&Dealt, &BodyMesh)| -> Vec<u64> {
        dealt.sizes.iter().map(|size| size * body.kind.tetrahedra()).collect()
    };
    let sizes: Vec<u64> = dealt.iter().zip(bodies.bodies).flat_map(size).collect();
    let mut wanted = spread(parts, &sizes).into_iter();
    let mut cut = |dealt: Dealt| {
        let parts = wanted.by_ref().take(dealt.sizes.len()).collect();
        Cut::new(dealt, parts, sizes_of_groups, comm)
    };
    let cuts: Vec<Cut> = dealt.into_iter().map(&mut cut).collect();

    // Numbers and owners.
    let (mut order, mut groups) = (Vec::new(), vec![Vec::new(); sizes_of_groups.len()]);
    for (body, cluster) in interleave(&cuts.iter().map(|cut| cut.clusters.len()).collect::<Vec<_>>()) {
        let Cluster { members, sizes } = &cuts[body].clusters[cluster];
        order.extend(members.iter().map(|&part| (body, part as usize)));
        groups.iter_mut().zip(sizes).for_each(|(all, sizes)| all.extend(sizes));
    }
    let clusters = Clusters::new(order.len(), &groups);
    let costs: Vec<Vec<u64>> = cuts.iter().map(|cut| costs(&cut.portion, cut.sizes.len(), comm)).collect();
    let cost = |id: usize| costs[order[id].0][order[id].1];
    let shares = whole_groups(&clusters, cost, comm.size());
    let mut places: Vec<Vec<(usize, usize)>> = cuts.iter().map(|cut| vec![(0, 0); cut.sizes.len()]).collect();
    order.iter().enumerate().for_each(|(id, &(body, part))| places[body][part] = (id, shares.owner(id)));
    let mut own = Vec::new();
    for (body, (cut, places)) in cuts.into_iter().zip(&places).enumerate() {
        own.extend(cut.subdomains(bodies, body, places, comm));
    }
    own.sort_by_key(|subdomain| subdomain.id);
    (clusters, shares, own)
}

/// A body before it is cut.
struct Dealt {
    portion: Portion,
    /// Elements of each whole.
    sizes: Vec<u64>,
    /// Piece of the body and region of each whole.
    of_wholes: Vec<[usize; 2]>,
    surfaces: Vec<NamedSurface>,
}

impl Dealt {
    /// `mesh` is this rank's part of a body that is no brick. Collective.
    ///
    /// # Panics
    /// If there is none.
    fn new(body: &BodyMesh, mesh: Option<SolidMesh>, comm: &dyn Comm) -> Self {
        if let Shape::Brick(_) = body.shape {
            let (sizes, of_wholes) = (vec![body.counts().elements], vec![[0, 0]]);
            return Self { portion: of_brick(body, comm), sizes, of_wholes, surfaces: Vec::new() };
        }
        let SolidMesh { mut portion, pieces, surfaces, piece_count, .. } =
            mesh.expect("every rank has its part of a mesh");
        let (wholes, count) = match body.materials.len() {
            1 => (pieces.clone(), piece_count),
            _ => Joints::new(comm, &portion).pieces(comm, &portion, &portion.wholes),
        };
        // Some element of each whole tells its piece and its region.
        let (mut sizes, mut of_wholes) = (vec![0; count], vec![0; 2 * count]);
        for ((&whole, &piece), &region) in wholes.iter().zip(&pieces).zip(&portion.wholes) {
            sizes[whole as usize] += 1;
            of_wholes[2 * whole as usize..][..2].copy_from_slice(&[1 + u64::from(piece), 1 + u64::from(region)]);
        }
        portion.wholes = wholes;
        let told = all_gather_u64(comm, &of_wholes);
        for theirs in told.chunks_exact(of_wholes.len()) {
            of_wholes.iter_mut().zip(theirs).for_each(|(mine, its)| *mine = (*mine).max(*its));
        }
        let of_wholes = of_wholes.as_chunks::<2>().0.iter().map(|of| of.map(|k| k as usize - 1)).collect();
        Self { portion, sizes: sum(comm, sizes), of_wholes, surfaces }
    }
}

/// This rank's share in a brick, which it generates.
fn of_brick(body: &BodyMesh, comm: &dyn Comm) -> Portion {
    let lattice = body.lattice().expect("the body is a brick");
    let own = share(body.counts().elements, comm);
    let nodes: Vec<u32> = own.clone().flat_map(|number| body.element(number)).map(|node| node as u32).collect();
    let point = |node: u32| lattice.coordinates(lattice.node_position(u64::from(node)));
    Portion::new(body.kind, own.start as u32, &nodes, point)
}

/// How a body is cut.
struct Cut {
    /// Every part is on one rank.
    portion: Portion,
    /// Elements of each part.
    sizes: Vec<u64>,
    clusters: Vec<Cluster>,
    of_wholes: Vec<[usize; 2]>,
    surfaces: Vec<NamedSurface>,
}

impl Cut {
    /// Into so many parts of each whole, in clusters of about so many. Where compact parts are too few or one is large, as on meshes
    /// whose sizes differ much, only faces are made smooth, or nothing is done. Collective.
    fn new(
        Dealt { portion, sizes, of_wholes, surfaces }: Dealt,
        parts: Vec<u32>,
        groups: &[usize],
        comm: &dyn Comm,
    ) -> Self {
        let wholes = Wholes::new(sizes, parts);
        let rank = |part: u32| part as usize * comm.size() / wholes.parts();
        let mut portion = portion;
        let start = |portion: &Portion| on_grid(comm, &portion.centres());
        portion.part = curve::start(comm, &start(&portion), &portion.wholes, &wholes);
        portion = portion.sent(comm, |at| rank(portion.part[at]));
        let (ground, sides) = (Ground::new(comm, &portion), Sides::new(comm, &portion));
        let is_cut = wholes.parts() > wholes.count();
        for (is_compact, is_smooth) in [(true, true), (false, true), (false, false)] {
            if is_smooth && !is_cut {
                continue;
            }
            let mut moved = portion.clone();
            if is_compact {
                compact(comm, &start(&portion), &mut moved.part, &wholes);
            }
            if is_smooth {
                ground.smooth(&mut moved.part, &wholes);
                sides.flatten(&mut moved.part, &wholes);
            }
            let moved = moved.sent(comm, |at| rank(moved.part[at]));
            let cut = Self::joined(moved, &wholes, groups, comm);
            let is_even = |(part, &size): (usize, &u64)| size as f64 <= LARGEST * wholes.mean(cut.1[part]);
            let is_sound = cut.0.sizes.len() >= wholes.parts() && cut.0.sizes.iter().enumerate().all(is_even);
            if is_sound || !is_smooth {
                return Self { of_wholes, surfaces, ..cut.0 };
            }
        }
        unreachable!("the last cut is taken")
    }

    /// Makes pieces of parts that do not hang together parts of their own, or of others; also the whole of each part.
    fn joined(mut portion: Portion, wholes: &Wholes, levels: &[usize], comm: &dyn Comm) -> (Self, Vec<u32>) {
        let pieces = Pieces::new(comm, &portion);
        let to = pieces.join(wholes);
        let count = to.iter().max().map_or(0, |&last| last as usize + 1);
        let (mut sizes, mut of) = (vec![0; count], vec![0; count]);
        for (piece, &to) in pieces.list.iter().zip(&to) {
            sizes[to as usize] += piece.size;
            of[to as usize] = piece.whole;
        }
        portion.part = pieces.own.iter().map(|&piece| to[piece as usize]).collect();
        let mut faces = Faces::new();
        for (&(a, b), n) in &pieces.faces {
            let (a, b) = (to[a as usize], to[b as usize]);
            if a != b {
                *faces.entry((a, b)).or_default() += n;
            }
        }
        let mine = if comm.rank() == 0 { groups(count, faces, levels) } else { Vec::new() };
        let mut all = from_root(comm, mine.concat().into_iter().map(u64::from).collect()).into_iter().map(|n| n as u32);
        let mut items = count;
        let of_level = |_: &usize| {
            let of: Vec<u32> = all.by_ref().take(items).collect();
            items = of.iter().max().map_or(0, |&last| last as usize + 1);
            of
        };
        let clusters = clusters(count, &levels.iter().map(of_level).collect::<Vec<_>>());
        (Self { portion, sizes, clusters, of_wholes: Vec::new(), surfaces: Vec::new() }, of)
    }

    /// Own subdomains, from the number and the owner of each part. Collective.
    fn subdomains(self, bodies: &Bodies, body: usize, places: &[(usize, usize)], comm: &dyn Comm) -> Vec<Subdomain> {
        let part = &self.portion.part;
        let portion = self.portion.sent(comm, |at| places[part[at] as usize].1);
        let surfaces = marks(bodies, body, &self.surfaces, &portion, comm);
        let mut order: Vec<usize> = (0..portion.len()).collect();
        order.sort_unstable_by_key(|&at| (portion.part[at], portion.numbers[at]));
        let subdomain = |places_here: &[usize]| {
            let id = places[portion.part[places_here[0]] as usize].0;
            match bodies.bodies[body].shape {
                Shape::Brick(_) => {
                    let numbers: Vec<u64> = places_here.iter().map(|&at| portion.numbers[at].into()).collect();
                    Subdomain::of_brick(id, bodies, body, &numbers)
                }
                Shape::Mesh(_) => {
                    let [piece, region] = self.of_wholes[portion.wholes[places_here[0]] as usize];
                    let nodes: Vec<u64> = places_here
                        .iter()
                        .flat_map(|&at| portion.elements.get(at))
                        .map(|&node| portion.nodes[node as usize].into())
                        .collect();
                    let local = |node: u64| portion.nodes.binary_search(&(node as u32)).expect("the node is here");
                    let point = |node: u64| portion.points[local(node)];
                    Subdomain::of_mesh((id, body, piece, region), &bodies.bodies[body], &nodes, point, &surfaces)
                }
            }
        };
        order.chunk_by(|&a, &b| portion.part[a] == portion.part[b]).map(subdomain).collect()
    }
}

/// The size of each part's factor, which is read for every application of F: nodes to the power of 4/3, as by nested dissection of
/// cubes. A part of several ranks counts as their pieces together. Collective.
fn costs(portion: &Portion, parts: usize, comm: &dyn Comm) -> Vec<u64> {
    let mut order: Vec<u32> = (0..portion.len() as u32).collect();
    order.sort_by_key(|&at| portion.part[at as usize]);
    let (mut last, mut nodes) = (vec![u32::MAX; portion.nodes.len()], vec![0; parts]);
    for at in order {
        let part = portion.part[at as usize];
        for &node in portion.elements.get(at as usize) {
            if replace(&mut last[node as usize], part) != part {
                nodes[part as usize] += 1;
            }
        }
    }
    sum(comm, nodes).into_iter().map(|nodes| (nodes as f64).powf(4.0 / 3.0) as u64).collect()
}

/// Named surfaces of a mesh's faces that have their least node here; none of a brick. Collective.
fn marks(bodies: &Bodies, body: usize, named: &[NamedSurface], portion: &Portion, comm: &dyn Comm) -> Marked {
    let mut faces = Vec::new();
    for (index, surface) in bodies.surfaces.iter().enumerate().filter(|(_, s)| s.body == body) {
        let Patch::Named(name) = &surface.patch else { continue };
        let own = named.iter().filter(|surface| surface.name == *name).flat_map(|surface| &surface.faces);
        faces.extend(own.map(|face| (key(face), index)));
    }
    forward(comm, &portion.nodes, portion.elements.kind().faces()[0].len(), &faces)
}

#[cfg(test)]
mod tests;
