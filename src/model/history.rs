//! The load history of a scene: right-hand sides and nodal loads at the end of each load step. Between two ends they go in
//! straight lines.

use super::conditions::RightHandSides;
use super::discrete::Discrete;
use crate::assembly::loads::{self, Load};
use crate::feti::Torn;
use crate::scene::{Friction, Scene, Step};

/// What is prescribed at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Conditions {
    /// `f`: nodal forces of each own subdomain.
    pub loads: Torn,
    /// `c`: right-hand sides of this rank's rows.
    pub rhs: Vec<f64>,
    /// Law of friction of each contact of the scene.
    pub friction: Vec<Option<Friction>>,
}

/// A straight part of the history: a load step of the scene.
pub struct Stage {
    /// What is prescribed at its end.
    pub end: Conditions,
    /// Equal increments that lead there, at least one.
    pub increments: usize,
    /// How often an increment may be halved.
    pub halvings: u32,
}

impl Conditions {
    /// A fraction of the way from here to `end`; exactly `end` at 1. Friction is that of the end.
    pub fn towards(&self, end: &Self, fraction: f64) -> Self {
        if fraction == 1.0 {
            return end.clone();
        }
        let between = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + fraction * (b - a)).collect();
        Self {
            loads: self.loads.iter().zip(&end.loads).map(|(a, b)| between(a, b)).collect(),
            rhs: between(&self.rhs, &end.rhs),
            friction: end.friction.clone(),
        }
    }
}

/// What is prescribed at the beginning, and the stages from there; `zeros` are those of a torn vector.
pub fn stages(scene: &Scene, discrete: &Discrete, zeros: &dyn Fn() -> Torn) -> (Conditions, Vec<Stage>) {
    let RightHandSides { begin, ends } = &discrete.right_hand_sides;
    let stages = scene.steps().iter().zip(ends).map(|(step, rhs)| Stage {
        end: Conditions {
            loads: loads(scene, discrete, zeros, &|name| step.of_load(name)),
            rhs: rhs.clone(),
            friction: friction(scene, step),
        },
        increments: step.increments,
        halvings: step.halvings,
    });
    (Conditions { loads: zeros(), rhs: begin.clone(), friction: friction(scene, &scene.steps()[0]) }, stages.collect())
}

/// Laws of friction during a step.
fn friction(scene: &Scene, step: &Step) -> Vec<Option<Friction>> {
    scene.contact.iter().map(|(name, contact)| step.friction(name, contact)).collect()
}

/// The loads that grow to their limit, if the scene asks for it.
pub fn growing(scene: &Scene, discrete: &Discrete, zeros: &dyn Fn() -> Torn) -> Option<Torn> {
    let limit = scene.limit.as_ref()?;
    Some(loads(scene, discrete, zeros, &|name| if limit.grows(name) { 1.0 } else { 0.0 }))
}

/// All loads, each by its factor.
fn loads(scene: &Scene, discrete: &Discrete, zeros: &dyn Fn() -> Torn, factor: &dyn Fn(&str) -> f64) -> Torn {
    let scaled = |(load, name): (&Load, &String)| load.times(factor(name));
    let scaled: Vec<Load> = discrete.loads.iter().zip(scene.load.keys()).map(scaled).collect();
    let mut loads = zeros();
    for (subdomain, f) in discrete.decomposition.subdomains.iter().zip(&mut loads) {
        loads::add(subdomain, &scaled, f);
    }
    loads
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_move_in_straight_lines_and_arrive_exactly() {
        let at = |x: f64| Conditions { loads: vec![vec![x, 0.1], vec![3.0 * x]], rhs: vec![-x], friction: Vec::new() };
        let end = at(0.3);
        assert_eq!(at(0.1).towards(&end, 1.0), end);
        let middle = at(0.1).towards(&end, 0.5);
        assert!((middle.loads[0][0] - 0.2).abs() < 1e-16 && middle.loads[0][1] == 0.1);
        assert!((middle.loads[1][0] - 0.6).abs() < 1e-16 && (middle.rhs[0] + 0.2).abs() < 1e-16);
    }
}
