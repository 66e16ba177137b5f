//! What acts on bodies: supports, loads, contacts, obstacles, steps.

use super::*;

#[test]
fn supports_are_checked() {
    refuses(&["support.base.fix=[]"], &["support.base.fix = []", "at least one"]);
    refuses(&["support.base.fix=['x', 'y', 'x']"], &["support.base.fix = [\"x\", \"y\", \"x\"]", "at most once"]);
    refuses(&["support.base.displacement=[0, nan, 0]"], &["support.base.displacement = ", "finite"]);
    let partly = ["support.base.fix=['x', 'y']", "support.base.displacement=[0, 1, 2]"];
    refuses(&partly, &["support.base.displacement = [0.0, 1.0, 2.0]", "component z is not fixed"]);
    let scene = one(&["support.base.displacement=[0, 1, 2]"]).unwrap();
    assert_eq!(Axis::ALL.map(|axis| scene.support["base"].prescribed(axis)), [Some(0.0), Some(1.0), Some(2.0)]);
}

#[test]
fn supports_must_agree_where_they_meet() {
    let side = |surface: &str, x: f64| {
        let side = format!("support.side={{surface = '{surface}', fix = ['x'], displacement = [{x}, 0, 0]}}");
        one(&[&side])
    };
    assert_says(side("block.xmin", 1.0), &["support.side", "support.base", "1.0 along x", "0.0"]);
    assert_says(side("block.zmin", 1.0), &["support.side", "support.base"]);
    assert!(side("block.zmax", 1.0).is_ok());
    assert!(side("block.xmin", 0.0).is_ok());
}

#[test]
fn loads_are_checked() {
    refuses(&["load.top={surface = 'block.zmax', traction = [0, 0, inf]}"], &["load.top.traction = [0.0, 0.0, inf]"]);
    refuses(&["load.top={surface = 'cube.zmax', traction = [0, 0, 1]}"], &["load.top.surface", "known are block"]);
    refuses(&["load.top={surface = 'cube.zmax', pressure = 1}"], &["load.top.surface", "known are block"]);
    refuses(&["load.top={surface = 'block.zmax', pressure = nan}"], &["load.top.pressure = NaN", "finite"]);
    refuses(&["load.own={body = 'cube', body_force = [0, 0, 1]}"], &["load.own.body", "no such body", "block"]);
    refuses(&["load.own={body = 'block', body_force = [0, nan, 1]}"], &["load.own.body_force", "finite"]);
    for (keys, part) in [
        ("", "missing key `surface`"),
        ("surface = 'block.zmax', body = 'block', body_force = [0, 0, 1]", "remove either surface or body"),
        ("surface = 'block.zmax'", "missing key `traction` or `pressure`"),
        ("surface = 'block.zmax', traction = [0, 0, 1], pressure = 1", "either a traction or a pressure"),
        ("surface = 'block.zmax', body_force = [0, 0, 1]", "give body = "),
        ("body = 'block'", "missing key `body_force`"),
        ("body = 'block', pressure = 1", "give surface = "),
        ("body = 'block', bodyforce = [0, 0, 1]", "unknown key `bodyforce`"),
    ] {
        refuses(&[&format!("load.top={{{keys}}}")], &["load.top", part]);
    }
}

#[test]
fn loads_of_every_kind_read_back() {
    let loads = [
        ("{surface = 'block.zmax', traction = [0, 0, 1]}", Some("block.zmax")),
        ("{surface = 'block.zmax', pressure = 3}", Some("block.zmax")),
        ("{body = 'block', body_force = [0, 0, -9.81]}", None),
    ];
    for (load, surface) in loads {
        let scene = one(&[&format!("load.top={load}")]).unwrap();
        assert_eq!(scene.load["top"].surface().map(SurfaceName::to_string).as_deref(), surface);
        assert_eq!(Scene::from_text(&scene.to_toml(), "again", 1, &[]).unwrap(), scene);
    }
}

#[test]
fn contact_pairs_are_checked() {
    assert_says(two_blocks(&["contact.joint.slave=middle.zmin"]), &["contact.joint.slave", "known are lower, upper"]);
    assert_says(two_blocks(&["contact.joint.master=middle.zmin"]), &["contact.joint.master"]);
    assert_says(two_blocks(&["contact.joint.master=upper.zmax"]), &["contact.joint.master", "does not touch itself"]);
    assert_says(two_blocks(&["contact.joint.gap=nan"]), &["contact.joint.gap", "finite"]);
    assert_says(two_blocks(&["contact.joint.clearance=inf"]), &["contact.joint.clearance", "finite"]);
    assert_says(
        two_blocks(&["contact.joint.clearance=0", "contact.joint.gap=1"]),
        &["contact.joint.clearance", "remove gap"],
    );
    let again = "contact.more={surfaces = ['lower.zmax', 'upper.zmin']}";
    assert_says(two_blocks(&[again]), &["contact.more.surfaces", "contact.joint is between the same two"]);
}

#[test]
fn a_contact_may_leave_open_which_surface_is_the_slave() {
    let either = |with: &str| two_blocks(&[&format!("contact.more={{{with}}}")]);
    let scene = either("surfaces = ['lower.xmax', 'upper.xmin'], gap = -0.5").unwrap();
    let Contact { sides, gap, .. } = &scene.contact["more"];
    let names = |text: &str| text.parse::<SurfaceName>().unwrap();
    assert_eq!((sides, *gap), (&Sides::Either(["lower.xmax", "upper.xmin"].map(names)), -0.5));
    assert_says(either("surfaces = ['lower.xmax', 'lower.xmin']"), &["contact.more.surfaces", "does not touch itself"]);
    assert_says(either("surfaces = ['lower.xmax', 'middle.xmin']"), &["contact.more.surfaces", "no body `middle`"]);
    assert_says(either("surfaces = ['lower.xmax']"), &["contact.more"]);
    assert_says(either("surfaces = ['lower.xmax', 'upper.xmin'], slave = 'upper.zmin'"), &["remove slave"]);
    assert_says(either("master = 'lower.xmax'"), &["needs a slave", "two surfaces"]);
}

#[test]
fn a_contact_has_one_second_side() {
    let ground = "{plane = {point = [0, 0, 0], normal = [0, 0, 1]}}";
    let rigid = |with: &str| one(&[&format!("contact.ground={{slave = 'block.zmin', {with}}}")]);
    assert!(rigid(&format!("rigid = {ground}")).is_ok());
    assert_says(rigid(""), &["master (a surface) or rigid (an obstacle)"]);
    assert_says(rigid(&format!("master = 'block.zmax', rigid = {ground}")), &["remove either master or rigid"]);
    assert_says(rigid("rigid = {cone = {point = [0, 0, 0]}}"), &["cone", "plane", "sphere", "cylinder", "heightfield"]);
    assert_says(rigid("rigid = {sphere = {centre = [0, 0, 0], diameter = 1}}"), &["diameter", "radius"]);
    assert_says(rigid("rigid = {sphere = {centre = [0, 0, 0]}}"), &["missing key", "radius"]);
    let text =
        rigid("gap = 0.25, rigid = {cylinder = {point = [0, 0, 0], axis = [1, 0, 0], radius = 2, inside = true}}")
            .unwrap();
    assert_eq!(Scene::from_text(&text.to_toml(), "echo", 1, &[]).unwrap(), text);
}

#[test]
fn obstacles_are_checked() {
    let says = |rigid: &str, parts: &[&str]| {
        let set = format!("contact.ground={{slave = 'block.zmin', rigid = {{{rigid}}}}}");
        refuses(&[&set], &[&["contact.ground.rigid."], parts].concat());
    };
    says("plane = {point = [0, nan, 0], normal = [0, 0, 1]}", &["plane.point", "finite"]);
    says("plane = {point = [0, 0, 0], normal = [0, 0, 0]}", &["plane.normal", "point somewhere"]);
    for radius in ["0", "-1", "inf", "nan"] {
        says(&format!("sphere = {{centre = [0, 0, 0], radius = {radius}}}"), &["sphere.radius = ", "positive"]);
    }
    says("sphere = {centre = [inf, 0, 0], radius = 1}", &["sphere.centre", "finite"]);
    says("cylinder = {point = [0, 0, 0], axis = [0, 0, 0], radius = 1}", &["cylinder.axis"]);
    says("cylinder = {point = [0, 0, 0], axis = [0, 0, 1], radius = -1}", &["cylinder.radius"]);
    let field = |spacing: &str, heights: &str| {
        format!("heightfield = {{origin = [0, 0], spacing = {spacing}, heights = {heights}}}")
    };
    says(&field("[1, 0]", "[[0, 0], [0, 0]]"), &["heightfield.spacing = [1.0, 0.0]", "positive"]);
    for heights in ["[]", "[[0, 0]]", "[[0], [0]]", "[[0, 0], [0, 0, 0]]"] {
        says(&field("[1, 1]", heights), &["heightfield.heights", "equal length"]);
    }
    says(&field("[1, 1]", "[[0, 0], [0, nan]]"), &["heightfield.heights", "finite"]);
}

#[test]
fn steps_are_checked() {
    let step = |text: &str| one(&["load.top={surface='block.zmax', traction=[0, 0, 1]}", &format!("step=[{text}]")]);
    assert_says(step("{amplitude=nan}"), &["step.0.amplitude = NaN", "finite"]);
    assert_says(step("{}, {increments=0}"), &["step.1.increments = 0", "at least 1"]);
    assert_says(step("{halvings=31}"), &["step.0.halvings = 31", "at most 30"]);
    assert_says(step("{load={bottom=1}}"), &["step.0.load.bottom", "no such load", "known are top"]);
    assert_says(step("{load={top=inf}}"), &["step.0.load.top", "finite"]);
    assert_says(step("{support={top=1}}"), &["step.0.support.top", "no such support", "known are base"]);
    assert_says(step("{amplitud=1}"), &["unknown key `amplitud`"]);
    refuses(&["step=[{load={top=1}}]"], &["no such load", "the scene has none"]);
    let text = format!("{ONE}[[step]]\n[[step]]\nname = 'off'\namplitude = inf\n");
    assert_says(Scene::from_text(&text, "one.toml", 1, &[]), &["one.toml, line 18", "step.1.amplitude = inf"]);
    let changed = Scene::from_text(&text, "one.toml", 1, &sets(&["step.1.amplitude=0"])).unwrap();
    assert_eq!((changed.step.len(), changed.step[1].amplitude, changed.step[1].name.as_str()), (2, 0.0, "off"));
}

#[test]
fn only_obstacles_are_moved_by_contacts() {
    let plane = |more: &str| {
        format!("contact.floor={{slave='block.zmin', rigid={{plane={{point=[0, 0, 0], normal=[0, 0, 1]}}}}{more}}}")
    };
    let step = "step=[{amplitude=0, contact={floor=2}}]";
    let moved = one(&[&plane(", displacement=[0, 0, 1]"), step]).unwrap();
    assert_eq!(moved.contact["floor"].displacement(), [0.0, 0.0, 1.0]);
    assert_eq!((moved.step[0].of_contact("floor"), moved.step[0].of_contact("other")), (2.0, 0.0));
    assert_eq!(Scene::from_text(&moved.to_toml(), "again.toml", 1, &[]).unwrap().contact, moved.contact);
    assert_eq!(one(&[&plane("")]).unwrap().contact["floor"].displacement(), [0.0; 3]);
    refuses(&[&plane(""), step], &["step.0.contact.floor", "no such contact whose obstacle has a displacement"]);
    refuses(&[&plane(", displacement=[0, inf, 1]")], &["contact.floor.displacement", "finite"]);
    assert_says(two_blocks(&["contact.joint.displacement=[0, 0, 1]"]), &["displacement moves a rigid obstacle"]);
}

#[test]
fn the_state_to_start_from_is_checked() {
    let start = |text: &str| one(&[&format!("initial={text}")]);
    let scene = start("{result='out/earlier.vtkhdf', bodies=['block']}").unwrap();
    assert_eq!(Scene::from_text(&scene.to_toml(), "again.toml", 1, &[]).unwrap().initial, scene.initial);
    assert_eq!(one(&[]).unwrap().initial, None);
    assert_says(start("{result=''}"), &["initial.result", "path of a result file"]);
    assert_says(start("{}"), &["missing key `result`"]);
    assert_says(start("{result='a', step=1}"), &["unknown key `step`"]);
    assert_says(start("{result='a', bodies=[]}"), &["initial.bodies = []", "at least one"]);
    assert_says(start("{result='a', bodies=['bolt']}"), &["initial.bodies = \"bolt\"", "known are block"]);
}

#[test]
fn steps_scale_what_they_do_not_name_by_their_amplitude() {
    let scene = one(&["step=[{amplitude=2, support={base=3}}, {}]"]).unwrap();
    let [first, second] = scene.steps() else { panic!("two steps") };
    assert_eq!((first.of_load("any"), first.of_support("base"), first.of_support("other")), (2.0, 3.0, 2.0));
    assert_eq!((second.of_load("any"), second.increments), (1.0, 1));
    let at_once = one(&[]).unwrap();
    let [whole] = at_once.steps() else { panic!("one step") };
    assert_eq!((whole.of_load("any"), whole.increments, whole.halvings), (1.0, 1, 0));
}

#[test]
fn supports_must_agree_in_every_step() {
    let side = "support.side={surface='block.xmin', fix=['x'], displacement=[1, 0, 0]}";
    let base = "support.base.displacement=[1, 0, 0]";
    assert!(one(&[side, base]).is_ok());
    assert!(one(&[side, base, "step=[{}, {amplitude=0.5}]"]).is_ok());
    assert_says(one(&[side, base, "step=[{}, {support={side=0.5}}]"]), &["support.side", "0.5 along x", "1.0"]);
}
