//! The contact patch test: two equal blocks in series, free laterally, the upper one pushed down across a gap.
//!
//! Frictionless blocks with symmetry supports stay in uniaxial compression; with the strain d = (U - g) / (2 L) of both
//! the pressure is E d, or (H d + sigma_y) / (1 + H / E) beyond yield. Matching meshes meet it to solver tolerance.

use crate::material::VonMises;

/// Two blocks of one material and one height with a gap between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoBlocks {
    pub material: VonMises,
    /// Height L > 0 of each block.
    pub height: f64,
    /// Initial gap g >= 0.
    pub gap: f64,
}

/// The blocks under a given displacement of the top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressed {
    /// Contact pressure, >= 0; zero if the gap is open or just closed.
    pub pressure: f64,
    /// Shortening of both blocks per height, >= 0.
    pub strain: f64,
    /// Downward displacement of the lower block's top.
    pub interface: f64,
}

impl TwoBlocks {
    /// Pushes the top of the upper block down by `displacement`.
    pub fn pressed(&self, displacement: f64) -> Pressed {
        let strain = (displacement - self.gap).max(0.0) / (2.0 * self.height);
        let VonMises { young, hardening, .. } = self.material;
        let elastic = young * strain;
        let pressure = match self.material.yield_stress {
            Some(limit) if elastic > limit => (hardening * strain + limit) / (1.0 + hardening / young),
            _ => elastic,
        };
        Pressed { pressure, strain, interface: strain * self.height }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analytic::homogeneous::uniaxial;
    use crate::material::samples::STEEL;

    fn blocks(gap: f64) -> TwoBlocks {
        TwoBlocks { material: STEEL, height: 1000.0, gap }
    }

    #[test]
    fn published_numbers() {
        for (displacement, gap, pressure) in [(3.0, 0.0, 315.0), (10.0, 0.0, 477.2727272727), (10.0, 1.0, 472.5)] {
            assert!((blocks(gap).pressed(displacement).pressure - pressure).abs() < 1e-9);
        }
    }

    #[test]
    fn open_and_grazing_gaps_carry_nothing() {
        for displacement in [-1.0, 0.0, 0.5, 1.0] {
            assert_eq!(blocks(1.0).pressed(displacement), Pressed { pressure: 0.0, strain: 0.0, interface: 0.0 });
        }
    }

    #[test]
    fn both_blocks_and_the_gap_add_up_to_the_displacement() {
        for displacement in [2.0, 5.0, 9.0] {
            let state = blocks(1.0).pressed(displacement);
            let strain = uniaxial(&STEEL, -state.pressure)[0];
            assert!((1.0 - 2.0 * 1000.0 * strain - displacement).abs() < 1e-11);
            assert!((state.interface + 1000.0 * strain).abs() < 1e-11);
        }
    }
}
