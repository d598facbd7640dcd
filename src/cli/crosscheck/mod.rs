//! `octray crosscheck`: the same scenes through octray and through POV-Ray, pictures and times side by side.
//!
//! Both trace with one thread and without anti-aliasing, and both pictures are linear light. Rounds are interleaved, so
//! that a busy moment of the machine does not hit one of the two only, and times are medians of tracing alone: what
//! either spends on reading, building and writing is left out.
//!
//! Each scene gets a verdict. Where POV-Ray's own picture comes from one of its artefacts, the verdict names it: from the
//! list in `artefacts.json`, or because POV-Ray contradicts itself when asked in other words that mean the same (see [`random`]).

mod artefacts;
mod random;
mod report;
mod verdict;

use super::Failure;
use super::compare::gate;
use super::number::{median, share};
use super::paths::{make_folder, scenes};
use super::povray::{PovRay, PovRun, as_povray_writes};
use super::render::TracingArgs;
use super::scene::{SceneArgs, load};
use super::streams::line_to_stdout;
use octray::compare::{AMPLIFY, Comparison, compare, strip};
use octray::film::Film;
use octray::image_io::{Encoding, encode};
use octray::render::render;
use serde::Serialize;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use verdict::Verdict;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scenes to render; a folder stands for all .scn and .pov files in it
    #[arg(value_name = "SCENE", required_unless_present = "random")]
    scenes: Vec<PathBuf>,
    /// Render N random scenes of every shape and finish instead, once each; those that differ are kept in the report's
    /// folder
    #[arg(long, value_name = "N", requires = "report", conflicts_with = "scenes", value_parser = clap::value_parser!(u64).range(1..))]
    random: Option<u64>,
    /// The first of the random scenes
    #[arg(long, value_name = "S", default_value_t = 0, requires = "random")]
    seed: u64,
    /// Write into this folder: index.html with all strips in it, the strips as PNG files, and figures.json
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Pixels per row: 320, of random scenes 80
    #[arg(short = 'W', long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    width: Option<u32>,
    /// Rows of pixels: 240, of random scenes 60
    #[arg(short = 'H', long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    height: Option<u32>,
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
    verdict: Option<Verdict>,
    /// PNG: `expected | difference | actual`.
    #[serde(skip)]
    strip: Vec<u8>,
}

#[derive(Debug, Clone, Serialize)]
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

impl Args {
    /// Width and height.
    fn size(&self) -> (usize, usize) {
        let usual = if self.random.is_some() { (80, 60) } else { (320, 240) };
        (self.width.unwrap_or(usual.0) as usize, self.height.unwrap_or(usual.1) as usize)
    }

    /// The random scenes, which end with the largest number there is.
    fn seeds(&self, count: u64) -> RangeInclusive<u64> {
        self.seed..=self.seed.saturating_add(count.saturating_sub(1))
    }
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let povray = PovRay::find(&args.povray)?;
    let scenes = scenes(&args.scenes)?;
    if let Some(folder) = &args.report {
        make_folder(folder)?;
    }
    line_to_stdout(format_args!("{}; POV-Ray {}", args.terms(), povray.version))?;
    line_to_stdout(report::HEAD)?;
    let mut rows = Vec::new();
    if let (Some(count), Some(folder)) = (args.random, &args.report) {
        rows = random::cross(args.seeds(count), folder, args, &povray)?;
        let mut told = rows.iter().filter(|row| !row.is_agreed());
        told.try_for_each(|row| line_to_stdout(report::line(row)))?;
    }
    for scene in &scenes {
        let row = cross(scene, args, &povray);
        line_to_stdout(report::line(&row))?;
        rows.push(row);
    }
    line_to_stdout(report::FOOT)?;
    line_to_stdout(verdict::counts(&rows))?;
    if let Some(folder) = &args.report {
        rows.sort_by(|a, b| b.error().total_cmp(&a.error()));
        report::write(folder, &rows, &povray.version, args)?;
    }
    match rows.iter().filter(|row| row.failed.is_some()).count() {
        0 => Ok(()),
        failed => Err(Failure::Differs(format!("{failed} of {} scenes failed", rows.len()))),
    }
}

impl Args {
    /// How it was measured, as text.
    fn terms(&self) -> String {
        let (width, height) = self.size();
        match self.random {
            None => {
                format!("{width} x {height}, one thread each, medians of {} interleaved rounds", self.rounds)
            }
            Some(count) => {
                let seeds = self.seeds(count);
                format!("random scenes {} to {}, {width} x {height}", seeds.start(), seeds.end())
            }
        }
    }
}

impl Row {
    /// Nothing to tell.
    fn is_agreed(&self) -> bool {
        matches!(self.verdict, Some(Verdict::Agrees | Verdict::Silhouettes))
    }

    /// What the page is sorted by: failures first, then by the largest difference off edges.
    fn error(&self) -> f64 {
        self.figures.as_ref().map_or(f64::INFINITY, |figures| figures.comparison.off_edges.max)
    }
}

fn cross(path: &Path, args: &Args, povray: &PovRay) -> Row {
    let scene = path.display().to_string();
    match measure(path, args, povray) {
        Ok(measured) => {
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let verdict = Verdict::of(&measured.figures.comparison, artefacts::of_scene(&name));
            measured.row(scene, verdict, args)
        }
        Err(why) => Row { scene, failed: Some(why), figures: None, verdict: None, strip: Vec::new() },
    }
}

/// Both pictures and what they cost.
struct Measured {
    figures: Figures,
    expected: Film,
    actual: Film,
}

impl Measured {
    fn row(&self, scene: String, verdict: Verdict, args: &Args) -> Row {
        let strip = strip(&self.expected, &self.actual, AMPLIFY);
        let (strip, unwritten) = match encode(&strip, &Encoding::default()) {
            Ok(strip) => (strip, None),
            Err(error) => (Vec::new(), Some(error.to_string())),
        };
        let failed = match gate(args.gate, &self.figures.comparison) {
            Err(Failure::Differs(why)) => Some(why),
            _ => unwritten,
        };
        Row { scene, failed, figures: Some(self.figures.clone()), verdict: Some(verdict), strip }
    }
}

fn measure(path: &Path, args: &Args, povray: &PovRay) -> Result<Measured, String> {
    let size = args.size();
    let scene =
        load(path, &args.scene_args, size, true).map_err(|_| "octray cannot read the scene".to_owned())?;
    let mut options = args.tracing.options(size.0, size.1);
    options.threads = 1;

    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    let mut pictures: Option<(Film, Film)> = None;
    for _ in 0..if args.random.is_some() { 1 } else { args.rounds } {
        let (actual, stats) =
            render(&scene, &options, &|_| ()).map_err(|error| format!("octray: {error}"))?;
        ours.push(stats.trace_s);
        let PovRun { film: expected, trace_s } = povray.render(path, &args.scene_args, size)?;
        theirs.push(trace_s);
        // Every round makes the same picture; the last is as good as any.
        pictures = Some((expected, actual));
    }
    let (expected, actual) = pictures.ok_or("no rounds")?;
    let actual = as_povray_writes(actual);
    let comparison = compare(&expected, &actual)?;
    let figures = Figures { octray_s: median(ours), povray_s: median(theirs), comparison };
    Ok(Measured { figures, expected, actual })
}
