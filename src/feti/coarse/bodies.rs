//! Rigid motions of whole bodies: three translations, three rotations about the centre of the body's bounding box in units
//! of its half diagonal. Pieces of a body that have no face in common count as bodies here.
//!
//! `T_c` expresses the motions of a body in the modes of its cluster `c`. The force of a row on a body is `T'G` of that row; forces
//! of gluing cancel there.

use std::collections::BTreeSet;
use std::fmt;

use crate::decomposition::Subdomain;
use crate::feti::dual::blocks::Blocks;
use crate::feti::dual::levels::Tree;
use crate::feti::inverse::kernel::{MODES, RigidModes};
use crate::span::complement;
use crate::vector::{cross, length};

/// `T` of all clusters, on every rank.
pub struct BodyMotions {
    /// Body and piece of each, ascending.
    pieces: Vec<[usize; 2]>,
    /// Centre and half diagonal of each.
    frames: Vec<([f64; 3], f64)>,
    /// For each cluster its body and `T_c`, `[mode][motion]`.
    clusters: Vec<(usize, [[f64; MODES]; MODES])>,
}

impl BodyMotions {
    /// Of all bodies, the modes being those of the clusters for each own subdomain. Collective.
    pub fn new(tree: &Tree, subdomains: &[Subdomain], modes: &[RigidModes]) -> Self {
        let mut mine = Vec::new();
        for subdomain in subdomains {
            let extreme =
                |a: usize, sign: f64| subdomain.points.iter().fold(f64::NEG_INFINITY, |m, p| m.max(sign * p[a]));
            mine.extend(piece(subdomain).map(|k| k as f64));
            (0..3).for_each(|a| mine.extend([extreme(a, 1.0), extreme(a, -1.0)]));
        }
        // A cluster is of one piece of one body.
        let boxes = tree.of_clusters(&tree.fold(tree.levels(), &mine, 8, f64::max), 8);
        let of_clusters: Vec<[usize; 2]> = boxes.chunks_exact(8).map(|b| [b[0] as usize, b[1] as usize]).collect();
        let pieces: Vec<[usize; 2]> = of_clusters.iter().copied().collect::<BTreeSet<_>>().into_iter().collect();
        let number = |piece: &[usize; 2]| pieces.binary_search(piece).expect("every piece has a cluster");
        let bodies: Vec<usize> = of_clusters.iter().map(number).collect();
        let mut extents = vec![[f64::NEG_INFINITY; 6]; pieces.len()];
        for (values, &body) in boxes.chunks_exact(8).zip(&bodies) {
            extents[body].iter_mut().zip(&values[2..]).for_each(|(e, v)| *e = e.max(*v));
        }
        let frame = |e: &[f64; 6]| {
            let half = |a: usize| 0.5 * (e[2 * a] + e[2 * a + 1]);
            let centre = [0, 1, 2].map(|a| 0.5 * (e[2 * a] - e[2 * a + 1]));
            (centre, (0..3).map(|a| half(a) * half(a)).sum::<f64>().sqrt())
        };
        let frames: Vec<_> = extents.iter().map(frame).collect();
        let mut mine = Vec::new();
        for (subdomain, modes) in subdomains.iter().zip(modes) {
            for motion in 0..MODES {
                let at = |x: &[f64; 3]| displacement(&frames[number(&piece(subdomain))], motion, x);
                let moved: Vec<f64> = subdomain.points.iter().flat_map(at).collect();
                mine.extend(modes.resultants(&subdomain.points, &moved));
            }
        }
        let columns = tree.of_clusters(&tree.sum(tree.levels(), &mine, MODES * MODES), MODES * MODES);
        let matrices = columns.chunks_exact(MODES * MODES);
        let matrix = |c: &[f64]| std::array::from_fn(|mode| std::array::from_fn(|motion| c[MODES * motion + mode]));
        Self { clusters: bodies.into_iter().zip(matrices.map(matrix)).collect(), pieces, frames }
    }

    /// Number of bodies, pieces of one counted one by one.
    pub fn bodies(&self) -> usize {
        self.frames.len()
    }

    /// Adds a force on a cluster's modes to that on its body, six numbers a body.
    pub fn add_force(&self, cluster: usize, modes: &[f64], forces: &mut [f64]) {
        let (body, matrix) = &self.clusters[cluster];
        for (row, f) in matrix.iter().zip(modes) {
            forces[MODES * body..][..MODES].iter_mut().zip(row).for_each(|(force, t)| *force += t * f);
        }
    }

    /// `T motion`, six numbers a cluster.
    pub fn amplitudes(&self, motion: &[f64]) -> Vec<f64> {
        let of = |(body, matrix): &(usize, [[f64; MODES]; MODES])| {
            let motion = &motion[MODES * body..][..MODES];
            matrix.map(|row| row.iter().zip(motion).map(|(t, m)| t * m).sum::<f64>())
        };
        self.clusters.iter().flat_map(of).collect()
    }

    /// An orthonormal basis of the kernel of `T' blocks T`: the motions that some rows leave free. `blocks` are the lower ones of
    /// `G G'` for these rows as unit vectors.
    pub fn free(&self, blocks: &Blocks) -> Vec<Vec<f64>> {
        let n = MODES * self.bodies();
        let mut gram = vec![vec![0.0; n]; n];
        for (&(row, column), block) in blocks {
            for j in 0..MODES {
                // The force of the column's motion on the row's body; its transpose where that is a block above.
                let (body, matrix) = &self.clusters[column];
                let motion = MODES * body + j;
                let product: Vec<f64> =
                    (0..MODES).map(|i| (0..MODES).map(|k| block[MODES * i + k] * matrix[k][j]).sum()).collect();
                let mut forces = vec![0.0; n];
                self.add_force(row, &product, &mut forces);
                for (i, force) in forces.into_iter().enumerate() {
                    gram[motion][i] += force;
                    if row != column {
                        gram[i][motion] += force;
                    }
                }
            }
        }
        // Gluing cancels to rounding.
        let largest = |values: &mut dyn Iterator<Item = &f64>| values.fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let block = largest(&mut blocks.values().flatten());
        let motion = largest(&mut self.clusters.iter().flat_map(|(_, matrix)| matrix.as_flattened()));
        let rounding = ROUNDING * block * motion * motion;
        gram.iter_mut().flatten().filter(|x| x.abs() <= rounding).for_each(|x| *x = 0.0);
        complement(&gram, n)
    }

    /// The first cluster of each body.
    pub fn first_clusters(&self) -> Vec<usize> {
        let first = |body| self.clusters.iter().position(|c| c.0 == body).expect("a body has a cluster");
        (0..self.bodies()).map(first).collect()
    }

    /// What moves most in a motion of all bodies, in words: the body, and the centre of its piece if it has several.
    pub fn describe(&self, motion: &[f64]) -> (usize, Option<[f64; 3]>, Motion) {
        let size = |body: usize| motion[MODES * body..][..MODES].iter().map(|m| m * m).sum::<f64>();
        let body = (0..self.bodies()).max_by(|&a, &b| size(a).total_cmp(&size(b)).then(b.cmp(&a))).unwrap_or(0);
        let ([t, w], (centre, half)) = ([0, 3].map(|k| vector(&motion[MODES * body + k..])), self.frames[body]);
        let (moved, turned) = (length(t), length(w));
        let [of, _] = self.pieces[body];
        let place = (self.pieces.iter().filter(|piece| piece[0] == of).count() > 1).then_some(centre);
        if turned <= PURE * moved {
            return (of, place, Motion::Translation(t.map(|x| x / moved)));
        }
        // Of a screw, the point of its axis that is nearest to the centre.
        let arm = cross(w, t).map(|x| half * x / (turned * turned));
        (
            of,
            place,
            Motion::Rotation {
                axis: w.map(|x| x / turned),
                through: [0, 1, 2].map(|a| centre[a] + arm[a]),
                size: half,
            },
        )
    }
}

/// Products of blocks and motions of a smaller share of the largest are rounding.
const ROUNDING: f64 = 1e-13;

fn piece(subdomain: &Subdomain) -> [usize; 2] {
    [subdomain.body, subdomain.piece]
}

/// A rotation this small beside a translation is none.
const PURE: f64 = 1e-6;

/// A rigid motion.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// Along a unit vector.
    Translation([f64; 3]),
    /// About a line.
    Rotation {
        /// Its direction, a unit vector.
        axis: [f64; 3],
        /// A point of it.
        through: [f64; 3],
        /// Half diagonal of the body.
        size: f64,
    },
}

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Translation(direction) => write!(f, "translation along {}", Direction(*direction)),
            Self::Rotation { axis, through, size } => {
                // Four digits of the body's size.
                let digits = (4.0 - size.log10().floor()).clamp(0.0, 17.0) as i32;
                let [x, y, z] = through.map(|x| (x * 10_f64.powi(digits)).round() / 10_f64.powi(digits) + 0.0);
                write!(f, "rotation about {} through ({x}, {y}, {z})", Direction(*axis))
            }
        }
    }
}

struct Direction([f64; 3]);

impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for (component, name) in self.0.into_iter().zip(["x", "y", "z"]) {
            if 1.0 - component.abs() < PURE {
                return write!(f, "{}{name}", if component > 0.0 { '+' } else { '-' });
            }
        }
        let [x, y, z] = self.0;
        write!(f, "({x:.3}, {y:.3}, {z:.3})")
    }
}

fn vector(values: &[f64]) -> [f64; 3] {
    [values[0], values[1], values[2]]
}

/// A motion of the body of this frame at a point.
fn displacement((centre, half): &([f64; 3], f64), motion: usize, x: &[f64; 3]) -> [f64; 3] {
    let mut u = [0.0; 3];
    if motion < 3 {
        u[motion] = 1.0;
    } else {
        let (b, c) = ((motion - 2) % 3, (motion - 1) % 3);
        u[c] = (x[b] - centre[b]) / half;
        u[b] = -(x[c] - centre[c]) / half;
    }
    u
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::Kind;
    use crate::fixture::{on_ranks, two_bricks, two_bricks_by_metis};

    #[test]
    fn gluing_does_not_act_on_bodies_and_contact_acts_on_two_alike() {
        for scene in [two_bricks(&[]), two_bricks(&["decomposition.cluster=2"]), two_bricks_by_metis(7)] {
            on_ranks(&scene, 2, |setup| {
                let coarse = setup.bare_coarse();
                for (row, _) in setup.rows().iter().enumerate().filter(|(_, row)| row.kind.is_contact()) {
                    let force = coarse.force_on_bodies(row);
                    (0..3).for_each(|a| assert!((force[a] + force[MODES + a]).abs() < 1e-13));
                    assert!(force[2].abs() > 0.1);
                }
            });
            on_ranks(&scene, 1, |setup| {
                let coarse = setup.bare_coarse();
                for (row, of) in setup.rows().iter().enumerate() {
                    let mut unit = vec![0.0; setup.rows().len()];
                    unit[row] = 1.0;
                    let mut force = vec![0.0; MODES * coarse.motions().bodies()];
                    let of_clusters = coarse.apply(&unit);
                    for (cluster, modes) in of_clusters.as_chunks::<MODES>().0.iter().enumerate() {
                        coarse.motions().add_force(cluster, modes, &mut force);
                    }
                    match of.kind {
                        Kind::Gluing => assert!(force.iter().all(|f| f.abs() < 1e-13), "{force:?}"),
                        Kind::Contact { .. } | Kind::Friction { .. } => {
                            let of_row = coarse.force_on_bodies(row);
                            assert!(force.iter().zip(of_row).all(|(a, b)| (a - b).abs() < 1e-13));
                        }
                        Kind::Support { axis, .. } => assert!(force[axis].abs().max(force[MODES + axis].abs()) > 0.1),
                    }
                }
            });
        }
    }

    #[test]
    fn what_supports_leave_free_is_found_and_named() {
        let free = |sets: &[&str]| {
            let described = |setup: &crate::fixture::Setup| {
                let coarse = setup.bare_coarse();
                let free = coarse.free();
                let name = |motion: &Vec<f64>| {
                    let (body, _, motion) = coarse.motions().describe(motion);
                    format!("{body}: {motion}")
                };
                free.iter().map(name).collect::<Vec<_>>()
            };
            on_ranks(&two_bricks(sets), 2, described).swap_remove(0)
        };
        assert!(free(&[]).is_empty());
        let guide = ["support.right.fix=[\"x\"]", "support.right.displacement=[0.0, 0.0, 0.0]"];
        let [y, z, turn] = &free(&guide)[..] else { panic!("{:?}", free(&guide)) };
        assert_eq!([&y[..], z], ["1: translation along +y", "1: translation along +z"]);
        assert!(turn.starts_with("1: rotation about +x through ("), "{turn}");
        // Of the upper brick, from z = 2.1 to 3.9, the top is held along y and z.
        let hinge = ["support.right.fix=[\"y\", \"z\"]", "support.right.surface=upper.zmax"];
        assert_eq!(free(&hinge), ["1: translation along +x"]);
        let nothing = ["support.right.surface=lower.xmax", "support.right.displacement=[0.0, 0.0, 0.0]"];
        assert_eq!(free(&nothing).len(), 6);
    }

    #[test]
    fn axes_of_rotation_go_through_what_stays() {
        on_ranks(&two_bricks(&[]), 1, |setup| {
            let coarse = setup.bare_coarse();
            // The upper brick about the line x = 5, z = 2.1 along y: centre (3, 1.1, 3).
            let half = (4.0_f64.powi(2) + 2.2_f64.powi(2) + 1.8_f64.powi(2)).sqrt() / 2.0;
            let (arm_x, arm_z) = (3.0 - 5.0, 3.0 - 2.1);
            let motion = [arm_z, 0.0, -arm_x, 0.0, half, 0.0];
            let whole = [[0.0; 6], motion].concat();
            let (body, place, motion) = coarse.motions().describe(&whole);
            assert_eq!(
                (body, place, motion.to_string()),
                (1, None, "rotation about +y through (5, 1.1, 2.1)".to_owned())
            );
        });
        let slanted = Motion::Translation([-0.6, 0.8, 0.0]);
        assert_eq!(slanted.to_string(), "translation along (-0.600, 0.800, 0.000)");
    }
}
