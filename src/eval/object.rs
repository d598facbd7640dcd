//! Objects: what stands in their braces, and their modifiers (manual sections 3.4.5 and 3.4.8).

use super::geometry::stand_in;
use super::machine::{Lexeme, Machine, Res};
use super::shape::are_on_one_side;
use super::value::{Absent, Facts, Lacks, ObjectValue, Value, With};
use crate::lang::{Keyword, Token};
use crate::scene::{CsgOp, Interior, Light, Object, OtherKind, Shape, Texture, Transform};
use std::sync::Arc;

/// Bytes that an object takes, roughly, with its texture; for the memory limit.
const OBJECT_BYTES: usize = 700;

/// Objects may be within each other to this depth: everybody who walks them recurses. A loop can build a deeper one
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
                        // Not modelled: it has no points, and a box answers for it where a script asks.
                        let mut lacks = self.lack(what, at);
                        if matches!(word, Keyword::LightGroup | Keyword::Composite) {
                            let group = self.light_group()?;
                            lacks.add(&group.lacks);
                            ObjectValue { lacks, ..group }
                        } else {
                            let shape = self.other_shape(word, &mut lacks)?;
                            let stand_in = Some(Arc::new(stand_in(shape.extent)));
                            ObjectValue { stand_in, lacks, ..Shape::Other(Arc::new(shape)).into() }
                        }
                    }
                },
            },
        };
        while self.modifier(&mut value)? {}
        self.close(what, open)?;
        let lone = |object: &Arc<Object>| object.texture.is_none() && object.interior_texture().is_some();
        if value.object.as_ref().is_some_and(lone) {
            let message = format!("this `{what}` has an `interior_texture`, but no `texture` of its own");
            return Err(self.error(message, self.span(at)));
        }
        Ok(value)
    }

    /// A copy of a declared object, if its name is next.
    pub fn named_object(&mut self) -> Res<Option<ObjectValue>> {
        let named = self.take_named(|value| match value {
            Value::Object(object) => Some(object.clone()),
            _ => None,
        })?;
        if let Some(object) = &named {
            self.charge(OBJECT_BYTES + size_of::<Light>() * object.lights.len())?;
        }
        Ok(named.map(|object| object.copy()))
    }

    /// An object by name or as it stands, if one is next.
    pub fn next_object(&mut self) -> Res<Option<ObjectValue>> {
        let named = self.named_object()?;
        if named.is_some() { Ok(named) } else { self.object() }
    }

    /// An object by name or as it stands.
    pub fn any_object(&mut self) -> Res<ObjectValue> {
        match self.next_object()? {
            Some(value) => Ok(value),
            None => self.expected("an object or the name of one"),
        }
    }

    /// One modifier of an object. False if the next token is none.
    #[inline]
    pub fn modifier(&mut self, value: &mut ObjectValue) -> Res<bool> {
        match self.peek()? {
            Token::Word(word) => self.modifier_word(word, value),
            Token::Name(_) => self.stray_color(),
            _ => Ok(false),
        }
    }

    /// A colour that is not in a pigment: a very old form of `quick_color`. False if none is next.
    fn stray_color(&mut self) -> Res<bool> {
        if !self.starts_color()? {
            return Ok(false);
        }
        let at = self.peek_lexeme()?;
        self.color()?;
        let message = "a colour counts for nothing here: it belongs in a `pigment`";
        self.warn("stray color", message, self.span(at));
        Ok(true)
    }

    fn modifier_word(&mut self, word: Keyword, value: &mut ObjectValue) -> Res<bool> {
        use Keyword as K;
        if word == K::Pigment
            && let Some(object) = &mut value.object
            && object.texture.is_none()
            && let Some(texture) = self.plain_pigment()
        {
            value.lacks.add(&self.default_texture.lacks);
            Arc::make_mut(object).texture = Some(texture);
            return Ok(true);
        }
        if let Some(transform) = self.transform_item(word)? {
            self.charge_move(&value.facts)?;
            value.transform(&transform);
            if matches!(word, K::Scale | K::Matrix | K::Transform)
                && value.facts.smooth_triangles
                && let Some(object) = &mut value.object
            {
                self.check_normals(object, &Transform::IDENTITY, word == K::Scale)?;
            }
            return Ok(true);
        }
        let at = self.peek_lexeme()?;
        if word == K::Inverse && value.object.is_none() {
            value.absent = value.absent.inverted();
        }
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
                    && let Some(named) = self.only_named_texture(lacks)
                {
                    object.texture = Some(named);
                    return Ok(true);
                }
                let texture = self.texture()?;
                self.add_layer(&mut object.texture, lacks, texture)?;
            }
            K::InteriorTexture => {
                self.next()?;
                let texture = self.texture()?;
                self.add_layer(&mut object.more_mut().interior_texture, lacks, texture)?;
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
                value.facts.interior = true;
            }
            K::Material => {
                self.next()?;
                let material = self.material()?;
                if let Some(texture) = material.texture {
                    self.add_layer(&mut object.texture, lacks, texture)?;
                }
                if let Some(texture) = material.interior_texture {
                    self.add_layer(&mut object.more_mut().interior_texture, lacks, texture)?;
                }
                if let Some(interior) = material.interior {
                    lacks.add(&interior.lacks);
                    // One of its own: two things of one material that overlap are two, as a ray counts them (measured).
                    object.interior = Some(Arc::new(Interior::clone(&interior.value)));
                    value.facts.interior = true;
                }
            }
            K::ClippedBy | K::BoundedBy => {
                self.next()?;
                let open = self.open(word.text())?;
                let (mut helpers, mut vanishes) = (Vec::new(), false);
                let other = if word == K::ClippedBy { K::BoundedBy } else { K::ClippedBy };
                if self.accept_word(other)? {
                    helpers = if word == K::ClippedBy {
                        object.bounded_by().to_vec()
                    } else {
                        object.clipped_by().to_vec()
                    };
                }
                loop {
                    let start = self.peek_lexeme()?;
                    let Some(helper) = self.helper()? else { break };
                    if helper.facts.patch || helper.is_textured() {
                        let what = if helper.facts.patch { "no inside" } else { "a texture" };
                        let message = format!("what has {what} cannot stand in `{}`", word.text());
                        return Err(self.error(message, self.span(start)));
                    }
                    lacks.add(&helper.lacks);
                    value.facts.add_helper(&helper.facts);
                    self.check_depth(&value.facts)?;
                    vanishes |=
                        helper.object.is_none() && matches!(helper.absent, Absent::Nothing | Absent::Flat);
                    helpers.extend(helper.object);
                }
                self.close(word.text(), open)?;
                if word == K::ClippedBy && vanishes {
                    (value.object, value.absent) = (None, Absent::Nothing);
                } else if word == K::ClippedBy {
                    object.more_mut().clipped_by.append(&mut helpers);
                } else {
                    object.more_mut().bounded_by.append(&mut helpers);
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
                object.flags.turned = true;
                if value.facts.patch {
                    let message = "`inverse` of what has no inside changes nothing";
                    self.warn("inverse of a patch", message, self.span(at));
                }
            }
            K::CutawayTextures => {
                self.next()?;
                if let Shape::Csg { cutaway_textures, .. } = &mut object.shape {
                    *cutaway_textures = true;
                    value.facts.cutaway = true;
                }
            }
            K::Open => {
                match &mut object.shape {
                    Shape::Cone { open, .. } => *open = true,
                    Shape::Other(other) => Arc::make_mut(other).open = true,
                    _ => return Ok(false),
                }
                self.next()?;
            }
            K::SplitUnion => {
                self.next()?;
                object.more_mut().unsplit = !self.switch_value()?;
            }
            // Hints that change no picture of ours.
            K::Sturm | K::Hierarchy | K::NoRadiosity | K::NoBumpScale | K::GlobalLights => {
                self.next()?;
                self.switch_value()?;
            }
            K::Photons => {
                self.next()?;
                object.more_mut().photons = Some(self.photon_use()?);
                self.ignore("photons of an object", at);
            }
            K::Radiosity => {
                self.next()?;
                self.radiosity_importance()?;
                self.ignore("radiosity of an object", at);
            }
            K::UvMapping => {
                self.next()?;
                object.uv_mapping = self.switch_value()?;
                lacks.add(&self.lack("uv_mapping", at));
            }
            _ => return self.stray_color(),
        }
        Ok(true)
    }

    /// An object within `clipped_by` or `bounded_by`.
    fn helper(&mut self) -> Res<Option<ObjectValue>> {
        match self.named_object()? {
            Some(value) => Ok(Some(value)),
            None => self.object(),
        }
    }

    /// Refuses objects within each other without end: everybody who walks them recurses.
    pub fn check_depth(&self, facts: &Facts) -> Res<()> {
        if facts.depth > DEPTH {
            return Err(self.halt(format!("objects within each other more than {DEPTH} levels deep")));
        }
        Ok(())
    }

    /// A move copies what clips and what bounds.
    pub fn charge_move(&mut self, facts: &Facts) -> Res<()> {
        match facts.helpers {
            0 => Ok(()),
            helpers => self.charge(OBJECT_BYTES.saturating_mul(helpers as usize)),
        }
    }

    /// Another texture over those that the object has.
    fn add_layer(
        &mut self,
        slot: &mut Option<Arc<Texture>>,
        lacks: &mut Lacks,
        texture: With<Texture>,
    ) -> Res<()> {
        lacks.add(&texture.lacks);
        let mut layers = slot.take().map(|texture| With::new(Texture::clone(&texture)));
        self.layer_over(&mut layers, texture)?;
        *slot = layers.map(|layers| Arc::new(layers.value));
        Ok(())
    }

    /// Where a `smooth_triangle` is placed POV-Ray looks whether its normals are still on one side of it, and at a `scale` makes them unit
    /// vectors again; neither of a mesh (measured). Done here by lengthening them before they are placed. `outer` leads from the parent's
    /// space to where the transform was said.
    fn check_normals(&mut self, object: &mut Arc<Object>, outer: &Transform, scaled: bool) -> Res<()> {
        let shared = match &object.shape {
            Shape::Triangle { normals: Some(_), .. } | Shape::Csg { .. } => Arc::get_mut(object).is_none(),
            _ => return Ok(()),
        };
        if shared {
            self.charge(OBJECT_BYTES)?;
        }
        self.count_steps(1)?;
        let object = Arc::make_mut(object);
        let place = object.transform.then(outer);
        match &mut object.shape {
            Shape::Triangle { vertices, normals: Some(normals) } => {
                for n in normals.iter_mut().filter(|_| scaled) {
                    let length = place.normal(*n).length();
                    if length > 0.0 && length.is_finite() {
                        *n /= length;
                    }
                }
                let (placed, normals) = (vertices.map(|v| place.point(v)), normals.map(|n| place.normal(n)));
                if !are_on_one_side(&placed, &normals) {
                    // Such a triangle is not there; one without area is never hit.
                    **vertices = [vertices[0]; 3];
                }
            }
            Shape::Csg { children, .. } => {
                for child in children {
                    self.check_normals(child, &place, scaled)?;
                }
            }
            _ => {}
        }
        Ok(())
    }
}

impl ObjectValue {
    /// The object as another one of its kind. Its interiors are new ones: two copies of a glass ball that overlap are two
    /// pieces of glass (measured), while the children of one union share the union's.
    fn copy(&self) -> Self {
        let mut copy = self.clone();
        if self.facts.interior
            && let Some(object) = &mut copy.object
        {
            let object = Arc::make_mut(object);
            if let Some(interior) = &mut object.interior {
                *interior = Arc::new(Interior::clone(interior));
            }
            // Those of the children are made new by whoever takes the tree apart: a copy of all of it here would double with
            // every line of `#declare A = union { object { A } object { A } }`.
            object.own_interiors = true;
        }
        copy
    }

    /// True if it or a part of it has a texture.
    pub fn is_textured(&self) -> bool {
        let own = |object: &Arc<Object>| object.texture.is_some() || object.interior_texture().is_some();
        self.facts.textured_part || self.object.as_ref().is_some_and(own)
    }

    /// Moves the object and its lights.
    pub fn transform(&mut self, transform: &Transform) {
        for object in [&mut self.object, &mut self.stand_in].into_iter().flatten() {
            Arc::make_mut(object).move_by(transform);
        }
        self.lights.iter_mut().for_each(|light| light.move_by(transform));
    }
}

impl From<Object> for ObjectValue {
    fn from(object: Object) -> Self {
        let (shapes, smooth_triangles, patch) = match &object.shape {
            Shape::Mesh(mesh) => (mesh.triangles.len() as u64, false, mesh.inside_vector.is_none()),
            Shape::Triangle { normals, .. } => (1, normals.is_some(), true),
            Shape::Other(other) => {
                (1, false, matches!(other.kind, OtherKind::BicubicPatch { .. } | OtherKind::Parametric(_)))
            }
            _ => (1, false, false),
        };
        let facts = Facts { shapes, smooth_triangles, patch, ..Facts::default() };
        Self { object: Some(Arc::new(object)), facts, ..Self::default() }
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
