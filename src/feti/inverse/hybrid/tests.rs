use faer::{Mat, Side};

use super::Hybrid;
use crate::feti::inverse::factor::Factors;
use crate::feti::inverse::kernel::MODES;
use crate::fixture::{Setup, assert_close, block_diagonal, column, dense, on_ranks, same_on_any_ranks, two_bricks};
use crate::scene::Scene;

/// A pair, blocks of four in a body of two rows, and compact parts.
fn scenes() -> [Scene; 3] {
    let long = ["body.lower.brick.cells=[12, 4, 2]", "body.lower.brick.size=[12.0, 4.4, 2.0]"];
    let by_metis = ["decomposition.subdomains=12", "decomposition.cluster=3"];
    let blocks = [&long[..], &["decomposition.cluster=4"]].concat();
    [&["decomposition.cluster=2"][..], &blocks, &by_metis].map(two_bricks)
}

fn hybrid(setup: &Setup) -> (Hybrid, Factors, Vec<Vec<f64>>) {
    let (mut factors, stiffnesses) = setup.factors();
    let clusters = &setup.discrete.decomposition.clusters;
    let mut hybrid = Hybrid::new(clusters.of_rank(setup.comm.rank()), setup.subdomains());
    hybrid.update(&mut factors).expect("bodies are whole");
    (hybrid, factors, stiffnesses)
}

/// `N (N'K N)^+ N'` with `N` a basis of what meets the bonds.
#[test]
fn inverts_the_stiffness_of_members_that_hold_together() {
    for scene in scenes() {
        on_ranks(&scene, 1, |setup| {
            let (mut hybrid, mut factors, stiffnesses) = hybrid(setup);
            let cluster = hybrid.0.iter().max_by_key(|c| c.members.len()).expect("there is one");
            let (members, bonds) = (cluster.members.clone(), cluster.bonds.clone());
            let of = |own: usize| dense(&factors.symbolic(own).pattern, &stiffnesses[own]);
            let k = block_diagonal(&members.clone().map(of).collect::<Vec<_>>());
            let (mut rows, mut first) = (Mat::zeros(bonds.rows, k.nrows()), 0);
            for member in &bonds.members {
                for jump in &member.jumps {
                    jump.entries.iter().for_each(|&(dof, x)| rows[(jump.row, first + dof as usize)] = x);
                }
                first += member.modes.len();
            }
            let svd = rows.svd().expect("it exists");
            let weakest = svd.S()[bonds.rows - 1];
            assert!(weakest > 1e-3, "a row follows from others: {weakest:e}");
            let basis = svd.V().subcols(bonds.rows, k.nrows() - bonds.rows);
            let inside = basis.transpose() * &k * basis;
            let eigen = inside.self_adjoint_eigen(Side::Lower).expect("it exists");
            let (n, largest) = (inside.nrows(), eigen.S()[inside.nrows() - 1]);
            assert!(eigen.S()[MODES - 1].abs() < 1e-12 * largest && eigen.S()[MODES] > 1e-6 * largest);
            let vectors = basis * eigen.U().subcols(MODES, n - MODES);
            let scaled = Mat::from_fn(k.nrows(), n - MODES, |i, j| vectors[(i, j)] / eigen.S()[MODES + j]);
            let expected = scaled * vectors.transpose();

            let mut found = Mat::zeros(k.nrows(), k.nrows());
            let dofs: Vec<(usize, usize)> = members
                .clone()
                .flat_map(|own| (0..setup.subdomains()[own].dofs()).map(move |dof| (own, dof)))
                .collect();
            for (j, &(own, dof)) in dofs.iter().enumerate() {
                let mut unit = setup.gather.zeros();
                unit[own][dof] = 1.0;
                hybrid.solve(&mut factors, &mut unit);
                unit[members.clone()].concat().iter().enumerate().for_each(|(i, x)| found[(i, j)] = *x);
            }
            assert_close(&found.transpose().to_owned(), &found, 1e-10);
            assert!((&rows * &found).norm_max() < 1e-11 * found.norm_max());
            let motions = basis * eigen.U().subcols(0, MODES);
            let p = Mat::<f64>::identity(k.nrows(), k.nrows()) - &motions * motions.transpose();
            assert_close(&(&p * &found * &p), &(&p * &expected * &p), 1e-9);
        });
    }
}

#[test]
fn bonds_are_closed_without_a_force_on_any_member() {
    let [_, blocks, _] = scenes();
    on_ranks(&blocks, 1, |setup| {
        let (mut hybrid, _, _) = hybrid(setup);
        let mut u = setup.displacements(4);
        hybrid.rejoin(&mut u);
        let mut forces = setup.gather.zeros();
        hybrid.add_forces(&mut forces);
        let largest = forces.iter().flatten().fold(0.0_f64, |largest, f| largest.max(f.abs()));
        for cluster in &hybrid.0 {
            let mut jump = vec![0.0; cluster.bonds.rows];
            for (member, own) in cluster.bonds.members.iter().zip(cluster.members.clone()) {
                member.jumps.iter().for_each(|of_row| jump[of_row.row] += of_row.of(&u[own]));
                for k in 0..MODES {
                    let along: f64 = member.modes.iter().zip(&forces[own]).map(|(m, f)| m[k] * f).sum();
                    assert!(along.abs() < 1e-11 * largest, "{along:e}");
                }
            }
            assert!(jump.iter().all(|x| x.abs() < 1e-11), "{jump:?}");
        }
        let closed = u.concat();
        hybrid.rejoin(&mut u);
        assert_close(&column(&u.concat()), &column(&closed), 1e-11);
    });
}

#[test]
fn forces_between_members_balance_each_of_them() {
    for scene in scenes() {
        on_ranks(&scene, 1, |setup| {
            let (mut hybrid, mut factors, _) = hybrid(setup);
            // In balance over the clusters.
            let mut forces = setup.displacements(1);
            let motions = setup.dense_modes();
            let all = column(&forces.concat());
            let balanced = &all - &motions * (motions.transpose() * &all);
            let mut at = 0;
            forces.iter_mut().flatten().for_each(|f| (*f, at) = (balanced[(at, 0)], at + 1));
            hybrid.solve(&mut factors, &mut forces.clone());
            let mut held = setup.gather.zeros();
            hybrid.add_forces(&mut held);
            for cluster in &hybrid.0 {
                for (member, own) in cluster.bonds.members.iter().zip(cluster.members.clone()) {
                    for k in 0..MODES {
                        let along = |f: &[f64]| member.modes.iter().zip(f).map(|(m, f)| m[k] * f).sum::<f64>();
                        let (given, taken) = (along(&forces[own]), along(&held[own]));
                        assert!((given - taken).abs() < 1e-11 && given.abs() > 1e-4, "{given:e} {taken:e}");
                    }
                }
            }
            // They glue: nothing but the gluing rows knows of them.
            let mut rows = vec![0.0; setup.rows().len()];
            setup.gather.apply(&held, &mut rows);
            let mut again = setup.gather.zeros();
            setup.gather.add_transpose(1.0, &rows, &mut again);
            assert_close(&column(&again.concat()), &column(&held.concat()), 1e-13);
        });
    }
}

#[test]
fn solutions_are_the_same_bits_on_any_ranks() {
    for scene in scenes() {
        same_on_any_ranks(&scene, |setup| {
            let (mut hybrid, mut factors, _) = hybrid(setup);
            let mut x = setup.displacements(2);
            hybrid.solve(&mut factors, &mut x);
            x.concat()
        });
    }
}
