//! The power that a mechanism takes, and where bodies begin to flow.
//!
//! The most power that stresses within the yield surface have on a velocity `v` is
//!
//! ```text
//! int sup { s' : eps(v) : s' does not yield } + p tr eps(v),
//! ```
//!
//! which no mechanism exceeds whose volumes stay: the pressure `p` does nothing then. Where they change, the yield surface of metals does
//! not limit it: it is taken to be twice the pressure that is there and the yield stress at most. And no stress power is taken to more than
//! double, that of elastic and hardening materials in particular. As the flow spreads both matter less and less, unless such parts bear
//! the loads.

use super::Region;
use super::visit::for_each_point;
use crate::material::Law;
use crate::tensor::{contract, deviator, trace};

/// The power on the velocity `v`, with the stress of the displacement `u`, one step from the committed history.
pub fn most(region: &Region, u: &[f64], v: &[f64]) -> f64 {
    let mut sum = 0.0;
    for_each_point(&region.subdomain.elements, &region.subdomain.points, [u, v], |at| {
        let [strain, rate] = &at.strains;
        let stress = region.material.respond(strain, region.committed(at.index)).stress;
        let power = contract(&stress, rate);
        let twice = 2.0 * power.abs();
        sum += at.weight
            * region.material.dissipation(rate).map_or(twice, |most| {
                let growth = trace(rate);
                // The rate of a bar that grows as fast, at the same volume.
                let bar = [growth, -0.5 * growth, -0.5 * growth, 0.0, 0.0, 0.0];
                let of_pressure = trace(&stress) / 3.0 * growth;
                let beside = of_pressure.abs() + region.material.dissipation(&bar).unwrap_or_default();
                twice.min(most + of_pressure + beside)
            });
    });
    sum
}

/// Of an elastic displacement `v`: the power of its stress on it without that of pressures, where stress is limited, and the same
/// weighted with the stress over its limit.
pub fn use_of_strength(region: &Region, v: &[f64]) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for_each_point(&region.subdomain.elements, &region.subdomain.points, [v], |at| {
        let [strain] = &at.strains;
        let Some(most) = region.material.dissipation(strain).filter(|most| *most > 0.0) else { return };
        let power = region.material.hooke().square(&deviator(strain));
        sums[0] += at.weight * power;
        sums[1] += at.weight * power * power / most;
    });
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::internal;
    use crate::decomposition::Subdomain;
    use crate::fixture::{on_ranks, two_bricks};
    use crate::material::samples::STEEL;
    use crate::material::{Material, VonMises};

    /// u = (a y, 0, 0) + b (x, 0, 0).
    fn field(subdomain: &Subdomain, [shear, growth]: [f64; 2]) -> Vec<f64> {
        subdomain.points.iter().flat_map(|[x, y, _]| [shear * y + growth * x, 0.0, 0.0]).collect()
    }

    fn power(region: &Region, u: &[f64], v: &[f64]) -> f64 {
        let mut forces = vec![0.0; u.len()];
        internal::add_forces(region, u, &mut forces);
        forces.iter().zip(v).map(|(f, v)| f * v).sum()
    }

    fn assert_near(found: f64, wanted: f64) {
        assert!((found / wanted - 1.0).abs() < 1e-10, "{found} for {wanted}");
    }

    #[test]
    fn where_stress_flows_the_most_is_what_it_does() {
        let perfect = Material::from(VonMises { hardening: 0.0, ..STEEL });
        let hard = Material::from(STEEL);
        on_ranks(&two_bricks(&[]), 1, |setup| {
            for subdomain in setup.subdomains() {
                let (u, v) = (field(subdomain, [0.1, 0.0]), field(subdomain, [1.0, 0.0]));
                let region = Region::virgin(subdomain, &perfect);
                assert_near(most(&region, &u, &v), power(&region, &u, &v));
                // It does not depend on the stress, but where that is far below its limit.
                let before = field(subdomain, [0.003, 0.0]);
                assert_near(most(&region, &before, &v), most(&region, &u, &v));
                let little = field(subdomain, [1e-5, 0.0]);
                assert_near(most(&region, &little, &v), 2.0 * power(&region, &little, &v));
                // No other stress does more, and pressures are not known.
                let other = field(subdomain, [0.03, 0.02]);
                assert!(most(&region, &other, &v) >= power(&region, &other, &v));
                let swelling = field(subdomain, [1.0, 0.3]);
                assert!(most(&region, &u, &swelling) > 1.1 * power(&region, &u, &swelling));
                // What hardens knows no limit.
                let region = Region::virgin(subdomain, &hard);
                assert_near(most(&region, &u, &v), 2.0 * power(&region, &u, &v));
            }
        });
    }

    #[test]
    fn strength_is_used_in_proportion_to_stress() {
        let perfect = Material::from(VonMises { hardening: 0.0, ..STEEL });
        on_ranks(&two_bricks(&[]), 1, |setup| {
            for subdomain in setup.subdomains() {
                let v = field(subdomain, [1e-6, 0.0]);
                let region = Region::virgin(subdomain, &perfect);
                let [done, weighted] = use_of_strength(&region, &v);
                let stress = perfect.hooke().shear_modulus() * 1e-6 * 3f64.sqrt();
                assert_near(done, power(&region, &v, &v));
                assert_near(done / weighted, 450.0 / stress);
                assert_eq!(use_of_strength(&Region::virgin(subdomain, &Material::from(STEEL)), &v), [0.0; 2]);
            }
        });
    }
}
