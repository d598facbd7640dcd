//! `octray rays`: how many rays a second, and what they hit.

use super::Failure;
use super::number::{median, number};
use super::overwrite::{Named, refuse_overwrites};
use super::render::{BuildArg, PrecisionArg, TraversalArg, threads};
use super::scene::{SceneArgs, load};
use super::streams::{line_to_stderr, line_to_stdout};
use clap::ValueEnum;
use glam::DVec3;
use octray::bvh::Occupancy;
use octray::file_io::{LONGEST_DATA, check_writable, read_file, replace_file};
use octray::ray_io::{Geometry, read_geometry, read_rays, write_hits, write_rays};
use octray::ray_set::{NO_PRIMITIVE, RayHits, RaySet};
use octray::render::Precision;
use octray::scene::{Camera, Mesh, MeshTriangle, Object, Projection, Scene, Shape};
use octray::workbench::{CameraRays, Measured, Workbench};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[derive(Debug, clap::Args)]
#[command(after_help = FORMATS)]
pub struct Args {
    /// Geometry: a POV-Ray 3.7 scene
    #[arg(required_unless_present_any = ["mesh", "spheres"], conflicts_with_all = ["mesh", "spheres"])]
    scene: Option<PathBuf>,
    /// Geometry: triangles, a MESH0001 or OBJ file
    #[arg(long, value_name = "FILE", conflicts_with = "spheres")]
    mesh: Option<PathBuf>,
    /// Geometry: spheres, a SPHR0001 file
    #[arg(long, value_name = "FILE")]
    spheres: Option<PathBuf>,
    /// Trace the rays of a RAYS0001 file and compare with the hits stored there; may be given several times
    #[arg(long, value_name = "FILE")]
    rays: Vec<PathBuf>,
    /// Without --rays: the sets to make from the camera, separated by commas
    #[arg(
        long,
        value_name = "SETS",
        value_enum,
        value_delimiter = ',',
        default_value = "camera,shadow,mirror,diffuse",
        conflicts_with = "rays"
    )]
    sets: Vec<SetArg>,
    /// Camera rays a side, in blocks of 8 by 8: a multiple of 8
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(8..=4096), conflicts_with = "rays")]
    size: u32,
    /// Where the camera stands; default for a scene: its own camera
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, conflicts_with = "rays")]
    eye: Option<DVec3>,
    /// Where it looks
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, default_value = "0,0,0", allow_hyphen_values = true, requires = "eye")]
    look: DVec3,
    /// What is up
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, default_value = "0,1,0", allow_hyphen_values = true, requires = "eye")]
    up: DVec3,
    /// Opening from edge to edge, in degrees
    #[arg(long, value_name = "DEG", default_value_t = 45.0, value_parser = opening(), requires = "eye")]
    fov: f64,
    /// Where shadow rays go; default for a scene: its first light
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, conflicts_with = "rays")]
    light: Option<DVec3>,
    /// Trace each set so many times; the report has the median
    #[arg(long, value_name = "N", default_value_t = 1)]
    repeat: usize,
    /// Threads; 0 is one per processor
    #[arg(short, long, value_name = "N", default_value_t = 1, value_parser = threads)]
    threads: usize,
    /// How exactly to compute
    #[arg(short, long, value_enum, default_value_t)]
    precision: PrecisionArg,
    /// How rays go through the tree
    #[arg(long, value_enum, default_value_t)]
    traversal: TraversalArg,
    /// How much time the tree may take
    #[arg(long, value_enum, default_value_t)]
    build: BuildArg,
    /// Count how many of eight lanes work: once more for each set, by one thread
    #[arg(long)]
    occupancy: bool,
    /// Write the last set's hits (HITS0001)
    #[arg(long, value_name = "FILE")]
    hits: Option<PathBuf>,
    /// Write each set's rays and hits as PREFIX.SET.rays (RAYS0001)
    #[arg(long, value_name = "PREFIX")]
    dump: Option<PathBuf>,
    /// Say on the standard error stream which rays differ from the stored hits: at most N of each set
    #[arg(long, value_name = "N", default_value_t = 0, requires = "rays")]
    explain: usize,
    #[command(flatten)]
    scene_args: SceneArgs,
}

const FORMATS: &str = "Prints one line of JSON per set. `mrays_cpu_s` is per second of processor time of all threads, \
which holds on a machine that others use too; `differs` counts rays whose answer is not the stored one (null for sets \
made from the camera). Files are little endian: MESH0001 (u32 vertices, u32 triangles, f32 xyz each, u32 corners each), \
SPHR0001 (u32 spheres, u32 0, f32 xyzr each), RAYS0001 (u32 rays, u32 0 closest or 1 any hit, then columns f32 ox oy oz \
dx dy dz t_near t_far, known hits f32 t, u32 primitive), HITS0001 (u32 rays, u32 query, f32 t, u32 primitive).";

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SetArg {
    /// From the eye through a square picture
    Camera,
    /// From what the camera sees to the light
    Shadow,
    /// Mirrored where the camera's rays hit
    Mirror,
    /// From there into a random direction, by the cosine
    Diffuse,
}

impl SetArg {
    fn name(self) -> &'static str {
        ["camera", "shadow", "mirror", "diffuse"][self as usize]
    }
}

/// A line of the report; times in seconds.
#[derive(Debug, Serialize)]
struct Line {
    set: String,
    rays: usize,
    hits: usize,
    median_s: f64,
    mrays_s: f64,
    mrays_cpu_s: f64,
    build_s: f64,
    build_cpu_s: f64,
    sah: f64,
    primitives: usize,
    bytes: usize,
    threads: usize,
    /// Computed in: finer than what was asked for where that is too coarse for the geometry.
    precision: Precision,
    traversal: String,
    build: String,
    differs: Option<usize>,
    /// Tests of boxes and of primitives, and lanes at work in them; null unless counted.
    occupancy: Option<Occupancy>,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    if !args.size.is_multiple_of(8) {
        return Err(Failure::Usage(format!("--size must be a multiple of 8, not {}", args.size)));
    }
    args.check_written()?;
    let (scene, primitives) = args.geometry()?;
    let traversal = args.traversal.into();
    let bench = Workbench::new(&scene, args.precision.into(), args.build.into(), args.threads)
        .map_err(|error| Failure::Machine(format!("cannot start the threads: {error}")))?;
    let mut last = None;
    for (name, rays, known) in args.ray_sets(&scene, &bench)? {
        let measured = bench.measure(&rays, traversal, args.repeat);
        let differs = known.map(|known| measured.hits.differing(&known, rays.query));
        let seconds = median(measured.wall_s.clone()).max(1e-9);
        let mrays = rays.len() as f64 * 1e-6;
        let line = Line {
            rays: rays.len(),
            hits: measured.hits.count(rays.query),
            median_s: seconds,
            mrays_s: mrays / seconds,
            mrays_cpu_s: mrays / median(measured.cpu_s.clone()).max(1e-9),
            build_s: bench.build_s,
            build_cpu_s: bench.build_cpu_s,
            sah: bench.sah,
            primitives,
            bytes: bench.bytes,
            threads: bench.threads(),
            precision: bench.precision(),
            traversal: format!("{:?}", args.traversal).to_lowercase(),
            build: format!("{:?}", args.build).to_lowercase(),
            differs: differs.as_ref().map(Vec::len),
            occupancy: args.occupancy.then(|| bench.occupancy(&rays, traversal)),
            set: name,
        };
        line_to_stdout(serde_json::to_string(&line).expect("plain numbers and names"))?;
        if let Some(path) = args.dumped(&line.set) {
            replace_file(&path, &write_rays(&rays, &measured.hits))?;
        }
        explain(&rays, &measured, differs.as_deref().unwrap_or_default(), args.explain);
        last = Some((measured.hits, rays.query));
    }
    if let (Some(path), Some((hits, query))) = (&args.hits, last) {
        replace_file(path, &write_hits(&hits, query))?;
    }
    Ok(())
}

impl Args {
    /// That what is written can be, and replaces nothing that is read: better now than when all has been measured.
    fn check_written(&self) -> Result<(), Failure> {
        let read: Vec<Named> = [("scene", &self.scene), ("mesh", &self.mesh), ("spheres", &self.spheres)]
            .into_iter()
            .filter_map(|(what, path)| Some((what, path.as_deref()?)))
            .chain(self.rays.iter().map(|path| ("set of rays", &**path)))
            .collect();
        let sets: Vec<String> = match &self.rays[..] {
            [] => self.sets.iter().map(|set| set.name().into()).collect(),
            paths => paths.iter().map(|path| name_of(path)).collect(),
        };
        let dumps: Vec<PathBuf> = sets.iter().filter_map(|set| self.dumped(set)).collect();
        let dumps = dumps.iter().map(|path| ("dump of a set", &**path));
        let written: Vec<Named> = dumps.chain(self.hits.as_deref().map(|path| ("hits", path))).collect();
        refuse_overwrites(&read, &written)?;
        Ok(written.iter().try_for_each(|(_, path)| check_writable(path))?)
    }

    /// Where a set's rays and hits are written to, if anywhere.
    fn dumped(&self, set: &str) -> Option<PathBuf> {
        let mut path = self.dump.clone()?.into_os_string();
        path.push(format!(".{set}.rays"));
        Some(path.into())
    }

    /// What rays are traced against, and how many primitives that is.
    fn geometry(&self) -> Result<(Scene, usize), Failure> {
        let Some(path) = self.mesh.as_ref().or(self.spheres.as_ref()) else {
            let path = self.scene.as_deref().unwrap_or(Path::new(""));
            let size = (self.size as usize, self.size as usize);
            let scene = load(path, &self.scene_args, size, false)?;
            let primitives = octray::render::shape_counts(&scene).values().sum::<u64>() as usize;
            return Ok((scene, primitives));
        };
        let geometry = read_geometry(&read_file(path, LONGEST_DATA)?)
            .map_err(|error| Failure::Machine(format!("{} cannot be read: {error}", path.display())))?;
        if self.mesh.is_some() != matches!(geometry, Geometry::Mesh { .. }) {
            return Err(Failure::Usage(format!("{} holds the other kind of geometry", path.display())));
        }
        let primitives = geometry.len();
        Ok((scene_of(geometry), primitives))
    }

    /// Name, rays and known hits of each set.
    fn ray_sets(
        &self,
        scene: &Scene,
        bench: &Workbench,
    ) -> Result<Vec<(String, RaySet, Option<RayHits>)>, Failure> {
        let mut sets = Vec::new();
        for path in &self.rays {
            let (rays, known) = read_rays(&read_file(path, LONGEST_DATA)?)
                .map_err(|error| Failure::Machine(format!("{} cannot be read: {error}", path.display())))?;
            sets.push((name_of(path), rays, Some(known)));
        }
        if !sets.is_empty() {
            return Ok(sets);
        }
        let camera = match self.eye {
            Some(eye) => self.camera(eye)?,
            None if self.scene.is_some() => scene.camera.clone(),
            None => return Err(Failure::Usage("say --rays, or where the camera stands: --eye".into())),
        };
        let light = self.light.or(scene.lights.first().map(|light| light.location));
        let made = CameraRays::new(bench, &camera, self.size as usize);
        for &set in &self.sets {
            let rays = match set {
                SetArg::Camera => made.camera.clone(),
                SetArg::Mirror => made.mirror(),
                SetArg::Diffuse => made.diffuse(),
                SetArg::Shadow => made.shadow(light.ok_or_else(|| {
                    Failure::Usage("shadow rays need a light: --light X,Y,Z, or --sets without shadow".into())
                })?),
            };
            sets.push((set.name().into(), rays, None));
        }
        Ok(sets)
    }

    fn camera(&self, eye: DVec3) -> Result<Camera, Failure> {
        let direction = (self.look - eye).try_normalize();
        let right = direction.and_then(|direction| direction.cross(self.up).try_normalize());
        let (Some(direction), Some(right)) = (direction, right) else {
            return Err(Failure::Usage("the camera must look somewhere, and not along --up".into()));
        };
        let side = 2.0 * (self.fov.to_radians() / 2.0).tan();
        let up = right.cross(direction) * side;
        Ok(Camera {
            projection: Projection::Perspective,
            location: eye,
            direction,
            right: right * side,
            up,
            ..Camera::default()
        })
    }
}

/// A set's name: its file's, without folder and ending.
fn name_of(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// One mesh, or spheres one by one, without colours.
fn scene_of(geometry: Geometry) -> Scene {
    let vector = |[x, y, z]: [f32; 3]| DVec3::new(x.into(), y.into(), z.into());
    let objects = match geometry {
        Geometry::Mesh { vertices, triangles } => {
            let triangle = |vertices| MeshTriangle { vertices, normals: None, textures: None };
            let mesh = Mesh {
                vertices: vertices.into_iter().map(vector).collect(),
                triangles: triangles.into_iter().map(triangle).collect(),
                ..Mesh::default()
            };
            vec![Arc::new(Object::new(Shape::Mesh(Arc::new(mesh))))]
        }
        Geometry::Spheres(spheres) => {
            let sphere = |[x, y, z, r]: [f32; 4]| {
                let shape = Shape::Sphere { center: vector([x, y, z]), radius: r.into() };
                Arc::new(Object::new(shape))
            };
            spheres.into_iter().map(sphere).collect()
        }
    };
    Scene { objects, ..Scene::default() }
}

/// Tells of the first few rays whose answer is another.
fn explain(rays: &RaySet, measured: &Measured, differing: &[usize], most: usize) {
    for &row in differing.iter().take(most) {
        let ([ox, oy, oz], [dx, dy, dz]) =
            (rays.origin.each_ref().map(|c| c[row]), rays.dir.each_ref().map(|c| c[row]));
        let (t, primitive) = (measured.hits.t[row], measured.hits.primitive[row]);
        let primitive = if primitive == NO_PRIMITIVE { -1 } else { i64::from(primitive) };
        line_to_stderr(format_args!(
            "ray {row} from {ox},{oy},{oz} along {dx},{dy},{dz}: t {t}, primitive {primitive}"
        ));
    }
}

/// For `--fov`: neither nothing nor all around, and small enough to be told from that.
fn opening() -> impl Fn(&str) -> Result<f64, String> + Clone {
    number(1e-6..=179.999_999, "degrees between 0 and 180")
}

fn vector(text: &str) -> Result<DVec3, String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|x| x.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y, z] if text.split(',').count() == 3 && numbers.iter().all(|x| x.is_finite()) => {
            Ok(DVec3::new(x, y, z))
        }
        _ => Err("expected three numbers, as in 0,1.5,-2".into()),
    }
}
