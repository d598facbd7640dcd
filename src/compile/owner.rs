//! Who owns a surface: what it looks like, what is inside it, who sees it.

/// What surfaces of one object share.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Owner {
    /// Textures seen from outside: one, or three that are blended between a triangle's corners.
    pub textures: [u32; 3],
    /// Texture seen from inside; `None` for the same.
    pub interior_texture: Option<u32>,
    /// A cut face without a look: shows those of the parts it lies in, in equal shares; `textures` if there are none.
    pub cut: bool,
    /// What light meets inside.
    pub interior: u32,
    /// Inside and outside change places: told to what asks what a point is in.
    pub inverse: bool,
    /// Lit from both sides.
    pub double_illuminate: bool,
    /// Stops all light.
    pub blocks: bool,
}

/// Bits that say which rays see a run. A ray's filter and a run's class must share a bit.
pub mod class {
    /// Seen by camera rays and what they become by refraction (not `no_image`).
    pub const CAMERA: u8 = 1;
    /// Seen by reflected rays and what they become by refraction (not `no_reflection`).
    pub const REFLECTED: u8 = 2;
    /// Blocks shadow rays altogether.
    pub const BLOCKS: u8 = 4;
    /// Lets some light of shadow rays through, or may.
    pub const FILTERS: u8 = 8;

    /// That of a thing that is met as a whole, by those of its surfaces: if one of them lets light through, it must be asked which was hit.
    pub fn of_whole(surfaces: impl IntoIterator<Item = u8>) -> u8 {
        let all = surfaces.into_iter().fold(0, |all, class| all | class);
        if all & FILTERS != 0 { all & !BLOCKS } else { all }
    }
}
