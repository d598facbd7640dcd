//! One tile of the picture, from its camera rays to its pixels, by one thread and without a lock.

use super::camera::push_camera_rays;
use super::enclosing::Enclosing;
use super::hits::HitList;
use super::light::LightProgram;
use super::medium::Media;
use super::queue::{RayQueue, ShadowQueue};
use super::shade::{Emit, shade};
use super::shadow::ShadowTracer;
use super::sums::Sums;
use super::trace::{GROUP, Query, Tracer};
use crate::compile::{Compiled, class};
use crate::film::{Pixel, RayCounts};
use crate::lane::{LANES, Lane, Scalar};
use smallvec::SmallVec;

/// Rays that are traced and shaded together. A tile's camera rays are one batch; what they spawn is worked off from
/// the end in batches of this size, so that waiting rays stay few however deep the recursion goes.
pub const BATCH: usize = 1024;

/// A rectangle of pixels.
#[derive(Debug, Clone, Copy)]
pub struct TileArea {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// What all tiles share.
pub struct Shared<'a, S: Scalar, B: Scalar> {
    /// The scene.
    pub scene: &'a Compiled<S, B>,
    /// Its lights.
    pub lights: Vec<LightProgram>,
    /// What the camera may stand in.
    pub enclosing: Enclosing,
    /// Picture size.
    pub size: (usize, usize),
}

/// Buffers of one thread, reused from tile to tile.
#[derive(Default)]
pub struct TileWorker<S: Scalar, B: Scalar> {
    tracer: Tracer<B>,
    shadows: ShadowTracer<S>,
    batch: RayQueue<S>,
    reflected: RayQueue<S>,
    /// By who sent them: camera rays and what they became, or reflected ones. Refraction does not change what a ray sees.
    refracted: [RayQueue<S>; 2],
    shadow_queues: Vec<ShadowQueue<S>>,
    hits: HitList<S>,
    queries: Vec<Query<S::Lane>>,
    sums: Sums,
    media: Media,
}

impl<S: Scalar, B: Scalar> TileWorker<S, B>
where
    S::Lane: Default,
{
    /// Renders the tile into `pixels` (row by row) and counts its rays.
    pub fn render(&mut self, shared: &Shared<S, B>, area: TileArea, pixels: &mut Vec<Pixel>) -> RayCounts {
        let mut counts = RayCounts::default();
        self.media = Media::default();
        self.media.number(SmallVec::new());
        self.sums.reset(area.width * area.height);
        self.shadow_queues.resize_with(shared.lights.len(), ShadowQueue::default);

        self.batch.split_off_into(0, &mut RayQueue::default());
        push_camera_rays(shared, area, &mut self.media, &mut self.batch);
        counts.camera += self.batch.len() as u64;
        self.wave(shared, class::CAMERA, &mut counts);
        loop {
            // The longest queue first, from its end: deep rays before shallow ones.
            let lengths = [self.reflected.len(), self.refracted[0].len(), self.refracted[1].len()];
            let longest = (0..3).max_by_key(|&k| lengths[k]).unwrap_or(0);
            if lengths[longest] == 0 {
                break;
            }
            let first = lengths[longest].saturating_sub(BATCH);
            let filter = match longest {
                0 => {
                    self.reflected.split_off_into(first, &mut self.batch);
                    counts.reflect += self.batch.len() as u64;
                    class::REFLECTED
                }
                k => {
                    self.refracted[k - 1].split_off_into(first, &mut self.batch);
                    counts.refract += self.batch.len() as u64;
                    [class::CAMERA, class::REFLECTED][k - 1]
                }
            };
            self.wave(shared, filter, &mut counts);
        }
        pixels.clear();
        pixels.extend(self.sums.pixels());
        counts
    }

    /// Traces and shades the batch.
    fn wave(&mut self, shared: &Shared<S, B>, filter: u8, counts: &mut RayCounts) {
        let scene = shared.scene;
        self.hits.clear();
        let rays = &self.batch;
        for group in (0..rays.len()).step_by(GROUP * LANES) {
            self.queries.clear();
            for first in (group..rays.len().min(group + GROUP * LANES)).step_by(LANES) {
                let (lines, left, part, lanes) = rays.geometry.load(first);
                self.queries.push(Query::new(lines, left, part, S::Lane::lit(f64::INFINITY), lanes));
            }
            self.tracer.nearest(scene, &mut self.queries, filter);
            for (k, query) in self.queries.iter().enumerate() {
                let first = group + k * LANES;
                let missed = query.lanes & !query.hits();
                for lane in (0..LANES).filter(|lane| missed >> lane & 1 == 1) {
                    let row = first + lane;
                    let light = scene.background.rgb * rays.throughput.row(row);
                    let share = rays.share[row].to_f64() * scene.background.transmit;
                    self.sums.miss(rays.sink[row], light, share);
                }
                self.hits.push(scene, first, query);
            }
        }
        self.hits.sort(scene);
        let mut emit = Emit {
            sums: &mut self.sums,
            reflected: &mut self.reflected,
            refracted: &mut self.refracted[usize::from(filter == class::REFLECTED)],
            shadows: &mut self.shadow_queues,
            media: &mut self.media,
        };
        for rows in self.hits.packets() {
            shade(scene, &shared.lights, rays, &self.hits, rows, &mut emit);
        }
        for queue in &mut self.shadow_queues {
            counts.shadow += queue.len() as u64;
            self.shadows.trace(scene, queue, &mut self.tracer, &mut self.media, &mut self.sums);
            queue.clear();
        }
    }
}
