//! The rigid modes of subdomains and groups, orthonormal over all their nodes, and those of groups in terms of their children's.

use super::Tree;
use crate::decomposition::Subdomain;
use crate::feti::inverse::kernel::{MODES, RigidModes, inertia};
use crate::vector::{difference, dot};

/// A matrix between six modes and six others.
pub type Transfer = [[f64; MODES]; MODES];

/// The modes of own subdomains and of their groups.
pub struct Motions {
    /// Those of own subdomains in terms of their shapes, if there are groups: congruent ones have equal bits.
    pub shapes: Vec<RigidModes>,
    /// For each level, from 0, those of each own subdomain's group.
    pub levels: Vec<Vec<RigidModes>>,
    /// For each level, from 1, `T_c` of all children of the groups at home here: the group's modes in terms of the child's.
    pub transfers: Vec<Vec<Transfer>>,
}

impl Motions {
    /// Of subdomains and all their groups. Collective.
    pub fn new(tree: &Tree, subdomains: &[Subdomain]) -> Self {
        let own = |s: &Subdomain| RigidModes::new(&s.points);
        let mut levels = vec![subdomains.iter().map(own).collect::<Vec<_>>()];
        let mut transfers = Vec::new();
        let mut nodes: Vec<f64> = subdomains.iter().flat_map(Nodes::of).collect();
        let mut modes: Vec<f64> = levels[0].iter().flat_map(RigidModes::to_numbers).collect();
        for level in 1..=tree.levels() {
            let (of_children, children) = (tree.up(level, &nodes, NODES), tree.up(level, &modes, NUMBERS));
            (nodes, modes) = (Vec::new(), Vec::new());
            let mut of_level = Vec::new();
            for members in tree.members(level) {
                let all = Nodes::joined(&of_children.as_chunks::<NODES>().0[members.clone()]);
                let of_group = all.modes();
                let child = |numbers: &[f64; NUMBERS]| of_group.in_modes_of(&RigidModes::from_numbers(numbers));
                of_level.extend(children.as_chunks().0[members.clone()].iter().map(child));
                nodes.extend(all.to_numbers());
                modes.extend(of_group.to_numbers());
            }
            transfers.push(of_level);
            let spread = tree.spread(level, &modes, NUMBERS);
            levels.push(spread.as_chunks().0.iter().map(RigidModes::from_numbers).collect());
        }
        let of_shape = |s: &Subdomain| RigidModes::new(&s.shape);
        let shapes = if tree.levels() > 0 { subdomains.iter().map(of_shape).collect() } else { Vec::new() };
        Self { shapes, levels, transfers }
    }
}

/// Numbers that tell nodes and modes.
const NODES: usize = 13;
const NUMBERS: usize = 13;

/// How many nodes there are, their centroid and their inertia tensor about it.
struct Nodes {
    count: f64,
    centre: [f64; 3],
    moments: [[f64; 3]; 3],
}

impl Nodes {
    fn of(subdomain: &Subdomain) -> [f64; NODES] {
        let (centre, moments) = inertia(&subdomain.points);
        Self { count: subdomain.points.len() as f64, centre, moments }.to_numbers()
    }

    /// All nodes of some parts; a node that several have counts several times.
    fn joined(parts: &[[f64; NODES]]) -> Self {
        let parts: Vec<Self> = parts.iter().map(Self::from_numbers).collect();
        let count: f64 = parts.iter().map(|part| part.count).sum();
        let centre: [f64; 3] =
            std::array::from_fn(|a| parts.iter().map(|part| part.count * part.centre[a]).sum::<f64>() / count);
        let mut moments = [[0.0; 3]; 3];
        for part in &parts {
            let arm = difference(part.centre, centre);
            for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
                let square = if a == b { dot(arm, arm) } else { 0.0 };
                moments[a][b] += part.moments[a][b] + part.count * (square - arm[a] * arm[b]);
            }
        }
        Self { count, centre, moments }
    }

    fn modes(&self) -> RigidModes {
        RigidModes::of_nodes(self.count, self.centre, self.moments)
    }

    fn to_numbers(&self) -> [f64; NODES] {
        let mut numbers = [self.count; NODES];
        numbers[1..4].copy_from_slice(&self.centre);
        numbers[4..].copy_from_slice(self.moments.as_flattened());
        numbers
    }

    fn from_numbers(numbers: &[f64; NODES]) -> Self {
        let [count, x, y, z, moments @ ..] = *numbers;
        Self { count, centre: [x, y, z], moments: std::array::from_fn(|i| std::array::from_fn(|j| moments[3 * i + j])) }
    }
}
