//! What stands in several places, meshes and composites: one tree for all of them, in a space of its own, which rays are moved to (Rubin
//! and Whitted 1980, A 3-dimensional representation for fast rendering of complex scenes).
//!
//! What stands once, or is small, has its primitives in the scene's own columns: a ray is through with those sooner.

use super::tag::Tag;
use super::{Geometry, SurfaceId};
use crate::kernel::Aabb;
use crate::lane::Scalar;
use crate::scene::Transform;
use glam::{DMat3, DVec3};

/// What has one tree for all places where it stands. The picture is the same, but for roundings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Instancing {
    /// That of which it saves more than it costs.
    #[default]
    Auto,
    /// All that stands in several places.
    Always,
    /// Nothing.
    Never,
}

/// What is shared, and where it stands.
pub struct Instances<S: Scalar, B: Scalar> {
    /// Each in its own space.
    pub prototypes: Vec<Geometry<S, B>>,
    /// In the order of the tree's leaves.
    pub rows: Vec<Instance<S>>,
    /// By look of an instance's prototype, its owner: see [`Instance::owners`].
    owners: Vec<u32>,
}

/// A prototype in one of its places.
#[derive(Debug, Clone)]
pub struct Instance<S> {
    /// Which.
    pub prototype: u32,
    /// The first of its surfaces, which are in the order of its prototype's.
    pub first: SurfaceId,
    /// Where the zero of the prototype's columns lies, in those of the scene.
    pub center: [S; 3],
    /// Rows of the linear map from the scene's space to the prototype's,
    pub to_own: [[S; 3]; 3],
    /// and back.
    pub to_scene: [[S; 3]; 3],
    /// Around it.
    pub bounds: Aabb,
    /// What an eye is in that is in it, if it has an inside.
    pub interior: Option<u32>,
    /// Place of its first look's owner.
    owners: u32,
}

impl<S: Scalar, B: Scalar> Default for Instances<S, B> {
    fn default() -> Self {
        Self { prototypes: Vec::new(), rows: Vec::new(), owners: Vec::new() }
    }
}

impl<S: Scalar, B: Scalar> Instances<S, B> {
    /// Of `placed` prototypes in the `order` of the tree's leaves, whose surfaces are numbered from `first` on.
    pub(super) fn new(
        prototypes: Vec<Geometry<S, B>>,
        placed: &[PlacedPrototype],
        order: &[u32],
        mut first: SurfaceId,
    ) -> Self {
        let mut all = Self { prototypes, rows: Vec::new(), owners: Vec::new() };
        for &row in order {
            let PlacedPrototype { number, place, owners, bounds, interior, .. } = &placed[row as usize];
            let geometry = &all.prototypes[*number as usize];
            let single = |v: DVec3| v.to_array().map(S::from_f64);
            let rows = |m: DMat3| [0, 1, 2].map(|k| single(m.row(k)));
            all.rows.push(Instance {
                prototype: *number,
                first,
                center: single(place.point(geometry.origin)),
                to_own: rows(place.inverse.matrix3),
                to_scene: rows(place.forward.matrix3),
                bounds: *bounds,
                interior: *interior,
                owners: all.owners.len() as u32,
            });
            first += geometry.owner.len() as u32;
            all.owners.extend_from_slice(owners);
        }
        all
    }

    /// True without any.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Bytes of the prototypes and of their places.
    pub(super) fn bytes(&self) -> usize {
        let prototypes: usize = self.prototypes.iter().map(Geometry::bytes).sum();
        prototypes + size_of_val(&self.rows[..]) + size_of_val(&self.owners[..])
    }

    /// Whose a surface of an instance is.
    pub(super) fn owner_of(&self, row: usize, surface: SurfaceId) -> u32 {
        let look = self.prototype_of(row).owner[self.own(row, surface)];
        self.owners[(self.rows[row].owners + look) as usize]
    }

    /// A surface's place among those of its instance.
    pub(super) fn place_of(&self, row: usize, surface: SurfaceId) -> u32 {
        self.prototype_of(row).ranks.of(self.own(row, surface) as SurfaceId)
    }

    /// True of a surface that is part of a composite and turned inside out there; `None` of what is no part of one.
    pub(super) fn is_inverted(&self, row: usize, surface: SurfaceId) -> Option<bool> {
        let prototype = self.prototype_of(row);
        let part = prototype.part_of(self.own(row, surface) as SurfaceId)?;
        Some(prototype.csg.parts[part as usize].inverted)
    }

    fn prototype_of(&self, row: usize) -> &Geometry<S, B> {
        &self.prototypes[self.rows[row].prototype as usize]
    }

    /// The number that a surface of an instance has in its prototype.
    fn own(&self, row: usize, surface: SurfaceId) -> usize {
        (surface - self.rows[row].first) as usize
    }
}

/// A prototype in one of its places, before there is a tree.
#[derive(Debug, Clone)]
pub(super) struct PlacedPrototype {
    /// Which.
    pub number: u32,
    /// From its own space to that of the scene's columns.
    pub place: Transform,
    /// That of its first surface.
    pub tag: Tag,
    /// By look.
    pub owners: Vec<u32>,
    /// Around it.
    pub bounds: Aabb,
    /// See [`Instance::interior`].
    pub interior: Option<u32>,
}

impl PlacedPrototype {
    /// True if lengths change so much on the way to the prototype's space or back that their squares may be beyond single precision.
    pub fn is_extreme(&self) -> bool {
        let Transform { forward, inverse } = &self.place;
        let numbers = [forward, inverse].map(|map| map.matrix3.to_cols_array());
        numbers.as_flattened().iter().any(|x| x.abs() > LARGEST)
    }
}

/// See [`PlacedPrototype::is_extreme`].
const LARGEST: f64 = 1e12;
