//! The feasible set { x >= l } and what a gradient means on it.
//!
//! The solvers know the set by the methods of [`FeasibleSet`] only: projection, step, longest step, active entries, split
//! gradient. A product of other convex sets (discs, for multipliers of friction) would answer the same questions here.
//!
//! Notation of Dostal, Optimal Quadratic Programming Algorithms (2009), chapter 5: free gradient phi, chopped gradient
//! beta, reduced free gradient phi~. An entry is active if it *equals* its bound: every move of x goes through
//! [`FeasibleSet::advance`], which puts entries onto the bound that are above it by no more than the rounding of that very
//! move. So the activity test needs no tolerance, and round-off cannot free an entry.

/// An entry this many roundings (of the numbers that it was computed from) above its bound is put onto it.
const SNAP: f64 = 16.0 * f64::EPSILON;

/// The vectors above some lower bounds, which are minus infinity where there is none.
#[derive(Clone, Debug)]
pub struct FeasibleSet {
    lower: Vec<f64>,
}

impl FeasibleSet {
    /// { x >= lower }.
    pub fn above(lower: Vec<f64>) -> Self {
        Self { lower }
    }

    /// How many entries its vectors have.
    pub fn dimension(&self) -> usize {
        self.lower.len()
    }

    /// The bounds, one per entry.
    #[cfg(test)]
    pub fn lower(&self) -> &[f64] {
        &self.lower
    }

    /// `x = max(l, x)`.
    pub fn project(&self, x: &mut [f64]) {
        for (x, &lower) in x.iter_mut().zip(&self.lower) {
            *x = clip(*x, lower, x.abs());
        }
    }

    /// `x = max(l, x - step p)`.
    pub fn advance(&self, x: &mut [f64], step: f64, p: &[f64]) {
        for ((x, &p), &lower) in x.iter_mut().zip(p).zip(&self.lower) {
            let change = step * p;
            *x = clip(*x - change, lower, x.abs() + change.abs());
        }
    }

    /// The largest step with `x - step p >= l` for this rank's entries; infinity if nothing is in the way.
    pub fn reach(&self, x: &[f64], p: &[f64]) -> f64 {
        let ways = x.iter().zip(p).zip(&self.lower).filter(|((_, p), _)| **p > 0.0);
        ways.map(|((x, p), lower)| (x - lower) / p).fold(f64::INFINITY, f64::min)
    }

    /// Which entries are on their bound.
    pub fn active(&self, x: &[f64]) -> Vec<bool> {
        x.iter().zip(&self.lower).map(|(x, lower)| x <= lower).collect()
    }

    /// `z = 0` on the active set of `x`.
    pub fn mask(&self, x: &[f64], z: &mut [f64]) {
        for ((z, x), lower) in z.iter_mut().zip(x).zip(&self.lower) {
            if x <= lower {
                *z = 0.0;
            }
        }
    }

    /// Splits the gradient at `x`: `free` is phi, `chopped` is beta (their sum is the projected gradient), and
    /// `reduced` is phi~, phi cut to what a step of length `step` can use before it meets the bound.
    pub fn split(&self, x: &[f64], gradient: &[f64], step: f64, parts: &mut Parts) {
        for (i, (&x, &g)) in x.iter().zip(gradient).enumerate() {
            let lower = self.lower[i];
            let active = x <= lower;
            parts.free[i] = if active { 0.0 } else { g };
            parts.chopped[i] = if active && g < 0.0 { g } else { 0.0 };
            parts.reduced[i] = if active { 0.0 } else { g.min((x - lower) / step) };
        }
    }
}

/// A gradient split by [`FeasibleSet::split`].
pub struct Parts {
    /// The gradient on the free set.
    pub free: Vec<f64>,
    /// The gradient on the active set where it points inwards.
    pub chopped: Vec<f64>,
    /// The free gradient cut to the distance from the bounds.
    pub reduced: Vec<f64>,
}

impl Parts {
    /// Room for `n` entries.
    pub fn new(n: usize) -> Self {
        Self { free: vec![0.0; n], chopped: vec![0.0; n], reduced: vec![0.0; n] }
    }
}

/// `max(lower, x)`, where `x` within the rounding of `scale` counts as on the bound; NaN stays NaN.
fn clip(x: f64, lower: f64, scale: f64) -> f64 {
    if x - lower <= SNAP * scale { lower } else { x }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: f64 = f64::NEG_INFINITY;

    #[test]
    fn rounding_is_put_onto_the_bound_whatever_the_scale() {
        for scale in [1e-9, 1.0, 1e9] {
            let set = FeasibleSet::above(vec![0.1 * scale, NONE]);
            let mut x = vec![0.3 * scale, 0.3 * scale];
            let p = vec![0.7 * scale, 0.7 * scale];
            let step = set.reach(&x, &p);
            set.advance(&mut x, step, &p);
            assert_eq!(set.active(&x), [true, false]);
            assert_eq!(x[0], 0.1 * scale);
        }
    }

    #[test]
    fn zero_bound_is_met_exactly_by_a_step_of_the_reach() {
        let set = FeasibleSet::above(vec![0.0]);
        for k in 1..200 {
            let (mut x, p) = (vec![1.0 / f64::from(k)], vec![f64::from(k).sqrt()]);
            let step = set.reach(&x, &p);
            set.advance(&mut x, step, &p);
            assert_eq!(x, [0.0]);
        }
    }

    #[test]
    fn gradient_parts() {
        let set = FeasibleSet::above(vec![0.0, 0.0, 0.0, NONE]);
        let mut parts = Parts::new(4);
        set.split(&[0.0, 0.0, 0.25, -5.0], &[1.0, -2.0, 3.0, 4.0], 0.5, &mut parts);
        assert_eq!(parts.free, [0.0, 0.0, 3.0, 4.0]);
        assert_eq!(parts.chopped, [0.0, -2.0, 0.0, 0.0]);
        assert_eq!(parts.reduced, [0.0, 0.0, 0.5, 4.0]);
    }

    #[test]
    fn nan_is_not_hidden_by_a_bound() {
        let set = FeasibleSet::above(vec![0.0]);
        let mut x = vec![1.0];
        set.advance(&mut x, f64::NAN, &[1.0]);
        assert!(x[0].is_nan());
    }
}
