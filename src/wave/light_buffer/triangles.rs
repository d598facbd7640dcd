//! Triangles as the light sees them, four at a time.

use super::FACES;
use super::drawn::Drawn;
use super::raster::Light;
use super::seen::{Four, Seen};
use super::sheet::{Figures, face_of};
use crate::compile::{SurfaceId, WithBlock};
use crate::kernel::Block;
use crate::lane::{QUAD, Scalar, bits};
use glam::DVec3;

/// Shows the light at `location` the opaque rows of one kind of triangles; returns the rows of those that are not seen well within a
/// face.
pub(super) struct ShowTriangles<'a> {
    /// See [`Four::kind`].
    pub kind: usize,
    pub opaque: &'a [bool],
    pub location: DVec3,
    pub seen: &'a mut [Seen; FACES],
}

impl<S: Scalar> WithBlock<S> for ShowTriangles<'_> {
    type Output = Vec<u32>;

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) -> Vec<u32> {
        let Self { kind, opaque, location, seen } = self;
        let mut rest = Vec::new();
        for (four, opaque) in opaque.chunks(QUAD).enumerate() {
            let Some(corners) = block.corners_in_four(four) else { return rest };
            let wanted =
                opaque.iter().enumerate().fold(0, |lanes, (k, &opaque)| lanes | u8::from(opaque) << k);
            let mut show = |face: usize, lanes: u8| {
                let figures = Figures::through(face, &corners, location);
                let lanes = lanes & figures.within;
                if lanes != 0 {
                    seen[face].add_four(Four { kind, lanes, four: four as u32 }, &figures);
                }
                lanes
            };
            // Mostly one face sees them all.
            let shown = show(face_of(&corners, 0, location), wanted);
            for k in bits(wanted & !shown) {
                if show(face_of(&corners, k, location), 1 << k) == 0 {
                    rest.push((four * QUAD + k) as u32);
                }
            }
        }
        rest
    }
}

/// Draws what a tile sees of one kind of triangles.
pub(super) struct DrawTriangles<'a> {
    /// See [`Four::packed`].
    pub fours: &'a [u64],
    /// Surface number of the kind's first row.
    pub base: SurfaceId,
    pub light: &'a Light,
    pub drawn: &'a mut Drawn,
}

impl<S: Scalar> WithBlock<S> for DrawTriangles<'_> {
    type Output = ();

    #[inline(always)]
    fn block<K: Block<S>>(self, block: &K) {
        let Self { fours, base, light, drawn } = self;
        for &packed in fours {
            let Four { lanes, four, .. } = Four::of(packed);
            let Some(corners) = block.corners_in_four(four as usize) else { return };
            let figures = Figures::through(light.number, &corners, light.location);
            let first = base + QUAD as u32 * four;
            figures.each_facet(lanes, &light.face, (first, light.slack), |facet, cells| {
                drawn.add_facet(facet, cells);
            });
        }
    }
}
