//! The load history: what part of the loads and prescribed displacements (of supports and obstacles) acts at the end of
//! each step.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::contact::{Contact, Friction};

/// A stretch of the load history. Loads and prescribed displacements go in a straight line from their values at the end
/// of the step before (zero at the beginning) to the ones given here.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Step {
    /// For headings.
    pub name: String,
    /// Factor of all loads and prescribed displacements at the end of the step.
    pub amplitude: f64,
    /// Equal parts in which the step is taken; plastic flow is integrated implicitly over each.
    pub increments: usize,
    /// How often an increment that does not converge is halved.
    pub halvings: u32,
    /// Factors of some loads, by name, instead of `amplitude`.
    pub load: BTreeMap<String, f64>,
    /// Factors of some supports' displacements, by name, instead of `amplitude`.
    pub support: BTreeMap<String, f64>,
    /// Factors of the displacements of some contacts' obstacles, by name, instead of `amplitude`.
    pub contact: BTreeMap<String, f64>,
    /// Coefficients of friction (or limits of its stress) of some contacts during the step, by name, instead of their own.
    pub friction: BTreeMap<String, f64>,
}

/// The history of a scene that gives none: everything at once.
pub(super) static AT_ONCE: [Step; 1] = [Step::whole(0)];

/// The same where there may be no equilibrium under all of it: what part there is one under is found by halving.
pub(super) static AT_MOST: [Step; 1] = [Step::whole(5)];

impl Step {
    const fn whole(halvings: u32) -> Self {
        Step {
            name: String::new(),
            amplitude: 1.0,
            increments: 1,
            halvings,
            load: BTreeMap::new(),
            support: BTreeMap::new(),
            contact: BTreeMap::new(),
            friction: BTreeMap::new(),
        }
    }

    /// Factor of this load at the end of the step.
    pub fn of_load(&self, name: &str) -> f64 {
        self.load.get(name).copied().unwrap_or(self.amplitude)
    }

    /// Factor of this support's displacement at the end of the step.
    pub fn of_support(&self, name: &str) -> f64 {
        self.support.get(name).copied().unwrap_or(self.amplitude)
    }

    /// Factor of the displacement of this contact's obstacle at the end of the step.
    pub fn of_contact(&self, name: &str) -> f64 {
        self.contact.get(name).copied().unwrap_or(self.amplitude)
    }

    /// The law of friction of this contact during the step; none without friction.
    pub fn friction(&self, name: &str, contact: &Contact) -> Option<Friction> {
        let law = contact.friction?;
        let law = self.friction.get(name).map_or(law, |value| law.with(*value));
        (law.value() > 0.0).then_some(law)
    }
}

impl Default for Step {
    fn default() -> Self {
        Step::whole(5)
    }
}
