use super::{Balance, Motions};
use crate::feti::inverse::kernel::MODES;
use crate::fixture::{Setup, on_ranks, same_on_any_ranks, two_bricks};
use crate::scene::Scene;

/// Pairs of pairs, compact parts in groups of groups, and three levels.
fn scenes() -> [Scene; 3] {
    let long = ["body.lower.brick.cells=[16, 4, 2]", "decomposition.cells=[1, 2, 1]", "decomposition.cluster=[4, 2]"];
    let by_metis = ["decomposition.subdomains=16", "decomposition.cluster=[3, 2]"];
    let deep = ["decomposition.cells=[1, 1, 1]", "decomposition.cluster=[2, 2, 2]"];
    [two_bricks(&long), two_bricks(&by_metis), two_bricks(&deep)]
}

fn balance<'a>(setup: &'a Setup) -> Balance<'a> {
    let decomposition = &setup.discrete.decomposition;
    Balance::new(&setup.connection, decomposition, &setup.discrete.constraints).expect("groups are firm")
}

#[test]
fn sums_go_up_and_numbers_come_down_on_any_ranks() {
    for scene in scenes() {
        for level in 1..=scene_levels(&scene) {
            let sums = same_on_any_ranks(&scene, |setup| {
                let own: Vec<f64> = setup.subdomains().iter().flat_map(|s| [1.0, s.id as f64]).collect();
                setup.tree.sum(level, &own, 2)
            });
            let numbers = same_on_any_ranks(&scene, |setup| {
                let groups: Vec<f64> = setup.tree.groups(level).map(|group| group as f64).collect();
                setup.tree.spread(level, &groups, 1)
            });
            on_ranks(&scene, 1, |setup| {
                let clusters = &setup.discrete.decomposition.clusters;
                let members = |group| clusters.begin(level, group)..clusters.begin(level, group + 1);
                let expected = (0..clusters.count(level))
                    .flat_map(|g| [members(g).len() as f64, members(g).sum::<usize>() as f64]);
                assert!(expected.eq(sums.iter().copied()));
                assert!((0..clusters.count(0)).map(|s| clusters.group(level, s) as f64).eq(numbers.iter().copied()));
            });
        }
    }
}

fn scene_levels(scene: &Scene) -> usize {
    on_ranks(scene, 1, |setup| setup.tree.levels())[0]
}

#[test]
fn modes_of_groups_are_orthonormal_and_sums_of_their_childrens() {
    for scene in scenes() {
        on_ranks(&scene, 1, |setup| {
            let clusters = &setup.discrete.decomposition.clusters;
            let Motions { levels, transfers, .. } = &setup.motions;
            for level in 1..=clusters.levels() {
                for group in 0..clusters.count(level) {
                    let members = clusters.begin(level, group)..clusters.begin(level, group + 1);
                    let points: Vec<[f64; 3]> =
                        setup.subdomains()[members.clone()].iter().flat_map(|s| s.points.clone()).collect();
                    let modes = &levels[level][members.start];
                    for k in 0..MODES {
                        let mut unit = [0.0; MODES];
                        unit[k] = 1.0;
                        let mut v = vec![0.0; 3 * points.len()];
                        modes.add_motion(&points, unit, &mut v);
                        let products = modes.resultants(&points, &v);
                        assert!((0..MODES).all(|l| (products[l] - unit[l]).abs() < 1e-13), "{products:?}");
                        for child in clusters.children(level, group) {
                            let transfer = &transfers[level - 1][child];
                            let first = clusters.begin(level - 1, child);
                            let point = setup.subdomains()[first].points[0];
                            let of_child = levels[level - 1][first].at(point);
                            for (line, expected) in of_child.iter().zip(modes.at(point)) {
                                let sum: f64 = (0..MODES).map(|j| line[j] * transfer[j][k]).sum();
                                assert!((sum - expected[k]).abs() < 1e-13);
                            }
                        }
                    }
                }
            }
        });
    }
}

#[test]
fn forces_between_members_take_their_resultants_if_these_balance_clusters() {
    for scene in scenes() {
        on_ranks(&scene, 1, |setup| {
            let balance = balance(setup);
            let mut torn = setup.displacements(1);
            // Without the resultants of clusters.
            let clusters = &setup.discrete.decomposition.clusters;
            for cluster in 0..clusters.total() {
                let members = clusters.first(cluster)..clusters.first(cluster + 1);
                let modes = &setup.modes()[members.start];
                let mut sum = [0.0; MODES];
                for own in members.clone() {
                    let of = modes.resultants(&setup.subdomains()[own].points, &torn[own]);
                    sum.iter_mut().zip(of).for_each(|(s, x)| *s -= x);
                }
                members.for_each(|own| modes.add_motion(&setup.subdomains()[own].points, sum, &mut torn[own]));
            }
            let shapes = setup.motions.levels[0].iter().zip(setup.subdomains());
            let resultants = |torn: &[Vec<f64>]| -> Vec<f64> {
                shapes.clone().zip(torn).flat_map(|((modes, s), t)| modes.resultants(&s.points, t)).collect()
            };
            let mut forces = vec![f64::NAN; setup.rows().len()];
            let wanted = resultants(&torn);
            balance.forces(wanted.clone(), &mut forces);
            let mut found = setup.gather.zeros();
            setup.gather.add_transpose(1.0, &forces, &mut found);
            let size = wanted.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            let error = wanted.iter().zip(resultants(&found)).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
            assert!(error < 1e-12 * size && size > 0.1, "{error:e} of {size}");
        });
    }
}

#[test]
fn motions_are_the_transpose_of_forces_and_relaxations_of_each_other() {
    for scene in scenes() {
        for ranks in [1, 3] {
            on_ranks(&scene, ranks, |setup| {
                let balance = balance(setup);
                let (x, y) = (setup.multipliers(1), setup.multipliers(2));
                let resultants: Vec<f64> = setup
                    .subdomains()
                    .iter()
                    .flat_map(|s| [1.0, 0.3, -0.2, 0.5, 0.1, 0.7].map(|k| k * (s.id as f64).cos()))
                    .collect();
                let mut forces = vec![0.0; x.len()];
                balance.forces(resultants.clone(), &mut forces);
                let motions = balance.motions(&mut x.clone());
                let own = motions.chunks(MODES).zip(resultants.chunks(MODES));
                let partial: Vec<f64> = own.map(|(a, r)| a.iter().zip(r).map(|(a, r)| a * r).sum()).collect();
                let [product, size] = setup.space.dots(&[(&forces, &x), (&forces, &forces)])[..] else { panic!() };
                assert!((setup.space.sum(&partial, 1)[0] - product).abs() < 1e-12 * size);

                let (mut relaxed, mut transposed) = (x.clone(), y.clone());
                balance.relax(&mut relaxed);
                balance.relax_transposed(&mut transposed);
                let [a, b, size] = setup.space.dots(&[(&relaxed, &y), (&x, &transposed), (&x, &x)])[..] else {
                    panic!()
                };
                assert!((a - b).abs() < 1e-13 * size && (a - setup.space.dots(&[(&x, &y)])[0]).abs() > 1e-3);
            });
        }
    }
}

#[test]
fn forces_motions_and_relaxations_are_the_same_bits_on_any_ranks() {
    for scene in scenes() {
        same_on_any_ranks(&scene, |setup| {
            let balance = balance(setup);
            let resultants = setup.subdomains().iter().flat_map(|s| [0.1; MODES].map(|k| k * (1.0 + s.id as f64).ln()));
            let mut forces = vec![0.0; setup.rows().len()];
            balance.forces(resultants.collect(), &mut forces);
            setup.owned(&forces)
        });
        same_on_any_ranks(&scene, |setup| balance(setup).motions(&mut setup.multipliers(3)));
        same_on_any_ranks(&scene, |setup| {
            let mut x = setup.multipliers(4);
            balance(setup).relax(&mut x);
            setup.owned(&x)
        });
    }
}
