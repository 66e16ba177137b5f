use super::marking::{total, wanted};
use super::start::{Start, start};
use super::*;
use crate::comm::threads;
use crate::element::Kind;
use crate::fixture::{RANKS, two_bricks};
use crate::model;
use crate::scene::Method;

/// Parts of the error that differ much and are the same on any ranks: by the place of an element.
fn parts(discrete: &Discrete) -> Vec<Vec<f64>> {
    let of = |s: &crate::decomposition::Subdomain| {
        let centre = |nodes: &[u32]| nodes.iter().map(|&n| s.points[n as usize][0]).sum::<f64>() / nodes.len() as f64;
        s.elements.iter().map(|nodes| (-3.0 * centre(nodes)).exp()).collect()
    };
    discrete.decomposition.subdomains.iter().map(of).collect()
}

#[test]
fn meshes_and_displacements_are_the_same_on_any_ranks_and_again() {
    let start = start(&two_bricks(&["decomposition.subdomains=6"]), |_| false).unwrap();
    let scene = &start.scene;
    let found = RANKS.map(|ranks| {
        let of_ranks = threads::run(ranks, |comm| {
            let mut adaptive = Adaptive::new(scene, &start.read, comm).unwrap();
            let begin = adaptive.unknowns();
            let mut torn = Vec::new();
            for _ in 0..2 {
                let discrete = model::discretise_meshes(scene, adaptive.meshes(scene), None, comm).unwrap();
                let u = discrete
                    .decomposition
                    .subdomains
                    .iter()
                    .map(|s| s.points.iter().flat_map(|x| [x[0] * x[1], x[2], 1.0]).collect())
                    .collect();
                let wanted = wanted(comm, &discrete, &parts(&discrete), 0.5);
                adaptive.refine(comm, (&discrete, &u), wanted);
                let discrete = model::discretise_meshes(scene, adaptive.meshes(scene), None, comm).unwrap();
                torn = adaptive.displacement(comm, &discrete);
                for (subdomain, u) in discrete.decomposition.subdomains.iter().zip(&torn) {
                    for (x, u) in subdomain.points.iter().zip(u.as_chunks::<3>().0) {
                        assert!((u[0] - x[0] * x[1]).abs() + (u[1] - x[2]).abs() + (u[2] - 1.0).abs() < 1e-13);
                    }
                }
            }
            assert!(adaptive.unknowns() > 2 * begin);
            (torn.concat().iter().map(|x| x.to_bits()).collect::<Vec<_>>(), adaptive.unknowns())
        });
        let unknowns = of_ranks[0].1;
        (of_ranks.into_iter().flat_map(|(bits, _)| bits).collect::<Vec<_>>(), unknowns)
    });
    assert!(found.iter().all(|other| *other == found[0]));
}

#[test]
fn what_is_marked_leaves_the_share_as_far_as_can_be_foretold() {
    let Start { scene, .. } = start(&two_bricks(&[]), |_| false).unwrap();
    let comm = &crate::comm::solo::Solo;
    let discrete = model::discretise(&scene, comm).unwrap();
    let parts = parts(&discrete);
    let (count, all) = (parts.concat().len(), total(comm, &parts));
    let mut before = 0;
    for share in [0.9, 0.6, 0.3] {
        let wanted = wanted(comm, &discrete, &parts, share);
        let marked: usize = wanted.iter().map(Vec::len).sum();
        assert!(marked > before && marked < count, "{share}: {marked} of {count}");
        before = marked;
        assert!(wanted.iter().flatten().all(|(_, times)| (1..=6).contains(times)));
    }
    // The least share that six bisections can leave is not reached: all are bisected.
    assert_eq!(wanted(comm, &discrete, &parts, 1e-3 * all / all).concat().len(), count);
}

#[test]
fn a_scene_begins_on_few_quadratic_tetrahedra() {
    let scene = two_bricks(&[]);
    let Start { scene: begun, notes, .. } = start(&scene, |_| false).unwrap();
    assert!(begun.body.values().all(|body| body.element == Kind::Tet10 && body.brick().is_none()));
    assert_eq!(begun.decomposition.method, Method::Auto);
    assert!(notes.iter().any(|note| note.contains("lower: begins with 4 x 2 x 2 cells")), "{notes:?}");
    assert!(notes.iter().any(|note| note.contains("tet10 in place of tet4")));
    let Start { scene: kept, .. } = start(&scene, |name| name == "lower").unwrap();
    assert_eq!(kept.body.values().map(|body| body.element).collect::<Vec<_>>(), [Kind::Tet4, Kind::Tet10]);
    let hexahedra = two_bricks(&["body.lower.element=hex8"]);
    assert!(start(&hexahedra, |_| true).err().unwrap().contains("only tet4 and tet10 can be refined"));
    assert!(start(&hexahedra, |_| false).is_ok());
}
