//! What a name stands for that is to be written, behind all symbolic links: a regular file, or what takes bytes one after
//! the other (a device, a pipe, what this program's standard output is already).
//!
//! Regular files are replaced as a whole, see [`super::replace`]; the last of the links may lead to one that is not there yet.
//! All else is there before the run and stays: it is written to, and never renamed over.

use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind};
use std::os::fd::AsFd;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// What is to be written.
#[derive(Debug, PartialEq)]
pub enum Target {
    /// A regular file, at the end of all links.
    File(PathBuf),
    /// Bytes one after the other.
    Stream,
}

impl Target {
    /// What a name stands for.
    ///
    /// # Errors
    /// If it is a directory, or links lead nowhere.
    pub fn of(path: &Path) -> io::Result<Self> {
        let about = match fs::metadata(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Self::File(behind_links(path))),
            about => about?,
        };
        if about.is_dir() {
            return Err(ErrorKind::IsADirectory.into());
        }
        // One that is open without a name, under /proc, cannot be replaced.
        let is_file = about.is_file() && about.nlink() > 0 && standard(&about).is_none();
        Ok(if is_file { Self::File(behind_links(path)) } else { Self::Stream })
    }

    /// The regular file.
    ///
    /// # Errors
    /// If it is none.
    pub fn file(self) -> io::Result<PathBuf> {
        match self {
            Self::File(path) => Ok(path),
            Self::Stream => Err(io::Error::other("HDF5 needs a regular file, and this is a device or a pipe")),
        }
    }
}

/// Opens a file to be written from its beginning, in place, with its directory if that is missing; or a stream, to be written
/// where it is. Waits for the reader of a pipe.
///
/// # Errors
/// If it cannot be opened.
pub fn open(path: &Path) -> io::Result<File> {
    match Target::of(path)? {
        Target::File(file) => {
            create_directory(&file)?;
            File::create(file)
        }
        Target::Stream => match standard(&fs::metadata(path)?) {
            Some(own) => Ok(own),
            None => File::options().append(true).open(path),
        },
    }
}

/// Makes the directory of a file.
///
/// # Errors
/// If it can neither be found nor made.
pub fn create_directory(file: &Path) -> io::Result<()> {
    file.parent().map_or(Ok(()), |directory| fs::create_dir_all(behind_links(directory)))
}

/// Standard output or error, if a file is the same: opened anew it would be written over from its beginning.
fn standard(about: &Metadata) -> Option<File> {
    let own = [io::stdout().as_fd().try_clone_to_owned(), io::stderr().as_fd().try_clone_to_owned()];
    let place = |about: &Metadata| (about.dev(), about.ino());
    let is_same = |file: &File| file.metadata().is_ok_and(|own| place(&own) == place(about));
    own.into_iter().flatten().map(File::from).find(is_same)
}

/// The end of a chain of symbolic links, whether it exists or not.
pub fn behind_links(path: &Path) -> PathBuf {
    /// As many as Linux follows.
    const LINKS: usize = 40;
    let mut path = path.to_owned();
    for _ in 0..LINKS {
        let Ok(next) = fs::read_link(&path) else { break };
        path = path.parent().map_or(next.clone(), |directory| directory.join(next));
    }
    path
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn links_are_followed_to_files_that_are_there_or_not() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        fs::create_dir(at("below")).unwrap();
        fs::write(at("file"), "").unwrap();
        symlink("below", at("into")).unwrap();
        symlink("../file", at("below/up")).unwrap();
        symlink("into/up", at("chain")).unwrap();
        symlink("below/none", at("dangling")).unwrap();
        symlink("loop", at("loop")).unwrap();
        let found = |name: &str| Target::of(&at(name)).map(|target| target.file().unwrap());
        assert_eq!(found("file").unwrap(), at("file"));
        assert!(found("chain").is_ok_and(|path| fs::canonicalize(path).unwrap() == at("file").canonicalize().unwrap()));
        assert_eq!(found("dangling").unwrap(), at("below/none"));
        assert_eq!(found("none").unwrap(), at("none"));
        assert_eq!(found("below").unwrap_err().kind(), ErrorKind::IsADirectory);
        assert!(found("loop").is_err());
        symlink("later", at("out")).unwrap();
        drop(open(&at("out/file")).unwrap());
        assert!(at("later/file").is_file());
    }

    #[test]
    fn devices_are_streams() {
        assert_eq!(Target::of(Path::new("/dev/null")).unwrap(), Target::Stream);
        let stream = Target::of(Path::new("/dev/full")).unwrap();
        assert!(stream.file().unwrap_err().to_string().contains("regular file"));
    }
}
