//! What can be wrong with a scene, in one short paragraph each.

use std::fmt;

/// Why there is no scene.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// Neither a built-in name nor something like a path.
    #[error("there is no built-in scene `{name}`: known are {known}; the path of a TOML file is accepted too")]
    UnknownScene {
        /// What was asked for.
        name: String,
        /// Names that exist, comma-separated.
        known: String,
    },
    /// The file cannot be read.
    #[error("cannot read the scene file {path}: {source}")]
    Read {
        /// The path as given.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// Not TOML, an unknown or missing key, or a value of the wrong type.
    #[error("{place}: {message}")]
    Syntax {
        /// Where.
        place: Place,
        /// What, in the words of the TOML reader.
        message: String,
    },
    /// An override that is malformed or does not fit the scene.
    #[error("--set {set}: {problem}")]
    Override {
        /// The override as given.
        set: String,
        /// What is wrong with it.
        problem: String,
    },
    /// Level 0 has no cells.
    #[error("level 0 leaves no cells: levels start at 1, and level n has n times the cells per edge")]
    Level,
    /// Meshes from files are as fine as they are.
    #[error(
        "level {level} refines bodies that a scene describes, and body {body} is from a mesh file: use level 1 and \
         refine the mesh, as with `gmsh -refine` or `Mesh.MeshSizeFactor = 0.5;`"
    )]
    LevelOfMesh {
        /// What was asked for.
        level: usize,
        /// A body from a mesh file.
        body: String,
    },
    /// Well-formed, but the values make no sense.
    #[error("{place}: {fault}")]
    Check {
        /// Where.
        place: Place,
        /// What.
        fault: Fault,
    },
}

/// Where in the input something is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// In a text; line and column count from 1 and are unknown for keys that only have a default.
    Text {
        /// The file or built-in scene.
        origin: String,
        /// Line and column.
        position: Option<(usize, usize)>,
    },
    /// In an override, given as on the command line.
    Override(String),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Place::Text { origin, position: Some((line, column)) } => {
                write!(f, "{origin}, line {line}, column {column}")
            }
            Place::Text { origin, position: None } => f.write_str(origin),
            Place::Override(set) => write!(f, "--set {set}"),
        }
    }
}

/// A check that failed: `key = value: rule`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Dotted path of the key.
    pub key: String,
    /// The offending value, unless it is the key as a whole.
    pub value: Option<String>,
    /// What is allowed instead.
    pub rule: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match &self.value {
            Some(value) => write!(f, "{} = {value}: {}", self.key, self.rule),
            None => write!(f, "{}: {}", self.key, self.rule),
        }
    }
}

/// A message of the TOML reader on one line, without the vocabulary of Rust types.
pub(super) fn in_user_words(message: &str) -> String {
    let words = [
        ("unknown field", "unknown key"),
        ("missing field", "missing key"),
        ("expected usize", "expected a count (0, 1, 2, ...)"),
        ("expected f64", "expected a number"),
        ("expected fewer elements in array", "expected fewer values"),
        ("\n", ", "),
    ];
    words.iter().fold(message.trim_end().to_owned(), |text, (from, to)| text.replace(from, to))
}
