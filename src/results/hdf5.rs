//! An HDF5 file that all ranks write together: groups, attributes, arrays of which each rank has its rows, texts.
//!
//! HDF5's rules behind it (HDF5 reference manual, "Collective calling requirements in parallel applications"): whatever
//! changes the structure of the file is called by every rank with the same arguments; data move in one collective
//! transfer a dataset, which ranks without rows enter with an empty selection. The safe crate knows no transfer
//! properties, so the transfer itself is a call into the C library. After every collective step the ranks agree on its
//! outcome: a rank whose disk is full must not leave the others waiting in the next one.
//! Time stamps are off, so the same results give the same bytes.
//!
//! Success of a write is not proof: Open MPI 4.1's collective write prints "No space left on device" and reports success
//! to HDF5. So a file is read back after it was closed, by the same sequence of calls on a [`SharedFile::reopen`]ed one.

use std::mem::ManuallyDrop;
use std::path::Path;

use hdf5_metno::types::{FixedAscii, TypeDescriptor};
use hdf5_metno::{Dataset, Datatype, File, FileBuilder, H5Type, globals, h5check, sync::sync};
use hdf5_metno_sys::h5d::{H5Dread, H5Dwrite};
use hdf5_metno_sys::h5i::hid_t;
use hdf5_metno_sys::h5p::{H5FD_mpio_xfer_t, H5P_DEFAULT, H5Pclose, H5Pcreate, H5Pset_dxpl_mpio};
use hdf5_metno_sys::h5s::{H5S_SELECT_SET, H5Sclose, H5Screate_simple, H5Sselect_hyperslab, H5Sselect_none};

use super::piece::{Field, Values};
use crate::comm::agree::agree;
use crate::comm::{Comm, all_gather_u64};

/// A file open on every rank of `comm`: a new one to be written, or a written one to be compared. All methods are
/// collective, and their errors, which say what failed on which rank, are the same on every rank.
pub struct SharedFile<'a> {
    // After a failure the file stays open: closing flushes, and a flush to a full disk is something that parallel HDF5
    // 1.10 does not survive (segmentation fault on one rank, endless waiting on another).
    file: ManuallyDrop<File>,
    comm: &'a dyn Comm,
    task: Task,
}

#[derive(Clone, Copy, PartialEq)]
enum Task {
    Write,
    Compare,
}

/// Numbers that arrays consist of. The trait is sealed: reading relies on any bytes of their size being one.
pub trait Number: H5Type + sealed::AnyBytes {}

impl Number for f64 {}
impl Number for i64 {}
impl Number for u8 {}

mod sealed {
    /// Types of which any bytes are a value.
    pub trait AnyBytes {}

    impl AnyBytes for f64 {}
    impl AnyBytes for i64 {}
    impl AnyBytes for u8 {}
}

impl<'a> SharedFile<'a> {
    /// Creates or truncates a file: through MPI-IO if the ranks are MPI processes, else by the only rank.
    ///
    /// # Errors
    /// If HDF5 cannot create it.
    pub fn create(comm: &'a dyn Comm, path: &Path) -> Result<Self, String> {
        let file = agree(comm, "creating the HDF5 file", access(comm).create(path))?;
        Ok(Self { file: ManuallyDrop::new(file), comm, task: Task::Write })
    }

    /// Opens a file to compare it with what was to be written: the calls that wrote it now fail where it differs.
    ///
    /// # Errors
    /// If HDF5 cannot open it.
    pub fn reopen(comm: &'a dyn Comm, path: &Path) -> Result<Self, String> {
        let file = agree(comm, "reading the file back", access(comm).open(path))?;
        Ok(Self { file: ManuallyDrop::new(file), comm, task: Task::Compare })
    }

    /// Creates a group.
    ///
    /// # Errors
    /// If HDF5 refuses, e.g. because the name is taken.
    pub fn group(&self, name: &str) -> Result<(), String> {
        let group = match self.task {
            Task::Write => self.file.create_group(name),
            Task::Compare => self.file.group(name),
        };
        agree(self.comm, name, group.map(drop))
    }

    /// Gives a group an attribute of a few numbers, the same on every rank.
    ///
    /// # Errors
    /// If HDF5 refuses.
    pub fn attribute(&self, group: &str, name: &str, values: &[i64]) -> Result<(), String> {
        let write = || match self.task {
            Task::Write => self.file.group(group)?.new_attr_builder().with_data(values).create(name),
            Task::Compare => self.file.group(group)?.attr(name),
        };
        agree(self.comm, name, write().map(drop))
    }

    /// Gives a group an attribute that is an ASCII text of exactly `N` bytes, without an end mark.
    ///
    /// # Errors
    /// If HDF5 refuses, or the text is longer than `N` or not ASCII.
    pub fn text_attribute<const N: usize>(&self, group: &str, name: &str, text: &str) -> Result<(), String> {
        let write = || {
            let text = FixedAscii::<N>::from_ascii(text).map_err(|e| hdf5_metno::Error::from(e.to_string()))?;
            match self.task {
                Task::Write => self.file.group(group)?.new_attr::<FixedAscii<N>>().create(name)?.write_scalar(&text),
                Task::Compare => self.file.group(group)?.attr(name).map(drop),
            }
        };
        agree(self.comm, name, write())
    }

    /// Writes an array: the ranks' rows of `width` numbers one behind the other in rank order. A width of 1 gives a
    /// one-dimensional array.
    ///
    /// # Errors
    /// If HDF5 refuses or the disk is full.
    pub fn rows<T: Number>(&self, name: &str, width: usize, mine: &[T]) -> Result<(), String> {
        self.states(name, width, &[mine])
    }

    /// Writes several states of such an array, each with as many rows, one behind the other.
    ///
    /// # Errors
    /// If HDF5 refuses or the disk is full.
    ///
    /// # Panics
    /// If there is no state.
    pub fn states<T: Number>(&self, name: &str, width: usize, states: &[&[T]]) -> Result<(), String> {
        let count = (states[0].len() / width) as u64;
        let counts = all_gather_u64(self.comm, &[count]);
        let begin: u64 = counts[..self.comm.rank()].iter().sum();
        let total: u64 = counts.iter().sum();
        let all = total as usize * states.len();
        let shape = if width == 1 { vec![all] } else { vec![all, width] };
        let dataset =
            self.dataset(name, || self.file.new_dataset::<T>().obj_track_times(false).shape(shape).create(name))?;
        for (state, mine) in (0_u64..).zip(states) {
            // Safety: numbers may be seen as bytes.
            let bytes = unsafe { std::slice::from_raw_parts(mine.as_ptr().cast::<u8>(), size_of_val(*mine)) };
            agree(self.comm, name, self.transfer(&dataset, state * total + begin, count, bytes))?;
        }
        Ok(())
    }

    /// Writes all states of a field as such an array.
    ///
    /// # Errors
    /// If HDF5 refuses or the disk is full.
    pub fn field(&self, name: &str, Field { components, states, .. }: &Field) -> Result<(), String> {
        let real: Vec<&[f64]> = states.iter().filter_map(Values::real).collect();
        let integer: Vec<&[i64]> = states.iter().filter_map(Values::integer).collect();
        if integer.is_empty() {
            self.states(name, *components, &real)
        } else {
            self.states(name, *components, &integer)
        }
    }

    /// Writes a text, the same on every rank, as a scalar dataset of a UTF-8 string of fixed length.
    ///
    /// # Errors
    /// If HDF5 refuses or the disk is full.
    pub fn text(&self, name: &str, text: &str) -> Result<(), String> {
        // HDF5 has no strings of length 0.
        let text = if text.is_empty() { " " } else { text };
        let kind = TypeDescriptor::FixedUnicode(text.len());
        let builder = self.file.new_dataset_builder().empty_as(kind).obj_track_times(false);
        let dataset = self.dataset(name, || builder.create(name))?;
        let mine = if self.comm.rank() == 0 { text.as_bytes() } else { &[] };
        agree(self.comm, name, self.transfer(&dataset, 0, u64::from(!mine.is_empty()), mine))
    }

    /// Number of rows of an array.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn count(&self, name: &str) -> Result<u64, String> {
        let count = self.file.dataset(name).map(|dataset| dataset.shape().first().map_or(1, |&rows| rows as u64));
        agree(self.comm, name, count)
    }

    /// Reads `count` rows of an array from `begin` on, other ones on each rank.
    ///
    /// # Errors
    /// If there is no such array, it holds other numbers, or it is shorter.
    pub fn read<T: Number>(&self, name: &str, begin: u64, count: u64) -> Result<Vec<T>, String> {
        let read = || {
            let dataset = self.file.dataset(name)?;
            let shape = dataset.shape();
            if !dataset.dtype()?.is::<T>() || shape.first().is_none_or(|&rows| begin + count > rows as u64) {
                return Err(hdf5_metno::Error::from(format!("no rows {begin} to {} of such numbers", begin + count)));
            }
            let width = shape.get(1).copied().unwrap_or(1);
            Ok((dataset, count as usize * width))
        };
        let (dataset, length) = agree(self.comm, name, read())?;
        let mut bytes = vec![0; length * size_of::<T>()];
        agree(self.comm, name, self.fetch(&dataset, begin, count, &mut bytes))?;
        let numbers = bytes.chunks_exact(size_of::<T>());
        // Safety: any bytes of its size are a number (`sealed::AnyBytes`).
        Ok(numbers.map(|number| unsafe { number.as_ptr().cast::<T>().read_unaligned() }).collect())
    }

    /// Reads a text, on every rank.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn read_text(&self, name: &str) -> Result<String, String> {
        let open = || {
            let dataset = self.file.dataset(name)?;
            let length = dataset.dtype()?.size();
            Ok::<_, hdf5_metno::Error>((dataset, length))
        };
        let (dataset, length) = agree(self.comm, name, open())?;
        let mut bytes = vec![0; length];
        agree(self.comm, name, self.fetch(&dataset, 0, 1, &mut bytes))?;
        agree(self.comm, name, String::from_utf8(bytes))
    }

    /// Closes the file; what HDF5 still held in memory is written now.
    ///
    /// # Errors
    /// If HDF5 refuses or the disk is full.
    pub fn close(self) -> Result<(), String> {
        agree(self.comm, "completing the HDF5 file", self.file.flush())?;
        agree(self.comm, "closing the HDF5 file", ManuallyDrop::into_inner(self.file).close())
    }

    fn dataset(&self, name: &str, create: impl FnOnce() -> hdf5_metno::Result<Dataset>) -> Result<Dataset, String> {
        agree(
            self.comm,
            name,
            match self.task {
                Task::Write => create(),
                Task::Compare => self.file.dataset(name),
            },
        )
    }

    /// Moves this rank's `count` rows to the dataset's rows from `begin` on, or compares them with those.
    fn transfer(&self, dataset: &Dataset, begin: u64, count: u64, mine: &[u8]) -> hdf5_metno::Result<()> {
        if self.task == Task::Write {
            let Transfer { kind, here, there, properties } = self.prepare(dataset, begin, count)?;
            let (to, of, with) = (dataset.id(), kind.id(), properties.0);
            // Safety (here and in `fetch`): the buffers hold `count` rows of the dataset's own type, and the selections stay
            // inside their extents.
            return sync(|| unsafe { h5check(H5Dwrite(to, of, here.0, there.0, with, mine.as_ptr().cast())) })
                .map(drop);
        }
        let mut read = vec![0; mine.len()];
        self.fetch(dataset, begin, count, &mut read)?;
        if read == mine { Ok(()) } else { Err("reads back differently: is the disk full?".into()) }
    }

    /// Moves the dataset's rows from `begin` on here.
    fn fetch(&self, dataset: &Dataset, begin: u64, count: u64, mine: &mut [u8]) -> hdf5_metno::Result<()> {
        let Transfer { kind, here, there, properties } = self.prepare(dataset, begin, count)?;
        let (from, of, with) = (dataset.id(), kind.id(), properties.0);
        sync(|| unsafe { h5check(H5Dread(from, of, here.0, there.0, with, mine.as_mut_ptr().cast())) }).map(drop)
    }

    fn prepare(&self, dataset: &Dataset, begin: u64, count: u64) -> hdf5_metno::Result<Transfer> {
        let shape: Vec<u64> = dataset.shape().into_iter().map(|n| n as u64).collect();
        Ok(Transfer {
            kind: dataset.dtype()?,
            here: Selection::rows(&shape, 0, count)?,
            there: Selection::rows(&shape, begin, count)?,
            properties: TransferProperties::new(self.comm.raw_mpi().is_some())?,
        })
    }
}

/// What a transfer needs: type of the numbers, rows in memory and in the file, and how.
struct Transfer {
    kind: Datatype,
    here: Selection,
    there: Selection,
    properties: TransferProperties,
}

/// Through MPI-IO if the ranks are MPI processes.
fn access(comm: &dyn Comm) -> FileBuilder {
    let mut builder = FileBuilder::new();
    if let Some(raw) = comm.raw_mpi() {
        builder.with_fapl(|access| access.mpio(raw, None).all_coll_metadata_ops(true).coll_metadata_write(true));
    }
    builder
}

/// A data space with some of its rows selected.
struct Selection(hid_t);

impl Selection {
    /// Rows `first..first + count` of an array; a scalar is one row.
    fn rows(shape: &[u64], first: u64, count: u64) -> hdf5_metno::Result<Self> {
        let none = std::ptr::null();
        // Safety (here and below): the arrays are as long as the space has dimensions, and `sync` is the lock that all
        // calls into the library take.
        let space =
            sync(|| unsafe { h5check(H5Screate_simple(shape.len() as i32, shape.as_ptr(), none)) }).map(Self)?;
        if count == 0 {
            sync(|| unsafe { h5check(H5Sselect_none(space.0)) })?;
        } else if !shape.is_empty() {
            let (mut begin, mut size) = (vec![0; shape.len()], shape.to_vec());
            (begin[0], size[0]) = (first, count);
            let select = || unsafe {
                h5check(H5Sselect_hyperslab(space.0, H5S_SELECT_SET, begin.as_ptr(), none, size.as_ptr(), none))
            };
            sync(select)?;
        }
        Ok(space)
    }
}

impl Drop for Selection {
    fn drop(&mut self) {
        // Safety: the space is ours and open.
        sync(|| unsafe { H5Sclose(self.0) });
    }
}

/// How data move: collectively under MPI, else as HDF5 likes.
struct TransferProperties(hid_t);

impl TransferProperties {
    fn new(collective: bool) -> hdf5_metno::Result<Self> {
        if !collective {
            return Ok(Self(H5P_DEFAULT));
        }
        // Safety: plain calls, under the library's lock.
        let properties = Self(sync(|| unsafe { h5check(H5Pcreate(*globals::H5P_DATASET_XFER)) })?);
        let mode = H5FD_mpio_xfer_t::H5FD_MPIO_COLLECTIVE;
        sync(|| unsafe { h5check(H5Pset_dxpl_mpio(properties.0, mode)) })?;
        Ok(properties)
    }
}

impl Drop for TransferProperties {
    fn drop(&mut self) {
        if self.0 != H5P_DEFAULT {
            // Safety: the list is ours and open.
            sync(|| unsafe { H5Pclose(self.0) });
        }
    }
}
