use super::*;

/// The chain with `2 + shift` on the diagonal and -1 beside it.
fn chain(n: u32, shift: f64) -> (Vec<u32>, Vec<u32>, Vec<f64>) {
    let begins = (0..n).map(|c| 2 * c).chain([2 * n - 1]).collect();
    let rows = (0..n).flat_map(|c| [c, c + 1]).take(2 * n as usize - 1).collect();
    let values = (0..n).flat_map(|_| [2.0 + shift, -1.0]).take(2 * n as usize - 1).collect();
    (begins, rows, values)
}

#[test]
fn solves_in_any_order_and_one_workspace_serves_all() {
    let [small, large] = [5_u32, 40].map(|n| (n, chain(n, 0.5)));
    let analyses = [&small, &large].map(|(n, (column_begin, rows, _))| {
        let lower = Lower { column_begin, rows };
        let order: Vec<u32> = (0..*n).collect();
        let backwards: Vec<u32> = (0..*n).rev().collect();
        [Analysis::ordered(lower, &backwards), Analysis::ordered(lower, &order)]
    });
    let mut workspace = Workspace::new(analyses.iter().flatten());
    for ((n, (column_begin, rows, values)), pair) in [&small, &large].into_iter().zip(&analyses) {
        for analysis in pair {
            for (precision, size, tolerance) in [
                (Precision::Double, 1.0, 1e-14),
                (Precision::Double, 1e-60, 1e-14),
                (Precision::Single, 1.0, 1e-6),
                (Precision::Single, 1e-60, 1e-6),
            ] {
                let mut factor = analysis.factor(precision);
                workspace.factorise(analysis, Lower { column_begin, rows }, values, &mut factor).expect("definite");
                let n = *n as usize;
                let mut x: Vec<f64> = (0..n).map(|k| size * (k as f64).sin()).collect();
                workspace.solve(analysis, &factor, &mut x);
                for k in 0..n {
                    let beside = if k > 0 { x[k - 1] } else { 0.0 } + x.get(k + 1).unwrap_or(&0.0);
                    assert!((2.5 * x[k] - beside - size * (k as f64).sin()).abs() < tolerance * size);
                }
            }
        }
    }
}

#[test]
fn a_breakdown_names_the_unknown() {
    let (column_begin, rows, mut values) = chain(6, 1.0);
    values[2 * 4] = -1.0;
    let lower = Lower { column_begin: &column_begin, rows: &rows };
    let analysis = Analysis::ordered(lower, &[0, 1, 4, 2, 3, 5]);
    for precision in [Precision::Single, Precision::Double] {
        let mut factor = analysis.factor(precision);
        let outcome = Workspace::new([&analysis]).factorise(&analysis, lower, &values, &mut factor);
        let breakdown = outcome.expect_err("the diagonal is negative");
        assert_eq!(breakdown.unknown, 4);
    }
}

#[test]
fn pivots_and_complements_of_a_chain() {
    let (column_begin, rows, values) = chain(6, 1.0);
    let lower = Lower { column_begin: &column_begin, rows: &rows };
    // The ends meet at the third, then at the fourth unknown.
    let analysis = Analysis::ordered(lower, &[0, 1, 5, 4, 3, 2]);
    for precision in [Precision::Single, Precision::Double] {
        let mut factor = analysis.factor(precision);
        Workspace::new([&analysis]).factorise(&analysis, lower, &values, &mut factor).expect("definite");
        // The pivots of either half are 3, 3 - 1/3, ..., as of the continued fraction.
        let (second, fourth) = (3.0 - 1.0 / 3.0, 3.0 - 1.0 / (3.0 - 1.0 / 3.0));
        let third = 3.0 - 1.0 / second - 1.0 / fourth;
        assert!((analysis.least_pivot(&factor, |_| 3.0) - third / 3.0).abs() < 1e-6);
        let found = analysis.complement(&factor, 2, |unknown| [2, 3].iter().position(|&k| k == unknown));
        let expected = [[3.0 - 1.0 / second, -1.0], [-1.0, fourth]];
        for (i, line) in expected.iter().enumerate() {
            for (j, value) in line.iter().enumerate() {
                assert!((found[(i, j)] - value).abs() < 1e-6, "{found:?}");
            }
        }
    }
}

/// Of a dense matrix: `2 n^2` operations for a solve, `n^3 / 3` for a factor.
#[test]
fn work_is_that_of_the_text_books() {
    let n = 40;
    let column_begin: Vec<u32> = (0..=n).map(|column| column * n - column * (column.max(1) - 1) / 2).collect();
    let rows: Vec<u32> = (0..n).flat_map(|column| column..n).collect();
    let values: Vec<f64> = (0..n).flat_map(|c| (c..n).map(move |r| if r == c { 50.0 } else { -1.0 })).collect();
    let lower = Lower { column_begin: &column_begin, rows: &rows };
    let analysis = Analysis::minimum_degree(lower);
    let mut workspace = Workspace::new([&analysis]);
    let (mut single, mut double) = (analysis.factor(Precision::Single), analysis.factor(Precision::Double));
    let booked = |work: &mut dyn FnMut()| {
        let before = work::done();
        work();
        let after = work::done();
        (after.flops - before.flops, after.bytes - before.bytes)
    };
    let (flops, _) = booked(&mut || workspace.factorise(&analysis, lower, &values, &mut single).expect("definite"));
    let cubes = f64::from(n).powi(3) / 3.0;
    assert!(flops > cubes && flops < 1.05 * cubes, "{flops} {cubes}");
    workspace.factorise(&analysis, lower, &values, &mut double).expect("definite");
    let mut x = vec![1.0; n as usize * WIDTH];
    let one = booked(&mut || workspace.solve(&analysis, &double, &mut x[..n as usize]));
    assert_eq!(one, (f64::from(2 * n * (n + 1)), f64::from(2 * 8 * n * n)));
    let half = booked(&mut || workspace.solve(&analysis, &single, &mut x[..n as usize]));
    assert_eq!(half, (one.0, one.1 / 2.0));
    // Side by side the factor is read once for all; places that nobody needs do not count.
    let three = booked(&mut || workspace.solve_wide(&analysis, &double, &mut x, 3));
    assert_eq!(three, (3.0 * one.0, one.1));
}
