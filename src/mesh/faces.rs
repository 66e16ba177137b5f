//! Which tetrahedra share a face.
//!
//! Faces are sorted into one bucket for each smallest node, so nothing but their numbers is stored: 16 bytes an element
//! while they are paired, as many for the result.

/// Faces of a positively oriented tetrahedron, counter-clockwise from outside.
pub const TET_FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

/// In place of a neighbour: the face belongs to one tetrahedron only.
pub const OUTSIDE: u32 = u32::MAX;

/// Neighbours of the tetrahedra of a mesh.
pub struct Neighbours {
    /// For each tetrahedron and each of its [`TET_FACES`] the tetrahedron behind, or [`OUTSIDE`].
    pub behind: Vec<[u32; 4]>,
    /// Faces with more than two tetrahedra, or two on the same side: the mesh overlaps itself. Nobody is behind them.
    pub overlapping: u64,
}

impl Neighbours {
    /// Pairs up the faces of at most 2^30 tetrahedra on nodes `0..nodes`.
    pub fn new(nodes: usize, tets: &[[u32; 4]]) -> Self {
        let mut begin = vec![0_u32; nodes + 1];
        let faces = || (0..4 * tets.len() as u32).map(|id| (id, key(face(tets, id))));
        faces().for_each(|(_, key)| begin[key[0] as usize + 1] += 1);
        (0..nodes).for_each(|n| begin[n + 1] += begin[n]);
        let mut ids = vec![0; 4 * tets.len()];
        let mut next = begin.clone();
        for (id, [node, ..]) in faces() {
            ids[next[node as usize] as usize] = id;
            next[node as usize] += 1;
        }

        let mut neighbours = Self { behind: vec![[OUTSIDE; 4]; tets.len()], overlapping: 0 };
        let mut bucket = Vec::new();
        for range in begin.windows(2) {
            bucket.clear();
            bucket.extend(ids[range[0] as usize..range[1] as usize].iter().map(|&id| (key(face(tets, id)), id)));
            bucket.sort_unstable();
            for same in bucket.chunk_by(|a, b| a.0 == b.0) {
                match *same {
                    [_] => {}
                    [(_, a), (_, b)] if turns(face(tets, a)) != turns(face(tets, b)) => {
                        neighbours.behind[a as usize / 4][a as usize % 4] = b / 4;
                        neighbours.behind[b as usize / 4][b as usize % 4] = a / 4;
                    }
                    _ => neighbours.overlapping += 1,
                }
            }
        }
        neighbours
    }

    /// Faces that belong to one tetrahedron only, counter-clockwise from outside, in the order of the tetrahedra.
    pub fn outer<'a>(&'a self, tets: &'a [[u32; 4]]) -> impl Iterator<Item = [u32; 3]> + 'a {
        (0..4 * tets.len() as u32).filter(|&id| self.behind(id) == OUTSIDE).map(|id| face(tets, id))
    }

    /// Faces between two tetrahedra, once each.
    pub fn inner<'a>(&'a self, tets: &'a [[u32; 4]]) -> impl Iterator<Item = [u32; 3]> + 'a {
        let first = |id: &u32| self.behind(*id) != OUTSIDE && id / 4 < self.behind(*id);
        (0..4 * tets.len() as u32).filter(first).map(|id| face(tets, id))
    }

    fn behind(&self, id: u32) -> u32 {
        self.behind[id as usize / 4][id as usize % 4]
    }
}

/// A face in ascending order of its nodes.
pub fn key(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

/// Whether the nodes of a face are an odd permutation of their ascending order.
fn turns([a, b, c]: [u32; 3]) -> bool {
    (a > b) ^ (b > c) ^ (a > c)
}

/// Face number `id`: four a tetrahedron.
fn face(tets: &[[u32; 4]], id: u32) -> [u32; 3] {
    TET_FACES[id as usize % 4].map(|corner| tets[id as usize / 4][corner])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Brick, Face, brick};

    fn tets(brick: &Brick) -> Vec<[u32; 4]> {
        brick::indices(&brick.all_cells()).flat_map(|cell| brick.tets(cell)).map(|tet| tet.map(|n| n as u32)).collect()
    }

    #[test]
    fn the_outside_of_a_brick_are_its_faces_and_neighbours_share_three_nodes() {
        let brick = Brick { origin: [0.0; 3], size: [1.0; 3], cells: [3, 2, 2] };
        let tets = tets(&brick);
        let neighbours = Neighbours::new(brick.node_count() as usize, &tets);
        assert_eq!(neighbours.overlapping, 0);
        let turned = |t: [u32; 3]| (0..3).map(|k| [t[k], t[(k + 1) % 3], t[(k + 2) % 3]]).min();
        let mut outer: Vec<_> = neighbours.outer(&tets).map(turned).collect();
        let of_brick = Face::ALL.into_iter().flat_map(|face| brick.triangles_on(face).collect::<Vec<_>>());
        let mut expected: Vec<_> = of_brick.map(|t| turned(t.map(|n| n as u32))).collect();
        outer.sort();
        expected.sort();
        assert_eq!(outer, expected, "sense of rotation included");
        for (tet, behind) in neighbours.behind.iter().enumerate() {
            for other in behind.iter().filter(|&&o| o != OUTSIDE).map(|&o| o as usize) {
                assert_eq!(tets[tet].iter().filter(|n| tets[other].contains(n)).count(), 3);
                assert!(neighbours.behind[other].contains(&(tet as u32)));
            }
        }
    }

    #[test]
    fn an_edge_is_no_face_and_faces_with_two_elements_on_a_side_overlap() {
        let count = |tets: &[[u32; 4]]| {
            let neighbours = Neighbours::new(6, tets);
            (neighbours.overlapping, neighbours.behind.as_flattened().iter().filter(|&&o| o != OUTSIDE).count())
        };
        assert_eq!(count(&[[0, 1, 2, 3], [0, 1, 4, 5]]), (0, 0));
        assert_eq!(count(&[[0, 1, 2, 3], [0, 2, 1, 4]]), (0, 2));
        assert_eq!(count(&[[0, 1, 2, 3], [0, 2, 1, 4], [0, 1, 2, 5]]), (1, 0));
        assert_eq!(count(&[[0, 1, 2, 3], [0, 1, 2, 4]]), (1, 0));
        assert_eq!(count(&[[0, 1, 2, 3], [1, 2, 0, 3]]), (4, 0));
    }
}
