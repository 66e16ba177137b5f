//! Least-squares polynomials of the stress around a node, from sums over the samples in the elements around it.
//!
//! The first `n` monomials of `x - x_node` count: 1, x, y, z are those of degree 1, with xx, yy, zz, xy, yz, zx of degree 2.
//! Coefficients are six a monomial. The sums are the lower triangle of the moments `sum m m'`, then `sum m stress'`.

use crate::tensor::Voigt;

/// Monomials of degree 2.
const MOST: usize = 10;
/// Part of the mean square of each monomial that is added to its moment, where the samples determine the polynomial ...
const RIDGE: f64 = 1e-9;
/// ... and where they do not: slopes that they hardly determine become small.
const STRONG_RIDGE: f64 = 1e-2;
/// Samples determine a polynomial if every monomial has this mean square beyond what those before it explain.
const TOLD: f64 = 1e-3;

/// Number of monomials up to a degree.
pub fn monomials(degree: usize) -> usize {
    if degree == 1 { 4 } else { MOST }
}

/// Numbers that the sums of a node take.
pub fn width(n: usize) -> usize {
    n * (n + 1) / 2 + 6 * n
}

/// The monomials at a place beside the node.
fn at([x, y, z]: [f64; 3]) -> [f64; MOST] {
    [1.0, x, y, z, x * x, y * y, z * z, x * y, y * z, z * x]
}

/// Degree of each monomial.
const DEGREES: [i32; MOST] = [0, 1, 1, 1, 2, 2, 2, 2, 2, 2];

/// Adds a sample to the sums of a node.
pub fn add(n: usize, way: [f64; 3], stress: &Voigt, sums: &mut [f64]) {
    let m = at(way);
    let (mut moments, products) = sums.split_at_mut(n * (n + 1) / 2);
    for (i, mi) in m[..n].iter().enumerate() {
        let (row, others) = moments.split_at_mut(i + 1);
        row.iter_mut().zip(&m).for_each(|(moment, mj)| *moment += mi * mj);
        moments = others;
    }
    for (row, m) in products.as_chunks_mut::<6>().0.iter_mut().zip(m) {
        row.iter_mut().zip(stress).for_each(|(sum, s)| *sum += m * s);
    }
}

/// Fits a polynomial to the samples by least squares. Returns whether they determine it; if not, its slopes are kept small.
pub fn fit(n: usize, sums: &[f64], coefficients: &mut [f64]) -> bool {
    let told = fit_with(RIDGE, n, sums, coefficients) > TOLD;
    if !told {
        fit_with(STRONG_RIDGE, n, sums, coefficients);
    }
    told
}

/// By Cholesky's method, with lengths in the radius of the patch. Returns the least pivot of a sample.
fn fit_with(ridge: f64, n: usize, sums: &[f64], coefficients: &mut [f64]) -> f64 {
    let (moments, products) = sums.split_at(n * (n + 1) / 2);
    let entry = |i: usize, j: usize| moments[i * (i + 1) / 2 + j];
    let count = entry(0, 0);
    let radius = ((1..4).map(|k| entry(k, k)).sum::<f64>() / count).sqrt();
    let scale = DEGREES.map(|degree| radius.powi(-degree));
    let mut l = [[0.0; MOST]; MOST];
    for i in 0..n {
        for j in 0..=i {
            let ridge = if i == j && i > 0 { ridge * count } else { 0.0 };
            let known: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            let rest = scale[i] * scale[j] * entry(i, j) + ridge - known;
            l[i][j] = if i == j { rest.sqrt() } else { rest / l[j][j] };
        }
    }
    let mut c = [[0.0; 6]; MOST];
    for i in 0..n {
        for s in 0..6 {
            let known: f64 = (0..i).map(|k| l[i][k] * c[k][s]).sum();
            c[i][s] = (scale[i] * products[6 * i + s] - known) / l[i][i];
        }
    }
    for i in (0..n).rev() {
        for s in 0..6 {
            let known: f64 = (i + 1..n).map(|k| l[k][i] * c[k][s]).sum();
            c[i][s] = (c[i][s] - known) / l[i][i];
        }
    }
    for ((row, c), scale) in coefficients.as_chunks_mut::<6>().0.iter_mut().zip(c).zip(scale) {
        *row = c.map(|c| scale * c);
    }
    (0..n).map(|k| l[k][k] * l[k][k] / count).fold(f64::INFINITY, f64::min)
}

/// Its value at a place beside the node.
pub fn value(coefficients: &[f64], way: [f64; 3]) -> Voigt {
    let mut value = [0.0; 6];
    for (m, row) in at(way).iter().zip(coefficients.as_chunks::<6>().0) {
        value.iter_mut().zip(row).for_each(|(v, c)| *v += m * c);
    }
    value
}

/// Adds the same polynomial around another node, `way` from here, to `moved`.
pub fn add_moved(coefficients: &[f64], way: [f64; 3], moved: &mut [f64]) {
    let [x, y, z] = way;
    let c = coefficients.as_chunks::<6>().0;
    for (s, value) in value(coefficients, way).into_iter().enumerate() {
        moved[s] += value;
        for (k, row) in c.iter().enumerate().skip(1) {
            moved[6 * k + s] += row[s];
        }
        if let [.., xx, yy, zz, xy, yz, zx] = c
            && c.len() == MOST
        {
            moved[6 + s] += 2.0 * x * xx[s] + y * xy[s] + z * zx[s];
            moved[12 + s] += 2.0 * y * yy[s] + x * xy[s] + z * yz[s];
            moved[18 + s] += 2.0 * z * zz[s] + y * yz[s] + x * zx[s];
        }
    }
}

#[cfg(test)]
mod tests;
