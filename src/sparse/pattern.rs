//! Sparsity of a subdomain's stiffness matrix: lower triangle by columns, in blocks of 3x3 a pair of nodes.
//!
//! Depends on the connectivity only, so congruent subdomains share one.

use crate::mesh::Elements;
use crate::work;

/// Bytes of an entry: its value and its row.
const ENTRY: usize = size_of::<f64>() + size_of::<u32>();

/// Lower triangle by columns, diagonal first; entries of one node lie together in every column.
#[derive(Debug, PartialEq, Eq)]
pub struct Pattern {
    /// First entry of each column, and the end.
    pub column_begin: Vec<u32>,
    /// Row of each entry, ascending within a column.
    pub rows: Vec<u32>,
    /// Adjacency of the nodes (without themselves), as METIS wants it: begins and neighbours.
    pub adjacency: (Vec<i32>, Vec<i32>),
}

impl Pattern {
    /// Of elements on `nodes` nodes, with all nodes of `clique` coupled besides.
    pub fn new(nodes: usize, elements: &Elements, clique: &[u32]) -> Self {
        // One number a pair: these are sorted faster.
        let among = |nodes| pairs(nodes).filter(|(a, b)| a != b).map(|(a, b)| u64::from(a) << 32 | u64::from(b));
        let mut pairs: Vec<u64> = elements.iter().chain([clique]).flat_map(among).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut begins = vec![0; nodes + 1];
        for &pair in &pairs {
            begins[(pair >> 32) as usize + 1] += 1;
        }
        for a in 0..nodes {
            begins[a + 1] += begins[a];
        }
        let neighbours: Vec<i32> = pairs.iter().map(|&pair| pair as u32 as i32).collect();

        let mut column_begin = vec![0];
        let mut rows = Vec::new();
        for node in 0..nodes {
            let others = &neighbours[begins[node] as usize..begins[node + 1] as usize];
            for axis in 0..3 {
                rows.extend((axis..3).map(|i| 3 * node as u32 + i as u32));
                for &below in others.iter().filter(|&&b| b as usize > node) {
                    rows.extend((0..3).map(|i| 3 * below as u32 + i));
                }
                column_begin.push(rows.len() as u32);
            }
        }
        Self { column_begin, rows, adjacency: (begins, neighbours) }
    }

    /// Number of unknowns.
    pub fn dofs(&self) -> usize {
        self.column_begin.len() - 1
    }

    /// Position of the block of nodes `(row, column)`, `row > column`, within each of the column's three columns: entry
    /// `(3 row + i, 3 column + j)` is at `column_begin[3 column + j] + offset - j + i`.
    pub fn block_offset(&self, row: u32, column: u32) -> usize {
        let begin = self.column_begin[3 * column as usize] as usize;
        let end = self.column_begin[3 * column as usize + 1] as usize;
        let mut blocks = self.rows[begin..end].chunks_exact(3);
        3 * blocks.position(|block| block[0] == 3 * row).expect("the pair of nodes is in the pattern")
    }

    /// Adds a 3x3 block `[i][j]` of nodes `(row, column)` to the lower triangle's values; of a diagonal block the lower
    /// part counts.
    #[inline]
    pub fn add_block(&self, values: &mut [f64], row: u32, column: u32, block: &[[f64; 3]; 3]) {
        let columns = &self.column_begin[3 * column as usize..3 * column as usize + 3];
        if row == column {
            for (j, &begin) in columns.iter().enumerate() {
                (j..3).for_each(|i| values[begin as usize + i - j] += block[i][j]);
            }
        } else {
            let offset = self.block_offset(row, column);
            for (j, &begin) in columns.iter().enumerate() {
                let at = begin as usize + offset - j;
                values[at..at + 3].iter_mut().zip(block).for_each(|(value, row)| *value += row[j]);
            }
        }
    }

    /// `y += A x` for the symmetric matrix with these lower values.
    pub fn multiply_add(&self, values: &[f64], x: &[f64], y: &mut [f64]) {
        work::each(self.rows.len(), 4, ENTRY);
        for column in 0..self.dofs() {
            let range = self.column_begin[column] as usize..self.column_begin[column + 1] as usize;
            let (rows, entries) = (&self.rows[range.clone()], &values[range]);
            let mut sum = entries[0] * x[column];
            let xc = x[column];
            for (&row, &value) in rows[1..].iter().zip(&entries[1..]) {
                y[row as usize] += value * xc;
                sum += value * x[row as usize];
            }
            y[column] += sum;
        }
    }

    /// The largest difference of two matrices' entries, relative to the geometric mean of the first one's diagonals; NaN if
    /// one is not finite.
    pub fn difference(&self, values: &[f64], others: &[f64]) -> f64 {
        work::each(self.rows.len(), 5, 2 * ENTRY);
        let diagonal = self.diagonal(values);
        let mut largest = 0.0;
        for column in 0..self.dofs() {
            let range = self.column_begin[column] as usize..self.column_begin[column + 1] as usize;
            let entries = values[range.clone()].iter().zip(&others[range.clone()]);
            for (&row, (a, b)) in self.rows[range].iter().zip(entries) {
                let square = (a - b) * (a - b) / (diagonal[column] * diagonal[row as usize]);
                if square > largest || square.is_nan() {
                    largest = square;
                }
            }
        }
        largest.sqrt()
    }

    /// An entry of the symmetric matrix with these lower values; zero outside of the pattern.
    pub fn value(&self, values: &[f64], row: u32, column: u32) -> f64 {
        let (row, column) = (row.max(column), row.min(column) as usize);
        let begin = self.column_begin[column] as usize;
        let rows = &self.rows[begin..self.column_begin[column + 1] as usize];
        rows.binary_search(&row).map_or(0.0, |at| values[begin + at])
    }

    /// Sets to zero what couples some unknowns, ascending, to each other and to the rest.
    pub fn uncouple(&self, unknowns: &[u32], values: &mut [f64]) {
        let is_one = |dof: u32| unknowns.binary_search(&dof).is_ok();
        for column in 0..self.dofs() as u32 {
            let range = self.column_begin[column as usize] as usize..self.column_begin[column as usize + 1] as usize;
            let all = is_one(column);
            for (&row, value) in self.rows[range.clone()].iter().zip(&mut values[range]) {
                if row != column && (all || is_one(row)) {
                    *value = 0.0;
                }
            }
        }
    }

    /// The diagonal of the matrix with these values.
    pub fn diagonal(&self, values: &[f64]) -> Vec<f64> {
        (0..self.dofs()).map(|c| values[self.column_begin[c] as usize]).collect()
    }
}

/// All pairs of some nodes.
fn pairs(nodes: &[u32]) -> impl Iterator<Item = (u32, u32)> {
    nodes.iter().flat_map(move |&a| nodes.iter().map(move |&b| (a, b)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::Kind;
    use crate::fixture::dense;

    fn tets(nodes: &[[u32; 4]]) -> Elements {
        Elements::new(Kind::Tet4, nodes.concat())
    }

    #[test]
    fn entries_are_those_of_the_matrix_on_both_sides_of_the_diagonal() {
        let pattern = Pattern::new(6, &tets(&[[0, 1, 2, 3], [1, 2, 3, 5]]), &[]);
        let values: Vec<f64> = (1..=pattern.rows.len()).map(|k| k as f64).collect();
        let matrix = dense(&pattern, &values);
        for (row, column) in (0..18).flat_map(|row| (0..18).map(move |column| (row, column))) {
            assert_eq!(pattern.value(&values, row, column), matrix[(row as usize, column as usize)]);
        }
    }

    #[test]
    fn differences_count_relative_to_the_diagonal() {
        let pattern = Pattern::new(4, &tets(&[[0, 1, 2, 3]]), &[]);
        let mut values = vec![0.0; pattern.rows.len()];
        let block = |s: f64| [[s, 0.0, 0.0], [0.0, s, 0.0], [0.0, 0.0, s]];
        (0..4).for_each(|n| pattern.add_block(&mut values, n, n, &block(if n == 3 { 100.0 } else { 1.0 })));
        let mut others = values.clone();
        // The diagonals are 1 and 100: 0.5 is a share of 0.05.
        pattern.add_block(&mut others, 3, 1, &block(0.5));
        assert!((pattern.difference(&values, &others) - 0.05).abs() < 1e-15);
        others[0] = f64::NAN;
        assert!(pattern.difference(&values, &others).is_nan());
    }

    #[test]
    fn blocks_land_where_they_belong() {
        let pattern = Pattern::new(5, &tets(&[[0, 1, 2, 3], [1, 2, 3, 4]]), &[0, 4]);
        // All pairs but (0, 4), which the clique adds: full lower triangle.
        assert_eq!(pattern.rows.len(), 15 * 16 / 2);
        let mut values = vec![0.0; pattern.rows.len()];
        let block = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]];
        pattern.add_block(&mut values, 4, 1, &block);
        pattern.add_block(&mut values, 2, 2, &[[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]]);
        for j in 0..15 {
            let mut unit = vec![0.0; 15];
            unit[j] = 1.0;
            let mut y = vec![0.0; 15];
            pattern.multiply_add(&values, &unit, &mut y);
            for (i, &value) in y.iter().enumerate() {
                let expected = match (i / 3, j / 3) {
                    (4, 1) => block[i % 3][j % 3],
                    (1, 4) => block[j % 3][i % 3],
                    (2, 2) => [[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]][i % 3][j % 3],
                    _ => 0.0,
                };
                assert_eq!(value, expected, "({i}, {j})");
            }
        }
    }
}
