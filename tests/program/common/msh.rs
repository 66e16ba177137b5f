//! Bricks written as files of Gmsh, the way Gmsh writes them.

use std::collections::BTreeMap;

use fetiplast::mesh::brick::indices;
use fetiplast::mesh::{Brick, Face};

/// Bricks and the names of their volumes. Surfaces are called as the faces; one physical surface has those of all bricks.
pub type Parts<'a> = [(&'a str, Brick)];

/// Forms of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    Text41,
    Binary41,
    Text22,
    Binary22,
}

/// Numbers in the file's form.
struct Writer {
    bytes: Vec<u8>,
    binary: bool,
}

impl Writer {
    fn text(&mut self, text: &str) {
        self.bytes.extend(text.as_bytes());
    }

    fn number<const N: usize>(&mut self, text: String, bytes: [u8; N]) {
        if self.binary { self.bytes.extend(bytes) } else { self.text(&(text + " ")) }
    }

    fn int(&mut self, number: usize) {
        self.number(number.to_string(), (number as i32).to_ne_bytes());
    }

    fn size(&mut self, number: usize) {
        self.number(number.to_string(), number.to_ne_bytes());
    }

    fn real(&mut self, number: f64) {
        self.number(format!("{number:?}"), number.to_ne_bytes());
    }

    /// The end of a line of text.
    fn line(&mut self) {
        if !self.binary {
            self.bytes.push(b'\n');
        }
    }

    fn section(&mut self, name: &str, body: impl FnOnce(&mut Self)) {
        self.text(&format!("${name}\n"));
        body(self);
        self.text(&format!("{}$End{name}\n", if self.binary { "\n" } else { "" }));
    }
}

/// Nodes and cells of one volume or surface of the geometry.
struct Entity {
    dimension: usize,
    tag: usize,
    group: usize,
    /// Gmsh's type: 2 triangle, 4 tetrahedron.
    kind: usize,
    cells: Vec<Vec<usize>>,
}

/// The bricks as one file. Nodes are numbered from 1, in the order of the bricks.
pub fn write(parts: &Parts, form: Form) -> Vec<u8> {
    write_glued(parts, form, |_| false)
}

/// As [`write`]; cells of later bricks have the nodes of earlier ones where these lie at a place that is `glued`.
pub fn write_glued(parts: &Parts, form: Form, glued: impl Fn([f64; 3]) -> bool) -> Vec<u8> {
    let mut points: Vec<[f64; 3]> = Vec::new();
    let mut entities = Vec::new();
    for (volume, (_, brick)) in (1..).zip(parts) {
        let first = points.len() + 1;
        points.extend(indices(&brick.all_nodes()).map(|at| brick.coordinates(at)));
        let number = |node: u64| {
            let (own, place) = (first + node as usize, points[first - 1 + node as usize]);
            let earlier = || points[..first - 1].iter().position(|x| *x == place).map(|k| k + 1);
            if glued(place) { earlier().unwrap_or(own) } else { own }
        };
        for (side, face) in (1..).zip(Face::ALL) {
            let cells = brick.triangles_on(face).map(|t| t.map(number).to_vec()).collect();
            entities.push(Entity { dimension: 2, tag: 6 * (volume - 1) + side, group: side, kind: 2, cells });
        }
        let tets = indices(&brick.all_cells()).flat_map(|cell| brick.tets(cell));
        let cells = tets.map(|t| t.map(number).to_vec()).collect();
        entities.push(Entity { dimension: 3, tag: volume, group: volume, kind: 4, cells });
    }
    entities.sort_by_key(|e| (e.dimension, e.tag));

    let version_4 = matches!(form, Form::Text41 | Form::Binary41);
    let binary = matches!(form, Form::Binary41 | Form::Binary22);
    let mut writer = Writer { bytes: Vec::new(), binary: false };
    writer.text(&format!("$MeshFormat\n{} {} 8\n", if version_4 { 4.1 } else { 2.2 }, u8::from(binary)));
    if binary {
        writer.bytes.extend(1_i32.to_ne_bytes());
        writer.text("\n");
    }
    writer.text("$EndMeshFormat\n");
    let mut names: Vec<String> = (1..)
        .zip(["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"])
        .map(|(tag, face)| format!("2 {tag} \"{face}\"\n"))
        .collect();
    names.extend((1..).zip(parts).map(|(tag, (name, _))| format!("3 {tag} \"{name}\"\n")));
    writer.text(&format!("$PhysicalNames\n{}\n{}$EndPhysicalNames\n", names.len(), names.concat()));
    writer.binary = binary;
    if version_4 {
        version_4_1(&mut writer, &points, &entities)
    } else {
        version_2_2(&mut writer, &points, &entities)
    }
    writer.bytes
}

fn version_4_1(writer: &mut Writer, points: &[[f64; 3]], entities: &[Entity]) {
    let mut of_dimension = BTreeMap::new();
    entities.iter().for_each(|e| *of_dimension.entry(e.dimension).or_insert(0) += 1);
    writer.section("Entities", |w| {
        (0..4).for_each(|d| w.size(of_dimension.get(&d).copied().unwrap_or(0)));
        w.line();
        for entity in entities {
            w.int(entity.tag);
            (0..6).for_each(|_| w.real(0.0));
            w.size(1);
            w.int(entity.group);
            w.size(0);
            w.line();
        }
    });
    writer.section("Nodes", |w| {
        [1, points.len(), 1, points.len()].into_iter().for_each(|n| w.size(n));
        w.line();
        [3, 1, 0].into_iter().for_each(|n| w.int(n));
        w.size(points.len());
        w.line();
        for node in 1..=points.len() {
            w.size(node);
            w.line();
        }
        for point in points {
            point.iter().for_each(|&x| w.real(x));
            w.line();
        }
    });
    let count: usize = entities.iter().map(|e| e.cells.len()).sum();
    writer.section("Elements", |w| {
        [entities.len(), count, 1, count].into_iter().for_each(|n| w.size(n));
        w.line();
        let mut number = 0;
        for Entity { dimension, tag, kind, cells, .. } in entities {
            [*dimension, *tag, *kind].into_iter().for_each(|n| w.int(n));
            w.size(cells.len());
            w.line();
            for cell in cells {
                number += 1;
                w.size(number);
                cell.iter().for_each(|&node| w.size(node));
                w.line();
            }
        }
    });
}

fn version_2_2(writer: &mut Writer, points: &[[f64; 3]], entities: &[Entity]) {
    writer.section("Nodes", |w| {
        w.text(&format!("{}\n", points.len()));
        for (node, point) in (1..).zip(points) {
            w.int(node);
            point.iter().for_each(|&x| w.real(x));
            w.line();
        }
    });
    let count: usize = entities.iter().map(|e| e.cells.len()).sum();
    writer.section("Elements", |w| {
        w.text(&format!("{count}\n"));
        let mut number = 0;
        for Entity { tag, group, kind, cells, .. } in entities {
            if w.binary {
                [*kind, cells.len(), 2].into_iter().for_each(|n| w.int(n));
            }
            for cell in cells {
                number += 1;
                w.int(number);
                if !w.binary {
                    [*kind, 2].into_iter().for_each(|n| w.int(n));
                }
                [*group, *tag].into_iter().for_each(|n| w.int(n));
                cell.iter().for_each(|&node| w.int(node));
                w.line();
            }
        }
    });
}
