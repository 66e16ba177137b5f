//! Closed forms to compare a computation with: no mesh, no element, no solver.
//!
//! All of them but [`cylinder`] have proportional deviatoric paths, so that one implicit step from the virgin state is
//! exact and the program must meet them up to discretisation, in one step or, along [`cycle`]s, in one a reversal.

pub mod blocks;
pub mod cycle;
pub mod cylinder;
pub mod hertz;
pub mod hollow_sphere;
pub mod homogeneous;
pub mod manufactured;
pub mod mindlin;
pub mod nested_spheres;
pub mod press_fit;
pub mod rubbing;

/// The point of [low, high] where `is_below` turns from true to false, to the last bit.
fn bisect(mut low: f64, mut high: f64, is_below: impl Fn(f64) -> bool) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if is_below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
}
