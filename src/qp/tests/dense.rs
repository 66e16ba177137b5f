//! For tests: dense matrices, a projector by Gram-Schmidt, random numbers, and the truth by trying all active sets.

use crate::qp::discs::Place;
use crate::qp::feasible::Face;
use crate::qp::quadratic::{Quadratic, Space};
pub use crate::vector::dot;

/// Plain inner products.
pub struct Plain;

impl Space for Plain {
    fn dots(&self, pairs: &[(&[f64], &[f64])]) -> Vec<f64> {
        pairs.iter().map(|(x, y)| x.iter().zip(*y).map(|(x, y)| x * y).sum()).collect()
    }

    fn minimum(&self, mine: f64) -> f64 {
        mine
    }
}

/// Linear congruential generator (Knuth, MMIX).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        let mut random = Self(seed);
        random.vector(4);
        random
    }

    /// Uniform on -1..1.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.next()).collect()
    }
}

/// Dense symmetric matrix that counts its products.
pub struct Matrix {
    pub n: usize,
    pub entries: Vec<f64>,
    pub products: usize,
}

impl Matrix {
    pub fn new(n: usize, entries: Vec<f64>) -> Self {
        Self { n, entries, products: 0 }
    }

    /// Random orthonormal eigenvectors, logarithmically spread eigenvalues from 1 / `cond` to 1.
    pub fn with_condition(n: usize, cond: f64, random: &mut Random) -> Self {
        let spread = (n - 1).max(1) as f64;
        Self::with_eigenvalues(&(0..n).map(|k| cond.powf(-(k as f64) / spread)).collect::<Vec<_>>(), random)
    }

    pub fn with_eigenvalues(values: &[f64], random: &mut Random) -> Self {
        let n = values.len();
        let basis = gram_schmidt((0..n).map(|_| random.vector(n)).collect());
        let entry = |i: usize, j: usize| (0..n).map(|k| values[k] * basis[k][i] * basis[k][j]).sum();
        Self::new(n, (0..n * n).map(|e| entry(e / n, e % n)).collect())
    }

    /// Five-point Laplacian on a square of `side` x `side` inner points, times h^-2.
    pub fn laplacian(side: usize) -> Self {
        let (n, scale) = (side * side, ((side + 1) * (side + 1)) as f64);
        let mut entries = vec![0.0; n * n];
        for i in 0..n {
            entries[i * n + i] = 4.0 * scale;
            let (right, below) = ((i % side + 1 < side).then_some(i + 1), (i + side < n).then_some(i + side));
            for j in right.into_iter().chain(below) {
                entries[i * n + j] = -scale;
                entries[j * n + i] = -scale;
            }
        }
        Self::new(n, entries)
    }

    /// The inverse of a positive definite matrix, by Gauss-Jordan elimination in place.
    pub fn inverse(&self) -> Self {
        let (n, mut a) = (self.n, self.entries.clone());
        for k in 0..n {
            let pivot = 1.0 / a[k * n + k];
            a[k * n + k] = 1.0;
            a[k * n..(k + 1) * n].iter_mut().for_each(|v| *v *= pivot);
            let row = a[k * n..(k + 1) * n].to_vec();
            for i in (0..n).filter(|&i| i != k) {
                let factor = std::mem::take(&mut a[i * n + k]);
                a[i * n..(i + 1) * n].iter_mut().zip(&row).for_each(|(v, r)| *v -= factor * r);
            }
        }
        Self::new(n, a)
    }

    pub fn cost(&self, x: &[f64], b: &[f64]) -> f64 {
        0.5 * dot(x, self.times(x)) - dot(x, b)
    }

    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        self.entries.chunks_exact(self.n).map(|row| dot(row, x)).collect()
    }

    /// `y = A x`, counted.
    pub fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.products += 1;
        y.copy_from_slice(&self.times(x));
    }
}

/// Projector onto the null space of rows; linearly dependent rows are welcome.
#[derive(Default)]
pub struct Null {
    pub rows: Vec<Vec<f64>>,
}

impl Null {
    pub fn of(rows: Vec<Vec<f64>>) -> Self {
        Self { rows: gram_schmidt(rows) }
    }

    pub fn project(&mut self, x: &mut [f64]) {
        for row in &self.rows {
            let c = dot(row, &*x);
            x.iter_mut().zip(row).for_each(|(x, r)| *x -= c * r);
        }
    }
}

/// A quadratic function put together from A, P and, perhaps, M.
pub struct Joined<'a>(pub &'a mut Matrix, pub &'a mut Null, pub Option<&'a mut Matrix>);

impl Quadratic for Joined<'_> {
    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.0.apply(x, y);
    }

    fn project(&mut self, x: &mut [f64]) {
        self.1.project(x);
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> bool {
        self.2.as_mut().map(|m| m.apply(r, z)).is_some()
    }
}

/// The same with faces: P M P + (I - P) / penalty cut to the face, where pairs move along their tangents on springs.
pub struct OnFaces<'a> {
    whole: Joined<'a>,
    face: Face,
    discs: Vec<[usize; 2]>,
}

impl<'a> OnFaces<'a> {
    pub fn new(whole: Joined<'a>, discs: Vec<[usize; 2]>) -> Self {
        Self { whole, face: Face { free: Vec::new(), places: Vec::new() }, discs }
    }

    /// `z = r` on what is free and, along the tangents of circles of curvature k, `factor(k) r`; zero elsewhere.
    fn cut(&self, factor: impl Fn(f64) -> f64, r: &[f64]) -> Vec<f64> {
        let mut z: Vec<f64> = r.iter().zip(&self.face.free).map(|(r, free)| r * f64::from(*free)).collect();
        for ([i, j], place) in self.discs.iter().zip(&self.face.places) {
            let Place::Sliding { normal: [a, b], curvature } = *place else { continue };
            let along = factor(curvature) * (a * r[*j] - b * r[*i]);
            (z[*i], z[*j]) = (-b * along, a * along);
        }
        z
    }
}

impl Quadratic for OnFaces<'_> {
    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.whole.apply(x, y);
    }

    fn project(&mut self, x: &mut [f64]) {
        self.whole.project(x);
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> bool {
        self.whole.precondition(r, z)
    }

    fn enter(&mut self, face: &Face) {
        self.face = face.clone();
    }

    fn precondition_on_face(&mut self, [size, penalty]: [f64; 2], r: &[f64], z: &mut [f64]) -> bool {
        let soft = self.cut(|k| size / (size + k), r);
        let mut inside = soft.clone();
        self.project(&mut inside);
        if !self.precondition(&inside, z) {
            return false;
        }
        self.project(z);
        for ((z, soft), inside) in z.iter_mut().zip(&soft).zip(&inside) {
            *z += (soft - inside) / penalty;
        }
        let soft = self.cut(|k| size / (size + k), z);
        let springs = self.cut(|k| k / (size + k).powi(2), r);
        for (i, z) in z.iter_mut().enumerate() {
            *z = soft[i] + if self.face.free[i] { 0.0 } else { springs[i] };
        }
        true
    }
}

pub fn distance(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt()
}

fn gram_schmidt(rows: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for mut row in rows {
        let before = dot(&row, &row).sqrt();
        for b in basis.iter().chain(&basis) {
            let c = dot(b, &row);
            row.iter_mut().zip(b).for_each(|(r, b)| *r -= c * b);
        }
        let after = dot(&row, &row).sqrt();
        if after > 1e-10 * before {
            basis.push(row.iter().map(|r| r / after).collect());
        }
    }
    basis
}

/// Gaussian elimination with row pivoting; `None` if singular.
fn solve(mut a: Vec<f64>, mut b: Vec<f64>) -> Option<Vec<f64>> {
    let n = b.len();
    let size = a.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    for k in 0..n {
        let pivot = (k..n).max_by(|i, j| a[i * n + k].abs().total_cmp(&a[j * n + k].abs()))?;
        if a[pivot * n + k].abs() < 1e-14 * size {
            return None;
        }
        (0..n).for_each(|j| a.swap(k * n + j, pivot * n + j));
        b.swap(k, pivot);
        for i in k + 1..n {
            let factor = a[i * n + k] / a[k * n + k];
            (k..n).for_each(|j| a[i * n + j] -= factor * a[k * n + j]);
            b[i] -= factor * b[k];
        }
    }
    for k in (0..n).rev() {
        let sum: f64 = (k + 1..n).map(|j| a[k * n + j] * b[j]).sum();
        b[k] = (b[k] - sum) / a[k * n + k];
    }
    Some(b)
}

/// The minimiser of 1/2 x'A x - x'b over { x >= lower, `equalities` x = 0 }: the best feasible one of the KKT points of
/// all active sets.
pub fn enumerate(a: &Matrix, b: &[f64], lower: &[f64], equalities: &Null) -> Vec<f64> {
    let bounded: Vec<usize> = (0..a.n).filter(|&i| lower[i].is_finite()).collect();
    let mut best = (f64::INFINITY, Vec::new());
    for set in 0..1usize << bounded.len() {
        let fixed = |i: usize| bounded.iter().position(|&j| j == i).is_some_and(|k| set >> k & 1 == 1);
        let free: Vec<usize> = (0..a.n).filter(|&i| !fixed(i)).collect();
        let mut x: Vec<f64> = (0..a.n).map(|i| if fixed(i) { lower[i] } else { 0.0 }).collect();
        let (f, m) = (free.len(), equalities.rows.len());
        let mut matrix = vec![0.0; (f + m) * (f + m)];
        let ax = a.times(&x);
        let mut right: Vec<f64> = free.iter().map(|&i| b[i] - ax[i]).collect();
        for (r, &i) in free.iter().enumerate() {
            for (c, &j) in free.iter().enumerate() {
                matrix[r * (f + m) + c] = a.entries[i * a.n + j];
            }
            for (c, row) in equalities.rows.iter().enumerate() {
                matrix[r * (f + m) + f + c] = row[i];
                matrix[(f + c) * (f + m) + r] = row[i];
            }
        }
        right.extend(equalities.rows.iter().map(|row| -dot(row, &x)));
        let Some(solution) = solve(matrix, right) else { continue };
        free.iter().zip(&solution).for_each(|(&i, &s)| x[i] = s);
        let size = 1.0 + dot(&x, &x).sqrt();
        let feasible = x.iter().zip(lower).all(|(x, l)| *x >= l - 1e-9 * size)
            && equalities.rows.iter().all(|row| dot(row, &x).abs() < 1e-9 * size);
        let cost = a.cost(&x, b);
        if feasible && cost < best.0 {
            best = (cost, x);
        }
    }
    best.1
}
