//! The result file: a VTKHDF unstructured grid with one partition a rank, and records of the run beside it.
//!
//! Format: "VTKHDF file format", docs.vtk.org, version 2.2 (the first that allows other groups next to `/VTKHDF`),
//! read by VTK 9.3 and ParaView 5.12 or newer. Written by all ranks with collective transfers; where the ranks are not
//! MPI processes, rank 0 gathers everything and writes the same file alone.
//! Several states make a time series: the arrays of the fields that change hold one state behind the other, and the group
//! `Steps` says where each begins; the mesh is that of all times. One state has no such group.

use std::path::Path;

use super::OutputError;
use super::hdf5::SharedFile;
use super::piece::{Field, Piece};
use super::replace::replace;
use crate::comm::agree::{agree, on_root, root_texts};
use crate::comm::solo::Solo;
use crate::comm::{Comm, all_gather_u64};

/// What is kept beside the fields. Rank 0's counts.
#[derive(Clone, Debug, Default)]
pub struct Records {
    /// Group `/provenance`: one text a name.
    pub provenance: Vec<(String, String)>,
    /// Group `/convergence`: the columns of a table.
    pub convergence: Vec<(String, Vec<f64>)>,
    /// Group `/state`: what another run can start from.
    pub state: State,
    /// Group `/mesh`: names of volumes and surfaces, and the faces of these; the same names on every rank.
    pub mesh: Vec<Field>,
}

/// What the material remembers at the end of a run.
#[derive(Clone, Debug, Default)]
pub struct State {
    /// What the arrays belong to. Rank 0's counts.
    pub description: String,
    /// This rank's rows, one rank's behind the other's; the same names on every rank.
    pub arrays: Vec<Field>,
}

impl Records {
    fn bytes(&self) -> u64 {
        const DESCRIPTION: usize = 1024;
        let texts: usize = self.provenance.iter().map(|(_, text)| text.len() + DESCRIPTION).sum();
        let columns: usize = self.convergence.iter().map(|(_, column)| 8 * column.len() + DESCRIPTION).sum();
        let states = self.state.arrays.iter().chain(&self.mesh).flat_map(|field| &field.states);
        let numbers: usize = states.map(|state| 8 * state.len() + DESCRIPTION).sum();
        (texts + columns + numbers + self.state.description.len()) as u64
    }
}

/// Version of the format.
const VERSION: [i64; 2] = [2, 2];

/// Writes all ranks' pieces as one file. Collective.
///
/// # Errors
/// The same on every rank: [`OutputError::Layout`] if a piece is inconsistent or has other fields than rank 0's,
/// [`OutputError::Write`] if the file cannot be written; an earlier file of that name is untouched then.
pub fn write(comm: &dyn Comm, path: &Path, piece: &Piece, records: &Records) -> Result<(), OutputError> {
    check(comm, piece).map_err(|reason| OutputError::Layout { path: path.to_owned(), reason })?;
    let bytes = all_gather_u64(comm, &[piece.bytes() + records.bytes()]).iter().sum();
    replace(comm, path, bytes, |temporary| {
        if comm.size() == 1 || comm.raw_mpi().is_some() {
            return write_rows(comm, temporary, piece, &[piece.sizes()], records);
        }
        let gathered = piece.gather(comm);
        let arrays = records.state.arrays.iter().map(|field| field.gather(comm)).collect();
        let state = State { description: records.state.description.clone(), arrays };
        let mesh = records.mesh.iter().map(|field| field.gather(comm)).collect();
        let records = Records { state, mesh, ..records.clone() };
        on_root(comm, "writing for all ranks", || match gathered {
            Some((whole, sizes)) => write_rows(&Solo, temporary, &whole, &sizes, &records),
            None => Ok(()),
        })
    })
}

fn check(comm: &dyn Comm, piece: &Piece) -> Result<(), String> {
    agree(comm, "the piece", piece.check())?;
    let (mine, first) = (piece.layout(), root_texts(comm, [piece.layout().as_str()]).concat());
    let same = if mine == first { Ok(()) } else { Err(format!("{mine}; rank 0 has {first}")) };
    agree(comm, "the fields", same)
}

/// Writes the pieces of the given sizes that lie one behind the other in `rows`, and reads them back.
fn write_rows(
    comm: &dyn Comm,
    path: &Path,
    rows: &Piece,
    sizes: &[[usize; 3]],
    records: &Records,
) -> Result<(), String> {
    for open in [SharedFile::create, SharedFile::reopen] {
        let file = open(comm, path)?;
        put_mesh(&file, rows, sizes)?;
        for (group, fields) in [("VTKHDF/PointData", &rows.point_data), ("VTKHDF/CellData", &rows.cell_data)] {
            file.group(group)?;
            put_fields(&file, group, fields)?;
        }
        if rows.times.len() > 1 {
            put_steps(comm, &file, rows, sizes)?;
        }
        put_records(comm, &file, records)?;
        file.close()?;
    }
    Ok(())
}

fn put_mesh(file: &SharedFile, rows: &Piece, sizes: &[[usize; 3]]) -> Result<(), String> {
    file.group("VTKHDF")?;
    file.attribute("VTKHDF", "Version", &VERSION)?;
    file.text_attribute::<16>("VTKHDF", "Type", "UnstructuredGrid")?;
    for (column, name) in ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"].into_iter().enumerate() {
        let numbers: Vec<i64> = sizes.iter().map(|row| row[column] as i64).collect();
        file.rows(&format!("VTKHDF/{name}"), 1, &numbers)?;
    }
    file.rows("VTKHDF/Points", 3, rows.points.as_flattened())?;
    file.rows("VTKHDF/Connectivity", 1, &signed(&rows.connectivity))?;
    file.rows("VTKHDF/Offsets", 1, &signed(&rows.offsets))?;
    file.rows("VTKHDF/Types", 1, &rows.types)
}

fn put_fields(file: &SharedFile, group: &str, fields: &[Field]) -> Result<(), String> {
    fields.iter().try_for_each(|field| file.field(&format!("{group}/{}", field.name), field))
}

/// Where each time finds its values; the mesh begins at 0 for all of them.
fn put_steps(comm: &dyn Comm, file: &SharedFile, rows: &Piece, sizes: &[[usize; 3]]) -> Result<(), String> {
    let count = rows.times.len();
    let mine = |values: Vec<i64>| if comm.rank() == 0 { values } else { Vec::new() };
    let repeated = |value: usize| mine(vec![value as i64; count]);
    let pieces = all_gather_u64(comm, &[sizes.len() as u64]).iter().sum::<u64>() as usize;
    file.group("VTKHDF/Steps")?;
    file.attribute("VTKHDF/Steps", "NSteps", &[count as i64])?;
    file.rows("VTKHDF/Steps/Values", 1, if comm.rank() == 0 { &rows.times[..] } else { &[] })?;
    file.rows("VTKHDF/Steps/NumberOfParts", 1, &repeated(pieces))?;
    for name in ["PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets"] {
        file.rows(&format!("VTKHDF/Steps/{name}"), 1, &repeated(0))?;
    }
    for (group, fields, column) in [("Point", &rows.point_data, 0), ("Cell", &rows.cell_data, 1)] {
        let here: u64 = sizes.iter().map(|row| row[column] as u64).sum();
        let total = all_gather_u64(comm, &[here]).iter().sum::<u64>() as i64;
        let group = format!("VTKHDF/Steps/{group}DataOffsets");
        file.group(&group)?;
        for field in fields {
            let stride = if field.states.len() > 1 { total } else { 0 };
            let offsets = (0..count as i64).map(|time| time * stride).collect();
            file.rows(&format!("{group}/{}", field.name), 1, &mine(offsets))?;
        }
    }
    Ok(())
}

fn put_records(comm: &dyn Comm, file: &SharedFile, records: &Records) -> Result<(), String> {
    file.group("provenance")?;
    let texts = root_texts(comm, records.provenance.iter().flat_map(|(name, text)| [name.as_str(), text.as_str()]));
    for pair in texts.chunks_exact(2) {
        file.text(&format!("provenance/{}", pair[0]), &pair[1])?;
    }
    file.group("convergence")?;
    let names = root_texts(comm, records.convergence.iter().map(|(name, _)| name.as_str()));
    for (column, name) in names.iter().enumerate() {
        let mine = if comm.rank() == 0 { &records.convergence[column].1[..] } else { &[] };
        file.rows(&format!("convergence/{name}"), 1, mine)?;
    }
    file.group("state")?;
    file.text("state/description", &root_texts(comm, [&records.state.description[..]]).concat())?;
    put_fields(file, "state", &records.state.arrays)?;
    if records.mesh.is_empty() {
        return Ok(());
    }
    file.group("mesh")?;
    put_fields(file, "mesh", &records.mesh)
}

/// VTK's ids are signed.
fn signed(ids: &[u64]) -> Vec<i64> {
    ids.iter().map(|&id| id as i64).collect()
}

#[cfg(test)]
mod tests {
    use super::super::piece::Values;
    use super::*;
    use crate::comm::threads;
    use hdf5_metno::File;

    /// Subdomain `s`: a column of `s + 1` tetrahedra on its own points, with values that tell rows apart.
    fn column(piece: &mut Piece, s: usize) {
        let first = piece.points.len() as u64;
        for point in 0..4 * (s + 1) {
            piece.points.push([s as f64, point as f64 / 3.0, -0.1]);
        }
        for cell in 0..=s as u64 {
            piece.connectivity.extend((0..4).map(|corner| first + 4 * cell + corner));
            piece.offsets.push(piece.connectivity.len() as u64);
            piece.types.push(10);
        }
    }

    /// Five subdomains spread over the ranks, the last rank without any if there is more than one.
    fn piece(comm: &dyn Comm) -> Piece {
        let owners = (comm.size() - 1).max(1);
        let mut piece = Piece { offsets: vec![0], times: vec![1.0], ..Piece::default() };
        let mut subdomain = Vec::new();
        for s in (0..5).filter(|s| s * owners / 5 == comm.rank()) {
            column(&mut piece, s);
            subdomain.resize(piece.types.len(), s as i64);
        }
        piece.point_data.push(Field::vector("displacement", &piece.points.clone()));
        piece.point_data.push(Field::scalar("contact_gap", piece.points.iter().map(|p| p[1].sin()).collect()));
        piece.cell_data.push(Field::integer("subdomain", subdomain));
        piece
    }

    fn records() -> Records {
        Records {
            provenance: vec![("scene".into(), "title = \"Blöcke\"\n".into()), ("empty".into(), String::new())],
            convergence: vec![("step".into(), vec![1.0, 2.0]), ("criterion".into(), vec![0.5, f64::NAN])],
            state: State { description: "{}".into(), arrays: Vec::new() },
            mesh: Vec::new(),
        }
    }

    /// A row for each cell.
    fn state(piece: &Piece) -> State {
        let kappa: Vec<f64> = piece.offsets[1..].iter().map(|end| piece.points[*end as usize - 1][1].cos()).collect();
        let arrays = vec![Field::integer("point", vec![-3; kappa.len()]), Field::scalar("kappa", kappa)];
        State { description: "{}".into(), arrays }
    }

    fn read_bits(file: &File, name: &str) -> Vec<u64> {
        file.dataset(name).unwrap().read_raw::<f64>().unwrap().into_iter().map(f64::to_bits).collect()
    }

    #[test]
    fn files_hold_the_same_numbers_for_every_number_of_ranks() {
        let directory = tempfile::tempdir().unwrap();
        let mut first = None;
        for ranks in [1, 3, 5] {
            let path = directory.path().join(format!("{ranks}.vtkhdf"));
            threads::run(ranks, |comm| {
                let records = if comm.rank() == 0 { records() } else { Records::default() };
                let records = Records { state: state(&piece(comm)), ..records };
                write(comm, &path, &piece(comm), &records).unwrap();
            });
            let file = File::open(&path).unwrap();
            let integers = |name: &str| file.dataset(name).unwrap().read_raw::<i64>().unwrap();
            let (points, cells) = (integers("VTKHDF/NumberOfPoints"), integers("VTKHDF/NumberOfCells"));
            assert_eq!((points.len(), cells.len()), (ranks, ranks));
            assert_eq!((points.iter().sum::<i64>(), cells.iter().sum::<i64>()), (60, 15));
            assert_eq!(integers("VTKHDF/Offsets").len(), 15 + ranks);
            assert!(ranks == 1 || points[ranks - 1] == 0);
            let numbers: Vec<Vec<u64>> = [
                "VTKHDF/Points",
                "VTKHDF/PointData/displacement",
                "VTKHDF/PointData/contact_gap",
                "VTKHDF/CellData/subdomain",
                "convergence/criterion",
                "state/point",
                "state/kappa",
            ]
            .map(|name| read_bits(&file, name))
            .to_vec();
            assert_eq!(numbers[6].len(), 15);
            assert_eq!(*first.get_or_insert(numbers.clone()), numbers);
            assert_eq!(file.dataset("VTKHDF/PointData/displacement").unwrap().shape(), [60, 3]);
        }
        let left: Vec<_> = std::fs::read_dir(directory.path()).unwrap().collect();
        assert_eq!(left.len(), 3, "no temporary files stay");
    }

    #[test]
    fn a_series_holds_one_state_behind_the_other_for_every_number_of_ranks() {
        let directory = tempfile::tempdir().unwrap();
        for ranks in [1, 3, 5] {
            let path = directory.path().join(format!("{ranks}.vtkhdf"));
            threads::run(ranks, |comm| {
                let mut series = piece(comm);
                for (time, shift) in [(1.5, 10.0), (4.0, 20.0)] {
                    let moved: Vec<_> = series.points.iter().map(|p| p.map(|x| x + shift)).collect();
                    series.record(time, vec![Field::vector("displacement", &moved)], Vec::new());
                }
                write(comm, &path, &series, &Records::default()).unwrap();
            });
            let file = File::open(&path).unwrap();
            let reals = |name: &str| file.dataset(&format!("VTKHDF/{name}")).unwrap().read_raw::<f64>().unwrap();
            let integers = |name: &str| file.dataset(&format!("VTKHDF/{name}")).unwrap().read_raw::<i64>().unwrap();
            assert_eq!(reals("Steps/Values"), [1.0, 1.5, 4.0]);
            assert_eq!(integers("Steps/NumberOfParts"), [ranks as i64; 3]);
            for name in ["PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets"] {
                assert_eq!(integers(&format!("Steps/{name}")), [0; 3]);
            }
            assert_eq!(integers("Steps/PointDataOffsets/displacement"), [0, 60, 120]);
            assert_eq!(integers("Steps/PointDataOffsets/contact_gap"), [0; 3]);
            assert_eq!(integers("Steps/CellDataOffsets/subdomain"), [0; 3]);
            let points = reals("Points");
            let expected = [0.0, 10.0, 20.0].into_iter().flat_map(|shift| points.iter().map(move |x| x + shift));
            assert!(reals("PointData/displacement").into_iter().eq(expected), "{ranks} ranks");
            assert_eq!(reals("PointData/contact_gap").len(), 60);
        }
    }

    #[test]
    fn a_field_has_one_state_or_one_a_time() {
        let mut series = piece(&Solo);
        for time in [2.0, 3.0] {
            series.record(time, Vec::new(), Vec::new());
        }
        let again = series.point_data[1].states[0].clone();
        series.point_data[1].states.push(again);
        assert!(series.check().is_err_and(|error| error == "field contact_gap has 2 states at 3 times"));
    }

    #[test]
    fn texts_and_type_read_back() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.vtkhdf");
        write(&Solo, &path, &piece(&Solo), &records()).unwrap();
        let file = File::open(&path).unwrap();
        let scene = file.dataset("provenance/scene").unwrap();
        let text = scene.read_scalar::<hdf5_metno::types::FixedUnicode<64>>().unwrap();
        assert_eq!(text.as_str(), "title = \"Blöcke\"\n");
        let group = file.group("VTKHDF").unwrap();
        let kind = group.attr("Type").unwrap();
        assert_eq!(kind.dtype().unwrap().size(), 16);
        assert_eq!(kind.read_scalar::<hdf5_metno::types::FixedAscii<16>>().unwrap().as_str(), "UnstructuredGrid");
        assert_eq!(group.attr("Version").unwrap().read_raw::<i64>().unwrap(), VERSION);
    }

    #[test]
    fn failures_are_everybodys_and_leave_nothing_behind() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.vtkhdf");
        std::fs::write(&path, "earlier").unwrap();
        for ranks in [1, 3, 5] {
            let outcomes = threads::run(ranks, |comm| {
                let below_a_file = write(comm, &path.join("b.vtkhdf"), &piece(comm), &Records::default());
                let mut other = piece(comm);
                if comm.rank() == ranks - 1 {
                    other.cell_data[0].states = vec![Values::Integer(vec![0; 99])];
                }
                let inconsistent = write(comm, &path, &other, &Records::default());
                let mut other = piece(comm);
                if comm.rank() > 0 {
                    other.point_data.pop();
                }
                let disagreeing = write(comm, &path, &other, &Records::default());
                // Fails inside HDF5, after the file was created: the name is taken.
                let mut twice = piece(comm);
                twice.point_data.push(twice.point_data[0].clone());
                [below_a_file, inconsistent, disagreeing, write(comm, &path, &twice, &Records::default())]
            });
            assert!(outcomes.iter().all(|o| *o == outcomes[0]));
            let [below_a_file, inconsistent, disagreeing, twice] = &outcomes[0];
            assert!(matches!(below_a_file, Err(OutputError::Write { .. })));
            assert!(matches!(inconsistent, Err(OutputError::Layout { reason, .. }) if reason.contains("99 values")));
            assert_eq!(disagreeing.is_err(), ranks > 1);
            assert!(matches!(twice, Err(OutputError::Write { reason, .. }) if reason.contains("displacement")));
            if ranks > 1 {
                assert_eq!(std::fs::read_to_string(&path).unwrap(), "earlier");
            } else {
                std::fs::write(&path, "earlier").unwrap();
            }
        }
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
    }
}
