//! A scene's primitives before there is a tree over them: all that the choice of a precision hangs on.

use super::flatten::flatten;
use super::gathered::{Gathered, Reach, middle};
use super::instances::PlacedPrototype;
use super::looks::LooksOfMeshes;
use super::prototypes::Prototypes;
use super::{Compiled, Instancing, Objects, assemble};
use crate::bvh::Preset;
use crate::lane::Scalar;
use crate::scene::Scene;
use glam::DVec3;

/// A scene's primitives in columns of precision `S`, and what of them goes into a tree.
pub struct Primitives<S: Scalar> {
    pub(super) gathered: Gathered<S>,
    pub(super) objects: Objects,
}

impl<S: Scalar> Primitives<S> {
    /// Those of `scene`.
    pub fn of(scene: &Scene) -> Self {
        Self::with(scene, Instancing::default())
    }

    /// The same where some of what stands in several places may be kept once.
    pub fn with(scene: &Scene, instancing: Instancing) -> Self {
        let (mut origin, mut meshes) = (DVec3::ZERO, LooksOfMeshes::default());
        let prototypes = Prototypes::of(scene, instancing, &mut meshes);
        let (mut flat, mut objects) = flatten::<S>(scene, origin, (&prototypes, &mut meshes));
        let mut reach = Reach::of(&flat);
        let middle = |whole| middle(whole).unwrap_or(scene.camera.location);
        if S::UNIT_ROUNDOFF > f64::UNIT_ROUNDOFF && middle(reach.whole) != DVec3::ZERO {
            // Its columns have lost digits: once more, from the middle that double precision finds.
            let (exact, _) = flatten::<f64>(scene, DVec3::ZERO, (&prototypes, &mut meshes));
            origin = middle(Reach::of(&exact).whole);
            drop(exact);
            (flat, objects) = flatten::<S>(scene, origin, (&prototypes, &mut meshes));
            reach = Reach::of(&flat);
        }
        Self { gathered: Gathered::of(flat, prototypes.all, origin, reach), objects }
    }

    /// True if a few are so much larger than all others that they stand beside the tree.
    pub fn have_giants(&self) -> bool {
        self.gathered.giants
    }

    /// True if something shared stands in a place whose map is beyond single precision.
    pub fn have_extreme_places(&self) -> bool {
        self.gathered.flat.placed.iter().any(PlacedPrototype::is_extreme)
    }

    /// True if boxes in precision `B` would tell little of where they are: a thousand far stars around a table.
    pub fn are_too_fine_for<B: Scalar>(&self) -> bool {
        self.gathered.items.are_too_fine_for::<B>()
    }

    /// With a tree over them, of those that were made from the same `scene`.
    pub fn compile<B: Scalar>(self, scene: &Scene, preset: Preset) -> Compiled<S, B> {
        let Objects { bodies, mesh_bodies, owners, textures, interiors } = self.objects;
        Compiled {
            geometry: assemble::assemble(self.gathered, preset),
            bodies,
            mesh_bodies,
            owners,
            textures,
            fades: interiors.iter().any(|interior| interior.fade_distance != 0.0),
            interiors,
            lights: scene.lights.clone(),
            camera: scene.camera.clone(),
            globals: scene.globals.clone(),
            background: scene.background,
        }
    }
}
