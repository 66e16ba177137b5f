use faer::{Mat, Side};

use crate::feti::inverse::kernel::MODES;
use crate::fixture::{Setup, assert_close, block_diagonal, column, dense, on_ranks, same_on_any_ranks, two_bricks};
use crate::scene::Scene;

/// Blocks of four, compact parts, and pairs of pairs.
fn scenes() -> [Scene; 3] {
    let blocks = ["body.lower.brick.cells=[8, 4, 2]", "decomposition.cluster=4"];
    let by_metis = ["decomposition.subdomains=10", "decomposition.cluster=3"];
    let pairs = ["decomposition.cells=[1, 2, 2]", "decomposition.cluster=[2, 2]"];
    [two_bricks(&blocks), two_bricks(&by_metis), two_bricks(&pairs)]
}

/// `R` of the groups of a level, on a single rank.
fn modes(setup: &Setup, level: usize) -> Mat<f64> {
    let clusters = &setup.discrete.decomposition.clusters;
    let total: usize = setup.subdomains().iter().map(|s| s.dofs()).sum();
    let mut r = Mat::zeros(total, MODES * clusters.count(level));
    let mut row = 0;
    for (subdomain, modes) in setup.subdomains().iter().zip(&setup.motions.levels[level]) {
        for components in subdomain.points.iter().flat_map(|&point| modes.at(point)) {
            (0..MODES).for_each(|k| r[(row, MODES * clusters.group(level, subdomain.id) + k)] = components[k]);
            row += 1;
        }
    }
    r
}

/// What `u` of members that hold together is orthogonal to: for each level `B'B R` with its rows and the modes of its members.
fn bonds(setup: &Setup) -> Mat<f64> {
    let (b, clusters) = (setup.dense_rows(), &setup.discrete.decomposition.clusters);
    let of_level = |level: usize| {
        let is_of = |row: usize| setup.connection.gluing.level(row) == Some(level);
        let rows = Mat::from_fn(b.nrows(), b.ncols(), |i, j| if is_of(i) { b[(i, j)] } else { 0.0 });
        rows.transpose() * (&rows * modes(setup, level - 1))
    };
    let all: Vec<Mat<f64>> = (1..=clusters.levels()).map(of_level).collect();
    let columns: Vec<(usize, usize)> =
        all.iter().enumerate().flat_map(|(k, m)| (0..m.ncols()).map(move |j| (k, j))).collect();
    Mat::from_fn(b.ncols(), columns.len(), |i, j| all[columns[j].0][(i, columns[j].1)])
}

/// `N (N'K N)^+ N'` with `N` a basis of what is orthogonal to the bonds.
#[test]
fn inverts_the_stiffness_of_members_that_hold_together() {
    for scene in scenes() {
        on_ranks(&scene, 1, |setup| {
            let (factors, stiffnesses) = setup.factors();
            let of = |own: usize| dense(&factors.symbolic(own).pattern, &stiffnesses[own]);
            let k = block_diagonal(&(0..stiffnesses.len()).map(of).collect::<Vec<_>>());
            let clusters = &setup.discrete.decomposition.clusters;
            let free = MODES * clusters.total();
            let svd = bonds(setup).transpose().svd().expect("it exists");
            let held = MODES * clusters.count(0) - free;
            let (weakest, nothing) = (svd.S()[held - 1], svd.S()[held]);
            assert!(weakest > 1e-3 && nothing < 1e-12, "{weakest:e} {nothing:e}");
            let basis = svd.V().subcols(held, k.nrows() - held);
            let inside = basis.transpose() * &k * basis;
            let eigen = inside.self_adjoint_eigen(Side::Lower).expect("it exists");
            let (n, largest) = (inside.nrows(), eigen.S()[inside.nrows() - 1]);
            assert!(eigen.S()[free - 1].abs() < 1e-12 * largest && eigen.S()[free] > 1e-6 * largest);
            let vectors = basis * eigen.U().subcols(free, n - free);
            let scaled = Mat::from_fn(k.nrows(), n - free, |i, j| vectors[(i, j)] / eigen.S()[free + j]);
            let expected = scaled * vectors.transpose();

            let mut operator = setup.operator();
            let mut found = Mat::zeros(k.nrows(), k.nrows());
            let dofs: Vec<(usize, usize)> = setup
                .subdomains()
                .iter()
                .enumerate()
                .flat_map(|(own, s)| (0..s.dofs()).map(move |dof| (own, dof)))
                .collect();
            for (j, &(own, dof)) in dofs.iter().enumerate() {
                let mut unit = setup.gather.zeros();
                unit[own][dof] = 1.0;
                operator.solve(&mut unit);
                unit.concat().iter().enumerate().for_each(|(i, x)| found[(i, j)] = *x);
            }
            assert_close(&found.transpose().to_owned(), &found, 1e-10);
            assert!((bonds(setup).transpose() * &found).norm_max() < 1e-11 * found.norm_max());
            let motions = modes(setup, clusters.levels());
            let p = Mat::<f64>::identity(k.nrows(), k.nrows()) - &motions * motions.transpose();
            assert_close(&(&p * &found * &p), &(&p * &expected * &p), 1e-9);
        });
    }
}

#[test]
fn members_are_brought_together_by_rigid_motions_alone() {
    for scene in scenes() {
        on_ranks(&scene, 1, |setup| {
            let mut operator = setup.operator();
            let before = setup.displacements(4);
            let mut u = before.clone();
            operator.rejoin(&mut u);
            let closed = column(&u.concat());
            assert!((bonds(setup).transpose() * &closed).norm_max() < 1e-12);
            // Motions of members less those of clusters.
            let moved = &closed - column(&before.concat());
            let r = modes(setup, 0);
            let rest = &moved - &r * (r.transpose() * &moved);
            assert!(rest.norm_max() < 1e-13 && moved.norm_max() > 1e-2);
            operator.rejoin(&mut u);
            assert_close(&column(&u.concat()), &closed, 1e-12);
            let mut lambda = vec![0.0; setup.rows().len()];
            operator.add_bonds([&mut lambda]);
            assert!(lambda.iter().all(|l| *l == 0.0), "no forces are needed");
        });
    }
}

#[test]
fn forces_between_members_balance_each_of_them() {
    for scene in scenes() {
        on_ranks(&scene, 1, |setup| {
            // In balance over the clusters.
            let clusters = setup.discrete.decomposition.clusters.levels();
            let (all, motions) = (column(&setup.displacements(1).concat()), modes(setup, clusters));
            let balanced = &all - &motions * (motions.transpose() * &all);
            let mut forces = setup.gather.zeros();
            forces.iter_mut().flatten().enumerate().for_each(|(at, f)| *f = balanced[(at, 0)]);
            let mut operator = setup.operator();
            operator.solve(&mut forces);
            let mut lambda = vec![0.0; setup.rows().len()];
            operator.add_bonds([&mut lambda]);
            let left = balanced - setup.dense_rows().transpose() * column(&lambda);
            let resultants = modes(setup, 0).transpose() * left;
            assert!(resultants.norm_max() < 1e-11, "{:e}", resultants.norm_max());
            assert!(lambda.iter().any(|l| l.abs() > 1e-2));
        });
    }
}

#[test]
fn solutions_are_the_same_bits_on_any_ranks() {
    for scene in scenes() {
        same_on_any_ranks(&scene, |setup| {
            let mut x = setup.displacements(2);
            setup.operator().solve(&mut x);
            x.concat()
        });
    }
}
