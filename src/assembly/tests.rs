use super::{Region, internal, loads, stiffness};
use crate::decomposition::Subdomain;
use crate::fixture::{
    assert_close, block_diagonal, built_in, column, dense, elastic, on_ranks, same_on_any_ranks, two_bricks,
    two_bricks_by_metis,
};
use crate::material::samples::{MATERIAL, STEEL};
use crate::material::{History, Hooke, Law, Material, VonMises};
use crate::random::Random;
use crate::scene::Scene;
use crate::sparse::pattern::Pattern;

/// A brick cut into boxes and into compact parts, and a rod of one part.
fn shapes() -> Vec<Scene> {
    vec![
        two_bricks(&[]),
        two_bricks_by_metis(7),
        two_bricks(&["body.upper.element=hex8"]),
        two_bricks(&["body.lower.element=tet10", "body.upper.element=tet10"]),
        two_bricks(&["body.lower.element=hex8", "body.upper.element=hex8", "decomposition.subdomains=3"]),
        built_in("bar", &["body.bar.brick.cells=[40, 1, 1]", "decomposition.cells=[40, 1, 1]"]),
    ]
}

fn pattern_of(subdomain: &Subdomain) -> Pattern {
    Pattern::new(subdomain.nodes.len(), &subdomain.elements, &[])
}

/// `u(x) = strain` field with random constant gradients of this size.
fn linear_field(subdomain: &Subdomain, size: f64) -> Vec<f64> {
    let gradient: [[f64; 3]; 3] = std::array::from_fn(|a| Random::new(a as u64).vector(size));
    let at = |p: &[f64; 3]| gradient.map(|row| (0..3).map(|a| row[a] * p[a]).sum::<f64>());
    subdomain.points.iter().flat_map(at).collect()
}

fn size(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |size, x| size.max(x.abs()))
}

#[test]
fn a_linear_displacement_leaves_no_force_inside_whether_elastic_or_plastic() {
    for strain in [1e-4, 1e-1] {
        for scene in shapes() {
            on_ranks(&scene, 1, |setup| {
                for subdomain in setup.subdomains() {
                    let u = linear_field(subdomain, strain);
                    let mut forces = vec![0.0; u.len()];
                    let found = internal::add_forces(&Region::virgin(subdomain, &MATERIAL), &u, &mut forces);
                    assert_eq!(found.plastic, if strain > 1e-2 { subdomain.elements.len() } else { 0 });
                    let tolerance = 1e-12 * size(&forces);
                    for (node, force) in forces.chunks_exact(3).enumerate() {
                        let inside = subdomain.boundary.binary_search(&(node as u32)).is_err();
                        assert!(!inside || size(force) < tolerance);
                    }
                    for axis in 0..3 {
                        let resultant: f64 = forces.iter().skip(axis).step_by(3).sum();
                        assert!(resultant.abs() < tolerance);
                    }
                }
            });
        }
    }
}

#[test]
fn a_translation_has_terms_that_cancel() {
    for scene in shapes() {
        on_ranks(&scene, 1, |setup| {
            for subdomain in setup.subdomains() {
                let u = [1.0, -2.0, 3.0].repeat(subdomain.nodes.len());
                let mut forces = vec![0.0; u.len()];
                let found = internal::add_forces(&Region::virgin(subdomain, &MATERIAL), &u, &mut forces);
                let force_squares: f64 = forces.iter().map(|f| f * f).sum();
                assert!(found.energy <= 1e-30 * found.terms.energy);
                assert!(force_squares <= 1e-30 * found.terms.force_squares);
                assert!(found.terms.energy > 0.0 && found.terms.force_squares > 0.0);
            }
        });
    }
}

#[test]
fn terms_are_no_less_than_what_is_left_of_them() {
    for scene in shapes() {
        on_ranks(&scene, 1, |setup| {
            let elastic = Material::from(VonMises::elastic(210.0, 0.29));
            for (subdomain, u) in setup.subdomains().iter().zip(setup.displacements(4)) {
                let mut forces = vec![0.0; u.len()];
                let found = internal::add_forces(&Region::virgin(subdomain, &elastic), &u, &mut forces);
                assert!(found.terms.energy >= found.energy && found.energy > 0.0);
                // Random displacements do not cancel.
                assert!(found.terms.energy <= 100.0 * found.energy);
            }
        });
    }
}

#[test]
fn elastic_forces_energy_and_norm_are_those_of_the_stiffness() {
    for scene in shapes() {
        on_ranks(&scene, 1, |setup| {
            let material = Material::from(VonMises::elastic(210.0, 0.29));
            for (subdomain, u) in setup.subdomains().iter().zip(setup.displacements(4)) {
                let pattern = pattern_of(subdomain);
                let k = dense(&pattern, &elastic(subdomain, &material, &pattern));
                let mut forces = vec![0.0; u.len()];
                let found = internal::add_forces(&Region::virgin(subdomain, &material), &u, &mut forces);
                let ku = &k * column(&u);
                assert_close(&column(&forces), &ku, 1e-13);
                let square = (column(&u).transpose() * ku)[(0, 0)];
                assert!((found.energy - 0.5 * square).abs() < 1e-13 * square);
                let [norm] = internal::elastic_squares(&Region::virgin(subdomain, &material), [&u]);
                assert!((norm - square).abs() < 1e-13 * square);
            }
        });
    }
}

#[test]
fn rigid_motions_meet_no_stiffness_in_any_shape_elastic_or_plastic() {
    for scene in shapes() {
        on_ranks(&scene, 1, |setup| {
            let mut blocks = Vec::new();
            for (own, subdomain) in setup.subdomains().iter().enumerate() {
                let pattern = pattern_of(subdomain);
                let mut values = vec![0.0; pattern.rows.len()];
                let u = linear_field(subdomain, if own % 2 == 0 { 0.0 } else { 0.1 });
                stiffness::assemble(&Region::virgin(subdomain, &MATERIAL), (&u, &[]), &pattern, &mut values);
                blocks.push(dense(&pattern, &values));
            }
            let k = block_diagonal(&blocks);
            let residual = (&k * setup.dense_modes()).norm_max() / k.norm_max();
            assert!(residual < 1e-14, "{residual:e}");
        });
    }
}

#[test]
fn forces_are_the_slope_of_the_energy_and_the_tangent_that_of_the_forces() {
    for scene in shapes() {
        on_ranks(&scene, 1, |setup| {
            let fields = setup.displacements(9).into_iter().zip(setup.displacements(10));
            for (subdomain, (u, direction)) in setup.subdomains().iter().zip(fields) {
                let material = half_yielding(subdomain, &u).into();
                assert_derivatives(subdomain, &material, &[], &u, &direction);
            }
        });
    }
}

#[test]
fn the_same_holds_after_a_commit_which_keeps_forces_and_makes_the_answer_elastic() {
    for scene in shapes() {
        on_ranks(&scene, 1, |setup| {
            let before = setup.displacements(11).into_iter().zip(setup.displacements(9));
            for (subdomain, ((old, u), direction)) in setup.subdomains().iter().zip(before.zip(setup.displacements(10)))
            {
                let material = VonMises { kinematic_hardening: 3e4, ..half_yielding(subdomain, &old) }.into();
                let history = internal::commit(&Region::virgin(subdomain, &material), &old);
                let at = |history: &[History]| {
                    let mut forces = vec![0.0; u.len()];
                    (
                        internal::add_forces(&Region { subdomain, material: &material, history }, &old, &mut forces)
                            .plastic,
                        forces,
                    )
                };
                let (flowing, waiting) = (at(&[]), at(&history));
                assert_close(&column(&waiting.1), &column(&flowing.1), 1e-12);
                assert!(2 * flowing.0 >= subdomain.elements.len() && waiting.0 == 0);
                assert_derivatives(subdomain, &material, &history, &u, &direction);
            }
        });
    }
}

/// Fails unless forces and tangent at `u` are derivatives, by central differences along `direction`.
fn assert_derivatives(subdomain: &Subdomain, material: &Material, history: &[History], u: &[f64], direction: &[f64]) {
    let at = |by: f64| {
        let moved: Vec<f64> = u.iter().zip(direction).map(|(u, d)| u + by * d).collect();
        let mut forces = vec![0.0; u.len()];
        let found = internal::add_forces(&Region { subdomain, material, history }, &moved, &mut forces);
        (found, forces)
    };
    let h = 1e-6;
    let (back, here, ahead) = (at(-h), at(0.0), at(h));

    let slope: f64 = here.1.iter().zip(direction).map(|(f, d)| f * d).sum();
    let sum: f64 = here.1.iter().map(|f| f.abs()).sum();
    assert!(((ahead.0.energy - back.0.energy) / (2.0 * h) - slope).abs() < 1e-6 * sum);

    let pattern = pattern_of(subdomain);
    let mut values = vec![0.0; pattern.rows.len()];
    let plastic = stiffness::assemble(&Region { subdomain, material, history }, (u, &[]), &pattern, &mut values);
    assert_eq!(plastic, here.0.plastic);
    let change: Vec<f64> = ahead.1.iter().zip(&back.1).map(|(a, b)| (a - b) / (2.0 * h)).collect();
    assert_close(&column(&change), &(dense(&pattern, &values) * column(direction)), 1e-6);
}

/// A material of which at least half of the elements, but not all, yield at `u`.
fn half_yielding(subdomain: &Subdomain, u: &[f64]) -> VonMises {
    let material = |k: i32| VonMises { yield_stress: Some(STEEL.young * 0.99_f64.powi(k)), ..STEEL };
    let plastic = |m: &VonMises| {
        internal::add_forces(&Region::virgin(subdomain, &Material::from(*m)), u, &mut vec![0.0; u.len()]).plastic
    };
    let elements = subdomain.elements.len();
    let found = (-210..1200).map(material).find(|m| 2 * plastic(m) >= elements).expect("everything yields at last");
    assert!(plastic(&found) < elements);
    found
}

#[test]
fn tractions_add_up_to_traction_times_area_on_any_cut_and_any_ranks() {
    for scene in [two_bricks(&[]), two_bricks_by_metis(24), two_bricks(&["body.upper.element=hex8"])] {
        let nodal = same_on_any_ranks(&scene, |setup| {
            let forces = |subdomain: &Subdomain| {
                let mut forces = vec![0.0; subdomain.dofs()];
                loads::add(subdomain, &setup.discrete.loads, &mut forces);
                forces
            };
            setup.subdomains().iter().flat_map(forces).collect()
        });
        for (axis, traction) in [0.1, 0.2, -0.3].into_iter().enumerate() {
            let total: f64 = nodal.iter().skip(axis).step_by(3).sum();
            assert!((total - traction * 4.0 * 2.2).abs() < 1e-13);
        }
    }
}

#[test]
fn each_quadrilateral_gives_a_quarter_of_its_force_to_each_corner() {
    let cube =
        built_in("bar", &["body.bar.element=hex8", "body.bar.brick.cells=[1, 1, 1]", "decomposition.cells=[1, 1, 1]"]);
    on_ranks(&cube, 1, |setup| {
        let subdomain = &setup.subdomains()[0];
        let mut forces = vec![0.0; subdomain.dofs()];
        loads::add(subdomain, &setup.discrete.loads, &mut forces);
        let quarter = 500.0 * 500.0 * 500.0 / 4.0;
        for (node, force) in forces.as_chunks::<3>().0.iter().enumerate() {
            assert_eq!(*force, [if node % 2 == 1 { quarter } else { 0.0 }, 0.0, 0.0]);
        }
    });
}

#[test]
fn each_triangle_gives_a_third_of_its_force_to_each_corner_and_tractions_on_one_surface_add_up() {
    let cube = built_in("bar", &["body.bar.brick.cells=[1, 1, 1]", "decomposition.cells=[1, 1, 1]"]);
    on_ranks(&cube, 1, |setup| {
        let subdomain = &setup.subdomains()[0];
        let half = setup.discrete.loads[0].times(0.5);
        let mut forces = vec![0.0; subdomain.dofs()];
        loads::add(subdomain, &[half, half], &mut forces);
        let total = 500.0 * 500.0 * 500.0;
        // The diagonal of xmax runs through corners 3 and 5: both triangles meet there.
        for (node, sixths) in [0.0, 1.0, 0.0, 2.0, 0.0, 2.0, 0.0, 1.0].into_iter().enumerate() {
            assert!((forces[3 * node] - sixths / 6.0 * total).abs() < 1e-15 * total, "{node}");
            assert_eq!(forces[3 * node + 1..][..2], [0.0, 0.0]);
        }
    });
}

/// The bar, cut into boxes or not at all, with one load for each text.
fn loaded_bar(cells: [usize; 3], loads: &[String]) -> Scene {
    let named: Vec<String> = loads.iter().enumerate().map(|(k, load)| format!("load.l{k}={load}")).collect();
    let cells = format!("decomposition.cells={cells:?}");
    built_in(
        "bar",
        &[&["load.pull.traction=[0, 0, 0]", &cells][..], &named.iter().map(|s| &s[..]).collect::<Vec<_>>()].concat(),
    )
}

#[test]
fn pressure_all_round_is_the_force_of_hydrostatic_stress_and_has_no_resultant() {
    let faces = ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"];
    let pressure: Vec<String> = faces.map(|face| format!("{{surface = 'bar.{face}', pressure = 7}}")).into();
    on_ranks(&loaded_bar([4, 2, 2], &pressure), 1, |setup| {
        let subdomain = &setup.subdomains()[0];
        let mut forces = vec![0.0; subdomain.dofs()];
        loads::add(subdomain, &setup.discrete.loads, &mut forces);
        let material = Material::from(VonMises::elastic(210.0, 0.29));
        let Hooke { young, poisson } = material.hooke();
        let stretch = -7.0 * (1.0 - 2.0 * poisson) / young;
        let u: Vec<f64> = subdomain.points.as_flattened().iter().map(|x| stretch * x).collect();
        let mut internal = vec![0.0; subdomain.dofs()];
        internal::add_forces(&Region::virgin(subdomain, &material), &u, &mut internal);
        assert_close(&column(&forces), &column(&internal), 1e-12);
        let resultants = setup.modes()[0].resultants(&subdomain.points, &forces);
        assert!(size(&resultants) < 1e-12 * size(&forces), "{resultants:?}");
    });
}

#[test]
fn a_body_force_acts_with_force_times_volume_at_the_centre_of_its_body_alone() {
    let scene = two_bricks(&["load.top={body = \"upper\", body_force = [0.1, 0.2, -0.3]}"]);
    let sums = |setup: &crate::fixture::Setup| {
        let mut sums = vec![0.0; 24];
        for subdomain in setup.subdomains() {
            let mut forces = vec![0.0; subdomain.dofs()];
            loads::add(subdomain, &setup.discrete.loads, &mut forces);
            let sums = &mut sums[12 * subdomain.body..][..12];
            for (point, force) in subdomain.points.iter().zip(forces.chunks_exact(3)) {
                for (a, f) in force.iter().enumerate() {
                    sums[a] += f;
                    (0..3).for_each(|b| sums[3 + 3 * a + b] += f * point[b]);
                }
            }
        }
        sums
    };
    let sums = on_ranks(&scene, 1, sums).remove(0);
    assert!(sums[..12].iter().all(|sum| *sum == 0.0), "the lower brick carries no load");
    for (a, force) in [0.1, 0.2, -0.3].into_iter().enumerate() {
        let volume = 4.0 * 2.2 * 1.8;
        assert!((sums[12 + a] - force * volume).abs() < 1e-13 * volume);
        for (b, centre) in [3.0, 1.1, 3.0].into_iter().enumerate() {
            let found = sums[15 + 3 * a + b];
            assert!((found - force * volume * centre).abs() < 1e-13 * volume, "{a} {b} {found}");
        }
    }
}
