//! Unknowns that the factor of a subdomain keeps at zero: those that supports fix.
//!
//! The multipliers of such supports that are in balance among themselves move nothing but the supported unknowns. With these
//! unknowns pinned at zero, `K^+` answers forces as the subdomain does on its supports, these multipliers have nothing to do, and
//! equilibrium tells afterwards what the supports carry ([`crate::feti::dual::pinned`]). Rigid motions, `G` and the coarse problem
//! stay as they are: of the rigid motions, those that the supports leave free are held by fixing nodes as in a subdomain
//! without supports ([`super::factor`]). `F` is zero along these multipliers; conjugate gradients do not mind, for right-hand
//! sides are, too.
//!
//! Without it these multipliers converge slowest where supports hold a subdomain at opposite faces: the preconditioner moves
//! the supports and holds the rest of the surface, though a part in plane strain, or one that resists changes of its volume only,
//! bends far more easily without its supports than with them.

use faer::{Mat, Side};

use super::kernel::{MODES, RigidModes};
use crate::constraint::{Constraints, Kind};
use crate::decomposition::Subdomain;

/// A rigid motion of unit size that supports hold moves the supported unknowns by at least the root of this.
const HELD: f64 = 1e-3;
/// One that they leave free moves them by at most the root of this.
const FREE: f64 = 1e-10;

/// What supports fix of one subdomain.
#[derive(Clone, Debug, PartialEq)]
pub struct Pins {
    /// Unknowns, ascending.
    pub unknowns: Vec<u32>,
    /// Amplitudes of the rigid motions that they leave free, in modes of the subdomain's shape.
    pub free: Vec<[f64; MODES]>,
}

impl Pins {
    /// None: all rigid motions are free.
    pub fn none() -> Self {
        let unit = |mode: usize| std::array::from_fn(|k| if k == mode { 1.0 } else { 0.0 });
        Self { unknowns: Vec::new(), free: (0..MODES).map(unit).collect() }
    }

    /// The supports of each own subdomain; none where they hold a rigid motion, but hardly.
    pub fn of_supports(constraints: &Constraints, subdomains: &[Subdomain]) -> Vec<Self> {
        let is_support = |row: u32| matches!(constraints.rows[row as usize].kind, Kind::Support { .. });
        let of = |(own, subdomain): (usize, &Subdomain)| {
            let entries = constraints.entries[own].iter().filter(|entry| is_support(entry.row));
            let mut unknowns: Vec<u32> = entries.map(|entry| entry.dof).collect();
            unknowns.sort_unstable();
            Self::at(unknowns, &subdomain.shape).unwrap_or_else(Self::none)
        };
        subdomains.iter().enumerate().map(of).collect()
    }

    /// At these unknowns of the nodes at `points`; `None` if it is hard to tell which rigid motions they leave free.
    fn at(unknowns: Vec<u32>, points: &[[f64; 3]]) -> Option<Self> {
        if unknowns.is_empty() {
            return None;
        }
        let modes = RigidModes::new(points);
        let mut gram = Mat::<f64>::zeros(MODES, MODES);
        for &dof in &unknowns {
            let motion = modes.along(dof as usize % 3, points[dof as usize / 3]);
            for i in 0..MODES {
                (0..MODES).for_each(|j| gram[(i, j)] += motion[i] * motion[j]);
            }
        }
        let eigen = gram.self_adjoint_eigen(Side::Lower).ok()?;
        let (values, vectors) = (eigen.S(), eigen.U());
        let count = (0..MODES).filter(|&k| values[k] <= FREE).count();
        let is_clear = (count..MODES).all(|k| values[k] >= HELD);
        let motion = |k: usize| std::array::from_fn(|mode| vectors[(mode, k)]);
        is_clear.then(|| Self { unknowns, free: (0..count).map(motion).collect() })
    }
}
