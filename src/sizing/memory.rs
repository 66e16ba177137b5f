//! What solving takes in memory: the model that counts and built problems share.
//!
//! A subdomain has
//! - the factor of its stiffness, in single precision where that is mixed and the subdomain is small enough for a factor in
//!   single precision to pass its probe, and with the Dirichlet preconditioner that of its interior and the blocks beside it, half
//!   as long;
//! - its matrix and a copy of the blocks on the boundary; where no other subdomain is like it also what is known of them
//!   before they are factorised;
//! - vectors, tangents, histories and results, in proportion to its unknowns.
//!
//! Congruent boxes share factors as long as they are elastic; how many remain so nobody knows before: where a material may yield,
//! `YIELDING` is what the benchmark has. Every rank has the coarse problem's factors, for all rows and for those of the active set:
//! `COARSE` `n^1.4` numbers each for `n` clusters, as `bench-results/kernels.md` has it for 250 to 21,296. Where rows of
//! contact are coupled, every rank at the contact has all of them.
//!
//! Constants are from runs of the benchmark, with each element, in boxes and in parts. Of what two ranks had of their own in runs
//! without a cascade the estimate is 0.85 to 1.34 times, in boxes of 2, 5 and 10 cells with tet4 and tet10 at levels 1 and 2; but 0.69
//! in 24 boxes of 27,783 unknowns of tet10.

use super::held::Item;
use crate::material::Law;
use crate::record::forecast::HeldRow;
use crate::scene::{Precision, Preconditioner, Scene};

/// Memory of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Memory {
    /// What ranks hold while solving.
    pub items: Vec<Item>,
    /// Numbers that subdomains take.
    pub(super) numbers: Numbers,
    /// On each rank, at most, while meshes are read and cut, before anything else is there, in MiB.
    pub cutting_mb: f64,
}

impl Memory {
    /// Of all ranks together, in MiB.
    pub fn total_mb(&self, ranks: usize) -> f64 {
        let cutting = (self.cutting_mb + PROCESS_MB) * ranks as f64;
        (ranks as f64 * self.solving_mb(ranks)).max(cutting)
    }

    /// Of a rank with its part of the subdomains, in MiB.
    pub fn of_rank_mb(&self, ranks: usize) -> f64 {
        self.solving_mb(ranks).max(self.cutting_mb + PROCESS_MB)
    }

    /// What a rank of so many owns and what all of them hold, item by item.
    pub fn held(&self, ranks: usize) -> Vec<HeldRow> {
        self.items.iter().map(|item| item.row(ranks)).collect()
    }

    fn solving_mb(&self, ranks: usize) -> f64 {
        megabytes(self.items.iter().map(|item| item.of_rank(ranks)).sum())
    }
}

/// What a process takes before it holds anything (MPI, HDF5), in MiB.
pub(super) const PROCESS_MB: f64 = 45.0;
/// Numbers in the factor of the coarse problem, for one cluster.
const COARSE: f64 = 190.0;
/// What every rank knows of each subdomain (its cluster, body, place and owner), in bytes.
const KNOWN: f64 = 100.0;
/// What a rank knows of a contact condition, in bytes.
const CONDITION: f64 = 400.0;
/// Ranks that know a condition that is coupled to few others: those of the slave's node and of the master's.
const SIDES: f64 = 2.0;
/// What every rank at the contact knows of a condition that is coupled to the others: itself, its row, and the gluing of its nodes,
/// in bytes.
const COUPLED: f64 = 3000.0;
/// The same of a condition of a contact that is held in parts, on all ranks together, with what inverts its rows near each subdomain; measured
/// with 48 x 48 cells on 40 x 40 in 64 subdomains at the contact.
const PART: f64 = 50_000.0;
/// What every rank knows of each rank: the subdomains that it owns and lengths of messages; of a surface in contact its boxes.
const OF_RANK: [f64; 2] = [64.0, 500.0];
/// Part of the factors of `n` congruent boxes of a body that is held where a material may yield: what yields, and, in boxes on its
/// border, `n^(-1/3)`. Fitted to what a test counts in the benchmark.
const YIELDING: [f64; 2] = [0.19, 1.17];
/// ... where none may: a few shapes.
const ELASTIC: f64 = 0.125;
/// Numbers for each unknown, if a material may yield, and if none may.
const VECTORS: [f64; 2] = [110.0, 45.0];
/// Numbers for each unknown among these that are the mesh: places twice, numbers of nodes, elements by their nodes.
const MESH: f64 = 6.0;
/// Unknowns from which a factor in single precision does not pass its probe.
const IN_DOUBLE: f64 = 7500.0;
/// Numbers that a slot of a row takes with all that goes with it: in G, in the row's terms, in messages.
const SLOT: f64 = 12.0;

/// Lengths of a subdomain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lengths {
    /// Of the factor of its stiffness.
    pub factor: f64,
    /// Of the lower half of its matrix.
    pub matrix: f64,
    /// Of its vectors.
    pub unknowns: f64,
}

/// Numbers that subdomains take: their mesh, factors, matrices, vectors (with tangents, histories and results), bonds of
/// groups, and slots of their rows; last, for the [`forecast`](super::forecast), those in factors of all subdomains if none were
/// shared, and the operations that make these.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Numbers(pub [f64; 8]);

impl Numbers {
    /// Of a subdomain, which may be one of so many congruent boxes of its body.
    pub fn of_subdomain(scene: &Scene, Lengths { factor, matrix, unknowns }: Lengths, boxes: Option<usize>) -> Self {
        let yields = scene.material.values().any(Law::yields);
        let (held, index) = boxes.map_or((1.0, 2.8), |boxes| (distinct(boxes as f64, yields), 1.5));
        let precision = if scene.solver.precision == Precision::Mixed { 0.5 } else { 1.0 };
        let whole = if unknowns > IN_DOUBLE { 1.0 } else { precision };
        let interior = if scene.solver.preconditioner == Preconditioner::Dirichlet { 0.5 * precision } else { 0.0 };
        let (factor, vectors) = ((whole + interior) * factor, (VECTORS[usize::from(!yields)] - MESH) * unknowns);
        Self([MESH * unknowns, held * factor, index * matrix, vectors, 0.0, 0.0, factor, factor.powf(1.5)])
    }

    /// Of the inverse of a group of so many members, where no other group is like it.
    pub fn of_group(members: f64) -> Self {
        Self([0.0, 0.0, 0.0, 0.0, (6.0 * (members - 1.0)).powi(2), 0.0, 0.0, 0.0])
    }

    /// Those in factors, and the operations that make these: a factor of `n` numbers takes `n^1.5` by nested dissection in space (George
    /// 1973). Boxes share the factors of their own rank: where a rank has a body's boxes by so many times fewer, more are on a border.
    pub fn factors(&self, fewer: f64) -> [f64; 2] {
        let [_, held, .., all, operations] = self.0;
        let part = held / all;
        let part = (part.min(YIELDING[0]) + (part - YIELDING[0]).max(0.0) * fewer.cbrt()).min(1.0);
        [part * all, part * operations]
    }

    /// Of slots of rows.
    pub fn of_slots(slots: f64) -> Self {
        Self([0.0, 0.0, 0.0, 0.0, 0.0, SLOT * slots, 0.0, 0.0])
    }

    /// Of so many like these.
    pub fn times(self, count: f64) -> Self {
        Self(self.0.map(|numbers| count * numbers))
    }
}

impl std::ops::AddAssign for Numbers {
    fn add_assign(&mut self, other: Self) {
        self.0.iter_mut().zip(other.0).for_each(|(sum, numbers)| *sum += numbers);
    }
}

/// Counts that the memory of a run depends on.
pub(super) struct Held {
    /// Of all subdomains.
    pub numbers: Numbers,
    pub subdomains: f64,
    /// Groups on the highest level.
    pub coarse_blocks: f64,
    /// Conditions of contacts whose rows are in small blocks, of those that are coupled, and of those so large that ranks hold
    /// parts ([`super::held::kind`]).
    pub conditions: [f64; 3],
    /// Surfaces in contact.
    pub surfaces: f64,
    /// Length of the largest factor.
    pub largest: f64,
}

impl Held {
    /// The items; the largest factor in its subdomains is worked on in double precision, beside the interior's.
    pub fn items(&self) -> Vec<Item> {
        let [meshes, factors, matrices, vectors, bonds, slots, ..] = self.numbers.0.map(|numbers| 8.0 * numbers);
        let [single, coupled, parts] = self.conditions;
        vec![
            Item::owned("meshes", meshes),
            Item::owned("factors", factors),
            Item::owned("matrices", matrices),
            Item::owned("vectors and results", vectors),
            Item::owned("bonds in groups", bonds),
            Item::owned("rows", slots),
            Item::owned("contact pairs", SIDES * CONDITION * single + PART * parts),
            Item::everywhere("process", PROCESS_MB * f64::from(1 << 20)),
            Item::everywhere("work on a factor", 12.0 * self.largest),
            Item::a_rank("lists of ranks", OF_RANK[0] + OF_RANK[1] * self.surfaces),
            Item::everywhere("coupled contact", COUPLED * coupled),
            Item::everywhere("coarse problem", 2.0 * 8.0 * of_coarse(self.coarse_blocks)),
            Item::everywhere("lists of clusters", KNOWN * self.subdomains),
        ]
    }
}

/// Part of the factors of congruent boxes that is held.
fn distinct(boxes: f64, yields: bool) -> f64 {
    let part = if yields { YIELDING[0] + YIELDING[1] / boxes.cbrt() } else { ELASTIC };
    part.clamp(1.0 / boxes, 1.0)
}

/// Numbers in the factor of the coarse problem of so many blocks.
pub(super) fn of_coarse(blocks: f64) -> f64 {
    COARSE * blocks.powf(1.4)
}

pub(super) fn megabytes(bytes: f64) -> f64 {
    bytes / f64::from(1 << 20)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes of the benchmark at levels 1 to 6, half of them in each body, and how many of them a Newton step factorised each for
    /// itself. Those that are elastic have two factors.
    const FACTORISED: [(f64, f64); 6] =
        [(6.0, 4.0), (48.0, 28.0), (162.0, 73.0), (384.0, 153.0), (750.0, 282.0), (1296.0, 406.0)];

    #[test]
    fn boxes_share_factors_as_those_of_the_benchmark_do() {
        for (boxes, own) in FACTORISED {
            let (found, part) = (distinct(0.5 * boxes, true), (own + 2.0) / boxes);
            assert!((found / part - 1.0).abs() < 0.08, "{found} of {boxes} boxes, not {part}");
        }
        assert_eq!(distinct(1.0, false), 1.0);
        assert_eq!(distinct(1e6, false), ELASTIC);
    }

    /// On a thousandth of a body's boxes as on a body with a thousandth of them; parts without a twin and elastic boxes as anywhere.
    #[test]
    fn boxes_of_other_ranks_share_nothing() {
        let of = |part: f64| Numbers([0.0, part * 10.0, 0.0, 0.0, 0.0, 0.0, 10.0, 30.0]);
        for (held, few) in [(distinct(1e6, true), distinct(1e3, true)), (1.0, 1.0), (ELASTIC, ELASTIC)] {
            let ([numbers, operations], [whole, _]) = (of(held).factors(1000.0), of(held).factors(1.0));
            assert!((numbers / (few * 10.0) - 1.0).abs() < 1e-12 && (operations / (few * 30.0) - 1.0).abs() < 1e-12);
            assert!((whole / (held * 10.0) - 1.0).abs() < 1e-12);
        }
        assert_eq!(of(0.5).factors(1e9), [10.0, 30.0]);
    }
}
