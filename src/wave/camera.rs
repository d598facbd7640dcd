//! Camera rays of a tile, in blocks of four by two pixels a packet and eight by eight a group.

use super::medium::Media;
use super::queue::{Cargo, RayQueue};
use super::tile::{Shared, TileArea};
use crate::compile::NO_SURFACE;
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Scalar, Vec3};
use crate::scene::Projection;

/// Appends the rays through the middles of the tile's pixels.
pub fn push_camera_rays<S: Scalar, B: Scalar>(
    shared: &Shared<S, B>,
    area: TileArea,
    media: &mut Media,
    queue: &mut RayQueue<S>,
) {
    let (scene, (width, height)) = (shared.scene, shared.size);
    let mut packet = Vec::with_capacity(LANES);
    let mut eye_medium = None;
    let mut pixels = Vec::with_capacity(area.width * area.height);
    for block_y in (0..area.height).step_by(8) {
        for block_x in (0..area.width).step_by(8) {
            for cell in 0..8 {
                let (x, y) = (block_x + cell % 2 * 4, block_y + cell / 2 * 2);
                for k in 0..LANES {
                    pixels.push((x + k % 4, y + k / 4));
                }
            }
        }
    }
    pixels.retain(|&(x, y)| x < area.width && y < area.height);
    for eight in pixels.chunks(LANES) {
        packet.clear();
        packet.extend((0..LANES).map(|k| eight[k.min(eight.len() - 1)]));
        // Across the picture from -1/2 to 1/2, left to right and bottom to top.
        let s = wide::f64x8::from_fn(|k| ((area.x + packet[k].0) as f64 + 0.5) / width as f64 - 0.5);
        let t = wide::f64x8::from_fn(|k| {
            (height as f64 - (area.y + packet[k].1) as f64 - 0.5) / height as f64 - 0.5
        });
        let camera = &scene.camera;
        let (u, v) = (Vec3::<wide::f64x8>::splat(camera.right), Vec3::splat(camera.up));
        let l = Vec3::splat(camera.direction);
        let eye = Vec3::splat(camera.location - scene.origin);
        let (origin, dir) = match camera.projection {
            Projection::Perspective => (eye, l + u * s + v * t),
            Projection::Orthographic => (eye + u * s + v * t, l),
        };
        let dir = dir.normalize();
        let narrow = |v: Vec3<wide::f64x8>| {
            Vec3::new(S::Lane::from_f64s(v.x), S::Lane::from_f64s(v.y), S::Lane::from_f64s(v.z))
        };
        let rays = Rays { origin: narrow(origin), dir: narrow(dir) };
        // One eye stands in one place; parallel rays start in many.
        let medium = match (camera.projection, eye_medium) {
            (Projection::Perspective, Some(medium)) => medium,
            _ => shared.enclosing.media(scene, origin, media),
        };
        eye_medium = Some(medium);
        let cargo = Cargo {
            throughput: Vec3::lit(1.0),
            weight: S::Lane::lit(1.0),
            share: S::Lane::lit(1.0),
            sink: std::array::from_fn(|k| (packet[k].1 * area.width + packet[k].0) as u32),
            level: [1; LANES],
            medium,
        };
        let lanes = crate::lane::Mask::<S::Lane>::first(eight.len()).bits();
        queue.push(&rays, &[NO_SURFACE; LANES], &[0; LANES], &cargo, lanes);
    }
}
