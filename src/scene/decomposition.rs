//! How bodies are cut into subdomains. The cut belongs to the scene: it never depends on the number of ranks.

use serde::{Deserialize, Serialize};

/// Subdomains, and clusters of them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Section")]
pub struct Decomposition {
    /// How subdomains are cut.
    #[serde(flatten)]
    pub method: Method,
    /// Groups of neighbouring subdomains; the largest share one set of rigid motions in the coarse problem. Absent: by the number of
    /// subdomains.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cluster: Option<Groups>,
    /// Whether `cells` were given beside a method that has none: a file can keep them while its user tries these.
    #[serde(skip)]
    pub idle_cells: bool,
}

/// Sizes of groups of subdomains.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Groups {
    /// About so many on each level, and as many levels as the coarse problem needs; 1 for plain Total FETI.
    Equal(usize),
    /// About so many subdomains in a group, so many groups in a group of the next level, and so on.
    Levels(Vec<usize>),
}

/// The method and its one parameter.
///
/// In a file the method may be left out: `subdomains` selects metis, `cells` bricks, and nothing auto.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(tag = "method", rename_all = "lowercase")]
pub enum Method {
    /// By the cost model: cubes of cells where they divide every body, else metis.
    #[default]
    Auto,
    /// Equal boxes of cells; they must divide every brick.
    Bricks {
        /// Cells of one subdomain along each axis. Not refined by the level: the subdomains multiply instead.
        cells: [usize; 3],
    },
    /// A graph partition of the elements.
    Metis {
        /// How many parts to ask for over all bodies; parts that fall apart are split further. Absent: by a cost model.
        #[serde(skip_serializing_if = "Option::is_none")]
        subdomains: Option<usize>,
    },
}

/// The paper's cubes of 10 x 10 x 10 cells.
pub const PAPER_CELLS: [usize; 3] = [10, 10, 10];

/// The section as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Section {
    method: Option<Name>,
    cells: Option<[usize; 3]>,
    subdomains: Option<usize>,
    cluster: Option<Groups>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Name {
    Auto,
    Bricks,
    Metis,
}

/// Keys of the section that contradict each other.
#[derive(Debug, thiserror::Error)]
#[error(
    "decomposition.subdomains = {subdomains} belongs to method = \"metis\", but method = \"{method}\" is given: \
     remove subdomains, or change or remove the method"
)]
struct SectionError {
    subdomains: usize,
    method: &'static str,
}

impl TryFrom<Section> for Decomposition {
    type Error = SectionError;

    fn try_from(section: Section) -> Result<Self, SectionError> {
        let Section { method, cells, subdomains, cluster } = section;
        let method = match (method, subdomains) {
            (Some(Name::Bricks), Some(subdomains)) => return Err(SectionError { subdomains, method: "bricks" }),
            (Some(Name::Auto), Some(subdomains)) => return Err(SectionError { subdomains, method: "auto" }),
            (Some(Name::Metis), _) | (None, Some(_)) => Method::Metis { subdomains },
            (Some(Name::Auto), None) => Method::Auto,
            (Some(Name::Bricks), None) => Method::Bricks { cells: cells.unwrap_or(PAPER_CELLS) },
            (None, None) => cells.map_or(Method::Auto, |cells| Method::Bricks { cells }),
        };
        let idle_cells = cells.is_some() && !matches!(method, Method::Bricks { .. });
        Ok(Self { method, cluster, idle_cells })
    }
}
