//! Light summed up for the pixels of a tile, in double precision and in one fixed order.

use crate::film::Pixel;
use crate::lane::{LANES, Lane, Mask, Vec3, each_lane, f32x8, f64x8};
use crate::scene::Rgb;

/// A sum for each pixel of the tile, and after them sums that are bent by a power before they count.
#[derive(Debug, Default)]
pub struct Sums {
    /// By channel.
    rgb: [Vec<f64>; 3],
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
        for column in self.rgb.iter_mut().chain([&mut self.transmit]) {
            column.clear();
            column.resize(pixels, 0.0);
        }
        self.deferred.clear();
    }

    /// Adds light in the lanes whose bit is set.
    #[inline]
    pub fn add<L: Lane>(&mut self, sink: &[u32; LANES], light: Vec3<L>, lanes: u8) {
        if lanes == 0 {
            return;
        }
        let first = sink[0];
        let in_order = each_lane(|k| first.wrapping_add(k as u32)) == *sink;
        let mask = Mask::<f64x8>::from_bits(lanes);
        for (column, light) in self.rgb.iter_mut().zip([light.x, light.y, light.z]) {
            let light = mask.keep(light.to_f64s());
            // Rays that are still in the order of their pixels add as a packet.
            if in_order && let Some(sums) = column[first as usize..].first_chunk_mut::<LANES>() {
                *sums = (f64x8::from_array(*sums) + light).to_array();
                continue;
            }
            // Idle lanes add nothing: which they are changes from packet to packet, and to guess it wrongly takes longer than to add.
            for (&sink, light) in sink.iter().zip(light.to_array()) {
                if let Some(sum) = column.get_mut(sink as usize) {
                    *sum += light;
                }
            }
        }
    }

    /// Rays missed everything: `share` of each pixel shows through. (Sums that are not pixels have no such share.)
    pub fn add_transmit(&mut self, sink: &[u32; LANES], share: f32x8, lanes: u8) {
        let share = share.to_f64s().to_array();
        for k in (0..LANES).filter(|k| lanes >> k & 1 == 1) {
            if let Some(transmit) = self.transmit.get_mut(sink[k] as usize) {
                *transmit += share[k];
            }
        }
    }

    /// New sums whose `exponent`th power, times `factor`, will go to `sink`.
    pub fn defer(
        &mut self,
        sink: &[u32; LANES],
        factor: Vec3<f32x8>,
        exponent: f64,
        lanes: u8,
    ) -> [u32; LANES] {
        let mut new = *sink;
        for (k, new) in new.iter_mut().enumerate() {
            if lanes >> k & 1 == 1 {
                self.deferred.push(Deferred { to: *new, factor: factor.lane(k), exponent });
                *new = self.rgb[0].len() as u32;
                for column in &mut self.rgb {
                    column.push(0.0);
                }
            }
        }
        new
    }

    /// The finished pixels.
    pub fn pixels(&mut self) -> impl Iterator<Item = Pixel> {
        let pixels = self.transmit.len();
        // Later sums may go to earlier deferred ones, never the other way.
        for (k, deferred) in self.deferred.iter().enumerate().rev() {
            for (channel, column) in self.rgb.iter_mut().enumerate() {
                let seen = column[pixels + k].max(0.0).powf(deferred.exponent);
                column[deferred.to as usize] += deferred.factor[channel] * seen;
            }
        }
        let [r, g, b] = &self.rgb;
        let sums = r.iter().zip(g).zip(b).zip(&self.transmit);
        sums.map(|(((&r, &g), &b), &transmit)| Pixel {
            rgb: [r as f32, g as f32, b as f32],
            transmit: transmit as f32,
        })
    }
}
