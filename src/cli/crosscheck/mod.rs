//! `octray crosscheck`: the same scenes through octray and through POV-Ray, pictures and times side by side.
//!
//! Both trace with one thread and without anti-aliasing, and both pictures are linear light. Rounds are interleaved, so
//! that a busy moment of the machine does not hit one of the two only, and times are medians of tracing alone: what
//! either spends on reading, building and writing is left out.

mod povray;
mod report;

use super::Failure;
use super::compare::{gate, share};
use super::render::TracingArgs;
use super::scene::{SceneArgs, load};
use octray::compare::{AMPLIFY, Comparison, clipped, compare, strip};
use octray::film::Film;
use octray::image_io::{Encoding, encode};
use octray::render::render;
use povray::{PovRay, PovRun};
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scenes to render; a folder stands for all .scn and .pov files in it
    #[arg(value_name = "SCENE", required = true)]
    scenes: Vec<PathBuf>,
    /// Write into this folder: index.html with all strips in it, the strips as PNG files, and figures.json
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Pixels per row
    #[arg(short = 'W', long, value_name = "N", default_value_t = 320, value_parser = clap::value_parser!(u32).range(1..))]
    width: u32,
    /// Rows of pixels
    #[arg(short = 'H', long, value_name = "N", default_value_t = 240, value_parser = clap::value_parser!(u32).range(1..))]
    height: u32,
    /// Renders by each; times are the medians
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    rounds: u32,
    #[command(flatten)]
    tracing: TracingArgs,
    #[command(flatten)]
    scene_args: SceneArgs,
    /// POV-Ray's program
    #[arg(long, value_name = "PROGRAM", default_value = "povray")]
    povray: PathBuf,
    /// Fail (exit code 1) unless at least this share of each scene's pixels off edges agree within 2e-3
    #[arg(long, value_name = "SHARE", value_parser = share)]
    gate: Option<f64>,
}

/// What became of one scene.
#[derive(Debug, Serialize)]
struct Row {
    /// The scene's path as given.
    scene: String,
    /// Why there is nothing to compare, or why the gate is shut.
    failed: Option<String>,
    /// The rest, where both made a picture.
    figures: Option<Figures>,
    /// PNG: `expected | difference | actual`.
    #[serde(skip)]
    strip: Vec<u8>,
}

#[derive(Debug, Serialize)]
struct Figures {
    /// Median seconds of tracing.
    octray_s: f64,
    /// The same of POV-Ray, which counts in milliseconds.
    povray_s: f64,
    comparison: Comparison,
}

/// Below this a time counted in milliseconds is off by several per cent, and ratios are told with a `~`.
const ROUGH_BELOW_S: f64 = 0.05;

impl Figures {
    /// How many times as long POV-Ray takes, e.g. "12.3" or "~9".
    fn ratio(&self) -> String {
        let ratio = self.povray_s / self.octray_s;
        match self.povray_s {
            0.0 => "-".into(),
            rough if rough < ROUGH_BELOW_S => format!("~{ratio:.0}"),
            _ => format!("{ratio:.1}"),
        }
    }
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let scenes = scenes(&args.scenes)?;
    let povray = PovRay::find(&args.povray)?;
    if let Some(folder) = &args.report {
        let failed =
            |error| Failure::Machine(format!("cannot make the folder {}: {error}", folder.display()));
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    println!(
        "{} x {}, one thread each, medians of {} rounds; POV-Ray {}",
        args.width, args.height, args.rounds, povray.version
    );
    println!("{}", report::HEAD);
    let mut rows = Vec::new();
    for scene in &scenes {
        let row = cross(scene, args, &povray);
        println!("{}", report::line(&row));
        rows.push(row);
    }
    println!("{}", report::FOOT);
    if let Some(folder) = &args.report {
        report::write(folder, &rows, &povray.version, args)?;
    }
    match rows.iter().filter(|row| row.failed.is_some()).count() {
        0 => Ok(()),
        failed => Err(Failure::Differs(format!("{failed} of {} scenes failed", rows.len()))),
    }
}

/// Files as they are, folders opened (sorted, not their subfolders).
fn scenes(given: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut scenes = Vec::new();
    for path in given {
        if !path.is_dir() {
            scenes.push(path.clone());
            continue;
        }
        let failed = |error| Failure::Machine(format!("cannot read the folder {}: {error}", path.display()));
        let entries: Result<Vec<_>, _> = std::fs::read_dir(path).map_err(failed)?.collect();
        let mut found: Vec<_> = entries.map_err(failed)?.into_iter().map(|entry| entry.path()).collect();
        found.retain(|file| file.extension().is_some_and(|e| e == "scn" || e == "pov"));
        if found.is_empty() {
            return Err(Failure::Usage(format!("there is no .scn or .pov file in {}", path.display())));
        }
        found.sort();
        scenes.extend(found);
    }
    Ok(scenes)
}

fn cross(path: &Path, args: &Args, povray: &PovRay) -> Row {
    let scene = path.display().to_string();
    match measure(path, args, povray) {
        Ok((figures, strip)) => {
            let failed = match gate(args.gate, &figures.comparison) {
                Err(Failure::Differs(why)) => Some(why),
                _ => None,
            };
            Row { scene, failed, figures: Some(figures), strip }
        }
        Err(why) => Row { scene, failed: Some(why), figures: None, strip: Vec::new() },
    }
}

fn measure(path: &Path, args: &Args, povray: &PovRay) -> Result<(Figures, Vec<u8>), String> {
    let size = (args.width as usize, args.height as usize);
    let scene =
        load(path, &args.scene_args, size, true).map_err(|_| "octray cannot read the scene".to_owned())?;
    let mut options = args.tracing.options(size.0, size.1);
    options.threads = 1;

    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    let mut pictures: Option<(Film, Film)> = None;
    for _ in 0..args.rounds {
        let (actual, stats) =
            render(&scene, &options, &|_| ()).map_err(|error| format!("octray: {error}"))?;
        ours.push(stats.trace_s);
        let PovRun { film: expected, trace_s } = povray.render(path, &args.scene_args, size)?;
        theirs.push(trace_s);
        // Every round makes the same picture; the last is as good as any.
        pictures = Some((expected, actual));
    }
    let (expected, actual) = pictures.ok_or("no rounds")?;
    // POV-Ray's file has no alpha here and ends at 1.
    let mut actual = clipped(actual);
    actual.pixels.iter_mut().for_each(|pixel| pixel.transmit = 0.0);
    let comparison = compare(&expected, &actual)?;
    let strip = encode(&strip(&expected, &actual, AMPLIFY), &Encoding::default())
        .map_err(|error| error.to_string())?;
    Ok((Figures { octray_s: median(ours), povray_s: median(theirs), comparison }, strip))
}

/// The middle one, or the mean of the two in the middle.
fn median(mut times: Vec<f64>) -> f64 {
    times.sort_unstable_by(f64::total_cmp);
    let (low, high) = (times.len().saturating_sub(1) / 2, times.len() / 2);
    times.get(low).zip(times.get(high)).map_or(0.0, |(a, b)| (a + b) / 2.0)
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn medians() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!((median(vec![7.0]), median(vec![])), (7.0, 0.0));
    }
}
