//! Where rays meet shapes: one file per shape, each with its columns and its kernel, eight rays at a time.
//!
//! A kernel is written once over [`Lane`] and knows nothing of trees, materials or light. It answers three questions
//! about a primitive: where eight rays cross it ([`Block::roots`]), what the surface is like there ([`Block::resolve`]),
//! and what box it fits in ([`Block::bounds`]). For constructive geometry it also says where a ray goes in and out
//! ([`Block::boundary`], [`Block::starts_inside`]), which is not the same for shapes that lack a part of their skin.
//!
//! There is no global epsilon. A ray that starts on a surface says which one it left ([`Left`]), and the kernel leaves
//! that crossing out by algebra, not by a distance.

mod aabb;
mod aabox;
mod ball;
mod coin;
mod cone;
mod disc;
mod ellipsoid;
mod fours;
mod frame;
mod lobe;
mod obox;
mod outline;
mod plane;
mod polygon;
mod polynomial;
mod polytope;
mod quartic;
mod ranks;
mod slab;
mod solid;
mod sphere;
mod torus;
mod triangle;
mod univariate;
mod zeros;

pub use aabb::Aabb;
pub use aabox::Boxes;
pub use ball::Ball;
pub use cone::{ClosedCones, Cones, Cylinders, OpenCones, OpenCylinders};
pub use disc::Discs;
pub use ellipsoid::Ellipsoids;
pub use lobe::{Lobe, Lobes};
pub use obox::OrientedBoxes;
pub use outline::{Center, LinePairs, Outlines, Passing, PluckerLines};
pub use plane::Planes;
pub use polygon::Polygons;
pub use polynomial::Polynomials;
pub use polytope::{HalfSpace, Quadric, bounds_of};
pub use ranks::{NO_SURFACE, Ranks, SurfaceId};
pub use solid::{OwnSpace, Solid};
pub use sphere::Spheres;
pub use torus::Tori;
pub use triangle::{SmoothTriangles, Triangles};

use crate::lane::{LANES, Lane, Mask, QUAD, Quad, Scalar, Vec3, bits, equal_lanes, f32x8};
use crate::parallel;
use glam::DVec3;

/// Eight rays with unit directions.
#[derive(Debug, Clone, Copy, Default)]
pub struct Rays<L> {
    /// Where they start, in the compiled scene's space.
    pub origin: Vec3<L>,
    /// Unit directions. In a primitive's own space a direction may have another length; `t` is the same in both.
    pub dir: Vec3<L>,
}

impl<L: Lane> Rays<L> {
    /// Becomes rays from `origin` along `dir`: number by number, as a copy of the whole is a call that takes longer.
    #[inline(always)]
    pub fn set(&mut self, origin: &Vec3<L>, dir: &Vec3<L>) {
        let Self { origin: from, dir: along } = self;
        (from.x, from.y, from.z) = (origin.x.in_register(), origin.y.in_register(), origin.z.in_register());
        (along.x, along.y, along.z) = (dir.x.in_register(), dir.y.in_register(), dir.z.in_register());
    }
}

/// Where eight rays look for a crossing.
#[derive(Debug, Clone, Copy)]
pub struct Looking<L> {
    /// Beyond this,
    pub from: L,
    /// and up to here.
    pub to: L,
    /// Lanes that look at all.
    pub lanes: u8,
    /// Whether there is a crossing is all they ask: any place there will do for it.
    pub any: bool,
}

/// What a look in single precision has told of eight rays and a primitive.
#[derive(Debug, Clone, Copy)]
pub struct Screened {
    /// Lanes that may meet it.
    pub may_meet: Mask<f32x8>,
    /// Where lanes that ask for any are within it: NaN in those of which that is not known.
    pub met_at: f32x8,
}

impl Screened {
    /// Nothing, but which lanes look.
    #[inline(always)]
    pub fn unknown(lanes: Mask<f32x8>) -> Self {
        Self { may_meet: lanes, met_at: f32x8::lit(f64::NAN) }
    }

    /// True if all rays miss it.
    #[inline(always)]
    pub fn is_missed(&self) -> bool {
        (self.may_meet | self.met_at.equal(self.met_at)).none()
    }
}

/// One of eight rays, and how it sees corners: every number in four lanes, as it is held against four rows at a time.
#[derive(Debug, Clone, Copy)]
pub struct Ray<S: Scalar> {
    origin: Four<S::Quad>,
    dir: Four<S::Quad>,
    view: [Four<S::Quad>; 2],
}

impl<S: Scalar> Ray<S> {
    /// The ray in lane `lane`; it sees corners if `to_corners`.
    #[inline(always)]
    pub fn of(rays: &Rays<S::Lane>, lane: usize, to_corners: bool) -> Self {
        let one = |v: &Vec3<S::Lane>| in_four([v.x.lanes()[lane], v.y.lanes()[lane], v.z.lanes()[lane]]);
        let (origin, dir) = (one(&rays.origin), one(&rays.dir));
        let view = if to_corners { triangle::view_in_four(dir) } else { [Four::default(); 2] };
        Self { origin, dir, view }
    }
}

/// A vector in four lanes: its components.
type Four<Q> = [Q; 3];

/// The same vector in all four lanes.
#[inline(always)]
fn in_four<Q: Quad>(v: [Q::Scalar; 3]) -> Four<Q> {
    v.map(Q::splat)
}

/// Scalar product, in the order that [`Vec3::dot`] has.
#[inline(always)]
fn dot_four<Q: Quad>(a: Four<Q>, b: Four<Q>) -> Q {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Vector product, in the order that [`Vec3::cross`] has.
#[inline(always)]
fn cross_four<Q: Quad>(a: Four<Q>, b: Four<Q>) -> Four<Q> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a - b`.
#[inline(always)]
fn less_four<Q: Quad>(a: Four<Q>, b: Four<Q>) -> Four<Q> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The rays among eight that start on the primitive at hand.
///
/// The crossing at the start is known to be `t = 0`; what a kernel returns for it is exactly that, so that it is
/// never a hit (hits have `t > 0`) and still counts for what is inside.
#[derive(Debug, Clone, Copy)]
pub struct Left<L> {
    /// Lanes that start on this primitive.
    pub on: Mask<L>,
    /// Which of its smooth parts they start on (see [`Surfaces::part`]), in every lane.
    pub part: [u8; LANES],
}

impl<L: Lane> Left<L> {
    /// The lanes that start on part `part` of the primitive.
    #[inline(always)]
    pub fn on_part(&self, part: u8) -> Mask<L> {
        // All eight bytes at once: the top bit of each that differs, then the others' bits side by side.
        let differ = u64::from_le_bytes(self.part) ^ (u64::from(part) * (u64::MAX / 0xff));
        let low = u64::MAX / 0xff * 0x7f;
        let same = !(((differ & low) + low) | differ) & !low;
        let bits = (same >> 7).wrapping_mul(0x0102_0408_1020_4080) >> 56;
        self.on & Mask::from_bits(bits as u8)
    }
}

/// The surface at eight hits.
#[derive(Debug, Clone, Copy, Default)]
pub struct Surfaces<L> {
    /// Hit points, projected on the primitive.
    pub point: Vec3<L>,
    /// Unit normals, outward where the shape has an outside; shading normals on smooth triangles.
    pub normal: Vec3<L>,
    /// First and second barycentric coordinate on triangles (the weights of the second and third corner); else zero.
    pub u: L,
    /// See `u`.
    pub v: L,
    /// Which smooth part of the primitive was hit: 0 for shapes of one piece, else as the shape's file says.
    pub part: [u8; LANES],
}

impl<L: Lane> Surfaces<L> {
    /// See [`Lane::in_register`].
    #[inline(always)]
    pub fn in_register(self) -> Self {
        let Self { point, normal, u, v, part } = self;
        let (point, normal) = (point.map(L::in_register), normal.map(L::in_register));
        Self { point, normal, u: u.in_register(), v: v.in_register(), part }
    }

    /// Takes the lanes of `mask` from `other`.
    #[inline(always)]
    pub fn put(&mut self, other: &Self, mask: Mask<L>) {
        self.point = Vec3::select(mask, other.point, self.point);
        self.normal = Vec3::select(mask, other.normal, self.normal);
        self.u = mask.select(other.u, self.u);
        self.v = mask.select(other.v, self.v);
        for k in bits(mask.bits()) {
            self.part[k] = other.part[k];
        }
    }
}

/// Of roots, NaN for none, those next to `t`; `t` where there is none.
#[inline(always)]
pub(crate) fn next_to<L: Lane>(roots: &[L], t: L) -> L {
    let (mut next, mut gap) = (t, L::lit(f64::INFINITY));
    for &root in roots {
        let this = (root - t).abs();
        let closer = this.lt(gap);
        (next, gap) = (closer.select(root, next), closer.select(this, gap));
    }
    next
}

/// The same of primitives `index`, in the lanes of `loose`.
#[inline(never)]
fn roots_next_to<S: Scalar, B: Block<S>>(
    block: &B,
    index: &[u32; LANES],
    loose: Mask<S::Lane>,
    rays: &Rays<S::Lane>,
    t: S::Lane,
) -> S::Lane {
    let (mut next, mut waiting) = (t, loose.bits());
    while waiting != 0 {
        let row = index[waiting.trailing_zeros() as usize & (LANES - 1)];
        let same = equal_lanes(index, row) & waiting;
        waiting &= !same;
        let root = next_to(block.roots(row as usize, rays, None).as_ref(), t);
        next = Mask::from_bits(same).select(root, next);
    }
    next
}

/// The columns of one kind of primitive, `len` rows, and its kernel.
pub trait Block<S: Scalar>: Default + Send + Sync {
    /// True if [`Block::boundary`] is not the same as [`Block::roots`].
    const SKIN_IS_PARTIAL: bool = false;
    /// True if a call costs something beside the test of a row: then walks have it inlined.
    const SHORT: bool = false;
    /// Crossings by lane: `[L; ROOTS]`.
    type Roots: AsRef<[S::Lane]>;

    /// Rows.
    fn len(&self) -> usize;

    /// Bytes of a row; 0 for kinds that scenes do not have in such numbers that it matters.
    fn row_bytes(&self) -> usize {
        0
    }

    /// True without rows.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All crossings of eight rays with primitive `i`, also those behind the start, in rising order; NaN where there
    /// is none (a lane's crossings come first, its NaNs last; of polynomials NaN stands anywhere).
    ///
    /// Crossings of a bounded solid come in pairs, into it and out of it (a ray that touches gets the same `t`
    /// twice, or nothing); a half space has one. With `left`, the crossing at the start is returned as exactly 0.
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> Self::Roots;

    /// The first crossing beyond where the rays look from; NaN where there is none. What is told of lanes that do not look, or
    /// of crossings farther than they look, may be anything that is not nearer than those. Those that ask for any are told of one
    /// somewhere where they look, not at its end.
    #[inline(always)]
    fn first(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        left: Option<&Left<S::Lane>>,
        looking: &Looking<S::Lane>,
    ) -> S::Lane {
        first_beyond(self.roots(i, rays, left).as_ref().iter().copied(), looking.from)
    }

    /// True if a short look in single precision tells of most rays that they miss a row. Walks have it inlined, and only call what
    /// goes on from there.
    const SCREENED: bool = false;

    /// That look, by rays none of which starts on primitive `i`.
    #[inline(always)]
    fn screen(&self, _i: usize, _rays: &Rays<S::Lane>, looking: &Looking<S::Lane>) -> Screened {
        Screened::unknown(Mask::from_bits(looking.lanes))
    }

    /// [`Block::first`] of rays that have been screened and start elsewhere: the same, to the bit.
    #[inline(always)]
    fn first_screened(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        looking: &Looking<S::Lane>,
        screened: Screened,
    ) -> S::Lane {
        self.first(i, rays, None, &Looking { lanes: screened.may_meet.bits(), ..*looking })
    }

    /// Asks the memory for row `i` and its neighbours, which will soon be tested.
    #[inline(always)]
    fn prefetch(&self, _i: usize) {}

    /// True if the kind has a test of one ray against four rows.
    const ACROSS: bool = false;

    /// The first crossing beyond `limits.0` (at least 0) of one ray with each of the rows `4 * four` to `4 * four + 3`, a
    /// row a lane, as eight rays would have it, to the bit; and the lanes where there is one that is not beyond
    /// `limits.1`. The ray starts on the rows whose bit is set in `left`, one at most. Rows past the end hold anything.
    #[inline(always)]
    fn near_in_four(&self, _four: usize, _ray: &Ray<S>, _limits: (S, S), _left: u8) -> (S::Quad, u8) {
        (S::Quad::default(), 0)
    }

    /// True if [`Block::near_in_four`] has a crossing with one of the rows of `rows` that is before `limits.1`.
    #[inline(always)]
    fn blocked_in_four(&self, four: usize, ray: &Ray<S>, limits: (S, S), (rows, left): (u8, u8)) -> bool {
        if let Some(blocked) = self.told_in_four(four, ray, limits, (rows, left)) {
            return blocked;
        }
        let (t, near) = self.near_in_four(four, ray, limits, left);
        let near = near & rows;
        // Nothing is at the limit itself.
        near != 0 && (0..QUAD).any(|k| near >> k & 1 == 1 && t.to_array()[k] < limits.1)
    }

    /// The same, where a kind can tell for less than its crossings cost.
    #[inline(always)]
    fn told_in_four(&self, _four: usize, _ray: &Ray<S>, _limits: (S, S), _rows: (u8, u8)) -> Option<bool> {
        None
    }

    /// True if most rays can be told to meet a row, or to miss it, for less than its test costs: by its outline.
    const OUTLINED: bool = false;

    /// The outlines of rows `4 * four` to `4 * four + 3`. Rows past the end hold anything.
    #[inline(always)]
    fn outlines(&self, _four: usize, _center: &Center<S>) -> Outlines {
        Outlines::default()
    }

    /// A bit for each ray that passes through the outline of primitive `i`.
    #[inline(always)]
    fn through(&self, _i: usize, _rays: &Rays<S::Lane>) -> u8 {
        0
    }

    /// [`Block::first`] of rays of which it is known through which of the rows `4 * four` to `4 * four + 3` they are passing, none
    /// through two, and which start on none of them: the same, to the bit. NaN for the other rays.
    #[inline(always)]
    fn first_through(
        &self,
        _four: usize,
        _passing: Passing,
        _rays: &Rays<S::Lane>,
        _from: S::Lane,
    ) -> S::Lane {
        S::Lane::lit(f64::NAN)
    }

    /// Lanes of `left.on` that leave primitive `i` for good: none of their crossings lies ahead. Only
    /// lanes for which that is cheap to say.
    #[inline(always)]
    fn left_behind(&self, _i: usize, _rays: &Rays<S::Lane>, _left: &Left<S::Lane>) -> u8 {
        0
    }

    /// Where a ray crosses a typical row nearer than this, single precision may not tell the distance within 1e-5 of itself, since what
    /// it is worked out from is so much longer; [`Block::sharpened`] does. 0 for kinds that do not ask for it.
    fn blurred(&self) -> f64 {
        0.0
    }

    /// The distance along the ray from `origin` along `dir`, which crosses primitive `i` at about `t`: in double precision.
    fn sharpened(&self, _i: usize, _origin: DVec3, _dir: DVec3, t: f64) -> f64 {
        t
    }

    /// Where eight rays change between outside and inside of primitive `i`, in the form of [`Block::roots`].
    ///
    /// The crossings themselves, except where a shape's surface is not all of its boundary: open cones and cylinders
    /// are closed by their caps for this purpose, a disc is its whole plane, a spindle torus has no hollow core,
    /// and triangles and polygons have no inside, so nothing. Wherever a crossing of [`Block::roots`] is part of
    /// the boundary, both give the same bits.
    #[inline(always)]
    fn boundary(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> Self::Roots {
        self.roots(i, rays, left)
    }

    /// Whether the far end of each ray's line, where `t` is minus infinity, is inside primitive `i`: never for
    /// bounded shapes. With the crossings of [`Block::boundary`] this tells inside from outside all along the line.
    #[inline(always)]
    fn starts_inside(&self, _i: usize, _rays: &Rays<S::Lane>) -> Mask<S::Lane> {
        Mask::none_set()
    }

    /// Adds the crossings of [`Block::roots`] to `out`, NaN anywhere; says which lanes are inside before all of these. Of rays that only
    /// look between two distances crossings elsewhere may be left out, and lanes that do not look may be told anything.
    #[inline(always)]
    fn cross(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        left: Option<&Left<S::Lane>>,
        _looking: Option<&Looking<S::Lane>>,
        out: &mut Vec<S::Lane>,
    ) -> Mask<S::Lane> {
        out.extend(self.roots(i, rays, left).as_ref().iter().map(|root| root.in_register()));
        self.starts_inside(i, rays)
    }

    /// The surface of primitive `index[k]` at `t[k]` along ray `k`. Lanes outside `active` hold anything.
    fn resolve(
        &self,
        index: &[u32; LANES],
        active: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
    ) -> Surfaces<S::Lane>;

    /// The same of rays that start elsewhere, of which those of `loose` cross at the root next to `t`, as it is `kept`: and where that is. (Who
    /// has to work the roots out to know the surface gives them for nothing.)
    #[inline(always)]
    fn resolve_next_to(
        &self,
        index: &[u32; LANES],
        loose: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
        kept: impl Fn(S::Lane) -> S::Lane,
    ) -> (S::Lane, Surfaces<S::Lane>) {
        let t = if loose.any() { kept(roots_next_to(self, index, loose, rays, t)) } else { t };
        (t, self.resolve(index, Mask::all_set(), rays, t))
    }

    /// Primitive `i` as a body; `None` where its surface is not all of the boundary, or not a boundary at all.
    fn solid(&self, _i: usize) -> Option<Solid> {
        None
    }

    /// What primitive `i` is the convex hull of, or lies within; `None` if that is not told.
    fn lobes(&self, i: usize) -> Option<Lobes> {
        self.solid(i).and_then(|solid| solid.lobes())
    }

    /// The corners' coordinates of triangles `4 * four` to `4 * four + 3`, if they are triangles. Rows past the end hold
    /// anything.
    #[inline(always)]
    fn corners_in_four(&self, _four: usize) -> Option<[[f64; QUAD]; 9]> {
        None
    }

    /// A box that holds primitive `i`, rounding of the columns included.
    fn bounds(&self, i: usize) -> Aabb;

    /// Boxes that together hold primitive `i`, for a tree that looks better at a long primitive piece by piece: none
    /// larger than it must be, but at most `most`, and none cut further whose half area is at most `least`.
    fn pieces(&self, i: usize, _least: f64, _most: usize, out: &mut Vec<Aabb>) {
        out.push(self.bounds(i));
    }

    /// Row `k` becomes the former row `order[k]`.
    fn permute(&mut self, order: &[u32]);
}

/// The first of rising crossings that lies beyond `from`, NaN where none does.
#[inline(always)]
pub(crate) fn first_beyond<L: Lane>(roots: impl DoubleEndedIterator<Item = L>, from: L) -> L {
    let mut t = L::lit(f64::NAN);
    for root in roots.rev() {
        t = root.gt(from).select(root, t);
    }
    t
}

/// Helper for [`Block::blurred`]: the mean of some thousand of the rows' `f`.
pub(crate) fn typical(rows: usize, f: impl Fn(usize) -> f64) -> f64 {
    let (mut sum, mut asked) = (0.0, 0);
    for i in (0..rows).step_by(rows / 4096 + 1) {
        (sum, asked) = (sum + f(i), asked + 1);
    }
    sum / f64::from(asked.max(1))
}

/// Helper for [`Block::permute`]: one column in a new order.
pub(crate) fn permuted<T: Copy + Send + Sync>(column: &[T], order: &[u32]) -> Vec<T> {
    parallel::list(order.len(), |k| column[order[k] as usize])
}

/// The row that eight primitives are, if they are one: neighbours mostly meet one and the same. (To be asked once for all columns.)
#[inline(always)]
pub(crate) fn one_row(index: &[u32; LANES]) -> Option<usize> {
    (equal_lanes(index, index[0]) == !0).then_some(index[0] as usize)
}

/// Reads one column for eight primitives.
#[inline(always)]
pub(crate) fn gather<S: Scalar>(column: &[S], index: &[u32; LANES]) -> S::Lane {
    match one_row(index) {
        Some(row) => S::Lane::splat(column[row]),
        None => gather_apart(column, index),
    }
}

/// The same of primitives that are not all one.
#[inline(always)]
pub(crate) fn gather_apart<S: Scalar>(column: &[S], index: &[u32; LANES]) -> S::Lane {
    S::Lane::from_fn(|k| column[index[k] as usize])
}

/// Reads vectors in three columns for eight primitives.
#[inline(always)]
pub(crate) fn gather_vectors<S: Scalar>(columns: &[Vec<S>; 3], index: &[u32; LANES]) -> Vec3<S::Lane> {
    let [x, y, z] = columns;
    match one_row(index) {
        Some(row) => Vec3::new(S::Lane::splat(x[row]), S::Lane::splat(y[row]), S::Lane::splat(z[row])),
        None => Vec3::new(gather_apart(x, index), gather_apart(y, index), gather_apart(z, index)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::f64x8;

    #[test]
    fn lanes_on_a_part_are_those_that_say_so() {
        for part in [[0, 1, 2, 3, 4, 5, 6, 7], [3; LANES], [0, 3, 0x83, 255, 128, 3, 2, 3]] {
            let left = Left::<f64x8> { on: Mask::from_bits(0b1011_1111), part };
            for wanted in [0, 3, 6, 7, 128, 255] {
                let bits =
                    (0..LANES).filter(|&k| k != 6 && part[k] == wanted).fold(0, |bits, k| bits | 1 << k);
                assert_eq!(left.on_part(wanted).bits(), bits, "{part:?} {wanted}");
            }
        }
    }
}
