//! The packet engine: waves of rays through the compiled scene, tile by tile, into a film.
//!
//! A tile belongs to one thread from its camera rays to its pixels; rays of one kind wait in columns until eight of
//! them fill a packet. Same scene, same build: the same bytes with any number of threads.

mod camera;
mod enclosing;
mod hits;
mod light;
mod medium;
mod queue;
mod shade;
mod shadow;
mod sums;
mod tile;
mod trace;

use crate::compile::Compiled;
use crate::film::{Film, Pixel, RayCounts};
use crate::lane::Scalar;
use enclosing::Enclosing;
use light::LightProgram;
use rayon::prelude::*;
use tile::{Shared, TileArea, TileWorker};

/// Edge of a tile in pixels: 1024 camera rays, whose queues stay in a core's second-level cache.
pub const TILE: usize = 32;

/// Renders with the threads of the current pool; `progress` is told the pixels and rays of each finished tile.
pub fn render<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    width: usize,
    height: usize,
    progress: &(dyn Fn(usize, &RayCounts) + Sync),
) -> (Film, RayCounts) {
    let lights = scene.lights.iter().map(|light| LightProgram::new(light, scene.origin)).collect();
    let shared = Shared { scene, lights, enclosing: Enclosing::new(scene), size: (width, height) };
    let tiles: Vec<TileArea> = (0..height)
        .step_by(TILE)
        .flat_map(|y| {
            (0..width).step_by(TILE).map(move |x| TileArea {
                x,
                y,
                width: TILE.min(width - x),
                height: TILE.min(height - y),
            })
        })
        .collect();
    let done: Vec<(TileArea, Vec<Pixel>, RayCounts)> = tiles
        .into_par_iter()
        .map_init(TileWorker::<S, B>::default, |worker, area| {
            let mut pixels = Vec::new();
            let counts = worker.render(&shared, area, &mut pixels);
            progress(pixels.len(), &counts);
            (area, pixels, counts)
        })
        .collect();

    let mut film = Film::new(width, height);
    let mut counts = RayCounts::default();
    for (area, pixels, tile_counts) in done {
        counts.add(&tile_counts);
        for (row, pixels) in pixels.chunks(area.width).enumerate() {
            let first = (area.y + row) * width + area.x;
            film.pixels[first..first + area.width].copy_from_slice(pixels);
        }
    }
    (film, counts)
}
