//! Nanoseconds for eight rays against one primitive, by shape and precision: `kernel/<shape>/<precision>`; and for as many noises
//! at eight points, `noise/<how many>/<apart or in one cell>`.
//!
//! Half of the rays are aimed at points in the shape's box, so most of them hit; `miss` are packets that pass by. Rays and
//! columns stay in the first-level cache: this is the kernel alone.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use octray::kernel::*;
use octray::lane::{LANES, Lane, Scalar, Vec3, f64x8};
use octray::scene::Transform;
use octray::scene::number::Number;
use std::hint::black_box;

/// Packets per pass.
const PACKETS: usize = 64;

/// Numbers from -1 to 1 without order.
fn numbers() -> impl FnMut() -> f64 {
    let mut seed = 1u64;
    move || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    }
}

/// Rays from 5 units away to random points around the origin, or past them by `off`.
fn packets<S: Scalar>(off: f64) -> Vec<Rays<S::Lane>> {
    let mut unit = numbers();
    let mut packet = || {
        let rays: [(DVec3, DVec3); LANES] = std::array::from_fn(|_| {
            let from = DVec3::new(unit(), unit(), unit()).normalize_or(DVec3::X) * 5.0;
            let aim = DVec3::new(unit(), unit(), unit()) * 0.7 + from.any_orthonormal_vector() * off;
            (from, (aim - from).normalize())
        });
        Rays { origin: Vec3::from_fn(|k| rays[k].0), dir: Vec3::from_fn(|k| rays[k].1) }
    };
    (0..PACKETS).map(|_| packet()).collect()
}

/// One block with one row.
fn shape<S: Scalar, B: Block<S>>(c: &mut Criterion, name: &str, precision: &str, push: impl Fn(&mut B)) {
    let mut block = B::default();
    push(&mut block);
    let mut group = c.benchmark_group(format!("kernel/{name}"));
    group.throughput(Throughput::Elements(PACKETS as u64));
    for (which, off) in [("", 0.0), ("-miss", 3.0)] {
        let rays = packets::<S>(off);
        group.bench_function(BenchmarkId::from_parameter(format!("{precision}{which}")), |b| {
            b.iter(|| {
                for packet in &rays {
                    black_box(block.roots(0, black_box(packet), None));
                }
            });
        });
    }
}

fn shapes<S: Scalar>(c: &mut Criterion, precision: &str) {
    let place = Transform::rotate(DVec3::new(0.3, -0.7, 1.1)).then(&Transform::translate(DVec3::splat(0.1)));
    let half = DVec3::new(1.0, 0.6, 0.8);
    let corners = [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, -1.0, 0.1), DVec3::new(0.0, 1.0, 0.2)];
    let (base, cap, tip) = ((DVec3::NEG_Y, 0.8), (DVec3::Y, 0.8), (DVec3::Y, 0.2));
    shape::<S, Spheres<S>>(c, "sphere", precision, |b| b.push(DVec3::splat(0.1), 1.0));
    shape::<S, Ellipsoids<S>>(c, "ellipsoid", precision, |b| b.push(&place));
    shape::<S, Planes<S>>(c, "plane", precision, |b| b.push(&place, DVec3::Y, 0.1));
    shape::<S, Boxes<S>>(c, "box", precision, |b| b.push(-half, half));
    shape::<S, OrientedBoxes<S>>(c, "oriented-box", precision, |b| b.push(&place, -half, half));
    shape::<S, Cylinders<S>>(c, "cylinder", precision, |b| b.push(&place, base, cap));
    shape::<S, OpenCylinders<S>>(c, "open-cylinder", precision, |b| b.push(&place, base, cap));
    shape::<S, ClosedCones<S>>(c, "cone", precision, |b| b.push(&place, base, tip));
    shape::<S, OpenCones<S>>(c, "open-cone", precision, |b| b.push(&place, base, tip));
    shape::<S, Discs<S>>(c, "disc", precision, |b| b.push(&place, DVec3::ZERO, DVec3::Y, 1.0, 0.2));
    shape::<S, Tori<S>>(c, "torus", precision, |b| b.push(&place, 0.8, 0.25));
    shape::<S, Triangles<S>>(c, "triangle", precision, |b| b.push(corners));
    shape::<S, Polygons<S>>(c, "polygon-12", precision, |b| {
        let angle = |k: i32| f64::from(k) * std::f64::consts::TAU / 12.0;
        b.push(&[(0..12).map(|k| place.point(DVec3::new(angle(k).cos(), angle(k).sin(), 0.0))).collect()]);
    });
}

fn kernels(c: &mut Criterion) {
    shapes::<f64>(c, "f64");
    shapes::<f32>(c, "f32");
}

/// `N` noises at points about random places in cells: all in one, or in up to eight.
fn noises<const N: usize>(c: &mut Criterion) {
    let mut group = c.benchmark_group(format!("noise/{N}"));
    group.throughput(Throughput::Elements(PACKETS as u64));
    for (which, reach) in [("in one cell", 0.4), ("apart", 3.0)] {
        let mut unit = numbers();
        let mut middle = || [(); 3].map(|()| (unit() * 100.0).floor() + 0.5);
        let middles: Vec<[f64; 3]> = (0..PACKETS).map(|_| middle()).collect();
        let mut about = |middle: f64| f64x8::from_fn(|_| middle + unit() * reach);
        let points: Vec<[f64x8; 3]> = middles.into_iter().map(|middle| middle.map(&mut about)).collect();
        group.bench_function(BenchmarkId::from_parameter(which), |b| {
            b.iter(|| {
                for &point in &points {
                    black_box(<f64x8 as Number>::lattice::<N>(black_box(point)));
                }
            });
        });
    }
}

fn noise(c: &mut Criterion) {
    noises::<1>(c);
    noises::<2>(c);
    noises::<3>(c);
}

criterion_group!(benches, kernels, noise);
criterion_main!(benches);
