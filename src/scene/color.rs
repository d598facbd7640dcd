//! Colours as POV-Ray has them: three channels of light and two ways of letting light through.

/// Linear red, green, blue.
pub type Rgb = glam::DVec3;

/// A pigment's colour: light, and how much of what lies behind shows through.
///
/// `filter` lets light through tinted by `rgb`, `transmit` untinted; the surface itself is seen by its [`Opacity`]
/// (manual section 3.2.1.5).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Color {
    /// Linear RGB.
    pub rgb: Rgb,
    /// Share of light that passes tinted.
    pub filter: f64,
    /// Share of light that passes untinted.
    pub transmit: f64,
}

/// What the surface's own light is multiplied by: the rules of POV-Ray's versions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Opacity {
    /// `1 - filter - transmit`, since version 3.7.
    #[default]
    Share,
    /// `1 - filter * max(rgb) - transmit`, before: a dark filter keeps most of what it does not let through.
    Filtered,
}

impl Color {
    /// An opaque colour.
    pub const fn opaque(r: f64, g: f64, b: f64) -> Self {
        Self { rgb: Rgb::new(r, g, b), filter: 0.0, transmit: 0.0 }
    }

    /// What the surface's own light is multiplied by.
    pub fn opacity(&self, rule: Opacity) -> f64 {
        match rule {
            Opacity::Share => 1.0 - self.filter - self.transmit,
            Opacity::Filtered => 1.0 - self.filter * self.rgb.max_element() - self.transmit,
        }
    }

    /// What light from behind is multiplied by: `rgb * filter + transmit`.
    pub fn transmittance(&self) -> Rgb {
        self.rgb * self.filter + self.transmit
    }

    /// True if no light passes (POV-Ray's bound, 1e-10 on each share).
    pub fn is_opaque(&self) -> bool {
        self.filter.abs() <= 1e-10 && self.transmit.abs() <= 1e-10
    }

    /// All five components in POV-Ray's order: red, green, blue, filter, transmit.
    pub fn components(&self) -> [f64; 5] {
        [self.rgb.x, self.rgb.y, self.rgb.z, self.filter, self.transmit]
    }

    /// `self` where `t` is 0, `other` where it is 1; all five components linear between.
    pub fn lerp(&self, other: &Self, t: f64) -> Self {
        Self {
            rgb: self.rgb + (other.rgb - self.rgb) * t,
            filter: self.filter + (other.filter - self.filter) * t,
            transmit: self.transmit + (other.transmit - self.transmit) * t,
        }
    }
}
