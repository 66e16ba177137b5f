//! How much of the secant stiffness stands for the tangent.
//!
//! The tangent of a yielding point is `2 mu s (I_dev - c N x N)` plus its bulk part, with `s` the ratio of stress to trial stress;
//! the secant stiffness is the same without `N x N`. As `Psi` is concave as a function of the squared trial stress, its model
//! with the secant stiffness lies above it: a full step with it lowers `J` wherever it starts, if slowly (Kacanov's method; Han,
//! Jensen, Shimansky 1997). Newton's step is good only where strains change by less than they are. Where rigid bodies begin to
//! flow they are not, and a line search cuts step after step. Then the stiffness goes towards the secant one, as far as full
//! steps need, and back while they go on.

/// A step cut below this length was too long: a little more of the secant stiffness is taken ...
const SHORT: f64 = 0.25;
/// ... beginning with this share, ...
const FIRST: f64 = 0.1;
/// ... and ten times as much after each more such step.
const GROWTH: f64 = 10.0;
/// What a step that was not cut leaves of it.
const DECAY: f64 = 0.3;
/// Less than this is none.
const LEAST: f64 = 0.01;

/// Share of the secant stiffness after a step that was taken with the share `now` and cut to `damping`.
pub fn next(now: f64, damping: f64) -> f64 {
    if damping < SHORT {
        return (GROWTH * now).clamp(FIRST, 1.0);
    }
    let less = DECAY * now;
    if less < LEAST { 0.0 } else { less }
}

#[cfg(test)]
mod tests {
    use super::next;

    #[test]
    fn comes_where_steps_are_cut_and_goes_where_they_are_not() {
        assert_eq!((next(0.0, 1.0), next(0.0, 0.5)), (0.0, 0.0));
        let up: Vec<f64> = [0.2, 0.01, 1e-3]
            .iter()
            .scan(0.0, |s, &d| {
                *s = next(*s, d);
                Some(*s)
            })
            .collect();
        assert_eq!(up, [0.1, 1.0, 1.0]);
        let mut share = 1.0;
        let steps = (1..).find(|_| {
            share = next(share, 1.0);
            share == 0.0
        });
        assert_eq!(steps, Some(4));
    }
}
