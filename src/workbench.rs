//! Rays in, hits and times out: a scene compiled as for a picture, and ray sets traced through it.
//!
//! Knows neither files nor text. Times are of the tracing alone: rays are loaded from columns, traced, and their hits
//! written to columns, which is what a picture's waves do too.

use crate::bvh::{Occupancy, Preset, Traversal};
use crate::compile::{Compiled, Instancing};
use crate::lane::Scalar;
use crate::precision::{Precision, Prepared, in_its_precision};
use crate::ray_set::{RayHits, RayQuery, RaySet};
use crate::scene::{Camera, Projection, Scene};
pub use crate::wave::FirstHit;
use crate::wave::{RayStream, StreamHits, nearest_hits, stream_occupancy, trace_stream};
use cpu_time::ProcessTime;
use glam::DVec3;
use std::time::Instant;

/// A scene that is ready for rays, and what it took to make it so.
pub struct Workbench {
    prepared: Prepared,
    pool: rayon::ThreadPool,
    /// Seconds from scene to columns and tree, of the clock on the wall.
    pub build_s: f64,
    /// The same in processor time of all threads.
    pub build_cpu_s: f64,
    /// Bytes of the tree, its leaves' columns and the tables beside them.
    pub bytes: usize,
    /// Expected box and primitive tests of a ray through the tree, by the surface-area heuristic (see
    /// [`crate::bvh::Bvh::sah`]).
    pub sah: f64,
}

/// A set's hits, and what each repetition cost.
#[derive(Debug, Clone, Default)]
pub struct Measured {
    /// Of the last repetition; all are alike.
    pub hits: RayHits,
    /// Seconds of the clock on the wall.
    pub wall_s: Vec<f64>,
    /// Seconds of processor time, summed over threads.
    pub cpu_s: Vec<f64>,
}

impl Workbench {
    /// Compiles `scene`; builds and traces with `threads` threads (0: one per processor).
    ///
    /// # Errors
    /// If threads cannot be started.
    pub fn new(
        scene: &Scene,
        precision: Precision,
        preset: Preset,
        threads: usize,
    ) -> Result<Self, rayon::ThreadPoolBuildError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let (wall, cpu) = (Instant::now(), ProcessTime::now());
        let prepared = pool.install(|| Prepared::new(scene, precision, preset, Instancing::default()));
        let (build_s, build_cpu_s) = (wall.elapsed().as_secs_f64(), cpu.elapsed().as_secs_f64());
        let (bytes, sah) =
            in_its_precision!(&prepared, scene => (scene.geometry.bytes(), scene.geometry.bvh.sah()));
        Ok(Self { prepared, pool, build_s, build_cpu_s, bytes, sah })
    }

    /// What is computed in: finer than what was asked for where that is too coarse for the scene.
    pub fn precision(&self) -> Precision {
        self.prepared.precision()
    }

    /// Threads that trace.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// What the rays through the middles of a picture's pixels hit first, in double precision, row by row.
    pub fn camera_hits(&self, camera: &Camera, width: usize, height: usize) -> Vec<Option<FirstHit>> {
        let pixel = |number: usize| pixel_ray(camera, (number % width, number / width), (width, height));
        let rays: Vec<_> = (0..width * height).map(pixel).collect();
        in_its_precision!(&self.prepared, scene => nearest_hits(scene, &rays))
    }

    /// How many lanes work in the tests of `rays`; takes one thread as long as a repetition, and some more.
    pub fn occupancy(&self, rays: &RaySet, traversal: Traversal) -> Occupancy {
        let stream = RayStream::new(rays);
        in_its_precision!(&self.prepared, scene => stream_occupancy(&scene.geometry, &stream, traversal))
    }

    /// Traces `rays` `repeat` times, at least once.
    pub fn measure(&self, rays: &RaySet, traversal: Traversal, repeat: usize) -> Measured {
        let measure = || in_its_precision!(&self.prepared, scene => measure(scene, rays, traversal, repeat));
        self.pool.install(measure)
    }
}

fn measure<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    rays: &RaySet,
    traversal: Traversal,
    repeat: usize,
) -> Measured {
    let stream = RayStream::new(rays);
    let mut hits = StreamHits::new(&stream);
    let mut measured = Measured::default();
    for _ in 0..repeat.max(1) {
        let (wall, cpu) = (Instant::now(), ProcessTime::now());
        trace_stream(&scene.geometry, &stream, traversal, &mut hits);
        measured.cpu_s.push(cpu.elapsed().as_secs_f64());
        measured.wall_s.push(wall.elapsed().as_secs_f64());
    }
    measured.hits = hits.develop(&scene.geometry, rays, &stream);
    measured
}

/// Ray sets as pictures make them: a camera's rays in blocks of 8 by 8 pixels, and what they become where they hit.
///
/// What is no ray in single precision (see [`RaySet::is_ray`]) is left out: to a light at the very hit, or from a camera out
/// of all measure.
pub struct CameraRays {
    /// Through the middles of a square picture's pixels, in Morton order within and across blocks.
    pub camera: RaySet,
    /// Row in `camera`, point (moved off the surface) and normal (towards the viewer) of each hit.
    hits: Vec<(usize, DVec3, DVec3)>,
}

/// Secondary rays start so far off the surface, as a share of the distance they were seen from, or of a thousandth of
/// the geometry's extent if that is more.
const OFF_SURFACE: f64 = 1e-4;

impl CameraRays {
    /// `size` (a multiple of 8) rays a side.
    pub fn new(bench: &Workbench, camera: &Camera, size: usize) -> Self {
        let mut set = RaySet::default();
        let mut lines = Vec::with_capacity(size * size);
        let blocks = size / 8;
        for number in 0..size * size {
            let (block, cell) = (number / 64, number % 64);
            let (bx, by) = if blocks.is_power_of_two() {
                (even_bits(block), even_bits(block >> 1))
            } else {
                (block % blocks, block / blocks)
            };
            let (x, y) = (bx * 8 + even_bits(cell), by * 8 + even_bits(cell >> 1));
            let (origin, dir) = pixel_ray(camera, (x, y), (size, size));
            let dir = dir.normalize();
            if push(&mut set, origin, dir, f32::INFINITY) {
                lines.push((origin, dir));
            }
        }
        let (found, bounds) = in_its_precision!(&bench.prepared, scene => (nearest_hits(scene, &lines), scene.geometry.bvh.bounds));
        let extent = (bounds.max - bounds.min).max_element().max(0.0);
        let hit = |(row, hit): (usize, Option<FirstHit>)| {
            let hit = hit?;
            let normal = if hit.normal.dot(lines[row].1) > 0.0 { -hit.normal } else { hit.normal };
            Some((row, hit.point + normal * (OFF_SURFACE * hit.t.max(1e-3 * extent)), normal))
        };
        let hits = found.into_iter().enumerate().filter_map(hit).collect();
        Self { camera: set, hits }
    }

    /// From the hits to `light`, which itself does not count.
    pub fn shadow(&self, light: DVec3) -> RaySet {
        let rays = self.hits.iter().map(|&(_, point, _)| (point, light - point, 0.9999));
        RaySet { query: RayQuery::Any, ..set_of(rays) }
    }

    /// Mirrored at the hits.
    pub fn mirror(&self) -> RaySet {
        set_of(self.hits.iter().map(|&(row, point, normal)| {
            let dir = DVec3::from_array(self.camera.dir.each_ref().map(|column| f64::from(column[row])));
            (point, (dir - normal * (2.0 * dir.dot(normal))).normalize(), f32::INFINITY)
        }))
    }

    /// From the hits into random directions, as a matt surface scatters light: by the cosine.
    pub fn diffuse(&self) -> RaySet {
        set_of(self.hits.iter().map(|&(row, point, normal)| {
            let (turn, share) = (random(row as u32, 1), random(row as u32, 2));
            let (a, b) = normal.any_orthonormal_pair();
            let (sin, cos) = (std::f64::consts::TAU * turn).sin_cos();
            let dir = (a * cos + b * sin) * share.sqrt() + normal * (1.0 - share).sqrt();
            (point, dir.normalize(), f32::INFINITY)
        }))
    }
}

/// Start, direction and how far.
fn set_of(rays: impl Iterator<Item = (DVec3, DVec3, f32)>) -> RaySet {
    let mut set = RaySet::default();
    for (origin, dir, far) in rays {
        push(&mut set, origin, dir, far);
    }
    set
}

/// Adds a ray from 0 to `far`, if it is one.
fn push(set: &mut RaySet, origin: DVec3, dir: DVec3, far: f32) -> bool {
    let (origin, dir) = (origin.as_vec3().to_array(), dir.as_vec3().to_array());
    let is_ray = RaySet::is_ray(origin, dir);
    if is_ray {
        set.push(origin, dir, (0.0, far));
    }
    is_ray
}

/// Start and direction (of any length) of the ray through the middle of pixel `(x, y)` of a picture of `width` by `height`.
fn pixel_ray(camera: &Camera, (x, y): (usize, usize), (width, height): (usize, usize)) -> (DVec3, DVec3) {
    let s = (x as f64 + 0.5) / width as f64 - 0.5;
    let t = 0.5 - (y as f64 + 0.5) / height as f64;
    let across = camera.right * s + camera.up * t;
    match camera.projection {
        Projection::Perspective => (camera.location, camera.direction + across),
        Projection::Orthographic => (camera.location + across, camera.direction),
    }
}

/// The number that every second bit of `bits` makes: one coordinate of a place on the Morton curve.
fn even_bits(bits: usize) -> usize {
    (0..usize::BITS / 2).fold(0, |number, k| number | (bits >> (2 * k) & 1) << k)
}

/// A number from 0 to 1 that depends on its seeds alone: two rounds of an integer hash that leaves no visible pattern.
fn random(row: u32, which: u32) -> f64 {
    let hash = |x: u32| {
        let x = (x ^ x >> 16).wrapping_mul(0x7feb_352d);
        let x = (x ^ x >> 15).wrapping_mul(0x846c_a68b);
        x ^ x >> 16
    };
    f64::from(hash(row.wrapping_mul(0x9e37_79b9).wrapping_add(hash(which.wrapping_add(0x85eb_ca6b)))))
        / (f64::from(u32::MAX) + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Tests;
    use crate::ray_set::{NO_PRIMITIVE, SAME_DISTANCE};
    use crate::scene::{Object, Shape};
    use std::sync::Arc;

    /// They used to be written to files that could not be read again.
    #[test]
    fn what_is_no_ray_is_left_out() {
        let mut camera = RaySet::default();
        camera.push([0.0, 0.0, -1.0], [0.0, 0.0, 1.0], (0.0, f32::INFINITY));
        let hits = vec![
            (0, DVec3::ZERO, -DVec3::Z),
            (0, DVec3::X, -DVec3::Z),
            (0, DVec3::Y, DVec3::NAN),
            (0, DVec3::splat(1e39), -DVec3::Z),
        ];
        let made = CameraRays { camera, hits };
        let starts = |set: RaySet| set.origin[0].clone();
        // To a light at the hit itself, and from what single precision does not reach.
        assert_eq!(starts(made.shadow(DVec3::ZERO)), [1.0, 0.0]);
        assert_eq!(starts(made.mirror()), [0.0, 1.0]);
        assert_eq!(starts(made.diffuse()), [0.0, 1.0]);
        assert!(made.shadow(DVec3::splat(1e300)).is_empty());
    }

    /// Packets that are alone, and the last of an odd number, are tested beside themselves.
    #[test]
    fn each_packet_is_counted_once() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let triangle = Object::new(Shape::Triangle { vertices: Box::new(corners), normals: None });
        let scene = Scene { objects: vec![Arc::new(triangle)], ..Scene::default() };
        let bench = Workbench::new(&scene, Precision::Fast, Preset::Balanced, 1).unwrap();
        for packets in 1..=4 {
            let mut rays = RaySet::default();
            for k in 0..8 * packets {
                let x = 0.01 * (k + 1) as f32;
                rays.push([x, 0.1, -1.0], [0.0, 0.0, 1.0], (0.0, f32::INFINITY));
            }
            let Tests { tests, lanes } = bench.occupancy(&rays, Traversal::Auto).leaf;
            assert_eq!((tests, lanes), (packets, 8 * packets));
        }
    }

    /// What all rays of a set share is kept once, and lengths of directions are computed as exactly as they must be: by single precision's
    /// own squares, or, where those would be infinite or vanish, by others.
    #[test]
    fn rays_are_hit_alike_however_they_are_given() {
        // A row of triangles, each farther off than the last, a gap beside each, and a ray to the middle of both.
        const RAYS: usize = 70;
        let middle = |k: usize| DVec3::new(k as f64 - 35.5, 0.3, 20.0 + 0.5 * k as f64);
        let triangle = |k: usize| {
            let corners =
                [DVec3::new(-0.4, -0.4, 0.0), DVec3::new(0.4, -0.4, 0.0), DVec3::new(0.0, 0.8, 0.0)];
            let vertices = Box::new(corners.map(|corner| middle(k) + corner));
            Arc::new(Object::new(Shape::Triangle { vertices, normals: None }))
        };
        let scene = Scene { objects: (0..RAYS).step_by(2).map(triangle).collect(), ..Scene::default() };
        let cases = [Precision::Fast, Precision::Exact]
            .into_iter()
            .flat_map(|precision| [1.0, 1e6, 1e-6, 1e20, 1e-21].map(|length| (precision, length)));
        for (precision, length) in cases {
            let bench = Workbench::new(&scene, precision, Preset::Balanced, 1).unwrap();
            for (one_eye, one_range, query) in [
                (true, true, RayQuery::Closest),
                (true, false, RayQuery::Any),
                (false, true, RayQuery::Any),
                (false, false, RayQuery::Closest),
            ] {
                let mut rays = RaySet { query, ..RaySet::default() };
                let mut expected = Vec::new();
                for k in 0..RAYS {
                    let eye = if one_eye { DVec3::ZERO } else { DVec3::X * (0.01 * k as f64) };
                    let (way, cut) = (middle(k) - eye, !one_range && k % 3 == 0);
                    let t = (way.length() / length) as f32;
                    let far = if cut { 0.9 * t } else { f32::INFINITY };
                    let dir = (way.normalize() * length).as_vec3().to_array();
                    rays.push(eye.as_vec3().to_array(), dir, (0.0, far));
                    expected.push((!cut && k % 2 == 0).then_some((t, k as u32 / 2)));
                }
                let RayHits { t, primitive } = bench.measure(&rays, Traversal::Auto, 1).hits;
                for (k, (expected, found)) in
                    expected.into_iter().zip(t.into_iter().zip(primitive)).enumerate()
                {
                    let case = (precision, length, one_eye, one_range, query, k);
                    match (query, expected) {
                        (RayQuery::Any, _) => assert_eq!(found.1, u32::from(expected.is_some()), "{case:?}"),
                        (RayQuery::Closest, None) => assert_eq!(found.1, NO_PRIMITIVE, "{case:?}"),
                        (RayQuery::Closest, Some((t, primitive))) => {
                            assert_eq!(found.1, primitive, "{case:?}");
                            assert!(
                                (found.0 / t - 1.0).abs() < SAME_DISTANCE,
                                "{case:?}: {} for {t}",
                                found.0
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn morton_order_walks_in_squares() {
        let places: Vec<_> = (0..8).map(|k| (even_bits(k), even_bits(k >> 1))).collect();
        assert_eq!(places, [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (3, 0), (2, 1), (3, 1)]);
    }
}
