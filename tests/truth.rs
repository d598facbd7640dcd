//! Our pictures against POV-Ray's own: see `tests/truth/README.md`.
//!
//! Each scene of `tests/truth/scenes.json` is rendered at its picture's size. What must hold: at least 99.9 % of the
//! pixels off edges agree within 2e-3 of linear light. A scene that cannot reach that has a row in [`EXCEPTIONS`].
//! `cargo test --release --test truth -- --nocapture` shows each scene's figures.

use octray::compare::{AMPLIFY, Comparison, WITHIN, clipped, compare, strip};
use octray::eval;
use octray::film::Film;
use octray::image_io::{self, Assume, Encoding};
use octray::render::{Engine, RenderOptions, render};
use std::path::Path;

/// Share of the pixels off edges that must agree within [`WITHIN`].
const SHARE: f64 = 0.999;

/// `(scene, share that must agree instead, why POV-Ray's picture differs there)`.
const EXCEPTIONS: &[(&str, f64, &str)] = &[(
    "scenes/feature/alpha_background.scn",
    0.86,
    "with alpha output POV-Ray mirrors a half transparent background undimmed, and without it dimmed; our picture is \
     the same with and without alpha, and agrees on every pixel with POV-Ray's without",
)];

#[derive(serde::Deserialize)]
struct Truth {
    scene: String,
    picture: String,
    width: usize,
    height: usize,
    alpha: bool,
}

fn table() -> Vec<Truth> {
    let table = std::fs::read_to_string("tests/truth/scenes.json").expect("the table of scenes");
    serde_json::from_str(&table).expect("a table of scenes")
}

/// The engine's picture as POV-Ray's file would hold it, as far as a film can.
fn ours(truth: &Truth, engine: Engine) -> Result<Film, String> {
    let (width, height) = (truth.width, truth.height);
    let options = eval::Options { image_width: width, image_height: height, ..eval::Options::default() };
    let found = eval::load(Path::new(&truth.scene), &options);
    if found.has_errors() {
        let first = found.diagnostics.iter().map(|d| d.short(&found.sources)).next().unwrap_or_default();
        return Err(format!("it has errors: {first}"));
    }
    let options = RenderOptions { width, height, engine, ..RenderOptions::default() };
    let (mut film, _) = render(&found.scene, &options, &|_| ()).map_err(|error| error.to_string())?;
    // `transmit` of a file that is read is 1 - alpha.
    if !truth.alpha {
        film.pixels.iter_mut().for_each(|pixel| pixel.transmit = 0.0);
    }
    Ok(clipped(film))
}

/// The figures, or what is wrong, with the strip written where it can be looked at.
fn check(truth: &Truth, engine: Engine) -> Result<Comparison, String> {
    let expected =
        image_io::read(Path::new(&truth.picture), Assume::File).map_err(|error| error.to_string())?;
    let actual = ours(truth, engine)?;
    let found = compare(&expected, &actual)?;
    let least = EXCEPTIONS.iter().find(|(scene, ..)| *scene == truth.scene).map_or(SHARE, |row| row.1);
    if found.off_edges.within >= least {
        return Ok(found);
    }
    let name = format!("{}-{engine:?}.png", truth.scene.trim_end_matches(".scn").replace(['/', '\\'], "-"));
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    image_io::write(&path, &strip(&expected, &actual, AMPLIFY), &Encoding::default())
        .map_err(|e| e.to_string())?;
    let off = &found.off_edges;
    let apart = off.pixels - (off.within * off.pixels as f64).round() as usize;
    Err(format!(
        "{apart} of {} pixels off edges ({:.3} %) differ by more than {WITHIN}, at most by {:.2e}: {:?}\n    strip: {}",
        off.pixels,
        100.0 * (1.0 - off.within),
        off.max,
        off.worst,
        path.display()
    ))
}

fn check_all(truths: &[Truth], engine: Engine) {
    let mut failed = Vec::new();
    for truth in truths {
        match check(truth, engine) {
            Ok(found) => {
                // Both figures, because most edges agree too.
                let (all, off) = (found.all.within * 100.0, found.off_edges.within * 100.0);
                println!("{engine:?}  {:48} off edges {off:8.3} %, all {all:8.3} %", truth.scene);
            }
            Err(why) => failed.push(format!("{}: {why}", truth.scene)),
        }
    }
    let of = truths.len();
    assert!(
        failed.is_empty(),
        "{} of {of} scenes differ from POV-Ray's\n{}",
        failed.len(),
        failed.join("\n")
    );
}

#[test]
fn packets_agree_with_povray() {
    let truths = table();
    for scene in scenes(&["scenes/feature", "scenes/show"]) {
        assert!(truths.iter().any(|truth| truth.scene == scene), "{scene} has no truth");
    }
    check_all(&truths, Engine::Packets);
}

#[test]
fn every_scene_is_told_of() {
    let told = std::fs::read_to_string("scenes/README.md").unwrap();
    for scene in scenes(&["scenes/feature", "scenes/hard", "scenes/show"]) {
        let name = scene.rsplit('/').next().unwrap();
        assert!(told.contains(&format!("\n- `{name}`: ")), "scenes/README.md does not tell of {scene}");
    }
}

/// The scenes of these folders, by their paths.
fn scenes(folders: &[&str]) -> Vec<String> {
    let found = folders.iter().flat_map(|folder| std::fs::read_dir(folder).unwrap());
    let paths = found.map(|entry| entry.unwrap().path().to_str().unwrap().to_owned());
    paths.filter(|path| path.ends_with(".scn")).collect()
}

/// On the feature scenes alone: against the thousands of objects of some others, every ray against every object takes
/// minutes.
#[test]
fn the_oracle_agrees_with_povray() {
    let mut truths = table();
    truths.retain(|truth| truth.scene.starts_with("scenes/feature/"));
    check_all(&truths, Engine::Reference);
}

#[test]
fn every_exception_is_of_a_scene_and_gives_its_reason() {
    let truths = table();
    for (scene, share, reason) in EXCEPTIONS {
        assert!(truths.iter().any(|truth| truth.scene == *scene), "{scene} is not in the table");
        assert!((0.5..SHARE).contains(share) && reason.len() > 20, "{scene}");
    }
}
