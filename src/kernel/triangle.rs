//! Triangles, flat and smooth, without cracks between neighbours.

use super::fours::{Four, Fours};
use super::plane::finite;
use super::{
    Aabb, Block, Center, Left, Outlines, Passing, Ray, Rays, Surfaces, cross_four, dot_four, first_beyond,
    gather, less_four, permuted, typical,
};
use crate::lane::{LANES, Lane, Mask, QUAD, Quad, Scalar, Vec3};
use crate::parallel;
use glam::DVec3;

/// `n` flat triangles `a`, `b`, `c`: columns `corner` (3 corners x 3) and `normal` (3, unit, along `(c - a) x (b - a)`, POV-Ray's
/// side, unless [`Triangles::extend`] was told of another).
///
/// A triangle has a surface but no inside. The places behind the last have no area and are never hit.
#[derive(Debug, Clone, Default)]
pub struct Triangles<S> {
    rows: Fours<S, 12>,
    /// The last ones, while they wait for their places.
    waiting: Indexed<S>,
}

/// Triangles with the numbers of their corners: a fifth to a third of the memory, but no form for rays.
#[derive(Debug, Clone, Default)]
struct Indexed<S> {
    vertices: Vec<[S; 3]>,
    corners: Vec<[u32; 3]>,
}

/// `n` triangles with a shading normal per corner (column `shading`, 3 corners x 3: a longer one weighs more).
#[derive(Debug, Clone, Default)]
pub struct SmoothTriangles<S> {
    flat: Triangles<S>,
    shading: [Vec<S>; 9],
}

/// Two unit-like vectors across a ray, so that points have two coordinates as the ray sees them.
///
/// Every triangle that shares a corner gives it the same two numbers, to the bit: that is what closes the cracks.
/// How square to the ray the vectors are only moves all triangles together, by roundings.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct View<L> {
    x: Vec3<L>,
    y: Vec3<L>,
}

impl<L: Lane> View<L> {
    /// Of rays in direction `dir`.
    #[inline(always)]
    pub fn along(dir: Vec3<L>) -> Self {
        // The cross product with z, or with x if that is nearly parallel: at least 1/2 in square, no division.
        let turn = dir.x.abs().ge(dir.z.abs());
        let x = Vec3::new(turn.keep(-dir.y), turn.select(dir.x, -dir.z), turn.select(L::zero(), dir.y));
        Self { x, y: dir.cross(x) }
    }

    /// The two coordinates of a point, given relative to the rays' start.
    #[inline(always)]
    pub(super) fn look(&self, from_origin: Vec3<L>) -> (L, L) {
        (self.x.dot(from_origin), self.y.dot(from_origin))
    }
}

/// [`View::along`] of one ray, each number in four lanes: the same, to the bit.
#[inline(always)]
pub(super) fn view_in_four<Q: Quad>(dir: super::Four<Q>) -> [super::Four<Q>; 2] {
    let [dx, dy, dz] = dir;
    let turn = dz.abs().le(dx.abs());
    let x = [turn & -dy, turn.choose(dx, -dz), turn.choose(Q::default(), dy)];
    [x, cross_four(dir, x)]
}

/// Whether the half line from the ray along `x` crosses the edge between two corners seen at heights `y1` and `y2`;
/// `above` says `y > 0` of each, and `cross` is `x1 y2 - x2 y1`.
///
/// The point where the ray pierces the plane lies within an outline if it crosses an odd number of edges. An edge
/// gives the same answer in both directions (`cross` changes its sign exactly), so neighbours never both lose a ray
/// nor both win it, also at corners and whatever the rounding of `cross`: the sum over a closed mesh is even, and
/// over a fan around a corner it is odd.
#[inline(always)]
pub(super) fn crosses<L: Lane>(above1: Mask<L>, above2: Mask<L>, cross: L) -> Mask<L> {
    // (The sign is turned by its bit: to choose between `cross` and `-cross` is an operation more.)
    (above1 ^ above2) & (cross ^ above2.keep(L::lit(-0.0))).lt(L::zero())
}

/// Three corners per lane.
#[derive(Debug, Clone, Copy)]
struct Corners<L>([Vec3<L>; 3]);

impl<L: Lane> Corners<L> {
    /// Whether rays pass through, and the weights of the corners, not normalised.
    #[inline(always)]
    fn pierced(&self, rays: &Rays<L>) -> (Mask<L>, [L; 3]) {
        let view = View::along(rays.dir);
        let [(x0, y0), (x1, y1), (x2, y2)] = self.0.map(|corner| view.look(corner - rays.origin));
        let [above0, above1, above2] = [y0, y1, y2].map(|y| y.gt(L::zero()));
        let weights = [x1 * y2 - x2 * y1, x2 * y0 - x0 * y2, x0 * y1 - x1 * y0];
        let inside = crosses(above1, above2, weights[0])
            ^ crosses(above2, above0, weights[1])
            ^ crosses(above0, above1, weights[2]);
        (inside, weights)
    }

    /// Weights of the second and third corner where a ray meets the triangle's plane: within 0 to 1, and so their
    /// sum.
    #[inline(always)]
    fn barycentric(&self, rays: &Rays<L>) -> (L, L) {
        let (_, w) = self.pierced(rays);
        let (zero, one) = (L::zero(), L::lit(1.0));
        let inv = one / (w[0] + w[1] + w[2]);
        // NaN (a triangle of no area) becomes 0.
        let u = (w[1] * inv).max(zero).min(one);
        (u, (w[2] * inv).max(zero).min(one - u))
    }
}

impl<S: Scalar> Indexed<S> {
    fn corners_of(&self, i: usize) -> [DVec3; 3] {
        self.corners[i].map(|corner| DVec3::from_array(self.vertices[corner as usize].map(S::to_f64)))
    }
}

impl<S: Scalar> Triangles<S> {
    /// Adds a row, rounded to the columns' precision. Corners that triangles share must be given the same bits.
    ///
    /// A triangle of no area is never hit.
    pub fn push(&mut self, corners: [DVec3; 3]) {
        self.settle();
        self.rows.push(row_of(corners, None));
    }

    /// Adds rows with the corners `corners(0)` to `corners(count - 1)`. What comes with them is the side that the front is to be on, if
    /// not POV-Ray's: mirrored triangles keep theirs in some places.
    pub fn extend(
        &mut self,
        count: usize,
        corners: impl Fn(usize) -> ([DVec3; 3], Option<DVec3>) + Send + Sync,
    ) {
        self.settle();
        self.rows.extend(count, |k| {
            let (corners, front) = corners(k);
            row_of(corners, front)
        });
    }

    /// Adds triangles, by their corners' numbers among `vertices`, that wait for their places: no ray may come before
    /// [`Block::permute`]. So the rows of long meshes are not written twice.
    pub fn add_waiting(
        &mut self,
        vertices: &[DVec3],
        count: usize,
        corners: impl Fn(usize) -> [u32; 3] + Send + Sync,
    ) {
        let Indexed { vertices: all, corners: waiting } = &mut self.waiting;
        let first = all.len() as u32;
        parallel::extend(all, vertices.len(), |k| vertices[k].to_array().map(S::from_f64));
        parallel::extend(waiting, count, |k| corners(k).map(|corner| first + corner));
    }

    /// The waiting ones become rows as they came: others are to follow.
    fn settle(&mut self) {
        let waiting = std::mem::take(&mut self.waiting);
        self.rows.extend(waiting.corners.len(), |k| row_of(waiting.corners_of(k), None));
    }

    /// Row `i`, be it a waiting one.
    fn row(&self, i: usize) -> [S; 12] {
        match i.checked_sub(self.rows.len()) {
            Some(waiting) => row_of(self.waiting.corners_of(waiting), None),
            None => self.rows.row(i),
        }
    }

    fn corners_of(&self, i: usize) -> [DVec3; 3] {
        if let Some(waiting) = i.checked_sub(self.rows.len()) {
            return self.waiting.corners_of(waiting);
        }
        let row = self.rows.row(i);
        [0, 3, 6].map(|k| DVec3::new(row[k].to_f64(), row[k + 1].to_f64(), row[k + 2].to_f64()))
    }

    /// Triangle `i` in every lane.
    #[inline(always)]
    fn at(&self, i: usize) -> (Corners<S::Lane>, Vec3<S::Lane>) {
        let Four(columns) = self.rows.four(i / QUAD);
        of_columns(|k| S::Lane::splat(columns[k][i % QUAD]))
    }

    /// Triangle `index[k]` in lane `k`.
    #[inline(always)]
    fn gathered(&self, index: &[u32; LANES]) -> (Corners<S::Lane>, Vec3<S::Lane>) {
        of_columns(|k| self.rows.gather(k, index))
    }
}

/// Corners and normal from the twelve columns.
#[inline(always)]
fn of_columns<L: Lane>(mut column: impl FnMut(usize) -> L) -> (Corners<L>, Vec3<L>) {
    let mut three = |k: usize| Vec3::new(column(k), column(k + 1), column(k + 2));
    (Corners([three(0), three(3), three(6)]), three(9))
}

/// Distances along rays to a triangle's plane where they pierce it, NaN elsewhere.
///
/// Watertight in the manner of Woop, Benthin, Wald (JCGT 2(1), 2013), with the even-odd rule for ties; `t` from the
/// plane, which keeps it good on large triangles.
#[inline(always)]
fn crossing<L: Lane>(
    (corners, normal): (Corners<L>, Vec3<L>),
    rays: &Rays<L>,
    left: Option<&Left<L>>,
) -> [L; 1] {
    let (inside, _) = corners.pierced(rays);
    if left.is_none() && !inside.any() {
        return [L::lit(f64::NAN)];
    }
    let mut t = to_plane(corners.0[0], normal, rays, inside);
    if let Some(left) = left {
        t = left.on.select(L::zero(), t);
    }
    [finite(t)]
}

/// Distances to the plane of a triangle in lanes `inside`, NaN elsewhere.
#[inline(always)]
fn to_plane<L: Lane>(corner: Vec3<L>, normal: Vec3<L>, rays: &Rays<L>, inside: Mask<L>) -> L {
    inside.select(normal.dot(corner - rays.origin) / normal.dot(rays.dir), L::lit(f64::NAN))
}

/// [`crossing`] of one ray with four triangles: see [`Block::near_in_four`]. (The triangle that the ray starts on is
/// crossed at 0, which is not beyond `t_min`.)
#[inline(always)]
fn near_crossings<S: Scalar>(
    four: &Four<S, 12>,
    ray: &Ray<S>,
    (t_min, t_max): (S, S),
    left: u8,
) -> (S::Quad, u8) {
    let Ray { origin, dir, view: [x, y] } = ray;
    let three = |k: usize| [0, 1, 2].map(|axis| S::Quad::from_array(four.0[k + axis]));
    let corners = [0, 3, 6].map(|k| less_four(three(k), *origin));
    let [(x0, y0), (x1, y1), (x2, y2)] = corners.map(|corner| (dot_four(*x, corner), dot_four(*y, corner)));
    let zero = S::Quad::default();
    let [above0, above1, above2] = [y0, y1, y2].map(|y| y.gt(zero));
    // As in `crosses`.
    let crosses = |above1: S::Quad, above2: S::Quad, cross: S::Quad| {
        (above1 ^ above2) & zero.gt(cross ^ (above2 & S::Quad::lit(-0.0)))
    };
    let inside = crosses(above1, above2, x1 * y2 - x2 * y1)
        ^ crosses(above2, above0, x2 * y0 - x0 * y2)
        ^ crosses(above0, above1, x0 * y1 - x1 * y0);
    let normal = three(9);
    let t = dot_four(normal, corners[0]) / dot_four(normal, *dir);
    let seen = inside & t.gt(S::Quad::splat(t_min)) & t.le(S::Quad::splat(t_max));
    (t, seen.bits() & !left)
}

/// A triangle's numbers; its normal on the side of `front`, if that is given.
fn row_of<S: Scalar>(corners: [DVec3; 3], front: Option<DVec3>) -> [S; 12] {
    let corners = corners.map(|c| c.to_array().map(S::from_f64));
    let normal = unit_normal(corners.map(|c| DVec3::from_array(c.map(S::to_f64))));
    let normal = if front.is_some_and(|front| normal.dot(front) < 0.0) { -normal } else { normal };
    std::array::from_fn(|k| if k < 9 { corners[k / 3][k % 3] } else { S::from_f64(normal[k - 9]) })
}

/// How long the parts are, at most, that add up to how high a ray starts above a triangle's plane, where it starts near the triangle: a sum
/// that is much less than they are is lost to their roundings. Nothing where the plane is square to an axis, however large the
/// triangle.
fn reach([a, b, c]: [DVec3; 3], normal: DVec3) -> f64 {
    normal.abs().dot(a.max(b).max(c) - a.min(b).min(c))
}

/// The unit normal of a triangle, zero if it has no area.
///
/// Taken at the corner between the two shorter edges, where a needle's edges are least alike, and with products that
/// do not cancel, so it is right to a few roundings of the edges however thin the triangle.
fn unit_normal(corners: [DVec3; 3]) -> DVec3 {
    let lengths: [f64; 3] =
        std::array::from_fn(|k| corners[(k + 1) % 3].distance_squared(corners[(k + 2) % 3]));
    // Edge k is opposite to corner k: the corner opposite to the longest edge lies between the shorter two.
    let k = (0..3).max_by(|&a, &b| lengths[a].total_cmp(&lengths[b])).unwrap_or(0);
    let (a, b) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
    // b × a: POV-Ray's side of a triangle, which decides where an `interior_texture` is seen.
    DVec3::new(
        difference_of_products(a.z, b.y, a.y, b.z),
        difference_of_products(a.x, b.z, a.z, b.x),
        difference_of_products(a.y, b.x, a.x, b.y),
    )
    .normalize_or_zero()
}

/// `a b - c d` within 2 roundings of the result (Kahan; Jeannerod, Louvet, Muller, Math. Comp. 82, 2013). Rust's
/// scalar `mul_add` always rounds once, on any machine; it may be slow, and this is not for rays.
fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let cd = c * d;
    let error = (-c).mul_add(d, cd);
    a.mul_add(b, -cd) + error
}

/// A triangle is cut where its box has so many times the area of the triangle's shadows on the box' sides: 2 is usual,
/// long and slanting ones have 20 to 200.
const SLENDER: f64 = 8.0;

/// See [`Block::pieces`]: halves across the longest edge, again and again.
fn pieces(corners: [DVec3; 3], least: f64, most: usize, out: &mut Vec<Aabb>) {
    let (end, mut waiting) = (out.len() + most, smallvec::SmallVec::<[[DVec3; 3]; 32]>::new());
    waiting.push(corners);
    while let Some([a, b, c]) = waiting.pop() {
        let bounds = Aabb::of([a, b, c]);
        let shadows = (b - a).cross(c - a).abs().element_sum() / 2.0;
        let (area, full) = (bounds.half_area(), out.len() + waiting.len() + 2 > end);
        if full || !(area > least) || !(area > SLENDER * shadows) {
            // Middles are rounded.
            out.push(bounds.inflated(4.0 * f64::UNIT_ROUNDOFF));
            continue;
        }
        let (ab, bc, ca) = (a.distance_squared(b), b.distance_squared(c), c.distance_squared(a));
        let [a, b, c] = if ab >= bc && ab >= ca {
            [c, a, b]
        } else if bc >= ca {
            [a, b, c]
        } else {
            [b, c, a]
        };
        let middle = (b + c) / 2.0; // b and c are now the ends of the longest edge.
        waiting.push([a, b, middle]);
        waiting.push([a, middle, c]);
    }
}

impl<S: Scalar> Block<S> for Triangles<S> {
    type Roots = [S::Lane; 1];

    fn len(&self) -> usize {
        self.rows.len() + self.waiting.corners.len()
    }

    fn row_bytes(&self) -> usize {
        self.rows.row_bytes()
    }

    #[inline(always)]
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 1] {
        crossing(self.at(i), rays, left)
    }

    #[inline(always)]
    fn prefetch(&self, i: usize) {
        self.rows.prefetch(i / QUAD);
    }

    const ACROSS: bool = true;

    #[inline(always)]
    fn near_in_four(&self, four: usize, ray: &Ray<S>, limits: (S, S), left: u8) -> (S::Quad, u8) {
        near_crossings(self.rows.four(four), ray, limits, left)
    }

    const OUTLINED: bool = true;

    #[inline(always)]
    fn outlines(&self, four: usize, center: &Center<S>) -> Outlines {
        let Four(columns) = self.rows.four(four);
        let column = |k: usize| S::Quad::from_array(columns[k]);
        let corner = |k: usize| [column(k), column(k + 1), column(k + 2)];
        Outlines::of::<S>([corner(0), corner(3), corner(6)], center)
    }

    #[inline(always)]
    fn through(&self, i: usize, rays: &Rays<S::Lane>) -> u8 {
        self.at(i).0.pierced(rays).0.bits()
    }

    #[inline(always)]
    fn first_through(&self, four: usize, passing: Passing, rays: &Rays<S::Lane>, from: S::Lane) -> S::Lane {
        let Four(columns) = self.rows.four(four);
        let which = passing.rows_of_rays();
        let vector = |k: usize| {
            let column = |k: usize| S::Lane::of_four(&columns[k], &which);
            Vec3::new(column(k), column(k + 1), column(k + 2))
        };
        let t = to_plane(vector(0), vector(9), rays, Mask::from_bits(passing.rays()));
        first_beyond(std::iter::once(finite(t)), from)
    }

    #[inline(always)]
    fn boundary(&self, _i: usize, _rays: &Rays<S::Lane>, _left: Option<&Left<S::Lane>>) -> [S::Lane; 1] {
        [S::Lane::lit(f64::NAN)]
    }

    fn blurred(&self) -> f64 {
        typical(self.rows.len(), |i| {
            let row = self.rows.row(i);
            reach(self.corners_of(i), DVec3::new(row[9].to_f64(), row[10].to_f64(), row[11].to_f64()))
        })
    }

    fn sharpened(&self, i: usize, origin: DVec3, dir: DVec3, _t: f64) -> f64 {
        let [a, b, c] = self.corners_of(i);
        let normal = (b - a).cross(c - a);
        normal.dot(a - origin) / normal.dot(dir)
    }

    fn resolve(
        &self,
        index: &[u32; LANES],
        _active: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
    ) -> Surfaces<S::Lane> {
        let (corners, normal) = self.gathered(index);
        let (u, v) = corners.barycentric(rays);
        let p = rays.origin + rays.dir * t;
        let point = p - normal * normal.dot(p - corners.0[0]);
        Surfaces { point, normal, u, v, ..Default::default() }
    }

    #[inline(always)]
    fn corners_in_four(&self, four: usize) -> Option<[[f64; QUAD]; 9]> {
        let Four(columns) = self.rows.four(four);
        Some(std::array::from_fn(|k| columns[k].map(S::to_f64)))
    }

    /// Exact: the corners themselves.
    fn bounds(&self, i: usize) -> Aabb {
        Aabb::of(self.corners_of(i))
    }

    fn pieces(&self, i: usize, least: f64, most: usize, out: &mut Vec<Aabb>) {
        pieces(self.corners_of(i), least, most, out);
    }

    fn permute(&mut self, order: &[u32]) {
        let mut rows = Fours::default();
        rows.extend(order.len(), |k| self.row(order[k] as usize));
        *self = Self { rows, waiting: Indexed::default() };
    }
}

impl<S: Scalar> SmoothTriangles<S> {
    /// Adds a row, as for flat triangles; `normals` are one a corner, about unit length; a longer one weighs more.
    pub fn push(&mut self, corners: [DVec3; 3], normals: [DVec3; 3]) {
        self.extend(1, |_| (corners, normals));
    }

    /// Adds rows with the corners and normals `row(0)` to `row(count - 1)`.
    pub fn extend(&mut self, count: usize, row: impl Fn(usize) -> ([DVec3; 3], [DVec3; 3]) + Send + Sync) {
        self.flat.extend(count, |k| (row(k).0, None));
        self.extend_shading(count, |k| row(k).1);
    }

    /// Adds triangles that wait for their places: see [`Triangles::add_waiting`].
    pub fn add_waiting(
        &mut self,
        vertices: &[DVec3],
        count: usize,
        row: impl Fn(usize) -> ([u32; 3], [DVec3; 3]) + Send + Sync,
    ) {
        self.flat.add_waiting(vertices, count, |k| row(k).0);
        self.extend_shading(count, |k| row(k).1);
    }

    fn extend_shading(&mut self, count: usize, normals: impl Fn(usize) -> [DVec3; 3] + Send + Sync) {
        for (column, shading) in self.shading.iter_mut().enumerate() {
            parallel::extend(shading, count, |k| S::from_f64(normals(k)[column / 3][column % 3]));
        }
    }
}

impl<S: Scalar> Block<S> for SmoothTriangles<S> {
    type Roots = [S::Lane; 1];

    fn len(&self) -> usize {
        self.flat.len()
    }

    fn row_bytes(&self) -> usize {
        self.flat.row_bytes() + 9 * size_of::<S>()
    }

    #[inline(always)]
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 1] {
        self.flat.roots(i, rays, left)
    }

    #[inline(always)]
    fn prefetch(&self, i: usize) {
        self.flat.prefetch(i);
    }

    const ACROSS: bool = true;

    #[inline(always)]
    fn near_in_four(&self, four: usize, ray: &Ray<S>, limits: (S, S), left: u8) -> (S::Quad, u8) {
        self.flat.near_in_four(four, ray, limits, left)
    }

    const OUTLINED: bool = true;

    #[inline(always)]
    fn outlines(&self, four: usize, center: &Center<S>) -> Outlines {
        self.flat.outlines(four, center)
    }

    #[inline(always)]
    fn through(&self, i: usize, rays: &Rays<S::Lane>) -> u8 {
        self.flat.through(i, rays)
    }

    #[inline(always)]
    fn first_through(&self, four: usize, passing: Passing, rays: &Rays<S::Lane>, from: S::Lane) -> S::Lane {
        self.flat.first_through(four, passing, rays, from)
    }

    #[inline(always)]
    fn boundary(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> [S::Lane; 1] {
        self.flat.boundary(i, rays, left)
    }

    fn blurred(&self) -> f64 {
        self.flat.blurred()
    }

    fn sharpened(&self, i: usize, origin: DVec3, dir: DVec3, t: f64) -> f64 {
        self.flat.sharpened(i, origin, dir, t)
    }

    /// The normal is the corners' normals blended by their weights (manual section 3.4.3.7); the flat one where
    /// they cancel.
    fn resolve(
        &self,
        index: &[u32; LANES],
        active: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
    ) -> Surfaces<S::Lane> {
        let flat = self.flat.resolve(index, active, rays, t);
        let n = |k: usize| gather(&self.shading[k], index);
        let [n0, n1, n2] = [0, 3, 6].map(|k| Vec3::new(n(k), n(k + 1), n(k + 2)));
        let blend = n0 * (S::Lane::lit(1.0) - flat.u - flat.v) + n1 * flat.u + n2 * flat.v;
        let sound = blend.dot(blend).gt(S::Lane::zero());
        Surfaces { normal: Vec3::select(sound, blend.normalize(), flat.normal), ..flat }
    }

    #[inline(always)]
    fn corners_in_four(&self, four: usize) -> Option<[[f64; QUAD]; 9]> {
        self.flat.corners_in_four(four)
    }

    fn bounds(&self, i: usize) -> Aabb {
        self.flat.bounds(i)
    }

    fn pieces(&self, i: usize, least: f64, most: usize, out: &mut Vec<Aabb>) {
        self.flat.pieces(i, least, most, out);
    }

    fn permute(&mut self, order: &[u32]) {
        self.flat.permute(order);
        for column in &mut self.shading {
            *column = permuted(column, order);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn waiting_triangles_become_the_rows_they_would_have_been() {
        let mut numbers = Random::new(3);
        let vertices: Vec<DVec3> = (0..100).map(|_| numbers.vector(1.0)).collect();
        let of = |k: usize| [k % 100, k * 7 % 100, k * 13 % 100].map(|v| v as u32);
        let corners = |k: usize| of(k).map(|v| vertices[v as usize]);
        let (mut rows, mut waiting) = (Triangles::<f32>::default(), Triangles::<f32>::default());
        // Two meshes, a triangle by itself, and a mesh that is still waiting when the order comes.
        for (count, vertices) in [(9, &vertices[..]), (4, &vertices[..]), (1, &[]), (30, &vertices[..])] {
            rows.extend(count, |k| (corners(k), None));
            match vertices {
                [] => waiting.push(corners(0)),
                vertices => waiting.add_waiting(vertices, count, of),
            }
            assert_eq!(waiting.len(), rows.len());
        }
        assert_eq!(waiting.rows.len(), 14);
        assert!(
            (0..44)
                .all(|i| rows.bounds(i) == waiting.bounds(i) && rows.corners_of(i) == waiting.corners_of(i))
        );
        let order: Vec<u32> = (0..44).rev().collect();
        rows.permute(&order);
        waiting.permute(&order);
        assert_eq!(waiting.rows.len(), 44);
        assert!((0..44).all(|i| rows.rows.row(i) == waiting.rows.row(i)));
    }
}
