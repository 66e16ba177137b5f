//! What checks are made of: a rule that holds, or the fault that names key, value and rule.

use std::fmt::Debug;

use super::error::Fault;

/// Nothing, or the first fault.
pub(super) type Checked = Result<(), Fault>;

/// Passes if `holds`; else the fault reads `key = value: rule`.
pub(super) fn require(holds: bool, key: &str, value: impl Debug, rule: impl Into<String>) -> Checked {
    if holds {
        Ok(())
    } else {
        Err(Fault { key: key.to_owned(), value: Some(format!("{value:?}")), rule: rule.into() })
    }
}

/// A fault of a whole section.
pub(super) fn whole(key: &str, rule: impl Into<String>) -> Fault {
    Fault { key: key.to_owned(), value: None, rule: rule.into() }
}

/// Passes if all are finite numbers.
pub(super) fn all_finite(key: &str, values: &[f64]) -> Checked {
    require(values.iter().all(|value| value.is_finite()), key, values, "must be finite numbers")
}

/// Names in one line.
pub(super) fn names<'a>(known: impl Iterator<Item = &'a String>) -> String {
    known.map(String::as_str).collect::<Vec<_>>().join(", ")
}

/// What to say of a name that is not among those of a section.
pub(super) fn known<'a>(section: &str, known: impl Iterator<Item = &'a String>) -> String {
    match names(known) {
        none if none.is_empty() => format!("no such {section}: the scene has none"),
        known => format!("no such {section}: known are {known}"),
    }
}
