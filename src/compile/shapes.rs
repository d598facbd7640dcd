//! Each shape of a scene into the block that holds it best: a sphere stays a sphere under similarities, a box stays
//! axis-parallel where it can, and whatever else is bent goes to a block with a space of its own.

use super::{Columns, Kind};
use crate::kernel::Aabb;
use crate::lane::Scalar;
use crate::parallel;
use crate::scene::{Mesh, Object, Shape, Transform};
use glam::DVec3;

/// Adds `shape` and says which block took it; `None` for shapes that nothing can hit. (Meshes and composites are not
/// for this.)
pub(super) fn push<S: Scalar>(columns: &mut Columns<S>, shape: &Shape, place: &Transform) -> Option<Kind> {
    match shape {
        Shape::Sphere { center, radius } => {
            if let Some(scale) = similarity(place) {
                columns.spheres.push(place.point(*center), radius * scale);
                return Some(Kind::Sphere);
            }
            let unit = Transform::scale(DVec3::splat(*radius)).then(&Transform::translate(*center));
            columns.ellipsoids.push(&unit.then(place));
            Some(Kind::Ellipsoid)
        }
        Shape::Plane { normal, distance } => {
            columns.planes.push(place, *normal, *distance);
            Some(Kind::Plane)
        }
        Shape::Box { min, max } => {
            if is_axis_scale(place) {
                let (a, b) = (place.point(*min), place.point(*max));
                columns.boxes.push(a.min(b), a.max(b));
                return Some(Kind::Box);
            }
            columns.oriented_boxes.push(place, *min, *max);
            Some(Kind::OrientedBox)
        }
        Shape::Cone { base, base_radius, cap, cap_radius, open } => {
            let (base, cap) = ((*base, *base_radius), (*cap, *cap_radius));
            Some(match (base_radius == cap_radius, open) {
                (true, false) => {
                    columns.cylinders.push(place, base, cap);
                    Kind::Cylinder
                }
                (true, true) => {
                    columns.open_cylinders.push(place, base, cap);
                    Kind::OpenCylinder
                }
                (false, false) => {
                    columns.cones.push(place, base, cap);
                    Kind::Cone
                }
                (false, true) => {
                    columns.open_cones.push(place, base, cap);
                    Kind::OpenCone
                }
            })
        }
        Shape::Disc { center, normal, radius, hole } => {
            columns.discs.push(place, *center, *normal, *radius, *hole);
            Some(Kind::Disc)
        }
        Shape::Torus { major, minor } => {
            columns.tori.push(place, *major, *minor);
            Some(Kind::Torus)
        }
        Shape::Polynomial(polynomial) => {
            columns.polynomials.push(place, polynomial);
            Some(Kind::Polynomial)
        }
        Shape::Polygon { outlines } => {
            let placed: Vec<Vec<DVec3>> =
                outlines.iter().map(|o| o.iter().map(|&p| place.point(p)).collect()).collect();
            columns.polygons.push(&placed);
            // A mirror image keeps its front.
            if let Some(front) = front_of(outlines) {
                columns.polygons.face(place.normal(front));
            }
            Some(Kind::Polygon)
        }
        Shape::Triangle { vertices, normals } => {
            let corners = vertices.map(|v| place.point(v));
            match normals {
                None => {
                    columns.triangles.push(corners);
                    Some(Kind::Triangle)
                }
                Some(normals) => {
                    let mut normals = normals.map(|n| place.normal(n));
                    shrink(&mut normals);
                    columns.smooth_triangles.push(corners, normals);
                    Some(Kind::SmoothTriangle)
                }
            }
        }
        _ => None,
    }
}

/// Adds a mesh's triangles: by block, which of them it took, in the order of its new rows. They may wait for their places if rows are
/// put in order before any ray comes.
pub(super) fn push_mesh<S: Scalar>(
    columns: &mut Columns<S>,
    mesh: &Mesh,
    place: &Transform,
    may_wait: bool,
) -> [(Kind, Vec<u32>); 2] {
    let triangles = &mesh.triangles;
    let vertices = parallel::list(mesh.vertices.len(), |k| place.point(mesh.vertices[k]));
    let mut normals = parallel::list(mesh.normals.len(), |k| place.normal(mesh.normals[k]));
    shrink(&mut normals);
    let (smooth, flat): (Vec<u32>, Vec<u32>) =
        (0..triangles.len() as u32).partition(|&k| triangles[k as usize].normals.is_some());
    let of = |k: u32| triangles[k as usize].vertices;
    let corners = |k: u32| of(k).map(|v| vertices[v as usize]);
    let shading = |k: u32| triangles[k as usize].normals.unwrap_or_default().map(|n| normals[n as usize]);
    // A mesh's triangles keep their fronts in a mirror image; those by themselves do not (measured in POV-Ray 3.7).
    let mirrors = place.forward.matrix3.determinant() < 0.0;
    let front = |k: u32| {
        let [a, b, c] = of(k).map(|v| mesh.vertices[v as usize]);
        place.normal((c - a).cross(b - a))
    };
    if may_wait && !mirrors && !flat.is_empty() {
        columns.triangles.add_waiting(&vertices, flat.len(), |k| of(flat[k]));
    } else {
        let row = |k: usize| (corners(flat[k]), mirrors.then(|| front(flat[k])));
        columns.triangles.extend(flat.len(), row);
    }
    if may_wait && !smooth.is_empty() {
        let row = |k: usize| (of(smooth[k]), shading(smooth[k]));
        columns.smooth_triangles.add_waiting(&vertices, smooth.len(), row);
    } else {
        columns.smooth_triangles.extend(smooth.len(), |k| (corners(smooth[k]), shading(smooth[k])));
    }
    [(Kind::Triangle, flat), (Kind::SmoothTriangle, smooth)]
}

/// True of shapes that have two sides but no inside; `inverse` does not turn them (measured in POV-Ray 3.7).
pub(super) fn is_flat(shape: &Shape) -> bool {
    matches!(shape, Shape::Triangle { .. } | Shape::Polygon { .. })
}

/// What the scene's `bounded_by` says of where an object lies that has no bounds of its own.
pub(super) fn given_bounds<S: Scalar>(object: &Object, around: &Transform) -> Aabb {
    object.bounded_by().iter().fold(Aabb::INFINITE, |bounds, helper| {
        let mut columns = Columns::<S>::default();
        match push(&mut columns, &helper.shape, &helper.transform.then(around)) {
            Some(kind) if !helper.flags.inverse => bounds.intersection(columns.bounds(kind, 0)),
            _ => bounds,
        }
    })
}

/// A normal on the side of a polygon's first corner that has an area: POV-Ray's front.
fn front_of(outlines: &[Vec<DVec3>]) -> Option<DVec3> {
    let corner = *outlines.first()?.first()?;
    let fans = outlines.iter().flat_map(|outline| outline.windows(2));
    fans.map(|edge| (edge[0] - corner).cross(edge[1] - corner)).find(|normal| *normal != DVec3::ZERO)
}

/// Makes the longest normal a unit one. Their lengths against each other stay: normals are blended before they are placed,
/// and a map that stretches weighs them by what it makes of each.
fn shrink(normals: &mut [DVec3]) {
    let longest = normals.iter().map(|n| n.length()).fold(0.0, f64::max);
    if longest > 0.0 && longest.is_finite() {
        normals.iter_mut().for_each(|n| *n /= longest);
    }
}

/// How far a map's columns may be from equal length and square to each other, to count as a similarity: a few
/// roundings of a product of rotations.
const SIMILARITY: f64 = 16.0 * f64::EPSILON;

/// The scale of a map that keeps angles.
fn similarity(place: &Transform) -> Option<f64> {
    let m = place.forward.matrix3;
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    let square = x.length_squared();
    let off = [y.length_squared() - square, z.length_squared() - square, x.dot(y), y.dot(z), z.dot(x)];
    off.iter().all(|e| e.abs() <= SIMILARITY * square).then(|| square.sqrt())
}

/// True for maps that stretch and move along the axes only.
fn is_axis_scale(place: &Transform) -> bool {
    let m = place.forward.matrix3;
    [m.x_axis.y, m.x_axis.z, m.y_axis.x, m.y_axis.z, m.z_axis.x, m.z_axis.y].iter().all(|&e| e == 0.0)
}
