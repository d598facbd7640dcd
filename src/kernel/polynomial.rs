//! Polynomial surfaces (`quadric`, `cubic`, `quartic`, `poly`), always computed in f64.
//!
//! Along a ray the surface is a polynomial in one unknown. Between the roots of its derivative it is monotone, so it
//! has one root there or none: from the highest derivative, which is linear, down to the polynomial itself every root is
//! alone in a bracket, where Newton's method cannot leave it (Yuksel 2022, High-performance polynomial root finding for
//! graphics, sections 3 and 4). The unknown is counted from the ray's closest point to the middle, which keeps the
//! coefficients of the size of the shape.

use super::frame::{Frames, narrowed, widened};
use super::polytope::{HalfSpace, Quadric};
use super::univariate::{Step, Univariate, steps};
use super::zeros::around_zeros;
use super::{Aabb, Block, Left, Looking, OwnSpace, Rays, Solid, Surfaces, first_beyond, permuted};
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, f64x8};
use crate::scene::{Polynomial, Transform};
use glam::{DMat3, DVec3};
use smallvec::SmallVec;
use std::sync::Arc;

/// `n` polynomial surfaces: each a frame, a polynomial that may be shared, and a box that the scene vouches for.
#[derive(Debug, Clone, Default)]
pub struct Polynomials<S> {
    frames: Frames<S>,
    polynomial: Vec<Arc<Polynomial>>,
    /// What is made of each once for all its copies.
    made: Vec<Arc<Made>>,
    /// Of order 2, what spares summing it up.
    quadric: Vec<Option<OfOrderTwo>>,
    bounds: Vec<Aabb>,
}

/// What a polynomial is, wherever it stands.
#[derive(Debug)]
struct Made {
    /// How it is summed up along rays.
    steps: Vec<Step>,
    /// Around all that is inside, if that is known to have an end.
    around: Aabb,
}

impl Made {
    fn new(polynomial: &Polynomial, quadric: Option<&Quadric>) -> Self {
        let steps = steps(polynomial);
        let around = match quadric {
            Some(quadric) => quadric.bounds_in(Aabb::INFINITE),
            None => around_zeros(polynomial, &steps),
        };
        Self { steps, around }
    }
}

/// Among so many surfaces before it a new one is looked for: copies mostly come one after the other, or by turns.
const COPIES_WITHIN: usize = 16;

/// Crossings farther than this from the closest point to the middle, in own space, are not looked for (POV-Ray's
/// greatest distance).
const REACH: f64 = 1e7;

/// Rounding of the ends between which roots are looked for, with room; they only save work.
const RANGE_ROUNDINGS: f64 = 64.0;

/// What tells that a quadric is not crossed is larger by this share of its terms, far more than rounding.
const SURE: f64 = 1.0 / (1u64 << 30) as f64;

/// A plane is parallel to axes if its normal has no more than this share along them: some roundings of a turn.
const PARALLEL: f64 = 1e-12;

/// What ends of a box may be off by, as a share of the farthest.
const ENDS_ROOM: f64 = 1e-9;

/// A quadric, and what its terms are at most at a distance of 1: of second order, of first, and the constant.
#[derive(Debug, Clone, Copy)]
struct OfOrderTwo {
    quadric: Quadric,
    sizes: [f64; 3],
}

impl OfOrderTwo {
    fn new(quadric: Quadric) -> Self {
        let Quadric { matrix: DMat3 { x_axis, y_axis, z_axis }, linear, constant } = quadric;
        let squares = [x_axis, y_axis, z_axis].map(|axis| axis.abs().element_sum()).iter().sum();
        Self { quadric, sizes: [squares, linear.abs().element_sum(), constant.abs()] }
    }

    /// Rays that cross it nowhere ahead, so far as that can be told where they start: beyond rounding, they have none of its roots, or
    /// none but behind.
    #[inline(always)]
    fn is_passed_by(&self, Rays { origin, dir }: &Rays<f64x8>) -> Mask<f64x8> {
        let [constant, slope, square] = along_quadric(&self.quadric, *origin, *dir);
        let [squares, linear, fixed] = self.sizes.map(f64x8::splat);
        let (far, length, room) = (origin.abs().max_element(), dir.abs().max_element(), f64x8::lit(SURE));
        let twice = squares * far + linear;
        // What each of the three may be off by, with room.
        let most = [twice.fused(far, fixed), squares.fused(far, twice) * length, squares * length * length];
        let off = most.map(|most| most * room);
        let half = slope * f64x8::lit(0.5);
        let missed = (constant * square - half * half).gt(off[0].fused(most[2], off[1] * slope.abs()));
        let outward = |x: f64x8| constant.lt(f64x8::zero()).select(-x, x);
        let behind = outward(constant).gt(off[0]) & outward(slope).gt(off[1]) & outward(square).gt(off[2]);
        missed | behind
    }
}

/// A polynomial of order 2.
fn quadric(polynomial: &Polynomial) -> Option<Quadric> {
    let &[xx, xy, xz, x, yy, yz, y, zz, z, constant] = polynomial.coefficients() else { return None };
    let (xy, xz, yz) = (xy * 0.5, xz * 0.5, yz * 0.5);
    let matrix = DMat3::from_cols([xx, xy, xz].into(), [xy, yy, yz].into(), [xz, yz, zz].into());
    Some(Quadric { matrix, linear: DVec3::new(x, y, z), constant })
}

/// What a quadric is along rays: constant, slope and square.
#[inline(always)]
fn along_quadric(quadric: &Quadric, origin: Vec3<f64x8>, dir: Vec3<f64x8>) -> [f64x8; QUADRATIC] {
    let Quadric { matrix: DMat3 { x_axis, y_axis, z_axis }, linear, constant } = quadric;
    let times = |v: Vec3<f64x8>| {
        let row = |k: usize| {
            let [x, y, z] = [x_axis, y_axis, z_axis].map(|axis| f64x8::splat(axis[k]));
            z.fused(v.z, y.fused(v.y, x * v.x))
        };
        Vec3::new(row(0), row(1), row(2))
    };
    let (linear, toward) = (Vec3::<f64x8>::splat(*linear), times(dir));
    let square = toward.fused_dot(dir);
    let slope = linear.fused_dot(dir) + toward.fused_dot(origin) * f64x8::lit(2.0);
    [(times(origin) + linear).fused_dot(origin) + f64x8::splat(*constant), slope, square]
}

/// Value and gradient of a polynomial.
fn gradient(polynomial: &Polynomial, p: Vec3<f64x8>) -> (f64x8, Vec3<f64x8>) {
    let zero = f64x8::zero();
    let (order, mut coefficients) = (polynomial.order(), polynomial.coefficients().iter());
    // A Horner scheme in each unknown, with the derivatives carried along.
    let (mut f, mut f_x, mut f_y, mut f_z) = (zero, zero, zero, zero);
    for i in 0..=order {
        let (mut g, mut g_y, mut g_z) = (zero, zero, zero);
        for j in 0..=i {
            let (mut h, mut h_z) = (zero, zero);
            for _ in 0..=j {
                h_z = h_z.fused(p.z, h);
                h = h.fused(p.z, f64x8::splat(coefficients.next().copied().unwrap_or_default()));
            }
            g_y = g_y.fused(p.y, g);
            g_z = g_z.fused(p.y, h_z);
            g = g.fused(p.y, h);
        }
        f_x = f_x.fused(p.x, f);
        f_y = f_y.fused(p.x, g_y);
        f_z = f_z.fused(p.x, g_z);
        f = f.fused(p.x, g);
    }
    (f, Vec3::new(f_x, f_y, f_z))
}

/// A ray's polynomial and where its unknown is 0.
struct Ray<const N: usize> {
    along: Univariate<N>,
    /// Distance from the ray's start to the place where the unknown is 0.
    base: f64x8,
    /// Length of one unit of `t` in own space, inverted.
    inv: f64x8,
    /// The size of the coordinates at 0.
    grain: f64x8,
}

impl<const N: usize> Ray<N> {
    /// No root lies farther from 0 than this; and the lanes in which that, and all else, is sound.
    #[inline(always)]
    fn reach(&self) -> (f64x8, Mask<f64x8>) {
        let Self { along, base, .. } = self;
        // Cauchy's bound of the roots.
        let (lead, rest) = along.c[..along.len].split_last().unwrap_or((base, &[]));
        let most = rest.iter().fold(f64x8::zero(), |most, c| c.abs().max(most));
        let reach = f64x8::lit(REACH).min(f64x8::lit(1.0) + most / lead.abs());
        (reach, (*base + most + lead.abs()).abs().lt(f64x8::lit(f64::INFINITY)))
    }
}

/// Which roots are asked for.
#[derive(Clone, Copy)]
enum Wanted<'a, L> {
    /// All.
    All,
    /// Those where rays look.
    Between(&'a Looking<L>),
    /// The first of these.
    First(&'a Looking<L>),
}

/// The roots of polynomials along rays.
struct Roots<const N: usize> {
    /// Rising, NaN where there is none.
    t: [f64x8; N],
    /// As many of them are in use,
    len: usize,
    /// and as many there are at most, with those at the start.
    most: usize,
    /// Those at the start, if some rays start on the surface.
    starts: Option<[f64x8; 2]>,
    /// Where the polynomial is negative before all of these, if not only the first is asked for.
    negative_before: Mask<f64x8>,
}

impl<S: Scalar> Polynomials<S> {
    /// Adds the image of a surface.
    pub fn push(&mut self, world_from_object: &Transform, polynomial: &Arc<Polynomial>) {
        self.frames.push(world_from_object);
        let quadric = quadric(polynomial);
        let mut before = self.polynomial.iter().zip(&self.made).rev().take(COPIES_WITHIN);
        let same = before.find(|(other, _)| *other == polynomial).map(|(_, made)| made.clone());
        let made = same.unwrap_or_else(|| Arc::new(Made::new(polynomial, quadric.as_ref())));
        let own = made.around;
        self.bounds.push(match own.is_finite() {
            true => self.frames.bounds(self.bounds.len(), own.center(), (own.max - own.min) * 0.5),
            false => Aabb::INFINITE,
        });
        self.made.push(made);
        self.polynomial.push(polynomial.clone());
        self.quadric.push(quadric.map(OfOrderTwo::new));
    }

    /// The scene vouches for the bounds of the last row. Where these turn out too small what stands out of them is seen, too, by
    /// rays that meet them, as in POV-Ray.
    pub fn bound_last(&mut self, bounds: Aabb) {
        if let Some(last) = self.bounds.last_mut()
            && bounds.intersection(*last) != *last
        {
            *last = bounds;
        }
    }

    /// Half spaces that the inside of a quadric lies in as far as it lies in all of `others`: none of other surfaces.
    pub fn half_spaces(&self, i: usize, others: &[HalfSpace]) -> Vec<HalfSpace> {
        let Some(OfOrderTwo { quadric, .. }) = &self.quadric[i] else { return Vec::new() };
        let OwnSpace { center, map } = self.frames.own_space(i);
        let forward = map.inverse();
        // Those whose planes are parallel to two of its axes.
        let mut within = Aabb::INFINITE;
        for &HalfSpace { normal, at } in others {
            let own = forward.transpose() * normal;
            let axis = own.abs().max_position();
            let rest = own.abs().element_sum() - own[axis].abs();
            if rest > own[axis].abs() * PARALLEL {
                continue;
            }
            let end = (at - normal.dot(center)) / own[axis];
            if own[axis] > 0.0 {
                within.max[axis] = within.max[axis].min(end);
            } else {
                within.min[axis] = within.min[axis].max(end);
            }
        }
        let bounds = quadric.bounds_in(within);
        let ends = bounds.min.to_array().into_iter().chain(bounds.max.to_array());
        let farthest = ends.filter(|end| end.is_finite()).fold(0.0, |most: f64, end| most.max(end.abs()));
        let room = ENDS_ROOM * farthest;
        let bounds = Aabb { min: bounds.min - room, max: bounds.max + room };
        let placed = |own: HalfSpace| {
            let normal = map.transpose() * own.normal;
            let length = normal.length();
            let normal = normal / length;
            HalfSpace { normal, at: own.at / length + normal.dot(center) }
        };
        HalfSpace::of_box(bounds).map(placed).collect()
    }

    fn own_rays(&self, i: usize, rays: &Rays<S::Lane>) -> Rays<f64x8> {
        self.frames.at(i).in_f64().rays(&rays.in_f64())
    }

    /// The polynomial along the rays, from their starts in the lanes of `on` and else from the closest point to the middle.
    #[inline(always)]
    fn ray<const N: usize>(&self, i: usize, own: &Rays<f64x8>, on: Mask<f64x8>) -> Ray<N> {
        let inv = f64x8::lit(1.0) / own.dir.length();
        let dir = own.dir * inv;
        // Twice: the first step leaves the rounding of a far start along the ray.
        let coarse = -own.origin.dot(dir);
        let near = own.origin + dir * coarse;
        let fine = -near.dot(dir);
        let origin = Vec3::select(on, own.origin, near + dir * fine);
        let base = on.select(f64x8::zero(), coarse + fine);
        let along = match &self.quadric[i] {
            Some(OfOrderTwo { quadric, .. }) => Univariate::quadratic(along_quadric(quadric, origin, dir)),
            None => {
                let mut along = Univariate::zero();
                along.go_along(&self.made[i].steps, origin, dir, false);
                along
            }
        };
        Ray { along, base, inv, grain: origin.abs().max_element() }
    }

    /// The roots along rays; none if all lanes that look are known to have none.
    #[inline(always)]
    fn solved<const N: usize>(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        left: Option<&Left<S::Lane>>,
        wanted: Wanted<S::Lane>,
    ) -> Roots<N> {
        let none = f64x8::lit(f64::NAN);
        let nowhere =
            |negative_before| Roots { t: [none; N], len: 0, most: 0, starts: None, negative_before };
        let own = self.own_rays(i, rays);
        let on = left.map_or(Mask::none_set(), |left| left.on.cast());
        let mut ray = self.ray::<N>(i, &own, on);
        let mut lanes = Mask::all_set();
        if let Wanted::Between(looking) | Wanted::First(looking) = wanted {
            // (Not so where the start is a root.)
            lanes = Mask::from_bits(looking.lanes) & (!ray.along.has_one_sign() | on);
            if lanes.none() {
                return nowhere(ray.along.c[0].lt(f64x8::zero()));
            }
        }
        let (reach, sound) = ray.reach();
        let mut ends = [-reach, reach];
        lanes &= sound;
        if let Wanted::Between(looking) | Wanted::First(looking) = wanted {
            // Wider by more than the roundings of this and of the distance that comes of a root.
            let [near, far] = [looking.from, looking.to].map(|t| t.to_f64s() / ray.inv);
            let room =
                |s: f64x8| (s.abs() + ray.base.abs()) * f64x8::lit(RANGE_ROUNDINGS * f64::UNIT_ROUNDOFF);
            ends[0] = ((near - ray.base) - room(near)).max(ends[0]);
            ends[1] = ((far - ray.base) + room(far)).min(ends[1]);
            if let Wanted::Between(_) = wanted {
                // (At a root there is no telling which sign it has.)
                ends[0] = on.select(-reach, ends[0]);
            }
            lanes &= ends[0].le(ends[1]);
        }
        let negative_before = match wanted {
            Wanted::All | Wanted::Between(_) => ray.along.value(ends[0]).lt(f64x8::zero()) & sound,
            Wanted::First(_) => Mask::none_set(),
        };
        if lanes.none() && !matches!(wanted, Wanted::All) {
            return nowhere(negative_before);
        }
        let most = ray.along.len.saturating_sub(1);
        let mut starts = None;
        if on.any() {
            // The start is a root, and where the slope there is below its rounding it is a double one.
            let noise = self.slope_noise::<N>(i, rays, &own);
            ray.along.divide(on);
            let tangent = on & ray.along.c[0].abs().le(noise);
            ray.along.divide(tangent);
            starts = Some([on.select(f64x8::zero(), none), tangent.select(f64x8::zero(), none)]);
            if (on | !lanes).all() {
                // All have one root less.
                ray.along.len = most;
            }
        }
        let seen = |root: f64x8| {
            let Wanted::First(looking) = wanted else { return Mask::none_set() };
            S::Lane::from_f64s((ray.base + root) * ray.inv).gt(looking.from).cast()
        };
        let mut t = ray.along.roots(ends, ray.grain, lanes, |root, crosses| !(crosses & seen(root)));
        let len = ray.along.len.saturating_sub(1);
        for s in &mut t[..len] {
            *s = (ray.base + *s) * ray.inv;
        }
        Roots { t, len, most, starts, negative_before }
    }

    /// Crossings that are wanted, rising but for NaN; and where the polynomial is negative before all of them.
    #[inline(always)]
    fn crossings<const N: usize>(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        left: Option<&Left<S::Lane>>,
        wanted: Wanted<S::Lane>,
        out: &mut impl Extend<S::Lane>,
    ) -> Mask<S::Lane> {
        let Roots { t, len, most, starts, negative_before } = self.solved::<N>(i, rays, left, wanted);
        if let Some(starts) = starts {
            let mut all: SmallVec<[f64x8; 4]> = t[..len].iter().copied().collect();
            for start in starts {
                insert(&mut all, start);
            }
            all.truncate(most);
            out.extend(all.into_iter().map(S::Lane::from_f64s));
        } else {
            out.extend(t[..len].iter().map(|&t| S::Lane::from_f64s(t)));
        }
        negative_before.cast()
    }

    /// The first crossing that rays look for; those at their starts are none.
    fn first_crossing<const N: usize>(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        left: Option<&Left<S::Lane>>,
        looking: &Looking<S::Lane>,
    ) -> S::Lane {
        let Roots { t, len, .. } = self.solved::<N>(i, rays, left, Wanted::First(looking));
        first_beyond(t[..len].iter().map(|&t| S::Lane::from_f64s(t)), looking.from)
    }

    /// Bounds the rounding of the polynomial's slope at the rays' starts, along unit directions in own space: what the
    /// rounding of start and direction make of it, by the magnitudes of its terms.
    fn slope_noise<const N: usize>(&self, i: usize, rays: &Rays<S::Lane>, own: &Rays<f64x8>) -> f64x8 {
        let frame = self.frames.at(i);
        let inv = f64x8::lit(1.0) / own.dir.length();
        let tiny = f64x8::lit(f64::MIN_POSITIVE);
        let start: Vec3<f64x8> = widened(frame.start_error(rays));
        let turn: Vec3<f64x8> = widened(frame.direction_error(rays)) * inv;
        let (most, most_turn) = (start.max_element().max(tiny), turn.max_element().max(tiny));
        // Along the direction, the start's error and the direction's at once, each of about unit length: of the terms that
        // come of it, those wanted are some and none is negative.
        let dir =
            own.dir.abs() * inv + start * (f64x8::lit(1.0) / most) + turn * (f64x8::lit(1.0) / most_turn);
        let mut terms = Univariate::<N>::zero();
        terms.go_along(&self.made[i].steps, own.origin.abs(), dir, true);
        // The sums themselves: as many roundings as a term has factors, and some.
        let roundings = f64x8::lit(8.0 * terms.len as f64 * f64::UNIT_ROUNDOFF);
        terms.c[2] * most + terms.c[1] * (most_turn + roundings)
    }
}

/// Puts `x` in its place among rising numbers, NaN last, lane by lane.
fn insert(rising: &mut SmallVec<[f64x8; 4]>, mut x: f64x8) {
    let inf = f64x8::lit(f64::INFINITY);
    x = x.min(inf); // NaN counts as infinity.
    for y in rising.iter_mut() {
        let here = y.min(inf);
        (*y, x) = (here.min(x), here.max(x));
    }
    rising.push(x);
    for y in rising.iter_mut() {
        *y = y.lt(inf).select(*y, f64x8::lit(f64::NAN));
    }
}

/// Coefficients along a ray of order 2, up to order 4, which most surfaces have, and up to the highest.
const QUADRATIC: usize = 3;
const FEW: usize = 5;
const MANY: usize = Polynomial::MAX_ORDER + 1;

/// Evaluates `with`, in which `$n` is room enough for the coefficients of an order along a ray.
macro_rules! with_room {
    ($order:expr, $n:ident => $with:expr) => {
        match $order {
            ..QUADRATIC => {
                const $n: usize = QUADRATIC;
                $with
            }
            QUADRATIC..FEW => {
                const $n: usize = FEW;
                $with
            }
            FEW.. => {
                const $n: usize = MANY;
                $with
            }
        }
    };
}

impl<S: Scalar> Block<S> for Polynomials<S> {
    type Roots = SmallVec<[S::Lane; 4]>;

    fn len(&self) -> usize {
        self.polynomial.len()
    }

    #[inline]
    fn roots(&self, i: usize, rays: &Rays<S::Lane>, left: Option<&Left<S::Lane>>) -> Self::Roots {
        let mut all = SmallVec::new();
        with_room!(self.polynomial[i].order(), N => self.crossings::<N>(i, rays, left, Wanted::All, &mut all));
        all
    }

    /// (Both of one sum along the rays, which is what takes the time.)
    #[inline]
    fn cross(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        left: Option<&Left<S::Lane>>,
        looking: Option<&Looking<S::Lane>>,
        out: &mut Vec<S::Lane>,
    ) -> Mask<S::Lane> {
        let wanted = looking.map_or(Wanted::All, Wanted::Between);
        with_room!(self.polynomial[i].order(), N => self.crossings::<N>(i, rays, left, wanted, out))
    }

    #[inline]
    fn first(
        &self,
        i: usize,
        rays: &Rays<S::Lane>,
        left: Option<&Left<S::Lane>>,
        looking: &Looking<S::Lane>,
    ) -> S::Lane {
        // (Not among the roots, though these take their own rays once more: most rays are told here, and there pay for what is to follow.)
        if let (Some(quadric), None) = (&self.quadric[i], left) {
            let passed = quadric.is_passed_by(&self.own_rays(i, rays)).bits();
            if looking.lanes & !passed == 0 {
                return S::Lane::lit(f64::NAN);
            }
        }
        with_room!(self.polynomial[i].order(), N => self.first_crossing::<N>(i, rays, left, looking))
    }

    fn solid(&self, i: usize) -> Option<Solid> {
        let quadric = self.quadric[i]
            .map(|OfOrderTwo { quadric, .. }| Solid::Quadric(self.frames.own_space(i), quadric));
        Some(quadric.unwrap_or(Solid::Endless))
    }

    /// Where the polynomial is negative, farther out than all its roots.
    fn starts_inside(&self, i: usize, rays: &Rays<S::Lane>) -> Mask<S::Lane> {
        let mut all = SmallVec::<[_; 4]>::new();
        with_room!(self.polynomial[i].order(), N => self.crossings::<N>(i, rays, None, Wanted::All, &mut all))
    }

    fn resolve(
        &self,
        index: &[u32; LANES],
        active: Mask<S::Lane>,
        rays: &Rays<S::Lane>,
        t: S::Lane,
    ) -> Surfaces<S::Lane> {
        let frame = self.frames.gathered(index).in_f64();
        let own = frame.rays(&rays.in_f64());
        let p = own.origin + own.dir * t.to_f64s();
        let (mut value, mut slope) = (f64x8::zero(), Vec3::<f64x8>::default());
        let mut waiting = active.bits();
        while waiting != 0 {
            let first = index[waiting.trailing_zeros() as usize];
            let same = index.iter().enumerate().fold(0u8, |same, (k, &i)| same | u8::from(i == first) << k);
            waiting &= !same;
            let mask = Mask::<f64x8>::from_bits(same);
            let (v, g) = gradient(&self.polynomial[first as usize], p);
            value = mask.select(v, value);
            slope = Vec3::select(mask, g, slope);
        }
        // A Newton step along the gradient puts the point on the surface. Where there is no gradient, at a cusp or where
        // sheets cross, any normal will do.
        let square = slope.dot(slope);
        let smooth = square.gt(f64x8::zero()) & square.lt(f64x8::lit(f64::INFINITY));
        let step = smooth.keep(value / square);
        let any = Vec3::new(f64x8::lit(1.0), f64x8::zero(), f64x8::zero());
        let normal = Vec3::select(smooth, slope, any);
        Surfaces {
            point: self.frames.to_world(index, narrowed(p - slope * step)),
            normal: narrowed(frame.normal(normal)),
            ..Default::default()
        }
    }

    fn bounds(&self, i: usize) -> Aabb {
        self.bounds[i]
    }

    fn permute(&mut self, order: &[u32]) {
        self.frames.permute(order);
        self.polynomial = order.iter().map(|&i| self.polynomial[i as usize].clone()).collect();
        self.made = order.iter().map(|&i| self.made[i as usize].clone()).collect();
        self.quadric = permuted(&self.quadric, order);
        self.bounds = permuted(&self.bounds, order);
    }
}
