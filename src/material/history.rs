//! Histories as named arrays, for results and checkpoints.

use super::law::{Variable, Variables};
use super::laws::History;

/// The numbers of each variable, point by point, in the order in which files have them.
pub fn arrays<'a>(histories: impl Iterator<Item = &'a History> + Clone) -> impl Iterator<Item = (Variable, Vec<f64>)> {
    History::variables().enumerate().map(move |(k, variable)| {
        (variable, histories.clone().flat_map(|history| history.values(k)).copied().collect())
    })
}

/// Histories from the array of each variable.
///
/// # Errors
/// Those of `array`.
pub fn from_arrays<E>(mut array: impl FnMut(&str) -> Result<Vec<f64>, E>) -> Result<Vec<History>, E> {
    let mut histories = Vec::new();
    for (k, Variable { name, components }) in History::variables().enumerate() {
        let values = array(name)?;
        histories.resize(values.len() / components, History::VIRGIN);
        for (history, values) in histories.iter_mut().zip(values.chunks_exact(components)) {
            history.values_mut(k).copy_from_slice(values);
        }
    }
    Ok(histories)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn histories_return_from_their_arrays_which_have_the_names_that_files_know() {
        let mut histories = vec![History::VIRGIN; 3];
        let mut next = 0.0;
        for history in &mut histories {
            for k in 0..History::variables().count() {
                for value in history.values_mut(k) {
                    next += 1.0;
                    *value = next;
                }
            }
        }
        let found: BTreeMap<&str, Vec<f64>> = arrays(histories.iter()).map(|(v, values)| (v.name, values)).collect();
        assert_eq!(found.len(), History::variables().count(), "no two variables have one name");
        assert_eq!(found["kappa"], [7.0, 14.0, 21.0]);
        assert_eq!(found["plastic_strain"][..7], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]);
        assert_eq!(from_arrays(|name| Ok::<_, ()>(found[name].clone())), Ok(histories));
    }
}
