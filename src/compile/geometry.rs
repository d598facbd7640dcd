//! What rays meet: primitives in columns, a tree over them, and a number for every surface.

use super::{Columns, Instances, Kind, SurfaceId};
use crate::bvh::{Bvh, GROUP, Run};
use crate::csg::CsgTree;
use crate::kernel::Ranks;
use crate::lane::{LANES, Scalar};
use glam::DVec3;

/// Primitives in precision `S` under boxes in precision `B`: those of a scene, or of something that stands in several places of one.
pub struct Geometry<S: Scalar, B: Scalar> {
    /// Subtracted from world coordinates (or from a prototype's own) before they become columns: zero in double precision; in
    /// single precision the middle of the scene, so that a scene far from the world's origin keeps its digits.
    pub origin: DVec3,
    /// Primitives that stand by themselves.
    pub columns: Columns<S>,
    /// First surface number of each kind.
    pub base: Vec<SurfaceId>,
    /// Parts of composites, always in double precision.
    pub parts: Columns<f64>,
    /// What the parts make up.
    pub csg: CsgTree,
    /// First surface number of a part.
    pub first_part: SurfaceId,
    /// By surface number, but for surfaces of instances: its kind; of parts with [`PART`](super::PART) set.
    pub kinds: Vec<u8>,
    /// The same: index into [`Compiled::owners`](super::Compiled::owners); of a prototype, which of its looks.
    pub owner: Vec<u32>,
    /// Which of surfaces at one place is seen; an instance decides for itself among its own.
    pub ranks: Ranks,
    /// What stands in several places and is kept once.
    pub instances: Instances<S, B>,
    /// Without finite bounds: tested before the tree.
    pub unbounded: Vec<Run>,
    /// Over everything else.
    pub bvh: Bvh<B>,
    /// Union of the classes of all runs.
    pub classes: u8,
    /// What is nearer to a ray's start than this is not told well by single precision (see [`Block::blurred`](crate::kernel::Block::blurred)):
    /// in scene units, 0 in double precision.
    pub blurred: S,
}

impl<S: Scalar, B: Scalar> Geometry<S, B> {
    /// Bytes of the tree, of triangles' and spheres' columns, and of the tables by surface number.
    pub fn bytes(&self) -> usize {
        let columns: usize = Kind::ALL.iter().map(|&kind| self.columns.bytes(kind)).sum();
        let tables =
            size_of_val(&self.kinds[..]) + size_of_val(&self.owner[..]) + size_of_val(self.ranks.rows());
        self.bvh.bytes() + columns + tables + self.instances.bytes()
    }

    /// Kind and row of a surface that is no part of a composite, and of no instance.
    #[inline(always)]
    pub fn row_of(&self, surface: SurfaceId) -> (u8, u32) {
        let kind = self.kinds[surface as usize];
        (kind, surface - self.base[usize::from(kind)])
    }

    /// The number of the part that a surface is, if it is one.
    #[inline(always)]
    pub fn part_of(&self, surface: SurfaceId) -> Option<u32> {
        surface.checked_sub(self.first_part).filter(|&part| (part as usize) < self.csg.parts.len())
    }

    /// The kind of a surface as [`Geometry::kinds`] has it, [`INSTANCE`](super::INSTANCE) for those of instances.
    #[inline(always)]
    pub fn kind_of(&self, surface: SurfaceId) -> u8 {
        self.kinds.get(surface as usize).copied().unwrap_or(super::INSTANCE)
    }

    /// Whose a surface is: see [`Geometry::owner`].
    #[inline(always)]
    pub fn owner_of(&self, surface: SurfaceId) -> u32 {
        match self.owner.get(surface as usize) {
            Some(&owner) => owner,
            None => self.owner_in_instance(surface),
        }
    }

    /// A surface's place in the order of declaration, also among those of its instance.
    #[inline(always)]
    pub fn place_of(&self, surface: SurfaceId) -> u32 {
        match self.ranks.rows().get(surface as usize) {
            Some(&place) => place,
            None => self.place_in_instance(surface),
        }
    }

    /// True of parts that are turned inside out, also in instances; `None` of what is no part of a composite.
    pub fn is_inverted(&self, surface: SurfaceId) -> Option<bool> {
        match self.part_of(surface) {
            Some(part) => Some(self.csg.parts[part as usize].inverted),
            None => self.instances.is_inverted(self.ranks.stretch(surface)?, surface),
        }
    }

    #[cold]
    fn owner_in_instance(&self, surface: SurfaceId) -> u32 {
        self.ranks.stretch(surface).map_or(0, |row| self.instances.owner_of(row, surface))
    }

    #[cold]
    fn place_in_instance(&self, surface: SurfaceId) -> u32 {
        let place = self.ranks.of(surface);
        self.ranks.stretch(surface).map_or(place, |row| place + self.instances.place_of(row, surface))
    }

    /// The first place of all surfaces.
    pub fn first_place(&self) -> u32 {
        let instances = self.instances.rows.iter().map(|instance| self.ranks.of(instance.first));
        self.ranks.rows().iter().copied().chain(instances).min().unwrap_or(0)
    }

    /// True if it has triangles by themselves, whose tests want a ray's view.
    pub fn has_triangles(&self) -> bool {
        self.columns.len(Kind::Triangle) + self.columns.len(Kind::SmoothTriangle) > 0
    }

    /// How many packets had better go through the tree together. Twice eight share the cost of nodes, which is little where leaves take
    /// long, and where few of the packets come to an instance. (By turns with eight, while bounds were made for sixteen whatever
    /// there was, frames with 2,500 and 1,600 instances took 1.07 and 1.03 of the time, tori and composites 1.01 to 1.02; meshes
    /// 0.93 to 1.01. Where trees are walked box by box, tori and composites take 0.98 to 0.99 of the instructions.)
    pub fn group_size(&self) -> usize {
        let long = self.bvh.together && !self.bvh.goes_box_by_box();
        if long || !self.instances.is_empty() { LANES } else { GROUP }
    }

    /// True if any run has a class of `filter`.
    pub fn has_class(&self, filter: u8) -> bool {
        self.classes & filter != 0
    }
}
