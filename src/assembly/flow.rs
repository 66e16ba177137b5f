//! The direction of plastic flow as an unknown of its own, beside the displacement.
//!
//! Newton's tangent `2 mu (s I_dev - (s - r) N x N)` (with `s` the ratio of stress to trial stress, `r` that of a hardening tangent,
//! `N = xi / |xi|`) takes the direction of flow to turn with the strain as it does for small changes. Where strains change by more
//! than they are, as where rigid bodies begin to flow, it turns far less, and steps have to be cut one after the other. The primal-dual
//! form of Newton's method does not divide by `|xi|` before it is made linear: the direction `W` is an unknown, with the equation
//! `|xi| W = xi`. Its linear form
//!
//! ```text
//! |xi| (W + dW) + (N : dxi) W = xi + dxi
//! ```
//!
//! gives `dW` point by point, and the tangent `2 mu (s I_dev - (s - r) W x N)`, whose symmetric part is taken, with `W` in the unit
//! ball, so that it stays positive definite. It does not depend on how small the strains are, and at the solution, where `W = N`, it is
//! Newton's (Chan, Golub and Mulet, SIAM J. Sci. Comput. 20 (1999); Hintermueller and Stadler, SIAM J. Sci. Comput. 28 (2006)). The
//! right-hand side is the same, so that a step still lowers `J`.

use std::sync::Arc;

use super::Region;
use super::visit::for_each_point;
use crate::material::Law;
use crate::tensor::Voigt;

/// `W` at each integration point of a subdomain, element by element; none at all where it is `N` everywhere.
pub type Flow = Arc<Vec<Voigt>>;

/// The directions after a step of this `length` from the displacement `u`, which changed by `change`, with `flow` before it.
pub fn follow(region: &Region, flow: &[Voigt], u: &[f64], (change, length): (&[f64], f64)) -> Vec<Voigt> {
    let elements = &region.subdomain.elements;
    let mut next = Vec::with_capacity(elements.kind().points() * elements.len());
    for_each_point(elements, &region.subdomain.shape, [u, change], |at| {
        let ([strain, change], committed) = (&at.strains, region.committed(at.index));
        next.push(region.material.flow(strain, committed, flow.get(at.index), (change, length)));
    });
    next
}
