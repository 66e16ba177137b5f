//! The rows of B: gluing of copies, supports and contact. All are orthogonal but for contact rows that share nodes, where a
//! node is in several contacts or meshes do not match.
//!
//! Rows are unit vectors unless stiffness jumps. Where it does, the length of a row is the root of the stiffness it works
//! against, relative to the largest. The orthogonal projector onto multipliers in balance then equals the projector with a
//! diagonal `Q` of Klawonn and Widlund (Comm. Pure Appl. Math. 54, 2001); without it iterations grow with the jump. Of the
//! copies of a node the stiffest are glued first, so that no two stiff copies are joined through a soft one.
//!
//! Rows that share a node form a *block*: the gluing and support rows of a node, together with those of the nodes
//! that contact, or short edges ([`ties`]), tie to it. A rank holds every row of every block that one of its
//! subdomains touches, so whatever couples the rows of a block is local. Large components of nodes are cut into many blocks, of which a
//! rank holds those that its subdomains touch, and some around them ([`reach`]). Rows, their order and their coefficients do not depend on
//! the ranks.
//!
//! Supports and contact act on the mean over the copies and are therefore orthogonal to gluing (design: "Constraint
//! rows"). The counts are those of the paper's Table 2: gluing `copies - 1` a component, one support row a node and
//! component, one contact row a slave node and contact.

pub mod blocks;
pub mod components;
pub mod contact;
pub mod dirichlet;
pub mod friction;
pub mod gluing;
pub mod law;
pub mod links;
pub mod prescribed;
pub mod reach;
pub mod ties;

use std::ops::Range;

use thiserror::Error;

use self::friction::Slider;
use self::prescribed::Parallel;
use self::ties::Ties;

/// What a row stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Copies of a node move together.
    Gluing,
    /// A component of the displacement is prescribed.
    Support {
        /// Index of the support in the scene.
        support: usize,
        /// Component.
        axis: usize,
    },
    /// Two surfaces do not penetrate.
    Contact {
        /// Number of the contact pair among those of the scene.
        pair: usize,
    },
    /// What two surfaces slide along each other.
    Friction {
        /// Number of the contact pair.
        pair: usize,
        /// Number of the direction, 0 or 1.
        axis: u8,
    },
}

/// A coefficient of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term {
    /// Subdomain of the copy.
    pub subdomain: u32,
    /// Global node.
    pub node: u64,
    /// Component of the displacement.
    pub axis: usize,
    /// The coefficient.
    pub value: f64,
}

/// One row: `sum of terms = rhs`, or `<= rhs` for contact ([`law`]); see [`Row::right_hand_side`].
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What it stands for.
    pub kind: Kind,
    /// Factor that gave the row its length: force (force) = `scale` times multiplier, distance (length) = slack / `scale`.
    pub scale: f64,
    /// Length of the row.
    pub length: f64,
    /// Its coefficients.
    pub terms: Vec<Term>,
    /// Components of a contact's condition that supports fix. They are part of the right-hand side.
    pub fixed: Vec<Fixed>,
    /// Other contact conditions along the same direction; the right-hand side is that of the tightest.
    pub parallel: Vec<Parallel>,
}

/// A component of a contact's condition that a support fixes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fixed {
    /// Index of the support in the scene.
    pub support: usize,
    /// Component.
    pub axis: usize,
    /// Its coefficient in the condition; the support takes as much of the contact force.
    pub weight: f64,
}

impl Kind {
    /// Whether the row is of a contact: its force is one that surfaces exert on each other.
    pub fn is_contact(self) -> bool {
        matches!(self, Self::Contact { .. } | Self::Friction { .. })
    }
}

impl Term {
    /// Whether both belong to one copy of a node, in one row.
    pub fn share_slot(&self, other: &Self) -> bool {
        (self.subdomain, self.node) == (other.subdomain, other.node)
    }
}

/// Ratio of stiffness from which rows are not unit vectors.
const JUMP: f64 = 16.0;

/// Least relative stiffness that a row's length follows: the coarse problem has sixteen digits for the squared lengths.
const SOFTEST: f64 = 1e-9;

impl Row {
    /// Gives a unit vector its length: the root of the stiffness it works against over the largest stiffness, rounded to a
    /// power of two and at least the root of [`SOFTEST`]. Given are the stiffness of subdomains and the largest of all.
    fn weigh(&mut self, stiffness: impl Fn(u32) -> f64, largest: f64) {
        let flexibility: f64 = self.terms.iter().map(|t| t.value * t.value / stiffness(t.subdomain)).sum();
        let relative = (1.0 / (flexibility * largest)).max(SOFTEST);
        if relative * JUMP <= 1.0 {
            self.lengthen((0.5 * relative.log2()).round().exp2());
        }
    }

    /// Multiplies its length by a factor.
    fn lengthen(&mut self, factor: f64) {
        self.length *= factor;
        self.scale *= factor;
        self.parallel.iter_mut().for_each(|other| other.scale *= factor);
        self.terms.iter_mut().for_each(|term| term.value *= factor);
    }
}

/// A prescribed displacement on a named surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Support {
    /// Name in the scene.
    pub name: String,
    /// Index of the named surface.
    pub surface: usize,
    /// Components that are fixed.
    pub fixed: [bool; 3],
    /// Their values (length).
    pub displacement: [f64; 3],
}

/// A coefficient of B in local numbering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Row on this rank.
    pub row: u32,
    /// Which of the row's slots collects this node's contribution.
    pub slot: u32,
    /// Local unknown, `3 node + axis`.
    pub dof: u32,
    /// The coefficient.
    pub value: f64,
}

/// The rows that one rank holds.
pub struct Constraints {
    /// Rows, block by block in the order of the blocks' lowest nodes. Terms are sorted by subdomain and node: one slot each.
    pub rows: Vec<Row>,
    /// Friction at the contact pairs of these rows; none without friction.
    pub sliders: Vec<Slider>,
    /// Rows of each block.
    pub blocks: Vec<Range<usize>>,
    /// Subdomains that hold each block, ascending: those that touch it and, of parts of large components, those near it.
    pub block_subdomains: Vec<Vec<u32>>,
    /// Whether each block is part of a large component.
    pub is_part: Vec<bool>,
    /// Whether any rank has such blocks.
    pub has_parts: bool,
    /// First slot of each row, and the end. A slot is the part of one copy of a node in a row.
    pub slot_begin: Vec<u32>,
    /// Subdomain of each slot; ascending within a row.
    pub slot_subdomain: Vec<u32>,
    /// Coefficients of each own subdomain, by row.
    pub entries: Vec<Vec<Entry>>,
    /// Own nodes with copies elsewhere or rows: for each own subdomain (local node, number of copies) where > 1.
    pub copies: Vec<Vec<(u32, u32)>>,
    /// Whether any rank has contact rows.
    pub has_inequalities: bool,
    /// Whether any contact has friction, in any step.
    pub has_friction: bool,
    /// Whether stiffness jumps, and rows may be of unequal length.
    pub uneven: bool,
    /// Whether those of contacts are: what gives way there is not as soft everywhere.
    pub uneven_contacts: bool,
    /// Nodes that short edges tie together.
    pub ties: Ties,
    /// Contact pairs of own nodes without a row, as supports fix all their nodes along the normal: index of the pair and the
    /// components that they fix.
    pub idle: Vec<(usize, Vec<Fixed>)>,
    /// Pairs of own nodes with friction whose sides supports hold along the surface, both.
    pub guided: Vec<friction::Guided>,
}

/// Why the rows cannot be set up.
#[derive(Debug, Error, PartialEq)]
pub enum ConstraintError {
    /// Two supports prescribe different values at one node.
    #[error(
        "support.{first} and support.{second} prescribe different displacements along {axis} where their surfaces \
         meet ({first_value} and {second_value}); make them equal, or leave {axis} out of one"
    )]
    Conflict {
        /// One support.
        first: String,
        /// The other.
        second: String,
        /// Component.
        axis: char,
        /// Value of the one.
        first_value: f64,
        /// Value of the other.
        second_value: f64,
    },
}

#[cfg(test)]
mod tests;
