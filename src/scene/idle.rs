//! What a scene says without effect: legal, but easily a mistake. Each is a warning that names the key.
//!
//! Keys that contradict each other, or that surely are mistakes, are refused by [`super::check`]. Whether a value that is
//! the default was written cannot be told, and does not matter.

use super::load::Load;
use super::{ErrorOf, Method, Qp, Scene, Step};

/// A sentence for each key without effect, section by section.
pub(super) fn warnings(scene: &Scene) -> Vec<String> {
    let mut found = materials(scene);
    found.extend(bodies(scene));
    found.extend(supports(scene));
    found.extend(drivers(scene));
    found.extend(steps(scene));
    found.extend(settings(scene));
    found
}

fn materials(scene: &Scene) -> Vec<String> {
    let is_used = |name: &str| scene.body.values().any(|body| body.material.names().contains(name));
    let idle = scene.material.keys().filter(|name| !is_used(name));
    idle.map(|name| format!("material.{name}: no body is made of it")).collect()
}

fn bodies(scene: &Scene) -> Vec<String> {
    let is_moved = |body: &str| {
        let of_body = |load: &Load| match load {
            Load::BodyForce { body: of, .. } => of == body,
            Load::Traction { surface, .. } | Load::Pressure { surface, .. } => surface.body == body,
        };
        let taken =
            |initial: &super::Initial| initial.bodies.as_ref().is_none_or(|names| names.iter().any(|n| n == body));
        scene.load.values().any(of_body)
            || scene.support.values().any(|s| s.surface.body == body && moves(s.displacement))
            || scene.initial.as_ref().is_some_and(taken)
    };
    let idle = scene.body.keys().filter(|name| !scene.touches(name) && !is_moved(name));
    idle.map(|name| {
        format!("body.{name}: nothing acts on it, so it stays as it is: no load, contact or prescribed displacement")
    })
    .collect()
}

fn moves(displacement: Option<[f64; 3]>) -> bool {
    displacement.is_some_and(|d| d != [0.0; 3])
}

/// Supports all of whose components others fix on the same surface.
fn supports(scene: &Scene) -> Vec<String> {
    let mut needed: Vec<_> = scene.support.iter().collect();
    let mut found = Vec::new();
    for (name, support) in scene.support.iter().rev() {
        let others = || needed.iter().filter(|(other, of)| *other != name && of.surface == support.surface);
        if support.fix.iter().all(|axis| others().any(|(_, other)| other.fix.contains(axis))) {
            needed.retain(|(other, _)| *other != name);
            found.push(format!("support.{name}: other supports of {} fix all that it fixes", support.surface));
        }
    }
    found
}

/// What steps scale, by its key, with its factor in each of them; and whether it is zero anyway.
fn scaled(scene: &Scene) -> impl Iterator<Item = (String, Vec<f64>, bool)> {
    let factors = |of: &dyn Fn(&Step) -> f64| -> Vec<f64> { scene.steps().iter().map(of).collect() };
    let of_load = move |(name, load): (&String, &Load)| {
        (format!("load.{name}"), factors(&|step| step.of_load(name)), load.is_zero())
    };
    let loads = scene.load.iter().map(of_load);
    let supports = scene.support.iter().filter(|(_, support)| moves(support.displacement));
    let supports = supports
        .map(move |(name, _)| (format!("support.{name}.displacement"), factors(&|step| step.of_support(name)), false));
    let contacts = scene.contact.iter().filter(|(_, contact)| contact.displacement() != [0.0; 3]);
    let contacts = contacts
        .map(move |(name, _)| (format!("contact.{name}.displacement"), factors(&|step| step.of_contact(name)), false));
    loads.chain(supports).chain(contacts)
}

fn drivers(scene: &Scene) -> Vec<String> {
    let told = |(key, factors, zero): (String, Vec<f64>, bool)| match (zero, factors.iter().all(|f| *f == 0.0)) {
        (true, _) => Some(format!("{key} is zero")),
        (false, true) => Some(format!("{key}: its factor is zero in every step")),
        (false, false) => None,
    };
    scaled(scene).filter_map(told).collect()
}

fn steps(scene: &Scene) -> Vec<String> {
    let mut found = Vec::new();
    if !scene.step.is_empty() && scaled(scene).next().is_none() {
        found.push("step: the scene has no loads and prescribed displacements that steps could change".to_owned());
    }
    for (index, step) in scene.step.iter().enumerate() {
        let still = |name: &&String| scene.support.get(*name).is_some_and(|support| !moves(support.displacement));
        let of_none = step.support.keys().filter(still);
        found.extend(of_none.map(|name| {
            format!("step.{index}.support.{name}: support.{name} prescribes no displacement that it could scale")
        }));
        let named = step.load.len() + step.contact.len() + step.support.keys().filter(|name| !still(name)).count();
        if step.amplitude != 1.0 && named > 0 && named == scaled(scene).count() {
            found.push(format!(
                "step.{index}.amplitude: the step names a factor of its own for all that it could scale"
            ));
        }
    }
    found
}

fn settings(scene: &Scene) -> Vec<String> {
    let mut found = Vec::new();
    if scene.decomposition.idle_cells {
        let method = if scene.decomposition.method == Method::Auto { "auto" } else { "metis" };
        found.push(format!("decomposition.cells: method = \"{method}\" does not use them, but \"bricks\" does"));
    }
    if scene.solver.error.is_none() {
        let idle = [
            ("error_of", scene.solver.error_of != ErrorOf::default()),
            ("max_unknowns", scene.solver.max_unknowns.is_some()),
        ];
        let given = idle.into_iter().filter(|(_, is_given)| *is_given);
        found.extend(given.map(|(key, _)| format!("solver.{key}: without solver.error no mesh is refined")));
    }
    if scene.solver.qp == Qp::SmalseM && scene.contact.is_empty() {
        found.push("solver.qp: without contact there is no quadratic program, but equations".to_owned());
    }
    found
}
