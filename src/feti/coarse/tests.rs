use faer::Mat;

use crate::feti::inverse::kernel::MODES;
use crate::fixture::{
    RANKS, Setup, assert_close, clustered, column, on_ranks, same_on_any_ranks, two_bricks, two_bricks_by_metis,
};
use crate::random::Random;
use crate::scene::Scene;

fn scenes() -> [Scene; 4] {
    [two_bricks(&[]), two_bricks(&["decomposition.cluster=2"]), two_bricks_by_metis(7), clustered()]
}

/// `G = R'B'`.
fn dense_coarse(setup: &Setup) -> Mat<f64> {
    setup.dense_modes().transpose() * setup.dense_rows().transpose()
}

fn amplitudes(count: usize) -> Vec<f64> {
    let mut random = Random::new(77);
    (0..count).map(|_| random.number()).collect()
}

#[test]
fn products_and_solutions_are_those_of_the_dense_matrices() {
    for scene in scenes() {
        on_ranks(&scene, 1, |setup| {
            let (g, coarse) = (dense_coarse(setup), setup.coarse().expect("the bodies are held"));
            let x = setup.multipliers(1);
            assert_close(&column(&coarse.apply(&x)), &(&g * column(&x)), 1e-13);

            let a = amplitudes(g.nrows());
            let mut rows = x.clone();
            coarse.add_transpose(-0.5, &a, &mut rows);
            assert_close(&column(&rows), &(column(&x) - 0.5 * (g.transpose() * column(&a))), 1e-13);
        });
    }
}

#[test]
fn coarse_products_and_solutions_are_the_same_bits_on_any_ranks() {
    for scene in [clustered(), two_bricks_by_metis(7)] {
        same_on_any_ranks(&scene, |setup| {
            let coarse = setup.coarse().expect("the bodies are held");
            let a = coarse.apply(&setup.multipliers(2));
            let shares = &setup.tree.clusters;
            a[MODES * shares.begin(setup.comm.rank())..][..MODES * shares.0[setup.comm.rank()]].to_vec()
        });
        same_on_any_ranks(&scene, |setup| {
            let coarse = setup.coarse().expect("the bodies are held");
            let mut rows = setup.multipliers(2);
            coarse.projector().expect("all rows hold them").project(&mut rows);
            setup.owned(&rows)
        });
    }
}

#[test]
fn what_nothing_holds_floats_on_every_rank() {
    // Contact alone, a guide, a hinge: each leaves the upper brick a motion.
    let upper_free = ["contact", "guide", "hinge"].map(|case| match case {
        "contact" => two_bricks(&["support.right.surface=lower.xmax", "support.right.displacement=[0.0, 0.0, 0.0]"]),
        "guide" => two_bricks(&["support.right.fix=[\"x\"]", "support.right.displacement=[0.0, 0.0, 0.0]"]),
        _ => two_bricks(&["support.right.fix=[\"y\", \"z\"]", "support.right.surface=upper.zmax"]),
    });
    for scene in upper_free {
        for ranks in RANKS {
            let bodies = |setup: &Setup| setup.subdomains().iter().map(|s| s.body).collect::<Vec<_>>();
            let found = on_ranks(&scene, ranks, |setup| (setup.coarse().err(), bodies(setup)));
            let bodies: Vec<usize> = found.iter().flat_map(|f| f.1.clone()).collect();
            let floating = found[0].0.as_ref().expect("the upper brick is free");
            assert_eq!(bodies[floating.subdomain], 1, "the lower brick is held");
            assert!(found.iter().all(|f| f.0.as_ref() == Some(floating)), "{ranks} ranks: {found:?}");
        }
    }
}

/// One body without any support, in a corner of three planes, as one subdomain and as eight.
#[test]
fn contact_alone_holds_a_body_that_no_support_holds() {
    let planes = ["x", "y", "z"].map(|axis| {
        let normal = ["x", "y", "z"].map(|other| if axis == other { 1.0 } else { 0.0 });
        format!("[contact.{axis}]\nslave = \"cube.{axis}min\"\nrigid = {{ plane = {{ point = [0.0, 0.0, 0.0], normal = {normal:?} }} }}\n")
    });
    for cells in [4, 2] {
        let text = format!(
            "[material.steel]\nyoung = 1.0\npoisson = 0.3\n[body.cube]\nmaterial = \"steel\"\nelement = \"tet4\"\n\
             brick = {{ origin = [0.0, 0.0, 0.0], size = [1.0, 1.0, 1.0], cells = [4, 4, 4] }}\n\
             [decomposition]\ncells = [{cells}, {cells}, {cells}]\n{}",
            planes.concat()
        );
        let scene = Scene::from_text(&text, "corner", 1, &[]).expect("the scene is sound");
        on_ranks(&scene, 2, |setup| {
            let coarse = setup.coarse().expect("the planes hold it");
            assert_eq!(coarse.free().len(), 6);
        });
    }
}
