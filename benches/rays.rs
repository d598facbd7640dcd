//! Rays through the tree, by set and precision, and the tree itself: `rays/<geometry>/<set>-<precision>`,
//! `build/<geometry>/<preset>`.
//!
//! Small geometry, so that a run takes a minute; figures beside Embree come from `benches/peers`.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use octray::bvh::{Preset, Traversal};
use octray::ray_set::RaySet;
use octray::render::Precision;
use octray::scene::{Camera, Mesh, MeshTriangle, Object, Projection, Scene, Shape};
use octray::workbench::{CameraRays, Workbench};
use std::sync::Arc;

/// 20,000 triangles in waves.
fn sheet() -> Scene {
    let n = 100u32;
    let mut mesh = Mesh::default();
    for k in 0..(n + 1) * (n + 1) {
        let at = |i: u32| 4.0 * f64::from(i) / f64::from(n) - 2.0;
        let (x, z) = (at(k % (n + 1)), at(k / (n + 1)));
        mesh.vertices.push(DVec3::new(x, 0.3 * (5.0 * x).sin() * (4.0 * z).cos(), z));
    }
    for k in 0..n * n {
        let a = k / n * (n + 1) + k % n;
        let (b, c, d) = (a + 1, a + n + 1, a + n + 2);
        let triangle = |vertices| MeshTriangle { vertices, normals: None, textures: None };
        mesh.triangles.extend([[a, b, c], [b, d, c]].map(triangle));
    }
    Scene { objects: vec![Arc::new(Object::new(Shape::Mesh(Arc::new(mesh))))], ..Scene::default() }
}

/// 8000 spheres in a lattice, no two alike.
fn spheres() -> Scene {
    let ball = |k: u32| {
        let at = |i: u32| f64::from(i % 20) / 10.0 - 1.0;
        let center = DVec3::new(at(k), at(k / 20), at(k / 400));
        let radius = 0.02 + 0.02 * (f64::from(k) * 0.7).sin().abs();
        Arc::new(Object::new(Shape::Sphere { center, radius }))
    };
    Scene { objects: (0..8000).map(ball).collect(), ..Scene::default() }
}

fn sets(bench: &Workbench) -> [(&'static str, RaySet); 4] {
    let camera = Camera {
        projection: Projection::Perspective,
        location: DVec3::new(0.3, 2.0, -3.2),
        direction: DVec3::new(-0.08, -0.55, 1.0),
        right: DVec3::X * 0.8,
        up: DVec3::Y * 0.8,
        ..Camera::default()
    };
    let made = CameraRays::new(bench, &camera, 256);
    [
        ("shadow", made.shadow(DVec3::new(3.0, 4.0, -2.0))),
        ("mirror", made.mirror()),
        ("diffuse", made.diffuse()),
        ("camera", made.camera),
    ]
}

fn rays(c: &mut Criterion) {
    for (name, scene) in [("triangles", sheet()), ("spheres", spheres())] {
        let mut group = c.benchmark_group(format!("rays/{name}"));
        for (precision, called) in [(Precision::Fast, "fast"), (Precision::Exact, "exact")] {
            let bench = Workbench::new(&scene, precision, Preset::default(), 1).expect("a thread");
            for (set, rays) in sets(&bench) {
                group.throughput(Throughput::Elements(rays.len() as u64));
                group.bench_function(BenchmarkId::from_parameter(format!("{set}-{called}")), |b| {
                    // The workbench times the tracing alone.
                    b.iter_custom(|rounds| {
                        let measured = bench.measure(&rays, Traversal::Auto, rounds as usize);
                        measured.wall_s.iter().map(|&s| std::time::Duration::from_secs_f64(s)).sum()
                    });
                });
            }
        }
        group.finish();
    }
}

fn build(c: &mut Criterion) {
    for (name, scene) in [("triangles", sheet()), ("spheres", spheres())] {
        let mut group = c.benchmark_group(format!("build/{name}"));
        group.sample_size(20);
        for (preset, called) in
            [(Preset::Fast, "fast"), (Preset::Balanced, "balanced"), (Preset::Best, "best")]
        {
            group.bench_function(BenchmarkId::from_parameter(called), |b| {
                b.iter(|| Workbench::new(&scene, Precision::Fast, preset, 1).expect("a thread").sah);
            });
        }
        group.finish();
    }
}

criterion_group!(benches, rays, build);
criterion_main!(benches);
