//! From a scene's objects to the nodes of a world.
//!
//! In comes an [`Object`]; out goes a tree of [`Node`]s in which nothing is inherited any more, `inverse` stands only at leaves, and
//! difference has become intersection.

use super::box_tree::{BoxTree, PartBox, Tally};
use super::interior::InteriorId;
use super::node::{Join, Leaf, Look, Near, Node, NodeKind, PlacedTexture};
use super::shape;
use super::trail::Children;
use crate::scene::{CsgOp, Flags, Interior, Mesh, MeshTriangle, Object, Shape, Texture, Transform};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// These objects, resolved, and what the [`InteriorId`]s in them stand for.
pub fn all(objects: &[Arc<Object>]) -> (Vec<Node>, Vec<Arc<Interior>>) {
    let mut builder = Builder::default();
    let nodes = objects.iter().map(|object| builder.top_level(object)).collect();
    (nodes, builder.interiors)
}

/// One object, resolved by itself, and what lines pass by in it: all that `bounds` tells a box of, in the world. What is in a
/// shape that has one must be in its box, too. `tally` counts what is asked.
pub fn alone(object: &Arc<Object>, bounds: Bounds, tally: &Tally) -> Node {
    let sieve = Sieve { bounds, tally: tally.clone(), meshes: FxHashMap::default() };
    Builder { sieve: Some(sieve), ..Builder::default() }.top_level(object)
}

/// Tells the box of a shape in the space that its transform leads to.
pub type Bounds<'b> = &'b dyn Fn(&Shape, &Transform) -> Option<PartBox>;

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
                let near = self.sieve.as_ref().map(|sieve| Around::near(&around, &sieve.tally));
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
    /// What lines pass by in a group.
    fn near(children: &[Option<Self>], tally: &Tally) -> Near {
        let boxes: Vec<_> = children.iter().map(|child| child.as_ref().map(|child| child.bounds)).collect();
        let is_inside_out = |child: &Option<Self>| child.as_ref().is_some_and(|child| child.inside_out);
        Near::new(&boxes, children.iter().map(is_inside_out).collect(), tally)
    }

    /// What is known of a group, if something is of each of its children.
    fn all(join: Join, children: &[Option<Self>]) -> Option<Self> {
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
