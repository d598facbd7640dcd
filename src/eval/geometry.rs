//! What a script asks of shapes: `trace`, `inside`, `min_extent`, `max_extent` (manual sections 3.1.4.9, 3.1.5.3).
//!
//! The oracle answers for rays and points; extents are bounding boxes, formed as POV-Ray forms them: each shape's own box is
//! carried through its whole transform, corner by corner, that of a composite, a mesh or a quadric through each move in turn.

use super::machine::{Machine, Res};
use super::value::{Facts, Num, ObjectValue, Value};
use crate::lang::{Keyword, Mark, Token};
use crate::reference::Solid;
use crate::scene::{CsgOp, ENDLESS, Object, Polynomial, Shape, Transform};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// Half the thickness of the box about a disc or a flat polygon, as POV-Ray has it.
const FLAT_HALF_THICKNESS: f64 = 1e-3;

/// Parts that the oracle makes ready, or holds against a ray, in the time of a step of the evaluator, about.
const PARTS_A_STEP: u64 = 8;

/// Bytes that the oracle takes for a part, about.
const PART_BYTES: u64 = 500;

/// Objects that are kept ready to be asked.
const SOLIDS: usize = 64;

/// Shapes that these have together, at most; one object may have more.
const SOLIDS_SHAPES: u64 = 1 << 20;

/// Lowest and highest corner.
pub(super) type Extent = crate::reference::PartBox;

/// An object that has been asked about.
pub(super) struct Known {
    object: Arc<Object>,
    shapes: u64,
    solid: Solid,
}

/// Extent of what has no end.
pub(super) const EVERYWHERE: Extent = (DVec3::splat(-ENDLESS), DVec3::splat(ENDLESS));

impl Machine<'_> {
    /// The call of one of these; its word and `(` have been taken, `)` will be by the caller.
    pub fn geometry_call(&mut self, word: Keyword) -> Res<Num> {
        let (object, facts) = self.object_argument()?;
        let shapes = facts.shapes;
        if let Keyword::MinExtent | Keyword::MaxExtent = word {
            self.count_extent(&facts)?;
            let (min, max) = extent(&object);
            return Ok(Num::vector(if word == Keyword::MinExtent { min } else { max }));
        }
        self.comma()?;
        let point = self.vector()?;
        if shapes.saturating_mul(PART_BYTES) > self.options.limits.memory {
            return Err(self.halt(format!("stopped: `{}` of an object of {shapes} shapes", word.text())));
        }
        if word == Keyword::Inside {
            let inside = self.ask(&object, shapes, |solid| solid.contains(point))?;
            return Ok(Num::float(f64::from(inside)));
        }
        self.comma()?;
        let direction = self.vector()?;
        let mut normal_place = None;
        let comma = self.accept(Mark::Comma)?;
        let next = self.peek_raw();
        if matches!(next, Token::Name(_)) || comma && next != Token::Mark(Mark::CloseParen) {
            let (symbol, at) = self.raw_name("trace")?;
            normal_place = Some(match self.peek_raw() {
                Token::Mark(Mark::OpenBracket) => self.element(symbol, at)?,
                _ => match self.scopes.place(symbol) {
                    Some(place) => place,
                    None => return self.unknown(symbol, at),
                },
            });
        }
        let hit = match direction.try_normalize() {
            Some(direction) => self.ask(&object, shapes, |solid| solid.meet(point, direction))?,
            None => None,
        };
        let (point, normal) = hit.map_or((DVec3::ZERO, DVec3::ZERO), |hit| (hit.point, hit.normal));
        if let Some(place) = normal_place {
            self.before_change(place.symbol)?;
            self.scopes.set_at(&place, Value::Number(Num::vector(normal)));
        }
        Ok(Num::vector(point))
    }

    /// Asks the oracle about an object of so many shapes. Scripts ask the same few objects again and again, so these are kept
    /// ready.
    fn ask<T>(&mut self, object: &Arc<Object>, shapes: u64, question: impl Fn(&Solid) -> T) -> Res<T> {
        let known = self.solids.iter().position(|known| Arc::ptr_eq(&known.object, object));
        let index = match known {
            Some(index) => index,
            None => {
                self.count_steps(shapes / PARTS_A_STEP)?;
                let mut kept: u64 = self.solids.iter().map(|known| known.shapes).sum();
                while !self.solids.is_empty()
                    && (self.solids.len() == SOLIDS || kept + shapes > SOLIDS_SHAPES)
                {
                    kept -= self.solids.remove(0).shapes;
                }
                let solid = Solid::new(object, &bounds);
                // The object is kept, so that its address stays its own and nobody changes it in place.
                self.solids.push(Known { object: object.clone(), shapes, solid });
                self.solids.len() - 1
            }
        };
        let solid = &self.solids[index].solid;
        let before = solid.asked();
        let answer = question(solid);
        let asked = solid.asked() - before;
        self.count_steps(asked / PARTS_A_STEP)?;
        Ok(answer)
    }

    /// An object by name or as it stands. Where a shape is not modelled its bounding box answers, and the scene is
    /// refused.
    ///
    /// With it, what there is to look at.
    fn object_argument(&mut self) -> Res<(Arc<Object>, Facts)> {
        let named = self.take_named(|value| match value {
            Value::Object(object) => Some(object.clone()),
            _ => None,
        })?;
        let value: Arc<ObjectValue> = match named {
            Some(value) => value,
            None => match self.object()? {
                Some(value) => Arc::new(value),
                None => return self.expected("an object"),
            },
        };
        if let Some(stand_in) = &value.stand_in {
            let lacks = value.lacks.clone();
            self.miss(&lacks);
            return Ok((stand_in.clone(), value.facts));
        }
        match &value.object {
            Some(object) => Ok((object.clone(), value.facts)),
            None => {
                let facts = Facts { shapes: 1, ..Facts::default() };
                Ok((Arc::new(stand_in((DVec3::ZERO, DVec3::ZERO))), facts))
            }
        }
    }

    /// The bounding box of an object in the space it stands in; `None` if there is nothing.
    pub fn extent(&mut self, value: &ObjectValue) -> Res<Option<Extent>> {
        self.count_extent(&value.facts)?;
        Ok(value.object.as_deref().map(extent))
    }

    /// Counts the steps that finding the bounding box of an object takes at most.
    fn count_extent(&mut self, facts: &Facts) -> Res<()> {
        self.count_steps(facts.shapes.saturating_add(facts.helpers))
    }
}

/// A box in place of a shape that is not modelled.
pub(super) fn stand_in((min, max): Extent) -> Object {
    Object::new(Shape::Box { min, max })
}

/// The bounding box of an object in the space it stands in.
fn extent(object: &Object) -> Extent {
    let kept = object.more.as_ref().and_then(|more| more.extent);
    let own = kept.unwrap_or_else(|| match &object.shape {
        Shape::Csg { op, children, .. } => {
            let (min, max) = composite(*op, children);
            object.transform.box_about(min, max)
        }
        shape => leaf(shape, &object.transform),
    });
    smaller(smaller(own, object.bounded_by()), object.clipped_by())
}

/// The object, which has not been moved yet, carries its box along from now on.
pub(super) fn keep_extent(object: &mut Object) {
    let around = match &object.shape {
        Shape::Csg { op, children, .. } => composite(*op, children),
        Shape::Polynomial(quadric) => ellipsoid(quadric).unwrap_or(EVERYWHERE),
        shape => leaf(shape, &Transform::IDENTITY),
    };
    object.more_mut().extent = Some(around);
}

/// The box of what clips or bounds an object in place of its own, if it is the smaller: POV-Ray does not cut one by the other
/// (measured). What is inside out bounds nothing.
fn smaller(own: Extent, helpers: &[Arc<Object>]) -> Extent {
    let bounds = helpers.iter().filter(|helper| !helper.flags.inverse).map(|helper| extent(helper));
    let Some(bounds) = bounds.reduce(both) else { return own };
    let volume = |(min, max): Extent| (max - min).element_product();
    if volume(bounds) < volume(own) { bounds } else { own }
}

/// What holds a shape and what is in it. A disc's inside is all that is behind its plane.
fn bounds(shape: &Shape, place: &Transform) -> Option<Extent> {
    let (min, max) = leaf(shape, place);
    let bounded = min.min_element() > -ENDLESS && max.max_element() < ENDLESS;
    (bounded && !matches!(shape, Shape::Disc { .. })).then_some((min, max))
}

/// The box of a quadric that is an ellipsoid with its axes along those of the space; POV-Ray looks for no other (measured).
fn ellipsoid(quadric: &Polynomial) -> Option<Extent> {
    let &[xx, xy, xz, x, yy, yz, y, zz, z, constant] = quadric.coefficients() else { return None };
    let (squares, linear) = (DVec3::new(xx, yy, zz), DVec3::new(x, y, z));
    if [xy, xz, yz] != [0.0; 3] || squares.cmpeq(DVec3::ZERO).any() {
        return None;
    }
    let center = -0.5 * linear / squares;
    // squares . (p - center)^2 = right
    let right = squares.dot(center * center) - constant;
    let radii2 = right / squares;
    radii2.cmpgt(DVec3::ZERO).all().then(|| {
        let radii = DVec3::from_array(radii2.to_array().map(f64::sqrt));
        (center - radii, center + radii)
    })
}

/// The box of a composite in its children's space.
fn composite(op: CsgOp, children: &[Arc<Object>]) -> Extent {
    let (min, max) = match op {
        CsgOp::Union | CsgOp::Merge => {
            let hull = |a: Extent, b: Extent| (a.0.min(b.0), a.1.max(b.1));
            children.iter().map(|child| extent(child)).reduce(hull).unwrap_or_default()
        }
        // What is cut away is a part turned inside out.
        _ => {
            let cut = |index: usize| op == CsgOp::Difference && index > 0;
            let parts = children.iter().enumerate();
            parts
                .map(|(index, child)| within(child, child.flags.inverse != cut(index)))
                .fold(EVERYWHERE, both)
        }
    };
    // Boxes that do not meet, or are open to a side, are no bound (measured).
    let closed = (max - min).max_element() < ENDLESS;
    if closed && min.cmple(max).all() { (min, max) } else { EVERYWHERE }
}

/// How far a part of an intersection lets it reach.
fn within(part: &Object, inside_out: bool) -> Extent {
    match &part.shape {
        Shape::Plane { normal, distance } => {
            let side = if inside_out { -1.0 } else { 1.0 };
            let (normal, point) = (*normal * side, *normal * *distance);
            half_space(part.transform.normal(normal), part.transform.point(point))
        }
        _ if inside_out => EVERYWHERE,
        _ => extent(part),
    }
}

/// The box of all that is behind a plane, which bounds something if it is across an axis.
fn half_space(normal: DVec3, point: DVec3) -> Extent {
    let (mut min, mut max) = EVERYWHERE;
    for axis in 0..3 {
        let others = normal.length_squared() - normal[axis] * normal[axis];
        if others <= f64::EPSILON * normal.length_squared() {
            let side = if normal[axis] > 0.0 { &mut max } else { &mut min };
            side[axis] = point[axis];
        }
    }
    (min, max)
}

fn both(a: Extent, b: Extent) -> Extent {
    (a.0.max(b.0), a.1.min(b.1))
}

fn leaf(shape: &Shape, place: &Transform) -> Extent {
    match shape {
        Shape::Sphere { center, radius } => {
            let m = place.forward.matrix3;
            let (x, y, z) = (m.x_axis.length(), m.y_axis.length(), m.z_axis.length());
            let round = (x - y).abs().max((x - z).abs()) <= ROUND_WITHIN * x;
            if round {
                let (center, radius) = (place.point(*center), radius * x);
                return (center - radius, center + radius);
            }
            place.box_about(*center - *radius, *center + *radius)
        }
        Shape::Box { min, max } => place.box_about(*min, *max),
        Shape::Cone { base, base_radius, cap, cap_radius, .. } => {
            // The axis goes from the thin end to the thick, a cylinder's from the second point to the first (measured).
            let (from, to) = if cap_radius > base_radius { (*base, *cap) } else { (*cap, *base) };
            let radius = base_radius.max(*cap_radius);
            let height = (to - from).length();
            let corner = DVec3::new(radius, radius, 0.0);
            let place = upright(from, to - from).then(place);
            place.box_about(-corner, corner + height * DVec3::Z)
        }
        Shape::Disc { center, normal, radius, .. } => {
            let corner = DVec3::new(*radius, *radius, FLAT_HALF_THICKNESS);
            upright(*center, *normal).then(place).box_about(-corner, corner)
        }
        Shape::Torus { major, minor } => {
            let corner = DVec3::new(major + minor, *minor, major + minor);
            place.box_about(-corner, corner)
        }
        Shape::Triangle { vertices, .. } => around(vertices.iter().copied(), place),
        Shape::Polygon { outlines } => {
            let (min, max) = around(outlines.iter().flatten().copied(), place);
            let thin = (max - min).cmplt(DVec3::splat(2.0 * FLAT_HALF_THICKNESS));
            let thickness = DVec3::select(thin, DVec3::splat(FLAT_HALF_THICKNESS), DVec3::ZERO);
            (min - thickness, max + thickness)
        }
        Shape::Mesh(mesh) => {
            // The mesh's own box, then its corners.
            let (min, max) = around(mesh.vertices.iter().copied(), &Transform::IDENTITY);
            place.box_about(min, max)
        }
        Shape::Other(other) => place.box_about(other.extent.0, other.extent.1),
        Shape::Plane { .. } | Shape::Polynomial(_) | Shape::Csg { .. } => EVERYWHERE,
    }
}

/// A sphere whose axes differ by less than this share, by rounding, is still one.
const ROUND_WITHIN: f64 = 1e-12;

/// Turns the z axis to `up` by the shortest way, then moves the origin to `origin`.
fn upright(origin: DVec3, up: DVec3) -> Transform {
    let up = up.try_normalize().unwrap_or(DVec3::Z);
    let turn = match DVec3::Z.cross(up).try_normalize() {
        Some(axis) => DMat3::from_axis_angle(axis, up.z.clamp(-1.0, 1.0).acos()),
        None if up.z < 0.0 => DMat3::from_rotation_x(std::f64::consts::PI),
        None => DMat3::IDENTITY,
    };
    let turn = glam::DAffine3::from_mat3_translation(turn, origin);
    Transform::from_affine(turn).unwrap_or_default()
}

fn around(points: impl Iterator<Item = DVec3>, place: &Transform) -> Extent {
    let mut points = points.map(|point| place.point(point));
    let Some(first) = points.next() else { return Extent::default() };
    points.fold((first, first), |(min, max), point| (min.min(point), max.max(point)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::nearest_hits;
    use crate::scene::{Mesh, MeshTriangle, Scene};

    fn placed(shape: Shape, x: f64) -> Arc<Object> {
        let place = glam::DAffine3::from_translation(DVec3::X * x) * glam::DAffine3::from_rotation_y(x);
        let transform = Transform::from_affine(place).unwrap().into();
        Arc::new(Object { transform, ..Object::new(shape) })
    }

    fn joined(op: CsgOp, children: Vec<Arc<Object>>) -> Arc<Object> {
        Arc::new(Object::new(Shape::Csg { op, children, cutaway_textures: false }))
    }

    fn inverse(object: &Arc<Object>) -> Arc<Object> {
        let mut object = Object::clone(object);
        object.flags.inverse = true;
        Arc::new(object)
    }

    /// An octahedron of eight times `n * n` triangles.
    fn octahedron(n: i32) -> Mesh {
        let mut mesh = Mesh { inside_vector: Some(DVec3::Y), ..Mesh::default() };
        for face in 0..8 {
            let sides =
                DVec3::from_array([0, 1, 2].map(|axis| if face >> axis & 1 == 0 { 0.4 } else { -0.4 }));
            let corner = |i: i32, j: i32| {
                sides * DVec3::new(f64::from(i), f64::from(j), f64::from(n - i - j)) / f64::from(n)
            };
            let mut add = |corners: [(i32, i32); 3]| {
                let first = mesh.vertices.len() as u32;
                mesh.vertices.extend(corners.map(|(i, j)| corner(i, j)));
                let vertices = [first, first + 1, first + 2];
                mesh.triangles.push(MeshTriangle { vertices, normals: None, textures: None });
            };
            for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
                add([(i, j), (i + 1, j), (i, j + 1)]);
                if i + j + 1 < n {
                    add([(i + 1, j), (i + 1, j + 1), (i, j + 1)]);
                }
            }
        }
        mesh
    }

    #[test]
    fn what_lines_pass_by_is_not_missed_by_a_script() {
        let (min, max) = (DVec3::new(-0.5, -0.2, -0.4), DVec3::new(0.3, 0.6, 0.1));
        let parts = vec![
            placed(Shape::Sphere { center: DVec3::Y * 0.3, radius: 0.4 }, -2.0),
            placed(Shape::Box { min, max }, -1.0),
            placed(Shape::Torus { major: 0.4, minor: 0.1 }, 0.0),
            placed(Shape::Plane { normal: DVec3::Y, distance: -1.0 }, 0.5),
            placed(Shape::Cone { base: min, base_radius: 0.4, cap: max, cap_radius: 0.1, open: true }, 1.0),
            placed(Shape::Disc { center: max, normal: DVec3::ONE, radius: 0.6, hole: 0.1 }, 2.0),
            placed(Shape::Mesh(Arc::new(octahedron(5))), 2.5),
        ];
        let grain = |i: u32| {
            let center = DVec3::new(f64::from(i) * 0.1 - 2.5, f64::from(i * 7 % 10) * 0.1, 0.0);
            placed(Shape::Sphere { center, radius: 0.08 }, 0.01 * f64::from(i))
        };
        let grains = joined(CsgOp::Union, (0..50).map(grain).collect());
        let union = joined(CsgOp::Union, parts.clone());
        let bounded = joined(CsgOp::Union, [&parts[..3], &parts[4..5], &parts[6..]].concat());
        let pierced = joined(CsgOp::Difference, vec![bounded.clone(), grains.clone()]);
        let mut clipped = Object::clone(&bounded);
        clipped.more_mut().clipped_by = vec![parts[0].clone(), inverse(&grains)];
        let mut clipped_outside = Object::clone(&inverse(&bounded));
        clipped_outside.more_mut().clipped_by = vec![parts[1].clone()];
        let objects = [
            joined(CsgOp::Union, vec![inverse(&bounded), parts[4].clone()]),
            joined(CsgOp::Intersection, vec![bounded.clone(), inverse(&grains)]),
            joined(CsgOp::Merge, vec![pierced.clone(), grains.clone(), Arc::new(clipped)]),
            joined(CsgOp::Union, vec![pierced.clone(), joined(CsgOp::Union, vec![grains, union.clone()])]),
            joined(CsgOp::Union, vec![Arc::new(clipped_outside), parts[0].clone()]),
            inverse(&pierced),
            union,
        ];
        // Points and directions that fill a box and a ball evenly enough.
        let ray = |k: u32| {
            let k = f64::from(k);
            let (angle, height) = (k * 2.399963, (k * 0.618034).fract() * 2.0 - 1.0);
            let dir = DVec3::new(angle.cos(), height, angle.sin()).normalize();
            (DVec3::new((k * 0.754878).fract() * 6.0 - 3.0, height, angle.cos()), dir)
        };
        let rays: Vec<_> = (0..3000).map(ray).collect();
        for (index, object) in objects.iter().enumerate() {
            let scene = Scene { objects: vec![object.clone()], ..Scene::default() };
            let (near, plain) = (Solid::new(object, &bounds), Solid::new(object, &|_, _| None));
            let (mut met, mut inside) = (0, 0);
            for (&(origin, dir), all) in rays.iter().zip(nearest_hits(&scene, &rays)) {
                let hit = near.meet(origin, dir);
                assert_eq!(hit.map(|hit| (hit.t, hit.point)), all.map(|hit| (hit.t, hit.point)), "{index}");
                assert_eq!(near.contains(origin), plain.contains(origin), "{index}: {origin}");
                met += u32::from(hit.is_some());
                inside += u32::from(near.contains(origin));
            }
            assert!(met > 100 && inside > 20, "{index}: {met} met, {inside} inside");
        }
    }

    #[test]
    fn a_ray_asks_few_of_many_triangles() {
        let mesh = Arc::new(Object::new(Shape::Mesh(Arc::new(octahedron(100)))));
        let solid = Solid::new(&mesh, &bounds);
        let rays = 100;
        for k in 0..rays {
            let origin = DVec3::new(0.1, 5.0, 0.2 - 0.001 * f64::from(k));
            assert!(solid.meet(origin, DVec3::NEG_Y).is_some());
        }
        // Of 80,000, that is; most of what is asked are the 2 log2(80000 / 4) boxes on the way to two sides.
        let asked = solid.asked() / u64::from(rays as u32);
        assert!(asked < 200, "{asked}");
    }
}
