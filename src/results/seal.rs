//! A seal behind the end of a file that tells whether the file is whole: its length and a checksum.
//!
//! HDF5 does not mind what follows its own end, and knows checksums of data only where they are cut into chunks. So the file
//! is sealed as a whole, and looked at before HDF5 is: reading a damaged one may crash the library. The checksum is the
//! CRC-32 of the CRC-32s of blocks, which the ranks share.

use std::fs::{self, File};
use std::io::{self, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;

use crate::comm::agree::{agree, on_root};
use crate::comm::{Comm, all_gather_u64};

const MARK: &[u8; 16] = b"fetiplast seal 1";
const LENGTH: u64 = 32;
const BLOCK: u64 = 1 << 20;

/// Seals a file that is closed. Collective.
///
/// # Errors
/// The same on every rank, if it cannot be read or written.
pub fn seal(comm: &dyn Comm, path: &Path) -> Result<(), String> {
    let length = agree(comm, "sealing the file", fs::metadata(path).map(|data| data.len()))?;
    let checksum = checksum(comm, path, length)?;
    on_root(comm, "sealing the file", || {
        let mark = [&MARK[..], &length.to_le_bytes(), &checksum.to_le_bytes()].concat();
        File::options().append(true).open(path)?.write_all(&mark)?;
        if fs::metadata(path)?.len() == length + LENGTH { Ok(()) } else { Err(io::Error::other("the file changes")) }
    })
}

/// Whether a sealed file is as it was. Collective.
///
/// # Errors
/// What is wrong with it, the same on every rank.
pub fn verify(comm: &dyn Comm, path: &Path) -> Result<(), String> {
    let mark = agree(comm, "opening", read_mark(path))?;
    let Some((length, expected)) = mark else { return Err("it is not complete, or no checkpoint".into()) };
    if checksum(comm, path, length)? == expected { Ok(()) } else { Err("it is damaged: its checksum is wrong".into()) }
}

/// Length and checksum by the seal; `None` if there is none at the end.
fn read_mark(path: &Path) -> io::Result<Option<(u64, u64)>> {
    let file = File::open(path)?;
    let Some(length) = file.metadata()?.len().checked_sub(LENGTH) else { return Ok(None) };
    let mut mark = [0; LENGTH as usize];
    file.read_exact_at(&mut mark, length)?;
    let number = |at: usize| u64::from_le_bytes(std::array::from_fn(|k| mark[at + k]));
    Ok((mark.starts_with(MARK) && number(16) == length).then(|| (length, number(24))))
}

fn checksum(comm: &dyn Comm, path: &Path, length: u64) -> Result<u64, String> {
    let mine = || {
        let file = File::open(path)?;
        let mut sums = Vec::new();
        for block in (comm.rank() as u64..length.div_ceil(BLOCK)).step_by(comm.size()) {
            let mut bytes = vec![0; BLOCK.min(length - block * BLOCK) as usize];
            file.read_exact_at(&mut bytes, block * BLOCK)?;
            sums.extend([block, u64::from(crc32fast::hash(&bytes))]);
        }
        Ok::<_, io::Error>(sums)
    };
    let mine = agree(comm, "reading the file", mine())?;
    let all = all_gather_u64(comm, &mine);
    let mut sums = all.as_chunks::<2>().0.to_vec();
    sums.sort_unstable();
    Ok(u64::from(crc32fast::hash(&sums.iter().flat_map(|[_, sum]| sum.to_le_bytes()).collect::<Vec<u8>>())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;

    #[test]
    fn a_sealed_file_is_known_from_a_damaged_one_on_any_number_of_ranks() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        let content: Vec<u8> = (0..BLOCK * 3 + 17).map(|k| (k * k / 7) as u8).collect();
        fs::write(&path, &content).unwrap();
        for outcome in threads::run(2, |comm| verify(comm, &path)) {
            assert!(outcome.unwrap_err().contains("not complete"));
        }
        assert!(threads::run(3, |comm| seal(comm, &path)).iter().all(Result::is_ok));
        let sealed = fs::read(&path).unwrap();
        assert_eq!(&sealed[..content.len()], content);
        for ranks in [1, 2, 5] {
            assert!(threads::run(ranks, |comm| verify(comm, &path)).iter().all(Result::is_ok));
        }
        for flipped in [0, BLOCK as usize + 3, content.len() - 1] {
            let mut damaged = sealed.clone();
            damaged[flipped] ^= 4;
            fs::write(&path, damaged).unwrap();
            for outcome in threads::run(2, |comm| verify(comm, &path)) {
                assert!(outcome.unwrap_err().contains("checksum"));
            }
        }
        for left in [0, 10, content.len(), sealed.len() - 1] {
            fs::write(&path, &sealed[..left]).unwrap();
            assert!(threads::run(2, |comm| verify(comm, &path)).iter().all(Result::is_err));
        }
        fs::remove_file(&path).unwrap();
        let missing = threads::run(2, |comm| verify(comm, &path));
        assert!(missing[0] == missing[1] && missing[0].clone().unwrap_err().contains("No such file"));
    }
}
