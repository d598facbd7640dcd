//! `mesh` and `mesh2` (manual sections 3.4.5.2.3 and 3.4.5.2.4).

use super::machine::{Lexeme, Machine, Res};
use super::shape::is_degenerate;
use super::value::{Lacks, ObjectValue, Value};
use crate::lang::{Keyword, Mark, Token};
use crate::scene::{Mesh, MeshTriangle, Shape, Texture};
use glam::DVec3;
use std::sync::Arc;

/// Three vertices, and the textures at them.
type Face = ([u32; 3], Option<[u32; 3]>);

/// A mesh under way.
#[derive(Default)]
struct Draft {
    mesh: Mesh,
    lacks: Lacks,
    degenerate: usize,
}

impl Machine<'_> {
    /// The triangles of a `mesh`.
    pub fn mesh(&mut self, at: Lexeme) -> Res<ObjectValue> {
        let mut draft = Draft::default();
        loop {
            match self.peek()? {
                Token::Word(Keyword::Triangle) => self.mesh_triangle(&mut draft, false)?,
                Token::Word(Keyword::SmoothTriangle) => self.mesh_triangle(&mut draft, true)?,
                Token::Word(Keyword::InsideVector) => {
                    self.next()?;
                    draft.mesh.inside_vector = self.vector()?.try_normalize();
                }
                _ => return Ok(self.finish_mesh(draft, at)),
            }
        }
    }

    fn mesh_triangle(&mut self, draft: &mut Draft, smooth: bool) -> Res<()> {
        let at = self.next()?;
        let open = self.open(if smooth { "smooth_triangle" } else { "triangle" })?;
        let (vertices, normals) = if smooth {
            let p = self.corners::<6>()?;
            let normals =
                [self.unit_normal(p[1], at), self.unit_normal(p[3], at), self.unit_normal(p[5], at)];
            ([p[0], p[2], p[4]], Some(normals))
        } else {
            (self.corners::<3>()?, None)
        };
        let mut textures = None;
        loop {
            match self.peek()? {
                Token::Word(Keyword::UvVectors) => {
                    self.next()?;
                    self.corners::<3>()?;
                }
                Token::Word(Keyword::Texture) => {
                    self.next()?;
                    let texture = self.texture()?;
                    draft.lacks.add(&texture.lacks);
                    let index = draft.add_texture(texture.value);
                    textures = Some([index; 3]);
                }
                Token::Word(Keyword::TextureList) => {
                    self.next()?;
                    let list_open = self.open("texture_list")?;
                    let mut indices = [0; 3];
                    for index in &mut indices {
                        *index = self.mesh_texture(draft)?;
                        self.comma()?;
                    }
                    self.close("texture_list", list_open)?;
                    textures = Some(indices);
                }
                _ => break,
            }
        }
        self.close("triangle", open)?;
        self.charge(size_of::<MeshTriangle>() + 6 * size_of::<DVec3>())?;
        if is_degenerate(&vertices) {
            draft.degenerate += 1;
            return Ok(());
        }
        let mesh = &mut draft.mesh;
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(vertices);
        let normals = normals.map(|normals| {
            let first = mesh.normals.len() as u32;
            mesh.normals.extend(normals);
            [first, first + 1, first + 2]
        });
        mesh.triangles.push(MeshTriangle { vertices: [first, first + 1, first + 2], normals, textures });
        Ok(())
    }

    /// A texture by block or by bare name.
    fn mesh_texture(&mut self, draft: &mut Draft) -> Res<u32> {
        let named = self.take_named(|value| match value {
            Value::Texture(texture) => Some(texture.copy()),
            _ => None,
        })?;
        let texture = match named {
            Some(texture) => texture,
            None if self.accept_word(Keyword::Texture)? => self.texture()?,
            None => return self.expected("a texture"),
        };
        draft.lacks.add(&texture.lacks);
        draft.mesh.textures.push(Arc::new(texture.value));
        Ok(draft.mesh.textures.len() as u32 - 1)
    }

    /// The lists of a `mesh2`.
    pub fn mesh2(&mut self, at: Lexeme) -> Res<ObjectValue> {
        use Keyword as K;
        let mut draft = Draft::default();
        let mut faces: Vec<Face> = Vec::new();
        let mut normal_faces: Vec<[u32; 3]> = Vec::new();
        let mut faces_seen = false;
        while let Token::Word(word) = self.peek()? {
            match word {
                K::VertexVectors | K::NormalVectors | K::UvVectors => {
                    self.next()?;
                    let open = self.open(word.text())?;
                    let count = self.count()?;
                    let mut list = Vec::with_capacity(count.min(1 << 20));
                    while list.len() < count {
                        self.comma()?;
                        list.push(self.vector()?);
                    }
                    self.charge(list.len() * size_of::<DVec3>())?;
                    self.comma()?;
                    self.close(word.text(), open)?;
                    match word {
                        K::VertexVectors => draft.mesh.vertices = list,
                        K::NormalVectors => {
                            draft.mesh.normals =
                                list.into_iter().map(|normal| self.unit_normal(normal, at)).collect();
                        }
                        _ => {}
                    }
                }
                K::TextureList => {
                    self.next()?;
                    let open = self.open(word.text())?;
                    let count = self.count()?;
                    while draft.mesh.textures.len() < count {
                        self.comma()?;
                        self.mesh_texture(&mut draft)?;
                    }
                    self.comma()?;
                    self.close(word.text(), open)?;
                }
                K::FaceIndices => {
                    self.next()?;
                    faces = self.faces(draft.mesh.vertices.len(), draft.mesh.textures.len())?;
                    faces_seen = true;
                }
                K::NormalIndices => {
                    self.next()?;
                    normal_faces = self.index_list(K::NormalIndices, draft.mesh.normals.len())?;
                }
                K::UvIndices => {
                    self.next()?;
                    self.index_list(K::UvIndices, usize::MAX)?;
                }
                K::InsideVector => {
                    self.next()?;
                    draft.mesh.inside_vector = self.vector()?.try_normalize();
                }
                _ => break,
            }
        }
        if !faces_seen {
            return self.expected("`face_indices` and the other lists of a mesh2");
        }
        // Without `normal_indices`, each vertex has the normal of its own number.
        if normal_faces.is_empty() && draft.mesh.normals.len() == draft.mesh.vertices.len() {
            normal_faces = faces.iter().map(|face| face.0).collect();
        }
        draft.mesh.triangles.reserve(faces.len());
        for (index, (vertices, textures)) in faces.into_iter().enumerate() {
            let corners = vertices.map(|v| draft.mesh.vertices[v as usize]);
            if is_degenerate(&corners) {
                draft.degenerate += 1;
                continue;
            }
            let normals = normal_faces.get(index).copied();
            draft.mesh.triangles.push(MeshTriangle { vertices, normals, textures });
        }
        Ok(self.finish_mesh(draft, at))
    }

    fn faces(&mut self, vertices: usize, textures: usize) -> Res<Vec<Face>> {
        let open = self.open("face_indices")?;
        let count = self.count()?;
        let mut faces = Vec::with_capacity(count.min(1 << 20));
        while faces.len() < count {
            self.comma()?;
            let face = self.indices(vertices)?;
            let mut looks = None;
            if textures > 0 {
                // One texture for the triangle or one a corner.
                self.comma()?;
                if !matches!(self.peek()?, Token::Vector(..) | Token::Mark(_)) {
                    let first = self.texture_index(textures)?;
                    let mut indices = [first; 3];
                    for slot in &mut indices[1..] {
                        self.comma()?;
                        if matches!(self.peek()?, Token::Vector(..) | Token::Mark(_)) {
                            break;
                        }
                        *slot = self.texture_index(textures)?;
                    }
                    looks = Some(indices);
                }
            }
            faces.push((face, looks));
        }
        self.charge(faces.len() * size_of::<MeshTriangle>())?;
        self.comma()?;
        self.close("face_indices", open)?;
        Ok(faces)
    }

    fn texture_index(&mut self, textures: usize) -> Res<u32> {
        let index = self.float()?;
        if !(index >= 0.0 && index < textures as f64) {
            return Err(self.error_here(format!("texture index {index} is not in 0..{}", textures - 1)));
        }
        Ok(index as u32)
    }

    fn index_list(&mut self, word: Keyword, len: usize) -> Res<Vec<[u32; 3]>> {
        let open = self.open(word.text())?;
        let count = self.count()?;
        let mut list = Vec::with_capacity(count.min(1 << 20));
        while list.len() < count {
            self.comma()?;
            list.push(self.indices(len)?);
        }
        self.comma()?;
        self.close(word.text(), open)?;
        Ok(list)
    }

    /// Three indices as a vector.
    fn indices(&mut self, len: usize) -> Res<[u32; 3]> {
        let v = self.vector()?;
        let valid = |i: f64| i >= 0.0 && i < len as f64 && i < f64::from(u32::MAX);
        if !(valid(v.x) && valid(v.y) && valid(v.z)) {
            let found = super::expr::show(v);
            let message = format!("expected three indices below {len}, found {found}");
            return Err(self.error_here(message));
        }
        Ok([v.x as u32, v.y as u32, v.z as u32])
    }

    /// The number of entries that begins a list.
    fn count(&mut self) -> Res<usize> {
        let count = self.float()?;
        if !(0.0..=4e9).contains(&count) {
            return Err(self.error_here(format!("expected the number of entries, found {count}")));
        }
        if self.peek()? != Token::Mark(Mark::CloseBrace) {
            self.comma()?;
        }
        Ok(count as usize)
    }

    fn finish_mesh(&mut self, draft: Draft, at: Lexeme) -> ObjectValue {
        let span = self.span(at);
        if draft.degenerate > 0 {
            let message = match draft.degenerate {
                1 => "the mesh has a degenerate triangle; left it out".to_string(),
                n => format!("the mesh has {n} degenerate triangles; left them out"),
            };
            self.warn("degenerate", message, span);
        }
        let object = if draft.mesh.triangles.is_empty() {
            self.warn("empty mesh", "a mesh of no triangles cannot be seen", span);
            ObjectValue::default()
        } else {
            Shape::Mesh(Arc::new(draft.mesh)).into()
        };
        ObjectValue { lacks: draft.lacks, ..object }
    }
}

impl Draft {
    fn add_texture(&mut self, texture: Texture) -> u32 {
        // Neighbouring triangles mostly share a texture.
        if self.mesh.textures.last().is_none_or(|last| **last != texture) {
            self.mesh.textures.push(Arc::new(texture));
        }
        self.mesh.textures.len() as u32 - 1
    }
}
