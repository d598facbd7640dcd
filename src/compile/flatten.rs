//! One pass over the scene's tree: textures, interiors and flags handed down, transforms multiplied out.

use super::instances::{Instancing, MeshLooks, PlacedMesh, SharedMesh, SharedMeshes, can_be_shared};
use super::shapes::{push, push_mesh};
use super::{Body, Columns, Flat, Kind, MeshBody, Objects, Owner, Tag, WithBlock, class};
use crate::csg::{Constraint, CsgNode, CsgTree, NodeKind, Part};
use crate::kernel::{Aabb, Block, HalfSpace, Solid, bounds_of};
use crate::lane::Scalar;
use crate::parallel;
use crate::scene::{CsgOp, Flags, Interior, Mesh, Object, Scene, Shape, Texture, Transform};
use crate::texture::TextureBuilder;
use glam::DVec3;
use rustc_hash::FxHashMap;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

/// Columns, composites and tags of everything in the scene, in its own order; coordinates relative to `origin`. Some meshes that
/// stand in several places are left whole.
pub(super) fn flatten<S: Scalar>(scene: &Scene, origin: DVec3, instancing: Instancing) -> (Flat<S>, Objects) {
    let mut pass = Pass {
        columns: Columns::default(),
        parts: Columns::default(),
        csg: CsgTree::default(),
        plain: vec![Vec::new(); Kind::ALL.len()],
        composites: Vec::new(),
        part_tags: Vec::new(),
        bodies: Vec::new(),
        mesh_bodies: Vec::new(),
        owners: Vec::new(),
        owner_of: FxHashMap::default(),
        textures: TextureBuilder::new(origin, &scene.globals),
        opaque: Vec::new(),
        interiors: vec![Interior::default()],
        interior_of: FxHashMap::default(),
        kept: Vec::new(),
        rank: 0,
        nodes: 0,
        to_compiled: Transform::translate(-origin),
        default_texture: Arc::new(Texture::default()),
        shared: SharedMeshes::of(scene, instancing),
        placed: Vec::new(),
    };
    for object in &scene.objects {
        let handed = Handed {
            place: Transform::IDENTITY,
            texture: None,
            interior_texture: None,
            interior: None,
            own_interior: 0,
            own_interiors: false,
            root: Arc::as_ptr(object) as usize,
            sees_through: sees_through(object),
            flags: Flags::default(),
            within: Within::Scene,
        };
        pass.object(object, &handed);
        pass.interior_of.remove(&handed.root);
    }
    let Pass { parts, csg, .. } = &mut pass;
    csg.plan(|part| parts.with(part.kind, SolidOf(part.row as usize)));
    let flat = Flat {
        columns: pass.columns,
        parts: pass.parts,
        csg: pass.csg,
        plain: pass.plain,
        composites: pass.composites,
        part_tags: pass.part_tags,
        meshes: pass.shared.all,
        placed: pass.placed,
    };
    let objects = Objects {
        bodies: pass.bodies,
        mesh_bodies: pass.mesh_bodies,
        owners: pass.owners,
        textures: pass.textures.finish(),
        interiors: pass.interiors,
    };
    (flat, objects)
}

/// A shared mesh by itself, in its own space relative to `origin`: owners are its looks, ranks its triangles' numbers, and all rays see it.
pub(super) fn flatten_mesh<S: Scalar>(shared: &SharedMesh, origin: DVec3) -> Flat<S> {
    let mut flat = Flat { plain: vec![Vec::new(); Kind::ALL.len()], ..Flat::default() };
    let SharedMesh { mesh, looks, .. } = shared;
    let class = class::CAMERA | class::REFLECTED | class::BLOCKS;
    for (kind, triangles) in push_mesh(&mut flat.columns, mesh, &Transform::translate(-origin), true) {
        let tag = |k: usize| Tag { owner: looks.of_triangle(triangles[k]), rank: triangles[k], class };
        parallel::extend(&mut flat.plain[kind as usize], triangles.len(), tag);
    }
    flat
}

/// What a node of the scene's tree has from its ancestors.
#[derive(Clone)]
struct Handed {
    /// From the node's parent space to the world.
    place: Transform,
    /// With the place of the space it is in; `None` for faces that show what they cut.
    texture: Option<(Arc<Texture>, Transform)>,
    interior_texture: Option<(Arc<Texture>, Transform)>,
    interior: Option<Arc<Interior>>,
    /// Names the interior if it is known to nobody else: odd, which no address is; else 0.
    own_interior: usize,
    /// Interiors from here on are known to nobody else.
    own_interiors: bool,
    /// Names the top-level object: the identity of its air.
    root: usize,
    /// Of that object: see [`sees_through`].
    sees_through: bool,
    flags: Flags,
    within: Within,
}

/// What a node stands in. What hides an object from rays is asked of whole objects, some of it also of parts (measured in
/// POV-Ray 3.7).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Within {
    /// The scene, or unions that are no more than their parts: the node is as good as an object of its own.
    Scene,
    /// A union that is one object: `no_reflection` counts.
    Union,
    /// A merge: `no_image` counts too.
    Merge,
    /// Whatever cuts: nothing counts.
    Intersection,
}

/// The tags of a mesh's triangles.
struct MeshTags {
    looks: MeshLooks,
    /// By look.
    tags: Vec<Tag>,
    first_rank: u32,
}

impl MeshTags {
    /// Of two triangles at one place the first is seen, so each has a rank of its own.
    fn of(&self, triangle: u32) -> Tag {
        let look = self.looks.of_triangle(triangle);
        Tag { rank: self.first_rank + triangle, ..self.tags[look as usize] }
    }
}

/// Whether a node is inside out.
#[derive(Debug, Clone, Copy, Default)]
struct Turned {
    inverted: bool,
    /// It or an ancestor was, be it back again: a union is a merge then.
    ever: bool,
}

impl Turned {
    fn by(self, flags: Flags) -> Self {
        Self { inverted: self.inverted != flags.inverse, ever: self.ever || flags.is_turned() }
    }

    fn over(self, inverts: bool) -> Self {
        Self { inverted: self.inverted != inverts, ever: self.ever || inverts }
    }
}

/// How children are joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Join {
    Any,
    Merged,
    All,
}

impl Join {
    /// Turned inside out, a union becomes an intersection of its children turned inside out, and back (De Morgan), as in
    /// POV-Ray, where it comes back as a merge.
    fn of(op: CsgOp, turned: Turned) -> Self {
        match (op, turned.inverted) {
            (CsgOp::Union, false) if !turned.ever => Self::Any,
            (CsgOp::Union | CsgOp::Merge, false) | (CsgOp::Intersection | CsgOp::Difference, true) => {
                Self::Merged
            }
            (CsgOp::Union | CsgOp::Merge, true) | (CsgOp::Intersection | CsgOp::Difference, false) => {
                Self::All
            }
        }
    }
}

impl Handed {
    /// What `object` has of its own and from its ancestors. `number` is unlike that of any other node.
    fn to(&self, object: &Object, number: usize) -> Self {
        let place = |texture: &Arc<Texture>| (texture.clone(), self.place);
        let (mine, his) = (object.flags, self.flags);
        let shadows = self.within == Within::Scene;
        let images = matches!(self.within, Within::Scene | Within::Merge);
        let reflections = self.within != Within::Intersection;
        Self {
            place: object.transform.then(&self.place),
            texture: object.texture.as_ref().map(place).or_else(|| self.texture.clone()),
            interior_texture: object.interior_texture().map(place).or_else(|| self.interior_texture.clone()),
            interior: object.interior.clone().or_else(|| self.interior.clone()),
            own_interior: match object.interior {
                Some(_) if self.own_interiors => 2 * number + 1,
                Some(_) => 0,
                None => self.own_interior,
            },
            own_interiors: self.own_interiors || object.own_interiors,
            root: self.root,
            sees_through: self.sees_through,
            flags: Flags {
                no_shadow: his.no_shadow || (shadows && object.throws_no_shadow()),
                no_image: his.no_image || (images && mine.no_image),
                no_reflection: his.no_reflection || (reflections && mine.no_reflection),
                hollow: mine.hollow || his.hollow,
                inverse: mine.inverse,
                turned: mine.turned,
                double_illuminate: mine.double_illuminate || his.double_illuminate,
            },
            within: self.within,
        }
    }

    /// The same as a shape shows it that is `inverted` or not.
    fn shown_by(&self, shape: &Shape, inverted: bool) -> Cow<'_, Self> {
        match (shape, &self.texture, &self.interior_texture) {
            (Shape::Polynomial(polynomial), Some(outer), Some(inner))
                if inverted && polynomial.exchanges_textures() =>
            {
                let (texture, interior_texture) = (Some(inner.clone()), Some(outer.clone()));
                Cow::Owned(Self { texture, interior_texture, ..self.clone() })
            }
            _ => Cow::Borrowed(self),
        }
    }
}

/// Turns round the order of surfaces at one place, among all that were given a rank since `before`.
fn turn_ranks(tags: &mut [Tag], before: u32, last: u32) {
    for tag in tags {
        tag.rank = turned_rank(tag.rank, before, last);
    }
}

/// A rank after `before`, counted back from `last`.
fn turned_rank(rank: u32, before: u32, last: u32) -> u32 {
    before + 1 + (last - rank)
}

/// True if rays go through some surface of an object, or ask there what they are in.
fn sees_through(object: &Object) -> bool {
    let tells = |texture: &Arc<Texture>| {
        !texture.is_opaque() || texture.layers.iter().any(|layer| layer.finish.reflection.fresnel)
    };
    object.texture.iter().chain(object.interior_texture()).any(tells)
        || match &object.shape {
            Shape::Csg { children, .. } => children.iter().any(|child| sees_through(child)),
            Shape::Mesh(mesh) => mesh.textures.iter().any(tells),
            _ => false,
        }
}

/// True of shapes that have two sides but no inside; `inverse` does not turn them (measured in POV-Ray 3.7).
fn is_flat(shape: &Shape) -> bool {
    matches!(shape, Shape::Triangle { .. } | Shape::Polygon { .. })
}

/// What the scene's `bounded_by` says of where an object lies that has no bounds of its own.
fn given_bounds<S: Scalar>(object: &Object, around: &Transform) -> Aabb {
    object.bounded_by().iter().fold(Aabb::INFINITE, |bounds, helper| {
        let mut columns = Columns::<S>::default();
        match push(&mut columns, &helper.shape, &helper.transform.then(around)) {
            Some(kind) if !helper.flags.inverse => bounds.intersection(columns.bounds(kind, 0)),
            _ => bounds,
        }
    })
}

struct Pass<S: Scalar> {
    columns: Columns<S>,
    parts: Columns<f64>,
    csg: CsgTree,
    plain: Vec<Vec<Tag>>,
    composites: Vec<Tag>,
    part_tags: Vec<Tag>,
    bodies: Vec<Body>,
    mesh_bodies: Vec<MeshBody>,
    owners: Vec<Owner>,
    owner_of: FxHashMap<Owner, u32>,
    textures: TextureBuilder,
    /// By texture number.
    opaque: Vec<bool>,
    interiors: Vec<Interior>,
    /// By address of the interior, or of the top-level object for its air.
    interior_of: FxHashMap<usize, u32>,
    kept: Vec<Arc<Interior>>,
    rank: u32,
    /// Nodes met.
    nodes: usize,
    to_compiled: Transform,
    /// POV-Ray's, for faces that nothing gives a look.
    default_texture: Arc<Texture>,
    /// Meshes that have one tree for all places where they stand,
    shared: SharedMeshes,
    /// and these.
    placed: Vec<PlacedMesh>,
}

impl<S: Scalar> Pass<S> {
    /// An object that nothing encloses but unions.
    fn object(&mut self, object: &Object, above: &Handed) {
        let handed = self.hand(object, above);
        let depends = !object.clipped_by().is_empty() || object.flags.is_turned();
        match &object.shape {
            Shape::Csg { op: CsgOp::Union, children, .. } if !depends => {
                if above.within == Within::Scene && !object.is_split() {
                    return self.union(children, handed);
                }
                for child in children {
                    self.object(child, &handed);
                }
            }
            Shape::Csg { .. } => self.composite(object, above, &handed),
            _ if !object.clipped_by().is_empty() => self.composite(object, above, &handed),
            Shape::Mesh(mesh) if self.placed(mesh, &handed) => {}
            Shape::Mesh(mesh) => {
                let before = self.rank;
                let tags = self.mesh_tags(mesh, &handed);
                if mesh.inside_vector.is_some() {
                    let interior = self.interior(&handed);
                    let (ranks, inverse) = (before + 1..self.rank + 1, handed.flags.inverse);
                    self.mesh_bodies.push(MeshBody { ranks, interior, inverse });
                }
                let place = handed.place.then(&self.to_compiled);
                for (kind, triangles) in push_mesh(&mut self.columns, mesh, &place, true) {
                    let plain = &mut self.plain[kind as usize];
                    parallel::extend(plain, triangles.len(), |k| tags.of(triangles[k]));
                }
            }
            shape => {
                let mut handed = handed;
                handed.flags.inverse &= !is_flat(shape);
                let tag = self.tag(&handed.shown_by(shape, handed.flags.inverse), false);
                let place = handed.place.then(&self.to_compiled);
                if let Some(kind) = push(&mut self.columns, shape, &place) {
                    self.plain[kind as usize].push(tag);
                    if kind == Kind::Polynomial {
                        let around = above.place.then(&self.to_compiled);
                        self.columns.polynomials.bound_last(given_bounds::<S>(object, &around));
                    }
                }
            }
        }
    }

    /// The children of a union that is one object. Its parts are traced as if each was one, but for what it decides itself:
    /// which of its surfaces is seen where several are at one place, the last, and what an eye is in.
    fn union(&mut self, children: &[Arc<Object>], handed: Handed) {
        let before = self.rank;
        let plain: Vec<usize> = self.plain.iter().map(Vec::len).collect();
        let (parts, meshes, placed) = (self.part_tags.len(), self.mesh_bodies.len(), self.placed.len());
        let interior = self.interior(&handed);
        let inside = Handed { within: Within::Union, ..handed };
        for child in children {
            self.object(child, &inside);
        }
        for (tags, from) in self.plain.iter_mut().zip(plain) {
            turn_ranks(&mut tags[from..], before, self.rank);
        }
        turn_ranks(&mut self.part_tags[parts..], before, self.rank);
        let turned = |rank: u32| turned_rank(rank, before, self.rank);
        for mesh in &mut self.placed[placed..] {
            // The ranks of a mesh's triangles among each other stay.
            let last = self.shared.all[mesh.mesh as usize].mesh.triangles.len() as u32 - 1;
            mesh.tag.rank = turned(mesh.tag.rank + last);
        }
        for mesh in &mut self.mesh_bodies[meshes..] {
            mesh.ranks = turned(mesh.ranks.end - 1)..turned(mesh.ranks.start) + 1;
        }
        self.bodies.push(Body { ranks: before + 1..self.rank + 1, interior });
    }

    fn hand(&mut self, object: &Object, above: &Handed) -> Handed {
        self.nodes += 1;
        above.to(object, self.nodes)
    }

    fn tag(&mut self, handed: &Handed, blocks: bool) -> Tag {
        let plain = || (self.default_texture.clone(), Transform::IDENTITY);
        let texture = handed.texture.clone().unwrap_or_else(plain);
        let texture = self.texture(&texture);
        self.tag_with([texture; 3], handed, blocks)
    }

    /// `blocks` is for what stops all light whatever texture is met.
    fn tag_with(&mut self, textures: [u32; 3], handed: &Handed, blocks: bool) -> Tag {
        let interior_texture = handed.interior_texture.as_ref().map(|texture| self.texture(texture));
        let owner = Owner {
            textures,
            interior_texture,
            cut: handed.texture.is_none(),
            interior: self.interior(handed),
            inverse: handed.flags.inverse,
            double_illuminate: handed.flags.double_illuminate,
            blocks: blocks || textures.iter().chain(&interior_texture).all(|&t| self.opaque[t as usize]),
        };
        let next = self.owners.len() as u32;
        let number = *self.owner_of.entry(owner).or_insert(next);
        if number == next {
            self.owners.push(owner);
        }
        let mut bits = 0;
        if !handed.flags.no_image {
            bits |= class::CAMERA;
        }
        if !handed.flags.no_reflection {
            bits |= class::REFLECTED;
        }
        if !handed.flags.no_shadow {
            bits |= if owner.blocks { class::BLOCKS } else { class::FILTERS };
        }
        self.rank += 1;
        Tag { owner: number, rank: self.rank, class: bits }
    }

    fn texture(&mut self, (texture, place): &(Arc<Texture>, Transform)) -> u32 {
        let number = self.textures.add(texture, place);
        if number as usize == self.opaque.len() {
            self.opaque.push(texture.is_opaque());
        }
        number
    }

    fn interior(&mut self, handed: &Handed) -> u32 {
        let key = match &handed.interior {
            Some(_) if handed.own_interior != 0 => handed.own_interior,
            Some(interior) => Arc::as_ptr(interior) as usize,
            None => handed.root,
        };
        if let Some(&number) = self.interior_of.get(&key) {
            return number;
        }
        // An object without an interior encloses air of its own, which has an identity only where a ray can go in. All
        // other such air is number 0: an eye may be in it.
        if handed.interior.is_none() && !handed.sees_through {
            return 0;
        }
        let number = self.interiors.len() as u32;
        match &handed.interior {
            Some(interior) => {
                self.interiors.push(Interior::clone(interior));
                self.kept.push(interior.clone());
            }
            None => self.interiors.push(Interior::default()),
        }
        self.interior_of.insert(key, number);
        number
    }

    /// Leaves a mesh whole if it is shared.
    fn placed(&mut self, mesh: &Arc<Mesh>, handed: &Handed) -> bool {
        let own = handed.texture.as_ref().map(|(texture, _)| texture.as_ref());
        if !can_be_shared(mesh, own) {
            return false;
        }
        let place = handed.place.then(&self.to_compiled);
        let Some((number, bounds)) = self.shared.place(mesh, &place) else { return false };
        let looks = self.shared.all[number as usize].looks.clone();
        let tags = self.look_tags(mesh, &looks, handed);
        let owners = tags.iter().map(|tag| tag.owner).collect();
        let tag = Tag { rank: self.rank, ..tags[0] };
        self.rank += mesh.triangles.len() as u32;
        self.placed.push(PlacedMesh { mesh: number, place, tag, owners, bounds });
        true
    }

    fn mesh_tags(&mut self, mesh: &Mesh, handed: &Handed) -> MeshTags {
        let looks = MeshLooks::of(mesh);
        let tags = self.look_tags(mesh, &looks, handed);
        let first_rank = self.rank;
        self.rank += mesh.triangles.len() as u32;
        MeshTags { looks, tags, first_rank }
    }

    /// By look.
    fn look_tags(&mut self, mesh: &Mesh, looks: &MeshLooks, handed: &Handed) -> Vec<Tag> {
        let own = handed.texture.as_ref().map(|(texture, _)| texture.as_ref());
        let blocks = mesh.blocks_light(own);
        let mut tags = vec![self.tag(handed, blocks)];
        let own: Vec<u32> = mesh.textures.iter().map(|t| self.texture(&(t.clone(), handed.place))).collect();
        for corners in &looks.textures {
            tags.push(self.tag_with(corners.map(|c| own[c as usize]), handed, blocks));
        }
        tags
    }

    /// An object whose surfaces depend on each other.
    fn composite(&mut self, object: &Object, above: &Handed, handed: &Handed) {
        let (first, first_node) = (self.csg.parts.len() as u32, self.csg.nodes.len() as u32);
        let before = self.rank;
        let interior = self.interior(handed);
        let mut tags = Vec::new();
        let whole = self.unclipped(object, handed, Turned::default(), &mut tags);
        let (root, bounds) = self.clipped(whole, object, above, &mut tags);
        // An eye is in what is in its own box, which what clips it makes smaller only if it has no end; then what clips it is
        // not asked (measured in POV-Ray 3.7).
        let (around, around_bounds) = if object.is_endless() { (root, bounds) } else { whole };
        if above.within == Within::Scene {
            turn_ranks(&mut tags, before, self.rank);
        }
        self.constrain(root, &mut Vec::new());
        // What only clips is seen by no ray.
        let seen = self.csg.parts[first as usize..].iter().map(|part| part.seen);
        let class = tags
            .iter()
            .zip(seen)
            .filter(|(_, seen)| *seen)
            .fold(0, |bits, (tag, _): (&Tag, _)| bits | tag.class);
        for (part, tag) in self.csg.parts[first as usize..].iter_mut().zip(&tags) {
            // Those that throw a shadow are met by all that ask for one.
            let shadows = class::BLOCKS | class::FILTERS;
            part.classes = if tag.class & shadows == 0 { tag.class } else { tag.class | shadows };
        }
        // If one part lets light through, the whole must be asked which part was hit.
        let class = if class & class::FILTERS != 0 { class & !class::BLOCKS } else { class };
        // A disc's bounds hold its surface, but not the half space that is its inside.
        let has_disc = self.csg.parts[first as usize..].iter().any(|part| part.kind == Kind::Disc as u8);
        let reach = if has_disc { Aabb::INFINITE } else { bounds };
        let bounds = match bounds.is_finite() {
            true => bounds,
            false => bounds.intersection(given_bounds::<f64>(object, &above.place.then(&self.to_compiled))),
        };
        let around = (around, around_bounds, interior);
        self.csg.push_composite(first, first_node, root, (bounds, reach), around);
        let tag = tags.first().copied().unwrap_or(Tag { owner: 0, rank: self.rank, class: 0 });
        self.composites.push(Tag { class, ..tag });
        self.part_tags.extend(tags);
    }

    /// Adds `object` to the expressions: the number of its node, and a box around its surfaces. Only parts are ever `inverted`,
    /// see [`Join::of`].
    fn node(&mut self, object: &Object, above: &Handed, turned: Turned, tags: &mut Vec<Tag>) -> (u32, Aabb) {
        let handed = self.hand(object, above);
        let whole = self.unclipped(object, &handed, turned, tags);
        self.clipped(whole, object, above, tags)
    }

    /// The same without what clips it. `handed` is what it has itself.
    fn unclipped(
        &mut self,
        object: &Object,
        handed: &Handed,
        turned: Turned,
        tags: &mut Vec<Tag>,
    ) -> (u32, Aabb) {
        let turned = turned.by(object.flags);
        let (kind, mut bounds) = match &object.shape {
            Shape::Csg { .. } => self.joined(object, handed, turned, tags),
            Shape::Mesh(mesh) => self.mesh(mesh, handed, turned.inverted, tags),
            shape => match self.primitive(shape, handed, turned.inverted, tags) {
                None => (NodeKind::Any(0..0), Aabb::EMPTY),
                Some(part) => return part,
            },
        };
        let number = self.push_node(kind);
        // What has no inside is nowhere inside, also when turned inside out.
        if let (Shape::Mesh(mesh), true) = (&object.shape, turned.inverted)
            && mesh.inside_vector.is_some()
        {
            self.csg.nodes[number as usize].inverted = true;
            bounds = Aabb::INFINITE;
        }
        if let Shape::Csg { op: CsgOp::Difference, .. } = &object.shape {
            self.csg.nodes[number as usize].cuttable = 1;
        }
        (number, bounds)
    }

    /// What children make together.
    ///
    /// Of surfaces at one place POV-Ray shows the last that it finds, and whatever cuts or merges takes what it finds in each
    /// part last first. So ranks are turned round part by part here, and once more for the whole.
    fn joined(
        &mut self,
        object: &Object,
        handed: &Handed,
        turned: Turned,
        tags: &mut Vec<Tag>,
    ) -> (NodeKind, Aabb) {
        let Shape::Csg { op, children, .. } = &object.shape else {
            return (NodeKind::Any(0..0), Aabb::EMPTY);
        };
        let join = Join::of(*op, turned);
        let within = match join {
            Join::Any => Within::Union,
            Join::Merged => Within::Merge,
            Join::All => Within::Intersection,
        };
        let inside = Handed { within, ..handed.clone() };
        let turns = join != Join::Any || !object.clipped_by().is_empty();
        let mut bounds: Option<Aabb> = None;
        let mut numbers = Vec::with_capacity(children.len());
        for (k, child) in children.iter().enumerate() {
            let (first, before) = (tags.len(), self.rank);
            let turned = turned.over(*op == CsgOp::Difference && k > 0);
            let (number, b) = self.node(child, &inside, turned, tags);
            if turns {
                turn_ranks(&mut tags[first..], before, self.rank);
            }
            let together = |a: Aabb| if join == Join::All { a.intersection(b) } else { a.union(b) };
            bounds = Some(bounds.map_or(b, together));
            numbers.push(number);
        }
        if join == Join::All {
            bounds = bounds.map(|bounds| self.between_planes(&numbers, bounds));
        }
        let list = self.list(&numbers);
        let kind = match join {
            Join::Any => NodeKind::Any(list),
            Join::Merged => NodeKind::Merged(list),
            Join::All => NodeKind::All(list),
        };
        (kind, bounds.unwrap_or(Aabb::EMPTY))
    }

    /// A mesh: a part for each triangle.
    fn mesh(
        &mut self,
        mesh: &Mesh,
        handed: &Handed,
        inverted: bool,
        tags: &mut Vec<Tag>,
    ) -> (NodeKind, Aabb) {
        let mesh_tags = self.mesh_tags(mesh, handed);
        let place = handed.place.then(&self.to_compiled);
        let (mut rows, mut numbers, mut bounds) = (Vec::new(), Vec::new(), Aabb::EMPTY);
        for (kind, triangles) in push_mesh(&mut self.parts, mesh, &place, false) {
            let first = self.parts.len(kind) - triangles.len();
            rows.extend(triangles.iter().enumerate().map(|(k, &triangle)| (triangle, kind, first + k)));
        }
        rows.sort_unstable();
        for (triangle, kind, row) in rows {
            bounds = bounds.union(self.parts.bounds(kind, row));
            numbers.push(self.part(kind, row, mesh.inside_vector.is_some()));
            if let Some(part) = self.csg.parts.last_mut() {
                part.inverted = inverted;
            }
            tags.push(mesh_tags.of(triangle));
        }
        (NodeKind::Odd(self.list(&numbers)), bounds)
    }

    /// Any other shape: its node, and a box around its surface; `None` for shapes that are not rendered.
    fn primitive(
        &mut self,
        shape: &Shape,
        handed: &Handed,
        inverted: bool,
        tags: &mut Vec<Tag>,
    ) -> Option<(u32, Aabb)> {
        let tag = self.tag(&handed.shown_by(shape, inverted), false);
        let kind = push(&mut self.parts, shape, &handed.place.then(&self.to_compiled))?;
        let row = self.parts.len(kind) - 1;
        let bounds = self.parts.bounds(kind, row);
        let solid = !is_flat(shape);
        let inverted = inverted && solid;
        let number = self.part(kind, row, solid);
        tags.push(tag);
        self.csg.nodes[number as usize].inverted = inverted;
        if let Some(part) = self.csg.parts.last_mut() {
            part.inverted = inverted;
        }
        // A part turned inside out bounds nothing, but its surface is where it was.
        Some((number, if inverted { Aabb::INFINITE } else { bounds }))
    }

    /// What `object` leaves of its own node where it is `clipped_by` others.
    fn clipped(
        &mut self,
        (node, mut bounds): (u32, Aabb),
        object: &Object,
        above: &Handed,
        tags: &mut Vec<Tag>,
    ) -> (u32, Aabb) {
        if object.clipped_by().is_empty() {
            return (node, bounds);
        }
        let outside = Handed { within: Within::Intersection, ..above.clone() };
        let mut numbers = vec![node];
        for clip in object.clipped_by() {
            let first = self.csg.parts.len();
            let (clip, b) = self.node(clip, &outside, Turned::default(), tags);
            for part in &mut self.csg.parts[first..] {
                part.seen = false;
            }
            bounds = bounds.intersection(b);
            numbers.push(clip);
        }
        bounds = self.between_planes(&numbers, bounds);
        let list = self.list(&numbers);
        let number = self.push_node(NodeKind::All(list));
        self.csg.nodes[number as usize].cuttable = 1;
        (number, bounds)
    }

    /// `bounds`, or, if these have no end, what planes and quadrics among `nodes` leave of them: all of what is bounded lies in each of these.
    fn between_planes(&self, nodes: &[u32], bounds: Aabb) -> Aabb {
        if bounds.is_finite() || bounds.is_empty() {
            return bounds;
        }
        let mut half_spaces: Vec<_> = HalfSpace::of_box(bounds).collect();
        let mut quadrics = Vec::new();
        self.half_spaces(nodes, &mut half_spaces, &mut quadrics);
        for row in quadrics {
            let more = self.parts.polynomials.half_spaces(row, &half_spaces);
            half_spaces.extend(more);
        }
        bounds.intersection(bounds_of(&half_spaces))
    }

    /// The half spaces among nodes that are intersected, and rows of what may be quadrics.
    fn half_spaces(&self, nodes: &[u32], half_spaces: &mut Vec<HalfSpace>, quadrics: &mut Vec<usize>) {
        for &number in nodes {
            let node = &self.csg.nodes[number as usize];
            match &node.kind {
                NodeKind::All(list) if !node.inverted => {
                    self.half_spaces(self.csg.list(list), half_spaces, quadrics)
                }
                NodeKind::Part(part) => {
                    let Part { kind, row, .. } = self.csg.parts[*part as usize];
                    let row = row as usize;
                    if kind == Kind::Polynomial as u8 && !node.inverted {
                        quadrics.push(row);
                    } else if let Some(Solid::HalfSpace { normal, foot }) =
                        self.parts.with(kind, SolidOf(row))
                    {
                        let normal = if node.inverted { -normal } else { normal };
                        half_spaces.push(HalfSpace { normal, at: normal.dot(foot) });
                    }
                }
                _ => {}
            }
        }
    }

    fn part(&mut self, kind: Kind, row: usize, solid: bool) -> u32 {
        let number = self.csg.parts.len() as u32;
        let whole_skin = self.parts.with(kind as u8, SolidOf(row)).is_some();
        self.csg.parts.push(Part {
            kind: kind as u8,
            row: row as u32,
            node: self.csg.nodes.len() as u32,
            solid,
            partial_skin: kind == Kind::Torus && !whole_skin,
            whole_skin,
            inverted: false,
            // The boundary of a disc is its whole plane.
            bounds: if kind == Kind::Disc { Aabb::INFINITE } else { self.parts.bounds(kind, row) },
            closed: !matches!(kind, Kind::Triangle | Kind::SmoothTriangle | Kind::Polygon),
            seen: true,
            classes: !0,
            constraints: 0..0,
            composite: self.csg.composites.len() as u32,
        });
        self.push_node(NodeKind::Part(number))
    }

    fn push_node(&mut self, kind: NodeKind) -> u32 {
        self.csg.nodes.push(CsgNode { kind, inverted: false, cuttable: usize::MAX });
        self.csg.nodes.len() as u32 - 1
    }

    fn list(&mut self, numbers: &[u32]) -> Range<u32> {
        let first = self.csg.lists.len() as u32;
        self.csg.lists.extend_from_slice(numbers);
        first..self.csg.lists.len() as u32
    }

    /// Hands the constraints of `node`'s ancestors (outermost first) down to its parts.
    fn constrain(&mut self, node: u32, above: &mut Vec<Constraint>) {
        let CsgNode { kind, inverted, .. } = self.csg.nodes[node as usize].clone();
        let depth = above.len();
        if inverted {
            above.push(Constraint::Inverted);
        }
        match kind {
            NodeKind::Part(number) => {
                let first = self.csg.constraints.len() as u32;
                self.csg.constraints.extend(above.iter().rev().cloned());
                self.csg.parts[number as usize].constraints = first..self.csg.constraints.len() as u32;
            }
            NodeKind::All(list) | NodeKind::Merged(list) | NodeKind::Any(list) | NodeKind::Odd(list) => {
                let children = self.csg.list(&list).to_vec();
                let kind = self.csg.nodes[node as usize].kind.clone();
                for &child in &children {
                    let constraint = match &kind {
                        NodeKind::All(list) => Some(Constraint::Inside(list.clone(), child)),
                        NodeKind::Merged(list) => Some(Constraint::Outside(list.clone(), child)),
                        _ => None,
                    };
                    let before = above.len();
                    above.extend(constraint);
                    self.constrain(child, above);
                    above.truncate(before);
                }
            }
        }
        above.truncate(depth);
    }
}

/// What body a row is.
struct SolidOf(usize);

impl WithBlock<f64> for SolidOf {
    type Output = Option<Solid>;
    fn block<B: Block<f64>>(self, block: &B) -> Option<Solid> {
        block.solid(self.0)
    }
}
