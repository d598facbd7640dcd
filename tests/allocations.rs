//! Buffers are reused from tile to tile: what a thread allocates does not grow with the rays it traces.

use octray::eval;
use octray::render::{Precision, RenderOptions, Schedule, render};
use octray::scene::Scene;
use std::path::Path;

#[global_allocator]
static ALLOCATOR: dhat::Alloc = dhat::Alloc;

const TILE: usize = 16;

/// Blocks that a picture of `edge` by `edge` pixels allocates, from the compiled scene to the film.
fn blocks(scene: &Scene, edge: usize) -> u64 {
    let schedule = Schedule { tile: TILE, ..Schedule::default() };
    let options = RenderOptions {
        width: edge,
        height: edge,
        threads: 1,
        precision: Precision::Exact,
        schedule,
        ..RenderOptions::default()
    };
    let _counted = dhat::Profiler::builder().testing().build();
    render(scene, &options, &|_| {}).unwrap();
    dhat::HeapStats::get().total_blocks
}

/// A picture of 64 tiles against one of 4, which has a sixteenth of the rays: the tile's developed pixels are a block of each, and
/// two hundred are what buffers may take to grow to the largest tile (three dozen of a thread, most of them none or once or
/// twice). What is allocated for each packet comes to 2048 blocks and more.
#[test]
fn nothing_is_allocated_for_packets() {
    let mut scenes = 0;
    let mut wrong = String::new();
    for entry in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/feature")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "scn") {
            continue;
        }
        scenes += 1;
        let scene = eval::load(&path, &eval::Options::default()).scene;
        let (few, many) = (blocks(&scene, 2 * TILE), blocks(&scene, 8 * TILE));
        println!(
            "{:30} {few:6} {many:6} {:6}",
            path.file_stem().unwrap().display(),
            many as i64 - few as i64
        );
        if many > few + 60 + 200 {
            wrong += &format!("{}: {few} blocks for 4 tiles, {many} for 64\n", path.display());
        }
    }
    assert!(scenes > 90, "{scenes}");
    assert!(wrong.is_empty(), "{wrong}");
}
