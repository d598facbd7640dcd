//! Files: the scene, its includes, and the includes that octray brings along.

use super::{Evaluation, Options};
use crate::lang::{Diagnostic, Severity, SourceMap};
use std::path::Path;

/// A scene file's bytes, or why not.
pub(super) fn read_scene(path: &Path) -> Result<Vec<u8>, String> {
    if path.is_dir() {
        return Err(format!("expected a scene file, found a directory: {}", path.display()));
    }
    std::fs::read(path).map_err(|error| format!("cannot read {}: {error}", path.display()))
}

pub(super) fn run(name: &str, path: Option<&Path>, bytes: &[u8], _options: &Options) -> Evaluation {
    let mut sources = SourceMap::default();
    sources.add(name, path, bytes);
    Evaluation {
        diagnostics: vec![Diagnostic::new(Severity::Error, "evaluation is not here yet", None)],
        sources,
        files_read: path.map(Into::into).into_iter().collect(),
        ..Evaluation::default()
    }
}
