//! The scene, resolved for tracing: which surface a ray meets first, what that shows, and what a ray starts in.

use super::build;
use super::interior::Media;
use super::node::{Join, Near, Node, NodeKind, PlacedTexture};
use super::ray::{Ray, RayKind};
use super::trail::{Crossing, Face};
use crate::scene::{Flags, Interior, Scene, Shape, Texture, Transform};
use glam::DVec3;
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
    /// What interiors' numbers ([`InteriorId`](super::interior::InteriorId)) stand for.
    pub interiors: Vec<Arc<Interior>>,
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
        let (nodes, interiors) = build::all(&scene.objects);
        let default_texture =
            PlacedTexture { texture: DEFAULT_TEXTURE.clone(), from_world: Transform::IDENTITY };
        Self { scene, nodes, default_texture, interiors }
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
                near.ahead_of(ray).into_iter().flat_map(|part| parts[part as usize].separate(ray)).collect()
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
