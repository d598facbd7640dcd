//! Reading scenes, text to description: `parse/<scene>`.
//!
//! A million spheres by `#for` and `rand` (`draw`) and by `#while` (`loop`), a macro tree of 2^16 leaves (`tree`), a mesh2
//! of 500 000 triangles (`mesh2`), and every example of an installed POV-Ray (`corpus`). Includes are read from disk
//! every time, as in use. `benches/peers/parse.py` sets the same scenes against POV-Ray.

use criterion::{Criterion, criterion_group, criterion_main};
use octray::eval::{Options, from_text, load};
use std::fmt::Write as _;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// As in the program, whose allocator is part of what is measured.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const CORPUS: &str = "/usr/share/doc/povray/examples";
const INCLUDES: &str = "/usr/share/povray-3.7/include";

/// A wavy sheet of 2 (n - 1)^2 triangles with vertex normals.
fn mesh2(n: usize) -> String {
    let (mut points, mut normals, mut faces) = (String::new(), String::new(), String::new());
    let at = |i: usize| 2.0 * i as f64 / (n - 1) as f64 - 1.0;
    for j in 0..n {
        for i in 0..n {
            let (x, z) = (at(i), at(j));
            let (dx, dz) = ((5.0 * x).cos() * (4.0 * z).cos(), -0.8 * (5.0 * x).sin() * (4.0 * z).sin());
            let size = (1.0 + dx * dx + dz * dz).sqrt();
            let y = 0.2 * (5.0 * x).sin() * (4.0 * z).cos();
            let _ = writeln!(points, "  <{x:.6}, {y:.6}, {z:.6}>,");
            let _ = writeln!(normals, "  <{:.6}, {:.6}, {:.6}>,", -dx / size, 1.0 / size, -dz / size);
            if i < n - 1 && j < n - 1 {
                let a = j * n + i;
                let _ = writeln!(faces, "  <{a}, {}, {}>,", a + 1, a + n);
                let _ = writeln!(faces, "  <{}, {}, {}>,", a + 1, a + n + 1, a + n);
            }
        }
    }
    let (vertices, triangles) = (n * n, 2 * (n - 1) * (n - 1));
    format!(
        "mesh2 {{ vertex_vectors {{ {vertices},\n{points} }} normal_vectors {{ {vertices},\n{normals} }} \
         face_indices {{ {triangles},\n{faces} }} }}"
    )
}

/// The example scenes below a folder.
fn examples(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            examples(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "pov") {
            found.push(path);
        }
    }
}

fn parse(c: &mut Criterion) {
    let mut group = c.benchmark_group("parse");
    group.sample_size(10).measurement_time(Duration::from_secs(10));
    let scenes = [
        ("draw", include_str!("parse/draw.scn").to_string()),
        ("loop", include_str!("parse/loop.scn").to_string()),
        ("tree", include_str!("parse/tree.scn").to_string()),
        ("mesh2", mesh2(501)),
    ];
    for (name, text) in &scenes {
        group.bench_function(*name, |b| {
            b.iter_with_large_drop(|| {
                let done = from_text(name, black_box(text), &Options::default());
                assert!(!done.has_errors());
                done
            });
        });
    }
    let mut corpus = Vec::new();
    examples(Path::new(CORPUS), &mut corpus);
    if !corpus.is_empty() {
        let options =
            Options { library_paths: vec![INCLUDES.into()], allow_missing: true, ..Options::default() };
        group.bench_function("corpus", |b| {
            b.iter(|| corpus.iter().for_each(|path| drop(black_box(load(path, &options)))));
        });
    }
    group.finish();
}

criterion_group!(benches, parse);
criterion_main!(benches);
