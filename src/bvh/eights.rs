//! A group's packets, by eights: a bit for each, and a lane for each.

use crate::lane::{LANES, bits_of_many};

/// Packets that walk together, at most.
pub const GROUP: usize = HALVES * LANES;
/// A number of each of them takes so many times eight lanes.
pub(super) const HALVES: usize = 2;
/// A bit for each packet of a group.
pub type Packets = u16;
/// A bit for each ray of a group, by eights of its packets.
pub(super) type GroupRays = [u64; HALVES];
/// A number for each packet of a group of `N` times eight, a packet a lane.
pub(super) type ByPacket<L, const N: usize> = [L; N];

/// The numbers of the packets whose bit is set, lowest first.
#[inline(always)]
pub fn each_packet(which: Packets) -> impl Iterator<Item = usize> {
    bits_of_many::<GROUP>(which.into())
}

/// A bit for each packet, by eight of them.
#[inline(always)]
pub(super) fn by_eights<const N: usize>(bits: impl Fn(usize) -> u8) -> Packets {
    (0..N).fold(0, |all, half| all | Packets::from(bits(half)) << (LANES * half))
}

/// The bits of eight packets.
#[inline(always)]
pub(super) fn eight_of(which: Packets, half: usize) -> u8 {
    (which >> (LANES * half)) as u8
}
