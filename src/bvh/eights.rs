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

/// A bit for each byte that is not 0.
#[inline(always)]
pub(super) fn bytes_in_use(x: u64) -> u8 {
    let x = x | x >> 4;
    let x = x | x >> 2;
    let lowest = (x | x >> 1) & 0x0101_0101_0101_0101;
    // Byte `k` is moved to bit `56 + k`.
    (lowest.wrapping_mul(0x0102_0408_1020_4080) >> 56) as u8
}

/// 1 in the byte of each bit that is set.
#[inline(always)]
pub(super) fn bytes_of(bits: u8) -> u64 {
    // Bit `k` alone in byte `k`, which by the sum comes to bit 7.
    let own = (u64::from(bits) * 0x0101_0101_0101_0101) & 0x8040_2010_0804_0201;
    (own + 0x7f7f_7f7f_7f7f_7f7f) >> 7 & 0x0101_0101_0101_0101
}

/// All bits of each byte that has three or more.
#[inline(always)]
pub(super) fn bytes_of_three(x: u64) -> u64 {
    // Bits counted in each pair, each four and each byte.
    let pairs = x - (x >> 1 & 0x5555_5555_5555_5555);
    let fours = (pairs & 0x3333_3333_3333_3333) + (pairs >> 2 & 0x3333_3333_3333_3333);
    let bytes = (fours + (fours >> 4)) & 0x0f0f_0f0f_0f0f_0f0f;
    // 3 and 125 are 128.
    let three = (bytes + 0x7d7d_7d7d_7d7d_7d7d) >> 7 & 0x0101_0101_0101_0101;
    three * 0xff
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_come_to_their_bytes() {
        for bits in 0..=u8::MAX {
            let bytes = bytes_of(bits).to_le_bytes();
            assert!((0..LANES).all(|k| bytes[k] == bits >> k & 1));
        }
    }

    #[test]
    fn bytes_are_told_by_their_bits() {
        for byte in 0..=255u64 {
            for k in 0..LANES {
                let (alone, beside) = (byte << (8 * k), !(0xff << (8 * k)));
                assert_eq!(bytes_in_use(alone), u8::from(byte != 0) << k);
                assert_eq!(bytes_in_use(alone | beside), !(u8::from(byte == 0) << k));
                let three = if byte.count_ones() >= 3 { 0xff << (8 * k) } else { 0 };
                assert_eq!(bytes_of_three(alone), three);
                assert_eq!(bytes_of_three(alone | beside), three | beside);
            }
        }
    }
}
