//! Sheets: triangles that cover a cell without a gap, though none of them does.
//!
//! Seen from the light every triangle is turned the same way round, by exchanging two corners if need be. Where two
//! triangles share an edge and lie on either side of it, their turned edges run against each other. Of triangles whose edges in a cell
//! all cancel so, the sum has no boundary there: every way through the cell meets as many of them as any other. One way
//! is counted, the one through the middle. The triangles' own test has no cracks between neighbours that share their
//! corners' bits, so what holds of the figure holds of the rays.
//!
//! Edges are added up as numbers that depend on their corners' bits and change their sign with the edge's direction: 64
//! bits well mixed, so that a sum of zero that is none is not to be expected.
//!
//! Places are whole numbers, so that what is told of the figure they make is exact; the figure is off by less than what cells are
//! grown by.

use super::Face;
use super::raster::{CELL_ROUNDING, DEPTH_ROUNDING, MOST_ACROSS, axes};
use crate::compile::SurfaceId;
use crate::lane::{QUAD, Quad, bits};
use glam::DVec3;
use wide::{f64x4, i32x8};

/// Corners farther across than this part of their depth might be seen through another face as well: faces overlap by 1e-3, and
/// there are cells beyond.
const WELL_WITHIN: f64 = 1.0 - 4e-3;

/// Binary places of a place in cells.
const PLACES: u32 = 19;
/// Parts of a cell.
const PARTS: i32 = 1 << PLACES;
/// What cells are grown by, in parts: more than that by what corners are rounded.
const GROWN: i32 = (CELL_ROUNDING * PARTS as f64) as i32 + 2;
/// Differences of places have products whose differences are numbers of 64 bits.
const _: () = assert!((MOST_ACROSS + 2.0) * (PARTS as f64) < (1u64 << 30) as f64);

/// A triangle that is seen well within one face.
#[derive(Debug, Clone, Copy)]
pub(super) struct Facet {
    /// Across and up, in parts of a cell from the face's first: its corners, and the first once more.
    at: [i32; 8],
    /// Halves of the corners' numbers: see [`corner`].
    keys: [u32; 3],
    /// Least and greatest depth, with room.
    pub near: f32,
    pub far: f32,
    pub surface: SurfaceId,
}

/// Four triangles as the light sees them through a face.
pub(super) struct Figures {
    /// Those that are seen well within it.
    pub within: u8,
    /// Their corners across and up, at depth 1.
    at: [[f64x4; 2]; 3],
    /// Least and greatest depth.
    depths: [f64x4; 2],
}

impl Figures {
    /// Through face number `face`, of their corners' coordinates.
    #[inline(always)]
    pub fn through(face: usize, corners: &[[f64; QUAD]; 9], location: DVec3) -> Self {
        let (along, across, up, backward) = axes(face);
        let one = f64x4::splat(1.0);
        let sign = if backward { -one } else { one };
        let seen = [0, 3, 6].map(|corner| {
            let relative = |axis: usize| {
                <f64x4 as Quad>::from_array(corners[corner + axis]) - f64x4::splat(location[axis])
            };
            let depth = relative(along) * sign;
            let share = one / depth;
            ([relative(across) * share, relative(up) * share], depth)
        });
        let at = seen.map(|(at, _)| at);
        let depths = ends(seen.map(|(_, depth)| depth));
        let far = at.as_flattened().iter().fold(f64x4::splat(0.0), |far, x| Quad::max(Quad::abs(*x), far));
        let within = Quad::le(far, f64x4::splat(WELL_WITHIN))
            & Quad::gt(depths[0], f64x4::splat(0.0))
            & Quad::gt(f64x4::splat(f64::INFINITY), depths[1]);
        Self { within: Quad::bits(within), at, depths }
    }

    /// Least and greatest coordinate across and up.
    #[inline(always)]
    pub fn ranges(&self) -> [[f64x4; 2]; 2] {
        [0, 1].map(|side| ends(self.at.map(|corner| corner[side])))
    }

    /// Calls for those of `lanes`, of which the first would have surface number `first`, as facets of `face`, which is laid out, with
    /// the cells that see them: first and last column, first and last row.
    #[inline(always)]
    pub fn each_facet(
        &self,
        lanes: u8,
        face: &Face,
        (first, slack): (SurfaceId, f64),
        mut call: impl FnMut(Facet, [[u32; 2]; 2]),
    ) {
        let parts = f64x4::splat(face.scale * f64::from(PARTS));
        let scaled =
            self.at.map(|corner| [0, 1].map(|side| (corner[side] - f64x4::splat(face.corner[side])) * parts));
        let cells = [(0, face.columns), (1, face.rows)].map(|(side, most)| {
            let [low, high] = ends(scaled.map(|corner| corner[side]));
            let cell = |at: f64x4, by: f64| (at + f64x4::splat(by)) * f64x4::splat(1.0 / f64::from(PARTS));
            // The whole number below is the one next to half less; at halfway either will do.
            let (grown, half) = (f64::from(GROWN + 1), 0.5 * f64::from(PARTS));
            let low = Quad::max(cell(low, -grown - half), f64x4::splat(0.0));
            let high = Quad::min(cell(high, grown - half), f64x4::splat(f64::from(most) - 1.0));
            [whole(low), whole(high)]
        });
        let places = scaled.map(|corner| corner.map(whole));
        let at = self.at.map(|corner| corner.map(Quad::to_array));
        let slack = f64x4::splat(slack);
        let near = (self.depths[0] * f64x4::splat(1.0 - DEPTH_ROUNDING) - slack).to_f32s().to_array();
        let far = (self.depths[1] * f64x4::splat(1.0 + DEPTH_ROUNDING) + slack).to_f32s().to_array();
        for k in bits(lanes) {
            let [[ax, ay], [bx, by], [cx, cy]] = places.map(|corner| corner.map(|lanes| lanes[k]));
            let facet = Facet {
                at: [ax, ay, bx, by, cx, cy, ax, ay],
                keys: at.map(|[across, up]| key([across[k], up[k]])),
                near: near[k],
                far: far[k],
                surface: first + k as u32,
            };
            call(facet, cells.map(|ends| ends.map(|lanes| lanes[k] as u32)));
        }
    }
}

/// The least and the greatest of three.
#[inline(always)]
fn ends([a, b, c]: [f64x4; 3]) -> [f64x4; 2] {
    [Quad::min(Quad::min(a, b), c), Quad::max(Quad::max(a, b), c)]
}

/// The whole numbers next to numbers of less than 31 bits.
#[inline(always)]
fn whole(x: f64x4) -> [i32; QUAD] {
    // Numbers of this size have no binary places, and their last bits are those of the whole number.
    const NO_PLACES: f64 = 1.5 * (1u64 << 52) as f64;
    Quad::to_array(x + f64x4::splat(NO_PLACES)).map(|x| x.to_bits() as i32)
}

/// The face that the first corner of one of four triangles is seen through.
#[inline(always)]
pub(super) fn face_of(corners: &[[f64; QUAD]; 9], k: usize, location: DVec3) -> usize {
    let point = DVec3::new(corners[0][k], corners[1][k], corners[2][k]) - location;
    let [x, y, z] = point.abs().to_array();
    let along = if x >= y && x >= z { 0 } else { 2 - usize::from(y >= z) };
    along * 2 + usize::from(point[along] < 0.0)
}

/// A cell, grown: least and greatest place, across and up by turns.
pub(super) struct Window {
    low: i32x8,
    high: i32x8,
    /// Some point of it, where regular meshes have no edges; and by turns.
    point: [i32; 2],
    points: i32x8,
}

impl Window {
    /// The cell in a column and row.
    pub fn of((column, row): (u32, u32)) -> Self {
        let [x, y] = [column, row].map(|cell| cell as i32 * PARTS);
        let turns = |[x, y]: [i32; 2]| i32x8::from([x, y, x, y, x, y, x, y]);
        let all = |by: i32| turns([x + by, y + by]);
        let point = [x + PARTS / 2 + 4321, y + PARTS / 2 - 1234];
        Self { low: all(-GROWN), high: all(PARTS + GROWN), point, points: turns(point) }
    }
}

/// Triangles of one cell, the nearest first, as far as they have been added.
#[derive(Default)]
pub(super) struct Layer {
    /// Of the edges in the cell.
    sum: u64,
    /// How many triangles the way through the window's point meets.
    over: u32,
    /// Not all could be told.
    unsure: bool,
}

impl Layer {
    /// Adds what a triangle has in the cell.
    #[inline(always)]
    pub fn add(&mut self, triangle: &Facet, cell: &Window) {
        let [ax, ay, bx, by, cx, cy, ..] = triangle.at;
        let [a, b, c] = [[ax, ay], [bx, by], [cx, cy]];
        let turned = area(a, b, c);
        // Roundings move the sides of which it is the product by a part each.
        let noise: i64 = [bx - ax, by - ay, cx - ax, cy - ay].map(|side| i64::from(side.abs())).iter().sum();
        if turned.abs() <= noise + 2 {
            self.unsure = true;
            return;
        }
        // Sides of the cell that both ends of an edge are beyond, two bits an edge.
        let at = i32x8::from(triangle.at);
        let [low, high] = [cell.low.simd_gt(at), at.simd_gt(cell.high)].map(|beyond| beyond.to_bitmask());
        let outside = (low & low >> 2) | (high & high >> 2);
        let [p, q, r] = [(0, a), (1, b), (2, c)].map(|(k, place)| corner(triangle.keys[k], place));
        let mut sum = 0u64;
        for (k, edge) in [edge(p, q), edge(q, r), edge(r, p)].into_iter().enumerate() {
            sum = sum.wrapping_add(if outside >> (2 * k) & 3 == 0 { edge } else { 0 });
        }
        self.sum = self.sum.wrapping_add(if turned < 0 { sum.wrapping_neg() } else { sum });
        // The point lies between the corners, or all of them lie on one side of it.
        let above = at.simd_gt(cell.points).to_bitmask();
        if [above, above >> 1].iter().any(|above| matches!(above & 0b10101, 0 | 0b10101)) {
            return;
        }
        let sides = [(a, b), (b, c), (c, a)].map(|(a, b)| area(a, b, cell.point).signum());
        if !sides.contains(&-turned.signum()) {
            self.unsure |= sides.contains(&0);
            self.over += 1;
        }
    }

    /// How many triangles every way through the cell meets, if that is known.
    pub fn everywhere(&self) -> Option<u32> {
        (self.sum == 0 && !self.unsure).then_some(self.over)
    }
}

/// Twice the area that three points surround: above zero if they come counterclockwise, below if clockwise.
#[inline(always)]
fn area(a: [i32; 2], b: [i32; 2], c: [i32; 2]) -> i64 {
    let less = |a: [i32; 2], b: [i32; 2]| [i64::from(a[0] - b[0]), i64::from(a[1] - b[1])];
    let (one, other) = (less(b, a), less(c, a));
    one[0] * other[1] - one[1] * other[0]
}

/// The number of a corner, which triangles that share it have alike and others do not: to take two corners for one might close a
/// gap, and half of the bits are too few where there are millions. What the place adds need not be kept.
#[inline(always)]
fn corner(key: u32, [x, y]: [i32; 2]) -> u64 {
    u64::from(key) << 32 | u64::from((x as u32).rotate_left(16) ^ y as u32)
}

/// What a corner's place at depth 1 adds to its number.
#[inline(always)]
fn key(corner: [f64; 2]) -> u32 {
    // Zeros of either sign are one.
    let [x, y] = corner.map(|x| (x + 0.0).to_bits());
    (mixed(x.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ y.rotate_left(32)) >> 32) as u32
}

/// A number for the edge between two corners, which changes its sign with the direction.
#[inline(always)]
fn edge(from: u64, to: u64) -> u64 {
    let number = mixed(from.wrapping_add(to));
    match from.cmp(&to) {
        std::cmp::Ordering::Less => number,
        std::cmp::Ordering::Equal => 0,
        std::cmp::Ordering::Greater => number.wrapping_neg(),
    }
}

/// The finishing step of splitmix64, but for its last shift.
#[inline(always)]
fn mixed(x: u64) -> u64 {
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb)
}
