//! The packet engine: waves of rays through the compiled scene, into the pixels of tiles.
//!
//! A tile belongs to one thread from its camera rays to its pixels; rays of one kind wait in columns until eight of
//! them fill a packet. Same scene, same build: the same bytes with any number of threads.

mod area;
mod camera;
mod composite;
mod crossings;
mod emit;
mod enclosing;
mod filters;
mod finish;
mod hit_list;
mod hits;
mod instances;
mod item_buffer;
mod lamp;
mod leaves;
mod leaving;
mod light;
mod light_buffer;
mod medium;
mod onward;
mod outlined;
mod packets;
mod query;
mod queue;
mod regroup;
mod rows;
mod screened;
mod shade;
mod shadow;
mod shared;
mod sharpen;
mod shown;
mod spare;
mod stream;
mod sums;
mod surround;
mod tile;
mod tinted;
mod trace;

pub use crate::bvh::{Occupancy, Traversal};
use crate::compile::{Compiled, Kind, class};
use crate::film::{Pixel, RayCounts};
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Scalar, Vec3, first_lanes};
use area::TileArea;
use enclosing::Enclosing;
use glam::DVec3;
use item_buffer::ItemBuffer;
use light::LightProgram;
use query::Query;
use queue::Lines;
use shared::Shared;
use std::sync::{Mutex, PoisonError};
pub use stream::{RayStream, StreamHits, stream_occupancy, trace_stream};
pub use surround::LightBuffers;
use surround::surround;
use tile::TileWorker;
use trace::Tracer;

/// How the work is cut up: it changes times, and not a bit of the picture (but see [`LightBuffers`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Schedule {
    /// How rays go through the tree.
    pub traversal: Traversal,
    /// Edge of a tile in pixels, at least 1.
    pub tile: usize,
    /// Which shadow rays are answered without being traced.
    pub light_buffers: LightBuffers,
}

impl Default for Schedule {
    /// A tile has 1024 camera rays, whose queues stay in a core's second-level cache.
    fn default() -> Self {
        Self { traversal: Traversal::default(), tile: 32, light_buffers: LightBuffers::default() }
    }
}

/// With more lights than these tiles are small: each thread keeps the shadow rays of a tile's camera rays for each light, 70 kB
/// a light with tiles of 32.
const MANY_LIGHTS: usize = 256;
/// See [`MANY_LIGHTS`].
const SMALL_TILE: usize = 8;

/// A finished tile.
#[derive(Debug, Clone, Copy)]
pub struct Tile<'a> {
    /// Column and row of its first pixel, from the top left.
    pub corner: (usize, usize),
    /// Pixels per row.
    pub width: usize,
    /// Row by row.
    pub pixels: &'a [Pixel],
    /// Rays that it took.
    pub rays: &'a RayCounts,
}

/// Renders with the threads of the current pool; `done` is handed each tile by the thread that finished it. With
/// `count` it also counts how many lanes work, which takes some more time.
pub fn render<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    (width, height): (usize, usize),
    schedule: Schedule,
    count: bool,
    done: &(dyn Fn(Tile<'_>) + Sync),
) -> (RayCounts, Occupancy) {
    let mut lights = LightProgram::all(&scene.lights, scene.geometry.origin);
    surround(scene, &mut lights, schedule.light_buffers, width * height);
    let items =
        (schedule.traversal == Traversal::Auto).then(|| ItemBuffer::of(scene, (width, height))).flatten();
    let shared = Shared { scene, lights, enclosing: Enclosing::new(scene), items, size: (width, height) };
    let most = if shared.lights.len() > MANY_LIGHTS { SMALL_TILE } else { usize::MAX };
    let tile = schedule.tile.clamp(1, most);
    let tiles = (0..height).step_by(tile).flat_map(|y| {
        (0..width).step_by(tile).map(move |x| TileArea {
            x,
            y,
            width: tile.min(width - x),
            height: tile.min(height - y),
        })
    });
    let by_thread = hand_out(tiles, |tiles| {
        let mut worker = TileWorker::new(&shared, schedule.traversal, count);
        let (mut counts, mut pixels) = (RayCounts::default(), Vec::new());
        for area in tiles {
            let rays = worker.render(&shared, area, &mut pixels);
            done(Tile { corner: (area.x, area.y), width: area.width, pixels: &pixels, rays: &rays });
            counts.add(&rays);
        }
        (counts, worker.occupancy())
    });
    let (mut counts, mut occupancy) = (RayCounts::default(), Occupancy::default());
    for (of_thread, tested) in &by_thread {
        counts.add(of_thread);
        occupancy += *tested;
    }
    (counts, occupancy)
}

/// Each thread of the current pool works on what it takes from `items`, the next one when it is done with one: they are not
/// alike, and stretches of them even less. Returns what the threads make of theirs.
fn hand_out<T, R: Send>(
    items: impl Iterator<Item = T> + Send,
    work: impl Fn(&mut dyn Iterator<Item = T>) -> R + Sync,
) -> Vec<R> {
    let waiting = Mutex::new(items);
    let next = || waiting.lock().unwrap_or_else(PoisonError::into_inner).next();
    rayon::broadcast(|_| work(&mut std::iter::from_fn(next)))
}

/// What a ray meets first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstHit {
    /// Distance along the unit direction, in scene units.
    pub t: f64,
    /// The point, put back on the surface, in world space.
    pub point: DVec3,
    /// Unit normal as the shape has it; interpolated on smooth triangles.
    pub normal: DVec3,
}

/// What camera rays `(origin, direction of any length but 0)` meet first, in their order: for comparing engines hit by hit.
pub fn nearest_hits<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    rays: &[(DVec3, DVec3)],
) -> Vec<Option<FirstHit>> {
    let mut tracer = Tracer::default();
    let mut found = Vec::with_capacity(rays.len());
    for group in rays.chunks(scene.geometry.group_size() * LANES) {
        let mut queries: Vec<Query<S::Lane>> = group
            .chunks(LANES)
            .map(|eight| {
                let ray = |k: usize| eight[k.min(eight.len() - 1)];
                let lines = Rays {
                    origin: Vec3::from_fn(|k| ray(k).0 - scene.geometry.origin),
                    dir: Vec3::from_fn(|k| ray(k).1.normalize()),
                };
                let lines = Lines { rays: lines, ..Lines::default() };
                let lanes = first_lanes(eight.len());
                Query::new(&lines, S::Lane::lit(f64::INFINITY), lanes)
            })
            .collect();
        tracer.nearest(&scene.geometry, &mut queries, class::CAMERA);
        for query in &mut queries {
            let surfaces = hits::resolve(&scene.geometry, query);
            let t = query.t.to_f64s().to_array();
            for k in (0..LANES).filter(|k| query.lanes >> k & 1 == 1) {
                found.push((query.hits() >> k & 1 == 1).then(|| {
                    let point = surfaces.point.lane(k);
                    // A plane is looked for some roundings nearer than it lies.
                    let on_plane = scene.geometry.kind_of(query.surface[k]) == Kind::Plane as u8;
                    let Rays { origin, dir } = query.rays;
                    FirstHit {
                        t: if on_plane { (point - origin.lane(k)).dot(dir.lane(k)) } else { t[k] },
                        point: point + scene.geometry.origin,
                        normal: surfaces.normal.lane(k),
                    }
                }));
            }
        }
    }
    found
}
