//! Pixels to rays, by the rule written at [`Camera`].

use super::ray::{Ray, RayKind};
use crate::scene::{Camera, Projection};

/// The ray through the middle of pixel (`x`, `y`), counted from the top left of a `width` by `height` picture.
pub fn ray(camera: &Camera, x: usize, y: usize, width: usize, height: usize) -> Ray {
    let s = (x as f64 + 0.5) / width as f64 - 0.5;
    let t = 0.5 - (y as f64 + 0.5) / height as f64;
    let across = s * camera.right + t * camera.up;
    let (origin, dir) = match camera.projection {
        Projection::Perspective => (camera.location, camera.direction + across),
        Projection::Orthographic => (camera.location + across, camera.direction),
    };
    Ray::new(origin, dir, RayKind::Camera)
}
