//! `camera { ... }` (manual section 3.4.2): keywords in any order, worked off in POV-Ray's order at the end.

use super::machine::{Machine, Res};
use super::value::{Lacks, Value, With};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::{Camera, Lens, LensKind, Normal, Pigment, Projection, Transform};
use glam::DVec3;

/// A camera's words before they are worked off.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CameraSpec {
    projection: Projection,
    location: DVec3,
    direction: DVec3,
    right: DVec3,
    up: DVec3,
    sky: DVec3,
    look_at: Option<DVec3>,
    angle_deg: Option<f64>,
    /// `right` or `up` was given.
    axes_given: bool,
    transform: Transform,
    /// A kind of camera that is not modelled: its angle may be a full turn.
    foreign: bool,
    lens: Lens,
    pub lacks: Lacks,
}

impl Default for CameraSpec {
    fn default() -> Self {
        let Camera { projection, location, direction, right, up, .. } = Camera::default();
        Self {
            projection,
            location,
            direction,
            right,
            up,
            sky: DVec3::Y,
            look_at: None,
            angle_deg: None,
            axes_given: false,
            transform: Transform::IDENTITY,
            foreign: false,
            lens: Lens::default(),
            lacks: Lacks::default(),
        }
    }
}

impl Machine<'_> {
    /// The block behind `camera`.
    pub fn camera(&mut self) -> Res<CameraSpec> {
        let open = self.open("camera")?;
        let named = self.take_named(|value| match value {
            Value::Camera(camera) => Some(CameraSpec::clone(camera)),
            _ => None,
        })?;
        let mut spec = named.unwrap_or_default();
        while self.camera_item(&mut spec)? {}
        self.close("camera", open)?;
        Ok(spec)
    }

    fn camera_item(&mut self, spec: &mut CameraSpec) -> Res<bool> {
        use Keyword as K;
        let Token::Word(word) = self.peek()? else { return Ok(false) };
        if let Some(transform) = self.transform_item(word)? {
            spec.transform = spec.transform.then(&transform);
            return Ok(true);
        }
        let at = self.peek_lexeme()?;
        match word {
            K::Perspective => {
                self.next()?;
                spec.projection = Projection::Perspective;
            }
            K::Orthographic => {
                self.next()?;
                spec.projection = Projection::Orthographic;
            }
            K::Location => {
                self.next()?;
                spec.location = self.vector()?;
            }
            K::Direction => {
                self.next()?;
                spec.direction = self.vector()?;
            }
            K::Right => {
                self.next()?;
                spec.right = self.vector()?;
                spec.axes_given = true;
            }
            K::Up => {
                self.next()?;
                spec.up = self.vector()?;
                spec.axes_given = true;
            }
            K::Sky => {
                self.next()?;
                spec.sky = self.vector()?;
            }
            K::LookAt => {
                self.next()?;
                spec.look_at = Some(self.vector()?);
            }
            K::Angle => {
                self.next()?;
                let angle = self.finite()?;
                self.comma()?;
                spec.lens.angles_deg = vec![angle];
                spec.lens.angles_deg.extend(self.optional_float()?);
                if !(angle > 0.0) {
                    return Err(
                        self.error_here(format!("the camera's `angle` must be positive, found {angle}"))
                    );
                }
                spec.angle_deg = Some(angle);
            }
            K::Fisheye
            | K::UltraWideAngle
            | K::Omnimax
            | K::Panoramic
            | K::Spherical
            | K::MeshCamera
            | K::Cylinder => {
                self.next()?;
                spec.foreign = true;
                let lacks = self.lack(format!("camera {{ {} }}", word.text()), at);
                spec.lacks.add(&lacks);
                spec.lens.kind = Some(match word {
                    K::Fisheye => LensKind::Fisheye,
                    K::UltraWideAngle => LensKind::UltraWideAngle,
                    K::Omnimax => LensKind::Omnimax,
                    K::Panoramic => LensKind::Panoramic,
                    K::Spherical => LensKind::Spherical,
                    K::Cylinder => {
                        LensKind::Cylinder(self.integer("the kind of a cylinder camera", 1, 4)? as u8)
                    }
                    _ => self.mesh_camera()?,
                });
            }
            // The rest is only of use with an aperture.
            K::Aperture => {
                self.next()?;
                spec.lens.blur.aperture = self.finite()?;
                if spec.lens.blur.aperture != 0.0 {
                    spec.lacks.add(&self.lack("aperture", at));
                }
            }
            K::BlurSamples => {
                self.next()?;
                let first = self.finite()?;
                let second = if self.accept(Mark::Comma)? { self.finite()? } else { first };
                spec.lens.blur.samples = [first.min(second), first.max(second)];
            }
            K::Variance | K::Confidence | K::FocalPoint => {
                let blur = &mut spec.lens.blur;
                let _ = self.float_item(&mut [
                    (K::Variance, &mut blur.variance),
                    (K::Confidence, &mut blur.confidence),
                ])? || self.vector_item(&mut [(K::FocalPoint, &mut blur.focal_point)])?;
            }
            K::Bokeh => {
                self.next()?;
                let open = self.open("bokeh")?;
                if self.accept_word(K::Pigment)? {
                    let mut pigment = With::new(Pigment::default());
                    self.pigment(&mut pigment)?;
                    spec.lens.blur.bokeh = Some(Box::new(pigment.value));
                }
                self.close("bokeh", open)?;
            }
            K::Normal => {
                self.next()?;
                let mut normal = With::new(Normal::default());
                self.normal(&mut normal)?;
                spec.lacks.add(&normal.lacks);
                spec.lens.normal = Some(Box::new(normal.value));
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// `{ rays, distribution, [max distance,] mesh ... [smooth] }` behind `mesh_camera`.
    fn mesh_camera(&mut self) -> Res<LensKind> {
        let open = self.open("mesh_camera")?;
        let rays = self.integer("the rays of a pixel", 1, u32::MAX)?;
        self.comma()?;
        let distribution = self.integer("the distribution of a mesh camera", 0, 3)? as u8;
        self.comma()?;
        let max_distance = self.optional_float()?.unwrap_or(0.0);
        self.comma()?;
        let mut meshes = Vec::new();
        let mut smooth = false;
        loop {
            let named = self.named_object()?;
            if let Some(value) = if named.is_some() { named } else { self.object()? } {
                meshes.extend(value.object);
                self.comma()?;
            } else if !self.switch_item(&mut [(Keyword::Smooth, &mut smooth)])? {
                break;
            }
        }
        self.close("mesh_camera", open)?;
        Ok(LensKind::Mesh { rays, distribution, max_distance, meshes, smooth })
    }

    /// The camera that a spec comes to.
    pub fn finish_camera(&mut self, spec: &CameraSpec, at: super::machine::Lexeme) -> Res<Camera> {
        let CameraSpec { projection, location, mut direction, mut right, mut up, .. } = *spec;
        if let Some(angle) = spec.angle_deg {
            if angle >= 180.0 && projection == Projection::Perspective && !spec.foreign {
                let message = format!("the `angle` of a perspective camera must be below 180, found {angle}");
                return Err(self.error(message, self.span(at)));
            }
            if angle < 180.0 {
                let unit = direction.try_normalize().unwrap_or(DVec3::Z);
                direction = unit * (right.length() / (2.0 * (angle.to_radians() / 2.0).tan()));
            }
        }
        if let Some(look_at) = spec.look_at {
            let (length, up_length, right_length) = (direction.length(), up.length(), right.length());
            let hand = up.cross(direction).dot(right);
            let Some(unit) = (look_at - location).try_normalize() else {
                return Err(self.error("the camera's `look_at` is its `location`", self.span(at)));
            };
            let side = spec.sky.cross(unit);
            // Looking along the sky vector: the given right vector decides (POV-Ray's bound).
            let side = if side.abs().max_element() < 1e-10 { right } else { side };
            let side = side.try_normalize().unwrap_or(DVec3::X);
            up = unit.cross(side) * up_length;
            right = side * if hand > 0.0 { right_length } else { -right_length };
            direction = unit * length;
        }
        if projection == Projection::Orthographic && (!spec.axes_given || spec.angle_deg.is_some()) {
            let length = direction.length();
            let reach = (spec.look_at.unwrap_or(DVec3::Z) - location).length();
            if length > 0.0 {
                right *= reach / length;
                up *= reach / length;
            }
        }
        let t = &spec.transform;
        let camera = Camera {
            projection,
            location: t.point(location),
            direction: t.vector(direction),
            right: t.vector(right),
            up: t.vector(up),
            lens: None,
        };
        let lens = Lens { angles_deg: spec.lens.angles_deg.clone(), ..Lens::default() };
        let camera = match lens == spec.lens {
            true => camera,
            false => Camera { lens: Some(Box::new(spec.lens.clone())), ..camera },
        };
        let flat = camera.direction.cross(camera.right).dot(camera.up);
        if !(flat.abs() > 0.0) {
            let span = self.span(at);
            self.warn("flat camera", "the camera's direction, right and up are in one plane", span);
        } else if !camera.is_square() {
            let message = "the camera's direction, right and up are not at right angles";
            self.warn("skewed camera", message, self.span(at));
        }
        Ok(camera)
    }
}
