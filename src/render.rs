//! A scene, a picture size and an engine in; a picture, in linear light or developed, and what it cost out.
//!
//! The one place that ties the engines: it chooses, times, and converts from the scene's working space. It knows
//! neither text nor files.

pub use crate::compile::{Instancing, Preset, kept_shapes};
pub use crate::film::RayCounts;
use crate::film::{Film, Picture, Pixel};
pub use crate::precision::Precision;
use crate::precision::{Prepared, in_its_precision};
use crate::reference;
use crate::scene::{Gamma, Object, Scene, Shape};
use crate::transfer::Transfer;
use crate::wave;
use crate::wave::Tile;
pub use crate::wave::{LightBuffers, Occupancy, Schedule, Traversal};
use bytemuck::Zeroable;
use rustc_hash::FxHashMap;
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Who traces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Engine {
    /// Eight rays at a time.
    #[default]
    Packets,
    /// The oracle: one f64 ray at a time, every ray against every object. Slow; ignores [`Precision`].
    Reference,
}

/// What to render and with what.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderOptions {
    /// Pixels per row, at least 1.
    pub width: usize,
    /// Rows, at least 1.
    pub height: usize,
    /// Threads; 0 takes one per processor. The picture does not depend on it.
    pub threads: usize,
    /// How exactly.
    pub precision: Precision,
    /// Who traces.
    pub engine: Engine,
    /// How much time the packet engine's tree may take.
    pub build: Preset,
    /// Counts how many of eight lanes work in the packet engine's tests; takes some more time.
    pub occupancy: bool,
    /// How the packet engine cuts up its work.
    pub schedule: Schedule,
    /// Which meshes the packet engine keeps once for all places where they stand.
    pub instancing: Instancing,
}

impl Default for RenderOptions {
    /// POV-Ray's built-in picture size, 160 by 120 (measured with an empty `povray.ini`).
    fn default() -> Self {
        Self {
            width: 160,
            height: 120,
            threads: 0,
            precision: Precision::default(),
            engine: Engine::default(),
            build: Preset::default(),
            occupancy: false,
            schedule: Schedule::default(),
            instancing: Instancing::default(),
        }
    }
}

/// What a render cost.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RenderStats {
    /// What the packet engine computed in: finer than what was asked for where that is too coarse for the sizes in the scene.
    pub precision: Precision,
    /// Seconds from scene to columns and trees; 0 for the reference engine, which has none.
    pub build_s: f64,
    /// Seconds of tracing, of making pixels what is kept of them included.
    pub trace_s: f64,
    /// Threads that traced.
    pub threads: usize,
    /// Rays traced.
    pub rays: RayCounts,
    /// How many shapes of each kind the scene has; see [`shape_counts`].
    pub shapes: BTreeMap<&'static str, u64>,
    /// Tests of boxes and of primitives, if they were counted.
    pub occupancy: Option<Occupancy>,
}

/// How far a render has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Pixels finished.
    pub pixels: u64,
    /// Pixels in all.
    pub of: u64,
    /// Rays traced so far.
    pub rays: u64,
}

/// Called from any thread now and then, from once per tile to once per row: must be cheap.
pub type OnProgress<'a> = &'a (dyn Fn(Progress) + Sync);

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A picture without pixels, or with more than memory can address.
    #[error("a picture has 1 to {MOST_PIXELS} pixels, not {width} by {height}")]
    Size {
        /// As asked for.
        width: usize,
        /// As asked for.
        height: usize,
    },
    /// Threads could not be started.
    #[error("cannot start the threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Most pixels a picture may have: 16 bytes each, so 16 GiB of film.
const MOST_PIXELS: usize = 1 << 30;

/// Stack of a thread, reserved but used only as deep as rays go: the reference engine recurses at every transparent
/// surface, and those that do not bend are not limited by `max_trace_level`.
const STACK_BYTES: usize = 1 << 28;

/// Renders `scene`.
///
/// The film is in linear light, unless the scene turns gamma correction off ([`Gamma::Off`]); then it holds the
/// scene's numbers as they are.
///
/// # Errors
/// If the size is out of reason, or threads cannot be started.
pub fn render(
    scene: &Scene,
    options: &RenderOptions,
    progress: OnProgress<'_>,
) -> Result<(Film, RenderStats), RenderError> {
    let linear = to_linear(working_space(scene));
    develop(scene, options, |pixels, film| film.extend_from_slice(&linear(pixels)), progress)
}

/// How what is summed in the scene's working space stands for light.
pub fn working_space(scene: &Scene) -> Transfer {
    match scene.globals.assumed_gamma {
        Gamma::Off => Transfer::AsIs,
        Gamma::Power(gamma) => Transfer::Power(gamma),
        Gamma::Srgb => Transfer::Srgb,
    }
}

/// Renders `scene`, and keeps of its pixels what `develop` makes of them, which is handed some, in the [`working_space`], and where
/// to add that, one for one: a picture of bytes takes a fifth of a film's memory, and fresh memory is dear.
///
/// # Errors
/// As [`render`].
pub fn develop<P: Copy + Zeroable + Send>(
    scene: &Scene,
    options: &RenderOptions,
    develop: impl Fn(&[Pixel], &mut Vec<P>) + Sync,
    progress: OnProgress<'_>,
) -> Result<(Picture<P>, RenderStats), RenderError> {
    let (width, height) = (options.width, options.height);
    if !width.checked_mul(height).is_some_and(|pixels| (1..=MOST_PIXELS).contains(&pixels)) {
        return Err(RenderError::Size { width, height });
    }
    let threads = rayon::ThreadPoolBuilder::new().num_threads(options.threads).stack_size(STACK_BYTES);
    let pool = threads.build()?;
    let sum = Sum::new(options);
    let picture = Mutex::new(Picture::new(width, height));
    // Tiles are developed and laid down as they are done, each by the thread that made it: afterwards it would be one
    // thread's work.
    let done = |tile: Tile<'_>| {
        progress(sum.add(tile.pixels.len(), tile.rays));
        let mut developed = Vec::with_capacity(tile.pixels.len());
        develop(tile.pixels, &mut developed);
        let mut picture = picture.lock().unwrap_or_else(PoisonError::into_inner);
        picture.lay(tile.corner, tile.width, &developed);
    };
    let mut stats = pool.install(|| trace(scene, options, &done));
    stats.threads = pool.current_num_threads();
    stats.shapes = shape_counts(scene);
    Ok((picture.into_inner().unwrap_or_else(PoisonError::into_inner), stats))
}

/// Is handed finished tiles, from any thread.
type OnTile<'a> = &'a (dyn Fn(Tile<'_>) + Sync);

/// Hands over to the engine, on the threads of the pool it is called in.
fn trace(scene: &Scene, options: &RenderOptions, done: OnTile<'_>) -> RenderStats {
    match options.engine {
        Engine::Packets => trace_packets(scene, options, done),
        Engine::Reference => trace_by_reference(scene, options, done),
    }
}

/// The packet engine.
fn trace_packets(scene: &Scene, options: &RenderOptions, done: OnTile<'_>) -> RenderStats {
    let begin = Instant::now();
    let prepared = Prepared::new(scene, options.precision, options.build, options.instancing);
    let build_s = begin.elapsed().as_secs_f64();
    let begin = Instant::now();
    let size = (options.width, options.height);
    let (rays, occupancy) = in_its_precision!(&prepared, compiled => {
        wave::render(compiled, size, options.schedule, options.occupancy, done)
    });
    let trace_s = begin.elapsed().as_secs_f64();
    let occupancy = options.occupancy.then_some(occupancy);
    RenderStats {
        precision: prepared.precision(),
        build_s,
        trace_s,
        rays,
        occupancy,
        ..RenderStats::default()
    }
}

/// The oracle.
fn trace_by_reference(scene: &Scene, options: &RenderOptions, done: OnTile<'_>) -> RenderStats {
    let begin = Instant::now();
    let on_row = |row: usize, pixels: &[Pixel], rays: &RayCounts| {
        done(Tile { corner: (0, row), width: pixels.len(), pixels, rays });
    };
    let rays = reference::render(scene, options.width, options.height, &on_row);
    let trace_s = begin.elapsed().as_secs_f64();
    RenderStats { trace_s, rays, ..RenderStats::default() }
}

/// Adds up what the threads have done.
struct Sum {
    pixels: AtomicU64,
    rays: AtomicU64,
    of: u64,
}

impl Sum {
    fn new(options: &RenderOptions) -> Self {
        let of = (options.width * options.height) as u64;
        Self { pixels: AtomicU64::new(0), rays: AtomicU64::new(0), of }
    }

    fn add(&self, pixels: usize, counts: &RayCounts) -> Progress {
        let (pixels, rays) = (pixels as u64, counts.total());
        Progress {
            pixels: self.pixels.fetch_add(pixels, Ordering::Relaxed) + pixels,
            of: self.of,
            rays: self.rays.fetch_add(rays, Ordering::Relaxed) + rays,
        }
    }
}

/// Decodes what was summed in a working space to linear light.
fn to_linear(working_space: Transfer) -> impl Fn(&[Pixel]) -> Cow<'_, [Pixel]> + Sync {
    move |pixels| match working_space {
        Transfer::AsIs | Transfer::LINEAR => Cow::Borrowed(pixels),
        transfer => {
            let decode = |value: f32| transfer.decode_single(value);
            pixels.iter().map(|pixel| Pixel { rgb: pixel.rgb.map(decode), ..*pixel }).collect()
        }
    }
}

/// Shapes by kind, composites opened; a composite itself counts under its operation, a mesh's triangles each.
///
/// Looks at every object once, however many composites share it: a short script can make a scene of 2^40 shapes, which
/// must not be rendered, but counted. Counts stop at `u64::MAX`.
pub fn shape_counts(scene: &Scene) -> BTreeMap<&'static str, u64> {
    let mut known = FxHashMap::default();
    let mut counts = BTreeMap::new();
    scene.objects.iter().for_each(|object| count(object, &mut counts, &mut known));
    counts
}

type Counts = BTreeMap<&'static str, u64>;

/// Adds what `object` is made of to `counts`. What several share is kept in `known`, by address.
fn count(object: &Arc<Object>, counts: &mut Counts, known: &mut FxHashMap<*const Object, Counts>) {
    let add = |counts: &mut Counts, kind, more: u64| {
        let sum = counts.entry(kind).or_insert(0);
        *sum = sum.saturating_add(more);
    };
    let (kind, many) = kind_and_count(&object.shape);
    let children = if let Shape::Csg { children, .. } = &object.shape { &children[..] } else { &[] };
    let mut parts = children.iter().chain(object.clipped_by()).peekable();
    if parts.peek().is_none() {
        return add(counts, kind, many);
    }
    if Arc::strong_count(object) == 1 {
        add(counts, kind, many);
        return parts.for_each(|part| count(part, counts, known));
    }
    if !known.contains_key(&Arc::as_ptr(object)) {
        let mut inner = Counts::from([(kind, many)]);
        parts.for_each(|part| count(part, &mut inner, known));
        known.insert(Arc::as_ptr(object), inner);
    }
    known[&Arc::as_ptr(object)].iter().for_each(|(kind, many)| add(counts, kind, *many));
}

/// The shape's keyword in a scene file, and how many it stands for.
fn kind_and_count(shape: &Shape) -> (&'static str, u64) {
    use crate::scene::CsgOp;
    match shape {
        Shape::Sphere { .. } => ("sphere", 1),
        Shape::Plane { .. } => ("plane", 1),
        Shape::Box { .. } => ("box", 1),
        Shape::Cone { base_radius, cap_radius, .. } if base_radius == cap_radius => ("cylinder", 1),
        Shape::Cone { .. } => ("cone", 1),
        Shape::Disc { .. } => ("disc", 1),
        Shape::Torus { .. } => ("torus", 1),
        Shape::Polynomial(_) => ("polynomial", 1),
        Shape::Triangle { normals: None, .. } => ("triangle", 1),
        Shape::Triangle { .. } => ("smooth_triangle", 1),
        Shape::Polygon { .. } => ("polygon", 1),
        Shape::Other(_) => ("not rendered", 1),
        Shape::Mesh(mesh) => ("mesh_triangle", mesh.triangles.len() as u64),
        Shape::Csg { op: CsgOp::Union, .. } => ("union", 1),
        Shape::Csg { op: CsgOp::Merge, .. } => ("merge", 1),
        Shape::Csg { op: CsgOp::Intersection, .. } => ("intersection", 1),
        Shape::Csg { op: CsgOp::Difference, .. } => ("difference", 1),
    }
}
