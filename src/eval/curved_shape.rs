//! Shapes made of curves that are read but not rendered: lathes, prisms, sweeps, patches, text (manual section 3.4.5.1).

use super::machine::{Machine, Res};
use super::other_shape::{Growing, ShapeRead};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::{Curve, Font, OtherKind};
use glam::DVec3;

/// Text has no metrics here: POV-Ray's letters are about this wide and high on average.
const LETTER_WIDTH: f64 = 0.5;
/// See [`LETTER_WIDTH`].
const LETTER_HEIGHT: f64 = 0.7;

impl Machine<'_> {
    /// What stands between the `{` of such a shape and its modifiers.
    pub fn curved_shape(&mut self, word: Keyword) -> Res<ShapeRead> {
        match word {
            Keyword::Lathe | Keyword::Sor => self.revolved(word),
            Keyword::Prism => self.prism(),
            Keyword::SphereSweep => self.sphere_sweep(),
            Keyword::BicubicPatch => self.bicubic_patch(),
            Keyword::Text => self.text_shape(),
            _ => self.expected("a shape"),
        }
    }

    /// The word of a curve through points, if one follows.
    fn curve_word(&mut self) -> Res<Option<Curve>> {
        use Keyword as K;
        let curve = match self.peek()? {
            Token::Word(K::LinearSpline) => Curve::Linear,
            Token::Word(K::QuadraticSpline) => Curve::Quadratic,
            Token::Word(K::CubicSpline) => Curve::Cubic,
            Token::Word(K::BezierSpline) => Curve::Bezier,
            Token::Word(K::BSpline) => Curve::BSpline,
            _ => return Ok(None),
        };
        self.next()?;
        self.comma()?;
        Ok(Some(curve))
    }

    /// `count, point, point, ...`, each read by `point`; at least as many as the curve needs.
    fn points<T>(&mut self, least: u32, mut point: impl FnMut(&mut Self) -> Res<T>) -> Res<Vec<T>> {
        let count = self.integer("the number of points", least, u32::MAX)?;
        self.comma()?;
        let mut points = Vec::new();
        for _ in 0..count {
            self.charge(std::mem::size_of::<T>())?;
            points.push(point(self)?);
            self.comma()?;
        }
        Ok(points)
    }

    fn plane_points(&mut self, least: u32) -> Res<Vec<[f64; 2]>> {
        self.points(least, |m| m.pair("a point of the plane"))
    }

    fn revolved(&mut self, word: Keyword) -> Res<ShapeRead> {
        let curve = self.curve_word()?.unwrap_or(Curve::Linear);
        let least = if word == Keyword::Sor { 4 } else { least_points(curve) };
        let points = self.plane_points(least)?;
        let mut around = Growing::default();
        for &[x, y] in &points {
            around.add(DVec3::new(x, y, x), 0.0);
            around.add(DVec3::new(-x, y, -x), 0.0);
        }
        let kind = match word {
            Keyword::Sor => OtherKind::Sor(points),
            _ => OtherKind::Lathe { curve, points },
        };
        Ok((kind, around.extent()))
    }

    fn prism(&mut self) -> Res<ShapeRead> {
        let (mut curve, mut conic) = (Curve::Linear, false);
        loop {
            if let Some(word) = self.curve_word()? {
                curve = word;
            } else if let Token::Word(word @ (Keyword::LinearSweep | Keyword::ConicSweep)) = self.peek()? {
                self.next()?;
                conic = word == Keyword::ConicSweep;
            } else {
                break;
            }
        }
        let low = self.finite()?;
        self.comma()?;
        let high = self.finite()?;
        self.comma()?;
        let start = self.peek_lexeme()?;
        let points = self.plane_points(3)?;
        if !are_closed(curve, &points) {
            let what = match curve {
                Curve::Linear => "the outline of this prism is open: POV-Ray closes it",
                _ => "the outline of this prism is open: POV-Ray leaves it out",
            };
            let span = self.span(start).to(self.span(self.last));
            self.warn("open prism", what, span);
        }
        let mut around = Growing::default();
        for &[x, z] in &points {
            around.add(DVec3::new(x, low, z), 0.0);
            around.add(DVec3::new(x, high, z), 0.0);
        }
        Ok((OtherKind::Prism { curve, conic, heights: [low, high], points }, around.extent()))
    }

    fn sphere_sweep(&mut self) -> Res<ShapeRead> {
        let curve = self.curve_word()?.unwrap_or(Curve::Linear);
        let least = if curve == Curve::Linear { 2 } else { 4 };
        let points = self.points(least, |m| {
            let center = m.vector()?;
            m.comma()?;
            Ok((center, m.finite()?))
        })?;
        let mut around = Growing::default();
        points.iter().for_each(|(center, radius)| around.add(*center, *radius));
        let mut tolerance = 1e-6;
        self.float_item(&mut [(Keyword::Tolerance, &mut tolerance)])?;
        Ok((OtherKind::SphereSweep { curve, points, tolerance }, around.extent()))
    }

    fn bicubic_patch(&mut self) -> Res<ShapeRead> {
        use Keyword as K;
        let (mut kind, mut steps, mut uv) = (0, [3; 2], None);
        let [mut flatness, mut accuracy] = [0.0; 2];
        loop {
            if self.accept_word(K::Type)? {
                kind = self.integer("the type of a patch", 0, 255)? as u8;
            } else if self.accept_word(K::USteps)? {
                steps[0] = self.integer("`u_steps`", 0, u32::MAX)?;
            } else if self.accept_word(K::VSteps)? {
                steps[1] = self.integer("`v_steps`", 0, u32::MAX)?;
            } else if self.accept_word(K::UvVectors)? {
                let mut corners = [[0.0; 2]; 4];
                for corner in &mut corners {
                    *corner = self.pair("u and v")?;
                    self.comma()?;
                }
                uv = Some(corners);
            } else if !self.float_item(&mut [(K::Flatness, &mut flatness), (K::Accuracy, &mut accuracy)])? {
                break;
            }
            self.comma()?;
        }
        let points = Box::new(self.corners::<16>()?);
        let mut around = Growing::default();
        points.iter().for_each(|point| around.add(*point, 0.0));
        Ok((OtherKind::BicubicPatch { kind, flatness, steps, uv, points }, around.extent()))
    }

    fn text_shape(&mut self) -> Res<ShapeRead> {
        let font = match self.next()?.token {
            Token::Word(Keyword::Ttf) => Font::File(self.file_name()?.to_string()),
            Token::Word(Keyword::Internal) => Font::Internal(self.integer("the number of a font", 0, 99)?),
            _ => return Err(self.error_here("expected `ttf` or `internal` and a font")),
        };
        self.comma()?;
        let text = self.string()?.to_string();
        self.comma()?;
        let thickness = self.finite()?;
        self.accept(Mark::Comma)?;
        let offset = self.vector()?;
        let letters = text.chars().count() as f64;
        let end = letters * (LETTER_WIDTH + offset.x);
        let high = LETTER_HEIGHT + (letters * offset.y).abs();
        let extent = (DVec3::ZERO, DVec3::new(end, high, thickness));
        Ok((OtherKind::Text { font, text, thickness, offset }, extent))
    }
}

/// As few points as a lathe's curve can go through.
fn least_points(curve: Curve) -> u32 {
    match curve {
        Curve::Linear => 2,
        Curve::Quadratic => 3,
        Curve::Cubic | Curve::Bezier | Curve::BSpline => 4,
    }
}

/// True if every one of a prism's outlines ends where it begins. Each runs to the first point that equals its start; those
/// through points have a guide before their start and, if cubic, one behind their end (manual section 3.4.5.1.11).
fn are_closed(curve: Curve, points: &[[f64; 2]]) -> bool {
    let (before, step, behind) = match curve {
        Curve::Linear => (0, 1, 0),
        Curve::Quadratic => (1, 1, 0),
        Curve::Cubic | Curve::BSpline => (1, 1, 1),
        Curve::Bezier => (0, 4, 0),
    };
    let mut rest = points;
    while !rest.is_empty() {
        let Some(outline) = rest.get(before..) else { return false };
        let Some(start) = outline.first() else { return false };
        // The segments of a Bézier outline have four points each.
        let ends = outline.iter().enumerate().skip(step.max(2) - 1).step_by(step);
        let Some((end, _)) = ends.into_iter().find(|(_, point)| *point == start) else { return false };
        let Some(next) = outline.get(end + 1 + behind..) else { return false };
        rest = next;
    }
    true
}
