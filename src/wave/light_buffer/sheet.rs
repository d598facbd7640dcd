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

use super::raster::axes;
use crate::lane::{QUAD, Quad};
use glam::DVec3;
use wide::f64x4;

/// Corners farther across than this part of their depth might be seen through another face as well: faces overlap by 1e-3, and
/// there are cells beyond.
const WELL_WITHIN: f64 = 1.0 - 4e-3;
/// Roundings of the sum of two products, each of two differences of numbers of order 1, in parts of the products: 4 are proven.
const AREA_ROUNDINGS: f64 = 8.0;

/// A triangle as the light sees it through one face.
#[derive(Debug, Clone, Copy)]
pub(super) struct Figure {
    /// Its corners across and up, at depth 1.
    at: [[f64; 2]; 3],
    /// Numbers of its edges from corner to corner, turned counterclockwise.
    edges: [u64; 3],
    /// Which way round the corners come: 1 is counterclockwise, 0 not known.
    turn: i8,
}

impl Figure {
    #[inline(always)]
    fn new(at: [[f64; 2]; 3]) -> Self {
        let [a, b, c] = at;
        let turn = turn(a, b, c);
        let [p, q, r] = at.map(key);
        let edges = [edge(p, q), edge(q, r), edge(r, p)];
        Self { at, edges: if turn < 0 { edges.map(u64::wrapping_neg) } else { edges }, turn }
    }

    /// Least and greatest coordinate across (0) or up (1).
    #[inline(always)]
    pub fn range(&self, side: usize) -> [f64; 2] {
        let [a, b, c] = self.at.map(|corner| corner[side]);
        [least(least(a, b), c), most(most(a, b), c)]
    }

    /// Corners relative to the light; `None` if they are not all seen well within one face. That face, and least and
    /// greatest depth, too.
    pub fn of(corners: [DVec3; 3]) -> Option<(usize, [f64; 2], Self)> {
        let face = face_of(corners[0]);
        let (along, across, up, backward) = axes(face);
        let depth = corners.map(|corner| if backward { -corner[along] } else { corner[along] });
        let mut at = [[0.0; 2]; 3];
        for k in 0..3 {
            let share = 1.0 / depth[k];
            at[k] = [corners[k][across] * share, corners[k][up] * share];
            let far = at[k][0].abs().max(at[k][1].abs());
            if !(depth[k] > 0.0 && depth[k] < f64::INFINITY && far <= WELL_WITHIN) {
                return None;
            }
        }
        let [a, b, c] = depth;
        Some((face, [a.min(b).min(c), a.max(b).max(c)], Self::new(at)))
    }
}

/// The smaller of two numbers that are numbers.
#[inline(always)]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger of two numbers that are numbers.
#[inline(always)]
fn most(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Four triangles as the light sees them through the face that the first of them is seen through, as [`Figure::of`] has it.
pub(super) struct Figures {
    pub face: usize,
    /// Those that are seen well within it.
    pub within: u8,
    /// Their corners across and up.
    at: [[[f64; QUAD]; 2]; 3],
    /// Least and greatest depth.
    pub depths: [[f64; QUAD]; 2],
}

impl Figures {
    /// Of their corners' coordinates.
    #[inline(always)]
    pub fn of(corners: &[[f64; QUAD]; 9], location: DVec3) -> Self {
        let first = DVec3::new(corners[0][0], corners[1][0], corners[2][0]) - location;
        let face = face_of(first);
        let (along, across, up, backward) = axes(face);
        let one = f64x4::splat(1.0);
        let sign = if backward { -one } else { one };
        let seen = [0, 3, 6].map(|corner| {
            let relative = |axis: usize| {
                <f64x4 as Quad>::from_array(corners[corner + axis]) - f64x4::splat(location[axis])
            };
            let depth = relative(along) * sign;
            let share = one / depth;
            [relative(across) * share, relative(up) * share, depth]
        });
        let least = |k: usize| Quad::min(Quad::min(seen[0][k], seen[1][k]), seen[2][k]);
        let most = |k: usize| Quad::max(Quad::max(seen[0][k], seen[1][k]), seen[2][k]);
        let [across, up, depths] = [0, 1, 2].map(|k| [least(k), most(k)]);
        let at = seen.map(|[across, up, _]| [across, up].map(Quad::to_array));
        let far = Quad::max(
            Quad::max(Quad::abs(across[0]), Quad::abs(across[1])),
            Quad::max(Quad::abs(up[0]), Quad::abs(up[1])),
        );
        let within = Quad::le(far, f64x4::splat(WELL_WITHIN))
            & Quad::gt(depths[0], f64x4::splat(0.0))
            & Quad::gt(f64x4::splat(f64::INFINITY), depths[1]);
        Self { face, within: Quad::bits(within), at, depths: depths.map(Quad::to_array) }
    }

    /// Number `k` of the four.
    #[inline(always)]
    pub fn figure(&self, k: usize) -> Figure {
        Figure::new(self.at.map(|corner| corner.map(|lanes| lanes[k])))
    }
}

/// The face that a point relative to the light is seen through.
#[inline(always)]
fn face_of(point: DVec3) -> usize {
    let [x, y, z] = point.abs().to_array();
    let along = if x >= y && x >= z { 0 } else { 2 - usize::from(y >= z) };
    along * 2 + usize::from(point[along] < 0.0)
}

/// A cell at depth 1, a little grown: least and greatest place across and up.
pub(super) struct Window {
    pub low: [f64; 2],
    pub high: [f64; 2],
}

/// Triangles of one cell, the nearest first, as far as they have been added.
#[derive(Default)]
pub(super) struct Layer {
    /// Of the edges in the cell.
    sum: u64,
    /// How many triangles the way through the cell's middle meets.
    over: u32,
    /// Not all could be told.
    unsure: bool,
}

impl Layer {
    /// Adds what a triangle has in the cell.
    #[inline(always)]
    pub fn add(&mut self, triangle: &Figure, cell: &Window) {
        let Figure { at: [a, b, c], edges, turn: round } = *triangle;
        if round == 0 {
            self.unsure = true;
            return;
        }
        // Of each corner, the sides of the cell that it is beyond.
        let beyond = |corner: [f64; 2]| {
            let [across, up] = corner;
            u8::from(across < cell.low[0])
                | u8::from(across > cell.high[0]) << 1
                | u8::from(up < cell.low[1]) << 2
                | u8::from(up > cell.high[1]) << 3
        };
        let [p, q, r] = [a, b, c].map(beyond);
        for (both, edge) in [p & q, q & r, r & p].into_iter().zip(edges) {
            self.sum = self.sum.wrapping_add(if both == 0 { edge } else { 0 });
        }
        let middle = [0, 1].map(|side| 0.5 * (cell.low[side] + cell.high[side]));
        let holds = |side: usize| {
            let [low, high] = triangle.range(side);
            (low <= middle[side]) & (middle[side] <= high)
        };
        if !(holds(0) & holds(1)) {
            return;
        }
        let sides = [turn(a, b, middle), turn(b, c, middle), turn(c, a, middle)];
        if !sides.contains(&-round) {
            self.unsure |= sides.contains(&0);
            self.over += 1;
        }
    }

    /// How many triangles every way through the cell meets, if that is known.
    pub fn everywhere(&self) -> Option<u32> {
        (self.sum == 0 && !self.unsure).then_some(self.over)
    }
}

/// 1 if three points come counterclockwise, -1 if clockwise, 0 if that cannot be told.
#[inline(always)]
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> i8 {
    let (one, other) = ((b[0] - a[0]) * (c[1] - a[1]), (b[1] - a[1]) * (c[0] - a[0]));
    let area = one - other;
    let noise = AREA_ROUNDINGS * (0.5 * f64::EPSILON) * (one.abs() + other.abs());
    i8::from(area > noise) - i8::from(area < -noise)
}

/// A number for a corner.
#[inline(always)]
fn key(corner: [f64; 2]) -> u64 {
    // Zeros of either sign are one.
    let [x, y] = corner.map(|x| (x + 0.0).to_bits());
    mixed(x.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ y.rotate_left(32))
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
