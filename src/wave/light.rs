//! Lights as eight points see them (manual section 3.4.4; formulas as measured on POV-Ray 3.7).

use super::light_buffer::{Around, Cones};
use crate::lane::{Lane, Mask, Vec3, f32x8};
use crate::scene::{Light, LightKind};
use glam::DVec3;

/// A light ready for lanes.
#[derive(Debug)]
pub struct LightProgram {
    location: DVec3,
    color: DVec3,
    kind: LightKind,
    /// Of a spotlight's radius and falloff.
    cosines: [f64; 2],
    /// Unit vector from the light to where it looks.
    axis: DVec3,
    point_at: DVec3,
    parallel: bool,
    fade: Option<(f64, f64)>,
    /// No shadows, no highlights.
    pub shadowless: bool,
    /// What is known of the ways to it.
    pub around: Around,
}

impl LightProgram {
    /// All lights of a scene for points relative to `origin`, in an order that does not depend on theirs: light is summed
    /// in that order, and so the picture has the same bytes however they are declared.
    pub fn all(lights: &[Light], origin: DVec3) -> Vec<Self> {
        let mut all: Vec<Self> = lights.iter().map(|light| Self::new(light, origin)).collect();
        all.sort_by_cached_key(Self::key);
        all
    }

    /// What tells lights apart, as bits: any order will do.
    fn key(&self) -> Vec<u64> {
        let (kind, [radius, falloff, tightness]) = match self.kind {
            LightKind::Point => (0, [0.0; 3]),
            LightKind::Spot { radius, falloff, tightness } => (1, [radius, falloff, tightness]),
            LightKind::Cylinder { radius, falloff, tightness } => (2, [radius, falloff, tightness]),
        };
        let (distance, power) = self.fade.unwrap_or_default();
        let numbers = [self.location, self.color, self.point_at, self.axis].map(|v| v.to_array());
        let switches =
            [kind, u64::from(self.parallel), u64::from(self.shadowless), u64::from(self.fade.is_some())];
        let shape = [radius, falloff, tightness, distance, power];
        numbers.as_flattened().iter().chain(&shape).map(|x| x.to_bits()).chain(switches).collect()
    }

    /// `light` for points relative to `origin`.
    pub fn new(light: &Light, origin: DVec3) -> Self {
        let cosines = match light.kind {
            LightKind::Spot { radius, falloff, .. } => [radius, falloff].map(f64::cos),
            LightKind::Point | LightKind::Cylinder { .. } => [0.0; 2],
        };
        Self {
            location: light.location - origin,
            color: light.color,
            kind: light.kind,
            cosines,
            axis: (light.point_at - light.location).normalize_or_zero(),
            point_at: light.point_at - origin,
            parallel: light.parallel || matches!(light.kind, LightKind::Cylinder { .. }),
            fade: light.fade.map(|fade| (fade.distance, fade.power)),
            shadowless: light.shadowless,
            around: Around::Unknown,
        }
    }

    /// Where its shadow rays end, if that is one point and it has any.
    pub fn shadow_point(&self) -> Option<DVec3> {
        (!self.parallel && !self.shadowless).then_some(self.location)
    }

    /// The cones around it, if it has any.
    pub fn cones(&self) -> Option<&Cones> {
        if let Around::Cones(cones) = &self.around { Some(cones) } else { None }
    }

    /// Its light goes all ways alike.
    pub fn is_point(&self) -> bool {
        self.kind == LightKind::Point && !self.parallel
    }

    /// Where it is on the front of surfaces at eight points, if [`LightProgram::is_point`]: nowhere else does
    /// [`LightProgram::towards`] lead to that side.
    #[inline]
    pub fn is_before<L: Lane>(&self, point: Vec3<L>, normal: Vec3<L>) -> Mask<L> {
        normal.dot(Vec3::splat(self.location) - point).gt(L::zero())
    }

    /// Unit directions from eight points to the light, and how far it is.
    #[inline]
    pub fn towards<L: Lane>(&self, point: Vec3<L>) -> (Vec3<L>, L) {
        let axis = Vec3::splat(self.axis);
        let to_light = Vec3::splat(self.location) - point;
        let (dir, distance) = if let LightKind::Cylinder { .. } = self.kind {
            // A beam is parallel: its light comes along the axis, from the plane through its place.
            let length = (self.location - self.point_at).length();
            let back = Vec3::splat((self.location - self.point_at) / length);
            (back, to_light.dot(back))
        } else {
            let distance = to_light.length();
            (to_light * (L::lit(1.0) / distance), distance)
        };
        if self.parallel { (-axis, -(distance * dir.dot(axis))) } else { (dir, distance) }
    }

    /// Its light at eight points, which have [`LightProgram::towards`], if nothing is in the way.
    #[inline(always)]
    pub fn at<L: Lane>(&self, point: Vec3<L>, dir: Vec3<L>, distance: L) -> Vec3<f32x8> {
        let light = Vec3::splat(self.color);
        if self.kind == LightKind::Point && self.fade.is_none() {
            return light;
        }
        light * self.strength(point, dir, distance).cast()
    }

    /// What the beam's shape and the distance leave of the light.
    #[inline(never)] // Inlined, it takes the registers of shading.
    fn strength<L: Lane>(&self, point: Vec3<L>, dir: Vec3<L>, distance: L) -> L {
        let one = L::lit(1.0);
        let mut strength = match self.kind {
            LightKind::Point => one,
            LightKind::Spot { tightness, .. } => {
                let [inner, outer] = self.cosines;
                // Behind a parallel spotlight the light does not look this way, though its rays would.
                let q = dir.dot(Vec3::splat(self.axis));
                let q = distance.gt(L::zero()).select(-q, q);
                let mut lit = q.gt(L::zero());
                if inner > 0.0 {
                    lit &= q.ge(L::lit(inner.min(outer)));
                }
                // Most of a scene lies beside most spots.
                if lit.none() {
                    return L::zero();
                }
                let mut s = q.max(L::zero()).pow_const(tightness);
                if inner > 0.0 {
                    let rim = smooth_step(outer, inner, q);
                    s = q.lt(L::lit(inner)).select(s * rim, s);
                }
                lit.keep(s)
            }
            LightKind::Cylinder { radius, falloff, tightness } => {
                let from = point - Vec3::splat(self.location);
                let axis = Vec3::splat(self.axis);
                let ahead = from.dot(axis);
                let off = (from - axis * ahead).length();
                let lit = ahead.gt(L::zero()) & off.lt(L::lit(falloff));
                if lit.none() {
                    return L::zero();
                }
                let x = one - off / L::lit(falloff);
                let mut s = x.max(L::zero()).pow_const(tightness);
                if radius > 0.0 {
                    let rim = smooth_step(0.0, 1.0 - radius / falloff, x);
                    s = off.gt(L::lit(radius)).select(s * rim, s);
                }
                lit.keep(s)
            }
        };
        if let Some((fade_distance, power)) = self.fade {
            let depth = distance / L::lit(fade_distance);
            let below = depth.lt(L::zero());
            let mut raised = depth.abs().pow_const(power);
            if power % 2.0 == 1.0 {
                raised = below.select(-raised, raised);
            }
            strength = strength * (L::lit(2.0) / (one + raised));
            // A root of what is below 0 is no number, and no light.
            if power.fract() != 0.0 {
                strength = below.select(L::zero(), strength);
            }
        }
        strength
    }
}

/// 0 below `low`, 1 from `high` on, a cubic between.
fn smooth_step<L: Lane>(low: f64, high: f64, x: L) -> L {
    let y = (x - L::lit(low)) / L::lit(high - low);
    let inner = y * y * (L::lit(3.0) - y * L::lit(2.0));
    let below: Mask<L> = x.lt(L::lit(low));
    let above = x.ge(L::lit(high));
    above.select(L::lit(1.0), below.select(L::zero(), inner))
}

/// POV-Ray's weights for the brightness of a colour.
pub fn grey(c: Vec3<f32x8>) -> f32x8 {
    c.x * f32x8::lit(0.297) + c.y * f32x8::lit(0.589) + c.z * f32x8::lit(0.114)
}
