//! Spans of a few vectors: which are independent, and what is orthogonal to all of them.
//!
//! By modified Gram-Schmidt: one vector after the other is made a unit vector, and the others orthogonal to it. How small a
//! remainder counts as nothing is what the callers know: whether supports hold a body is a matter of arms and of its size
//! (`scene::held`, [`crate::feti::coarse::bodies`], [`crate::feti::coarse::equilibrium`]). For a few dozen
//! vectors; nothing here is blocked.

use crate::vector::{dot, length};

/// Vectors shorter than this share of the longest are nothing in [`complement`]. They are squares of arms over a body's size: those
/// below a hundred thousandth hold nothing.
const NOTHING: f64 = 1e-10;

/// Unit vectors of which so nearly the same is left are equally good in [`complement`].
const TIE: f64 = 1e-6;

/// For each vector whether it is independent of those before it: whether what is orthogonal to these is longer than this
/// `share` of the longest vector.
pub fn independent(vectors: Vec<Vec<f64>>, share: f64) -> Vec<bool> {
    let longest = vectors.iter().map(length).fold(0.0, f64::max);
    let mut span: Vec<Vec<f64>> = Vec::new();
    let is_new = |mut vector: Vec<f64>| {
        span.iter().for_each(|direction| orthogonalise_to(&mut vector, direction));
        let is_new = length(&vector) > share * longest;
        if is_new {
            normalise(&mut vector);
            span.push(vector);
        }
        is_new
    };
    vectors.into_iter().map(is_new).collect()
}

/// An orthonormal basis of what is orthogonal to all `vectors` of `n` entries. Unit vectors come first.
pub fn complement(vectors: &[Vec<f64>], n: usize) -> Vec<Vec<f64>> {
    let square = |v: &[f64]| dot(v, v);
    let longest = vectors.iter().map(|v| square(v)).fold(0.0, f64::max);
    let mut span: Vec<Vec<f64>> = Vec::new();
    let mut rest = vectors.to_vec();
    // The longest of what is left, again and again.
    while let Some(next) = (0..rest.len()).max_by(|&a, &b| square(&rest[a]).total_cmp(&square(&rest[b]))) {
        let mut direction = rest.swap_remove(next);
        if square(&direction) <= NOTHING * NOTHING * longest {
            break;
        }
        orthonormalise(&mut direction, &span);
        rest.iter_mut().for_each(|v| orthogonalise_to(v, &direction));
        span.push(direction);
    }
    let given = span.len();
    let mut left: Vec<Vec<f64>> = (0..n).map(|k| (0..n).map(|i| f64::from(i == k)).collect()).collect();
    left.iter_mut().for_each(|v| span.iter().for_each(|direction| orthogonalise_to(v, direction)));
    while span.len() < n {
        // Ties go to the first.
        let longest = left.iter().map(|v| square(v)).fold(0.0, f64::max);
        let tied = |v: &Vec<f64>| square(v) >= (1.0 - TIE) * longest;
        let next = left.iter().position(tied).expect("fewer directions than dimensions");
        let mut direction = left.remove(next);
        orthonormalise(&mut direction, &span);
        left.iter_mut().for_each(|v| orthogonalise_to(v, &direction));
        span.push(direction);
    }
    span.split_off(given)
}

/// Makes `v` a unit vector orthogonal to orthonormal ones.
fn orthonormalise(v: &mut [f64], to: &[Vec<f64>]) {
    to.iter().for_each(|direction| orthogonalise_to(v, direction));
    normalise(v);
}

fn normalise(v: &mut [f64]) {
    let length = length(&*v);
    v.iter_mut().for_each(|x| *x /= length);
}

fn orthogonalise_to(v: &mut [f64], direction: &[f64]) {
    let along = dot(&*v, direction);
    v.iter_mut().zip(direction).for_each(|(x, d)| *x -= along * d);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn complements_are_orthonormal_and_prefer_unit_vectors() {
        let vectors = [vec![0.0, 2.0, 0.0, 0.0], vec![0.0, 1.0, 0.0, 1e-14], vec![3.0, 0.0, -3.0, 0.0]];
        let found = complement(&vectors, 4);
        assert_eq!(found.len(), 2);
        assert_eq!(found[0], [0.0, 0.0, 0.0, 1.0]);
        assert!(found[1].iter().zip([0.5_f64.sqrt(), 0.0, 0.5_f64.sqrt(), 0.0]).all(|(a, b)| (a - b).abs() < 1e-15));
        assert_eq!(complement(&[], 2), [[1.0, 0.0], [0.0, 1.0]]);
    }

    #[test]
    fn vectors_are_independent_of_those_before_them_or_not() {
        let vectors =
            vec![vec![0.0, 2.0, 0.0], vec![0.0, 1.0, 1e-8], vec![3.0, 1.0, 0.0], vec![1.0, 7.0, 0.0], vec![0.0; 3]];
        assert_eq!(independent(vectors.clone(), 1e-6), [true, false, true, false, false]);
        assert_eq!(independent(vectors, 1e-9), [true, true, true, false, false]);
        assert_eq!(independent(vec![Vec::new(); 2], 1e-6), [false; 2]);
    }
}
