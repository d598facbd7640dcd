//! Files into memory.

use super::FileError;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Bytes of the longest picture, geometry or set of rays that is read.
pub const LONGEST_DATA: u64 = 4 << 30;

/// The bytes of a file of at most `longest`.
///
/// # Errors
/// If the system does not give them, or there are more: a device's have no end.
pub fn read_file(path: &Path, longest: u64) -> Result<Vec<u8>, FileError> {
    bytes(path, longest).map_err(|error| FileError::new("read", path, &error))
}

fn bytes(path: &Path, longest: u64) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    let len = file.metadata().map_or(0, |metadata| metadata.len());
    let mut bytes = Vec::new();
    if len <= longest {
        bytes.try_reserve_exact(capacity(len as usize))?;
        file.take(longest.saturating_add(1)).read_to_end(&mut bytes)?;
    }
    if len.max(bytes.len() as u64) > longest {
        return Err(io::Error::other(format!("it is longer than {} MB", longest >> 20)));
    }
    Ok(bytes)
}

const SMALL: usize = 16 << 10;
const USUAL: usize = 64 << 10;
const LARGE: usize = 1 << 20;

/// Memory for a file of `len` bytes, and one more, so that its end is found without asking again.
///
/// For texts it is small, or of one size for all but the longest. The allocator keeps half a megabyte for each size of block,
/// and the kernel clears two megabytes when they are first touched: for a dozen includes of a dozen sizes that took longer than
/// to read them.
fn capacity(len: usize) -> usize {
    match len.saturating_add(1) {
        exact @ LARGE.. => exact,
        text => match text.next_power_of_two() {
            small @ ..=SMALL => small,
            usual => usual.max(USUAL),
        },
    }
}
