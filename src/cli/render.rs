//! `octray render`: a scene to a picture file.

use super::Failure;
use super::number::number;
use super::overwrite::{Named, refuse_overwrites};
use super::pages;
use super::progress::Bar;
use super::scene::{Loaded, SceneArgs, load_whole};
use super::stats::Stats;
use super::streams::to_stdout;
use clap::ValueEnum;
use octray::file_io;
use octray::film::Pixel;
use octray::image_io::{self, Developer, Encoding, Format};
use octray::render::{
    Engine, LightBuffers, Precision, Preset, RenderError, RenderOptions, Schedule, Traversal, develop,
    render, working_space,
};
use octray::scene::{Gamma, Scene};
use octray::transfer::Transfer;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Pixels in the longest row or column that JPEG's header can tell of.
const JPEG_SIDE: u32 = 65535;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The scene: a POV-Ray 3.7 file
    scene: PathBuf,
    /// Picture file; its ending says which kind: png, exr, hdr, ppm, jpg. `-` is the standard output. Without it: the
    /// scene's name with .png, in the current folder
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// Kind of picture, whatever the file's name
    #[arg(long, value_name = "KIND")]
    format: Option<FormatArg>,
    /// Pixels per row. The camera does not adapt: for square pixels its `right` must be WIDTH/HEIGHT times its `up`
    #[arg(short = 'W', long, value_name = "N", default_value_t = RenderOptions::default().width as u32, value_parser = clap::value_parser!(u32).range(1..))]
    width: u32,
    /// Rows of pixels
    #[arg(short = 'H', long, value_name = "N", default_value_t = RenderOptions::default().height as u32, value_parser = clap::value_parser!(u32).range(1..))]
    height: u32,
    /// Threads; 0 is one per processor. The picture is the same, bit by bit, for any number
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = threads)]
    threads: usize,
    #[command(flatten)]
    tracing: TracingArgs,
    #[command(flatten)]
    scene_args: SceneArgs,
    /// Bits per channel of PNG and PPM
    #[arg(long, value_name = "BITS", default_value = "8", value_parser = ["8", "16"])]
    bit_depth: String,
    /// Write how much of each pixel is covered, too (PNG, EXR), as POV-Ray's +UA. A `background` without `transmit`
    /// covers everything
    #[arg(long)]
    alpha: bool,
    /// How the numbers in PNG, PPM and JPEG stand for light: `srgb`, or a power; 1.0 is linear, as POV-Ray's
    /// File_Gamma=1.0
    #[arg(long, value_name = "GAMMA", default_value = "srgb", value_parser = transfer)]
    file_gamma: Transfer,
    /// Write times, ray counts and memory as JSON; `-` is the standard output
    #[arg(long, value_name = "FILE.json")]
    stats: Option<PathBuf>,
    /// With --stats: count how many of eight lanes work in tests of boxes and of primitives; takes a little longer
    #[arg(long, requires = "stats")]
    occupancy: bool,
    /// Say nothing but errors, and show no progress
    #[arg(short, long)]
    quiet: bool,
}

/// How to trace.
#[derive(Debug, clap::Args)]
pub struct TracingArgs {
    /// How exactly to compute
    #[arg(short, long, value_enum, default_value_t)]
    pub precision: PrecisionArg,
    /// Who traces
    #[arg(long, value_enum, default_value_t)]
    pub engine: EngineArg,
    /// How much time the tree may take. The picture is the same, bit by bit
    #[arg(long, value_enum, default_value_t)]
    pub build: BuildArg,
    /// How rays go through the tree. The picture is the same, bit by bit
    #[arg(long, value_enum, default_value_t)]
    pub traversal: TraversalArg,
    /// Which lights have buffers that answer shadow rays untraced. The picture is the same but for roundings
    #[arg(long, value_enum, default_value_t)]
    pub light_buffers: LightBuffersArg,
}

#[derive(Debug, Clone, Copy, Default, ValueEnum)]
pub enum PrecisionArg {
    /// Single precision wherever its error is bounded: for previews
    Fast,
    /// Boxes in single, surfaces in double precision
    #[default]
    Exact,
    /// Boxes and surfaces in double precision (light is in single in every mode)
    Strict,
}

#[derive(Debug, Clone, Copy, Default, ValueEnum)]
pub enum EngineArg {
    /// Eight rays at a time
    #[default]
    Packets,
    /// One ray at a time against every object: slow, and what the packet engine is checked with
    Reference,
}

#[derive(Debug, Clone, Copy, Default, ValueEnum)]
pub enum BuildArg {
    /// As little as possible: for previews of large scenes
    Fast,
    /// What pays off within one picture
    #[default]
    Balanced,
    /// What pays off in large pictures, and over many
    Best,
}

#[derive(Debug, Clone, Copy, Default, ValueEnum)]
pub enum TraversalArg {
    /// By measured switches, as is best for the rays at hand
    #[default]
    Auto,
    /// Groups of eight-ray packets, whatever the rays
    Packet,
    /// Each ray by itself against eight boxes
    Single,
    /// Packets that fall apart into single rays
    Hybrid,
}

#[derive(Debug, Clone, Copy, Default, ValueEnum)]
pub enum LightBuffersArg {
    /// Where they save more than they cost
    #[default]
    Auto,
    /// All that shadow rays converge on
    Always,
    /// None
    Never,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum FormatArg {
    Png,
    Exr,
    Hdr,
    Ppm,
    #[value(alias = "jpeg")]
    Jpg,
}

impl From<BuildArg> for Preset {
    fn from(build: BuildArg) -> Self {
        match build {
            BuildArg::Fast => Self::Fast,
            BuildArg::Balanced => Self::Balanced,
            BuildArg::Best => Self::Best,
        }
    }
}

impl From<TraversalArg> for Traversal {
    fn from(traversal: TraversalArg) -> Self {
        match traversal {
            TraversalArg::Auto => Self::Auto,
            TraversalArg::Packet => Self::Packet,
            TraversalArg::Single => Self::Single,
            TraversalArg::Hybrid => Self::Hybrid,
        }
    }
}

impl From<LightBuffersArg> for LightBuffers {
    fn from(buffers: LightBuffersArg) -> Self {
        match buffers {
            LightBuffersArg::Auto => Self::Auto,
            LightBuffersArg::Always => Self::Always,
            LightBuffersArg::Never => Self::Never,
        }
    }
}

impl From<PrecisionArg> for Precision {
    fn from(precision: PrecisionArg) -> Self {
        match precision {
            PrecisionArg::Fast => Self::Fast,
            PrecisionArg::Exact => Self::Exact,
            PrecisionArg::Strict => Self::Strict,
        }
    }
}

impl TracingArgs {
    pub fn options(&self, width: usize, height: usize) -> RenderOptions {
        let engine = match self.engine {
            EngineArg::Packets => Engine::Packets,
            EngineArg::Reference => Engine::Reference,
        };
        let (precision, build) = (self.precision.into(), self.build.into());
        let (traversal, light_buffers) = (self.traversal.into(), self.light_buffers.into());
        let schedule = Schedule { traversal, light_buffers, ..Schedule::default() };
        RenderOptions { width, height, precision, engine, build, schedule, ..RenderOptions::default() }
    }
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let start = Instant::now();
    let output = Output::of(args)?;
    let size = (args.width as usize, args.height as usize);
    let Loaded { scene, files_read, shapes } = load_whole(&args.scene, &args.scene_args, size, args.quiet)?;
    let read: Vec<_> = files_read.iter().map(|path| ("file that the scene reads", &**path)).collect();
    refuse_overwrites(&read, &output.written(args))?;
    let parse_s = start.elapsed().as_secs_f64();
    // Before the rendering, which may take hours.
    output.check_writable()?;
    if let Some(path) = args.stats.as_deref().filter(|path| !is_stdout(path)) {
        file_io::check_writable(path)?;
    }

    let options = RenderOptions {
        threads: args.threads,
        occupancy: args.occupancy,
        ..args.tracing.options(size.0, size.1)
    };
    pages::let_be_for(&scene, shapes);
    let bar = Bar::new(size.0 * size.1, args.quiet);
    let progress = |progress| bar.update(progress);
    let failure = |error: RenderError| match error {
        RenderError::Size { .. } => Failure::Usage(error.to_string()),
        RenderError::Threads(_) => Failure::Machine(error.to_string()),
    };
    let encoding = args.encoding(&scene, output.format);
    let (file, stats) = if let Some(developer) = Developer::of(&encoding, working_space(&scene)) {
        let to_codes = |pixels: &[Pixel], codes: &mut Vec<_>| developer.develop(pixels, codes);
        let (picture, stats) = develop(&scene, &options, to_codes, &progress).map_err(failure)?;
        (image_io::encode_developed(&picture, &encoding)?, stats)
    } else {
        let (film, stats) = render(&scene, &options, &progress).map_err(failure)?;
        (image_io::encode(&film, &encoding)?, stats)
    };
    drop(bar);

    output.write(&file)?;
    if let Some(path) = &args.stats {
        let stats = Stats::new(&options, stats, parse_s, start.elapsed().as_secs_f64());
        let mut json = serde_json::to_vec_pretty(&stats).expect("plain numbers and names");
        json.push(b'\n');
        if is_stdout(path) { to_stdout(&json)? } else { file_io::replace_file(path, &json)? }
    }
    Ok(())
}

impl Args {
    fn encoding(&self, scene: &Scene, format: Format) -> Encoding {
        Encoding {
            format,
            deep: self.bit_depth == "16",
            // Without gamma correction numbers are written as they are, whatever the file: as in POV-Ray.
            transfer: if scene.globals.assumed_gamma == Gamma::Off {
                Transfer::AsIs
            } else {
                self.file_gamma
            },
            alpha: self.alpha,
        }
    }
}

/// Where the picture goes.
struct Output {
    /// `None` is the standard output.
    path: Option<PathBuf>,
    format: Format,
}

impl Output {
    fn of(args: &Args) -> Result<Self, Failure> {
        let asked = args.format.map(|format| match format {
            FormatArg::Png => Format::Png,
            FormatArg::Exr => Format::Exr,
            FormatArg::Hdr => Format::Hdr,
            FormatArg::Ppm => Format::Ppm,
            FormatArg::Jpg => Format::Jpeg,
        });
        let output = match &args.output {
            Some(path) if is_stdout(path) => Self { path: None, format: asked.unwrap_or_default() },
            Some(path) => {
                let format = asked.or_else(|| Format::of_path(path)).ok_or_else(|| {
                    let path = path.display();
                    Failure::Usage(format!(
                        "`{path}` does not end in png, exr, hdr, ppm or jpg; say --format"
                    ))
                })?;
                Self { path: Some(path.clone()), format }
            }
            None => {
                let format = asked.unwrap_or_default();
                let ending = Format::ALL.iter().find(|(f, _)| *f == format).map_or("png", |(_, e)| e[0]);
                let name = args.scene.with_extension(ending);
                let name =
                    name.file_name().ok_or_else(|| Failure::Usage("the scene has no name; say -o".into()))?;
                Self { path: Some(name.into()), format }
            }
        };
        if output.path.is_none() && args.stats.as_deref().is_some_and(is_stdout) {
            return Err(Failure::Usage("picture and stats cannot both go to the standard output".into()));
        }
        if args.alpha && !matches!(output.format, Format::Png | Format::Exr) {
            return Err(Failure::Usage("only PNG and EXR hold alpha".into()));
        }
        if args.bit_depth == "16" && !matches!(output.format, Format::Png | Format::Ppm) {
            return Err(Failure::Usage(
                "only PNG and PPM have 16 bits; EXR and HDR always hold floats".into(),
            ));
        }
        let longest = args.width.max(args.height);
        if output.format == Format::Jpeg && longest > JPEG_SIDE {
            return Err(Failure::Usage(format!(
                "JPEG holds at most {JPEG_SIDE} pixels a side, not {longest}"
            )));
        }
        refuse_overwrites(&[("scene", &args.scene)], &output.written(args))?;
        Ok(output)
    }

    /// The files that will be written.
    fn written<'a>(&'a self, args: &'a Args) -> Vec<Named<'a>> {
        let stats = args.stats.as_deref().filter(|path| !is_stdout(path));
        let picture = self.path.as_deref().map(|path| ("picture", path));
        picture.into_iter().chain(stats.map(|path| ("stats", path))).collect()
    }

    fn check_writable(&self) -> Result<(), Failure> {
        Ok(self.path.as_deref().map_or(Ok(()), file_io::check_writable)?)
    }

    fn write(&self, file: &[u8]) -> Result<(), Failure> {
        match &self.path {
            Some(path) => Ok(file_io::replace_file(path, file)?),
            None => to_stdout(file),
        }
    }
}

fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// A number for `--threads`. Each has a stack and queues of its own; more than there are processors only take memory.
pub fn threads(text: &str) -> Result<usize, String> {
    number(0..=1024, "a number from 0 (one per processor) to 1024")(text)
}

fn transfer(text: &str) -> Result<Transfer, String> {
    if text.eq_ignore_ascii_case("srgb") {
        return Ok(Transfer::Srgb);
    }
    match text.parse::<f64>() {
        // Beyond this no display ever was, and PNG's gAMA could not say it.
        Ok(gamma) if (0.1..=10.0).contains(&gamma) => Ok(Transfer::Power(gamma)),
        _ => Err("expected `srgb` or a number from 0.1 to 10".into()),
    }
}
