//! One block of columns per kind of primitive, and the one place that goes from a kind's number to its block.

use crate::kernel::*;
use crate::lane::Scalar;

/// Declares the kinds once: field, variant, block, cost of a test in box tests (ratios measured by `benches/kernels.rs`), what
/// it is.
macro_rules! kinds {
    ($($field:ident, $variant:ident, $block:ident, $cost:expr, $name:expr;)*) => {
        /// A kind of primitive with columns of its own.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum Kind {
            $(#[doc = $name] $variant,)*
        }

        impl Kind {
            /// All of them, in the order of their numbers.
            pub const ALL: &'static [Kind] = &[$(Kind::$variant),*];

            /// True if one ray can be tested against several rows at a time.
            pub fn tests_across(self) -> bool {
                match self { $(Kind::$variant => <$block<f64> as Block<f64>>::ACROSS),* }
            }

            /// Cost of testing it against a packet, in box tests.
            pub fn cost(self) -> f32 {
                match self { $(Kind::$variant => $cost),* }
            }
        }

        /// All primitives of a scene; blocks of absent kinds are empty and cost nothing.
        #[derive(Default)]
        pub struct Columns<S: Scalar> {
            $(#[doc = $name] pub $field: $block<S>,)*
        }

        impl<S: Scalar> Columns<S> {
            /// Rows of `kind`.
            pub fn len(&self, kind: Kind) -> usize {
                match kind { $(Kind::$variant => self.$field.len()),* }
            }

            /// Bytes of the rows of `kind`.
            pub fn bytes(&self, kind: Kind) -> usize {
                match kind { $(Kind::$variant => self.$field.len() * self.$field.row_bytes()),* }
            }

            /// Box around a row.
            pub fn bounds(&self, kind: Kind, row: usize) -> Aabb {
                match kind { $(Kind::$variant => self.$field.bounds(row)),* }
            }

            /// Boxes that together hold a row (see [`Block::pieces`]).
            pub fn pieces(&self, kind: Kind, row: usize, least: f64, most: usize, out: &mut Vec<Aabb>) {
                match kind { $(Kind::$variant => self.$field.pieces(row, least, most, out)),* }
            }

            /// Rows of `kind` in a new order.
            pub fn permute(&mut self, kind: Kind, order: &[u32]) {
                match kind { $(Kind::$variant => self.$field.permute(order)),* }
            }

            /// Hands the block of `kind` to `with`.
            #[inline(always)]
            pub fn with<W: WithBlock<S>>(&self, kind: u8, with: W) -> W::Output {
                match Kind::ALL[usize::from(kind)] { $(Kind::$variant => with.block(&self.$field)),* }
            }
        }
    };
}

/// Work to be done on a block whose kind is known only at run time.
pub trait WithBlock<S: Scalar> {
    /// What comes of it.
    type Output;
    /// Does it.
    fn block<B: Block<S>>(self, block: &B) -> Self::Output;
}

kinds! {
    planes, Plane, Planes, 1.0, "plane";
    spheres, Sphere, Spheres, 1.0, "sphere";
    ellipsoids, Ellipsoid, Ellipsoids, 1.5, "ellipsoid";
    boxes, Box, Boxes, 1.2, "box";
    oriented_boxes, OrientedBox, OrientedBoxes, 2.0, "oriented box";
    cylinders, Cylinder, Cylinders, 2.0, "cylinder";
    open_cylinders, OpenCylinder, OpenCylinders, 2.0, "open cylinder";
    cones, Cone, ClosedCones, 2.5, "cone";
    open_cones, OpenCone, OpenCones, 2.5, "open cone";
    discs, Disc, Discs, 1.5, "disc";
    tori, Torus, Tori, 25.0, "torus";
    polynomials, Polynomial, Polynomials, 60.0, "polynomial";
    polygons, Polygon, Polygons, 4.0, "polygon";
    triangles, Triangle, Triangles, 1.5, "triangle";
    smooth_triangles, SmoothTriangle, SmoothTriangles, 1.5, "smooth triangle";
}
