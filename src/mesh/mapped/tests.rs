use super::*;
use crate::comm::solo::Solo;
use crate::comm::threads;
use crate::element::sample::samples;
use crate::mesh::faces::Neighbours;
use crate::mesh::quality::Quality;
use crate::mesh::surface::areas;
use crate::vector::length;
use std::f64::consts::PI;

const SPHERE: Mapped = Mapped::Sphere { radii: [100.0, 200.0], cells: [4, 4] };
const CYLINDER: Mapped = Mapped::Cylinder { radii: [100.0, 200.0], height: 30.0, cells: [8, 4, 2] };
const KINDS: [Kind; 3] = [Kind::Tet4, Kind::Hex8, Kind::Tet10];

fn grid() -> Mapped {
    Mapped::Grid { planes: [vec![0.0, 1.0, 3.0], vec![-1.0, 0.0], vec![2.0, 2.5, 4.0, 8.0]] }
}

fn volume(mesh: &SolidMesh) -> f64 {
    let of = |nodes: &[u32]| {
        let places: Vec<[f64; 3]> = nodes.iter().map(|&n| mesh.portion.points[n as usize]).collect();
        samples(mesh.portion.elements.kind(), &places).iter().map(|s| s.weight).sum::<f64>()
    };
    mesh.portion.elements.iter().map(of).sum()
}

fn area(mesh: &SolidMesh, surface: &str) -> f64 {
    let of = |face: &Vec<u32>| {
        let places: Vec<[f64; 3]> = face.iter().map(|&n| mesh.portion.points[n as usize]).collect();
        areas(&places).iter().sum::<f64>()
    };
    mesh.surface(surface).iter().map(of).sum()
}

/// Sound, without holes, with surfaces that cover the boundary; volumes and areas are those of the body, up to facets.
#[test]
fn meshes_are_sound_and_fill_their_bodies() {
    let curved = 10.0 * PI;
    let areas_of = |radius: f64| 0.5 * PI * radius * radius;
    for kind in KINDS {
        let facets = if kind == Kind::Tet10 { 1e-3 } else { 0.02 };
        for (body, exact, inner) in [
            (&SPHERE, PI / 6.0 * 7e6, areas_of(100.0)),
            (&CYLINDER, 0.25 * PI * 3e4 * 30.0, 50.0 * PI * 30.0),
            (&grid(), 18.0, 0.0),
        ] {
            let mesh = body.mesh(&Solo, kind);
            let quality = Quality::of(&Solo, &mesh.portion);
            assert!(quality.is_sound() && quality.worst_shape > 0.05, "{kind:?} {quality:?}");
            assert_eq!(mesh.portion.elements.len() as u64, kind.cell().per_hexahedron() * mesh.counts.cells);
            let neighbours = Neighbours::new(mesh.portion.points.len(), &mesh.portion.elements);
            assert!(neighbours.overlapping.is_empty());
            let named: usize = mesh.surfaces.iter().map(|s| s.faces.len()).sum();
            assert_eq!(named, neighbours.outer(&mesh.portion.elements).count(), "every outer face is on one surface");
            assert!((volume(&mesh) / exact - 1.0).abs() < facets, "{kind:?} {}", volume(&mesh) / exact);
            if inner > 0.0 {
                assert!((area(&mesh, "inner") / inner - 1.0).abs() < facets, "{kind:?} {curved}");
            }
        }
    }
}

#[test]
fn nodes_are_on_the_surfaces_that_they_are_named_for() {
    for kind in KINDS {
        for body in [SPHERE, CYLINDER] {
            let mesh = body.mesh(&Solo, kind);
            let is_sphere = matches!(body, Mapped::Sphere { .. });
            let on = |name: &str, holds: &dyn Fn([f64; 3]) -> bool| {
                let mut nodes = mesh.surface(name).iter().flatten();
                assert!(
                    !mesh.surface(name).is_empty() && nodes.all(|&n| holds(mesh.portion.points[n as usize])),
                    "{name}"
                );
            };
            let radius = |[x, y, z]: [f64; 3]| length([x, y, if is_sphere { z } else { 0.0 }]);
            on("inner", &|x| (radius(x) - 100.0).abs() < 1e-12);
            on("outer", &|x| (radius(x) - 200.0).abs() < 1e-12);
            on("x0", &|x| x[0] == 0.0);
            on("y0", &|x| x[1] == 0.0);
            let (name, end) = if is_sphere { ("z0", 0.0) } else { ("top", 30.0) };
            on(name, &|x| x[2] == end);
        }
        let (mesh, origin) = (grid().mesh(&Solo, kind), [0.0, -1.0, 2.0]);
        for axis in 0..3 {
            let nodes = mesh.surface(["xmin", "ymin", "zmin"][axis]).iter().flatten();
            assert!(nodes.map(|&n| mesh.portion.points[n as usize][axis]).all(|x| x == origin[axis]));
        }
    }
}

/// Nodes are numbered from cell to cell, and that is the same on any ranks.
#[test]
fn numbers_are_those_of_a_walk_along_the_cells_on_any_ranks() {
    let sphere = Mapped::Sphere { radii: [1.0, 2.0], cells: [1, 1] };
    for (kind, body) in KINDS.into_iter().flat_map(|kind| [SPHERE, CYLINDER, grid(), sphere.clone()].map(|b| (kind, b)))
    {
        let mut known = HashMap::new();
        let mut walked = Vec::new();
        for cell in (0..body.mesh(&Solo, kind).counts.cells).map(|cell| body.cell(cell)) {
            let mut number = |key: Key| {
                let next = known.len() as u32;
                *known.entry(key).or_insert(next)
            };
            for key in body.corners(cell) {
                number(key);
            }
            walked.extend(body.elements(cell, kind).into_iter().map(number));
        }
        let alone = body.mesh(&Solo, kind);
        assert!(alone.portion.elements.nodes() == walked && alone.counts.nodes == known.len() as u64, "{kind:?}");
        assert!(known.iter().all(|(&key, &node)| body.place(key) == alone.portion.points[node as usize]));
        for ranks in [2, 5] {
            let parts = threads::run(ranks, |comm| body.mesh(comm, kind));
            let global = |mesh: &SolidMesh| -> Vec<u32> {
                mesh.portion.elements.nodes().iter().map(|&n| mesh.portion.nodes[n as usize]).collect()
            };
            assert_eq!(parts.iter().flat_map(global).collect::<Vec<_>>(), walked);
            for (k, surface) in alone.surfaces.iter().enumerate() {
                let faces = parts.iter().flat_map(|part| part.surfaces[k].faces.clone());
                assert_eq!(faces.collect::<Vec<_>>(), surface.faces, "{}", surface.name);
            }
            for part in parts {
                let own = part.portion.nodes.iter().map(|&node| alone.portion.points[node as usize]);
                assert!(own.eq(part.portion.points.iter().copied()) && part.counts == alone.counts);
            }
        }
    }
}
