//! What a ray travels through: the list of interiors it is in, bending, and fading.

use crate::scene::{Interior, Rgb};
use glam::DVec3;
use smallvec::SmallVec;

/// Which interior, by identity: two objects of equal glass are two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InteriorId(pub usize);

/// The interiors a ray is in, in the order it entered them; the last one bends it.
#[derive(Debug, Clone, Default)]
pub struct Media(SmallVec<[InteriorId; 4]>);

/// What crossing a surface does.
pub struct Passage {
    /// The list behind the surface.
    pub media: Media,
    /// Index of refraction in front over that behind.
    pub eta: f64,
}

/// Ratios nearer to 1 than this bend nothing (POV-Ray's bound).
const STRAIGHT: f64 = 1e-10;

/// Fade distances under this are none (POV-Ray's bound).
const NO_FADING: f64 = 1e-10;

/// Fade powers from here on mean exponential fading.
const EXPONENTIAL_POWER: f64 = 1000.0;

impl Media {
    /// True if the ray is in it.
    pub fn contains(&self, id: InteriorId) -> bool {
        self.0.contains(&id)
    }

    /// The innermost.
    fn last(&self) -> Option<InteriorId> {
        self.0.last().copied()
    }

    /// The index of refraction that Fresnel's law has at a surface of `id`: far side over near side.
    ///
    /// Told by the list: a surface is left from within if its interior is in the list, be it last or not.
    pub fn relative_ior(&self, id: InteriorId, interiors: &[impl AsRef<Interior>]) -> f64 {
        let ior = |id: InteriorId| interiors[id.0].as_ref().ior;
        match self.last() {
            None => ior(id),
            Some(_) if self.contains(id) && self.0.len() == 1 => 1.0 / ior(id),
            Some(last) if self.contains(id) => ior(last) / ior(id),
            Some(last) => ior(id) / ior(last),
        }
    }

    /// Adds it if it is not there.
    pub fn enter_once(&mut self, id: InteriorId) {
        if !self.contains(id) {
            self.0.push(id);
        }
    }

    /// Behind a surface of `id`. Whether it is entered or left is told by the list alone.
    pub fn pass(&self, id: InteriorId, interiors: &[impl AsRef<Interior>]) -> Passage {
        let ior = |id: Option<InteriorId>| id.map_or(1.0, |id| interiors[id.0].as_ref().ior);
        let mut media = self.clone();
        let eta = if self.last() == Some(id) {
            media.0.pop();
            ior(Some(id)) / ior(media.last())
        } else if self.contains(id) {
            // Leaving one of two that overlap: the other, entered later, goes on bending.
            media.0.retain(|known| *known != id);
            1.0
        } else {
            media.0.push(id);
            ior(self.last()) / ior(Some(id))
        };
        Passage { media, eta }
    }
}

impl Passage {
    /// True if a ray goes straight on.
    pub fn is_straight(&self) -> bool {
        (self.eta - 1.0).abs() < STRAIGHT
    }

    /// The direction behind the surface (Snell's law); `None` is total internal reflection.
    ///
    /// `dir` is unit, `normal` unit and towards where the ray comes from.
    pub fn bend(&self, dir: DVec3, normal: DVec3) -> Option<DVec3> {
        let cosine = -dir.dot(normal);
        let k = 1.0 + self.eta * self.eta * (cosine * cosine - 1.0);
        (k >= 0.0).then(|| (self.eta * dir + (self.eta * cosine - k.sqrt()) * normal).normalize())
    }
}

/// What is left of light after `distance` through the interior.
pub fn fade(interior: &Interior, distance: f64) -> Rgb {
    if interior.fade_distance.abs() <= NO_FADING {
        return Rgb::ONE;
    }
    let (to, depth) = (interior.fade_color, distance / interior.fade_distance);
    if interior.fade_power >= EXPONENTIAL_POWER {
        (-(Rgb::ONE - to) * depth).exp()
    } else {
        to + (Rgb::ONE - to) / (1.0 + depth.powf(interior.fade_power))
    }
}

/// [`fade`] on a shadow ray, where without a `fade_power` there is none (POV-Ray's rule).
pub fn shadow_fade(interior: &Interior, distance: f64) -> Rgb {
    if interior.fade_power > 0.0 { fade(interior, distance) } else { Rgb::ONE }
}
