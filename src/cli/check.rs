//! `octray check`: reads scenes and tells what is wrong with them.

use super::Failure;
use super::scene::{SceneArgs, evaluate, plural, print_messages};
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
    /// One line for each error and warning, as editors like it: file:line:column: error: message
    #[arg(long)]
    short: bool,
}

/// Diagnostics go to the standard error stream, one line per good scene to the standard output.
pub fn run(args: &Args) -> Result<(), Failure> {
    let size = RenderOptions::default();
    let mut all_good = true;
    for path in &args.scenes {
        let found = evaluate(path, &args.scene, (size.width, size.height));
        if args.short {
            found.diagnostics.iter().for_each(|d| eprintln!("{}", d.short(&found.sources)));
        } else {
            print_messages(&found, false);
        }
        if found.has_errors() {
            all_good = false;
            continue;
        }
        let counts = shape_counts(&found.scene);
        let shapes: Vec<_> = counts.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
        let lights = plural(found.scene.lights.len(), "light");
        let warnings = plural(found.count(Severity::Warning), "warning");
        println!("{}: no errors, {warnings}; {lights}, shapes: {}", path.display(), shapes.join(", "));
    }
    if all_good { Ok(()) } else { Err(Failure::Scene) }
}
