//! `octray bench`: what speed costs in accuracy, mode by mode, with POV-Ray beside them where it is installed.
//!
//! All trace with one thread unless told otherwise and without anti-aliasing. Rounds go through all modes before the next
//! begins, so that a busy moment of the machine does not hit one of them only; times are medians of tracing alone.
//! Errors are those of the pictures in linear light and of what camera rays hit, against `strict`.

mod kinds;
mod measure;
mod page;
mod plot;
mod table;

use super::Failure;
use super::number::number;
use super::paths::{make_folder, scenes};
use super::povray::PovRay;
use super::render::threads;
use super::scene::SceneArgs;
use super::streams::{line_to_stdout, to_stdout};
use measure::{Measured, measure};
use octray::file_io::replace_file;
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scenes to measure; a folder stands for all .scn and .pov files in it
    #[arg(value_name = "SCENE", default_value = "scenes/show")]
    scenes: Vec<PathBuf>,
    /// Write into this folder: index.html with plot, tables and pictures in it, figures.csv, rays.csv and
    /// figures.json
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
    /// Threads; 0 is one per processor
    #[arg(short, long, value_name = "N", default_value_t = 1, value_parser = threads)]
    threads: usize,
    /// Leave the oracle out where it would take longer than this
    #[arg(long, value_name = "SECONDS", default_value_t = 15.0, value_parser = number(0.0.., "seconds, from 0 on"))]
    oracle_limit: f64,
    #[command(flatten)]
    scene_args: SceneArgs,
    /// POV-Ray's program; left out if it cannot be run
    #[arg(long, value_name = "PROGRAM", default_value = "povray")]
    povray: PathBuf,
}

/// Everything that a run found.
#[derive(Debug, Serialize)]
struct Run {
    machine: Machine,
    scenes: Vec<Measured>,
}

/// Where and how it was measured.
#[derive(Debug, Serialize)]
struct Machine {
    cpu: Option<String>,
    processors: usize,
    /// Instruction sets that this build uses.
    build: String,
    version: &'static str,
    /// Of the working folder, if it is a checkout.
    commit: Option<String>,
    povray: Option<String>,
    width: u32,
    height: u32,
    threads: usize,
    rounds: u32,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let paths = scenes(&args.scenes)?;
    let povray = PovRay::find(&args.povray).ok();
    if let Some(folder) = &args.report {
        make_folder(folder)?;
    }
    let machine = Machine::here(args, povray.as_ref());
    line_to_stdout(format_args!("{}\n{}", machine.told(), table::HEAD))?;
    let mut measured = Vec::new();
    for path in &paths {
        let one = measure(path, args, povray.as_ref())?;
        to_stdout(table::lines(&one))?;
        measured.push(one);
    }
    line_to_stdout(table::FOOT)?;
    let run = Run { machine, scenes: measured };
    if let Some(folder) = &args.report {
        write(folder, &run)?;
    }
    Ok(())
}

fn write(folder: &Path, run: &Run) -> Result<(), Failure> {
    let plot = plot::svg(&run.scenes).map_err(Failure::Machine)?;
    replace_file(&folder.join("plot.svg"), plot.as_bytes())?;
    replace_file(&folder.join("index.html"), page::page(run, &plot).as_bytes())?;
    replace_file(&folder.join("figures.csv"), table::csv(&run.scenes).as_bytes())?;
    let walks = kinds::csv(run.scenes.iter().map(|scene| (scene.scene.as_str(), &scene.walks[..])));
    replace_file(&folder.join("rays.csv"), walks.as_bytes())?;
    let json = serde_json::to_vec_pretty(run).expect("plain numbers and names");
    Ok(replace_file(&folder.join("figures.json"), &json)?)
}

impl Machine {
    fn here(args: &Args, povray: Option<&PovRay>) -> Self {
        #[cfg(target_arch = "x86_64")]
        let cpu = raw_cpuid::CpuId::new()
            .get_processor_brand_string()
            .map(|brand| brand.as_str().split_whitespace().collect::<Vec<_>>().join(" "));
        #[cfg(not(target_arch = "x86_64"))]
        let cpu = None;
        let sets = [
            ("AVX512F", cfg!(target_feature = "avx512f")),
            ("AVX2", cfg!(target_feature = "avx2")),
            ("FMA", cfg!(target_feature = "fma")),
        ];
        let build: Vec<_> = sets.iter().filter(|(_, used)| *used).map(|(name, _)| *name).collect();
        let asked = std::process::Command::new("git").args(["rev-parse", "--short", "HEAD"]).output();
        let commit = asked.ok().filter(|asked| asked.status.success());
        Self {
            cpu,
            processors: std::thread::available_parallelism().map_or(0, usize::from),
            build: build.join(", "),
            version: env!("CARGO_PKG_VERSION"),
            commit: commit.map(|asked| String::from_utf8_lossy(&asked.stdout).trim().to_owned()),
            povray: povray.map(|povray| povray.version.clone()),
            width: args.width,
            height: args.height,
            threads: args.threads,
            rounds: args.rounds,
        }
    }

    /// In one line.
    fn told(&self) -> String {
        let or_unknown = |text: &Option<String>| text.clone().unwrap_or_else(|| "unknown".into());
        format!(
            "octray {} ({}), built for {}; {}, {} processors; {} x {}, {} thread(s), medians of {} interleaved \
             rounds; POV-Ray {}",
            self.version,
            or_unknown(&self.commit),
            self.build,
            or_unknown(&self.cpu),
            self.processors,
            self.width,
            self.height,
            self.threads,
            self.rounds,
            self.povray.as_deref().unwrap_or("is not installed")
        )
    }
}
