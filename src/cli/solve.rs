//! `fetiplast solve`: a scene, coarser levels first where that pays, to files of results.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::conduct::Conduct;
use super::keeper::Signals;
use super::levels::{Setting, carry_out};
use super::plan::Plan;
use super::{Failure, Source, find, values};
use crate::comm::Comm;
use crate::material::Law;
use crate::monitor::timing::Timer;
use crate::scene::{ErrorOf, Preconditioner, Qp, Scene};

/// Coarser levels at most. Where a rank has few subdomains of the last level, each of them costs it about one of those: a third would cost
/// what it saves.
const COARSER: usize = 2;

/// Arguments of `solve`.
#[derive(Debug, Args)]
pub struct Solve {
    #[command(flatten)]
    source: Source,
    /// Where results go: SCENE.vtkhdf for ParaView, and SCENE.json unless --summary says otherwise.
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Solver of the quadratic programs: smalse-m or active-set. Short for --set solver.qp=...
    #[arg(long, value_name = "NAME", value_parser = values::name::<Qp>)]
    qp: Option<String>,
    /// none, lumped or dirichlet. Short for --set solver.preconditioner=...
    #[arg(long, value_name = "NAME", value_parser = values::name::<Preconditioner>)]
    preconditioner: Option<String>,
    /// Stop when the algebraic error is at most this share of the discretisation error. Short for --set solver.accuracy=...
    #[arg(long, value_name = "X", value_parser = values::accuracy, allow_negative_numbers = true)]
    accuracy: Option<String>,
    /// Refine meshes until the error is at most this: 0.01 or 1%. Short for --set solver.error=...
    #[arg(long, value_name = "X", value_parser = values::error, allow_negative_numbers = true)]
    error: Option<String>,
    /// What the error is of: energy, stress, displacement:X,Y,Z:DIRECTION, reaction:SUPPORT:DIRECTION or
    /// contact_force:CONTACT. Short for --set solver.error_of=...
    #[arg(long, value_name = "NAME", value_parser = values::name::<ErrorOf>)]
    error_of: Option<String>,
    /// Refined meshes have so many unknowns at most. Short for --set solver.max_unknowns=...
    #[arg(long, value_name = "N")]
    max_unknowns: Option<u64>,
    /// Find the limit load, to 1 % or so near: 0.01 or 1%. Short for --set limit.tolerance=...
    #[arg(long, value_name = "X", value_parser = values::error, num_args = 0..=1, default_missing_value = "1%", require_equals = true)]
    limit: Option<String>,
    /// Solve a quarter of the level first, then half of it, and start from there: auto (where it pays), on or off.
    #[arg(long, value_name = "WHEN", default_value = "auto", num_args = 0..=1, default_missing_value = "on")]
    cascade: Cascade,
    #[command(flatten)]
    conduct: Conduct,
}

/// When coarser levels are solved first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Cascade {
    /// Where the problem is not linear.
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

impl Cascade {
    /// The levels to solve before `level`, coarsest first. None where there is a history, of which a coarser
    /// level knows the end, or an earlier state, which is of one mesh, or a body that is no brick, or meshes are refined,
    /// or a limit load, which has its own start.
    pub(super) fn before(self, level: usize, scene: &Scene) -> Vec<usize> {
        let linear = scene.contact.is_empty() && !scene.material.values().any(Law::yields);
        let has_history = !scene.step.is_empty() || scene.initial.is_some() || scene.limit.is_some();
        let possible = !has_history && scene.is_of_bricks() && scene.solver.error.is_none();
        if self == Self::Off || !possible || (self == Self::Auto && linear) {
            return Vec::new();
        }
        let half = |l: &usize| (*l > 1).then(|| l.div_ceil(2));
        let mut levels: Vec<usize> = std::iter::successors(half(&level), half).take(COARSER).collect();
        levels.reverse();
        levels
    }
}

/// Solves a scene and writes its results. Collective.
///
/// # Errors
/// If the scene is bad or files cannot be read or written.
pub fn solve(arguments: Solve, comm: &dyn Comm, signals: Signals) -> Result<i32, Failure> {
    let timer = Timer::start();
    let Solve { mut source, out, qp, preconditioner, accuracy, error, error_of, max_unknowns, limit, cascade, conduct } =
        arguments;
    let shorthand = |key: &str, value: Option<String>| value.map(|v| format!("solver.{key}={v}"));
    source.sets.extend(shorthand("qp", qp));
    source.sets.extend(shorthand("preconditioner", preconditioner));
    source.sets.extend(shorthand("accuracy", accuracy));
    source.sets.extend(shorthand("error", error));
    source.sets.extend(shorthand("error_of", error_of));
    source.sets.extend(shorthand("max_unknowns", max_unknowns.map(|n| n.to_string())));
    source.sets.extend(limit.map(|tolerance| format!("limit.tolerance={tolerance}")));
    let found = find(&source, comm)?;
    let scene = found.at_level(source.level, &source.sets)?;
    let mut levels = cascade.before(source.level, &scene);
    levels.push(source.level);
    let plan = Plan { source, levels, yielding: None, rows: Vec::new(), refinements: Vec::new(), again: false };
    carry_out(plan, &found, &scene, None, Setting { timer, out, conduct, signals }, comm)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::two_bricks;

    #[test]
    fn a_cascade_has_two_coarser_levels_at_most() {
        let scene = two_bricks(&[]);
        let before = |level| Cascade::On.before(level, &scene);
        assert_eq!([1, 2, 3, 5, 10].map(before), [vec![], vec![1], vec![1, 2], vec![2, 3], vec![3, 5]]);
    }
}
