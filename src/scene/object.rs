//! Shapes, and what an object adds to its shape.

use super::{Interior, Mesh, OtherShape, PhotonUse, Placement, Polynomial, Texture, Transform};
use glam::DVec3;
use std::sync::Arc;

/// A shape with its place, look and flags: one node of the tree that a scene file builds.
///
/// `shape` lives in the object's own space; `transform` leads from there to the *parent space* (the shape of the
/// composite it stands in, or the world). `texture`, `interior_texture`, `clipped_by` and `bounded_by` live in the
/// parent space, because a transform moves only what stands before it: whoever transforms an object transforms
/// these too. [`Object::transformed`] does all of it.
///
/// A child without a texture or interior has its nearest ancestor's; the evaluator has given every top-level
/// object a texture, but for a composite with `cutaway_textures`: without one of its own its cut faces show what they
/// cut.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// The geometry.
    pub shape: Shape,
    /// From the object's own space to its parent's.
    pub transform: Placement,
    /// Its look.
    pub texture: Option<Arc<Texture>>,
    /// What is in it; compared by identity, but see `own_interiors`.
    pub interior: Option<Arc<Interior>>,
    /// What few objects have. Apart, as scenes of millions of objects spend their reading time on fetching memory.
    pub more: Option<Box<More>>,
    /// Textures are asked at places on the surface; not rendered.
    pub uv_mapping: bool,
    /// Switches.
    pub flags: Flags,
    /// The interiors of its children (and theirs) are its own, each wherever it is met, though they share an `Arc` with
    /// other objects: it is a copy of a declared composite.
    pub own_interiors: bool,
}

/// What few objects have.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct More {
    /// Its look from inside, if another.
    pub interior_texture: Option<Arc<Texture>>,
    /// Only what is inside all of these is there.
    pub clipped_by: Vec<Arc<Object>>,
    /// The user's word for how far it reaches. A hint for infinite shapes, but it holds a union together: see
    /// [`Object::is_split`].
    pub bounded_by: Vec<Arc<Object>>,
    /// It is a union that shall not be split (`split_union off`).
    pub unsplit: bool,
    /// What is said of photons; not rendered.
    pub photons: Option<PhotonUse>,
    /// The box that a script is told of a composite, a mesh or a quadric, in the parent's space: each move puts a new one
    /// about the corners of the one before, and so it grows as POV-Ray's does. Rendering does not ask.
    pub extent: Option<(DVec3, DVec3)>,
}

/// Geometry, in the object's own space.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// All points `radius` from `center`.
    Sphere {
        /// Middle.
        center: DVec3,
        /// Over 0.
        radius: f64,
    },
    /// All points with `normal . p = distance`; inside is the side the normal points away from.
    Plane {
        /// Unit length.
        normal: DVec3,
        /// From the origin along `normal`.
        distance: f64,
    },
    /// Between two corners, `min <= max` in each axis.
    Box {
        /// Lowest corner.
        min: DVec3,
        /// Highest corner.
        max: DVec3,
    },
    /// A cylinder (`base_radius == cap_radius`) or cone between two points.
    Cone {
        /// Middle of the one end.
        base: DVec3,
        /// Radius there.
        base_radius: f64,
        /// Middle of the other end.
        cap: DVec3,
        /// Radius there.
        cap_radius: f64,
        /// Without its two ends. It is a solid all the same for `inside`.
        open: bool,
    },
    /// A flat ring. Its inside, for constructive geometry, is the side its normal points away from.
    Disc {
        /// Middle.
        center: DVec3,
        /// Unit length.
        normal: DVec3,
        /// Outer radius.
        radius: f64,
        /// Radius of the hole, 0 for none.
        hole: f64,
    },
    /// About the y axis.
    Torus {
        /// From the middle to the middle of the tube.
        major: f64,
        /// Of the tube.
        minor: f64,
    },
    /// Where a polynomial in the coordinates is 0; inside it is negative. `sturm` is left out: the roots found are the same.
    Polynomial(Arc<Polynomial>),
    /// One triangle, flat or with a normal per corner.
    Triangle {
        /// Corners. (Behind a pointer: with them every object would be larger.)
        vertices: Box<[DVec3; 3]>,
        /// Normals at the corners, blended as they are: a longer one weighs more.
        normals: Option<Box<[DVec3; 3]>>,
    },
    /// One or more closed outlines in one plane; a point is in it if it is within an odd number of them.
    Polygon {
        /// Each outline once round, the first point not repeated at the end.
        outlines: Vec<Vec<DVec3>>,
    },
    /// Many triangles.
    Mesh(Arc<Mesh>),
    /// One that is read but not rendered: it has no points.
    Other(Arc<OtherShape>),
    /// Several objects made one.
    Csg {
        /// How.
        op: CsgOp,
        /// In order of declaration; never empty. The order has meaning for `Difference` and on ties.
        children: Vec<Arc<Object>>,
        /// Cut faces show the texture of the object that was cut.
        cutaway_textures: bool,
    },
}

/// Constructive solid geometry (manual section 3.4.5.5).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CsgOp {
    /// All surfaces of all children.
    Union,
    /// All surfaces that are not inside another child.
    Merge,
    /// What is inside every child.
    Intersection,
    /// What is inside the first child and no other. The others' `inverse` flags are *not* set here: the reader
    /// of the tree turns them inside out.
    Difference,
}

/// An object's switches, all off by default. Set on a composite they hold for its children too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Flags {
    /// Throws no shadow.
    pub no_shadow: bool,
    /// Not seen by camera rays.
    pub no_image: bool,
    /// Not seen by reflected rays.
    pub no_reflection: bool,
    /// Holds air, not stuff: fog and media go on inside it.
    pub hollow: bool,
    /// Inside and outside change places.
    pub inverse: bool,
    /// They have changed places, be it back again: of a union this leaves a merge, as POV-Ray makes an intersection of it and
    /// a merge of that.
    pub turned: bool,
    /// Lit from both sides.
    pub double_illuminate: bool,
}

impl Flags {
    /// True of what is inside out or has been.
    pub fn is_turned(self) -> bool {
        self.inverse || self.turned
    }
}

impl Object {
    /// An object that is only its shape.
    pub fn new(shape: Shape) -> Self {
        Self {
            shape,
            transform: Placement::IDENTITY,
            texture: None,
            interior: None,
            more: None,
            uv_mapping: false,
            flags: Flags::default(),
            own_interiors: false,
        }
    }

    /// The object moved by `next`, with everything that has been said of it so far.
    pub fn transformed(mut self, next: &Transform) -> Self {
        self.move_by(next);
        self
    }

    /// As [`Object::transformed`], in place.
    pub fn move_by(&mut self, next: &Transform) {
        self.transform.move_by(next);
        let move_texture = |texture: &mut Arc<Texture>| {
            if !texture.is_still() {
                *texture = Arc::new(texture.transformed(next));
            }
        };
        self.texture.iter_mut().for_each(move_texture);
        if let Some(more) = &mut self.more {
            more.interior_texture.iter_mut().for_each(move_texture);
            for helper in more.clipped_by.iter_mut().chain(&mut more.bounded_by) {
                Arc::make_mut(helper).move_by(next);
            }
            if let Some((min, max)) = more.extent {
                more.extent = Some(next.box_about(min, max));
            }
        }
    }

    /// Its look from inside, if another.
    pub fn interior_texture(&self) -> Option<&Arc<Texture>> {
        self.more.as_ref().and_then(|more| more.interior_texture.as_ref())
    }

    /// Only what is inside all of these is there.
    pub fn clipped_by(&self) -> &[Arc<Object>] {
        self.more.as_ref().map_or(&[], |more| &more.clipped_by)
    }

    /// The user's word for how far it reaches.
    pub fn bounded_by(&self) -> &[Arc<Object>] {
        self.more.as_ref().map_or(&[], |more| &more.bounded_by)
    }

    /// True of a union that is no more than its parts, each of which is as good as an object of its own. POV-Ray makes one
    /// object of a union that is bounded, clipped or turned, or has `split_union off`.
    pub fn is_split(&self) -> bool {
        matches!(self.shape, Shape::Csg { op: CsgOp::Union, .. })
            && !self.flags.is_turned()
            && self
                .more
                .as_ref()
                .is_none_or(|more| more.clipped_by.is_empty() && more.bounded_by.is_empty() && !more.unsplit)
    }

    /// True if it throws no shadow where it is an object of its own: by its own word, or, of a union that is not split, by that of
    /// all its parts (measured in POV-Ray 3.7; a part's part says nothing, nor does one part of several).
    pub fn throws_no_shadow(&self) -> bool {
        self.flags.no_shadow
            || match &self.shape {
                Shape::Csg { op: CsgOp::Union, children, .. }
                    if !self.flags.is_turned() && !self.is_split() =>
                {
                    children.iter().all(|child| child.flags.no_shadow)
                }
                _ => false,
            }
    }

    /// True if its shape, without what clips it, may reach without end.
    pub fn is_endless(&self) -> bool {
        self.flags.inverse
            || match &self.shape {
                Shape::Plane { .. } | Shape::Polynomial(_) => true,
                Shape::Csg { op: CsgOp::Union | CsgOp::Merge, children, .. } => {
                    children.iter().any(|child| child.is_endless())
                }
                Shape::Csg { op: CsgOp::Intersection, children, .. } => {
                    children.iter().all(|child| child.is_endless())
                }
                Shape::Csg { op: CsgOp::Difference, children, .. } => {
                    children.first().is_some_and(|child| child.is_endless())
                }
                _ => false,
            }
    }

    /// What few objects have, to be written to.
    pub fn more_mut(&mut self) -> &mut More {
        self.more.get_or_insert_default()
    }
}
