//! Whole files, in and out.
//!
//! Knows what can go wrong with a path (no end, no permission, a device), nothing of what files hold. What is read has a
//! limit; what is written stands there whole or not at all.

mod place;
mod read;
mod replace;

pub use place::{folder_of, is_same_file};
pub use read::{LONGEST_DATA, read_file};
pub use replace::{check_writable, replace_file};

use std::io;
use std::path::{Path, PathBuf};

/// The file system said no.
#[derive(Debug, thiserror::Error)]
#[error("cannot {action} {}: {reason}", path.display())]
pub struct FileError {
    /// "read" or "write".
    pub action: &'static str,
    /// The file meant, not a temporary one.
    pub path: PathBuf,
    /// What the system said.
    pub reason: String,
}

impl FileError {
    fn new(action: &'static str, path: &Path, error: &io::Error) -> Self {
        Self { action, path: path.into(), reason: error.to_string() }
    }
}

#[cfg(test)]
mod tests;
