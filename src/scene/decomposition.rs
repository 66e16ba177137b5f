//! How bodies are cut into subdomains. The cut belongs to the scene: it never depends on the number of ranks.

use serde::{Deserialize, Serialize};

/// The method and its one parameter.
///
/// In a file the method may be left out: `subdomains` selects metis, `cells` bricks, and nothing auto.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "lowercase", try_from = "Section")]
pub enum Decomposition {
    /// Bricks with the paper's cells where they divide every body, else metis by the cost model.
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
    method: Option<Method>,
    cells: Option<[usize; 3]>,
    subdomains: Option<usize>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Method {
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

    /// `cells` beside other methods are ignored: a file can keep them while its user tries these.
    fn try_from(section: Section) -> Result<Self, SectionError> {
        let Section { method, cells, subdomains } = section;
        match (method, subdomains) {
            (Some(Method::Bricks), Some(subdomains)) => Err(SectionError { subdomains, method: "bricks" }),
            (Some(Method::Auto), Some(subdomains)) => Err(SectionError { subdomains, method: "auto" }),
            (Some(Method::Metis), _) | (None, Some(_)) => Ok(Decomposition::Metis { subdomains }),
            (Some(Method::Auto), None) => Ok(Decomposition::Auto),
            (Some(Method::Bricks), None) => Ok(Decomposition::Bricks { cells: cells.unwrap_or(PAPER_CELLS) }),
            (None, None) => Ok(cells.map_or(Decomposition::Auto, |cells| Decomposition::Bricks { cells })),
        }
    }
}
