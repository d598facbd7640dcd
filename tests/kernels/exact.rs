//! Every shape against double-double, on easy rays and on hard ones.
//!
//! What may differ is what rounding of the input alone explains. With `u` half a unit in the last place, a coordinate
//! carries an error of `K u` times what was summed to get it; in own space that is `slack`. A crossing may then be off
//! along the ray by `slack / |n . d|`, or by the square root of `slack` where the ray is tangent, and it may be lost or
//! won only if it is also lost or won when the shape grows or shrinks by `slack`.

use crate::dd::{Dd, at};
use crate::oracle::{OwnRay, Solid, reach};
use crate::support::{Rng, lane_roots, packet, rounded};
use glam::DVec3;
use octray::kernel::*;
use octray::lane::{LANES, Scalar};
use octray::scene::Transform;

/// Roundings that the chain from a world ray to a crossing piles up: 1 in the subtraction of the centre, 3 in a row of
/// the map, for the origin and again for the direction. (The polynomial and its root come to less, because they
/// are formed near the shape. Half of this is seen to be needed.)
const K: f64 = 8.0;

/// How rays are laid.
#[derive(Debug, Clone, Copy)]
enum Aim {
    /// At random points within the shape's box, from this many sizes away.
    Across(f64),
    /// From inside the shape's box.
    Within,
    /// Parallel to an axis of the world, some with components -0.
    Parallel,
    /// Along a tangent at this many sizes, off the surface by 10^-1 to 10^-7 sizes outward or inward.
    Graze(f64),
    /// At edges, rims, corners and apexes.
    Feature(f64),
    /// Downward, nearly level, from this many sizes above the surface.
    Hover(f64),
}

fn lay(aim: Aim, solid: &Solid, place: &Transform, rng: &mut Rng) -> (DVec3, DVec3) {
    let inside = place.point(rng.cube());
    let size = place.vector(DVec3::ONE).length();
    match aim {
        Aim::Across(far) => {
            let from = place.forward.translation + rng.direction() * size * far;
            (from, inside - from)
        }
        Aim::Within => (inside, rng.direction()),
        Aim::Parallel => {
            let mut dir = DVec3::ZERO;
            dir[(rng.unit() * 3.0) as usize] = if rng.unit() < 0.5 { -1.0 } else { 1.0 };
            (inside - dir * size * 2.0, if rng.unit() < 0.5 { dir } else { -(DVec3::ZERO - dir) })
        }
        Aim::Graze(far) => {
            let p = solid.surface(rng);
            let n = solid.normal(p);
            let off = 10f64.powf(-1.0 - 6.0 * rng.unit()) * if rng.unit() < 0.5 { 1.0 } else { -1.0 };
            let tangent = place.vector(n.cross(rng.direction())).normalize();
            (place.point(p + n * off) - tangent * size * far, tangent)
        }
        Aim::Hover(height) => {
            let p = solid.surface(rng);
            let n = solid.normal(p);
            let level = n.cross(rng.direction()).normalize();
            // From the horizon (an angle of sqrt(2 height) below level) to straight down.
            let down = (2.0 * height).sqrt() * 10f64.powf(3.0 * rng.unit());
            (place.point(p + n * height), place.vector(level - n * down))
        }
        Aim::Feature(far) => {
            let p = place.point(solid.feature(rng));
            let from = p + rng.direction() * size * far;
            (from, p - from)
        }
    }
}

/// What came out of one run, in units of what rounding allows.
#[derive(Debug, Default)]
struct Tally {
    crossings: usize,
    worst: f64,
    undecided: usize,
}

/// Holds primitive 0 of a block against its oracle on `count` rays.
fn hold<S: Scalar, B: Block<S>>(
    what: &str,
    block: &B,
    solid: &Solid,
    place: &Transform,
    aim: Aim,
    count: usize,
) -> Tally {
    let rng = &mut Rng(count as u64);
    let m = place.inverse.matrix3;
    let bounds = block.bounds(0);
    let mut tally = Tally::default();
    for _ in 0..count.div_ceil(LANES) {
        let rays: Vec<_> = (0..LANES).map(|_| lay(aim, solid, place, rng)).collect();
        let rays = packet::<S::Lane>(&rays);
        let roots = block.roots(0, &rays, None);
        for k in 0..LANES {
            let (o, d) = (rays.origin.lane(k), rays.dir.lane(k));
            let own = OwnRay::new(place, o, d);
            let found = lane_roots(roots.as_ref(), k);
            let expected = solid.roots(&own);
            let far = expected
                .iter()
                .map(|t| t.f64())
                .chain(found.iter().copied())
                .fold(0.0, |far: f64, t| far.max(t.abs()));
            let slack = K
                * S::UNIT_ROUNDOFF
                * (1.0 + reach(&m, o.abs() + place.forward.translation.abs()) + reach(&m, d) * far);
            if solid.hopeless(&own, slack) {
                tally.undecided += 1;
                continue;
            }
            // Only rounding of the sum itself, 2^-100, is forgiven: bounds hold the shape that the columns describe. (The
            // oracle's double roots are good to half its digits only.)
            let plain = bounds.is_finite() && !matches!(aim, Aim::Graze(_) | Aim::Feature(_));
            for t in expected.iter().filter(|_| plain) {
                let p = at(o.to_array().map(Dd::from), d.to_array().map(Dd::from), *t);
                let tiny = Dd::from((o.length() + t.f64().abs()) * 2f64.powi(-100));
                for axis in 0..3 {
                    assert!(
                        p[axis] >= Dd::from(bounds.min[axis]) - tiny
                            && p[axis] <= Dd::from(bounds.max[axis]) + tiny,
                        "{what} {aim:?}: {p:?} is not in {bounds:?}"
                    );
                }
            }
            let neighbours = solid.neighbours(&own, slack);
            let certain = neighbours.iter().all(|n| n.len() == expected.len());
            if found.len() != expected.len() {
                assert!(
                    !certain,
                    "{what} {aim:?}: {found:?} for {expected:?}, ray {o:?} {d:?}, slack {slack:e}"
                );
                tally.undecided += 1;
                continue;
            }
            for (i, (t, e)) in found.iter().zip(&expected).enumerate() {
                let error = (Dd::from(*t) - *e).f64().abs();
                let p = DVec3::from_array(at(own.origin, own.dir, *e).map(Dd::f64));
                let speed = DVec3::from_array(own.dir.map(|x| x.f64()));
                let straight = error * solid.normal(p).dot(speed).abs() / slack;
                let tangent = error * speed.length() / (4.0 * slack.sqrt());
                // At an edge another face may be met: the crossing then lies between those of the two shapes.
                let rivals = neighbours.iter().flat_map(|n| if certain { &n[i..=i] } else { &n[..] });
                let between = rivals.clone().any(|r| r.f64() <= *t) && rivals.clone().any(|r| r.f64() >= *t);
                let share = if between { 0.0 } else { straight.min(tangent) };
                assert!(
                    share <= 1.0,
                    "{what} {aim:?}: {t:e} for {:e}, {share} of what rounding allows, ray {o:?} {d:?}",
                    e.f64()
                );
                tally.crossings += 1;
                tally.worst = tally.worst.max(share);
            }
        }
    }
    tally
}

/// The frames: scale, turn, shift. In f32 the map is rounded to f32 too, as the columns are.
fn places<S: Scalar>() -> Vec<(&'static str, Transform)> {
    let turn = Transform::rotate(DVec3::new(0.3, -0.7, 1.1));
    let mut all = vec![
        ("unit", Transform::IDENTITY),
        ("small", turn.then(&Transform::scale(DVec3::splat(1e-5)))),
        ("large", turn.then(&Transform::scale(DVec3::splat(1e5)))),
        ("shifted", turn.then(&Transform::translate(DVec3::new(10.0, -20.0, 30.0)))),
        (
            "stretched",
            Transform::scale(DVec3::new(1.0, 0.1, 3.0))
                .then(&turn)
                .then(&Transform::translate(DVec3::new(1.0, 2.0, 3.0))),
        ),
        ("mirrored", Transform::scale(DVec3::new(1.0, -2.0, 1.0)).then(&turn)),
    ];
    if S::UNIT_ROUNDOFF < 1e-10 {
        all.extend([
            ("far off", turn.then(&Transform::translate(DVec3::new(1e6, 2e6, -1e6)))),
            ("flat", Transform::scale(DVec3::new(1.0, 1e-6, 1.0)).then(&turn)),
            ("long", Transform::scale(DVec3::new(1e-6, 1e-6, 1e3)).then(&turn)),
        ]);
    }
    all
}

fn aims<S: Scalar>() -> Vec<Aim> {
    let mut all = vec![
        Aim::Across(3.0),
        Aim::Across(100.0),
        Aim::Within,
        Aim::Parallel,
        Aim::Graze(3.0),
        Aim::Feature(3.0),
        Aim::Feature(0.3),
        Aim::Hover(1e-2),
    ];
    if S::UNIT_ROUNDOFF < 1e-10 {
        all.extend([
            Aim::Across(1e4),
            Aim::Across(1e6),
            Aim::Graze(1e4),
            Aim::Feature(1e3),
            Aim::Hover(2.7e-7),
        ]);
    }
    all
}

/// Every place and aim for one shape.
fn hold_all<S: Scalar, B: Block<S>>(
    what: &str,
    solid: Solid,
    push: impl Fn(&mut B, &Transform),
    count: usize,
) {
    for (name, place) in places::<S>() {
        let place = rounded::<S>(&place);
        let mut block = B::default();
        push(&mut block, &place);
        for aim in aims::<S>() {
            let tally = hold(&format!("{what} {name}"), &block, &solid, &place, aim, count);
            if std::env::var_os("TALLY").is_some() {
                println!("{what} {name} {aim:?}: {tally:?}");
            }
        }
    }
}

/// Spheres and axis-parallel boxes have columns of their own instead of a frame.
fn shapes_without_frames<S: Scalar>(count: usize) {
    let half = DVec3::new(1.0, 0.5, 0.25);
    // Sizes are powers of two, so that corners are exact: the columns are the oracle's shape.
    for (center, size) in [(0.0, 0), (0.0, -17), (0.0, 22), (10.0, 0), (1e6, 0), (1e3, -10)] {
        let size = 2f64.powi(size);
        let center = DVec3::new(center, -2.0 * center, 3.0 * center);
        let place = Transform::scale(DVec3::splat(size)).then(&Transform::translate(center));
        let place = rounded::<S>(&place);
        let (center, size) = (place.forward.translation, place.forward.matrix3.x_axis.x);
        let (mut spheres, mut boxes) = (Spheres::<S>::default(), Boxes::<S>::default());
        spheres.push(center, size);
        boxes.push(center - half * size, center + half * size);
        for aim in aims::<S>() {
            hold::<S, _>("sphere", &spheres, &Solid::Ball, &place, aim, count);
            hold::<S, _>("axis-parallel box", &boxes, &Solid::Box { half }, &place, aim, count);
        }
    }
}

fn shapes<S: Scalar>(count: usize) {
    shapes_without_frames::<S>(count);
    hold_all::<S, Ellipsoids<S>>("ellipsoid", Solid::Ball, |b, t| b.push(t), count);
    let half = DVec3::new(1.0, 0.5, 0.25);
    hold_all::<S, OrientedBoxes<S>>("box", Solid::Box { half }, |b, t| b.push(t, -half, half), count);
    let flat = DVec3::new(1.0, 0.5, 0.0);
    hold_all::<S, OrientedBoxes<S>>(
        "flat box",
        Solid::Box { half: flat },
        |b, t| b.push(t, -flat, flat),
        count,
    );
    hold_all::<S, Cylinders<S>>(
        "cylinder",
        Solid::Cone { taper: 0.0, open: false },
        |b, t| b.push(t, (DVec3::ZERO, 1.0), (DVec3::Z, 1.0)),
        count,
    );
    hold_all::<S, OpenCylinders<S>>(
        "open cylinder",
        Solid::Cone { taper: 0.0, open: true },
        |b, t| b.push(t, (DVec3::ZERO, 1.0), (DVec3::Z, 1.0)),
        count,
    );
    for taper in [1.0, 0.5, 1.0 / 1024.0, 1.0 / (1u64 << 30) as f64] {
        hold_all::<S, ClosedCones<S>>(
            "cone",
            Solid::Cone { taper, open: false },
            |b, t| b.push(t, (DVec3::ZERO, 1.0), (DVec3::Z, 1.0 - taper)),
            count,
        );
        hold_all::<S, OpenCones<S>>(
            "open cone",
            Solid::Cone { taper, open: true },
            |b, t| b.push(t, (DVec3::ZERO, 1.0), (DVec3::Z, 1.0 - taper)),
            count,
        );
    }
    hold_all::<S, Discs<S>>(
        "ring",
        Solid::Disc { hole: 0.25 },
        |b, t| b.push(t, DVec3::ZERO, DVec3::Z, 1.0, 0.25),
        count,
    );
    hold_all::<S, Planes<S>>("plane", Solid::Plane, |b, t| b.push(t, DVec3::Z, 0.0), count);
}

#[test]
fn shapes_are_exact_in_f64() {
    shapes::<f64>(160);
}

#[test]
fn shapes_are_exact_in_f32() {
    shapes::<f32>(160);
}

#[test]
fn tori_are_exact() {
    // About y in the file's words, about z in the oracle's.
    let swap = Transform::from_affine(glam::DAffine3::from_mat3(glam::DMat3::from_cols(
        DVec3::X,
        DVec3::Z,
        DVec3::Y,
    )))
    .unwrap();
    for minor in [0.25, 0.5, 0.75, 1.0 / 1024.0, 1.0 / 16384.0] {
        let (major, solid) = (1.0 - minor, Solid::Torus { major: 1.0 - minor, minor });
        hold_all::<f64, Tori<f64>>(
            &format!("torus {minor}"),
            solid,
            |b, t| b.push(&swap.then(t), major, minor),
            80,
        );
    }
}
