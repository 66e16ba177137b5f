//! Vectors in space, and inner products and sums of any.

use crate::work;

/// A point or a direction.
pub type Point = [f64; 3];

/// `x'y`, summed from the first component to the last.
#[inline]
pub fn dot(x: impl AsRef<[f64]>, y: impl AsRef<[f64]>) -> f64 {
    x.as_ref().iter().zip(y.as_ref()).map(|(x, y)| x * y).sum()
}

/// `y = y + a x`.
pub fn axpy(a: f64, x: &[f64], y: &mut [f64]) {
    work::each(x.len(), 2, size_of::<f64>());
    for (y, x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
}

/// Euclidean length.
#[inline]
pub fn length(x: impl AsRef<[f64]>) -> f64 {
    dot(&x, &x).sqrt()
}

/// `a - b`.
#[inline]
pub fn difference<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    std::array::from_fn(|i| a[i] - b[i])
}

/// `a x b`.
#[inline]
pub fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
