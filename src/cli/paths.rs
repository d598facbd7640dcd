//! Scenes and folders that a command is told of.

use super::Failure;
use std::path::{Path, PathBuf};

/// Files as they are, folders opened (sorted, not their subfolders).
pub fn scenes(given: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut scenes = Vec::new();
    for path in given {
        if !path.is_dir() {
            scenes.push(path.clone());
            continue;
        }
        let failed = |error| Failure::Machine(format!("cannot read the folder {}: {error}", path.display()));
        let entries: Result<Vec<_>, _> = std::fs::read_dir(path).map_err(failed)?.collect();
        let mut found: Vec<_> = entries.map_err(failed)?.into_iter().map(|entry| entry.path()).collect();
        found.retain(|file| file.extension().is_some_and(|e| e == "scn" || e == "pov"));
        if found.is_empty() {
            return Err(Failure::Usage(format!("there is no .scn or .pov file in {}", path.display())));
        }
        found.sort();
        scenes.extend(found);
    }
    Ok(scenes)
}

/// Makes `folder` and those it lies in, where they are not there.
pub fn make_folder(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|error| Failure::Machine(format!("cannot make the folder {}: {error}", folder.display())))
}

/// The end of a path says more than its beginning.
pub fn shortened(path: &str, most: usize) -> String {
    let length = path.chars().count();
    if length <= most {
        path.into()
    } else {
        format!("…{}", path.chars().skip(length - most + 1).collect::<String>())
    }
}

/// A path as a field of a CSV file, without what would end it.
pub fn csv_field(path: &str) -> String {
    path.replace([',', '"', '\n'], "_")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_paths_keep_their_end() {
        assert_eq!(shortened("scenes/a.scn", 32), "scenes/a.scn");
        assert_eq!(shortened("abcdefgh", 4), "…fgh");
    }
}
