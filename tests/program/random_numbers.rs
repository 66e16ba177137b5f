//! Random scenes of which a number is asked for, beside the same on a much finer mesh: they differ by no more than both say.

use crate::common::random::Random;
use crate::common::{number, scene_file, solve_with};
use crate::numbers::last;
use crate::twins::Block;
use serde_json::Value;

const SCENES: u64 = 16;
/// The error that the finer run is asked for, over that of the other one.
const FINER: f64 = 0.1;

const LOWER: [&str; 2] = ["material.lower.yield_stress=4", "material.lower.hardening=50"];
const UPPER: [&str; 2] = ["material.upper.yield_stress=4", "material.upper.hardening=50"];

/// A block that is pressed, from above by so much, on one that a load moves aside; one may yield.
struct Pressed {
    lower: Block,
    upper: Block,
    down: f64,
    aside: f64,
    /// `--set`s of the one that yields.
    yields: &'static [&'static str],
}

impl Pressed {
    fn random(random: &mut Random) -> Self {
        let [lower, mut upper] = [(); 2].map(|()| Block { element: "tet10", ..Block::random(random) });
        upper.begin = [0, 1].map(|a| random.within(-0.4 * upper.size[a], lower.size[a] - 0.6 * upper.size[a]));
        let [down, aside] = [random.within(0.002, 0.02), random.within(-3.0, 3.0)];
        Self { lower, upper, down, aside, yields: random.one_of(&[&[], &LOWER, &UPPER]) }
    }

    fn toml(&self) -> String {
        format!(
            "{}{}
            [support.ground]\nsurface = \"lower.zmin\"\nfix = [\"x\", \"y\", \"z\"]
            [support.lid]\nsurface = \"upper.zmax\"\nfix = [\"x\", \"y\", \"z\"]\ndisplacement = [0.0, 0.0, {:?}]
            [load.aside]\nsurface = \"lower.xmax\"\ntraction = [{:?}, 0.0, 0.0]
            [contact.joint]\nsurfaces = [\"lower.zmax\", \"upper.zmin\"]",
            self.lower.toml("lower", 0.0),
            self.upper.toml("upper", self.lower.height),
            -self.down,
            self.aside,
        )
    }

    /// What forces and corners are asked for.
    fn number(&self, random: &mut Random) -> String {
        let Self { lower, upper, .. } = self;
        let [x, y] = upper.begin;
        match random.below(6) {
            0 => "contact_force:joint:z".to_owned(),
            1 => "contact_force:joint:x".to_owned(),
            2 => "reaction:ground:z".to_owned(),
            3 => "reaction:lid:z".to_owned(),
            4 => format!("displacement:{},{},{}:x:lower", lower.size[0], lower.size[1], lower.height),
            _ => format!("displacement:{x},{y},{}:z:upper", lower.height),
        }
    }
}

#[test]
#[ignore = "minutes: scripts/many"]
fn numbers_of_random_scenes_are_as_exact_as_told() {
    let folder = tempfile::tempdir().unwrap();
    let mut met = 0;
    for seed in 1..=SCENES {
        let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let scene = Pressed::random(&mut random);
        let (number_of, error) = (scene.number(&mut random), random.one_of(&[0.02, 0.01, 0.005]));
        let path = scene_file(folder.path(), &scene.toml());
        let ask = |error: f64, most: &str| -> Value {
            let error = error.to_string();
            let options = ["--error", &error, "--error-of", &number_of, "--max-unknowns", most];
            last(&solve_with(2, &path, 1, scene.yields, &options).summary()).clone()
        };
        let [told, finer] = [ask(error, "60000"), ask(FINER * error, "150000")];
        let [value, other] = [&told, &finer].map(|row| number(&row["goal"], "value"));
        let [mine, its] = [(&told, value), (&finer, other)].map(|(row, value)| number(row, "error") * value.abs());
        assert!(
            (value - other).abs() <= mine + its,
            "{seed}, {number_of}: {value} and {other}, {mine} and {its}\n{}",
            scene.toml()
        );
        met += usize::from(number(&told, "error") <= error);
    }
    assert!(2 * met > SCENES as usize, "{met} of {SCENES} runs came to the error");
}
