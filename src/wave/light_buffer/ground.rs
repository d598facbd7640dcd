//! What the points that lights shine on lie on.

use super::casters::{Caster, is_convex};
use crate::compile::{COMPOSITE, Geometry, INSTANCE, Kind, NO_SURFACE, SurfaceId};
use crate::csg::{Composite, Part};
use crate::lane::Scalar;

/// What a surface belongs to: a caster's number above, and flags below.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Ground(pub u32);

impl Ground {
    /// Where the caster's number begins.
    pub const CASTER: u32 = 16;
    /// In place of a caster's number: it casts no shadow, or has no bounds.
    pub const CASTS_NONE: u32 = (1 << 16) - 1;
    /// What leaves it there outward meets it nowhere else.
    pub const CONVEX: u32 = 1;
    /// Of what stands in instances.
    const NOT_KNOWN: Self = Self((Self::MOST as u32) << Self::CASTER);
    /// Casters that can be told apart.
    const MOST: usize = Self::CASTS_NONE as usize - 1;

    fn new(caster: u32, convex: bool) -> Self {
        Self(caster << Self::CASTER | if convex { Self::CONVEX } else { 0 })
    }
}

/// By surface number, but for surfaces of instances: what it belongs to.
#[derive(Debug)]
pub struct Grounds(Vec<Ground>);

impl Grounds {
    /// Of a scene in which these casters have bounds; `None` if they are too many.
    pub fn of<S: Scalar, B: Scalar>(scene: &Geometry<S, B>, bounded: &[Caster]) -> Option<Self> {
        if bounded.len() > Ground::MOST {
            return None;
        }
        let mut grounds = vec![Ground::new(Ground::CASTS_NONE, false); scene.kinds.len()];
        for (number, caster) in (0..).zip(bounded) {
            match caster.kind {
                INSTANCE => {}
                COMPOSITE => {
                    let Composite { parts, required, .. } = &scene.csg.composites[caster.row as usize];
                    let first = scene.first_part as usize;
                    for part in parts.clone() {
                        grounds[first + part as usize] = Ground::new(number, false);
                    }
                    // All of the composite is within these.
                    for &part in &scene.csg.required[required.start as usize..required.end as usize] {
                        let Part { kind, whole_skin, .. } = scene.csg.parts[part as usize];
                        let convex = whole_skin && is_convex(Kind::ALL[usize::from(kind)]);
                        grounds[first + part as usize] = Ground::new(number, convex);
                    }
                }
                kind => {
                    let surface = scene.base[usize::from(kind)] + caster.row;
                    grounds[surface as usize] = Ground::new(number, caster.surface != NO_SURFACE);
                }
            }
        }
        Some(Self(grounds))
    }

    /// What a surface belongs to.
    #[inline(always)]
    pub(super) fn under(&self, surface: SurfaceId) -> Ground {
        self.0.get(surface as usize).copied().unwrap_or(Ground::NOT_KNOWN)
    }
}
