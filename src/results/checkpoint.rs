//! A checkpoint file: named arrays and texts in HDF5, sealed as a whole ([`super::seal`]).
//!
//! All ranks write together, each its rows, one rank's behind the other's. Ranks own consecutive subdomains, so a file does
//! not depend on their number, and others read it. Of every checkpoint the one before is kept beside it.
//! What the arrays mean is not known here.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use super::OutputError;
use super::hdf5::{Number, SharedFile};
use super::piece::Field;
use super::replace::replace;
use super::seal;
use super::target::{Target, behind_links};
use crate::comm::agree::{on_root, root_texts};
use crate::comm::{Comm, all_gather_u64};

/// Writes a checkpoint, once what is there is the one before. Names of arrays and texts have the form `group/name`; rank 0's
/// texts count. Collective.
///
/// # Errors
/// [`OutputError::Write`], the same on every rank; earlier checkpoints are there still.
pub fn write(comm: &dyn Comm, path: &Path, texts: &[(&str, String)], arrays: &[Field]) -> Result<(), OutputError> {
    const DESCRIPTION: u64 = 4096;
    let values = root_texts(comm, texts.iter().map(|(_, text)| text.as_str()));
    let texts: Vec<(&str, String)> = texts.iter().map(|(name, _)| *name).zip(values).collect();
    let names = (arrays.len() + texts.len()) as u64;
    let numbers: u64 = arrays.iter().flat_map(|field| &field.states).map(|state| state.len() as u64).sum();
    let letters: u64 = texts.iter().map(|(_, text)| text.len() as u64).sum();
    let bytes = all_gather_u64(comm, &[8 * numbers]).iter().sum::<u64>() + letters + names * DESCRIPTION;
    replace(comm, path, bytes, |temporary| {
        for open in [SharedFile::create, SharedFile::reopen] {
            let file = open(comm, temporary)?;
            let names = texts.iter().map(|(name, _)| *name).chain(arrays.iter().map(|field| &field.name[..]));
            let mut groups: Vec<&str> = names.filter_map(|name| Some(name.split_once('/')?.0)).collect();
            groups.sort_unstable();
            groups.dedup();
            groups.iter().try_for_each(|group| file.group(group))?;
            texts.iter().try_for_each(|(name, text)| file.text(name, text))?;
            arrays.iter().try_for_each(|field| file.field(&field.name, field))?;
            file.close()?;
        }
        seal::seal(comm, temporary)?;
        on_root(comm, "keeping the checkpoint before", || {
            File::open(temporary)?.sync_all()?;
            match fs::rename(behind_links(path), Target::of(&previous(path)).and_then(Target::file)?) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
                _ => Ok(()),
            }
        })
    })
}

/// Where the checkpoint before is kept: beside the file itself, where `path` is a link to it.
pub fn previous(path: &Path) -> PathBuf {
    let path = behind_links(path);
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".previous");
    path.with_file_name(name)
}

/// A checkpoint that is being read. All methods are collective, and their errors are the same on every rank.
pub struct Checkpoint<'a> {
    file: SharedFile<'a>,
}

impl<'a> Checkpoint<'a> {
    /// Opens a checkpoint that is whole.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn open(comm: &'a dyn Comm, path: &Path) -> Result<Self, String> {
        seal::verify(comm, path)?;
        Ok(Self { file: SharedFile::reopen(comm, path)? })
    }

    /// A text, on every rank.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn text(&self, name: &str) -> Result<String, String> {
        self.file.read_text(name)
    }

    /// All rows of an array, on every rank.
    ///
    /// # Errors
    /// If there is none of that name and kind.
    pub fn whole<T: Number>(&self, name: &str) -> Result<Vec<T>, String> {
        let rows = self.file.count(name)?;
        self.file.read(name, 0, rows)
    }

    /// The file, for parts of its arrays.
    pub fn arrays(&self) -> &SharedFile<'a> {
        &self.file
    }

    /// Closes the file.
    ///
    /// # Errors
    /// If HDF5 refuses.
    pub fn close(self) -> Result<(), String> {
        self.file.close()
    }
}
