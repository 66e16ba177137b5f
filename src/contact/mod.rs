//! Contact geometry: which points of two surfaces face each other, normals and gaps. No unknowns, no multipliers.
//!
//! Every condition is one on a slave node: against the master node opposite where meshes match ([`matching`]), against
//! weighted means of master nodes where they do not ([`mortar`]), or against a rigid obstacle ([`rigid`]). On quadratic
//! faces conditions of nodes are combined ([`quadratic`]). [`pairing`] finds out which, and which surface is the slave.
//!
//! No rank sees a surface whole. A rank has its own faces with two layers around them, and asks for the faces of the other side
//! that are along the normals of these ([`patch`]). What it makes of them has the bits that the whole surfaces would give.
//! [`known`] numbers the conditions and brings them to the ranks that have copies of their nodes. [`consistency`] is
//! what they cost a solution, and [`entry`] what they miss of obstacles.

pub mod areas;
pub mod clip;
pub mod consistency;
pub mod corner;
pub mod dual;
pub mod edge;
pub mod entry;
pub mod known;
pub mod matching;
pub mod mortar;
pub mod opposite;
pub mod pairing;
pub mod patch;
pub mod quadratic;
pub mod rigid;
pub mod sagitta;
pub mod smooth;
pub mod surface;
pub mod tree;

use thiserror::Error;

/// Normals are one up to this.
const ROUNDING: f64 = 1e-12;

/// A condition on the slave surface, named after one of its nodes: linearised frictionless contact
/// `normal . (sum of weight u_slave - sum of weight u_master) <= gap`.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactPair {
    /// Index of the contact in the scene.
    pub contact: usize,
    /// Global node on the slave surface that the condition is named after.
    pub slave: u64,
    /// Number of the smooth part of the surface around that node: each has a normal, and a condition, of its own
    /// ([`smooth`]).
    pub part: u32,
    /// Global nodes on the slave surface with their weights, which add up to one: usually that node alone.
    pub slaves: Vec<(u64, f64)>,
    /// Global nodes on the master surface with their weights, which add up to one; none on a rigid obstacle.
    pub masters: Vec<(u64, f64)>,
    /// Where the normal varies over the condition: for each of these nodes, slaves first, what takes the place of its weight times
    /// `normal`. Those of both sides have one sum. Empty where it does not vary.
    pub vectors: Vec<[f64; 3]>,
    /// Unit vector towards the other side. Between surfaces: the outward normal of the slave surface at the node, mean of
    /// those of the faces around it, weighted by area. At a rigid obstacle: straight into it.
    pub normal: [f64; 3],
    /// Initial distance along the normal (length); negative where the bodies overlap.
    pub gap: f64,
    /// Share of the slave surface that belongs to the condition, seen along its outward normal: pressure is force over this
    /// area. Only what has the other side opposite counts.
    pub area: f64,
    /// Area of the limit of friction: where nodes match, and at obstacles, all of the slave surface that belongs to the node (area).
    /// Else `area`.
    pub limit_area: f64,
    /// Whether the node has the other side opposite; else the condition is at the edge of the other side, near it.
    pub covered: bool,
}

impl ContactPair {
    /// Its nodes with their weights, those of the master with a minus.
    pub fn nodes(&self) -> impl Iterator<Item = (u64, f64)> {
        self.slaves.iter().copied().chain(self.masters.iter().map(|(node, weight)| (*node, -weight)))
    }

    /// Its nodes with their factors in the condition.
    pub fn factors(&self) -> impl Iterator<Item = (u64, [f64; 3])> {
        let slaves = self.slaves.len();
        self.nodes().enumerate().map(move |(at, (node, weight))| match self.vectors.get(at) {
            Some(vector) => (node, vector.map(|x| if at < slaves { x } else { -x })),
            None => (node, self.normal.map(|n| weight * n)),
        })
    }

    /// How far a motion of all slave nodes closes the condition, along each axis: `normal`, where that does not vary.
    pub fn resultant(&self) -> [f64; 3] {
        let slaves = self.vectors.get(..self.slaves.len());
        let sum = |vectors: &[[f64; 3]]| std::array::from_fn(|a| vectors.iter().map(|vector| vector[a]).sum::<f64>());
        slaves.map_or(self.normal, sum)
    }

    /// Force on the slave surface where the condition is met with this force: the master's nodes take all of it.
    pub fn force(&self, force: f64) -> [f64; 3] {
        self.resultant().map(|n| -force * n)
    }
}

/// Where a contact condition is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Place of the slave node.
    pub place: [f64; 3],
    /// Longest edge of the facets around it.
    pub facet: f64,
}

/// A node of the master surface that has slave nodes opposite: what the pressure is there.
#[derive(Clone, Debug, PartialEq)]
pub struct MasterNode {
    /// Index of the contact in the scene.
    pub contact: usize,
    /// Global node.
    pub node: u64,
    /// Number of the smooth part of the surface around it.
    pub part: u32,
    /// Distance of the slave surface (length).
    pub distance: f64,
    /// Whether it is opposite the slave node of one condition, as meshes match.
    pub matches: bool,
    /// Indices of conditions with weights, which add up to one: its pressure is the mean of theirs.
    pub pairs: Vec<(usize, f64)>,
}

/// The conditions of one contact on the nodes of a rank's own faces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Conditions {
    /// Ascending by slave node and part. Ranks that share a node have its conditions all.
    pub pairs: Vec<ContactPair>,
    /// Nodes of the master surface within reach of the rank's own faces, by the indices of these pairs.
    pub masters: Vec<MasterNode>,
    /// Conditions of all ranks.
    pub count: usize,
    /// Slave nodes of all ranks that carry no condition because supports hold them.
    pub held: usize,
}

impl Conditions {
    /// Sets the gaps to a distance that is given, or adds one to those that were found.
    pub fn prescribe(&mut self, clearance: Option<f64>, gap: f64) {
        self.pairs.iter_mut().for_each(|pair| pair.gap = clearance.unwrap_or(pair.gap + gap));
    }
}

/// Why two surfaces cannot be paired.
#[derive(Debug, Error, PartialEq)]
pub enum ContactError {
    /// Supports hold every slave node that faces the master.
    #[error(
        "contact.{name}: supports hold all nodes of the slave surface in the direction of the contact; swap slave and master, \
         or leave that direction free"
    )]
    AllHeld {
        /// Name of the contact in the scene.
        name: String,
    },
    /// The surfaces do not face each other anywhere.
    #[error(
        "contact.{name}: no node of the slave surface has the master surface opposite along its normal; \
             check the names of the surfaces and the positions of the bodies"
    )]
    Apart {
        /// Name of the contact in the scene.
        name: String,
    },
    /// All of a slave surface is turned away from a rigid obstacle, or beside it.
    #[error(
        "contact.{name}: none of the {slaves} nodes of the slave surface faces the obstacle; check its place and which side \
         is free (normal, inside, above), and the name of the surface"
    )]
    LooksAway {
        /// Name of the contact in the scene.
        name: String,
        /// All slave nodes.
        slaves: usize,
    },
    /// A node is stopped in more directions than it has components.
    #[error(
        "contact.{names}: {nodes} nodes are stopped in more directions than are independent there, so the contact forces would not \
         be unique; give each obstacle the part of the surface that it can touch, and leave out a face where more than three meet \
         at a tip"
    )]
    Crowded {
        /// Names of the contacts at the first such node.
        names: String,
        /// How many such nodes there are.
        nodes: usize,
    },
    /// Supports hold a slave node where it overlaps with the other side.
    #[error(
        "contact.{name}: supports hold {nodes} of its nodes inside the other side, up to {depth:.2e} deep; move the bodies apart, \
         or leave the direction towards the other side free where they meet"
    )]
    Held {
        /// Name of the contact in the scene.
        name: String,
        /// Slave nodes that are held so.
        nodes: usize,
        /// Deepest of them (length).
        depth: f64,
    },
}
