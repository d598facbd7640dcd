//! Where shapes with a space of their own lie in the world: what ellipsoids, boxes, cones, discs and tori share.
//!
//! A [`Transform`] comes in, local rays go out. A frame keeps the world position `c` of its own origin apart from
//! the linear part: `own = M (p - c)`. A far origin then cancels in one subtraction, rounded once, and not in a sum
//! of large products. Directions keep the length that the map gives them, so `t` is the same in both spaces.

use super::{Aabb, OwnSpace, Rays, one_row, permuted};
use crate::lane::{LANES, Lane, Scalar, Vec3, f64x8};
use crate::scene::Transform;
use glam::{DMat3, DVec3};
use std::any::Any;

/// `n` frames, each with its numbers together: who asks for one needs them all, and has them with one look whether it is there and a
/// few cache lines, where columns would take as many of either as there are numbers.
#[derive(Debug, Clone, Default)]
pub(crate) struct Frames<S> {
    /// World position of the centre and the rows of `M` (1 / scene unit).
    to_own: Vec<[S; ROW]>,
    /// The same position and the rows of `M`'s inverse (scene units).
    to_world: Vec<[S; ROW]>,
}

/// Numbers of an affine map.
const ROW: usize = 12;

/// The way from the world into a primitive's own space, per lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame<L> {
    /// World position of the own space's origin.
    pub center: Vec3<L>,
    /// Rows of `M`.
    pub rows: [Vec3<L>; 3],
}

/// A 3x3 map given by rows, applied to a vector.
#[inline(always)]
fn apply<L: Lane>(rows: &[Vec3<L>; 3], v: Vec3<L>) -> Vec3<L> {
    Vec3::new(rows[0].dot(v), rows[1].dot(v), rows[2].dot(v))
}

impl<L: Lane> Frame<L> {
    /// From a row of [`Frames`].
    #[inline(always)]
    fn of([a, b, c, m @ ..]: [L; ROW]) -> Self {
        let row = |k: usize| Vec3::new(m[k], m[k + 1], m[k + 2]);
        Self { center: Vec3::new(a, b, c), rows: [row(0), row(3), row(6)] }
    }

    /// Rays in the primitive's own space; their directions are not of unit length, `t` is the world's.
    #[inline(always)]
    pub fn rays(&self, rays: &Rays<L>) -> Rays<L> {
        Rays { origin: apply(&self.rows, rays.origin - self.center), dir: apply(&self.rows, rays.dir) }
    }

    /// A normal of the primitive's own space in the world, to length 1.
    #[inline(always)]
    pub fn normal(&self, n: Vec3<L>) -> Vec3<L> {
        (self.rows[0] * n.x + self.rows[1] * n.y + self.rows[2] * n.z).normalize()
    }

    /// How far the own origin of `rays` may be from where it is meant to be, per axis, given that a start on the
    /// primitive was rounded to a world position: 4 roundings of that position, of the centre, and of the map.
    ///
    /// A ray that leaves a surface within this angle of its tangent cannot know which side it is on.
    #[inline(always)]
    pub fn start_error(&self, rays: &Rays<L>) -> Vec3<L> {
        let reach = (rays.origin.abs() + self.center.abs()) * L::lit(4.0 * L::Scalar::UNIT_ROUNDOFF);
        apply(&abs_rows(&self.rows), reach)
    }

    /// How far `rays.dir` may be wrong in own space, per axis: 8 roundings in the map and in the normal that the
    /// caller compared the direction with.
    #[inline(always)]
    pub fn direction_error(&self, rays: &Rays<L>) -> Vec3<L> {
        apply(&abs_rows(&self.rows), rays.dir.abs() * L::lit(8.0 * L::Scalar::UNIT_ROUNDOFF))
    }
}

/// In double precision.
#[inline(always)]
pub(super) fn widened<L: Lane>(v: Vec3<L>) -> Vec3<f64x8> {
    Vec3::new(v.x.to_f64s(), v.y.to_f64s(), v.z.to_f64s())
}

/// Back from double precision.
#[inline(always)]
pub(super) fn narrowed<L: Lane>(v: Vec3<f64x8>) -> Vec3<L> {
    Vec3::new(L::from_f64s(v.x), L::from_f64s(v.y), L::from_f64s(v.z))
}

impl<L: Lane> Frame<L> {
    /// The same in double precision.
    #[inline(always)]
    pub fn in_f64(&self) -> Frame<f64x8> {
        Frame { center: widened(self.center), rows: self.rows.map(widened) }
    }
}

impl<L: Lane> Rays<L> {
    /// The same in double precision.
    #[inline(always)]
    pub(super) fn in_f64(&self) -> Rays<f64x8> {
        Rays { origin: widened(self.origin), dir: widened(self.dir) }
    }

    /// The same in double precision: themselves, if they are, else what is put into `room`.
    #[inline(always)]
    pub fn in_double<'a>(&'a self, room: &'a mut Option<Rays<f64x8>>) -> &'a Rays<f64x8> {
        // (A copy of eight rays is some fifty instructions.)
        match (self as &dyn Any).downcast_ref() {
            Some(rays) => rays,
            None => room.insert(self.in_f64()),
        }
    }
}

impl<S: Scalar> Frames<S> {
    /// Adds a row; `world_from_own.forward` leads from the primitive's own space to the world.
    pub fn push(&mut self, world_from_own: &Transform) {
        let (forward, inverse) = (world_from_own.forward, world_from_own.inverse);
        let row = |matrix: DMat3| {
            let [x, y, z] = [0, 1, 2].map(|k| matrix.row(k).to_array().map(S::from_f64));
            let [a, b, c] = forward.translation.to_array().map(S::from_f64);
            [a, b, c, x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]]
        };
        self.to_own.push(row(inverse.matrix3));
        self.to_world.push(row(forward.matrix3));
    }

    /// Rows.
    pub fn len(&self) -> usize {
        self.to_own.len()
    }

    /// The middle of frame `i` in every lane.
    #[inline(always)]
    pub fn center(&self, i: usize) -> Vec3<S::Lane> {
        let [x, y, z, ..] = self.to_own[i];
        Vec3::broadcast([x, y, z])
    }

    /// Frame `i` in every lane.
    #[inline(always)]
    pub fn at(&self, i: usize) -> Frame<S::Lane> {
        let row = &self.to_own[i];
        let vector = |k: usize| Vec3::broadcast([row[k], row[k + 1], row[k + 2]]).map(S::Lane::in_register);
        Frame { center: vector(0), rows: [vector(3), vector(6), vector(9)] }
    }

    /// Frame `index[k]` in lane `k`.
    #[inline(always)]
    pub fn gathered(&self, index: &[u32; LANES]) -> Frame<S::Lane> {
        Frame::of(gather_rows(&self.to_own, index))
    }

    /// World positions of points given in the own space of primitive `index[k]`.
    #[inline(always)]
    pub fn to_world(&self, index: &[u32; LANES], own: Vec3<S::Lane>) -> Vec3<S::Lane> {
        let Frame { center, rows } = Frame::of(gather_rows(&self.to_world, index));
        center + apply(&rows, own)
    }

    /// A world box around the own-space box from `middle - half` to `middle + half`, as the columns have it.
    pub fn bounds(&self, i: usize, middle: DVec3, half: DVec3) -> Aabb {
        let (center, forward) = (self.center_of(i), self.forward_of(i));
        let half = forward_abs(&forward) * half + self.defect(i, &forward, middle.abs() + half);
        let middle = center + forward * middle;
        around(middle, half)
    }

    /// A world box around the own-space unit ball, as the columns have it.
    pub fn ball_bounds(&self, i: usize) -> Aabb {
        let (center, forward) = (self.center_of(i), self.forward_of(i));
        let half = DVec3::new(forward.row(0).length(), forward.row(1).length(), forward.row(2).length());
        around(center, half + self.defect(i, &forward, DVec3::ONE))
    }

    /// A world box around the own-space disc across the z axis at height `z`.
    pub fn disc_bounds(&self, i: usize, z: f64, radius: f64) -> Aabb {
        let (center, forward) = (self.center_of(i), self.forward_of(i));
        let half =
            DVec3::from_array(std::array::from_fn(|k| forward.x_axis[k].hypot(forward.y_axis[k]))) * radius;
        let defect = self.defect(i, &forward, DVec3::new(radius, radius, z.abs()));
        around(center + forward.z_axis * z, half + defect)
    }

    /// How far the shape can lie from where the forward map puts it, for own points within `reach` per axis.
    ///
    /// Rays see the shape through the rounded `M`, the box comes from the rounded inverse `F`. With `R = M F - 1`,
    /// computed here, `M`'s true inverse is `F (1 + R)^-1`, so a point `k` lies within `|F| |R| k` (and terms of
    /// second order) of `F k`; 8 f64 roundings of `|F| |M| |F| k` cover the computation of `R` and of the box.
    fn defect(&self, i: usize, forward: &DMat3, reach: DVec3) -> DVec3 {
        let own = self.matrix(&self.to_own, i);
        let residual = own * *forward - DMat3::IDENTITY;
        let f = forward_abs(forward);
        let rounding = f * (forward_abs(&own) * (f * reach)) * (8.0 * f64::UNIT_ROUNDOFF);
        // Twice, for the second order: |R| is far below 1/2 for any map worth the name.
        f * (forward_abs(&residual) * reach) * 2.0 + rounding
    }

    /// The space of row `i`.
    pub fn own_space(&self, i: usize) -> OwnSpace {
        OwnSpace { center: self.center_of(i), map: self.matrix(&self.to_own, i) }
    }

    fn center_of(&self, i: usize) -> DVec3 {
        let [x, y, z, ..] = self.to_own[i].map(S::to_f64);
        DVec3::new(x, y, z)
    }

    fn forward_of(&self, i: usize) -> DMat3 {
        self.matrix(&self.to_world, i)
    }

    fn matrix(&self, rows: &[[S; ROW]], i: usize) -> DMat3 {
        let [_, _, _, rows @ ..] = rows[i].map(S::to_f64);
        DMat3::from_cols_array(&rows).transpose()
    }

    /// Row `k` becomes the former row `order[k]`.
    pub fn permute(&mut self, order: &[u32]) {
        for rows in [&mut self.to_own, &mut self.to_world] {
            *rows = permuted(rows, order);
        }
    }
}

#[inline(always)]
fn abs_rows<L: Lane>([x, y, z]: &[Vec3<L>; 3]) -> [Vec3<L>; 3] {
    [x.abs(), y.abs(), z.abs()]
}

/// Rows of eight primitives, column by column.
#[inline(always)]
fn gather_rows<S: Scalar>(rows: &[[S; ROW]], index: &[u32; LANES]) -> [S::Lane; ROW] {
    let mut columns = rows[index[0] as usize].map(|x| S::Lane::splat(x).in_register());
    if one_row(index).is_none() {
        gather_rows_apart(rows, index, &mut columns);
    }
    columns
}

/// The same of rows that are not all one. (Inlined, it has the compiler keep what either way has made in halves of registers, and
/// store all of that several times over.)
#[inline(never)]
fn gather_rows_apart<S: Scalar>(rows: &[[S; ROW]], index: &[u32; LANES], columns: &mut [S::Lane; ROW]) {
    let rows = index.map(|row| &rows[row as usize]);
    for (k, column) in columns.iter_mut().enumerate() {
        *column = S::Lane::from_fn(|lane| rows[lane][k]).in_register();
    }
}

fn forward_abs(m: &DMat3) -> DMat3 {
    DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs())
}

/// The box around `middle`, with two more f64 roundings for the last sums.
fn around(middle: DVec3, half: DVec3) -> Aabb {
    Aabb { min: middle - half, max: middle + half }.inflated(2.0 * f64::UNIT_ROUNDOFF)
}
