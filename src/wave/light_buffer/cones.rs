//! The few things around a light, each in the cone that it fills: eight ways to the light are held against all of them at once,
//! which takes less than to look up a cell for each. Where they are more than a handful, all eight ways against eight cones
//! first.

use super::Known;
use super::casters::{Caster, Casters};
use super::region::{Regions, slack_at};
use super::seen::relative;
use crate::bvh::Run;
#[cfg(doc)]
use crate::compile::NO_SURFACE;
use crate::compile::{Kind, SurfaceId};
use crate::lane::{
    LANES, Lane, Mask, Scalar, Vec3, bits, equal_lanes, f32x8, first_and_last, first_lanes, highest,
};
use glam::DVec3;

/// What stands around a light, in compiled space.
#[derive(Debug)]
pub struct Cones {
    /// Of what the light is beside.
    all: Vec<Cone>,
    /// The same by eights.
    eights: Vec<EightCones>,
    /// Some are not balls.
    boxed: bool,
    /// What it is in the box of.
    around: Vec<Run>,
    regions: Regions,
}

/// A caster as a light sees it, in a ball and in a box. Cosines are those between a way and that to the ball's middle, places are
/// counted from the caster to the light.
#[derive(Debug, Clone, Copy)]
struct Cone {
    axis: [f32; 3],
    /// The least cosine of a way that it may be in.
    least: f32,
    /// It is in the way of nothing nearer to the light than this.
    near: f32,
    /// From this cosine on ways end in it, if they begin beyond `beyond`.
    full: f32,
    beyond: f32,
    /// Least and greatest places in its box, which tell more of anything but a ball.
    corners: Option<[[f32; 3]; 2]>,
    /// Of convex solids, which are never in the way of their own front; else [`NO_SURFACE`].
    surface: SurfaceId,
    caster: Run,
}

/// Where the ways of eight cones go, as points of the unit sphere: those that are no farther from a point than so much.
#[derive(Debug)]
struct EightCones {
    axis: [[f32; LANES]; 3],
    reach: [f32; LANES],
}

/// What cosines of directions in single precision may be off by: a rounding or two each of their components, of three products and
/// two sums, and of the bound.
const COSINE_ROUNDING: f64 = 16.0 * f32::EPSILON as f64;
/// What distances may be off by, in parts: the same of a product and a bound.
const DISTANCE_ROUNDING: f64 = 8.0 * f32::EPSILON as f64;

impl Cones {
    /// Of all `casters`, of which these are `bounded`, where `S` is what rays are traced in.
    pub fn of<S: Scalar>(casters: &Casters, bounded: &[Caster], location: DVec3) -> Self {
        let slack = slack_at::<S>(location, casters.bounds);
        let regions = Regions::of(casters, location, slack);
        let (all, eights, around) = (Vec::new(), Vec::new(), Vec::new());
        let mut cones = Self { all, eights, boxed: false, around, regions };
        for caster in bounded {
            let (min, max) = relative(caster, location, slack);
            if min.max(-max).max_element() <= 0.0 {
                cones.regions.enter(caster, location, slack);
                cones.around.push(run(caster));
            } else {
                let cone = Cone::of(caster, location, slack);
                cones.boxed |= cone.corners.is_some();
                cones.all.push(cone);
            }
        }
        cones.eights = cones.all.chunks(LANES).map(EightCones::of).collect();
        cones
    }

    /// Hands those cones to `test` that any of the ways `lanes` may be in, and more.
    #[inline(always)]
    fn each_near(&self, way: &Way, lanes: u8, mut test: impl FnMut(&Cone)) {
        if self.eights.len() <= 1 || lanes == 0 {
            self.all.iter().for_each(test);
            return;
        }
        let bundle = Bundle::of(way, lanes);
        for (cones, eight) in self.all.chunks(LANES).zip(&self.eights) {
            for k in bits(bundle.meets(eight) & first_lanes(cones.len())) {
                if let Some(cone) = cones.get(k) {
                    test(cone);
                }
            }
        }
    }

    /// Puts into `known` what is known of the ways from `lanes` of eight points, by their unit directions and lengths. As for
    /// [`super::LightBuffer::look`], the points lie on surfaces that are lit on the side that is seen.
    #[inline(always)]
    pub fn look<L: Lane>(
        &self,
        point: Vec3<L>,
        way: (Vec3<L>, L),
        (surface, outside): (&[SurfaceId; LANES], u8),
        lanes: u8,
        known: &mut Known,
    ) {
        let way = Way::of(way, self.boxed);
        let (mut met, mut blocked) = (0u8, 0u8);
        self.each_near(&way, lanes, |cone| {
            let (cosine, within) = cone.holds(&way, lanes);
            if within == 0 {
                return;
            }
            let others = within & !(equal_lanes(surface, cone.surface) & outside);
            let behind = cosine.gt(f32x8::splat(cone.full)) & way.length.gt(f32x8::splat(cone.beyond));
            met |= others;
            blocked |= others & behind.bits();
        });
        known.free = self.regions.hold(lanes & !met, point, surface);
        (known.blocked, known.doubtful) = (blocked, 0);
    }

    /// Hands those of the rays `lanes` to the light, by their unit directions and lengths, that may meet a caster to `test`, one
    /// caster after the other.
    #[inline(always)]
    pub fn each_met<L: Lane>(&self, way: (Vec3<L>, L), lanes: u8, mut test: impl FnMut(&Run, u8)) {
        for caster in &self.around {
            test(caster, lanes);
        }
        let way = Way::of(way, self.boxed);
        self.each_near(&way, lanes, |cone| {
            let (_, within) = cone.holds(&way, lanes);
            if within != 0 {
                test(&cone.caster, within);
            }
        });
    }
}

/// A caster as a run of its own.
fn run(caster: &Caster) -> Run {
    Run { kind: caster.kind, class: caster.classes, last: true, len: 1, first: caster.row }
}

/// Eight ways to a light.
struct Way {
    dir: Vec3<f32x8>,
    inverse: Vec3<f32x8>,
    length: f32x8,
}

impl Way {
    /// By their unit directions and lengths. Only for boxes they need inverses.
    #[inline(always)]
    fn of<L: Lane>((dir, length): (Vec3<L>, L), boxed: bool) -> Self {
        let dir = dir.cast::<f32x8>();
        let inverse = if boxed { dir.slab_inverse() } else { Vec3::default() };
        Self { dir, inverse, length: length.cast() }
    }
}

/// All ways of a packet, as points of the unit sphere: what they lie around, and how far from there.
struct Bundle {
    middle: Vec3<f32x8>,
    reach: f32x8,
}

impl Bundle {
    /// Of `lanes` (not none).
    #[inline(always)]
    fn of(way: &Way, lanes: u8) -> Self {
        // As neighbours in a picture come in rows, between the first and the last.
        let (first, last) = first_and_last(lanes);
        let between = |x: &f32x8| (x.lanes()[first] + x.lanes()[last]) * 0.5;
        let Vec3 { x, y, z } = &way.dir;
        let middle = Vec3::<f32x8>::broadcast([between(x), between(y), between(z)]);
        let off = way.dir - middle;
        let square = off.fused_dot(off);
        // A way that is none is NaN: wherever it is, it is in reach.
        let square = square.equal(square).select(square, f32x8::lit(f64::INFINITY));
        let farthest = highest(Mask::from_bits(lanes).select(square, f32x8::zero()));
        let reach = f32x8::splat(farthest).sqrt() * f32x8::lit(1.0 + DISTANCE_ROUNDING);
        Self { middle, reach }
    }

    /// The cones that some of the ways may be in, a bit for each.
    #[inline(always)]
    fn meets(&self, cones: &EightCones) -> u8 {
        let [x, y, z] = cones.axis.map(f32x8::from_array);
        let (off, reach) = (Vec3::new(x, y, z) - self.middle, f32x8::from_array(cones.reach) + self.reach);
        // (Of such a middle everything is NaN, and met.)
        !off.fused_dot(off).gt(reach * reach).bits()
    }
}

impl EightCones {
    /// Of up to eight.
    fn of(cones: &[Cone]) -> Self {
        let mut eight = Self { axis: [[0.0; LANES]; 3], reach: [0.0; LANES] };
        for (k, cone) in cones.iter().enumerate().take(LANES) {
            for (axis, own) in eight.axis.iter_mut().zip(cone.axis) {
                axis[k] = own;
            }
            // The square is twice one less the cosine, which is no more off than once more what was allowed for; as much again for
            // the lengths of what are not quite unit vectors.
            let square = 2.0 * (1.0 - f64::from(cone.least) + 2.0 * COSINE_ROUNDING);
            eight.reach[k] = (square.sqrt() * (1.0 + DISTANCE_ROUNDING)) as f32;
        }
        eight
    }
}

impl Cone {
    /// Of a caster in whose box `location` is not.
    fn of(caster: &Caster, location: DVec3, slack: f64) -> Self {
        let (center, size) = (location - caster.bounds.center(), caster.bounds.max - caster.bounds.min);
        let (distance, is_ball) = (center.length(), caster.kind == Kind::Sphere as u8);
        let radius = 0.5 * if is_ball { size.max_element() } else { size.length() };
        let corners = || {
            let (min, max) = relative(caster, location, slack);
            let grown = (-max).abs().max(-min).max_element() * DISTANCE_ROUNDING;
            [-max - grown, -min + grown].map(|corner| corner.as_vec3().to_array())
        };
        let mut cone = Self {
            axis: (center / distance).as_vec3().to_array(),
            least: f32::NEG_INFINITY,
            near: 0.0,
            full: f32::INFINITY,
            beyond: f32::INFINITY,
            corners: (!is_ball).then(corners),
            surface: caster.surface,
            caster: run(caster),
        };
        // Of the ways that touch a ball of a radius.
        let cosine = |radius: f64| (1.0 - (radius / distance).powi(2)).max(0.0).sqrt();
        let (grown, shrunk) = (radius + slack, radius - slack);
        if distance > grown {
            cone.least = (cosine(grown) - COSINE_ROUNDING) as f32;
            // (Shadow rays end a little before the light.)
            cone.near = ((distance - grown - 4.0 * slack) * (1.0 - DISTANCE_ROUNDING)) as f32;
            if is_ball && caster.blocks && shrunk > 0.0 {
                cone.full = (cosine(shrunk) + COSINE_ROUNDING) as f32;
                // Nothing that is met is farther than where ways touch.
                cone.beyond = ((distance * cosine(shrunk) + slack) * (1.0 + DISTANCE_ROUNDING)) as f32;
            }
        }
        cone
    }

    /// The cosines of eight ways, and those of `lanes` that it may be in.
    #[inline(always)]
    fn holds(&self, way: &Way, lanes: u8) -> (f32x8, u8) {
        let cosine = way.dir.fused_dot(Vec3::broadcast(self.axis));
        let near = cosine.ge(f32x8::splat(self.least)) & way.length.ge(f32x8::splat(self.near));
        let mut within = near.bits() & lanes;
        if let (Some([low, high]), true) = (self.corners, within != 0) {
            let [a, b] = [low, high].map(|corner| way.inverse.mul(Vec3::broadcast(corner)));
            let enter = a.x.min(b.x).max(a.y.min(b.y)).max(a.z.min(b.z).max(f32x8::zero()));
            let leave = a.x.max(b.x).min(a.y.max(b.y)).min(a.z.max(b.z)).min(way.length);
            within &= enter.le(leave * f32x8::lit(1.0 + DISTANCE_ROUNDING)).bits();
        }
        (cosine, within)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::NO_SURFACE;
    use crate::kernel::Aabb;
    use crate::random::Random;

    /// Balls and boxes about a light, most of them far and small, some touching each other as its ways see them; ways that run
    /// side by side, and ways all about.
    #[test]
    fn what_any_way_is_in_is_near() {
        let mut random = Random::new(7);
        let mut numbers = || random.vector(1.0);
        let (mut cones, mut near, mut in_any) = (Vec::new(), 0, 0);
        for row in 0..60u32 {
            let size = 0.5f64.powi(row as i32 % 7);
            let (center, half) = (numbers().normalize() * 4.0, DVec3::splat(size));
            let kind = if row % 2 == 0 { Kind::Sphere } else { Kind::Box } as u8;
            let bounds = Aabb { min: center - half, max: center + half };
            let (classes, surface, blocks, opaque) = (0, NO_SURFACE, true, true);
            let caster = Caster { bounds, kind, row, classes, surface, blocks, opaque };
            cones.push(Cone::of(&caster, DVec3::ZERO, 1e-6));
        }
        let eights = cones.chunks(LANES).map(EightCones::of).collect();
        let regions = Regions::default();
        let all = Cones { all: cones, eights, boxed: true, around: Vec::new(), regions };
        for round in 0..4000 {
            let (middle, spread) = (numbers(), [1e-4, 1e-3, 1e-2, 0.1, 10.0][round % 5]);
            let mut ways: [DVec3; LANES] = std::array::from_fn(|_| (middle + numbers() * spread).normalize());
            if round % 7 == 0 {
                // From where the light itself is.
                ways[round % LANES] = DVec3::NAN;
            }
            let lengths = f32x8::lit(10.0);
            let way = Way::of((Vec3::<f32x8>::from_fn(|k| ways[k]), lengths), true);
            let lanes = [0xff, 0x3c, 0x81, 0x10][round % 4];
            let rows = |found: &mut Vec<u32>, cone: &Cone| {
                if cone.holds(&way, lanes).1 != 0 {
                    found.push(cone.caster.first);
                }
            };
            let (mut expected, mut found) = (Vec::new(), Vec::new());
            all.all.iter().for_each(|cone| rows(&mut expected, cone));
            all.each_near(&way, lanes, |cone| {
                near += 1;
                rows(&mut found, cone);
            });
            assert_eq!(found, expected, "round {round}");
            in_any += expected.len();
        }
        // It would be for nothing if most were near.
        assert!(near < 4000 * 60 / 3 && in_any > 1000, "{near} near, {in_any} in");
    }
}
