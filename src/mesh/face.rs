//! The six faces of a brick.

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
}
