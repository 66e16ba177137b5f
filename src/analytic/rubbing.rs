//! Bodies that rub on planes with Coulomb's friction: what equilibrium alone tells.

/// A bar between two planes that press it, held at one end and pulled at the other. Friction takes a force `q` from each unit of
/// length that slips:
///
/// ```text
/// it slips over P/q,   the end moves by P^2 / (2 E A q),   friction takes P^3 / (6 E A q)
/// ```
///
/// Let go, it slips back over half of that length, where friction turns round: half of the displacement is left, and a quarter of the
/// work is done again. (Stress is that of a bar, the same all over a cross section.)
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar {
    /// Stiffness `E A`.
    pub stiffness: f64,
    /// Friction `q` on a unit of length.
    pub drag: f64,
    /// The force `P` at its end.
    pub pull: f64,
}

impl Bar {
    /// What slips of the bar that is pulled; of one that is let go half of that.
    pub fn slipping(&self) -> f64 {
        self.pull / self.drag
    }

    /// Displacement of the end while it is pulled, or when it was let go.
    pub fn end(&self, released: bool) -> f64 {
        let pulled = self.pull * self.pull / (2.0 * self.stiffness * self.drag);
        if released { 0.5 * pulled } else { pulled }
    }

    /// Work of friction while it is pulled, or while it is let go. `elements` is how many linear elements slip: friction acts at
    /// their nodes, which costs `1 / (2 m^2)` more; none is the bar itself.
    pub fn dissipated(&self, released: bool, elements: Option<usize>) -> f64 {
        let pulled = self.pull.powi(3) / (6.0 * self.stiffness * self.drag);
        let nodal = elements.map_or(0.0, |m| 0.5 / (m * m) as f64);
        (1.0 + nodal) * if released { 0.25 * pulled } else { pulled }
    }
}

/// Horizontal force that drives a weight of one up a slope (its tangent) with friction.
pub fn up_a_slope(slope: f64, friction: f64) -> f64 {
    (slope + friction) / (1.0 - friction * slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BAR: Bar = Bar { stiffness: 2.1e9, drag: 6000.0, pull: 3e6 };

    /// `u' = N / E A` with a force that falls by `q`, summed up along the bar.
    #[test]
    fn the_end_moves_by_the_strain_of_what_slips() {
        let count = 1000;
        let h = BAR.slipping() / count as f64;
        let force = |k: usize| BAR.drag * h * (k as f64 + 0.5);
        let moved: f64 = (0..count).map(|k| force(k) * h / BAR.stiffness).sum();
        assert!((moved / BAR.end(false) - 1.0).abs() < 1e-9, "{moved}");
        assert!((BAR.end(false) - 0.357142857142857).abs() < 1e-12);
    }

    /// The work of the pull is what is stored and what friction takes, there and back.
    #[test]
    fn no_energy_is_lost() {
        let stored = |released: bool| {
            let part = BAR.pull.powi(3) / (6.0 * BAR.stiffness * BAR.drag);
            // Two stresses that rise to half of the pull, each over half of what slipped.
            if released { 0.25 * part } else { part }
        };
        // Force over displacement of the end is a parabola on both ways.
        let there = BAR.pull * BAR.end(false) * 2.0 / 3.0;
        assert!((stored(false) + BAR.dissipated(false, None) - there).abs() < 1e-9 * there);
        let back = BAR.pull * BAR.end(true) / 3.0;
        assert!((stored(false) - stored(true) - BAR.dissipated(true, None) - back).abs() < 1e-9 * there);
    }

    /// Nodes that slip with linear elements between them.
    #[test]
    fn friction_at_nodes_takes_a_little_more() {
        let m = 10;
        let h = BAR.slipping() / m as f64;
        // The last node has half of the friction; the strain of each element is that of the friction before it.
        let mut u = vec![0.0; m + 1];
        for k in 0..m {
            u[k + 1] = u[k] + BAR.drag * h * (k as f64 + 0.5) * h / BAR.stiffness;
        }
        let weight = |k: usize| if k == m { 0.5 } else { 1.0 };
        let work: f64 = (1..=m).map(|k| weight(k) * BAR.drag * h * u[k]).sum();
        assert!((work / BAR.dissipated(false, Some(m)) - 1.0).abs() < 1e-12, "{work}");
        assert!((u[m] / BAR.end(false) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_slope_without_friction_needs_its_tangent_and_a_plane_the_coefficient() {
        assert_eq!((up_a_slope(0.1, 0.0), up_a_slope(0.0, 0.3)), (0.1, 0.3));
        assert!((up_a_slope(0.1, 0.3) - 0.412371).abs() < 1e-6);
    }
}
