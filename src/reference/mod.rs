//! The oracle: one ray at a time, f64, recursive, every object asked in turn.
//!
//! A [`Scene`] comes in, rows of [`Pixel`]s go out. It is written in the form every textbook gives (Whitted 1980; Glassner,
//! An Introduction to Ray Tracing, 1989): find the nearest hit, shade it with a ray to each light, reflect, refract, stop
//! at the depth limit. It shares nothing with the packet engine but the scene description, and knows no lanes, trees or
//! queues: where the two disagree, the one that is easy to read is believed.
//!
//! In reading order: `camera` makes rays; `build` resolves the scene into trees of `node`s; `shape` crosses a line with one
//! shape and `trail` with a composite; `world` tells what a ray meets first; `trace` follows a ray; `light`, `surface`,
//! `reflect`, `interior` and `pattern` say what it sees. A script's `trace` and `inside` are answered here, too, and they
//! alone by way of `box_tree`.

#![allow(clippy::neg_cmp_op_on_partial_ord, reason = "`!(x > 0.0)`: NaN fails")]

mod box_tree;
mod build;
mod camera;
mod interior;
mod light;
mod node;
mod pattern;
mod polynomial;
mod ray;
mod reflect;
mod shape;
mod surface;
mod trace;
mod trail;
mod world;

#[cfg(test)]
mod tests;

pub use box_tree::PartBox;
pub use build::Bounds;

use crate::film::{Pixel, RayCounts};
use crate::scene::{Color, Object, Pigment, Scene};
use box_tree::Tally;
use glam::DVec3;
use node::Node;
use ray::{Ray, RayKind};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use trace::Tracer;
use world::World;

/// What a camera ray meets first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the unit direction, in scene units.
    pub t: f64,
    /// The point, put back on the surface.
    pub point: DVec3,
    /// Unit normal, towards the viewer; interpolated on smooth triangles.
    pub normal: DVec3,
    /// Index into [`Scene::objects`].
    pub object: usize,
}

/// Traces one ray through the middle of each pixel.
///
/// `done` is handed, from any thread and in any order, the number of each row, its pixels and the rays they took. The
/// picture depends on nothing but the scene and its size. Rows are shared out over the threads of the current rayon pool.
pub fn render(
    scene: &Scene,
    width: usize,
    height: usize,
    done: &(dyn Fn(usize, &[Pixel], &RayCounts) + Sync),
) -> RayCounts {
    if width == 0 {
        return RayCounts::default();
    }
    let world = World::new(scene);
    let row = |y: usize| {
        let mut tracer = Tracer::new(&world);
        let pixel = |x| tracer.camera_ray(&camera::ray(&scene.camera, x, y, width, height));
        let pixels: Vec<Pixel> = (0..width).map(pixel).collect();
        done(y, &pixels, &tracer.counts);
        tracer.counts
    };
    // One row at a time: rows are not alike, and a stretch that a thread has begun is not shared any more.
    let counts: Vec<RayCounts> = (0..height).into_par_iter().with_max_len(1).map(row).collect();
    let mut total = RayCounts::default();
    counts.iter().for_each(|counts| total.add(counts));
    total
}

/// What a camera ray from `origin` along `dir` (any length but 0) meets first, for comparing engines hit by hit.
///
/// Resolves the scene anew on every call; for many rays use [`nearest_hits`].
pub fn nearest_hit(scene: &Scene, origin: DVec3, dir: DVec3) -> Option<Hit> {
    nearest_hits(scene, &[(origin, dir)]).pop().flatten()
}

/// One object, made ready to be asked any number of times.
pub struct Solid {
    node: Node,
    tally: Tally,
}

impl Solid {
    /// Resolves the object; takes some hundred bytes for each of its parts. `bounds` tells what holds a shape, its inside too, in
    /// the space that its transform leads to, if anything does; lines need not look where there is none.
    pub fn new(object: &Arc<Object>, bounds: Bounds) -> Self {
        let tally = Tally::default();
        Self { node: build::alone(object, bounds, &tally), tally }
    }

    /// What a line from `origin` along the unit `dir` meets first; the normal points out of the object.
    pub fn meet(&self, origin: DVec3, dir: DVec3) -> Option<Hit> {
        let ray = Ray::new(origin, dir, RayKind::Camera);
        let hit = world::nearest(std::slice::from_ref(&self.node), &ray, f64::INFINITY)?;
        let normal = if hit.backside { -hit.normal } else { hit.normal };
        Some(Hit { t: hit.t, point: hit.face.point, normal, object: 0 })
    }

    /// How many boxes and parts have been held against lines so far.
    pub fn asked(&self) -> u64 {
        self.tally.load(Ordering::Relaxed)
    }

    /// True if `point` is inside.
    pub fn contains(&self, point: DVec3) -> bool {
        /// Counting goes along any line; this unit vector is along no face of what people build.
        const ASKEW: DVec3 = DVec3::new(0.48, 0.6, 0.64);
        self.node.trail(&Ray::new(point, ASKEW, RayKind::Camera)).is_inside_at_start()
    }
}

/// The colour of a pigment at a point of the space it stands in, by the usual noise.
pub fn pigment_color(pigment: &Pigment, point: DVec3) -> Color {
    pattern::color(pigment, point, Default::default())
}

/// [`nearest_hit`] for many rays `(origin, dir)`, in their order.
pub fn nearest_hits(scene: &Scene, rays: &[(DVec3, DVec3)]) -> Vec<Option<Hit>> {
    let world = World::new(scene);
    let nearest = |&(origin, dir): &(DVec3, DVec3)| {
        let hit = world.nearest(&Ray::new(origin, dir, RayKind::Camera), f64::INFINITY)?;
        Some(Hit { t: hit.t, point: hit.face.point, normal: hit.normal, object: hit.object })
    };
    rays.par_iter().map(nearest).collect()
}
