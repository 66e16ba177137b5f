//! How large a discrete problem is: counts in the paper's way, and the memory that solving would take.

use std::rc::Rc;

use super::held::kind;
use super::memory::{Held, Lengths, Memory, Numbers, PROCESS_MB};
use crate::comm::exact::exact_sums;
use crate::comm::{Comm, maximum};
use crate::constraint::Kind;
use crate::decomposition::{Cut, Decomposition, Subdomain, bricks};
use crate::feti::dual::space::RowSpace;
use crate::feti::inverse::factor::{Symbolic, analyse};
use crate::model::discrete::{Discrete, cut};
use crate::record::counts::Sizes;
use crate::scene::Scene;

/// Counts what a discrete problem consists of, in the paper's way. Collective.
pub fn sizes(discrete: &Discrete, comm: &dyn Comm) -> Sizes {
    let Discrete { decomposition, constraints, bodies, .. } = discrete;
    let clusters = &decomposition.clusters;
    let space = RowSpace::new(comm, &decomposition.shares, constraints);
    let mut partial = Vec::new();
    for (rows, subdomain) in space.owned().iter().zip(&decomposition.subdomains) {
        let touches = subdomain.facets.iter().any(|facet| discrete.contacts.touch(facet.surface));
        let mut counts = [subdomain.dofs() as f64, 0.0, 0.0, 0.0, 0.0, f64::from(touches)];
        for row in rows.clone() {
            counts[match constraints.rows[row].kind {
                Kind::Gluing => 1,
                Kind::Support { .. } => 2,
                Kind::Contact { .. } => 3,
                Kind::Friction { .. } => 4,
            }] += 1.0;
        }
        partial.extend(counts);
    }
    let sum: Vec<u64> = space.sum(&partial, 6).into_iter().map(|n| n as u64).collect();
    Sizes {
        nodes: bodies.iter().map(|b| b.counts().nodes).sum(),
        cells: bodies.iter().map(|b| b.counts().cells).sum(),
        elements: bodies.iter().map(|b| b.counts().elements).sum(),
        subdomains: decomposition.shares.total() as u64,
        clusters: clusters.count(clusters.levels().min(1)) as u64,
        coarse_blocks: clusters.total() as u64,
        contact_subdomains: sum[5],
        primal_dofs: sum[0],
        gluing_rows: sum[1],
        dirichlet_rows: sum[2],
        contact_rows: sum[3],
        friction_rows: sum[4],
        dual_dofs: sum[1] + sum[2] + sum[3] + sum[4],
        estimated: Vec::new(),
    }
}

/// Memory that solving would take: as the model of [`mod@super::memory`] has it, from the analysis of all subdomains.
/// Subdomains of equal connectivity are analysed once. Collective.
pub fn memory(scene: &Scene, discrete: &Discrete, comm: &dyn Comm) -> Memory {
    let Discrete { decomposition, constraints, contacts, .. } = discrete;
    let cut = cut(&scene.decomposition.method, &discrete.bodies);
    let boxes = |s: &Subdomain| match cut {
        Cut::Bricks(cells) => Some(bricks::count(&discrete.bodies[s.body], cells)),
        Cut::Parts(_) => None,
    };
    let lengths = |s: &Rc<Symbolic>| {
        let lengths = [s.analysis().factor_length(), s.pattern.rows.len(), s.pattern.dofs()];
        let [factor, matrix, unknowns] = lengths.map(|n| n as f64);
        Lengths { factor, matrix, unknowns }
    };
    let lengths: Vec<Lengths> = analyse(&decomposition.subdomains).iter().map(lengths).collect();
    let each = lengths.iter().zip(&decomposition.subdomains);
    let of_subdomains = each.map(|(&lengths, subdomain)| Numbers::of_subdomain(scene, lengths, boxes(subdomain)));
    let groups = if matches!(cut, Cut::Bricks(_)) { Vec::new() } else { members_of_groups(decomposition) };
    let groups = groups.into_iter().map(|members| Numbers::of_group(members as f64));
    // Each block counts once, where its lowest subdomain is.
    let blocks = constraints.blocks.iter().zip(&constraints.block_subdomains);
    let owned = blocks.filter(|(_, subdomains)| decomposition.own_index(subdomains[0]).is_some());
    let slots = owned.map(|(rows, _)| constraints.slot_begin[rows.end] - constraints.slot_begin[rows.start]);
    let slots = slots.map(|slots| Numbers::of_slots(slots.into()));
    let rows: Vec<_> = of_subdomains.chain(groups).chain(slots).map(|numbers| numbers.0).collect();
    let numbers = Numbers(exact_sums(comm, &rows));
    let largest = maximum(comm, &[lengths.iter().fold(0.0, |largest, lengths| lengths.factor.max(largest))])[0];
    let mut conditions = [0.0; 3];
    for (contact, row) in scene.contact.values().zip(&contacts.rows) {
        let count = row.conditions as f64;
        conditions[kind(scene, contact, row.rule != "mortar", count)] += count;
    }
    let [subdomains, coarse_blocks] = [decomposition.shares.total(), decomposition.clusters.total()].map(|n| n as f64);
    let held = Held { numbers, subdomains, coarse_blocks, conditions, surfaces: contacts.surfaces() as f64, largest };
    let items = held.items();
    Memory { items, numbers, cutting_mb: discrete.reading_mb.map_or(0.0, |mb| (mb - PROCESS_MB).max(0.0)) }
}

/// How many members the groups have whose first subdomain is the rank's.
fn members_of_groups(decomposition: &Decomposition) -> Vec<usize> {
    let Decomposition { clusters, .. } = decomposition;
    let first = decomposition.subdomains.first().map_or(0, |subdomain| subdomain.id);
    let own = first..first + decomposition.subdomains.len();
    let of_level =
        |level: usize| clusters.beginning(level, own.clone()).map(move |group| clusters.children(level, group).len());
    (1..=clusters.levels()).flat_map(of_level).collect()
}
