//! Values of options. What is malformed whatever the scene is a wrong command line.

use serde::de::DeserializeOwned;
use serde::de::IntoDeserializer;
use serde::de::value::Error;

use crate::scene;

/// Of `--level`.
pub(super) fn level(text: &str) -> Result<usize, String> {
    let level = text.parse().ok().filter(|level| *level > 0);
    level.ok_or_else(|| "levels start at 1, and level n has n times the cells per edge".into())
}

/// Of `--ranks`.
pub(super) fn ranks(text: &str) -> Result<usize, String> {
    let ranks = text.parse().ok().filter(|ranks| *ranks > 0);
    ranks.ok_or_else(|| "a run has one rank at least".into())
}

/// Of `--set`.
pub(super) fn change(text: &str) -> Result<String, String> {
    scene::well_formed(text).map(|()| text.to_owned())
}

/// A name that a key of the scene may have.
pub(super) fn name<T: DeserializeOwned>(text: &str) -> Result<String, String> {
    T::deserialize(text.into_deserializer()).map(|_| text.to_owned()).map_err(|error: Error| error.to_string())
}

/// Of `--error`, a share or in per cent, as TOML has numbers.
pub(super) fn error(text: &str) -> Result<String, String> {
    let (number, unit) = text.strip_suffix('%').map_or((text, 1.0), |number| (number, 100.0));
    let share = number.trim().parse::<f64>().ok().map(|x| x / unit).filter(|share| *share > 0.0 && *share < 1.0);
    share.map(|share| format!("{share:?}")).ok_or_else(|| "it is above 0 and below 1, or 100%".into())
}

/// Of `--accuracy`, as TOML has numbers.
pub(super) fn accuracy(text: &str) -> Result<String, String> {
    let share = text.parse::<f64>().ok().filter(|share| *share > 0.0 && *share < 1.0);
    share.map(|share| format!("{share:?}")).ok_or_else(|| "it is a share, above 0 and below 1".into())
}
