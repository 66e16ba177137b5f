//! What contacts with friction can exert on rigid motions of whole bodies.
//!
//! With Coulomb's friction that is a cone of forces for each contact, with Tresca's a disc. A sum of discs is a convex set, whose points are
//!
//! ```text
//! sum_j x_j t_j   with   x_j >= 0,  sum_j x_j <= 1
//! ```
//!
//! for sums `t_j` of border points. The second condition is one row more, with a slack. As many generators are taken as it takes: a motion
//! that is left over adds to each cone the force that resists it most, and of the discs the sum that does, until there is none. So what is
//! refused cannot be held.

use std::collections::HashMap;

use super::Coarse;
use crate::constraint::Constraints;
use crate::constraint::friction::Slider;
use crate::feti::dual::space::RowSpace;
use crate::qp::nnls;
use crate::scene::Friction;
use crate::vector::{dot, length};

/// What contacts with friction can exert on free motions.
#[derive(Default)]
pub(super) struct Cones {
    /// Of each: along the normal, and along the surface as far as friction goes, for a unit force.
    axes: Vec<[Vec<f64>; 3]>,
    /// Of each: along the surface, as far as friction goes.
    discs: Vec<[Vec<f64>; 2]>,
}

/// How contacts balance a load.
pub(super) struct Balance {
    /// Forces without a limit that were tried: pushes, and those in cones.
    pub pushes: Vec<Vec<f64>>,
    /// What is left of the load, a motion that it drives.
    pub left: Vec<f64>,
}

impl Cones {
    /// With these laws of friction and so many free motions, `along` which forces are told. Collective.
    pub fn new(
        coarse: &Coarse,
        space: &RowSpace,
        constraints: &Constraints,
        (friction, motions): (&[Option<Friction>], usize),
        along: impl Fn(&[f64]) -> Vec<f64>,
    ) -> Self {
        if !constraints.has_friction {
            return Self::default();
        }
        let of_row: HashMap<usize, &Slider> =
            constraints.sliders.iter().map(|slider| (slider.normal, slider)).collect();
        let unit_force = |row: usize, factor: f64| {
            let mut force = along(&coarse.force_on_bodies(row));
            force.iter_mut().for_each(|f| *f *= factor / constraints.rows[row].scale);
            force
        };
        let width = 3 * motions;
        let cone = |row: usize| {
            let slider = of_row.get(&row)?;
            let (factor, is_given) = match friction[slider.contact]? {
                Friction::Coulomb(coefficient) => (coefficient, 0.0),
                Friction::Tresca(limit) => (limit * slider.share, 1.0),
            };
            let mut numbers = unit_force(row, 1.0);
            for k in 0..2 {
                let tangent = slider.tangents.get(k);
                numbers.extend(tangent.map_or(vec![0.0; motions], |tangent| unit_force(tangent.row, factor)));
            }
            numbers.push(is_given);
            Some(numbers)
        };
        let mut found = Self::default();
        for numbers in space.gather(width + 1, cone) {
            let [normal, first, second] = [0, 1, 2].map(|k| numbers[k * motions..][..motions].to_vec());
            match numbers[width] == 1.0 {
                true => found.discs.push([first, second]),
                false => found.axes.push([normal, first, second]),
            }
        }
        found
    }

    /// Forces that are there in any case: four sides of each cone, so that it has all its dimensions.
    fn sides(&self) -> impl Iterator<Item = Vec<f64>> {
        const SIDES: [(f64, f64); 4] = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
        let of_cone =
            |[normal, first, second]: &[Vec<f64>; 3]| SIDES.map(|(a, b)| combined(normal, (a, first), (b, second)));
        self.axes.iter().flat_map(of_cone).filter(|side| length(side) > 0.0).map(unit)
    }

    /// Forces both ways along the surfaces that have a limit.
    pub fn along_discs(&self) -> impl Iterator<Item = Vec<f64>> {
        let both_ways = |x: &Vec<f64>| [x.clone(), x.iter().map(|x| -x).collect()];
        self.discs.iter().flatten().filter(|x| length(x) > 0.0).flat_map(both_ways).map(unit)
    }

    /// Balances a load by pushes along `normals` and by friction; what is left is nothing below `nothing`.
    pub fn balance(&self, normals: &[Vec<f64>], load: &[f64], nothing: f64) -> Balance {
        let (motions, weight) = (load.len(), length(load));
        let limited = usize::from(!self.discs.is_empty());
        let row = |force: &[f64], share: f64| -> Vec<f64> { [force, &[share * weight][..limited]].concat() };
        let target = row(load, 1.0);
        let mut pushes: Vec<Vec<f64>> = normals.iter().cloned().chain(self.sides()).collect();
        let mut columns: Vec<Vec<f64>> = pushes.iter().map(|push| row(push, 0.0)).collect();
        columns.extend((limited > 0).then(|| unit(row(&vec![0.0; motions], 1.0))));
        let mut left = nnls::solve(&columns, &target).residual;
        for _ in 0..CUTS {
            if length(&left) <= nothing {
                break;
            }
            let known = columns.len();
            let motion = &left[..motions];
            let more = self.against(motion);
            columns.extend(more.iter().map(|push| row(push, 0.0)));
            pushes.extend(more);
            if limited > 0 {
                let most = unit(row(&self.most(motion), 1.0));
                columns.extend((dot(&most, &left) > RESISTS * length(&left)).then_some(most));
            }
            if columns.len() == known {
                break;
            }
            left = nnls::solve(&columns, &target).residual;
        }
        left.truncate(motions);
        Balance { pushes, left }
    }

    /// The force of each cone that resists a motion most, of those that resist it.
    fn against(&self, motion: &[f64]) -> Vec<Vec<f64>> {
        let most = |[normal, first, second]: &[Vec<f64>; 3]| {
            let (a, b) = (dot(first, motion), dot(second, motion));
            let size = a.hypot(b);
            if size == 0.0 {
                return None;
            }
            let force = unit(combined(normal, (a / size, first), (b / size, second)));
            (dot(&force, motion) > RESISTS * length(motion)).then_some(force)
        };
        self.axes.iter().filter_map(most).collect()
    }

    /// What the discs together resist a motion most with.
    fn most(&self, motion: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; motion.len()];
        for [first, second] in &self.discs {
            let (a, b) = (dot(first, motion), dot(second, motion));
            let size = a.hypot(b);
            if size > 0.0 {
                sum = combined(&sum, (a / size, first), (b / size, second));
            }
        }
        sum
    }
}

/// Generators are added so many times at most.
const CUTS: usize = 60;

/// A force resists a motion if it is along it by more than this share.
const RESISTS: f64 = 1e-8;

/// `x + a y + b z`.
fn combined(x: &[f64], (a, y): (f64, &[f64]), (b, z): (f64, &[f64])) -> Vec<f64> {
    x.iter().zip(y).zip(z).map(|((x, y), z)| x + a * y + b * z).collect()
}

/// A vector of length one; zero stays zero.
pub(super) fn unit(mut x: Vec<f64>) -> Vec<f64> {
    let size = length(&x);
    x.iter_mut().for_each(|x| *x /= if size > 0.0 { size } else { 1.0 });
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Motions of a body.
    const MOTIONS: usize = 6;

    fn vector(random: &mut Random) -> Vec<f64> {
        (0..MOTIONS).map(|_| random.number()).collect()
    }

    /// The largest work on a motion is on the border of what can be exerted, whatever pushes do beside it that do no work there.
    #[test]
    fn discs_bear_what_is_within_their_sum_and_nothing_beyond() {
        for seed in 0..40 {
            let mut random = Random::new(seed);
            let discs = (0..7).map(|_| [vector(&mut random), vector(&mut random)]).collect();
            let cones = Cones { axes: Vec::new(), discs };
            let motion = unit(vector(&mut random));
            let mut idle = || {
                let push = vector(&mut random);
                let along = dot(&push, &motion);
                push.iter().zip(&motion).map(|(p, m)| p - along * m).collect::<Vec<f64>>()
            };
            let normals = [idle(), idle()];
            let border = cones.most(&motion);
            for (share, bears) in [(0.5, true), (0.999, true), (1.001, false), (2.0, false)] {
                let load: Vec<f64> =
                    (0..MOTIONS).map(|k| share * border[k] + 3.0 * normals[0][k] + normals[1][k]).collect();
                let nothing = 1e-9 * length(&load);
                let Balance { left, .. } = cones.balance(&normals, &load, nothing);
                assert_eq!(length(&left) <= nothing, bears, "seed {seed}, {share}: {left:?}");
                assert!(bears || dot(&left, &load) > 0.0, "what is left is driven");
            }
        }
    }
}
