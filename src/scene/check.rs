//! Checks of a typed scene: values in range, names that exist, counts that fit, bodies that are held.
//!
//! The first fault ends the check. What needs geometry (whether contact surfaces face each other) or a mesh is checked
//! by the rooms that have them.

use super::Fault;
use super::Scene;
use super::body::{Axis, Body, Brick, Gmsh, Rotation, Shape};
use super::contact::{Contact, Friction, Sides};
use super::decomposition::{Groups, Method};
use super::goal::ErrorOf;
use super::held::Held;
use super::initial::Initial;
use super::load::Load;
use super::mapped::{OF_CYLINDER, OF_SPHERE};
use super::require::{Checked, all_finite, known, names, require, whole};
use super::solver::Solver;
use super::step::Step;
use super::surface::{Face, Support, SurfaceName};
use super::volumes;
use crate::material::{BadParameter, Law, Material};

/// The first fault of a scene, in the order of its sections.
pub(super) fn scene(scene: &Scene) -> Checked {
    if scene.body.is_empty() {
        return Err(whole("body", "a scene needs at least one body, in a section [body.NAME]"));
    }
    scene.material.iter().try_for_each(|(name, it)| material(&format!("material.{name}"), it))?;
    scene.body.iter().try_for_each(|(name, it)| body(scene, &format!("body.{name}"), it))?;
    scene.support.iter().try_for_each(|(name, it)| support(scene, &format!("support.{name}"), it))?;
    scene.load.iter().try_for_each(|(name, it)| load(scene, &format!("load.{name}"), it))?;
    scene.contact.iter().try_for_each(|(name, it)| contact(scene, &format!("contact.{name}"), it))?;
    scene.initial.iter().try_for_each(|it| initial(scene, it))?;
    scene.step.iter().enumerate().try_for_each(|(index, it)| step(scene, &format!("step.{index}"), it))?;
    scene.limit.iter().try_for_each(|it| it.check(scene))?;
    decomposition(scene)?;
    solver(&scene.solver)?;
    scene.solver.error_of.goal().map_or(Ok(()), |goal| goal.check(scene))?;
    error_with_friction(scene)?;
    scene.steps().iter().try_for_each(|step| compatible_supports(scene, step))?;
    scene.body.keys().try_for_each(|name| holding(scene, name))
}

fn material(key: &str, material: &Material) -> Checked {
    let fault = |BadParameter { name, value, rule }| Fault {
        key: format!("{key}.{name}"),
        value: Some(format!("{value:?}")),
        rule: rule.to_owned(),
    };
    material.check().map_err(fault)
}

fn body(scene: &Scene, key: &str, body: &Body) -> Checked {
    let volumes = body.gmsh().and_then(|gmsh| gmsh.volume.as_ref());
    volumes::check(&scene.material, key, volumes, &body.material)?;
    match &body.shape {
        Shape::Brick(it) => brick(key, it),
        Shape::Gmsh(it) => gmsh(&format!("{key}.gmsh"), it),
        Shape::Sphere(it) => it.check(&format!("{key}.sphere")),
        Shape::Cylinder(it) => it.check(&format!("{key}.cylinder")),
        Shape::Grid(it) => it.check(&format!("{key}.grid")),
    }
}

fn brick(key_of_body: &str, &Brick { origin, size, cells }: &Brick) -> Checked {
    all_finite(&format!("{key_of_body}.brick.origin"), &origin)?;
    let positive = size.iter().all(|edge| edge.is_finite() && *edge > 0.0);
    require(positive, &format!("{key_of_body}.brick.size"), size, "edges must be positive and finite")?;
    let key = format!("{key_of_body}.brick.cells");
    require(!cells.contains(&0), &key, cells, "must be at least 1 along each edge")?;
    // A cell costs some tens of numbers; room for a thousand keeps every later product within the integers.
    let countable = cells.iter().try_fold(1000_usize, |product, &n| product.checked_mul(n)).is_some();
    require(countable, &key, cells, "too many cells (level included) to be counted")?;
    let resolved = |a: usize| {
        let farthest = origin[a].abs().max((origin[a] + size[a]).abs());
        size[a] / cells[a] as f64 > BLURRED * f64::EPSILON * farthest
    };
    let rule = "coordinates of this size cannot tell the nodes of a cell apart: move the scene nearer to the origin";
    require((0..3).all(resolved), &format!("{key_of_body}.brick.origin"), origin, rule)
}

/// Cells must be this many roundings of their coordinates long.
const BLURRED: f64 = 1e4;

fn gmsh(key: &str, Gmsh { file, scale, rotate, translate, .. }: &Gmsh) -> Checked {
    require(!file.is_empty(), &format!("{key}.file"), file, "must be the path of a mesh file")?;
    require(scale.is_finite() && *scale > 0.0, &format!("{key}.scale"), scale, "must be positive and finite")?;
    if let Some(Rotation { axis, angle_deg }) = rotate {
        let length: f64 = axis.iter().map(|x| x * x).sum();
        let rule = "must be a direction: finite numbers, not all zero";
        require(length.is_normal(), &format!("{key}.rotate.axis"), axis, rule)?;
        require(angle_deg.is_finite(), &format!("{key}.rotate.angle_deg"), angle_deg, "must be finite")?;
    }
    all_finite(&format!("{key}.translate"), translate)
}

/// Surfaces of mesh files are looked up when these are read.
fn surface(scene: &Scene, key: &str, name: &SurfaceName) -> Checked {
    let Some(body) = scene.body.get(&name.body) else {
        let rule = format!("no body `{}`: known are {}", name.body, names(scene.body.keys()));
        return require(false, key, name.to_string(), rule);
    };
    let SurfaceName { body: of, surface } = name;
    let (what, known): (&str, &[&str]) = match &body.shape {
        Shape::Gmsh(_) => return Ok(()),
        Shape::Brick(_) => ("brick", &Face::ALL.map(Face::name)),
        Shape::Grid(_) => ("grid", &Face::ALL.map(Face::name)),
        Shape::Sphere(_) => ("sphere", &OF_SPHERE),
        Shape::Cylinder(_) => ("cylinder", &OF_CYLINDER),
    };
    let rule = format!("`{surface}` is not a face of body `{of}`: a {what} has {}", known.join(", "));
    require(known.contains(&&surface[..]), key, name.to_string(), rule)
}

fn support(scene: &Scene, key: &str, support: &Support) -> Checked {
    surface(scene, &format!("{key}.surface"), &support.surface)?;
    let fix: Vec<String> = support.fix.iter().map(Axis::to_string).collect();
    let fix_key = format!("{key}.fix");
    require(!fix.is_empty(), &fix_key, &fix, "name at least one of x, y, z, or remove the support")?;
    let once = Axis::ALL.iter().all(|axis| support.fix.iter().filter(|fixed| *fixed == axis).count() <= 1);
    require(once, &fix_key, &fix, "name each of x, y, z at most once")?;
    let Some(values) = support.displacement else { return Ok(()) };
    let key = format!("{key}.displacement");
    all_finite(&key, &values)?;
    for axis in Axis::ALL {
        let used = support.fix.contains(&axis) || values[axis.index()] == 0.0;
        require(used, &key, values, format!("component {axis} is not fixed, so it must be 0: add {axis} to fix"))?;
    }
    Ok(())
}

fn load(scene: &Scene, key: &str, load: &Load) -> Checked {
    let place = |name: &SurfaceName| surface(scene, &format!("{key}.surface"), name);
    match load {
        Load::Traction { surface, traction } => {
            place(surface)?;
            all_finite(&format!("{key}.traction"), traction)
        }
        Load::Pressure { surface, pressure } => {
            place(surface)?;
            require(pressure.is_finite(), &format!("{key}.pressure"), pressure, "must be a finite number")
        }
        Load::BodyForce { body, body_force } => {
            let key_body = format!("{key}.body");
            require(scene.body.contains_key(body), &key_body, body, known("body", scene.body.keys()))?;
            all_finite(&format!("{key}.body_force"), body_force)
        }
    }
}

fn contact(scene: &Scene, key: &str, contact: &Contact) -> Checked {
    require(contact.gap.is_finite(), &format!("{key}.gap"), contact.gap, "must be a finite number")?;
    if let Some(clearance) = contact.clearance {
        let key = format!("{key}.clearance");
        require(clearance.is_finite(), &key, clearance, "must be a finite number")?;
        require(contact.gap == 0.0, &key, clearance, "stands instead of any gap: remove gap, or clearance")?;
    }
    if let Some(law) = contact.friction {
        friction(&format!("{key}.{}", law.key()), law)?;
    }
    let (first, second) = match &contact.sides {
        Sides::Named { .. } => ("slave", "master"),
        Sides::Either(_) => ("surfaces", "surfaces"),
        Sides::Rigid { slave, obstacle, displacement } => {
            surface(scene, &format!("{key}.slave"), slave)?;
            all_finite(&format!("{key}.displacement"), &displacement.unwrap_or_default())?;
            obstacle.check(&format!("{key}.rigid"))?;
            let twin = earlier(scene, contact).find(|(_, earlier)| earlier.sides == contact.sides);
            let rule = |twin: &str| format!("contact.{twin} is the same obstacle for it; remove one of the two");
            let of_twin =
                |(twin, _): (&String, _)| require(false, &format!("{key}.slave"), slave.to_string(), rule(twin));
            return twin.map_or(Ok(()), of_twin);
        }
    };
    let sides: Vec<&SurfaceName> = contact.surfaces().collect();
    let [one, other] = sides[..] else { unreachable!("an obstacle is not a surface") };
    surface(scene, &format!("{key}.{first}"), one)?;
    let key = format!("{key}.{second}");
    surface(scene, &key, other)?;
    let rule = "both sides are of one body; a body does not touch itself";
    require(one.body != other.body, &key, other.to_string(), rule)?;
    let same = |(_, earlier): &(&String, &Contact)| {
        let surfaces: Vec<_> = earlier.surfaces().collect();
        surfaces.len() == 2 && surfaces.contains(&one) && surfaces.contains(&other)
    };
    let twin = earlier(scene, contact).find(same);
    let rule = |twin: &str| format!("contact.{twin} is between the same two surfaces; remove one of the two");
    twin.map_or(Ok(()), |(twin, _)| require(false, &key, other.to_string(), rule(twin)))
}

/// Errors that were asked for need a minimum (of the energy), or a symmetric dual problem (of a number).
fn error_with_friction(scene: &Scene) -> Checked {
    let laws = || scene.contact.iter().filter_map(|(name, contact)| Some((name, contact.friction?)));
    let Some(error) = scene.solver.error.filter(|_| laws().any(|(_, law)| law.value() > 0.0)) else { return Ok(()) };
    let coulomb = laws().find(|(_, law)| matches!(law, Friction::Coulomb(_)) && law.value() > 0.0);
    if let (ErrorOf::Energy, Some((name, _))) = (&scene.solver.error_of, coulomb) {
        let rule =
            format!("with contact.{name}.friction there is no energy that is least: ask for error_of = \"stress\"");
        return require(false, "solver.error", error, rule);
    }
    let rule = "errors of single numbers are estimated without friction only: ask for that of the stress";
    require(scene.solver.error_of.goal().is_none(), "solver.error", error, rule)
}

/// A coefficient of friction, or a limit of its stress.
fn friction(key: &str, law: Friction) -> Checked {
    let value = law.value();
    require(value.is_finite() && value >= 0.0, key, value, "must be a finite number that is not negative")
}

/// The contacts before this one.
fn earlier<'a>(scene: &'a Scene, contact: &Contact) -> impl Iterator<Item = (&'a String, &'a Contact)> {
    scene.contact.iter().take_while(move |(_, earlier)| !std::ptr::eq(*earlier, contact))
}

fn initial(scene: &Scene, Initial { result, bodies }: &Initial) -> Checked {
    require(!result.is_empty(), "initial.result", result, "must be the path of a result file")?;
    let Some(bodies) = bodies else { return Ok(()) };
    let key = "initial.bodies";
    require(!bodies.is_empty(), key, bodies, "name at least one body, or leave it out for all")?;
    let once = (1..bodies.len()).all(|index| !bodies[..index].contains(&bodies[index]));
    require(once, key, bodies, "name each body once")?;
    let stranger = bodies.iter().find(|name| !scene.body.contains_key(*name));
    stranger.map_or(Ok(()), |name| require(false, key, name, known("body", scene.body.keys())))
}

fn step(scene: &Scene, key: &str, step: &Step) -> Checked {
    let finite = |key: &str, value: f64| require(value.is_finite(), key, value, "must be a finite number");
    finite(&format!("{key}.amplitude"), step.amplitude)?;
    let rule = "must be at least 1 and at most 1000000";
    require((1..=1_000_000).contains(&step.increments), &format!("{key}.increments"), step.increments, rule)?;
    require(step.halvings <= 30, &format!("{key}.halvings"), step.halvings, "must be at most 30")?;
    for (name, &factor) in &step.load {
        let key = format!("{key}.load.{name}");
        require(scene.load.contains_key(name), &key, factor, known("load", scene.load.keys()))?;
        finite(&key, factor)?;
    }
    for (name, &factor) in &step.support {
        let key = format!("{key}.support.{name}");
        require(scene.support.contains_key(name), &key, factor, known("support", scene.support.keys()))?;
        finite(&key, factor)?;
    }
    for (name, &factor) in &step.contact {
        let key = format!("{key}.contact.{name}");
        let moves = |(_, contact): &(&String, &Contact)| contact.displacement() != [0.0; 3];
        let moving: Vec<&String> = scene.contact.iter().filter(moves).map(|(name, _)| name).collect();
        let rule = known("contact whose obstacle has a displacement", moving.iter().copied());
        require(moving.contains(&name), &key, factor, rule)?;
        finite(&key, factor)?;
    }
    for (name, &value) in &step.friction {
        let key = format!("{key}.friction.{name}");
        let laws = scene.contact.iter().filter(|(_, contact)| contact.friction.is_some()).map(|(name, _)| name);
        let rule = known("contact with friction or shear_limit of its own", laws);
        let law = scene.contact.get(name).and_then(|contact| contact.friction);
        law.map_or_else(|| require(false, &key, value, rule), |law| friction(&key, law.with(value)))?;
    }
    Ok(())
}

fn decomposition(scene: &Scene) -> Checked {
    let sizes = match &scene.decomposition.cluster {
        None => &[][..],
        Some(Groups::Equal(size)) => std::slice::from_ref(size),
        Some(Groups::Levels(sizes)) => sizes,
    };
    for &size in sizes {
        require(size >= 1, "decomposition.cluster", size, "must be at least 1")?;
    }
    match scene.decomposition.method {
        Method::Auto => Ok(()),
        Method::Bricks { cells } => {
            let key = "decomposition.cells";
            require(!cells.contains(&0), key, cells, "must be at least 1 along each axis")?;
            scene.body.iter().try_for_each(|(name, body)| divided(name, body, cells))
        }
        Method::Metis { subdomains: None } => Ok(()),
        Method::Metis { subdomains: Some(subdomains) } => {
            let key = "decomposition.subdomains";
            let bodies = scene.body.len();
            require(subdomains >= bodies, key, subdomains, format!("each of the {bodies} bodies needs at least one"))?;
            let regions = scene.body.values().map(|body| body.material.names().len()).sum();
            let rule = format!("each material of each body needs at least one, which are {regions}");
            require(subdomains >= regions, key, subdomains, rule)?;
            // Elements of mesh files are counted when these are read.
            let per_body: Option<Vec<usize>> = scene
                .body
                .values()
                .map(|b| Some(b.brick()?.cell_count() * b.element.cell().per_hexahedron() as usize))
                .collect();
            let Some(per_body) = per_body else { return Ok(()) };
            let elements = per_body.into_iter().fold(0_usize, usize::saturating_add);
            require(subdomains <= elements, key, subdomains, format!("there are only {elements} elements to share out"))
        }
    }
}

fn divided(name: &str, body: &Body, cells: [usize; 3]) -> Checked {
    let key = "decomposition.cells";
    let Some(brick) = body.brick() else {
        let rule = format!("body {name} is no brick, so that it cannot be cut into bricks: use method = \"metis\"");
        return require(false, key, cells, rule);
    };
    for axis in Axis::ALL {
        let (of_body, part) = (brick.cells[axis.index()], cells[axis.index()]);
        let rule =
            || format!("{part} does not divide the {of_body} cells (level included) of body {name} along {axis}");
        require(of_body.is_multiple_of(part), key, cells, rule())?;
    }
    Ok(())
}

fn solver(solver: &Solver) -> Checked {
    let tolerances = [
        ("solver.newton_tolerance", solver.newton_tolerance),
        ("solver.residual_tolerance", solver.residual_tolerance),
        ("solver.qp_tolerance", solver.qp_tolerance),
    ];
    let accuracy = solver.accuracy.map(|value| ("solver.accuracy", value));
    let error = solver.error.map(|value| ("solver.error", value));
    for (key, value) in tolerances.into_iter().chain(accuracy).chain(error) {
        require(value > 0.0 && value < 1.0, key, value, "a relative tolerance must be above 0 and below 1")?;
    }
    for (key, value) in [("solver.newton_limit", solver.newton_limit), ("solver.qp_limit", solver.qp_limit)] {
        require(value >= 1, key, value, "must be at least 1")?;
    }
    Ok(())
}

/// Faces of a brick that are not opposite share nodes, where two supports must not prescribe different values at the end
/// of a step. Surfaces of mesh files are compared node by node when rows are made.
fn compatible_supports(scene: &Scene, step: &Step) -> Checked {
    for (index, (name, one)) in scene.support.iter().enumerate() {
        for (other_name, other) in scene.support.iter().take(index) {
            let (Some(face), Some(other_face)) = (one.surface.face(), other.surface.face()) else { continue };
            let meet = one.surface.body == other.surface.body
                && scene.body[&one.surface.body].brick().is_some()
                && (face == other_face || face.axis() != other_face.axis());
            for axis in Axis::ALL.into_iter().filter(|_| meet) {
                let (Some(value), Some(other_value)) = (one.prescribed(axis), other.prescribed(axis)) else { continue };
                let (value, other_value) = (step.of_support(name) * value, step.of_support(other_name) * other_value);
                if value != other_value {
                    let rule = format!(
                        "prescribes the displacement {value:?} along {axis}, but support.{other_name} prescribes \
                         {other_value:?} on nodes that {} and {} share",
                        one.surface, other.surface
                    );
                    return Err(whole(&format!("support.{name}"), rule));
                }
            }
        }
    }
    Ok(())
}

/// A brick must be held by its supports unless contact may do so.
fn holding(scene: &Scene, body: &str) -> Checked {
    if scene.body[body].brick().is_none() || scene.touches(body) {
        return Ok(());
    }
    Held::brick(scene, body).refusal().map_or(Ok(()), |rule| Err(whole(&format!("body.{body}"), rule)))
}
