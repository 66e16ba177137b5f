use std::collections::{BTreeMap, BTreeSet};

use super::{Facet, Patch, Subdomain};
use crate::comm::threads;
use crate::fixture::{RANKS, Setup, built_in, on_ranks, two_bricks, two_bricks_by_metis};
use crate::scene::Scene;
use crate::study::{discretise, sizes};

/// Bricks and METIS, one body and two, few elements a part and many.
fn scenes() -> Vec<Scene> {
    let bar = |parts: usize| built_in("bar", &[&format!("decomposition.subdomains={parts}")]);
    vec![
        two_bricks(&[]),
        built_in("patch", &[]),
        bar(7),
        bar(24),
        two_bricks_by_metis(7),
        two_bricks_by_metis(24),
        built_in("patch", &["decomposition.subdomains=24"]),
    ]
}

#[test]
fn sizes_are_those_of_the_papers_table_2() {
    for (level, ranks, nodes, subdomains, primal, rows) in [
        (1, 1, 7502, 6, 23958, [1452, 726, 275]),
        (1, 5, 7502, 6, 23958, [1452, 726, 275]),
        (2, 2, 53802, 48, 191664, [30258, 2646, 1029]),
    ] {
        let scene = Scene::load("two-blocks", level, &[]).unwrap();
        let found = threads::run(ranks, |comm| {
            let discrete = discretise(&scene, comm).unwrap();
            let nodes: u64 = discrete.bodies.iter().map(|body| body.counts().nodes).sum();
            assert_eq!((nodes, discrete.decomposition.shares.total()), (nodes, subdomains));
            let found = sizes(&discrete, comm);
            assert_eq!([found.gluing_rows, found.dirichlet_rows, found.contact_rows], rows);
            let own = &discrete.decomposition.subdomains;
            (nodes, own.len(), own.iter().map(Subdomain::dofs).sum::<usize>())
        });
        assert!(found.iter().all(|f| f.0 == nodes));
        assert_eq!(found.iter().map(|f| f.1).sum::<usize>(), subdomains);
        assert_eq!(found.iter().map(|f| f.2).sum::<usize>(), primal);
    }
}

#[test]
fn every_subdomain_hangs_together_by_whole_faces() {
    for scene in scenes() {
        on_ranks(&scene, 1, |setup| {
            for subdomain in setup.subdomains() {
                let mut reached = BTreeSet::from([0]);
                let mut front = vec![0];
                while let Some(element) = front.pop() {
                    for (other, nodes) in subdomain.elements.iter().enumerate() {
                        let shared = nodes.iter().filter(|n| subdomain.elements[element].contains(n)).count();
                        if shared == 3 && reached.insert(other) {
                            front.push(other);
                        }
                    }
                }
                assert_eq!(reached.len(), subdomain.elements.len(), "{:?}", scene.decomposition);
            }
        });
    }
}

#[test]
fn every_element_is_in_exactly_one_subdomain() {
    for scene in scenes() {
        on_ranks(&scene, 1, |setup| {
            let global = |s: &Subdomain| -> Vec<[u64; 4]> {
                s.elements.iter().map(|tet| tet.map(|n| s.nodes[n as usize])).collect()
            };
            let mut torn: Vec<[u64; 4]> = setup.subdomains().iter().flat_map(global).collect();
            let mut whole: Vec<[u64; 4]> = setup
                .discrete
                .bodies
                .iter()
                .flat_map(|b| (0..b.counts().elements).map(|e| b.brick().unwrap().tet(e).map(|n| b.first_node + n)))
                .collect();
            torn.sort_unstable();
            whole.sort_unstable();
            assert_eq!(torn, whole, "{:?}", scene.decomposition);
        });
    }
}

#[test]
fn subdomains_are_the_same_on_any_number_of_ranks_and_idle_ranks_do_no_harm() {
    type Plain = (usize, usize, Vec<u64>, Vec<[u32; 4]>, Vec<Facet>, Vec<u32>);
    let plain = |s: &Subdomain| -> Plain {
        (s.id, s.body, s.nodes.clone(), s.elements.clone(), s.facets.clone(), s.boundary.clone())
    };
    for scene in [two_bricks(&[]), two_bricks_by_metis(7)] {
        let torn =
            |ranks| on_ranks(&scene, ranks, |setup| setup.subdomains().iter().map(plain).collect::<Vec<_>>()).concat();
        let alone = torn(1);
        for ranks in [2, 3, 5, 20] {
            assert!(torn(ranks) == alone, "{ranks} ranks, {:?}", scene.decomposition);
        }
    }
}

#[test]
fn every_copy_of_a_node_knows_all_others_and_its_surfaces() {
    for scene in [two_bricks(&[]), two_bricks_by_metis(24), built_in("patch", &[])] {
        for ranks in RANKS {
            let per_rank = on_ranks(&scene, ranks, |setup| {
                let nodes: Vec<_> = setup.subdomains().iter().map(|s| (s.id as u32, s.nodes.clone())).collect();
                (nodes, setup.discrete.decomposition.interface.clone(), surfaces_of_nodes(setup))
            });
            let mut copies: BTreeMap<u64, Vec<u32>> = BTreeMap::new();
            for (id, nodes) in per_rank.iter().flat_map(|r| &r.0) {
                nodes.iter().for_each(|&node| copies.entry(node).or_default().push(*id));
            }
            for (own, interface, surfaces) in &per_rank {
                let holds = |copies: &[u32]| own.iter().any(|(id, _)| copies.contains(id));
                let surfaces = |node: &u64| surfaces.get(node).cloned().unwrap_or_default();
                let expected: Vec<_> = copies
                    .iter()
                    .filter(|(node, copies)| holds(copies) && (copies.len() > 1 || !surfaces(node).is_empty()))
                    .map(|(&node, copies)| (node, copies.clone(), surfaces(&node)))
                    .collect();
                let found: Vec<_> = interface.iter().map(|n| (n.node, n.copies.clone(), n.surfaces.clone())).collect();
                assert_eq!(found, expected, "{ranks} ranks, {:?}", scene.decomposition);
            }
        }
    }
}

/// Named surfaces of all nodes, from the positions in their bricks.
fn surfaces_of_nodes(setup: &Setup) -> BTreeMap<u64, Vec<u32>> {
    let mut result: BTreeMap<u64, Vec<u32>> = BTreeMap::new();
    for (index, surface) in setup.discrete.surfaces.iter().enumerate() {
        let body = &setup.discrete.bodies[surface.body];
        let (brick, Patch::Face(face)) = (body.brick().unwrap(), &surface.patch) else { panic!("bodies are bricks") };
        for node in 0..brick.node_count() {
            if brick.is_on(*face, brick.node_position(node)) {
                result.entry(body.first_node + node).or_default().push(index as u32);
            }
        }
    }
    result
}
