//! `mesh` and `mesh2` (manual sections 3.4.5.2.3 and 3.4.5.2.4).

use super::expr::show;
use super::geometry::keep_extent;
use super::machine::{Lexeme, Machine, Res, Stop};
use super::shape::is_degenerate;
use super::value::{Lacks, ObjectValue, Value};
use crate::lang::{Keyword, Mark, Span, Token};
use crate::scene::{Mesh, MeshTriangle, Object, Shape, Texture};
use glam::DVec3;
use std::sync::Arc;

/// The faces of a mesh2, in columns.
#[derive(Default)]
struct Faces {
    vertices: Vec<[u32; 3]>,
    /// The textures at them; ends with the last face that has any.
    textures: Vec<Option<[u32; 3]>>,
}

/// Entries of a list that room is made for before they are seen: more than are in any usual file, less than harms.
const AT_ONCE: usize = 1 << 20;

/// A mesh under way.
#[derive(Default)]
struct Draft {
    mesh: Mesh,
    lacks: Lacks,
    degenerate: usize,
}

/// Unit normals nearer to each other than this are one (measured in POV-Ray: flat at 1e-5, smooth at 1.03e-5).
const ALIKE: f64 = 1e-5;

/// True if POV-Ray leaves a mesh's triangle with these unit normals at its corners flat: by its own normal, whatever these are.
fn are_alike(&[a, b, c]: &[DVec3; 3]) -> bool {
    (a - b).length() < ALIKE && (a - c).length() < ALIKE
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
        let normals = normals.filter(|normals| !are_alike(normals)).map(|normals| {
            let first = mesh.normals.len() as u32;
            mesh.normals.extend(normals);
            [first, first + 1, first + 2]
        });
        mesh.triangles.push(MeshTriangle { vertices: [first, first + 1, first + 2], normals, textures });
        Ok(())
    }

    /// A vertex normal; a zero one becomes x, as in POV-Ray.
    fn unit_normal(&mut self, normal: DVec3, at: Lexeme) -> DVec3 {
        normal.try_normalize().unwrap_or_else(|| {
            let span = self.span(at);
            self.warn("zero normal", "a normal of length 0 counts as <1, 0, 0>", span);
            DVec3::X
        })
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
        let mut faces = Faces::default();
        let mut normal_faces: Vec<[u32; 3]> = Vec::new();
        let mut faces_seen = false;
        while let Token::Word(word) = self.peek()? {
            match word {
                K::VertexVectors | K::NormalVectors | K::UvVectors => {
                    self.next()?;
                    let open = self.open(word.text())?;
                    let count = self.count()?;
                    let mut list = Vec::with_capacity(count.min(AT_ONCE));
                    while list.len() < count {
                        self.comma()?;
                        if !self.rows(count, &mut list, |_, v| Ok(v))? {
                            list.push(self.vector()?);
                        }
                    }
                    self.charge(list.len() * size_of::<DVec3>())?;
                    self.comma()?;
                    self.close(word.text(), open)?;
                    match word {
                        K::VertexVectors => draft.mesh.vertices = list,
                        K::NormalVectors => {
                            list.iter_mut().for_each(|normal| *normal = self.unit_normal(*normal, at));
                            draft.mesh.normals = list;
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
        let (normals, vertices) = (draft.mesh.normals.len(), draft.mesh.vertices.len());
        if normal_faces.is_empty() && normals != 0 && normals != vertices {
            let message = format!("{normals} normals for {vertices} vertices need `normal_indices`");
            return Err(self.error(message, self.span(at)));
        }
        // Without `normal_indices`, each vertex has the normal of its own number.
        let normal_faces = match normal_faces.is_empty() && normals == vertices {
            true => &faces.vertices,
            false => &normal_faces,
        };
        draft.mesh.triangles.reserve_exact(faces.vertices.len());
        for (index, &vertices) in faces.vertices.iter().enumerate() {
            let corners = vertices.map(|v| draft.mesh.vertices[v as usize]);
            if is_degenerate(&corners) {
                draft.degenerate += 1;
                continue;
            }
            let normals = normal_faces
                .get(index)
                .filter(|corners| !are_alike(&corners.map(|n| draft.mesh.normals[n as usize])))
                .copied();
            let textures = faces.textures.get(index).copied().flatten();
            draft.mesh.triangles.push(MeshTriangle { vertices, normals, textures });
        }
        Ok(self.finish_mesh(draft, at))
    }

    fn faces(&mut self, vertices: usize, textures: usize) -> Res<Faces> {
        let open = self.open("face_indices")?;
        let count = self.count()?;
        let mut faces = Faces { vertices: Vec::with_capacity(count.min(AT_ONCE)), textures: Vec::new() };
        while faces.vertices.len() < count {
            self.comma()?;
            if !self.rows(count, &mut faces.vertices, |m, v| m.indices_of(v, vertices))? {
                faces.vertices.push(self.indices(vertices)?);
            }
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
                    faces.textures.resize(faces.vertices.len() - 1, None);
                    faces.textures.push(Some(indices));
                }
            }
        }
        self.charge(faces.vertices.len() * size_of::<MeshTriangle>())?;
        self.comma()?;
        self.close("face_indices", open)?;
        Ok(faces)
    }

    /// The plain vectors that a list begins with, up to `count` entries of it; false, and nothing taken, if there are none.
    fn rows<T>(
        &mut self,
        count: usize,
        list: &mut Vec<T>,
        entry: impl Fn(&mut Self, DVec3) -> Res<T>,
    ) -> Res<bool> {
        let Token::Rows(first, rows) = self.peek()? else { return Ok(false) };
        self.next()?;
        // Each with its comma.
        self.count_steps(2 * u64::from(rows))?;
        let text = self.text.clone();
        let numbers = &text.numbers[first as usize..][..3 * rows as usize];
        let room = count - list.len();
        for (row, v) in numbers.chunks_exact(3).take(room).enumerate() {
            let v = DVec3::from_slice(v);
            let entry = match v.is_finite() {
                true => entry(self, v),
                false => Err(self.error_here(format!("expected a finite vector, found {}", show(v)))),
            };
            list.push(entry.map_err(|stop| self.in_row(stop, row))?);
        }
        if room < rows as usize {
            let error = self.error_here(format!("expected `}}` after {count} entries, found a vector"));
            return Err(self.in_row(error, room));
        }
        Ok(true)
    }

    /// An error of the rows that have just been taken, moved to the one that is at fault.
    fn in_row(&self, stop: Stop, row: usize) -> Stop {
        let Stop::Error(mut diagnostic) = stop else { return stop };
        if let Some(span) = &mut diagnostic.span {
            // Nothing but blanks stands between rows.
            let text = self.sources.text(*span);
            let from = text.match_indices('<').nth(row).map_or(0, |(at, _)| at);
            let len = text[from..].find('>').map_or(1, |at| at + 1);
            *span = Span { start: span.start + from as u32, end: span.start + (from + len) as u32, ..*span };
        }
        Stop::Error(diagnostic)
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
        let mut list = Vec::with_capacity(count.min(AT_ONCE));
        while list.len() < count {
            self.comma()?;
            if !self.rows(count, &mut list, |m, v| m.indices_of(v, len))? {
                list.push(self.indices(len)?);
            }
        }
        self.comma()?;
        self.close(word.text(), open)?;
        Ok(list)
    }

    /// Three indices as a vector.
    fn indices(&mut self, len: usize) -> Res<[u32; 3]> {
        let v = self.vector()?;
        self.indices_of(v, len)
    }

    /// Three indices below `len` from the vector that has just been taken.
    fn indices_of(&mut self, v: DVec3, len: usize) -> Res<[u32; 3]> {
        let valid = |i: f64| i >= 0.0 && i < len as f64 && i < f64::from(u32::MAX);
        if !(valid(v.x) && valid(v.y) && valid(v.z)) {
            let found = show(v);
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
            let mut object = Object::new(Shape::Mesh(Arc::new(draft.mesh)));
            keep_extent(&mut object);
            object.into()
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
