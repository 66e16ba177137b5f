use faer::Mat;
use faer::prelude::Solve;

use super::*;

use crate::fixture::{Setup, assert_close, column, on_ranks, same_on_any_ranks, two_bricks, two_bricks_by_metis};
use crate::scene::Scene;

/// Every other contact row is kept.
fn some(setup: &Setup) -> Vec<bool> {
    setup.rows().iter().map(|row| row.law().always_holds() || row.terms[0].node % 2 == 0).collect()
}

#[test]
fn knows_the_balance_of_the_kept_rows() {
    for scene in [two_bricks(&[]), two_bricks(&["decomposition.cluster=2"]), two_bricks_by_metis(7)] {
        on_ranks(&scene, 1, |setup| {
            let (coarse, kept) = (setup.coarse().expect("the bodies are held"), some(setup));
            assert!(kept.contains(&false));
            let mask = Mat::from_fn(kept.len(), kept.len(), |i, j| f64::from(i == j && kept[i]));
            let g = setup.dense_modes().transpose() * setup.dense_rows().transpose() * &mask;
            let inverse = |e: Mat<f64>| (&g * g.transpose()).partial_piv_lu().solve(e);
            let face = CoarseFace::new(&coarse, kept);

            let x = setup.multipliers(1);
            let amplitudes = inverse(&g * column(&x));
            assert_close(&column(&face.amplitudes(&coarse, &x)), &amplitudes, 1e-9);
            let expected = &mask * column(&x) - g.transpose() * &amplitudes;
            let [mut projected, mut reduced] = [x.clone(), x.clone()];
            face.project(&coarse, &mut projected);
            face.reduce(&coarse, &mut reduced);
            assert_close(&column(&projected), &expected, 1e-9);
            assert_close(&column(&reduced), &expected, 1e-9);
            let mut balanced = x.clone();
            let e = coarse.apply(&setup.multipliers(2));
            face.add_balance(&coarse, e.clone(), &mut balanced);
            assert_close(&column(&balanced), &(column(&x) + g.transpose() * inverse(column(&e))), 1e-9);
        });
    }
}

/// Both bodies are held, or the upper one by contact alone, or but for one motion, or by more rows than the base has.
fn faces<'a>(setup: &'a Setup) -> Vec<(Coarse<'a>, CoarseFace)> {
    let coarse = || without_contact(setup);
    let grown = |coarse: Coarse<'a>| {
        let few = setup.rows().iter().map(|row| row.law().always_holds() || row.terms[0].node % 4 == 0).collect();
        let face = CoarseFace::new(&coarse, few);
        let face = CoarseFace::on(&coarse, Rc::clone(&face.base), some(setup), Sliding::default());
        (coarse, face)
    };
    let loose = |coarse: Coarse<'a>| {
        let face = CoarseFace::loose(&coarse, some(setup));
        (coarse, face)
    };
    vec![loose(coarse()), grown(coarse())]
}

#[test]
fn on_any_base_projectors_are_idempotent_balanced_and_each_others_transposes() {
    for scene in [two_bricks(&[]), two_bricks_by_metis(7), hanging(), hinged()] {
        on_ranks(&scene, 1, |setup| {
            for (coarse, face) in faces(setup) {
                let dot = |x: &[f64], y: &[f64]| setup.space.dots(&[(x, y)])[0];
                let project = |x: &[f64]| {
                    let mut x = x.to_vec();
                    face.project(&coarse, &mut x);
                    x
                };
                let reduce = |x: &[f64]| {
                    let mut x = x.to_vec();
                    face.reduce(&coarse, &mut x);
                    x
                };
                let (x, y) = (setup.multipliers(1), setup.multipliers(2));
                let [px, ry] = [project(&x), reduce(&y)];
                let size = dot(&x, &x).sqrt();
                let forces = coarse.apply(&px);
                assert!(length(&forces) < 1e-10 * length(coarse.apply(&x)), "{:e}", length(&forces));
                assert!(px.iter().zip(face.kept()).all(|(x, kept)| *kept || *x == 0.0));
                assert_close(&column(&project(&px)), &column(&px), 1e-9);
                assert_close(&column(&reduce(&ry)), &column(&ry), 1e-9);
                assert!((dot(&px, &y) - dot(&x, &ry)).abs() < 1e-9 * size * dot(&y, &y).sqrt());

                // The norms and products that come with a gradient are those of what it becomes.
                let mut z = x.clone();
                face.mask(&mut z);
                let partial = setup.space.partial(&[(&z, &z), (&z, &ry), (&z, &y)]);
                let zy = dot(&z, &y);
                let ([square, product], others) = face.reduce_with_sums(&coarse, (&mut z, &ry), &partial, 3);
                assert_close(&column(&z), &column(&reduce(&x)), 1e-12);
                let scale = size * size;
                assert!((square - dot(&z, &z)).abs() < 1e-9 * scale && (product - dot(&z, &ry)).abs() < 1e-9 * scale);
                assert!((others[0] - zy).abs() < 1e-12 * scale);

                // Balance by the kept rows; contacts only where nothing else can.
                let mut mine = setup.multipliers(3);
                face.mask(&mut mine);
                let e = coarse.apply(&mine);
                let mut balance = vec![0.0; x.len()];
                face.add_balance(&coarse, e.clone(), &mut balance);
                assert_close(&column(&coarse.apply(&balance)), &column(&e), 1e-9);
                let contact = |row: usize| !setup.rows()[row].law().always_holds() && !face.base.has_contact(row);
                let uses = (0..x.len()).any(|row| contact(row) && balance[row] != 0.0);
                assert_eq!(uses, face.base.free().len() > face.free().len());
            }
        });
    }
}

/// The upper brick hangs on contact alone, of which nothing is kept.
fn hanging() -> Scene {
    two_bricks(&["support.right.surface=lower.xmax", "support.right.displacement=[0.0, 0.0, 0.0]"])
}

fn equalities(setup: &Setup) -> Vec<bool> {
    setup.rows().iter().map(|row| row.law().always_holds()).collect()
}

/// One motion of the upper brick is free.
fn hinged() -> Scene {
    two_bricks(&["support.right.fix=[\"y\", \"z\"]", "support.right.surface=upper.zmax"])
}

/// Contact may hold nothing.
fn without_contact<'a>(setup: &'a Setup) -> Coarse<'a> {
    let mut coarse = setup.bare_coarse();
    let _ = coarse.factorise();
    coarse
}

#[test]
fn motions_that_the_kept_rows_leave_free_are_left_alone() {
    for (scene, freedoms) in [(hanging(), 6), (hinged(), 1)] {
        on_ranks(&scene, 1, |setup| {
            let (coarse, kept) = (without_contact(setup), equalities(setup));
            let mask = Mat::from_fn(kept.len(), kept.len(), |i, j| f64::from(i == j && kept[i]));
            let g = setup.dense_modes().transpose() * setup.dense_rows().transpose() * &mask;
            let face = CoarseFace::new(&coarse, kept);
            assert_eq!(face.free().len(), freedoms);
            let mut gram = &g * g.transpose();
            for motion in face.free() {
                let n = column(motion);
                let resistance = (g.transpose() * &n).norm_l2() / n.norm_l2();
                assert!(resistance < 1e-12, "{resistance:e}");
                // Of full rank, and the same on all that is balanced.
                gram += &n * n.transpose();
            }
            let inverse = |e: Mat<f64>| gram.partial_piv_lu().solve(e);

            let x = setup.multipliers(1);
            let mut projected = x.clone();
            face.project(&coarse, &mut projected);
            let expected = &mask * column(&x) - g.transpose() * inverse(&g * column(&x));
            assert_close(&column(&projected), &expected, 1e-9);

            let mut masked = setup.multipliers(2);
            face.mask(&mut masked);
            let balanced = coarse.apply(&masked);
            let size = column(&balanced).norm_l2();
            assert_eq!(face.unbalanced(&balanced, size), None);
            let mut rows = vec![0.0; x.len()];
            face.add_balance(&coarse, balanced.clone(), &mut rows);
            assert_close(&column(&coarse.apply(&rows)), &column(&balanced), 1e-9);

            let push: Vec<f64> = balanced.iter().zip(&face.free()[0]).map(|(b, m)| b + 1e-3 * m).collect();
            let motion = face.unbalanced(&push, size).expect("it is pushed where it is free");
            assert!((g.transpose() * column(&motion)).norm_l2() < 1e-12 * column(&motion).norm_l2());
        });
    }
}

#[test]
fn projections_are_the_same_bits_on_any_ranks() {
    same_on_any_ranks(&two_bricks_by_metis(7), |setup| {
        let coarse = setup.coarse().expect("the bodies are held");
        let mut x = setup.multipliers(1);
        CoarseFace::new(&coarse, some(setup)).project(&coarse, &mut x);
        CoarseFace::loose(&coarse, some(setup)).reduce(&coarse, &mut x);
        setup.owned(&x)
    });
    same_on_any_ranks(&hanging(), |setup| {
        let coarse = without_contact(setup);
        let face = CoarseFace::new(&coarse, equalities(setup));
        let mut x = setup.multipliers(1);
        face.project(&coarse, &mut x);
        setup.owned(&x)
    });
}
