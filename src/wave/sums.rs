//! Light summed up for the pixels of a tile, in double precision and in one fixed order.

use crate::film::Pixel;
use crate::lane::{LANES, Lane, Vec3};
use crate::scene::Rgb;

/// A sum for each pixel of the tile, and after them sums that are bent by a power before they count.
#[derive(Debug, Default)]
pub struct Sums {
    rgb: Vec<Rgb>,
    transmit: Vec<f64>,
    deferred: Vec<Deferred>,
}

/// `factor * sum^exponent` goes to the sum `to`, when everything has been traced.
#[derive(Debug, Clone, Copy)]
struct Deferred {
    to: u32,
    factor: Rgb,
    exponent: f64,
}

impl Sums {
    /// Empty sums for `pixels` pixels.
    pub fn reset(&mut self, pixels: usize) {
        self.rgb.clear();
        self.rgb.resize(pixels, Rgb::ZERO);
        self.transmit.clear();
        self.transmit.resize(pixels, 0.0);
        self.deferred.clear();
    }

    /// Adds light in the lanes whose bit is set.
    pub fn add<L: Lane>(&mut self, sink: &[u32; LANES], light: Vec3<L>, lanes: u8) {
        let [x, y, z] = [light.x, light.y, light.z].map(|c| c.to_f64s().to_array());
        for (k, &sink) in sink.iter().enumerate() {
            if lanes >> k & 1 == 1 {
                self.rgb[sink as usize] += Rgb::new(x[k], y[k], z[k]);
            }
        }
    }

    /// A ray missed everything: `light` from the background, and `share` of the pixel shows through.
    pub fn miss(&mut self, sink: u32, light: Rgb, share: f64) {
        self.rgb[sink as usize] += light;
        if let Some(transmit) = self.transmit.get_mut(sink as usize) {
            *transmit += share;
        }
    }

    /// New sums whose `exponent`th power, times `factor`, will go to `sink`.
    pub fn defer<L: Lane>(
        &mut self,
        sink: &[u32; LANES],
        factor: Vec3<L>,
        exponent: f64,
        lanes: u8,
    ) -> [u32; LANES] {
        let mut new = *sink;
        for (k, new) in new.iter_mut().enumerate() {
            if lanes >> k & 1 == 1 {
                self.deferred.push(Deferred { to: *new, factor: factor.lane(k), exponent });
                *new = self.rgb.len() as u32;
                self.rgb.push(Rgb::ZERO);
            }
        }
        new
    }

    /// The finished pixels.
    pub fn pixels(&mut self) -> impl Iterator<Item = Pixel> {
        let first = self.rgb.len() - self.deferred.len();
        // Later sums may go to earlier deferred ones, never the other way.
        for (k, deferred) in self.deferred.iter().enumerate().rev() {
            let seen = self.rgb[first + k].max(Rgb::ZERO).powf(deferred.exponent);
            self.rgb[deferred.to as usize] += deferred.factor * seen;
        }
        self.rgb[..first]
            .iter()
            .zip(&self.transmit)
            .map(|(rgb, transmit)| Pixel { rgb: rgb.as_vec3().to_array(), transmit: *transmit as f32 })
    }
}
