//! What a name can stand for.

use crate::lang::Symbol;
use crate::scene::{ColorMap, Finish, Interior, Light, Object, Pigment, Placement, Texture};
use glam::DVec3;
use smallvec::SmallVec;
use std::sync::Arc;

/// The value of an identifier, an array element or a macro argument.
#[derive(Debug, Clone)]
pub(super) enum Value {
    Number(Num),
    String(Arc<str>),
    Array(Arc<Array>),
    Macro(Arc<Macro>),
    Function(Arc<super::function::Called>),
    Spline(Arc<crate::scene::Spline>),
    Random(Arc<std::sync::atomic::AtomicU32>),
    Transform(Placement),
    Pigment(Arc<With<Pigment>>),
    Texture(Arc<With<Arc<Texture>>>),
    Finish(Arc<With<Finish>>),
    Normal(Arc<With<crate::scene::Normal>>),
    Density(Arc<With<Pigment>>),
    Map(Arc<With<NamedMap>>),
    Interior(With<Arc<Interior>>),
    Material(Arc<Material>),
    ColorMap(Arc<With<ColorMap>>),
    Object(Arc<ObjectValue>),
    Camera(Arc<super::camera::CameraSpec>),
    Fog(Arc<crate::scene::Fog>),
    Rainbow(Arc<crate::scene::Rainbow>),
    SkySphere(Arc<With<crate::scene::SkySphere>>),
    Media(Arc<With<crate::scene::Media>>),
    /// What `#fopen` opened.
    File(u32),
    /// A library's block that nobody has asked for yet. Whoever looks at a name's token finds it evaluated.
    Later(Arc<super::later::Later>),
    /// Its declaration failed; whoever uses it fails without a word.
    Poison,
}

/// A float (`n` 1) or a vector of 2 to 5 components; the 5-vector is the colour `<red, green, blue, filter, transmit>`.
/// Components from `n` on are 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Num {
    pub n: u8,
    pub v: [f64; 5],
}

/// `array[a][b]`, row by row. Elements that were never set are `None`.
#[derive(Debug, Clone)]
pub(super) struct Array {
    pub dims: SmallVec<[usize; 2]>,
    pub items: Vec<Option<Value>>,
    /// Arrays within each other, itself included; never less than there are.
    pub depth: usize,
}

/// Parameters, and where the body's tokens are.
#[derive(Debug)]
pub(super) struct Macro {
    pub name: Symbol,
    pub params: SmallVec<[Symbol; 4]>,
    pub program: u32,
    pub body: u32,
}

/// A map that was declared by itself.
#[derive(Debug, Clone)]
pub(super) enum NamedMap {
    Pigments(Vec<(f64, Pigment)>),
    Normals(Vec<(f64, crate::scene::Normal)>),
    Textures(Vec<(f64, Texture)>),
    Densities(Vec<(f64, Pigment)>),
    Slopes(Vec<[f64; 3]>),
}

impl NamedMap {
    fn kind(&self) -> &'static str {
        match self {
            NamedMap::Pigments(_) => "pigment_map",
            NamedMap::Normals(_) => "normal_map",
            NamedMap::Textures(_) => "texture_map",
            NamedMap::Densities(_) => "density_map",
            NamedMap::Slopes(_) => "slope_map",
        }
    }
}

/// A value and what is not modelled in it.
#[derive(Debug, Clone, Default)]
pub(super) struct With<T> {
    pub value: T,
    pub lacks: Lacks,
}

/// A texture for each side, and an interior.
#[derive(Debug, Clone, Default)]
pub(super) struct Material {
    pub texture: Option<With<Texture>>,
    pub interior_texture: Option<With<Texture>>,
    pub interior: Option<With<Arc<Interior>>>,
}

/// A thing that can be placed: an object, the lights that came with it, and what is not modelled in them.
#[derive(Debug, Clone, Default)]
pub(super) struct ObjectValue {
    /// `None` for a bare light, and for a shape that is not modelled.
    pub object: Option<Arc<Object>>,
    /// What a script may ask instead of `object`, if that or a part of it is not modelled.
    pub stand_in: Option<Arc<Object>>,
    pub lights: Vec<Light>,
    pub lacks: Lacks,
    pub facts: Facts,
    /// What a composite makes of it if there is no `object`.
    pub absent: Absent,
}

/// What a part without surfaces is to the composite that it stands in.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Absent {
    /// Nothing is inside: a union of nothing, a sphere of radius 0.
    #[default]
    Nothing,
    /// Everything is inside: an intersection of nothing.
    Everything,
    /// It has no inside to turn: a triangle without area.
    Flat,
    /// It is no part at all.
    Light,
}

impl Absent {
    /// The same inside out.
    pub fn inverted(self) -> Self {
        match self {
            Self::Nothing => Self::Everything,
            Self::Everything => Self::Nothing,
            Self::Flat | Self::Light => self,
        }
    }
}

/// What is known of an object and everything it is made of, so that nobody has to walk it: its parts are shared, and a script
/// of forty lines can make an object to whose parts there are 2^40 ways.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Facts {
    /// Objects within each other.
    pub depth: usize,
    /// As often as they are met on the way down; a mesh's triangles each.
    pub shapes: u64,
    /// Objects in `clipped_by` and `bounded_by`, and in theirs.
    pub helpers: u64,
    /// Some part has an interior of its own.
    pub interior: bool,
    pub smooth_triangles: bool,
    /// Some part shows what it cuts.
    pub cutaway: bool,
    /// Some part has no inside: a triangle, a mesh without `inside_vector`, a bicubic patch.
    pub patch: bool,
    /// Some part has a texture of its own.
    pub textured_part: bool,
}

impl Facts {
    /// Takes in a part.
    pub fn add(&mut self, part: &Facts) {
        self.depth = self.depth.max(part.depth + 1);
        self.shapes = self.shapes.saturating_add(part.shapes);
        self.interior |= part.interior;
        self.smooth_triangles |= part.smooth_triangles;
        self.cutaway |= part.cutaway;
        self.patch |= part.patch;
        self.textured_part |= part.textured_part;
    }

    /// Takes in an object that clips or bounds.
    pub fn add_helper(&mut self, helper: &Facts) {
        self.depth = self.depth.max(helper.depth + 1);
        self.shapes = self.shapes.saturating_add(helper.shapes);
        self.helpers = self.helpers.saturating_add(helper.helpers).saturating_add(1);
    }
}

/// What is not modelled in a value.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Lacks {
    /// Indices into the machine's table of what was met; sorted, each once.
    pub met: SmallVec<[u32; 2]>,
    /// Patterns within each other: whoever takes the value apart recurses.
    pub depth: u32,
}

impl Lacks {
    #[inline]
    pub fn add(&mut self, other: &Lacks) {
        self.depth = self.depth.max(other.depth);
        match (self.met.last(), other.met.first()) {
            (_, None) => {}
            (Some(last), Some(first)) if first <= last => self.merge(&other.met),
            // What is met later has the larger index: this is the usual way, and must not look at what is there.
            _ => self.met.extend_from_slice(&other.met),
        }
    }
}

impl Lacks {
    /// Takes in what is not there yet, which need not come after all that is.
    fn merge(&mut self, met: &[u32]) {
        let there = self.met.len();
        for index in met {
            if self.met[..there].binary_search(index).is_err() {
                self.met.push(*index);
            }
        }
        // Two runs in order are put together in linear time.
        if self.met.get(there).is_some_and(|first| *first < self.met[there - 1]) {
            self.met.sort();
        }
    }
}

impl<T: Clone> With<Arc<T>> {
    /// A copy to be changed.
    pub fn copy(&self) -> With<T> {
        With { value: T::clone(&self.value), lacks: self.lacks.clone() }
    }
}

impl<T> With<T> {
    pub fn new(value: T) -> Self {
        Self { value, lacks: Lacks::default() }
    }
}

impl Num {
    pub const fn float(value: f64) -> Self {
        Self { n: 1, v: [value, 0.0, 0.0, 0.0, 0.0] }
    }

    pub const fn vector(v: DVec3) -> Self {
        Self { n: 3, v: [v.x, v.y, v.z, 0.0, 0.0] }
    }

    /// Applies `f` component by component after promotion: a float stands for all components, a shorter vector is
    /// filled with zeros (language rule, measured).
    pub fn zip(self, other: Num, f: impl Fn(f64, f64) -> f64) -> Num {
        if self.n == 1 && other.n == 1 {
            return Num::float(f(self.v[0], other.v[0]));
        }
        if (self.n, other.n) == (3, 3) {
            let (a, b) = (self.v, other.v);
            return Num { n: 3, v: [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), 0.0, 0.0] };
        }
        let n = self.n.max(other.n);
        let (a, b) = (self.promoted(n), other.promoted(n));
        let mut v = [0.0; 5];
        for i in 0..n as usize {
            v[i] = f(a[i], b[i]);
        }
        Num { n, v }
    }

    pub fn map(self, f: impl Fn(f64) -> f64) -> Num {
        let mut v = self.v;
        v[..self.n as usize].iter_mut().for_each(|component| *component = f(*component));
        Num { n: self.n, v }
    }

    /// As `n` components.
    pub fn promoted(self, n: u8) -> [f64; 5] {
        let mut v = self.v;
        if self.n == 1 {
            v[..n as usize].fill(self.v[0]);
        }
        v
    }

    /// As a 3-vector; a float stands for all three.
    pub fn xyz(self) -> DVec3 {
        let v = self.promoted(3);
        DVec3::new(v[0], v[1], v[2])
    }

    /// Floats nearer to 0 than POV-Ray's epsilon are false (measured).
    pub fn is_true(self) -> bool {
        self.v[0].abs() >= super::directive::EQUAL_WITHIN
    }
}

impl Value {
    /// How many arrays are within each other in it.
    pub fn array_depth(&self) -> usize {
        if let Value::Array(array) = self { array.depth } else { 0 }
    }

    /// What kind of thing it is, for messages.
    pub fn kind(&self) -> &'static str {
        match self {
            Value::Number(num) => match num.n {
                1 => "float",
                5 => "colour",
                _ => "vector",
            },
            Value::String(_) => "string",
            Value::Array(_) => "array",
            Value::Macro(_) => "macro",
            Value::Function(_) => "function",
            Value::Spline(_) => "spline",
            Value::Random(_) => "random number stream",
            Value::Transform(_) => "transform",
            Value::Pigment(_) => "pigment",
            Value::Texture(_) => "texture",
            Value::Finish(_) => "finish",
            Value::Normal(_) => "normal",
            Value::Density(_) => "density",
            Value::Map(map) => map.value.kind(),
            Value::Interior(_) => "interior",
            Value::Material(_) => "material",
            Value::ColorMap(_) => "color_map",
            Value::Object(_) => "object",
            Value::Camera(_) => "camera",
            Value::File(_) => "file",
            Value::Fog(_) => "fog",
            Value::Rainbow(_) => "rainbow",
            Value::SkySphere(_) => "sky_sphere",
            Value::Media(_) => "media",
            Value::Later(later) => later.kind(),
            Value::Poison => "value that could not be read",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Lacks;

    #[test]
    fn lacks_stay_sorted_and_each_once() {
        for (a, b, both) in [
            (&[][..], &[][..], &[][..]),
            (&[], &[3, 5], &[3, 5]),
            (&[3, 5], &[], &[3, 5]),
            (&[3, 5], &[6, 7], &[3, 5, 6, 7]),
            (&[3, 5], &[5, 7], &[3, 5, 7]),
            (&[3, 5], &[3, 5], &[3, 5]),
            (&[3, 5, 9], &[1, 5, 6, 12], &[1, 3, 5, 6, 9, 12]),
        ] {
            let of = |met: &[u32]| Lacks { met: met.into(), depth: 0 };
            let mut sum = of(a);
            sum.add(&of(b));
            assert_eq!(sum, of(both), "{a:?} and {b:?}");
        }
    }
}
