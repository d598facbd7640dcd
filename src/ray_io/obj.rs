//! Wavefront OBJ: corners and faces, nothing else.

use super::{Geometry, RayFileError};

/// `v` and `f` lines; faces of more than three corners become fans. Other lines are passed over.
pub(super) fn read_obj(text: &str) -> Result<Geometry, RayFileError> {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (number, line) in text.lines().enumerate() {
        let wrong = |what: &str| RayFileError::Value(format!("line {}: expected {what}", number + 1));
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let mut next = || words.next().and_then(|word| word.parse::<f32>().ok());
                let (Some(x), Some(y), Some(z)) = (next(), next(), next()) else {
                    return Err(wrong("three numbers"));
                };
                vertices.push([x, y, z]);
            }
            Some("f") => {
                let mut corners = Vec::new();
                for word in words {
                    let number = word.split('/').next().and_then(|n| n.parse::<i64>().ok());
                    // Counted from 1, or backwards from the last corner so far.
                    let corner = match number {
                        Some(n) if n > 0 => n - 1,
                        Some(n) if n < 0 => vertices.len() as i64 + n,
                        _ => return Err(wrong("numbers of corners")),
                    };
                    corners.push(u32::try_from(corner).map_err(|_| wrong("numbers of corners"))?);
                }
                let Some((&first, rest)) = corners.split_first() else { continue };
                triangles.extend(rest.windows(2).map(|pair| [first, pair[0], pair[1]]));
            }
            _ => {}
        }
    }
    if triangles.is_empty() {
        return Err(RayFileError::Kind("a MESH0001, SPHR0001 or OBJ file with faces"));
    }
    Ok(Geometry::Mesh { vertices, triangles })
}
