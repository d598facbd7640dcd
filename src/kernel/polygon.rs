//! Polygons: closed outlines in one plane, inside by the even-odd rule.

use super::plane::finite;
use super::triangle::{View, crosses};
use super::{Aabb, Block, Left, Rays, Surfaces, gather_vectors, permuted};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3};
use glam::DVec3;
use std::ops::Range;

/// `n` polygons: columns `normal` (3, unit), `anchor` (3, a point of the plane) and `outlines`, each a run of
/// entries in `ends`; the corners of all polygons stand in one pool, `corner` (3).
///
/// A polygon has a surface but no inside.
#[derive(Debug, Clone, Default)]
pub struct Polygons<S> {
    normal: [Vec<S>; 3],
    anchor: [Vec<S>; 3],
    outlines: Vec<OutlineRange>,
    /// Where outline `k` begins and ends in the pool.
    ends: Vec<Range<u32>>,
    corner: [Vec<S>; 3],
}

/// A run of entries in [`Polygons::ends`].
#[derive(Debug, Clone, Copy)]
struct OutlineRange {
    first: u32,
    end: u32,
}

impl<S: Scalar> Polygons<S> {
    /// Adds a row, rounded to the columns' precision: outlines once round, the first corner not repeated.
    ///
    /// The plane is the one that fits best (Newell's: the corners are taken to lie in one). Corners shared with
    /// other polygons or triangles must be given the same bits. A polygon of no area is never hit.
    pub fn push(&mut self, outlines: &[Vec<DVec3>]) {
        let first = self.ends.len() as u32;
        for outline in outlines {
            let begin = self.corner[0].len() as u32;
            for corner in outline {
                for (column, x) in self.corner.iter_mut().zip(corner.to_array()) {
                    column.push(S::from_f64(x));
                }
            }
            self.ends.push(begin..self.corner[0].len() as u32);
        }
        let row = OutlineRange { first, end: self.ends.len() as u32 };
        self.outlines.push(row);
        let anchor = self.middle(row);
        let normal = self.newell(row, anchor);
        for k in 0..3 {
            self.anchor[k].push(S::from_f64(anchor[k]));
            self.normal[k].push(S::from_f64(normal[k]));
        }
    }

    /// Turns the last row's front to the side that `front` points to.
    pub fn face(&mut self, front: DVec3) {
        let normal = self.normal.each_mut().map(|column| column.last_mut());
        let [Some(x), Some(y), Some(z)] = normal else { return };
        if DVec3::new(x.to_f64(), y.to_f64(), z.to_f64()).dot(front) < 0.0 {
            for n in [x, y, z] {
                *n = S::from_f64(-n.to_f64());
            }
        }
    }

    /// The ranges of a polygon's outlines in the pool.
    fn ranges(&self, row: OutlineRange) -> &[Range<u32>] {
        &self.ends[row.first as usize..row.end as usize]
    }

    fn corner_of(&self, k: usize) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|axis| self.corner[axis][k].to_f64()))
    }

    fn corners_of(&self, row: OutlineRange) -> impl Iterator<Item = DVec3> {
        self.ranges(row).iter().cloned().flatten().map(|k| self.corner_of(k as usize))
    }

    /// The corners' mean.
    fn middle(&self, row: OutlineRange) -> DVec3 {
        let (sum, count) = self.corners_of(row).fold((DVec3::ZERO, 0.0), |(s, n), p| (s + p, n + 1.0));
        if count > 0.0 { sum / count } else { sum }
    }

    /// The unit normal by Newell's sum over the edges of all outlines, each turned the way of the first so that
    /// holes do not cancel it; zero without an area.
    fn newell(&self, row: OutlineRange, middle: DVec3) -> DVec3 {
        let mut total = DVec3::ZERO;
        for range in self.ranges(row) {
            let corners: Vec<_> = range.clone().map(|k| self.corner_of(k as usize) - middle).collect();
            let sum: DVec3 = corners
                .iter()
                .zip(corners.iter().cycle().skip(1))
                .map(|(a, b)| (*a - *b).cross(*a + *b))
                .sum();
            total += if total.dot(sum) < 0.0 { -sum } else { sum };
        }
        total.normalize_or_zero()
    }
}

impl<S: Scalar> Block<S> for Polygons<S> {
    type Roots = [S::Lane; 1];

    fn len(&self) -> usize {
        self.outlines.len()
    }

    /// Even-odd over the edges as the ray sees them, by the same rule as for triangles, so neighbours leave no
    /// crack.
    #[inline(always)]
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 1] {
        let zero = S::Lane::zero();
        let splat = |c: &[Vec<S>; 3], k: usize| {
            Vec3::new(S::Lane::splat(c[0][k]), S::Lane::splat(c[1][k]), S::Lane::splat(c[2][k]))
        };
        let view = View::along(rays.dir);
        let look = |k: usize| view.look(splat(&self.corner, k) - rays.origin);
        let mut inside = Mask::none_set();
        for range in self.ranges(self.outlines[i]) {
            let range = range.start as usize..range.end as usize;
            let Some(last) = range.clone().last() else { continue };
            let (mut x1, mut y1) = look(last);
            let mut above1 = y1.gt(zero);
            for k in range {
                let (x2, y2) = look(k);
                let above2 = y2.gt(zero);
                inside = inside ^ crosses(above1, above2, x1 * y2 - x2 * y1);
                (x1, y1, above1) = (x2, y2, above2);
            }
        }
        let normal = splat(&self.normal, i);
        let mut t = normal.dot(splat(&self.anchor, i) - rays.origin) / normal.dot(rays.dir);
        t = inside.select(t, S::Lane::lit(f64::NAN));
        if let Some(left) = left {
            t = left.on.select(zero, t);
        }
        [finite(t)]
    }

    #[inline(always)]
    fn boundary(&self, _i: usize, _rays: &Rays<S::Lane>, _left: Option<&Left<S::Lane>>) -> [S::Lane; 1] {
        [S::Lane::lit(f64::NAN)]
    }

    fn resolve(
        &self,
        index: &[u32; LANES],
        _active: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
    ) -> Surfaces<S::Lane> {
        let (normal, anchor) = (gather_vectors(&self.normal, index), gather_vectors(&self.anchor, index));
        let p = rays.origin + rays.dir * t;
        Surfaces { point: p - normal * normal.dot(p - anchor), normal, ..Default::default() }
    }

    /// Around the corners and, because the plane is rounded, the plane's distance from the farthest of them.
    fn bounds(&self, i: usize) -> Aabb {
        let row = self.outlines[i];
        let at = |c: &[Vec<S>; 3]| DVec3::from_array(std::array::from_fn(|k| c[k][i].to_f64()));
        let (normal, anchor) = (at(&self.normal), at(&self.anchor));
        let off = self.corners_of(row).map(|p| normal.dot(p - anchor).abs()).fold(0.0, f64::max);
        let Aabb { min, max } = Aabb::of(self.corners_of(row));
        Aabb { min: min - off, max: max + off }
    }

    /// The pool stays as it is; rows keep their runs in it.
    fn permute(&mut self, order: &[u32]) {
        for column in self.normal.iter_mut().chain(&mut self.anchor) {
            *column = permuted(column, order);
        }
        self.outlines = permuted(&self.outlines, order);
    }
}
