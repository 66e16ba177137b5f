use std::collections::HashSet;
use std::rc::Rc;

use faer::{Mat, Side};

use super::{Factors, analyse};
use crate::assembly::{Region, stiffness};
use crate::constraint::Kind;
use crate::decomposition::Subdomain;
use crate::feti::inverse::kernel::RigidModes;
use crate::feti::inverse::pins::Pins;
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
            let mut factors = Factors::new(analyse(setup.subdomains()), Precision::Double, None);
            for (own, subdomain) in setup.subdomains().iter().enumerate() {
                for u in [vec![0.0; subdomain.dofs()], stretched(subdomain)] {
                    let mut values = vec![0.0; factors.symbolic(own).pattern.rows.len()];
                    let region = Region::virgin(subdomain, &MATERIAL);
                    stiffness::assemble(&region, (&u, &[]), &factors.symbolic(own).pattern, &mut values);
                    factors.factorise(own, subdomain, &values, false).expect("stiff up to rigid motions");
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
                let error = factors.factorise(2, subdomain, &values, false).expect_err("it is spoilt");
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
                let mut factors = Factors::new(symbolic.clone(), precision, None);
                for (own, subdomain) in subdomains.iter().enumerate() {
                    if common && (1..twins).contains(&own) {
                        factors.share(own, 0);
                    } else {
                        factors.factorise(own, subdomain, &values, common).expect("definite");
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

/// A brick of each kind: held at a face, on a plane without friction, at a corner, free; regular parts and irregular ones.
fn supported() -> [Scene; 4] {
    let sliding = |axes: &str| two_bricks(&[&format!("support.left.fix={axes}"), "support.right.fix=['x', 'y']"]);
    [two_bricks(&[]), two_bricks_by_metis(7), sliding("['x']"), sliding("['x', 'z']")]
}

/// `K^+` is that of the part on its supports: with the dense stiffness `K_ii` of what is not pinned, `K_ii K^+ K_ii = K_ii`.
#[test]
fn pinned_unknowns_stay_and_the_others_give_way_as_on_their_supports() {
    let mut seen = HashSet::new();
    for scene in supported() {
        let counts = on_ranks(&scene, 1, |setup| {
            let stiffnesses = setup.factors().1;
            let pins = Pins::of_supports(&setup.discrete.constraints, setup.subdomains());
            let mut factors = Factors::new(analyse(setup.subdomains()), Precision::Double, Some(pins.clone()));
            for (own, pins) in pins.iter().enumerate() {
                let (subdomain, values) = (&setup.subdomains()[own], &stiffnesses[own]);
                factors.factorise(own, subdomain, values, false).expect("what is left free is held");
                assert_eq!(factors.pinned(own), pins.unknowns);
                let k = dense(&factors.symbolic(own).pattern, values);
                let is_free = |dof: &usize| !pins.unknowns.contains(&(*dof as u32));
                let rest: Vec<usize> = (0..k.nrows()).filter(is_free).collect();
                let part = Mat::from_fn(rest.len(), rest.len(), |i, j| k[(rest[i], rest[j])]);
                let mut random = Random::new(own as u64);
                let x = Mat::from_fn(rest.len(), 1, |_, _| random.number());
                let force = &part * &x;
                let mut torn = setup.gather.zeros();
                // What pulls at pinned unknowns does nothing.
                torn[own].fill(1.0);
                rest.iter().enumerate().for_each(|(at, &dof)| torn[own][dof] = force[(at, 0)]);
                factors.solve(&mut torn);
                let moved = Mat::from_fn(rest.len(), 1, |at, _| torn[own][rest[at]]);
                assert_close(&(&part * moved), &force, 1e-10);
                assert!(pins.unknowns.iter().all(|&dof| torn[own][dof as usize] == 0.0));
            }
            pins.iter().map(|pins| pins.free.len()).collect::<Vec<_>>()
        });
        seen.extend(counts.concat());
    }
    assert!(seen.len() >= 4, "parts with several numbers of free motions: {seen:?}");
}

/// What is free is what the stiffness without the supported unknowns has no energy for.
#[test]
fn pins_know_which_rigid_motions_they_leave_free() {
    for scene in supported() {
        on_ranks(&scene, 1, |setup| {
            let (factors, stiffnesses) = setup.factors();
            let pins = Pins::of_supports(&setup.discrete.constraints, setup.subdomains());
            assert!(pins.iter().any(|pins| !pins.unknowns.is_empty()));
            for (own, pins) in pins.iter().enumerate() {
                let is_support = |row: u32| matches!(setup.rows()[row as usize].kind, Kind::Support { .. });
                let mut supported: Vec<u32> =
                    setup.gather.entries(own).iter().filter(|e| is_support(e.row)).map(|e| e.dof).collect();
                supported.sort_unstable();
                let k = dense(&factors.symbolic(own).pattern, &stiffnesses[own]);
                let rest: Vec<usize> = (0..k.nrows()).filter(|&dof| !supported.contains(&(dof as u32))).collect();
                let part = Mat::from_fn(rest.len(), rest.len(), |i, j| k[(rest[i], rest[j])]);
                let values = part.self_adjoint_eigenvalues(Side::Lower).expect("they exist");
                let energy = |share: f64| values.iter().filter(|v| **v <= share * values[values.len() - 1]).count();
                let is_clear = energy(1e-12) == energy(1e-4);
                assert_eq!(pins.unknowns, if is_clear { supported } else { Vec::new() }, "subdomain {own}");
                assert_eq!(pins.free.len(), if is_clear { energy(1e-12) } else { 6 }, "subdomain {own}");
                let modes = RigidModes::new(&setup.subdomains()[own].shape);
                for motion in &pins.free {
                    for &dof in &pins.unknowns {
                        let at = modes.along(dof as usize % 3, setup.subdomains()[own].shape[dof as usize / 3]);
                        assert!(at.iter().zip(motion).map(|(m, a)| m * a).sum::<f64>().abs() < 1e-14);
                    }
                }
            }
        });
    }
}
