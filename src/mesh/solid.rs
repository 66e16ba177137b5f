//! The mesh of one body with named surfaces, of which each rank has a part.

use super::portion::Portion;

/// A rank's part in the mesh of one body.
#[derive(Clone, Debug, PartialEq)]
pub struct SolidMesh {
    /// Own elements, positively oriented.
    pub portion: Portion,
    /// The face-connected piece of the body that each own element is in.
    pub pieces: Vec<u32>,
    /// Faces of own elements on named parts of the boundary; a face may be on several.
    pub surfaces: Vec<NamedSurface>,
    /// How many pieces the body has.
    pub piece_count: usize,
    /// Sizes of the mesh of all ranks.
    pub counts: Counts,
}

/// Part of the boundary of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedSurface {
    /// Its name.
    pub name: String,
    /// Nodes of own faces within the body, counter-clockwise from outside.
    pub faces: Vec<Vec<u32>>,
}

/// Sizes of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counts {
    /// Nodes.
    pub nodes: u64,
    /// Cells before they were split into elements.
    pub cells: u64,
    /// Elements.
    pub elements: u64,
}

impl SolidMesh {
    /// Own faces of a named surface; none if there is no such surface.
    pub fn surface(&self, name: &str) -> &[Vec<u32>] {
        self.surfaces.iter().find(|surface| surface.name == name).map_or(&[], |surface| &surface.faces)
    }
}
