//! A tile's place in the picture.

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
