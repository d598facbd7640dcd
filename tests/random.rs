//! Random scenes of every shape and finish: exact packets against the oracle.
//!
//! The generator is seeded, so a scene that fails is named by its number and comes back. The environment variables
//! `OCTRAY_RANDOM_SCENES` and `OCTRAY_RANDOM_FIRST` ask for more scenes than the usual few. The texts of scenes that
//! differ are kept in `target/tmp`.

use octray::eval;
use octray::film::Pixel;
use octray::render::{Engine, LightBuffers, RenderOptions, Schedule, render};
use octray::scene::Scene;
use std::path::Path;

const WIDTH: usize = 32;
const HEIGHT: usize = 24;

/// Bodies around it all, and so around the eye: what it is in decides what rays meet next.
const AROUND: [&str; 3] = [
    "plane { y, 40*U pigment { rgb 0.5 } hollow } box { -30*U, 30*U pigment { rgb <0.4, 0.5, 0.6> } }",
    "sphere { 0, 25*U pigment { rgbt <0.9, 0.95, 1, 0.9> } interior { ior 1.1 } } plane { -y, 40*U pigment { rgb 0.5 } }",
    "difference { sphere { 0, 25*U pigment { rgbt 0.9 } } box { <-30, -40, -30>*U, <30, -12, 30>*U pigment { rgb 0.5 } } }
     union { disc { 20*U*y, y, 3*U } box { -30*U, 30*U pigment { rgb 0.6 } } pigment { rgb 0.4 } interior { ior 1.3 } }",
];

/// The text of random scene `seed`; every fourth has something around it.
fn text(seed: u64) -> String {
    let around = if seed % 4 == 3 { AROUND[(seed / 4 % 3) as usize] } else { "" };
    octray::random::scene(seed) + around
}

fn scene(seed: u64) -> Scene {
    in_words(seed, &[])
}

/// The same with identifiers declared from outside.
fn in_words(seed: u64, words: &[(&str, &str)]) -> Scene {
    let declares = words.iter().map(|(name, value)| (name.to_string(), value.to_string())).collect();
    let options =
        eval::Options { image_width: WIDTH, image_height: HEIGHT, declares, ..eval::Options::default() };
    let read = eval::from_text("random", &text(seed), &options);
    assert!(!read.has_errors(), "seed {seed}: {:?}", read.diagnostics);
    read.scene
}

/// Light is kept in f32 (6e-8 of it is one rounding) and summed in another order; the digits that curved mirrors and
/// glass multiply at each bounce reach this at the few bounces the scenes ask for. 10,000 scenes hold it in every pixel.
const COLOR: f64 = 1e-6;

fn apart((a, b): (&Pixel, &Pixel)) -> f64 {
    let channels = a.rgb.iter().zip(&b.rgb).chain([(&a.transmit, &b.transmit)]);
    // Light over 1 is compared by its share.
    channels
        .map(|(a, b)| (f64::from(*a) - f64::from(*b)).abs() / f64::from(b.abs()).max(1.0))
        .fold(0.0, |worst: f64, d| if d.is_nan() { f64::NAN } else { worst.max(d) })
}

/// Pixels of 768 in which other coordinates, rounded anew, may see past another outline.
const OUTLINES: usize = 2;

/// What the cross-check takes for granted when it asks POV-Ray again. Polynomials written in other units and with another
/// solver's name are the same numbers; lengths of another power of two round where textures are scaled; a triangle alone
/// and in a mesh are the same corners.
#[test]
fn other_words_mean_the_same_scene() {
    let words: [&[(&str, &str)]; 4] =
        [&[("P", "16")], &[("P", "16"), ("STURM", "1")], &[("U", "1024")], &[("MESHED", "1")]];
    let mut changed = 0;
    for seed in 0..40 {
        let picture = |words| {
            let options = RenderOptions { width: WIDTH, height: HEIGHT, threads: 2, ..Default::default() };
            render(&in_words(seed, words), &options, &|_| {}).unwrap().0
        };
        let plain = picture(&[]);
        for words in words {
            let other = picture(words);
            let over = other.pixels.iter().zip(&plain.pixels).filter(|pair| !(apart(*pair) <= COLOR)).count();
            assert!(over <= OUTLINES, "seed {seed}, {words:?}: {over} pixels");
            let objects = |words| format!("{:?}", in_words(seed, words).objects);
            changed += usize::from(objects(words) != objects(&[]));
        }
    }
    assert!(changed > 80, "words change {changed} scenes only");
}

#[test]
fn random_scenes_look_the_same_to_packets_and_oracle() {
    let scenes = std::env::var("OCTRAY_RANDOM_SCENES").ok().and_then(|n| n.parse().ok()).unwrap_or(120);
    let first = std::env::var("OCTRAY_RANDOM_FIRST").ok().and_then(|n| n.parse().ok()).unwrap_or(0);
    let (mut wrong, mut largest) = (Vec::new(), 0.0f64);
    for seed in first..first + scenes {
        let scene = scene(seed);
        let picture = |engine| {
            // By themselves lights have buffers only in larger pictures.
            let light_buffers = if seed % 2 == 0 { LightBuffers::Always } else { LightBuffers::Auto };
            let schedule = Schedule { light_buffers, ..Schedule::default() };
            let (width, height, threads) = (WIDTH, HEIGHT, 2);
            let options = RenderOptions { width, height, engine, threads, schedule, ..Default::default() };
            render(&scene, &options, &|_| {}).unwrap().0
        };
        let (packets, oracle) = (picture(Engine::Packets), picture(Engine::Reference));
        let differences: Vec<f64> = packets.pixels.iter().zip(&oracle.pixels).map(apart).collect();
        let over = differences.iter().filter(|d| !(**d <= COLOR)).count();
        largest = differences.iter().copied().fold(largest, f64::max);
        if over > 0 {
            let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("random-{seed}.scn"));
            std::fs::write(kept, text(seed)).unwrap();
            let worst =
                (0..differences.len()).max_by(|&a, &b| differences[a].total_cmp(&differences[b])).unwrap();
            wrong.push(format!(
                "scene {seed}: {over} pixels, worst {:.1e} at {}, {}: packets {:?}, oracle {:?}",
                differences[worst],
                worst % WIDTH,
                worst / WIDTH,
                packets.pixels[worst],
                oracle.pixels[worst]
            ));
        }
    }
    println!(
        "{scenes} scenes from {first}: {} differ by more than {COLOR:.0e}, largest {largest:.1e}",
        wrong.len()
    );
    assert!(wrong.is_empty(), "{} scenes differ:\n{}", wrong.len(), wrong.join("\n"));
}
