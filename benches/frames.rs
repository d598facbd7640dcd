//! Whole frames of one thread, by scene and precision, `frame/<scene>-<precision>`; and frames that are mostly shading,
//! `shading/<lights>-<looks>`: a wall that fills the view under lamps that throw no shadow, so that each camera ray is one
//! plane test and each lamp one evaluation of the finish.
//!
//! Figures beside POV-Ray come from `benches/peers/frames.py`.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use octray::eval::{Options, from_text, load};
use octray::render::{Precision, RenderOptions, render};
use octray::scene::Scene;
use std::fmt::Write as _;
use std::path::Path;
use std::time::Duration;

/// As in the program, whose allocator is part of what is measured.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const WIDTH: usize = 160;
const HEIGHT: usize = 120;

/// Times the tracing alone, and counts rays.
fn trace(c: &mut Criterion, group: &str, name: &str, scene: &Scene) {
    let mut group = c.benchmark_group(group);
    for (precision, called) in [(Precision::Fast, "fast"), (Precision::Exact, "exact")] {
        let options =
            RenderOptions { width: WIDTH, height: HEIGHT, threads: 1, precision, ..RenderOptions::default() };
        let frame = || render(scene, &options, &|_| {}).expect("a thread, and a picture of some pixels").1;
        group.throughput(Throughput::Elements(frame().rays.total()));
        group.bench_function(BenchmarkId::from_parameter(format!("{name}-{called}")), |b| {
            b.iter_custom(|rounds| (0..rounds).map(|_| Duration::from_secs_f64(frame().trace_s)).sum());
        });
    }
    group.finish();
}

fn options() -> Options {
    Options { image_width: WIDTH, image_height: HEIGHT, ..Options::default() }
}

fn frames(c: &mut Criterion) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/show");
    for name in ["chess", "city", "clockwork", "drink", "knot", "rings", "spheres"] {
        let evaluation = load(&folder.join(name).with_extension("scn"), &options());
        assert!(!evaluation.has_errors(), "{name}: {:?}", evaluation.diagnostics);
        trace(c, "frame", name, &evaluation.scene);
    }
}

/// A wall before the camera; `look` is its texture.
fn wall(lights: usize, look: &str) -> Scene {
    let mut text = format!(
        "#version 3.7; global_settings {{ assumed_gamma 1 }} camera {{ location -3*z look_at 0 }}
         plane {{ -z, 0 {look} }}"
    );
    for k in 0..lights {
        let (y, x) = (k as f64 * 2.4).sin_cos();
        let _ = write!(text, " light_source {{ <{x}, {y}, -2>, rgb {} shadowless }}", 1.0 / lights as f64);
    }
    let evaluation = from_text("wall.scn", &text, &options());
    assert!(!evaluation.has_errors(), "{:?}", evaluation.diagnostics);
    evaluation.scene
}

fn shading(c: &mut Criterion) {
    let matt = "pigment { rgb 0.7 }";
    let rich =
        "pigment { checker rgb 0.2 rgb 0.9 } finish { specular 0.5 roughness 0.02 metallic brilliance 1.5 }";
    let noisy = "pigment { bozo turbulence 0.5 color_map { [0 rgb 0.2] [1 rgb 0.9] } }";
    for (lights, called, look) in
        [(1, "matt", matt), (16, "matt", matt), (16, "metallic", rich), (1, "turbulent", noisy)]
    {
        trace(c, "shading", &format!("{lights}-{called}"), &wall(lights, look));
    }
}

criterion_group!(benches, frames, shading);
criterion_main!(benches);
