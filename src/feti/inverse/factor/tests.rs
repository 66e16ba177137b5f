use std::rc::Rc;

use faer::prelude::Solve;
use faer::{Mat, Side};

use super::{Factors, analyse};
use crate::assembly::{Region, stiffness};
use crate::constraint::Kind;
use crate::decomposition::Subdomain;
use crate::feti::inverse::kernel::RigidModes;
use crate::feti::inverse::pinnable;
use crate::fixture::{assert_close, built_in, column, dense, elastic, on_ranks, two_bricks, two_bricks_by_metis};
use crate::material::samples::MATERIAL;
use crate::random::Random;
use crate::scene::Scene;
use crate::sparse::cholesky::Precision;

/// Cubes, compact parts of many and of few elements, a rod of a cell's section, a plate of one layer, needles for cells.
fn shapes() -> [Scene; 6] {
    let block = |cells: &str, size: &str| {
        built_in(
            "shear",
            &[
                &format!("body.block.brick.cells={cells}"),
                &format!("body.block.brick.size={size}"),
                &format!("decomposition.cells={cells}"),
            ],
        )
    };
    [
        two_bricks(&[]),
        two_bricks_by_metis(7),
        two_bricks_by_metis(40),
        block("[30, 1, 1]", "[30.0, 1.0, 1.0]"),
        block("[9, 9, 1]", "[900.0, 900.0, 1.0]"),
        block("[3, 3, 3]", "[1.0, 1.0, 100.0]"),
    ]
}

/// Displacements at which everything yields.
fn stretched(subdomain: &Subdomain) -> Vec<f64> {
    subdomain.points.iter().flat_map(|p| [0.05 * p[0] + 0.02 * p[1], -0.01 * p[1], 0.03 * p[0]]).collect()
}

/// `K + rho Q` is inverted and `K R = 0`: `K K^+ K = K` up to round-off, which slender shapes amplify.
#[test]
fn k_times_its_generalised_inverse_times_k_is_k() {
    for scene in shapes() {
        on_ranks(&scene, 1, |setup| {
            let mut factors = Factors::new(analyse(setup.subdomains()), Precision::Double);
            for (own, subdomain) in setup.subdomains().iter().enumerate() {
                for u in [vec![0.0; subdomain.dofs()], stretched(subdomain)] {
                    let mut values = vec![0.0; factors.symbolic(own).pattern.rows.len()];
                    let region = Region::virgin(subdomain, &MATERIAL);
                    stiffness::assemble(&region, (&u, &[]), &factors.symbolic(own).pattern, &mut values);
                    factors.factorise(own, subdomain, &values, &[], false).expect("stiff up to rigid motions");
                    let times = |factors: &Factors, x: &[f64]| {
                        let mut y = vec![0.0; x.len()];
                        factors.symbolic(own).pattern.multiply_add(&values, x, &mut y);
                        y
                    };
                    let mut random = Random::new(subdomain.id as u64);
                    for _ in 0..3 {
                        let x: Vec<f64> = (0..u.len()).map(|_| random.number()).collect();
                        let kx = times(&factors, &x);
                        let mut torn = setup.gather.zeros();
                        torn[own].clone_from(&kx);
                        factors.solve(&mut torn);
                        let kkkx = times(&factors, &torn[own]);
                        let norm = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
                        let error: Vec<f64> = kkkx.iter().zip(&kx).map(|(a, b)| a - b).collect();
                        let relative = norm(&error) / norm(&kx);
                        assert!(relative < 1e-11, "{:?} {relative:e}", scene.body);
                    }
                }
            }
        });
    }
}

#[test]
fn the_kernel_of_every_subdomain_is_exactly_its_six_rigid_modes() {
    for scene in shapes() {
        on_ranks(&scene, 1, |setup| {
            for (own, subdomain) in setup.subdomains().iter().enumerate() {
                let symbolic = super::Symbolic::new(subdomain);
                let k = dense(&symbolic.pattern, &elastic(subdomain, setup.material(own), &symbolic.pattern));
                let modes = RigidModes::new(&subdomain.points);
                let mut r = Mat::zeros(k.nrows(), 6);
                for (dof, row) in subdomain.points.iter().flat_map(|&p| modes.at(p)).enumerate() {
                    (0..6).for_each(|m| r[(dof, m)] = row[m]);
                }
                assert!((&k * &r).norm_max() < 1e-14 * k.norm_max());
                let values = k.self_adjoint_eigenvalues(Side::Lower).expect("they exist");
                let largest = values.last().expect("not empty");
                let zeros = values.iter().filter(|v| v.abs() < 1e-10 * largest).count();
                assert_eq!(zeros, 6, "{:?} {:e}", scene.body, values[6] / largest);
            }
        });
    }
}

#[test]
fn a_stiffness_that_is_not_finite_or_not_definite_is_refused_by_name() {
    on_ranks(&two_bricks(&[]), 1, |setup| {
        let (mut factors, stiffnesses) = setup.factors();
        let subdomain = &setup.subdomains()[2];
        for spoilt in [f64::NAN, f64::INFINITY, -1e6] {
            // On the diagonal and, where it is not definite by far, below it.
            for at in [0, 1, stiffnesses[2].len() - 1, stiffnesses[2].len() - 2] {
                let mut values = stiffnesses[2].clone();
                values[at] = spoilt;
                let error = factors.factorise(2, subdomain, &values, &[], false).expect_err("it is spoilt");
                assert_eq!((error.subdomain, error.dofs), (2, subdomain.dofs()));
            }
        }
    });
}

#[test]
fn congruent_subdomains_share_their_analysis_and_others_do_not() {
    on_ranks(&built_in("patch", &[]), 1, |setup| {
        let symbolic = analyse(setup.subdomains());
        assert!(symbolic.iter().all(|s| Rc::ptr_eq(s, &symbolic[0])));
    });
    on_ranks(&two_bricks_by_metis(7), 1, |setup| {
        let symbolic = analyse(setup.subdomains());
        for (a, one) in setup.subdomains().iter().enumerate() {
            for (b, other) in setup.subdomains().iter().enumerate() {
                assert!(!Rc::ptr_eq(&symbolic[a], &symbolic[b]) || one.elements == other.elements);
            }
        }
        assert!(symbolic.iter().any(|s| !Rc::ptr_eq(s, &symbolic[0])));
    });
}

/// With every number of twins, in both precisions.
#[test]
fn twins_get_what_they_would_get_alone_and_the_same_bits_beside_any_others() {
    on_ranks(&built_in("patch", &[]), 1, |setup| {
        let (subdomains, given) = (setup.subdomains(), setup.displacements(3));
        let symbolic = analyse(subdomains);
        let values = elastic(&subdomains[0], setup.material(0), &symbolic[0].pattern);
        for (precision, tolerance) in [(Precision::Double, 1e-12), (Precision::Single, 1e-4)] {
            let solved = |common: bool, twins: usize| {
                let mut factors = Factors::new(symbolic.clone(), precision);
                for (own, subdomain) in subdomains.iter().enumerate() {
                    if common && (1..twins).contains(&own) {
                        factors.share(own, 0);
                    } else {
                        factors.factorise(own, subdomain, &values, &[], common).expect("definite");
                    }
                }
                let mut x = given.clone();
                factors.solve(&mut x);
                x
            };
            let alone = solved(false, 0);
            let together = solved(true, subdomains.len());
            for (a, b) in alone.iter().zip(&together) {
                assert_close(&column(b), &column(a), tolerance);
            }
            for twins in 1..subdomains.len() {
                assert!(solved(true, twins) == together, "{twins} twins");
            }
        }
    });
}

#[test]
fn pinned_unknowns_stay_and_the_others_give_way_as_without_them() {
    on_ranks(&two_bricks_by_metis(7), 1, |setup| {
        let (mut factors, stiffnesses) = setup.factors();
        let pinned = pinnable::unknowns(&setup.discrete.constraints, setup.subdomains(), setup.modes());
        let mut forces = setup.displacements(3);
        let before = forces.clone();
        let own = (0..pinned.len()).find(|&own| !pinned[own].is_empty()).expect("a support holds a part");
        factors
            .factorise(own, &setup.subdomains()[own], &stiffnesses[own], &pinned[own], false)
            .expect("nothing is free");
        assert_eq!(factors.pinned(own), pinned[own]);
        factors.solve(&mut forces);
        let k = dense(&factors.symbolic(own).pattern, &stiffnesses[own]);
        let rest: Vec<usize> = (0..k.nrows()).filter(|&dof| !pinned[own].contains(&(dof as u32))).collect();
        let part = Mat::from_fn(rest.len(), rest.len(), |i, j| k[(rest[i], rest[j])]);
        let moved = part.partial_piv_lu().solve(Mat::from_fn(rest.len(), 1, |i, _| before[own][rest[i]]));
        assert_close(&Mat::from_fn(rest.len(), 1, |i, _| forces[own][rest[i]]), &moved, 1e-10);
        assert!(pinned[own].iter().all(|&dof| forces[own][dof as usize] == 0.0));

        factors
            .factorise(own, &setup.subdomains()[own], &stiffnesses[own], &[], false)
            .expect("elastic bodies are stiff");
        let mut again = before.clone();
        factors.solve(&mut again);
        let mut plain = before;
        setup.factors().0.solve(&mut plain);
        assert_eq!(again, plain);
    });
}

/// Parts are pinned where what is left of the stiffness without the supports' unknowns is as definite as it gets.
#[test]
fn supports_hold_the_parts_to_which_they_leave_no_rigid_motion() {
    let sliding = two_bricks(&["support.left.fix=['x']", "support.right.fix=['x', 'y']"]);
    for (scene, pinned_at_all) in [(two_bricks(&[]), true), (two_bricks_by_metis(7), true), (sliding, false)] {
        on_ranks(&scene, 1, |setup| {
            let (factors, stiffnesses) = setup.factors();
            let pinned = pinnable::unknowns(&setup.discrete.constraints, setup.subdomains(), setup.modes());
            assert_eq!(pinned.iter().any(|pinned| !pinned.is_empty()), pinned_at_all);
            for (own, pinned) in pinned.iter().enumerate() {
                let is_support = |row: u32| matches!(setup.rows()[row as usize].kind, Kind::Support { .. });
                let mut supported: Vec<u32> =
                    setup.gather.entries(own).iter().filter(|e| is_support(e.row)).map(|e| e.dof).collect();
                supported.sort_unstable();
                let k = dense(&factors.symbolic(own).pattern, &stiffnesses[own]);
                let rest: Vec<usize> = (0..k.nrows()).filter(|&dof| !supported.contains(&(dof as u32))).collect();
                let part = Mat::from_fn(rest.len(), rest.len(), |i, j| k[(rest[i], rest[j])]);
                let values = part.self_adjoint_eigenvalues(Side::Lower).expect("they exist");
                let definite = values[0] > 1e-4 * values[values.len() - 1];
                assert_eq!(!pinned.is_empty(), definite && !supported.is_empty(), "subdomain {own}: {:e}", values[0]);
                assert!(pinned.is_empty() || *pinned == supported);
            }
        });
    }
}
