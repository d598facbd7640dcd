//! Rays and hits from bytes, and back.

use super::{Bytes, RayFileError};
use crate::ray_set::{RayHits, RayQuery, RaySet};

/// Bytes of a ray in a RAYS0001 file.
const RAY: u64 = 40;

/// Reads RAYS0001: rays, and the hits that are stored beside them.
///
/// # Errors
/// If the bytes are something else or cut off, or if a ray has no direction or numbers that are not finite.
pub fn read_rays(bytes: &[u8]) -> Result<(RaySet, RayHits), RayFileError> {
    if !bytes.starts_with(b"RAYS0001") {
        return Err(RayFileError::Kind("a RAYS0001 file"));
    }
    let (n, query, mut body) = Bytes::open(bytes, b"RAYS0001", |n, _| RAY * n)?;
    let query = match query {
        0 => RayQuery::Closest,
        1 => RayQuery::Any,
        other => return Err(RayFileError::Value(format!("its rays ask for {other}: expected 0 or 1"))),
    };
    let n = n as usize;
    let mut column = || body.numbers::<f32>(n);
    let rays = RaySet {
        origin: [column(), column(), column()],
        dir: [column(), column(), column()],
        t_near: column(),
        t_far: column(),
        query,
    };
    let hits = RayHits { t: column(), primitive: body.numbers(n) };
    for row in 0..n {
        let at = |columns: &[Vec<f32>; 3]| columns.each_ref().map(|column| column[row]);
        if !RaySet::is_ray(at(&rays.origin), at(&rays.dir))
            || rays.t_near[row].is_nan()
            || rays.t_far[row].is_nan()
        {
            return Err(RayFileError::Value(format!(
                "ray {row} has no direction, or numbers that are not finite"
            )));
        }
    }
    Ok((rays, hits))
}

/// The bytes of a RAYS0001 file.
pub fn write_rays(rays: &RaySet, hits: &RayHits) -> Vec<u8> {
    let mut bytes = header(b"RAYS0001", rays.len(), rays.query);
    for column in rays.origin.iter().chain(&rays.dir).chain([&rays.t_near, &rays.t_far]) {
        bytes.extend_from_slice(bytemuck::cast_slice(column));
    }
    push_hits(&mut bytes, hits);
    bytes
}

/// The bytes of a HITS0001 file.
pub fn write_hits(hits: &RayHits, query: RayQuery) -> Vec<u8> {
    let mut bytes = header(b"HITS0001", hits.t.len(), query);
    push_hits(&mut bytes, hits);
    bytes
}

fn header(magic: &[u8; 8], rows: usize, query: RayQuery) -> Vec<u8> {
    let query: u32 = if query == RayQuery::Any { 1 } else { 0 };
    let mut bytes = magic.to_vec();
    bytes.extend((rows as u32).to_le_bytes());
    bytes.extend(query.to_le_bytes());
    bytes
}

fn push_hits(bytes: &mut Vec<u8>, hits: &RayHits) {
    bytes.extend_from_slice(bytemuck::cast_slice(&hits.t));
    bytes.extend_from_slice(bytemuck::cast_slice(&hits.primitive));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_survive_the_file() {
        let mut rays = RaySet { query: RayQuery::Any, ..RaySet::default() };
        rays.push([1.0, 2.0, 3.0], [0.0, 0.0, 1.0], (0.0, f32::INFINITY));
        rays.push([1.5, 2.5, 3.5], [1.0, -1.0, 0.0], (0.1, 2.0));
        let hits = RayHits { t: vec![f32::NEG_INFINITY, 2.0], primitive: vec![1, 0] };
        let bytes = write_rays(&rays, &hits);
        assert_eq!(read_rays(&bytes), Ok((rays, hits)));
        assert!(read_rays(&bytes[..bytes.len() - 1]).is_err());
    }

    #[test]
    fn a_ray_without_direction_is_refused() {
        let mut rays = RaySet::default();
        rays.push([0.0; 3], [0.0; 3], (0.0, 1.0));
        let hits = RayHits { t: vec![0.0], primitive: vec![0] };
        assert!(read_rays(&write_rays(&rays, &hits)).is_err());
    }
}
