//! What contacts with friction can exert on rigid motions of whole bodies.
//!
//! With Coulomb's friction that is a cone of forces for each contact. As many of its generators are taken as it takes: a motion that is left
//! over adds to each cone the force that resists it most, until there is none that does. So what is refused cannot be held. Tresca's
//! friction counts with any size here: whether its limit is enough is found out by solving.

use std::collections::HashMap;

use super::Coarse;
use crate::constraint::Constraints;
use crate::constraint::friction::Slider;
use crate::feti::dual::space::RowSpace;
use crate::scene::Friction;
use crate::vector::{dot, length};

/// What contacts with friction can exert on free motions.
pub(super) struct Cones {
    /// Of each: along the normal, and along the surface as far as friction goes, for a unit force.
    axes: Vec<[Vec<f64>; 3]>,
    /// Forces that are there in any case: both ways along the surface under Tresca's law, and where cones have sides.
    pub sides: Vec<Vec<f64>>,
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
            return Self { axes: Vec::new(), sides: Vec::new() };
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
                Friction::Tresca(_) => (1.0, 1.0),
            };
            let mut numbers = unit_force(row, 1.0);
            for k in 0..2 {
                let tangent = slider.tangents.get(k);
                numbers.extend(tangent.map_or(vec![0.0; motions], |tangent| unit_force(tangent.row, factor)));
            }
            numbers.push(is_given);
            Some(numbers)
        };
        let all = space.gather(width + 1, cone);
        let (mut axes, mut sides) = (Vec::new(), Vec::new());
        for numbers in all {
            let [normal, first, second] = [0, 1, 2].map(|k| numbers[k * motions..][..motions].to_vec());
            if numbers[width] == 1.0 {
                let opposite = |x: &Vec<f64>| x.iter().map(|x| -x).collect::<Vec<f64>>();
                sides.extend([opposite(&first), opposite(&second), first, second]);
            } else {
                axes.push([normal, first, second]);
            }
        }
        // Four sides of each cone, so that it has all its dimensions.
        let cones = Self { axes, sides: Vec::new() };
        for [normal, first, second] in &cones.axes {
            for (a, b) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
                sides.push(combined(normal, (a, first), (b, second)));
            }
        }
        let sides = sides.into_iter().filter(|side| length(side) > 0.0).map(unit).collect();
        Self { sides, ..cones }
    }

    /// The force of each cone that resists a motion most, of those that resist it.
    pub fn against(&self, motion: &[f64]) -> Vec<Vec<f64>> {
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
}

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
