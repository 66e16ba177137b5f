//! The load history of a scene: right-hand sides and nodal loads at the end of each step.

use super::conditions::RightHandSides;
use super::discrete::Discrete;
use crate::assembly::loads::{self, Load};
use crate::feti::Torn;
use crate::newton::loading::{Conditions, Stage};
use crate::scene::Scene;

/// What is prescribed at the beginning, and the stages from there; `zeros` are those of a torn vector.
pub fn stages(scene: &Scene, discrete: &Discrete, zeros: &dyn Fn() -> Torn) -> (Conditions, Vec<Stage>) {
    let RightHandSides { begin, ends } = &discrete.right_hand_sides;
    let loads = |factor: &dyn Fn(&str) -> f64| {
        let scaled = |(load, name): (&Load, &String)| load.times(factor(name));
        let scaled: Vec<Load> = discrete.loads.iter().zip(scene.load.keys()).map(scaled).collect();
        let mut loads = zeros();
        for (subdomain, f) in discrete.decomposition.subdomains.iter().zip(&mut loads) {
            loads::add(subdomain, &scaled, f);
        }
        loads
    };
    let stages = scene.steps().iter().zip(ends).map(|(step, rhs)| Stage {
        end: Conditions { loads: loads(&|name| step.of_load(name)), rhs: rhs.clone() },
        increments: step.increments,
        halvings: step.halvings,
    });
    (Conditions { loads: zeros(), rhs: begin.clone() }, stages.collect())
}
