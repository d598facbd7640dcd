//! Triangles and polygons: closed meshes without leaks, needles, weights and shading normals.

use crate::support::{Rng, crossings, lane_roots, packet, ray, surface};
use glam::DVec3;
use octray::kernel::*;
use octray::lane::{LANES, Lane, Scalar};

/// The twenty faces of an icosahedron about `center`, corners rounded to the columns once for all faces.
fn icosahedron<S: Scalar>(center: DVec3, size: f64) -> Vec<[DVec3; 3]> {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let corners: Vec<DVec3> = [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)]
        .iter()
        .flat_map(|&(a, b)| [DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)])
        .map(|p| (center + p.normalize() * size).map(|x| S::from_f64(x).to_f64()))
        .collect();
    let edge = corners.iter().map(|p| p.distance(corners[0])).filter(|d| *d > 0.0).fold(f64::MAX, f64::min);
    let near = |a: usize, b: usize| corners[a].distance(corners[b]) < edge * 1.2;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    faces.push([corners[a], corners[b], corners[c]]);
                }
            }
        }
    }
    faces
}

/// Rays from outside to points of edges and corners: every one must come in and go out, an even number of times.
fn no_leaks<S: Scalar>(center: DVec3, size: f64, count: usize) {
    let faces = icosahedron::<S>(center, size);
    assert_eq!(faces.len(), 20);
    let mut triangles = Triangles::<S>::default();
    let mut polygons = Polygons::<S>::default();
    for face in &faces {
        triangles.push(*face);
        polygons.push(&[face.to_vec()]);
    }
    let rng = &mut Rng(count as u64);
    for _ in 0..count / LANES {
        let rays: [_; LANES] = std::array::from_fn(|_| {
            let face = faces[(rng.unit() * 20.0) as usize];
            let along = if rng.unit() < 0.3 { 0.0 } else { rng.unit() };
            let target = face[0].lerp(face[1], along);
            // From in front of the edge, within 19 degrees; beyond 20.9 it may be on the outline.
            let from = center + (target - center + rng.cube() * size * 0.1) * (2.0 + 8.0 * rng.unit());
            (from, target - from)
        });
        let rays = packet::<S::Lane>(&rays);
        let mut hits = [[0; LANES]; 2];
        for i in 0..20 {
            let [a] = triangles.roots(i, &rays, None);
            let [b] = polygons.roots(i, &rays, None);
            for (hits, t) in hits.iter_mut().zip([a, b]) {
                let bits = t.equal(t).bits();
                hits.iter_mut().enumerate().for_each(|(k, n)| *n += u32::from(bits >> k & 1));
            }
        }
        assert_eq!(hits[0], hits[1], "a triangle and the same polygon");
        assert!(hits[0].iter().all(|n| *n >= 2 && n % 2 == 0), "{:?} crossings", hits[0]);
    }
}

#[test]
fn closed_meshes_do_not_leak() {
    no_leaks::<f64>(DVec3::ZERO, 1.0, 1_000_000);
    no_leaks::<f64>(DVec3::new(1e6, -2e6, 1e5), 1.0, 200_000);
    no_leaks::<f32>(DVec3::ZERO, 1.0, 1_000_000);
    no_leaks::<f32>(DVec3::splat(10.0), 1e-3, 200_000);
}

/// A grid in a plane, seen straight and at its own lines: one crossing everywhere within.
#[test]
fn grids_are_crossed_once() {
    let mut triangles = Triangles::<f64>::default();
    for i in 0..4 {
        for j in 0..4 {
            let p = |a: i32, b: i32| DVec3::new(f64::from(a), f64::from(b), 0.0);
            let (a, b, c, d) = (p(i, j), p(i + 1, j), p(i + 1, j + 1), p(i, j + 1));
            triangles.push([a, b, c]);
            triangles.push([a, c, d]);
        }
    }
    for x in 1..16 {
        for y in 1..16 {
            let target = DVec3::new(f64::from(x), f64::from(y), 0.0) / 4.0;
            for dir in [DVec3::Z, DVec3::NEG_Z, DVec3::new(0.5, -0.25, 1.0), DVec3::new(-1.0, 0.0, 0.125)] {
                let rays = packet::<octray::lane::f64x8>(&[(target - dir * 8.0, dir)]);
                let hits: usize = (0..32).map(|i| crossings(&triangles, i, &rays, None).len()).sum();
                assert_eq!(hits, 1, "at {target} along {dir}");
            }
        }
    }
}

/// Needles: the crossing is right to the roundings of the ray and the corners over the sine to the plane.
#[test]
fn needles_are_met_where_they_are() {
    let rng = &mut Rng(5);
    for width in [1e-4, 1e-7] {
        for _ in 0..500 {
            let (along, across) = (rng.direction(), rng.direction());
            let base = rng.cube() * 3.0;
            let corners = [base, base + along * 2.0, base + along * (2.0 * rng.unit()) + across * width];
            let mut triangles = Triangles::<f64>::default();
            triangles.push(corners);
            let (u, v) = (rng.unit(), rng.unit());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let target = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
            let from = target + rng.direction() * 5.0;
            let rays = packet::<octray::lane::f64x8>(&[(from, target - from)]);
            let found = crossings(&triangles, 0, &rays, None);
            let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
            let sine = n.dot(rays.dir.lane(0)).abs();
            // Corners to 1e-15 tilt the plane by that over the width, seen from at most the width's distance: the
            // needle's long edges hold it.
            let allowed = 1e-14 / sine;
            if u.min(v).min(1.0 - u - v) * width > 1e-14 / sine {
                assert_eq!(found.len(), 1, "width {width}");
            }
            for t in found {
                assert!((t - 5.0).abs() <= allowed, "{t} of 5, {allowed:e}, width {width}");
            }
        }
    }
    let mut none = Triangles::<f64>::default();
    none.push([DVec3::ZERO, DVec3::X, DVec3::X * 2.0]);
    none.push([DVec3::X, DVec3::X, DVec3::Y]);
    let rays = ray([0.5, 0.0, -1.0], [0.0, 0.0, 1.0]);
    assert_eq!(crossings(&none, 0, &rays, None).len() + crossings(&none, 1, &rays, None).len(), 0);
}

/// A ground triangle of 10^6 seen from 1 above: in f32 too the height decides, not the far corners.
#[test]
fn large_triangles_keep_their_height() {
    let corners = [(-1e6, -1e6), (1e6, -1e6), (0.0, 1.5e6)].map(|(x, z)| DVec3::new(x, 0.0, z));
    let mut triangles = Triangles::<f32>::default();
    triangles.push(corners);
    let rng = &mut Rng(1);
    for _ in 0..1000 {
        let dir = (rng.cube() - DVec3::Y * 1.1).normalize();
        let rays = packet::<octray::lane::f32x8>(&[(DVec3::Y, dir)]);
        let down = f64::from(-rays.dir.lane(0).y as f32);
        let found = lane_roots(&triangles.roots(0, &rays, None), 0);
        // Three roundings of t = 1 / down.
        assert!(found.len() == 1 && (found[0] * down - 1.0).abs() < 4.0 * f32::UNIT_ROUNDOFF, "{found:?}");
    }
}

#[test]
fn weights_and_normals_follow_the_corners() {
    let corners = [DVec3::ZERO, DVec3::X * 3.0, DVec3::Y * 2.0];
    let normals = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut smooth = SmoothTriangles::<f64>::default();
    smooth.push(corners, normals);
    let rng = &mut Rng(9);
    for _ in 0..1000 {
        let (u, v) = (rng.unit(), rng.unit());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let target = corners[1] * u + corners[2] * v;
        let from = target + rng.direction() * 4.0;
        let rays = packet(&[(from, target - from)]);
        let t = crossings(&smooth, 0, &rays, None);
        let Some(&t) = t.first() else { continue };
        let s = surface(&smooth, &rays, t);
        let sine = rays.dir.lane(0).z.abs();
        let blend = (normals[0] * (1.0 - u - v) + normals[1] * u + normals[2] * v).normalize();
        let [su, sv] = [s.u, s.v].map(|x| x.to_array()[0]);
        let allowed = 1e-14 / sine; // some ten roundings of 5, seen at this angle
        assert!((su - u).abs() < allowed && (sv - v).abs() < allowed, "{su} {sv} for {u} {v}");
        assert!(s.normal.lane(0).distance(blend) < 2.0 * allowed);
        assert_eq!(s.point.lane(0).z, 0.0);
    }
}

/// Outlines within outlines, a corner on the way of the ray, and one that crosses itself.
#[test]
fn polygons_are_even_odd() {
    let square = |h: f64| [(-h, -h), (h, -h), (h, h), (-h, h)].map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
    let star: Vec<_> = (0..5).map(|k| f64::from(k * 2) * std::f64::consts::TAU / 5.0).collect();
    let star = star.iter().map(|a| DVec3::new(a.sin(), a.cos(), 0.0)).collect::<Vec<_>>();
    let mut with_double = square(1.0);
    with_double.insert(2, with_double[1]);
    with_double.insert(4, DVec3::new(0.5, 1.0, 0.0)); // a repeated corner, and one in the middle of an edge
    let mut polygons = Polygons::<f64>::default();
    polygons.push(&[square(3.0), square(2.0), square(1.0)]);
    polygons.push(&[star]);
    polygons.push(&[with_double]);
    let hits =
        |i: usize, x: f64, y: f64| crossings(&polygons, i, &ray([x, y, -1.0], [0.0, 0.0, 1.0]), None).len();
    for (x, expected) in [(0.0, 1), (0.5, 1), (1.5, 0), (2.5, 1), (3.5, 0), (-2.5, 1), (-1.5, 0)] {
        assert_eq!(hits(0, x, 0.1), expected, "{x}");
    }
    // At the height of a corner on both sides of it.
    assert_eq!([hits(0, -2.5, 2.0), hits(0, 0.0, 2.0 + 1e-9), hits(0, 2.5, -1.0)], [1, 1, 1]);
    assert_eq!([hits(1, 0.0, 0.0), hits(1, 0.0, 0.9), hits(1, 0.9, 0.9)], [0, 1, 0]);
    for k in 0..20 {
        let x = -0.95 + 0.1 * f64::from(k);
        assert_eq!([hits(2, x, 0.0), hits(2, x, 0.5), hits(2, x, 1.5)], [1, 1, 0], "{x}");
    }
}
