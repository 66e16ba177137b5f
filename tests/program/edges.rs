//! Contact that ends, is shared by several contacts, runs round an edge, or is none: what a user draws is what is computed.

use crate::common::fields::Fields;
use crate::common::{
    Run, assert_near, assert_residuals, number, only_result, scene_file, solve, solve_tightly, vector,
};

/// A box: origin, size, cells.
struct Block([f64; 3], [f64; 3], [usize; 3]);

impl Block {
    fn toml(&self, name: &str, element: &str) -> String {
        let Block(origin, size, cells) = self;
        format!(
            "[body.{name}]\nmaterial = \"soft\"\nelement = \"{element}\"\nbrick = {{ origin = {origin:?}, size = {size:?}, \
             cells = {cells:?} }}\n"
        )
    }
}

const SOFT: &str = "[material.soft]\nyoung = 1000.0\npoisson = 0.3\n";

const NAMED: [&str; 2] = ["slave = \"top.zmin\"\nmaster = \"bot.zmax\"", "slave = \"bot.zmax\"\nmaster = \"top.zmin\""];
const EITHER: &str = "surfaces = [\"top.zmin\", \"bot.zmax\"]";

/// A block on a block, guided along z at its top, where it is pressed with 1.
fn stacked(bottom: &Block, top: &Block, element: &str, sides: &str) -> String {
    let blocks = bottom.toml("bot", element) + &top.toml("top", element);
    format!(
        "{SOFT}{blocks}
        [support.ground]
        surface = \"bot.zmin\"
        fix = [\"x\", \"y\", \"z\"]
        [support.guide]
        surface = \"top.zmax\"
        fix = [\"x\", \"y\"]
        [load.press]
        surface = \"top.zmax\"
        traction = [0.0, 0.0, -1.0]
        [contact.joint]
        {sides}
        "
    )
}

fn run(text: &str) -> Run {
    let directory = tempfile::tempdir().unwrap();
    solve(1, &scene_file(directory.path(), text), &[])
}

#[test]
fn a_block_whose_load_is_beyond_its_base_tips_whichever_surface_is_the_slave() {
    let bottom = Block([0.0; 3], [1.0; 3], [3, 3, 3]);
    for element in ["tet4", "hex8", "tet10"] {
        for (offset, stands) in [(0.45, true), (0.52, false), (0.55, false), (0.58, false), (-0.55, false)] {
            let top = Block([offset, 0.0, 1.0], [1.0; 3], [5, 5, 5]);
            for sides in [NAMED[0], NAMED[1], EITHER] {
                let run = run(&stacked(&bottom, &top, element, sides));
                if stands {
                    assert_residuals(&run.converged().summary(), 1e-6);
                } else {
                    assert_eq!(run.code, 65, "{element} {offset} {sides}: {}{}", run.stdout, run.stderr);
                    assert!(run.stderr.contains("body.top: loads drive its rotation about"), "{}", run.stderr);
                }
            }
        }
    }
}

/// Pressures on the nodes of both surfaces, at z = 1, by place.
fn pressures(run: &Run) -> Vec<([f64; 3], f64)> {
    let fields = Fields::read(&run.result());
    let pressure = fields.of_points("contact_pressure");
    let joint = fields.points.iter().copied().zip(pressure);
    joint.filter(|(point, _)| (point[2] - 1.0).abs() < 1e-9).collect()
}

/// The wide block presses its middle on a narrow one. Nothing acts beyond the edges, and what acts within is that of the scene
/// with the slave exchanged.
#[test]
fn a_slave_that_overhangs_has_the_pressures_of_the_exchanged_scene() {
    for element in ["hex8", "tet4"] {
        let bottom = Block([0.0; 3], [1.0; 3], [13, 13, 6]);
        let top = Block([-0.47, -0.53, 1.0], [2.0, 2.0, 1.0], [26, 26, 6]);
        let [wide, narrow] = NAMED.map(|sides| run(&stacked(&bottom, &top, element, sides)).converged());
        let covered = |at: &[f64; 3]| (0..2).all(|a| (-1e-9..=1.0 + 1e-9).contains(&at[a]));
        let inner = |at: &[f64; 3]| (0..2).all(|a| (0.1..=0.9).contains(&at[a]));
        let [of_wide, of_narrow] = [pressures(&wide), pressures(&narrow)];
        let (mut square, mut difference) = (0.0, 0.0);
        for ((at, one), (_, other)) in of_wide.iter().zip(&of_narrow) {
            assert!(*one >= 0.0 && *other >= 0.0);
            if !covered(at) {
                assert_eq!([*one, *other], [0.0; 2], "{at:?}");
            } else if inner(at) {
                square += other * other;
                difference += (one - other).powi(2);
            }
        }
        assert!(difference < 0.05_f64.powi(2) * square, "{element}: {}", (difference / square).sqrt());
        for run in [&wide, &narrow] {
            // The force is that on the body named first.
            let force = vector(&run.summary()["contact_force"])[2].abs();
            assert!((force - 4.0).abs() < 1e-6, "{force}");
        }
        assert!(
            vector(&wide.summary()["contact_force"])[2] > 0.0 && vector(&narrow.summary()["contact_force"])[2] < 0.0
        );
    }
}

#[test]
fn the_force_of_a_contact_is_that_on_the_body_named_first_whoever_is_the_slave() {
    let (bottom, top) = (Block([0.0; 3], [1.0; 3], [3, 3, 2]), Block([0.0, 0.0, 1.0], [1.0; 3], [4, 4, 2]));
    for (surfaces, sign) in [("[\"top.zmin\", \"bot.zmax\"]", 1.0), ("[\"bot.zmax\", \"top.zmin\"]", -1.0)] {
        let summary = run(&stacked(&bottom, &top, "hex8", &format!("surfaces = {surfaces}"))).converged().summary();
        assert_eq!(summary["contacts"][0]["slave"], "top.zmin", "the finer one");
        assert_near("force", vector(&summary["contact_forces"]["joint"]), [0.0, 0.0, sign], 1e-6);
        assert_near("force on top", vector(&summary["balance"]["top"]["contacts"]["force"]), [0.0, 0.0, 1.0], 1e-6);
        assert_near("force on bot", vector(&summary["balance"]["bot"]["contacts"]["force"]), [0.0, 0.0, -1.0], 1e-6);
    }
}

/// One block on two others, side by side, with meshes of their own: uniaxial pressure, exact whatever the meshes.
#[test]
fn two_contacts_that_share_their_slave_pass_the_patch_test_of_one() {
    let on_two = |element: &str, cells: [[usize; 3]; 3], border: f64, sides: [&str; 2]| {
        let [left, right, top] = cells;
        let blocks = Block([0.0; 3], [border, 1.0, 1.0], left).toml("left", element)
            + &Block([border, 0.0, 0.0], [2.0 - border, 1.0, 1.0], right).toml("right", element)
            + &Block([0.0, 0.0, 1.0], [2.0, 1.0, 1.0], top).toml("top", element);
        let rolls = ["left", "right"].map(|body| {
            format!("[support.{body}]\nsurface = \"{body}.zmin\"\nfix = [\"z\"]\n[support.{body}-y]\nsurface = \"{body}.ymin\"\nfix = [\"y\"]\n")
        });
        format!(
            "{SOFT}{blocks}{}
            [support.left-x]
            surface = \"left.xmin\"
            fix = [\"x\"]
            [support.right-x]
            surface = \"right.xmin\"
            fix = [\"x\"]
            [support.top-x]
            surface = \"top.xmin\"
            fix = [\"x\"]
            [support.top-y]
            surface = \"top.ymin\"
            fix = [\"y\"]
            [load.press]
            surface = \"top.zmax\"
            traction = [0.0, 0.0, -10.0]
            [contact.one]
            {}
            [contact.two]
            {}",
            rolls.concat(),
            sides[0],
            sides[1]
        )
    };
    let top_slave = ["slave = \"top.zmin\"\nmaster = \"left.zmax\"", "slave = \"top.zmin\"\nmaster = \"right.zmax\""];
    let top_master = ["slave = \"left.zmax\"\nmaster = \"top.zmin\"", "slave = \"right.zmax\"\nmaster = \"top.zmin\""];
    let free = ["surfaces = [\"top.zmin\", \"left.zmax\"]", "surfaces = [\"right.zmax\", \"top.zmin\"]"];
    let unlike = [[3, 2, 2], [2, 3, 2], [6, 5, 3]];
    let alike = [[3, 3, 2], [3, 3, 2], [6, 3, 2]];
    let cases = [
        ("tet4", unlike, 1.0, top_slave),
        ("tet4", unlike, 1.0, free),
        ("hex8", unlike, 0.9, top_slave),
        ("hex8", unlike, 1.1, top_master),
        ("tet4", alike, 1.0, top_slave),
        ("hex8", alike, 1.0, top_master),
        ("tet10", alike, 1.0, top_slave),
        ("tet10", unlike, 0.95, top_slave),
    ];
    let directory = tempfile::tempdir().unwrap();
    for (element, cells, border, sides) in cases {
        let text = on_two(element, cells, border, sides);
        let run = solve_tightly(1, &scene_file(directory.path(), &text), &[]);
        let fields = Fields::read(&run.result());
        let all = fields.of_points("contact_pressure");
        let what = format!("{element} {cells:?} {border} {sides:?}");
        for (k, point) in fields.points.iter().enumerate().filter(|(_, point)| (point[2] - 1.0).abs() < 1e-9) {
            assert!((all[k] - 10.0).abs() < 1e-7, "{what}: {} at {point:?}", all[k]);
        }
        if border == 1.0 && sides == top_slave {
            // Contacts that share nodes have fields of their own.
            let [one, two] = ["one", "two"].map(|name| fields.of_points(&format!("contact_pressure_{name}")));
            for (k, point) in fields.points.iter().enumerate().filter(|(_, point)| (point[2] - 1.0).abs() < 1e-9) {
                let expected = [point[0] < 1.5, point[0] > 0.5].map(|near| if near { 10.0 } else { 0.0 });
                let found = [one[k], two[k]];
                let known = |c: usize| {
                    (point[0] - 1.0).abs() > 0.51 || found[c] == 0.0 || (found[c] - expected[c]).abs() < 1e-7
                };
                assert!(known(0) && known(1), "{what}: {found:?} at {point:?}");
            }
        }
        let summary = run.summary();
        for (name, share) in [("one", border), ("two", 2.0 - border)] {
            let force = vector(&summary["contact_forces"][name])[2].abs();
            assert!((force - 10.0 * share).abs() < 1e-7, "{what}: {name} {force}");
        }
    }
}

/// Cubes of `1 / n` that fill a region, as a file of Gmsh with one volume and the surfaces of the given names: `region` and
/// `surface` say where the centre of a cube, or of a face, belongs.
fn voxels(
    n: usize,
    [low, high]: [i64; 2],
    region: impl Fn([f64; 3]) -> bool,
    surface: impl Fn([f64; 3]) -> Option<usize>,
    names: &[&str],
) -> String {
    let m = n as i64;
    let count = (high - low) * m + 1;
    let node = |[i, j, k]: [i64; 3]| 1 + i + count * (j + count * k);
    let place = |index: i64| low as f64 + index as f64 / n as f64;
    let centre = |at: [i64; 3]| at.map(|i| place(i) + 0.5 / n as f64);
    let inside = |at: [i64; 3]| at.iter().all(|i| (0..count - 1).contains(i)) && region(centre(at));
    let cells =
        (0..(count - 1).pow(3)).map(|c| [c % (count - 1), c / (count - 1) % (count - 1), c / (count - 1).pow(2)]);
    let (mut elements, mut used) = (Vec::new(), std::collections::BTreeSet::new());
    for at in cells.filter(|at| inside(*at)) {
        let corner = |d: [i64; 3]| node([at[0] + d[0], at[1] + d[1], at[2] + d[2]]);
        let ring = [[0, 0], [1, 0], [1, 1], [0, 1]];
        let nodes: Vec<i64> = [0, 1].iter().flat_map(|z| ring.map(|[x, y]| corner([x, y, *z]))).collect();
        used.extend(nodes.iter().copied());
        elements.push(format!("5 2 100 1 {}", nodes.iter().map(i64::to_string).collect::<Vec<_>>().join(" ")));
        for (axis, side) in [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)] {
            let mut beside = at;
            beside[axis] += 2 * side - 1;
            let mut middle = centre(at);
            middle[axis] = place(at[axis] + side);
            let Some(group) = surface(middle).filter(|_| !inside(beside)) else { continue };
            let face = ring.map(|[a, b]| {
                let mut d = [0; 3];
                (d[axis], d[(axis + 1) % 3], d[(axis + 2) % 3]) = (side, a, b);
                corner(d).to_string()
            });
            elements.push(format!("3 2 {} {} {}", group + 1, group + 1, face.join(" ")));
        }
    }
    let names = names.iter().zip(1..).map(|(name, tag)| format!("2 {tag} \"{name}\"\n"));
    let names: Vec<String> = names.chain(["3 100 \"all\"\n".to_owned()]).collect();
    let at = |node: i64| [(node - 1) % count, (node - 1) / count % count, (node - 1) / (count * count)].map(place);
    let nodes = used.iter().map(|&node| {
        let [x, y, z] = at(node);
        format!("{node} {x} {y} {z}\n")
    });
    let numbered: Vec<String> =
        elements.iter().zip(1..).map(|(element, number)| format!("{number} {element}\n")).collect();
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{}\n{}$EndPhysicalNames\n$Nodes\n{}\n{}$EndNodes\n$Elements\n{}\n{}$EndElements\n",
        names.len(),
        names.concat(),
        used.len(),
        nodes.collect::<String>(),
        numbered.len(),
        numbered.concat()
    )
}

/// A cube in the corner of a thick box, both under the same pressure all around: the state is uniform in both. The contact
/// surface, named whole, runs round three edges and a corner.
#[test]
fn a_block_in_the_corner_of_a_box_keeps_its_uniform_pressure() {
    let directory = tempfile::tempdir().unwrap();
    let outer = |at: [f64; 3], end: f64| at.iter().any(|x| (x - end).abs() < 1e-9);
    let notch = |at: [f64; 3]| at.iter().any(|x| x.abs() < 1e-9) && at.iter().all(|x| *x > -1e-9);
    // Outer faces of the box at -1 are held along their normals, those at 1 pressed.
    let held = |at: [f64; 3]| (0..3).find(|&a| (at[a] + 1.0).abs() < 1e-9);
    for (of_box, of_block) in [(2, 2), (2, 3), (3, 2)] {
        let of =
            |at: [f64; 3]| if notch(at) { Some(0) } else { held(at).map(|a| 2 + a).or(outer(at, 1.0).then_some(1)) };
        let names = ["skin", "press", "x", "y", "z"];
        let mesh = voxels(of_box, [-1, 1], |at| at.iter().any(|x| *x < 0.0), of, &names);
        std::fs::write(directory.path().join("box.msh"), mesh).unwrap();
        let of = |at: [f64; 3]| if outer(at, 0.0) { Some(0) } else { Some(1) };
        let mesh = voxels(of_block, [0, 1], |_| true, of, &names[..2]);
        std::fs::write(directory.path().join("block.msh"), mesh).unwrap();
        for element in ["tet4", "hex8"] {
            for sides in [["block", "box"], ["box", "block"]] {
                let text = corner_scene(element, sides);
                let run = solve_tightly(1, &scene_file(directory.path(), &text), &[]);
                let fields = Fields::read(&run.result());
                let pressure = fields.of_points("contact_pressure");
                let skin = fields.points.iter().zip(&pressure).filter(|(at, _)| notch(**at));
                let off: f64 = skin.clone().map(|(_, p)| (p - 10.0).abs()).fold(0.0, f64::max);
                assert!(skin.count() > 20 && off < 1e-6, "{of_box} {of_block} {element} {sides:?}: {off:.1e}");
                let force = vector(&run.summary()["contact_force"]).map(f64::abs);
                assert_near("force", force, [10.0; 3], 1e-7);
            }
        }
    }
}

fn corner_scene(element: &str, [slave, master]: [&str; 2]) -> String {
    let body = |name: &str| {
        format!("[body.{name}]\nmaterial = \"soft\"\nelement = \"{element}\"\ngmsh = {{ file = \"{name}.msh\" }}\n")
    };
    let held = ["x", "y", "z"].map(|axis| format!("[support.{axis}]\nsurface = \"box.{axis}\"\nfix = [\"{axis}\"]\n"));
    let pressed = ["block", "box"].map(|body| format!("[load.{body}]\nsurface = \"{body}.press\"\npressure = 10.0\n"));
    format!(
        "{SOFT}{}{}{}{}[contact.joint]\nslave = \"{slave}.skin\"\nmaster = \"{master}.skin\"\n",
        body("block"),
        body("box"),
        held.concat(),
        pressed.concat()
    )
}

#[test]
fn surfaces_that_do_not_face_each_other_are_no_contact() {
    let (bottom, top) = (Block([0.0; 3], [1.0; 3], [3, 3, 3]), Block([0.0, 0.0, 1.0], [1.0; 3], [3, 3, 3]));
    for sides in [
        "slave = \"top.zmin\"\nmaster = \"bot.zmin\"",
        "slave = \"top.zmin\"\nmaster = \"bot.xmax\"",
        "surfaces = [\"top.zmax\", \"bot.zmax\"]",
        "surfaces = [\"top.ymin\", \"bot.zmax\"]",
    ] {
        for element in ["tet4", "tet10"] {
            let run = run(&stacked(&bottom, &top, element, sides));
            assert_eq!(run.code, 65, "{sides}: {}", run.stdout);
            assert!(run.stderr.contains("contact.joint: no node of the slave surface"), "{}", run.stderr);
        }
    }
}

/// Both sides cut into parts, some of which the edge of the other side runs through.
#[test]
fn ranks_change_no_bit_where_contact_ends() {
    let bottom = Block([0.0; 3], [1.0; 3], [4, 4, 3]);
    let top = Block([0.37, -0.21, 1.0], [1.1, 1.3, 0.8], [6, 5, 3]);
    let directory = tempfile::tempdir().unwrap();
    for (element, sides) in [("tet10", NAMED[0]), ("hex8", NAMED[1])] {
        let scene = scene_file(directory.path(), &stacked(&bottom, &top, element, sides));
        let of = |ranks: usize| {
            let run = solve(ranks, &scene, &["decomposition.subdomains=7"]).converged();
            (only_result(run.summary()), Fields::read(&run.result()).of_points("contact_pressure").len())
        };
        let alone = of(1);
        assert_eq!(alone, of(2), "{element}");
        assert_eq!(alone, of(3), "{element}");
    }
}

/// What acts on each body adds up to nothing, with its moments, and is what the summary says elsewhere.
#[test]
fn loads_supports_and_contacts_are_in_balance_on_each_body() {
    let bottom = Block([0.2, -0.1, 0.0], [1.0, 1.2, 1.0], [3, 4, 2]);
    let top = Block([0.4, 0.1, 1.0], [1.1, 0.8, 0.7], [4, 3, 3]);
    let summary = run(&stacked(&bottom, &top, "hex8", EITHER)).converged().summary();
    assert!(number(&summary, "residual_balance") < 1e-7, "{}", summary["residual_balance"]);
    let of = |body: &str, kind: &str, what: &str| vector(&summary["balance"][body][kind][what]);
    // The traction on the top of the upper block, about the mean of its nodes: none along z, and no arm.
    assert_near("load", of("top", "loads", "force"), [0.0, 0.0, -0.88], 1e-12);
    assert!(of("top", "loads", "moment").iter().all(|m| m.abs() < 1e-12));
    let sum = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| a[i] + b[i]);
    assert_near("contact", of("top", "contacts", "force"), vector(&summary["contact_force"]), 1e-9);
    assert_near("ground", of("bot", "supports", "force"), vector(&summary["reactions"]["ground"]), 1e-9);
    let all: [f64; 3] = sum(of("bot", "supports", "moment"), of("bot", "contacts", "moment"));
    assert!(all.iter().all(|m| m.abs() < 1e-7), "{all:?}");
    assert!(of("bot", "contacts", "moment").iter().any(|m| m.abs() > 0.05), "the contact is not in the middle");
}
