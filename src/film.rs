//! The picture under way: linear light, one sum per pixel. Knows nothing of scenes, rays or files.

/// A finished picture, row by row from the top left: of light, or of what its pixels were developed to.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture<P> {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` pixels.
    pub pixels: Vec<P>,
}

/// A picture in linear light.
pub type Film = Picture<Pixel>;

/// One pixel: premultiplied linear RGB, and how much of the background shows through.
///
/// `rgb` already holds the scene's background where it is seen, as POV-Ray does without alpha output.
/// Unclamped: light over 1 is kept for float files.
#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Pixel {
    /// Linear red, green and blue.
    pub rgb: [f32; 3],
    /// What of the pixel is not covered, 0 to 1: the share of the background that is seen, times the background's own
    /// `transmit`. Alpha is `1 - transmit`.
    pub transmit: f32,
}

impl<P: Copy + bytemuck::Zeroable> Picture<P> {
    /// A black picture; a film is also covered. (Its memory comes as the system zeroes it, where it is first written to.)
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: bytemuck::zeroed_vec(width * height) }
    }

    /// The pixel in column `x`, row `y` (0 at the top left).
    pub fn pixel(&self, x: usize, y: usize) -> P {
        self.pixels[y * self.width + x]
    }

    /// Lays rows of `width` pixels over those from column `x`, row `y` on.
    pub fn lay(&mut self, (x, y): (usize, usize), width: usize, pixels: &[P]) {
        for (row, pixels) in pixels.chunks(width).enumerate() {
            let first = (y + row) * self.width + x;
            self.pixels[first..first + pixels.len()].copy_from_slice(pixels);
        }
    }
}

/// Rays traced, by what they were for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct RayCounts {
    /// From the eye.
    pub camera: u64,
    /// Towards lights.
    pub shadow: u64,
    /// Off mirrors.
    pub reflect: u64,
    /// Through surfaces, bent or straight.
    pub refract: u64,
    /// The packets they went in.
    #[serde(skip)]
    pub packets: PacketCounts,
}

/// Packets of rays by what the rays were for, and packets of hits that were shaded. Zero where rays go one by one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PacketCounts {
    /// See [`RayCounts`].
    pub camera: u64,
    /// See [`RayCounts`].
    pub shadow: u64,
    /// See [`RayCounts`].
    pub reflect: u64,
    /// See [`RayCounts`].
    pub refract: u64,
    /// Packets of hits.
    pub shaded: u64,
    /// Hits in them; one that shows several textures counts once for each.
    pub hits: u64,
    /// Shadow rays that went in no packet: what is around the light was known.
    pub answered: u64,
}

impl RayCounts {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.camera + self.shadow + self.reflect + self.refract
    }

    /// Adds those of another part of the picture.
    pub fn add(&mut self, other: &Self) {
        self.camera += other.camera;
        self.shadow += other.shadow;
        self.reflect += other.reflect;
        self.refract += other.refract;
        let (own, other) = (&mut self.packets, &other.packets);
        own.camera += other.camera;
        own.shadow += other.shadow;
        own.reflect += other.reflect;
        own.refract += other.refract;
        own.shaded += other.shaded;
        own.hits += other.hits;
        own.answered += other.answered;
    }
}
