//! One pass over the scene's tree: textures, interiors and flags handed down, transforms multiplied out.

use super::composites::{Composites, Join, Stand, Turned};
use super::instances::PlacedPrototype;
use super::looks::{LooksOfMeshes, MeshLooks};
use super::original::{Original, composite_can_be_shared, mesh_can_be_shared};
use super::prototypes::{Prototype, Prototypes};
use super::shapes::{given_bounds, is_flat, push, push_mesh};
use super::uses::MOST_SURFACES;
use super::{Body, Columns, Flat, Kind, Look, MeshBody, Objects, Owner, Tag, class, turn_ranks, turned_rank};
use crate::lane::Scalar;
use crate::parallel;
use crate::scene::{CsgOp, Flags, Interior, Mesh, Object, Scene, Shape, Texture, Transform};
use crate::texture::TextureBuilder;
use glam::DVec3;
use rustc_hash::FxHashMap;
use std::borrow::Cow;
use std::sync::Arc;

/// Columns, composites and tags of everything in the scene, in its own order; coordinates relative to `origin`. Some of what
/// stands in several places is left whole: `prototypes`.
pub(super) fn flatten<S: Scalar>(
    scene: &Scene,
    origin: DVec3,
    (prototypes, meshes): (&Prototypes, &mut LooksOfMeshes),
) -> (Flat<S>, Objects) {
    let mut pass = Pass {
        columns: Columns::default(),
        plain: vec![Vec::new(); Kind::ALL.len()],
        composites: Composites::default(),
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
        prototypes,
        placed: Vec::new(),
        placed_surfaces: 0,
        meshes,
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
    pass.composites.plan();
    let flat =
        Flat { columns: pass.columns, plain: pass.plain, composites: pass.composites, placed: pass.placed };
    let objects = Objects {
        bodies: pass.bodies,
        mesh_bodies: pass.mesh_bodies,
        owners: pass.owners,
        textures: pass.textures.finish(),
        interiors: pass.interiors,
    };
    (flat, objects)
}

/// A prototype by itself, in its own space relative to `origin`: owners are its looks, and all rays see it. Of a mesh it is its place
/// that says whether it stops light.
pub(super) fn flatten_prototype<S: Scalar>(prototype: &Prototype, origin: DVec3) -> Flat<S> {
    let mut flat = Flat { plain: vec![Vec::new(); Kind::ALL.len()], ..Flat::default() };
    let to_compiled = &Transform::translate(-origin);
    let seen = class::CAMERA | class::REFLECTED | class::BLOCKS;
    let lets_through = if let Original::Mesh(_) = prototype.original { class::FILTERS } else { 0 };
    let look = |number| Look { owner: number, class: seen | lets_through };
    match &prototype.original {
        Original::Mesh(mesh) => {
            let of = LooksOfMeshes::default().of(mesh);
            for (kind, triangles) in push_mesh(&mut flat.columns, mesh, to_compiled, true) {
                let tag = |k: usize| look(of.of_triangle(triangles[k])).ranked(triangles[k]);
                parallel::extend(&mut flat.plain[kind as usize], triangles.len(), tag);
            }
        }
        Original::Composite(object) => {
            let (place, above) = (&Transform::IDENTITY, &Transform::IDENTITY);
            let stand = Stand { place, above, to_compiled, alone: true, interior: 0 };
            let looks: Vec<_> = (0..prototype.looks).map(look).collect();
            flat.composites.push(object, stand, (&looks, &mut LooksOfMeshes::default()), &mut 0);
            flat.composites.plan();
            flat.composites.part_tags.iter_mut().for_each(|tag| tag.rank -= 1); // (From 0 on, as those of meshes.)
        }
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

struct Pass<'a, S: Scalar> {
    columns: Columns<S>,
    plain: Vec<Vec<Tag>>,
    composites: Composites,
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
    /// What has one tree for all places where it stands,
    prototypes: &'a Prototypes,
    /// these,
    placed: Vec<PlacedPrototype>,
    /// with so many surfaces.
    placed_surfaces: u64,
    meshes: &'a mut LooksOfMeshes,
}

impl<S: Scalar> Pass<'_, S> {
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
            Shape::Mesh(mesh) if self.placed_mesh(mesh, &handed) => {}
            Shape::Mesh(mesh) => {
                let of = self.meshes.of(mesh);
                let looks = self.looks_of_mesh(mesh, &of, &handed);
                // Of two triangles at one place the first is seen, so each has a rank of its own.
                let first = self.rank + 1;
                self.rank += mesh.triangles.len() as u32;
                if mesh.inside_vector.is_some() {
                    let interior = self.interior(&handed);
                    let (ranks, inverse) = (first..self.rank + 1, handed.flags.inverse);
                    self.mesh_bodies.push(MeshBody { ranks, interior, inverse });
                }
                let place = handed.place.then(&self.to_compiled);
                for (kind, triangles) in push_mesh(&mut self.columns, mesh, &place, true) {
                    let plain = &mut self.plain[kind as usize];
                    let look = |triangle| looks[of.of_triangle(triangle) as usize];
                    parallel::extend(plain, triangles.len(), |k| {
                        look(triangles[k]).ranked(first + triangles[k])
                    });
                }
            }
            shape => {
                let mut handed = handed;
                handed.flags.inverse &= !is_flat(shape);
                let tag = self.tag(&handed.shown_by(shape, handed.flags.inverse));
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
        let (parts, meshes, placed) =
            (self.composites.part_tags.len(), self.mesh_bodies.len(), self.placed.len());
        let interior = self.interior(&handed);
        let inside = Handed { within: Within::Union, ..handed };
        for child in children {
            self.object(child, &inside);
        }
        for (tags, from) in self.plain.iter_mut().zip(plain) {
            turn_ranks(&mut tags[from..], before, self.rank);
        }
        turn_ranks(&mut self.composites.part_tags[parts..], before, self.rank);
        let turned = |rank: u32| turned_rank(rank, before, self.rank);
        for thing in &mut self.placed[placed..] {
            // The ranks of its surfaces among each other stay.
            let last = self.prototypes.all[thing.number as usize].ranks - 1;
            thing.tag.rank = turned(thing.tag.rank + last);
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

    /// That of what stands by itself.
    fn tag(&mut self, handed: &Handed) -> Tag {
        let look = self.look(handed, false);
        self.rank += 1;
        look.ranked(self.rank)
    }

    fn look(&mut self, handed: &Handed, blocks: bool) -> Look {
        let plain = || (self.default_texture.clone(), Transform::IDENTITY);
        let texture = handed.texture.clone().unwrap_or_else(plain);
        let texture = self.texture(&texture);
        self.look_with([texture; 3], handed, blocks)
    }

    /// `blocks` is for what stops all light whatever texture is met.
    fn look_with(&mut self, textures: [u32; 3], handed: &Handed, blocks: bool) -> Look {
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
        let mut class = 0;
        if !handed.flags.no_image {
            class |= class::CAMERA;
        }
        if !handed.flags.no_reflection {
            class |= class::REFLECTED;
        }
        if !handed.flags.no_shadow {
            class |= if owner.blocks { class::BLOCKS } else { class::FILTERS };
        }
        Look { owner: number, class }
    }

    /// By look.
    fn looks_of_mesh(&mut self, mesh: &Mesh, of: &MeshLooks, handed: &Handed) -> Vec<Look> {
        let own = handed.texture.as_ref().map(|(texture, _)| texture.as_ref());
        let blocks = mesh.blocks_light(own);
        let mut looks = vec![self.look(handed, blocks)];
        let own: Vec<u32> = mesh.textures.iter().map(|t| self.texture(&(t.clone(), handed.place))).collect();
        for corners in &of.textures {
            looks.push(self.look_with(corners.map(|c| own[c as usize]), handed, blocks));
        }
        looks
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
    fn placed_mesh(&mut self, mesh: &Arc<Mesh>, handed: &Handed) -> bool {
        if !mesh_can_be_shared(mesh, handed.texture.is_some(), handed.flags.inverse) {
            return false;
        }
        let Some(number) = self.prototypes.mesh(mesh) else { return false };
        let of = self.meshes.of(mesh);
        let looks = self.looks_of_mesh(mesh, &of, handed);
        let interior = mesh.inside_vector.map(|_| self.interior(handed));
        self.placed(number, handed, (&looks, interior))
    }

    /// The same for a composite.
    fn placed_composite(
        &mut self,
        object: &Object,
        handed: &Handed,
        (looks, interior): (&[Look], u32),
    ) -> bool {
        let texture = handed.texture.as_ref().map(|(texture, _)| texture.as_ref());
        let inside = handed.interior_texture.as_ref().map(|(texture, _)| texture.as_ref());
        let Some(number) = self.prototypes.composite(object) else { return false };
        composite_can_be_shared(object, [texture, inside], u64::MAX)
            && self.placed(number, handed, (looks, Some(interior)))
    }

    /// Puts prototype `number` where it is handed, if there are numbers left for its surfaces.
    fn placed(&mut self, number: u32, handed: &Handed, (looks, interior): (&[Look], Option<u32>)) -> bool {
        let place = handed.place.then(&self.to_compiled);
        let prototype = &self.prototypes.all[number as usize];
        debug_assert_eq!(looks.len(), prototype.looks as usize);
        let surfaces = self.placed_surfaces + u64::from(prototype.ranks);
        if surfaces > MOST_SURFACES {
            return false;
        }
        self.placed_surfaces = surfaces;
        let bounds = prototype.bounds_in(&place);
        let owners = looks.iter().map(|look| look.owner).collect();
        let class = class::of_whole(looks.iter().map(|look| look.class));
        let tag = Look { class, ..looks[0] }.ranked(self.rank + 1);
        self.rank += prototype.ranks;
        self.placed.push(PlacedPrototype { number, place, tag, owners, bounds, interior });
        true
    }

    /// An object whose surfaces depend on each other.
    fn composite(&mut self, object: &Object, above: &Handed, handed: &Handed) {
        let alone = above.within == Within::Scene;
        let interior = self.interior(handed);
        let mut looks = Vec::new();
        self.looks_unclipped(object, handed, Turned::default(), &mut looks);
        if self.placed_composite(object, handed, (&looks, interior)) {
            return;
        }
        self.looks_of_clips(object, above, &mut looks);
        let (place, above, to_compiled) = (&handed.place, &above.place, &self.to_compiled);
        let stand = Stand { place, above, to_compiled, alone, interior };
        self.composites.push(object, stand, (&looks, self.meshes), &mut self.rank);
    }

    /// The looks of what is in a composite, in the order in which [`Composites::push`] comes to it.
    fn looks(&mut self, object: &Object, above: &Handed, turned: Turned, looks: &mut Vec<Look>) {
        let handed = self.hand(object, above);
        self.looks_unclipped(object, &handed, turned, looks);
        self.looks_of_clips(object, above, looks);
    }

    /// The same without what clips it. `handed` is what it has itself.
    fn looks_unclipped(&mut self, object: &Object, handed: &Handed, turned: Turned, looks: &mut Vec<Look>) {
        let turned = turned.by(object.flags);
        match &object.shape {
            Shape::Csg { op, children, .. } => {
                let within = match Join::of(*op, turned) {
                    Join::Any => Within::Union,
                    Join::Merged => Within::Merge,
                    Join::All => Within::Intersection,
                };
                let inside = Handed { within, ..handed.clone() };
                for (k, child) in children.iter().enumerate() {
                    self.looks(child, &inside, turned.over(*op, k), looks);
                }
            }
            Shape::Mesh(mesh) => {
                let of = self.meshes.of(mesh);
                looks.extend(self.looks_of_mesh(mesh, &of, handed));
            }
            shape => looks.push(self.look(&handed.shown_by(shape, turned.inverted), false)),
        }
    }

    /// Those of what clips it.
    fn looks_of_clips(&mut self, object: &Object, above: &Handed, looks: &mut Vec<Look>) {
        if !object.clipped_by().is_empty() {
            let outside = Handed { within: Within::Intersection, ..above.clone() };
            for clip in object.clipped_by() {
                self.looks(clip, &outside, Turned::default(), looks);
            }
        }
    }
}
