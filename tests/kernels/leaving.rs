//! Rays that start on a surface: never a hit on what they leave, always the far side of what they enter.

use crate::dd::Dd;
use crate::oracle::{OwnRay, Solid, reach};
use crate::support::{Rng, lane_roots, packet, rounded};
use glam::{DAffine3, DMat3, DVec3};
use octray::kernel::*;
use octray::lane::{LANES, Lane, Mask, Scalar};
use octray::scene::Transform;

/// Roundings between a start as resolved and the same point as the next ray sees it: 4 in the map there and back, 4 in
/// the projection, and those of the crossing itself (`exact.rs`).
const K: f64 = 16.0;

/// Eight rays that start on primitive 0, where random rays hit it, in random directions.
struct Start<S: Scalar> {
    rays: Rays<S::Lane>,
    left: Left<S::Lane>,
    /// Cosine with the normal, by lane.
    cos: [f64; LANES],
}

/// Lanes that hit nothing are not `on`.
fn start<S: Scalar, B: Block<S>>(block: &B, place: &Transform, rng: &mut Rng) -> Start<S> {
    let size = place.vector(DVec3::ONE).length();
    let seen: Vec<_> = (0..LANES)
        .map(|_| {
            let from = place.forward.translation + rng.direction() * size * 3.0;
            (from, place.point(rng.cube()) - from)
        })
        .collect();
    let rays = packet::<S::Lane>(&seen);
    let roots = block.roots(0, &rays, None);
    // The first crossing, or any other, so that starts lie on all sides.
    let pick = rng.bits() as usize % roots.as_ref().len();
    let t = roots.as_ref()[pick];
    let on = t.equal(t);
    let surfaces = block.resolve(&[0; LANES], on, &rays, t);
    let onward: Vec<_> = (0..LANES).map(|k| (surfaces.point.lane(k), rng.direction())).collect();
    let rays = packet::<S::Lane>(&onward);
    let cos = std::array::from_fn(|k| surfaces.normal.lane(k).dot(rays.dir.lane(k)));
    Start { rays, left: Left { on, part: surfaces.part }, cos }
}

/// What rounding makes of a start, in own space.
fn slack<S: Scalar>(place: &Transform, start: DVec3) -> f64 {
    let sums = start.abs() + place.forward.translation.abs();
    K * S::UNIT_ROUNDOFF * (1.0 + reach(&place.inverse.matrix3, sums))
}

/// Convex solids, many: outward nothing, inward exactly one crossing ahead.
fn convex<S: Scalar, B: Block<S>>(what: &str, block: &B, place: &Transform, count: usize) {
    let rng = &mut Rng(7);
    let (mut starts, mut touching) = (0, 0);
    while starts < count {
        let Start { rays, left, cos } = start(block, place, rng);
        let roots = block.roots(0, &rays, Some(&left));
        for k in (0..LANES).filter(|k| left.on.bits() >> k & 1 == 1) {
            let found = lane_roots(roots.as_ref(), k);
            let ahead = found.iter().filter(|t| **t > 0.0).count();
            assert_eq!(found.len(), 2, "{what}: {found:?}, cos {}", cos[k]);
            let gone = block.left_behind(0, &rays, &left) >> k & 1 == 1;
            assert!(!gone || ahead == 0, "{what}: {found:?}, which is said to be left behind");
            assert!(found.contains(&0.0), "{what}: {found:?}, cos {}", cos[k]);
            if cos[k] < 0.0 && ahead == 0 {
                touching += 1;
            } else {
                assert_eq!(ahead, usize::from(cos[k] < 0.0), "{what}: {found:?}, cos {}", cos[k]);
            }
            starts += 1;
        }
    }
    // A ray inward may touch only, at an edge, or so low that rounding decides: within some hundred roundings, of the
    // size or the angle, of which each start has a few chances. In f64 that is never.
    let allowed = starts as f64 * S::UNIT_ROUNDOFF * 4096.0;
    assert!(f64::from(touching) <= allowed, "{what}: {touching} of {starts} only touch");
}

/// Any shape: the crossings are those of the oracle from the same start, one of which is exactly 0. Returns the share of starts that
/// are said to be left behind.
fn as_the_oracle<S: Scalar, B: Block<S>>(
    what: &str,
    block: &B,
    solid: &Solid,
    place: &Transform,
    count: usize,
) -> f64 {
    let rng = &mut Rng(11);
    let (mut starts, mut unclear) = (0, 0);
    let mut gone = 0;
    while starts < count {
        let Start { rays, left, .. } = start(block, place, rng);
        let roots = block.roots(0, &rays, Some(&left));
        let left_behind = block.left_behind(0, &rays, &left);
        assert_eq!(left_behind & !left.on.bits(), 0, "{what}: lanes that start elsewhere");
        gone += left_behind.count_ones() as usize;
        for k in (0..LANES).filter(|k| left.on.bits() >> k & 1 == 1) {
            starts += 1;
            let (o, d) = (rays.origin.lane(k), rays.dir.lane(k));
            let own = OwnRay::new(place, o, d);
            let slack = slack::<S>(place, o);
            if solid.hopeless(&own, slack) {
                continue;
            }
            let dir = DVec3::from_array(own.dir.map(Dd::f64));
            let speed = dir.length();
            // In own space; the side it leaves to is the same.
            let slope = solid.normal(DVec3::from_array(own.origin.map(Dd::f64))).dot(dir) / speed;
            let found = lane_roots(roots.as_ref(), k);
            if left_behind >> k & 1 == 1 {
                assert!(
                    found.iter().all(|t| *t <= 0.0),
                    "{what}: {found:?}, which is said to be left behind"
                );
            }
            let mut expected: Vec<f64> = solid.roots(&own).iter().map(|t| t.f64()).collect();
            let nearest =
                (0..expected.len()).min_by(|&a, &b| expected[a].abs().total_cmp(&expected[b].abs()));
            let Some(nearest) = nearest else {
                unclear += 1;
                continue;
            };
            // The start is off the surface by `slack`, and the root there by that over the cosine; the curvature
            // adds up to its square again.
            let grazing = slack / slope.abs() * 2.0;
            let here = expected.remove(nearest);
            if here.abs() * speed > grazing || found.len() != expected.len() + 1 {
                // Decided by rounding: allowed for a ray that is nearly tangent, here or where it next comes by.
                let variants = solid.neighbours(&own, slack);
                let tangent = grazing > 0.01
                    || slope.abs() < 4.0 * slack.sqrt()
                    || variants.iter().any(|v| v.len() != expected.len() + 1);
                assert!(
                    tangent,
                    "{what}: {found:?} for {expected:?} and 0, which is {here:e}, cos {slope} slack {slack:e}"
                );
                unclear += 1;
                continue;
            }
            let zero = found.iter().position(|t| *t == 0.0);
            assert!(zero.is_some(), "{what}: no crossing at the start in {found:?}");
            let others = found.iter().enumerate().filter(|(i, _)| Some(*i) != zero).map(|(_, t)| *t);
            for (t, e) in others.zip(&expected) {
                // First order at both ends, the root of it where the next crossing is tangent.
                let error = (t - e).abs() * speed;
                assert!(
                    error <= grazing + 4.0 * slack.sqrt(),
                    "{what}: {t:e} for {e:e}, off by {error:e}, cos {slope}"
                );
            }
        }
    }
    assert!(unclear * 20 < starts, "{what}: {unclear} of {starts} undecided");
    gone as f64 / starts as f64
}

fn places() -> [Transform; 3] {
    let turn = Transform::rotate(DVec3::new(0.3, -0.7, 1.1));
    [
        turn.then(&Transform::translate(DVec3::new(10.0, -20.0, 30.0))),
        Transform::scale(DVec3::new(1.0, 0.2, 3.0)).then(&turn),
        turn.then(&Transform::scale(DVec3::splat(1e-4))).then(&Transform::translate(DVec3::ONE * 1e-2)),
    ]
}

/// How many starts: without the oracle, with it, and with the torus' oracle.
const COUNTS: [usize; 3] = [100_000, 1000, 200];

fn leave<S: Scalar>() {
    let half = DVec3::new(1.0, 0.5, 0.25);
    let cone = |tip: f64| ((DVec3::ZERO, 1.0), (DVec3::Z, tip));
    for place in places() {
        let place = rounded::<S>(&place);
        let mut ellipsoids = Ellipsoids::<S>::default();
        ellipsoids.push(&place);
        convex("ellipsoid", &ellipsoids, &place, COUNTS[0]);
        as_the_oracle("ellipsoid", &ellipsoids, &Solid::Ball, &place, COUNTS[1]);

        let mut boxes = OrientedBoxes::<S>::default();
        boxes.push(&place, -half, half);
        convex("box", &boxes, &place, COUNTS[0]);
        as_the_oracle("box", &boxes, &Solid::Box { half }, &place, COUNTS[1]);

        let mut cylinders = Cylinders::<S>::default();
        cylinders.push(&place, cone(1.0).0, cone(1.0).1);
        convex("cylinder", &cylinders, &place, COUNTS[0]);
        let solid = Solid::Cone { taper: 0.0, open: false };
        as_the_oracle("cylinder", &cylinders, &solid, &place, COUNTS[1]);

        for tip in [0.0, 0.5] {
            let mut cones = ClosedCones::<S>::default();
            cones.push(&place, cone(tip).0, cone(tip).1);
            convex("cone", &cones, &place, COUNTS[0]);
            let solid = Solid::Cone { taper: 1.0 - tip, open: false };
            as_the_oracle("cone", &cones, &solid, &place, COUNTS[1]);
            let mut cones = OpenCones::<S>::default();
            cones.push(&place, cone(tip).0, cone(tip).1);
            let solid = Solid::Cone { taper: 1.0 - tip, open: true };
            as_the_oracle("open cone", &cones, &solid, &place, COUNTS[1]);
        }

        let mut discs = Discs::<S>::default();
        discs.push(&place, DVec3::ZERO, DVec3::Z, 1.0, 0.25);
        as_the_oracle("ring", &discs, &Solid::Disc { hole: 0.25 }, &place, COUNTS[1]);

        let mut planes = Planes::<S>::default();
        planes.push(&place, DVec3::Z, 0.0);
        as_the_oracle("plane", &planes, &Solid::Plane, &place, COUNTS[1]);

        let swap = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y);
        let swap = Transform::from_affine(DAffine3::from_mat3(swap)).unwrap();
        for minor in [0.25, 0.5, 0.75, 1.0 / 1024.0] {
            let mut tori = Tori::<S>::default();
            tori.push(&swap.then(&place), 1.0 - minor, minor);
            let solid = Solid::Torus { major: 1.0 - minor, minor };
            let gone = as_the_oracle(&format!("torus {minor}"), &tori, &solid, &place, COUNTS[2]);
            // Where there is an outer half, up to a quarter of all; of a tube that is as thin as starts may be off, none.
            let blurred = S::UNIT_ROUNDOFF > 1e-10 && minor < 0.01;
            assert!(gone > 0.1 || minor > 0.5 || blurred, "torus {minor}: {gone} of starts are left behind");
        }
    }
    for (center, radius) in [(DVec3::ZERO, 1.0), (DVec3::splat(30.0), 1.0), (DVec3::ZERO, 6.4e6)] {
        let place = Transform::scale(DVec3::splat(radius)).then(&Transform::translate(center));
        let mut spheres = Spheres::<S>::default();
        spheres.push(center, radius);
        convex("sphere", &spheres, &place, COUNTS[0]);
        let mut boxes = Boxes::<S>::default();
        boxes.push(center - half * radius, center + half * radius);
        convex("axis-parallel box", &boxes, &place, COUNTS[0]);
    }
}

#[test]
fn leaving_rays_forget_the_surface_in_f64() {
    leave::<f64>();
}

#[test]
fn leaving_rays_forget_the_surface_in_f32() {
    leave::<f32>();
}

/// Tori, many starts: what is said to be left behind is not met again. Rays leave the inner half too, through the hole.
fn leave_tori<S: Scalar>() {
    let turn = Transform::rotate(DVec3::new(0.3, -0.7, 1.1));
    let stretched = Transform::scale(DVec3::new(1.0, 3.0, 0.1)).then(&turn);
    let rng = &mut Rng(13);
    for place in places().into_iter().chain([stretched]) {
        let place = rounded::<S>(&place);
        for minor in [0.02, 0.1, 0.2, 0.35, 0.5] {
            let swap = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y);
            let swap = Transform::from_affine(DAffine3::from_mat3(swap)).unwrap();
            let mut tori = Tori::<S>::default();
            tori.push(&swap.then(&place), 1.0 - minor, minor);
            let (mut starts, mut told) = (0, 0);
            while starts < 20_000 {
                let Start { rays, left, .. } = start(&tori, &place, rng);
                let gone = tori.left_behind(0, &rays, &left);
                let roots = tori.roots(0, &rays, Some(&left));
                starts += left.on.bits().count_ones();
                for k in (0..LANES).filter(|k| gone >> k & 1 == 1) {
                    let found = lane_roots(roots.as_ref(), k);
                    assert!(
                        found.iter().all(|t| *t <= 0.0),
                        "torus {minor}: {found:?} of what is left behind"
                    );
                    let own = place.inverse.transform_point3(rays.origin.lane(k));
                    told += u32::from(own.truncate().length() < 1.0 - minor);
                }
            }
            // Of those on the inner half, which is near to half of all, some start inward and some meet the far side.
            assert!(minor > 0.2 || told * 30 > starts, "torus {minor}: {told} of {starts} through the hole");
        }
    }
}

#[test]
fn tori_left_behind_are_not_met_again_in_f64() {
    leave_tori::<f64>();
}

#[test]
fn tori_left_behind_are_not_met_again_in_f32() {
    leave_tori::<f32>();
}

/// A start that no hit of ours made: all lanes inactive leaves the crossings as they are.
#[test]
fn lanes_that_start_elsewhere_are_untouched() {
    let mut boxes = Boxes::<f64>::default();
    boxes.push(DVec3::NEG_ONE, DVec3::ONE);
    let rays = packet::<octray::lane::f64x8>(&[(DVec3::new(-3.0, 0.1, 0.2), DVec3::new(1.0, 0.1, 0.05))]);
    let left = Left { on: Mask::none_set(), part: [0; LANES] };
    let plain = boxes.roots(0, &rays, None).map(|t| t.to_array());
    assert_eq!(boxes.roots(0, &rays, Some(&left)).map(|t| t.to_array()), plain);
}
