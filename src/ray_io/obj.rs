//! Wavefront OBJ: corners and faces, nothing else.

use super::{Geometry, RayFileError};

/// `v` and `f` lines; faces of more than three corners become fans. Other lines are passed over.
pub(super) fn read_obj(text: &str) -> Result<Geometry, RayFileError> {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    // Faces may name corners of later lines: lines, each with a corner beyond those so far and beyond earlier lines'.
    let mut ahead: Vec<(usize, u32)> = Vec::new();
    // Some programs begin their texts with a mark of UTF-8.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    for (line, number) in text.lines().zip(1..) {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let mut next = || words.next()?.parse().ok().filter(|x: &f32| x.is_finite());
                let (Some(x), Some(y), Some(z)) = (next(), next(), next()) else {
                    return Err(wrong(number, "three finite numbers"));
                };
                vertices.push([x, y, z]);
            }
            Some("f") => {
                let corners: Option<Vec<u32>> = words.map(|word| corner(word, vertices.len())).collect();
                let corners = corners.ok_or_else(|| wrong(number, "numbers of corners"))?;
                let [first, _, _, ..] = corners[..] else {
                    return Err(wrong(number, "three or more corners"));
                };
                let last = corners.iter().copied().max().unwrap_or_default();
                let known = ahead.last().map_or(0, |(_, corner)| *corner as usize + 1).max(vertices.len());
                if last as usize >= known {
                    ahead.push((number, last));
                }
                triangles.extend(corners[1..].windows(2).map(|pair| [first, pair[0], pair[1]]));
            }
            _ => {}
        }
    }
    if let Some((number, corner)) = ahead.iter().find(|(_, corner)| *corner as usize >= vertices.len()) {
        let (corner, there) = (u64::from(*corner) + 1, vertices.len());
        let message = format!("line {number} names corner {corner}, which is not among the {there}");
        return Err(RayFileError::Value(message));
    }
    if triangles.is_empty() {
        return Err(RayFileError::Kind("a MESH0001, SPHR0001 or OBJ file with faces"));
    }
    Ok(Geometry::Mesh { vertices, triangles })
}

/// The index that `3`, `3/1/2` or, backwards from the last corner so far, `-1` means.
fn corner(word: &str, so_far: usize) -> Option<u32> {
    let corner = match word.split('/').next()?.parse::<i64>().ok()? {
        0 => return None,
        n if n > 0 => n - 1,
        n => so_far as i64 + n,
    };
    corner.try_into().ok()
}

fn wrong(line: usize, expected: &str) -> RayFileError {
    RayFileError::Value(format!("line {line}: expected {expected}"))
}
