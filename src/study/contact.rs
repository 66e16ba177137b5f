//! Contact at the nodes of the mesh: pressure on both sides, gap and status on the slave's.
//!
//! The pressure of a condition is its force over its area. So is its friction stress; but where a limit of the stress is given it is
//! over the area that the limit counts: where nodes match, with what is beyond the edge of the other surface. A node of the master
//! surface has the mean of the conditions around the place opposite, weighted by the slave's linear functions there. A node of several contacts, or of
//! several smooth parts of one, shows the largest of its pressures and the smallest of its gaps; where contacts share nodes each has a
//! field of its own beside these. Nodes beyond the edge of the other surface touch nothing, and show nothing.

use std::collections::HashMap;

use crate::constraint::law::Status;
use crate::contact::MasterNode;
use crate::contact::known::Pairs;
use crate::decomposition::Subdomain;
use crate::model::contacts::Contacts;
use crate::newton::friction::Rubbing;
use crate::results::piece::Field;

/// Contact at one pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactState {
    /// Index of the pair.
    pub pair: usize,
    /// Normal force that the surfaces exert on each other, at least zero (force).
    pub force: f64,
    /// Distance along the normal (length); negative is penetration.
    pub gap: f64,
    /// Whether the surfaces touch, and slip.
    pub status: Status,
    /// Friction, if there is any.
    pub friction: Option<Rubbing>,
}

impl ContactState {
    /// Force over the area of the condition (stress); the condition must be known here.
    pub fn pressure(&self, pairs: &Pairs) -> f64 {
        self.force / pairs[self.pair].area
    }
}

/// Contact at the nodes of a rank's subdomains.
struct AtNodes {
    /// Zero where nothing touches.
    pressure: Vec<f64>,
    /// Not a number off the slave surfaces.
    gap: Vec<f64>,
    /// The largest [`Status`] of the node's contacts, -1 off the slave surfaces.
    status: Vec<i64>,
}

/// Fields of the nodes of these subdomains, one behind the other; `states` are those of the pairs whose rows are on this rank.
pub fn fields(subdomains: &[Subdomain], touching: &Contacts, states: &[ContactState]) -> Vec<Field> {
    let known = Known::new(touching, states);
    let of = |wanted: &dyn Fn(usize) -> bool| {
        let parts = subdomains.iter().map(|subdomain| known.at_nodes(subdomain, wanted));
        parts.fold(AtNodes::nothing(0), AtNodes::and)
    };
    let AtNodes { pressure, gap, status } = of(&|_| true);
    let mut fields = vec![
        Field::scalar("contact_pressure", pressure),
        Field::scalar("contact_gap", gap),
        Field::integer("contact_status", status),
    ];
    if touching.has_friction {
        let [traction, slip]: [Vec<[f64; 3]>; 2] = std::array::from_fn(|which| {
            subdomains.iter().flat_map(|subdomain| known.vectors(subdomain, which)).collect()
        });
        fields.push(Field::vector("friction_traction", &traction));
        fields.push(Field::vector("slip", &slip));
    }
    for &contact in &touching.sharing {
        let pressure = of(&|of| of == contact).pressure;
        // Names in HDF5 have no slash.
        let name = touching.names[contact].replace('/', "_");
        fields.push(Field::scalar(&format!("contact_pressure_{name}"), pressure));
    }
    fields
}

/// What a rank knows of contact, by node.
struct Known<'a> {
    /// All nodes of both sides, ascending.
    nodes: Vec<u64>,
    /// Nodes of slave surfaces with the contacts and the states of their conditions, ascending.
    slaves: Vec<(u64, usize, &'a ContactState)>,
    /// Nodes of master surfaces, ascending.
    masters: Vec<&'a MasterNode>,
    /// Pressure of each condition whose row is on this rank.
    pressures: HashMap<usize, f64>,
    /// Friction stress on the slave's side of each condition whose row is on this rank, and what it slid on the other.
    rubbed: HashMap<usize, [[f64; 3]; 2]>,
}

impl<'a> Known<'a> {
    fn new(Contacts { pairs, masters, .. }: &'a Contacts, states: &'a [ContactState]) -> Self {
        let pressures = states.iter().map(|state| (state.pair, state.pressure(pairs))).collect();
        let rubbed = states.iter().filter_map(|state| {
            let Rubbing { force, total, is_given, .. } = state.friction?;
            let pair = &pairs[state.pair];
            let area = if is_given { pair.limit_area } else { pair.area };
            Some((state.pair, [force.map(|f| f / area), total]))
        });
        let rubbed = rubbed.collect();
        let covered = states.iter().filter(|state| pairs[state.pair].covered);
        let mut slaves: Vec<_> =
            covered.map(|state| (pairs[state.pair].slave, pairs[state.pair].contact, state)).collect();
        slaves.sort_by_key(|(node, _, state)| (*node, state.pair));
        let mut masters: Vec<&MasterNode> = masters.iter().collect();
        masters.sort_by_key(|master| master.node);
        let nodes = slaves.iter().map(|(node, ..)| *node).chain(masters.iter().map(|master| master.node));
        let mut nodes: Vec<u64> = nodes.collect();
        nodes.sort_unstable();
        nodes.dedup();
        Self { nodes, slaves, masters, pressures, rubbed }
    }

    /// The conditions of a node on slave surfaces.
    fn slaves_at(&self, node: u64) -> impl Iterator<Item = &(u64, usize, &'a ContactState)> {
        let first = self.slaves.partition_point(|(known, ..)| *known < node);
        self.slaves[first..].iter().take_while(move |(known, ..)| *known == node)
    }

    /// What a node on master surfaces meets.
    fn masters_at(&self, node: u64) -> impl Iterator<Item = &&'a MasterNode> {
        let first = self.masters.partition_point(|master| master.node < node);
        self.masters[first..].iter().take_while(move |master| master.node == node)
    }

    /// Pressure of a condition; zero where its row is on other ranks.
    fn pressure(&self, pair: usize) -> f64 {
        self.pressures.get(&pair).copied().unwrap_or_default()
    }

    /// Friction stress (0) or slip (1) at the nodes of a subdomain; on the master's side the mean of the conditions opposite, the other
    /// way. Nodes of several contacts show sums.
    fn vectors(&self, subdomain: &Subdomain, which: usize) -> Vec<[f64; 3]> {
        let mut found = vec![[0.0; 3]; subdomain.nodes.len()];
        let mut add = |local: usize, factor: f64, pair: usize| {
            let Some(of) = self.rubbed.get(&pair).map(|of| of[which]) else { return };
            found[local].iter_mut().zip(of).for_each(|(sum, x)| *sum += factor * x);
        };
        for (local, &node) in subdomain.nodes.iter().enumerate() {
            self.slaves_at(node).for_each(|(.., state)| add(local, 1.0, state.pair));
            let opposite = self.masters_at(node).flat_map(|master| &master.pairs);
            opposite.for_each(|&(pair, weight)| add(local, -weight, pair));
        }
        found
    }

    /// Contact at the nodes of a subdomain, of the contacts that are wanted.
    fn at_nodes(&self, subdomain: &Subdomain, wanted: &dyn Fn(usize) -> bool) -> AtNodes {
        let mut found = AtNodes::nothing(subdomain.nodes.len());
        // Copies of a node show the same, also where a subdomain has no face of the surface.
        let touches = |(_, node): &(usize, &u64)| self.nodes.binary_search(node).is_ok();
        for (local, &node) in subdomain.nodes.iter().enumerate().filter(touches) {
            for (.., state) in self.slaves_at(node).filter(|(_, contact, _)| wanted(*contact)) {
                found.pressure[local] = found.pressure[local].max(self.pressure(state.pair));
                // `min` takes the number of a number and none.
                found.gap[local] = state.gap.min(found.gap[local]);
                found.status[local] = found.status[local].max(state.status as i64);
            }
            for master in self.masters_at(node).filter(|master| wanted(master.contact)) {
                let mean = master.pairs.iter().map(|&(pair, weight)| weight * self.pressure(pair)).sum();
                found.pressure[local] = found.pressure[local].max(mean);
            }
        }
        found.fill_middles(subdomain);
        found
    }
}

impl AtNodes {
    /// Nodes off all surfaces.
    fn nothing(nodes: usize) -> Self {
        Self { pressure: vec![0.0; nodes], gap: vec![f64::NAN; nodes], status: vec![-1; nodes] }
    }

    /// One behind the other.
    fn and(mut self, other: Self) -> Self {
        self.pressure.extend(other.pressure);
        self.gap.extend(other.gap);
        self.status.extend(other.status);
        self
    }

    /// Where contact of a quadratic face has conditions at its corners only, its fields are linear: middles have the means.
    fn fill_middles(&mut self, subdomain: &Subdomain) {
        let quadratic = subdomain.facets.iter().filter(|facet| facet.nodes.len() == 6);
        let edges =
            quadratic.flat_map(|facet| (0..3).map(|k| [3 + k, k, (k + 1) % 3].map(|n| facet.nodes[n] as usize)));
        for [middle, a, b] in edges {
            if self.status[middle] < 0 && self.status[a] >= 0 && self.status[b] >= 0 {
                self.pressure[middle] = 0.5 * (self.pressure[a] + self.pressure[b]);
                self.gap[middle] = 0.5 * (self.gap[a] + self.gap[b]);
                self.status[middle] = self.status[a].max(self.status[b]);
            }
        }
    }
}
