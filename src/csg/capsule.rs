//! What two packets of rays side by side pass by: parts of a composite by capsules around them, eight at a time.
//!
//! All their rays lie within some room of one line, as far as a ball around the composite reaches. A part whose capsule (all that is within
//! a radius of a stretch of a line) is farther than that from the line is met by none of them. Most parts of most composites are
//! told so: of a dozen holes they meet one.

use crate::kernel::{Aabb, Rays, Solid};
use crate::lane::{LANES, Lane, Many, Mask, Scalar, Sixteen, Vec3, f32x8, f32x16};
use glam::{DMat3, DVec3};

/// Capsules are no longer than this many times the composite's size, either way.
const LONGEST: f64 = 4.0;

/// What squares of distances may be off by, of the square of the composite's size `s`: where lines are nearest is off by `x = 4 u h
/// T / b`, with halves `h` up to 4 s, coordinates `T` up to 6 s, and `b` the square of half's part across. That adds `b x^2`, or `4 b`
/// where the end of the capsule is before: 200 u s^2 at worst. With room for the squares themselves.
const SQUARE_ROOM: f64 = 1024.0 * f32::UNIT_ROUNDOFF;

/// Capsules and rooms are wider by this share, and by this share of the composite's size, than what they are around.
const ROOM: f64 = 1.0 / 4096.0;

/// Eight capsules; lanes without one are met by nothing.
#[derive(Debug, Clone, Copy)]
pub struct Capsules {
    /// Middles, relative to that of the composite.
    middle: [[f32; LANES]; 3],
    /// From there to one end.
    half: [[f32; LANES]; 3],
    radius: [f32; LANES],
}

/// A capsule in plain f64.
#[derive(Debug, Clone, Copy)]
pub(super) struct Capsule {
    middle: DVec3,
    half: DVec3,
    radius: f64,
}

impl Capsule {
    /// Around a body, as far as that matters within bounds (finite) that are about of a `size`.
    pub(super) fn around(solid: &Solid, bounds: Aabb, size: f64) -> Self {
        let round = |middle: DVec3, radius: f64| Self { middle, half: DVec3::ZERO, radius };
        let boxed = round(bounds.center(), (bounds.max - bounds.min).length() * 0.5);
        let own = match solid {
            Solid::Ball { center, radius } => round(*center, *radius),
            Solid::Box { min, max } => {
                let half = (*max - *min) * 0.5;
                Self::of_box((*min + *max) * 0.5, DMat3::from_diagonal(half))
            }
            Solid::OrientedBox(space, half) => {
                Self::of_box(space.center, space.map.inverse() * DMat3::from_diagonal(*half))
            }
            Solid::Cylinder(space) | Solid::Cone { space, .. } => {
                let to_world = space.map.inverse();
                let (x, y, half) = (to_world.x_axis, to_world.y_axis, to_world.z_axis * 0.5);
                // The longest radius of the ellipse across: the greatest singular value.
                let (mean, apart) = ((x.dot(x) + y.dot(y)) * 0.5, (x.dot(x) - y.dot(y)) * 0.5);
                let radius = (mean + apart.hypot(x.dot(y))).sqrt();
                Self { middle: space.center + half, half, radius }
            }
            _ => boxed,
        };
        // Also where the own space is none, and gives NaN.
        let short = own.half.length() <= size * LONGEST;
        if short && own.radius <= boxed.radius { own } else { boxed }
    }

    /// Around a middle and three half axes.
    fn of_box(middle: DVec3, axes: DMat3) -> Self {
        let [x, y, z] = [axes.x_axis, axes.y_axis, axes.z_axis];
        let around = |half: DVec3, a: DVec3, b: DVec3| Self {
            middle,
            half,
            radius: (a + b).length().max((a - b).length()),
        };
        let ways = [around(x, y, z), around(y, z, x), around(z, x, y)];
        ways.into_iter().min_by(|a, b| a.radius.total_cmp(&b.radius)).unwrap_or(ways[0])
    }
}

impl Capsules {
    /// Of up to eight capsules, as rays see them that stay within `size` of `middle`.
    pub(super) fn new(capsules: &[Capsule], middle: DVec3, size: f64) -> Self {
        let (none, nowhere) = ([0.0; LANES], f32::NEG_INFINITY);
        let mut block = Self { middle: [none; 3], half: [none; 3], radius: [nowhere; LANES] };
        for (k, capsule) in capsules.iter().enumerate().take(LANES) {
            for axis in 0..3 {
                block.middle[axis][k] = (capsule.middle - middle)[axis] as f32;
                block.half[axis][k] = capsule.half[axis] as f32;
            }
            block.radius[k] = (capsule.radius * (1.0 + ROOM) + size * ROOM) as f32;
        }
        block
    }
}

/// A line, and how far from it rays are.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beam {
    from: Vec3<f32x8>,
    /// Unit direction.
    dir: Vec3<f32x8>,
    room: f32x8,
    slack: f32x8,
}

impl Beam {
    /// Around the rays of `lanes` (not none), given by their points nearest to a middle, within `size` of there.
    #[inline(always)]
    pub(super) fn new(rays: &Rays<f32x16>, lanes: u16, size: f32) -> Self {
        let first = lanes.trailing_zeros() as usize;
        let last = (u16::BITS - 1).saturating_sub(lanes.leading_zeros()) as usize;
        // Neighbours in a picture come in rows: between the first and the last lie the others.
        let between = |v: &Vec3<f32x16>| {
            let mean = |x: &f32x16| (x.number(first) + x.number(last)) * 0.5;
            [mean(&v.x), mean(&v.y), mean(&v.z)]
        };
        let (from, dir) = (between(&rays.origin), between(&rays.dir));
        let (away, turned) = (rays.origin - Vec3::broadcast(from), rays.dir - Vec3::broadcast(dir));
        let room = away.fused_dot(away).sqrt() + turned.fused_dot(turned).sqrt() * f32x16::splat(size);
        let room = Mask::from_bits(lanes).select(room, f32x16::default()).highest();
        // NaN of rays that go opposite ways: they meet everything.
        let dir = Vec3::<f32x8>::broadcast(dir);
        let dir = dir * (f32x8::lit(1.0) / dir.fused_dot(dir).sqrt());
        Self {
            from: Vec3::broadcast(from),
            dir,
            room: f32x8::splat(room) * f32x8::lit(1.0 + ROOM),
            slack: f32x8::splat(size) * f32x8::splat(size) * f32x8::lit(SQUARE_ROOM),
        }
    }

    /// A bit for each capsule that some of the rays may meet.
    #[inline(always)]
    pub(super) fn meets(&self, capsules: &Capsules) -> u8 {
        let vector = |v: &[[f32; LANES]; 3]| {
            Vec3::new(f32x8::from_array(v[0]), f32x8::from_array(v[1]), f32x8::from_array(v[2]))
        };
        let (toward, half) = (vector(&capsules.middle) - self.from, vector(&capsules.half));
        // Where the capsule's line is nearest to this one, or the end that is. Parallels come out anywhere, which is all the same.
        let (along, sideways) = (self.dir.fused_dot(half), self.dir.fused_dot(toward));
        let bend = half.fused_dot(half) - along * along;
        let (one, zero) = (f32x8::lit(1.0), f32x8::zero());
        let nearest = (along * sideways - half.fused_dot(toward)) / bend;
        let nearest = Lane::max(Lane::min(nearest, one), zero - one);
        let toward = half.fused(nearest, toward);
        let ahead = self.dir.fused_dot(toward);
        let square = toward.fused_dot(toward) - ahead * ahead;
        let reach = f32x8::from_array(capsules.radius) + self.room;
        // A negative reach is none; what is NaN may meet.
        !((reach * reach + self.slack).lt(square) | reach.lt(zero)).bits()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::OwnSpace;
    use crate::random::Random;

    /// A body, the bounds it is given with, and whether a place is inside.
    fn body(random: &mut Random, kind: usize) -> (Solid, Aabb, impl Fn(DVec3) -> bool + use<>) {
        let axes = DMat3::from_cols(random.vector(1.0), random.vector(1.0), random.vector(1.0));
        let center = random.vector(1.0);
        let space = OwnSpace { center, map: (axes * 0.4).inverse() };
        let half = DVec3::new(0.4, 0.1, 0.2);
        let solid = match kind {
            0 => Solid::Ball { center, radius: 0.2 },
            1 => Solid::Box { min: center - half, max: center + half },
            2 => Solid::OrientedBox(space, half),
            3 => Solid::Cylinder(space),
            4 => Solid::Cone { space, taper: 0.5 },
            _ => Solid::Other,
        };
        let inside = move |p: DVec3| {
            let own = space.map * (p - center);
            match kind {
                0 => p.distance(center) <= 0.2,
                1 => (p - center).abs().cmple(half).all(),
                2 => own.abs().cmple(half).all(),
                3 => own.truncate().length() <= 1.0 && (0.0..=1.0).contains(&own.z),
                4 => own.truncate().length() <= 1.0 - 0.5 * own.z && (0.0..=1.0).contains(&own.z),
                _ => p.distance(center) <= 0.3,
            }
        };
        let reach = if kind > 4 { 0.3 } else { 9.0 };
        (solid, Aabb { min: center - reach, max: center + reach }, inside)
    }

    #[test]
    fn what_some_ray_meets_is_met() {
        // (Of rays that differ little or much, some.)
        let lanes = [0xffff, 0x8000, 0x0a61, 0xff, 0x01];
        let (random, count) = (&mut Random::new(1), LANES * 2);
        let (middle, size) = (DVec3::splat(3.0), 1.5);
        let (mut met, mut told) = (0, 0);
        for round in 0..300 {
            let spread = [1e-3, 0.05, 1.0][round % 3];
            let (from, toward) = (random.vector(1.0), random.vector(1.0).normalize());
            let rays: Vec<(DVec3, DVec3)> = (0..count)
                .map(|_| {
                    let dir = (toward + random.vector(1.0) * spread).normalize();
                    let place = from * 0.8 + random.vector(1.0) * spread * 0.2;
                    (place - dir * place.dot(dir), dir)
                })
                .collect();
            let lanes = lanes[round / 3 % 5];
            let vectors = |of: fn(&(DVec3, DVec3)) -> DVec3| {
                let [x, y, z] = [0, 1, 2].map(|axis| {
                    f32x16::of(|k| f32x8::from_fn(|lane| of(&rays[k * LANES + lane])[axis] as f32))
                });
                Vec3::new(x, y, z)
            };
            let lines = Rays { origin: vectors(|ray| ray.0), dir: vectors(|ray| ray.1) };
            let beam = Beam::new(&lines, lanes, size as f32);
            let bodies: Vec<_> = (0..LANES - 1).map(|kind| body(random, kind)).collect();
            let capsules: Vec<Capsule> = bodies
                .iter()
                .map(|(solid, bounds, _)| {
                    let capsule = Capsule::around(solid, *bounds, size);
                    Capsule { middle: capsule.middle + middle, ..capsule }
                })
                .collect();
            let near = beam.meets(&Capsules::new(&capsules, middle, size));
            assert_eq!(near >> (LANES - 1), 0, "nothing is met where nothing is");
            for (k, (solid, _, inside)) in bodies.iter().enumerate() {
                let crossed = (0..count).filter(|lane| lanes >> lane & 1 == 1).any(|lane| {
                    let (o, d) = rays[lane];
                    (-300..=300).any(|s| inside(o + d * (f64::from(s) / 200.0)))
                });
                assert!(!crossed || near >> k & 1 == 1, "{round}: a ray meets {solid:?}");
                met += u32::from(crossed);
                told += u32::from(near >> k & 1 == 0);
            }
        }
        assert!(met > 100 && told > 500, "{met} met, {told} told to be missed");
    }
}
