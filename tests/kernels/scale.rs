//! A scene scaled by a power of two gives the same bits, scaled: no kernel has a length of its own.

use crate::support::{Rng, packet};
use glam::DVec3;
use octray::kernel::*;
use octray::lane::{LANES, Lane, Mask, f64x8};
use octray::scene::Transform;

/// What a block answers to eight rays, as bits, lengths taken back by `scale`.
fn answers<B: Block<f64>>(block: &B, rays: &Rays<f64x8>, scale: f64) -> Vec<u64> {
    let mut bits = Vec::new();
    let mut put = |lanes: f64x8, scale: f64| {
        // NaNs have one meaning here and many patterns.
        bits.extend(lanes.to_array().map(|x| if x.is_nan() { u64::MAX } else { (x / scale).to_bits() }));
    };
    let roots = block.roots(0, rays, None);
    for t in roots.as_ref().iter().chain(block.boundary(0, rays, None).as_ref()) {
        put(*t, scale);
    }
    let t = roots.as_ref()[0];
    let s = block.resolve(&[0; LANES], Mask::all_set(), rays, t);
    for (v, unit) in [(s.point, scale), (s.normal, 1.0)] {
        [v.x, v.y, v.z].into_iter().for_each(|x| put(x, unit));
    }
    put(s.u, 1.0);
    put(s.v, 1.0);
    let hit = t.equal(t);
    let onward = Rays { origin: s.point, dir: rays.dir };
    let left = Left { on: hit, part: s.part };
    for t in block.roots(0, &onward, Some(&left)).as_ref() {
        put(hit.keep(*t), scale);
    }
    bits.push(u64::from(block.starts_inside(0, rays).bits()));
    bits.extend(s.part.iter().zip(0..).filter(|(_, k)| hit.bits() >> k & 1 == 1).map(|(p, _)| u64::from(*p)));
    let b = block.bounds(0);
    bits.extend(b.min.to_array().iter().chain(&b.max.to_array()).map(|x| (x / scale).to_bits()));
    bits
}

/// Compares scale 1 with all others, on random rays and random frames.
fn check<B: Block<f64>>(what: &str, push: impl Fn(&mut B, &Transform, &mut Rng)) {
    let rng = &mut Rng(3);
    for round in 0..50 {
        let place = Transform::scale(DVec3::ONE + rng.cube() * 0.5)
            .then(&Transform::rotate(rng.cube() * 3.0))
            .then(&Transform::translate(rng.cube() * 5.0));
        let rays: [_; LANES] = std::array::from_fn(|_| {
            let from = rng.cube() * 10.0;
            (from, place.point(rng.cube()) - from)
        });
        let answer = |k: i32| {
            let scale = 2f64.powi(k);
            let mut block = B::default();
            push(&mut block, &place.then(&Transform::scale(DVec3::splat(scale))), &mut Rng(round));
            answers(&block, &packet(&rays.map(|(o, d)| (o * scale, d))), scale)
        };
        let one = answer(0);
        for k in -20..=20 {
            assert_eq!(answer(k), one, "{what} scaled by 2^{k}");
        }
    }
}

#[test]
fn powers_of_two_scale_the_bits() {
    let half = DVec3::new(1.0, 0.5, 0.25);
    let ends =
        |rng: &mut Rng| ((rng.cube() * 0.5, 0.2 + rng.unit()), (rng.cube() + DVec3::Z * 2.0, rng.unit()));
    // Spheres and axis-parallel boxes take their place without the turn.
    check::<Spheres<f64>>("sphere", |b, t, _| {
        b.push(t.forward.translation, t.forward.matrix3.x_axis.length());
    });
    check::<Boxes<f64>>("axis-parallel box", |b, t, _| {
        let size = half * t.forward.matrix3.x_axis.length();
        b.push(t.forward.translation - size, t.forward.translation + size);
    });
    check::<Ellipsoids<f64>>("ellipsoid", |b, t, _| b.push(t));
    check::<OrientedBoxes<f64>>("box", |b, t, _| b.push(t, -half, half * 0.7));
    check::<Planes<f64>>("plane", |b, t, rng| b.push(t, rng.direction(), rng.unit()));
    check::<Discs<f64>>("disc", |b, t, rng| b.push(t, rng.cube(), rng.direction(), 0.8, 0.3));
    check::<Cylinders<f64>>("cylinder", |b, t, rng| {
        let (base, cap) = ends(rng);
        b.push(t, base, cap);
    });
    check::<ClosedCones<f64>>("cone", |b, t, rng| {
        let (base, cap) = ends(rng);
        b.push(t, base, cap);
    });
    check::<OpenCones<f64>>("open cone", |b, t, rng| {
        let (base, cap) = ends(rng);
        b.push(t, base, cap);
    });
    check::<Tori<f64>>("torus", |b, t, rng| b.push(t, 0.3 + rng.unit(), 0.05 + 0.5 * rng.unit()));
    let corners = |t: &Transform, rng: &mut Rng| [0; 3].map(|_| t.point(rng.cube()));
    check::<Triangles<f64>>("triangle", |b, t, rng| b.push(corners(t, rng)));
    check::<SmoothTriangles<f64>>("smooth triangle", |b, t, rng| {
        b.push(corners(t, rng), [0; 3].map(|_| rng.direction()));
    });
    check::<Polygons<f64>>("polygon", |b, t, rng| {
        let outline = (0..7).map(|_| t.point(rng.cube().with_z(0.0))).collect();
        b.push(&[outline]);
    });
}
