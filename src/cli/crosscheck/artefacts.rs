//! Where POV-Ray's own picture is known to be wrong: the list `artefacts.json`, kept beside this file.
//!
//! Each entry says what POV-Ray does, how that was shown, and in which scenes it decides pixels: named ones by their file's
//! stem, random ones by their seed (at the usual size of random scenes).

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
    #[serde(default)]
    seeds: Vec<u64>,
}

static LIST: LazyLock<Vec<Artefact>> = LazyLock::new(|| {
    serde_json::from_str(include_str!("artefacts.json")).expect("the list is checked by a test")
});

/// What is on record for a scene file.
pub fn of_scene(stem: &str) -> Option<String> {
    LIST.iter().find(|known| known.scenes.iter().any(|scene| scene == stem)).map(told)
}

/// What is on record for a random scene.
pub fn of_seed(seed: u64) -> Option<String> {
    LIST.iter().find(|known| known.seeds.contains(&seed)).map(told)
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
        assert!(
            of_scene("light_leak").is_some() && of_scene("nothing").is_none() && of_seed(u64::MAX).is_none()
        );
    }
}
