//! The six faces of a brick.

use std::fmt;
use std::str::FromStr;

/// A face of a brick, named by its axis and its end; the order is that of [`Face::ALL`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Face {
    XMin,
    XMax,
    YMin,
    YMax,
    ZMin,
    ZMax,
}

/// A name that is none of xmin, xmax, ymin, ymax, zmin, zmax.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a brick has the faces xmin, xmax, ymin, ymax, zmin and zmax, but no `{0}`")]
pub struct UnknownFace(pub String);

impl Face {
    /// All faces, in the order of their discriminants.
    pub const ALL: [Face; 6] = [Face::XMin, Face::XMax, Face::YMin, Face::YMax, Face::ZMin, Face::ZMax];

    /// The axis the face is normal to: 0, 1, 2 for x, y, z.
    pub fn axis(self) -> usize {
        self as usize / 2
    }

    /// Whether the face is at the upper end of its axis.
    pub fn is_upper(self) -> bool {
        self as usize % 2 == 1
    }

    /// Outward unit normal.
    pub fn normal(self) -> [f64; 3] {
        let mut normal = [0.0; 3];
        normal[self.axis()] = if self.is_upper() { 1.0 } else { -1.0 };
        normal
    }
}

impl fmt::Display for Face {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"][*self as usize])
    }
}

impl FromStr for Face {
    type Err = UnknownFace;

    fn from_str(name: &str) -> Result<Self, UnknownFace> {
        Self::ALL.into_iter().find(|face| face.to_string() == name).ok_or_else(|| UnknownFace(name.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back_and_others_refused() {
        for face in Face::ALL {
            assert_eq!(face.to_string().parse(), Ok(face));
        }
        assert_eq!("top".parse::<Face>(), Err(UnknownFace("top".into())));
        assert_eq!((Face::YMax.axis(), Face::YMax.is_upper(), Face::ZMin.normal()), (1, true, [0.0, 0.0, -1.0]));
    }
}
