//! The words of each shape (manual section 3.4.5). Odd sizes are put right or refused here, so that renderers
//! need not ask.

use super::geometry::keep_extent;
use super::machine::{Lexeme, Machine, Res};
use super::value::{Absent, ObjectValue};
use crate::lang::{Keyword, Token};
use crate::scene::{Object, Shape};
use glam::DVec3;

impl Machine<'_> {
    /// What stands between a shape's `{` and its modifiers. `None` if octray does not model the shape yet.
    pub fn shape(&mut self, word: Keyword, at: Lexeme) -> Res<Option<ObjectValue>> {
        use Keyword as K;
        let shape = match word {
            K::Sphere => self.sphere()?,
            K::Plane => Some(self.plane()?),
            K::Box => Some(self.box_shape()?),
            K::Cylinder => self.cylinder(at)?,
            K::Cone => self.cone(at)?,
            K::Disc => self.disc()?,
            K::Torus => self.torus()?,
            K::Triangle => {
                let vertices = self.corners::<3>()?;
                self.checked_triangle(vertices, None, at)
            }
            K::SmoothTriangle => {
                let p = self.corners::<6>()?;
                let normals = [p[1], p[3], p[5]].map(DVec3::normalize_or_zero);
                self.checked_triangle([p[0], p[2], p[4]], Some(normals), at)
            }
            K::Polygon => self.polygon(at)?,
            K::Quadric => self.quadric()?,
            K::Cubic => self.surface_of_order(3)?,
            K::Quartic => self.surface_of_order(4)?,
            K::Poly => self.poly()?,
            K::Polynomial => self.polynomial()?,
            _ => return Ok(None),
        };
        Ok(Some(match shape {
            Some(shape) => {
                let mut object = Object::new(shape);
                if word == K::Quadric {
                    keep_extent(&mut object);
                }
                object.into()
            }
            // It has no points; the scene goes on without it.
            None if matches!(word, K::Triangle | K::SmoothTriangle) => {
                ObjectValue { absent: Absent::Flat, ..ObjectValue::default() }
            }
            None => ObjectValue::default(),
        }))
    }

    fn sphere(&mut self) -> Res<Option<Shape>> {
        let center = self.vector()?;
        self.comma()?;
        let radius = self.radius("sphere")?;
        Ok((radius > 0.0).then_some(Shape::Sphere { center, radius }))
    }

    fn plane(&mut self) -> Res<Shape> {
        let normal = self.direction("plane")?;
        self.comma()?;
        Ok(Shape::Plane { normal, distance: self.finite()? })
    }

    fn box_shape(&mut self) -> Res<Shape> {
        let a = self.vector()?;
        self.comma()?;
        let b = self.vector()?;
        Ok(Shape::Box { min: a.min(b), max: a.max(b) })
    }

    fn cylinder(&mut self, at: Lexeme) -> Res<Option<Shape>> {
        let base = self.vector()?;
        self.comma()?;
        let cap = self.vector()?;
        self.comma()?;
        let radius = self.radius("cylinder")?;
        let shape = Shape::Cone { base, base_radius: radius, cap, cap_radius: radius, open: false };
        Ok(self.has_length(base, cap, "cylinder", at).then_some(shape).filter(|_| radius > 0.0))
    }

    fn cone(&mut self, at: Lexeme) -> Res<Option<Shape>> {
        let base = self.vector()?;
        self.comma()?;
        let base_radius = self.size_of("cone")?;
        self.comma()?;
        let cap = self.vector()?;
        self.comma()?;
        let cap_radius = self.size_of("cone")?;
        let span = self.span(at);
        if base_radius == 0.0 && cap_radius == 0.0 {
            self.warn("radius", "a cone with both radii 0 cannot be seen", span);
            return Ok(None);
        }
        let shape = Shape::Cone { base, base_radius, cap, cap_radius, open: false };
        Ok(self.has_length(base, cap, "cone", at).then_some(shape))
    }

    fn has_length(&mut self, base: DVec3, cap: DVec3, what: &str, at: Lexeme) -> bool {
        if base == cap {
            let span = self.span(at);
            self.warn("length", format!("a {what} of no length cannot be seen"), span);
        }
        base != cap
    }

    fn disc(&mut self) -> Res<Option<Shape>> {
        let center = self.vector()?;
        self.comma()?;
        let start = self.peek_lexeme()?;
        let normal = self.vector()?.try_normalize();
        if normal.is_none() {
            let span = self.span(start).to(self.span(self.last));
            self.warn("normal", "a disc whose normal is zero cannot be seen", span);
        }
        self.comma()?;
        let radius = self.radius("disc")?;
        let hole = if self.comma_then_float()? { self.finite()?.abs() } else { 0.0 };
        let Some(normal) = normal else { return Ok(None) };
        Ok((radius > 0.0).then_some(Shape::Disc { center, normal, radius, hole }))
    }

    /// After a value: true if a float follows, with or without a comma.
    fn comma_then_float(&mut self) -> Res<bool> {
        if self.accept(crate::lang::Mark::Comma)? {
            return Ok(true);
        }
        Ok(matches!(self.peek()?, Token::Number(_)))
    }

    fn torus(&mut self) -> Res<Option<Shape>> {
        let major = self.size_of("torus")?;
        self.comma()?;
        let minor = self.finite()?;
        if !(minor > 0.0) {
            // POV-Ray finds no point of a torus with a negative tube, unlike spheres.
            let span = self.span(self.last);
            self.warn(
                "radius",
                format!("torus radius must be positive, found {minor}; it cannot be seen"),
                span,
            );
        }
        Ok((minor > 0.0).then_some(Shape::Torus { major, minor }))
    }

    /// A radius: POV-Ray takes the square of a negative one and so its size.
    fn radius(&mut self, what: &str) -> Res<f64> {
        let before = self.here();
        let (start, radius) = match self.quick_float() {
            Some(radius) if radius > 0.0 && radius.is_finite() => return Ok(radius),
            Some(radius) => (before, self.checked_finite(radius, before)?),
            None => (self.peek_lexeme()?, self.finite()?),
        };
        let span = self.span(start).to(self.span(self.last));
        if radius < 0.0 {
            let message = format!("{what} radius must be positive, found {radius}; took {}", -radius);
            self.warn("radius", message, span);
        } else if radius == 0.0 {
            self.warn("radius", format!("a {what} of radius 0 cannot be seen"), span);
        }
        Ok(radius.abs())
    }

    /// A radius that may be 0. POV-Ray makes two bodies of such a cone or torus, or loses parts of it; not modelled.
    fn size_of(&mut self, what: &str) -> Res<f64> {
        let start = self.peek_lexeme()?;
        let radius = self.finite()?;
        if radius < 0.0 {
            let span = self.span(start).to(self.span(self.last));
            let message = format!("{what} radius must not be negative, found {radius}; took {}", -radius);
            self.warn("radius", message, span);
        }
        Ok(radius.abs())
    }

    /// A vector that is made a unit normal.
    fn direction(&mut self, what: &str) -> Res<DVec3> {
        let start = self.peek_lexeme()?;
        let vector = self.vector()?;
        match vector.try_normalize() {
            Some(unit) => Ok(unit),
            None => {
                let span = self.span(start).to(self.span(self.last));
                Err(self.error(format!("the normal of a {what} must not be zero"), span))
            }
        }
    }

    /// `N` vectors with or without commas between them.
    pub fn corners<const N: usize>(&mut self) -> Res<[DVec3; N]> {
        let mut corners = [DVec3::ZERO; N];
        for corner in &mut corners {
            *corner = self.vector()?;
            self.comma()?;
        }
        Ok(corners)
    }

    fn checked_triangle(
        &mut self,
        vertices: [DVec3; 3],
        normals: Option<[DVec3; 3]>,
        at: Lexeme,
    ) -> Option<Shape> {
        let lacking = if is_degenerate(&vertices) {
            Some("degenerate triangle: its corners are on one line")
        } else if normals.is_some_and(|normals| !are_on_one_side(&vertices, &normals)) {
            Some("degenerate triangle: its normals are not on one side of it")
        } else {
            None
        };
        if let Some(lacking) = lacking {
            self.warn("degenerate", lacking, self.span(at));
            return None;
        }
        Some(Shape::Triangle { vertices: Box::new(vertices), normals: normals.map(Box::new) })
    }

    /// `polygon { count, p, p, ... }`: an outline ends where its first point comes again.
    fn polygon(&mut self, at: Lexeme) -> Res<Option<Shape>> {
        let count = self.finite()?;
        self.comma()?;
        if !(3.0..=1e8).contains(&count) {
            return Err(self.error_here(format!("a polygon has at least 3 points, found {count}")));
        }
        let mut outlines: Vec<Vec<DVec3>> = Vec::new();
        let mut outline: Vec<DVec3> = Vec::new();
        for _ in 0..count as usize {
            let point = self.vector()?;
            self.comma()?;
            if !outline.is_empty() && outline[0] == point {
                outlines.push(std::mem::take(&mut outline));
            } else {
                outline.push(point);
            }
        }
        let span = self.span(at);
        if !outline.is_empty() {
            self.warn("open polygon", "the polygon's last outline is not closed; closed it", span);
            outlines.push(outline);
        }
        outlines.retain(|outline| outline.len() > 2);
        if outlines.is_empty() {
            self.warn("degenerate", "a polygon of fewer than 3 points cannot be seen", span);
            return Ok(None);
        }
        let off = out_of_plane(&outlines);
        if off > PLANAR {
            let message = format!(
                "a polygon that is not flat cannot be seen: a point is {off:.1e} off the plane of others"
            );
            self.warn("bent polygon", message, span);
            return Ok(None);
        }
        Ok(Some(Shape::Polygon { outlines }))
    }
}

/// POV-Ray leaves out polygons with a point farther off the plane than this, in units of the polygon's own space (measured:
/// 1.00e-10 is seen, 1.06e-10 is not).
const PLANAR: f64 = 1.03e-10;

/// How far a point is off the plane of the first three that are not on one line.
fn out_of_plane(outlines: &[Vec<DVec3>]) -> f64 {
    let start = outlines[0][0];
    let points = || outlines.iter().flatten().map(|&point| point - start);
    let Some(along) = points().find_map(|point| point.try_normalize()) else { return 0.0 };
    let aside = |point: DVec3| point.reject_from_normalized(along);
    let Some(across) = points().find(|&point| aside(point).length() > PLANAR) else { return 0.0 };
    let normal = along.cross(across).normalize();
    points().map(|point| point.dot(normal).abs()).fold(0.0, f64::max)
}

/// True if all normals look away from the same side of a triangle, and none along it or nowhere: POV-Ray leaves out a smooth
/// triangle that stands alone, not in a mesh, if they do not.
pub(super) fn are_on_one_side(p: &[DVec3; 3], normals: &[DVec3; 3]) -> bool {
    let face = (p[1] - p[0]).cross(p[2] - p[0]);
    let sides = normals.map(|normal| normal.dot(face));
    sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0)
}

/// True if the corners are on one line, as nearly as doubles can tell.
pub(super) fn is_degenerate(p: &[DVec3; 3]) -> bool {
    let (a, b) = (p[1] - p[0], p[2] - p[0]);
    // Rounding of the coordinates alone moves the cross product by this much, relative to what it is made of.
    const ROUNDING: f64 = 4.0 * f64::EPSILON;
    let size = p[0].abs().max(p[1].abs()).max(p[2].abs()).max_element();
    !(a.cross(b).length() > ROUNDING * size * a.length().max(b.length()))
}
