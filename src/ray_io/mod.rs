//! Bytes of geometry and ray files, and back: triangles, spheres, rays, hits.
//!
//! The binary kinds are little endian and start with eight letters that name them:
//!
//! ```text
//! MESH0001  u32 vertices, u32 triangles, f32 xyz[vertices][3], u32 corner[triangles][3]
//! SPHR0001  u32 spheres, u32 0, f32 xyzr[spheres][4]
//! RAYS0001  u32 rays, u32 query (0 closest hit, 1 any hit),
//!           f32 ox[rays], oy[], oz[], dx[], dy[], dz[], t_near[], t_far[],
//!           f32 t[rays], u32 primitive[rays]            (known hits, see `RayHits`)
//! HITS0001  u32 rays, u32 query, f32 t[rays], u32 primitive[rays]
//! ```
//!
//! Wavefront OBJ is read too: `v` and `f` lines, polygons as fans. It knows neither scenes' text nor how rays are traced.

mod geometry;
mod obj;
mod rays;

pub use geometry::{Geometry, read_geometry};
pub use rays::{read_rays, write_hits, write_rays};

/// Why bytes are not what they should be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RayFileError {
    /// Neither of the kinds that were expected.
    #[error("expected {0}")]
    Kind(&'static str),
    /// Fewer or more bytes than its counts say.
    #[error("it is {found} bytes long, but its header says {expected}")]
    Length {
        /// Bytes there are.
        found: u64,
        /// Bytes there should be.
        expected: u64,
    },
    /// A number that cannot be.
    #[error("{0}")]
    Value(String),
}

/// Reads counts and columns off the front.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    /// The file's body after its name and two counts, and the counts; `body` says how many bytes the body has, by the counts.
    fn open(
        bytes: &'a [u8],
        magic: &[u8; 8],
        body: impl Fn(u64, u64) -> u64,
    ) -> Result<(u32, u32, Self), RayFileError> {
        let number = |at: usize| {
            let four = bytes.get(at..at + 4)?;
            Some(u32::from_le_bytes([four[0], four[1], four[2], four[3]]))
        };
        debug_assert!(bytes.starts_with(magic));
        let short = RayFileError::Length { found: bytes.len() as u64, expected: HEADER as u64 };
        let (Some(first), Some(second)) = (number(8), number(12)) else { return Err(short) };
        let expected = HEADER as u64 + body(first.into(), second.into());
        if bytes.len() as u64 != expected {
            return Err(RayFileError::Length { found: bytes.len() as u64, expected });
        }
        Ok((first, second, Self(&bytes[HEADER..])))
    }

    /// The next `n` numbers, or as many as there are.
    fn numbers<T: bytemuck::Pod>(&mut self, n: usize) -> Vec<T> {
        let (head, rest) = self.0.split_at((n * size_of::<T>()).min(self.0.len()));
        self.0 = rest;
        head.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect()
    }
}

/// Bytes of the name and the two counts.
const HEADER: usize = 16;

/// Files are little endian; so is every machine this has been built for, and others must not misread.
const _: () =
    assert!(cfg!(target_endian = "little"), "geometry and ray files are read as the machine stores numbers");
