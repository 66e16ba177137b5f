//! The mesh and the fields of a result file.

use std::collections::BTreeMap;
use std::path::Path;

use hdf5_metno::{Dataset, File, H5Type};

/// What closed forms are met to.
pub const EXACT: f64 = 1e-10;

/// All pieces of a result file, one behind the other, at one time.
pub struct Fields {
    file: File,
    /// Which of the times.
    time: usize,
    pub points: Vec<[f64; 3]>,
    pub displacement: Vec<[f64; 3]>,
    /// Corners of the elements, as indices into the points.
    pub elements: Vec<Vec<usize>>,
}

impl Fields {
    /// The only state of a file.
    pub fn read(path: &Path) -> Fields {
        assert_eq!(Fields::times(path), None, "a time series");
        Fields::at(path, 0)
    }

    /// The times of a series.
    pub fn times(path: &Path) -> Option<Vec<f64>> {
        let steps = File::open(path).unwrap().dataset("VTKHDF/Steps/Values").ok()?;
        Some(steps.read_raw().unwrap())
    }

    /// The state at one of the times.
    pub fn at(path: &Path, time: usize) -> Fields {
        let file = File::open(path).unwrap();
        let numbers = |name: &str| file.dataset(&format!("VTKHDF/{name}")).unwrap().read_raw::<i64>().unwrap();
        let vectors = |name: &str| {
            let raw = file.dataset(&format!("VTKHDF/{name}")).unwrap().read_raw::<f64>().unwrap();
            raw.as_chunks::<3>().0.to_vec()
        };
        // Every piece counts its own points and entries.
        let mut elements = Vec::new();
        let (connectivity, offsets) = (numbers("Connectivity"), numbers("Offsets"));
        let (mut first_point, mut entries, mut offsets) = (0, &connectivity[..], &offsets[..]);
        for (points, cells) in numbers("NumberOfPoints").into_iter().zip(numbers("NumberOfCells")) {
            let ends = &offsets[..=cells as usize];
            let place = |point: &i64| (first_point + point) as usize;
            elements.extend(ends.windows(2).map(|e| entries[e[0] as usize..e[1] as usize].iter().map(place).collect()));
            first_point += points;
            (entries, offsets) = (&entries[ends[cells as usize] as usize..], &offsets[cells as usize + 1..]);
        }
        Fields {
            points: vectors("Points"),
            displacement: state(&file, time, "Point", "displacement").as_chunks::<3>().0.to_vec(),
            elements,
            file,
            time,
        }
    }

    /// A field of one real number a point.
    pub fn of_points(&self, name: &str) -> Vec<f64> {
        state(&self.file, self.time, "Point", name)
    }

    /// A field of one integer a point.
    pub fn integers_of_points(&self, name: &str) -> Vec<i64> {
        state(&self.file, self.time, "Point", name)
    }

    /// A field of one real number an element.
    pub fn of_elements(&self, name: &str) -> Vec<f64> {
        state(&self.file, self.time, "Cell", name)
    }

    /// A field of one integer an element.
    pub fn integers_of_elements(&self, name: &str) -> Vec<i64> {
        state(&self.file, self.time, "Cell", name)
    }

    /// Body number of each point.
    pub fn body_of_points(&self) -> Vec<i64> {
        let mut bodies = vec![-1; self.points.len()];
        for (element, body) in self.elements.iter().zip(self.integers_of_elements("body")) {
            element.iter().for_each(|&point| bodies[point] = body);
        }
        bodies
    }

    /// Cells of each piece, one piece a rank.
    pub fn cells_of_pieces(&self) -> Vec<i64> {
        self.file.dataset("VTKHDF/NumberOfCells").unwrap().read_raw().unwrap()
    }

    /// The bits of every dataset of these groups, by name; integers and reals alike take 8 bytes.
    pub fn bits(&self, groups: &[&str]) -> Vec<(String, Vec<u64>)> {
        let mut all = Vec::new();
        for group in groups {
            for name in self.file.group(group).unwrap().member_names().unwrap() {
                let path = format!("{group}/{name}");
                let bits = bits(&self.file.dataset(&path).unwrap());
                all.push((path, bits));
            }
        }
        all
    }
}

/// The rows of a field of points or cells at a time.
fn state<T: H5Type + Clone>(file: &File, time: usize, of: &str, name: &str) -> Vec<T> {
    let dataset = file.dataset(&format!("VTKHDF/{of}Data/{name}")).unwrap();
    let width = dataset.shape().get(1).copied().unwrap_or(1);
    let all = dataset.read_raw().unwrap();
    let Ok(offsets) = file.dataset(&format!("VTKHDF/Steps/{of}DataOffsets/{name}")) else { return all };
    let begin = offsets.read_raw::<i64>().unwrap()[time] as usize;
    let counts = file.dataset(&format!("VTKHDF/NumberOf{of}s")).unwrap().read_raw::<i64>().unwrap();
    let rows = counts.iter().sum::<i64>() as usize;
    all[begin * width..][..rows * width].to_vec()
}

fn bits(dataset: &Dataset) -> Vec<u64> {
    if dataset.dtype().unwrap().is::<i64>() {
        dataset.read_raw::<i64>().unwrap().into_iter().map(i64::cast_unsigned).collect()
    } else {
        dataset.read_raw::<f64>().unwrap().into_iter().map(f64::to_bits).collect()
    }
}

/// Displacements by node, stress and plastic strain by the nodes of an element.
pub type State = (BTreeMap<i64, [f64; 3]>, BTreeMap<Vec<i64>, [f64; 2]>);

/// The state at one of the times of a file, whatever its subdomains.
pub fn state_at(path: &Path, time: usize) -> State {
    let fields = Fields::at(path, time);
    let nodes = fields.integers_of_points("node");
    let (stress, kappa) = (fields.of_elements("von_mises"), fields.of_elements("equivalent_plastic_strain"));
    let states = stress.into_iter().zip(kappa).map(|(stress, kappa)| [stress, kappa]);
    let elements = fields.elements.iter().map(|element| element.iter().map(|&point| nodes[point]).collect());
    (nodes.iter().copied().zip(fields.displacement).collect(), elements.zip(states).collect())
}

/// Largest difference of values with the same key, relative to the largest value, by component.
pub fn difference<K: Ord, const N: usize>(a: &BTreeMap<K, [f64; N]>, b: &BTreeMap<K, [f64; N]>) -> f64 {
    assert!(a.keys().eq(b.keys()) && !a.is_empty());
    let differences = (0..N).map(|k| {
        let size = b.values().fold(0.0_f64, |size, value| size.max(value[k].abs()));
        a.values().zip(b.values()).fold(0.0_f64, |worst, (a, b)| worst.max((a[k] - b[k]).abs())) / size
    });
    differences.fold(0.0, f64::max)
}

/// Fails unless every value is the expected one, relative to `scale`.
#[track_caller]
pub fn assert_uniform(what: &str, values: impl IntoIterator<Item = f64>, expected: f64, scale: f64) {
    let errors = values.into_iter().map(|value| ((value - expected) / scale).abs());
    let worst = errors.fold(0.0, |a, b| if b.is_nan() || b > a { b } else { a });
    assert!(worst <= EXACT, "{what}: relative error {worst:.2e} against {expected}");
}

/// Fails unless every node has the displacement that `exact` gives for it.
#[track_caller]
pub fn assert_displacement(fields: &Fields, exact: impl Fn(usize) -> [f64; 3]) {
    let expected: Vec<[f64; 3]> = (0..fields.points.len()).map(exact).collect();
    let size = expected.as_flattened().iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    for axis in 0..3 {
        let errors = fields.displacement.iter().zip(&expected).map(|(u, exact)| u[axis] - exact[axis]);
        assert_uniform(&format!("displacement along axis {axis}"), errors, 0.0, size);
    }
}
