//! What can be wrong with a mesh file, and what to do about it in Gmsh.

use std::fmt;
use std::io;

use crate::mesh::whole::Flaw;

/// What is wrong with a mesh file. Counts are of the file.
#[derive(Debug, thiserror::Error)]
pub enum Problem {
    /// The system refuses to open or read it.
    #[error("cannot read the mesh file: {0}")]
    Read(#[from] io::Error),
    /// What another rank met, or all of them.
    #[error("{text}")]
    Told {
        /// What it says.
        text: String,
        /// Whether the system refuses to open or read the file.
        is_unreadable: bool,
    },
    /// Another kind of file.
    #[error(
        "this is not a Gmsh mesh, which begins with $MeshFormat; `gmsh -3 -format msh41 PART.geo -o PART.msh` makes one"
    )]
    NoMesh,
    /// A version of the format that is not read.
    #[error("MSH version {0} is not read: save with `Mesh.MshFileVersion = 4.1;` (2.2 is read too)")]
    Version(String),
    /// Binary numbers of another machine.
    #[error("the binary numbers are not those of this machine ({0}): save with `Mesh.Binary = 0;`")]
    Foreign(&'static str),
    /// Something else than the format prescribes.
    #[error("{place}: expected {expected}, found `{found}`; if the file was edited or cut short, save it again")]
    Expected {
        /// Where.
        place: Place,
        /// What the format has here.
        expected: &'static str,
        /// What is here.
        found: String,
    },
    /// The file ends too early.
    #[error("the file ends inside ${section}, after {done} of {announced} {items}: it is cut short, save it again")]
    CutShort {
        /// Section.
        section: &'static str,
        /// What is counted.
        items: &'static str,
        /// Items that are there.
        done: u64,
        /// Items that should be.
        announced: u64,
    },
    /// A section that goes on to the end of the file.
    #[error("{place}: section ${name} has no end $End{name}: its name is misspelt or the file cut short")]
    NoEnd {
        /// Where it begins.
        place: Place,
        /// Its name.
        name: String,
    },
    /// A count that the rest of the section contradicts.
    #[error("${section} announces {announced} {items} but has {found}: save the file again")]
    Count {
        /// Section.
        section: &'static str,
        /// What is counted.
        items: &'static str,
        /// By the first line.
        announced: u64,
        /// By the blocks.
        found: u64,
    },
    /// A count that no file of this length can hold, or no 32-bit number.
    #[error("${section} announces {announced} {items}, more than {limit}")]
    TooMany {
        /// Section.
        section: &'static str,
        /// What is counted.
        items: &'static str,
        /// How many.
        announced: u64,
        /// What sets the limit.
        limit: String,
    },
    /// A section is missing.
    #[error("there is no section ${0}: {1}")]
    NoSection(&'static str, &'static str),
    /// Two nodes with one number.
    #[error("node {0} is there twice: save the file again")]
    NodeTwice(u64),
    /// A node without a place.
    #[error("node {0} has a coordinate that is not a finite number")]
    NotFinite(u64),
    /// A cell refers to a node that is not there.
    #[error("{place}: a {kind} has node {node}, which is not in $Nodes: save the file again")]
    NoNode {
        /// Where.
        place: Place,
        /// Kind of cell.
        kind: &'static str,
        /// Number of the node.
        node: u64,
    },
    /// A kind of cell that is not known.
    #[error("{0}: cells of Gmsh's type {1} are not known: mesh with `Mesh.ElementOrder = 1;`")]
    UnknownKind(Place, i32),
    /// Gmsh has cut the mesh.
    #[error(
        "the mesh is partitioned, but fetiplast cuts bodies by itself: save it without (`Mesh.NbPartitions = 0;`, or \
         `UnpartitionMesh` in Gmsh's menu)"
    )]
    Partitioned,
    /// Only surfaces or lines.
    #[error("there are no volume cells: mesh in 3D (`gmsh -3`, or `Mesh 3;` at the end of the .geo)")]
    NoVolumeCells,
    /// Volume cells in no physical group.
    #[error(
        "{cells} of {all} volume cells are in no physical volume: name their volumes, as in \
         `Physical Volume(\"NAME\") = {{{entities}}};`{hint}"
    )]
    Untagged {
        /// Volume cells without a group.
        cells: u64,
        /// All volume cells.
        all: u64,
        /// Their volumes' tags, comma-separated.
        entities: String,
        /// Another way out, if there is one.
        hint: &'static str,
    },
    /// A body asks for a physical volume that is not there.
    #[error("there is no physical volume `{name}`: {known}; name it as in `Physical Volume(\"{name}\") = {{1}};`")]
    NoVolume {
        /// What was asked for.
        name: String,
        /// What is there.
        known: String,
    },
    /// A body does not say which of several volumes it is.
    #[error("there are {count} physical volumes, so say which in gmsh.volume, one or a list: {known}")]
    WhichVolume {
        /// How many.
        count: usize,
        /// What is there.
        known: String,
    },
    /// Cells that a body would have twice.
    #[error(
        "volumes `{first}` and `{second}` share {cells} cells (those of Gmsh's volume {entity}), so that they cannot be parts of one \
         body: take that volume out of one of the two"
    )]
    Shared {
        /// Name of a volume.
        first: String,
        /// Name of another.
        second: String,
        /// Tag of the volume of the geometry that both have.
        entity: i32,
        /// How many.
        cells: u64,
    },
    /// A mesh that only looks whole.
    #[error("{volume}, first near ({:.6}, {:.6}, {:.6}): {flaw}", near[0], near[1], near[2])]
    NotWhole {
        /// Names of the volumes there.
        volume: String,
        /// Where it shows first, in the file's coordinates.
        near: [f64; 3],
        /// What is wrong.
        flaw: Flaw,
    },
    /// Cells that cannot be computed with.
    #[error(
        "{what} has {cells} {kind} cells, and only first-order cells are read: mesh with `Mesh.ElementOrder = 1;` or \
         `SetOrder 1;`"
    )]
    HigherOrder {
        /// Volume or surface.
        what: String,
        /// How many.
        cells: u64,
        /// Their kind.
        kind: &'static str,
    },
    /// Other cells than those that the element is made of.
    #[error("volume `{volume}` has {cells} {kind} cells, but element = \"{element}\" needs {needs}")]
    OtherCells {
        /// Name of the volume.
        volume: String,
        /// Cells that are others.
        cells: u64,
        /// Kind of the first of them.
        kind: &'static str,
        /// Name of the element.
        element: &'static str,
        /// Which cells it needs, and how to get them.
        needs: &'static str,
    },
    /// Elements without a positive volume.
    #[error(
        "volume `{volume}`: {inverted} of {elements} elements are inverted and {degenerate} have no volume, the first \
         near ({:.6}, {:.6}, {:.6}); try `Mesh.Optimize = 1;`, `Mesh.OptimizeNetgen = 1;` or a smaller \
         `Mesh.MeshSizeMax`{hint}", near[0], near[1], near[2]
    )]
    BadElements {
        /// Name of the volume.
        volume: String,
        /// All.
        elements: u64,
        /// Negative volume.
        inverted: u64,
        /// No volume.
        degenerate: u64,
        /// Centre of the first one, in the file's coordinates.
        near: [f64; 3],
        /// What else may help.
        hint: &'static str,
    },
    /// Two elements on one side of a face.
    #[error(
        "volume `{volume}`: {faces} faces have two elements on the same side, the first near ({:.6}, {:.6}, {:.6}), so parts of the \
         mesh overlap; remove duplicates (`Coherence Mesh;`) and volumes that intersect (`BooleanFragments`)",
        near[0], near[1], near[2]
    )]
    Overlapping {
        /// Name of the volume.
        volume: String,
        /// Such faces.
        faces: u64,
        /// A node of the first, in the file's coordinates.
        near: [f64; 3],
    },
    /// Cells that have a node twice, which others beside them do not.
    #[error(
        "volume `{volume}`: {cells} cells have a node twice, the first is a {kind} near ({:.6}, {:.6}, {:.6}); such a cell leaves a \
         hole: make it a prism, pyramid or tetrahedron, as Gmsh does",
        near[0], near[1], near[2]
    )]
    Repeated {
        /// Name of the first one's volume.
        volume: String,
        /// How many.
        cells: u64,
        /// Kind of the first one.
        kind: &'static str,
        /// The first node that is there twice, in the file's coordinates.
        near: [f64; 3],
    },
    /// A surface that is not there.
    #[error(
        "there is no physical surface `{name}`: {known}; name it as in \
         `Physical Surface(\"{name}\") = {{1}};`"
    )]
    NoSurface {
        /// What was asked for.
        name: String,
        /// What is there.
        known: String,
    },
    /// A surface that does not bound the body.
    #[error(
        "no triangle of physical surface `{name}` ({triangles} in all) is on the boundary of volume `{volume}`; those \
         that are: {known}"
    )]
    ElsewhereSurface {
        /// What was asked for.
        name: String,
        /// Triangles.
        triangles: u64,
        /// The body's volume.
        volume: String,
        /// Surfaces of the body.
        known: String,
    },
    /// A surface within the body.
    #[error(
        "{inner} of {triangles} triangles of physical surface `{name}` lie inside volume `{volume}`, not on its \
         boundary; take their surface out of `Physical Surface(\"{name}\")`"
    )]
    InnerSurface {
        /// What was asked for.
        name: String,
        /// The body's volume.
        volume: String,
        /// Triangles inside.
        inner: u64,
        /// All.
        triangles: u64,
    },
}

/// Where in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line of a text, from 1.
    Line(u64),
    /// Byte of a binary file, from 0.
    Byte(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
        }
    }
}

impl Problem {
    /// Whether the system refuses to open or read the file.
    pub fn is_unreadable(&self) -> bool {
        matches!(self, Self::Read(_) | Self::Told { is_unreadable: true, .. })
    }

    /// Something else than the format prescribes, shown by its beginning.
    pub(super) fn expected(place: Place, expected: &'static str, found: &[u8]) -> Self {
        // Texts between ranks end where a NUL is.
        let found = String::from_utf8_lossy(&found[..found.len().min(64)]).replace('\0', "\u{fffd}");
        Self::Expected { place, expected, found }
    }
}
