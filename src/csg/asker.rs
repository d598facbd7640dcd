//! Packets of rays that ask for surfaces of a composite, always two at once: most of it takes as long for two as for one.
//!
//! (Where there is no other, the second is idle. Code for one packet beside that for two was no faster, with vectors of sixteen
//! numbers and of eight: what idle lanes take is saved where code is fetched.)

use crate::kernel::Rays;
use crate::lane::{LANES, f64x8};

/// Eight rays that ask for surfaces of a composite.
#[derive(Debug, Clone, Copy)]
pub struct Asker<'a, Q> {
    /// The rays.
    pub rays: &'a Rays<f64x8>,
    /// What its parts do along them.
    pub source: Q,
    /// They look beyond this.
    pub t_min: f64x8,
    /// Lanes that hold a ray, whether it asks or not.
    pub all: u8,
}

/// Bits of lanes, packet by packet.
#[inline(always)]
pub(super) fn by_packets(bits: impl Fn(usize) -> u8) -> u16 {
    u16::from_le_bytes([bits(0), bits(1)])
}

/// The bits of packet `k`.
#[inline(always)]
pub(super) fn of_packet(bits: u16, k: usize) -> u8 {
    bits.to_le_bytes()[k & 1]
}

/// Bits of packet `k`, and none of the other.
#[inline(always)]
pub(super) fn in_packet(bits: u8, k: usize) -> u16 {
    u16::from(bits) << (k * LANES)
}
