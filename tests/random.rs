//! Random scenes of every shape and finish: exact packets against the oracle.
//!
//! The generator is seeded, so a scene that fails is named by its number and comes back. The environment variables
//! `OCTRAY_RANDOM_SCENES` and `OCTRAY_RANDOM_FIRST` ask for more scenes than the usual few. The texts of scenes that
//! differ are kept in `target/tmp`.

use octray::eval;
use octray::film::Pixel;
use octray::render::{Engine, RenderOptions, render};
use octray::scene::Scene;
use std::path::Path;

const WIDTH: usize = 32;
const HEIGHT: usize = 24;

fn scene(seed: u64) -> Scene {
    let options = eval::Options { image_width: WIDTH, image_height: HEIGHT, ..eval::Options::default() };
    let read = eval::from_text("random", &octray::random::scene(seed), &options);
    assert!(!read.has_errors(), "seed {seed}: {:?}", read.diagnostics);
    read.scene
}

/// Light is kept in f32 (6e-8 of it is one rounding) and summed in another order; the digits that curved mirrors and
/// glass multiply at each bounce reach this at the few bounces the scenes ask for. 10,000 scenes hold it in every pixel.
const COLOR: f64 = 1e-6;

#[test]
fn random_scenes_look_the_same_to_packets_and_oracle() {
    let scenes = std::env::var("OCTRAY_RANDOM_SCENES").ok().and_then(|n| n.parse().ok()).unwrap_or(120);
    let first = std::env::var("OCTRAY_RANDOM_FIRST").ok().and_then(|n| n.parse().ok()).unwrap_or(0);
    let (mut wrong, mut largest) = (Vec::new(), 0.0f64);
    for seed in first..first + scenes {
        let scene = scene(seed);
        let picture = |engine| {
            let options =
                RenderOptions { width: WIDTH, height: HEIGHT, engine, threads: 2, ..Default::default() };
            render(&scene, &options, &|_| {}).unwrap().0
        };
        let (packets, oracle) = (picture(Engine::Packets), picture(Engine::Reference));
        let apart = |(a, b): (&Pixel, &Pixel)| {
            let channels = a.rgb.iter().zip(&b.rgb).chain([(&a.transmit, &b.transmit)]);
            // Light over 1 is compared by its share.
            channels
                .map(|(a, b)| (f64::from(*a) - f64::from(*b)).abs() / f64::from(b.abs()).max(1.0))
                .fold(0.0, |worst: f64, d| if d.is_nan() { f64::NAN } else { worst.max(d) })
        };
        let differences: Vec<f64> = packets.pixels.iter().zip(&oracle.pixels).map(apart).collect();
        let over = differences.iter().filter(|d| !(**d <= COLOR)).count();
        largest = differences.iter().copied().fold(largest, f64::max);
        if over > 0 {
            let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("random-{seed}.scn"));
            std::fs::write(kept, octray::random::scene(seed)).unwrap();
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
