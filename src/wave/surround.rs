//! Which lights have buffers, and how fine.

use super::hand_out;
use super::light::LightProgram;
use super::light_buffer::{Around, Casters, Cones, Room, are_worth_it, fill};
use crate::compile::Compiled;
use crate::lane::Scalar;

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
    let casters = match buffers {
        LightBuffers::Never => return,
        // So many lights that there is no room for what is worth it of each.
        _ if most < FEWEST_CELLS => return,
        LightBuffers::Auto if cells < FEWEST_CELLS || !are_worth_it(&scene.geometry, pixels) => return,
        LightBuffers::Auto | LightBuffers::Always => Casters::of(&scene.geometry),
    };
    hand_out(lights.iter_mut(), |lights| {
        // Memory that is needed once for all lights of a thread.
        let mut room = Room::default();
        for light in lights {
            if let Some(place) = light.shadow_point() {
                let buffer = fill(&scene.geometry, &casters, place, cells.max(FEWEST_CELLS), &mut room);
                light.around = Around::Cells(Box::new(buffer));
            }
        }
    });
}
