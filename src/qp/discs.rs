//! Discs: pairs of entries with |x - c| <= r, beside the bounds of [`super::feasible`].
//!
//! A multiplier of friction is of this kind: two tangential forces whose resultant is at most r (Tresca). With n = (x - c)
//! / |x - c| the outward normal of a disc whose circle x is on, the projected gradient is g - min(n'g, 0) n [Dostal and
//! Kozubek, Math. Program. 135 (2012)]. Where n'g < 0 that is the tangential part: the entries are pressed against the
//! circle and may *slide* along it. The literature counts this part as chopped, since no straight step follows it. Here it
//! is free: a path along the circle has, beside the curvature of the function, -n'g / r per square of its length, and
//! [`super::mprgp`] takes conjugate gradient steps on the tangent with that (the Hessian of the Lagrangian).
//!
//! Rounding: nothing is *exactly* on a circle. A pair is on it if |x - c| >= r - 8 eps (r + |c|), which is recomputed from x
//! wherever it is needed. [`Disc::confine`] puts pairs there to that precision, and pairs that a move leaves inside by its
//! rounding as well; those that it leaves inside are well below the threshold. So the test is as sure as that of a bound. A
//! radius below 64 eps |c| cannot be told from zero, and counts as zero: then the pair is the centre.

use super::feasible::{Parts, SNAP};

/// A pair is on the circle up to this many roundings of the numbers that its distance is computed from.
const ON: f64 = 8.0 * f64::EPSILON;
/// Radii below this many times the size of the centre count as zero.
const POINT: f64 = 64.0 * f64::EPSILON;

/// The pairs of entries within a distance of a centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// The indices of the two entries, which have no lower bound; twice the same for an interval.
    pub entries: [usize; 2],
    /// The centre.
    pub centre: [f64; 2],
    /// The radius: not negative, perhaps 0 or infinite.
    pub radius: f64,
}

/// A pair of entries of a vector; the same index twice is an interval, whose second number is none.
pub(super) fn pair_of([i, j]: [usize; 2], x: &[f64]) -> [f64; 2] {
    [x[i], if i == j { 0.0 } else { x[j] }]
}

/// Sets a pair of entries of a vector; of an interval the first.
pub(super) fn put_pair(entries: [usize; 2], x: &mut [f64], pair: [f64; 2]) {
    entries.into_iter().zip(pair).rev().for_each(|(i, value)| x[i] = value);
}

/// Where a pair is in its disc, and where the gradient presses it to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// Off the circle.
    Inside,
    /// The disc is a point.
    Point,
    /// On the circle, with a gradient step that goes inside.
    Leaving {
        /// The outward normal n.
        normal: [f64; 2],
    },
    /// On the circle and pressed against it.
    Sliding {
        /// The outward normal n.
        normal: [f64; 2],
        /// What the circle adds to the curvature along the tangent, -n'g / r.
        curvature: f64,
    },
}

impl Disc {
    /// The pair's entries of a vector.
    fn of(&self, x: &[f64]) -> [f64; 2] {
        pair_of(self.entries, x)
    }

    /// Sets the pair's entries of a vector.
    fn put(&self, x: &mut [f64], pair: [f64; 2]) {
        put_pair(self.entries, x, pair);
    }

    /// x - c.
    fn offset(&self, x: &[f64]) -> [f64; 2] {
        difference(self.of(x), self.centre)
    }

    /// Whether the radius is zero up to rounding.
    fn is_point(&self) -> bool {
        self.radius <= POINT * length(self.centre)
    }

    /// How precisely a pair can be on the circle.
    fn rounding(&self) -> f64 {
        ON * (self.radius + length(self.centre))
    }

    /// Whether the pair is on the circle.
    pub fn is_active(&self, x: &[f64]) -> bool {
        self.is_point() || length(self.offset(x)) >= self.radius - self.rounding()
    }

    /// Moves the pair to the nearest point of the disc. Within the rounding of `scale` inside the circle counts as on it; NaN
    /// stays NaN.
    pub fn confine(&self, x: &mut [f64], scale: f64) {
        let offset = self.offset(x);
        let distance = length(offset);
        if distance.is_nan() {
            return;
        }
        if self.is_point() {
            return self.put(x, self.centre);
        }
        let scale = scale + length(self.centre);
        let is_inside = distance == 0.0 || distance < self.radius - SNAP * scale;
        if !is_inside && (distance - self.radius).abs() > self.rounding() {
            self.put(x, plus(self.centre, self.radius / distance, offset));
        }
    }

    /// Where the pair is.
    pub fn place(&self, x: &[f64], gradient: &[f64]) -> Place {
        if self.is_point() {
            return Place::Point;
        }
        if !self.is_active(x) {
            return Place::Inside;
        }
        let offset = self.offset(x);
        let normal = offset.map(|v| v / length(offset));
        let slope = dot(normal, self.of(gradient));
        if slope < 0.0 { Place::Sliding { normal, curvature: -slope / self.radius } } else { Place::Leaving { normal } }
    }

    /// The largest step with x - step p in the disc; for a sliding pair, which is on the tangent, as far from the circle's
    /// point as the radius.
    pub fn reach(&self, place: Place, x: &[f64], p: &[f64]) -> f64 {
        let (offset, p) = (self.offset(x), self.of(p));
        let square = dot(p, p);
        if square == 0.0 || place == Place::Point {
            return f64::INFINITY;
        }
        if let Place::Sliding { normal, .. } = place {
            let (way, p) = (tangential(normal, offset), tangential(normal, p));
            let back = way * p.signum();
            return if p == 0.0 { f64::INFINITY } else { ((self.radius + back) / p.abs()).max(0.0) };
        }
        // The larger root of |x - c - step p|^2 = r^2, without cancellation.
        let (distance, size) = (length(offset), square.sqrt());
        let (inwards, room) = (dot(offset, p) / size, (self.radius - distance) * (self.radius + distance));
        if room == f64::INFINITY {
            return room;
        }
        let root = (inwards * inwards + room).max(0.0).sqrt();
        let way = if inwards > 0.0 { inwards + root } else { room.max(0.0) / (root - inwards) };
        if way > 0.0 { way / size } else { 0.0 }
    }

    /// Splits the pair's gradient at its place, see [`super::feasible::FeasibleSet::split`].
    pub fn split(&self, place: Place, x: &[f64], gradient: &[f64], step: f64, parts: &mut Parts) {
        const ZERO: [f64; 2] = [0.0; 2];
        let g = self.of(gradient);
        let [mut free, mut chopped, mut reduced, mut tangent] = [ZERO; 4];
        match place {
            Place::Inside => {
                free = g;
                let offset = self.offset(x);
                let aim = plus(offset, -step, g);
                let distance = length(aim);
                let within = distance <= self.radius;
                reduced = if within { g } else { plus(offset, -self.radius / distance, aim).map(|v| v / step) };
            }
            Place::Point => {}
            Place::Leaving { normal } => chopped = plus(g, -dot(normal, g).min(0.0), normal),
            Place::Sliding { normal, curvature } => {
                tangent = plus(ZERO, tangential(normal, g), [-normal[1], normal[0]]);
                free = tangent;
                reduced = tangent.map(|v| v / (1.0 + step * curvature));
                // On the way along the tangent the gradient may turn inwards.
                chopped = normal.map(|n| n * dot(normal, g).max(0.0));
            }
        }
        self.put(&mut parts.free, free);
        self.put(&mut parts.chopped, chopped);
        self.put(&mut parts.reduced, reduced);
        self.put(&mut parts.tangent, tangent);
    }

    /// `hp = hp + k t t'p` on the tangent t of a sliding pair, with k its curvature.
    pub fn bend(&self, place: Place, p: &[f64], hp: &mut [f64]) {
        if let Place::Sliding { normal, curvature } = place {
            let along = curvature * tangential(normal, self.of(p));
            self.put(hp, plus(self.of(hp), along, [-normal[1], normal[0]]));
        }
    }

    /// Divides the tangent of a pair that slides by 1 + k / size, with k the circle's curvature: a diagonal preconditioner for a
    /// Hessian of that size with what [`Disc::bend`] adds.
    pub fn relax(&self, place: Place, size: f64, z: &mut [f64]) {
        if let Place::Sliding { normal, curvature } = place {
            let along = tangential(normal, self.of(z)) / (1.0 + curvature / size);
            self.put(z, [-normal[1] * along, normal[0] * along]);
        }
    }

    /// `z = x - old`. Between two points of the circle the difference is a chord, perpendicular to the mean of their offsets;
    /// what is not is rounding, which the large gradient across the circle would magnify.
    pub fn difference(&self, x: &[f64], old: &[f64], z: &mut [f64]) {
        let mut chord = difference(self.of(x), self.of(old));
        let middle = plus(self.offset(x), 1.0, self.offset(old));
        let square = dot(middle, middle);
        if self.is_active(x) && self.is_active(old) && square > self.radius * self.radius {
            chord = plus(chord, -dot(chord, middle) / square, middle);
        }
        self.put(z, chord);
    }
}

/// The component along the tangent (-n_2, n_1).
fn tangential(normal: [f64; 2], v: [f64; 2]) -> f64 {
    normal[0] * v[1] - normal[1] * v[0]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn length(a: [f64; 2]) -> f64 {
    dot(a, a).sqrt()
}

fn difference(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

/// a + s b.
fn plus(a: [f64; 2], s: f64, b: [f64; 2]) -> [f64; 2] {
    [a[0] + s * b[0], a[1] + s * b[1]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::qp::feasible::FeasibleSet;
    use crate::qp::tests::dense::Random;

    fn set(disc: Disc) -> FeasibleSet {
        FeasibleSet::with_discs(vec![f64::NEG_INFINITY; 2], vec![disc])
    }

    fn disc(centre: [f64; 2], radius: f64) -> Disc {
        Disc { entries: [0, 1], centre, radius }
    }

    /// A disc of some size, and a point in it or on its circle.
    fn random(random: &mut Random, on: bool) -> (Disc, [f64; 2]) {
        let scale = 10_f64.powf(6.0 * random.next());
        let disc = disc([scale * random.next(), scale * random.next()], scale * random.next().abs());
        let mut x = plus(disc.centre, disc.radius, [0.6 * random.next(), 0.6 * random.next()]);
        if on {
            x = [x[0] + scale * random.next().signum() * 2.0, x[1]];
            disc.confine(&mut x, 0.0);
        }
        (disc, x)
    }

    #[test]
    fn a_step_of_the_reach_meets_the_circle() {
        let mut numbers = Random::new(61);
        for k in 0..4000 {
            let (disc, mut x) = random(&mut numbers, k % 2 == 0);
            let size = disc.radius * 10_f64.powf(4.0 * numbers.next());
            let p = [size * numbers.next(), size * numbers.next()];
            let place = if disc.is_active(&x) { Place::Leaving { normal: [1.0, 0.0] } } else { Place::Inside };
            assert_eq!(place == Place::Inside, k % 2 == 1);
            let step = disc.reach(place, &x, &p);
            let half = plus(x, -0.5 * step, p);
            assert!(step >= 0.0 && length(disc.offset(&half)) <= disc.radius + disc.rounding());
            set(disc).advance(&mut x, step, &p);
            assert!(disc.is_active(&x), "{disc:?} {x:?}");
            assert!(length(disc.offset(&x)) <= disc.radius + disc.rounding());
            // Once more changes nothing.
            let before = x;
            set(disc).project(&mut x);
            assert_eq!(x, before);
        }
    }

    /// The projected gradient is the limit of (x - P(x - s g)) / s, and the reduced one is that with s.
    #[test]
    fn parts_are_what_short_projected_steps_do() {
        let mut numbers = Random::new(62);
        let projected = |disc: &Disc, x: [f64; 2], step: f64, g: [f64; 2]| {
            let mut moved = x;
            set(*disc).advance(&mut moved, step, &g);
            difference(x, moved).map(|v| v / step)
        };
        for k in 0..2000 {
            let (disc, x) = random(&mut numbers, k % 2 == 0);
            let g = [numbers.next(), numbers.next()];
            let mut parts = Parts::new(2);
            let step = disc.radius * (1.0 + numbers.next());
            set(disc).split(&x, &g, step, &mut parts);
            let of = |part: &[f64]| [part[0], part[1]];
            let (free, chopped) = (of(&parts.free), of(&parts.chopped));
            let found = projected(&disc, x, 1e-5 * disc.radius, g);
            // A pair that leaves at a small angle meets the circle again, as it should.
            let sum = plus(free, 1.0, chopped);
            assert!(length(difference(sum, found)) < 1e-4, "{sum:?} {found:?} {:?}", parts.places);
            match parts.places[0] {
                Place::Inside => {
                    assert_eq!((free, chopped), (g, [0.0; 2]));
                    assert!(length(difference(of(&parts.reduced), projected(&disc, x, step, g))) < 1e-9);
                }
                Place::Leaving { .. } => assert_eq!((free, chopped), ([0.0; 2], g)),
                Place::Sliding { normal, curvature } => {
                    assert_eq!((parts.tangent[0], parts.tangent[1], chopped), (free[0], free[1], [0.0; 2]));
                    assert!(dot(normal, free).abs() < 1e-15 && curvature > 0.0);
                    // The curvature is that of f = g'x along the circle: f'' = -n'g / r.
                    let along = [-normal[1], normal[0]];
                    let on =
                        |angle: f64| disc.radius * dot(g, plus(normal.map(|n| n * angle.cos()), angle.sin(), along));
                    let second = (on(1e-3) - 2.0 * on(0.0) + on(-1e-3)) / (1e-6 * disc.radius * disc.radius);
                    let mut hp = [0.0; 2];
                    disc.bend(parts.places[0], &along, &mut hp);
                    assert!((dot(hp, along) - second).abs() < 1e-5 / disc.radius, "{hp:?} {second}");
                }
                Place::Point => panic!("the radius is not zero"),
            }
        }
    }

    #[test]
    fn differences_on_a_circle_are_chords() {
        let disc = disc([1e3, -2e3], 0.7);
        for (angle, small) in [(1.0, 1e-9), (2.0, 1e-3), (3.0, 1.0)] {
            let on = |angle: f64| plus(disc.centre, disc.radius, [angle.cos(), angle.sin()]);
            let (old, x, mut z) = (on(angle), on(angle + small), [0.0; 2]);
            disc.difference(&x, &old, &mut z);
            let sine = f64::sin(0.5 * small);
            let across = dot(z, [angle.cos(), angle.sin()]);
            // -2 r sin^2 of half the angle, which is 1e-19 where x itself is rounded to 1e-13.
            assert!((across + 2.0 * disc.radius * sine * sine).abs() < 1e-12 * small + 1e-12 * length(z), "{across}");
        }
    }

    #[test]
    fn points_far_circles_and_no_numbers() {
        for radius in [0.0, 1e-15] {
            let point = disc([3.0, 4.0], radius);
            let mut x = [5.0, 6.0];
            set(point).project(&mut x);
            assert_eq!((x, point.place(&x, &[1.0, 1.0])), ([3.0, 4.0], Place::Point));
            set(point).advance(&mut x, 1.0, &[1.0, 1.0]);
            assert_eq!(x, [3.0, 4.0]);
        }
        for radius in [1e200, f64::INFINITY] {
            let far = disc([3.0, 4.0], radius);
            let mut x = [5.0, 6.0];
            for p in [[1.0, 2.0], [-1.0, 2.0], [0.0, 0.0]] {
                assert!(far.reach(Place::Inside, &x, &p) > 1e190);
                set(far).advance(&mut x, 0.0, &p);
            }
            assert_eq!((x, far.place(&x, &[1.0, 1.0])), ([5.0, 6.0], Place::Inside));
        }
        for radius in [0.0, 1.0, f64::INFINITY] {
            let mut x = [0.5, 0.5];
            set(disc([0.0; 2], radius)).advance(&mut x, f64::NAN, &[1.0, 1.0]);
            assert!(x[0].is_nan());
        }
    }
}
