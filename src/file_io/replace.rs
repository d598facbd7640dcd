//! Files written whole or not at all: into a new file in the same folder, then renamed over the old one.
//!
//! A render that fails or is stopped leaves what stood there before.

use super::{FileError, folder_of};
use std::fs::{self, Permissions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Writes `bytes` to `path`. A symbolic link's target is replaced, not the link; a new file gets the permissions that
/// any program's would, a replaced one keeps its own. Devices and pipes are written to directly.
///
/// # Errors
/// With the path and the system's reason; `path` is then as it was.
pub fn replace_file(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    write_whole(path, bytes).map_err(|error| FileError::new("write", path, &error))
}

/// Finds out, before hours of rendering, whether [`replace_file`] could work: makes and removes a new file in the folder.
///
/// # Errors
/// As [`replace_file`].
pub fn check_writable(path: &Path) -> Result<(), FileError> {
    let possible = Target::of(path).and_then(|target| match target {
        Target::Direct => Ok(()),
        Target::Replace { path: file, .. } => temporary_beside(&file).map(drop),
    });
    possible.map_err(|error| FileError::new("write", path, &error))
}

/// What is at the path.
enum Target {
    /// A device or a pipe, which a rename would destroy.
    Direct,
    /// A regular file or nothing.
    Replace { path: PathBuf, permissions: Option<Permissions> },
}

impl Target {
    fn of(path: &Path) -> io::Result<Self> {
        match fs::metadata(path) {
            Ok(found) if found.is_dir() => Err(io::Error::other("it is a folder")),
            Ok(found) if !found.is_file() => Ok(Self::Direct),
            // `rename` needs only the folder's permission; a file marked read-only is meant to stay.
            Ok(found) if found.permissions().readonly() => Err(io::Error::other("the file is read-only")),
            Ok(found) => {
                Ok(Self::Replace { path: fs::canonicalize(path)?, permissions: Some(found.permissions()) })
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                Ok(Self::Replace { path: linked_to(path), permissions: None })
            }
            Err(error) => Err(error),
        }
    }
}

/// Where a file will be that is not there yet: at the end of symbolic links, if `path` is one.
fn linked_to(path: &Path) -> PathBuf {
    // More than a system follows; and those in a ring lead nowhere, as the system has said by then.
    const LINKS: usize = 64;
    let mut path = path.to_owned();
    for _ in 0..LINKS {
        let Ok(target) = fs::read_link(&path) else { break };
        path = folder_of(&path).join(target);
    }
    path
}

fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    match Target::of(path)? {
        Target::Direct => fs::write(path, bytes),
        Target::Replace { path, permissions } => {
            let file = temporary_beside(&path)?;
            // To the file itself: the crate adds its temporary name to what goes wrong.
            file.as_file().write_all(bytes)?;
            if let Some(permissions) = permissions {
                file.as_file().set_permissions(permissions)?;
            }
            file.persist(&path).map(drop).map_err(|error| error.error)
        }
    }
}

/// A new, empty file in the same folder, removed when dropped.
fn temporary_beside(path: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".octray-").suffix(".part");
    // The crate's own default is 0600; the process's umask is applied to this.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder_of(path)).map_err(|error| io::Error::new(error.kind(), without_name(&error)))
}

/// What the system said. The crate wraps it in an error of its own, of which nothing but the text can be had, to add its
/// temporary name; that is not the user's business.
fn without_name(error: &io::Error) -> String {
    let text = error.to_string();
    text.split_once(" at path \"").map_or(text.as_str(), |(reason, _)| reason).to_owned()
}
