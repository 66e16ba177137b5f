//! Solves with one Cholesky factor that several ranks share in, by its elimination tree.
//!
//! What the supernodes of a subtree do to those above is summed up child by child (the multifrontal method: Duff and Reid
//! 1983; solves: Heath, Ng and Peyton 1991), so that the bits do not depend on which rank has which subtree. Each rank solves in
//! its own subtrees; the supernodes above them all, on every rank.

use faer::sparse::linalg::cholesky::SymbolicCholeskyRaw;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

use super::cholesky::{Analysis, Factor};
use super::supernodes::{entries as of_supernode, fronts as supernodes};
use crate::work;

/// The elimination tree of an analysis, shared out over ranks.
pub struct Fronts {
    /// The supernodes that each one is the parent of.
    children: Vec<Vec<u32>>,
    /// Supernodes of each rank, ascending.
    own: Vec<Vec<u32>>,
    /// Of these, the roots of its subtrees.
    roots: Vec<Vec<u32>>,
    /// Supernodes above all, ascending.
    common: Vec<u32>,
    /// What each supernode adds to the rows below it.
    updates: Vec<Vec<f64>>,
    /// The unknowns in the order of elimination.
    x: Vec<f64>,
    panel: Vec<f64>,
}

/// So many numbers are read faster than they are shared.
const SMALL: usize = 50_000;

impl Fronts {
    /// Of an analysis.
    pub fn new(analysis: &Analysis, ranks: usize) -> Self {
        let Some(panels) = panels(analysis) else { return Self::of(&[], &[], 1) };
        let nodes = panels.n_supernodes();
        let of_column = |column: u32| panels.supernode_end().partition_point(|&end| end <= column);
        let parent = |s: usize| panels.supernode(s).pattern().first().map(|&row| of_column(row));
        let parents: Vec<Option<usize>> = (0..nodes).map(parent).collect();
        let at = panels.col_ptr_for_val();
        let sizes: Vec<usize> = (0..nodes).map(|s| (at[s + 1] - at[s]) as usize).collect();
        let ranks = if sizes.iter().sum::<usize>() < SMALL { 1 } else { ranks };
        Self::of(&parents, &sizes, ranks)
    }

    /// Of a tree, by the parent of each node and how much it takes. The heaviest subtrees are opened as long as that makes the
    /// busiest rank less busy.
    fn of(parents: &[Option<usize>], sizes: &[usize], ranks: usize) -> Self {
        let nodes = parents.len();
        let mut children = vec![Vec::new(); nodes];
        let mut weights = sizes.to_vec();
        for (s, parent) in parents.iter().enumerate() {
            if let Some(parent) = *parent {
                children[parent].push(s as u32);
                weights[parent] += weights[s];
            }
        }
        let mut roots: Vec<usize> = (0..nodes).filter(|&s| parents[s].is_none()).collect();
        let mut above = 0;
        let (mut best, mut kept) = (usize::MAX, roots.clone());
        while ranks > 1 && !roots.is_empty() {
            // Heaviest first.
            roots.sort_by_key(|&s| (std::cmp::Reverse(weights[s]), s));
            let busiest = above + shared_out(&roots, &weights, ranks).1;
            if busiest < best {
                (best, kept) = (busiest, roots.clone());
            }
            let heaviest = roots[0];
            if above >= best || children[heaviest].is_empty() {
                break;
            }
            above += sizes[heaviest];
            roots.swap_remove(0);
            roots.extend(children[heaviest].iter().map(|&child| child as usize));
        }
        let (owner_of_root, _) = shared_out(&kept, &weights, ranks);
        let mut owner = vec![None; nodes];
        kept.iter().zip(owner_of_root).for_each(|(&root, rank)| owner[root] = Some(rank));
        // Children come before their parents.
        (0..nodes).rev().for_each(|s| owner[s] = owner[s].or(parents[s].and_then(|parent| owner[parent])));
        let of =
            |wanted: Option<usize>| (0..).zip(&owner).filter(move |(_, o)| **o == wanted).map(|(s, _)| s).collect();
        let own: Vec<Vec<u32>> = (0..ranks).map(|rank| of(Some(rank))).collect();
        let is_root = |s: &u32| parents[*s as usize].is_none_or(|parent| owner[parent].is_none());
        Self {
            roots: own.iter().map(|own| own.iter().copied().filter(is_root).collect()).collect(),
            common: of(None),
            own,
            children,
            updates: vec![Vec::new(); nodes],
            x: Vec::new(),
            panel: Vec::new(),
        }
    }

    /// `x = A^-1 x` with the factor of `A` in double precision, for equal `x` on all ranks. `all_gather` is given this `rank`'s numbers
    /// and how many each rank has, and returns all. Collective.
    ///
    /// # Panics
    /// If the factor is in single precision.
    pub fn solve(
        &mut self,
        (analysis, factor): (&Analysis, &Factor),
        rank: usize,
        all_gather: impl Fn(&[f64], &[usize]) -> Vec<f64>,
        x: &mut [f64],
    ) {
        let (Some(panels), Some(order)) = (panels(analysis), analysis.order()) else { return };
        let Factor::Double(values) = factor else { panic!("factors that ranks share are in double precision") };
        let is_shared = self.own.len() > 1;
        let mine = if is_shared { rank } else { 0 };
        let entries: usize = self.own[mine].iter().chain(&self.common).map(|&s| of_supernode(panels, s as usize)).sum();
        work::each(entries, 4, 2 * size_of::<f64>());
        self.x.clear();
        self.x.extend(order.iter().map(|&k| x[k as usize]));

        let Self { children, own, roots, common, updates, x: unknowns, panel } = self;
        supernodes::eliminate_all(panels, values, (&own[mine], children), unknowns, updates);
        if is_shared {
            let length = |&root: &u32| panels.supernode(root as usize).pattern().len();
            let counts: Vec<usize> = roots.iter().map(|roots| roots.iter().map(length).sum()).collect();
            let message: Vec<f64> = roots[mine].iter().flat_map(|&root| &updates[root as usize]).copied().collect();
            let all = all_gather(&message, &counts);
            let mut rest = &all[..];
            for root in roots.iter().flatten() {
                let (update, others) = rest.split_at(length(root));
                updates[*root as usize].clear();
                updates[*root as usize].extend_from_slice(update);
                rest = others;
            }
        }
        supernodes::eliminate_all(panels, values, (common, children), unknowns, updates);
        supernodes::substitute_all(panels, values, common, unknowns, panel);
        supernodes::substitute_all(panels, values, &own[mine], unknowns, panel);
        if is_shared {
            let columns =
                |s: &u32| panels.supernode_begin()[*s as usize] as usize..panels.supernode_end()[*s as usize] as usize;
            let counts: Vec<usize> = own.iter().map(|own| own.iter().map(|s| columns(s).len()).sum()).collect();
            let message: Vec<f64> = own[mine].iter().flat_map(|s| &unknowns[columns(s)]).copied().collect();
            let all = all_gather(&message, &counts);
            let mut rest = &all[..];
            for s in own.iter().flatten() {
                let (solved, others) = rest.split_at(columns(s).len());
                unknowns[columns(s)].copy_from_slice(solved);
                rest = others;
            }
        }
        order.iter().zip(&*unknowns).for_each(|(&k, &y)| x[k as usize] = y);
    }
}

fn panels(analysis: &Analysis) -> Option<&SymbolicSupernodalCholesky<u32>> {
    match analysis.symbolic().raw() {
        SymbolicCholeskyRaw::Supernodal(panels) => Some(panels),
        // Only a matrix without unknowns.
        SymbolicCholeskyRaw::Simplicial(_) => None,
    }
}

/// The rank of each subtree, heaviest first, and the load of the busiest: each goes to the rank that has least.
fn shared_out(roots: &[usize], weights: &[usize], ranks: usize) -> (Vec<usize>, usize) {
    let mut loads = vec![0; ranks];
    let mut give = |&root: &usize| {
        let rank = (0..ranks).min_by_key(|&rank| loads[rank]).expect("there is a rank");
        loads[rank] += weights[root];
        rank
    };
    let owners = roots.iter().map(&mut give).collect();
    (owners, loads.into_iter().max().unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::super::cholesky::{Lower, Precision, Workspace};
    use super::*;
    use crate::comm::threads;
    use crate::sparse::ordering::nested_dissection;

    struct Laplacian {
        begins: Vec<u32>,
        rows: Vec<u32>,
        values: Vec<f64>,
        graph: (Vec<i32>, Vec<i32>),
    }

    /// The 7-point Laplacian of a cube of so many cells an edge, and its neighbours.
    fn laplacian(n: usize) -> Laplacian {
        let at = |x: [usize; 3]| x[0] + n * (x[1] + n * x[2]);
        let (mut begins, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        let mut graph = (vec![0], Vec::new());
        for k in 0..n * n * n {
            let place = [k % n, k / n % n, k / (n * n)];
            rows.push(k as u32);
            values.push(6.01);
            for axis in 0..3 {
                let mut other = place;
                if place[axis] > 0 {
                    other[axis] -= 1;
                    graph.1.push(at(other) as i32);
                }
                other[axis] = place[axis] + 1;
                if other[axis] < n {
                    graph.1.push(at(other) as i32);
                    rows.push(at(other) as u32);
                    values.push(-1.0);
                }
            }
            graph.0.push(graph.1.len() as i32);
            begins.push(rows.len() as u32);
        }
        Laplacian { begins, rows, values, graph }
    }

    #[test]
    fn any_number_of_ranks_finds_the_same_bits_and_the_solution() {
        let n = 14;
        let Laplacian { begins, rows, values, graph } = laplacian(n);
        let lower = Lower { column_begin: &begins, rows: &rows };
        let analysis = Analysis::ordered(lower, &nested_dissection(&graph, 1));
        let mut workspace = Workspace::new([&analysis]);
        let mut factor = analysis.factor(Precision::Double);
        workspace.factorise(&analysis, lower, &values, &mut factor).expect("it is definite");
        assert!(analysis.factor_length() > SMALL);
        let right: Vec<f64> = (0..n * n * n).map(|k| (k as f64).sin()).collect();
        let mut expected = right.clone();
        workspace.solve(&analysis, &factor, &mut expected);
        let solve = |ranks: usize| {
            threads::run(ranks, |comm| {
                let mut x = right.clone();
                let mut fronts = Fronts::new(&analysis, ranks);
                assert_eq!(fronts.own.len(), ranks);
                let all_gather = |mine: &[f64], counts: &[usize]| comm.all_gather(mine, counts);
                fronts.solve((&analysis, &factor), comm.rank(), all_gather, &mut x);
                x
            })
        };
        let alone = solve(1).swap_remove(0);
        let error = alone.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-12, "{error}");
        for ranks in [2, 3, 5, 16] {
            assert!(solve(ranks).iter().all(|x| *x == alone), "{ranks} ranks");
        }
    }

    #[test]
    fn work_is_shared_out_as_evenly_as_a_tree_lets_it() {
        // A complete binary tree, children before parents: 15 nodes of which the last is the root.
        let parents: Vec<Option<usize>> =
            [8, 8, 9, 9, 10, 10, 11, 11, 12, 12, 13, 13, 14, 14].into_iter().map(Some).chain([None]).collect();
        let fronts = Fronts::of(&parents, &[1; 15], 2);
        assert_eq!((fronts.common, fronts.own.iter().map(Vec::len).collect::<Vec<_>>()), (vec![14], vec![7, 7]));
        let fronts = Fronts::of(&parents, &[1; 15], 4);
        assert_eq!((fronts.common, fronts.roots.concat().len()), (vec![12, 13, 14], 4));
        assert_eq!(Fronts::of(&parents, &[1; 15], 1).common.len(), 0);
    }
}
