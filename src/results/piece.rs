//! One rank's part of the results: a mesh and the fields on it.
//!
//! Numbering is the piece's own: connectivity counts from the piece's first point. The mesh stays, fields may change from
//! one time to the next. No field is interpreted here.

use crate::comm::{Comm, all_gather_u64};

/// An unstructured mesh with fields; a rank that owns nothing has no points and no cells, but the same fields.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Piece {
    /// Coordinates, in the scene's length unit.
    pub points: Vec<[f64; 3]>,
    /// Point numbers, cell after cell.
    pub connectivity: Vec<u64>,
    /// Where each cell begins in `connectivity`, and where the last one ends: cells + 1 numbers, the first is 0.
    pub offsets: Vec<u64>,
    /// VTK's type of each cell: 10 tetrahedron, 12 hexahedron, 24 quadratic tetrahedron.
    pub types: Vec<u8>,
    /// When the states of the fields were recorded, ascending.
    pub times: Vec<f64>,
    /// Fields with one row a point.
    pub point_data: Vec<Field>,
    /// Fields with one row a cell.
    pub cell_data: Vec<Field>,
}

/// A named field with `components` numbers a row.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// What ParaView shows.
    pub name: String,
    /// Numbers a row.
    pub components: usize,
    /// Row after row: one state, which is that of all times, or one a time.
    pub states: Vec<Values>,
}

/// The numbers of a field.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Measured quantities.
    Real(Vec<f64>),
    /// Numbers of things: subdomains, ranks.
    Integer(Vec<i64>),
}

impl Field {
    /// A field of one real number a row.
    pub fn scalar(name: &str, values: Vec<f64>) -> Self {
        Self { name: name.into(), components: 1, states: vec![Values::Real(values)] }
    }

    /// A field of three real numbers a row.
    pub fn vector(name: &str, values: &[[f64; 3]]) -> Self {
        Self { name: name.into(), components: 3, states: vec![Values::Real(values.as_flattened().to_vec())] }
    }

    /// A field of `components` numbers a row.
    pub fn of(name: &str, components: usize, values: Values) -> Self {
        Self { name: name.into(), components, states: vec![values] }
    }

    /// A field of one integer a row.
    pub fn integer(name: &str, values: Vec<i64>) -> Self {
        Self { name: name.into(), components: 1, states: vec![Values::Integer(values)] }
    }
}

impl Piece {
    /// Real numbers of a field of points or of cells at the last time; `None` if there is no such field.
    pub fn last(&self, name: &str) -> Option<&[f64]> {
        let field = self.point_data.iter().chain(&self.cell_data).find(|field| field.name == name)?;
        field.states.last()?.real()
    }
}

impl Field {
    /// All ranks' rows one behind the other, on every rank. Collective; all ranks have the same states.
    pub(super) fn gather(&self, comm: &dyn Comm) -> Self {
        let states = self.states.iter().map(|state| match state {
            Values::Real(values) => {
                let bits: Vec<u64> = values.iter().map(|x| x.to_bits()).collect();
                Values::Real(all_gather_u64(comm, &bits).into_iter().map(f64::from_bits).collect())
            }
            Values::Integer(values) => {
                let bits: Vec<u64> = values.iter().map(|i| i.cast_unsigned()).collect();
                Values::Integer(all_gather_u64(comm, &bits).into_iter().map(u64::cast_signed).collect())
            }
        });
        Self { name: self.name.clone(), components: self.components, states: states.collect() }
    }

    fn kind(&self) -> &'static str {
        self.states.first().map_or("empty", Values::kind)
    }
}

impl Values {
    /// How many.
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Real(values) => values.len(),
            Self::Integer(values) => values.len(),
        }
    }

    /// The numbers, if they are real.
    pub fn real(&self) -> Option<&[f64]> {
        match self {
            Self::Real(values) => Some(values),
            Self::Integer(_) => None,
        }
    }

    /// The numbers, if they are integers.
    pub fn integer(&self) -> Option<&[i64]> {
        match self {
            Self::Real(_) => None,
            Self::Integer(values) => Some(values),
        }
    }

    fn kind(&self) -> &'static str {
        match self {
            Self::Real(_) => "real",
            Self::Integer(_) => "integer",
        }
    }
}

impl Piece {
    /// Numbers of points, cells and connectivity entries.
    pub fn sizes(&self) -> [usize; 3] {
        [self.points.len(), self.types.len(), self.connectivity.len()]
    }

    /// Bytes that the arrays take in a file, and a little more.
    pub fn bytes(&self) -> u64 {
        const DESCRIPTIONS: usize = 4096;
        let fields: usize =
            self.point_data.iter().chain(&self.cell_data).flat_map(|field| &field.states).map(Values::len).sum();
        let numbers = 3 * self.points.len() + self.connectivity.len() + self.offsets.len() + fields;
        (8 * numbers + self.types.len() + DESCRIPTIONS) as u64
    }

    /// Names, widths and kinds of all fields: the same text on every rank.
    pub fn layout(&self) -> String {
        let describe = |f: &Field| format!("{} ({} {} x {})", f.name, f.components, f.kind(), f.states.len());
        let list = |fields: &[Field]| fields.iter().map(describe).collect::<Vec<_>>().join(", ");
        format!("{} times; points: {}; cells: {}", self.times.len(), list(&self.point_data), list(&self.cell_data))
    }

    /// Adds the states that fields have at a time.
    pub fn record(&mut self, time: f64, point_data: Vec<Field>, cell_data: Vec<Field>) {
        self.times.push(time);
        for (fields, new) in [(&mut self.point_data, point_data), (&mut self.cell_data, cell_data)] {
            for field in new {
                match fields.iter_mut().find(|known| known.name == field.name) {
                    Some(known) => known.states.extend(field.states),
                    None => fields.push(field),
                }
            }
        }
    }

    /// Whether the arrays belong together.
    ///
    /// # Errors
    /// The first thing that does not fit, with its numbers.
    pub fn check(&self) -> Result<(), String> {
        let [points, cells, entries] = self.sizes();
        if self.offsets.len() != cells + 1 || self.offsets[0] != 0 || self.offsets[cells] != entries as u64 {
            return Err(format!("{} offsets for {cells} cells with {entries} entries", self.offsets.len()));
        }
        if let Some(cell) = self.offsets.windows(2).position(|pair| pair[0] > pair[1]) {
            return Err(format!("the offsets decrease at cell {cell}"));
        }
        if let Some(point) = self.connectivity.iter().find(|&&point| point >= points as u64) {
            return Err(format!("a cell refers to point {point} of {points}"));
        }
        let fields = self.point_data.iter().map(|f| (f, points)).chain(self.cell_data.iter().map(|f| (f, cells)));
        for (field, rows) in fields {
            let (name, width, states) = (&field.name, field.components, field.states.len());
            if states != 1 && states != self.times.len() {
                return Err(format!("field {name} has {states} states at {} times", self.times.len()));
            }
            if let Some(wrong) = field.states.iter().find(|s| width == 0 || s.len() != rows * width) {
                return Err(format!("field {name} has {} values for {rows} rows of {width}", wrong.len()));
            }
            if field.states.iter().any(|state| state.kind() != field.kind()) {
                return Err(format!("field {name} has real and integer states"));
            }
        }
        Ok(())
    }

    /// All ranks' pieces one behind the other, and the sizes of each, on rank 0; `None` elsewhere. Collective; all
    /// ranks have the same layout.
    pub fn gather(&self, comm: &dyn Comm) -> Option<(Self, Vec<[usize; 3]>)> {
        let mut outgoing = vec![Vec::new(); comm.size()];
        outgoing[0] = self.pack();
        let incoming = comm.all_to_all(outgoing);
        if comm.rank() > 0 {
            return None;
        }
        let mut whole = Self { offsets: Vec::new(), ..self.emptied() };
        let sizes = incoming.into_iter().map(|packed| whole.append(packed.into_iter())).collect();
        Some((whole, sizes))
    }

    /// The same fields without rows.
    fn emptied(&self) -> Self {
        let no_values = |values: &Values| match values {
            Values::Real(_) => Values::Real(Vec::new()),
            Values::Integer(_) => Values::Integer(Vec::new()),
        };
        let empty = |fields: &[Field]| -> Vec<Field> {
            let states = |f: &Field| f.states.iter().map(no_values).collect();
            fields.iter().map(|f| Field { name: f.name.clone(), components: f.components, states: states(f) }).collect()
        };
        let (point_data, cell_data) = (empty(&self.point_data), empty(&self.cell_data));
        Self { times: self.times.clone(), point_data, cell_data, ..Self::default() }
    }

    /// Everything but names as one row of numbers, bit by bit.
    fn pack(&self) -> Vec<u64> {
        let mut packed: Vec<u64> = self.sizes().map(|n| n as u64).to_vec();
        packed.extend(self.points.as_flattened().iter().map(|x| x.to_bits()));
        packed.extend(&self.connectivity);
        packed.extend(&self.offsets);
        packed.extend(self.types.iter().map(|&t| u64::from(t)));
        for values in self.point_data.iter().chain(&self.cell_data).flat_map(|field| &field.states) {
            match values {
                Values::Real(values) => packed.extend(values.iter().map(|x| x.to_bits())),
                Values::Integer(values) => packed.extend(values.iter().map(|&i| i as u64)),
            }
        }
        packed
    }

    /// Appends a packed piece; returns its sizes.
    fn append(&mut self, mut packed: impl Iterator<Item = u64>) -> [usize; 3] {
        let sizes = [(); 3].map(|()| packed.next().unwrap_or_default() as usize);
        let [points, cells, entries] = sizes;
        self.points.extend((0..points).map(|_| [(); 3].map(|()| f64::from_bits(packed.next().unwrap_or_default()))));
        self.connectivity.extend(packed.by_ref().take(entries));
        self.offsets.extend(packed.by_ref().take(cells + 1));
        self.types.extend(packed.by_ref().take(cells).map(|t| t as u8));
        let fields = self.point_data.iter_mut().map(|f| (f, points));
        for (field, rows) in fields.chain(self.cell_data.iter_mut().map(|f| (f, cells))) {
            for state in &mut field.states {
                let numbers = packed.by_ref().take(rows * field.components);
                match state {
                    Values::Real(values) => values.extend(numbers.map(f64::from_bits)),
                    Values::Integer(values) => values.extend(numbers.map(|i| i as i64)),
                }
            }
        }
        sizes
    }
}
