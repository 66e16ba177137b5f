//! `G G'` of the members of each group by the gluing rows between them, and its inverse.
//!
//! It leaves the rigid motions of the group as a whole. So the first member is tied: `(G G')^+` gives it no motion, which is exact
//! for forces that are in balance over the group.

use std::collections::HashMap;
use std::ops::Range;
use std::rc::Rc;

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};

use super::Motions;
use super::motions::Transfer;
use crate::constraint::Constraints;
use crate::decomposition::{Clusters, Subdomain};
use crate::feti::dual::Interconnection;
use crate::feti::dual::blocks::{Block, Blocks, FewBlocks, Place, add_block, add_product, pack, unpack};
use crate::feti::inverse::kernel::MODES;
use crate::simd::vectorised;
use crate::work;

/// `G` of a row for one member.
type OfMember = (usize, [f64; MODES]);

/// `(G G')^+` of all members but the first, by columns.
pub struct Inverse {
    /// Number of unknowns: six for each member but the first.
    pub length: usize,
    columns: Vec<f64>,
}

/// What `G G'` is made of.
pub struct Equalities<'s> {
    pub clusters: &'s Clusters,
    pub connection: &'s Interconnection<'s>,
    pub subdomains: &'s [Subdomain],
    pub constraints: &'s Constraints,
}

/// The members of the groups of one level, which are of the level below.
pub struct OfLevel {
    /// For each group at home here the inverse of its `G G'` by the gluing between its members; groups with equal blocks share one.
    /// `None` where something leaves members free.
    pub inverses: Vec<Option<Rc<Inverse>>>,
    /// For each member at home here the diagonal block of `G G'` of all equalities that move it.
    pub diagonals: Vec<Transfer>,
}

/// What own subdomains have of the rows of a level.
struct Parts {
    /// The rows between the members of each one's group: a number that orders them, and which of `members` they have.
    rows: Vec<Vec<(u32, Range<u32>)>>,
    members: Vec<OfMember>,
    /// Diagonal blocks.
    diagonals: Vec<Block>,
}

impl Equalities<'_> {
    /// Of the groups of a level. Collective.
    pub fn of_level(&self, level: usize) -> OfLevel {
        let Self { connection, .. } = self;
        let parts = self.parts(level);
        let mut known: HashMap<Vec<u64>, Option<Rc<Inverse>>> = HashMap::new();
        let blocks = self.brought_home(level, &parts);
        let of_group = |(members, blocks): (&Range<usize>, &Blocks)| {
            let entry = |(&(row, column), block): (&Place, &Block)| {
                [row as u64, column as u64].into_iter().chain(block.map(f64::to_bits)).collect::<Vec<_>>()
            };
            let key: Vec<u64> = [members.len() as u64].into_iter().chain(blocks.iter().flat_map(entry)).collect();
            known.entry(key).or_insert_with(|| Inverse::new(members.len(), blocks).map(Rc::new)).clone()
        };
        let inverses = connection.tree.members(level).iter().zip(&blocks).map(of_group).collect();
        let sums = connection.tree.sum(level - 1, parts.diagonals.as_flattened(), MODES * MODES);
        let lines = |block: &Block| std::array::from_fn(|i| std::array::from_fn(|j| block[MODES * i + j]));
        OfLevel { inverses, diagonals: sums.as_chunks().0.iter().map(lines).collect() }
    }

    /// A row counts for the first subdomain that it is of, in a member for the first of the member. One neighbour exchange.
    fn parts(&self, level: usize) -> Parts {
        let Self { clusters, connection, subdomains, constraints } = self;
        let Interconnection { gather, motions, gluing, .. } = connection;
        let first = subdomains.first().map_or(0, |s| s.id);
        let own = |subdomain: u32| (subdomain as usize).checked_sub(first).filter(|&own| own < subdomains.len());
        let (mut rows, mut all) = (vec![Vec::new(); subdomains.len()], Vec::new());
        let mut diagonals = vec![[0.0; MODES * MODES]; subdomains.len()];
        // The order of rows depends on what is outside of the group, that of nodes does not.
        let mut dofs = vec![0; constraints.rows.len()];
        for entry in (0..subdomains.len()).flat_map(|own| gather.entries(own)) {
            if entry.slot == constraints.slot_begin[entry.row as usize] {
                dofs[entry.row as usize] = entry.dof;
            }
        }
        let is_above = |row| gluing.level(row) >= Some(level);
        gather.moved(is_above, modes_of_nodes(level - 1, motions, subdomains), |row, values| {
            let slots = &constraints.slot_subdomain[constraints.slots(row)];
            let (begin, mut values) = (all.len(), values.iter());
            let member = |subdomain: u32| clusters.group(level - 1, subdomain as usize);
            for of_member in slots.chunk_by(|&a, &b| member(a) == member(b)) {
                let sixes = values.by_ref().take(of_member.len()).copied();
                let six = sixes.reduce(sum).expect("no member is without a slot");
                if let Some(own) = own(of_member[0]) {
                    add_product(&mut diagonals[own], &six, &six);
                }
                all.push((member(of_member[0]), six));
            }
            match own(slots[0]).filter(|_| gluing.level(row) == Some(level)) {
                Some(own) => rows[own].push((dofs[row], begin as u32..all.len() as u32)),
                None => all.truncate(begin),
            }
        });
        Parts { rows, members: all, diagonals }
    }

    /// Lower blocks of the groups at home here. Collective.
    fn brought_home(&self, level: usize, parts: &Parts) -> Vec<Blocks> {
        let Self { clusters, connection: Interconnection { tree, .. }, subdomains, .. } = self;
        let mut outgoing = vec![Vec::new(); tree.comm().size()];
        for (subdomain, rows) in subdomains.iter().zip(&parts.rows) {
            let mut rows = rows.clone();
            rows.sort_by_key(|row| row.0);
            let mut blocks = FewBlocks::default();
            for (_, members) in rows {
                let of_row = &parts.members[members.start as usize..members.end as usize];
                work::add(MODES * MODES * of_row.len() * (of_row.len() + 1), size_of_val(of_row));
                for (at, (column, b)) in of_row.iter().enumerate() {
                    for (row, a) in &of_row[at..] {
                        add_product(blocks.at((*row, *column)), a, b);
                    }
                }
            }
            let group = clusters.group(level, subdomain.id);
            outgoing[tree.home(clusters.begin(level, group))].extend(pack(&blocks.into_blocks()));
        }
        let groups = tree.groups(level);
        let mut sums = vec![Blocks::new(); groups.len()];
        for message in tree.comm().all_to_all(outgoing) {
            for ((row, column), block) in unpack(&message) {
                let group = clusters.group(level, clusters.begin(level - 1, row));
                let begin = clusters.children(level, group).start;
                add_block(&mut sums[group - groups.start], (row - begin, column - begin), block);
            }
        }
        sums
    }
}

fn sum(a: [f64; MODES], b: [f64; MODES]) -> [f64; MODES] {
    std::array::from_fn(|k| a[k] + b[k])
}

/// The modes of the groups of a level at the nodes of own subdomains, one component. Congruent groups have equal bits on the
/// lowest level, where all depends on shapes alone.
fn modes_of_nodes<'s>(
    level: usize,
    motions: &'s Motions,
    subdomains: &'s [Subdomain],
) -> impl Fn(usize, usize, usize) -> [f64; MODES] + 's {
    move |own, node, axis| match level {
        0 => motions.shapes[own].along(axis, subdomains[own].shape[node]),
        _ => motions.levels[level][own].along(axis, subdomains[own].points[node]),
    }
}

impl Inverse {
    /// Of so many members with these lower blocks; `None` if something moves freely.
    fn new(members: usize, blocks: &Blocks) -> Option<Self> {
        let length = MODES * (members - 1);
        let mut matrix = Mat::zeros(length, length);
        for (&(row, column), block) in blocks.iter().filter(|(place, _)| place.1 > 0) {
            let (row, column) = (MODES * (row - 1), MODES * (column - 1));
            for (k, x) in block.iter().enumerate() {
                matrix[(row + k / MODES, column + k % MODES)] = *x;
            }
        }
        // A factor of n^3/3 and an inverse of 2n^3/3 operations.
        work::add(length.pow(3), size_of::<f64>() * length * length);
        let largest = (0..length).map(|k| matrix[(k, k)]).fold(0.0, f64::max);
        let factor = matrix.llt(Side::Lower).ok()?;
        let inverse = factor.inverse();
        let columns: Vec<f64> =
            (0..length).flat_map(|j| (0..length).map(move |i| (i, j))).map(|at| inverse[at]).collect();
        let is_firm = (0..length).all(|k| columns[length * k + k] * largest < 1.0 / LOOSE);
        is_firm.then_some(Self { length, columns })
    }

    /// Its product with `count` vectors, up to [`TOGETHER`]; the bits of each do not depend on the others.
    pub fn multiply(&self, x: &[[f64; TOGETHER]], count: usize) -> Vec<[f64; TOGETHER]> {
        work::add(2 * count * self.columns.len(), size_of_val(&self.columns[..]));
        let mut y = vec![[0.0; TOGETHER]; self.length];
        vectorised(
            (&self.columns[..], x, &mut y[..]),
            #[inline(always)]
            |(columns, x, y)| {
                for (column, x) in columns.chunks_exact(y.len().max(1)).zip(x) {
                    for (y, a) in y.iter_mut().zip(column) {
                        (0..TOGETHER).for_each(|k| y[k] += a * x[k]);
                    }
                }
            },
        );
        y
    }
}

/// Members that move by more than the inverse of this, relative to what holds them, are loose.
const LOOSE: f64 = 1e-10;
/// Vectors that are multiplied together.
pub const TOGETHER: usize = 8;
