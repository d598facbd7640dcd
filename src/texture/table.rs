//! All textures of a scene, the like ones folded together.

use super::{Highlights, LayerProgram, PatternProgram, PigmentProgram, Program};
use crate::scene::noise::Generator;
use crate::scene::{Color, Finish, Globals, Opacity, PigmentKind, Texture, Transform};
use glam::DVec3;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;
use std::sync::Arc;

/// Textures by number.
#[derive(Debug, Default)]
pub struct TextureTable {
    /// One for each different texture in its place.
    pub textures: Vec<TextureRow>,
    /// What they do, apart from plain colours.
    pub programs: Vec<Program>,
}

/// One texture.
#[derive(Debug, Clone)]
pub struct TextureRow {
    /// Its number among the programs.
    pub program: u32,
    /// A colour for each layer, top layer first; only those of plain layers are read.
    pub colors: SmallVec<[Color; 1]>,
    /// Blocks all light, by POV-Ray's static test.
    pub opaque: bool,
}

/// Fills a [`TextureTable`].
#[derive(Debug, Default)]
pub struct TextureBuilder {
    table: TextureTable,
    /// Textures already seen: by address (kept alive in `kept`) and place, if the place matters.
    seen: FxHashMap<(usize, Option<[u64; 12]>), u32>,
    /// Programs of plain textures by the bits of their finishes.
    plain: FxHashMap<Vec<u64>, u32>,
    kept: Vec<Arc<Texture>>,
    /// Subtracted from world points before they reach the kernels and the textures.
    origin: DVec3,
    /// The scene's.
    opacity: Opacity,
    generator: Generator,
}

impl TextureBuilder {
    /// For points relative to `origin`, in a scene of these settings.
    pub fn new(origin: DVec3, globals: &Globals) -> Self {
        let (opacity, generator) = (globals.opacity, globals.noise_generator);
        Self { origin, opacity, generator, ..Self::default() }
    }

    /// The number of `texture`, carried by an object whose parent space leads to the world by `world_from_parent`.
    pub fn add(&mut self, texture: &Arc<Texture>, world_from_parent: &Transform) -> u32 {
        let uniform = texture.is_uniform();
        let place = texture.transform.then(world_from_parent);
        let key = (Arc::as_ptr(texture) as usize, (!uniform).then(|| bits_of(&place)));
        if let Some(&number) = self.seen.get(&key) {
            return number;
        }
        let program =
            if uniform { self.plain_program(texture) } else { self.new_program(texture, Some(&place)) };
        let number = self.table.textures.len() as u32;
        let colors = texture
            .layers
            .iter()
            .rev()
            .map(|layer| match &layer.pigment.kind {
                PigmentKind::Solid(color) => *color,
                PigmentKind::Other { stand_in, .. } => **stand_in,
                _ => Color::default(),
            })
            .collect();
        self.table.textures.push(TextureRow { program, colors, opaque: texture.is_opaque() });
        self.seen.insert(key, number);
        self.kept.push(texture.clone());
        number
    }

    /// The finished table.
    pub fn finish(self) -> TextureTable {
        self.table
    }

    fn plain_program(&mut self, texture: &Texture) -> u32 {
        let key = texture.layers.iter().flat_map(|layer| finish_bits(&layer.finish)).collect();
        if let Some(&program) = self.plain.get(&key) {
            return program;
        }
        let program = self.new_program(texture, None);
        self.plain.insert(key, program);
        program
    }

    fn new_program(&mut self, texture: &Texture, place: Option<&Transform>) -> u32 {
        let layers = texture
            .layers
            .iter()
            .rev()
            .map(|layer| LayerProgram {
                finish: Finish::clone(&layer.finish),
                highlights: Highlights::of(&layer.finish),
                pigment: match (&layer.pigment.kind, place) {
                    (PigmentKind::Solid(_) | PigmentKind::Other { .. }, _) | (_, None) => {
                        PigmentProgram::Plain
                    }
                    (_, Some(place)) => {
                        let place = layer.pigment.transform.then(place);
                        PigmentProgram::Pattern(Box::new(PatternProgram::new(
                            &layer.pigment.kind,
                            &place,
                            self.origin,
                            self.generator,
                        )))
                    }
                },
                opacity: self.opacity,
            })
            .collect();
        self.table.programs.push(Program { layers });
        self.table.programs.len() as u32 - 1
    }
}

fn bits_of(place: &Transform) -> [u64; 12] {
    place.forward.to_cols_array().map(f64::to_bits)
}

fn finish_bits(f: &Finish) -> [u64; 26] {
    let r = &f.reflection;
    [
        f.ambient.x,
        f.ambient.y,
        f.ambient.z,
        f.emission.x,
        f.emission.y,
        f.emission.z,
        f.diffuse,
        f.diffuse_back,
        f.brilliance,
        f.phong,
        f.phong_size,
        f.specular,
        f.roughness,
        f.metallic,
        f.irid,
        f.irid_thickness,
        r.min.x,
        r.min.y,
        r.min.z,
        r.max.x,
        r.max.y,
        r.max.z,
        r.falloff,
        r.exponent,
        r.metallic,
        f64::from(u8::from(r.fresnel) + 2 * u8::from(f.conserve_energy)),
    ]
    .map(f64::to_bits)
}
