use std::collections::HashMap;

use faer::Mat;

use super::prescribed::Prescribed;
use super::reach::rounds;
use super::{ConstraintError, Constraints, Kind, Row, Support};
use super::{contact, dirichlet};
use crate::comm::all_gather_u64;
use crate::contact::ContactPair;
use crate::decomposition::{InterfaceNode, Subdomain};
use crate::fixture::{
    RANKS, Setup, assert_close, built_in, column, long_contact, not_matching, on_ranks, quarters, two_bricks,
    two_bricks_by_metis,
};
use crate::scene::Scene;

/// Contact of subdomains that do not match, nodes with eight copies, compact parts.
fn scenes() -> [Scene; 5] {
    [
        two_bricks(&[]),
        two_bricks(&["contact.joint.friction=0.3"]),
        two_bricks_by_metis(9),
        built_in("patch", &[]),
        built_in("patch", &["decomposition.subdomains=12"]),
    ]
}

#[test]
fn rows_are_orthonormal() {
    for scene in scenes() {
        on_ranks(&scene, 1, |setup| {
            let b = setup.dense_rows();
            assert_close(&(&b * b.transpose()), &Mat::identity(b.nrows(), b.nrows()), 1e-14);
        });
    }
    let most = on_ranks(&built_in("patch", &[]), 1, |setup| {
        setup.discrete.decomposition.interface.iter().map(|n| n.copies.len()).max()
    });
    assert_eq!(most, [Some(8)]);
}

#[test]
fn rows_are_as_long_as_the_root_of_the_stiffness_they_work_against() {
    let materials = r#"{ left-low = "stiff", left-high = "soft", right-low = "soft", right-high = "stiff" }"#;
    // A jump of 2^20.
    let jump = format!("material.soft.young={:?}", 200.0 / f64::from(1 << 20));
    let scene = quarters(materials, &[&jump, "decomposition.subdomains=12"]);
    on_ranks(&scene, 1, |setup| {
        let b = setup.dense_rows();
        let lengths: Vec<f64> = setup.rows().iter().map(|row| row.length).collect();
        let squares = Mat::from_fn(b.nrows(), b.nrows(), |i, j| if i == j { lengths[i] * lengths[i] } else { 0.0 });
        assert_close(&(&b * b.transpose()), &squares, 1e-14);
        let soft: Vec<bool> = setup.subdomains().iter().map(|s| s.material == 0).collect();
        let mut found = [0; 2];
        for row in setup.rows() {
            let soft: Vec<bool> = row.terms.iter().map(|term| soft[term.subdomain as usize]).collect();
            // What joins a soft copy to others gives way as it does.
            let (easy, power) = (soft.contains(&true), row.length.log2());
            assert!(if easy { (-10.0..=-8.0).contains(&power) } else { power == 0.0 }, "{row:?}");
            found[usize::from(easy)] += 1;
        }
        assert!(found.iter().all(|&count| count > 10), "{found:?}");
    });
}

#[test]
fn rows_of_meshes_that_do_not_match_are_unit_vectors_and_independent() {
    // The second one holds slave nodes along the normal.
    for sets in [&[][..], &["support.right.surface=upper.xmin"], &["decomposition.subdomains=11"]] {
        let independent = |setup: &Setup| {
            let b = setup.dense_rows();
            let gram = &b * b.transpose();
            assert!((0..b.nrows()).all(|row| (gram[(row, row)] - 1.0).abs() < 1e-14));
            let eigenvalues = gram.self_adjoint_eigenvalues(faer::Side::Lower).expect("they exist");
            assert!(eigenvalues[0] > 1e-3, "{sets:?}: {}", eigenvalues[0]);
            (0..b.nrows()).filter(|&row| !setup.rows()[row].law().always_holds()).count()
        };
        let contacts = on_ranks(&not_matching(sets), 1, independent)[0];
        // Nodes of the slave surface over the master: 4 of 5 columns, less the one that is held.
        assert_eq!(contacts, if sets.contains(&"support.right.surface=upper.xmin") { 15 } else { 20 });
    }
}

/// A rigid motion of space: displacement of a point.
fn motion(point: [f64; 3]) -> [f64; 3] {
    let (shift, turn) = ([0.3, -0.7, 0.2], [0.4, 0.5, -0.6]);
    std::array::from_fn(|a| {
        let (b, c) = ((a + 1) % 3, (a + 2) % 3);
        shift[a] + turn[b] * point[c] - turn[c] * point[b]
    })
}

#[test]
fn a_common_motion_leaves_gluing_at_rest_and_is_seen_by_supports_and_contact() {
    for scene in scenes().into_iter().chain([not_matching(&["support.right.surface=upper.xmin"])]) {
        on_ranks(&scene, 1, |setup| {
            let motions = |s: &Subdomain| s.points.iter().flat_map(|&p| motion(p)).collect::<Vec<_>>();
            let u: Vec<f64> = setup.subdomains().iter().flat_map(motions).collect();
            let bu = setup.dense_rows() * column(&u);
            let size = u.iter().fold(0.0_f64, |size, u| size.max(u.abs()));
            let along = |number: usize, pair: usize| {
                let tangents = setup.discrete.constraints.sliders.iter().flat_map(|slider| &slider.tangents);
                let tangent = tangents.into_iter().find(|tangent| tangent.row == number);
                tangent.map_or(setup.discrete.contacts.pairs[pair].normal, |tangent| tangent.direction)
            };
            for (number, (found, row)) in bu.col(0).iter().zip(setup.rows()).enumerate() {
                let expected = match row.kind {
                    Kind::Gluing => 0.0,
                    Kind::Support { axis, .. } => {
                        (row.terms.len() as f64).sqrt() * motion(point(setup, row.terms[0].node))[axis]
                    }
                    Kind::Contact { pair } | Kind::Friction { pair, .. } => {
                        let (along, pair) = (along(number, pair), &setup.discrete.contacts.pairs[pair]);
                        let part = |node: u64, axis: usize| {
                            let free = row.terms.iter().any(|t| (t.node, t.axis) == (node, axis));
                            if free { along[axis] * motion(point(setup, node))[axis] } else { 0.0 }
                        };
                        let sides = |a: usize| pair.nodes().map(|(node, w)| w * part(node, a)).sum::<f64>();
                        row.scale * (0..3).map(sides).sum::<f64>()
                    }
                };
                assert!((found - expected).abs() < 1e-14 * size, "{row:?}");
            }
        });
    }
}

fn point(setup: &Setup, node: u64) -> [f64; 3] {
    let mut holders = setup.subdomains().iter().filter_map(|s| s.local_node(node).map(|local| s.points[local]));
    holders.next().expect("every node is somewhere")
}

#[test]
fn every_rank_holds_the_blocks_of_its_subdomains_and_all_ranks_the_same_rows() {
    for scene in [two_bricks(&[]), two_bricks_by_metis(9), not_matching(&[]), long_contact()] {
        let blocks = |constraints: &Constraints| -> Vec<(Vec<u32>, Vec<Row>)> {
            let rows = constraints.blocks.iter().map(|rows| constraints.rows[rows.clone()].to_vec());
            constraints.block_subdomains.iter().cloned().zip(rows).collect()
        };
        let alone = on_ranks(&scene, 1, |setup| blocks(&setup.discrete.constraints)).remove(0);
        for ranks in RANKS {
            on_ranks(&scene, ranks, |setup| {
                let own = |subdomain: &u32| setup.discrete.decomposition.own_index(*subdomain).is_some();
                let expected = alone.iter().filter(|(subdomains, _)| subdomains.iter().any(own));
                assert!(blocks(&setup.discrete.constraints).iter().eq(expected), "{ranks} ranks");
            });
        }
    }
}

/// By the conditions of the whole scene.
#[test]
fn subdomains_hold_what_they_reach_of_a_large_contact() {
    on_ranks(&long_contact(), 1, |setup| {
        let (constraints, pairs) = (&setup.discrete.constraints, &setup.discrete.contacts.pairs);
        let edges: Vec<(u64, Vec<u64>)> =
            pairs.iter().map(|(_, pair)| (pair.slave, pair.nodes().map(|(node, _)| node).collect())).collect();
        let (mut of_nodes, mut of_slaves) = (HashMap::new(), HashMap::new());
        for subdomain in setup.subdomains() {
            let mut reached: Vec<u64> = subdomain.nodes.clone();
            for round in 1..=rounds(false) {
                let near: Vec<_> = edges.iter().filter(|(_, of)| of.iter().any(|n| reached.contains(n))).collect();
                let more: Vec<u64> = near.iter().flat_map(|(_, of)| of.iter().copied()).collect();
                reached.extend(more);
                if round == rounds(false) {
                    for (slave, _) in near {
                        of_slaves.entry(*slave).or_insert_with(Vec::new).push(subdomain.id as u32);
                    }
                }
            }
            reached.sort_unstable();
            reached.dedup();
            reached.iter().for_each(|&node| of_nodes.entry(node).or_insert_with(Vec::new).push(subdomain.id as u32));
        }
        let mut differ = std::collections::BTreeSet::new();
        let blocks = constraints.blocks.iter().zip(&constraints.block_subdomains).zip(&constraints.is_part);
        for ((rows, holders), _) in blocks.filter(|(_, part)| **part) {
            let row = &constraints.rows[rows.start];
            let expected = match row.kind {
                Kind::Contact { pair } => &of_slaves[&pairs[pair].slave],
                _ => &of_nodes[&row.terms[0].node],
            };
            assert_eq!(holders, expected);
            differ.insert(holders.clone());
        }
        assert!(differ.len() > 3, "{differ:?}");
    });
}

#[test]
fn supports_in_conflict_are_refused_on_every_rank_with_one_message() {
    for ranks in RANKS {
        let errors = on_ranks(&two_bricks(&[]), ranks, |setup| {
            let mut supports = setup.discrete.supports.clone();
            let [name, value] = ["other", "right"].map(String::from);
            let twin = supports.iter().find(|s| s.name == value).expect("the scene has it");
            supports.push(Support { name, displacement: [0.0, 0.1, 0.5], ..twin.clone() });
            let interface = &setup.discrete.decomposition.interface;
            let displacements = supports.iter().map(|support| support.displacement).collect();
            let at = Prescribed { displacements, gaps: HashMap::new(), drags: HashMap::new() };
            dirichlet::check(setup.comm, interface, &supports, &at).err()
        });
        let expected = ConstraintError::Conflict {
            first: "right".into(),
            second: "other".into(),
            axis: 'z',
            first_value: 0.0,
            second_value: 0.5,
        };
        assert!(errors.iter().all(|error| error.as_ref() == Some(&expected)), "{ranks} ranks: {errors:?}");
    }
}

#[test]
fn a_pair_fixed_on_both_sides_along_the_normal_has_no_row() {
    let flush = two_bricks(&["body.upper.brick.origin.0=0.0", "support.right.surface=upper.xmin"]);
    for ranks in RANKS {
        on_ranks(&flush, ranks, |setup| {
            let contact = crate::sizing::sizes(&setup.discrete, setup.comm).contact_rows;
            assert_eq!((setup.discrete.contacts.pairs.total(), contact), (15, 12));
        });
    }
    on_ranks(&flush, 1, |setup| assert_eq!(setup.discrete.constraints.idle.len(), 3));
}

fn node(node: u64, copies: &[u32]) -> InterfaceNode {
    InterfaceNode { node, copies: copies.to_vec(), surfaces: vec![] }
}

fn pair(slaves: &[(u64, f64)], masters: &[(u64, f64)]) -> ContactPair {
    let (slaves, masters, normal) = (slaves.to_vec(), masters.to_vec(), [0.6, 0.0, 0.8]);
    ContactPair {
        contact: 0,
        slave: 7,
        part: 0,
        slaves,
        masters,
        vectors: Vec::new(),
        normal,
        gap: 0.5,
        area: 1.0,
        limit_area: 1.0,
        covered: true,
    }
}

/// Sum of a row's coefficients at a node, as before it was made a unit vector.
fn coefficient(row: &Row, node: u64, axis: usize) -> f64 {
    row.terms.iter().filter(|t| (t.node, t.axis) == (node, axis)).map(|t| t.value / row.scale).sum()
}

#[test]
fn a_contact_row_takes_means_of_copies_and_moves_what_supports_fix_to_its_right_hand_side() {
    let pair = pair(&[(7, 1.0), (6, 0.5)], &[(8, 0.75), (9, 0.75)]);
    let nodes = [node(6, &[3]), node(7, &[0, 3]), node(8, &[1, 2, 4]), node(9, &[2])];
    let (held, free) = ([Some(0), None, None], [None; 3]);
    let at =
        Prescribed { displacements: vec![[0.25, 0.0, 0.0]], gaps: HashMap::from([(3, 0.5)]), drags: HashMap::new() };
    let side = |number: u64, fixed: [Option<usize>; 3]| (&nodes[number as usize - 6], fixed);
    let row = contact::row(3, &pair, &|n| side(n, if n % 2 == 1 { held } else { free })).expect("much is free");
    let square: f64 = row.terms.iter().map(|t| t.value * t.value).sum();
    assert!((square - 1.0).abs() < 1e-15);
    assert!((row.right_hand_side(&at) - row.scale * (0.5 - 0.6 * 0.25 + 0.75 * 0.6 * 0.25)).abs() < 1e-15);
    let fixed: Vec<_> = row.fixed.iter().map(|h| (h.support, h.axis, h.weight)).collect();
    assert_eq!(fixed, [(0, 0, 0.6), (0, 0, -0.75 * 0.6)]);
    let expected = [
        (6, [0.5 * 0.6, 0.0, 0.5 * 0.8]),
        (7, [0.0, 0.0, 0.8]),
        (8, [-0.75 * 0.6, 0.0, -0.75 * 0.8]),
        (9, [0.0, 0.0, -0.75 * 0.8]),
    ];
    for (node, expected) in expected {
        for (axis, expected) in expected.into_iter().enumerate() {
            assert!((coefficient(&row, node, axis) - expected).abs() < 1e-15, "{node} {axis}");
        }
    }
    let all = contact::row(3, &pair, &|n| side(n, [Some(0); 3])).unwrap_err();
    let left = Prescribed { displacements: vec![[0.1; 3]], ..at }.distance(3, &all);
    assert!((left - 0.5).abs() < 1e-15, "a common motion leaves the gap: {left}");
}

#[test]
fn of_contacts_in_one_direction_the_tightest_counts() {
    let slave = node(7, &[0, 3]);
    const GAPS: [f64; 5] = [0.5, -0.5, 0.2, 0.3, 0.1];
    let at = |gaps: [f64; 5]| Prescribed {
        displacements: Vec::new(),
        gaps: gaps.into_iter().enumerate().collect(),
        drags: HashMap::new(),
    };
    let row = |number: usize, normal: [f64; 3]| {
        let pair = ContactPair { normal, ..pair(&[(7, 1.0)], &[]) };
        contact::row(number, &pair, &|_| (&slave, [None; 3])).expect("it is free")
    };
    let (up, down) = ([0.6, 0.0, 0.8], [-0.6, 0.0, -0.8]);
    let mut rows = Vec::new();
    for (number, normal) in [up, down, up, up, [0.0, 0.6, 0.8]].into_iter().enumerate() {
        contact::add_tightest(&mut rows, row(number, normal), &at(GAPS));
    }
    let kinds: Vec<Kind> = rows.iter().map(|row| row.kind).collect();
    assert_eq!(kinds, [2, 1, 4].map(|pair| Kind::Contact { pair }));
    let right_hand_sides = |gaps: [f64; 5]| rows.iter().map(|row| row.right_hand_side(&at(gaps))).collect::<Vec<_>>();
    let scale = rows[0].scale;
    assert_eq!(right_hand_sides(GAPS), [0.2, -0.5, 0.1].map(|gap| scale * gap));
    // Another obstacle has come nearest.
    assert_eq!(right_hand_sides([0.5, -0.5, 0.2, 0.1, 0.1]), [0.1, -0.5, 0.1].map(|gap| scale * gap));
}

#[test]
fn components_that_supports_fix_are_known_at_every_node_that_is_asked_for() {
    for ranks in RANKS {
        on_ranks(&two_bricks(&[]), ranks, |setup| {
            let (supports, decomposition) = (&setup.discrete.supports, &setup.discrete.decomposition);
            let fixed = |node: &&InterfaceNode| dirichlet::fixed(node, supports).iter().any(Option::is_some);
            let mine: Vec<u64> = decomposition.interface.iter().filter(fixed).map(|node| node.node).collect();
            let some = all_gather_u64(setup.comm, &mine).into_iter().min().expect("supports hold some");
            let found =
                dirichlet::fixed_at(setup.comm, &decomposition.interface, supports, &[some, some, some + 1_000_000]);
            assert_eq!(found[0], found[1]);
            assert!(found[0] != [false; 3] && found[2] == [false; 3]);
        });
    }
}
