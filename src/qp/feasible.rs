//! The feasible set { x >= l, |(x_i, x_j) - c| <= r } and what a gradient means on it.
//!
//! The solvers know the set by the methods of [`FeasibleSet`] only: projection, step, longest step, active entries, split
//! gradient. What they mean for a disc is in [`super::discs`]. A product of other convex sets would answer the same
//! questions.
//!
//! Notation of Dostal, Optimal Quadratic Programming Algorithms (2009), chapter 5: free gradient phi, chopped gradient
//! beta, reduced free gradient phi~. An entry is active if it *equals* its bound: every move of x goes through
//! [`FeasibleSet::advance`], which puts entries onto the bound that are above it by no more than the rounding of that very
//! move. So the activity test needs no tolerance, and round-off cannot free an entry. Circles are met up to rounding.

use super::discs::{Disc, Place};

/// An entry this many roundings (of the numbers that it was computed from) above its bound is put onto it.
pub(super) const SNAP: f64 = 16.0 * f64::EPSILON;

/// The vectors above some lower bounds, which are minus infinity where there is none, with pairs of entries in discs.
#[derive(Clone, Debug)]
pub struct FeasibleSet {
    lower: Vec<f64>,
    /// `None` if no rank has any.
    discs: Option<Vec<Disc>>,
}

impl FeasibleSet {
    /// { x >= lower }, on all ranks.
    pub fn above(lower: Vec<f64>) -> Self {
        Self { lower, discs: None }
    }

    /// { x >= lower, x in discs }: pairs of distinct entries without a bound. If one rank makes its part of the set by this,
    /// all ranks do, those without discs too: solvers take other collectives.
    pub fn with_discs(lower: Vec<f64>, discs: Vec<Disc>) -> Self {
        debug_assert!(discs.iter().flat_map(|disc| disc.entries).all(|i| lower[i] == f64::NEG_INFINITY));
        Self { lower, discs: Some(discs) }
    }

    /// How many entries its vectors have.
    pub fn dimension(&self) -> usize {
        self.lower.len()
    }

    /// Whether it was made with discs: the same on all ranks.
    pub fn has_discs(&self) -> bool {
        self.discs.is_some()
    }

    /// This rank's discs.
    pub(super) fn discs(&self) -> &[Disc] {
        self.discs.as_deref().unwrap_or_default()
    }

    /// The bounds, one per entry.
    #[cfg(test)]
    pub fn lower(&self) -> &[f64] {
        &self.lower
    }

    /// The nearest point of the set: `x = max(l, x)`, and radially onto the circles.
    pub fn project(&self, x: &mut [f64]) {
        for (x, &lower) in x.iter_mut().zip(&self.lower) {
            *x = clip(*x, lower, x.abs());
        }
        for disc in self.discs() {
            disc.confine(x, size(disc, x));
        }
    }

    /// The nearest point of the set to `x - step p`.
    pub fn advance(&self, x: &mut [f64], step: f64, p: &[f64]) {
        self.advance_entries(x, step, p);
        for disc in self.discs() {
            disc.confine(x, size(disc, x) + step.abs() * size(disc, p));
        }
    }

    /// As [`FeasibleSet::advance`], but pairs that slide stay on the tangent, off the set.
    pub fn advance_on_tangents(&self, places: &[Place], x: &mut [f64], step: f64, p: &[f64]) {
        self.advance_entries(x, step, p);
        for (disc, place) in self.discs().iter().zip(places) {
            if !matches!(place, Place::Sliding { .. }) {
                disc.confine(x, size(disc, x) + step.abs() * size(disc, p));
            }
        }
    }

    /// `x = max(l, x - step p)`.
    fn advance_entries(&self, x: &mut [f64], step: f64, p: &[f64]) {
        for ((x, &p), &lower) in x.iter_mut().zip(p).zip(&self.lower) {
            let change = step * p;
            *x = clip(*x - change, lower, x.abs() + change.abs());
        }
    }

    /// The largest step with `x - step p` in the set for this rank's entries; infinity if nothing is in the way. Pairs that
    /// slide may go as far along the tangent as the radius.
    pub fn reach(&self, places: &[Place], x: &[f64], p: &[f64]) -> f64 {
        let ways = x.iter().zip(p).zip(&self.lower).filter(|((_, p), _)| **p > 0.0);
        let reach = ways.map(|((x, p), lower)| (x - lower) / p).fold(f64::INFINITY, f64::min);
        self.discs().iter().zip(places).map(|(disc, place)| disc.reach(*place, x, p)).fold(reach, f64::min)
    }

    /// Which entries are on their bound or their circle.
    pub fn active(&self, x: &[f64]) -> Vec<bool> {
        let mut active: Vec<bool> = x.iter().zip(&self.lower).map(|(x, lower)| x <= lower).collect();
        for disc in self.discs() {
            disc.entries.into_iter().for_each(|i| active[i] = disc.is_active(x));
        }
        active
    }

    /// `z = 0` on the active bounds of `x`.
    pub fn mask_bounds(&self, x: &[f64], z: &mut [f64]) {
        for ((z, x), lower) in z.iter_mut().zip(x).zip(&self.lower) {
            if x <= lower {
                *z = 0.0;
            }
        }
    }

    /// Splits the gradient at `x`: `free` is phi, `chopped` is beta (their sum is the projected gradient), and
    /// `reduced` is phi~, phi cut to what a step of length `step` can use before it meets the bound.
    pub fn split(&self, x: &[f64], gradient: &[f64], step: f64, parts: &mut Parts) {
        parts.places.clear();
        parts.places.extend(self.discs().iter().map(|disc| disc.place(x, gradient)));
        self.split_on_tangents(x, gradient, step, parts);
    }

    /// As [`FeasibleSet::split`] with the places of discs as they are in `parts`: `x` has moved along tangents, and the
    /// gradient is that of [`FeasibleSet::bend`]'s function.
    pub fn split_on_tangents(&self, x: &[f64], gradient: &[f64], step: f64, parts: &mut Parts) {
        for (i, (&x, &g)) in x.iter().zip(gradient).enumerate() {
            let lower = self.lower[i];
            let active = x <= lower;
            parts.free[i] = if active { 0.0 } else { g };
            parts.chopped[i] = if active && g < 0.0 { g } else { 0.0 };
            parts.reduced[i] = if active { 0.0 } else { g.min((x - lower) / step) };
        }
        if let Some(discs) = &self.discs {
            parts.tangent.resize(self.lower.len(), 0.0);
            for (k, disc) in discs.iter().enumerate() {
                disc.split(parts.places[k], x, gradient, step, parts);
            }
        }
    }

    /// Adds to `hp = H p` what circles add to the Hessian on the tangents of pairs that slide.
    pub fn bend(&self, places: &[Place], p: &[f64], hp: &mut [f64]) {
        self.discs().iter().zip(places).for_each(|(disc, place)| disc.bend(*place, p, hp));
    }

    /// The face that `x` is on, where the gradient presses pairs that are on their circles.
    pub fn face(&self, x: &[f64], gradient: &[f64]) -> Face {
        let places = self.discs().iter().map(|disc| disc.place(x, gradient)).collect();
        Face { free: self.active(x).into_iter().map(|active| !active).collect(), places }
    }

    /// Scales `z` on the tangents of pairs that slide, see [`Disc::relax`].
    pub fn relax(&self, places: &[Place], size: f64, z: &mut [f64]) {
        self.discs().iter().zip(places).for_each(|(disc, place)| disc.relax(*place, size, z));
    }

    /// `z = x - old`, without rounding across circles.
    pub fn difference(&self, x: &[f64], old: &[f64], z: &mut [f64]) {
        for ((z, x), old) in z.iter_mut().zip(x).zip(old) {
            *z = x - old;
        }
        self.discs().iter().for_each(|disc| disc.difference(x, old, z));
    }
}

/// A face of the set.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// The entries that are neither on their bound nor on their circle.
    pub free: Vec<bool>,
    /// Where the pairs of this rank's discs are: those that slide may move along their tangents, too.
    pub places: Vec<Place>,
}

/// A gradient split by [`FeasibleSet::split`].
pub struct Parts {
    /// The gradient on the free set.
    pub free: Vec<f64>,
    /// The gradient on the active set where it points inwards.
    pub chopped: Vec<f64>,
    /// The free gradient cut to the distance from the bounds.
    pub reduced: Vec<f64>,
    /// The part of the free gradient that pairs can slide by; empty if the set is without discs.
    pub tangent: Vec<f64>,
    /// Where the pairs are.
    pub places: Vec<Place>,
}

impl Parts {
    /// Room for `n` entries.
    pub fn new(n: usize) -> Self {
        let [free, chopped, reduced] = std::array::from_fn(|_| vec![0.0; n]);
        Self { free, chopped, reduced, tangent: Vec::new(), places: Vec::new() }
    }
}

/// `max(lower, x)`, where `x` within the rounding of `scale` counts as on the bound; NaN stays NaN.
fn clip(x: f64, lower: f64, scale: f64) -> f64 {
    if x - lower <= SNAP * scale { lower } else { x }
}

/// The larger size of a disc's two entries.
fn size(disc: &Disc, x: &[f64]) -> f64 {
    disc.entries.into_iter().map(|i| x[i].abs()).fold(0.0, f64::max)
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
            let step = set.reach(&[], &x, &p);
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
            let step = set.reach(&[], &x, &p);
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
