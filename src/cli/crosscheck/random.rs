//! Random scenes through octray and POV-Ray, and what can be found out about differences without a person.
//!
//! A random scene can be asked for in other words that mean the same (see [`octray::random`]). Where POV-Ray's picture
//! depends on the words it contradicts itself, and a pixel on which it then agrees with octray is explained.

use super::verdict::Verdict;
use super::{Args, Measured, Row, measure};
use crate::cli::Failure;
use crate::cli::povray::{PovRay, as_povray_writes};
use crate::cli::scene::load;
use octray::compare::{WITHIN, apart, edge_mask};
use octray::file_io::replace_file;
use octray::film::Film;
use octray::render::{Engine, render};
use rayon::prelude::*;
use std::ops::RangeInclusive;
use std::path::Path;

/// The same scene in other words.
struct Wording {
    /// What is declared: names and values.
    declare: &'static [(&'static str, &'static str)],
    /// Why POV-Ray's picture may change.
    reason: &'static str,
}

/// Artefacts of POV-Ray, each with the words in which it does not show.
const WORDINGS: [Wording; 5] = [
    // Units of a quarter suffice for surfaces of size 1, of a sixteenth for smaller ones too.
    Wording {
        declare: &[("P", "16")],
        reason: "a ray that starts on a polynomial surface loses its far side, as the root finder's tolerances are \
                 absolute: agrees with the same polynomials in units of a sixteenth",
    },
    Wording {
        declare: &[("P", "16"), ("STURM", "1")],
        reason: "a quartic whose highest coefficient along the ray is small has false roots: agrees with `sturm`",
    },
    // A power of two, so that every coordinate keeps its digits; far from POV-Ray's end of the world, 1e7.
    Wording {
        declare: &[("U", "1024")],
        reason: "its tolerances are absolute: agrees with lengths 1024 times as long",
    },
    // More than the 1e-10 under which POV-Ray takes a colour for opaque.
    Wording {
        declare: &[("T", "1e-9")],
        reason: "what blocked the last shadow ray is tried first, and light that it lets through this time is filtered \
                 twice: agrees with colours a billionth clear, of which none is tried first",
    },
    Wording {
        declare: &[("MESHED", "1")],
        reason: "each transform may turn the front of a triangle by itself: agrees with a mesh of that one triangle",
    },
];

/// Steps of the eye, in units of length, after which only a pixel that hangs on last digits is another: all else moves by
/// some 1e-7 of a unit, and light by some 1e-6.
const STEPS: [&str; 4] = ["1e-9", "-1e-9", "1e-7", "-1e-7"];

/// Renders at a time. POV-Ray spends most of the start of such small pictures waiting.
const AT_A_TIME: usize = 6;

/// Renders the scenes `seeds`; the texts of those that differ stay in `folder`.
pub fn cross(
    seeds: RangeInclusive<u64>,
    folder: &Path,
    args: &Args,
    povray: &PovRay,
) -> Result<Vec<Row>, Failure> {
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
            let mut verdict = Verdict::of(&measured.figures.comparison, None);
            let open = open_pixels(&measured);
            if !open.is_empty() {
                verdict = look_into(&path, open, &measured, args, povray);
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

/// Pixels that differ and are not on an edge of both pictures. An edge of POV-Ray's alone excuses nothing: a picture
/// speckled by mistake has edges everywhere.
fn open_pixels(Measured { expected, actual, .. }: &Measured) -> Vec<usize> {
    let (theirs, ours) = (edge_mask(expected), edge_mask(actual));
    (0..theirs.len()).filter(|&i| !(theirs[i] && ours[i]) && apart_at(expected, actual, i) > WITHIN).collect()
}

/// Asks POV-Ray in other words, then from beside the eye, then the oracle, about the pixels `open`.
fn look_into(
    path: &Path,
    mut open: Vec<usize>,
    measured: &Measured,
    args: &Args,
    povray: &PovRay,
) -> Verdict {
    let Measured { expected, actual, .. } = measured;
    let pixels = open.len();
    // Takes what is explained off the list and says how much.
    let explain = |declare: &[(&str, &str)], open: &mut Vec<usize>| {
        let before = open.len();
        if before > 0 {
            let mut other = args.scene_args.clone();
            other.declares.extend(declare.iter().map(|&(name, value)| (name.into(), value.into())));
            if let Ok(other) = povray.render(path, &other, args.size()) {
                open.retain(|&i| apart_at(&other.film, actual, i) > WITHIN);
            }
        }
        before - open.len()
    };
    let mut reasons = Vec::new();
    for wording in &WORDINGS {
        match explain(wording.declare, &mut open) {
            0 => {}
            explained => reasons.push(format!("{} ({explained} pixels)", wording.reason)),
        }
    }
    let hanging: usize = STEPS.iter().map(|step| explain(&[("EYE", step)], &mut open)).sum();
    if open.is_empty() && reasons.is_empty() {
        return Verdict::LastDigits { pixels };
    }
    if hanging > 0 {
        reasons.push(format!("{hanging} pixels hang on last digits"));
    }
    if open.is_empty() {
        return Verdict::PovRayWrong { reason: reasons.join("; ") };
    }
    let note = oracle(path, args).map(|oracle| {
        let with = |film| open.iter().filter(|&&i| apart_at(&oracle, film, i) <= WITHIN).count();
        format!(
            "{} of them in other words too, where the oracle sides {} times with octray, {} times with POV-Ray",
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

/// Of a pixel's colours.
fn apart_at(a: &Film, b: &Film, i: usize) -> f64 {
    let (a, b) = (a.pixels[i].rgb, b.pixels[i].rgb);
    a.into_iter().zip(b).map(|(a, b)| apart(a, b)).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    /// A box of order 6 whose far side POV-Ray loses in speckles.
    const SPECKLED: u64 = 173;

    #[test]
    fn speckles_are_explained_and_our_own_mistakes_are_not() {
        let line = Line::parse_from(["crosscheck", "--random", "1", "--report", ".", "-W", "40", "-H", "30"]);
        let Ok(povray) = PovRay::find(&line.args.povray) else {
            eprintln!("skipped: there is no POV-Ray to ask");
            return;
        };
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("scene.scn");
        std::fs::write(&path, octray::random::scene(SPECKLED)).expect("written");
        let mut measured = measure(&path, &line.args, &povray).expect("both render it");

        let open = open_pixels(&measured);
        assert!(open.len() > 20, "{} speckles", open.len());
        let verdict = look_into(&path, open, &measured, &line.args, &povray);
        assert!(matches!(verdict, Verdict::PovRayWrong { .. }), "{verdict}");

        // A speckle of our own, where both agree.
        let (expected, actual) = (measured.expected.clone(), &mut measured.actual);
        let agreed = (0..actual.pixels.len()).find(|&i| apart_at(&expected, actual, i) <= WITHIN);
        actual.pixels[agreed.expect("most pixels agree")].rgb[0] += 0.01;
        let verdict = look_into(&path, open_pixels(&measured), &measured, &line.args, &povray);
        assert!(matches!(verdict, Verdict::Differs { .. }), "{verdict}");
    }
}
