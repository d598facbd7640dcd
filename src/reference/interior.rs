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

    /// Adds it, be it there or not.
    pub fn enter(&mut self, id: InteriorId) {
        self.0.push(id);
    }

    /// Behind a surface of `id`. Whether it is entered or left is told by the list alone.
    pub fn pass(&self, id: InteriorId, interiors: &[impl AsRef<Interior>]) -> Passage {
        let ior = |id: Option<InteriorId>| id.map_or(1.0, |id| interiors[id.0].as_ref().ior);
        let mut media = self.clone();
        let eta = if self.last() == Some(id) {
            media.0.pop();
            ior(Some(id)) / ior(media.last())
        } else if let Some(place) = self.0.iter().position(|&known| known == id) {
            // Leaving one of two that overlap: the other, entered later, goes on bending.
            media.0.remove(place);
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    const WATER: InteriorId = InteriorId(0);
    const GLASS: InteriorId = InteriorId(1);

    fn interiors() -> [Arc<Interior>; 2] {
        [1.33, 1.5].map(|ior| Arc::new(Interior { ior, ..Interior::default() }))
    }

    /// The ratios met on the way through surfaces in this order, and whether it ends in air.
    fn through(surfaces: &[InteriorId]) -> (Vec<f64>, bool) {
        let mut media = Media::default();
        let mut ratios = Vec::new();
        for &id in surfaces {
            let passage = media.pass(id, &interiors());
            ratios.push(passage.eta);
            media = passage.media;
        }
        (ratios, media.last().is_none())
    }

    #[test]
    fn nested_and_overlapping_interiors() {
        assert_eq!(through(&[WATER, WATER]), (vec![1.0 / 1.33, 1.33], true));
        assert_eq!(
            through(&[WATER, GLASS, GLASS, WATER]),
            (vec![1.0 / 1.33, 1.33 / 1.5, 1.5 / 1.33, 1.33], true)
        );
        // Leaving the water while still in the glass bends nothing; the glass ends in air.
        assert_eq!(through(&[WATER, GLASS, WATER, GLASS]), (vec![1.0 / 1.33, 1.33 / 1.5, 1.0, 1.5], true));
    }

    #[test]
    fn fresnel_asks_for_the_far_side_over_the_near_side() {
        let mut media = Media::default();
        assert_eq!(media.relative_ior(GLASS, &interiors()), 1.5);
        media.enter(GLASS);
        assert_eq!(media.relative_ior(GLASS, &interiors()), 1.0 / 1.5);
        media.enter(WATER);
        assert_eq!(media.relative_ior(GLASS, &interiors()), 1.33 / 1.5);
    }

    #[test]
    fn two_parts_of_one_interior_are_left_one_by_one() {
        let mut media = Media::default();
        media.enter(GLASS);
        media.enter(GLASS);
        let first = media.pass(GLASS, &interiors());
        assert_eq!((first.eta, first.media.last()), (1.0, Some(GLASS)));
        let second = first.media.pass(GLASS, &interiors());
        assert_eq!((second.eta, second.media.last()), (1.5, None));
    }

    #[test]
    fn bends_by_snell_up_to_the_critical_angle() {
        let passage = |eta| Passage { media: Media::default(), eta };
        let incoming = |sine: f64| DVec3::new(sine, 0.0, (1.0 - sine * sine).sqrt());
        let bent = passage(1.0 / 1.5).bend(incoming(0.6), DVec3::NEG_Z).unwrap();
        assert!((bent.x - 0.4).abs() < 1e-15, "{bent}");
        assert!(passage(1.5).bend(incoming(2.0 / 3.0 - 1e-15), DVec3::NEG_Z).is_some());
        assert!(passage(1.5).bend(incoming(2.0 / 3.0 + 1e-15), DVec3::NEG_Z).is_none());
    }

    #[test]
    fn one_is_straight_to_ten_digits() {
        for (eta, straight) in [(1.0, true), (1.0 + 1e-11, true), (1.0 - 1e-9, false)] {
            assert_eq!(Passage { media: Media::default(), eta }.is_straight(), straight);
        }
    }
}
