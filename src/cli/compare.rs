//! `octray compare`: how far two picture files are apart.

use super::Failure;
use super::number::{number, share};
use super::overwrite::refuse_overwrites;
use super::streams::{line_to_stdout, to_stdout};
use clap::ValueEnum;
use octray::compare::{AMPLIFY, Comparison, Difference, EDGE_CONTRAST, WITHIN, clipped, compare, strip};
use octray::file_io::check_writable;
use octray::image_io::{self, Assume, Encoding, Format};
use octray::transfer::Transfer;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The picture that is right: PNG, EXR, HDR, PPM or JPEG
    #[arg(value_name = "EXPECTED")]
    expected: PathBuf,
    /// The picture in question
    #[arg(value_name = "ACTUAL")]
    actual: PathBuf,
    /// Write `expected | difference | actual` side by side, as PNG
    #[arg(long, value_name = "OUT.png")]
    strip: Option<PathBuf>,
    /// What differences are multiplied by in the strip
    #[arg(long, value_name = "X", default_value_t = AMPLIFY, value_parser = number(0.0..=f32::MAX, "a number from 0 on"))]
    amplify: f32,
    /// Figures as JSON instead of a table
    #[arg(long)]
    json: bool,
    /// How the numbers in PNG, PPM and JPEG files stand for light. `file`: as PNG files say, else sRGB
    #[arg(long, value_enum, default_value_t)]
    input_gamma: InputGamma,
    /// Fail (exit code 1) unless at least this share of the pixels off edges agree within 2e-3
    #[arg(long, value_name = "SHARE", value_parser = share)]
    gate: Option<f64>,
}

#[derive(Debug, Clone, Copy, Default, ValueEnum)]
enum InputGamma {
    #[default]
    File,
    Srgb,
    Linear,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let assume = match args.input_gamma {
        InputGamma::File => Assume::File,
        InputGamma::Srgb => Assume::Transfer(Transfer::Srgb),
        InputGamma::Linear => Assume::Transfer(Transfer::LINEAR),
    };
    if let Some(path) = &args.strip {
        let read = [("expected picture", &*args.expected), ("actual picture", &*args.actual)];
        refuse_overwrites(&read, &[("strip", path)])?;
        // No other program would read it as what its name says.
        if Format::of_path(path).is_some_and(|format| format != Format::Png) {
            let path = path.display();
            return Err(Failure::Usage(format!(
                "strips are PNG files: `{path}` is the name of another kind"
            )));
        }
        check_writable(path)?;
    }
    let (mut expected, mut actual) =
        (image_io::read(&args.expected, assume)?, image_io::read(&args.actual, assume)?);
    let is_float = |path| Format::of_path(path).is_some_and(Format::is_float);
    // An integer file ends at 1: what a float file holds beyond that is no difference.
    if !(is_float(&args.expected) && is_float(&args.actual)) {
        (expected, actual) = (clipped(expected), clipped(actual));
    }
    let found = compare(&expected, &actual).map_err(Failure::Differs)?;
    if let Some(path) = &args.strip {
        image_io::write(path, &strip(&expected, &actual, args.amplify), &Encoding::default())?;
    }
    if args.json {
        line_to_stdout(serde_json::to_string_pretty(&found).expect("plain numbers and names"))?;
    } else {
        to_stdout(table(&found))?;
    }
    gate(args.gate, &found)
}

/// Fails if too few pixels agree.
pub fn gate(least: Option<f64>, found: &Comparison) -> Result<(), Failure> {
    match least {
        Some(least) if found.off_edges.within < least => Err(Failure::Differs(format!(
            "{:.4} % of the pixels off edges agree within {WITHIN}, and {:.4} % are asked for",
            found.off_edges.within * 100.0,
            least * 100.0
        ))),
        _ => Ok(()),
    }
}

fn table(found: &Comparison) -> String {
    let mut out = format!("{} x {} pixels, linear light\n", found.width, found.height);
    out += &format!("{:24}{:>14}{:>14}\n", "", "all", "off edges");
    let mut row = |what: &str, figure: &dyn Fn(&Difference) -> String| {
        out += &format!("{what:24}{:>14}{:>14}\n", figure(&found.all), figure(&found.off_edges));
    };
    let percent = |share: f64| format!("{:.3} %", share * 100.0);
    row("pixels", &|d| d.pixels.to_string());
    row("rmse", &|d| format!("{:.3e}", d.rmse));
    row("p99", &|d| format!("{:.3e}", d.p99));
    row("over 1/255", &|d| percent(d.over_1_255));
    row("over 4/255", &|d| percent(d.over_4_255));
    row("within 2e-3", &|d| percent(d.within));
    row("max", &|d| format!("{:.3e}", d.max));
    row("at column, row", &|d| d.worst.map_or("-".into(), |w| format!("{}, {}", w.x, w.y)));
    if let Some(worst) = found.all.worst {
        let rgb = |c: [f32; 3]| format!("<{:.5}, {:.5}, {:.5}>", c[0], c[1], c[2]);
        out += &format!("there: expected {}, actual {}\n", rgb(worst.expected), rgb(worst.actual));
    }
    out + &format!("edges: neighbours in the expected picture differ by over {EDGE_CONTRAST}\n")
}
