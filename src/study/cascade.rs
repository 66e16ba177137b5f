//! From the solution on a coarse mesh to a start on a finer one of the same bodies, which are bricks.
//!
//! The displacement is interpolated: the coarse elements' linear functions at the fine nodes. A contact is closed where
//! the nearest coarse one is. Plastic state and multipliers follow from these two by the equations themselves.
//! No rank ever holds a whole mesh: nodal values travel by rendezvous at the rank that a node's number points to.

use std::collections::{HashMap, HashSet};

use super::Solved;
use crate::assembly::{Region, internal};
use crate::comm::meeting::look_up;
use crate::comm::{Comm, all_gather_u64};
use crate::constraint::Kind;
use crate::contact::ContactPair;
use crate::contact::known::Pairs;
use crate::decomposition::Cut;
use crate::decomposition::{BodyMesh, Subdomain, bricks};
use crate::feti::Torn;
use crate::mesh::Brick;
use crate::model::Discrete;
use crate::model::discrete::cut;
use crate::model::meshes;
use crate::newton;
use crate::scene::Scene;

/// What a solved scene suggests as the start on a finer mesh of the same bodies. Collective.
pub fn refine(comm: &dyn Comm, coarse: (&Discrete, &Solved), fine: &Discrete) -> newton::Start {
    let (coarse, solved) = coarse;
    let u = interpolate(
        comm,
        (&coarse.bodies, &coarse.decomposition.subdomains, &solved.u),
        (&fine.bodies, &fine.decomposition.subdomains),
    );
    let (from, to) = ((&coarse.bodies[..], &coarse.contacts.pairs), (&fine.bodies[..], &fine.contacts.pairs));
    let closed = closed_contacts(comm, from, &solved.closed, to);
    let kept = |kind| match kind {
        Kind::Contact { pair } | Kind::Friction { pair, .. } => closed.contains(&pair),
        Kind::Gluing | Kind::Support { .. } => true,
    };
    newton::Start {
        u,
        kept: fine.constraints.rows.iter().map(|row| kept(row.kind)).collect(),
        is_origin: false,
        reach: None,
    }
}

/// Which boxes of each body of a finer mesh (x fastest) are likely to yield: those around the coarse elements that yield. `None` if
/// the mesh is not cut into boxes. Collective.
pub fn expected_yielding(comm: &dyn Comm, coarse: (&Discrete, &Solved), fine: &Scene) -> Option<Vec<Vec<bool>>> {
    let bodies = meshes::bricks(fine)?;
    let Cut::Bricks(cells) = cut(&fine.decomposition.method, &bodies) else { return None };
    let (coarse, solved) = coarse;
    let mut found = HashSet::new();
    for (subdomain, u) in coarse.decomposition.subdomains.iter().zip(&solved.u) {
        let (body, brick) = (subdomain.body, brick(&coarse.bodies[subdomain.body]));
        for nodes in internal::yielding(&Region::virgin(subdomain, &coarse.materials[subdomain.material]), u) {
            let sum = |a: usize| nodes.iter().map(|&n| subdomain.points[n as usize][a]).sum::<f64>();
            let centre = |a: usize| sum(a) / nodes.len() as f64;
            let place = std::array::from_fn(|a| (centre(a) - brick.origin[a]) / brick.size[a]);
            found.insert([body as u64, bricks::around(&bodies[body], cells, place) as u64]);
        }
    }
    let mut result: Vec<Vec<bool>> = bodies.iter().map(|body| vec![false; bricks::count(body, cells)]).collect();
    let found: Vec<u64> = found.into_iter().flatten().collect();
    all_gather_u64(comm, &found).chunks_exact(2).for_each(|at| result[at[0] as usize][at[1] as usize] = true);
    Some(result)
}

/// Displacement of the coarse mesh at the nodes of own fine subdomains. Copies of a node get the same bits, on any
/// number of ranks. Collective.
fn interpolate(comm: &dyn Comm, coarse: (&[BodyMesh], &[Subdomain], &Torn), fine: (&[BodyMesh], &[Subdomain])) -> Torn {
    let (coarse_bodies, coarse_subdomains, u) = coarse;
    let (fine_bodies, fine_subdomains) = fine;
    let around: Vec<Vec<(Vec<u64>, Vec<f64>)>> = fine_subdomains
        .iter()
        .map(|s| s.nodes.iter().map(|&node| locate(&coarse_bodies[s.body], &fine_bodies[s.body], node)).collect())
        .collect();
    let needed = around.iter().flatten().flat_map(|(nodes, _)| nodes.iter().copied()).collect();
    let values = fetch(comm, displacements(coarse_subdomains, u), needed);
    around
        .iter()
        .map(|nodes| nodes.iter().flat_map(|(nodes, weights)| mean(&values, nodes, weights)).collect())
        .collect()
}

/// The coarse element around a fine node: its nodes, numbered over all bodies, and the values of their shape functions.
fn locate(coarse: &BodyMesh, fine: &BodyMesh, node: u64) -> (Vec<u64>, Vec<f64>) {
    let (cells, lattice) = (brick(coarse).cells, lattice(fine));
    let at = lattice.node_position(node - fine.first_node);
    let in_cells = std::array::from_fn(|a| (at[a] * cells[a]) as f64 / lattice.cells[a] as f64);
    let (nodes, weights) = coarse.around(in_cells);
    (nodes.iter().map(|n| coarse.first_node + n).collect(), weights)
}

fn lattice(body: &BodyMesh) -> Brick {
    body.lattice().expect("only bricks have levels")
}

fn brick(body: &BodyMesh) -> &Brick {
    body.brick().expect("only bricks have levels")
}

fn mean(values: &HashMap<u64, [f64; 3]>, nodes: &[u64], weights: &[f64]) -> [f64; 3] {
    std::array::from_fn(|a| nodes.iter().zip(weights).map(|(node, w)| w * values[node][a]).sum())
}

/// Displacements of all nodes of subdomains, by number.
pub(super) fn displacements(subdomains: &[Subdomain], u: &Torn) -> impl Iterator<Item = (u64, [f64; 3])> {
    let each = subdomains.iter().zip(u);
    each.flat_map(|(subdomain, u)| subdomain.nodes.iter().copied().zip(u.as_chunks::<3>().0.iter().copied()))
}

/// Vectors of the needed nodes, from whichever rank knows them. Of several who do the lowest rank counts, and of what it knows
/// the first. Collective.
pub(super) fn fetch(
    comm: &dyn Comm,
    known: impl Iterator<Item = (u64, [f64; 3])>,
    needed: HashSet<u64>,
) -> HashMap<u64, [f64; 3]> {
    let ranks = comm.size() as u64;
    let mut reports = vec![Vec::new(); comm.size()];
    for (node, x) in known {
        reports[(node % ranks) as usize].extend([node, x[0].to_bits(), x[1].to_bits(), x[2].to_bits()]);
    }
    let mut directory = HashMap::new();
    for report in comm.all_to_all(reports).concat().chunks_exact(4) {
        directory.entry(report[0]).or_insert([report[1], report[2], report[3]]);
    }
    let mut wishes = vec![Vec::new(); comm.size()];
    needed.into_iter().for_each(|node| wishes[(node % ranks) as usize].push(node));
    let answers = comm
        .all_to_all(wishes)
        .iter()
        .map(|wish| wish.iter().flat_map(|node| [[*node].as_slice(), &directory[node]].concat()).collect())
        .collect();
    let answers = comm.all_to_all(answers).concat();
    answers.chunks_exact(4).map(|a| (a[0], [a[1], a[2], a[3]].map(f64::from_bits))).collect()
}

/// Which of this rank's fine contact pairs are closed: those where the coarse node nearest to the slave node is the slave node of
/// a closed coarse pair. `closed` are the numbers of this rank's closed coarse pairs. Collective.
fn closed_contacts(
    comm: &dyn Comm,
    coarse: (&[BodyMesh], &Pairs),
    closed: &[u64],
    fine: (&[BodyMesh], &Pairs),
) -> HashSet<usize> {
    let (coarse_bodies, coarse_pairs) = coarse;
    let (fine_bodies, fine_pairs) = fine;
    let key = |pair: &ContactPair, slave: u64| [pair.contact as u64, slave];
    let closed = closed.iter().map(|&pair| &coarse_pairs[pair as usize]);
    let closed: HashSet<[u64; 2]> = closed.map(|pair| key(pair, pair.slave)).collect();
    let nearest = |node: u64| {
        let body = fine_bodies.iter().rposition(|body| body.first_node <= node).expect("a node is in a body");
        let (first, coarse_first) = (fine_bodies[body].first_node, coarse_bodies[body].first_node);
        let (fine, coarse) = (lattice(&fine_bodies[body]), lattice(&coarse_bodies[body]));
        let at = fine.node_position(node - first);
        let place = std::array::from_fn(|a| (2 * at[a] * coarse.cells[a] + fine.cells[a]) / (2 * fine.cells[a]));
        coarse_first + coarse.node(place)
    };
    let wanted: HashSet<[u64; 2]> = fine_pairs.iter().map(|(_, pair)| key(pair, nearest(pair.slave))).collect();
    let found = look_up(comm, closed.into_iter().map(|key| (key, Vec::new())), wanted);
    let is_closed = |pair: &ContactPair| found.contains_key(&key(pair, nearest(pair.slave)));
    fine_pairs.iter().filter(|(_, pair)| is_closed(pair)).map(|(number, _)| number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::solo::Solo;
    use crate::comm::threads;
    use crate::fixture::{RANKS, two_bricks, two_bricks_by_metis};
    use crate::model::discrete::{Discrete, discretise};
    use crate::scene::Scene;

    fn discrete(scene: &Scene, comm: &dyn Comm) -> Discrete {
        discretise(scene, comm).expect("the scene has a discrete problem")
    }

    /// A displacement that is linear in each body, or not.
    fn field(discrete: &Discrete, bend: f64) -> Torn {
        let at = |body: usize, p: &[f64; 3]| {
            let s = 1.0 + body as f64;
            [s * p[0] - p[1] + bend * (3.0 * p[2]).sin(), 0.5 * p[2] + s, p[1] * s - bend * p[0] * p[1]]
        };
        let of = |s: &Subdomain| s.points.iter().flat_map(|p| at(s.body, p)).collect();
        discrete.decomposition.subdomains.iter().map(of).collect()
    }

    fn pass(comm: &dyn Comm, coarse: &Discrete, fine: &Discrete, bend: f64) -> Torn {
        let u = field(coarse, bend);
        interpolate(
            comm,
            (&coarse.bodies, &coarse.decomposition.subdomains, &u),
            (&fine.bodies, &fine.decomposition.subdomains),
        )
    }

    const FINER: [&str; 2] = ["body.lower.brick.cells=[12, 4, 6]", "body.upper.brick.cells=[12, 4, 6]"];

    #[test]
    fn linear_displacements_pass_exactly() {
        for element in ["tet4", "hex8", "tet10"] {
            let elements = ["lower", "upper"].map(|body| format!("body.{body}.element={element}"));
            let elements = [&elements[0][..], &elements[1][..]];
            let scenes = [two_bricks(&elements), two_bricks(&[&FINER[..], &elements].concat())];
            let [coarse, fine] = scenes.map(|scene| discrete(&scene, &Solo));
            for (found, exact) in pass(&Solo, &coarse, &fine, 0.0).iter().zip(field(&fine, 0.0)) {
                assert!(found.iter().zip(exact).all(|(a, b)| (a - b).abs() < 1e-13));
            }
        }
    }

    #[test]
    fn ranks_and_subdomains_change_no_bit() {
        let of = |comm: &dyn Comm, scenes: [Scene; 2]| {
            let [coarse, fine] = scenes.map(|scene| discrete(&scene, comm));
            let u = pass(comm, &coarse, &fine, 1.0);
            let nodes = fine.decomposition.subdomains.iter().flat_map(|s| s.nodes.clone());
            nodes.zip(u.concat().chunks_exact(3).map(|u| [0, 1, 2].map(|a| u[a].to_bits()))).collect::<Vec<_>>()
        };
        let bricks = || [two_bricks(&[]), two_bricks(&FINER)];
        let alone: HashMap<_, _> = of(&Solo, bricks()).into_iter().collect();
        for ranks in RANKS {
            let metis =
                || [two_bricks_by_metis(7), two_bricks(&[&FINER[..], &["decomposition.subdomains=9"]].concat())];
            for found in threads::run(ranks, |comm| [of(comm, bricks()), of(comm, metis())].concat()).concat() {
                assert_eq!(alone[&found.0], found.1);
            }
        }
    }

    #[test]
    fn the_nearest_contacts_are_closed() {
        let (coarse, fine) = (discrete(&two_bricks(&[]), &Solo), discrete(&two_bricks(&FINER), &Solo));
        let place = |d: &Discrete, pair: &ContactPair| {
            let body = &d.bodies[1];
            brick(body).coordinates(brick(body).node_position(pair.slave - body.first_node))
        };
        let closed: Vec<u64> = (0..coarse.contacts.pairs.total() as u64)
            .filter(|&k| place(&coarse, &coarse.contacts.pairs[k as usize])[0] < 2.5)
            .collect();
        let found = closed_contacts(
            &Solo,
            (&coarse.bodies, &coarse.contacts.pairs),
            &closed,
            (&fine.bodies, &fine.contacts.pairs),
        );
        assert!((1..fine.contacts.pairs.total()).contains(&found.len()));
        for (number, pair) in fine.contacts.pairs.iter() {
            assert_eq!(found.contains(&number), place(&fine, pair)[0] < 2.5, "{:?}", place(&fine, pair));
        }
    }
}
