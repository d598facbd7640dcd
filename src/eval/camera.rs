//! `camera { ... }` (manual section 3.4.2): keywords in any order, worked off in POV-Ray's order at the end.

use super::machine::{Machine, Res};
use super::value::{Lacks, Value};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::{Camera, Projection, Transform};
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
    pub lacks: Lacks,
}

impl Default for CameraSpec {
    fn default() -> Self {
        let Camera { projection, location, direction, right, up } = Camera::default();
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
                self.optional_float()?;
                if !(angle > 0.0) {
                    return Err(
                        self.error_here(format!("the camera's `angle` must be positive, found {angle}"))
                    );
                }
                spec.angle_deg = Some(angle);
            }
            K::Fisheye | K::UltraWideAngle | K::Omnimax | K::Panoramic | K::Spherical | K::MeshCamera => {
                self.next()?;
                spec.foreign = true;
                let lacks = self.lack(format!("camera {{ {} }}", word.text()), at);
                if word == K::MeshCamera {
                    self.block_left_out(word.text())?;
                }
                spec.lacks.add(&lacks);
            }
            K::Cylinder => {
                self.next()?;
                self.float()?;
                spec.foreign = true;
                spec.lacks.add(&self.lack("camera { cylinder }", at));
            }
            K::Aperture => {
                self.next()?;
                if self.finite()? != 0.0 {
                    spec.lacks.add(&self.lack("aperture", at));
                }
            }
            // Only of use with an aperture.
            K::BlurSamples | K::Variance | K::Confidence | K::FocalPoint => {
                self.next()?;
                self.expr()?;
                if self.accept(Mark::Comma)? {
                    self.expr()?;
                }
            }
            K::Bokeh => {
                self.next()?;
                self.block_left_out("bokeh")?;
            }
            K::Normal => {
                self.next()?;
                let lacks = self.normal(at)?;
                spec.lacks.add(&lacks);
            }
            _ => return Ok(false),
        }
        Ok(true)
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
        };
        let flat = camera.direction.cross(camera.right).dot(camera.up);
        if !(flat.abs() > 0.0) {
            let span = self.span(at);
            self.warn("flat camera", "the camera's direction, right and up are in one plane", span);
        }
        Ok(camera)
    }
}
