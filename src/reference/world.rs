//! The scene, resolved for tracing: every leaf knows its place in the world, its look and its interior.
//!
//! A [`Scene`] comes in; a tree of [`Node`]s goes out, in which nothing is inherited any more, `inverse` stands only at
//! leaves, and difference has become intersection. Then: which surface a ray meets first.

use super::box_tree::{BoxTree, PartBox, Reach, Tally};
use super::interior::{InteriorId, Media};
use super::ray::{Ray, RayKind};
use super::shape;
use super::trail::{Children, Crossing, Face};
use crate::scene::{CsgOp, Flags, Interior, Mesh, MeshTriangle, Object, Scene, Shape, Texture, Transform};
use glam::DVec3;
use rustc_hash::FxHashMap;
use smallvec::{SmallVec, smallvec};
use std::sync::{Arc, LazyLock};

/// Everything that rays meet.
pub struct World<'s> {
    /// Camera, lights, settings.
    pub scene: &'s Scene,
    /// One for each of the scene's objects, in its order.
    pub nodes: Vec<Node>,
    /// For surfaces that nothing gives a texture.
    default_texture: PlacedTexture,
    /// What [`InteriorId`]s stand for.
    pub interiors: Vec<Arc<Interior>>,
}

/// An object or a part of one.
pub struct Node {
    /// A shape or several.
    pub kind: NodeKind,
    /// Only what is inside all of these is there.
    pub clips: Vec<Node>,
    /// What is in it, unless its children say otherwise.
    pub interior: InteriorId,
    /// It is a union that is no more than its parts.
    split: bool,
    /// What clips it does not keep an eye out of it.
    open_to_eyes: bool,
}

/// A shape or several.
#[allow(clippy::large_enum_variant, reason = "most nodes are leaves")]
pub enum NodeKind {
    /// One shape.
    Leaf(Leaf),
    /// Several.
    Group {
        /// How they are joined.
        join: Join,
        /// In order of declaration.
        children: Vec<Node>,
        /// Which of them a line may meet, if somebody has taken the trouble to know.
        near: Option<Near>,
        /// A face cut into it can show the textures of this many of its children: all, or the first of a difference.
        cuttable: usize,
        /// Of faces of several children at one place the last one's is seen, else the first one's.
        last_shows: bool,
    },
}

/// What lines pass by in a group, and the state of what they pass by.
pub struct Near {
    tree: BoxTree,
    /// The children that a line is inside of which passes by them: those that are inside out.
    inside_out: Vec<bool>,
    /// How many those are.
    insides: usize,
}

/// How the children of a group are joined. Difference is an intersection whose other children are inside out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Join {
    /// Inside any; all surfaces.
    Union,
    /// Inside any; surfaces outside all others.
    Merge,
    /// Inside all; surfaces inside all others.
    Intersection,
}

/// A shape in the world.
pub struct Leaf {
    /// Counts all leaves of the world.
    pub id: usize,
    /// Whose shape it is.
    object: Arc<Object>,
    /// From that space to the world.
    pub to_world: Transform,
    /// Inside and outside have changed places.
    pub inverted: bool,
    /// False if it has no inside at all.
    pub solid: bool,
    /// A bound on its coordinates in the world: the size of the numbers its meetings are computed from.
    pub reach: f64,
    /// What its surface shows.
    pub look: Look,
    /// Which triangles of a mesh a line may meet, if that is known.
    pub triangles: Option<Arc<BoxTree>>,
}

/// What a leaf has of its own or from its ancestors.
#[derive(Clone)]
pub struct Look {
    /// `None` only on helpers such as clips, whose surfaces are never seen.
    pub texture: Option<PlacedTexture>,
    /// Seen from inside instead of `texture`.
    pub interior_texture: Option<PlacedTexture>,
    /// What is in it.
    pub interior: InteriorId,
    /// Its own and its ancestors' switches; what hides it from rays is asked of whole objects only.
    pub flags: Flags,
}

/// A texture, and the way from the world to its space.
#[derive(Clone)]
pub struct PlacedTexture {
    /// The layers.
    pub texture: Arc<Texture>,
    /// Takes the world's points to the texture's.
    pub from_world: Transform,
}

impl Leaf {
    /// In its own space.
    pub fn shape(&self) -> &Shape {
        &self.object.shape
    }
}

impl PlacedTexture {
    /// A texture that lives in the space which `to_world` leads from.
    pub fn new(texture: &Arc<Texture>, to_world: &Transform) -> Self {
        Self { texture: texture.clone(), from_world: texture.transform.then(to_world).inverted() }
    }
}

/// What a ray meets.
pub struct Met<'w> {
    /// Distance.
    pub t: f64,
    /// Bound on its error.
    pub slack: f64,
    /// The surface there.
    pub face: Face<'w>,
    /// Unit, towards the ray's origin; interpolated on smooth triangles.
    pub normal: DVec3,
    /// The surface is seen from its inside.
    pub backside: bool,
    /// Index into the scene's objects.
    pub object: usize,
}

impl<'s> World<'s> {
    /// Resolves the scene.
    pub fn new(scene: &'s Scene) -> Self {
        let mut builder = Builder::default();
        let nodes = scene.objects.iter().map(|object| builder.top_level(object)).collect();
        let default_texture =
            PlacedTexture { texture: DEFAULT_TEXTURE.clone(), from_world: Transform::IDENTITY };
        Self { scene, nodes, default_texture, interiors: builder.interiors }
    }

    /// [`nearest`] of the scene's objects.
    pub fn nearest(&self, ray: &Ray, t_max: f64) -> Option<Met<'_>> {
        nearest(&self.nodes, ray, t_max)
    }

    /// What a surface shows: textures with their shares, which add up to 1.
    pub fn textures(&self, met: &Met, ray: &Ray) -> SmallVec<[(f64, PlacedTexture); 3]> {
        let leaf = met.face.leaf;
        if let (true, Some(inner)) = (met.backside, &leaf.look.interior_texture) {
            return smallvec![(1.0, inner.clone())];
        }
        if let Shape::Mesh(mesh) = leaf.shape()
            && let Some(textures) = mesh.triangles[met.face.part].textures
        {
            let place = |i: u32| PlacedTexture::new(&mesh.textures[i as usize], &leaf.to_world);
            return if textures[0] == textures[1] && textures[1] == textures[2] {
                smallvec![(1.0, place(textures[0]))]
            } else {
                met.face.corners.into_iter().zip(textures.map(place)).collect()
            };
        }
        if let Some(texture) = &leaf.look.texture {
            return smallvec![(1.0, texture.clone())];
        }
        let mut found = SmallVec::new();
        self.nodes[met.object].cut_textures(ray, met, &mut found);
        if found.is_empty() {
            found.push(self.default_texture.clone());
        }
        let share = 1.0 / found.len() as f64;
        found.into_iter().map(|texture| (share, texture)).collect()
    }

    /// The interiors in which the ray starts, in order of declaration.
    pub fn media_at_start(&self, ray: &Ray) -> Media {
        let mut media = Media::default();
        for node in &self.nodes {
            node.add_media(ray, &mut media);
        }
        media
    }
}

/// The nearest surface of these that the ray sees before `t_max`.
///
/// Of surfaces that cannot be told apart (nearer together than their rounding errors) the one declared first is met, or a plane,
/// as POV-Ray tries objects without bounds before all others (where it has a tree, from three objects and lights on).
pub fn nearest<'w>(nodes: impl IntoIterator<Item = &'w Node>, ray: &Ray, t_max: f64) -> Option<Met<'w>> {
    let mut best: Option<(Crossing, Face, usize)> = None;
    let is_plane = |face: &Face| matches!(face.leaf.shape(), Shape::Plane { .. });
    let parts = nodes
        .into_iter()
        .enumerate()
        .flat_map(|(object, node)| node.separate(ray).into_iter().map(move |part| (object, part)));
    for (object, node) in parts {
        let lone = matches!(node.kind, NodeKind::Leaf(_)) && node.clips.is_empty();
        for crossing in node.trail(ray).crossings {
            let Some(face) = crossing.face else { continue };
            if !crossing.is_ahead() || is_hidden(&face.leaf.look.flags, ray.kind) {
                continue;
            }
            let limit = best.as_ref().map_or(t_max, |best| best.0.t);
            let before_ties = lone && is_plane(&face) && best.as_ref().is_some_and(|best| !is_plane(&best.1));
            let slack = if before_ties { -crossing.slack } else { crossing.slack };
            if crossing.t < limit - slack {
                best = Some((crossing, face, object));
            }
            break;
        }
    }
    let (crossing, face, object) = best?;
    // A wound-up shading normal is turned to the viewer by itself, as POV-Ray does.
    let backside = face.shading.dot(ray.dir) > 0.0;
    let normal = if backside { -face.shading } else { face.shading };
    Some(Met { t: crossing.t, slack: crossing.slack, face, normal, backside, object })
}

/// One object, resolved by itself, and what lines pass by in it: all that `bounds` tells a box of, in the world. What is in a
/// shape that has one must be in its box, too. `tally` counts what is asked.
pub fn alone(object: &Arc<Object>, bounds: Bounds, tally: &Tally) -> Node {
    let sieve = Sieve { bounds, tally: tally.clone(), meshes: FxHashMap::default() };
    Builder { sieve: Some(sieve), ..Builder::default() }.top_level(object)
}

/// Tells the box of a shape in the space that its transform leads to.
pub type Bounds<'b> = &'b dyn Fn(&Shape, &Transform) -> Option<PartBox>;

impl Node {
    /// Its parts, if it is no more than they are, and which of them lines may meet.
    fn split_parts(&self) -> Option<(&[Node], Option<&Near>)> {
        match &self.kind {
            NodeKind::Group { join: Join::Union, children, near, .. }
                if self.split && self.clips.is_empty() =>
            {
                Some((children, near.as_ref()))
            }
            _ => None,
        }
    }

    /// The parts of a union, of unions in it too, each of which is as good as an object of its own; or the node itself. Parts that
    /// the ray is known to pass by may be left out.
    fn separate(&self, ray: &Ray) -> SmallVec<[&Self; 1]> {
        match self.split_parts() {
            None => smallvec![self],
            Some((parts, None)) => parts.iter().flat_map(|part| part.separate(ray)).collect(),
            Some((parts, Some(near))) => {
                let met = near.tree.met_by(ray.origin, ray.dir, Reach::Ahead);
                met.into_iter().flat_map(|part| parts[part as usize].separate(ray)).collect()
            }
        }
    }

    /// Where no texture is given to a cut face (`cutaway_textures`): those of the parts that the face's point is in.
    ///
    /// A point on a surface counts as in it. Of a difference only the first part counts.
    fn cut_textures(&self, ray: &Ray, met: &Met, found: &mut SmallVec<[PlacedTexture; 3]>) {
        if self.trail(ray).sides_at(met.t, met.slack) == [false, false] {
            return;
        }
        match &self.kind {
            NodeKind::Leaf(leaf) => found.extend(leaf.look.texture.clone()),
            NodeKind::Group { children, cuttable, .. } => {
                children[..*cuttable].iter().for_each(|child| child.cut_textures(ray, met, found));
            }
        }
    }

    fn add_media(&self, ray: &Ray, media: &mut Media) {
        if let Some((parts, _)) = self.split_parts() {
            return parts.iter().for_each(|part| part.add_media(ray, media));
        }
        if self.surrounds(ray, self.open_to_eyes) {
            // Whatever its parts are made of (measured in POV-Ray 3.7).
            media.enter(self.interior);
        }
    }

    /// True if an eye where the ray starts is in it, be it clipped away there or not if it is `open`.
    fn surrounds(&self, ray: &Ray, open: bool) -> bool {
        match &self.kind {
            // POV-Ray asks only objects in whose box the eye is, and the box of a disc is flat.
            NodeKind::Leaf(leaf) if !leaf.solid || matches!(leaf.shape(), Shape::Disc { .. }) => false,
            NodeKind::Group { join: Join::Union | Join::Merge, children, .. }
                if self.clips.is_empty() || open =>
            {
                children.iter().any(|child| child.surrounds(ray, false))
            }
            _ if open => self.unclipped(ray).is_inside_at_start(),
            _ => self.trail(ray).is_inside_at_start(),
        }
    }
}

/// Whether rays of this kind pass by.
fn is_hidden(flags: &Flags, kind: RayKind) -> bool {
    match kind {
        RayKind::Camera => flags.no_image,
        RayKind::Reflected => flags.no_reflection,
        RayKind::Shadow => flags.no_shadow,
    }
}

/// POV-Ray's default texture.
static DEFAULT_TEXTURE: LazyLock<Arc<Texture>> = LazyLock::new(Arc::default);

impl Near {
    fn new(around: &[Option<Around>], tally: &Tally) -> Self {
        let boxes: Vec<_> = around.iter().map(|around| around.as_ref().map(|around| around.bounds)).collect();
        let inside_out: Vec<_> =
            around.iter().map(|around| around.as_ref().is_some_and(|around| around.inside_out)).collect();
        let insides = inside_out.iter().filter(|&&inside_out| inside_out).count();
        Self { tree: BoxTree::new(&boxes, 1, tally), inside_out, insides }
    }

    /// The children that a line may meet, and how many of the others it is inside of, all the way.
    pub fn met_by(&self, ray: &Ray) -> (SmallVec<[u32; 16]>, usize) {
        let met = self.tree.met_by(ray.origin, ray.dir, Reach::Whole);
        let asked = met.iter().filter(|&&child| self.inside_out[child as usize]).count();
        (met, self.insides - asked)
    }
}

/// Hands out numbers for leaves and interiors while the tree is built.
#[derive(Default)]
struct Builder<'b> {
    leaves: usize,
    interiors: Vec<Arc<Interior>>,
    /// If lines shall be told what they pass by.
    sieve: Option<Sieve<'b>>,
}

/// What tells lines what they pass by.
struct Sieve<'b> {
    bounds: Bounds<'b>,
    tally: Tally,
    /// By their addresses, which stay theirs as long as the object is there.
    meshes: FxHashMap<*const Mesh, Arc<BoxTree>>,
}

/// What is known of a node from afar: a line that does not meet the box meets no surface, and is outside, or inside all the way.
struct Around {
    bounds: PartBox,
    inside_out: bool,
}

/// What a child has from its parent.
#[derive(Clone)]
struct Inherited {
    /// From the parent's inner space to the world.
    to_world: Transform,
    look: Look,
    inverted: bool,
    /// It or an ancestor was, be it back again.
    turned: bool,
    /// Interiors from here on are known to nobody else.
    own_interiors: bool,
    /// What the parent is to its children.
    within: Within,
    /// POV-Ray keeps the last of what it finds at one place, and all that intersects or merges takes what it finds in a part
    /// last first: false below an odd number of those.
    last_shows: bool,
}

/// What a part stands in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Within {
    /// The scene, or unions that are no more than their parts.
    Scene,
    /// A union that is one object.
    Union,
    /// A merge.
    Merge,
    /// Whatever cuts.
    Intersection,
}

impl Builder<'_> {
    fn top_level(&mut self, object: &Arc<Object>) -> Node {
        // Every object has an interior; one that is not given is of its own kind of air.
        let interior = match &object.interior {
            Some(interior) => self.interior(interior, false),
            None => self.fresh(&Arc::new(Interior::default())),
        };
        let look = Look { texture: None, interior_texture: None, interior, flags: Flags::default() };
        self.node(
            object,
            &Inherited {
                to_world: Transform::IDENTITY,
                look,
                inverted: false,
                turned: false,
                own_interiors: false,
                within: Within::Scene,
                last_shows: true,
            },
        )
        .0
    }

    fn node(&mut self, object: &Arc<Object>, parent: &Inherited) -> (Node, Option<Around>) {
        let place = |texture: &Arc<Texture>| PlacedTexture::new(texture, &parent.to_world);
        let look = Look {
            texture: object.texture.as_ref().map(place).or_else(|| parent.look.texture.clone()),
            interior_texture: object
                .interior_texture()
                .map(place)
                .or_else(|| parent.look.interior_texture.clone()),
            interior: object
                .interior
                .as_ref()
                .map_or(parent.look.interior, |interior| self.interior(interior, parent.own_interiors)),
            flags: inherit(parent.look.flags, object, parent.within),
        };
        let inverted = parent.inverted != object.flags.inverse;
        let turned = parent.turned || object.flags.is_turned();
        let split = parent.within == Within::Scene && object.is_split();
        let clipped = !object.clipped_by().is_empty();
        let to_world = object.transform.then(&parent.to_world);
        let (kind, around) = match &object.shape {
            Shape::Csg { op, children, .. } => {
                let (join, first_inverted, others_inverted) = join(*op, inverted, turned);
                let within = match join {
                    _ if split => Within::Scene,
                    Join::Union => Within::Union,
                    Join::Merge => Within::Merge,
                    Join::Intersection => Within::Intersection,
                };
                let reverses = join != Join::Union || clipped;
                let own_interiors = parent.own_interiors || object.own_interiors;
                let mut child = |(i, child): (usize, &Arc<Object>)| {
                    let inverted = if i == 0 { first_inverted } else { others_inverted };
                    let inherited = Inherited {
                        to_world,
                        look: look.clone(),
                        inverted,
                        turned: turned || (*op == CsgOp::Difference && i > 0),
                        own_interiors,
                        within,
                        last_shows: parent.last_shows != reverses,
                    };
                    self.node(child, &inherited)
                };
                let (children, around): (Vec<_>, Vec<_>) =
                    children.iter().enumerate().map(&mut child).unzip();
                let cuttable = if *op == CsgOp::Difference { 1 } else { children.len() };
                let near = self.sieve.as_ref().map(|sieve| Near::new(&around, &sieve.tally));
                let kind = NodeKind::Group { join, children, near, cuttable, last_shows: parent.last_shows };
                (kind, Around::all(join, &around))
            }
            _ => {
                let leaf = self.leaf(object, to_world, inverted, look.clone());
                let bounds = self.sieve.as_ref().and_then(|sieve| (sieve.bounds)(leaf.shape(), &to_world));
                let inside_out = leaf.inverted && leaf.solid;
                (NodeKind::Leaf(leaf), bounds.map(|bounds| Around { bounds, inside_out }))
            }
        };
        // Clips stand in the parent's space and are not turned inside out with the object.
        let outside =
            Inherited { inverted: false, turned: false, within: Within::Intersection, ..parent.clone() };
        let clips: Vec<_> = object.clipped_by().iter().map(|clip| self.node(clip, &outside).0).collect();
        // Where it is inside all the way, it is its clips that a line enters and leaves.
        let around = around.filter(|around| clips.is_empty() || !around.inside_out);
        // POV-Ray asks of an eye's surroundings only what is in the object's own box, which what clips it makes smaller
        // if the object has no end, and then only the object itself (measured).
        let open_to_eyes = clipped && !object.is_endless();
        (Node { kind, clips, interior: look.interior, split, open_to_eyes }, around)
    }

    fn leaf(&mut self, object: &Arc<Object>, to_world: Transform, inverted: bool, mut look: Look) -> Leaf {
        let shape = &object.shape;
        if inverted
            && matches!(shape, Shape::Polynomial(polynomial) if polynomial.exchanges_textures())
            && let (Some(outer), Some(inner)) = (&mut look.texture, &mut look.interior_texture)
        {
            std::mem::swap(outer, inner);
        }
        let id = self.leaves;
        self.leaves += 1;
        let m = to_world.forward.matrix3;
        let reach = shape::reach(shape);
        let reach = m.x_axis.abs() * reach.x
            + m.y_axis.abs() * reach.y
            + m.z_axis.abs() * reach.z
            + to_world.forward.translation.abs();
        Leaf {
            id,
            object: object.clone(),
            to_world,
            inverted: inverted && shape::turns(shape),
            solid: shape::is_solid(shape),
            reach: reach.max_element(),
            look,
            triangles: match (&mut self.sieve, shape) {
                (Some(sieve), Shape::Mesh(mesh)) => Some(sieve.triangles(mesh)),
                _ => None,
            },
        }
    }

    fn fresh(&mut self, interior: &Arc<Interior>) -> InteriorId {
        self.interiors.push(interior.clone());
        InteriorId(self.interiors.len() - 1)
    }

    fn interior(&mut self, interior: &Arc<Interior>, own: bool) -> InteriorId {
        if own {
            return self.fresh(&Arc::new(Interior::clone(interior)));
        }
        let known = self.interiors.iter().position(|known| Arc::ptr_eq(known, interior));
        known.map_or_else(|| self.fresh(interior), InteriorId)
    }
}

impl Sieve<'_> {
    fn triangles(&mut self, mesh: &Arc<Mesh>) -> Arc<BoxTree> {
        /// To ask four triangles costs about what it costs to tell them apart.
        const TRIANGLES_A_BOX: usize = 4;
        let around = |triangle: &MeshTriangle| {
            let [a, b, c] = triangle.vertices.map(|vertex| mesh.vertices[vertex as usize]);
            Some((a.min(b).min(c), a.max(b).max(c)))
        };
        let tree = || {
            let boxes: Vec<_> = mesh.triangles.iter().map(around).collect();
            Arc::new(BoxTree::new(&boxes, TRIANGLES_A_BOX, &self.tally))
        };
        self.meshes.entry(Arc::as_ptr(mesh)).or_insert_with(tree).clone()
    }
}

impl Around {
    /// What is known of a group, if something is of each of its children.
    fn all(join: Join, children: &[Option<Around>]) -> Option<Self> {
        let mut known = children.iter().flatten();
        let first = known.next().filter(|_| children.iter().all(Option::is_some))?.bounds;
        let bounds = known.fold(first, |a, b| (a.0.min(b.bounds.0), a.1.max(b.bounds.1)));
        let inside = children.iter().flatten().filter(|child| child.inside_out).count();
        Some(Self { bounds, inside_out: Children { join, inside, all: children.len() }.is_inside() })
    }
}

/// How a composite joins its children, and whether its first and its other children are inside out.
///
/// Turned inside out, a union becomes an intersection of its children turned inside out and back (De Morgan), so that
/// its inner surfaces are gone; this is POV-Ray's rule too. They stay gone where it is `turned` back again.
fn join(op: CsgOp, inverted: bool, turned: bool) -> (Join, bool, bool) {
    match (op, inverted) {
        (CsgOp::Union, false) if turned => (Join::Merge, false, false),
        (CsgOp::Union, false) => (Join::Union, false, false),
        (CsgOp::Merge, false) => (Join::Merge, false, false),
        (CsgOp::Union | CsgOp::Merge, true) => (Join::Intersection, true, true),
        (CsgOp::Intersection, false) => (Join::Intersection, false, false),
        (CsgOp::Intersection, true) => (Join::Merge, true, true),
        (CsgOp::Difference, false) => (Join::Intersection, false, true),
        (CsgOp::Difference, true) => (Join::Merge, true, false),
    }
}

/// A child's switches: its own and its ancestors'.
///
/// What hides an object from rays is asked of whole objects, some of it also of parts of merges and unions (measured in
/// POV-Ray 3.7).
fn inherit(parent: Flags, object: &Object, within: Within) -> Flags {
    let own = object.flags;
    let shadows = within == Within::Scene;
    let images = matches!(within, Within::Scene | Within::Merge);
    let reflections = within != Within::Intersection;
    Flags {
        no_shadow: parent.no_shadow || (shadows && object.throws_no_shadow()),
        no_image: parent.no_image || (images && own.no_image),
        no_reflection: parent.no_reflection || (reflections && own.no_reflection),
        hollow: parent.hollow || own.hollow,
        inverse: false,
        turned: false,
        double_illuminate: parent.double_illuminate || own.double_illuminate,
    }
}
