//! What a hit shows: one texture, but on cut faces and between corners that wear different ones.

use super::composite::Parts;
use super::hits::Looks;
use super::query::Query;
use crate::compile::Compiled;
use crate::csg::Scratch;
use crate::kernel::Surfaces;
use crate::lane::{Lane, Scalar};

/// The textures that a hit shows; kept from hit to hit so that nothing is allocated.
#[derive(Debug, Default)]
pub struct Shown {
    /// Each with its share.
    textures: Vec<(u32, f64)>,
    /// Parts that a cut face lies in.
    parts: Vec<(u32, u8)>,
    scratch: Scratch,
}

impl Shown {
    /// What `lane` of `query` shows: POV-Ray leaves out textures too faint to be followed.
    #[inline]
    pub fn find<S: Scalar, B: Scalar>(
        &mut self,
        scene: &Compiled<S, B>,
        query: &Query<S::Lane>,
        (looks, found): (&Looks, &Surfaces<S::Lane>),
        lane: usize,
    ) -> &[(u32, f64)] {
        self.textures.clear();
        if looks.cuts >> lane & 1 == 1 {
            self.find_cut(scene, query, looks.owner[lane], lane);
        } else if looks.blends >> lane & 1 == 1 {
            let (u, v) = (found.u.lanes()[lane].to_f64(), found.v.lanes()[lane].to_f64());
            let shares = [S::from_f64(1.0 - u - v).to_f64(), u, v];
            self.textures.extend(scene.owners[looks.owner[lane] as usize].textures.into_iter().zip(shares));
        } else {
            self.textures.push((looks.texture[lane], 1.0));
            return &self.textures;
        }
        self.textures.retain(|(_, share)| *share >= scene.globals.adc_bailout);
        &self.textures
    }

    /// The textures of the parts that a hit on a cut face lies in, in equal shares.
    fn find_cut<S: Scalar, B: Scalar>(
        &mut self,
        scene: &Compiled<S, B>,
        query: &Query<S::Lane>,
        owner: u32,
        lane: usize,
    ) {
        let Self { textures, parts, scratch } = self;
        let mut room = None;
        let rays = query.rays.in_double(&mut room);
        if let Some(part) = scene.geometry.part_of(query.surface[lane]) {
            let composite =
                &scene.geometry.csg.composites[scene.geometry.csg.parts[part as usize].composite as usize];
            let source = Parts { scene: &scene.geometry, left: &query.left, part: &query.part, starts: true };
            // Two roundings: of `t` itself, and of the ray that it was found along.
            let at = (1 << lane, query.t.to_f64s(), 2.0 * S::UNIT_ROUNDOFF);
            parts.clear();
            scene.geometry.csg.parts_at(composite, rays, at, &source, scratch, parts);
            let owners =
                parts.iter().map(|(part, _)| scene.geometry.owner_of(scene.geometry.first_part + part));
            let lending = owners.map(|owner| &scene.owners[owner as usize]).filter(|owner| !owner.cut);
            textures.extend(lending.map(|owner| (owner.textures[0], 1.0)));
        }
        if textures.is_empty() {
            textures.push((scene.owners[owner as usize].textures[0], 1.0));
        }
        let share = 1.0 / textures.len() as f64;
        textures.iter_mut().for_each(|(_, of_texture)| *of_texture = share);
    }
}
