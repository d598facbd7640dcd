//! Shapes that are read but not rendered: blobs, heights, fields of functions (manual sections 3.4.5.1 to 3.4.5.4).
//! Those made of curves are in `curved_shape.rs`.

use super::function::Called;
use super::geometry::Extent;
use super::item::{ANY, NOT_NEGATIVE};
use super::machine::{Machine, Res};
use super::value::{Lacks, ObjectValue, Value};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::{
    BlobPart, ImageSource, Isosurface, JuliaFractal, Object, OtherKind, OtherShape, Parametric, Shape,
};
use glam::DVec3;
use std::sync::Arc;

/// A box that grows with every point.
#[derive(Default)]
pub(super) struct Growing(Option<Extent>);

impl Growing {
    pub fn add(&mut self, point: DVec3, radius: f64) {
        let (low, high) = (point - radius.abs(), point + radius.abs());
        self.0 = Some(self.0.map_or((low, high), |(min, max)| (min.min(low), max.max(high))));
    }

    pub fn extent(&self) -> Extent {
        self.0.unwrap_or_default()
    }
}

/// Highest corner of the box that POV-Ray has about any superellipsoid.
const SUPERELLIPSOID: DVec3 = DVec3::splat(1.0001);

/// Crossings of an isosurface that POV-Ray counts.
const MAX_TRACE: f64 = 10.0;

/// What stands between the `{` of a shape and its modifiers.
pub(super) type ShapeRead = (OtherKind, Extent);

impl Machine<'_> {
    /// A shape that is not rendered, its word and `{` taken. What in it is not modelled either goes to `lacks`.
    pub fn other_shape(&mut self, word: Keyword, lacks: &mut Lacks) -> Res<OtherShape> {
        let mut open = false;
        let (kind, extent) = self.shape_read(word, lacks, &mut open)?;
        Ok(OtherShape { kind, extent, open })
    }

    fn shape_read(&mut self, word: Keyword, lacks: &mut Lacks, is_open: &mut bool) -> Res<ShapeRead> {
        use Keyword as K;
        Ok(match word {
            K::Superellipsoid => {
                let exponents = self.pair("two exponents")?;
                (OtherKind::Superellipsoid(exponents), (-SUPERELLIPSOID, SUPERELLIPSOID))
            }
            K::Ovus => {
                let bottom = self.finite()?;
                self.comma()?;
                let top = self.finite()?;
                let wide = bottom.max(top);
                let extent = (DVec3::new(-wide, -bottom, -wide), DVec3::new(wide, bottom + top, wide));
                (OtherKind::Ovus { bottom, top }, extent)
            }
            K::Blob => self.blob(lacks)?,
            K::HeightField => self.height_field(lacks)?,
            K::Isosurface => self.isosurface(lacks, is_open)?,
            K::Parametric => self.parametric(lacks)?,
            K::JuliaFractal => self.julia_fractal()?,
            _ => return self.curved_shape(word),
        })
    }

    /// The objects and lights of a `light_group`; its modifiers come behind.
    pub fn light_group(&mut self) -> Res<ObjectValue> {
        let mut group = ObjectValue::default();
        let (mut objects, mut lights, mut around) = (Vec::new(), Vec::new(), Growing::default());
        let mut global_lights = false;
        loop {
            if let Some(child) = self.next_object()? {
                group.lacks.add(&child.lacks);
                group.facts.add(&child.facts);
                if let Some((min, max)) = self.extent(&child)? {
                    around.add(min, 0.0);
                    around.add(max, 0.0);
                }
                lights.extend(child.lights);
                objects.extend(child.object);
                self.check_depth(&group.facts)?;
            } else if !self.switch_item(&mut [(Keyword::GlobalLights, &mut global_lights)])? {
                break;
            }
        }
        let kind = OtherKind::LightGroup { objects, lights, global_lights };
        let shape = OtherShape { kind, extent: around.extent(), open: false };
        group.object = Some(Arc::new(Object::new(Shape::Other(Arc::new(shape)))));
        Ok(group)
    }

    fn blob(&mut self, lacks: &mut Lacks) -> Res<ShapeRead> {
        use Keyword as K;
        let mut around = Growing::default();
        let mut threshold = 1.0;
        let mut parts = Vec::new();
        loop {
            self.comma()?;
            match self.peek()? {
                Token::Word(word @ (K::Sphere | K::Cylinder)) => {
                    self.next()?;
                    parts.push(self.blob_part(word, &mut around, lacks)?);
                }
                Token::Word(K::Component) => {
                    self.next()?;
                    let strength = self.finite()?;
                    self.comma()?;
                    let radius = self.finite()?;
                    self.comma()?;
                    let center = self.vector()?;
                    around.add(center, radius);
                    let transform = Default::default();
                    parts.push(BlobPart { ends: vec![center], radius, strength, transform, texture: None });
                }
                _ => {
                    if !self.bounded_item(&mut [(K::Threshold, &mut threshold, ANY)])? {
                        break;
                    }
                }
            }
            self.charge(std::mem::size_of::<BlobPart>())?;
        }
        Ok((OtherKind::Blob { threshold, parts }, around.extent()))
    }

    fn blob_part(&mut self, word: Keyword, around: &mut Growing, lacks: &mut Lacks) -> Res<BlobPart> {
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
        let strength = self.finite()?;
        let mut part = Growing::default();
        ends.iter().for_each(|end| part.add(*end, radius));
        // Its modifiers are those of an object.
        let mut value = ObjectValue::from(super::geometry::stand_in(part.extent()));
        while self.modifier(&mut value)? {}
        self.close(word.text(), open)?;
        lacks.add(&value.lacks);
        if let Some((min, max)) = self.extent(&value)? {
            around.add(min, 0.0);
            around.add(max, 0.0);
        }
        let look = value.object.map(|object| (object.transform.clone(), object.texture.clone()));
        let (transform, texture) = look.unwrap_or_default();
        Ok(BlobPart { ends, radius, strength, transform, texture })
    }

    fn height_field(&mut self, lacks: &mut Lacks) -> Res<ShapeRead> {
        let image: ImageSource = self.image_source(lacks)?;
        let (mut water_level, mut smooth) = (0.0, false);
        while self.float_item(&mut [(Keyword::WaterLevel, &mut water_level)])?
            || self.switch_item(&mut [(Keyword::Smooth, &mut smooth)])?
        {}
        let extent = (DVec3::new(0.0, water_level, 0.0), DVec3::ONE);
        Ok((OtherKind::HeightField { image: Box::new(image), water_level, smooth }, extent))
    }

    /// `function { ... }`, or `{ ... }` behind a `function` that has been left out, or the name of one.
    fn inline_function(&mut self, lacks: &mut Lacks) -> Res<crate::scene::function::Callee> {
        let value = if self.accept_word(Keyword::Function)? { self.function()? } else { self.rvalue()? };
        let Value::Function(called) = value else { return self.expected("`function`") };
        lacks.add(&called.lacks);
        Ok(Called::clone(&called).value)
    }

    fn isosurface(&mut self, lacks: &mut Lacks, is_open: &mut bool) -> Res<ShapeRead> {
        use Keyword as K;
        let function = self.inline_function(lacks)?;
        self.comma()?;
        let (mut container, mut extent) = unit_box();
        let (mut threshold, mut accuracy, mut max_gradient) = (0.0, 0.001, 1.1);
        let mut evaluate = None;
        let mut max_trace = Some(1.0);
        while let Token::Word(word) = self.peek()? {
            match word {
                K::ContainedBy => (container, extent) = self.container()?,
                K::MaxTrace => {
                    let at = self.next()?;
                    let count = self.finite()?;
                    if count > MAX_TRACE {
                        let message = format!("`max_trace` is at most {MAX_TRACE}, found {count}");
                        self.warn("max_trace", message, self.span(at));
                    }
                    max_trace = Some(count.min(MAX_TRACE));
                }
                // It may stand among these, or behind them as any modifier.
                K::Open => {
                    self.next()?;
                    *is_open = true;
                }
                K::AllIntersections => {
                    self.next()?;
                    max_trace = None;
                }
                K::Evaluate => {
                    self.next()?;
                    let mut numbers = [0.0; 3];
                    for number in &mut numbers {
                        *number = self.finite()?;
                        self.comma()?;
                    }
                    evaluate = Some(numbers);
                }
                _ => {
                    if !self.bounded_item(&mut [
                        (K::Threshold, &mut threshold, ANY),
                        (K::Accuracy, &mut accuracy, ANY),
                        (K::MaxGradient, &mut max_gradient, ANY),
                    ])? {
                        break;
                    }
                }
            }
        }
        let shape =
            Isosurface { function, container, threshold, accuracy, max_gradient, evaluate, max_trace };
        Ok((OtherKind::Isosurface(Box::new(shape)), extent))
    }

    /// `contained_by { box { ... } }` or `{ sphere { ... } }`, and how far that reaches. Only its shape and place matter.
    fn container(&mut self) -> Res<(Arc<Object>, Extent)> {
        self.next()?;
        let open = self.open("contained_by")?;
        let value = self.object()?.unwrap_or_default();
        self.close("contained_by", open)?;
        let extent = self.extent(&value)?.unwrap_or_default();
        match value.object {
            Some(object) if matches!(object.shape, Shape::Box { .. } | Shape::Sphere { .. }) => {
                let (shape, transform) = (object.shape.clone(), object.transform.clone());
                Ok((Arc::new(Object { transform, ..Object::new(shape) }), extent))
            }
            _ => Err(self.error_here("expected a box or a sphere in `contained_by`")),
        }
    }

    fn parametric(&mut self, lacks: &mut Lacks) -> Res<ShapeRead> {
        use Keyword as K;
        let mut functions = [const { crate::scene::function::Callee::Missing }; 3];
        for function in &mut functions {
            *function = self.inline_function(lacks)?;
            self.comma()?;
        }
        let low = self.pair("the lowest u and v")?;
        self.comma()?;
        let high = self.pair("the highest u and v")?;
        self.comma()?;
        let (mut container, mut extent) = unit_box();
        let (mut accuracy, mut max_gradient) = (0.001, 1.0);
        let mut precompute = None;
        while let Token::Word(word) = self.peek()? {
            match word {
                K::ContainedBy => (container, extent) = self.container()?,
                K::Precompute => {
                    self.next()?;
                    let depth = self.finite()?;
                    self.comma()?;
                    let mut axes = [false; 3];
                    while let Token::Word(axis @ (K::X | K::Y | K::Z)) = self.peek()? {
                        self.next()?;
                        self.comma()?;
                        axes[if axis == K::X { 0 } else { 1 + usize::from(axis == K::Z) }] = true;
                    }
                    precompute = Some((depth, axes));
                }
                _ => {
                    if !self.bounded_item(&mut [
                        (K::MaxGradient, &mut max_gradient, ANY),
                        (K::Accuracy, &mut accuracy, ANY),
                    ])? {
                        break;
                    }
                }
            }
        }
        let bounds = [low, high];
        let shape = Parametric { functions, bounds, container, accuracy, max_gradient, precompute };
        Ok((OtherKind::Parametric(Box::new(shape)), extent))
    }

    fn julia_fractal(&mut self) -> Res<ShapeRead> {
        use Keyword as K;
        let [a, b, c, d, _] = self.expr()?.promoted(4);
        let mut shape = JuliaFractal {
            parameter: [a, b, c, d],
            hypercomplex: false,
            function: "sqr",
            exponent: [2.0, 0.0],
            max_iteration: 20,
            precision: 20.0,
            slice: ([0.0, 0.0, 0.0, 1.0], 0.0),
        };
        while let Token::Word(word) = self.peek()? {
            match word {
                K::Quaternion | K::Hypercomplex => {
                    self.next()?;
                    shape.hypercomplex = word == K::Hypercomplex;
                }
                _ if JULIA_FUNCTIONS.contains(&word) => {
                    self.next()?;
                    shape.function = word.text();
                }
                K::Pwr | K::Pow => {
                    self.next()?;
                    shape.function = "pwr";
                    self.expect(Mark::OpenParen)?;
                    for part in &mut shape.exponent {
                        *part = self.finite()?;
                        self.comma()?;
                    }
                    self.expect(Mark::CloseParen)?;
                }
                K::MaxIteration => {
                    self.next()?;
                    shape.max_iteration = self.integer("`max_iteration`", 0, u32::MAX)?;
                }
                K::Slice => {
                    self.next()?;
                    let [a, b, c, d, _] = self.expr()?.promoted(4);
                    self.comma()?;
                    shape.slice = ([a, b, c, d], self.finite()?);
                }
                _ => {
                    if !self.bounded_item(&mut [(K::Precision, &mut shape.precision, NOT_NEGATIVE)])? {
                        break;
                    }
                }
            }
        }
        // No point of these sets is farther from the origin.
        let extent = (DVec3::splat(-2.0), DVec3::splat(2.0));
        Ok((OtherKind::JuliaFractal(Box::new(shape)), extent))
    }
}

/// Functions that a `julia_fractal` iterates, apart from powers.
const JULIA_FUNCTIONS: [Keyword; 17] = {
    use Keyword as K;
    [
        K::Sqr,
        K::Cube,
        K::Exp,
        K::Reciprocal,
        K::Sin,
        K::Asin,
        K::Sinh,
        K::Asinh,
        K::Cos,
        K::Acos,
        K::Cosh,
        K::Acosh,
        K::Tan,
        K::Atan,
        K::Tanh,
        K::Atanh,
        K::Ln,
    ]
};

/// What contains a field of a function if nothing else is said.
fn unit_box() -> (Arc<Object>, Extent) {
    let extent = (DVec3::NEG_ONE, DVec3::ONE);
    (Arc::new(super::geometry::stand_in(extent)), extent)
}
