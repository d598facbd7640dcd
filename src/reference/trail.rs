//! Constructive geometry along a line: where it enters and leaves each object (Roth, Ray Casting for Modeling Solids, 1982).
//!
//! A node of the world and a ray come in; the node's [`Trail`] goes out: all crossings of the whole line in order, each
//! with the state after it. Inside and outside are told by counting crossings from `t = -∞`, never by asking whether a
//! rounded point lies in a shape; so faces that coincide do not speckle.

use super::node::{Join, Leaf, Node, NodeKind};
use super::ray::Ray;
use super::shape::{self, Line, Root};
use crate::scene::Shape;
use glam::DVec3;
use smallvec::{SmallVec, smallvec};

/// Rounding in the position of a meeting, in units of the largest coordinate that enters it.
///
/// A dozen roundings lie between the ray and a meeting (two transforms and the kernel); POV-Ray has 1e-4 to 1e-3 scene units.
const POSITION_ERROR: f64 = 16.0 * f64::EPSILON;

/// A line's passage through one object.
pub struct Trail<'w> {
    /// The state at `t = -∞`.
    pub starts_inside: bool,
    /// In rising order of `t`; those of one object's parts that tie are one.
    pub crossings: SmallVec<[Crossing<'w>; 2]>,
}

/// One place where something changes or something is seen.
#[derive(Clone)]
pub struct Crossing<'w> {
    /// Along the ray.
    pub t: f64,
    /// Bound on the error of `t`: crossings nearer together than their slacks tie.
    pub slack: f64,
    /// Whether the line is inside after it.
    pub inside_after: bool,
    /// What is seen, if anything.
    pub face: Option<Face<'w>>,
    /// The ray started here.
    pub left: bool,
}

/// A place on a leaf's surface.
#[derive(Clone, Copy)]
pub struct Face<'w> {
    /// Whose surface.
    pub leaf: &'w Leaf,
    /// Which part of it.
    pub part: usize,
    /// The point in the leaf's space, on the surface.
    pub local: DVec3,
    /// The same in the world.
    pub point: DVec3,
    /// Unit normal to shade with, outward: away from the inside, also when inverted.
    pub shading: DVec3,
    /// Shares of a triangle's corners.
    pub corners: [f64; 3],
}

impl Crossing<'_> {
    /// True if the ray meets it: not behind, and not where the ray starts.
    pub fn is_ahead(&self) -> bool {
        !self.left && self.t > self.slack
    }
}

impl Trail<'_> {
    /// The state just before the first crossing ahead.
    pub fn is_inside_at_start(&self) -> bool {
        self.crossings
            .iter()
            .take_while(|c| !c.is_ahead())
            .last()
            .map_or(self.starts_inside, |c| c.inside_after)
    }

    /// The states just before and just after the crossing at `t`, or the state there if there is none.
    pub fn sides_at(&self, t: f64, slack: f64) -> [bool; 2] {
        let mut before = self.starts_inside;
        for crossing in &self.crossings {
            if (crossing.t - t).abs() <= crossing.slack + slack {
                return [before, crossing.inside_after];
            }
            if crossing.t > t {
                break;
            }
            before = crossing.inside_after;
        }
        [before; 2]
    }
}

impl Node {
    /// The passage of `ray`'s whole line through this object.
    pub fn trail<'w>(&'w self, ray: &Ray) -> Trail<'w> {
        if self.clips.is_empty() {
            return self.unclipped(ray);
        }
        let mut parts = Parts::new(Join::Intersection, false);
        parts.add(self.unclipped(ray));
        for clip in &self.clips {
            let mut clip = clip.trail(ray);
            clip.crossings.iter_mut().for_each(|crossing| crossing.face = None);
            parts.add(clip);
        }
        parts.combine()
    }

    /// The same as if nothing clipped it.
    pub fn unclipped<'w>(&'w self, ray: &Ray) -> Trail<'w> {
        match &self.kind {
            NodeKind::Leaf(leaf) => leaf.trail(ray),
            NodeKind::Group { join, children, near, last_shows, .. } => {
                let mut parts = Parts::new(*join, *last_shows);
                match near {
                    None => children.iter().for_each(|child| parts.add(child.trail(ray))),
                    Some(near) => {
                        let (met, inside) = near.met_by(ray);
                        parts.pass_by(children.len() - met.len(), inside);
                        met.iter().for_each(|&child| parts.add(children[child as usize].trail(ray)));
                    }
                }
                parts.combine()
            }
        }
    }
}

impl Leaf {
    fn trail<'w>(&'w self, ray: &Ray) -> Trail<'w> {
        let departure = ray.left.filter(|departure| departure.leaf == self.id);
        let from_world = self.to_world.inverted();
        let line = Line {
            origin: departure.map_or_else(|| from_world.point(ray.origin), |departure| departure.local),
            dir: from_world.vector(ray.dir),
            left: departure.map(|departure| departure.part),
        };
        let roots = match (self.shape(), &self.triangles) {
            (Shape::Mesh(mesh), Some(triangles)) => shape::cross_near(mesh, &line, triangles),
            (shape, _) => shape::cross(shape, &line),
        };
        let mut inside = roots.starts_inside != (self.inverted && self.solid);
        let starts_inside = inside;
        let mut crossing = |root: &Root| {
            inside ^= root.toggles;
            let face = root.visible.then(|| self.face(root));
            Crossing { t: root.t, slack: self.slack(root, ray), inside_after: inside, face, left: root.left }
        };
        Trail { starts_inside, crossings: roots.list.iter().map(&mut crossing).collect() }
    }

    fn face<'w>(&'w self, root: &Root) -> Face<'w> {
        let outward = self.to_world.normal(root.smooth.unwrap_or(root.normal)).normalize();
        // The front of a triangle by itself goes by the order of its corners in the world: a mirror turns it, where it
        // does not turn a mesh's (measured in POV-Ray 3.7).
        let mirrored = matches!(self.shape(), Shape::Triangle { normals: None, .. })
            && self.to_world.forward.matrix3.determinant() < 0.0;
        let shading = if self.inverted != mirrored { -outward } else { outward };
        let point = self.to_world.point(root.point);
        Face { leaf: self, part: root.part, local: root.point, point, shading, corners: root.corners }
    }

    /// How far `t` may be off: the error in position, seen along the ray. Near a tangent the surface bends away first,
    /// and the error ends at the root of the relative one.
    fn slack(&self, root: &Root, ray: &Ray) -> f64 {
        let largest = ray.origin.abs().max_element().max(root.t.abs()).max(self.reach);
        let cosine = self.to_world.normal(root.normal).normalize().dot(ray.dir).abs();
        POSITION_ERROR * largest / cosine.max(POSITION_ERROR.sqrt())
    }
}

/// The trails of an object's children.
struct Parts<'w> {
    state: Children,
    /// Of faces at one place.
    last_shows: bool,
    cursors: Vec<Cursor<'w>>,
}

impl<'w> Parts<'w> {
    fn new(join: Join, last_shows: bool) -> Self {
        Self { state: Children { join, inside: 0, all: 0 }, last_shows, cursors: Vec::new() }
    }

    fn add(&mut self, trail: Trail<'w>) {
        self.state.inside += usize::from(trail.starts_inside);
        self.state.all += 1;
        // Children that the line never crosses only have a state.
        if !trail.crossings.is_empty() {
            let rest = trail.crossings.into_iter().peekable();
            self.cursors.push(Cursor { inside: trail.starts_inside, rest });
        }
    }

    /// Counts children whose surfaces the line does not meet: it is inside of so many of them, all the way.
    fn pass_by(&mut self, children: usize, inside: usize) {
        self.state.inside += inside;
        self.state.all += children;
    }

    /// Joins the trails.
    ///
    /// Crossings that tie are taken together, at most one from each child, and only the states before and after all of them
    /// count.
    fn combine(self) -> Trail<'w> {
        let Self { mut state, last_shows, mut cursors } = self;
        let starts_inside = state.is_inside();
        let mut crossings = smallvec![];
        while let Some((t, slack)) = next(&mut cursors) {
            // The first ties with itself even where it has no distance: a radius of 1e160 has no finite square.
            let ties = |crossing: &Crossing| {
                crossing.t.total_cmp(&t).is_eq() || (crossing.t - t).abs() <= crossing.slack + slack
            };
            let tied: Vec<(bool, Crossing)> = cursors
                .iter_mut()
                .filter_map(|cursor| {
                    let crossing = cursor.rest.next_if(ties)?;
                    let before = std::mem::replace(&mut cursor.inside, crossing.inside_after);
                    Some((before, crossing))
                })
                .collect();
            let before = state;
            for (was_inside, crossing) in &tied {
                state.inside = state.inside + usize::from(crossing.inside_after) - usize::from(*was_inside);
            }
            let shows = |(was_inside, crossing): &&(bool, Crossing)| {
                crossing.face.is_some() && counts(&before, &state, *was_inside, crossing.inside_after)
            };
            let seen = if last_shows { tied.iter().rfind(shows) } else { tied.iter().find(shows) };
            let left = tied.iter().any(|(_, crossing)| crossing.left);
            let t = if left { 0.0 } else { seen.map_or(t, |(_, crossing)| crossing.t) };
            let face = seen.and_then(|(_, crossing)| crossing.face);
            crossings.push(Crossing { t, slack, inside_after: state.is_inside(), face, left });
        }
        Trail { starts_inside, crossings }
    }
}

/// A child on the way along the line.
struct Cursor<'w> {
    inside: bool,
    rest: std::iter::Peekable<smallvec::IntoIter<[Crossing<'w>; 2]>>,
}

/// Place and slack of the first crossing not yet passed.
fn next(cursors: &mut [Cursor]) -> Option<(f64, f64)> {
    let heads = cursors
        .iter_mut()
        .filter_map(|cursor| cursor.rest.peek().map(|crossing| (crossing.t, crossing.slack)));
    heads.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// How many of a group's children the line is in.
#[derive(Clone, Copy)]
pub struct Children {
    /// How they are joined.
    pub join: Join,
    /// Those that it is in.
    pub inside: usize,
    /// All there are.
    pub all: usize,
}

impl Children {
    /// Whether it is in the group then.
    pub fn is_inside(&self) -> bool {
        match self.join {
            Join::Union | Join::Merge => self.inside > 0,
            Join::Intersection => self.inside == self.all,
        }
    }

    /// True if the surface of one child shows as far as the others are concerned, that child's own state being `own`.
    fn others_show(&self, own: bool) -> bool {
        let others = self.inside - usize::from(own);
        match self.join {
            Join::Union => true,
            Join::Merge => others == 0,
            Join::Intersection => others == self.all - 1,
        }
    }
}

/// Whether a child's surface shows where the group's state goes from `before` to `after` and the child's own from
/// `own_before` to `own_after`.
///
/// A surface of a solid shows where the group's value changes, an inner surface of a child where it shows for all others. If
/// others change at the same place, the surface of something without inside (a triangle, say) shows if it does on either side.
fn counts(before: &Children, after: &Children, own_before: bool, own_after: bool) -> bool {
    let sides = [before.others_show(own_before), after.others_show(own_after)];
    let others_change = before.inside - usize::from(own_before) != after.inside - usize::from(own_after);
    let wanted = before.join == Join::Intersection;
    if before.join == Join::Union || !others_change {
        sides[0]
    } else if own_before != own_after || own_before == wanted {
        before.is_inside() != after.is_inside()
    } else {
        sides[0] || sides[1]
    }
}
