//! How fast each kind of ray is: a picture's camera rays, and what they become where they hit, in every precision, eight
//! at a time and one by one.
//!
//! The rays are walked to their nearest hits (shadow rays to any) and nothing is shaded, so that kinds can be told apart,
//! as they cannot within a picture.

use super::Args;
use crate::cli::number::median;
use crate::cli::paths::csv_field;
use octray::bvh::Preset;
use octray::ray_set::RaySet;
use octray::render::{Precision, Traversal};
use octray::scene::Scene;
use octray::workbench::{CameraRays, Workbench};
use serde::Serialize;

/// One precision and walk.
#[derive(Debug, Serialize)]
pub struct Walk {
    pub precision: &'static str,
    /// `packets` or `single`.
    pub walk: &'static str,
    /// Mrays/s in the order of [`KINDS`]; `None` where there are no such rays.
    pub mrays_per_s: [Option<f64>; 4],
}

/// Kinds of rays: a square of camera rays, their hits to the scene's first light, mirrored there, and scattered there by the
/// cosine.
pub const KINDS: [&str; 4] = ["camera", "shadow", "mirror", "diffuse"];

const PRECISIONS: [(&str, Precision); 3] =
    [("fast", Precision::Fast), ("exact", Precision::Exact), ("strict", Precision::Strict)];

/// Names of the walks.
pub const WALKS: [(&str, Traversal); 2] = [("packets", Traversal::Packet), ("single", Traversal::Single)];

/// Side of the square of camera rays: a multiple of 8.
const SIDE: usize = 256;

/// The walks of all precisions; rounds go through all of them before the next begins.
pub fn measure(scene: &Scene, args: &Args) -> Result<Vec<Walk>, rayon::ThreadPoolBuildError> {
    let benches: Vec<Workbench> = PRECISIONS
        .iter()
        .map(|&(_, precision)| Workbench::new(scene, precision, Preset::default(), args.threads))
        .collect::<Result<_, _>>()?;
    let sets = sets(&benches[1], scene);
    let mut seconds = vec![Vec::new(); benches.len() * WALKS.len() * KINDS.len()];
    for _ in 0..args.rounds {
        let mut lists = seconds.iter_mut();
        for bench in &benches {
            for (_, walk) in WALKS {
                for (set, list) in sets.iter().zip(&mut lists) {
                    list.extend(
                        set.as_ref().and_then(|set| bench.measure(set, walk, 1).wall_s.first().copied()),
                    );
                }
            }
        }
    }
    let mut seconds = seconds.into_iter().map(median);
    let mut walks = Vec::new();
    for (precision, _) in PRECISIONS {
        for (walk, _) in WALKS {
            let speed = |kind: usize| {
                let seconds = seconds.next().unwrap_or_default();
                sets[kind].as_ref().map(|set| set.len() as f64 / seconds.max(1e-9) * 1e-6)
            };
            walks.push(Walk { precision, walk, mrays_per_s: [0, 1, 2, 3].map(speed) });
        }
    }
    Ok(walks)
}

/// In the order of [`KINDS`]; `None` for empty sets, and for shadow rays where there is no light.
fn sets(bench: &Workbench, scene: &Scene) -> [Option<RaySet>; 4] {
    let made = CameraRays::new(bench, &scene.camera, SIDE);
    let shadow = scene.lights.first().map(|light| made.shadow(light.location));
    let (mirror, diffuse) = (made.mirror(), made.diffuse());
    [Some(made.camera), shadow, Some(mirror), Some(diffuse)].map(|set| set.filter(|set| !set.is_empty()))
}

/// One line a scene, precision and walk.
pub fn csv<'a>(scenes: impl Iterator<Item = (&'a str, &'a [Walk])>) -> String {
    let mut text = String::from("scene,precision,walk");
    KINDS.iter().for_each(|kind| text += &format!(",{kind}_mrays_per_s"));
    text.push('\n');
    for (scene, walks) in scenes {
        for walk in walks {
            text += &format!("{},{},{}", csv_field(scene), walk.precision, walk.walk);
            for speed in walk.mrays_per_s {
                text += &speed.map_or_else(|| ",".into(), |speed| format!(",{speed:.3}"));
            }
            text.push('\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_that_are_missing_leave_their_column_empty() {
        let walks = [Walk {
            precision: "fast",
            walk: "single",
            mrays_per_s: [Some(1.25), None, Some(2.0), Some(0.5)],
        }];
        let text = csv([("a,b", &walks[..])].into_iter());
        assert!(text.ends_with("\na_b,fast,single,1.250,,2.000,0.500\n"), "{text}");
    }
}
