//! Random changes of sound scenes and meshes: the readers, and what follows up to the discrete problem, give a problem or
//! an error, and neither panic nor hang nor eat memory.
//!
//! `FETIPLAST_FUZZ_SECONDS=600 cargo test --release --test program fuzz` goes on for that long, from another start each
//! time; without it the same few inputs are tried as a test.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use crate::bad_mesh;
use crate::common::msh::Form;
use crate::common::random::Random;
use fetiplast::comm::solo::Solo;
use fetiplast::mesh::gmsh::Msh;
use fetiplast::model::discrete::discretise;
use fetiplast::monitor::timing::peak_rss_mb;
use fetiplast::scene::{Scene, library};

/// Inputs of each kind where no time is stated.
const FEW: usize = 300;
/// What one input may take.
const LONGEST: Duration = Duration::from_secs(10);
/// What all inputs together may add to the peak memory (MiB).
const MOST: f64 = 500.0;
/// Cells of a mesh that is really made: a user may ask for a large one.
const CELLS: usize = 5000;

impl Random {
    /// One to four changes: a byte, a piece removed or repeated, a number put in place of another, the end cut off.
    fn changed(&mut self, input: &[u8]) -> Vec<u8> {
        const NUMBERS: [&str; 10] =
            ["0", "-1", "1e308", "nan", "-inf", "4294967296", "18446744073709551615", "1e-300", "2", ""];
        let mut bytes = input.to_vec();
        for _ in 0..=self.below(4) {
            let begin = self.below(bytes.len());
            let end = (begin + 1 + self.below(40)).min(bytes.len());
            match self.below(6) {
                0 => bytes[begin] = self.below(256) as u8,
                1 => bytes[begin] ^= 1 << self.below(8),
                2 if end - begin < bytes.len() => drop(bytes.drain(begin..end)),
                3 => {
                    let piece = bytes[begin..end].to_vec();
                    let to = self.below(bytes.len());
                    bytes.splice(to..to, piece);
                }
                4 if self.below(8) == 0 => bytes.truncate(begin + 1),
                _ => {
                    let digit = |b: &u8| b.is_ascii_digit() || b"+-.".contains(b);
                    if let Some(first) = bytes[begin..].iter().position(digit).map(|n| begin + n) {
                        let last = bytes[first..].iter().position(|b| !digit(b)).map_or(bytes.len(), |n| first + n);
                        bytes.splice(first..last, NUMBERS[self.below(NUMBERS.len())].bytes());
                    }
                }
            }
            if bytes.is_empty() {
                return input.to_vec();
            }
        }
        bytes
    }
}

/// Tries `body` on changes of the inputs, few or for the stated time.
fn survives(inputs: &[Vec<u8>], body: impl Fn(&[u8])) {
    let stated = std::env::var("FETIPLAST_FUZZ_SECONDS").ok().map(|s| s.parse().expect("it is a number of seconds"));
    let clock = || std::time::UNIX_EPOCH.elapsed().expect("it is after 1970").as_nanos() as u64;
    let mut random = Random(if stated.is_some() { clock() } else { 1 });
    let (started, before) = (Instant::now(), peak_rss_mb().expect("Linux says"));
    let mut tried = 0;
    while stated.map_or(tried < FEW, |seconds| started.elapsed().as_secs() < seconds) {
        let chosen = random.below(inputs.len());
        let input = random.changed(&inputs[chosen]);
        let begin = Instant::now();
        let outcome = catch_unwind(AssertUnwindSafe(|| body(&input)));
        let keep = || {
            let file = std::env::temp_dir().join("fetiplast-fuzz-input");
            fs::write(&file, &input).expect("the input is kept");
            file
        };
        assert!(outcome.is_ok(), "panic on {:?}, input {tried}", keep());
        assert!(begin.elapsed() < LONGEST, "{:?} takes {:?}", keep(), begin.elapsed());
        let grown = peak_rss_mb().expect("Linux says") - before;
        assert!(grown < MOST, "{:?} takes the peak memory up by {grown} MiB", keep());
        tried += 1;
    }
    println!("{tried} inputs in {:?}", started.elapsed());
}

/// The discrete problem, if there is a scene and its meshes are small.
fn discretised(text: &str, origin: &str) {
    let Ok(scene) = Scene::from_text(text, origin, 1, &[]) else { return };
    let cells = |body: &fetiplast::scene::Body| body.brick().map_or(0, |brick| brick.cells.iter().product());
    if scene.body.values().map(cells).sum::<usize>() < CELLS {
        let _ = discretise(&scene, &Solo);
    }
}

#[test]
fn changed_scenes_end_in_a_problem_or_an_error() {
    let scenes: Vec<Vec<u8>> = library::names().filter_map(library::text).map(|text| text.into()).collect();
    survives(&scenes, |bytes| discretised(&String::from_utf8_lossy(bytes), "scene.toml"));
}

#[test]
fn changed_mesh_files_are_read_or_refused() {
    let meshes = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/meshes");
    let files = fs::read_dir(meshes).expect("the folder is there").map(|entry| entry.expect("it is readable").path());
    let inputs: Vec<Vec<u8>> = files
        .filter(|f| f.extension().is_some_and(|e| e == "msh"))
        .map(|f| fs::read(f).expect("it is a file"))
        .collect();
    assert!(!inputs.is_empty());
    survives(&inputs, |bytes| drop(Msh::parse(bytes, bytes.len() as u64)));
}

#[test]
fn scenes_with_changed_meshes_end_in_a_problem_or_an_error() {
    let directory = tempfile::tempdir().unwrap();
    let origin = directory.path().join("scene.toml");
    let inputs = [Form::Text41, Form::Binary41, Form::Text22, Form::Binary22].map(bad_mesh::bytes);
    survives(&inputs, |bytes| {
        fs::write(directory.path().join("two.msh"), bytes).expect("the mesh is written");
        discretised(bad_mesh::SCENE, &origin.to_string_lossy());
    });
}
