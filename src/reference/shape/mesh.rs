//! Triangles in bulk; with an `inside_vector` a solid.

use super::triangle::Sheared;
use super::{Line, Root, Roots};
use crate::reference::box_tree::{BoxTree, Reach};
use crate::scene::Mesh;
use glam::DVec2;

/// All triangles in turn; a triangle's index is its part of the surface.
///
/// Inside is counted along the line itself, not along `inside_vector`: on a closed mesh the two are the same, since the
/// triangle test is watertight. On an open mesh POV-Ray's answer depends on that vector and ours on the line.
pub fn cross(mesh: &Mesh, line: &Line) -> Roots {
    let sheared = Sheared::new(line);
    let projected: Vec<_> = mesh.vertices.iter().map(|&vertex| sheared.project(vertex)).collect();
    let met = |part| meet(mesh, &sheared, part, |vertex| projected[vertex as usize]);
    Roots::sorted((0..mesh.triangles.len()).filter_map(met).collect())
}

/// The same, of which only those triangles are asked that the line may meet.
pub fn cross_near(mesh: &Mesh, line: &Line, triangles: &BoxTree) -> Roots {
    let sheared = Sheared::new(line);
    let near = triangles.met_by(line.origin, line.dir, Reach::Whole);
    let project = |vertex| sheared.project(mesh.vertices[vertex as usize]);
    Roots::sorted(near.iter().filter_map(|&part| meet(mesh, &sheared, part as usize, project)).collect())
}

fn meet(mesh: &Mesh, sheared: &Sheared, part: usize, project: impl Fn(u32) -> DVec2) -> Option<Root> {
    let triangle = &mesh.triangles[part];
    let corners = || {
        let normals = triangle.normals.map(|normals| normals.map(|i| mesh.normals[i as usize]));
        (triangle.vertices.map(|i| mesh.vertices[i as usize]), normals)
    };
    let root = sheared.meet(triangle.vertices.map(project), corners, part)?;
    Some(Root { toggles: mesh.inside_vector.is_some(), ..root })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::MeshTriangle;
    use glam::DVec3;

    /// An octahedron: the least closed mesh with corners of four edges on the axes.
    fn octahedron(center: DVec3) -> Mesh {
        let vertices = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z]
            .map(|v| center + v)
            .to_vec();
        let triangles = (0..8).map(|i: u32| MeshTriangle {
            vertices: [i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2 & 1)],
            normals: None,
            textures: None,
        });
        Mesh { vertices, triangles: triangles.collect(), inside_vector: Some(DVec3::X), ..Mesh::default() }
    }

    #[test]
    fn closed_mesh_is_met_an_even_number_of_times() {
        for offset in [0.0, 1e6] {
            let center = DVec3::new(offset, -offset, offset);
            let mesh = octahedron(center);
            for i in 0..2000 {
                let a = i as f64;
                let origin = center + 3.0 * DVec3::new(a.sin(), (1.3 * a).cos(), (0.7 * a + 1.0).sin());
                // At corners, at edges, at faces.
                let corner = |i: usize| mesh.vertices[i];
                let target =
                    [corner(i % 6), corner(0).lerp(corner(2), 0.25), center, corner(4).midpoint(corner(1))]
                        [i % 4];
                let roots = cross(&mesh, &Line { origin, dir: target - origin, left: None });
                assert_eq!(roots.list.len() % 2, 0, "ray {i} at offset {offset}: {:?}", roots.list.len());
            }
        }
    }

    #[test]
    fn triangle_that_was_left_is_not_met_again() {
        let mesh = octahedron(DVec3::ZERO);
        let first =
            cross(&mesh, &Line { origin: DVec3::new(0.2, 0.3, -5.0), dir: DVec3::Z, left: None }).list[0];
        let roots = cross(&mesh, &Line { origin: first.point, dir: DVec3::Z, left: Some(first.part) });
        assert_eq!(roots.list.iter().map(|root| root.left).collect::<Vec<_>>(), [true, false]);
        assert!((roots.list[1].t - 1.0).abs() < 1e-15);
    }
}
