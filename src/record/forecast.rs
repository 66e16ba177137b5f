//! What a run would hold, and how long it would take, by amounts of work.

use serde::{Deserialize, Serialize};

/// How often an amount comes up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Per {
    /// Once.
    Run,
    /// In each Newton step.
    Step,
    /// In each application of the dual operator.
    Application,
}

/// Work of one kind.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Amount {
    /// Its kind, as the forecast has it.
    pub of: &'static str,
    /// How often it comes up.
    pub per: Per,
    /// How much it is, on the rank with most.
    pub amount: f64,
}

/// A level of the cascade, the finest last.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OfLevel {
    /// Subdomains, about.
    pub subdomains: f64,
    /// Newton steps.
    pub steps: f64,
    /// Applications of the dual operator.
    pub applications: f64,
    /// What is done.
    pub amounts: Vec<Amount>,
    /// Seconds.
    pub seconds: f64,
}

/// A forecast for so many ranks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Forecast {
    /// The ranks.
    pub ranks: usize,
    /// Levels of the cascade.
    pub levels: Vec<OfLevel>,
    /// Seconds in all.
    pub seconds: f64,
    /// Of these for messages.
    pub messages: f64,
}

/// What a rank holds of an item.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct HeldRow {
    /// Its name.
    pub item: String,
    /// The rank's share, in MiB.
    pub owned_mb: f64,
    /// What every rank holds, in MiB.
    pub everywhere_mb: f64,
}
