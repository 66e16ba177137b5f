use faer::prelude::Solve;
use faer::{Mat, Side};

use super::scaling::Scaling;
use super::{Changes, Preconditioner};
use crate::constraint::Kind;
use crate::decomposition::Subdomain;
use crate::feti::inverse::factor::{Factors, analyse};
use crate::feti::inverse::schur::Schur;
use crate::fixture::{
    Setup, assert_close, block_diagonal, built_in, column, dense, long_contact, not_matching, on_ranks,
    same_on_any_ranks, two_bricks, two_bricks_by_metis,
};
use crate::scene::Scene;
use crate::sparse::cholesky::Precision;

/// The upper brick so flat that short edges tie the nodes of each column.
const FLAT: &str = "body.upper.brick.size.2=0.2";

fn scenes() -> [Scene; 7] {
    let small = two_bricks(&["decomposition.cells=[1, 2, 2]"]);
    let (flat, flat_mortar) = (two_bricks(&[FLAT]), not_matching(&[FLAT]));
    [two_bricks(&[]), two_bricks_by_metis(7), small, not_matching(&[]), flat, flat_mortar, long_contact()]
}

/// A preconditioner at the elastic stiffness, and what it stands on.
struct Case<'a> {
    preconditioner: Preconditioner<'a>,
    factors: Factors,
    stiffnesses: Vec<Vec<f64>>,
}

impl<'a> Case<'a> {
    fn new(setup: &'a Setup<'a>, dirichlet: bool, kept: impl Fn(usize) -> bool) -> Self {
        let (factors, stiffnesses) = setup.factors();
        let own = stiffnesses.len();
        let whole = analyse(setup.subdomains());
        let mut schur =
            Schur::new(&whole, setup.gather.boundaries(), &vec![1; own], dirichlet.then_some(Precision::Double));
        for (k, values) in stiffnesses.iter().enumerate() {
            schur.update(k, k, values, false).expect("the interior is held by its boundary");
        }
        let mut preconditioner = Preconditioner::new(&setup.connection, &setup.discrete.constraints, schur);
        let stiffness = stiffnesses.iter().enumerate().map(|(k, values)| (&factors.symbolic(k).pattern, &values[..]));
        let patches = preconditioner.patches.as_ref().map(|patches| (patches, Scaling::default()));
        preconditioner.scaling = Scaling::new(&setup.discrete.constraints, &setup.gather, patches, stiffness);
        preconditioner.scaling.restrict(&setup.discrete.constraints, kept);
        Self { preconditioner, factors, stiffnesses }
    }

    /// With deluxe scaling of all faces.
    fn deluxe(setup: &'a Setup<'a>) -> Self {
        let mut case = Self::new(setup, true, |_| true);
        let (all, stiffnesses) = (vec![true; setup.subdomains().len()], &case.stiffnesses);
        let changes = Changes { fresh: all.clone(), weak: all, refreshed: 1, is_any_weak: true };
        let Preconditioner { deluxe, schur, .. } = &mut case.preconditioner;
        let stiffness = |own: usize| (&**case.factors.symbolic(own), &stiffnesses[own][..]);
        deluxe.meet(&changes);
        deluxe.update(schur, stiffness);
        assert!(deluxe.is_active());
        case
    }

    fn apply(&mut self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        self.preconditioner.apply(x, &mut y);
        y
    }

    fn stiffness(&self) -> Vec<Mat<f64>> {
        let block = |(own, values): (usize, &Vec<f64>)| dense(&self.factors.symbolic(own).pattern, values);
        self.stiffnesses.iter().enumerate().map(block).collect()
    }
}

/// `D^-1`: of blocks of nodes of one column of a body whose top is near its bottom, else of unknowns.
fn dense_flexibility(setup: &Setup, stiffness: &[Mat<f64>]) -> Mat<f64> {
    let block = |(subdomain, k): (&Subdomain, &Mat<f64>)| {
        let points = &subdomain.points;
        let column = |dof: usize| [points[dof / 3][0], points[dof / 3][1]];
        let is_flat = points.iter().all(|point| (point[2] - points[0][2]).abs() < 0.25);
        let together = |a: usize, b: usize| if is_flat { column(a) == column(b) } else { a == b };
        let mut inverse = Mat::zeros(k.nrows(), k.nrows());
        for first in 0..k.nrows() {
            let group: Vec<usize> = (0..k.nrows()).filter(|&dof| together(first, dof)).collect();
            let part = Mat::from_fn(group.len(), group.len(), |i, j| k[(group[i], group[j])]);
            let unit = Mat::from_fn(group.len(), 1, |i, _| f64::from(u8::from(group[i] == first)));
            let moved = part.partial_piv_lu().solve(unit);
            group.iter().enumerate().for_each(|(i, &dof)| inverse[(dof, first)] = moved[(i, 0)]);
        }
        inverse
    };
    block_diagonal(&setup.subdomains().iter().zip(stiffness).map(block).collect::<Vec<_>>())
}

/// `(B D^-1 B')^-1 B D^-1` with the kept rows of `B`; the others are zero. The columns of each subdomain are those of the rows that it
/// holds.
fn dense_scaled_rows(setup: &Setup, b: &Mat<f64>, flexibility: &Mat<f64>, kept: impl Fn(usize) -> bool) -> Mat<f64> {
    let constraints = &setup.discrete.constraints;
    let holds = |row: usize, subdomain: u32| {
        let block = constraints.blocks.iter().position(|rows| rows.contains(&row)).expect("it is in a block");
        !constraints.is_part[block] || constraints.block_subdomains[block].contains(&subdomain)
    };
    let (mut all, mut begin) = (Mat::zeros(b.nrows(), b.ncols()), 0);
    for subdomain in setup.subdomains() {
        let held = |&row: &usize| kept(row) && holds(row, subdomain.id as u32);
        let held: Vec<usize> = (0..b.nrows()).filter(held).collect();
        let some = Mat::from_fn(held.len(), b.ncols(), |i, j| b[(held[i], j)]);
        let weighted = &some * flexibility;
        let own = weighted.subcols(begin, subdomain.dofs());
        let scaled = (&weighted * some.transpose()).partial_piv_lu().solve(own);
        for (i, &row) in held.iter().enumerate() {
            all.row_mut(row).subcols_mut(begin, subdomain.dofs()).copy_from(scaled.row(i));
        }
        begin += subdomain.dofs();
    }
    all
}

/// The block of the boundary unknowns of each subdomain, less what its interior takes if it is free to move; zero
/// elsewhere.
fn dense_boundary_stiffness(stiffness: &[Mat<f64>], boundaries: &[Vec<u32>], interior_moves: bool) -> Mat<f64> {
    let block = |(k, boundary): (&Mat<f64>, &Vec<u32>)| {
        let inside: Vec<usize> = (0..k.nrows()).filter(|&dof| !boundary.contains(&(dof as u32))).collect();
        let outside: Vec<usize> = boundary.iter().map(|&dof| dof as usize).collect();
        let part = |rows: &[usize], columns: &[usize]| {
            Mat::from_fn(rows.len(), columns.len(), |i, j| k[(rows[i], columns[j])])
        };
        let mut s = part(&outside, &outside);
        if interior_moves && !inside.is_empty() {
            let answer = part(&inside, &inside).partial_piv_lu().solve(part(&inside, &outside));
            s -= part(&outside, &inside) * answer;
        }
        let mut whole = Mat::zeros(k.nrows(), k.nrows());
        for (i, &row) in outside.iter().enumerate() {
            for (j, &column) in outside.iter().enumerate() {
                whole[(row, column)] = s[(i, j)];
            }
        }
        whole
    };
    block_diagonal(&stiffness.iter().zip(boundaries).map(block).collect::<Vec<_>>())
}

#[test]
fn lumped_and_dirichlet_equal_their_dense_formulas_with_all_rows_and_with_some() {
    for scene in scenes() {
        on_ranks(&scene, 1, |setup| {
            let b = setup.dense_rows();
            let odd_contact = |row: usize| matches!(setup.rows()[row].kind, Kind::Contact { pair } if pair % 2 == 1);
            for (dirichlet, all) in [(false, true), (true, true), (true, false)] {
                let kept = |row: usize| all || !odd_contact(row);
                let mut case = Case::new(setup, dirichlet, kept);
                let stiffness = case.stiffness();
                let scaled = dense_scaled_rows(setup, &b, &dense_flexibility(setup, &stiffness), kept);
                let boundary = setup.gather.boundaries();
                let s = dense_boundary_stiffness(&stiffness, &boundary, dirichlet);
                let x = setup.multipliers(8);
                let expected = &scaled * s * scaled.transpose() * column(&x);
                assert_close(&column(&case.apply(&x)), &expected, 1e-11);
            }
        });
    }
}

/// `B_D'` with the unknowns that one row of gluing alone touches shared out by `(S_1 + S_2)^-1 S_2`, for each pair of subdomains.
fn dense_deluxe(setup: &Setup, scaled: &Mat<f64>, s: &Mat<f64>) -> Mat<f64> {
    let b = setup.dense_rows();
    let rows_at = |dof: usize| (0..b.nrows()).filter(|&row| b[(row, dof)] != 0.0).collect();
    let touching: Vec<Vec<usize>> = (0..s.nrows()).map(rows_at).collect();
    let dofs_of = |row: usize| (0..touching.len()).filter(|&dof| touching[dof].contains(&row)).collect::<Vec<usize>>();
    let mut pairs: Vec<(Vec<u32>, Vec<usize>)> = Vec::new();
    for (row, of_row) in setup.rows().iter().enumerate().filter(|(_, row)| row.kind == Kind::Gluing) {
        if dofs_of(row).iter().all(|&dof| touching[dof] == [row]) {
            let pair: Vec<u32> = of_row.terms.iter().map(|term| term.subdomain).collect();
            match pairs.iter_mut().find(|(known, _)| *known == pair) {
                Some((_, rows)) => rows.push(row),
                None => pairs.push((pair, vec![row])),
            }
        }
    }
    assert!(!pairs.is_empty());
    let mut result = scaled.transpose().to_owned();
    for (_, rows) in pairs {
        let n = rows.len();
        let [first, second] = [0, 1].map(|side| rows.iter().map(|&row| dofs_of(row)[side]).collect::<Vec<usize>>());
        let part = |dofs: &[usize]| Mat::from_fn(n, n, |i, j| s[(dofs[i], dofs[j])]);
        let share = (part(&first) + part(&second)).partial_piv_lu().solve(part(&second));
        for i in 0..n {
            result.row_mut(first[i]).fill(0.0);
            result.row_mut(second[i]).fill(0.0);
            for (j, &row) in rows.iter().enumerate() {
                let jump = 1.0 / b[(row, first[j])];
                result[(first[i], row)] = jump * share[(i, j)];
                result[(second[i], row)] = jump * (share[(i, j)] - f64::from(u8::from(i == j)));
            }
        }
    }
    result
}

#[test]
fn deluxe_scaling_is_that_of_the_dense_formula_and_dual_to_the_rows() {
    for scene in [two_bricks(&[]), two_bricks_by_metis(7), two_bricks(&[FLAT])] {
        on_ranks(&scene, 1, |setup| {
            let mut case = Case::deluxe(setup);
            let (b, stiffness) = (setup.dense_rows(), case.stiffness());
            let scaled = dense_scaled_rows(setup, &b, &dense_flexibility(setup, &stiffness), |_| true);
            let s = dense_boundary_stiffness(&stiffness, &setup.gather.boundaries(), true);
            let x = setup.multipliers(8);
            let deluxe = dense_deluxe(setup, &scaled, &s);
            assert_close(&(&b * (&deluxe * column(&x))), &column(&x), 1e-11);
            let expected = deluxe.transpose() * s * &deluxe * column(&x);
            assert_close(&column(&case.apply(&x)), &expected, 1e-11);
        });
    }
}

#[test]
fn deluxe_scaling_has_the_same_bits_on_any_ranks_and_ends_once_nothing_is_weak() {
    for scene in [two_bricks(&[]), two_bricks_by_metis(7)] {
        let special = same_on_any_ranks(&scene, |setup| {
            let image = Case::deluxe(setup).apply(&setup.multipliers(12));
            setup.owned(&image)
        });
        let [plain, back] = [false, true].map(|was_deluxe| {
            same_on_any_ranks(&scene, |setup| {
                let mut case = if was_deluxe { Case::deluxe(setup) } else { Case::new(setup, true, |_| true) };
                let none = vec![false; setup.subdomains().len()];
                let changes = Changes { fresh: none.clone(), weak: none, refreshed: 0, is_any_weak: false };
                let Preconditioner { deluxe, schur, .. } = &mut case.preconditioner;
                deluxe.meet(&changes);
                deluxe.update(schur, |_| panic!("no face has a scaling of its own"));
                setup.owned(&case.apply(&setup.multipliers(12)))
            })
        });
        assert!(plain == back && plain != special);
    }
}

/// `B B_D' = I`, by way of `(B D^-1 B') (B D^-1 B')^-1 = I`.
#[test]
fn scaled_rows_are_dual_to_the_rows() {
    let flat = two_bricks(&["decomposition.subdomains=7", FLAT]);
    // On the top, which is loaded, are groups that no row touches.
    let narrow = two_bricks(&["body.upper.brick.size.1=0.2"]);
    for scene in [two_bricks(&[]), two_bricks_by_metis(7), built_in("patch", &[]), flat, narrow] {
        on_ranks(&scene, 3, |setup| {
            let mut case = Case::new(setup, false, |_| true);
            let scaling = &mut case.preconditioner.scaling;
            let x = setup.multipliers(9);
            let mut solved = vec![0.0; x.len()];
            scaling.solve(&x, &mut solved);
            let mut torn = setup.gather.zeros();
            setup.gather.add_transpose(1.0, &solved, &mut torn);
            for ((own, t), boundary) in torn.iter_mut().enumerate().zip(setup.gather.boundaries()) {
                let mut on_boundary: Vec<f64> = boundary.iter().map(|&dof| t[dof as usize]).collect();
                scaling.flexibility().apply(own, &boundary, &mut on_boundary);
                boundary.iter().zip(on_boundary).for_each(|(&dof, x)| t[dof as usize] = x);
            }
            let mut back = vec![0.0; x.len()];
            setup.gather.apply(&torn, &mut back);
            assert_close(&column(&back), &column(&x), 1e-13);
        });
    }
}

#[test]
fn the_preconditioned_operator_is_definite_on_symmetric_products() {
    for scene in [two_bricks(&[]), long_contact()] {
        on_ranks(&scene, 2, |setup| {
            for dirichlet in [false, true] {
                let mut case = Case::new(setup, dirichlet, |_| true);
                let (x, y) = (setup.multipliers(1), setup.multipliers(2));
                let (mx, my) = (case.apply(&x), case.apply(&y));
                let [xmy, ymx, xmx] = setup.space.dots(&[(&x, &my), (&y, &mx), (&x, &mx)])[..] else { panic!() };
                assert!((xmy - ymx).abs() < 1e-12 * xmx && xmx > 0.0);
            }
        });
    }
}

#[test]
fn mending_closes_the_defect_and_leaves_the_interior_without_force() {
    for scene in scenes() {
        for (ranks, dirichlet, special) in [(1, false, false), (1, true, false), (3, true, false), (2, true, true)] {
            on_ranks(&scene, ranks, |setup| {
                let case = if special { Case::deluxe(setup) } else { Case::new(setup, dirichlet, |_| true) };
                let Case { mut preconditioner, factors, stiffnesses } = case;
                let mut u = setup.displacements(10);
                let before = u.clone();
                let wanted = setup.multipliers(11);
                let mut bu = vec![0.0; wanted.len()];
                setup.gather.apply(&u, &mut bu);
                // What is not of large components is closed at once.
                let parts = setup.discrete.constraints.has_parts;
                for _ in 0..if parts { 12 } else { 1 } {
                    let defect: Vec<f64> = wanted.iter().zip(&bu).map(|(c, b)| c - b).collect();
                    preconditioner.mend(&defect, &mut u);
                    setup.gather.apply(&u, &mut bu);
                    let left: Vec<f64> = wanted.iter().zip(&bu).map(|(c, b)| c - b).collect();
                    let [before, after, size] =
                        setup.space.dots(&[(&defect, &defect), (&left, &left), (&wanted, &wanted)])[..]
                    else {
                        panic!()
                    };
                    assert!(after <= 0.01 * before + 1e-26 * size, "{after:.1e} of {before:.1e}");
                }
                assert_close(&column(&bu), &column(&wanted), 1e-12);

                let boundaries = setup.gather.boundaries();
                for (own, (after, before)) in u.iter().zip(&before).enumerate() {
                    let moved: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
                    let mut forces = vec![0.0; moved.len()];
                    factors.symbolic(own).pattern.multiply_add(&stiffnesses[own], &moved, &mut forces);
                    let largest = forces.iter().fold(0.0_f64, |size, f| size.max(f.abs()));
                    for dof in (0..moved.len()).filter(|&dof| !boundaries[own].contains(&(dof as u32))) {
                        let still = if dirichlet { forces[dof].abs() < 1e-12 * largest } else { moved[dof] == 0.0 };
                        assert!(still, "interior unknown {dof} of subdomain {own}");
                    }
                }
            });
        }
    }
}

#[test]
fn images_are_the_same_bits_on_any_ranks() {
    let flat = two_bricks(&["decomposition.subdomains=7", FLAT]);
    for scene in [two_bricks(&[]), two_bricks_by_metis(7), flat, long_contact()] {
        for dirichlet in [false, true] {
            same_on_any_ranks(&scene, |setup| {
                let image = Case::new(setup, dirichlet, |_| true).apply(&setup.multipliers(12));
                setup.owned(&image)
            });
        }
    }
}

/// `kappa(M F)` on `Ker G`: the eigenvalues of `M F` are those of `L' F L` with `M = L L'`.
#[test]
fn dirichlet_conditions_the_dual_operator_better_than_lumped_and_lumped_better_than_none() {
    let scene = two_bricks(&[
        "body.lower.brick.cells=[6, 3, 3]",
        "body.upper.brick.cells=[6, 3, 3]",
        "body.upper.brick.origin.0=0.0",
        "decomposition.cells=[3, 3, 3]",
    ]);
    on_ranks(&scene, 1, |setup| {
        let n = setup.rows().len();
        let basis = (setup.dense_rows() * setup.dense_modes()).qr().compute_thin_Q();
        let p = Mat::<f64>::identity(n, n) - &basis * basis.transpose();
        let unit = |k: usize| (0..n).map(|i| f64::from(u8::from(i == k))).collect::<Vec<_>>();
        let mut operator = setup.operator();
        let mut f = Mat::zeros(n, n);
        for k in 0..n {
            let mut image = vec![0.0; n];
            operator.apply(&unit(k), &mut image);
            f.col_mut(k).copy_from(column(&image).col(0));
        }
        let [none, lumped, dirichlet] = [None, Some(false), Some(true)].map(|dirichlet| {
            let mut m = p.clone();
            if let Some(dirichlet) = dirichlet {
                let mut case = Case::new(setup, dirichlet, |_| true);
                (0..n).for_each(|k| m.col_mut(k).copy_from(column(&case.apply(&unit(k))).col(0)));
            }
            let eigen = (&p * m * &p).self_adjoint_eigen(Side::Lower).expect("it exists");
            let root = Mat::from_fn(n, n, |i, j| eigen.U()[(i, j)] * eigen.S()[j].max(0.0).sqrt());
            let values = (root.transpose() * &f * root).self_adjoint_eigenvalues(Side::Lower).expect("they exist");
            values[n - 1] / values[6 * setup.subdomains().len()]
        });
        assert!(1.5 * dirichlet < lumped && 10.0 * lumped < none, "{dirichlet} {lumped} {none}");
    });
}
