//! Colour over space: solid, in blocks, or along a map.

use super::noise::Generator;
use super::{Color, Pattern, Patterned, Placement};
use glam::DVec3;
use std::sync::Arc;

/// A `pigment` (manual section 3.4.6.1).
#[derive(Debug, Clone, PartialEq)]
pub struct Pigment {
    /// Which colour where.
    pub kind: PigmentKind,
    /// From the pattern's space to the space of the texture it stands in.
    pub transform: Placement,
}

/// Which colour where.
#[derive(Debug, Clone, PartialEq)]
pub enum PigmentKind {
    /// One colour everywhere.
    Solid(Color),
    /// A choice of whole colours by block. (Behind a pointer, as the next: scenes have a colour for each of a million objects.)
    Blocks(Box<Blocks>),
    /// A number per point, looked up in a map.
    Mapped(Box<Mapped>),
    /// What is read but not rendered.
    Other {
        /// As it was said.
        said: Arc<Patterned<Pigment>>,
        /// Stands in for it if the user has allowed that.
        stand_in: Box<Color>,
    },
}

/// A choice of whole colours by block.
#[derive(Debug, Clone, PartialEq)]
pub struct Blocks {
    /// Which block a point lies in.
    pub pattern: BlockPattern,
    /// One colour for each of [`BlockPattern::color_count`].
    pub colors: Vec<Color>,
    /// How the number of a block is shaped, as any pattern's is, before its colour is looked up; between two numbers lie mixed
    /// colours.
    pub wave: Wave,
    /// 0 unless it is said (measured in POV-Ray 3.7): then the number is only laid on the wave.
    pub frequency: f64,
    /// Counts where the frequency is not 0.
    pub phase: f64,
}

impl Blocks {
    /// Blocks that show their colours as they are.
    pub fn new(pattern: BlockPattern, colors: Vec<Color>) -> Self {
        Self { pattern, colors, wave: Wave::Ramp, frequency: 0.0, phase: 0.0 }
    }

    /// From the number of a block to its colour.
    pub fn map(&self) -> ColorMap {
        ColorMap { entries: (0u32..).map(f64::from).zip(self.colors.iter().copied()).collect() }
    }
}

/// A number per point, looked up in a map.
#[derive(Debug, Clone, PartialEq)]
pub struct Mapped {
    /// Point to number.
    pub pattern: Pattern,
    /// How the number is shaped before look-up.
    pub wave: Wave,
    /// The number is multiplied by this (default 1),
    pub frequency: f64,
    /// and this is added (default 0).
    pub phase: f64,
    /// Of what noise; the scene's if it says none.
    pub generator: Option<Generator>,
    /// Number to colour.
    pub map: ColorMap,
}

/// Patterns that choose among a list of colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BlockPattern {
    /// Unit cubes, two colours.
    Checker,
    /// Mortar (first colour) between bricks (second).
    Brick {
        /// Of a brick with its mortar; default `<8, 3, 4.5>`.
        size: DVec3,
        /// Thickness; default 0.5.
        mortar: f64,
    },
    /// Hexagonal columns along y, three colours.
    Hexagon,
}

impl BlockPattern {
    /// The colours it has if none are given.
    pub fn own_colors(&self) -> &'static [Color] {
        const RED: Color = Color::opaque(1.0, 0.0, 0.0);
        const GREEN: Color = Color::opaque(0.0, 1.0, 0.0);
        const BLUE: Color = Color::opaque(0.0, 0.0, 1.0);
        const MORTAR: Color = Color::opaque(0.5, 0.5, 0.5);
        const BRICK: Color = Color::opaque(0.6, 0.15, 0.15);
        match self {
            Self::Checker => &[BLUE, GREEN],
            Self::Brick { .. } => &[MORTAR, BRICK],
            Self::Hexagon => &[BLUE, GREEN, RED],
        }
    }

    /// How many colours the pattern chooses from.
    pub fn color_count(&self) -> usize {
        match self {
            Self::Checker | Self::Brick { .. } => 2,
            Self::Hexagon => 3,
        }
    }
}

/// The shape of the repeating number (manual section 3.4.7.10).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Wave {
    /// Up, then a jump.
    #[default]
    Ramp,
    /// Up and down in straight lines.
    Triangle,
    /// Up and down in a sine.
    Sine,
    /// Half sines.
    Scallop,
    /// Smooth up, then a jump.
    Cubic,
    /// A power, then a jump.
    Poly(f64),
}

/// Colours at rising places in 0..1; linear between neighbours.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ColorMap {
    /// `(place, colour)`, places never falling. Two entries at one place make a jump.
    pub entries: Vec<(f64, Color)>,
}

impl Pigment {
    /// One colour everywhere.
    pub fn solid(color: Color) -> Self {
        Self { kind: PigmentKind::Solid(color), transform: Placement::IDENTITY }
    }

    /// True if it is one colour everywhere, as far as it is rendered.
    pub fn is_uniform(&self) -> bool {
        matches!(self.kind, PigmentKind::Solid(_) | PigmentKind::Other { .. })
    }

    /// True if no point of it can let light through: POV-Ray's test, on the colours it is made of.
    pub fn is_opaque(&self) -> bool {
        match &self.kind {
            PigmentKind::Solid(color) => color.is_opaque(),
            PigmentKind::Blocks(blocks) => blocks.colors.iter().all(Color::is_opaque),
            PigmentKind::Mapped(mapped) => mapped.map.entries.iter().all(|(_, c)| c.is_opaque()),
            PigmentKind::Other { stand_in, .. } => stand_in.is_opaque(),
        }
    }
}

impl Default for Pigment {
    /// POV-Ray's: black.
    fn default() -> Self {
        Self::solid(Color::default())
    }
}
