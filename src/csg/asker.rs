//! Packets of rays that ask for surfaces of a composite, one or two at once.

use crate::kernel::Rays;
use crate::lane::{Singles, f64x8};

/// Eight rays that ask for surfaces of a composite.
#[derive(Debug)]
pub struct Asker<'a, Q> {
    /// The rays.
    pub rays: &'a Rays<f64x8>,
    /// What its parts do along them.
    pub source: Q,
    /// Those that ask.
    pub lanes: u8,
    /// They look beyond this,
    pub t_min: f64x8,
    /// and up to here.
    pub t_max: f64x8,
    /// Lanes that hold a ray, whether it asks or not.
    pub all: u8,
}

/// Bits of lanes, packet by packet.
#[inline(always)]
pub(super) fn by_packets<W: Singles>(bits: impl Fn(usize) -> u8) -> u16 {
    let high = if W::EIGHTS == 2 { bits(1) } else { 0 };
    u16::from_le_bytes([bits(0), high])
}

/// The bits of packet `k`.
#[inline(always)]
pub(super) fn of_packet(bits: u16, k: usize) -> u8 {
    bits.to_le_bytes()[k & 1]
}
