//! What all tiles share.

use super::enclosing::Enclosing;
use super::item_buffer::ItemBuffer;
use super::light::LightProgram;
use crate::compile::Compiled;
use crate::lane::Scalar;

/// What all tiles share.
pub struct Shared<'a, S: Scalar, B: Scalar> {
    /// The scene.
    pub scene: &'a Compiled<S, B>,
    /// Its lights.
    pub lights: Vec<LightProgram>,
    /// What the camera may stand in.
    pub enclosing: Enclosing,
    /// What of it is seen in which pixels, where it is worth to know.
    pub items: Option<ItemBuffer>,
    /// Picture size.
    pub size: (usize, usize),
}
