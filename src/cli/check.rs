//! `octray check`: reads scenes and tells what is wrong with them, and what of them octray does not render.

use super::Failure;
use super::scene::{
    MessageFormat, SceneArgs, is_over_limit, many, options, over_limit, plural, print_messages, shapes,
};
use super::streams::to_stdout;
use cpu_time::ProcessTime;
use octray::eval::{Effect, Evaluation, Missing};
use octray::lang::Severity;
use octray::render::{RenderOptions, shape_counts};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scenes to read
    #[arg(value_name = "SCENE", required = true)]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    scene: SceneArgs,
    /// What the scene finds in `image_width`
    #[arg(short = 'W', long, value_name = "N", default_value_t = RenderOptions::default().width as u32, value_parser = clap::value_parser!(u32).range(1..))]
    width: u32,
    /// What the scene finds in `image_height`
    #[arg(short = 'H', long, value_name = "N", default_value_t = RenderOptions::default().height as u32, value_parser = clap::value_parser!(u32).range(1..))]
    height: u32,
    /// Say how much processor time reading and evaluating took
    #[arg(long)]
    times: bool,
    /// The same as --message-format short
    #[arg(long, conflicts_with = "message_format")]
    short: bool,
}

/// Diagnostics go to the standard error stream. To the standard output go, for each good scene, one line, and one for each
/// feature that `octray render` would refuse or ignore: that makes no scene a bad one.
pub fn run(args: &Args) -> Result<(), Failure> {
    let size = (args.width as usize, args.height as usize);
    let mut all_good = true;
    for path in &args.scenes {
        let options = octray::eval::Options { list_missing: true, ..options(&args.scene, size) };
        let begin = ProcessTime::now();
        let found = octray::eval::load(path, &options);
        let read_s = begin.elapsed().as_secs_f64();
        let format = if args.short { MessageFormat::Short } else { args.scene.message_format };
        print_messages(&found, false, format);
        if found.has_errors() {
            all_good = false;
            continue;
        }
        let counts = shape_counts(&found.scene);
        let sum = shapes(&counts);
        let shapes: Vec<_> = counts.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
        let lights = plural(found.scene.lights.len(), "light");
        let warnings = plural(found.count(Severity::Warning), "warning");
        let mut report =
            format!("{}: no errors, {warnings}; {lights}, shapes: {}\n", path.display(), shapes.join(", "));
        if args.times {
            report += &format!("  read and evaluated in {read_s:.6} s of processor time\n");
        }
        if is_over_limit(&found.scene, sum, args.scene.max_shapes) {
            report += &format!("  refused: {} ({})\n", many(sum), over_limit(args.scene.max_shapes));
        }
        found.missing.iter().for_each(|missing| report += &told(missing, &found));
        to_stdout(report)?;
        // Taking a scene of a million objects apart again takes as long as a quarter of reading it.
        std::mem::forget(found);
    }
    if all_good { Ok(()) } else { Err(Failure::Scene) }
}

/// `refused: blob (3 places, the first at ball.scn:12:3)`
fn told(missing: &Missing, found: &Evaluation) -> String {
    let effect = match missing.effect {
        Effect::Refused => "refused",
        Effect::Ignored => "ignored",
    };
    let (line, column) = found.sources.position(missing.first);
    let name = &found.sources.file(missing.first.file).name;
    let places = match missing.places {
        1 => "at".to_string(),
        places => format!("{places} places, the first at"),
    };
    format!("  {effect}: {} ({places} {name}:{line}:{column})\n", missing.feature)
}
