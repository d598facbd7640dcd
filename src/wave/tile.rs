//! One tile of the picture, from its camera rays to its pixels, by one thread and without a lock.

use super::area::TileArea;
use super::camera::{PixelOrder, push_camera_rays};
use super::emit::Emit;
use super::hit_list::{HitList, Sender};
use super::item_buffer::TileItems;
use super::medium::Media;
use super::query::Query;
use super::queue::{Batch, Carriers, Feelers, Queue};
use super::regroup::WINDOW;
use super::shade::{Shading, shade};
use super::shadow::ShadowTracer;
use super::shared::Shared;
use super::shown::Shown;
use super::sums::Sums;
use super::trace::Tracer;
use crate::bvh::{Occupancy, Traversal};
use crate::compile::class;
use crate::csg::Scratch;
use crate::film::{PacketCounts, Pixel, RayCounts};
use crate::lane::{LANES, Lane, Scalar, Vec3, f32x8};

/// Packets that are traced and shaded together. A tile's camera rays are one batch; what they spawn is worked off from
/// the end in batches of this size, so that waiting rays stay few however deep the recursion goes.
const BATCH: usize = 128;

/// Shadow rays of a light wait for so many packets, or for the end of the tile: as many as are put together anew at a time. (With 8 that
/// is what one batch sends, and those of its neighbours do not come together: behind glass and among leaves pictures took
/// 1.13 of the time, others 0.97 to 1.02.)
const SHADOW_BATCH: usize = WINDOW;
/// Of all lights together so many wait, about: with many lights each waits for fewer, so that a thread keeps megabytes, not
/// gigabytes.
const SHADOWS_WAITING: usize = 4096;
/// But so many in any case.
const LEAST_SHADOW_BATCH: usize = 8;

/// So many packets of hits are shaded together: each step of shading for all of them.
const SHADED_TOGETHER: usize = 16;

/// Buffers of one thread, reused from tile to tile.
pub struct TileWorker<S: Scalar, B: Scalar> {
    tracer: Tracer<B>,
    shadows: ShadowTracer<S>,
    batch: Batch<Carriers<S::Lane>>,
    camera: Queue<Carriers<S::Lane>>,
    reflected: Queue<Carriers<S::Lane>>,
    /// By who sent them: camera rays and what they became, or reflected ones. Refraction does not change what a ray sees.
    refracted: [Queue<Carriers<S::Lane>>; 2],
    shadow_queues: Vec<Queue<Feelers<S::Lane>>>,
    /// What these wait for.
    shadow_batch: usize,
    hits: HitList<S::Lane>,
    shadings: Vec<Shading<S::Lane>>,
    queries: Vec<Query<S::Lane>>,
    sums: Sums,
    media: Media,
    /// For what the eye is in.
    scratch: Scratch,
    shown: Shown,
    order: PixelOrder,
    /// What shading has counted.
    counts: PacketCounts,
}

impl<S: Scalar, B: Scalar> TileWorker<S, B> {
    /// Buffers of a thread whose rays go through the tree in this way and that, if asked, counts how many lanes work.
    pub fn new(shared: &Shared<S, B>, traversal: Traversal, count: bool) -> Self {
        let mut tracer = Tracer::with(traversal);
        if count {
            tracer.count();
        }
        let mixed = !traversal.wants_octants(&shared.scene.geometry.bvh);
        // A packet that is taken apart may fill eight.
        let carriers = |size| Queue::new(size, BATCH + LANES, mixed);
        let shadow_batch = SHADOWS_WAITING / shared.lights.len().max(1);
        let shadow_batch = shadow_batch.clamp(LEAST_SHADOW_BATCH, SHADOW_BATCH);
        // What waits until there are enough, and about what a batch of rays adds to it.
        let feelers = || Queue::new(usize::MAX, shadow_batch + shadow_batch.min(BATCH), mixed);
        Self {
            tracer,
            shadows: ShadowTracer::new(traversal),
            batch: Batch::default(),
            camera: carriers(usize::MAX),
            reflected: carriers(BATCH),
            refracted: [carriers(BATCH), carriers(BATCH)],
            shadow_queues: shared.lights.iter().map(|_| feelers()).collect(),
            shadow_batch,
            hits: HitList::default(),
            shadings: Vec::new(),
            queries: Vec::new(),
            sums: Sums::default(),
            media: Media::default(),
            scratch: Scratch::default(),
            shown: Shown::default(),
            order: PixelOrder::default(),
            counts: PacketCounts::default(),
        }
    }

    /// What was tested so far, if that is counted.
    pub fn occupancy(&self) -> Occupancy {
        self.tracer.occupancy()
    }

    /// Renders the tile into `pixels` (row by row) and counts its rays.
    pub fn render(&mut self, shared: &Shared<S, B>, area: TileArea, pixels: &mut Vec<Pixel>) -> RayCounts {
        self.media.begin_tile();
        self.hits.begin_tile();
        self.shadows.begin_tile();
        self.sums.reset(area.width * area.height);
        self.order.set(area.width, area.height);
        let around = (&mut self.media, &mut self.scratch);
        push_camera_rays(shared, area, &self.order, around, &mut self.camera);
        let camera = self.camera.take_count();
        self.camera.take(&mut self.batch);
        self.wave(shared, Sender::Camera, shared.items.as_ref().and_then(|items| items.of_tile(area)));
        loop {
            // The longest queue first, from its end: deep rays before shallow ones.
            let lengths = [self.reflected.len(), self.refracted[0].len(), self.refracted[1].len()];
            let longest = (0..3).max_by_key(|&k| lengths[k]).unwrap_or(0);
            if lengths[longest] == 0 {
                // Only packets that are not full are left: of hits first, which fill those of rays.
                if self.flush_hits(shared) {
                    continue;
                }
                self.reflected.flush();
                self.refracted.iter_mut().for_each(Queue::flush);
                if self.reflected.len() + self.refracted[0].len() + self.refracted[1].len() == 0 {
                    break;
                }
                continue;
            }
            let (queue, sender) = match longest {
                0 => (&mut self.reflected, Sender::Mirror),
                1 => (&mut self.refracted[0], Sender::Camera),
                _ => (&mut self.refracted[1], Sender::Mirror),
            };
            queue.take(&mut self.batch);
            self.wave(shared, sender, None);
        }
        let Self { shadows, shadow_queues, tracer, media, sums, .. } = self;
        let mut shadow = 0;
        for (light, queue) in shadow_queues.iter_mut().enumerate() {
            queue.flush();
            shadow += queue.take_count();
            let cones = shared.lights[light].cones();
            shadows.trace(shared.scene, (light, cones, queue), tracer, media, sums);
        }
        // From the order of the rays to rows.
        pixels.resize(area.width * area.height, Pixel::default());
        for (pixel, &place) in self.sums.pixels().zip(self.order.places()) {
            pixels[place as usize] = pixel;
        }
        let reflect = self.reflected.take_count();
        let refract = self.refracted.iter_mut().map(Queue::take_count).sum();
        let counts = std::mem::take(&mut self.counts);
        shadow += counts.answered;
        let packets = PacketCounts {
            camera: self.camera.take_packet_count(),
            shadow: self.shadow_queues.iter_mut().map(Queue::take_packet_count).sum(),
            reflect: self.reflected.take_packet_count(),
            refract: self.refracted.iter_mut().map(Queue::take_packet_count).sum(),
            ..counts
        };
        RayCounts { camera, shadow, reflect, refract, packets }
    }

    /// Traces and shades the batch, and the shadow rays of the lights that have enough of them. Of camera rays it may be known what is
    /// seen in the tile's blocks of pixels.
    fn wave(&mut self, shared: &Shared<S, B>, sender: Sender, items: Option<TileItems>) {
        let Self { batch, queries, tracer, hits, shadings, shown, sums, media, .. } = self;
        let (shadow_queues, shadows, scene) = (&mut self.shadow_queues, &mut self.shadows, shared.scene);
        let background = Vec3::splat(scene.background.rgb);
        let filter = match sender {
            Sender::Camera => class::CAMERA,
            Sender::Mirror => class::REFLECTED,
        };
        let (reflected, refracted, counts) = (&mut self.reflected, &mut self.refracted, &mut self.counts);
        let mut emit = Emit { sums, reflected, refracted, shadows: shadow_queues, media, counts };
        let lights = &shared.lights;
        let size = scene.geometry.group_size();
        for (number, group) in batch.by_octant(size).enumerate() {
            queries.resize(group.len(), Query::default());
            for (query, rays) in queries.iter_mut().zip(group.clone()) {
                query.aim(&rays.lines, S::Lane::lit(f64::INFINITY), rays.lanes);
            }
            match &items {
                Some(items) => {
                    let blocks = std::array::from_fn(|k| items.of_block(number * size / LANES + k));
                    tracer.nearest_among(&scene.geometry, queries, filter, &blocks);
                }
                None => tracer.nearest(&scene.geometry, queries, filter),
            }
            for (rays, query) in group.zip(&mut *queries) {
                let missed = query.lanes & !query.hits();
                if missed != 0 {
                    emit.sums.add(&rays.sink, background.mul(rays.throughput), missed);
                    if scene.background.transmit != 0.0 {
                        let share = rays.share * f32x8::lit(scene.background.transmit);
                        emit.sums.add_transmit(&rays.sink, share, missed);
                    }
                }
                hits.take(scene, rays, query, sender, shown);
                if hits.ready() >= SHADED_TOGETHER {
                    shade(scene, lights, hits.all_ready(), shadings, &mut emit);
                }
            }
        }
        shade(scene, lights, hits.all_ready(), shadings, &mut emit);
        for (light, queue) in shadow_queues.iter_mut().enumerate() {
            if queue.len() >= self.shadow_batch {
                let cones = lights[light].cones();
                shadows.trace(scene, (light, cones, queue), tracer, media, sums);
            }
        }
    }

    /// Shades the hits that wait; false if there are none.
    fn flush_hits(&mut self, shared: &Shared<S, B>) -> bool {
        let Self { hits, shadings, sums, media, shadow_queues, reflected, refracted, counts, .. } = self;
        let flushed = hits.flush();
        let mut emit = Emit { sums, reflected, refracted, shadows: shadow_queues, media, counts };
        shade(shared.scene, &shared.lights, hits.all_ready(), shadings, &mut emit);
        flushed
    }
}
