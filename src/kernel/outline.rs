//! Outlines of triangles as lines see them: which rays surely pass through, and which surely pass by.
//!
//! In go four triangles' corners and sixteen rays, as lines in Plücker coordinates; out come two bits a ray and triangle. It
//! is done in single precision whatever the scene's, and what that cannot tell is left to the triangle's own test, which this
//! never contradicts: no crack opens and no hit moves by a bit. Most rays are told for a third of that test's arithmetic, in
//! double precision for a sixth.
//!
//! A line passes an edge on the side that the sign of their side product says (Plücker's permuted inner product; Shoemake
//! 1998, Plücker coordinate tutorial, Ray Tracing News 11(1)), through the triangle if it is the same for all three. Seen
//! along the ray, the product is the edge's length times its distance from the ray.
//!
//! Lines have no moments about a place that all of them go through, a camera or a light: that is half of the arithmetic.

use super::{Four, Rays, in_four, less_four};
use crate::lane::{
    LANES, Lane, Mask, QUAD, Quad, Scalar, Vec3, f32x4, f32x8, f32x16, highest, of_two_bits, sixteen_bits,
};
use glam::DVec3;
use std::ops::Range;

/// What lines' coordinates are counted from.
#[derive(Debug, Clone, Copy, Default)]
pub struct Center<S> {
    at: [S; 3],
    /// How far from there rays start, at most.
    reach: f32,
    /// How far from there lines pass, at most, if all are taken to go through it: 0 if rays start there.
    gap: f32,
    /// Some lines pass farther off.
    parted: bool,
}

/// Eight lines about a [`Center`].
#[derive(Debug, Clone, Copy, Default)]
pub struct PluckerLines {
    /// Unit directions.
    dir: [f32x8; 3],
    /// `(start - center) x dir`.
    moment: [f32x8; 3],
}

/// Four triangles' edges about a [`Center`]; a triangle a lane.
#[derive(Debug, Clone, Copy, Default)]
pub struct Outlines {
    /// By edge, its start crossed with itself.
    normal: [[[f32; QUAD]; 3]; 3],
    /// The edges themselves.
    edge: [[[f32; QUAD]; 3]; 3],
    /// Side products beyond this on either side of 0 tell.
    limit: [f32; QUAD],
    /// Some lines do not go through the center.
    parted: bool,
}

/// What a side product may be off by and still tell what the triangle's own test will say, in units of `u e r`: u is single
/// precision's unit roundoff, e the length of the longest edge, r the sum of how far the triangle and the rays lie from the
/// center, which the triangle's distance from a ray's start does not exceed.
///
/// Here the corners are off by u r, as the rays are; the products of rounded numbers by `4.7 u e r` at the crossed edge, by 3 at
/// the last dot product, by 1 each at rounding the direction and the last sum: 10 in all (moments: `2.7 + 3 + 1 + 1 + 1`).
/// The own test moves corners by u r, their coordinates across the ray by 2 and 5.5 on axes that may be as short as
/// `sqrt(1/2)`, and turns an edge's answer within 2: 12.2 together. Two products beyond their limit on different sides put
/// the ray `limit / e` away from all three edges, not only from two: on the third edge they would have one sign.
/// The rest is for terms of second order and the limit's own rounding. (Where the machine multiplies and adds at once there are fewer
/// roundings than are counted here.)
const MARGIN: f32 = 28.0 * (f32::EPSILON / 2.0);

/// Lines that pass the center by no more than this share of how far off they start are taken to go through it: rounding starts and
/// directions moves them so far. What they pass it by is added to the margin.
const THROUGH: f32 = 8.0 * (f32::EPSILON / 2.0);

/// Square of the sine between two rays that tell where both go. What starts less than a thousandth of the way apart is small beside
/// the margin at the other end of the way: then it is better seen from the start.
const LEAST_ANGLE: f64 = 1.0 / (1 << 20) as f64;

/// Edges and distances whose squares leave these bounds are not told: there products may vanish or overflow.
const SOUND: [f64; 2] = [1e-30, 1e30];

impl<S: Scalar> Center<S> {
    /// At the start of the first of eight rays.
    #[inline(always)]
    pub fn at_start(rays: &Rays<S::Lane>) -> Self {
        let v = &rays.origin;
        Self { at: [v.x, v.y, v.z].map(|x| x.lanes()[0]), ..Self::default() }
    }

    /// Where the lines of two rays, each the given lane of a packet, are nearest to each other: a light that shadow rays go to. None if
    /// they go nearly the same way.
    #[inline(always)]
    pub fn where_meet(rays: [(&Rays<S::Lane>, usize); 2]) -> Option<Self> {
        let [(o, d), (p, e)] = rays.map(|(rays, lane)| {
            let of = |v: &Vec3<S::Lane>| [v.x, v.y, v.z].map(|x| x.lanes()[lane].to_f64());
            (DVec3::from_array(of(&rays.origin)), DVec3::from_array(of(&rays.dir)))
        });
        let across = d.cross(e);
        let square = across.length_squared();
        let at = o + d * ((p - o).cross(e).dot(across) / square);
        let at = at.to_array().map(S::from_f64);
        (square > LEAST_ANGLE).then_some(Self { at, ..Self::default() })
    }

    /// True if all lines that it has taken in go through it.
    #[inline(always)]
    pub fn is_common(&self) -> bool {
        !self.parted
    }

    /// Puts into `lines` the lines about it of rays, one packet after the other; it then takes in those of the lanes given.
    #[inline(always)]
    pub fn take_in<'a>(
        &mut self,
        packets: impl Iterator<Item = (&'a Rays<S::Lane>, u8)>,
        lines: &mut [PluckerLines],
    ) {
        let at = DVec3::from_array(self.at.map(S::to_f64));
        let (mut starts, mut gaps) = (f32x8::zero(), f32x8::zero());
        for ((rays, lanes), lines) in packets.zip(lines) {
            let from: Vec3<f32x8> = (rays.origin - Vec3::splat(at)).cast();
            let dir: Vec3<f32x8> = rays.dir.cast();
            let (moment, lanes) = (from.cross(dir), Mask::from_bits(lanes));
            // (NaN is not kept.)
            starts = Lane::max(lanes.keep(from.fused_dot(from)), starts);
            gaps = Lane::max(lanes.keep(moment.fused_dot(moment)), gaps);
            (lines.dir, lines.moment) = ([dir.x, dir.y, dir.z], [moment.x, moment.y, moment.z]);
        }
        let gap = highest(gaps).sqrt();
        self.reach = highest(starts).sqrt();
        self.parted = gap > THROUGH * self.reach;
        self.gap = if self.parted { 0.0 } else { gap };
    }
}

/// The lines of two packets side by side: sixteen numbers take an operation where the machine has AVX-512, and two where it
/// has not.
#[derive(Debug, Clone, Copy)]
pub struct LinePairs {
    dir: [f32x16; 3],
    moment: [f32x16; 3],
}

impl LinePairs {
    /// Of two packets' lines.
    #[inline(always)]
    pub fn of([a, b]: [&PluckerLines; 2]) -> Self {
        let beside =
            |a: &[f32x8; 3], b: &[f32x8; 3]| [0, 1, 2].map(|axis| bytemuck::cast([a[axis], b[axis]]));
        Self { dir: beside(&a.dir, &b.dir), moment: beside(&a.moment, &b.moment) }
    }
}

/// Which of eight rays pass through which of four rows.
///
/// In one word, sixteen bits a row and the lower eight of them in use: so two packets' answers come apart by one shift, and nothing
/// is stored byte by byte that is then read as a word, which costs a stall.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Passing(u64);

impl Passing {
    const ROW_BITS: usize = 16;
    /// A bit in each row.
    const EACH_ROW: u64 = u64::MAX / u16::MAX as u64;

    /// All rays through some rows.
    #[inline(always)]
    pub fn through_all(rows: &Range<usize>) -> Self {
        let below = |row: usize| {
            u64::MAX.checked_shr((u64::BITS as usize - Self::ROW_BITS * row) as u32).unwrap_or(0)
        };
        Self(below(rows.end) & !below(rows.start)).of(!0)
    }

    /// True if no ray passes through any.
    #[inline(always)]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Rays that pass through a row.
    #[inline(always)]
    pub fn row(self, row: usize) -> u8 {
        (self.0 >> (Self::ROW_BITS * row)) as u8
    }

    /// With these rays, and no others, through a row.
    #[inline(always)]
    pub fn with(self, row: usize, rays: u8) -> Self {
        let shift = Self::ROW_BITS * row;
        Self(self.0 & !(0xff << shift) | u64::from(rays) << shift)
    }

    /// Only some rays.
    #[inline(always)]
    pub fn of(self, rays: u8) -> Self {
        Self(self.0 & (Self::EACH_ROW * u64::from(rays)))
    }

    /// Each ray through the first of its rows only.
    #[inline(always)]
    pub fn first_rows(self) -> Self {
        let Self(all) = self;
        let before = all << Self::ROW_BITS | all << (2 * Self::ROW_BITS) | all << (3 * Self::ROW_BITS);
        Self(all & !before)
    }

    /// The rays that pass through any row.
    #[inline(always)]
    pub fn rays(self) -> u8 {
        let Self(all) = self;
        let two = all | all >> (2 * Self::ROW_BITS);
        (two | two >> Self::ROW_BITS) as u8
    }

    /// By ray, which of the four rows it passes through, if that is one; 0 if it passes by all.
    #[inline(always)]
    pub fn rows_of_rays(self) -> [u32; LANES] {
        let [_, one, two, three] = [0, 1, 2, 3].map(|row| self.row(row));
        of_two_bits(one | three, two | three)
    }

    /// What is in `other`, too.
    #[inline(always)]
    fn both(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Without what is in `other`.
    #[inline(always)]
    pub fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Rows that any ray passes through.
    #[inline(always)]
    pub fn rows(self) -> impl Iterator<Item = usize> {
        let Self(mut rest) = self;
        std::iter::from_fn(move || {
            (rest != 0).then(|| {
                let row = rest.trailing_zeros() as usize / Self::ROW_BITS % QUAD;
                rest &= !(0xff << (Self::ROW_BITS * row));
                row
            })
        })
    }
}

impl Outlines {
    /// Of triangles with these corners.
    #[inline(always)]
    pub(super) fn of<S: Scalar>([a, b, c]: [Four<S::Quad>; 3], center: &Center<S>) -> Self {
        let at = in_four::<S::Quad>(center.at);
        let (a, b, c) = (seen_from(a, at), seen_from(b, at), seen_from(c, at));
        let (ab, bc, ca) = (less_four(b, a), less_four(c, b), less_four(a, c));
        let longest = Quad::max(Quad::max(dot(ab, ab), dot(bc, bc)), dot(ca, ca));
        let away = dot(a, a);
        let (e, reach) = (longest.sqrt(), f32x4::splat(center.reach));
        let limit = e * (f32x4::splat(MARGIN) * (away.sqrt() + e + reach) + f32x4::splat(center.gap));
        let sound = Quad::gt(longest, Quad::lit(SOUND[0]))
            & Quad::le(away + longest + reach * reach, Quad::lit(SOUND[1]));
        let limit = sound.choose(limit, Quad::lit(f64::INFINITY));
        Self {
            normal: [in_rows(cross(a, ab)), in_rows(cross(b, bc)), in_rows(cross(c, ca))],
            edge: [in_rows(ab), in_rows(bc), in_rows(ca)],
            limit: limit.to_array(),
            parted: center.parted,
        }
    }

    /// By packet, which lines surely pass through triangles `rows` of the four, and of which it is not sure whether they do. `all` is
    /// [`Passing::through_all`] of these.
    #[inline(always)]
    pub fn meet(&self, rows: &Range<usize>, all: Passing, lines: &LinePairs) -> [[Passing; 2]; 2] {
        if self.parted {
            self.meet_each::<true>(rows, all, lines)
        } else {
            self.meet_each::<false>(rows, all, lines)
        }
    }

    #[inline(always)]
    fn meet_each<const PARTED: bool>(
        &self,
        rows: &Range<usize>,
        all: Passing,
        lines: &LinePairs,
    ) -> [[Passing; 2]; 2] {
        let (mut told, mut astride) = (0, 0);
        for row in rows.clone() {
            let of_row = self.meet_one::<PARTED>(row, lines);
            let [is_told, is_astride] = of_row.map(|yes| sixteen_bits(yes, Passing::ROW_BITS * row));
            (told, astride) = (told | is_told, astride | is_astride);
        }
        [0, LANES].map(|shift| {
            let [told, astride] = [told, astride].map(|both| Passing(both >> shift));
            [all.both(told).without(astride), all.without(told)]
        })
    }

    /// Of one triangle, an answer for each of sixteen lines, by sign: whether it is told; and if so, whether the line passes edges on
    /// either side.
    #[inline(always)]
    fn meet_one<const PARTED: bool>(&self, row: usize, lines: &LinePairs) -> [f32x16; 2] {
        let k = row % QUAD;
        let side = |edge: usize| {
            let moments = PARTED.then(|| product(&self.edge[edge], k, &lines.moment, None));
            product(&self.normal[edge], k, &lines.dir, moments)
        };
        let (a, b, c) = (side(0), side(1), side(2));
        // A NaN is one in all three, and compares with nothing.
        let (least, most) = (a.fast_min(b).fast_min(c), a.fast_max(b).fast_max(c));
        // Told are lines that pass no edge within the limit, or on both sides beyond it.
        let told = least.abs().fast_min(most.abs()).simd_gt(f32x16::splat(self.limit[k]));
        [told, least ^ most]
    }
}

/// A corner from the center.
#[inline(always)]
fn seen_from<Q: Quad>(corner: Four<Q>, center: Four<Q>) -> Four<f32x4> {
    let [x, y, z] = less_four(corner, center);
    [x.to_f32s(), y.to_f32s(), z.to_f32s()]
}

/// Lanes as numbers.
#[inline(always)]
fn in_rows([x, y, z]: Four<f32x4>) -> [[f32; QUAD]; 3] {
    [x.to_array(), y.to_array(), z.to_array()]
}

/// Row `k` of `a` times `b`, and `sum`.
#[inline(always)]
fn product(a: &[[f32; QUAD]; 3], k: usize, b: &[f32x16; 3], sum: Option<f32x16>) -> f32x16 {
    let at = |axis: usize| f32x16::splat(a[axis][k]);
    let z = sum.map_or(at(2) * b[2], |sum| at(2).mul_add(b[2], sum));
    at(0).mul_add(b[0], at(1).mul_add(b[1], z))
}

/// Scalar product.
#[inline(always)]
fn dot([ax, ay, az]: Four<f32x4>, [bx, by, bz]: Four<f32x4>) -> f32x4 {
    ax.mul_add(bx, ay.mul_add(by, az * bz))
}

/// Vector product.
#[inline(always)]
fn cross([ax, ay, az]: Four<f32x4>, [bx, by, bz]: Four<f32x4>) -> Four<f32x4> {
    [ay.mul_sub(bz, az * by), az.mul_sub(bx, ax * bz), ax.mul_sub(by, ay * bx)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::{Block, Triangles};
    use crate::lane::{each_lane, f64x8};
    use crate::random::Random;

    /// Where rays come from, or go to.
    #[derive(Clone, Copy, PartialEq)]
    enum Ends {
        OneStart,
        Starts,
        Light,
    }

    /// Rays at and beside triangles near and far, large and tiny, at their insides, edges and corners: how many lanes were told,
    /// and of how many.
    fn check<L: Lane>(ends: Ends) -> (u32, u32) {
        let mut numbers = Random::new(7);
        let (mut told, mut of, mut common) = (0, 0, 0);
        for round in 0..4000 {
            let size = 10f64.powf(numbers.between(-1.0, 1.0) * 2.0);
            let place = numbers.vector(1.0) * 10.0;
            let corners = [0; 3].map(|_| place + numbers.vector(1.0) * size);
            let mut triangles = Triangles::<L::Scalar>::default();
            triangles.push(corners);
            let eye = numbers.vector(1.0) * 10.0;
            // One ray in two goes past an edge or a corner within 10^-1 to 10^-17.
            let at = each_lane(|k| {
                let [u, v] = [numbers.between(-1.0, 1.0), numbers.between(-1.0, 1.0)];
                let near = if k % 2 == 0 { 0.0 } else { 10f64.powf(numbers.between(-1.0, 1.0) * 8.0 - 9.0) };
                let [u, v] = [[u, v], [near, v], [near, 1.0 - near], [u, 1.0 - u + near]][round % 4];
                corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v
            });
            let (origins, dirs) = match ends {
                // From beyond the triangle to the light.
                Ends::Light => {
                    let origins = at.map(|at| at + (at - eye) * numbers.between(0.1, 1.0));
                    (origins, each_lane(|k| (eye - origins[k]).normalize()))
                }
                _ => {
                    let apart = if ends == Ends::Starts { 1.0 } else { 0.0 };
                    let origins = each_lane(|_| eye + numbers.vector(1.0) * apart);
                    (origins, each_lane(|k| (at[k] - origins[k]).normalize()))
                }
            };
            let rays = Rays { origin: Vec3::<L>::from_fn(|k| origins[k]), dir: Vec3::from_fn(|k| dirs[k]) };
            let met = Center::where_meet([(&rays, 0), (&rays, LANES - 1)]).filter(|_| ends == Ends::Light);
            let mut center = met.unwrap_or_else(|| Center::<L::Scalar>::at_start(&rays));
            let mut lines = PluckerLines::default();
            center.take_in([(&rays, !0)].into_iter(), std::slice::from_mut(&mut lines));
            common += u32::from(center.is_common());
            let pair = LinePairs::of([&PluckerLines::default(), &lines]);
            let rows = 0..1;
            let outlines = triangles.outlines(0, &center);
            let [_, [through, unsure]] = outlines.meet(&rows, Passing::through_all(&rows), &pair);
            let t = triangles.roots(0, &rays, None)[0];
            let from = L::lit(f64::NEG_INFINITY);
            let known = triangles.first_through(0, through, &rays, from).to_array();
            let (through, unsure) = (through.row(0), unsure.row(0));
            for (k, t) in t.to_array().into_iter().enumerate().filter(|(k, _)| unsure >> k & 1 == 0) {
                let (t, known) = (t.to_f64(), known[k].to_f64());
                assert_eq!(through >> k & 1 == 1, !t.is_nan(), "{round} {k}");
                assert!(t.is_nan() || t == known, "{round} {k}: {t} {known}");
            }
            told += LANES as u32 - unsure.count_ones();
            of += LANES as u32;
        }
        // (Past a tiny triangle rays to a light go nearly the same way.)
        let expected = [4000..=4000, 0..=0, 2000..=4000][ends as usize].clone();
        assert!(expected.contains(&common), "{common} of 4000 have a point in common");
        (told, of)
    }

    #[test]
    fn rays_are_taken_row_by_row() {
        let all = [0b0110, 0b0011, 0, 0b1010].into_iter().enumerate();
        let all = all.fold(Passing::default(), |all, (row, rays)| all.with(row, rays));
        let rays = |passing: Passing| [0, 1, 2, 3].map(|row| passing.row(row));
        assert_eq!(rays(all.first_rows()), [0b0110, 0b0001, 0, 0b1000]);
        let rest = all.without(all.first_rows());
        assert_eq!(rays(rest), [0, 0b0010, 0, 0b0010]);
        assert_eq!(rays(rest.without(rest.first_rows())), [0, 0, 0, 0b0010]);
        assert_eq!(rays(all.of(0b1001)), [0, 0b0001, 0, 0b1000]);
        assert_eq!(all.first_rows().rows_of_rays(), [1, 0, 0, 3, 0, 0, 0, 0]);
        assert_eq!((all.rays(), rest.rays(), Passing::default().rays()), (0b1111, 0b0010, 0));
        let eights = |passing: Passing| rays(passing).map(|rays| rays == 0xff);
        assert_eq!(eights(Passing::through_all(&(0..QUAD))), [true; QUAD]);
        assert_eq!(eights(Passing::through_all(&(1..3))), [false, true, true, false]);
        assert_eq!(Passing::through_all(&(1..3)).rows().collect::<Vec<_>>(), [1, 2]);
        assert!(all.rows().eq([0, 1, 3]) && all.with(1, 0).rows().eq([0, 3]));
    }

    #[test]
    fn what_is_told_is_what_the_test_says() {
        for ends in [Ends::OneStart, Ends::Starts, Ends::Light] {
            for (told, of) in [check::<f32x8>(ends), check::<f64x8>(ends)] {
                // Three rays in eight are aimed at an edge or a corner, most of them nearer than single precision sees.
                assert!(told > of / 2, "{told} of {of}");
            }
        }
    }
}
