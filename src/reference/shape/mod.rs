//! Where a line meets one shape: a kernel per shape, all in the shape's own space.
//!
//! A [`Line`] comes in, its [`Roots`] go out: *every* meeting on the whole line, also behind the origin, because inside
//! and outside are told by counting along the line (Roth 1982), never by testing a rounded point. The kernels know
//! neither the world nor what the meetings are for.

mod cone;
mod cuboid;
mod mesh;
mod planar;
mod polygon;
mod polynomial;
mod sphere;
mod torus;
mod triangle;

pub use mesh::cross_near;

use crate::scene::Shape;
use glam::DVec3;
use smallvec::SmallVec;

/// `origin + t dir` for all t, in a shape's own space.
///
/// `dir` has the world's direction in this space, not unit length, so that `t` is the distance in the world.
#[derive(Debug, Clone, Copy)]
pub struct Line {
    /// A point of the line: where `t` is 0.
    pub origin: DVec3,
    /// Never 0.
    pub dir: DVec3,
    /// The part of this shape on which `origin` lies, if the ray has just left it: the kernel then gives the meeting at
    /// `origin` exactly `t = 0`, and finds the others without it.
    pub left: Option<usize>,
}

impl Line {
    /// The point at `t`.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.dir
    }
}

/// One meeting of a line and a shape.
#[derive(Debug, Clone, Copy)]
pub struct Root {
    /// Along the line.
    pub t: f64,
    /// The point, put back on the surface.
    pub point: DVec3,
    /// Outward geometric normal, any length but 0.
    pub normal: DVec3,
    /// The normal to shade with, if another.
    pub smooth: Option<DVec3>,
    /// Shares of a triangle's three corners; 0 on other shapes.
    pub corners: [f64; 3],
    /// Which part of the surface.
    pub part: usize,
    /// There is something to see. False where a solid ends without a surface: the ends of an open cylinder.
    pub visible: bool,
    /// The line passes between inside and outside. False on surfaces without an inside.
    pub toggles: bool,
    /// This is the point the ray has just left.
    pub left: bool,
}

impl Root {
    /// A visible meeting at which the line enters or leaves the solid.
    fn new(t: f64, point: DVec3, normal: DVec3, part: usize) -> Self {
        let (smooth, corners) = (None, [0.0; 3]);
        Self { t, point, normal, smooth, corners, part, visible: true, toggles: true, left: false }
    }

    /// The same, marked as the point of departure if it is: the root of the part that was left.
    fn departing(mut self, line: &Line) -> Self {
        if line.left == Some(self.part) && self.t == 0.0 {
            self.left = true;
            self.point = line.origin;
        }
        self
    }
}

/// All meetings of a line and a shape.
#[derive(Debug, Clone, Default)]
pub struct Roots {
    /// Whether the line is inside before its first meeting, at `t = -∞`.
    pub starts_inside: bool,
    /// In rising order of `t`.
    pub list: SmallVec<[Root; 4]>,
}

impl Roots {
    fn sorted(mut list: SmallVec<[Root; 4]>) -> Self {
        list.sort_by(|a, b| a.t.total_cmp(&b.t));
        Self { starts_inside: false, list }
    }
}

/// All meetings of `line` and `shape`. `Csg` has none of its own.
pub fn cross(shape: &Shape, line: &Line) -> Roots {
    match shape {
        Shape::Sphere { center, radius } => sphere::cross(*center, *radius, line),
        Shape::Plane { normal, distance } => planar::plane(*normal, *distance, line),
        Shape::Box { min, max } => cuboid::cross(*min, *max, line),
        Shape::Cone { base, base_radius, cap, cap_radius, open } => {
            cone::Cone::new(*base, *base_radius, *cap, *cap_radius, *open)
                .map_or_else(Roots::default, |cone| cone.cross(line))
        }
        Shape::Disc { center, normal, radius, hole } => planar::disc(*center, *normal, *radius, *hole, line),
        Shape::Torus { major, minor } => torus::cross(*major, *minor, line),
        Shape::Polynomial(polynomial) => polynomial::cross(polynomial, line),
        Shape::Triangle { vertices, normals } => triangle::cross(vertices, normals.as_deref(), line),
        Shape::Polygon { outlines } => polygon::cross(outlines, line),
        Shape::Mesh(mesh) => mesh::cross(mesh, line),
        Shape::Csg { .. } | Shape::Other(_) => Roots::default(),
    }
}

/// True if the shape has an inside; turning one without inside out changes nothing.
pub fn is_solid(shape: &Shape) -> bool {
    match shape {
        Shape::Triangle { .. } | Shape::Polygon { .. } => false,
        Shape::Mesh(mesh) => mesh.inside_vector.is_some(),
        _ => true,
    }
}

/// False for shapes whose sides stay when they are turned inside out: triangles and polygons by themselves (measured in
/// POV-Ray 3.7; in a mesh they turn).
pub fn turns(shape: &Shape) -> bool {
    !matches!(shape, Shape::Triangle { .. } | Shape::Polygon { .. })
}

/// A bound on each coordinate's magnitude on the shape (of infinite ones: on the part nearest the origin).
///
/// The size of the numbers that a kernel computes with, and so the unit of its rounding errors.
pub fn reach(shape: &Shape) -> DVec3 {
    let farthest = |points: &mut dyn Iterator<Item = DVec3>| points.fold(DVec3::ZERO, |r, p| r.max(p.abs()));
    match shape {
        Shape::Sphere { center, radius } => center.abs() + *radius,
        Shape::Plane { normal, distance } => (*normal * *distance).abs(),
        Shape::Box { min, max } => min.abs().max(max.abs()),
        Shape::Cone { base, base_radius, cap, cap_radius, .. } => {
            (base.abs() + *base_radius).max(cap.abs() + *cap_radius)
        }
        Shape::Disc { center, radius, .. } => center.abs() + *radius,
        Shape::Torus { major, minor } => DVec3::splat(major + minor),
        // Nothing says how large it is; coefficients of the order of 1 make it as large as that.
        Shape::Polynomial(_) => DVec3::ONE,
        Shape::Triangle { vertices, .. } => farthest(&mut vertices.iter().copied()),
        Shape::Polygon { outlines } => farthest(&mut outlines.iter().flatten().copied()),
        Shape::Mesh(mesh) => farthest(&mut mesh.vertices.iter().copied()),
        Shape::Csg { .. } | Shape::Other(_) => DVec3::ZERO,
    }
}

#[cfg(test)]
fn line(origin: [f64; 3], dir: [f64; 3]) -> Line {
    Line { origin: origin.into(), dir: dir.into(), left: None }
}

#[cfg(test)]
fn distances(roots: &Roots) -> Vec<f64> {
    roots.list.iter().map(|root| root.t).collect()
}
