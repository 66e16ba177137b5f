//! For tests: the dual problem of a torn membrane with an obstacle, small and dense, but with all that Total-FETI has:
//! floating parts, orthonormal gluing rows, support rows, contact rows, a coarse right-hand side.

use super::super::slides::Slides;
use super::dense::{Matrix, Plain, dot};
use crate::qp::active_set::Face;
use crate::qp::feasible::FeasibleSet;
use crate::qp::quadratic::Quadratic;
use crate::qp::smalse::{Problem, Settings, Solution, Start, solve};
use crate::qp::{self, Limits, power};
use crate::vector::axpy;

/// One equality, on the kept rows and on all rows, with its right-hand side.
#[derive(Clone)]
struct Row {
    inside: Vec<f64>,
    full: Vec<f64>,
    right: f64,
}

pub struct Torn {
    pub f: Matrix,
    pub d: Vec<f64>,
    pub bounded: Vec<bool>,
    pub preconditioned: bool,
    lumped: Matrix,
    rows: Vec<Row>,
    set: Set,
    face: Option<Set>,
}

/// Some rows, and the equalities orthonormalised on them.
struct Set {
    kept: Vec<bool>,
    basis: Vec<Row>,
}

impl Torn {
    /// `parts` x `parts` squares of `cells` x `cells` cells; held at the left side, over an obstacle along the right one,
    /// under a load that turns from down to up.
    pub fn membrane(parts: usize, cells: usize) -> Self {
        let local = (cells + 1) * (cells + 1);
        let k = stiffness(cells);
        let mut regular = Matrix::new(local, k.entries.clone());
        regular.entries.iter_mut().for_each(|v| *v += 1.0 / local as f64);
        let inverse = regular.inverse();
        let Rows { b, gap, bounded } = Rows::of(parts, cells);

        // F = B K^+ B', B K B', d = B K^+ f - c and G = R'B, part by part.
        let load = |part: usize| if part / parts * 2 < parts { -0.02 } else { 0.03 };
        let n = b.len();
        let column = |row: &[Coefficient], part: usize, a: &Matrix| {
            let mut v = vec![0.0; local];
            row.iter().filter(|((p, _), _)| *p == part).for_each(|((_, i), value)| v[*i] += value);
            a.times(&v)
        };
        let mut f = Matrix::new(n, vec![0.0; n * n]);
        let mut lumped = Matrix::new(n, vec![0.0; n * n]);
        let mut d: Vec<f64> = gap.iter().map(|g| -g).collect();
        let mut rows = vec![Row { inside: vec![], full: vec![0.0; n], right: 0.0 }; parts * parts];
        for (part, coarse) in rows.iter_mut().enumerate() {
            let kernel = 1.0 / (local as f64).sqrt();
            coarse.right = kernel * load(part) * local as f64;
            let load = inverse.times(&vec![load(part); local]);
            for j in (0..n).filter(|&j| b[j].iter().any(|((p, _), _)| *p == part)) {
                let (soft, stiff) = (column(&b[j], part, &inverse), column(&b[j], part, &k));
                for (i, row) in b.iter().enumerate() {
                    for ((_, node), value) in row.iter().filter(|((p, _), _)| *p == part) {
                        f.entries[i * n + j] += value * soft[*node];
                        lumped.entries[i * n + j] += value * stiff[*node];
                    }
                }
                for ((_, node), value) in b[j].iter().filter(|((p, _), _)| *p == part) {
                    d[j] += value * load[*node];
                    coarse.full[j] += value * kernel;
                }
            }
        }
        let set = Set { kept: vec![true; n], basis: Vec::new() };
        Self { f, d, bounded, preconditioned: false, lumped, rows, set, face: None }
    }
}

/// Stiffness of one floating square: five-point, halved at edges.
fn stiffness(cells: usize) -> Matrix {
    let (side, local) = (cells + 1, (cells + 1) * (cells + 1));
    let mut k = Matrix::new(local, vec![0.0; local * local]);
    let mut spring = |i: usize, j: usize, c: f64| {
        for (a, b, v) in [(i, i, c), (j, j, c), (i, j, -c), (j, i, -c)] {
            k.entries[a * local + b] += v;
        }
    };
    let weight = |t: usize| if t == 0 || t == cells { 0.5 } else { 1.0 };
    for s in 0..side {
        for t in 0..cells {
            spring(s * side + t, s * side + t + 1, weight(s));
            spring(t * side + s, (t + 1) * side + s, weight(s));
        }
    }
    k
}

/// A node of a part, and its coefficient.
type Coefficient = ((usize, usize), f64);

/// The rows of the dual problem.
struct Rows {
    b: Vec<Vec<Coefficient>>,
    gap: Vec<f64>,
    bounded: Vec<bool>,
}

impl Rows {
    /// Gluing of the copies of each point, supports at the left side, contact along the right one.
    fn of(parts: usize, cells: usize) -> Self {
        let (side, across) = (cells + 1, parts * cells + 1);
        let mut copies: Vec<Vec<(usize, usize)>> = vec![Vec::new(); across * across];
        for part in 0..parts * parts {
            for node in 0..side * side {
                let x = part % parts * cells + node % side;
                let y = part / parts * cells + node / side;
                copies[y * across + x].push((part, node));
            }
        }
        let (mut b, mut gap, mut bounded) = (Vec::new(), Vec::new(), Vec::new());
        for (point, copies) in copies.iter().enumerate() {
            let mean = 1.0 / (copies.len() as f64).sqrt();
            for m in 1..copies.len() {
                let size = ((m * (m + 1)) as f64).sqrt();
                let mut row: Vec<_> = copies[..m].iter().map(|c| (*c, 1.0 / size)).collect();
                row.push((copies[m], -(m as f64) / size));
                b.push(row);
            }
            if point % across == 0 {
                b.push(copies.iter().map(|c| (*c, mean)).collect());
            }
            gap.resize(b.len(), 0.0);
            bounded.resize(b.len(), false);
            if point % across > across - cells {
                b.push(copies.iter().map(|c| (*c, -mean)).collect());
                gap.push(0.2 / mean);
                bounded.push(true);
            }
        }
        Self { b, gap, bounded }
    }
}

impl Set {
    /// Of these rows; and whether they can balance anything.
    fn of(rows: &[Row], kept: &[bool]) -> (Self, bool) {
        let mut basis: Vec<Row> = Vec::new();
        let mut possible = true;
        for row in rows {
            let inside = row.full.iter().zip(kept).map(|(v, kept)| v * f64::from(*kept)).collect();
            let mut row = Row { inside, ..row.clone() };
            for b in &basis {
                let c = -dot(&b.inside, &row.inside);
                axpy(c, &b.inside, &mut row.inside);
                axpy(c, &b.full, &mut row.full);
                row.right += c * b.right;
            }
            let length = dot(&row.inside, &row.inside).sqrt();
            possible &= length > 1e-8;
            row.inside.iter_mut().chain(&mut row.full).for_each(|v| *v /= length);
            row.right /= length;
            basis.push(row);
        }
        (Self { kept: kept.to_vec(), basis }, possible)
    }

    fn project(&self, x: &mut [f64]) {
        x.iter_mut().zip(&self.kept).for_each(|(x, kept)| *x *= f64::from(*kept));
        for row in &self.basis {
            axpy(-dot(&row.inside, &*x), &row.inside, x);
        }
    }
}

impl Quadratic for Torn {
    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.f.apply(x, y);
    }

    fn project(&mut self, x: &mut [f64]) {
        self.set.project(x);
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> bool {
        if self.preconditioned {
            self.lumped.apply(r, z);
        }
        self.preconditioned
    }

    fn enter(&mut self, face: &qp::feasible::Face) {
        let (set, possible) = Set::of(&self.rows, &face.free);
        self.face = possible.then_some(set);
    }

    fn precondition_on_face(&mut self, [_, penalty]: [f64; 2], r: &[f64], z: &mut [f64]) -> bool {
        let Some(face) = self.face.as_ref().filter(|_| self.preconditioned) else { return false };
        let mut inside = r.to_vec();
        face.project(&mut inside);
        self.lumped.apply(&inside, z);
        face.project(z);
        let mut beside = vec![0.0; r.len()];
        face.basis.iter().for_each(|row| axpy(dot(&row.inside, r) / penalty, &row.full, &mut beside));
        face.basis.iter().for_each(|row| axpy(dot(&row.full, &beside), &row.inside, z));
        true
    }

    fn balance(&mut self, target: &[f64], x: &mut [f64]) {
        let Some(face) = &self.face else { return };
        let missing: Vec<f64> = target.iter().zip(&*x).map(|(target, x)| target - x).collect();
        face.basis.iter().for_each(|row| axpy(dot(&row.full, &missing), &row.inside, x));
    }
}

impl Face for Torn {
    fn restrict(&mut self, kept: &mut [bool], _: &Slides) -> bool {
        let (set, possible) = Set::of(&self.rows, kept);
        self.set = set;
        possible
    }

    fn restore(&mut self, x: &mut [f64]) {
        for row in &self.set.basis {
            axpy(row.right - dot(&row.inside, &*x), &row.inside, x);
        }
    }

    fn gaps(&mut self, residual: &mut [f64]) {
        for row in &self.set.basis {
            axpy(-dot(&row.inside, &*residual), &row.full, residual);
        }
    }
}

/// Solves by SMALSE-M with x = x0 + y, x0 the shortest solution of the equalities; returns x.
pub fn homogenised(torn: &mut Torn, relative: f64) -> Solution {
    let n = torn.d.len();
    torn.restrict(&mut vec![true; n], &Slides::default());
    let mut shift = vec![0.0; n];
    torn.restore(&mut shift);
    let b: Vec<f64> = torn.f.times(&shift).iter().zip(&torn.d).map(|(fx, d)| d - fx).collect();
    let lower = shift.iter().zip(&torn.bounded).map(|(s, b)| if *b { -s } else { f64::NEG_INFINITY }).collect();
    let norm = power::norm(&Plain, torn, &b).expect("an estimate").norm;
    let limits = Limits { relative, reference: None, absolute: 0.0, rounding: 0.0, drop: 0.0, products: 2000 };
    let settings = Settings { limits, norm };
    let problem = Problem { space: &Plain, function: torn, b: &b, set: &FeasibleSet::above(lower) };
    let mut found = solve(problem, &settings, Start { x: vec![0.0; n], multiplier: None });
    axpy(1.0, &shift, &mut found.x);
    found
}
