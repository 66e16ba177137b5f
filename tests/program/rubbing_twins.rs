//! Random scenes with friction beside their twins: slave and master exchanged, mirrored, cut otherwise. A block on another one is
//! pressed, pushed along it and let go or pushed back; what holds it there is friction alone, or a guide that moves it.
//!
//! `FETIPLAST_FUZZ_SCENES=500 cargo test --release --test program rubbing_twins` tries as many; without it a few are tried as a test.

use crate::common::random::Random;
use crate::twins::{Block, End, LOWER_SLAVE, UPPER_SLAVE, difference, overlap, own_error, solve_text, stated};
use fetiplast::record::summary::Summary;

/// Scenes where no number is stated.
const FEW: usize = 12;

const ACTIVE_SET: &str = "active-set";

/// What resists sliding.
#[derive(Clone, Copy, Debug)]
enum Law {
    Coulomb(f64),
    Tresca(f64),
}

/// What pushes the upper block along.
#[derive(Clone, Copy, Debug)]
enum Push {
    /// Tractions on its top. Nothing but friction holds it.
    Load([f64; 2]),
    /// Its top is moved.
    Way([f64; 2]),
}

/// An upper block on a lower one, pressed with one on its top.
#[derive(Clone, Copy, Debug)]
struct Rubbed {
    lower: Block,
    upper: Block,
    law: Law,
    push: Push,
    /// Factor of the push in the last step.
    back: f64,
    gap: f64,
    /// Yield stress of both, in pressures.
    strength: Option<f64>,
}

impl Rubbed {
    fn random(random: &mut Random) -> Self {
        let (lower, mut upper) = (Block::random(random), Block::random(random));
        upper.begin = [0, 1].map(|a| random.within(-0.3 * upper.size[a], lower.size[a] - 0.7 * upper.size[a]));
        upper.height = random.within(0.2, 0.8);
        let law = match random.below(3) {
            0 => Law::Tresca(random.one_of(&[0.1, 0.3, 1.0])),
            _ => Law::Coulomb(random.one_of(&[0.01, 0.1, 0.3, 0.5, 0.8])),
        };
        let along = [random.within(-1.0, 1.0), random.within(-1.0, 1.0)];
        let push = match law {
            Law::Coulomb(most) | Law::Tresca(most) if random.below(2) == 0 => Push::Load(along.map(|part| most * part)),
            _ => Push::Way(along.map(|part| part * upper.height / upper.young * random.one_of(&[0.5, 3.0]))),
        };
        let gap = match push {
            Push::Load(_) => random.one_of(&[0.0, 0.0, 1e-3]),
            Push::Way(_) => random.one_of(&[0.0, 0.0, 1e-3, -1e-4]),
        };
        let strength = random.one_of(&[None, None, Some(1.2)]);
        Self { lower, upper, law, push, back: random.one_of(&[0.0, -1.0, 0.5]), gap, strength }
    }

    /// Distance from where the resultant passes the surface to the nearest edge of the overlap, negative outside, when all pushes.
    fn margin(&self) -> f64 {
        let shift = match self.push {
            Push::Load(along) => along.map(|part| part * self.upper.height),
            Push::Way(_) => [0.0; 2],
        };
        let along = |a: usize| {
            let [low, high] = overlap(&self.lower, &self.upper, a);
            let at = self.upper.begin[a] + 0.5 * self.upper.size[a];
            [at, at + shift[a], at + self.back * shift[a]].map(|at| (at - low).min(high - at))
        };
        [along(0), along(1)].as_flattened().iter().fold(f64::INFINITY, |least, margin| margin.min(least))
    }

    /// What friction bears at least and at most, over the load that presses.
    fn borne(&self) -> [f64; 2] {
        match self.law {
            Law::Coulomb(friction) => [friction; 2],
            Law::Tresca(limit) => {
                let of = |beyond: f64| {
                    let [a, b] =
                        [0, 1].map(|a| overlap(&self.lower, &self.upper, a)).map(|[low, high]| high - low + beyond);
                    limit * a * b / (self.upper.size[0] * self.upper.size[1])
                };
                // A slave node near the edge of the other surface has all of its area. Friction that does not act where the load does
                // has to bear its moment, too, with no more than half of it.
                [0.5 * of(0.0), of(2.0 * self.lower.widest().max(self.upper.widest()))]
            }
        }
    }

    /// How much of what friction bears the push needs at least and at most; zero where something else holds.
    fn needed(&self) -> [f64; 2] {
        let Push::Load([x, y]) = self.push else { return [0.0; 2] };
        let [least, most] = self.borne();
        [most, least].map(|borne| x.hypot(y) * self.back.abs().max(1.0) / borne)
    }

    /// Reflected at the plane x = 0.
    fn mirrored(&self) -> Self {
        let push = match self.push {
            Push::Load([x, y]) => Push::Load([-x, y]),
            Push::Way([x, y]) => Push::Way([-x, y]),
        };
        Self { lower: self.lower.mirrored(), upper: self.upper.mirrored(), push, ..*self }
    }

    fn solve(&self, sides: &str, subdomains: usize, qp: &str) -> End {
        let law = match self.law {
            Law::Coulomb(friction) => format!("friction = {friction:?}"),
            Law::Tresca(limit) => format!("shear_limit = {limit:?}"),
        };
        let (pushed, key) = match self.push {
            Push::Load([x, y]) => {
                (format!("[load.push]\nsurface = \"upper.zmax\"\ntraction = [{x:?}, {y:?}, 0.0]"), "load.push")
            }
            Push::Way([x, y]) => (
                format!(
                    "[support.push]\nsurface = \"upper.zmax\"\nfix = [\"x\", \"y\"]\ndisplacement = [{x:?}, {y:?}, 0.0]"
                ),
                "support.push",
            ),
        };
        let text = format!(
            "step = [{{ {key} = 0.0 }}, {{ increments = 2 }}, {{ {key} = {:?} }}]
            {}{}
            [support.ground]\nsurface = \"lower.zmin\"\nfix = [\"x\", \"y\", \"z\"]
            [load.press]\nsurface = \"upper.zmax\"\ntraction = [0.0, 0.0, -1.0]
            {pushed}
            [contact.joint]\n{sides}\n{law}
            [decomposition]\nsubdomains = {subdomains}
            [solver]\nqp = \"{qp}\"\nresidual_tolerance = 1e-8\nqp_tolerance = 1e-10",
            self.back,
            self.lower.toml("lower", 0.0),
            self.upper.toml("upper", self.lower.height + self.gap),
        );
        let yields = |name: &str, of: f64| format!("[material.{name}]\nyield_stress = {of:?}\nhardening = 20.0\n");
        let text = match self.strength {
            Some(of) => ["lower", "upper"]
                .iter()
                .fold(text, |text, name| text.replace(&format!("[material.{name}]\n"), &yields(name, of))),
            None => text,
        };
        solve_text(&text, &format!("{self:?} {sides}"))
    }

    /// Checks what must hold whatever the mesh.
    fn assert_sound(&self, summary: &Summary, what: &str) {
        let steps = &summary.steps;
        assert_eq!(steps.len(), 4, "{what}: increments are halved");
        let area = self.upper.size[0] * self.upper.size[1];
        for (row, factor) in steps.iter().zip([0.0, 0.5, 1.0, self.back]) {
            let state = &row.state;
            let [x, y, z] = state.contact_forces["joint"].map(|force| force / area);
            assert!((z.abs() - 1.0).abs() < 1e-6, "{what}: {z} bears 1");
            if let Push::Load(along) = self.push {
                let off = (x.abs() - (factor * along[0]).abs()).hypot(y.abs() - (factor * along[1]).abs());
                assert!(off < 1e-6, "{what}: {x}, {y} bears {along:?}");
            }
            let [_, most] = self.borne();
            assert!(x.hypot(y) <= most * (1.0 + 1e-6), "{what}: {x}, {y} beyond the limit");
            let of = &state.residuals;
            assert!(of.friction < Some(1e-6) && of.balance < Some(1e-6) && of.energies < Some(1e-6), "{what}: {of:?}");
            let dissipation = state.friction["joint"].dissipation;
            let scale = state.energies.as_ref().expect("it converged").external.abs();
            assert!(dissipation >= -1e-7 * scale, "{what}: {dissipation}");
        }
    }
}

#[test]
fn random_scenes_with_friction_are_what_their_twins_are() {
    let number = stated();
    let mut random = Random(number.map_or(2, |n| n + 1));
    let (mut stood, mut refused, mut largest) = (0, 0, 0.0_f64);
    for number in 0..number.unwrap_or(FEW as u64) {
        let scene = Rubbed::random(&mut random);
        let [least, most] = scene.needed();
        let what = format!("scene {number}: {scene:?}, margin {:.3}, needs {least:.3} to {most:.3}", scene.margin());
        let widest = scene.lower.widest().max(scene.upper.widest());
        let (holds, surely) = (scene.margin() > -1e-9 && least < 1.0 + 1e-9, scene.margin() > 0.25 * widest);
        let ends = [UPPER_SLAVE, LOWER_SLAVE].map(|sides| scene.solve(sides, 2, ACTIVE_SET));
        for end in &ends {
            match end {
                End::Tips => assert!(!(surely && most < 0.999), "{what} is refused"),
                End::Converged(summary) => {
                    assert!(holds, "{what} is held");
                    scene.assert_sound(summary, &what);
                }
            }
        }
        let [End::Converged(upper), End::Converged(lower)] = &ends else {
            refused += 1;
            continue;
        };
        stood += 1;
        let (found, allowed) = (difference(upper, lower), own_error(upper) + own_error(lower));
        largest = largest.max(found / allowed);
        // Residuals are below 1e-8, and flow gives way 250 times as far as its surroundings.
        let alike = if scene.strength.is_some() { 1e-5 } else { 1e-6 };
        // Errors of the energy that comes from flow and from what friction is given over are in no estimate.
        assert!(scene.strength.is_some() || found < 2.0 * allowed, "{what}: exchanged by {found:.3}, not {allowed:.3}");
        let End::Converged(cut) = scene.solve(UPPER_SLAVE, 5, ACTIVE_SET) else {
            panic!("{what} tips where it is cut otherwise")
        };
        assert!(difference(upper, &cut) < alike, "{what}: cut otherwise by {:.1e}", difference(upper, &cut));
        let End::Converged(other) = scene.solve(LOWER_SLAVE, 2, "smalse-m") else {
            panic!("{what} tips with SMALSE-M")
        };
        // Where an increment was halved flow and friction took another path.
        let same_path = other.steps.len() == lower.steps.len();
        assert!(
            !same_path || difference(lower, &other) < alike,
            "{what}: by SMALSE-M {:.1e}",
            difference(lower, &other)
        );
        if [scene.lower, scene.upper].iter().all(|block| block.element == "hex8") {
            let End::Converged(mirrored) = scene.mirrored().solve(UPPER_SLAVE, 2, ACTIVE_SET) else {
                panic!("{what} tips mirrored")
            };
            assert!(difference(upper, &mirrored) < alike, "{what}: mirrored by {:.1e}", difference(upper, &mirrored));
        }
    }
    println!(
        "{stood} scenes stood, {refused} did not; exchanged they differ by at most {largest:.2} of what their errors say"
    );
    assert!(stood > 5 && refused > 0, "{stood} {refused}");
}
