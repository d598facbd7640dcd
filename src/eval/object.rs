//! Objects: modifiers, constructive geometry, placing (manual sections 3.4.5 and 3.4.8).

use super::geometry::stand_in;
use super::machine::{Lexeme, Machine, Res};
use super::texture::layer_over;
use super::value::{Lacks, ObjectValue, Value, With};
use crate::lang::{Keyword, Token};
use crate::scene::{CsgOp, Interior, Object, Shape, Texture, Transform};
use std::sync::Arc;

/// Bytes that an object takes, roughly, with its texture; for the memory limit.
const OBJECT_BYTES: usize = 700;

/// Composites may be within each other to this depth: everybody who walks them recurses. A loop can build a deeper one
/// (`#declare U = union { object { U } ... }`) than braces allow to write.
const DEPTH: usize = 500;

impl Machine<'_> {
    /// Reads an object if one is next; `None` (and nothing taken) if not.
    pub fn object(&mut self) -> Res<Option<ObjectValue>> {
        let Token::Word(word) = self.peek()? else { return Ok(None) };
        if !is_object(word) {
            return Ok(None);
        }
        self.charge(OBJECT_BYTES)?;
        self.deeper(|m| {
            let at = m.next()?;
            m.object_block(word, at).map(Some)
        })
    }

    fn object_block(&mut self, word: Keyword, at: Lexeme) -> Res<ObjectValue> {
        if word == Keyword::LightSource {
            return self.light();
        }
        let what = word.text();
        let open = self.open(what)?;
        let named = self.named_object()?;
        let mut value = match named {
            Some(value) => value,
            None => match word {
                Keyword::Object => match self.object()? {
                    Some(value) => value,
                    None => return self.expected("an object or the name of one"),
                },
                Keyword::Union => self.csg(CsgOp::Union, at)?,
                Keyword::Merge => self.csg(CsgOp::Merge, at)?,
                Keyword::Intersection => self.csg(CsgOp::Intersection, at)?,
                Keyword::Difference => self.csg(CsgOp::Difference, at)?,
                Keyword::Mesh => self.mesh(at)?,
                Keyword::Mesh2 => self.mesh2(at)?,
                _ => match self.shape(word, at)? {
                    Some(value) => value,
                    None => {
                        // Not modelled: read to the end, and left out.
                        let lacks = self.lack(what, at);
                        let stand_in = match word {
                            Keyword::LightGroup | Keyword::Composite => {
                                let group = self.light_group()?;
                                let mut value = ObjectValue { lacks, ..group };
                                while self.modifier(&mut value)? {}
                                self.close(what, open)?;
                                return Ok(value);
                            }
                            _ => Some(Arc::new(stand_in(self.other_shape(word)?))),
                        };
                        ObjectValue { object: None, stand_in, depth: 0, lights: Vec::new(), lacks }
                    }
                },
            },
        };
        while self.modifier(&mut value)? {}
        self.close(what, open)?;
        Ok(value)
    }

    /// A copy of a declared object, if its name is next.
    pub fn named_object(&mut self) -> Res<Option<ObjectValue>> {
        let named = self.take_named(|value| match value {
            Value::Object(object) => Some(object.clone()),
            _ => None,
        })?;
        let copy = named.map(|object| object.copy());
        if copy.is_some() {
            self.charge(OBJECT_BYTES)?;
        }
        Ok(copy)
    }

    /// The children of a composite.
    fn csg(&mut self, op: CsgOp, at: Lexeme) -> Res<ObjectValue> {
        let mut children = Vec::new();
        let mut lights = Vec::new();
        let mut lacks = Lacks::default();
        let mut cutters_missing = false;
        let mut depth = 0;
        let mut stand_ins = Vec::new();
        let mut any_stand_in = false;
        while let Some(child) = self.object()? {
            depth = depth.max(child.depth + 1);
            if depth > DEPTH {
                return Err(self.halt(format!("composites within each other more than {DEPTH} levels deep")));
            }
            cutters_missing |= child.object.is_none() && child.lights.is_empty();
            any_stand_in |= child.stand_in.is_some();
            stand_ins.extend(child.stand_in.or_else(|| child.object.clone()));
            children.extend(child.object);
            lights.extend(child.lights);
            lacks.add(&child.lacks);
        }
        let span = self.span(at);
        if children.len() == 1 && lights.is_empty() && !cutters_missing {
            self.warn(
                "csg of one",
                format!("a `{}` of one object", self.sources.text(span).to_owned()),
                span,
            );
        }
        if children.is_empty() && lights.is_empty() && !cutters_missing {
            self.warn("empty csg", format!("a `{}` of nothing", self.sources.text(span).to_owned()), span);
        }
        let object = (!children.is_empty())
            .then(|| Arc::new(Object::new(Shape::Csg { op, children, cutaway_textures: false })));
        let stand_in = any_stand_in.then(|| {
            let shape = Shape::Csg { op, children: stand_ins, cutaway_textures: false };
            Arc::new(Object::new(shape))
        });
        Ok(ObjectValue { object, stand_in, depth, lights, lacks })
    }

    /// One modifier of an object. False if the next token is none.
    pub fn modifier(&mut self, value: &mut ObjectValue) -> Res<bool> {
        use Keyword as K;
        let Token::Word(word) = self.peek()? else { return Ok(false) };
        if let Some(transform) = self.transform_item(word)? {
            value.transform(&transform);
            if word == K::Scale {
                value
                    .object
                    .iter_mut()
                    .filter(|o| has_smooth_triangles(o))
                    .for_each(|o| rescale_normals(Arc::make_mut(o)));
            }
            return Ok(true);
        }
        let at = self.peek_lexeme()?;
        // What is said of a shape that is not there is read all the same.
        let mut nothing;
        let lacks = &mut value.lacks;
        let object = match &mut value.object {
            Some(object) => Arc::make_mut(object),
            None => {
                nothing = Object::new(Shape::Sphere { center: glam::DVec3::ZERO, radius: 1.0 });
                &mut nothing
            }
        };
        match word {
            K::Texture => {
                self.next()?;
                if object.texture.is_none()
                    && let Some(named) = self.only_named_texture()?
                {
                    lacks.add(&named.lacks);
                    object.texture = Some(named.value.clone());
                    return Ok(true);
                }
                let texture = self.texture()?;
                self.add_layer(&mut object.texture, lacks, texture);
            }
            K::InteriorTexture => {
                self.next()?;
                let texture = self.texture()?;
                self.add_layer(&mut object.interior_texture, lacks, texture);
            }
            K::Pigment | K::Finish | K::Normal => {
                let mut texture = match &object.texture {
                    Some(texture) => With::new(Texture::clone(texture)),
                    None => self.default_texture.clone(),
                };
                let result = self.surface_item(word, &mut texture);
                lacks.add(&texture.lacks);
                object.texture = Some(Arc::new(texture.value));
                result?;
            }
            K::Interior => {
                self.next()?;
                let interior = self.interior(object.interior.as_deref())?;
                lacks.add(&interior.lacks);
                object.interior = Some(interior.value);
            }
            K::Material => {
                self.next()?;
                let material = self.material()?;
                if let Some(texture) = material.texture {
                    self.add_layer(&mut object.texture, lacks, texture);
                }
                if let Some(texture) = material.interior_texture {
                    self.add_layer(&mut object.interior_texture, lacks, texture);
                }
                if let Some(interior) = material.interior {
                    lacks.add(&interior.lacks);
                    object.interior = Some(interior.value);
                }
            }
            K::ClippedBy | K::BoundedBy => {
                self.next()?;
                let open = self.open(word.text())?;
                let mut helpers = Vec::new();
                let other = if word == K::ClippedBy { K::BoundedBy } else { K::ClippedBy };
                if self.accept_word(other)? {
                    helpers = if word == K::ClippedBy {
                        object.bounded_by.clone()
                    } else {
                        object.clipped_by.clone()
                    };
                }
                while let Some(helper) = self.helper(lacks)? {
                    helpers.extend(helper);
                }
                self.close(word.text(), open)?;
                if word == K::ClippedBy {
                    object.clipped_by.append(&mut helpers);
                } else {
                    object.bounded_by.append(&mut helpers);
                }
            }
            K::NoShadow => {
                self.next()?;
                object.flags.no_shadow = true;
            }
            K::NoImage => {
                self.next()?;
                object.flags.no_image = self.switch_value()?;
            }
            K::NoReflection => {
                self.next()?;
                object.flags.no_reflection = self.switch_value()?;
            }
            K::Hollow => {
                self.next()?;
                object.flags.hollow = self.switch_value()?;
            }
            K::DoubleIlluminate => {
                self.next()?;
                object.flags.double_illuminate = self.switch_value()?;
            }
            K::Inverse => {
                self.next()?;
                object.flags.inverse = !object.flags.inverse;
            }
            K::CutawayTextures => {
                self.next()?;
                if let Shape::Csg { cutaway_textures, .. } = &mut object.shape {
                    *cutaway_textures = true;
                }
            }
            K::Open => {
                match &mut object.shape {
                    Shape::Cone { open, .. } => *open = true,
                    _ if value.stand_in.is_some() => {}
                    _ => return Ok(false),
                }
                self.next()?;
            }
            // Hints that change no picture of ours.
            K::Sturm | K::Hierarchy | K::NoRadiosity | K::SplitUnion | K::NoBumpScale | K::GlobalLights => {
                self.next()?;
                self.switch_value()?;
            }
            K::Photons | K::Radiosity => {
                self.next()?;
                self.block_left_out(word.text())?;
                self.ignore(
                    if word == K::Photons { "photons of an object" } else { "radiosity of an object" },
                    at,
                );
            }
            K::UvMapping => {
                self.next()?;
                self.switch_value()?;
                lacks.add(&self.lack("uv_mapping", at));
            }
            // A very old form of `quick_color`.
            K::Color | K::Colour => {
                self.color()?;
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// An object within `clipped_by` or `bounded_by`.
    fn helper(&mut self, lacks: &mut Lacks) -> Res<Option<Option<Arc<Object>>>> {
        let helper = match self.named_object()? {
            Some(value) => value,
            None => match self.object()? {
                Some(value) => value,
                None => return Ok(None),
            },
        };
        lacks.add(&helper.lacks);
        Ok(Some(helper.object))
    }

    /// Another texture over those that the object has.
    fn add_layer(&mut self, slot: &mut Option<Arc<Texture>>, lacks: &mut Lacks, texture: With<Texture>) {
        lacks.add(&texture.lacks);
        let mut layers = slot.take().map(|texture| With::new(Texture::clone(&texture)));
        layer_over(&mut layers, texture);
        *slot = layers.map(|layers| Arc::new(layers.value));
    }

    /// Puts an object and its lights into the scene.
    pub fn place(&mut self, value: ObjectValue) {
        self.miss(&value.lacks);
        self.scene.lights.extend(value.lights);
        if let Some(mut object) = value.object {
            // Each is an object of its own, even if it is one and the same declared object.
            self.give_default(Arc::make_mut(&mut object));
            self.scene.objects.push(object);
        }
    }

    /// Gives the default texture to what has none, but not to what `cutaway_textures` is to give one.
    fn give_default(&mut self, object: &mut Object) {
        if object.texture.is_some() {
            return;
        }
        match &mut object.shape {
            Shape::Csg { cutaway_textures: true, .. } => {}
            Shape::Csg { op: CsgOp::Union, children, .. }
                if children.iter().any(|child| is_cutaway(child)) =>
            {
                children.iter_mut().for_each(|child| self.give_default(Arc::make_mut(child)));
            }
            _ => {
                let lacks = self.default_texture.lacks.clone();
                self.miss(&lacks);
                object.texture = Some(self.shared_default());
            }
        }
    }

    fn shared_default(&mut self) -> Arc<Texture> {
        match &self.default_shared {
            Some(texture) => texture.clone(),
            None => {
                let texture = Arc::new(self.default_texture.value.clone());
                self.default_shared = Some(texture.clone());
                texture
            }
        }
    }
}

/// POV-Ray makes the placed normals of a `smooth_triangle` unit vectors again at a `scale`, but not at a `matrix` or
/// `transform`, nor those of a mesh (measured). Done here by lengthening them before they are placed.
fn rescale_normals(object: &mut Object) {
    fn within(object: &mut Object, outer: &Transform) {
        let place = object.transform.then(outer);
        match &mut object.shape {
            Shape::Triangle { normals: Some(normals), .. } => {
                for n in normals.iter_mut() {
                    let length = place.normal(*n).length();
                    if length > 0.0 && length.is_finite() {
                        *n /= length;
                    }
                }
            }
            Shape::Csg { children, .. } => {
                children.iter_mut().for_each(|child| within(Arc::make_mut(child), &place));
            }
            _ => {}
        }
    }
    within(object, &Transform::IDENTITY);
}

/// Composites share their children: what need not change is not copied.
fn has_smooth_triangles(object: &Object) -> bool {
    match &object.shape {
        Shape::Triangle { normals, .. } => normals.is_some(),
        Shape::Csg { children, .. } => children.iter().any(|child| has_smooth_triangles(child)),
        _ => false,
    }
}

impl ObjectValue {
    /// The object as another one of its kind. Its interiors are new ones: two copies of a glass ball that overlap are two
    /// pieces of glass (measured), while the children of one union share the union's.
    fn copy(&self) -> Self {
        let mut copy = self.clone();
        if let Some(object) = &mut copy.object
            && has_interior(object)
        {
            renew_interiors(Arc::make_mut(object));
        }
        copy
    }

    /// Moves the object and its lights.
    pub fn transform(&mut self, transform: &Transform) {
        for object in [&mut self.object, &mut self.stand_in].into_iter().flatten() {
            Arc::make_mut(object).move_by(transform);
        }
        for light in &mut self.lights {
            light.location = transform.point(light.location);
            light.point_at = transform.point(light.point_at);
        }
    }
}

fn has_interior(object: &Object) -> bool {
    object.interior.is_some()
        || matches!(&object.shape, Shape::Csg { children, .. } if children.iter().any(|child| has_interior(child)))
}

fn renew_interiors(object: &mut Object) {
    if let Some(interior) = &mut object.interior {
        *interior = Arc::new(Interior::clone(interior));
    }
    if let Shape::Csg { children, .. } = &mut object.shape {
        for child in children {
            if has_interior(child) {
                renew_interiors(Arc::make_mut(child));
            }
        }
    }
}

impl From<Object> for ObjectValue {
    fn from(object: Object) -> Self {
        Self {
            object: Some(Arc::new(object)),
            stand_in: None,
            depth: 0,
            lights: Vec::new(),
            lacks: Lacks::default(),
        }
    }
}

impl From<Shape> for ObjectValue {
    fn from(shape: Shape) -> Self {
        Object::new(shape).into()
    }
}

/// Words that begin an object.
pub(super) fn is_object(word: Keyword) -> bool {
    use Keyword as K;
    matches!(
        word,
        K::Object
            | K::Union
            | K::Merge
            | K::Intersection
            | K::Difference
            | K::Composite
            | K::Sphere
            | K::Plane
            | K::Box
            | K::Cylinder
            | K::Cone
            | K::Disc
            | K::Torus
            | K::Triangle
            | K::SmoothTriangle
            | K::Polygon
            | K::Mesh
            | K::Mesh2
            | K::LightSource
            | K::BicubicPatch
            | K::Blob
            | K::Cubic
            | K::HeightField
            | K::Isosurface
            | K::JuliaFractal
            | K::Lathe
            | K::LightGroup
            | K::Ovus
            | K::Parametric
            | K::Poly
            | K::Polynomial
            | K::Prism
            | K::Quadric
            | K::Quartic
            | K::Sor
            | K::SphereSweep
            | K::Superellipsoid
            | K::Text
    )
}

/// True if an untextured part of it shows what it cuts.
fn is_cutaway(object: &Object) -> bool {
    match &object.shape {
        Shape::Csg { cutaway_textures, op, children } => {
            *cutaway_textures || (*op == CsgOp::Union && children.iter().any(|child| is_cutaway(child)))
        }
        _ => false,
    }
}
