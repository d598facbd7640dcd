//! Triangles and spheres from bytes.

use super::obj::read_obj;
use super::{Bytes, RayFileError};

/// What a file holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Geometry {
    /// Triangles.
    Mesh {
        /// Corners, three numbers each.
        vertices: Vec<[f32; 3]>,
        /// Numbers of each triangle's corners: all of them within `vertices`.
        triangles: Vec<[u32; 3]>,
    },
    /// Centre and radius of each sphere.
    Spheres(Vec<[f32; 4]>),
}

impl Geometry {
    /// Triangles or spheres.
    pub fn len(&self) -> usize {
        match self {
            Self::Mesh { triangles, .. } => triangles.len(),
            Self::Spheres(spheres) => spheres.len(),
        }
    }

    /// True without any.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Reads MESH0001, SPHR0001, or text as OBJ.
///
/// # Errors
/// If the bytes are none of these, are cut off, name corners that are not there, or hold numbers that are not finite.
pub fn read_geometry(bytes: &[u8]) -> Result<Geometry, RayFileError> {
    let geometry = if bytes.starts_with(b"MESH0001") {
        let (n, m, mut body) = Bytes::open(bytes, b"MESH0001", |n, m| 12 * (n + m))?;
        let vertices = body.numbers(n as usize);
        let triangles = body.numbers(m as usize);
        Geometry::Mesh { vertices, triangles }
    } else if bytes.starts_with(b"SPHR0001") {
        let (n, _, mut body) = Bytes::open(bytes, b"SPHR0001", |n, _| 16 * n)?;
        Geometry::Spheres(body.numbers(n as usize))
    } else {
        let text = std::str::from_utf8(bytes);
        read_obj(text.map_err(|_| RayFileError::Kind("a MESH0001, SPHR0001 or OBJ file"))?)?
    };
    check(&geometry)?;
    Ok(geometry)
}

fn check(geometry: &Geometry) -> Result<(), RayFileError> {
    let bad = |what: &str, row: usize| Err(RayFileError::Value(format!("{what} {row} is not finite")));
    match geometry {
        Geometry::Mesh { vertices, triangles } => {
            if let Some(row) = vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
                return bad("corner", row);
            }
            let there = vertices.len();
            if let Some(row) = triangles.iter().position(|t| t.iter().any(|&c| c as usize >= there)) {
                let message = format!("triangle {row} names a corner that is not among the {there}");
                return Err(RayFileError::Value(message));
            }
        }
        Geometry::Spheres(spheres) => {
            if let Some(row) = spheres.iter().position(|s| !s.iter().all(|x| x.is_finite()) || s[3] < 0.0) {
                let message = format!("sphere {row} is not finite, or has a negative radius");
                return Err(RayFileError::Value(message));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(corner: u32) -> Vec<u8> {
        let mut bytes = b"MESH0001".to_vec();
        bytes.extend([3u32, 1].iter().flat_map(|n| n.to_le_bytes()));
        bytes.extend([0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0, 1, corner].iter().flat_map(|n| n.to_le_bytes()));
        bytes
    }

    #[test]
    fn a_mesh_is_read_and_checked() {
        assert_eq!(read_geometry(&mesh(2)).map(|g| g.len()), Ok(1));
        let outside = read_geometry(&mesh(3)).unwrap_err();
        assert!(outside.to_string().contains("names a corner"), "{outside}");
        let cut = read_geometry(&mesh(2)[..60]).unwrap_err();
        assert_eq!(cut, RayFileError::Length { found: 60, expected: 64 });
        assert!(read_geometry(b"SPHR0001").is_err());
        assert!(read_geometry(&[0xff, 0xfe, 0x00]).is_err());
    }

    #[test]
    fn an_object_file_is_read_as_fans() {
        let text = "# a square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1 2/2 3/3 -1/4\n";
        let Ok(Geometry::Mesh { triangles, vertices }) = read_geometry(text.as_bytes()) else {
            panic!("not a mesh")
        };
        assert_eq!((vertices.len(), triangles), (4, vec![[0, 1, 2], [0, 2, 3]]));
        // A mark of UTF-8 hid the first corner; faces may stand before their corners.
        let marked = "\u{feff}v 0 0 0\nf 1 2 3\nv 1 0 0\nv 1 1 0\n";
        let Ok(Geometry::Mesh { triangles, vertices }) = read_geometry(marked.as_bytes()) else {
            panic!("not a mesh")
        };
        assert_eq!((vertices[0], vertices.len(), triangles), ([0.0; 3], 3, vec![[0, 1, 2]]));
    }

    #[test]
    fn what_is_wrong_in_an_object_file_is_told_with_its_line() {
        for (text, says) in [
            ("v 0 0 0\nf 1 1 1\nf 1 1 2\nf 1 1 9\n", "line 3 names corner 2, which is not among the 1"),
            ("v 0 0 0\nf 1 -2 1\n", "line 2: expected numbers of corners"),
            ("v 0 0 0\nf 1 0 1\n", "line 2: expected numbers of corners"),
            ("v 0 zero 0\n", "line 1: expected three finite numbers"),
            ("v 0 0 0\nv 0 1e99 0\n", "line 2: expected three finite numbers"),
            ("v 0 NaN 0\n", "line 1: expected three finite numbers"),
            ("v 0 0 0\nv 1 0 0\nf 1 2\n", "line 3: expected three or more corners"),
            ("f\n", "line 1: expected three or more corners"),
            ("v 0 0 0\n", "OBJ file with faces"),
        ] {
            let error = read_geometry(text.as_bytes()).unwrap_err();
            assert!(error.to_string().contains(says), "{text:?}: {error}");
        }
    }
}
