//! What the program asks of a material law. A law is a file with a type for its parameters and one for its state.

use super::Hooke;
use crate::tensor::{Tangent, Voigt};

/// What a material point remembers between load steps. Results and checkpoints have its variables by name. A variable that
/// several laws have is called the same in all of them.
pub trait Variables: Copy + PartialEq {
    /// The state of a point that was never loaded.
    const VIRGIN: Self;

    /// The name and the numbers of each variable, in the order in which files have them.
    fn variables(&mut self) -> impl Iterator<Item = (&'static str, &mut [f64])>;
}

/// What a material point answers to a strain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// Stress, the derivative of `energy` by the strain.
    pub stress: Voigt,
    /// One-step potential Psi, energy per volume.
    pub energy: f64,
    /// Whether the trial stress is outside the yield surface, by more than round-off.
    pub plastic: bool,
    /// Accumulated plastic strain at the end of the step.
    pub equivalent_plastic_strain: f64,
}

/// A parameter that no material can have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BadParameter {
    /// Its key in the scene.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// What is allowed instead.
    pub rule: &'static str,
}

/// A law: small strains, rate independent, with a convex potential Psi for a step from a committed state. Strains have
/// engineering shears, stresses and moduli one unit.
pub trait Law {
    /// What a point remembers.
    type State: Variables;

    /// Refuses parameters that no material has.
    ///
    /// # Errors
    /// The first bad one.
    fn check(&self) -> Result<(), BadParameter>;

    /// The law of small strains, `C_e`.
    fn hooke(&self) -> Hooke;

    /// Whether the material can yield.
    fn yields(&self) -> bool;

    /// Whether it flows without hardening, so that there are loads without an equilibrium.
    fn has_limit(&self) -> bool;

    /// Stress, potential and plasticity at `strain`, one step away from `committed`.
    fn respond(&self, strain: &Voigt, committed: &Self::State) -> Response;

    /// The consistent tangent d stress / d strain of the same step: symmetric, at most C_e. In an elastic step it is C_e to the
    /// last bit. With a direction of `flow`, it is the tangent of `assembly::flow`.
    fn stiffness(&self, strain: &Voigt, committed: &Self::State, flow: Option<&Voigt>) -> Tangent;

    /// The direction of flow (`assembly::flow`) after a `change` of the strain by a step of a length.
    fn flow(&self, strain: &Voigt, committed: &Self::State, flow: Option<&Voigt>, step: (&Voigt, f64)) -> Voigt;

    /// Psi(strain + change) - Psi(strain) - sigma(strain) : change >= 0, energy per volume: how far Psi is above its tangent. As
    /// accurate for small changes as for large ones.
    fn divergence(&self, strain: &Voigt, change: &Voigt, committed: &Self::State) -> f64;

    /// A strain one step away from `committed` that has this stress. Beyond the yield surface of what does not harden there is none:
    /// there it is that of the stress on the surface that differs by a multiple of the deviator.
    fn strain(&self, stress: &Voigt, committed: &Self::State) -> Voigt;

    /// The least that tangents are of the elastic stiffness; 1 for an elastic material.
    fn least_tangent(&self) -> f64;

    /// The law with more hardening, if needed: tangents are at least this share of the elastic stiffness. Elastic ones stay.
    fn firmer(&self, least_tangent: f64) -> Self
    where
        Self: Sized;

    /// The most power that a stress without volumetric part can have on a strain rate, per volume; `None` where nothing limits it:
    /// in an elastic material, and in one that hardens.
    fn dissipation(&self, rate: &Voigt) -> Option<f64>;

    /// The state at the end of the step, to be committed once the load step has converged.
    fn commit(&self, strain: &Voigt, committed: &Self::State) -> Self::State;
}
