//! What a solution is like, in numbers: forces, energies, residuals, errors, measures.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// What a solution is like. Energies are those of the last increment: what is stored elastically, and what this increment
/// dissipates or stores by hardening.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Elements with plastic flow in the increment.
    pub plastic_elements: Option<u64>,
    /// Contact pairs that transmit pressure.
    pub active_contacts: Option<u64>,
    /// Sum of `contact_forces`.
    pub contact_force: Option<[f64; 3]>,
    /// Force of each contact on the body that the scene names first, whichever surface is the slave.
    pub contact_forces: BTreeMap<String, [f64; 3]>,
    /// Friction at each contact that has any.
    #[serde(default)]
    pub friction: BTreeMap<String, Rubbed>,
    /// Force of each support on the bodies.
    pub reactions: BTreeMap<String, [f64; 3]>,
    /// What acts on each body.
    pub balance: BTreeMap<String, Acting>,
    /// Work of the loads, `f'u`.
    pub external_work: Option<f64>,
    /// `Psi(u)`.
    pub internal_energy: Option<f64>,
    /// `J(u) = Psi(u) - f'u`; with what friction dissipates if its limit is given (Tresca), so that it is what is minimised.
    pub energy: Option<f64>,
    /// Energies since the beginning of the history; null where it began from a result, with `[limit]`, and without convergence.
    #[serde(default)]
    pub energies: Option<Energies>,
    /// Largest length of a nodal displacement.
    pub max_displacement: Option<f64>,
    /// Largest von Mises stress of an element.
    pub max_von_mises: Option<f64>,
    /// How well the equations hold.
    #[serde(flatten)]
    pub residuals: Residuals,
    /// How far the stress is from what it should be.
    #[serde(flatten)]
    pub errors: Errors,
    /// How near it is to the limits of small strains and displacements.
    #[serde(flatten)]
    pub measures: Measures,
}

/// Friction at a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rubbed {
    /// Friction force on the body that the scene names first.
    pub force: [f64; 3],
    /// What the increment dissipates: friction force times slip (energy).
    pub dissipation: f64,
    /// Pairs that touch, or have a given limit of friction, and do not slip.
    pub sticking: u64,
    /// Pairs that slip.
    pub slipping: u64,
}

/// Energies since the beginning of a history: `external = stored + plastic + friction + closing` in equilibrium.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    /// Work of loads, supports and moving obstacles.
    pub external: f64,
    /// Elastic energy.
    pub stored: f64,
    /// Plastic work.
    pub plastic: f64,
    /// What friction dissipated.
    pub friction: f64,
    /// What contact took besides, since increments have a size.
    pub closing: f64,
}

/// The largest value of a measure, and where it is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Extreme {
    /// The value.
    pub value: f64,
    /// Name of the body or contact.
    pub of: String,
    /// Coordinates of an element's centre or of a node.
    pub at: [f64; 3],
}

/// Measures of how near a solution is to the limits of the theory (`study/limits`); null where there is nothing to measure.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// Norm of the strain.
    pub max_strain: Option<Extreme>,
    /// Angle in radians.
    pub max_rotation: Option<Extreme>,
    /// Displacement of a node over the diagonal of its body's bounding box.
    pub max_relative_displacement: Option<Extreme>,
    /// Way that a closed slave node slides, in edges of its facets.
    pub max_sliding: Option<Extreme>,
    /// Gap that closed over the diagonal of the slave's body.
    pub max_closed_gap: Option<Extreme>,
    /// Share of the pressure that is missing, since the other side enters faces of the slave between their nodes.
    pub max_missed_pressure: Option<Extreme>,
    /// Rounding of coordinates over what bodies are strained by (strain times the diagonal); null without contact.
    pub max_rounding: Option<Extreme>,
}

/// Forces and moments on a body, these about the mean of its nodes. What supports hold of a contact's condition passes from one
/// to the other and is in neither.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Acting {
    /// Of loads.
    pub loads: Resultant,
    /// Of supports.
    pub supports: Resultant,
    /// Of contacts.
    pub contacts: Resultant,
    /// Their sum, zero in equilibrium.
    pub unbalanced: Resultant,
}

/// A force and its moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Resultant {
    /// The force.
    pub force: [f64; 3],
    /// The moment (force times length).
    pub moment: [f64; 3],
}

impl Resultant {
    /// Adds a force at the end of this arm.
    pub fn add(&mut self, force: &[f64], arm: [f64; 3]) {
        for a in 0..3 {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            self.force[a] += force[a];
            self.moment[a] += arm[b] * force[c] - arm[c] * force[b];
        }
    }

    /// Of six numbers, the force before the moment.
    pub fn of(numbers: &[f64]) -> Self {
        Self { force: [numbers[0], numbers[1], numbers[2]], moment: [numbers[3], numbers[4], numbers[5]] }
    }

    /// The sum of two.
    pub fn plus(self, other: Self) -> Self {
        let sum = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| a[i] + b[i]);
        Self { force: sum(self.force, other.force), moment: sum(self.moment, other.moment) }
    }
}

/// Errors of the stress in the norm of its complementary energy, relative to the stress.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Bound on `J(u)` less its minimum on this mesh.
    pub duality_gap: Option<f64>,
    /// Bound on the distance from the solution on this mesh.
    #[serde(rename = "error_algebraic")]
    pub algebraic: Option<f64>,
    /// Whether it is a bound; with perfect plasticity it is an estimate.
    #[serde(rename = "error_algebraic_is_bound")]
    pub algebraic_is_bound: Option<bool>,
    /// Estimated distance of the solution on this mesh from the exact one.
    #[serde(rename = "error_discretisation")]
    pub discretisation: Option<f64>,
    /// Whether the solver stopped because the first was small beside the second.
    pub ended_by_accuracy: Option<bool>,
}

/// Relative residuals of the glued, undecomposed problem.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Residuals {
    /// Forces out of balance.
    #[serde(rename = "residual_equilibrium")]
    pub equilibrium: Option<f64>,
    /// Jumps between the copies of a node.
    #[serde(rename = "residual_gluing")]
    pub gluing: Option<f64>,
    /// Penetration.
    #[serde(rename = "residual_gap")]
    pub gap: Option<f64>,
    /// Pressure across open gaps.
    #[serde(rename = "residual_complementarity")]
    pub complementarity: Option<f64>,
    /// Distance of contact forces from the law of friction; zero without friction.
    #[serde(rename = "residual_friction", default)]
    pub friction: Option<f64>,
    /// Unbalanced force or moment of a body.
    #[serde(rename = "residual_balance")]
    pub balance: Option<f64>,
    /// What is missing in the balance of energies, over the sum of their sizes.
    #[serde(rename = "residual_energies", default)]
    pub energies: Option<f64>,
}
