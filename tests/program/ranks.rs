//! The same scene gives bitwise the same summary and fields for every number of ranks: subdomains belong to the scene,
//! and sums are formed in their order. Ranks beyond the number of subdomains stay idle.

use crate::common::fields::Fields;
use crate::common::msh::{Form, write};
use crate::common::{COARSE, Run, only_result, scene_file, solve};
use fetiplast::mesh::Brick;
use serde_json::{Map, Value};

const RANKS: [usize; 4] = [1, 2, 3, 5];

/// The summary but for what belongs to the run, and warnings, which tell of idle ranks.
fn result(run: &Run) -> Map<String, Value> {
    let mut summary = only_result(run.summary());
    assert!(summary.remove("warnings").is_some());
    summary
}

/// Fails unless all runs have the same results to the last bit; returns the number of subdomains.
fn assert_independent_of_ranks(scene: &str, sets: &[&str], all_ranks: &[usize]) -> u64 {
    let mut first = None;
    let mut subdomains = 0;
    for &ranks in all_ranks {
        let run = solve(ranks, scene, sets).converged();
        let summary = result(&run);
        subdomains = summary["subdomains"].as_u64().unwrap();
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
    subdomains
}

#[test]
fn bricks_give_the_same_bits_on_1_2_3_and_5_ranks() {
    assert_eq!(assert_independent_of_ranks("two-blocks", &COARSE, &RANKS), 6);
}

#[test]
fn metis_parts_give_the_same_bits_on_1_2_3_and_5_ranks() {
    let sets = [&COARSE[..2], &["decomposition.method=metis", "decomposition.subdomains=7"]].concat();
    assert!(assert_independent_of_ranks("two-blocks", &sets, &RANKS) >= 7);
}

#[test]
fn sixteen_ranks_on_a_few_cores_give_the_bits_of_one() {
    let sets = [&COARSE[..2], &["decomposition.method=metis", "decomposition.subdomains=24"]].concat();
    assert!(assert_independent_of_ranks("two-blocks", &sets, &[1, 16]) >= 24);
}

#[test]
fn bodies_from_mesh_files_give_the_same_bits_on_1_2_3_and_5_ranks() {
    let brick = |z: f64| Brick { origin: [0.0, 0.0, z], size: [4.0, 2.0, 2.0], cells: [8, 4, 4] };
    let directory = tempfile::tempdir().unwrap();
    let mesh = write(&[("lower", brick(0.0)), ("upper", brick(2.0))], Form::Binary41);
    std::fs::write(directory.path().join("two.msh"), mesh).unwrap();
    let body = |name: &str| {
        format!(
            "[body.{name}]\nmaterial = 'steel'\nelement = 'tet4'\ngmsh = {{ file = 'two.msh', volume = '{name}' }}\n"
        )
    };
    let text = "[material.steel]\nyoung = 210.0\npoisson = 0.3\nyield_stress = 0.3\nhardening = 10.0\n".to_owned()
        + &body("lower")
        + &body("upper")
        + "[support.left]\nsurface = 'lower.xmin'\nfix = ['x', 'y', 'z']\n\
           [support.right]\nsurface = 'upper.xmax'\nfix = ['x', 'y', 'z']\n\
           [load.top]\nsurface = 'upper.zmax'\ntraction = [0.0, 0.0, -0.05]\n\
           [contact.joint]\nslave = 'upper.zmin'\nmaster = 'lower.zmax'\n";
    let scene = scene_file(directory.path(), &text);
    assert!(assert_independent_of_ranks(&scene, &["decomposition.subdomains=7"], &RANKS) >= 7);
}

#[test]
fn preconditioned_active_sets_give_the_same_bits_on_1_2_3_and_5_ranks() {
    let sets = [&COARSE[..], &["solver.qp=active-set", "solver.preconditioner=dirichlet"]].concat();
    assert_eq!(assert_independent_of_ranks("two-blocks", &sets, &RANKS), 6);
}

#[test]
fn ranks_without_a_subdomain_stay_idle_and_change_nothing() {
    let sets = [&COARSE[..2], &["decomposition.cells=[15, 5, 5]"]].concat();
    assert_eq!(assert_independent_of_ranks("two-blocks", &sets, &[1, 3, 5]), 2);
    let warned = |ranks| solve(ranks, "bar", &[]).converged().summary()["warnings"].to_string();
    assert!(warned(3).contains("1 of 3 ranks stay idle: there are only 2 subdomains"));
    assert_eq!(warned(2), "[]");
}

#[test]
fn a_scene_without_contact_gives_the_same_bits_on_1_2_3_and_5_ranks() {
    assert_eq!(assert_independent_of_ranks("shear", &[], &RANKS), 8);
}

#[test]
fn contact_with_an_obstacle_gives_the_same_bits_on_1_2_3_and_5_ranks() {
    let sets = ["body.cube.brick.cells=[8, 8, 8]", "decomposition.cells=[4, 4, 4]"];
    assert_eq!(assert_independent_of_ranks("step-42", &sets, &RANKS), 8);
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
    assert!(assert_independent_of_ranks(scene, &sets, &[1, 2, 3]) >= 24);
}
