//! Shapes that are read but not rendered: their words, and the box they lie in (manual sections 3.4.5.1 to 3.4.5.4).
//!
//! The box stands in for the shape where a script asks for its extent.

use super::geometry::Extent;
use super::machine::{Machine, Res};
use super::value::ObjectValue;
use crate::lang::{Keyword, Mark, Token};
use glam::DVec3;

/// Text has no metrics here: POV-Ray's letters are about this wide and high on average.
const LETTER_WIDTH: f64 = 0.5;
/// See [`LETTER_WIDTH`].
const LETTER_HEIGHT: f64 = 0.7;

/// A box that grows with every point.
#[derive(Default)]
struct Growing(Option<Extent>);

impl Growing {
    fn add(&mut self, point: DVec3, radius: f64) {
        let (low, high) = (point - radius.abs(), point + radius.abs());
        self.0 = Some(self.0.map_or((low, high), |(min, max)| (min.min(low), max.max(high))));
    }

    fn extent(&self) -> Extent {
        self.0.unwrap_or_default()
    }
}

impl Machine<'_> {
    /// What stands between the `{` of such a shape and its modifiers.
    pub fn other_shape(&mut self, word: Keyword) -> Res<Extent> {
        use Keyword as K;
        Ok(match word {
            K::Superellipsoid => {
                self.expr()?;
                (DVec3::NEG_ONE, DVec3::ONE)
            }
            K::Ovus => {
                let bottom = self.finite()?;
                self.comma()?;
                let top = self.finite()?;
                let wide = bottom.max(top);
                (DVec3::new(-wide, -bottom, -wide), DVec3::new(wide, bottom + top, wide))
            }
            K::Blob => self.blob()?,
            K::HeightField => self.height_field()?,
            K::Isosurface => self.isosurface()?,
            K::Parametric => self.parametric()?,
            K::JuliaFractal => self.julia_fractal()?,
            K::Lathe | K::Sor => self.revolved()?,
            K::Prism => self.prism()?,
            K::SphereSweep => self.sphere_sweep()?,
            K::BicubicPatch => self.bicubic_patch()?,
            K::Text => self.text_shape()?,
            _ => return self.expected("a shape"),
        })
    }

    /// The objects and lights of a `light_group`; its `global_lights` is among its modifiers.
    pub fn light_group(&mut self) -> Res<ObjectValue> {
        let mut group = ObjectValue::default();
        while let Some(child) = self.object()? {
            group.lacks.add(&child.lacks);
        }
        Ok(group)
    }

    fn blob(&mut self) -> Res<Extent> {
        use Keyword as K;
        let mut around = Growing::default();
        while let Token::Word(word @ (K::Threshold | K::Sphere | K::Cylinder | K::Component)) = self.peek()? {
            self.next()?;
            match word {
                K::Threshold => {
                    self.finite()?;
                }
                K::Component => {
                    self.finite()?;
                    self.comma()?;
                    let radius = self.finite()?;
                    self.comma()?;
                    around.add(self.vector()?, radius);
                }
                _ => self.blob_part(word, &mut around)?,
            }
            self.comma()?;
        }
        Ok(around.extent())
    }

    fn blob_part(&mut self, word: Keyword, around: &mut Growing) -> Res<()> {
        let open = self.open(word.text())?;
        let mut ends = vec![self.vector()?];
        self.comma()?;
        if word == Keyword::Cylinder {
            ends.push(self.vector()?);
            self.comma()?;
        }
        let radius = self.finite()?;
        self.comma()?;
        self.accept_word(Keyword::Strength)?;
        self.finite()?;
        let mut part = Growing::default();
        ends.iter().for_each(|end| part.add(*end, radius));
        let mut value = ObjectValue::from(super::geometry::stand_in(part.extent()));
        while self.modifier(&mut value)? {}
        self.close(word.text(), open)?;
        if let Some((min, max)) = self.extent(&value)? {
            around.add(min, 0.0);
            around.add(max, 0.0);
        }
        Ok(())
    }

    fn height_field(&mut self) -> Res<Extent> {
        if self.peek()? == Token::Word(Keyword::Function) {
            self.next()?;
            self.finite()?;
            self.comma()?;
            self.finite()?;
            self.comma()?;
            match self.peek()? {
                Token::Name(_) => self.inline_function()?,
                _ => {
                    self.function()?;
                }
            }
        } else {
            self.bitmap()?;
        }
        let mut water = 0.0;
        loop {
            match self.peek()? {
                Token::Word(Keyword::WaterLevel) => {
                    self.next()?;
                    water = self.finite()?;
                }
                Token::Word(Keyword::Smooth) => {
                    self.next()?;
                    self.switch_value()?;
                }
                _ => return Ok((DVec3::new(0.0, water, 0.0), DVec3::ONE)),
            }
        }
    }

    /// `function { ... }`, or `{ ... }` behind a `function` that has been left out, or the name of one.
    fn inline_function(&mut self) -> Res<()> {
        if self.accept_word(Keyword::Function)? {
            self.function()?;
            return Ok(());
        }
        match self.rvalue()? {
            super::value::Value::Function(_) => Ok(()),
            _ => self.expected("`function`"),
        }
    }

    fn isosurface(&mut self) -> Res<Extent> {
        use Keyword as K;
        self.inline_function()?;
        self.comma()?;
        let mut extent = (DVec3::NEG_ONE, DVec3::ONE);
        while let Token::Word(word) = self.peek()? {
            match word {
                K::ContainedBy => extent = self.container()?,
                K::Threshold | K::Accuracy | K::MaxGradient | K::MaxTrace => {
                    self.next()?;
                    self.finite()?;
                }
                K::Evaluate => {
                    self.next()?;
                    for _ in 0..3 {
                        self.finite()?;
                        self.comma()?;
                    }
                }
                K::AllIntersections => {
                    self.next()?;
                }
                K::Open => {
                    self.next()?;
                    self.switch_value()?;
                }
                _ => break,
            }
        }
        Ok(extent)
    }

    /// `contained_by { box { ... } }` or `{ sphere { ... } }`.
    fn container(&mut self) -> Res<Extent> {
        self.next()?;
        let open = self.open("contained_by")?;
        let object = self.object()?;
        self.close("contained_by", open)?;
        let extent = object.map(|value| self.extent(&value)).transpose()?;
        match extent.flatten() {
            Some(extent) => Ok(extent),
            None => Err(self.error_here("expected a box or a sphere in `contained_by`")),
        }
    }

    fn parametric(&mut self) -> Res<Extent> {
        use Keyword as K;
        for _ in 0..3 {
            self.inline_function()?;
            self.comma()?;
        }
        self.expr()?;
        self.comma()?;
        self.expr()?;
        self.comma()?;
        let mut extent = (DVec3::NEG_ONE, DVec3::ONE);
        while let Token::Word(word) = self.peek()? {
            match word {
                K::ContainedBy => extent = self.container()?,
                K::MaxGradient | K::Accuracy => {
                    self.next()?;
                    self.finite()?;
                }
                K::Precompute => {
                    self.next()?;
                    self.finite()?;
                    self.comma()?;
                    while let Token::Word(K::X | K::Y | K::Z) = self.peek()? {
                        self.next()?;
                        self.comma()?;
                    }
                }
                _ => break,
            }
        }
        Ok(extent)
    }

    fn julia_fractal(&mut self) -> Res<Extent> {
        use Keyword as K;
        self.expr()?;
        while let Token::Word(word) = self.peek()? {
            match word {
                K::Quaternion
                | K::Hypercomplex
                | K::Sqr
                | K::Cube
                | K::Exp
                | K::Reciprocal
                | K::Sin
                | K::Asin
                | K::Sinh
                | K::Asinh
                | K::Cos
                | K::Acos
                | K::Cosh
                | K::Acosh
                | K::Tan
                | K::Atan
                | K::Tanh
                | K::Atanh
                | K::Ln => {
                    self.next()?;
                }
                K::Pwr | K::Pow => {
                    self.next()?;
                    self.expect(Mark::OpenParen)?;
                    self.finite()?;
                    self.comma()?;
                    self.finite()?;
                    self.expect(Mark::CloseParen)?;
                }
                K::MaxIteration | K::Precision => {
                    self.next()?;
                    self.finite()?;
                }
                K::Slice => {
                    self.next()?;
                    self.expr()?;
                    self.comma()?;
                    self.finite()?;
                }
                _ => break,
            }
        }
        // No point of these sets is farther from the origin.
        Ok((DVec3::splat(-2.0), DVec3::splat(2.0)))
    }

    /// The word of a curve through points, if one follows.
    fn curve_word(&mut self) -> Res<bool> {
        use Keyword as K;
        let Token::Word(K::LinearSpline | K::QuadraticSpline | K::CubicSpline | K::BezierSpline | K::BSpline) =
            self.peek()?
        else {
            return Ok(false);
        };
        self.next()?;
        self.comma()?;
        Ok(true)
    }

    fn point_count(&mut self) -> Res<usize> {
        let count = self.finite()?;
        self.comma()?;
        if !(1.0..=1e8).contains(&count) {
            return Err(self.error_here(format!("expected a number of points, found {count}")));
        }
        Ok(count as usize)
    }

    fn revolved(&mut self) -> Res<Extent> {
        self.curve_word()?;
        let mut around = Growing::default();
        for _ in 0..self.point_count()? {
            let point = self.vector()?;
            self.comma()?;
            for radius in [point.x, -point.x] {
                around.add(DVec3::new(radius, point.y, radius), 0.0);
            }
        }
        Ok(around.extent())
    }

    fn prism(&mut self) -> Res<Extent> {
        while self.curve_word()?
            || self.accept_word(Keyword::LinearSweep)?
            || self.accept_word(Keyword::ConicSweep)?
        {}
        let low = self.finite()?;
        self.comma()?;
        let high = self.finite()?;
        self.comma()?;
        let mut around = Growing::default();
        for _ in 0..self.point_count()? {
            let point = self.vector()?;
            self.comma()?;
            around.add(DVec3::new(point.x, low, point.y), 0.0);
            around.add(DVec3::new(point.x, high, point.y), 0.0);
        }
        Ok(around.extent())
    }

    fn sphere_sweep(&mut self) -> Res<Extent> {
        self.curve_word()?;
        let mut around = Growing::default();
        for _ in 0..self.point_count()? {
            let center = self.vector()?;
            self.comma()?;
            let radius = self.finite()?;
            self.comma()?;
            around.add(center, radius);
        }
        if self.accept_word(Keyword::Tolerance)? {
            self.finite()?;
        }
        Ok(around.extent())
    }

    fn bicubic_patch(&mut self) -> Res<Extent> {
        use Keyword as K;
        while let Token::Word(
            word @ (K::Type | K::Flatness | K::USteps | K::VSteps | K::Accuracy | K::UvVectors),
        ) = self.peek()?
        {
            self.next()?;
            if word == K::UvVectors {
                for _ in 0..4 {
                    self.expr()?;
                    self.comma()?;
                }
            } else {
                self.finite()?;
            }
            self.comma()?;
        }
        let mut around = Growing::default();
        for point in self.corners::<16>()? {
            around.add(point, 0.0);
        }
        Ok(around.extent())
    }

    fn text_shape(&mut self) -> Res<Extent> {
        match self.next()?.token {
            Token::Word(Keyword::Ttf) => {
                self.file_name()?;
            }
            Token::Word(Keyword::Internal) => {
                self.finite()?;
            }
            _ => return Err(self.error_here("expected `ttf` or `internal` and a font")),
        }
        self.comma()?;
        let text = self.string()?;
        self.comma()?;
        let thickness = self.finite()?;
        self.comma()?;
        let offset = self.vector()?;
        let letters = text.chars().count() as f64;
        let end = letters * (LETTER_WIDTH + offset.x);
        Ok((DVec3::ZERO, DVec3::new(end, LETTER_HEIGHT + (letters * offset.y).abs(), thickness)))
    }

    /// The picture of an `image_map`, `height_field` and the like: its kind, its name, what is said of its gamma. Files are
    /// not opened.
    pub fn bitmap(&mut self) -> Res<()> {
        use Keyword as K;
        if let Token::Word(
            K::Png | K::Gif | K::Tga | K::Ppm | K::Pgm | K::Jpeg | K::Tiff | K::Sys | K::Pot | K::Df3,
        ) = self.peek()?
        {
            self.next()?;
        }
        self.file_name()?;
        loop {
            match self.peek()? {
                Token::Word(K::Gamma) => {
                    self.next()?;
                    if !self.accept_word(K::Srgb)? {
                        self.finite()?;
                    }
                }
                Token::Word(K::Premultiplied) => {
                    self.next()?;
                    self.switch_value()?;
                }
                _ => return Ok(()),
            }
        }
    }
}
