//! How exactly an active set's equality problems are solved.
//!
//! A factor on the residual decides when a set is corrected. It can be too loose. Where some contacts are stiff and some soft, or bodies
//! keep their volume, the norm of the residual is that of the soft parts; the forces and gaps of stiff rows may still be wrong, and the
//! sets may wander. So the problems are solved more exactly where contacts are that different, and after a correction that is much larger
//! than an earlier one; and more exactly for good when corrections do not become smaller for long, or a set comes back, to the tolerance
//! in the end. Sets that wander then wander for ever. A set that comes back lowers the tolerance of the program too, as far as that of
//! the scene.
//!
//! Slips may also turn to and fro on one set, where discs are small beside the tolerance. Their springs tell: corrections of these do not
//! become smaller.

/// Factor by which the residual drops between two looks at the set.
pub(super) const LOOSE: f64 = 0.4;
/// What it is multiplied by for a set after a large correction, and for good where sets come back or do not settle, ...
pub(super) const TIGHTER: f64 = 0.1;
/// ... and the last before the tolerance; the first where some contacts are stiff and some soft.
pub(super) const LEAST: f64 = 1e-3;
/// A correction that changes this many times more rows than the smallest so far: sets are corrected too early.
const GROWTH: f64 = 1.3;
/// A correction of springs that is not below this share of the last one: springs do not settle.
const SETTLING: f64 = 0.7;
/// So many of them one after the other: slips turn to and fro.
const TURNS: usize = 3;
/// So many corrections without one that is smaller than all before: sets do not settle.
const SLOW: usize = 6;

/// So many of them where problems are solved to the tolerance: sets wander.
const STUCK: usize = 8;

/// The state of it.
pub(super) struct Exactness {
    /// The sets since that became more exact for good.
    pub history: Vec<Vec<bool>>,
    /// How far the residual drops before a set is corrected.
    pub loose: f64,
    /// Whether the next one is more exact.
    wary: bool,
    /// The smallest correction so far, ...
    smallest: f64,
    /// ... and how many came after it, or after that became more exact.
    since: usize,
    /// What the last correction of springs on this set moved the residual by, ...
    springs: f64,
    /// ... and how many came one after the other that were not much smaller than the one before.
    unsettled: usize,
}

impl Exactness {
    pub fn new(first: Vec<bool>, loose: f64) -> Self {
        Self {
            history: vec![first],
            loose,
            wary: false,
            smallest: f64::INFINITY,
            since: 0,
            springs: f64::INFINITY,
            unsettled: 0,
        }
    }

    /// How far the residual drops on this set.
    pub fn take_relative(&mut self) -> f64 {
        if std::mem::take(&mut self.wary) { self.loose * TIGHTER } else { self.loose }
    }

    /// Takes note of a correction that left the set as it is and moved the residual by `distance` with springs across slips.
    pub fn note_springs(&mut self, distance: f64) {
        self.unsettled = if distance > SETTLING * self.springs { self.unsettled + 1 } else { 0 };
        self.springs = distance;
    }

    /// Whether springs do not settle on this set.
    pub fn turns_for_ever(&self) -> bool {
        self.unsettled >= TURNS
    }

    /// Takes note of a correction with so many changes.
    pub fn note(&mut self, changes: f64) {
        (self.springs, self.unsettled) = (f64::INFINITY, 0);
        self.wary = changes > GROWTH * self.smallest;
        self.since = if changes < self.smallest { 0 } else { self.since + 1 };
        self.smallest = self.smallest.min(changes);
        if self.since >= SLOW && self.loose > 0.0 {
            self.tighten();
        }
    }

    /// Whether sets wander, however exactly they are solved.
    pub fn is_stuck(&self) -> bool {
        self.loose == 0.0 && self.since >= STUCK
    }

    /// More exactly for good.
    pub fn tighten(&mut self) {
        self.loose = if self.loose > LEAST { self.loose * TIGHTER } else { 0.0 };
        self.since = 0;
        self.history.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_that_turn_to_and_fro_are_found() {
        let mut exactness = Exactness::new(vec![true], LOOSE);
        let mut tell = |distances: &[f64]| {
            distances.iter().for_each(|&d| exactness.note_springs(d));
            exactness.turns_for_ever()
        };
        assert!(!tell(&[3.0, 2.5, 2.4, 1.0, 0.9, 0.8]));
        assert!(tell(&[0.7]));
        assert!(!tell(&[0.1]));
        assert!(tell(&[0.1; 3]));
        // Another set, another chance.
        exactness.note(5.0);
        assert!(!exactness.turns_for_ever());
    }

    #[test]
    fn sets_that_do_not_settle_are_solved_more_exactly_for_good() {
        let mut exactness = Exactness::new(vec![true], LOOSE);
        for changes in [50.0, 40.0, 45.0, 41.0, 51.0, 50.0, 48.0] {
            exactness.note(changes);
            assert_eq!((exactness.take_relative(), exactness.history.len()), (LOOSE, 1), "{changes}");
        }
        exactness.note(42.0);
        assert_eq!((exactness.take_relative(), exactness.history.len()), (LOOSE * TIGHTER, 0));
        // A large one counts for the next set alone.
        exactness.note(81.0);
        assert_eq!(exactness.take_relative(), LOOSE * TIGHTER * TIGHTER);
        assert_eq!(exactness.take_relative(), LOOSE * TIGHTER);
        (0..3).for_each(|_| exactness.tighten());
        // What is as exact as can be is not tried for ever.
        for sets in 0..20 {
            assert_eq!((exactness.take_relative(), exactness.history.len()), (0.0, sets));
            assert_eq!(exactness.is_stuck(), sets >= STUCK, "{sets}");
            exactness.note(70.0);
            exactness.history.push(vec![false]);
        }
        exactness.note(39.0);
        assert!(!exactness.is_stuck());
    }
}
