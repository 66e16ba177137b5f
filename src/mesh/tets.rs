//! An unstructured mesh of linear tetrahedra with named surfaces.

/// The mesh of one body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TetMesh {
    /// Coordinates of the nodes.
    pub points: Vec<[f64; 3]>,
    /// Nodes of each element, positively oriented.
    pub tets: Vec<[u32; 4]>,
    /// Cells before they were split into elements.
    pub cells: u64,
    /// Triangles on the boundary by the name of their surface, counter-clockwise from outside. A triangle may be on
    /// several surfaces.
    pub surfaces: Vec<(String, Vec<[u32; 3]>)>,
}

impl TetMesh {
    /// Triangles of a named surface; none if there is no such surface.
    pub fn surface(&self, name: &str) -> &[[u32; 3]] {
        self.surfaces.iter().find(|(known, _)| known == name).map_or(&[], |(_, triangles)| triangles)
    }

    /// Corners of an element.
    pub fn corners(&self, tet: [u32; 4]) -> [[f64; 3]; 4] {
        tet.map(|n| self.points[n as usize])
    }
}
