//! Where POV-Ray's own picture is known to be wrong: the list `artefacts.json`, kept beside this file.
//!
//! Each entry says what POV-Ray does, how that was shown, and the stems of the scene files in which it decides pixels.

use serde::Deserialize;
use std::sync::LazyLock;

#[derive(Debug, Deserialize)]
struct Artefact {
    /// What POV-Ray does.
    what: String,
    /// How one knows.
    evidence: String,
    #[serde(default)]
    scenes: Vec<String>,
}

static LIST: LazyLock<Vec<Artefact>> = LazyLock::new(|| {
    serde_json::from_str(include_str!("artefacts.json")).expect("the list is checked by a test")
});

/// What is on record for a scene file.
pub fn of_scene(stem: &str) -> Option<String> {
    LIST.iter().find(|known| known.scenes.iter().any(|scene| scene == stem)).map(told)
}

fn told(known: &Artefact) -> String {
    format!("{} ({})", known.what, known.evidence)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_is_whole() {
        assert!(LIST.iter().all(|known| !known.what.is_empty() && !known.evidence.is_empty()));
        assert!(of_scene("light_leak").is_some() && of_scene("nothing").is_none());
    }
}
