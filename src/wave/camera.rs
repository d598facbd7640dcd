//! Camera rays of a tile, in blocks of four by two pixels a packet and eight by eight pixels, two of which make a group.

use super::area::{Shared, TileArea};
use super::medium::Media;
use super::queue::{Carriers, Lines, Queue};
use crate::csg::Scratch;
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Scalar, Vec3, each_lane, f32x8, f64x8, first_lanes};
use crate::scene::Projection;

/// Edge of the blocks of pixels.
const BLOCK: usize = 8;

/// The order in which a tile's pixels get their rays.
#[derive(Debug, Default)]
pub struct PixelOrder {
    /// Width and height of the tile.
    size: (usize, usize),
    /// Column and row of each pixel.
    pixels: Vec<[u32; 2]>,
    /// Its place in the tile, row by row.
    places: Vec<u32>,
}

impl PixelOrder {
    /// Becomes that of tiles of a size: mostly it is.
    pub fn set(&mut self, width: usize, height: usize) {
        if self.size == (width, height) {
            return;
        }
        self.size = (width, height);
        self.pixels.clear();
        for block_y in (0..height).step_by(BLOCK) {
            for block_x in (0..width).step_by(BLOCK) {
                for cell in 0..BLOCK {
                    let (x, y) = (block_x + cell % 2 * 4, block_y + cell / 2 * 2);
                    let eight = (0..LANES).map(|k| (x + k % 4, y + k / 4));
                    let within = eight.filter(|&(x, y)| x < width && y < height);
                    self.pixels.extend(within.map(|(x, y)| [x as u32, y as u32]));
                }
            }
        }
        self.places.clear();
        self.places.extend(self.pixels.iter().map(|&[x, y]| y * width as u32 + x));
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
    for (number, eight) in order.pixels.chunks(LANES).enumerate() {
        let pixel = each_lane(|k| eight[k.min(eight.len() - 1)]);
        // Across the picture from -1/2 to 1/2, left to right and bottom to top.
        let s = f64x8::from_fn(|k| ((area.x as f64 + f64::from(pixel[k][0])) + 0.5) / width as f64 - 0.5);
        let t = f64x8::from_fn(|k| {
            (height as f64 - (area.y as f64 + f64::from(pixel[k][1])) - 0.5) / height as f64 - 0.5
        });
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
            lanes: first_lanes(eight.len()),
        };
        queue.push();
    }
    queue.flush();
}
