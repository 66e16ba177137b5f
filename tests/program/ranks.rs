//! The same scene gives bitwise the same summary and fields for every number of ranks: subdomains belong to the scene,
//! and sums are formed in their order. Ranks beyond the number of subdomains stay idle.

use crate::common::fields::Fields;
use crate::common::msh::{Form, write};
use crate::common::{COARSE, Run, assert_close, only_result, scene_file, solve};
use fetiplast::mesh::Brick;
use serde_json::{Map, Value};

const RANKS: [usize; 4] = [1, 2, 3, 5];

/// The summary but for what belongs to the run, and warnings, which tell of idle ranks.
fn result(run: &Run) -> Map<String, Value> {
    let mut summary = only_result(run.summary());
    assert!(summary.remove("warnings").is_some());
    summary
}

/// Fails unless all runs have the same results to the last bit, which it returns.
pub fn assert_independent_of_ranks(scene: &str, sets: &[&str], all_ranks: &[usize]) -> Map<String, Value> {
    let mut first = None;
    for &ranks in all_ranks {
        let run = solve(ranks, scene, sets).converged();
        let summary = result(&run);
        let subdomains = summary["subdomains"].as_u64().unwrap();
        let fields = Fields::read(&run.result());
        assert_eq!(fields.cells_of_pieces().len(), ranks, "one piece a rank");
        let mut bits = fields.bits(&["VTKHDF/PointData", "VTKHDF/CellData", "convergence"]);
        assert!(bits.len() > 10 && bits.iter().all(|(_, column)| !column.is_empty()), "no fields");
        let owners = bits.iter().position(|(name, _)| name == "VTKHDF/CellData/rank").expect("a field `rank`");
        let (_, owners) = bits.swap_remove(owners);
        assert_eq!(owners.iter().max(), Some(&(ranks.min(subdomains as usize) as u64 - 1)), "every rank has its share");
        bits.sort();
        let points: Vec<_> = fields.points.iter().map(|point| point.map(f64::to_bits)).collect();
        let (summary_1, bits_1, points_1, elements_1) =
            first.get_or_insert_with(|| (summary.clone(), bits.clone(), points.clone(), fields.elements.clone()));
        for (key, value) in &summary {
            assert_eq!(*value, summary_1[key], "{key} on {ranks} ranks");
        }
        assert_eq!(summary.len(), summary_1.len());
        for ((name, column), (name_1, column_1)) in bits.iter().zip(bits_1) {
            assert!(name == name_1 && column == column_1, "{name} differs on {ranks} ranks");
        }
        assert!(points == *points_1 && fields.elements == *elements_1, "another mesh on {ranks} ranks");
    }
    first.expect("some ranks").0
}

#[test]
fn bricks_give_the_same_bits_on_1_2_3_and_5_ranks() {
    assert_eq!(assert_independent_of_ranks("two-blocks", &COARSE, &RANKS)["subdomains"], 6);
}

#[test]
fn metis_parts_give_the_same_bits_on_1_2_3_and_5_ranks() {
    let sets = [&COARSE[..2], &["decomposition.method=metis", "decomposition.subdomains=7"]].concat();
    assert!(assert_independent_of_ranks("two-blocks", &sets, &RANKS)["subdomains"].as_u64() >= Some(7));
}

#[test]
fn sixteen_ranks_on_a_few_cores_give_the_bits_of_one() {
    let sets = [&COARSE[..2], &["decomposition.method=metis", "decomposition.subdomains=24"]].concat();
    assert!(assert_independent_of_ranks("two-blocks", &sets, &[1, 16])["subdomains"].as_u64() >= Some(24));
}

/// The lower body is rigid but for its flow: faces between its subdomains have a scaling of their own, supports hold some of them still.
#[test]
fn a_rigid_body_that_flows_gives_the_same_bits_on_1_2_3_and_5_ranks() {
    let sets = [&COARSE[..], &["material.lower.young=2.1e11"]].concat();
    assert_eq!(assert_independent_of_ranks("two-blocks", &sets, &RANKS)["subdomains"], 6);
}

/// A block from a mesh file that a rigid ball presses into, plastic under it.
#[test]
fn a_mesh_file_cut_into_1_7_24_and_60_parts_gives_one_energy_and_the_same_bits_on_1_2_and_3_ranks() {
    let block = Brick { origin: [0.0; 3], size: [4.0, 4.0, 2.0], cells: [8, 8, 4] };
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("block.msh"), write(&[("block", block)], Form::Binary41)).unwrap();
    let scene = scene_file(
        directory.path(),
        r#"
        [material.steel]
        young = 210.0
        poisson = 0.3
        yield_stress = 0.3
        hardening = 10.0
        [body.block]
        material = "steel"
        element = "tet4"
        gmsh = { file = "block.msh" }
        [support.bottom]
        surface = "block.zmin"
        fix = ["x", "y", "z"]
        [contact.ball]
        slave = "block.zmax"
        rigid = { sphere = { centre = [2.1, 1.9, 4.9], radius = 3.0 } }
        "#,
    );
    let tight = ["solver.newton_tolerance=1e-8", "solver.residual_tolerance=1e-10", "solver.qp_tolerance=1e-11"];
    let mut whole: Option<Map<String, Value>> = None;
    for parts in [1, 7, 24, 60] {
        let cut = format!("decomposition.subdomains={parts}");
        let summary = assert_independent_of_ranks(&scene, &[&tight[..], &[&cut]].concat(), &[1, 2, 3]);
        assert!(summary["subdomains"].as_u64() >= Some(parts));
        let whole = whole.get_or_insert_with(|| summary.clone());
        for key in ["energy", "internal_energy", "max_displacement", "max_von_mises"] {
            let [found, expected] = [&summary, &*whole].map(|s| s[key].as_f64().unwrap());
            assert_close(key, found, expected, 1e-8);
        }
        assert_eq!(summary["plastic_elements"], whole["plastic_elements"]);
        assert!(summary["plastic_elements"].as_u64() > Some(100) && summary["active_contacts"].as_u64() > Some(4));
    }
}

#[test]
fn preconditioned_active_sets_give_the_same_bits_on_1_2_3_and_5_ranks() {
    let sets = [&COARSE[..], &["solver.qp=active-set", "solver.preconditioner=dirichlet"]].concat();
    assert_eq!(assert_independent_of_ranks("two-blocks", &sets, &RANKS)["subdomains"], 6);
}

#[test]
fn ranks_without_a_subdomain_stay_idle_and_change_nothing() {
    let sets = [&COARSE[..2], &["decomposition.cells=[15, 5, 5]"]].concat();
    assert_eq!(assert_independent_of_ranks("two-blocks", &sets, &[1, 3, 5])["subdomains"], 2);
    let warned = |ranks| solve(ranks, "bar", &[]).converged().summary()["warnings"].to_string();
    assert!(warned(3).contains("1 of 3 ranks stay idle: there are only 2 subdomains"));
    assert_eq!(warned(2), "[]");
}

#[test]
fn a_scene_without_contact_gives_the_same_bits_on_1_2_3_and_5_ranks() {
    assert_eq!(assert_independent_of_ranks("shear", &[], &RANKS)["subdomains"], 8);
}

#[test]
fn contact_with_an_obstacle_gives_the_same_bits_on_1_2_3_and_5_ranks() {
    let sets = ["body.cube.brick.cells=[8, 8, 8]", "decomposition.cells=[4, 4, 4]"];
    assert_eq!(assert_independent_of_ranks("step-42", &sets, &RANKS)["subdomains"], 8);
}

#[test]
fn contact_of_meshes_that_do_not_match_gives_the_same_bits_on_1_2_3_and_5_ranks() {
    let cells = ["body.upper.brick.cells=[6, 5, 4]", "decomposition.cells=[2, 1, 2]"];
    assert_independent_of_ranks("patch", &cells, &[1, 2, 3, 5]);
}

#[test]
fn curved_interfaces_of_a_mesh_file_give_the_same_bits_on_1_2_and_3_ranks() {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/ring.toml");
    let mesh = ["inner", "outer"].map(|body| format!("body.{body}.gmsh.file='../tests/meshes/ring-8-6.msh'"));
    let sets = [&mesh[0], &mesh[1], "decomposition.subdomains=24"];
    assert!(assert_independent_of_ranks(scene, &sets, &[1, 2, 3])["subdomains"].as_u64() >= Some(24));
}
