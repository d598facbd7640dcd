//! Polynomial surfaces that are something else too: a sphere and a torus, against the kernels made for them.

use crate::support::{Rng, lane_roots, packet};
use glam::DVec3;
use octray::kernel::{Block, Left, Looking, Polynomials, Rays, Spheres, Tori};
use octray::lane::{LANES, Lane, Mask, Vec3, f64x8};
use octray::scene::{Polynomial, Transform};
use std::sync::Arc;

const MAJOR: f64 = 0.75;
const MINOR: f64 = 0.25;

fn polynomial(order: usize, terms: &[([usize; 3], f64)], factor: f64) -> Arc<Polynomial> {
    let mut c = vec![0.0; Polynomial::terms(order)];
    for (powers, value) in terms {
        c[Polynomial::place(order, *powers)] = value * factor;
    }
    Arc::new(Polynomial::new(order, c).expect("finite coefficients, as many as the order asks for"))
}

/// The unit sphere, as a polynomial of `order` whose highest terms are 0.
fn sphere(order: usize, factor: f64) -> Arc<Polynomial> {
    let terms = [([2, 0, 0], 1.0), ([0, 2, 0], 1.0), ([0, 0, 2], 1.0), ([0, 0, 0], -1.0)];
    polynomial(order, &terms, factor)
}

/// `r^4 + side (x^2 + z^2) + axis y^2 + constant`
fn quartic(side: f64, axis: f64, constant: f64) -> Arc<Polynomial> {
    let terms = [
        ([4, 0, 0], 1.0),
        ([0, 4, 0], 1.0),
        ([0, 0, 4], 1.0),
        ([2, 2, 0], 2.0),
        ([2, 0, 2], 2.0),
        ([0, 2, 2], 2.0),
        ([2, 0, 0], side),
        ([0, 2, 0], axis),
        ([0, 0, 2], side),
        ([0, 0, 0], constant),
    ];
    polynomial(4, &terms, 1.0)
}

/// `(r^2 + R^2 - a^2)^2 = 4 R^2 (x^2 + z^2)`
fn torus() -> Arc<Polynomial> {
    let k = MAJOR * MAJOR - MINOR * MINOR;
    quartic(2.0 * k - 4.0 * MAJOR * MAJOR, 2.0 * k, k * k)
}

fn rays(rng: &mut Rng, place: &Transform, far: f64) -> Rays<f64x8> {
    let seen: Vec<_> = (0..LANES)
        .map(|_| {
            let from = place.point(rng.direction() * far);
            (from, place.point(rng.cube()) - from)
        })
        .collect();
    packet(&seen)
}

/// Crossings of both, from outside and then from where the first was: as many, and as far.
fn agree(a: &impl Block<f64>, b: &impl Block<f64>, place: &Transform, far: f64, bound: f64) {
    let rng = &mut Rng(5);
    let mut met = 0;
    for _ in 0..2000 {
        let rays = rays(rng, place, far);
        let (found, expected) = (a.roots(0, &rays, None), b.roots(0, &rays, None));
        let surfaces = b.resolve(&[0; LANES], Mask::all_set(), &rays, expected.as_ref()[0]);
        let on = expected.as_ref()[0].equal(expected.as_ref()[0]);
        let onward = Rays { origin: surfaces.point, dir: rays.dir };
        let left = Left { on, part: surfaces.part };
        let (found_on, expected_on) = (a.roots(0, &onward, Some(&left)), b.roots(0, &onward, Some(&left)));
        let ahead = Looking { from: f64x8::zero(), to: f64x8::lit(f64::INFINITY), lanes: !0, any: false };
        let first = [a.first(0, &rays, None, &ahead), b.first(0, &rays, None, &ahead)];
        let left = Some(&left);
        let first_on = [a.first(0, &onward, left, &ahead), b.first(0, &onward, left, &ahead)];
        for k in 0..LANES {
            let hit = on.bits() >> k & 1 == 1;
            let mut pairs = vec![(lane_roots(found.as_ref(), k), lane_roots(expected.as_ref(), k), first)];
            if hit {
                met += 1;
                pairs.push((lane_roots(found_on.as_ref(), k), lane_roots(expected_on.as_ref(), k), first_on));
            }
            for (found, expected, first) in pairs {
                // Two roots that nearly touch are the square root of a rounding apart, or not there at all.
                let gap = expected.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
                if gap < 1e-3 || found.len() != expected.len() && found.windows(2).any(|w| w[1] - w[0] < 1e-3)
                {
                    continue;
                }
                assert_eq!(found.len(), expected.len(), "{found:?} for {expected:?}");
                for (f, e) in found.iter().zip(&expected) {
                    assert!((f - e).abs() <= bound, "{found:?} for {expected:?}");
                }
                let nearest = expected.iter().find(|&&t| t > 0.0);
                for first in first.map(|first| first.to_array()[k]) {
                    match nearest {
                        Some(t) => assert!((first - t).abs() <= bound, "{first} for {expected:?}"),
                        None => assert!(first.is_nan(), "{first} for {expected:?}"),
                    }
                }
            }
        }
    }
    assert!(met > 2000, "only {met} rays met it");
}

fn placed() -> Transform {
    Transform::scale(DVec3::new(1.0, 2.0, 0.5))
        .then(&Transform::rotate(DVec3::new(0.3, 0.7, -0.4)))
        .then(&Transform::translate(DVec3::new(3.0, -2.0, 1.0)))
}

fn one(polynomial: &Arc<Polynomial>, place: &Transform) -> Polynomials<f64> {
    let mut block = Polynomials::default();
    block.push(place, polynomial);
    block
}

#[test]
fn a_sphere_of_any_order_and_factor_is_a_sphere() {
    let mut spheres = Spheres::default();
    spheres.push(DVec3::ZERO, 1.0);
    for order in [2, 3, 4, 7] {
        for factor in [1.0, 1e8, 1e-8] {
            // A root's error is that of the value, some 16 roundings of 1, over the slope: at least 1e-3 for roots
            // that are 1e-3 apart.
            agree(
                &one(&sphere(order, factor), &Transform::IDENTITY),
                &spheres,
                &Transform::IDENTITY,
                4.0,
                1e-11,
            );
        }
    }
}

#[test]
fn a_torus_is_a_torus_near_and_far() {
    for place in [Transform::IDENTITY, placed()] {
        let mut tori = Tori::default();
        tori.push(&place, MAJOR, MINOR);
        for far in [3.0, 1e4] {
            // As above, with slopes of the order of the gap times the tube; far rays also carry 1e4 roundings of `t`
            // and of the place.
            agree(&one(&torus(), &place), &tori, &place, far, 1e-10 * far);
        }
    }
}

#[test]
fn inside_is_where_the_polynomial_is_negative() {
    let outside_in = one(&sphere(2, -1.0), &Transform::IDENTITY);
    let rng = &mut Rng(9);
    let rays = rays(rng, &Transform::IDENTITY, 4.0);
    assert!(outside_in.starts_inside(0, &rays).all());
    assert!(one(&sphere(2, 1.0), &Transform::IDENTITY).starts_inside(0, &rays).none());
}

#[test]
fn what_touches_or_is_no_number_is_not_crossed() {
    // (x^2 + y^2 + z^2 - 1)^2 does not change its sign.
    let double = one(&quartic(-2.0, -2.0, 1.0), &Transform::IDENTITY);
    let through = packet::<f64x8>(&[(DVec3::new(0.0, 0.0, -2.0), DVec3::Z)]);
    assert!(lane_roots(double.roots(0, &through, None).as_ref(), 0).is_empty());
    for origin in [f64::NAN, f64::INFINITY] {
        let mut broken = through;
        broken.origin.x = f64x8::lit(origin);
        assert!(
            lane_roots(one(&sphere(2, 1.0), &Transform::IDENTITY).roots(0, &broken, None).as_ref(), 0)
                .is_empty()
        );
    }
}

/// Asked where rays are between two distances, what is inside there is as from end to end: also of rays that start on the surface,
/// before, on and behind it.
#[test]
fn what_is_inside_between_two_distances_is_so_from_end_to_end() {
    let saddle = polynomial(4, &[([3, 0, 0], 1.0), ([1, 2, 0], -3.0), ([0, 0, 1], -1.0)], 1.0);
    let cone = polynomial(2, &[([2, 0, 0], 1.0), ([0, 2, 0], -1.0), ([0, 0, 2], 1.0)], 1.0);
    let hollow = sphere(3, -1.0);
    let place = placed();
    let rng = &mut Rng(7);
    let (mut inside, mut asked, mut spared, mut left_inside) = (0, 0, 0, 0);
    for of in [saddle, cone, hollow, sphere(2, 2.0), torus()] {
        let surface = one(&of, &place);
        for round in 0..1000 {
            let rays = rays(rng, &place, 3.0);
            let first = surface.roots(0, &rays, None).as_ref().first().copied();
            let first = first.unwrap_or(f64x8::lit(f64::NAN));
            let on = Mask::from_bits(if round % 2 == 0 { 0 } else { 0b0110_0110 }) & first.equal(first);
            let at = surface.resolve(&[0; LANES], on, &rays, on.keep(first));
            let rays = Rays { origin: Vec3::select(on, at.point, rays.origin), dir: rays.dir };
            let left = Left { on, part: at.part };
            let left = on.any().then_some(&left);
            let ends: [[f64; 2]; LANES] = std::array::from_fn(|_| {
                let [from, to] = [(); 2].map(|()| rng.unit() * 4.0 - 2.0);
                [from.min(to), from.max(to)]
            });
            let [from, to] = [0, 1].map(|k| f64x8::from_fn(|lane| ends[lane][k]));
            let looking = Looking { from, to, lanes: !0, any: false };
            let (mut all, mut some) = (Vec::new(), Vec::new());
            let before_all = surface.cross(0, &rays, left, None, &mut all).bits();
            let before_some = surface.cross(0, &rays, left, Some(&looking), &mut some).bits();
            for (lane, &[from, to]) in ends.iter().enumerate() {
                let (all, some) = (lane_roots(&all, lane), lane_roots(&some, lane));
                let starts_here = on.bits() >> lane & 1 == 1;
                for share in [0.01, 0.5, 0.99] {
                    let t = from + share * (to - from);
                    if all.iter().any(|root| (root - t).abs() < 1e-6) {
                        continue;
                    }
                    let odd = |before: u8, roots: &[f64]| {
                        (before >> lane & 1 == 1) ^ (roots.iter().filter(|root| **root < t).count() % 2 == 1)
                    };
                    assert_eq!(odd(before_some, &some), odd(before_all, &all), "{t}: {some:?} of {all:?}");
                    asked += 1;
                    inside += u32::from(odd(before_all, &all));
                    left_inside += u32::from(starts_here && odd(before_all, &all));
                }
                spared += u32::from(some.len() < all.len());
            }
        }
    }
    assert!(
        asked > 100_000 && inside > asked / 8 && left_inside > 1000,
        "{inside}, {left_inside} of {asked}"
    );
    assert!(spared > 10_000, "{spared}");
}

/// A quadric that is told to be passed by has no crossing ahead: the first is that of all, to the bit, also of rays that all but touch.
#[test]
fn what_passes_a_quadric_by_has_no_crossing_ahead() {
    let quadric = |y: f64, z: f64, along_z: f64, constant: f64| {
        let terms =
            [([2, 0, 0], 1.0), ([0, 2, 0], y), ([0, 0, 2], z), ([0, 0, 1], along_z), ([0; 3], constant)];
        polynomial(2, &terms, 1.0)
    };
    let surfaces = [
        quadric(1.0, 0.0, 0.0, -0.5),
        quadric(0.5, 0.0, -1.0, 0.0),
        quadric(1.0, -1.0, 0.0, 0.0),
        quadric(1.0, -1.0, 0.0, 0.1),
        quadric(-0.7, 0.0, 1.0, 0.0),
        quadric(2.0, 3.0, 0.0, -0.3),
        quadric(1e-7, 0.0, 1.0, 0.0),
    ];
    let (place, rng) = (placed(), &mut Rng(11));
    let (mut met, mut passed) = (0, 0);
    for of in surfaces {
        let surface = one(&of, &place);
        for round in 0..2000 {
            let far = [2.0, 1e4][round % 2];
            let mut rays = rays(rng, &place, far);
            let first = surface.roots(0, &rays, None).as_ref().first().copied();
            let first = first.unwrap_or(f64x8::lit(f64::NAN));
            let hits = first.equal(first);
            if round % 4 > 1 && hits.any() {
                // Along the surface, or almost, and off it by 1e-15 to 1e-1.
                let at = surface.resolve(&[0; LANES], hits, &rays, hits.keep(first));
                let turned = Vec3::from_fn(|_| rng.direction());
                let way = at.normal.cross(turned).normalize();
                let off = f64x8::from_fn(|_| 10f64.powf(-15.0 + 14.0 * rng.unit()) * (rng.unit() - 0.5));
                let from = at.point + at.normal * off - way * f64x8::lit(far);
                rays = Rays {
                    origin: Vec3::select(hits, from, rays.origin),
                    dir: Vec3::select(hits, way, rays.dir),
                };
            }
            let ahead = Looking { from: f64x8::zero(), to: f64x8::lit(f64::INFINITY), lanes: !0, any: false };
            let found = surface.first(0, &rays, None, &ahead).to_array();
            let all = surface.roots(0, &rays, None);
            for (lane, found) in found.into_iter().enumerate() {
                let expected = lane_roots(all.as_ref(), lane).into_iter().find(|t| *t > 0.0);
                assert_eq!((!found.is_nan()).then_some(found), expected, "{round} {lane}");
                met += u32::from(expected.is_some());
                passed += u32::from(expected.is_none());
            }
        }
    }
    assert!(met > 10_000 && passed > 10_000, "{met} met, {passed} passed by");
}
