//! How bodies are cut into subdomains. The cut belongs to the scene: it never depends on the number of ranks.

use serde::{Deserialize, Serialize};

/// The method and its one parameter.
///
/// In a file the method may be left out: `subdomains` selects metis, anything else bricks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "lowercase", try_from = "Section")]
pub enum Decomposition {
    /// Equal boxes of cells; they must divide every brick.
    Bricks {
        /// Cells of one subdomain along each axis. Not refined by the level: the subdomains multiply instead.
        cells: [usize; 3],
    },
    /// A graph partition of the elements.
    Metis {
        /// How many parts to ask for over all bodies; parts that fall apart are split further.
        subdomains: usize,
    },
}

impl Default for Decomposition {
    /// The paper's cubes of 10 x 10 x 10 cells.
    fn default() -> Self {
        Decomposition::Bricks { cells: [10, 10, 10] }
    }
}

/// The section as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Section {
    method: Option<Method>,
    cells: Option<[usize; 3]>,
    subdomains: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Method {
    Bricks,
    Metis,
}

/// Keys of the section that contradict each other.
#[derive(Debug, thiserror::Error)]
enum SectionError {
    #[error(
        "decomposition.subdomains = {0} belongs to method = \"metis\", but method = \"bricks\" is given: \
         remove subdomains, or change or remove the method"
    )]
    SubdomainsOfBricks(usize),
    #[error("decomposition.method = \"metis\" needs decomposition.subdomains, the number of parts to cut into")]
    NoSubdomains,
}

impl TryFrom<Section> for Decomposition {
    type Error = SectionError;

    /// `cells` beside metis are ignored: a file can keep them while its user tries the other method.
    fn try_from(section: Section) -> Result<Self, SectionError> {
        match (section.method, section.subdomains) {
            (Some(Method::Bricks), Some(subdomains)) => Err(SectionError::SubdomainsOfBricks(subdomains)),
            (Some(Method::Metis), None) => Err(SectionError::NoSubdomains),
            (_, Some(subdomains)) => Ok(Decomposition::Metis { subdomains }),
            (_, None) => Ok(section.cells.map_or_else(Decomposition::default, |cells| Decomposition::Bricks { cells })),
        }
    }
}
