//! What is cut out of a composite, as far as the places are concerned where rays come into it: those who come in beside all that is cut
//! out see just that place, and nothing else of the composite need be looked at.
//!
//! Most rays that meet a composite do: a die is met between its dots, a wheel between its holes. Where a ray comes into the parts that
//! hold all of the composite is known from their brackets; that is held against a ball, a box or a half space around each part cut
//! out, with room for what a bracket leaves open.

use super::bracket::Map;
use super::single::{least, most, single};
use crate::kernel::{Aabb, OwnSpace, Solid};
use crate::lane::{Many, Sixteen, Vec3, f32x16};
use glam::{DMat3, DVec3};
use std::ops::Range;

/// What is around a part is wider than the part by this share of the composite's size, or more.
const ROOM: f64 = 1.0 / 512.0;

/// Places may be known to this share of the composite's size: half of the room, the rest of which is for rounding.
pub(super) const KNOWN_TO: f64 = ROOM * 0.5;

/// What has its middle farther away than this, in sizes of the composite, is not held against places as it is: single precision would lose
/// more than the room that is left.
const FARTHEST_MIDDLE: f64 = 1024.0;

/// Bites of all composites, by what is around them.
#[derive(Debug, Clone, Default)]
pub struct Bites {
    /// Centres and squares of radii.
    balls: Vec<[f32; 4]>,
    /// The spaces in which they go to 1 either way in each axis.
    boxes: Vec<Map>,
    /// Unit normals outward, and how far along them the planes are.
    half_spaces: Vec<[f32; 4]>,
}

/// Where those of one composite stand among them. All are relative to the composite's middle.
#[derive(Debug, Clone, Default)]
pub(super) struct Bitten {
    balls: Range<u32>,
    boxes: Range<u32>,
    half_spaces: Range<u32>,
}

/// The space in which what is within `half` of `center`, as `map` has it, or within `room` of that, is within 1 in each axis.
fn unit_space(center: DVec3, map: DMat3, half: DVec3, room: f64) -> Map {
    let row = |k: usize| single(map.row(k) / (half[k] + room * map.row(k).length()));
    Map { center: single(center), rows: [0, 1, 2].map(row) }
}

impl Bites {
    /// Adds parts, each given by what body it is and where it may be, of a composite of some `size` around `middle`.
    pub(super) fn push<'a>(
        &mut self,
        parts: impl Iterator<Item = &'a (Solid, Aabb)>,
        middle: DVec3,
        size: f64,
    ) -> Bitten {
        let first = self.lengths();
        let room = size * ROOM;
        for (solid, bounds) in parts {
            // In their own space: from its origin to their middle, and from there.
            let own = |OwnSpace { center, map }: OwnSpace, to: DVec3, half: DVec3| {
                (center + map.inverse() * to - middle, map, half)
            };
            let boxed = match *solid {
                Solid::OrientedBox(space, half) => Some(own(space, DVec3::ZERO, half)),
                Solid::Ellipsoid(space) => Some(own(space, DVec3::ZERO, DVec3::ONE)),
                Solid::Cylinder(space) => Some(own(space, DVec3::Z * 0.5, DVec3::new(1.0, 1.0, 0.5))),
                _ => None,
            };
            let is_near = |center: DVec3| center.abs().max_element() <= size * FARTHEST_MIDDLE;
            match *solid {
                Solid::Ball { center, radius } if is_near(center - middle) => {
                    let [x, y, z] = single(center - middle);
                    self.balls.push([x, y, z, (radius + room).powi(2) as f32]);
                }
                Solid::HalfSpace { normal, foot } => {
                    let [x, y, z] = single(normal);
                    self.half_spaces.push([x, y, z, (normal.dot(foot - middle) + room) as f32]);
                }
                _ => {
                    let around = (bounds.center() - middle, DMat3::IDENTITY, (bounds.max - bounds.min) * 0.5);
                    let (center, map, half) = boxed.filter(|boxed| is_near(boxed.0)).unwrap_or(around);
                    self.boxes.push(unit_space(center, map, half, room));
                }
            }
        }
        let last = self.lengths();
        let [balls, boxes, half_spaces] = [0, 1, 2].map(|k| first[k]..last[k]);
        Bitten { balls, boxes, half_spaces }
    }

    fn lengths(&self) -> [u32; 3] {
        [self.balls.len(), self.boxes.len(), self.half_spaces.len()].map(|len| len as u32)
    }

    /// Lanes whose places, relative to the composite's middle, may be within a bite.
    #[inline(always)]
    pub(super) fn hold(&self, bitten: &Bitten, places: &Vec3<f32x16>) -> u16 {
        let Bitten { balls, boxes, half_spaces } = bitten;
        // How far outside of the nearest, each in a measure of its own.
        let (one, mut outside) = (f32x16::constant(1.0), f32x16::constant(f64::INFINITY));
        for &[x, y, z, square] in super::slice(&self.balls, balls) {
            let toward = *places - Vec3::broadcast([x, y, z]);
            outside = least(outside, toward.fused_dot(toward) - f32x16::splat(square));
        }
        for space in super::slice(&self.boxes, boxes) {
            let Vec3 { x, y, z } = space.places(*places).map(f32x16::abs);
            outside = least(outside, most(most(x, y), z) - one);
        }
        for &[x, y, z, at] in super::slice(&self.half_spaces, half_spaces) {
            outside = least(outside, Vec3::broadcast([x, y, z]).fused_dot(*places) - f32x16::splat(at));
        }
        outside.le(f32x16::default()).bits()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::{LANES, Lane, f32x8};
    use crate::random::Random;

    /// A body, where it may be, and whether a place is inside.
    fn body(random: &mut Random, kind: usize) -> ((Solid, Aabb), impl Fn(DVec3) -> bool + use<>) {
        let axes = DMat3::from_cols(random.vector(1.0), random.vector(1.0), random.vector(1.0));
        let (center, half) = (random.vector(0.8), DVec3::new(0.4, 0.1, 0.2));
        let normal = random.vector(1.0).normalize();
        let space = OwnSpace { center, map: (axes * 0.4).inverse() };
        let solid = match kind {
            0 => Solid::Ball { center, radius: 0.2 },
            1 => Solid::HalfSpace { normal, foot: center },
            2 => Solid::OrientedBox(space, half),
            3 => Solid::Cylinder(space),
            4 => Solid::Ellipsoid(space),
            _ => Solid::Other,
        };
        let inside = move |p: DVec3| {
            let own = space.map * (p - center);
            match kind {
                0 => p.distance(center) <= 0.2,
                1 => normal.dot(p - center) <= 0.0,
                2 => own.abs().cmple(half).all(),
                3 => own.truncate().length() <= 1.0 && (0.0..=1.0).contains(&own.z),
                4 => own.length() <= 1.0,
                _ => (p - center).abs().cmple(half).all(),
            }
        };
        ((solid, Aabb { min: center - half, max: center + half }), inside)
    }

    /// A bit for each place that is held by a body behind others, known as badly as brackets may leave it.
    fn held(
        random: &mut Random,
        part: &(Solid, Aabb),
        (middle, size): (DVec3, f64),
        places: &[DVec3],
    ) -> u16 {
        let mut bites = Bites::default();
        bites.push([&body(random, 0).0, &body(random, 3).0, &body(random, 1).0].into_iter(), middle, size);
        let bitten = bites.push([part].into_iter(), middle, size);
        let mut off = || random.vector(1.0).normalize() * (size * KNOWN_TO);
        let known: Vec<DVec3> = places.iter().map(|&place| place + off() - middle).collect();
        let [x, y, z] = [0, 1, 2]
            .map(|axis: usize| f32x16::of(|k| f32x8::from_fn(|lane| known[k * LANES + lane][axis] as f32)));
        bites.hold(&bitten, &Vec3::new(x, y, z))
    }

    #[test]
    fn what_is_inside_is_held_and_little_else() {
        let random = &mut Random::new(1);
        let (mut within, mut beside) = (0, 0);
        for round in 0..600 {
            let (part, inside) = body(random, round % 6);
            let places: Vec<DVec3> = (0..2 * LANES).map(|_| random.vector(1.0)).collect();
            let middle = random.vector(1.0);
            let bits = held(random, &part, (middle, 1.5), &places);
            for (k, &place) in places.iter().enumerate() {
                let is_held = bits >> k & 1 == 1;
                assert!(is_held || !inside(place), "{round}: {place} is inside of {:?}", part.0);
                within += u32::from(inside(place));
                beside += u32::from(is_held && !inside(place));
            }
        }
        assert!(within > 500 && beside < within, "{within} inside, {beside} held beside");
    }

    /// Single precision cannot tell where a ball as large as a planet ends, or a rod as long as its orbit.
    #[test]
    fn what_is_far_too_large_is_held_as_far_as_it_matters() {
        let random = &mut Random::new(2);
        let bounds = Aabb { min: DVec3::splat(-2.0), max: DVec3::splat(2.0) };
        let mut within = 0;
        for round in 0..400 {
            let far = 10f64.powi(2 + round / 2 % 8);
            let normal = random.vector(1.0).normalize();
            let (a, b) = normal.any_orthonormal_pair();
            let rod = OwnSpace {
                center: normal * -0.3,
                map: DMat3::from_cols(a * 0.3, b * 0.2, normal * far).inverse(),
            };
            let ball = round % 2 == 0;
            let solid = match ball {
                true => Solid::Ball { center: normal * (far + 0.3), radius: far },
                false => Solid::Cylinder(rod),
            };
            let inside = |p: DVec3| {
                if ball {
                    // (How deep below the ball's plane, and how much the ball is below that.)
                    let deep = normal.dot(p) - 0.3;
                    return deep - (p - normal * normal.dot(p)).length_squared() / far > 0.0;
                }
                let own = rod.map * (p - rod.center);
                own.truncate().length() <= 1.0 && own.z >= 0.0
            };
            let places: Vec<DVec3> = (0..2 * LANES).map(|_| random.vector(1.0)).collect();
            let bits = held(random, &(solid, bounds), (DVec3::ZERO, 1.5), &places);
            for (k, &place) in places.iter().enumerate() {
                assert!(bits >> k & 1 == 1 || !inside(place), "{round}: {place} is inside of {solid:?}");
                within += u32::from(inside(place));
            }
        }
        assert!(within > 500, "{within} inside");
    }
}
