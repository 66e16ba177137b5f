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
    /// Parts of the boundary; a triangle may be on several.
    pub surfaces: Vec<NamedSurface>,
}

/// Part of the boundary of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedSurface {
    /// Its name.
    pub name: String,
    /// Its triangles, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl TetMesh {
    /// Triangles of a named surface; none if there is no such surface.
    pub fn surface(&self, name: &str) -> &[[u32; 3]] {
        self.surfaces.iter().find(|surface| surface.name == name).map_or(&[], |surface| &surface.triangles)
    }

    /// Corners of an element.
    pub fn corners(&self, tet: [u32; 4]) -> [[f64; 3]; 4] {
        tet.map(|n| self.points[n as usize])
    }
}
