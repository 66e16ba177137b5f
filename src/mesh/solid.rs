//! An unstructured mesh of one body, with named surfaces.

use super::Elements;

/// The mesh of one body.
#[derive(Clone, Debug, PartialEq)]
pub struct SolidMesh {
    /// Coordinates of the nodes.
    pub points: Vec<[f64; 3]>,
    /// Elements, positively oriented.
    pub elements: Elements,
    /// Cells of the file, before they were split into elements.
    pub cells: u64,
    /// Parts of the boundary; a face may be on several.
    pub surfaces: Vec<NamedSurface>,
    /// The part of the body that each element is in; empty if there is only one.
    pub regions: Vec<u32>,
    /// The face-connected piece of the body that each element is in; empty if there is only one.
    pub pieces: Vec<u32>,
}

/// Part of the boundary of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedSurface {
    /// Its name.
    pub name: String,
    /// Nodes of its faces, counter-clockwise from outside.
    pub faces: Vec<Vec<u32>>,
}

impl SolidMesh {
    /// The part of the body that an element is in.
    pub fn region(&self, element: usize) -> usize {
        self.regions.get(element).map_or(0, |&region| region as usize)
    }

    /// The piece of the body that an element is in.
    pub fn piece(&self, element: usize) -> usize {
        self.pieces.get(element).map_or(0, |&piece| piece as usize)
    }

    /// Faces of a named surface; none if there is no such surface.
    pub fn surface(&self, name: &str) -> &[Vec<u32>] {
        self.surfaces.iter().find(|surface| surface.name == name).map_or(&[], |surface| &surface.faces)
    }
}
