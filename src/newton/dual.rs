//! The dual problem in the words of the QP solvers: inner products, and `F`, `P`, `M` as one quadratic function, on all
//! rows ([`WholeDual`]) or on those of an active set ([`DualFace`]).

use crate::constraint::Constraints;
use crate::constraint::law::Law;
use crate::feti::coarse::Coarse;
use crate::feti::coarse::face::CoarseFace;
use crate::feti::coarse::motion;
use crate::feti::coarse::projector::Projector;
use crate::feti::coarse::sliding::{Across, Sliding};
use crate::feti::dual::operator::DualOperator;
use crate::feti::dual::space::RowSpace;
use crate::feti::preconditioner::Preconditioner;
use crate::monitor::timing::Timer;
use crate::qp::active_set;
use crate::qp::feasible::Face;
use crate::qp::quadratic::{Quadratic, Space};
use crate::qp::slides::Slides;

/// Inner products of multipliers.
pub struct Multipliers<'a>(pub &'a RowSpace<'a>, pub &'a Timer);

impl Space for Multipliers<'_> {
    fn dots(&self, pairs: &[(&[f64], &[f64])]) -> Vec<f64> {
        self.1.time("inner products", || self.0.dots(pairs))
    }

    fn minimum(&self, mine: f64) -> f64 {
        self.1.time("inner products", || -self.0.maximum(-mine))
    }
}

/// `F` and the preconditioner at one tangent, and the coarse problem.
pub struct Dual<'s, 'a> {
    /// `F`.
    pub operator: &'s mut DualOperator<'a>,
    /// `G`, and motions of bodies.
    pub coarse: &'s Coarse<'a>,
    /// `M`.
    pub preconditioner: Option<&'s mut Preconditioner<'a>>,
    /// Inner products of multipliers.
    pub space: &'s RowSpace<'s>,
    /// Where the time goes.
    pub timer: &'s Timer,
    /// Called after each application of F with the number so far.
    pub alive: &'s dyn Fn(usize),
}

impl<'a> Dual<'_, 'a> {
    /// The same for a shorter while.
    pub fn reborrow(&mut self) -> Dual<'_, 'a> {
        Dual { operator: self.operator, preconditioner: self.preconditioner.as_deref_mut(), ..*self }
    }

    /// From now on the preconditioner scales the kept rows only.
    pub fn restrict_scaling(&mut self, constraints: &Constraints, kept: &[bool]) {
        if let Some(preconditioner) = &mut self.preconditioner {
            self.timer.time("scaling", || preconditioner.restrict(constraints, |row| kept[row]));
        }
    }

    /// `y = F x`.
    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.timer.time("dual operator", || self.operator.apply(x, y));
        (self.alive)(self.operator.applications());
    }

    /// `z = M r`; false if there is no preconditioner.
    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> bool {
        let Some(preconditioner) = &mut self.preconditioner else { return false };
        let operator = &self.operator;
        self.timer.time("preconditioner", || operator.precondition(r, z, |r, z| preconditioner.apply(r, z)));
        true
    }

    /// `z = M r` for rows of a face on which slips hang on springs; false if there is no preconditioner.
    fn precondition_on(&mut self, rows: &CoarseFace, slides: &Slides, r: &[f64], z: &mut [f64]) -> bool {
        if slides.is_empty() {
            return self.precondition(r, z);
        }
        let mut soft = r.to_vec();
        slides.soften(&mut soft);
        let is_there = self.precondition(&soft, z);
        if is_there {
            rows.mask(z);
            slides.soften(z);
            slides.add_springs(r, z);
        }
        is_there
    }

    /// Contributions of each own subdomain to `x'x` and `x'r`, to the products of `x` with each of `against`, and to those of
    /// `pairs`; and the number of products.
    fn partial(&self, (x, r): (&[f64], &[f64]), against: &[&[f64]], pairs: &[(&[f64], &[f64])]) -> (Vec<f64>, usize) {
        let mut all = vec![(x, x), (x, r)];
        all.extend(against.iter().map(|other| (x, *other)));
        all.extend(pairs);
        (self.timer.time("inner products", || self.space.partial(&all)), all.len())
    }
}

/// The dual problem on all rows, for a solver that wants an orthogonal projector. On faces it is preconditioned like [`DualFace`].
pub struct WholeDual<'s, 'a> {
    dual: Dual<'s, 'a>,
    /// `P`.
    projector: Projector<'s, 'a>,
    /// The rows of B.
    constraints: &'s Constraints,
    /// What discs of friction do on the face.
    slides: Slides,
    /// The rows of the face.
    rows: Option<CoarseFace>,
}

impl<'s, 'a> WholeDual<'s, 'a> {
    /// With discs of friction of which nothing need be known. No face is entered yet.
    pub fn new(dual: Dual<'s, 'a>, projector: Projector<'s, 'a>, constraints: &'s Constraints, slides: Slides) -> Self {
        Self { dual, projector, constraints, slides, rows: None }
    }
}

impl Quadratic for WholeDual<'_, '_> {
    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.dual.apply(x, y);
    }

    fn project(&mut self, x: &mut [f64]) {
        self.dual.timer.time("coarse problem", || self.projector.project(x));
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> bool {
        self.dual.precondition(r, z)
    }

    fn enter(&mut self, face: &Face) {
        let mut slides = self.slides.clone();
        slides.press(&face.places);
        let mut kept = face.free.clone();
        slides.mark(&mut kept);
        let Dual { coarse, space, timer, .. } = self.dual;
        let is_known = self.rows.as_ref().is_some_and(|rows| rows.kept() == kept) && slides == self.slides;
        if space.maximum(f64::from(!is_known)) == 0.0 {
            return;
        }
        self.dual.restrict_scaling(self.constraints, &kept);
        let across = sliding(&slides);
        self.rows = Some(timer.time("coarse set-up", || match &self.rows {
            Some(rows) => rows.with(coarse, space, kept, across),
            None => CoarseFace::sliding(coarse, kept, across),
        }));
        self.slides = slides;
    }

    /// With `L` and `P = I - L G` of the face: `P M P' + L G G' L' / penalty`. The second term is for what violates equilibrium. Without
    /// a preconditioner `M` is 1 / size.
    fn precondition_on_face(&mut self, [size, penalty]: [f64; 2], r: &[f64], z: &mut [f64]) -> bool {
        let Some(rows) = &self.rows else { return false };
        let Dual { coarse, timer, .. } = self.dual;
        let (mut inside, mut beside) = (r.to_vec(), vec![0.0; r.len()]);
        let missing = timer.time("coarse problem", || {
            let motion = rows.reduce(coarse, &mut inside);
            coarse.add_transpose(1.0 / penalty, &motion, &mut beside);
            coarse.apply(&beside)
        });
        if !self.dual.precondition_on(rows, &self.slides, &inside, z) {
            z.copy_from_slice(&inside);
            self.slides.relax(size, z);
            z.iter_mut().for_each(|z| *z /= size);
        }
        timer.time("coarse problem", || {
            rows.project(coarse, z);
            rows.add_balance(coarse, missing, z);
        });
        true
    }

    fn balance(&mut self, target: &[f64], x: &mut [f64]) {
        let Some(rows) = &self.rows else { return };
        let Dual { coarse, timer, .. } = self.dual;
        let missing: Vec<f64> = target.iter().zip(&*x).map(|(target, x)| target - x).collect();
        timer.time("coarse problem", || rows.add_balance(coarse, coarse.apply(&missing), x));
    }
}

/// The dual problem on the rows of an active set: multipliers elsewhere are zero.
pub struct DualFace<'s, 'a> {
    /// On all rows.
    pub dual: Dual<'s, 'a>,
    /// The rows of B.
    pub constraints: &'s Constraints,
    /// `e = R'f_k`, whole on every rank.
    pub resultants: &'s [f64],
    /// The rows of the set.
    pub rows: CoarseFace,
    /// What discs of friction do.
    pub slides: Slides,
}

/// The friction rows of which slips leave one combination free.
pub fn sliding(slides: &Slides) -> Sliding {
    Sliding::new(slides.across().map(|(rows, direction, is_soft)| Across { rows, direction, is_soft }).collect())
}

/// A contact resists a motion if this changes `B u` there by more than this share of the largest change in any row.
const RESISTS: f64 = 1e-9;

impl DualFace<'_, '_> {
    /// Adds contacts until the rows of the set can balance `e`: while a free motion is left that `e` drives, those that resist
    /// it. False if none resists.
    pub fn complete(&mut self, kept: &mut [bool]) -> bool {
        let size = self.resultants.iter().map(|e| e * e).sum::<f64>().sqrt();
        let left = self.left();
        while let Some(motion) = self.rows.unbalanced(&left, size) {
            let moved = self.dual.coarse.moved(&motion);
            let most = self.dual.space.maximum(moved.iter().fold(0.0, |most, m| most.max(m.abs())));
            let mut joined = 0.0;
            for ((kept, row), &moved) in kept.iter_mut().zip(&self.constraints.rows).zip(&moved) {
                if !*kept && row.law() != Law::Friction && row.law().resists(moved, RESISTS * most) {
                    (*kept, joined) = (true, 1.0);
                }
            }
            if self.dual.space.maximum(joined) == 0.0 {
                // What presses may stick.
                for slider in &self.constraints.sliders {
                    if !kept[slider.normal] {
                        continue;
                    }
                    for row in slider.tangents.iter().map(|tangent| tangent.row) {
                        if !kept[row] && Law::Friction.resists(moved[row], RESISTS * most) {
                            (kept[row], joined) = (true, 1.0);
                        }
                    }
                }
            }
            if self.dual.space.maximum(joined) == 0.0 {
                return false;
            }
            let sliding = self.rows.slides().clone();
            self.rows = self.rows.with(self.dual.coarse, self.dual.space, kept.to_vec(), sliding);
        }
        true
    }

    /// What friction along slips leaves of `e`. Collective.
    fn left(&self) -> Vec<f64> {
        let mut left = self.resultants.to_vec();
        if !self.constraints.has_friction {
            return left;
        }
        let taken = self.dual.coarse.apply(&self.slides.fixed(self.constraints.rows.len()));
        left.iter_mut().zip(taken).for_each(|(e, taken)| *e -= taken);
        left
    }
}

impl Quadratic for DualFace<'_, '_> {
    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.dual.apply(x, y);
        self.slides.add_compliance(1.0, x, y);
    }

    fn project(&mut self, x: &mut [f64]) {
        self.dual.timer.time("coarse problem", || self.rows.project(self.dual.coarse, x));
    }

    fn reduce(&mut self, r: &mut [f64]) {
        self.dual.timer.time("coarse problem", || {
            self.rows.reduce(self.dual.coarse, r);
        });
    }

    fn reduce_with_products(
        &mut self,
        _: &dyn Space,
        x: &mut [f64],
        r: &[f64],
        against: &[&[f64]],
        pairs: &[(&[f64], &[f64])],
    ) -> ([f64; 2], Vec<f64>) {
        self.rows.mask(x);
        let (partial, width) = self.dual.partial((x, r), against, pairs);
        self.dual.timer.time("coarse problem", || self.rows.reduce_with_sums(self.dual.coarse, (x, r), &partial, width))
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> bool {
        self.dual.precondition_on(&self.rows, &self.slides, r, z)
    }
}

impl active_set::Face for DualFace<'_, '_> {
    fn restrict(&mut self, kept: &mut [bool], slides: &Slides) -> bool {
        let timer = self.dual.timer;
        let Dual { coarse, space, .. } = self.dual;
        self.slides.clone_from(slides);
        self.rows = timer.time("coarse set-up", || self.rows.with(coarse, space, kept.to_vec(), sliding(slides)));
        let complete = timer.time("coarse set-up", || self.complete(kept));
        self.dual.restrict_scaling(self.constraints, kept);
        self.slides.adopt(kept);
        complete
    }

    fn restore(&mut self, x: &mut [f64]) {
        self.dual.timer.time("coarse problem", || {
            let present = self.dual.coarse.apply(x);
            let missing = self.resultants.iter().zip(present).map(|(e, b)| e - b).collect();
            self.rows.add_balance(self.dual.coarse, missing, x);
        });
    }

    fn gaps(&mut self, residual: &mut [f64]) {
        self.dual.timer.time("coarse problem", || {
            let a = motion::amplitudes(&self.rows, self.dual.coarse, self.dual.space, self.constraints, residual);
            self.dual.coarse.add_transpose(-1.0, &a, residual);
        });
    }
}
