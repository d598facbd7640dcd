//! Composites taken apart: their parts in columns, and expressions over these.

use super::looks::LooksOfMeshes;
use super::shapes::{given_bounds, is_flat, push, push_mesh};
use super::{Columns, Kind, Look, Tag, WithBlock, class, turn_ranks};
use crate::csg::{Constraint, CsgNode, CsgTree, NodeKind, Part};
use crate::kernel::{Aabb, Ball, Block, HalfSpace, Solid, bounds_of};
use crate::scene::{CsgOp, Flags, Mesh, Object, Shape, Transform};
use std::ops::Range;
use std::sync::Arc;

/// Composites of a scene, in its own order.
#[derive(Default)]
pub(super) struct Composites {
    /// Their parts, always in double precision.
    pub parts: Columns<f64>,
    /// What these make up.
    pub csg: CsgTree,
    /// By part.
    pub part_tags: Vec<Tag>,
    /// By composite.
    pub tags: Vec<Tag>,
}

/// Where a composite stands.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stand<'a> {
    /// From its own space to the world,
    pub place: &'a Transform,
    /// from its parent's,
    pub above: &'a Transform,
    /// and from the world to the space of the columns.
    pub to_compiled: &'a Transform,
    /// It is an object of its own, which decides what is seen of surfaces at one place.
    pub alone: bool,
    /// What an eye in it is in.
    pub interior: u32,
}

/// What a composite is made of, as far as a place for it hangs on that.
#[derive(Debug)]
pub(super) struct Extents {
    /// Around all its surfaces.
    pub bounds: Aabb,
    /// Around those of each part.
    pub parts: Vec<Aabb>,
    /// Looks that its parts have,
    pub looks: u32,
    /// and ranks that its surfaces take.
    pub ranks: u32,
}

/// Whether a node is inside out.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Turned {
    pub inverted: bool,
    /// It or an ancestor was, be it back again: a union is a merge then.
    ever: bool,
}

impl Turned {
    /// What it is for a node with `flags`.
    pub fn by(self, flags: Flags) -> Self {
        Self { inverted: self.inverted != flags.inverse, ever: self.ever || flags.is_turned() }
    }

    /// What child number `k` has of it where children are joined by `op`.
    pub fn over(self, op: CsgOp, k: usize) -> Self {
        let inverts = op == CsgOp::Difference && k > 0;
        Self { inverted: self.inverted != inverts, ever: self.ever || inverts }
    }
}

/// How children are joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Join {
    Any,
    Merged,
    All,
}

impl Join {
    /// Turned inside out, a union becomes an intersection of its children turned inside out, and back (De Morgan), as in
    /// POV-Ray, where it comes back as a merge.
    pub fn of(op: CsgOp, turned: Turned) -> Self {
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

impl Composites {
    /// Adds `object`, whose parts have these `looks`: one each, of a mesh one for each of its own, in the order in which the object has
    /// them. Surfaces take ranks after `rank`.
    pub fn push(
        &mut self,
        object: &Object,
        stand: Stand,
        (looks, meshes): (&[Look], &mut LooksOfMeshes),
        rank: &mut u32,
    ) {
        let before = *rank;
        let (first, first_node) = (self.csg.parts.len() as u32, self.csg.nodes.len() as u32);
        let mut apart =
            Apart { all: self, to_compiled: stand.to_compiled, looks: 0, meshes, tags: Vec::new(), rank };
        let whole = apart.unclipped(object, stand.place, Turned::default());
        let (root, bounds) = apart.clipped(whole, object, stand.above);
        let look = |tag: &Tag| looks[tag.owner as usize].ranked(tag.rank);
        let mut tags: Vec<Tag> = apart.tags.iter().map(look).collect();
        // An eye is in what is in its own box, which what clips it makes smaller only if it has no end; then what clips it is
        // not asked (measured in POV-Ray 3.7).
        let (around, around_bounds) = if object.is_endless() { (root, bounds) } else { whole };
        if stand.alone {
            turn_ranks(&mut tags, before, *rank);
        }
        self.constrain(root, &mut Vec::new());
        let parts = &mut self.csg.parts[first as usize..];
        // What only clips is seen by no ray.
        let seen = tags.iter().zip(&*parts).filter(|(_, part)| part.seen);
        let class = class::of_whole(seen.map(|(tag, _)| tag.class));
        for (part, tag) in parts.iter_mut().zip(&tags) {
            // Those that throw a shadow are met by all that ask for one.
            let shadows = class::BLOCKS | class::FILTERS;
            part.classes = if tag.class & shadows == 0 { tag.class } else { tag.class | shadows };
        }
        // A disc's bounds hold its surface, but not the half space that is its inside.
        let has_disc = parts.iter().any(|part| part.kind == Kind::Disc as u8);
        let reach = if has_disc { Aabb::INFINITE } else { bounds };
        let bounds = match bounds.is_finite() {
            true => bounds,
            false => bounds.intersection(given_bounds::<f64>(object, &stand.above.then(stand.to_compiled))),
        };
        let around = (around, around_bounds, stand.interior);
        self.csg.push_composite(first, first_node, root, (bounds, reach), around);
        let tag = tags.first().copied().unwrap_or(Tag { owner: 0, rank: *rank, class: 0 });
        self.tags.push(Tag { class, ..tag });
        self.part_tags.extend(tags);
    }

    /// Decides how its composites are asked, when all are there.
    pub fn plan(&mut self) {
        let Self { parts, csg, .. } = self;
        csg.plan(|part| parts.with(part.kind, SolidOf(part.row as usize)));
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

impl Extents {
    /// Those of `object` in its own space, without what clips it.
    pub fn of(object: &Object, meshes: &mut LooksOfMeshes) -> Self {
        let (mut all, mut ranks) = (Composites::default(), 0);
        let mut apart = Apart {
            all: &mut all,
            to_compiled: &Transform::IDENTITY,
            looks: 0,
            meshes,
            tags: Vec::new(),
            rank: &mut ranks,
        };
        let (_, bounds) = apart.unclipped(object, &Transform::IDENTITY, Turned::default());
        let looks = apart.looks;
        let parts = all.csg.parts.iter().map(|part| part.bounds.intersection(bounds));
        Self { bounds, parts: parts.collect(), looks, ranks }
    }
}

/// What is simple among nodes that are intersected.
#[derive(Default)]
struct Simple {
    half_spaces: Vec<HalfSpace>,
    /// Rows of what may be quadrics.
    quadrics: Vec<usize>,
    balls: Vec<Ball>,
}

impl Simple {
    /// So many balls are held against each other and against planes: what they share is small then.
    const MOST_BALLS: usize = 8;

    /// What of `bounds` is in domes and lenses that the balls make with planes and with each other.
    fn balls_within(&self, mut bounds: Aabb) -> Aabb {
        let balls = &self.balls[..self.balls.len().min(Self::MOST_BALLS)];
        for (k, ball) in balls.iter().enumerate() {
            for plane in &self.half_spaces {
                bounds = bounds.intersection(ball.bounds_behind(plane));
            }
            for other in &balls[..k] {
                bounds = bounds.intersection(ball.bounds_with(other));
            }
        }
        bounds
    }
}

/// A composite as it is taken apart.
struct Apart<'a> {
    all: &'a mut Composites,
    to_compiled: &'a Transform,
    /// How many its parts have so far.
    looks: u32,
    meshes: &'a mut LooksOfMeshes,
    /// Of its parts, whose owners are the numbers of their looks.
    tags: Vec<Tag>,
    /// The last that was given.
    rank: &'a mut u32,
}

impl Apart<'_> {
    /// Adds `object` to the expressions: the number of its node, and a box around its surfaces. Only parts are ever inverted,
    /// see [`Join::of`].
    fn node(&mut self, object: &Object, above: &Transform, turned: Turned) -> (u32, Aabb) {
        let whole = self.unclipped(object, &object.transform.then(above), turned);
        self.clipped(whole, object, above)
    }

    /// The same without what clips it, in its `place`.
    fn unclipped(&mut self, object: &Object, place: &Transform, turned: Turned) -> (u32, Aabb) {
        let turned = turned.by(object.flags);
        let (kind, mut bounds) = match &object.shape {
            Shape::Csg { op, children, .. } => self.joined(object, (*op, children), place, turned),
            Shape::Mesh(mesh) => self.mesh(mesh, place, turned.inverted),
            shape => match self.primitive(shape, place, turned.inverted) {
                None => (NodeKind::Any(0..0), Aabb::EMPTY),
                Some(part) => return part,
            },
        };
        let number = self.push_node(kind);
        // What has no inside is nowhere inside, also when turned inside out.
        if let (Shape::Mesh(mesh), true) = (&object.shape, turned.inverted)
            && mesh.inside_vector.is_some()
        {
            self.all.csg.nodes[number as usize].inverted = true;
            bounds = Aabb::INFINITE;
        }
        if let Shape::Csg { op: CsgOp::Difference, .. } = &object.shape {
            self.all.csg.nodes[number as usize].cuttable = 1;
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
        (op, children): (CsgOp, &[Arc<Object>]),
        place: &Transform,
        turned: Turned,
    ) -> (NodeKind, Aabb) {
        let join = Join::of(op, turned);
        let turns = join != Join::Any || !object.clipped_by().is_empty();
        let mut bounds: Option<Aabb> = None;
        let mut numbers = Vec::with_capacity(children.len());
        for (k, child) in children.iter().enumerate() {
            let (first, before) = (self.tags.len(), *self.rank);
            let (number, b) = self.node(child, place, turned.over(op, k));
            if turns {
                turn_ranks(&mut self.tags[first..], before, *self.rank);
            }
            let together = |a: Aabb| if join == Join::All { a.intersection(b) } else { a.union(b) };
            bounds = Some(bounds.map_or(b, together));
            numbers.push(number);
        }
        if join == Join::All {
            bounds = bounds.map(|bounds| self.within_all(&numbers, bounds));
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
    fn mesh(&mut self, mesh: &Arc<Mesh>, place: &Transform, inverted: bool) -> (NodeKind, Aabb) {
        let of = self.meshes.of(mesh);
        let first_look = self.looks;
        self.looks += of.count() as u32;
        let first_rank = *self.rank + 1;
        *self.rank += mesh.triangles.len() as u32;
        let place = place.then(self.to_compiled);
        let (mut rows, mut numbers, mut bounds) = (Vec::new(), Vec::new(), Aabb::EMPTY);
        for (kind, triangles) in push_mesh(&mut self.all.parts, mesh, &place, false) {
            let first = self.all.parts.len(kind) - triangles.len();
            rows.extend(triangles.iter().enumerate().map(|(k, &triangle)| (triangle, kind, first + k)));
        }
        rows.sort_unstable();
        for (triangle, kind, row) in rows {
            bounds = bounds.union(self.all.parts.bounds(kind, row));
            numbers.push(self.part(kind, row, (mesh.inside_vector.is_some(), inverted)));
            let owner = first_look + of.of_triangle(triangle);
            self.tags.push(Tag { owner, rank: first_rank + triangle, class: 0 });
        }
        (NodeKind::Odd(self.list(&numbers)), bounds)
    }

    /// Any other shape: its node, and a box around its surface; `None` for shapes that are not rendered.
    fn primitive(&mut self, shape: &Shape, place: &Transform, inverted: bool) -> Option<(u32, Aabb)> {
        let look = self.looks;
        self.looks += 1;
        *self.rank += 1;
        let kind = push(&mut self.all.parts, shape, &place.then(self.to_compiled))?;
        let row = self.all.parts.len(kind) - 1;
        let bounds = self.all.parts.bounds(kind, row);
        let solid = !is_flat(shape);
        let inverted = inverted && solid;
        let number = self.part(kind, row, (solid, inverted));
        self.tags.push(Tag { owner: look, rank: *self.rank, class: 0 });
        self.all.csg.nodes[number as usize].inverted = inverted;
        // A part turned inside out bounds nothing, but its surface is where it was.
        Some((number, if inverted { Aabb::INFINITE } else { bounds }))
    }

    /// What `object` leaves of its own node where it is `clipped_by` others.
    fn clipped(
        &mut self,
        (node, mut bounds): (u32, Aabb),
        object: &Object,
        above: &Transform,
    ) -> (u32, Aabb) {
        if object.clipped_by().is_empty() {
            return (node, bounds);
        }
        let mut numbers = vec![node];
        for clip in object.clipped_by() {
            let first = self.all.csg.parts.len();
            let (clip, b) = self.node(clip, above, Turned::default());
            for part in &mut self.all.csg.parts[first..] {
                part.seen = false;
            }
            bounds = bounds.intersection(b);
            numbers.push(clip);
        }
        bounds = self.within_all(&numbers, bounds);
        let list = self.list(&numbers);
        let number = self.push_node(NodeKind::All(list));
        self.all.csg.nodes[number as usize].cuttable = 1;
        (number, bounds)
    }

    /// What is left of `bounds` of something that lies in all of `nodes`: by the domes and lenses of balls among these and, where it has
    /// no end yet, by planes and quadrics.
    fn within_all(&self, nodes: &[u32], bounds: Aabb) -> Aabb {
        if bounds.is_empty() {
            return bounds;
        }
        let mut simple = Simple::default();
        self.simple(nodes, &mut simple);
        let bounds = simple.balls_within(bounds);
        if bounds.is_finite() || bounds.is_empty() {
            return bounds;
        }
        let mut half_spaces: Vec<_> = HalfSpace::of_box(bounds).chain(simple.half_spaces).collect();
        for row in simple.quadrics {
            let more = self.all.parts.polynomials.half_spaces(row, &half_spaces);
            half_spaces.extend(more);
        }
        bounds.intersection(bounds_of(&half_spaces))
    }

    /// Adds what is simple among nodes that are intersected.
    fn simple(&self, nodes: &[u32], simple: &mut Simple) {
        let Composites { csg, parts, .. } = &*self.all;
        for &number in nodes {
            let node = &csg.nodes[number as usize];
            match &node.kind {
                NodeKind::All(list) if !node.inverted => self.simple(csg.list(list), simple),
                NodeKind::Part(part) => {
                    let Part { kind, row, .. } = csg.parts[*part as usize];
                    let row = row as usize;
                    if kind == Kind::Polynomial as u8 && !node.inverted {
                        simple.quadrics.push(row);
                        continue;
                    }
                    match parts.with(kind, SolidOf(row)) {
                        Some(Solid::HalfSpace { normal, foot }) => {
                            let normal = if node.inverted { -normal } else { normal };
                            simple.half_spaces.push(HalfSpace { normal, at: normal.dot(foot) });
                        }
                        Some(Solid::Ball { center, radius }) if !node.inverted => {
                            simple.balls.push(Ball { center, radius });
                        }
                        _ => {}
                    }
                }
                _ => {}
            }
        }
    }

    fn part(&mut self, kind: Kind, row: usize, (solid, inverted): (bool, bool)) -> u32 {
        let Composites { csg, parts, .. } = &mut *self.all;
        let number = csg.parts.len() as u32;
        let whole_skin = parts.with(kind as u8, SolidOf(row)).is_some();
        csg.parts.push(Part {
            kind: kind as u8,
            row: row as u32,
            node: csg.nodes.len() as u32,
            solid,
            partial_skin: kind == Kind::Torus && !whole_skin,
            whole_skin,
            inverted,
            // The boundary of a disc is its whole plane.
            bounds: if kind == Kind::Disc { Aabb::INFINITE } else { parts.bounds(kind, row) },
            closed: !matches!(kind, Kind::Triangle | Kind::SmoothTriangle | Kind::Polygon),
            seen: true,
            classes: !0,
            constraints: 0..0,
            composite: csg.composites.len() as u32,
        });
        self.push_node(NodeKind::Part(number))
    }

    fn push_node(&mut self, kind: NodeKind) -> u32 {
        let nodes = &mut self.all.csg.nodes;
        nodes.push(CsgNode { kind, inverted: false, cuttable: usize::MAX });
        nodes.len() as u32 - 1
    }

    fn list(&mut self, numbers: &[u32]) -> Range<u32> {
        let lists = &mut self.all.csg.lists;
        let first = lists.len() as u32;
        lists.extend_from_slice(numbers);
        first..lists.len() as u32
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
