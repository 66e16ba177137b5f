//! Friction between surfaces: what it dissipates, how well its law holds, what it leaves behind.
//!
//! `s` is what surfaces have slid since the last committed increment, `-slack` in the friction rows; `r` the radius of the disc of
//! friction, of constant size (Tresca) or the coefficient times the normal multiplier (Coulomb). At a solution
//!
//! ```text
//! |lambda_t| <= r,    |s| lambda_t = r s.
//! ```
//!
//! Under Tresca's law the displacement minimises `J(u) + sum r |s|`. Under Coulomb's it does so with the radii of its own normal
//! multipliers (Hueeber, Stadler and Wohlmuth, SIAM J. Sci. Comput. 30 (2008)).

use super::problem::TornProblem;
use super::residuals::{larger, relative};
use crate::constraint::friction::Slider;
use crate::constraint::law::Status;
use crate::scene::Friction;
use crate::vector::{dot, length};

/// Radii of the discs of friction on a rank, in the order of its sliders; empty without friction.
pub type Radii = Vec<f64>;

/// What slips by less than this share of the largest displacement sticks.
const ROUNDING: f64 = 1e-9;

/// What is held by less than this share of the largest friction force sticks, too: what moves there is the tolerance.
const BORDER: f64 = 1.0 - 1e-4;

/// Friction at one pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rubbing {
    /// Number of the pair.
    pub pair: usize,
    /// Force of the other side on the slave's, along the surface (force).
    pub force: [f64; 3],
    /// What the slave's side slid on the other since the last committed increment (length).
    pub slip: [f64; 3],
    /// The same since the beginning (length).
    pub total: [f64; 3],
    /// Whether the limit is given, not a share of the pressure.
    pub is_given: bool,
    /// The largest friction force (force).
    pub limit: f64,
}

impl TornProblem<'_> {
    /// Radii at some multipliers.
    pub fn radii(&self, lambda: &[f64]) -> Radii {
        let laws = self.laws();
        self.constraints.sliders.iter().map(|slider| laws.radius(slider, lambda[slider.normal])).collect()
    }

    /// `sum r |s|`, where `slack` is that of a displacement (energy). One collective; none without friction.
    pub fn dissipation(&self, radii: &Radii, slack: &[f64]) -> f64 {
        self.sum_of_sliders(|number, slider| radii[number] * slider.size(slack))
    }

    /// Its derivative along a displacement that changes the slack by `-change`.
    pub fn dissipation_slope(&self, radii: &Radii, slack: &[f64], change: &[f64]) -> f64 {
        self.sum_of_sliders(|number, slider| {
            let size = slider.size(slack);
            let along: f64 = slider.tangents.iter().map(|t| -slack[t.row] * change[t.row]).sum();
            radii[number] * if size > 0.0 { along / size } else { slider.size(change) }
        })
    }

    /// Sum of a number of each slider. One collective; none without friction.
    fn sum_of_sliders(&self, of: impl Fn(usize, &Slider) -> f64) -> f64 {
        if !self.constraints.has_friction {
            return 0.0;
        }
        let (mut values, mut ones) = (vec![0.0; self.gather.rows()], vec![0.0; self.gather.rows()]);
        for (number, slider) in self.constraints.sliders.iter().enumerate() {
            let row = slider.tangents[0].row;
            (values[row], ones[row]) = (of(number, slider), 1.0);
        }
        self.space.dots(&[(&values, &ones)])[0]
    }

    /// How far multipliers are from the law of friction: the largest `|lambda_t| - r` over the largest contact force, and the largest
    /// `||s| lambda_t - r s|` over this times the largest displacement. Collective; zero without friction.
    pub(super) fn friction_residual(&self, slack: &[f64], lambda: &[f64], (force, displacement): (f64, f64)) -> f64 {
        if !self.constraints.has_friction {
            return 0.0;
        }
        let mut worst = [0.0_f64; 3];
        for (slider, radius) in self.constraints.sliders.iter().zip(self.radii(lambda)) {
            let scale = self.constraints.rows[slider.tangents[0].row].scale;
            let (size, beyond) = (slider.size(slack), slider.size(lambda) - radius);
            let off = slider.tangents.iter().map(|t| (size * lambda[t.row] + radius * slack[t.row]).powi(2));
            let found = [scale * beyond.max(0.0), off.sum::<f64>().sqrt(), scale * radius];
            worst.iter_mut().zip(found).for_each(|(w, f)| *w = larger(*w, f));
        }
        let [beyond, off, radius] = worst.map(|worst| self.space.maximum(worst));
        let force = larger(force, radius);
        larger(relative(beyond, force), relative(off, force * displacement))
    }

    /// Friction at the pairs whose rows are on this rank.
    pub fn rubbing(&self, slack: &[f64], lambda: &[f64]) -> Vec<Rubbing> {
        let of = |(slider, radius): (&Slider, f64)| {
            let (scale, mut found) = (self.constraints.rows[slider.tangents[0].row].scale, [[0.0; 3]; 3]);
            for tangent in &slider.tangents {
                let slip = -slack[tangent.row] / scale;
                let before = self.committed.slips.get(tangent.row).map_or(0.0, |slip| slip / scale);
                let values = [-scale * lambda[tangent.row], slip, before + slip];
                for (vector, value) in found.iter_mut().zip(values) {
                    vector.iter_mut().zip(tangent.direction).for_each(|(x, t)| *x += value * t);
                }
            }
            let [force, slip, total] = found;
            let is_given = matches!(self.friction[slider.contact], Some(Friction::Tresca(_)));
            Rubbing { pair: slider.pair, force, slip, total, is_given, limit: scale * radius }
        };
        self.constraints.sliders.iter().zip(self.radii(lambda)).map(of).collect()
    }

    /// Remembers what surfaces have slid, where `slack` is that of the displacement that is committed: from now on that is where they
    /// slide from.
    pub fn commit_slips(&mut self, slack: &[f64]) {
        if !self.constraints.has_friction {
            return;
        }
        self.committed.slips.resize(slack.len(), 0.0);
        for row in self.constraints.sliders.iter().flat_map(|slider| &slider.tangents).map(|tangent| tangent.row) {
            self.committed.slips[row] -= slack[row];
        }
    }
}

impl Rubbing {
    /// Whether surfaces that touch stick or slip; `size` is that of displacements.
    pub fn status(&self, size: f64) -> Status {
        let slips = length(self.slip) > ROUNDING * size && length(self.force) >= BORDER * self.limit;
        if slips { Status::Slip } else { Status::Closed }
    }

    /// What it dissipates (energy).
    pub fn dissipation(&self) -> f64 {
        -dot(self.force, self.slip)
    }
}
