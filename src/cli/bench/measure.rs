//! One scene through every mode: times, pictures, camera hits, and their errors.

use super::Args;
use super::kinds::{self, Walk};
use crate::cli::Failure;
use crate::cli::number::median;
use crate::cli::povray::{PovRay, as_povray_writes};
use crate::cli::scene::load;
use crate::cli::stats::{MeanLanes, QueueLanes};
use octray::bvh::Preset;
use octray::compare::{AMPLIFY, Comparison, compare, strip};
use octray::film::Film;
use octray::image_io::{Encoding, encode};
use octray::render::{Engine, Precision, RayCounts, RenderOptions, Schedule, Traversal, render};
use octray::scene::Scene;
use octray::workbench::Workbench;
use serde::Serialize;
use std::path::Path;

/// What was found of one scene.
#[derive(Debug, Serialize)]
pub struct Measured {
    /// The file's stem.
    pub scene: String,
    /// Fast, exact, strict, `exact` ray by ray; the oracle and POV-Ray where there are.
    pub modes: Vec<Mode>,
    /// Kinds of rays by themselves.
    pub walks: Vec<Walk>,
    /// Rays of `exact`, by kind.
    pub rays: RayCounts,
    /// PNG: strict, difference, fast.
    #[serde(skip)]
    pub strip: Vec<u8>,
    /// PNG: POV-Ray, difference, exact.
    #[serde(skip)]
    pub povray_strip: Option<Vec<u8>>,
}

/// One way of rendering the scene.
#[derive(Debug, Serialize)]
pub struct Mode {
    pub name: &'static str,
    /// Median seconds of tracing.
    pub trace_s: f64,
    /// All rays over that time; of POV-Ray the rays that `exact` traced for the same picture. `None` of a time too short for
    /// its clock, which in POV-Ray's case counts in milliseconds.
    pub mrays_per_s: Option<f64>,
    /// Its picture against strict's; of POV-Ray both end at 1.
    pub against_strict: Comparison,
    pub against_povray: Option<Comparison>,
    /// What its camera rays hit, against strict's.
    pub hits: Option<HitErrors>,
    /// Mean lanes at work in tests, from a render that is not timed; the oracle and POV-Ray have none.
    pub occupancy: Option<MeanLanes>,
    /// Mean lanes of the queues' packets; absent where there are none.
    pub queues: Option<QueueLanes>,
}

/// Camera hits of one mode against those of `strict`.
#[derive(Debug, Clone, Serialize)]
pub struct HitErrors {
    /// Rays that hit in both.
    pub hits: usize,
    /// Relative error of the distance.
    pub t: Quantiles,
    /// Error of the point, as a share of the distance.
    pub point: Quantiles,
    /// Strict hits, this does not.
    pub misses: usize,
    /// This hits, strict does not.
    pub false_hits: usize,
}

#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Quantiles {
    pub median: f64,
    pub p999: f64,
    pub max: f64,
}

impl Quantiles {
    fn of(mut all: Vec<f64>) -> Self {
        all.sort_unstable_by(f64::total_cmp);
        let at = |per_mille: usize| {
            (all.len() * per_mille).div_ceil(1000).checked_sub(1).map_or(0.0, |rank| all[rank])
        };
        Self { median: at(500), p999: at(999), max: at(1000) }
    }
}

/// What is timed in rounds: the precisions, and `exact` with every ray walking the tree by itself.
const WAYS: [(&str, Precision, Traversal); 4] = [
    ("fast", Precision::Fast, Traversal::Auto),
    ("exact", Precision::Exact, Traversal::Auto),
    ("strict", Precision::Strict, Traversal::Auto),
    ("single", Precision::Exact, Traversal::Single),
];

pub fn measure(path: &Path, args: &Args, povray: Option<&PovRay>) -> Result<Measured, Failure> {
    let size = (args.width as usize, args.height as usize);
    let scene = load(path, &args.scene_args, size, true)?;
    let machine = |error: &dyn std::fmt::Display| Failure::Machine(format!("{}: {error}", path.display()));
    let options = |precision, traversal| RenderOptions {
        width: size.0,
        height: size.1,
        threads: args.threads,
        precision,
        engine: Engine::Packets,
        schedule: Schedule { traversal, ..Schedule::default() },
        ..RenderOptions::default()
    };

    let mut times = [const { Vec::new() }; 4];
    let mut films: [Option<(Film, RayCounts)>; 4] = [None, None, None, None];
    let (mut povray_times, mut povray_film) = (Vec::new(), None);
    for _ in 0..args.rounds {
        for (k, (_, precision, traversal)) in WAYS.into_iter().enumerate() {
            let (film, stats) =
                render(&scene, &options(precision, traversal), &|_| ()).map_err(|e| machine(&e))?;
            times[k].push(stats.trace_s);
            films[k] = Some((film, stats.rays));
        }
        if let Some(povray) = povray {
            // What POV-Ray cannot render is measured without it.
            if let Ok(run) = povray.render(path, &args.scene_args, size) {
                povray_times.push(run.trace_s);
                povray_film = Some(run.film);
            }
        }
    }
    let oracle = oracle(&scene, args).map_err(|e| machine(&e))?;

    let [fast, exact, strict, single] = films.map(|film| film.expect("there is at least one round"));
    let rays = exact.1;
    let hits = camera_hits(&scene, args).map_err(|e| machine(&e))?;
    let mut modes = Vec::new();
    let mut add = |name, trace_s: f64, film: &Film, counts: &RayCounts, hits| -> Result<(), String> {
        modes.push(Mode {
            name,
            trace_s,
            mrays_per_s: mrays_per_s(counts, trace_s),
            against_strict: compare(&strict.0, film)?,
            against_povray: povray_film
                .as_ref()
                .map(|theirs| compare(theirs, &as_povray_writes(film.clone())))
                .transpose()?,
            hits,
            occupancy: None,
            queues: None,
        });
        Ok(())
    };
    let [fast_hits, exact_hits] = hits;
    let told = |error: String| machine(&error);
    let [fast_s, exact_s, strict_s, single_s] = times.map(median);
    add("fast", fast_s, &fast.0, &fast.1, Some(fast_hits)).map_err(told)?;
    add("exact", exact_s, &exact.0, &exact.1, Some(exact_hits)).map_err(told)?;
    add("strict", strict_s, &strict.0, &strict.1, None).map_err(told)?;
    add("single", single_s, &single.0, &single.1, None).map_err(told)?;
    if let Some((film, counts, trace_s)) = &oracle {
        add("oracle", *trace_s, film, counts, None).map_err(told)?;
    }
    if let Some(theirs) = &povray_film {
        let trace_s = median(povray_times);
        modes.push(Mode {
            name: "POV-Ray",
            trace_s,
            mrays_per_s: mrays_per_s(&rays, trace_s),
            against_strict: compare(&as_povray_writes(strict.0.clone()), theirs).map_err(told)?,
            against_povray: None,
            hits: None,
            occupancy: None,
            queues: None,
        });
    }
    // The modes begin with these. Counting lanes takes time, so that each is rendered once more.
    for (mode, (_, precision, traversal)) in modes.iter_mut().zip(WAYS) {
        let counting = RenderOptions { occupancy: true, ..options(precision, traversal) };
        let (_, stats) = render(&scene, &counting, &|_| ()).map_err(|e| machine(&e))?;
        mode.occupancy = stats.occupancy.map(MeanLanes::from);
        mode.queues = QueueLanes::of(&stats.rays);
    }
    let png = |expected: &Film, actual: &Film| {
        encode(&strip(expected, actual, AMPLIFY), &Encoding::default()).map_err(|error| machine(&error))
    };
    let povray_strip =
        povray_film.as_ref().map(|theirs| png(theirs, &as_povray_writes(exact.0.clone()))).transpose()?;
    let strip = png(&strict.0, &fast.0)?;
    let walks = kinds::measure(&scene, args).map_err(|e| machine(&e))?;
    let scene = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Measured { scene, modes, walks, rays, strip, povray_strip })
}

fn mrays_per_s(rays: &RayCounts, seconds: f64) -> Option<f64> {
    (seconds > 0.0).then(|| rays.total() as f64 / seconds * 1e-6)
}

/// The oracle's picture, rays and seconds, unless a sixteenth of the picture foretells that it takes too long.
fn oracle(scene: &Scene, args: &Args) -> Result<Option<(Film, RayCounts, f64)>, octray::render::RenderError> {
    let (width, height) = (args.width as usize, args.height as usize);
    let options = |share: usize| RenderOptions {
        width: (width / share).max(1),
        height: (height / share).max(1),
        threads: args.threads,
        engine: Engine::Reference,
        ..RenderOptions::default()
    };
    let (few, all) = (options(8), options(1));
    let (_, stats) = render(scene, &few, &|_| ())?;
    let foretold = stats.trace_s * (width * height) as f64 / (few.width * few.height) as f64;
    if foretold > args.oracle_limit {
        return Ok(None);
    }
    let (film, stats) = render(scene, &all, &|_| ())?;
    Ok(Some((film, stats.rays, stats.trace_s)))
}

/// What camera rays hit in `fast` and `exact`, against `strict`.
fn camera_hits(scene: &Scene, args: &Args) -> Result<[HitErrors; 2], rayon::ThreadPoolBuildError> {
    let hits = |precision| {
        Workbench::new(scene, precision, Preset::default(), args.threads)
            .map(|bench| bench.camera_hits(&scene.camera, args.width as usize, args.height as usize))
    };
    let strict = hits(Precision::Strict)?;
    let against = |ours: Vec<Option<_>>| {
        let (mut t, mut point, mut misses, mut false_hits) = (Vec::new(), Vec::new(), 0, 0);
        for (ours, strict) in ours.iter().zip(&strict) {
            let (ours, strict): (&Option<octray::workbench::FirstHit>, _) = (ours, strict);
            match (ours, strict) {
                (Some(a), Some(b)) => {
                    t.push((a.t - b.t).abs() / b.t);
                    point.push(a.point.distance(b.point) / b.t);
                }
                (None, Some(_)) => misses += 1,
                (Some(_), None) => false_hits += 1,
                (None, None) => {}
            }
        }
        HitErrors { hits: t.len(), t: Quantiles::of(t), point: Quantiles::of(point), misses, false_hits }
    };
    Ok([against(hits(Precision::Fast)?), against(hits(Precision::Exact)?)])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// POV-Ray's time of a small picture is 0 ms: that was told as 827000.00 Mrays/s.
    #[test]
    fn no_time_has_no_speed() {
        let rays = RayCounts { camera: 3_000_000, ..RayCounts::default() };
        assert_eq!((mrays_per_s(&rays, 2.0), mrays_per_s(&rays, 0.0)), (Some(1.5), None));
    }

    #[test]
    fn quantiles_of_known_lists() {
        let thousand = Quantiles::of((1..=1000).rev().map(f64::from).collect());
        assert_eq!((thousand.median, thousand.p999, thousand.max), (500.0, 999.0, 1000.0));
        assert_eq!(Quantiles::of(vec![]).max, 0.0);
    }
}
