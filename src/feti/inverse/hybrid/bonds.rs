//! `B_c`: what holds the members of a cluster together, from their shapes alone.
//!
//! Between any two members with a face in common, the jump of the displacement over the nodes of the face has no part along the
//! six rigid motions of these nodes: three weighted averages and three moments. The rows are combinations of gluing rows, so
//! the glued solution meets them. Those that follow from others before them are left out.

use std::rc::Rc;

use crate::decomposition::Subdomain;
use crate::feti::inverse::kernel::MODES;
use crate::feti::inverse::kernel::{RigidModes, inertia};

/// Nodes are a face if the product of their principal moments is more than this share of the cube of their sum.
const SPREAD: f64 = 1e-9;
/// A row whose part that is orthogonal to those before it has a smaller share of its square follows from these.
const NOTHING: f64 = 1e-6;

/// The rows of a cluster; the same bits in congruent ones.
#[derive(Debug, PartialEq)]
pub struct Bonds {
    /// Number of rows.
    pub rows: usize,
    /// What each member takes part in.
    pub members: Vec<Member>,
}

/// A member's part of the rows, and its rigid modes.
#[derive(Debug, PartialEq)]
pub struct Member {
    /// Its orthonormal rigid modes, six numbers an unknown.
    pub modes: Vec<[f64; MODES]>,
    /// Its rows, ascending.
    pub jumps: Vec<Jump>,
}

/// A member's part of a row.
#[derive(Clone, Debug, PartialEq)]
pub struct Jump {
    /// The row.
    pub row: usize,
    /// Unknowns and coefficients.
    pub entries: Vec<(u32, f64)>,
    /// `R' B_c'`: what the member's rigid modes contribute to the row.
    pub modes: [f64; MODES],
}

impl Jump {
    /// The row's part for a displacement of the member.
    pub fn of(&self, u: &[f64]) -> f64 {
        self.entries.iter().map(|&(dof, value)| value * u[dof as usize]).sum()
    }
}

/// The bonds of clusters, those of congruent ones in common.
#[derive(Default)]
pub struct Kinds(Vec<(Bonds, Rc<Bonds>)>);

impl Kinds {
    /// Of the cluster of these members.
    pub fn bonds(&mut self, members: &[Subdomain]) -> Rc<Bonds> {
        let all = Bonds::of_faces(members);
        if let Some((_, shared)) = self.0.iter().find(|(known, _)| *known == all) {
            return Rc::clone(shared);
        }
        let independent = Rc::new(all.independent());
        self.0.push((all, Rc::clone(&independent)));
        independent
    }
}

impl Bonds {
    /// All rows.
    pub(super) fn of_faces(subdomains: &[Subdomain]) -> Self {
        let modes = |s: &Subdomain| {
            let modes = RigidModes::new(&s.shape);
            s.shape.iter().flat_map(|&point| modes.at(point)).collect()
        };
        let mut members: Vec<Member> =
            subdomains.iter().map(|s| Member { modes: modes(s), jumps: Vec::new() }).collect();
        let mut rows = 0;
        for (j, other) in subdomains.iter().enumerate() {
            for (i, one) in subdomains[..j].iter().enumerate() {
                let shared = shared_nodes(one, other);
                let points: Vec<[f64; 3]> = shared.iter().map(|&[node, _]| one.shape[node as usize]).collect();
                if !is_face(&points) {
                    continue;
                }
                let motions = RigidModes::new(&points);
                let motions: Vec<[[f64; MODES]; 3]> = points.iter().map(|&point| motions.at(point)).collect();
                for (side, member, sign) in [(0, i, 0.5_f64.sqrt()), (1, j, -0.5_f64.sqrt())] {
                    let member = &mut members[member];
                    for k in 0..MODES {
                        let of_node = |(nodes, at): (&[u32; 2], &[[f64; MODES]; 3])| {
                            [0, 1, 2].map(|axis| (3 * nodes[side] + axis as u32, sign * at[axis][k]))
                        };
                        let entries: Vec<(u32, f64)> =
                            shared.iter().zip(&motions).flat_map(of_node).filter(|entry| entry.1 != 0.0).collect();
                        let mut modes = [0.0; MODES];
                        for &(dof, value) in &entries {
                            modes.iter_mut().zip(member.modes[dof as usize]).for_each(|(m, r)| *m += value * r);
                        }
                        member.jumps.push(Jump { row: rows + k, entries, modes });
                    }
                }
                rows += MODES;
            }
        }
        Self { rows, members }
    }

    /// Without the rows that follow from others before them.
    fn independent(&self) -> Self {
        // Cholesky's factor of `B_c B_c'`, row by row.
        let gram = self.gram();
        let (mut factor, mut place): (Vec<Vec<f64>>, _) = (Vec::new(), vec![None; self.rows]);
        let mut kept: Vec<usize> = Vec::new();
        for (row, products) in gram.chunks_exact(self.rows).enumerate() {
            let mut of_row: Vec<f64> = Vec::with_capacity(kept.len() + 1);
            for (&other, of_other) in kept.iter().zip(&factor) {
                let known: f64 = of_row.iter().zip(of_other).map(|(a, b)| a * b).sum();
                of_row.push((products[other] - known) / of_other[of_row.len()]);
            }
            let rest = products[row] - of_row.iter().map(|x| x * x).sum::<f64>();
            if rest > NOTHING * products[row] {
                of_row.push(rest.sqrt());
                factor.push(of_row);
                place[row] = Some(kept.len());
                kept.push(row);
            }
        }
        let renumber = |jump: &Jump| place[jump.row].map(|row| Jump { row, ..jump.clone() });
        let member = |member: &Member| Member {
            modes: member.modes.clone(),
            jumps: member.jumps.iter().filter_map(renumber).collect(),
        };
        Self { rows: kept.len(), members: self.members.iter().map(member).collect() }
    }

    /// `B_c B_c'`, row by row.
    fn gram(&self) -> Vec<f64> {
        let mut gram = vec![0.0; self.rows * self.rows];
        for member in &self.members {
            let mut column = vec![0.0; member.modes.len()];
            for one in &member.jumps {
                one.entries.iter().for_each(|&(dof, value)| column[dof as usize] = value);
                for other in &member.jumps {
                    gram[self.rows * one.row + other.row] += other.of(&column);
                }
                one.entries.iter().for_each(|&(dof, _)| column[dof as usize] = 0.0);
            }
        }
        gram
    }
}

/// Local nodes of both, ascending.
fn shared_nodes(one: &Subdomain, other: &Subdomain) -> Vec<[u32; 2]> {
    let (mut shared, mut at) = (Vec::new(), 0);
    for (local, &node) in one.nodes.iter().enumerate() {
        while other.nodes.get(at).is_some_and(|&o| o < node) {
            at += 1;
        }
        if other.nodes.get(at) == Some(&node) {
            shared.push([local as u32, at as u32]);
        }
    }
    shared
}

/// Whether points do not lie on one line.
fn is_face(points: &[[f64; 3]]) -> bool {
    let [[a, b, c], [_, d, e], [.., f]] = inertia(points).1;
    let determinant = a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d);
    determinant > SPREAD * (a + d + f).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{on_ranks, two_bricks};

    #[test]
    fn lines_are_no_faces() {
        let line = [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8, 0.9], [1.0, 1.1, 1.2]];
        assert!(!is_face(&line[..1]) && !is_face(&line[..2]) && !is_face(&line));
        assert!(is_face(&[line[0], line[1], [0.1, 0.2, 0.9]]));
    }

    /// Rows of random members: rigid motions of all together meet them, those of one alone do not; boxes have bonds alike.
    #[test]
    fn rows_hold_members_together_and_leave_the_whole_free() {
        let cells = ["body.lower.brick.cells=[8, 4, 4]", "decomposition.cells=[2, 2, 2]", "decomposition.cluster=8"];
        on_ranks(&two_bricks(&cells), 1, |setup| {
            let mut kinds = Kinds::default();
            let clusters: Vec<_> = setup.discrete.decomposition.clusters.of_rank(0).collect();
            for members in clusters.clone() {
                let subdomains = &setup.subdomains()[members];
                let bonds = kinds.bonds(subdomains);
                let points: Vec<[f64; 3]> = subdomains.iter().flat_map(|s| s.points.iter().copied()).collect();
                let modes = RigidModes::new(&points);
                for k in 0..MODES {
                    let (mut jump, mut size) = (vec![0.0; bonds.rows], vec![0.0_f64; bonds.rows]);
                    for (subdomain, member) in subdomains.iter().zip(&bonds.members) {
                        let u: Vec<f64> =
                            subdomain.points.iter().flat_map(|&p| modes.at(p)).map(|row| row[k]).collect();
                        for of_row in &member.jumps {
                            jump[of_row.row] += of_row.of(&u);
                            size[of_row.row] = size[of_row.row].max(of_row.modes.iter().map(|m| m.abs()).sum());
                        }
                    }
                    assert!(jump.iter().all(|x| x.abs() < 1e-14), "{jump:?}");
                    assert!(size.iter().all(|x| *x > 0.1), "{size:?}");
                }
                if subdomains.len() == 8 {
                    assert_eq!(bonds.rows, 72);
                }
            }
            assert!(kinds.0.len() < clusters.len(), "{} of {}", kinds.0.len(), clusters.len());
        });
    }
}
