//! The limit load to be found: which loads grow, and how near it is to be known.

use serde::{Deserialize, Serialize};

use super::Scene;
use super::load::Load;
use super::require::{Checked, known, require, whole};

/// Some loads grow, together, until bodies without hardening bear no more; the others stay.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limit {
    /// Names of the loads that grow; all of them if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loads: Option<Vec<String>>,
    /// How far the bounds of the limit factor may be apart, relative.
    pub tolerance: f64,
}

impl Default for Limit {
    fn default() -> Self {
        Limit { loads: None, tolerance: 0.01 }
    }
}

impl Limit {
    /// Whether this load grows.
    pub fn grows(&self, load: &str) -> bool {
        self.loads.as_ref().is_none_or(|names| names.iter().any(|name| name == load))
    }

    /// The first fault, in a scene that asks for it.
    pub(super) fn check(&self, scene: &Scene) -> Checked {
        let key = "limit.tolerance";
        require(
            self.tolerance >= 1e-5 && self.tolerance < 1.0,
            key,
            self.tolerance,
            "must be at least 1e-5 and below 1",
        )?;
        if let Some(names) = &self.loads {
            let key = "limit.loads";
            let once = (1..names.len()).all(|index| !names[..index].contains(&names[index]));
            require(once && !names.is_empty(), key, names, "name each load that grows once, or leave it out for all")?;
            let stranger = names.iter().find(|name| !scene.load.contains_key(*name));
            stranger.map_or(Ok(()), |name| require(false, key, name, known("load", scene.load.keys())))?;
        }
        let fault = |rule: &str| Err(whole("limit", rule));
        let grows = |(name, load): (&String, &Load)| self.grows(name) && !load.is_zero();
        if !scene.load.iter().any(grows) {
            return fault("there is no load that could grow: give one in a section [load.NAME]");
        }
        if !scene.has_limit_load() {
            return fault(
                "every material is elastic or hardens, so there is no limit load: give one a yield stress and no hardening",
            );
        }
        if !scene.step.is_empty() {
            return fault("the limit load does not depend on a history: remove the steps, or this section");
        }
        if scene.contact.values().any(|contact| contact.friction.is_some_and(|law| law.value() > 0.0)) {
            return fault(
                "limit loads are bounded by the work of the loads, which friction is no part of: remove friction and shear_limit, or this section",
            );
        }
        if scene.initial.is_some() {
            return fault("the limit load does not depend on an earlier state: remove [initial], or this section");
        }
        Ok(())
    }
}
