//! How exactly a scene is computed: what is asked for, and what is taken where that is too coarse for the scene.

use crate::bvh::Preset;
use crate::compile::{Compiled, Instancing, Primitives};
use crate::scene::Scene;
use serde::Serialize;

/// How exactly the packet engine computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Single precision where it can be bounded: previews.
    Fast,
    /// Boxes in single, surfaces in double precision.
    #[default]
    Exact,
    /// Boxes in double precision, too: the kernels of `exact` under boxes without any rounding to f32. (Light is in single in
    /// every mode, and summed in plain f64, not compensated: in no hard case would more digits decide otherwise, see `docs/hard-cases.md`.)
    Strict,
}

/// A scene compiled in one of the precisions.
pub(crate) enum Prepared {
    Fast(Compiled<f32, f32>),
    Exact(Compiled<f64, f32>),
    Strict(Compiled<f64, f64>),
}

impl Prepared {
    /// In the precision that is asked for, or in the next one where that is too coarse for the sizes in the scene: a ground of a
    /// planet's size for surfaces in single precision, a thousand far stars for boxes.
    pub fn new(scene: &Scene, asked: Precision, preset: Preset, instancing: Instancing) -> Self {
        if asked == Precision::Fast {
            let primitives = Primitives::<f32>::with(scene, instancing);
            let is_too_coarse = primitives.have_giants()
                || primitives.have_extreme_places()
                || primitives.are_too_fine_for::<f32>();
            if !is_too_coarse {
                return Self::Fast(primitives.compile(scene, preset));
            }
        }
        let primitives = Primitives::<f64>::with(scene, instancing);
        if asked == Precision::Strict || primitives.are_too_fine_for::<f32>() {
            Self::Strict(primitives.compile(scene, preset))
        } else {
            Self::Exact(primitives.compile(scene, preset))
        }
    }

    /// Which it is.
    pub fn precision(&self) -> Precision {
        match self {
            Self::Fast(_) => Precision::Fast,
            Self::Exact(_) => Precision::Exact,
            Self::Strict(_) => Precision::Strict,
        }
    }
}

/// What `$of` is of a prepared scene, by whatever precision it is compiled in.
macro_rules! in_its_precision {
    ($prepared:expr, $scene:ident => $of:expr) => {
        match $prepared {
            $crate::precision::Prepared::Fast($scene) => $of,
            $crate::precision::Prepared::Exact($scene) => $of,
            $crate::precision::Prepared::Strict($scene) => $of,
        }
    };
}
pub(crate) use in_its_precision;
