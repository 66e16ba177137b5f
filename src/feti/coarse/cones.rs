//! What contacts with friction can exert on rigid motions of whole bodies.
//!
//! With Coulomb's friction that is a cone of forces for each pair, with Tresca's a disc. The discs of a contact add up to a convex set,
//! whose points are
//!
//! ```text
//! sum_j x_j t_j   with   x_j >= 0,  sum_j x_j <= 1
//! ```
//!
//! for sums `t_j` of border points. The second condition is one row more, with a slack. As many generators are taken as it takes: a motion
//! that is left over adds to each cone the force that resists it most, and of each sum of discs the point that does, until there is none.
//! So what is refused cannot be held. What is not decided after many of them counts as held, and solving tells.

use std::collections::{BTreeMap, HashMap};

use super::Coarse;
use super::nnls;
use crate::constraint::Constraints;
use crate::constraint::friction::Slider;
use crate::feti::dual::space::RowSpace;
use crate::scene::Friction;
use crate::vector::{dot, length};

/// What contacts with friction can exert on free motions.
#[derive(Default)]
pub(super) struct Cones {
    /// Of each: along the normal, and along the surface as far as friction goes, for a unit force.
    axes: Vec<[Vec<f64>; 3]>,
    /// Of each contact those of its pairs: along the surface, as far as friction goes.
    discs: Vec<Vec<[Vec<f64>; 2]>>,
}

/// How contacts balance a load.
pub(super) struct Balance {
    /// Forces without a limit that were tried: pushes, and those in cones.
    pub pushes: Vec<Vec<f64>>,
    /// What is left of the load, a motion that it drives; zero where that is not proven.
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
            let (factor, group) = match friction[slider.contact]? {
                Friction::Coulomb(coefficient) => (coefficient, -1.0),
                Friction::Tresca(limit) => (limit * slider.limit_area, slider.contact as f64),
            };
            let mut numbers = unit_force(row, 1.0);
            for k in 0..2 {
                let tangent = slider.tangents.get(k);
                numbers.extend(tangent.map_or(vec![0.0; motions], |tangent| unit_force(tangent.row, factor)));
            }
            numbers.push(group);
            Some(numbers)
        };
        let (mut axes, mut discs) = (Vec::new(), BTreeMap::<usize, Vec<_>>::new());
        for numbers in space.gather(width + 1, cone) {
            let [normal, first, second] = [0, 1, 2].map(|k| numbers[k * motions..][..motions].to_vec());
            match numbers[width] < 0.0 {
                true => axes.push([normal, first, second]),
                false => discs.entry(numbers[width] as usize).or_default().push([first, second]),
            }
        }
        Self { axes, discs: discs.into_values().collect() }
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
        self.discs.iter().flatten().flatten().filter(|x| length(x) > 0.0).flat_map(both_ways).map(unit)
    }

    /// Balances a load by pushes along `normals` and by friction; what is left is nothing below `nothing`.
    pub fn balance(&self, normals: &[Vec<f64>], load: &[f64], nothing: f64) -> Balance {
        let (motions, weight) = (load.len(), length(load));
        // Behind a force the rows that limit the sum of each contact: of its own one or of none.
        let row = |force: &[f64], own: Option<usize>| -> Vec<f64> {
            let shares = (0..self.discs.len()).map(|group| if own == Some(group) { weight } else { 0.0 });
            force.iter().copied().chain(shares).collect()
        };
        let (target, none) = ([load, &vec![weight; self.discs.len()]].concat(), vec![0.0; motions]);
        let mut pushes: Vec<Vec<f64>> = normals.iter().cloned().chain(self.sides()).collect();
        let mut columns: Vec<Vec<f64>> = pushes.iter().map(|push| row(push, None)).collect();
        columns.extend((0..self.discs.len()).map(|group| unit(row(&none, Some(group)))));
        for _ in 0..CUTS {
            let mut left = nnls::solve(&columns, &target).residual;
            if length(&left) <= nothing {
                break;
            }
            let motion = &left[..motions];
            let more = self.against(motion);
            let most = (0..self.discs.len()).map(|group| unit(row(&self.most(group, motion), Some(group))));
            let most: Vec<Vec<f64>> = most.filter(|most| dot(most, &left) > RESISTS * length(&left)).collect();
            if more.is_empty() && most.is_empty() {
                left.truncate(motions);
                return Balance { pushes, left };
            }
            columns.extend(more.iter().map(|push| row(push, None)).chain(most));
            pushes.extend(more);
        }
        Balance { pushes, left: none }
    }

    /// The force of each cone that resists a motion most, of those that resist it.
    pub fn against(&self, motion: &[f64]) -> Vec<Vec<f64>> {
        let most = |[normal, first, second]: &[Vec<f64>; 3]| {
            let [a, b] = against_motion([first, second], motion)?;
            let force = unit(combined(normal, (a, first), (b, second)));
            (dot(&force, motion) > RESISTS * length(motion)).then_some(force)
        };
        self.axes.iter().filter_map(most).collect()
    }

    /// What the discs of a contact resist a motion most with.
    fn most(&self, group: usize, motion: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; motion.len()];
        for [first, second] in &self.discs[group] {
            if let Some([a, b]) = against_motion([first, second], motion) {
                sum = combined(&sum, (a, first), (b, second));
            }
        }
        sum
    }
}

/// Generators are added so many times at most.
pub(super) const CUTS: usize = 100;

/// A force resists a motion if it is along it by more than this share.
const RESISTS: f64 = 1e-8;

/// The point of the unit circle whose force, of two along a surface, resists a motion most; `None` where neither does.
fn against_motion(forces: [&Vec<f64>; 2], motion: &[f64]) -> Option<[f64; 2]> {
    let along = forces.map(|force| dot(force, motion));
    let size = along[0].hypot(along[1]);
    (size > 0.0).then(|| along.map(|along| along / size))
}

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
            let mut discs = |count: usize| (0..count).map(|_| [vector(&mut random), vector(&mut random)]).collect();
            let cones = Cones { axes: Vec::new(), discs: vec![discs(5), discs(1), discs(3)] };
            let motion = unit(vector(&mut random));
            let mut idle = || {
                let push = vector(&mut random);
                let along = dot(&push, &motion);
                push.iter().zip(&motion).map(|(p, m)| p - along * m).collect::<Vec<f64>>()
            };
            let normals = [idle(), idle()];
            let border = (0..3).map(|group| cones.most(group, &motion));
            let border = border.fold(vec![0.0; MOTIONS], |sum, most| combined(&sum, (1.0, &most), (0.0, &most)));
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
