//! Rows as forces on subdomains.
//!
//! The rows that glue a node come in threes, one along each axis, with the same slots. Multipliers `x` of three are a force `c x` on the
//! subdomain of each slot, with the moment `l x x`: four numbers, the coefficient `c` and the lever `l`, which is `c` times the arm.
//! Of any other row a slot has three of six numbers along one component of the displacement: its force, and its moments about the
//! two other axes. A row that acts along several components is among the rows of each of them, with a part of its moments.

use crate::feti::inverse::kernel::MODES;
use crate::vector::cross;
use crate::work;

/// Six numbers of a force and its moment, or of a translation and a rotation.
pub type Six = [f64; MODES];

/// Some rows of one rank.
#[derive(Default)]
pub struct Levers {
    /// Those in threes, by the first of each: for each slot its coefficient and its lever.
    threes: Slots<4>,
    /// Those along one component: for each slot its force, and its moments about the two axes after its own.
    along: [Slots<3>; 3],
}

/// Rows with so many numbers for each of their slots.
#[derive(Default)]
struct Slots<const N: usize> {
    rows: Vec<u32>,
    /// Last slot of each row, and one more.
    ends: Vec<u32>,
    /// For each slot the place of its subdomain ([`super::Halo::place`]).
    places: Vec<u32>,
    levers: Vec<[f64; N]>,
}

/// Which of the six numbers of a force along an axis are not zero.
const fn of_axis(axis: usize) -> [usize; 3] {
    [axis, 3 + (axis + 1) % 3, 3 + (axis + 2) % 3]
}

impl Levers {
    /// Adds a row along an axis. After one along the first axis, those along the second and the third follow, with the next numbers, the
    /// same slots and the same coefficients.
    pub fn push_of_three(&mut self, row: usize, axis: usize, slots: impl ExactSizeIterator<Item = (u32, Six)>) {
        if axis == 0 {
            let lever = |(place, [force, _, _, _, second, third]): (u32, Six)| (place, [force, 0.0, -third, second]);
            self.threes.push(row, slots.map(lever));
        } else if axis == 1 {
            let levers = &mut self.threes.levers;
            let begin = levers.len() - slots.len();
            levers[begin..].iter_mut().zip(slots).for_each(|(lever, (_, force))| lever[1] = force[5]);
        }
    }

    /// Adds a row, with the place and the force of each of its slots.
    pub fn push(&mut self, row: usize, slots: impl Iterator<Item = (u32, Six)> + Clone) {
        let mut left: Vec<Six> = slots.clone().map(|(_, force)| force).collect();
        // Forces along an axis take their moments with them; a couple without a force is anyone's.
        for of_axis_alone in [true, false] {
            for axis in 0..3 {
                let entries = of_axis(axis);
                let told = if of_axis_alone { &entries[..1] } else { &entries[..] };
                if !left.iter().any(|force| told.iter().any(|&k| force[k] != 0.0)) {
                    continue;
                }
                let levers = left.iter_mut().map(|force| entries.map(|k| std::mem::take(&mut force[k])));
                self.along[axis].push(row, slots.clone().map(|(place, _)| place).zip(levers));
            }
        }
    }

    /// `forces += ` what the rows `x` exert on own subdomains, which have the first places.
    pub fn add_forces(&self, x: &[f64], forces: &mut [Six]) {
        self.threes.add_forces(x, forces);
        self.along[0].add_forces::<0>(x, forces);
        self.along[1].add_forces::<1>(x, forces);
        self.along[2].add_forces::<2>(x, forces);
    }

    /// `rows += factor` times the jumps that these motions make, given by place.
    pub fn add_jumps(&self, factor: f64, motions: &[Six], rows: &mut [f64]) {
        self.threes.add_jumps(factor, motions, rows);
        self.along[0].add_jumps::<0>(factor, motions, rows);
        self.along[1].add_jumps::<1>(factor, motions, rows);
        self.along[2].add_jumps::<2>(factor, motions, rows);
    }
}

impl<const N: usize> Slots<N> {
    fn push(&mut self, row: usize, slots: impl Iterator<Item = (u32, [f64; N])>) {
        for (place, lever) in slots {
            self.places.push(place);
            self.levers.push(lever);
        }
        self.rows.push(row as u32);
        self.ends.push(self.places.len() as u32);
    }

    /// The rows with their slots, to do so many operations at each of these.
    fn each(&self, flops: usize) -> impl Iterator<Item = (usize, &[u32], &[[f64; N]])> {
        work::each(self.levers.len(), flops, size_of::<[f64; N]>() + size_of::<u32>());
        let mut begin = 0;
        self.rows.iter().zip(&self.ends).map(move |(&row, &end)| {
            let slots = begin..end as usize;
            begin = slots.end;
            (row as usize, &self.places[slots.clone()], &self.levers[slots])
        })
    }
}

impl Slots<4> {
    /// Operations at a slot: a product with a number, a cross product, and a sum of six.
    const FLOPS: usize = 18;

    fn add_forces(&self, x: &[f64], forces: &mut [Six]) {
        for (row, places, levers) in self.each(Self::FLOPS) {
            let x = [x[row], x[row + 1], x[row + 2]];
            for (&place, &[coefficient, lever @ ..]) in places.iter().zip(levers) {
                if let Some(sum) = forces.get_mut(place as usize) {
                    let moment = cross(lever, x);
                    for k in 0..3 {
                        sum[k] += coefficient * x[k];
                        sum[3 + k] += moment[k];
                    }
                }
            }
        }
    }

    fn add_jumps(&self, factor: f64, motions: &[Six], rows: &mut [f64]) {
        for (row, places, levers) in self.each(Self::FLOPS) {
            let mut jump = [0.0; 3];
            for (&place, &[coefficient, lever @ ..]) in places.iter().zip(levers) {
                let [x, y, z, rotation @ ..] = motions[place as usize];
                let turned = cross(rotation, lever);
                jump.iter_mut().zip([x, y, z]).zip(turned).for_each(|((sum, t), r)| *sum += coefficient * t + r);
            }
            rows[row..row + 3].iter_mut().zip(jump).for_each(|(row, jump)| *row += factor * jump);
        }
    }
}

impl Slots<3> {
    /// Operations at a slot: three products, and a sum of them.
    const FLOPS: usize = 6;

    fn add_forces<const AXIS: usize>(&self, x: &[f64], forces: &mut [Six]) {
        let [force, first, second] = const { of_axis(AXIS) };
        for (row, places, levers) in self.each(Self::FLOPS) {
            let x = x[row];
            for (&place, lever) in places.iter().zip(levers) {
                if let Some(sum) = forces.get_mut(place as usize) {
                    sum[force] += x * lever[0];
                    sum[first] += x * lever[1];
                    sum[second] += x * lever[2];
                }
            }
        }
    }

    fn add_jumps<const AXIS: usize>(&self, factor: f64, motions: &[Six], rows: &mut [f64]) {
        let [way, first, second] = const { of_axis(AXIS) };
        for (row, places, levers) in self.each(Self::FLOPS) {
            let mut jump = 0.0;
            for (&place, lever) in places.iter().zip(levers) {
                let motion = &motions[place as usize];
                jump += lever[0] * motion[way] + lever[1] * motion[first] + lever[2] * motion[second];
            }
            rows[row] += factor * jump;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Rows along one axis, along several, and couples, and such in threes; some slots are of other ranks.
    #[test]
    fn sums_are_those_of_all_six_numbers() {
        let mut random = Random::new(5);
        let masks: [[usize; MODES]; 6] = [
            [1, 0, 0, 0, 1, 1],
            [0, 1, 0, 1, 0, 1],
            [0, 0, 1, 1, 1, 0],
            [1; 6],
            [0, 1, 1, 1, 1, 1],
            [0, 0, 0, 1, 0, 1],
        ];
        let (own, all) = (3, 5);
        let mut six = |mask: [usize; MODES]| mask.map(|m| m as f64 * random.number());
        let mut rows: Vec<Vec<(u32, Six)>> = (0..24)
            .map(|row| (0..2 + row % 3).map(|slot| (((row + slot) % all) as u32, six(masks[row % 6]))).collect())
            .collect();
        let motions: Vec<Six> = (0..all).map(|_| six([1; MODES])).collect();
        let mut levers = Levers::default();
        rows.iter().enumerate().for_each(|(row, slots)| levers.push(row, slots.iter().copied()));
        // Threes, each with a coefficient and an arm for each of its slots.
        let mut three = |first: usize| {
            let [c, x, y, z] = [(); 4].map(|()| random.number());
            let forces = [
                [c, 0.0, 0.0, 0.0, c * z, -c * y],
                [0.0, c, 0.0, -c * z, 0.0, c * x],
                [0.0, 0.0, c, c * y, -c * x, 0.0],
            ];
            forces.map(|force| ((first % all) as u32, force))
        };
        for first in [24, 27, 30, 33] {
            let slots: Vec<_> = (0..2 + first % 2).map(|slot| three(first + slot)).collect();
            for axis in 0..3 {
                let of_axis: Vec<(u32, Six)> = slots.iter().map(|of_slot| of_slot[axis]).collect();
                levers.push_of_three(first + axis, axis, of_axis.iter().copied());
                rows.push(of_axis);
            }
        }

        let x: Vec<f64> = (0..rows.len()).map(|row| 1.0 + row as f64).collect();
        let mut forces = vec![[1.0; MODES]; own];
        levers.add_forces(&x, &mut forces);
        let mut expected = vec![[1.0; MODES]; all];
        for ((place, force), x) in rows.iter().zip(&x).flat_map(|(slots, x)| slots.iter().map(move |slot| (slot, x))) {
            (0..MODES).for_each(|k| expected[*place as usize][k] += x * force[k]);
        }
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12 * (1.0 + b.abs());
        assert!(forces.as_flattened().iter().zip(expected.as_flattened()).all(|(&a, &b)| near(a, b)));

        let mut jumps = x.clone();
        levers.add_jumps(-2.0, &motions, &mut jumps);
        for ((slots, x), jump) in rows.iter().zip(x).zip(jumps) {
            let of_slot = |(place, force): &(u32, Six)| -> f64 {
                motions[*place as usize].iter().zip(force).map(|(a, b)| a * b).sum()
            };
            assert!(near(jump, x - 2.0 * slots.iter().map(of_slot).sum::<f64>()));
        }
    }
}
