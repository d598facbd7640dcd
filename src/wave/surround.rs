//! Which lights have buffers, and how fine.

use super::hand_out;
use super::light::LightProgram;
use super::light_buffer::{Around, Casters, Cones, Grounds, Openings, Room, are_worth_it, count, fill};
use crate::compile::Compiled;
use crate::lane::Scalar;
use std::sync::Arc;

/// Whether lights have buffers. The picture is the same but for the order in which light is summed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LightBuffers {
    /// Where they save more than they cost.
    #[default]
    Auto,
    /// All lights to whose place shadow rays go.
    Always,
    /// None.
    Never,
}

/// Pixels to a cell of a light: the more pixels, the finer the cells that pay. (Of a city of 3,000 convex solids under 25 lamps, tracing
/// and shading take 0.64, 0.42 and 0.37 of the instructions with 4, 16 and 32 thousand cells a light, which take 3, 6
/// and 11 million a light to fill.)
const PIXELS_A_CELL: usize = 32;
/// Pictures with fewer cells than these are done sooner without.
const FEWEST_CELLS: usize = 256;
/// Most cells of a light: a megabyte.
const MOST_CELLS: usize = 1 << 16;
/// Most cells of all lights together.
const MOST_OF_ALL: usize = 1 << 22;

/// Cells of a light that casters are drawn into, at most, for each pixel. To draw into one takes about 0.1 us, and a shadow ray that is
/// looked up instead of traced spares 0.03 us: with more than this, plain scenes of spheres, boxes or cones took 1.1 to 1.8 times as
/// long with buffers as without.
const DRAWN_A_PIXEL: f64 = 0.25;
/// As many more if all surfaces are mirrors or see-through: there are more shadow rays then, from scattered places, and each spares
/// 0.08 us or more.
const DRAWN_AMONG_MIRRORS: f64 = 0.25;

/// Things and parts of things that are drawn into windows, for all lights, at most for each pixel: of frames of 88 and of 1,700 under two
/// lights the windows spare 12 to 15 ns a pixel.
const DRAWN_IN_WINDOWS: f64 = 1.0 / 32.0;

/// The share of surfaces that send rays on.
fn mirrors<S: Scalar, B: Scalar>(scene: &Compiled<S, B>) -> f64 {
    let sends_on = |texture: u32| {
        let row = &scene.textures.textures[texture as usize];
        let layers = &scene.textures.programs[row.program as usize].layers;
        !row.opaque || layers.iter().any(|layer| layer.finish.reflection.is_some())
    };
    let owners: Vec<bool> = scene.owners.iter().map(|owner| sends_on(owner.textures[0])).collect();
    let surfaces = &scene.geometry.owner;
    let count = surfaces.iter().filter(|&&owner| owners.get(owner as usize).is_some_and(|&it| it)).count();
    count as f64 / surfaces.len().max(1) as f64
}

/// Gives lights their buffers for a picture of so many pixels.
pub fn surround<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    lights: &mut [LightProgram],
    buffers: LightBuffers,
    pixels: usize,
) {
    let most = MOST_CELLS.min(MOST_OF_ALL / lights.len().max(1));
    let cells = (pixels / PIXELS_A_CELL).min(most);
    if buffers == LightBuffers::Auto && scene.geometry.bvh.is_small() {
        let casters = Casters::of(&scene.geometry);
        let bounded = casters.bounded(&scene.geometry);
        for light in lights {
            if let Some(place) = light.shadow_point() {
                light.around = Around::Cones(Cones::of::<S>(&casters, &bounded, place));
            }
        }
        return;
    }
    let mut most_drawn = f64::INFINITY;
    if buffers == LightBuffers::Auto {
        most_drawn = pixels as f64 * (DRAWN_A_PIXEL + DRAWN_AMONG_MIRRORS * mirrors(scene));
    }
    let casters = match buffers {
        LightBuffers::Never => return,
        // So many lights that there is no room for what is worth it of each.
        _ if most < FEWEST_CELLS => return,
        LightBuffers::Auto if cells < FEWEST_CELLS || !are_worth_it(&scene.geometry, pixels, most_drawn) => {
            return open(scene, lights, pixels);
        }
        LightBuffers::Auto | LightBuffers::Always => Casters::of(&scene.geometry),
    };
    let room = Room::default();
    hand_out(lights.iter_mut(), |lights| {
        for light in lights {
            if let Some(place) = light.shadow_point() {
                let size = (cells.max(FEWEST_CELLS), most_drawn);
                if let Some(buffer) = fill(&scene.geometry, &casters, place, size, &room) {
                    light.around = Around::Cells(Box::new(buffer));
                }
            }
        }
    });
}

/// Gives lights that have no cells their windows, if that is little beside a picture of so many pixels.
fn open<S: Scalar, B: Scalar>(scene: &Compiled<S, B>, lights: &mut [LightProgram], pixels: usize) {
    let drawn = count(&scene.geometry).saturating_mul(lights.len());
    if drawn as f64 > DRAWN_IN_WINDOWS * pixels as f64 {
        return;
    }
    let casters = Casters::of(&scene.geometry);
    let bounded = casters.bounded(&scene.geometry);
    let Some(grounds) = Grounds::of(&scene.geometry, &bounded).map(Arc::new) else { return };
    for light in lights {
        let place = light.shadow_point();
        let open = |place| Openings::of(&scene.geometry, &casters, (&bounded, &grounds), place);
        if let Some(openings) = place.and_then(open) {
            light.around = Around::Openings(openings);
        }
    }
}
