//! Hard cases with known answers, for every engine and precision, and laws that random scenes must keep.
//!
//! Kernels are held against double-double in `tests/kernels`; here whole pictures are, against closed forms.

mod closed_forms;
#[path = "../kernels/dd.rs"]
mod dd;
mod laws;
mod literals;
#[path = "../kernels/oracle.rs"]
#[allow(dead_code, reason = "the kernels' tests ask it more")]
mod oracle;
mod povray;
mod rays;
mod scripts;
#[path = "../kernels/support.rs"]
#[allow(dead_code, reason = "the kernels' tests need more")]
mod support;
mod table;

use octray::eval;
use octray::film::Film;
use octray::render::{Engine, LightBuffers, Precision, RenderOptions, Schedule, render};
use octray::scene::Scene;

/// Pixels per row of every picture here.
pub const WIDTH: usize = 32;
/// Rows.
pub const HEIGHT: usize = 24;

/// Every way of rendering, with its name and how far from a closed form of order 1 it may be: roundings of single or
/// double precision, kept in f32 pixels, times some tens of operations a bounce.
pub const WAYS: [(&str, Engine, Precision, f64); 4] = [
    ("fast", Engine::Packets, Precision::Fast, 2e-4),
    ("exact", Engine::Packets, Precision::Exact, 2e-6),
    ("strict", Engine::Packets, Precision::Strict, 2e-6),
    ("oracle", Engine::Reference, Precision::Exact, 2e-6),
];

/// Reads a scene that has no errors.
pub fn scene(text: &str) -> Scene {
    let options = eval::Options { image_width: WIDTH, image_height: HEIGHT, ..eval::Options::default() };
    let read = eval::from_text("scene", text, &options);
    assert!(!read.has_errors(), "{:?}\n{text}", read.diagnostics);
    read.scene
}

/// Renders it.
pub fn picture(scene: &Scene, engine: Engine, precision: Precision, threads: usize) -> Film {
    // Small pictures have no light buffers by themselves. Here they must stand the test too; `strict` traces every ray.
    let light_buffers =
        if precision == Precision::Strict { LightBuffers::Never } else { LightBuffers::Always };
    let options = RenderOptions {
        width: WIDTH,
        height: HEIGHT,
        threads,
        engine,
        precision,
        schedule: Schedule { light_buffers, ..Schedule::default() },
        ..RenderOptions::default()
    };
    render(scene, &options, &|_| {}).unwrap().0
}

/// The largest difference of each pixel, as a share of light over 1.
pub fn differences(a: &Film, b: &Film) -> Vec<f64> {
    let apart = |(a, b): (&octray::film::Pixel, &octray::film::Pixel)| {
        let channels = a.rgb.iter().zip(&b.rgb).chain([(&a.transmit, &b.transmit)]);
        channels
            .map(|(a, b)| (f64::from(*a) - f64::from(*b)).abs() / f64::from(b.abs()).max(1.0))
            .fold(0.0, |worst: f64, d| if d.is_nan() { f64::INFINITY } else { worst.max(d) })
    };
    a.pixels.iter().zip(&b.pixels).map(apart).collect()
}

/// Every case within its bounds, and every case in the table that stands in `docs`.
#[test]
fn hard_cases_hold() {
    let (pictures, rays, scripts) = (closed_forms::rows(), rays::rows(), scripts::rows());
    let parts = [&pictures, &rays, &scripts].map(|rows| table::lines(rows));
    println!("{}", parts.join("\n"));
    if let Some(path) = std::env::var_os("OCTRAY_HARD_TABLE") {
        std::fs::write(path, table::document(&parts)).unwrap();
    }
    let all = || pictures.iter().chain(&rays).chain(&scripts);
    let broken: Vec<_> =
        [&pictures, &rays, &scripts].into_iter().flat_map(|rows| table::broken(rows)).collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
    let standing = std::fs::read_to_string(table::DOCUMENT).unwrap_or_default();
    let missing: Vec<_> =
        all().filter(|row| !standing.contains(&format!("| {} |", row.case))).map(|row| &row.case).collect();
    assert!(missing.is_empty(), "{} is older than these cases: {missing:?}", table::DOCUMENT);
}
