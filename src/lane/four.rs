//! Eight numbers out of four: what rays that are known to meet one of four rows take of their rows.
//!
//! For machines that have an instruction for it, of those that `safe_arch` knows.

use super::{LANES, QUAD, f32x8, f64x8};

#[inline(always)]
pub(super) fn singles(four: &[f32; QUAD], which: &[u32; LANES]) -> f32x8 {
    let both: [[f32; QUAD]; 2] = [*four; 2];
    bytemuck::cast(safe_arch::shuffle_av_f32_half_m256(bytemuck::cast(both), bytemuck::cast(*which)))
}

#[inline(always)]
pub(super) fn doubles(four: &[f64; QUAD], which: &[u32; LANES]) -> f64x8 {
    // A double is two neighbours of eight.
    let words = which.map(|k| u64::from(k) << 1 | u64::from(k) << 33 | 1 << 32);
    let [lower, upper]: [[u64; QUAD]; 2] = bytemuck::cast(words);
    let taken = [lower, upper]
        .map(|words| safe_arch::shuffle_av_i32_all_m256i(bytemuck::cast(*four), bytemuck::cast(words)));
    bytemuck::cast(taken)
}
