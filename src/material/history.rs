//! Histories as named arrays, for results and checkpoints.

use super::law::Variables;
use super::laws::History;

/// Name, numbers a point, and the numbers of each variable, point by point, in the order in which files have them.
pub fn arrays<'a>(histories: impl Iterator<Item = &'a History>) -> Vec<(&'static str, usize, Vec<f64>)> {
    let mut virgin = History::VIRGIN;
    let mut arrays: Vec<_> = virgin.variables().map(|(name, values)| (name, values.len(), Vec::new())).collect();
    for mut history in histories.copied() {
        for ((_, values), (.., array)) in history.variables().zip(&mut arrays) {
            array.extend_from_slice(values);
        }
    }
    arrays
}

/// Histories from the array of each variable.
///
/// # Errors
/// Those of `array`.
pub fn from_arrays<E>(mut array: impl FnMut(&str) -> Result<Vec<f64>, E>) -> Result<Vec<History>, E> {
    let mut virgin = History::VIRGIN;
    let mut histories = Vec::new();
    for (k, (name, numbers)) in virgin.variables().enumerate() {
        let values = array(name)?;
        histories.resize(values.len() / numbers.len(), History::VIRGIN);
        for (history, values) in histories.iter_mut().zip(values.chunks_exact(numbers.len())) {
            history.variables().nth(k).expect("all have the same variables").1.copy_from_slice(values);
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
            for value in history.variables().flat_map(|(_, values)| values) {
                next += 1.0;
                *value = next;
            }
        }
        let found = arrays(histories.iter()).into_iter().map(|(name, _, values)| (name, values));
        let found: BTreeMap<&str, Vec<f64>> = found.collect();
        assert_eq!(found.len(), histories[0].variables().count(), "no two variables have one name");
        assert_eq!(found["kappa"], [7.0, 14.0, 21.0]);
        assert_eq!(found["plastic_strain"][..7], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]);
        assert_eq!(from_arrays(|name| Ok::<_, ()>(found[name].clone())), Ok(histories));
    }
}
