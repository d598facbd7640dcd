//! Random scenes through octray and POV-Ray, and what can be found out about differences without a person.
//!
//! A random scene's lengths are multiples of `U`, so that POV-Ray can be asked again in another unit. Its tolerances are
//! absolute (1e-4, 1e-3 and more for some shapes), so a difference that comes from one of them goes away where a unit is
//! [`UNIT`] times as long; octray's picture does not depend on the unit.

use super::povray::PovRay;
use super::verdict::Verdict;
use super::{Args, Measured, Row, artefacts, as_povray_writes, measure};
use crate::cli::Failure;
use crate::cli::scene::load;
use octray::compare::{WITHIN, edge_mask};
use octray::film::Film;
use octray::image_io::replace_file;
use octray::render::{Engine, render};
use rayon::prelude::*;
use std::ops::Range;
use std::path::Path;

/// The other unit: a power of two, so that every coordinate keeps its digits; far from POV-Ray's end of the world, 1e7.
const UNIT: u32 = 1024;

/// Renders at a time. POV-Ray spends most of the start of such small pictures waiting.
const AT_A_TIME: usize = 6;

/// Renders the scenes `seeds`; the texts of those that differ stay in `folder`.
pub fn cross(seeds: Range<u64>, folder: &Path, args: &Args, povray: &PovRay) -> Result<Vec<Row>, Failure> {
    let threads = rayon::ThreadPoolBuilder::new().num_threads(AT_A_TIME).build();
    let threads = threads.map_err(|error| Failure::Machine(error.to_string()))?;
    threads.install(|| seeds.into_par_iter().map(|seed| cross_one(seed, folder, args, povray)).collect())
}

fn cross_one(seed: u64, folder: &Path, args: &Args, povray: &PovRay) -> Result<Row, Failure> {
    let path = folder.join(format!("random-{seed}.scn"));
    replace_file(&path, octray::random::scene(seed).as_bytes())?;
    let scene = format!("random-{seed}");
    let row = match measure(&path, args, povray) {
        Ok(measured) => {
            let mut verdict = Verdict::of(&measured.figures.comparison, artefacts::of_seed(seed));
            if let Verdict::Differs { .. } = verdict {
                verdict = look_into(&path, &measured, args, povray);
            }
            measured.row(scene, verdict, args)
        }
        Err(why) => Row { scene, failed: Some(why), figures: None, verdict: None, strip: Vec::new() },
    };
    if row.is_agreed() {
        // What is left behind is overwritten by the next run.
        let _ = std::fs::remove_file(&path);
    }
    Ok(row)
}

/// Asks POV-Ray in another unit, and the oracle.
fn look_into(path: &Path, measured: &Measured, args: &Args, povray: &PovRay) -> Verdict {
    let Measured { expected, actual, .. } = measured;
    let edges = edge_mask(expected);
    let mut open: Vec<usize> =
        (0..edges.len()).filter(|&i| !edges[i] && apart(expected, actual, i) > WITHIN).collect();
    let pixels = open.len();
    let mut in_unit = args.scene_args.clone();
    in_unit.declares.push(("U".into(), UNIT.to_string()));
    if let Ok(other) = povray.render(path, &in_unit, args.size()) {
        open.retain(|&i| apart(&other.film, actual, i) > WITHIN);
    }
    if open.is_empty() {
        let reason = format!(
            "its tolerances are absolute: with lengths {UNIT} times as long it agrees in all {pixels} pixels that differ"
        );
        return Verdict::PovRayWrong { reason };
    }
    let note = oracle(path, args).map(|oracle| {
        let with = |film| open.iter().filter(|&&i| apart(&oracle, film, i) <= WITHIN).count();
        format!(
            "{} of them in another unit too, where the oracle sides {} times with octray, {} times with POV-Ray",
            open.len(),
            with(actual),
            with(expected)
        )
    });
    Verdict::Differs { pixels, note }
}

fn oracle(path: &Path, args: &Args) -> Option<Film> {
    let (width, height) = args.size();
    let scene = load(path, &args.scene_args, (width, height), true).ok()?;
    let mut options = args.tracing.options(width, height);
    (options.engine, options.threads) = (Engine::Reference, 1);
    Some(as_povray_writes(render(&scene, &options, &|_| ()).ok()?.0))
}

fn apart(a: &Film, b: &Film, i: usize) -> f64 {
    let (a, b) = (a.pixels[i].rgb, b.pixels[i].rgb);
    a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max)
}
