//! How long a run on so many ranks would take.
//!
//! A run is a sum of amounts of work, each times the seconds of its unit. Amounts are what the rank with most has of it: its share
//! of what ranks share, and what every rank does. They are for the whole run, for each Newton step, or for each application of the
//! dual operator with all that goes with it (preconditioner, projections, inner products).
//!
//! | amount | is |
//! |---|---|
//! | `meshes` | unknowns: reading, cutting, analysis, results; for each step assembly, forces and residuals |
//! | `rows` | slots of rows: set-up; for each application `B`, `B'`, `G` of groups, inner products |
//! | `factors` | operations of the factors that subdomains do not share; for each application the numbers in them |
//! | `coarse` | operations of the factor of the highest level, which every rank makes; numbers that a rank solves with |
//! | `exchanges`, `messages` | exchanges with several ranks at once, one after the other; messages of all of them |
//! | `collectives`, `bytes` | steps of trees of all ranks; bytes sent or received |
//!
//! Units come from runs of this machine and networks from outside: `bench-results/model.json`, which `scripts/bench write model` makes
//! of measured runs. Applications of a step grow with the subdomains to a bound there, as FETI's condition number has one. A cascade
//! is the sum of its levels. What is not in it: input and output of large files, waiting for ranks with more plastic elements, other
//! programs.

use std::sync::LazyLock;

use serde::Deserialize;

use super::memory::Memory;
use crate::feti::inverse::kernel::MODES;
use crate::record::counts::Sizes;
use crate::record::forecast::{Amount, Forecast, OfLevel, Per};

/// What `scripts/bench write model` found.
#[derive(Deserialize)]
struct Model {
    /// By the size of subdomains, the smallest first.
    sizes: Vec<OfSize>,
    /// Newton steps of the first level of a cascade, of those between, and of the last or only one.
    steps: [f64; 3],
    /// Applications a step likewise: `[a, b]` of `a / (1 + b S^(-1/3))` for `S` subdomains.
    applications: [[f64; 2]; 3],
}

#[derive(Deserialize)]
struct OfSize {
    /// Of a subdomain.
    unknowns: f64,
    /// Seconds of a unit, by kind and how often it comes up.
    units: Vec<Unit>,
}

#[derive(Deserialize)]
struct Unit {
    of: String,
    per: Per,
    seconds: f64,
}

static MODEL: LazyLock<Model> = LazyLock::new(|| {
    serde_json::from_str(include_str!("../../bench-results/model.json")).expect("the model is written by a script")
});

impl Model {
    /// Between the measured sizes straight in logarithms, beyond them as at the nearest.
    fn unit(&self, of: &str, per: Per, unknowns: f64) -> f64 {
        let above = self.sizes.partition_point(|size| size.unknowns < unknowns).min(self.sizes.len() - 1);
        let (low, high) = (&self.sizes[above.saturating_sub(1)], &self.sizes[above]);
        let width = (high.unknowns / low.unknowns).ln();
        let share = if width > 0.0 { ((unknowns / low.unknowns).ln() / width).clamp(0.0, 1.0) } else { 1.0 };
        (1.0 - share) * low.unit(of, per) + share * high.unit(of, per)
    }
}

impl OfSize {
    fn unit(&self, of: &str, per: Per) -> f64 {
        self.units.iter().find(|unit| unit.of == of && unit.per == per).map_or(0.0, |unit| unit.seconds)
    }
}

/// Kinds that are messages.
const MESSAGES: [&str; 4] = ["exchanges", "messages", "collectives", "bytes"];
/// Of a box among boxes.
const NEIGHBOURS: f64 = 26.0;
/// Exchanges of an application with neighbours: `B` and the preconditioner, and for each level of groups.
const EXCHANGES: [f64; 2] = [2.0, 4.0];
/// Passes along the tree of groups, for each level as many as it is high; and the ranks that one is with.
const TREE: [f64; 2] = [8.0, 4.0];
/// Collectives of an application: inner products, and both halves of a projection's solve.
const COLLECTIVES: f64 = 6.0;
/// Parts of a factor of the coarse problem that are above all parts that ranks share, in a body: its last separator is `n^(2/3)` blocks.
const SEPARATOR: f64 = 18.0;
/// Solves of the coarse problem in an application.
const SOLVES: f64 = 2.5;
/// Bytes of the sums in an application: a few long integers.
const REDUCED: f64 = 2400.0;
/// Bytes of a number.
const NUMBER: f64 = 8.0;

/// What solving a scene of so many bodies of these sizes takes on so many ranks, given which part of them each level of the cascade
/// has, the finest last.
pub fn forecast((sizes, bodies): (&Sizes, usize), memory: &Memory, ranks: usize, parts: &[f64]) -> Forecast {
    // Of one body a rank has boxes, if there are no fewer ranks than bodies.
    let factors = memory.numbers.factors((ranks as f64 / bodies as f64).max(1.0));
    let place = |number: usize| if number + 1 == parts.len() { 2 } else { number.min(1) };
    let level = |(number, part): (usize, &f64)| of_level(sizes, factors, ranks, *part, place(number));
    let levels: Vec<OfLevel> = parts.iter().enumerate().map(level).collect();
    let unknowns = sizes.primal_dofs as f64 / sizes.subdomains as f64;
    let messages = |level: &OfLevel| seconds(level, unknowns, |amount| MESSAGES.contains(&amount.of));
    Forecast {
        ranks,
        seconds: levels.iter().map(|level| level.seconds).sum(),
        messages: levels.iter().map(messages).sum(),
        levels,
    }
}

/// Of a level with this part of the subdomains.
fn of_level(sizes: &Sizes, factors: [f64; 2], ranks: usize, part: f64, place: usize) -> OfLevel {
    let subdomains = part * sizes.subdomains as f64;
    let (steps, [bound, fewer]) = (MODEL.steps[place], MODEL.applications[place]);
    let applications = steps * bound / (1.0 + fewer / subdomains.max(1.0).cbrt());
    let amounts = amounts(sizes, factors, ranks as f64, part);
    let mut level = OfLevel { subdomains, steps, applications, amounts, seconds: 0.0 };
    level.seconds = seconds(&level, sizes.primal_dofs as f64 / sizes.subdomains as f64, |_| true);
    level
}

fn seconds(level: &OfLevel, unknowns: f64, counts: impl Fn(&Amount) -> bool) -> f64 {
    let times = |per: Per| match per {
        Per::Run => 1.0,
        Per::Step => level.steps,
        Per::Application => level.applications,
    };
    let of = |a: &Amount| a.amount * times(a.per) * MODEL.unit(a.of, a.per, unknowns);
    level.amounts.iter().filter(|a| counts(a)).map(of).sum()
}

fn amounts(sizes: &Sizes, [numbers, operations]: [f64; 2], ranks: f64, part: f64) -> Vec<Amount> {
    let subdomains = part * sizes.subdomains as f64;
    // Subdomains are whole.
    let share = (subdomains / ranks).ceil().max(1.0) / sizes.subdomains as f64;
    let [unknowns, rows] = [sizes.primal_dofs, sizes.dual_dofs].map(|n| n as f64);
    let blocks = (part * sizes.coarse_blocks as f64).max(1.0);
    let levels = if sizes.clusters == sizes.subdomains { 0.0 } else { groups(sizes) };
    let length = super::memory::of_coarse(blocks);
    let common = (SEPARATOR * blocks.powf(4.0 / 3.0)).min(length);
    let mut amounts = Vec::new();
    let mut add = |of, per, amount| amounts.push(Amount { of, per, amount });
    add("meshes", Per::Run, share * unknowns);
    add("meshes", Per::Step, share * unknowns);
    add("rows", Per::Run, share * rows);
    add("rows", Per::Application, share * rows);
    add("factors", Per::Step, share * operations);
    add("factors", Per::Application, share * numbers);
    add("coarse", Per::Run, length * blocks.powf(0.6));
    add("coarse", Per::Application, SOLVES * (common + (length - common) / ranks));
    if ranks > 1.0 {
        let active = ranks.min(subdomains.ceil());
        let neighbours = NEIGHBOURS.min(active - 1.0).max(0.0);
        // Of a cube of subdomains the rows on its faces, of all that its subdomains have.
        let own = subdomains / ranks;
        let outside = (1.0 / own.max(1.0).cbrt()).min(1.0) * (1.0 - 1.0 / ranks);
        let exchanges = EXCHANGES[0] + EXCHANGES[1] * levels;
        let passes = TREE[0] * levels * (levels + 1.0) / 2.0;
        add("exchanges", Per::Application, exchanges + passes);
        add("messages", Per::Application, exchanges * neighbours + passes * TREE[1].min(neighbours));
        add("collectives", Per::Application, COLLECTIVES * ranks.log2());
        add("bytes", Per::Application, NUMBER * (2.0 + levels) * outside * share * rows);
        // Long integers of inner products, and what the coarse problem gets of each block.
        add("bytes", Per::Application, REDUCED * ranks.log2() + NUMBER * MODES as f64 * SOLVES * blocks);
    }
    amounts
}

/// Levels of groups, from the numbers of subdomains, clusters and blocks.
fn groups(sizes: &Sizes) -> f64 {
    let of = |a: u64, b: u64| (a as f64 / b as f64).ln();
    let first = of(sizes.subdomains, sizes.clusters).max(f64::ln(2.0));
    1.0 + (of(sizes.clusters, sizes.coarse_blocks) / first).round()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::two_bricks;
    use crate::sizing::counts::Counted;

    /// Two bodies.
    fn blocks() -> (Sizes, Memory) {
        let boxes = ["body.lower.brick.cells=[32, 16, 16]", "body.upper.brick.cells=[32, 16, 16]"];
        let scene =
            two_bricks(&[&boxes[..], &["decomposition.cells=[1, 1, 1]", "decomposition.cluster=[8, 8]"]].concat());
        let counted = Counted::new(&scene).expect("bodies are bricks");
        (counted.sizes(), counted.memory())
    }

    fn of(ranks: usize, parts: &[f64]) -> Forecast {
        let (sizes, memory) = blocks();
        forecast((&sizes, 2), &memory, ranks, parts)
    }

    #[test]
    fn every_amount_has_a_unit_and_shares_shrink_with_the_ranks() {
        let [few, many] = [16, 64].map(|ranks| of(ranks, &[1.0]).levels[0].clone());
        // A smaller share has fewer factors in common.
        let [in_few, in_many] = [8.0, 32.0].map(|fewer| blocks().1.numbers.factors(fewer)[0]);
        assert!(in_few <= in_many);
        let in_proportion = |a: &Amount, b: &Amount, ratio: f64| (a.amount / b.amount - ratio).abs() < 1e-12;
        for (a, b) in few.amounts.iter().zip(&many.amounts) {
            assert!(MODEL.sizes.iter().all(|size| size.units.iter().any(|unit| unit.of == a.of && unit.per == a.per)));
            assert_eq!((a.of, a.per), (b.of, b.per));
            match a.of {
                "factors" => assert!(in_proportion(a, b, 4.0 * in_few / in_many)),
                "meshes" | "rows" => assert!(in_proportion(a, b, 4.0), "{}", a.of),
                "coarse" if a.per == Per::Run => assert_eq!(a.amount, b.amount),
                "coarse" => assert!(b.amount < a.amount && a.amount < 4.0 * b.amount),
                "collectives" => assert!((b.amount / a.amount - 1.5).abs() < 1e-12),
                _ => {}
            }
        }
        assert!(many.seconds < few.seconds && few.seconds < 4.0 * many.seconds);
    }

    #[test]
    fn a_forecast_is_the_sum_of_its_levels_and_one_rank_says_nothing() {
        let alone = of(1, &[1.0]);
        assert_eq!(alone.messages, 0.0);
        assert!(alone.seconds > 0.0 && of(4, &[1.0]).messages > 0.0);
        let cascade = of(4, &[0.125, 1.0]);
        let [coarse, fine] = &cascade.levels[..] else { panic!("two levels") };
        assert_eq!(cascade.seconds, coarse.seconds + fine.seconds);
        assert!(coarse.seconds < fine.seconds && coarse.subdomains == fine.subdomains / 8.0);
        // More ranks than subdomains help nobody.
        let work = |ranks: usize| of(ranks, &[1.0]).seconds - of(ranks, &[1.0]).messages;
        assert!(work(1 << 20) > 0.9 * work(1 << 14));
    }
}
