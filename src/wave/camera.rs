//! Camera rays of a tile, in blocks of four by two pixels a packet and eight by eight pixels, two of which make a group.

use super::area::{BLOCK, PACKET, TileArea};
use super::medium::Media;
use super::queue::{Carriers, Lines, Queue};
use super::shared::Shared;
use crate::csg::Scratch;
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Scalar, Vec3, each_lane, f32x8, f64x8, first_lanes};
use crate::scene::Projection;

/// The order in which a tile's pixels get their rays.
#[derive(Debug, Default)]
pub struct PixelOrder {
    /// Width and height of the tile.
    size: (usize, usize),
    /// By packet of rays, columns and rows; of the last pixel in lanes that have none.
    packets: Vec<[f64x8; 2]>,
    /// Of each pixel its place in the tile, row by row.
    places: Vec<u32>,
}

impl PixelOrder {
    /// Becomes that of tiles of a size: mostly it is.
    pub fn set(&mut self, width: usize, height: usize) {
        if self.size == (width, height) {
            return;
        }
        self.size = (width, height);
        self.packets.clear();
        self.places.clear();
        let [columns, rows] = PACKET;
        for block_y in (0..height).step_by(BLOCK) {
            for block_x in (0..width).step_by(BLOCK) {
                let across = BLOCK / columns;
                for packet in 0..BLOCK {
                    let (x, y) = (block_x + packet % across * columns, block_y + packet / across * rows);
                    let eight = (0..LANES).map(|k| (x + k % columns, y + k / columns));
                    let within = eight.filter(|&(x, y)| x < width && y < height);
                    self.places.extend(within.map(|(x, y)| (y * width + x) as u32));
                }
            }
        }
        for eight in self.places.chunks(LANES) {
            let place = |k: usize| eight[k.min(eight.len() - 1)] as usize;
            let column = f64x8::from_fn(|k| (place(k) % width) as f64);
            self.packets.push([column, f64x8::from_fn(|k| (place(k) / width) as f64)]);
        }
    }

    /// The pixels' places in the tile, row by row.
    pub fn places(&self) -> &[u32] {
        &self.places
    }
}

/// Appends the rays through the middles of the tile's pixels; each goes to the sum of its number in `order`.
pub fn push_camera_rays<S: Scalar, B: Scalar>(
    shared: &Shared<S, B>,
    area: TileArea,
    order: &PixelOrder,
    (media, scratch): (&mut Media, &mut Scratch),
    queue: &mut Queue<Carriers<S::Lane>>,
) {
    let (scene, (width, height)) = (shared.scene, shared.size);
    let camera = &scene.camera;
    let (u, v) = (Vec3::<f64x8>::splat(camera.right), Vec3::splat(camera.up));
    let l = Vec3::splat(camera.direction);
    let eye = Vec3::splat(camera.location - scene.geometry.origin);
    let mut eye_medium = None;
    let [width, height, half] = [width as f64, height as f64, 0.5].map(f64x8::lit);
    let [first_x, first_y] = [area.x, area.y].map(|first| f64x8::lit(first as f64));
    for (number, &[x, y]) in order.packets.iter().enumerate() {
        // Across the picture from -1/2 to 1/2, left to right and bottom to top.
        let s = ((first_x + x) + half) / width - half;
        let t = (height - (first_y + y) - half) / height - half;
        let (origin, dir) = match camera.projection {
            Projection::Perspective => (eye, l + u * s + v * t),
            Projection::Orthographic => (eye + u * s + v * t, l),
        };
        let dir = dir.normalize();
        // One eye stands in one place; parallel rays start in many.
        let medium = match (camera.projection, eye_medium) {
            (Projection::Perspective, Some(medium)) => medium,
            _ => shared.enclosing.media(scene, origin, media, scratch),
        };
        eye_medium = Some(medium);
        *queue.next() = Carriers {
            lines: Lines { rays: Rays { origin: origin.cast(), dir: dir.cast() }, ..Lines::default() },
            throughput: Vec3::lit(1.0),
            weight: S::Lane::lit(1.0),
            share: f32x8::lit(1.0),
            sink: each_lane(|k| (number * LANES + k) as u32),
            level: [1; LANES],
            medium,
            lanes: first_lanes(order.places.len() - number * LANES),
        };
        queue.push();
    }
    queue.flush();
}
