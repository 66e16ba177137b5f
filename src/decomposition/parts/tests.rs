use std::collections::BTreeSet;

use super::super::number_bodies;
use super::*;
use crate::comm::solo::Solo;
use crate::element::Kind;
use crate::mesh::Brick;
use crate::mesh::faces::Neighbours;

#[test]
fn parts_are_balanced_and_more_compact_than_those_of_metis_with_as_few_shared_nodes() {
    let brick = Brick { origin: [0.0; 3], size: [3.0, 1.0, 1.0], cells: [24, 8, 8] };
    for (kind, wanted) in [(Kind::Tet4, 24), (Kind::Tet4, 60), (Kind::Hex8, 24)] {
        let bodies = number_bodies([(kind, Shape::Brick(brick), vec![0])]);
        let Cut { portion, sizes, .. } = Cut::new(Dealt::new(&bodies[0], None, &Solo), vec![wanted], &[], &Solo);
        assert_eq!(sizes.len(), wanted as usize);
        let mean = portion.len() as f64 / f64::from(wanted);
        assert!(sizes.iter().all(|&size| (size as f64 / mean - 1.0).abs() < 0.25), "{sizes:?} around {mean}");

        let neighbours = Neighbours::new(portion.nodes.len(), &portion.elements);
        let faces = |element| neighbours.of(element).map(move |other| ((element as u32, other), 1));
        let faces = (0..portion.len()).flat_map(faces).collect();
        let metis = groups(portion.len(), faces, &[portion.len() / wanted as usize]).swap_remove(0);
        let shared = |part: &[u32]| {
            let copies = portion.elements.iter().zip(part).flat_map(|(nodes, p)| nodes.iter().map(move |&n| (n, *p)));
            copies.collect::<BTreeSet<_>>().len() - brick.node_count() as usize
        };
        let centres = portion.centres();
        let inertia = |part: &[u32]| -> f64 {
            let of_part = |k: u32| -> f64 {
                let points: Vec<_> = centres.iter().zip(part).filter(|(_, p)| **p == k).collect();
                let mean = [0, 1, 2].map(|a| points.iter().map(|p| p.0[a]).sum::<f64>() / points.len() as f64);
                points.iter().map(|p| (0..3).map(|a| (p.0[a] - mean[a]).powi(2)).sum::<f64>()).sum()
            };
            (0..wanted + 2).map(of_part).filter(|x| x.is_finite()).sum()
        };
        let found = [&portion.part, &metis].map(|part| (shared(part), inertia(part)));
        assert!(found[0].1 < found[1].1 && found[0].0 * 10 <= found[1].0 * 11, "{kind:?}, {wanted}: {found:?}");
    }
}
