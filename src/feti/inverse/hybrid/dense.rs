//! The dense problem of a cluster for its members' given responses.
//!
//! With `v = K^+ t`, `W = K^+ B_c'`, `S = B_c W`, the members' rigid modes `R` and `G = R'B_c'`,
//!
//! ```text
//! u = v - W mu + R a,    B_c u = 0,    R'(t - B_c'mu) = 0
//! ```
//!
//! gives `S mu = B_c v + G'a` and `(G S^-1 G') a = R't - G S^-1 B_c v`. The latter leaves rigid motions of the whole free: the
//! first member is tied to nothing, which is exact where `t` is in balance over the cluster and symmetric in any case.

use std::rc::Rc;

use faer::Mat;
use faer::linalg::solvers::DenseSolveCore;

use super::bonds::{Bonds, Member};
use crate::feti::inverse::kernel::MODES;
use crate::simd::vectorised;
use crate::work;

/// `W`, `S^-1` and `(G S^-1 G')^-1`, by columns.
pub struct DenseProblem {
    responses: Vec<Rc<Vec<f64>>>,
    rows: Vec<f64>,
    motions: Vec<f64>,
}

impl DenseProblem {
    /// From `W` of each member, by columns in the order of its jumps; `None` if that has no inverse.
    pub fn new(bonds: &Bonds, responses: Vec<Rc<Vec<f64>>>) -> Option<Self> {
        let (n, m) = (bonds.rows, MODES * bonds.members.len());
        // S and H from their factors, and two inverses.
        let jumps = |member: &Member| member.jumps.iter().map(|jump| 2 * jump.entries.len()).sum::<usize>();
        let s: usize = bonds.members.iter().map(|member| jumps(member) * member.jumps.len()).sum();
        let h: usize = bonds.members.iter().map(|member| 2 * MODES * n * member.jumps.len()).sum();
        work::add(s + h + 2 * (n.pow(3) + m.pow(3)), size_of::<f64>() * (n * n + m * m));
        let mut s = Mat::zeros(n, n);
        for (member, response) in bonds.members.iter().zip(&responses) {
            for (one, column) in member.jumps.iter().zip(response.chunks_exact(member.modes.len())) {
                for other in &member.jumps {
                    s[(other.row, one.row)] += other.of(column);
                }
            }
        }
        let rows = inverse(&s)?;
        let mut h = Mat::zeros(m, m);
        let mut column = vec![0.0; n];
        for (k, member) in bonds.members.iter().enumerate() {
            for mode in 0..MODES {
                column.fill(0.0);
                for jump in &member.jumps {
                    add(jump.modes[mode], &rows[n * jump.row..][..n], &mut column);
                }
                let mut forces = vec![0.0; m];
                add_forces(bonds, 1.0, &column, &mut forces);
                forces.iter().enumerate().for_each(|(i, f)| h[(i, MODES * k + mode)] = *f);
            }
        }
        let size = (0..m).map(|k| h[(k, k)]).sum::<f64>() / m as f64;
        (0..MODES).for_each(|k| h[(k, k)] += size);
        let motions = inverse(&h)?;
        Some(Self { responses, rows, motions })
    }

    /// `W` of a member.
    pub fn response(&self, member: usize) -> &Rc<Vec<f64>> {
        &self.responses[member]
    }

    /// From `v` of the members to `u`, and from `R't` to what balances the members: their multipliers `mu`.
    pub fn solve(&self, bonds: &Bonds, mut resultants: Vec<f64>, members: &mut [Vec<f64>]) -> Vec<f64> {
        let mut jump = vec![0.0; bonds.rows];
        let responses: usize = self.responses.iter().map(|columns| columns.len()).sum();
        let modes: usize = bonds.members.iter().map(|member| MODES * member.modes.len()).sum();
        let numbers = responses + modes + 2 * self.rows.len() + self.motions.len();
        work::each(numbers, 2, size_of::<f64>());
        for (member, v) in bonds.members.iter().zip(&*members) {
            member.jumps.iter().for_each(|of_row| jump[of_row.row] += of_row.of(v));
        }
        add_forces(bonds, -1.0, &multiply(&self.rows, &jump), &mut resultants);
        let amplitudes = multiply(&self.motions, &resultants);
        for (member, a) in bonds.members.iter().zip(amplitudes.as_chunks::<MODES>().0) {
            for of_row in &member.jumps {
                jump[of_row.row] += of_row.modes.iter().zip(a).map(|(g, a)| g * a).sum::<f64>();
            }
        }
        let multipliers = multiply(&self.rows, &jump);
        for (k, (Member { modes, jumps }, u)) in bonds.members.iter().zip(members).enumerate() {
            for (of_row, column) in jumps.iter().zip(self.responses[k].chunks_exact(modes.len())) {
                add(-multipliers[of_row.row], column, u);
            }
            for (u, row) in u.iter_mut().zip(modes) {
                *u += row.iter().zip(&amplitudes[MODES * k..]).map(|(r, a)| r * a).sum::<f64>();
            }
        }
        multipliers
    }
}

/// `forces += factor G multipliers`.
fn add_forces(bonds: &Bonds, factor: f64, multipliers: &[f64], forces: &mut [f64]) {
    for (member, forces) in bonds.members.iter().zip(forces.as_chunks_mut::<MODES>().0) {
        for jump in &member.jumps {
            let x = factor * multipliers[jump.row];
            forces.iter_mut().zip(&jump.modes).for_each(|(f, g)| *f += x * g);
        }
    }
}

/// By columns; `None` if there is none.
fn inverse(matrix: &Mat<f64>) -> Option<Vec<f64>> {
    let inverse = matrix.partial_piv_lu().inverse();
    let n = inverse.nrows();
    let columns: Vec<f64> = (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).map(|at| inverse[at]).collect();
    columns.iter().all(|x| x.is_finite()).then_some(columns)
}

/// A square matrix, by columns, times a vector.
fn multiply(columns: &[f64], x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; x.len()];
    columns.chunks_exact(x.len().max(1)).zip(x).for_each(|(column, &x)| add(x, column, &mut y));
    y
}

/// `y += factor x`.
fn add(factor: f64, x: &[f64], y: &mut [f64]) {
    vectorised(
        (factor, x, y),
        #[inline(always)]
        |(factor, x, y)| {
            for (y, x) in y.iter_mut().zip(x) {
                *y += factor * x;
            }
        },
    );
}
