//! How a scene is cut and solved, and what it refuses to solve.

use super::*;

#[test]
fn decompositions_are_checked() {
    refuses(&["decomposition.cells=[0, 2, 2]"], &["decomposition.cells = [0, 2, 2]"]);
    refuses(
        &["decomposition.cells=[2, 3, 2]"],
        &["decomposition.cells = [2, 3, 2]: 3 does not divide the 2 cells", "body block", "along y"],
    );
    assert_says(two_blocks(&["decomposition.subdomains=1"]), &["decomposition.subdomains = 1", "2 bodies"]);
    refuses(&["decomposition.subdomains=49"], &["decomposition.subdomains = 49", "48 elements"]);
    assert!(one(&["decomposition.subdomains=48"]).is_ok());
    refuses(&["decomposition.cluster=0"], &["decomposition.cluster = 0", "at least 1"]);
    assert_eq!(one(&["decomposition.cluster=8"]).unwrap().decomposition.cluster, Some(Groups::Equal(8)));
}

#[test]
fn the_method_follows_the_keys() {
    let metis = |subdomains| Method::Metis { subdomains: Some(subdomains) };
    let bricks = Method::Bricks { cells: PAPER_CELLS };
    let cut = |text: &str, list: &[&str]| {
        let text = ONE.replace("cells = [2, 2, 2]\n", text);
        Scene::from_text(&text, "one.toml", 5, &sets(list)).map(|scene| scene.decomposition.method)
    };
    assert_eq!(cut("", &[]).unwrap(), Method::default());
    assert_eq!(cut("subdomains = 4", &[]).unwrap(), metis(4));
    assert_eq!(cut("method = 'metis'\ncells = [9, 9, 9]\nsubdomains = 4", &[]).unwrap(), metis(4));
    let both = cut("method = 'bricks'\nsubdomains = 4", &[]).unwrap_err().to_string();
    assert!(both.contains("line 13") && both.contains("method = \"bricks\" is given"), "{both}");
    assert_eq!(cut("method = 'metis'", &[]).unwrap(), Method::Metis { subdomains: None });
    assert_eq!(cut("method = 'bricks'", &[]).unwrap(), bricks);
    assert_eq!(cut("method = 'auto'", &[]).unwrap(), Method::Auto);
    assert!(cut("method = 'auto'\nsubdomains = 4", &[]).is_err());

    assert_eq!(cut("method = 'bricks'", &["decomposition.subdomains=4"]).unwrap(), metis(4));
    assert_eq!(cut("subdomains = 4", &["decomposition.method=bricks"]).unwrap(), bricks);
    assert_eq!(cut("subdomains = 4", &["decomposition.method=auto"]).unwrap(), Method::Auto);
    assert!(cut("", &["decomposition.method=bricks", "decomposition.subdomains=4"]).is_err());
    let supplied = ["decomposition.subdomains=4", "decomposition.method=metis"];
    assert_eq!(cut("method = 'bricks'", &supplied).unwrap(), metis(4));
}

#[test]
fn solver_settings_are_checked() {
    for key in ["newton_tolerance", "residual_tolerance", "qp_tolerance", "accuracy"] {
        for value in ["0", "1", "-1e-4", "nan", "inf"] {
            refuses(&[&format!("solver.{key}={value}")], &[&format!("solver.{key} = "), "above 0 and below 1"]);
        }
    }
    for key in ["newton_limit", "qp_limit"] {
        refuses(&[&format!("solver.{key}=0")], &[&format!("solver.{key} = 0"), "at least 1"]);
    }
    refuses(&["solver.qp=simplex"], &["solver.qp=simplex", "smalse-m", "active-set"]);
    let scene = one(&["solver.qp=active-set", "solver.preconditioner=lumped"]).unwrap();
    let Solver { qp, preconditioner, .. } = scene.solver;
    assert_eq!((qp, preconditioner), (Qp::ActiveSet, Preconditioner::Lumped));
}

#[test]
fn bodies_must_be_held() {
    refuses(
        &["support.base.fix=['x', 'y']"],
        &["body.block", "translation along z, rotation about x, rotation about y:"],
    );
    refuses(&["support.base.fix=['z']"], &["translation along x, translation along y, rotation about z:"]);
    let mut hinge = sets(&["support.base.fix=['z']"]);
    hinge.push("support.back={surface = 'block.xmin', fix = ['x']}".to_owned());
    assert_says(Scene::from_text(ONE, "one.toml", 1, &hinge), &["against translation along y:"]);
    hinge.push("support.side={surface = 'block.ymin', fix = ['y']}".to_owned());
    assert!(Scene::from_text(ONE, "one.toml", 1, &hinge).is_ok(), "three planes of symmetry hold a body");
    let floor = "contact.floor={slave = 'block.zmin', rigid = {plane = {point = [0, 0, 0], normal = [0, 0, 1]}}}";
    let loose = one(&["support.base.fix=['x', 'y']", floor]).unwrap();
    assert!(loose.warnings()[0].contains("translation along z"), "{:?}", loose.warnings());
    hinge[1] = "support.back={surface = 'block.zmax', fix = ['y']}".to_owned();
    assert_says(Scene::from_text(ONE, "one.toml", 1, &hinge), &["against translation along x:"]);
}

#[test]
fn thin_bodies_are_held_like_thick_ones() {
    let clamp = "support.base.surface=block.xmin";
    for size in ["[1e9, 1e-9, 1]", "[1, 1e-12, 1e-12]"] {
        assert!(one(&[clamp, &format!("body.block.brick.size={size}")]).is_ok());
    }
}

#[test]
fn contact_may_hold_a_body() {
    assert!(two_blocks(&[]).unwrap().warnings().is_empty());
    let loose = two_blocks(&["support.right.fix=['x', 'y']"]).unwrap();
    let warnings = loose.warnings();
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("body upper"), "{warnings:?}");
    assert!(warnings[0].contains("1 rigid motion that only contact can hold: translation along z"), "{warnings:?}");
}

/// Every form of a number, as texts and as tables, through a scene and back.
#[test]
fn numbers_whose_error_is_asked_for_are_read_in_both_forms() {
    let read = |value: &str| two_blocks(&["solver.error=0.01", &format!("solver.error_of={value}")]);
    for (text, table) in [
        ("displacement:1,2.5,3:-z", "{displacement={point=[1.0, 2.5, 3.0], direction=[0.0, 0.0, -2.0]}}"),
        (
            "displacement:1,2.5,3:3,0,4:upper",
            "{displacement={point=[1.0, 2.5, 3.0], direction=[0.6, 0.0, 0.8], body='upper'}}",
        ),
        ("reaction:left:x", "{reaction={support='left', direction='x'}}"),
        ("contact_force", "{contact_force={}}"),
        ("contact_force:joint", "{contact_force={contact='joint'}}"),
        ("contact_force:joint:0,0,1", "{contact_force={contact='joint', direction='z'}}"),
    ] {
        let scene = read(text).unwrap();
        assert_eq!(scene, read(table).unwrap(), "{text}");
        assert_eq!(Scene::from_text(&scene.to_toml(), "echo", 1, &[]).unwrap(), scene, "{}", scene.to_toml());
        assert!(scene.solver.error_of.goal().is_some());
    }
    let of_stress = read("stress").unwrap();
    assert_eq!(Scene::from_text(&of_stress.to_toml(), "echo", 1, &[]).unwrap(), of_stress);
}

#[test]
fn numbers_that_a_scene_does_not_have_are_refused() {
    let refuses = |value: &str, words: &[&str]| {
        assert_says(two_blocks(&["solver.error=0.01", &format!("solver.error_of={value}")]), words);
    };
    refuses("heat", &["`heat`", "displacement:X,Y,Z:DIRECTION"]);
    refuses("displacement:1,2:z", &["`1,2` is no point"]);
    refuses("displacement:1,2,3:w", &["`w` is no direction"]);
    refuses("displacement:1,2,3:0,0,0", &["is no direction"]);
    refuses("displacement:1,2,nan:z", &["solver.error_of", "finite"]);
    refuses("displacement:1,2,3", &["write energy, stress"]);
    refuses("displacement:1,2,3:z:middle", &["no such body: known are lower, upper"]);
    refuses("reaction", &["several: name one of left, right"]);
    refuses("reaction:bottom", &["no such support: known are left, right"]);
    refuses("reaction:left", &["fixes several components", "reaction:left:z"]);
    refuses("contact_force:bolt", &["no such contact: known are joint"]);
    refuses("{reaction={support='left', along='x'}}", &["unknown key `along`"]);
    let roll = "support.roll={surface='block.xmin', fix=['x']}";
    let one = |value: &str| one(&["solver.error=0.01", roll, &format!("solver.error_of={value}")]);
    assert!(one("reaction:roll").is_ok() && one("reaction:base:1,2,3").is_ok());
    assert_says(one("reaction:roll:z"), &["support.roll does not fix z"]);
    assert_says(one("contact_force"), &["the scene has no contact"]);
}
