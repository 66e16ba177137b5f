//! Structured bodies that are no bricks: a part of a hollow sphere or cylinder, a box of unequal cells.

use serde::{Deserialize, Serialize};

use super::require::{Checked, require};

/// An octant of a hollow sphere about the origin, where all coordinates are positive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sphere {
    /// Inner radius, positive.
    pub inner: f64,
    /// Outer radius, larger.
    pub outer: f64,
    /// Cells along half of an edge, which is a quarter of a great circle, and through the wall.
    pub cells: [usize; 2],
}

/// A quarter of a hollow cylinder about the z axis, where all coordinates are positive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    /// Inner radius, positive.
    pub inner: f64,
    /// Outer radius, larger.
    pub outer: f64,
    /// Along the axis, positive.
    pub height: f64,
    /// Cells along the quarter of a circle, through the wall, and along the axis.
    pub cells: [usize; 3],
}

/// A box cut by planes across the axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Where the planes across x are, ascending.
    pub x: Vec<f64>,
    /// Where the planes across y are, ascending.
    pub y: Vec<f64>,
    /// Where the planes across z are, ascending.
    pub z: Vec<f64>,
}

/// Surfaces of a sphere.
pub(super) const OF_SPHERE: [&str; 5] = ["inner", "outer", "x0", "y0", "z0"];
/// Surfaces of a cylinder.
pub(super) const OF_CYLINDER: [&str; 6] = ["inner", "outer", "x0", "y0", "bottom", "top"];

impl Sphere {
    pub(super) fn refine(&mut self, level: usize) {
        self.cells = self.cells.map(|n| n.saturating_mul(level));
    }

    pub(super) fn check(&self, key: &str) -> Checked {
        let [around, through] = self.cells;
        radii(key, self.inner, self.outer)?;
        countable(&format!("{key}.cells"), &self.cells, &[3, around, around, through])
    }
}

impl Cylinder {
    pub(super) fn refine(&mut self, level: usize) {
        self.cells = self.cells.map(|n| n.saturating_mul(level));
    }

    pub(super) fn check(&self, key: &str) -> Checked {
        radii(key, self.inner, self.outer)?;
        let height = self.height;
        require(height.is_finite() && height > 0.0, &format!("{key}.height"), height, "must be positive and finite")?;
        countable(&format!("{key}.cells"), &self.cells, &self.cells)
    }
}

impl Grid {
    /// Cuts each interval into equal parts: into so many that the check refuses them where that is too much.
    pub(super) fn refine(&mut self, level: usize) {
        for planes in [&mut self.x, &mut self.y, &mut self.z] {
            let level = level.min(MOST_ALONG / planes.len().saturating_sub(1).max(1) + 1);
            let between = |k: usize| {
                let (i, part) = (k / level, (k % level) as f64 / level as f64);
                if part == 0.0 { planes[i] } else { planes[i] + part * (planes[i + 1] - planes[i]) }
            };
            *planes = (0..planes.len().saturating_sub(1).saturating_mul(level) + 1).map(between).collect();
        }
    }

    pub(super) fn check(&self, key: &str) -> Checked {
        for (axis, planes) in [("x", &self.x), ("y", &self.y), ("z", &self.z)] {
            let ascending = planes.iter().all(|x| x.is_finite()) && planes.windows(2).all(|pair| pair[0] < pair[1]);
            let rule = "at least two finite numbers are needed, ascending";
            require(planes.len() >= 2 && ascending, &format!("{key}.{axis}"), planes, rule)?;
        }
        let cells = [&self.x, &self.y, &self.z].map(|planes| planes.len() - 1);
        let fits = cells.iter().all(|&n| n <= MOST_ALONG);
        require(fits, key, cells, "too many cells along an edge (level included)")?;
        countable(key, &cells, &cells)
    }
}

fn radii(key: &str, inner: f64, outer: f64) -> Checked {
    let rule = "must be positive and finite: a full sphere or cylinder has no such mesh";
    require(inner.is_finite() && inner > 0.0, &format!("{key}.inner"), inner, rule)?;
    let rule = "must be finite and larger than inner";
    require(outer.is_finite() && outer > inner, &format!("{key}.outer"), outer, rule)
}

/// Nodes of these bodies are numbered in 32 bits, those of quadratic elements included.
const MOST_CELLS: usize = 1 << 28;

/// Planes of a grid are kept.
const MOST_ALONG: usize = 1 << 20;

fn countable(key: &str, cells: &[usize], factors: &[usize]) -> Checked {
    require(!cells.contains(&0), key, cells, "must be at least 1 along each edge")?;
    let count = factors.iter().fold(1_usize, |product, &n| product.saturating_mul(n));
    require(count <= MOST_CELLS, key, cells, "too many cells (level included) to be counted")
}
