//! Two threads that hold a half of the entries each, one without discs: they have to take the same way.

use std::sync::{Barrier, Mutex};
use std::thread;

use super::dense::{Matrix, Plain, Random, distance};
use crate::qp::discs::Disc;
use crate::qp::feasible::FeasibleSet;
use crate::qp::quadratic::{Quadratic, Space};
use crate::qp::smalse::{Problem, Settings, Solution, Start, solve};
use crate::qp::{Limits, Outcome};

const LIMITS: Limits =
    Limits { relative: 1e-9, reference: None, absolute: 0.0, rounding: 0.0, drop: 0.0, products: 1000 };
const HALF: usize = 12;
const SETTINGS: Settings = Settings { limits: LIMITS, norm: 1.0 };

/// Where the threads put what the others shall see.
struct Board {
    barrier: Barrier,
    sheets: [Mutex<Vec<f64>>; 2],
}

struct Rank<'a> {
    board: &'a Board,
    rank: usize,
    matrix: &'a Matrix,
}

impl Rank<'_> {
    /// What each rank has, on both. One collective.
    fn share(&self, mine: &[f64]) -> [Vec<f64>; 2] {
        *self.board.sheets[self.rank].lock().expect("no thread has panicked") = mine.to_vec();
        self.board.barrier.wait();
        let all = [0, 1].map(|rank| self.board.sheets[rank].lock().expect("no thread has panicked").clone());
        self.board.barrier.wait();
        assert_eq!(all[0].len(), all[1].len(), "the ranks ask for different things");
        all
    }
}

impl Space for Rank<'_> {
    fn dots(&self, pairs: &[(&[f64], &[f64])]) -> Vec<f64> {
        let [first, second] = self.share(&Plain.dots(pairs));
        first.iter().zip(&second).map(|(a, b)| a + b).collect()
    }

    fn minimum(&self, mine: f64) -> f64 {
        let [first, second] = self.share(&[mine]);
        first[0].min(second[0])
    }
}

impl Quadratic for Rank<'_> {
    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        let all = self.matrix.times(&self.share(x).concat());
        y.copy_from_slice(&all[self.rank * HALF..][..HALF]);
    }

    fn project(&mut self, _: &mut [f64]) {}

    fn precondition(&mut self, _: &[f64], _: &mut [f64]) -> bool {
        false
    }
}

fn on_two(matrix: &Matrix, b: &[f64], lower: &[f64], discs: &[Disc]) -> [Solution; 2] {
    let board = Board { barrier: Barrier::new(2), sheets: Default::default() };
    let part = |rank: usize| {
        let (space, mut function) = (Rank { board: &board, rank, matrix }, Rank { board: &board, rank, matrix });
        let discs = if rank == 0 { Vec::new() } else { discs.to_vec() };
        let set = FeasibleSet::with_discs(lower[rank * HALF..][..HALF].to_vec(), discs);
        let b = &b[rank * HALF..][..HALF];
        let problem = Problem { space: &space, function: &mut function, b, set: &set };
        solve(problem, &SETTINGS, Start { x: vec![0.0; HALF], multiplier: None })
    };
    thread::scope(|scope| {
        let other = scope.spawn(|| part(1));
        [part(0), other.join().expect("it ends")]
    })
}

/// Alone, with the same order of sums.
fn on_one(matrix: &Matrix, b: &[f64], lower: &[f64], discs: &[Disc]) -> Solution {
    struct Alone<'a>(&'a Matrix);
    impl Space for Alone<'_> {
        fn dots(&self, pairs: &[(&[f64], &[f64])]) -> Vec<f64> {
            let half = |from: usize| {
                let half: Vec<_> = pairs.iter().map(|(x, y)| (&x[from..][..HALF], &y[from..][..HALF])).collect();
                Plain.dots(&half)
            };
            half(0).iter().zip(&half(HALF)).map(|(a, b)| a + b).collect()
        }
        fn minimum(&self, mine: f64) -> f64 {
            mine
        }
    }
    impl Quadratic for Alone<'_> {
        fn apply(&mut self, x: &[f64], y: &mut [f64]) {
            y.copy_from_slice(&self.0.times(x));
        }
        fn project(&mut self, _: &mut [f64]) {}
        fn precondition(&mut self, _: &[f64], _: &mut [f64]) -> bool {
            false
        }
    }
    let moved = |disc: &Disc| Disc { entries: disc.entries.map(|i| i + HALF), ..*disc };
    let set = FeasibleSet::with_discs(lower.to_vec(), discs.iter().map(moved).collect());
    let problem = Problem { space: &Alone(matrix), function: &mut Alone(matrix), b, set: &set };
    solve(problem, &SETTINGS, Start { x: vec![0.0; 2 * HALF], multiplier: None })
}

#[test]
fn ranks_without_discs_go_along() {
    let mut random = Random::new(71);
    for _ in 0..10 {
        let matrix = Matrix::with_condition(2 * HALF, 100.0, &mut random);
        let b = random.vector(2 * HALF);
        let lower: Vec<f64> =
            (0..2 * HALF).map(|i| if i < 4 { -random.next().abs() } else { f64::NEG_INFINITY }).collect();
        let disc = |k: usize| Disc {
            entries: [2 * k, 2 * k + 1],
            centre: [0.1 * random.next(), 0.1 * random.next()],
            radius: 5.0 * random.next().abs(),
        };
        let discs: Vec<Disc> = (0..HALF / 2).map(disc).collect();
        let alone = on_one(&matrix, &b, &lower, &discs);
        let [first, second] = on_two(&matrix, &b, &lower, &discs);
        assert_eq!((first.outcome, second.outcome), (Outcome::Converged, Outcome::Converged));
        assert_eq!(first.statistics, second.statistics);
        assert_eq!(first.gradient_norm, second.gradient_norm);
        let together = [first.x, second.x].concat();
        // The sums have the same order, so the bits are the same.
        assert_eq!((distance(&together, &alone.x), first.statistics), (0.0, alone.statistics));
    }
}
