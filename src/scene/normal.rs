//! `normal { ... }`: how far a surface's normals lean (manual section 3.4.6.2). Read, not rendered.

use super::{Patterned, Placement};
use std::sync::Arc;

/// A perturbation of normals.
#[derive(Debug, Clone, PartialEq)]
pub struct Normal {
    /// By what; nothing leans without. An image is a `bump_map`.
    pub patterned: Option<Arc<Patterned<Normal>>>,
    /// How far; `bump_size` for images.
    pub amount: f64,
    /// How far apart a pattern is asked to find its slope.
    pub accuracy: f64,
    /// Grows with the pattern's scale.
    pub bump_scale: bool,
    /// From the pattern's space to the space of the texture it stands in.
    pub transform: Placement,
}

impl Default for Normal {
    fn default() -> Self {
        Self {
            patterned: None,
            amount: 0.5,
            accuracy: 0.02,
            bump_scale: true,
            transform: Placement::IDENTITY,
        }
    }
}
