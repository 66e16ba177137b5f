//! The limit load: equilibria that do more and more work, until what they bear and what their mechanism takes are near.

use super::recorder::Recorder;
use super::{Failure, StudyError, Watcher, iterate};
use crate::monitor::events::Event;
use crate::monitor::timing::Timer;
use crate::newton::{Newton, Outcome};
use crate::record::rows::LimitLoad;
use crate::scene::Limit;

/// Each equilibrium does so many times the work of the one before.
const GROWTH: f64 = 6.0;
/// Where an equilibrium is not found, so much of the way to it is tried instead ...
const SHARE: f64 = 0.125;
/// ... so often.
const FALLS: usize = 3;
/// Equilibria at most: elastic parts that bear everything know no limit.
const MOST: u64 = 6;

/// Goes on until the bounds are as near as wanted; returns how it was given up, and the bounds. Collective.
pub(super) fn seek(
    limit: &Limit,
    newton: &mut Newton,
    recorder: &mut Recorder,
    timer: &Timer,
    watcher: &mut dyn Watcher,
) -> Result<(Option<Failure>, Option<LimitLoad>), StudyError> {
    let mut found: Option<LimitLoad> = recorder.rows.last().and_then(|row| row.limit_load);
    let mut falls = 0;
    loop {
        let at = newton.at();
        watcher.tell(Event::Increment(format!("equilibrium {} on the way to the limit load", at.number)));
        let outcome = iterate(newton, recorder, timer, watcher)?;
        if matches!(outcome, Outcome::Stalled | Outcome::LimitReached) && falls < FALLS {
            falls += 1;
            let reason = outcome.message().unwrap_or_default();
            watcher.tell(Event::Warning(format!("equilibrium {}: {reason}; one with less work is tried", at.number)));
            newton.fall_back(SHARE, found.map_or(1.0, |found| found.lower), timer);
            continue;
        }
        if outcome != Outcome::Converged {
            if newton.reached().is_none() {
                recorder.record(newton, timer);
            }
            return Ok((Some((at, outcome)), found));
        }
        let Some(row) = recorder.rows.last().and_then(|row| row.limit_load) else { return Ok((None, None)) };
        let best = found.map_or(row, |best| best.then(row, limit.tolerance));
        watcher.tell(Event::Limit(best));
        found = Some(best);
        if best.width() <= limit.tolerance {
            return Ok((None, Some(best.in_order())));
        }
        if at.number as u64 == MOST {
            return Ok((Some((at, Outcome::Unlimited)), found));
        }
        newton.press_on(GROWTH, timer);
    }
}
