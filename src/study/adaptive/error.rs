//! The error of a solution on a sequence of finer and finer meshes.
//!
//! Of the energy: minima over spaces of which each contains the one before fall, and `J(u_1) - J(u_2)` is the difference of two
//! errors. The Bregman distances (`estimate::bregman`) `D_1` and `D_2` estimate both, too large or too small by a factor that
//! changes little from mesh to mesh. So this factor is measured:
//!
//! ```text
//! J(u_h) - J  ~  theta D_h + gap,   theta = (J(u_1) - J(u_2)) / (D_1 - D_2),
//! ```
//!
//! the larger one with the last two meshes on which `D_1` was at least `APART` times `D_2`. Until there is such a mesh, `theta` is
//! `UNKNOWN`, or what meshes that are nearer tell, if that is more, up to `LARGEST`: a distance that hardly fell while the energy did was
//! too small. Then it is at least `LEAST`: where bodies touch, conditions are those of a mesh, and energies need not fall. Where a limit
//! load is sought, it is at least `LEAST_OF_LIMIT`: distances are far too large on coarse meshes there, and much of them can vanish with
//! little of the error. What conditions of contact add to a distance (`estimate::contact`) is too large where pressures end within an
//! element: such meshes tell no factor, and where it is noticed at all the least one is `LEAST_OF_CONTACT`. Where an energy rises, the
//! error is taken to be as large at least. `gap` bounds what the solver left. Energies of a history are those of its last increment, which
//! begins from another state on each mesh: there `theta` is `UNKNOWN`.
//!
//! Of the stress: the estimate of `estimate`, by `SAFETY` larger.
//!
//! Of a number `Q`: what elements add to it has both signs. The sum `E` of it (`estimate::weighted`) is near the error where it is
//! smooth and too small at edges and fronts; that of its sizes, `D`, falls from mesh to mesh as the error does, but for what cancels.
//! So the error is taken to be the larger one of
//!
//! ```text
//! SAFETY_OF_SUM |E|   and   theta D,   theta = |Q_1 - Q_2| / (D_1 - D_2)
//! ```
//!
//! with the largest `theta` of the last three meshes as above, at least `LEAST_OF_NUMBER`; until there is one, `UNKNOWN_OF_NUMBER` or
//! what nearer meshes tell. Measured over the error, from the second mesh that tells: 0.35 to 500, half of them up to 4, one of 40 below 1.
//! Where curved surfaces of linear elements touch whose meshes do not match, conditions have an error that is in neither.

use crate::record::rows::{GoalRow, RefinementRow};
use crate::scene::ErrorOf;

/// Estimated over true errors of the stress are 0.87 and more on refined meshes.
const SAFETY: f64 = 1.2;
/// Distances of two meshes differ by this factor: those of meshes nearer to each other tell more of how elements happen to lie.
const APART: f64 = 2.0;

/// The true factor was 0.46 on smooth solutions, whose strains are recovered well, up to 1.9 where fronts of plastic flow and
/// edges are.
const LEAST: f64 = 0.5;
/// See [`LEAST`]; near limit loads it was 0.7 to 2.3.
const LEAST_OF_LIMIT: f64 = 1.5;
/// Where conditions of contact have more than this share of a distance, the least factor is `LEAST_OF_CONTACT`: it was 0.6 to 1.8 there.
const NOTICED: f64 = 0.01;
/// See [`LEAST`] and [`NOTICED`].
const LEAST_OF_CONTACT: f64 = 1.2;
/// Where they have more than this share of a distance it may be several times too large, and tells nothing of that of a finer mesh.
const PLAIN: f64 = 0.1;
/// Where nothing tells it: of histories, in which each element counts with the largest distance of all increments, the largest that was
/// found was 1.9.
const UNKNOWN: f64 = 2.0;
/// On meshes before there is a second one that is far enough apart it was up to 2.7, and near ones told 1.3 to 18.
const LARGEST: f64 = 3.0;

/// Errors of numbers were up to 1.8 times what elements add up to on meshes that resolve the solution.
const SAFETY_OF_SUM: f64 = 1.5;
/// See [`LEAST`]; of the sizes of elements, 0.3 to 1 was left where little cancels.
const LEAST_OF_NUMBER: f64 = 0.3;
/// See [`UNKNOWN`]: nothing cancels.
const UNKNOWN_OF_NUMBER: f64 = 1.0;
/// A number is nothing if it is below this share of the terms that it is a sum of.
const NOTHING: f64 = 1e-8;

/// The relative error on the last mesh, from the rows of all; its own `error` is not looked at.
pub fn estimate(of: &ErrorOf, meshes: &[RefinementRow]) -> f64 {
    let Some(last) = meshes.last() else { return f64::INFINITY };
    match of {
        ErrorOf::Goal(_) => of_goal(meshes),
        ErrorOf::Stress => SAFETY * last.stress,
        ErrorOf::Energy => {
            let (theta, least) = if is_history(meshes) { (UNKNOWN, 0.0) } else { (factor(meshes), rise(meshes)) };
            let above = (theta * last.distance + last.gap).max(least);
            if above == 0.0 { 0.0 } else { above / last.size }
        }
    }
}

/// The error of a number, see the header.
fn of_goal(meshes: &[RefinementRow]) -> f64 {
    let Some(last) = meshes.last().and_then(|row| row.goal) else { return f64::INFINITY };
    if vanishes(&last) {
        return f64::INFINITY;
    }
    let before = meshes.iter().rev().skip(1).filter_map(|row| row.goal);
    let changes = before.map(|coarse| [(coarse.value - last.value).abs(), coarse.distance]);
    let theta = told(changes, last.distance, 3, UNKNOWN_OF_NUMBER).max(LEAST_OF_NUMBER);
    (theta * last.distance).max(SAFETY_OF_SUM * last.correction.abs()) / last.value.abs()
}

/// Whether an error is more than a guess: those of energies are when meshes were compared, those of numbers when the second mesh
/// changed them to the side that elements add up to, or there is a third.
pub fn is_known(of: &ErrorOf, meshes: &[RefinementRow]) -> bool {
    match (of, meshes) {
        (ErrorOf::Stress, _) => true,
        (ErrorOf::Energy, _) => meshes.len() > 1 || is_history(meshes),
        (ErrorOf::Goal(_), [one, other]) => {
            let side = |(one, other): (GoalRow, GoalRow)| {
                (other.value - one.value) * (one.correction - other.correction) >= 0.0
            };
            one.goal.zip(other.goal).is_some_and(side)
        }
        (ErrorOf::Goal(_), _) => meshes.len() > 2,
    }
}

/// Whether a number is nothing but rounding, so that no error can be relative to it.
pub fn vanishes(goal: &GoalRow) -> bool {
    goal.value.abs() <= NOTHING * goal.terms
}

/// Whether a mesh took more than one increment of a history: energies are of steps from different states then.
pub fn is_history(meshes: &[RefinementRow]) -> bool {
    meshes.iter().any(|row| row.increments > 1 && row.limit_load.is_none())
}

/// How far the last mesh raised the energy: shapes or conditions changed, and the error is as large at least.
fn rise(meshes: &[RefinementRow]) -> f64 {
    let [.., before, last] = meshes else { return 0.0 };
    if compares(before, last) { last.energy - before.energy } else { 0.0 }
}

/// Whether two energies are those of the same problem: loads that grow to their limit may have done other work.
fn compares(coarse: &RefinementRow, fine: &RefinementRow) -> bool {
    let work = |row: &RefinementRow| row.limit_load.map(|limit| limit.work);
    work(coarse) == work(fine)
}

/// `theta` of energies.
fn factor(meshes: &[RefinementRow]) -> f64 {
    let Some((fine, coarser)) = meshes.split_last() else { return UNKNOWN };
    let of_contact = |share: f64| move |row: &RefinementRow| row.consistency > share * row.distance;
    let is_plain = |coarse: &&RefinementRow| compares(coarse, fine) && !of_contact(PLAIN)(coarse);
    let before = coarser.iter().rev().filter(is_plain);
    let least = match fine.limit_load {
        Some(_) => LEAST_OF_LIMIT,
        None if meshes.iter().any(of_contact(NOTICED)) => LEAST_OF_CONTACT,
        None => LEAST,
    };
    told(before.map(|coarse| [coarse.energy - fine.energy, coarse.distance]), fine.distance, 2, UNKNOWN).max(least)
}

/// The largest `theta` with the last `count` meshes that are far enough from one of this `distance`. Until there is one, `unknown`, or what
/// nearer ones tell. `changes` are those from each mesh before, the last one first, with its distance.
fn told(changes: impl Iterator<Item = [f64; 2]> + Clone, distance: f64, count: usize, unknown: f64) -> f64 {
    let below = |apart: f64| move |&[_, coarse]: &[f64; 2]| coarse >= apart * distance;
    let theta = |[change, coarse]: [f64; 2]| change / (coarse - distance);
    let far = changes.clone().filter(below(APART)).take(count).map(theta).reduce(f64::max);
    far.unwrap_or_else(|| changes.filter(below(1.0)).map(theta).fold(unknown, f64::max).min(LARGEST))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::rows::LimitLoad;

    fn known(energy: f64, distance: f64) -> RefinementRow {
        RefinementRow { energy, size: energy.abs(), distance, stress: 0.1, increments: 1, ..RefinementRow::default() }
    }

    #[test]
    fn energies_of_other_works_are_not_compared() {
        let limit = |work: f64| Some(LimitLoad { lower: 1.0, upper: 1.0, factor: 1.0, work, rest: 0.0 });
        let row = |energy, distance, work| RefinementRow { limit_load: limit(work), ..known(energy, distance) };
        let [coarse, other, fine] = [row(14.0, 4.0, 1.0), row(100.0, 8.0, 2.0), row(8.0, 1.0, 1.0)];
        let alone = estimate(&ErrorOf::Energy, &[coarse.clone(), fine.clone()]);
        assert_eq!(alone, 2.0 / 8.0);
        assert_eq!(estimate(&ErrorOf::Energy, &[other.clone(), coarse, fine.clone()]), alone);
        assert_eq!(estimate(&ErrorOf::Energy, &[other, fine]), UNKNOWN * 1.0 / 8.0);
        // Energies that fall less than distances tell less of a limit than of other loads.
        let of_limit = [row(8.2, 3.0, 1.0), row(8.0, 1.0, 1.0)];
        assert_eq!(estimate(&ErrorOf::Energy, &of_limit), LEAST_OF_LIMIT / 8.0);
        assert_eq!(estimate(&ErrorOf::Energy, &[known(8.2, 3.0), known(8.0, 1.0)]), LEAST / 8.0);
    }

    /// Distances that are those of conditions fall faster than the error does.
    #[test]
    fn meshes_whose_distance_is_of_contact_tell_no_factor() {
        let row = |energy, distance, consistency| RefinementRow { consistency, ..known(energy, distance) };
        let fine = row(8.0, 1.0, 0.02);
        let of = |coarse: RefinementRow| estimate(&ErrorOf::Energy, &[coarse, fine.clone()]) * 8.0;
        assert_eq!(of(row(9.5, 4.0, 3.0)), UNKNOWN);
        assert_eq!(of(row(12.5, 4.0, 0.3)), 1.5);
        assert_eq!(of(row(8.5, 4.0, 0.3)), LEAST_OF_CONTACT);
        let fits = [row(8.6, 4.0, 0.001), row(8.0, 1.0, 0.001)];
        assert_eq!(estimate(&ErrorOf::Energy, &fits) * 8.0, LEAST);
    }

    #[test]
    fn a_constant_factor_is_found_from_two_meshes() {
        let meshes: Vec<RefinementRow> = (0..4).map(|k| 0.5_f64.powi(k)).map(|e| known(-10.0 + e, 2.0 * e)).collect();
        let error = |count: usize| estimate(&ErrorOf::Energy, &meshes[..count]);
        assert_eq!(error(1), UNKNOWN * 2.0 / 9.0);
        for count in 2..=4 {
            let exact = 0.5_f64.powi(count as i32 - 1);
            assert!((error(count) * meshes[count - 1].energy.abs() - exact).abs() < 1e-12);
        }
        assert!((estimate(&ErrorOf::Stress, &meshes) - 0.12).abs() < 1e-15);
    }

    fn of_number(value: f64, correction: f64, distance: f64) -> RefinementRow {
        let goal = Some(GoalRow { value, correction, distance, terms: value.abs(), ..GoalRow::default() });
        RefinementRow { goal, ..RefinementRow::default() }
    }

    #[test]
    fn errors_of_numbers_follow_from_what_meshes_changed_or_elements_add_up_to() {
        let of = ErrorOf::Goal("contact_force".parse::<ErrorOf>().unwrap().goal().unwrap().clone());
        let error = |meshes: &[RefinementRow]| estimate(&of, meshes);
        assert_eq!(error(&[of_number(-8.0, 0.1, 2.0)]), 2.0 / 8.0);
        // Half of the sizes is left: 1 of 2 from the first mesh to the second.
        let meshes = [of_number(-8.0, 0.1, 4.0), of_number(-9.0, -0.1, 2.0), of_number(-9.5, 0.1, 1.0)];
        assert_eq!(error(&meshes), 0.5 / 9.5);
        // Little changed, by chance: the sum of the elements, and the least share of the sizes.
        assert_eq!(error(&[of_number(8.0, 1.0, 4.0), of_number(8.0, -1.0, 2.0)]), 1.5 / 8.0);
        assert_eq!(error(&[of_number(8.0, 1.0, 4.0), of_number(8.0, 0.0, 2.0)]), 0.6 / 8.0);
        // Meshes that are near tell what they can.
        assert_eq!(error(&[of_number(10.0, 1.0, 3.0), of_number(8.0, 0.5, 2.0)]), 4.0 / 8.0);
        assert_eq!(error(&[of_number(8.5, 1.0, 3.0), of_number(8.0, 0.5, 2.0)]), 2.0 / 8.0);
        assert_eq!(error(&[of_number(18.0, 1.0, 3.0), of_number(8.0, 0.5, 2.0)]), LARGEST * 2.0 / 8.0);
        // Exact in any case: forces that balance loads.
        assert_eq!(error(&[of_number(8.0, 0.0, 0.0)]), 0.0);
        assert_eq!(error(&[of_number(8.5, 0.0, 0.0), of_number(8.0, 0.0, 0.0)]), 0.0);
        let nothing = RefinementRow {
            goal: Some(GoalRow { value: 1e-9, terms: 1.0, ..GoalRow::default() }),
            ..meshes[0].clone()
        };
        assert_eq!(error(&[nothing]), f64::INFINITY);
        assert_eq!(error(&[RefinementRow::default()]), f64::INFINITY);

        assert!(!is_known(&of, &meshes[..1]) && is_known(&of, &meshes));
        assert!(!is_known(&of, &[of_number(8.0, 2.0, 4.0), of_number(7.0, 1.0, 1.0)]));
        assert!(is_known(&of, &[of_number(8.0, 2.0, 4.0), of_number(9.0, 1.0, 1.0)]));
        assert!(is_known(&ErrorOf::Energy, &meshes) && !is_known(&ErrorOf::Energy, &meshes[..1]));
    }

    #[test]
    fn meshes_that_tell_nothing_are_left_out() {
        let error = |meshes: &[RefinementRow]| estimate(&ErrorOf::Energy, meshes);
        // The first mesh saw less than there was.
        assert_eq!(error(&[known(-5.0, 1.0), known(-8.0, 2.0)]), UNKNOWN * 2.0 / 8.0);
        assert_eq!(error(&[known(-5.0, 1.0), known(-8.0, 2.0), known(-9.0, 1.0)]), 1.0 / 9.0);
        // Meshes that are near tell what they can.
        assert_eq!(error(&[known(-8.0, 1.5), known(-8.5, 1.0)]), UNKNOWN / 8.5);
        assert_eq!(error(&[known(-8.0, 1.25), known(-8.625, 1.0)]), 2.5 / 8.625);
        assert_eq!(error(&[known(-8.0, 1.25), known(-10.0, 1.0)]), LARGEST / 10.0);
        // The last but one is too near. Of those before it the last two count.
        let meshes = [known(-7.0, 4.0), known(-9.0, 1.5), known(-9.5, 1.0)];
        assert_eq!(error(&meshes), 2.5 / 3.0 / 9.5);
        assert_eq!(error(&[known(-6.5, 4.0), known(-7.0, 3.5), known(-9.0, 1.5), known(-9.5, 1.0)]), 1.0 / 9.5);
        assert_eq!(error(&[known(0.0, 9.0), known(-7.0, 4.0), known(-7.0, 4.0), known(-9.5, 1.0)]), 2.5 / 3.0 / 9.5);
        assert_eq!(error(&[known(-7.0, 4.0), known(-6.9, 1.0)]), LEAST / 6.9);
        let history = meshes.map(|row| RefinementRow { increments: 2, ..row });
        assert_eq!(error(&history), UNKNOWN / 9.5);
        assert_eq!(error(&[RefinementRow { gap: 0.5, ..known(-5.0, 1.0) }]), (UNKNOWN + 0.5) / 5.0);
        assert_eq!(error(&[known(0.0, 0.0)]), 0.0);
        // What rises cannot be known better than that.
        assert_eq!(error(&[known(-7.0, 1.0), known(-5.0, 0.1)]), 2.0 / 5.0);
        assert_eq!(error(&[]), f64::INFINITY);
    }
}
