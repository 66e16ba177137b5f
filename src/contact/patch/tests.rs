use std::collections::BTreeSet;

use super::*;
use crate::contact::pairing::Rule;
use crate::contact::{Conditions, ContactPair, MasterNode, matching, mortar, quadratic};
use crate::fixture::{RANKS, Setup, not_matching, on_ranks, two_bricks, two_bricks_by_metis, two_meshes};
use crate::scene::Scene;

/// Scenes whose contacts are on many ranks: matching and not, of all kinds of faces, flat and curved, in boxes and parts.
fn scenes() -> Vec<Scene> {
    let each = |element: &str| ["lower", "upper"].map(|body| format!("body.{body}.element={element}"));
    let (hex8, tet10) = (each("hex8"), each("tet10"));
    let with = |sets: &[String; 2], more: &[&str]| -> Vec<String> {
        sets.iter().cloned().chain(more.iter().map(|set| set.to_string())).collect()
    };
    let set =
        |make: &dyn Fn(&[&str]) -> Scene, sets: Vec<String>| make(&sets.iter().map(|set| &set[..]).collect::<Vec<_>>());
    vec![
        two_bricks(&["decomposition.cells=[1, 1, 1]"]),
        two_bricks_by_metis(24),
        set(&two_bricks, with(&hex8, &["decomposition.cells=[1, 1, 1]"])),
        set(&two_bricks, with(&tet10, &["decomposition.cells=[1, 1, 1]"])),
        not_matching(&["decomposition.cells=[1, 1, 1]"]),
        not_matching(&["decomposition.subdomains=15"]),
        not_matching(&["decomposition.cells=[1, 1, 1]", "support.right.surface=upper.xmin"]),
        set(&not_matching, with(&hex8, &["decomposition.cells=[1, 2, 1]"])),
        set(&not_matching, with(&tet10, &["decomposition.cells=[1, 2, 1]"])),
        two_meshes(12),
        rings([2, 2]),
        rings([3, 2]),
    ]
}

/// A quarter of a ring in another one, of curved quadratic elements, with so many cells around each.
fn rings(around: [usize; 2]) -> Scene {
    let ring = |name: &str, inner: f64, around: usize| {
        let cylinder =
            format!("inner = {inner:.1}, outer = {:.1}, height = 2.0, cells = [{around}, 1, 2]", inner + 1.0);
        format!(
            r#"
            body.{name} = {{ material = "steel", element = "tet10", cylinder = {{ {cylinder} }} }}
            support.{name}-x = {{ surface = "{name}.x0", fix = ["x"] }}
            support.{name}-y = {{ surface = "{name}.y0", fix = ["y"] }}
            support.{name}-z = {{ surface = "{name}.bottom", fix = ["z"] }}"#
        )
    };
    let text = format!(
        r#"
        material.steel = {{ young = 210.0, poisson = 0.3 }}
        contact.joint = {{ slave = "inside.outer", master = "outside.inner" }}
        load.bore = {{ surface = "inside.inner", pressure = 1.0 }}
        decomposition.subdomains = 11
        {}
        {}"#,
        ring("inside", 1.0, around[0]),
        ring("outside", 2.0, around[1])
    );
    Scene::from_text(&text, "rings", 1, &[]).expect("the scene is sound")
}

/// The conditions of the whole surfaces, as every rank would find them that sees these.
fn whole(setup: &Setup) -> (Conditions, Rule) {
    let discrete = &setup.discrete;
    let gather = |surface: usize| GatheredSurface::gather(setup.comm, setup.subdomains(), surface);
    let surfaces = discrete.contacts.surfaces[0];
    let (slave, master) = (gather(surfaces.slave), gather(surfaces.master.expect("it has two sides")));
    if let Some(found) = matching::pair(0, &slave, &master) {
        let pairs = quadratic::conditions(&slave, quadratic::SHARE, found.pairs);
        return (Conditions { pairs, ..found }, Rule::NodeToNode);
    }
    let interface = &discrete.decomposition.interface;
    let held = crate::constraint::dirichlet::fixed_at(setup.comm, interface, &discrete.supports, &slave.nodes);
    (mortar::pair(0, "joint", &slave, &master, &held).expect("they face each other"), Rule::Mortar)
}

#[test]
fn ranks_find_the_conditions_of_the_whole_surfaces_bit_by_bit_and_know_those_of_their_nodes() {
    for (number, scene) in scenes().iter().enumerate() {
        let (expected, rule) = on_ranks(scene, 1, whole).remove(0);
        assert_eq!(rule == Rule::Mortar, (4..=8).contains(&number) || number == 11, "{number}");
        for ranks in RANKS.into_iter().chain([9]) {
            let found = on_ranks(scene, ranks, |setup| {
                let contacts = &setup.discrete.contacts;
                assert_eq!(contacts.pairs.total(), expected.pairs.len(), "{number}: {ranks} ranks");
                for (k, pair) in contacts.pairs.iter() {
                    assert_eq!(*pair, expected.pairs[k], "{number}: {ranks} ranks");
                }
                let nodes: BTreeSet<u64> = setup.subdomains().iter().flat_map(|s| s.nodes.iter().copied()).collect();
                let here =
                    |pair: &ContactPair| pair.slaves.iter().chain(&pair.masters).any(|(node, _)| nodes.contains(node));
                let missing = |k: &usize| here(&expected.pairs[*k]) && contacts.pairs.get(*k).is_none();
                assert_eq!((0..expected.pairs.len()).find(missing), None, "{number}: {ranks} ranks");
                // So are the nodes of the master.
                let key = |m: &MasterNode| (m.node, m.part, m.pairs[0].0);
                let mut masters: Vec<&MasterNode> =
                    expected.masters.iter().filter(|m| nodes.contains(&m.node)).collect();
                masters.sort_by_key(|m| key(m));
                assert!(contacts.masters.iter().eq(masters), "{number}: {ranks} ranks");
                contacts.pairs.known()
            });
            // Conditions that share nodes are in one block: of quadratic faces, and where meshes do not match.
            assert!(ranks < 9 || number > 2 || found.iter().any(|known| *known < expected.pairs.len()));
        }
    }
}

#[test]
fn own_nodes_have_the_normals_and_areas_and_smooth_parts_of_the_whole_surface() {
    // A surface that goes round edges: all of a box but one side.
    for scene in scenes() {
        for ranks in RANKS {
            on_ranks(&scene, ranks, |setup| {
                for surface in 0..setup.discrete.surfaces.len() {
                    let whole = GatheredSurface::gather(setup.comm, setup.subdomains(), surface);
                    let patch = Patch::new(setup.comm, &setup.discrete.decomposition, surface);
                    let (here, all) = (patch.surface.normals_and_areas(), whole.normals_and_areas());
                    for (k, (node, part)) in patch.surface.nodes.iter().zip(&patch.surface.parts).enumerate() {
                        if patch.surface.layer(k) != Layer::Rim {
                            let index = whole.index(*node, *part).expect("it is on the surface");
                            assert_eq!(here[k], all[index]);
                        }
                    }
                    let told = (0..here.len()).filter(|&k| patch.surface.tells(k)).count();
                    assert_eq!(crate::comm::sums(setup.comm, [told as u64]), [all.len() as u64]);
                    let [one, other] = [patch.surface.diameter(), whole.diameter()];
                    assert_eq!(one, other);
                    assert!((patch.surface.spacing() - whole.spacing()).abs() < 1e-14 * whole.spacing());
                }
            });
        }
    }
}

#[test]
fn all_faces_along_lines_are_found_wherever_they_are() {
    for scene in [two_bricks(&["decomposition.cells=[1, 1, 1]"]), two_meshes(12)] {
        for ranks in RANKS {
            on_ranks(&scene, ranks, |setup| {
                let surface = setup.discrete.contacts.surfaces[0].slave;
                let whole = GatheredSurface::gather(setup.comm, setup.subdomains(), surface);
                let patch = Patch::new(setup.comm, &setup.discrete.decomposition, surface);
                // Each rank asks for others.
                let mut random = crate::random::Random::new(setup.comm.rank() as u64);
                let mut line = || {
                    let point = std::array::from_fn(|_| 3.0 * random.number() + 1.0);
                    let way: [f64; 3] = std::array::from_fn(|_| random.number());
                    Line { point, direction: way.map(|x| x / dot(way, way).sqrt()), distance: 0.2 }
                };
                let lines: Vec<Line> = (0..10).map(|_| line()).collect();
                let found = patch.near(setup.comm, &lines);
                let corners: Vec<_> = whole.corners().collect();
                let tree = BallTree::new(&corners);
                let name =
                    |of: &GatheredSurface, t: usize| of.triangles[t].map(|slot| (of.nodes[slot], of.parts[slot]));
                let names: BTreeSet<_> = (0..found.triangles.len()).map(|t| name(&found, t)).collect();
                for Line { point, direction, distance } in lines {
                    let near = tree.along(point, direction, distance);
                    assert!(near.into_iter().all(|t| names.contains(&name(&whole, t))), "{ranks} ranks");
                }
                assert!(names.len() <= whole.triangles.len());
            });
        }
    }
}
