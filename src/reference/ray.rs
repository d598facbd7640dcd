//! A ray, and the surface it comes from.

use glam::DVec3;

/// What sent a ray, which decides what it may see. Behind a transparent surface it stays what it was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RayKind {
    /// The camera: blind to `no_image`.
    Camera,
    /// A mirror, or total internal reflection: blind to `no_reflection`.
    Reflected,
    /// A point that asks for a light: blind to `no_shadow`.
    Shadow,
}

/// A half line in the world.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// Where it starts, scene units.
    pub origin: DVec3,
    /// Unit length, so that `t` is a distance.
    pub dir: DVec3,
    /// What sent it.
    pub kind: RayKind,
    /// The surface it starts on, if any.
    pub left: Option<Departure>,
}

/// The place a ray starts from: that surface is not met again at `t = 0`, however the arithmetic rounds.
#[derive(Debug, Clone, Copy)]
pub struct Departure {
    /// Which leaf of the world.
    pub leaf: usize,
    /// Which part of its surface (a face of a box, a triangle of a mesh).
    pub part: usize,
    /// The point in the leaf's own space, exactly as the kernel put it on the surface.
    pub local: DVec3,
}

impl Ray {
    /// A ray that starts in free space; `dir` may have any length but 0.
    pub fn new(origin: DVec3, dir: DVec3, kind: RayKind) -> Self {
        Self { origin, dir: dir.normalize(), kind, left: None }
    }
}
