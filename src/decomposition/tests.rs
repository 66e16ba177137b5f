use std::collections::{BTreeMap, BTreeSet};

use super::subdomain::Facet;
use super::{Bodies, BodyMesh, Counts, Cut, Patch, Shape, Subdomain, number_bodies, tear};
use crate::comm::solo::Solo;
use crate::comm::words::share;
use crate::comm::{Comm, threads};
use crate::element::tet4::Tet4;
use crate::element::{Element, Kind};
use crate::fixture::{RANKS, Setup, built_in, on_ranks, two_bricks, two_bricks_by_metis, two_meshes};
use crate::mesh::brick::indices;
use crate::mesh::faces::key;
use crate::mesh::surface::area_vector;
use crate::mesh::{Brick, Elements, Portion, SolidMesh};
use crate::model::discrete::discretise;
use crate::scene::Scene;
use crate::sizing::sizes;

/// Boxes and compact parts, one body and two, few elements a part and many.
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
        two_bricks(&["body.upper.element=hex8"]),
        two_bricks(&["body.lower.element=tet10", "body.upper.element=tet10", "decomposition.subdomains=7"]),
        built_in("patch", &["body.lower.element=hex8", "body.upper.element=hex8", "decomposition.subdomains=24"]),
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
    for scene in scenes().into_iter().chain([two_meshes(2), two_meshes(24)]) {
        on_ranks(&scene, 1, |setup| setup.subdomains().iter().for_each(assert_hangs_together));
    }
}

#[track_caller]
fn assert_hangs_together(subdomain: &Subdomain) {
    let mut reached = BTreeSet::from([0]);
    let mut front = vec![0];
    while let Some(element) = front.pop() {
        for (other, nodes) in subdomain.elements.iter().enumerate() {
            let shared = nodes.iter().filter(|n| subdomain.elements.get(element).contains(n)).count();
            if shared == subdomain.elements.kind().faces()[0].len() && reached.insert(other) {
                front.push(other);
            }
        }
    }
    assert_eq!(reached.len(), subdomain.elements.len());
}

#[test]
fn every_element_is_in_exactly_one_subdomain() {
    for scene in scenes() {
        on_ranks(&scene, 1, |setup| {
            let global = |s: &Subdomain| -> Vec<Vec<u64>> {
                s.elements.iter().map(|nodes| nodes.iter().map(|&n| s.nodes[n as usize]).collect()).collect()
            };
            let mut torn: Vec<Vec<u64>> = setup.subdomains().iter().flat_map(global).collect();
            let of_body = |b: &BodyMesh| -> Vec<Vec<u64>> {
                let element = |e| b.element(e).into_iter().map(|n| b.first_node + n).collect();
                (0..b.counts().elements).map(element).collect()
            };
            let mut whole: Vec<Vec<u64>> = setup.discrete.bodies.iter().flat_map(of_body).collect();
            torn.sort_unstable();
            whole.sort_unstable();
            assert_eq!(torn, whole, "{:?}", scene.decomposition);
        });
    }
}

#[test]
fn subdomains_are_the_same_on_any_number_of_ranks_and_idle_ranks_do_no_harm() {
    type Plain = (usize, usize, Vec<u64>, Elements, Vec<Facet>, Vec<u32>);
    let plain = |s: &Subdomain| -> Plain {
        (s.id, s.body, s.nodes.clone(), s.elements.clone(), s.facets.clone(), s.boundary.clone())
    };
    for scene in [two_bricks(&[]), two_bricks_by_metis(7), two_meshes(7)] {
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
    let hexahedra = two_bricks(&["body.upper.element=hex8", "decomposition.subdomains=5"]);
    let quadratic = two_bricks(&["body.lower.element=tet10", "body.upper.element=tet10"]);
    for scene in [two_bricks(&[]), two_bricks_by_metis(24), built_in("patch", &[]), hexahedra, quadratic] {
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
        let (brick, Patch::Face(face)) = (body.lattice().unwrap(), &surface.patch) else { panic!("bodies are bricks") };
        for node in 0..brick.node_count() {
            if brick.is_on(*face, brick.node_position(node)) {
                result.entry(body.first_node + node).or_default().push(index as u32);
            }
        }
    }
    result
}

/// Volume of each body and, of each surface, the upward component of area times normal: what is on one rank.
fn volumes_and_areas(setup: &Setup) -> [Vec<f64>; 2] {
    let mut volumes = vec![0.0; setup.discrete.bodies.len()];
    let mut areas = vec![0.0; setup.discrete.surfaces.len()];
    for subdomain in setup.subdomains() {
        let at = |nodes: &[u32]| -> Vec<_> { nodes.iter().map(|&n| subdomain.points[n as usize]).collect() };
        for tet in &subdomain.elements {
            volumes[subdomain.body] += Tet4::points(&at(tet).try_into().unwrap())[0].weight;
        }
        for facet in &subdomain.facets {
            areas[facet.surface] += area_vector(&at(&facet.nodes).try_into().unwrap())[2];
        }
    }
    [volumes, areas]
}

#[test]
fn subdomains_of_meshes_fill_their_bodies_and_have_their_surfaces() {
    for (parts, ranks) in [(2, 1), (7, 3), (24, 5)] {
        let found = on_ranks(&two_meshes(parts), ranks, volumes_and_areas);
        // Surfaces are ordered by name: base and top of either body.
        for (quantity, expected) in [(0, vec![2.0; 2]), (1, vec![-2.0, 2.0, -2.0, 2.0])] {
            for (k, expected) in expected.into_iter().enumerate() {
                let sum: f64 = found.iter().map(|rank| rank[quantity][k]).sum();
                assert!((sum - expected).abs() < 1e-13, "{sum} instead of {expected}");
            }
        }
    }
}

fn mesh_of(bricks: &[Brick]) -> SolidMesh {
    let (mut points, mut nodes) = (Vec::new(), Vec::new());
    for brick in bricks {
        let first = points.len() as u32;
        points.extend(indices(&brick.all_nodes()).map(|at| brick.coordinates(at)));
        let tets = indices(&brick.all_cells()).flat_map(|cell| brick.tets(cell)).flatten();
        nodes.extend(tets.map(|n| first + n as u32));
    }
    let portion = Portion::new(Kind::Tet4, 0, &nodes, |node| points[node as usize]);
    let counts = Counts { nodes: points.len() as u64, cells: 0, elements: portion.len() as u64 };
    SolidMesh { pieces: vec![0; portion.len()], portion, surfaces: Vec::new(), piece_count: 1, counts }
}

/// A rank's share of a mesh that all of them have.
fn of_rank(comm: &dyn Comm, mesh: &SolidMesh) -> SolidMesh {
    let Portion { elements, wholes, points, .. } = &mesh.portion;
    let own = share(elements.len() as u64, comm);
    let places = own.start as usize..own.end as usize;
    let nodes: Vec<u32> = places.clone().flat_map(|at| elements.get(at)).copied().collect();
    let portion = Portion::new(elements.kind(), own.start as u32, &nodes, |node| points[node as usize]);
    let portion = Portion { wholes: wholes[places.clone()].to_vec(), ..portion };
    SolidMesh { portion, pieces: mesh.pieces[places].to_vec(), ..mesh.clone() }
}

#[test]
fn a_body_of_several_pieces_is_cut_piece_by_piece() {
    let brick = |x: f64, cells| Brick { origin: [x, 0.0, 0.0], size: [1.0; 3], cells };
    let mut mesh = mesh_of(&[brick(0.0, [4, 4, 4]), brick(2.0, [1, 1, 1]), brick(4.0, [4, 4, 2])]);
    let elements = mesh.portion.len();
    (mesh.pieces, mesh.piece_count) = ([vec![0; 384], vec![1; 6], vec![2; 192]].concat(), 3);
    let bodies = number_bodies([(Kind::Tet4, Shape::Mesh(mesh.counts), vec![0])]);
    let meshes = BTreeMap::from([(0, mesh)]);
    for parts in [1, 3, 12] {
        let torn = Bodies { bodies: &bodies, surfaces: &[] };
        let subdomains = tear(&torn, meshes.clone(), Cut::Parts(parts), &|_| Vec::new(), None, &Solo).subdomains;
        assert!(subdomains.len() >= parts.max(3));
        assert_eq!(subdomains.iter().map(|s| s.elements.len()).sum::<usize>(), elements);
        subdomains.iter().for_each(assert_hangs_together);
    }
}

#[test]
fn thin_plates_and_bodies_of_few_elements_are_cut() {
    for (cells, size, parts) in
        [([24, 24, 1], [1.0, 1.0, 1e-3], 16), ([1, 1, 1], [1.0; 3], 4), ([2, 1, 1], [1.0; 3], 40)]
    {
        let brick = Brick { origin: [0.0; 3], size, cells };
        let bodies = number_bodies([(Kind::Tet4, Shape::Brick(brick), vec![0])]);
        let torn = Bodies { bodies: &bodies, surfaces: &[] };
        let subdomains = tear(&torn, BTreeMap::new(), Cut::Parts(parts), &|_| Vec::new(), None, &Solo).subdomains;
        subdomains.iter().for_each(assert_hangs_together);
        let elements = brick.element_count() as usize;
        assert_eq!(subdomains.iter().map(|s| s.elements.len()).sum::<usize>(), elements);
        let wanted = parts.min(elements);
        assert!(parts > elements || (wanted..=wanted * 5 / 4).contains(&subdomains.len()), "{}", subdomains.len());
    }
}

#[test]
fn regions_are_cut_one_by_one_by_their_size() {
    let mut mesh = mesh_of(&[Brick { origin: [0.0; 3], size: [1.0; 3], cells: [8, 4, 4] }]);
    // A quarter of the body between two parts of the rest.
    let region = |nodes: &[u32]| {
        let x = nodes.iter().map(|&n| mesh.portion.points[n as usize][0]).sum::<f64>() / 4.0;
        u32::from((0.25..0.5).contains(&x))
    };
    mesh.portion.wholes = mesh.portion.elements.iter().map(region).collect();
    let bodies = number_bodies([(Kind::Tet4, Shape::Mesh(mesh.counts), vec![2, 5])]);
    let cut = |parts: usize, ranks: usize| {
        let subdomains = threads::run(ranks, |comm| {
            let torn = Bodies { bodies: &bodies, surfaces: &[] };
            let meshes = BTreeMap::from([(0, of_rank(comm, &mesh))]);
            tear(&torn, meshes, Cut::Parts(parts), &|_| Vec::new(), None, comm).subdomains
        });
        subdomains.concat()
    };
    for parts in [2, 8] {
        let subdomains = cut(parts, 1);
        subdomains.iter().for_each(assert_hangs_together);
        let mut elements = BTreeMap::<usize, Vec<usize>>::new();
        for subdomain in &subdomains {
            let x = |nodes: &[u32]| nodes.iter().map(|&n| subdomain.points[n as usize][0]).sum::<f64>() / 4.0;
            assert!(subdomain.elements.iter().all(|e| (0.25..0.5).contains(&x(e)) == (subdomain.material == 5)));
            elements.entry(subdomain.material).or_default().push(subdomain.elements.len());
        }
        let parts_of = |material| elements[&material].len();
        assert_eq!([parts_of(2), parts_of(5)], if parts == 2 { [2, 1] } else { [6, 2] });
        assert_eq!([2, 5].map(|material| elements[&material].iter().sum::<usize>()), [576, 192]);
        for ranks in RANKS {
            assert!(cut(parts, ranks) == subdomains, "{ranks} ranks");
        }
    }
}

#[test]
fn boxes_that_yield_are_spread_over_the_ranks() {
    let brick = |cells| Brick { origin: [0.0; 3], size: [1.0; 3], cells };
    let shapes = [[8, 4, 6], [4, 4, 4]].map(|cells| (Kind::Tet4, Shape::Brick(brick(cells)), vec![0]));
    let bodies = number_bodies(shapes);
    // The upper half of the first body, and a corner of the other.
    let upper: Vec<bool> = (0..24).map(|k| k >= 12).collect();
    let corner: Vec<bool> = (0..8).map(|k| k < 3).collect();
    let yielding = [upper, corner];
    let cut = |expected: Option<&[Vec<bool>]>, ranks: usize| {
        threads::run(ranks, |comm| {
            let torn = Bodies { bodies: &bodies, surfaces: &[] };
            let none = &|_| Vec::new();
            let own = tear(&torn, BTreeMap::new(), Cut::Bricks([2, 2, 2]), none, expected, comm).subdomains;
            own.iter().map(|s| (s.body, s.nodes.clone())).collect::<Vec<_>>()
        })
    };
    let plain: Vec<_> = cut(None, 1).concat();
    // Without expectations boxes come in the order of their bodies, x fastest.
    let kind = |subdomain: &(usize, Vec<u64>)| {
        let before = plain.iter().take_while(|&other| other != subdomain).filter(|s| s.0 == subdomain.0).count();
        (subdomain.0, yielding[subdomain.0][before])
    };
    for ranks in RANKS {
        let parts = cut(Some(&yielding), ranks);
        assert_eq!(parts.concat(), cut(Some(&yielding), 1).concat(), "numbers do not depend on the ranks");
        assert_eq!(BTreeSet::from_iter(parts.concat()), BTreeSet::from_iter(plain.clone()));
        for wanted in [(0, false), (0, true), (1, false), (1, true)] {
            let counts: Vec<usize> = parts.iter().map(|own| own.iter().filter(|s| kind(s) == wanted).count()).collect();
            let total: usize = counts.iter().sum();
            assert!(counts.iter().all(|&n| (n * ranks).abs_diff(total) <= 2 * ranks), "{wanted:?}: {counts:?}");
        }
    }
}

#[test]
fn clusters_hang_together_and_are_the_same_on_any_ranks() {
    let bricks = ["body.lower.brick.cells=[12, 4, 4]", "decomposition.cluster=8"];
    let metis = ["decomposition.subdomains=24", "decomposition.cluster=4"];
    for (scene, wanted) in [(two_bricks(&bricks), 4), (two_bricks(&metis), 6)] {
        let clusters = |ranks: usize| -> Vec<Vec<Subdomain>> {
            let of_rank = |setup: &Setup| (setup.discrete.decomposition.clusters.clone(), setup.subdomains().to_vec());
            let (clusters, subdomains): (Vec<_>, Vec<_>) = on_ranks(&scene, ranks, of_rank).into_iter().unzip();
            let (clusters, subdomains) = (&clusters[0], subdomains.concat());
            let members = |cluster| clusters.first(cluster)..clusters.first(cluster + 1);
            (0..clusters.total()).map(|cluster| subdomains[members(cluster)].to_vec()).collect()
        };
        let alone = clusters(1);
        assert_eq!(alone.len(), wanted, "{:?}", scene.decomposition);
        for members in &alone {
            assert!(members.iter().all(|s| s.body == members[0].body));
            // From the first by whole faces of elements.
            let faces = |s: &Subdomain| -> BTreeSet<Vec<u32>> {
                let all = (0..s.elements.len()).flat_map(|e| (0..s.elements.kind().faces().len()).map(move |f| (e, f)));
                let global =
                    |(e, f)| s.elements.face(e, f).iter().map(|&n| s.nodes[n as usize] as u32).collect::<Vec<_>>();
                all.map(|at| key(&global(at))).collect()
            };
            let faces: Vec<_> = members.iter().map(faces).collect();
            let mut reached = vec![0];
            for at in 0..members.len() {
                let Some(&from) = reached.get(at) else { panic!("{} of {} members", reached.len(), members.len()) };
                let next =
                    (0..members.len()).filter(|&to| !reached.contains(&to) && !faces[to].is_disjoint(&faces[from]));
                let next: Vec<usize> = next.collect();
                reached.extend(next);
            }
        }
        for ranks in RANKS {
            assert!(clusters(ranks) == alone, "{ranks} ranks");
        }
    }
}
