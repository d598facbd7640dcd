//! Lanes do not see each other, broken rays hit nothing, and rows can change places.

use crate::support::{Rng, lane_roots, packet};
use glam::DVec3;
use octray::kernel::*;
use octray::lane::{LANES, Lane, Mask, Quad, Scalar, Vec3};
use octray::scene::Transform;

/// Three primitives of each kind, in three places.
fn check<S: Scalar, B: Block<S>>(what: &str, push: impl Fn(&mut B, &Transform)) {
    let mut block = B::default();
    assert!(block.is_empty());
    let places = [-1.0, 0.0, 1.0].map(|x| {
        Transform::rotate(DVec3::splat(x)).then(&Transform::translate(DVec3::new(4.0 * x, x, 2.0 * x)))
    });
    places.iter().for_each(|t| push(&mut block, t));
    assert_eq!(block.len(), 3);
    let rng = &mut Rng(what.len() as u64);
    for _ in 0..200 {
        let good: [_; LANES] = std::array::from_fn(|k| {
            let from = rng.cube() * 10.0;
            (from, places[k % 3].point(rng.cube() * 0.5) - from)
        });
        let rays = packet::<S::Lane>(&good);
        broken_rays_hit_nothing(what, &block, &rays, rng);
        rows_move_as_told(what, &places, &push, &block, &rays);
        first_is_first_of_all(what, &block, &rays, rng);
        four_rows_answer_as_one_does(what, &block, &rays);
        for i in 0..3 {
            let all = block.roots(i, &rays, None);
            for (k, one) in good.iter().enumerate() {
                let alone = block.roots(i, &packet(&[*one]), None);
                assert_eq!(lane_roots(alone.as_ref(), 0), lane_roots(all.as_ref(), k), "{what} alone");
                let found = lane_roots(all.as_ref(), k);
                assert!(found.is_sorted(), "{what}: {found:?}");
                let first = all.as_ref().iter().position(|t| t.to_array()[k].to_f64().is_nan());
                assert!(first.is_none_or(|n| n == found.len()), "{what}: NaN before a crossing");
            }
        }
    }
}

/// Of a stretch of each ray: the crossing that [`Block::roots`] has there, or none; and whether there is any.
fn first_is_first_of_all<S: Scalar, B: Block<S>>(what: &str, block: &B, rays: &Rays<S::Lane>, rng: &mut Rng) {
    let all = block.roots(0, rays, None);
    let from = S::Lane::from_fn(|_| S::from_f64(rng.unit() * 16.0));
    let to = from + S::Lane::from_fn(|_| S::from_f64(rng.unit() * 16.0));
    let looking = Looking { from, to, lanes: rng.bits() as u8, any: false };
    let found = block.first(0, rays, None, &looking);
    let any = block.first(0, rays, None, &Looking { any: true, ..looking });
    for k in (0..LANES).filter(|k| looking.lanes >> k & 1 == 1) {
        let [from, to, found, any] = [from, to, found, any].map(|x| x.to_array()[k].to_f64());
        let expected = lane_roots(all.as_ref(), k).into_iter().find(|&t| t > from);
        // Other starts of an iteration, or another order of sums: some roundings of distances up to 32.
        let close = |t: f64| (t - found).abs() <= 32.0 * 64.0 * S::UNIT_ROUNDOFF;
        match expected.filter(|&t| t <= to) {
            Some(t) => {
                assert!(close(t), "{what}: {found} for {t}");
                assert!(from < any && any <= to, "{what}: {any} between {from} and {to}");
            }
            None => {
                assert!(found.is_nan() || found > to, "{what}: {found} between {from} and {to}");
                assert!(any.is_nan() || any > to, "{what}: {any} between {from} and {to}");
            }
        }
    }
}

/// One broken number in one lane: that lane has no crossing, the others the same as before.
fn broken_rays_hit_nothing<S: Scalar, B: Block<S>>(
    what: &str,
    block: &B,
    rays: &Rays<S::Lane>,
    rng: &mut Rng,
) {
    let (victim, axis) = (rng.bits() as usize % LANES, rng.bits() as usize % 3);
    let poison = |v: Vec3<S::Lane>, with: f64| {
        Vec3::from_fn(|k| {
            let mut p = v.lane(k);
            if k == victim {
                p[axis] = with;
            }
            p
        })
    };
    for (origin, dir) in [
        (poison(rays.origin, f64::NAN), rays.dir),
        (rays.origin, poison(rays.dir, f64::NAN)),
        (poison(rays.origin, f64::INFINITY), rays.dir),
        (Vec3::lit(f64::NAN), Vec3::lit(f64::NAN)),
    ] {
        let broken = Rays { origin, dir };
        let all = !broken.origin.lane((victim + 1) % LANES).is_finite();
        for i in 0..block.len() {
            let (before, after) = (block.roots(i, rays, None), block.roots(i, &broken, None));
            for k in 0..LANES {
                let expected = if k == victim || all { vec![] } else { lane_roots(before.as_ref(), k) };
                assert_eq!(lane_roots(after.as_ref(), k), expected, "{what}, lane {k}");
            }
        }
    }
}

/// One ray against four rows meets what it meets among eight rays, to the bit, whatever it starts on and however far it
/// looks.
fn four_rows_answer_as_one_does<S: Scalar, B: Block<S>>(what: &str, block: &B, rays: &Rays<S::Lane>) {
    if !B::ACROSS {
        return;
    }
    let number = S::from_f64;
    for (lane, started) in (0..LANES).flat_map(|lane| (0..=block.len()).map(move |row| (lane, row))) {
        let ray = Ray::of(rays, lane, true);
        for limits in [(0.0, f64::INFINITY), (0.0, 8.0), (8.0, 12.0)] {
            let (t_min, t_max) = (number(limits.0), number(limits.1));
            let bit = if started < block.len() { 1 << started } else { 0 };
            let (t, near) = block.near_in_four(0, &ray, (t_min, t_max), bit);
            let met = (0..block.len()).any(|i| near >> i & 1 == 1 && t.to_array()[i] < t_max);
            let blocked = block.blocked_in_four(0, &ray, (t_min, t_max), ((1 << block.len()) - 1, bit));
            assert_eq!(blocked, met, "{what}, lane {lane}, started on {started}, {limits:?}");
            for i in 0..block.len() {
                let left = Left { on: Mask::from_bits(1 << lane), part: [0; LANES] };
                let roots = block.roots(i, rays, (i == started).then_some(&left));
                let roots = lane_roots(roots.as_ref(), lane);
                let first = roots.into_iter().find(|&t| t > limits.0).filter(|&t| t <= limits.1);
                let found = (near >> i & 1 == 1).then(|| t.to_array()[i].to_f64());
                assert_eq!(found, first, "{what}: row {i} of four, from row {started}, within {limits:?}");
            }
        }
    }
}

/// A row in another place gives the same answers there; `resolve` takes each lane's own row.
fn rows_move_as_told<S: Scalar, B: Block<S>>(
    what: &str,
    places: &[Transform; 3],
    push: &impl Fn(&mut B, &Transform),
    block: &B,
    rays: &Rays<S::Lane>,
) {
    let order = [2, 0, 1];
    let mut moved = B::default();
    places.iter().for_each(|t| push(&mut moved, t));
    moved.permute(&order);
    let mut t = S::Lane::lit(f64::NAN);
    let index: [u32; LANES] = std::array::from_fn(|k| k as u32 % 3);
    for (i, &from) in order.iter().enumerate() {
        let (a, b) = (moved.roots(i, rays, None), block.roots(from as usize, rays, None));
        assert_eq!(moved.bounds(i), block.bounds(from as usize));
        for k in 0..LANES {
            assert_eq!(lane_roots(a.as_ref(), k), lane_roots(b.as_ref(), k), "{what} moved");
        }
        let mine = Mask::from_bits((0..LANES).filter(|k| k % 3 == from as usize).map(|k| 1 << k).sum());
        t = mine.select(b.as_ref()[0], t);
    }
    // Where row `from` of the block went.
    let went = index.map(|from| order.iter().position(|&o| o == from).unwrap() as u32);
    let (a, b) = (block.resolve(&index, t.equal(t), rays, t), moved.resolve(&went, t.equal(t), rays, t));
    for k in (0..LANES).filter(|k| t.equal(t).bits() >> k & 1 == 1) {
        assert_eq!((a.point.lane(k), a.normal.lane(k)), (b.point.lane(k), b.normal.lane(k)), "{what}");
        let alone = block.resolve(&[index[k]; LANES], Mask::all_set(), rays, t);
        assert_eq!(a.point.lane(k), alone.point.lane(k), "{what}");
        assert!(
            (a.normal.lane(k).length() - 1.0).abs() < 8.0 * S::UNIT_ROUNDOFF,
            "{what}: not a unit normal"
        );
    }
    rows_tell_where_they_are_met(what, block, (&index, rays), t);
}

/// Who meets a row each lane at about a root, and has no other near, is told where, and sees what is seen there: to the bit.
fn rows_tell_where_they_are_met<S: Scalar, B: Block<S>>(
    what: &str,
    block: &B,
    (index, rays): (&[u32; LANES], &Rays<S::Lane>),
    t: S::Lane,
) {
    let (there, off) = (t.equal(t), t.abs() * S::Lane::lit(1.0 / 1024.0));
    let seen = block.resolve(index, there, rays, t);
    for about in [t - off, t + off] {
        let (told, again) = block.resolve_next_to(index, there, rays, about, |t| t);
        for k in (0..LANES).filter(|k| there.bits() >> k & 1 == 1) {
            let [told, t, off] = [told, t, off].map(|lane| lane.to_array()[k].to_f64());
            let roots = lane_roots(block.roots(index[k] as usize, rays, None).as_ref(), k);
            if roots.iter().all(|root| *root == t || (root - t).abs() > 4.0 * off) {
                assert_eq!(told, t, "{what}, lane {k}");
                assert_eq!(again.point.lane(k), seen.point.lane(k), "{what}");
                assert_eq!(again.normal.lane(k), seen.normal.lane(k), "{what}");
                assert_eq!(again.part[k], seen.part[k], "{what}");
            }
        }
    }
}

fn shapes<S: Scalar>() {
    let half = DVec3::new(1.0, 0.5, 0.25);
    check::<S, Spheres<S>>("sphere", |b, t| b.push(t.forward.translation, 1.0));
    check::<S, Boxes<S>>("axis-parallel box", |b, t| {
        b.push(t.forward.translation - half, t.forward.translation + half);
    });
    check::<S, Ellipsoids<S>>("ellipsoid", |b, t| b.push(t));
    check::<S, OrientedBoxes<S>>("box", |b, t| b.push(t, -half, half));
    check::<S, Planes<S>>("plane", |b, t| b.push(t, DVec3::Y, 0.0));
    check::<S, Discs<S>>("disc", |b, t| b.push(t, DVec3::ZERO, DVec3::Y, 1.0, 0.1));
    let (base, cap, apex) = ((DVec3::NEG_Y, 1.0), (DVec3::Y, 1.0), (DVec3::Y, 0.0));
    check::<S, Cylinders<S>>("cylinder", |b, t| b.push(t, base, cap));
    check::<S, OpenCylinders<S>>("open cylinder", |b, t| b.push(t, base, cap));
    check::<S, ClosedCones<S>>("cone", |b, t| b.push(t, base, apex));
    check::<S, OpenCones<S>>("open cone", |b, t| b.push(t, base, apex));
    check::<S, Tori<S>>("torus", |b, t| b.push(t, 0.7, 0.3));
    let corners = |t: &Transform| [DVec3::NEG_ONE, DVec3::X, DVec3::Y].map(|p| t.point(p));
    check::<S, Triangles<S>>("triangle", |b, t| b.push(corners(t)));
    check::<S, SmoothTriangles<S>>("smooth triangle", |b, t| {
        b.push(corners(t), [DVec3::X, DVec3::Y, DVec3::Z])
    });
    check::<S, Polygons<S>>("polygon", |b, t| b.push(&[corners(t).to_vec()]));
}

#[test]
fn lanes_and_rows_keep_to_themselves() {
    shapes::<f32>();
    shapes::<f64>();
}
