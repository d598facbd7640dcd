//! Convex regions that a light is in: a way within them all meets none of their surfaces.

use super::casters::{Caster, Casters, HalfSpace};
use crate::compile::{Kind, SurfaceId};
use crate::kernel::Aabb;
use crate::lane::{LANES, Lane, Scalar, Vec3, equal_lanes, f64x8};
use glam::DVec3;

/// What a light cannot see past but for points within it: surfaces without bounds, and those that the light is inside of.
#[derive(Debug, Default)]
pub(super) struct Regions {
    all: Vec<Region>,
    /// No other such surface is there, or nothing can be told of points by what stands before the light.
    complete: bool,
}

/// What coordinates may be off by, in roundings of the scene's reach: a few each for a point on a surface, the light's place
/// and a crossing.
const ROUNDINGS: f64 = 64.0;

/// That of a light at `location`, where `S` is what rays are traced in.
pub fn slack_at<S: Scalar>(location: DVec3, bounds: Option<Aabb>) -> f64 {
    let far = bounds.map_or(0.0, |bounds| bounds.reach());
    ROUNDINGS * S::UNIT_ROUNDOFF * location.abs().max_element().max(far)
}

impl Regions {
    /// Sides of the planes among `casters`.
    pub fn of(casters: &Casters, location: DVec3, slack: f64) -> Self {
        let mut regions = Self { all: Vec::new(), complete: casters.complete };
        for plane in &casters.planes {
            regions.add(Region::beside(plane, location, slack));
        }
        regions
    }

    /// The light is in the box of a caster.
    pub fn enter(&mut self, caster: &Caster, location: DVec3, slack: f64) {
        self.add(Region::within(caster, location, slack));
    }

    /// Nothing can be told of points by what stands before the light.
    pub fn give_up(&mut self) {
        self.complete = false;
    }

    fn add(&mut self, region: Option<Region>) {
        match region {
            Some(region) => self.all.push(region),
            None => self.complete = false,
        }
    }

    /// Those of `lanes` whose points on surfaces are in all regions.
    #[inline(always)]
    pub fn hold<L: Lane>(&self, lanes: u8, point: Vec3<L>, surface: &[SurfaceId; LANES]) -> u8 {
        let mut held = if self.complete { lanes } else { 0 };
        for region in &self.all {
            if held == 0 {
                break;
            }
            let on = equal_lanes(surface, region.surface);
            // (All of them mostly are on the only plane there is.)
            if held & !on != 0 {
                held &= region.holds(point) | on;
            }
        }
        held
    }
}

/// A convex region that a light is in.
#[derive(Debug, Clone, Copy)]
struct Region {
    /// Its boundary: points on it are as good as in it.
    surface: SurfaceId,
    inside: Inside,
}

/// What is strictly within a region, less what roundings may move.
#[derive(Debug, Clone, Copy)]
enum Inside {
    /// `normal . p > least`.
    HalfSpace { normal: DVec3, least: f64 },
    /// Nearer to `center` than the root of `square`.
    Ball { center: DVec3, square: f64 },
    /// Within a box.
    Box(Aabb),
}

impl Region {
    /// The side of a plane that `location` is on, less `slack`; `None` if that is not plain.
    fn beside(plane: &HalfSpace, location: DVec3, slack: f64) -> Option<Self> {
        let height = plane.normal.dot(location - plane.foot);
        let normal = plane.normal * height.signum();
        let least = normal.dot(plane.foot) + slack;
        let inside = Inside::HalfSpace { normal, least };
        (height.abs() > 2.0 * slack).then_some(Self { surface: plane.surface, inside })
    }

    /// The inside of a caster whose box `location` is in, less `slack`; `None` if it is not in it, or that is not known.
    fn within(caster: &Caster, location: DVec3, slack: f64) -> Option<Self> {
        let Aabb { min, max } = caster.bounds;
        let inside = if caster.kind == Kind::Sphere as u8 {
            let radius = 0.5 * (max - min).min_element() - slack;
            Inside::Ball { center: caster.bounds.center(), square: radius * radius.max(0.0) }
        } else if caster.kind == Kind::Box as u8 {
            Inside::Box(Aabb { min: min + slack, max: max - slack })
        } else {
            return None;
        };
        let region = Self { surface: caster.surface, inside };
        (region.holds(Vec3::<f64x8>::splat(location)) == !0).then_some(region)
    }

    /// Which of eight points are in it.
    #[inline(always)]
    fn holds<L: Lane>(&self, point: Vec3<L>) -> u8 {
        match self.inside {
            Inside::HalfSpace { normal, least } => point.dot(Vec3::splat(normal)).gt(L::lit(least)).bits(),
            Inside::Ball { center, square } => {
                let off = point - Vec3::splat(center);
                off.dot(off).lt(L::lit(square)).bits()
            }
            Inside::Box(Aabb { min, max }) => {
                let axis = |p: L, min: f64, max: f64| p.gt(L::lit(min)) & p.lt(L::lit(max));
                let inside = axis(point.x, min.x, max.x) & axis(point.y, min.y, max.y);
                (inside & axis(point.z, min.z, max.z)).bits()
            }
        }
    }
}
