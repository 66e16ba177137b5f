//! Discs in an active set: `|x_T| <= r(x_n)` for pairs `T` of unknowns, by a primal-dual active set.
//!
//! With the gradient's negative `v` (what slides), a flexibility `f > 0` and `z = x_T + v_T / f` the conditions of a disc are one
//! equation (Hueeber, Stadler and Wohlmuth, SIAM J. Sci. Comput. 30 (2008)):
//!
//! ```text
//! x_T = z  where |z| <= r  (it sticks: v_T = 0),      x_T = r z / |z|  elsewhere  (it slips)
//! ```
//!
//! Newton's method for the second one, with `d = z / |z|`, fixes the unknown along `d` at `r`, and leaves the one across, `y`, to a
//! spring: `v across d = c y` with the compliance `c = f (|z| / r - 1)`. Each set is a symmetric linear problem. The radius is a
//! constant, or grows with another unknown `x_n`; it is that of the set before, so that with the sets radii converge, too. That one
//! tells whether a slip goes on: the change of a radius would hide small slips. Where nothing presses (`r = 0`) the disc is a point.

use super::discs;

/// A pair goes on sticking or slipping this share of the radius beyond the border, so that rounding makes no pair come and go that is just
/// on it.
const ROUNDING: f64 = 1e-9;

/// Unknowns this share of the radius from the border are on it.
const BORDER: f64 = 1e-9;

/// A radius that moves what slides by this share of the tolerance is rounding.
const NOTHING: f64 = 1e-3;

/// A spring that gives way this many times as far as the matrix is soft. What has to balance should not hang on it.
const SOFT: f64 = 30.0;

/// A disc.
#[derive(Clone, Debug, PartialEq)]
pub struct Disc {
    /// The unknown that its radius grows with.
    pub normal: usize,
    /// Its unknowns; twice the same if it has one.
    pub entries: [usize; 2],
    /// Its radius: a constant, and a factor of the unknown that it grows with.
    pub radius: [f64; 2],
    /// How far its unknowns move the gradient: about the diagonal of the matrix.
    pub flexibility: f64,
}

/// What is known of the unknowns of a disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Slide {
    /// They are zero.
    Open,
    /// They are free.
    Stick,
    /// The one along the slip is at the border, the one across hangs on a spring.
    Slip {
        /// Unit vector along the slip.
        direction: [f64; 2],
        /// The radius.
        radius: f64,
        /// Of the spring.
        compliance: f64,
    },
}

impl Slide {
    /// Sets with the same names are the same set.
    fn name(self) -> [bool; 2] {
        match self {
            Self::Open => [false, false],
            Self::Stick => [true, false],
            Self::Slip { .. } => [true, true],
        }
    }
}

/// The discs of a rank, and what is known of each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Slides {
    /// The discs.
    pub discs: Vec<Disc>,
    /// Of each.
    states: Vec<Slide>,
    /// Whether it has turned round.
    turned: Vec<bool>,
}

impl Disc {
    /// Its numbers in a vector.
    fn of(&self, x: &[f64]) -> [f64; 2] {
        discs::pair_of(self.entries, x)
    }

    /// Writes its numbers into a vector.
    fn put(&self, pair: [f64; 2], x: &mut [f64]) {
        discs::put_pair(self.entries, x, pair);
    }

    /// Whether it has two unknowns.
    fn is_plane(&self) -> bool {
        self.entries[0] != self.entries[1]
    }

    /// The unknown across a slip.
    fn across(&self, direction: [f64; 2], x: &[f64]) -> f64 {
        let (across, x) = (across(direction), self.of(x));
        across[0] * x[0] + across[1] * x[1]
    }

    /// Its radius where the unknown it grows with has this value.
    pub fn radius(&self, x: &[f64]) -> f64 {
        let [constant, factor] = self.radius;
        constant + factor * f64::max(0.0, x[self.normal])
    }

    /// What the unknowns and what slides tell of it, see [`Slides::next`].
    fn judge(&self, (state, turned): (Slide, bool), x: &[f64], v: &[f64], [tolerance, doubt]: [f64; 2]) -> Slide {
        let radius = self.radius(x);
        if radius <= NOTHING * tolerance / self.flexibility {
            return Slide::Open;
        }
        let ([a, b], [s, t]) = (self.of(x), self.of(v));
        let z = [a + s / self.flexibility, b + t / self.flexibility];
        let size = z[0].hypot(z[1]);
        // What slips was put on the circle of before: it has not come off it because the next one is larger.
        let border = if let Slide::Slip { radius: before, .. } = state { before } else { radius };
        let margin = tolerance / self.flexibility;
        let outside = size > border * (1.0 + ROUNDING) + margin;
        let slips = match state {
            // What slides against its friction turns round once; then it sticks first.
            Slide::Slip { direction, .. } if s * direction[0] + t * direction[1] < -doubt => outside && !turned,
            Slide::Slip { .. } => size > border * (1.0 - ROUNDING) - margin,
            Slide::Open => size > border,
            Slide::Stick => outside,
        };
        if !slips || size == 0.0 {
            return Slide::Stick;
        }
        let compliance = self.flexibility * f64::max(0.0, size / border - 1.0);
        Slide::Slip { direction: z.map(|z| z / size), radius, compliance }
    }
}

impl Slides {
    /// Discs of which nothing is known: all are open.
    pub fn open(discs: Vec<Disc>) -> Self {
        let states = vec![Slide::Open; discs.len()];
        Self::in_states(discs, states)
    }

    /// Discs as unknowns `x` and what slides, `v`, tell.
    pub fn told(discs: Vec<Disc>, x: &[f64], v: &[f64]) -> Self {
        let states = discs.iter().map(|disc| disc.judge((Slide::Open, false), x, v, [0.0; 2])).collect();
        Self::in_states(discs, states)
    }

    fn in_states(discs: Vec<Disc>, states: Vec<Slide>) -> Self {
        let turned = vec![false; discs.len()];
        Self { discs, states, turned }
    }

    /// The radius of each disc at some unknowns.
    pub fn radii(&self, x: &[f64]) -> Vec<f64> {
        self.discs.iter().map(|disc| disc.radius(x)).collect()
    }

    /// Moves what slips along the rays of its discs to these radii: in the difference `x` of unknowns to some `start`.
    pub fn carry(&self, start: &[f64], x: &mut [f64], radii: &[f64]) {
        for ((disc, state), radius) in self.iter().zip(radii) {
            let ([a, b], [s, t]) = (disc.of(start), disc.of(x));
            let size = (a + s).hypot(b + t);
            if matches!(state, Slide::Slip { .. }) && size > 0.0 {
                let stretch = radius / size - 1.0;
                disc.put([s + stretch * (a + s), t + stretch * (b + t)], x);
            }
        }
    }

    /// The discs of these radii, for the difference of unknowns to some `start`.
    pub fn around(&self, start: &[f64], radii: &[f64]) -> Vec<discs::Disc> {
        let of = |(disc, &radius): (&Disc, &f64)| {
            let centre = disc.of(start).map(|x| -x);
            discs::Disc { entries: disc.entries, centre, radius }
        };
        self.discs.iter().zip(radii).map(of).collect()
    }

    /// What a change of radii moves the gradient by, at the first unknown of each disc.
    pub fn change(&self, radii: &[f64], next: &[f64], n: usize) -> Vec<f64> {
        let mut change = vec![0.0; n];
        for ((disc, radius), next) in self.discs.iter().zip(radii).zip(next) {
            change[disc.entries[0]] = disc.flexibility * (next - radius);
        }
        change
    }

    /// Follows unknowns in discs of these radii: what is on the border slips along them.
    pub fn settle(&mut self, x: &[f64], radii: &[f64]) {
        for ((disc, state), &radius) in self.discs.iter().zip(&mut self.states).zip(radii) {
            let [a, b] = disc.of(x);
            let size = a.hypot(b);
            *state = match radius {
                0.0 => Slide::Open,
                _ if size < (1.0 - BORDER) * radius => Slide::Stick,
                _ => Slide::Slip { direction: [a / size, b / size], radius, compliance: 0.0 },
            };
        }
    }

    /// Follows a face of given radii, for differences of unknowns: what is pressed against its circle hangs on the circle's curvature, and
    /// does not move along its normal.
    pub fn press(&mut self, places: &[discs::Place]) {
        for (state, place) in self.states.iter_mut().zip(places) {
            *state = match *place {
                discs::Place::Inside => Slide::Stick,
                discs::Place::Point | discs::Place::Leaving { .. } => Slide::Open,
                discs::Place::Sliding { normal, curvature } => {
                    Slide::Slip { direction: normal, radius: 0.0, compliance: curvature }
                }
            };
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.discs.is_empty()
    }

    fn iter(&self) -> impl Iterator<Item = (&Disc, Slide)> {
        self.discs.iter().zip(self.states.iter().copied())
    }

    /// Marks the unknowns that need not be what [`Slides::fix`] makes them.
    pub fn mark(&self, kept: &mut [bool]) {
        for (disc, state) in self.iter() {
            let free = match state {
                Slide::Open => false,
                Slide::Stick => true,
                Slide::Slip { .. } => disc.is_plane(),
            };
            disc.entries.into_iter().for_each(|entry| kept[entry] = free);
        }
    }

    /// Of marked unknowns those that do not move: none of discs that slip.
    pub fn held(&self, kept: &[bool]) -> Vec<bool> {
        let mut held = kept.to_vec();
        for (disc, ..) in self.slipping() {
            disc.entries.into_iter().for_each(|entry| held[entry] = false);
        }
        held
    }

    /// Open discs whose unknowns are kept stick.
    pub fn adopt(&mut self, kept: &[bool]) {
        for (disc, state) in self.discs.iter().zip(&mut self.states) {
            if *state == Slide::Open && kept[disc.entries[0]] {
                *state = Slide::Stick;
            }
        }
    }

    /// Unknowns of discs of two that slip, with the unit vector across, and whether the spring there is soft.
    pub fn across(&self) -> impl Iterator<Item = ([usize; 2], [f64; 2], bool)> {
        self.slipping().map(|(disc, direction, compliance)| {
            (disc.entries, across(direction), compliance > SOFT * disc.flexibility)
        })
    }

    /// Those of two unknowns that slip, with the direction and the compliance of the spring across.
    fn slipping(&self) -> impl Iterator<Item = (&Disc, [f64; 2], f64)> {
        self.iter().filter_map(|(disc, state)| match state {
            Slide::Slip { direction, compliance, .. } if disc.is_plane() => Some((disc, direction, compliance)),
            _ => None,
        })
    }

    /// Puts unknowns that slip at the radius along their slips, with nothing across: directions that have just followed them have taken
    /// that in.
    pub fn align(&self, x: &mut [f64]) {
        for (disc, state) in self.iter() {
            if let Slide::Slip { direction, radius, .. } = state {
                disc.put(direction.map(|d| radius * d), x);
            }
        }
    }

    /// Gives unknowns their fixed parts: none where open, the radius along the slip.
    pub fn fix(&self, x: &mut [f64]) {
        for (disc, state) in self.iter() {
            match state {
                Slide::Open => disc.put([0.0; 2], x),
                Slide::Stick => {}
                Slide::Slip { direction, radius, .. } => {
                    let (y, across) = (disc.across(direction, x), across(direction));
                    disc.put(std::array::from_fn(|k| radius * direction[k] + y * across[k]), x);
                }
            }
        }
    }

    /// The fixed parts alone.
    pub fn fixed(&self, n: usize) -> Vec<f64> {
        let mut x = vec![0.0; n];
        self.fix(&mut x);
        x
    }

    /// `y += factor C x` with the compliance `C` of the springs.
    pub fn add_compliance(&self, factor: f64, x: &[f64], y: &mut [f64]) {
        for (disc, direction, compliance) in self.slipping() {
            let (force, across) = (factor * compliance * disc.across(direction, x), across(direction));
            let [a, b] = disc.of(y);
            disc.put([a + force * across[0], b + force * across[1]], y);
        }
    }

    /// Scales a vector by the share of the matrix that springs leave to the rest: `f / (f + c)` across slips.
    pub fn soften(&self, x: &mut [f64]) {
        self.give_way(|disc| disc.flexibility, x);
    }

    /// Divides by 1 + c / size across slips: the inverse of a matrix of this size with springs, times the size.
    pub fn relax(&self, size: f64, x: &mut [f64]) {
        self.give_way(|_| size, x);
    }

    /// `f / (f + c)` across slips.
    fn give_way(&self, flexibility: impl Fn(&Disc) -> f64, x: &mut [f64]) {
        for (disc, direction, compliance) in self.slipping() {
            let taken = compliance / (flexibility(disc) + compliance) * disc.across(direction, x);
            let ([a, b], across) = (disc.of(x), across(direction));
            disc.put([a - taken * across[0], b - taken * across[1]], x);
        }
    }

    /// Adds to `z` what springs make of a gradient `r`: `c / (f + c)^2` times it. Between two softened vectors and the rest's inverse
    /// that is an inverse of the sum: the stiffness scaling of constraints that give way.
    pub fn add_springs(&self, r: &[f64], z: &mut [f64]) {
        for (disc, direction, compliance) in self.slipping() {
            let sum = disc.flexibility + compliance;
            let added = compliance / (sum * sum) * disc.across(direction, r);
            let ([a, b], across) = (disc.of(z), across(direction));
            disc.put([a + added * across[0], b + added * across[1]], z);
        }
    }

    /// The states that the unknowns and what slides, `v`, tell. A change between sticking and slipping takes more than `tolerance` of
    /// what slides, and more than `doubt` where it slides against its friction: what sticks by mistake comes loose again from its
    /// border only, one row of nodes with each set. So what is beyond the other side of its disc slips there at once; but once only, for
    /// bodies that friction alone holds would be thrown to and fro.
    pub fn next(&self, x: &[f64], v: &[f64], [tolerance, doubt]: [f64; 2]) -> Vec<Slide> {
        let judge =
            |((disc, state), &turned): ((&Disc, Slide), &bool)| disc.judge((state, turned), x, v, [tolerance, doubt]);
        self.iter().zip(&self.turned).map(judge).collect()
    }

    /// Takes other states on, and notes what turns round.
    pub fn take(&mut self, next: Vec<Slide>) {
        for ((turned, state), next) in self.turned.iter_mut().zip(&self.states).zip(&next) {
            if let (Slide::Slip { direction: [a, b], .. }, Slide::Slip { direction: [s, t], .. }) = (state, next) {
                *turned |= a * s + b * t < 0.0;
            }
        }
        self.states = next;
    }

    /// Compares with other states, into vectors of zeros, at the first unknown of each disc: 1 into `changed` where the name is another;
    /// where it slips as before what another radius moves the gradient by into `fixed`, and how far unknowns are from what the other
    /// state says besides, as a gradient, into `hung`.
    pub fn compare(&self, next: &[Slide], x: &[f64], [changed, fixed, hung]: [&mut [f64]; 3]) {
        for ((disc, state), next) in self.iter().zip(next) {
            changed[disc.entries[0]] = f64::from(next.name() != state.name());
            let Slide::Slip { direction, radius, compliance } = *next else { continue };
            let (here, beside) = (disc.of(x), disc.across(direction, x));
            let along = here[0] * direction[0] + here[1] * direction[1];
            let Slide::Slip { radius: before, .. } = state else { continue };
            fixed[disc.entries[0]] = disc.flexibility * (radius - before);
            let across = (disc.flexibility + compliance) * beside;
            hung[disc.entries[0]] = (disc.flexibility * (along - before)).hypot(across);
        }
    }

    /// Follows the radii of other states of the same names: the matrix stays the same.
    pub fn shift(&mut self, next: &[Slide]) {
        for (state, next) in self.states.iter_mut().zip(next) {
            if let (Slide::Slip { radius, .. }, Slide::Slip { radius: to, .. }) = (state, *next) {
                *radius = to;
            }
        }
    }

    /// What tells this set from others.
    pub fn names(&self) -> impl Iterator<Item = bool> {
        self.states.iter().flat_map(|state| state.name())
    }
}

/// The unit vector across another one.
fn across([a, b]: [f64; 2]) -> [f64; 2] {
    [-b, a]
}

#[cfg(test)]
mod tests;
