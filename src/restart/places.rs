//! Rows of a file where they belong on own subdomains, however those of the file were cut.
//!
//! Nodes go by their numbers, elements by their first four nodes, which tell them apart. Every rank looks through all rows, a
//! block at a time, and keeps its own.

use std::collections::HashMap;
use std::ops::Range;

use crate::decomposition::Subdomain;
use crate::material::{History, Variables, history};
use crate::results::hdf5::{Number, SharedFile};

/// Rows that are read at once.
const BLOCK: u64 = 1 << 16;

/// What tells an element from others of its mesh.
pub(super) fn key(element: &[u32], nodes: &[u64]) -> [i64; 4] {
    std::array::from_fn(|k| nodes[element[k] as usize] as i64)
}

/// The rows that a rank wants of arrays of so many rows a state, ascending, and the place of each here.
pub(super) struct Wanted<P> {
    total: u64,
    rows: Vec<u64>,
    places: Vec<P>,
}

impl<P: Copy> Wanted<P> {
    /// These.
    pub fn new(total: u64, found: impl Iterator<Item = (u64, P)>) -> Self {
        let (rows, places) = found.unzip();
        Self { total, rows, places }
    }

    /// The rows of an array of `N` integers each that have a place here. Collective.
    ///
    /// # Errors
    /// If it cannot be read; the same on every rank.
    pub fn find<const N: usize>(
        file: &SharedFile,
        name: &str,
        place: impl Fn([i64; N]) -> Option<P>,
    ) -> Result<Self, String> {
        let mut found = Self { total: file.count(name)?, rows: Vec::new(), places: Vec::new() };
        for block in blocks(found.total) {
            let keys = file.read::<i64>(name, block.start, block.end - block.start)?;
            let places = keys.as_chunks::<N>().0.iter().map(|key| place(*key));
            for (row, place) in block.zip(places).filter_map(|(row, place)| Some((row, place?))) {
                found.rows.push(row);
                found.places.push(place);
            }
        }
        Ok(found)
    }

    /// Rows that a state of the arrays has, those of all ranks.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// The rows and their places.
    pub fn rows(&self) -> impl Iterator<Item = (u64, P)> + '_ {
        self.rows.iter().copied().zip(self.places.iter().copied())
    }

    /// Their numbers in one of the states of an array. Collective.
    ///
    /// # Errors
    /// If it cannot be read; the same on every rank.
    pub fn read<T: Number + Copy>(&self, file: &SharedFile, name: &str, state: u64) -> Result<Vec<T>, String> {
        let (mut found, mut rows) = (Vec::new(), &self.rows[..]);
        for block in blocks(self.total) {
            let count = block.end - block.start;
            let values = file.read::<T>(name, state * self.total + block.start, count)?;
            let width = values.len() / count as usize;
            let (here, beyond) = rows.split_at(rows.partition_point(|row| *row < block.end));
            for row in here {
                found.extend_from_slice(&values[width * (row - block.start) as usize..][..width]);
            }
            rows = beyond;
        }
        Ok(found)
    }
}

fn blocks(rows: u64) -> impl Iterator<Item = Range<u64>> {
    (0..rows).step_by(BLOCK as usize).map(move |begin| begin..rows.min(begin + BLOCK))
}

/// Nodes and elements of own subdomains.
pub(super) struct Places<'a> {
    subdomains: &'a [Subdomain],
    /// Numbers of the nodes, ascending, each once.
    nodes: Vec<i64>,
    /// Subdomain of an element, and its number there.
    elements: HashMap<[i64; 4], (usize, usize)>,
}

impl<'a> Places<'a> {
    /// Of those subdomains that are `taken`.
    pub fn new(subdomains: &'a [Subdomain], taken: impl Fn(&Subdomain) -> bool) -> Self {
        let (mut nodes, mut elements) = (Vec::new(), HashMap::new());
        for (k, subdomain) in subdomains.iter().enumerate().filter(|(_, subdomain)| taken(subdomain)) {
            nodes.extend(subdomain.nodes.iter().map(|&node| node as i64));
            let of_subdomain = subdomain.elements.iter().enumerate();
            elements.extend(of_subdomain.map(|(e, element)| (key(element, &subdomain.nodes), (k, e))));
        }
        nodes.sort_unstable();
        nodes.dedup();
        Self { subdomains, nodes, elements }
    }

    /// Place of a node.
    pub fn node(&self, number: i64) -> Option<usize> {
        self.nodes.binary_search(&number).ok()
    }

    /// Place of an element: subdomain, and number there.
    pub fn element(&self, key: [i64; 4]) -> Option<(usize, usize)> {
        self.elements.get(&key).copied()
    }

    /// Whether rows have all nodes.
    pub fn have_nodes(&self, rows: &Wanted<usize>) -> bool {
        let mut has = vec![false; self.nodes.len()];
        rows.places.iter().for_each(|&node| has[node] = true);
        !has.contains(&false)
    }

    /// Whether rows have all elements, each once.
    pub fn have_elements(&self, rows: &Wanted<(usize, usize)>) -> bool {
        rows.places.len() == self.elements.len()
    }

    /// Numbers at the nodes of each subdomain, `width` a node; zeros where nothing is wanted. Of several copies in the file,
    /// which differ by round-off, or in whether they know of a contact, the largest number counts. Collective.
    ///
    /// # Errors
    /// If the array cannot be read; the same on every rank.
    pub fn at_nodes<T: Number + Copy + Default + PartialOrd>(
        &self,
        file: &SharedFile,
        rows: &Wanted<usize>,
        (name, width, state): (&str, usize, u64),
    ) -> Result<Vec<Vec<T>>, String> {
        let mut values = vec![None; width * self.nodes.len()];
        for (&node, row) in rows.places.iter().zip(rows.read::<T>(file, name, state)?.chunks_exact(width)) {
            for (known, &value) in values[width * node..].iter_mut().zip(row) {
                // NaN gives way to the value of any other copy.
                let counts = |known: &T| value > *known || known.partial_cmp(known).is_none();
                if known.as_ref().is_none_or(counts) {
                    *known = Some(value);
                }
            }
        }
        let of_node = |node: &u64| {
            let known = self.node(*node as i64).map(|node| &values[width * node..]);
            (0..width).map(move |k| known.and_then(|known| known[k]).unwrap_or_default())
        };
        Ok(self.subdomains.iter().map(|subdomain| subdomain.nodes.iter().flat_map(of_node).collect()).collect())
    }

    /// Numbers of the elements of each subdomain, `width` an element; zeros where nothing is wanted. Collective.
    ///
    /// # Errors
    /// If the array cannot be read; the same on every rank.
    pub fn in_elements<T: Number + Copy + Default>(
        &self,
        file: &SharedFile,
        rows: &Wanted<(usize, usize)>,
        (name, width, state): (&str, usize, u64),
    ) -> Result<Vec<Vec<T>>, String> {
        let mut values: Vec<Vec<T>> =
            self.subdomains.iter().map(|s| vec![T::default(); width * s.elements.len()]).collect();
        for (&(k, e), row) in rows.places.iter().zip(rows.read::<T>(file, name, state)?.chunks_exact(width)) {
            values[k][width * e..][..width].copy_from_slice(row);
        }
        Ok(values)
    }

    /// Histories of each subdomain, none where nothing ever yielded, from the arrays of a group. Places are a subdomain and
    /// an integration point of it. Collective.
    ///
    /// # Errors
    /// If the arrays cannot be read; the same on every rank.
    pub fn histories(
        &self,
        file: &SharedFile,
        rows: &Wanted<(usize, usize)>,
        group: &str,
    ) -> Result<Vec<Vec<History>>, String> {
        let found = history::from_arrays(|name| rows.read::<f64>(file, &format!("{group}/{name}"), 0))?;
        let mut histories = vec![Vec::new(); self.subdomains.len()];
        for (&(k, point), history) in rows.places.iter().zip(found) {
            if history != History::VIRGIN {
                let elements = &self.subdomains[k].elements;
                histories[k].resize(elements.kind().points() * elements.len(), History::VIRGIN);
                histories[k][point] = history;
            }
        }
        Ok(histories)
    }
}
