//! Random scenes that are sound, or tip, beside their twins: slave and master exchanged, mirrored, cut otherwise. None may
//! differ without a word from what is known of it, or from its twins by more than both say of their own errors.
//!
//! `FETIPLAST_FUZZ_SCENES=500 cargo test --release --test program twins` tries as many; without it a few are tried as a test.

use crate::common::random::Random;
use fetiplast::comm::solo::Solo;
use fetiplast::model::{self, ModelError};
use fetiplast::monitor::timing::Timer;
use fetiplast::record::summary::Summary;
use fetiplast::scene::Scene;
use fetiplast::study::{self, StudyError};

/// Scenes where no number is stated.
const FEW: usize = 60;

impl Random {
    /// Uniform in a range, in steps of a thousandth of it.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.below(1001) as f64 / 1000.0
    }

    pub fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }
}

/// A box: along x and y its beginning, size and cells; its height and cells along it.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    pub begin: [f64; 2],
    pub size: [f64; 2],
    pub cells: [usize; 2],
    pub height: f64,
    pub layers: usize,
    pub element: &'static str,
    pub young: f64,
}

impl Block {
    pub fn random(random: &mut Random) -> Self {
        Self {
            begin: [0.0; 2],
            size: [random.within(0.5, 2.0), random.within(0.5, 2.0)],
            cells: [2 + random.below(5), 2 + random.below(5)],
            height: random.within(0.5, 1.5),
            layers: 1 + random.below(3),
            element: random.one_of(&["tet4", "hex8", "tet10"]),
            young: random.one_of(&[300.0, 1000.0, 5000.0]),
        }
    }

    pub fn toml(&self, name: &str, base: f64) -> String {
        let Self { begin: [x, y], size: [a, b], cells: [m, n], height, layers, element, young } = self;
        format!(
            "[material.{name}]\nyoung = {young:?}\npoisson = 0.3\n[body.{name}]\nmaterial = \"{name}\"\nelement = \"{element}\"\n\
             brick = {{ origin = [{x:?}, {y:?}, {base:?}], size = [{a:?}, {b:?}, {height:?}], cells = [{m}, {n}, {layers}] }}\n"
        )
    }

    /// Reflected at the plane x = 0.
    pub fn mirrored(self) -> Self {
        Self { begin: [-self.begin[0] - self.size[0], self.begin[1]], ..self }
    }

    /// Its widest cell, along the surfaces.
    pub fn widest(&self) -> f64 {
        (0..2).map(|a| self.size[a] / self.cells[a] as f64).fold(0.0, f64::max)
    }
}

/// Where a block is above another one, along an axis.
pub fn overlap(lower: &Block, upper: &Block, a: usize) -> [f64; 2] {
    let [lower, upper] = [lower, upper].map(|block| [block.begin[a], block.begin[a] + block.size[a]]);
    [lower[0].max(upper[0]), lower[1].min(upper[1])]
}

/// An upper block on a lower one, pressed with one on its top, where it is guided along z.
#[derive(Clone, Copy, Debug)]
struct Stacked {
    lower: Block,
    upper: Block,
    gap: f64,
}

/// What a scene came to.
#[derive(Debug)]
pub enum End {
    Converged(Box<Summary>),
    Tips,
}

impl Stacked {
    fn random(random: &mut Random) -> Self {
        let (lower, mut upper) = (Block::random(random), Block::random(random));
        upper.begin = [0, 1].map(|a| random.within(-0.6 * upper.size[a], lower.size[a] - 0.4 * upper.size[a]));
        Self { lower, upper, gap: random.one_of(&[0.0, 0.0, 0.05, -0.002]) }
    }

    /// Distance from the load's resultant to the nearest edge of the overlap, negative outside.
    fn margin(&self) -> f64 {
        let along = |a: usize| {
            let [low, high] = overlap(&self.lower, &self.upper, a);
            let at = self.upper.begin[a] + 0.5 * self.upper.size[a];
            (at - low).min(high - at)
        };
        along(0).min(along(1))
    }

    /// Whether the load's resultant is beyond the overlap, or nearer to its edge than multipliers are that have no node in reach.
    fn may_tip(&self) -> bool {
        self.margin() < 0.25 * self.lower.widest().max(self.upper.widest())
    }

    /// Reflected at the plane x = 0.
    fn mirrored(&self) -> Self {
        Self { lower: self.lower.mirrored(), upper: self.upper.mirrored(), ..*self }
    }

    fn solve(&self, sides: &str, subdomains: usize) -> End {
        let text = format!(
            "{}{}
            [support.ground]\nsurface = \"lower.zmin\"\nfix = [\"x\", \"y\", \"z\"]
            [support.guide]\nsurface = \"upper.zmax\"\nfix = [\"x\", \"y\"]
            [load.press]\nsurface = \"upper.zmax\"\ntraction = [0.0, 0.0, -1.0]
            [contact.joint]\n{sides}
            [decomposition]\nsubdomains = {subdomains}
            [solver]\nresidual_tolerance = 1e-8\nqp_tolerance = 1e-10",
            self.lower.toml("lower", 0.0),
            self.upper.toml("upper", self.lower.height + self.gap),
        );
        solve_text(&text, &format!("{self:?} {sides}"))
    }
}

/// What a scene comes to, told as `what`.
pub fn solve_text(text: &str, what: &str) -> End {
    let scene = Scene::from_text(text, "random", 1, &[]).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let solved = model::discretise(&scene, &Solo)
        .map_err(StudyError::from)
        .and_then(|discrete| study::solve(&scene, &discrete, &Solo, study::Begin::Rest, &Timer::default(), &mut ()));
    match solved {
        Ok(solved) => {
            assert_eq!(solved.summary.converged, Some(true), "{what}: {:?}\n{text}", solved.summary.error);
            End::Converged(Box::new(solved.summary))
        }
        Err(StudyError::Model(ModelError::Unheld(_))) => End::Tips,
        Err(error) => panic!("{error}\n{text}"),
    }
}

/// How many random scenes are wanted, if that is stated.
pub fn stated() -> Option<u64> {
    std::env::var("FETIPLAST_FUZZ_SCENES").ok().map(|n| n.parse().expect("it is a number of scenes"))
}

/// Difference of two energies, relative to what is stored.
pub fn difference(one: &Summary, other: &Summary) -> f64 {
    let energy = |summary: &Summary| summary.state.energy.expect("it is solved");
    let stored = |summary: &Summary| summary.state.internal_energy.expect("it is solved");
    (energy(one) - energy(other)).abs() / stored(one).max(stored(other))
}

/// What a scene says of the error of its energy: twice the square of that of its stress, where singular edges hide half of it.
pub fn own_error(summary: &Summary) -> f64 {
    2.0 * summary.state.errors.discretisation.expect("it is solved").powi(2)
}

pub const LOWER_SLAVE: &str = "slave = \"lower.zmax\"\nmaster = \"upper.zmin\"";
pub const UPPER_SLAVE: &str = "slave = \"upper.zmin\"\nmaster = \"lower.zmax\"";

#[test]
fn random_scenes_are_what_their_twins_are() {
    let stated = stated();
    let mut random = Random(stated.map_or(1, |n: u64| n));
    let (mut stood, mut tipped, mut largest) = (0, 0, 0.0_f64);
    for number in 0..stated.unwrap_or(FEW as u64) {
        let scene = Stacked::random(&mut random);
        let ends = [UPPER_SLAVE, LOWER_SLAVE].map(|sides| scene.solve(sides, 2));
        let what = format!("scene {number}: {scene:?}, margin {:.3}", scene.margin());
        for end in &ends {
            match end {
                End::Tips => assert!(scene.may_tip(), "{what} tips"),
                End::Converged(summary) => {
                    assert!(scene.margin() > -1e-9, "{what} stands");
                    let force = summary.state.contact_forces["joint"][2].abs();
                    let load = scene.upper.size[0] * scene.upper.size[1];
                    assert!((force - load).abs() < 1e-6 * load, "{what}: {force} bears {load}");
                    assert!(summary.state.residuals.balance < Some(1e-7), "{what}: {:?}", summary.state.residuals);
                }
            }
        }
        let [End::Converged(upper), End::Converged(lower)] = &ends else {
            tipped += 1;
            continue;
        };
        stood += 1;
        let (found, allowed) = (difference(upper, lower), own_error(upper) + own_error(lower));
        largest = largest.max(found / allowed);
        assert!(found < allowed, "{what}: exchanged energies differ by {found:.3}, errors say {allowed:.3}");
        let End::Converged(cut) = scene.solve(UPPER_SLAVE, 5) else { panic!("{what} tips where it is cut otherwise") };
        assert!(difference(upper, &cut) < 1e-7, "{what}: cut otherwise by {:.1e}", difference(upper, &cut));
        // Boxes of hexahedra are their own mirror images, tetrahedra lean to one side.
        let alike = [scene.lower, scene.upper].iter().all(|block| block.element == "hex8");
        let End::Converged(mirrored) = scene.mirrored().solve(UPPER_SLAVE, 2) else {
            assert!(!alike && scene.may_tip(), "{what} tips mirrored");
            continue;
        };
        let allowed = if alike { 1e-7 } else { own_error(upper) + own_error(&mirrored) };
        assert!(difference(upper, &mirrored) < allowed, "{what}: mirrored by {:.1e}", difference(upper, &mirrored));
    }
    println!(
        "{stood} scenes stood, {tipped} tipped; exchanged they differ by at most {largest:.2} of what their errors say"
    );
    assert!(stood > 5 && tipped > 2, "{stood} {tipped}");
}
