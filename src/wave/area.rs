//! A tile's place in the picture, and the blocks of pixels in it that get their rays together.

/// Edge of the blocks: eight packets of camera rays.
pub const BLOCK: usize = 8;

/// Columns and rows of pixels of such a packet.
pub const PACKET: [usize; 2] = [4, 2];

/// A rectangle of pixels.
#[derive(Debug, Clone, Copy)]
pub struct TileArea {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}
