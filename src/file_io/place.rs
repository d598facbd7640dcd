//! Where paths lead.

use std::path::{Path, PathBuf};

/// The folder that a path's last name is in: `.` if the path says none.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// True if writing to one path would replace what is at the other. Devices and pipes take both.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    let is_device = |path: &Path| path.metadata().is_ok_and(|found| !found.is_file());
    !is_device(a) && !is_device(b) && whole_path(a).is_some_and(|path| Some(path) == whole_path(b))
}

/// Without links; of what is not there yet, the folder's.
fn whole_path(path: &Path) -> Option<PathBuf> {
    path.canonicalize().ok().or_else(|| Some(folder_of(path).canonicalize().ok()?.join(path.file_name()?)))
}
