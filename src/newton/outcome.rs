//! How an iteration ends, and what each of its steps did.

use serde::{Deserialize, Serialize};

use super::forcing::LOOSEST;
use super::path::At;
use crate::qp;

/// How the iteration for an increment ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// Both criteria are met, or the accuracy is.
    Converged,
    /// The allowed steps are used up.
    LimitReached,
    /// No step length along the Newton direction lowers the energy: round-off, or a quadratic program solved too loosely.
    Stalled,
    /// A quantity is NaN or infinite.
    NotFinite,
    /// The quadratic program of a step could not be solved.
    Inner(qp::Outcome),
    /// Loads that are to follow the work they do, do none.
    Idle,
    /// Loads grew far beyond what a limit needs, without one.
    Unlimited,
    /// A tangent stiffness is singular beyond its rigid motions.
    Singular(String),
    /// Nothing balances the loads on some body, step after step.
    Unheld,
}

impl Outcome {
    /// Whether what a quadratic program found is worth going on with.
    ///
    /// # Errors
    /// How the iteration ends if it is not.
    pub fn of_program(program: qp::Outcome) -> Result<(), Self> {
        match program {
            qp::Outcome::Converged | qp::Outcome::LimitReached => Ok(()),
            qp::Outcome::NotFinite => Err(Self::NotFinite),
            program => Err(Self::Inner(program)),
        }
    }

    /// What to tell the user, `None` if all is well.
    pub fn message(&self) -> Option<String> {
        Some(match self {
            Self::Converged => return None,
            Self::LimitReached => "Newton's method reached solver.newton_limit without convergence".into(),
            Self::Stalled => {
                "Newton's method stalled: no step lowers the energy; tighten solver.qp_tolerance, or accept the residuals"
                    .into()
            }
            Self::NotFinite => "the solution is not finite (NaN or infinite): check loads, sizes and moduli".into(),
            Self::Inner(qp::Outcome::LimitReached) => {
                "a quadratic program reached solver.qp_limit without convergence".into()
            }
            Self::Inner(outcome) => format!("a quadratic program could not be solved ({outcome:?})"),
            Self::Idle => "the loads of [limit] move nothing, or nothing that yields without hardening".into(),
            Self::Unlimited => {
                "loads that grow are borne without a limit: perhaps by elastic or hardening parts, or by linear elements, which lock".into()
            }
            Self::Singular(message) => message.clone(),
            Self::Unheld => "nothing balances the loads on a body: what contact or friction held there has let go; add a support, or a load that \
                             presses it against a contact"
                .into(),
        })
    }
}

/// What [`super::Newton::advance`] did.
#[derive(Clone, Debug, PartialEq)]
pub enum Next {
    /// The next increment, or part of one, is to be tried.
    Increment,
    /// The attempt that led there failed like this; its first half is to be tried.
    Half(At, Outcome),
    /// The history is over: all of it was reached, or it was given up.
    End,
}

/// What one step did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// Number, from 1.
    pub number: usize,
    /// The paper's criterion.
    pub criterion: f64,
    /// Largest of the true residuals.
    pub residual: f64,
    /// Step length, 1 for a full step.
    pub damping: f64,
    /// `J` after the step.
    pub energy: f64,
    /// Elements that yield.
    pub plastic_elements: usize,
    /// Contact pairs with a force.
    pub active_contacts: usize,
    /// What the QP solver did.
    pub statistics: qp::Statistics,
    /// Residual of the subdomains' problems that rounding leaves, relative to their forces.
    pub local_residual: f64,
    /// Applications of F, those around the quadratic program included.
    pub applications: usize,
    /// Subdomains with a new factor, over all ranks.
    pub factorisations: usize,
    /// Wall time.
    pub seconds: f64,
}

impl StepRecord {
    /// Whether forces on subdomains are further out of balance than the loosest quadratic program leaves them.
    pub fn is_spoiled(&self) -> bool {
        self.local_residual > LOOSEST
    }
}
