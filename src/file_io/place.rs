//! Where paths lead.

use std::path::Path;

/// The folder that a path's last name is in: `.` if the path says none.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
