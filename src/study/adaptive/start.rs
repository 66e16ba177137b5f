//! The scene of the first meshes: as few elements as tell what the bodies are.
//!
//! Bricks are cut into cells of nearly equal edges, `ACROSS` of them across the thinnest brick, but no more than the scene has.
//! Other structured bodies and meshes from files are taken as they are; straight elements of a file are curved where its faces stand
//! for a round surface ([`crate::mesh::form`]). Elements become quadratic tetrahedra: for the same error they take a fraction of the
//! unknowns of linear ones, which lock where the material flows.

use crate::element::Cell;
use crate::element::Kind;
use crate::scene::{Grid, Method, Scene, Shape};

/// Cells across the thinnest brick.
const ACROSS: f64 = 3.0;
/// The algebraic error of a solution is at most this share of the discretisation error.
const ACCURACY: f64 = 0.3;

/// What a run that refines meshes begins with.
pub struct Start {
    /// The scene with the elements that are solved with; none of its bodies is a brick.
    pub scene: Scene,
    /// The same with the elements that its mesh files may have, to be tried in this order: those that were given, and linear
    /// ones. They become quadratic when they are read.
    pub read: [Scene; 2],
    /// What was decided, in words.
    pub notes: Vec<String>,
}

/// From a scene. `is_chosen` says whether the user chose the element of a body.
///
/// # Errors
/// Why the scene cannot be refined.
pub fn start(scene: &Scene, is_chosen: impl Fn(&str) -> bool) -> Result<Start, String> {
    if scene.initial.is_some() {
        return Err(
            "solver.error: the state of `initial` belongs to one mesh, which cannot be refined; remove one of both"
                .into(),
        );
    }
    let given = scene;
    let mut scene = given.clone();
    let mut notes = Vec::new();
    let edges = scene.body.values().filter_map(|body| body.brick()).flat_map(|brick| brick.size);
    let edge = edges.fold(f64::INFINITY, f64::min) / ACROSS;
    for (name, body) in &mut scene.body {
        if !is_chosen(name) {
            let was = std::mem::replace(&mut body.element, quadratic());
            if was != body.element {
                let (element, was) = (body.element.name(), was.name());
                notes.push(format!("body {name}: {element} in place of {was}; --set body.{name}.element=... chooses"));
            }
        } else if body.element.cell() != Cell::Tetrahedron {
            let element = body.element.name();
            let tetrahedra: Vec<&str> = tetrahedra().map(Kind::name).collect();
            return Err(format!(
                "body.{name}.element = \"{element}\": only {} can be refined",
                tetrahedra.join(" and ")
            ));
        }
        if let Some(brick) = body.brick() {
            let planes = [0, 1, 2].map(|axis| {
                let count = ((brick.size[axis] / edge).round() as usize).clamp(1, brick.cells[axis]);
                let plane = |k: usize| brick.origin[axis] + brick.size[axis] * (k as f64 / count as f64);
                (0..=count).map(plane).collect::<Vec<f64>>()
            });
            let [cells_x, cells_y, cells_z] = planes.each_ref().map(|planes| planes.len() - 1);
            notes.push(format!("body {name}: begins with {cells_x} x {cells_y} x {cells_z} cells"));
            let [x, y, z] = planes;
            body.shape = Shape::Grid(Grid { x, y, z });
        }
    }
    if scene.decomposition.method != Method::Auto {
        notes.push("each mesh is cut into as many subdomains as cost least, whatever `decomposition` says".to_owned());
        scene.decomposition.method = Method::Auto;
    }
    scene.solver.accuracy.get_or_insert(ACCURACY);
    let mut read = [scene.clone(), scene.clone()];
    for (name, body) in given.body.iter().filter(|(_, body)| body.gmsh().is_some()) {
        // Cells that are no tetrahedra are split into linear ones.
        let of_file = if body.element.cell() == Cell::Tetrahedron { body.element } else { linear() };
        for (scene, element) in read.iter_mut().zip([of_file, linear()]) {
            scene.body.get_mut(name).expect("bodies are the same").element = element;
        }
    }
    Ok(Start { scene, read, notes })
}

fn tetrahedra() -> impl Iterator<Item = Kind> {
    Kind::ALL.iter().copied().filter(|kind| kind.cell() == Cell::Tetrahedron)
}

fn linear() -> Kind {
    tetrahedra().min_by_key(|kind| kind.degree()).expect("there are tetrahedra")
}

fn quadratic() -> Kind {
    tetrahedra().max_by_key(|kind| kind.degree()).expect("there are tetrahedra")
}
