//! Where rays meet surfaces, eight at a time.

use super::instances::resolve_instances;
use super::query::Query;
use super::queue::{Lines, put, put3};
use crate::compile::{Compiled, Geometry, INSTANCE, PART, SurfaceId, WithBlock};
use crate::kernel::{Block, Rays, Surfaces};
use crate::lane::{
    LANES, Lane, Mask, Scalar, Vec3, choose, each_lane, each_number, equal_lanes, f32x8, f64x8,
};

/// Eight hits with what the rays brought along.
#[derive(Debug, Clone, Copy, Default)]
pub struct Hit<L: Lane> {
    /// Lanes that hold one.
    pub active: u8,
    /// On the surface.
    pub point: Vec3<L>,
    /// Ray directions.
    pub dir: Vec3<L>,
    /// Unit normals on the ray's side.
    pub normal: Vec3<L>,
    /// Cosine between normal and ray, at least 0.
    pub cos: L,
    /// How far the ray has come.
    pub distance: L,
    /// See [`Carriers::throughput`](super::queue::Carriers::throughput); times the texture's share.
    pub throughput: Vec3<f32x8>,
    /// See [`Carriers::weight`](super::queue::Carriers::weight).
    pub weight: L,
    /// See [`Carriers::share`](super::queue::Carriers::share); times the texture's share.
    pub share: f32x8,
    /// See [`Carriers::sink`](super::queue::Carriers::sink).
    pub sink: [u32; LANES],
    /// See [`Carriers::level`](super::queue::Carriers::level).
    pub level: [u16; LANES],
    /// See [`Carriers::medium`](super::queue::Carriers::medium).
    pub medium: [u32; LANES],
    /// What is on the inside of the surface.
    pub interior: [u32; LANES],
    /// Lanes lit from both sides.
    pub double_illuminate: u8,
    /// Lanes whose surface is seen from where its normal points.
    pub outside: u8,
    /// What was hit.
    pub surface: [u32; LANES],
    /// The part of it.
    pub part: [u8; LANES],
    /// The texture seen; in lanes without a hit, that of one with.
    pub texture: [u32; LANES],
}

impl<L: Lane> Hit<L> {
    /// Lane `from` of `other` becomes lane `to`.
    pub fn put(&mut self, to: usize, other: &Self, from: usize) {
        put3(&mut self.point, to, &other.point, from);
        put3(&mut self.dir, to, &other.dir, from);
        put3(&mut self.normal, to, &other.normal, from);
        put(&mut self.cos, to, &other.cos, from);
        put(&mut self.distance, to, &other.distance, from);
        put3(&mut self.throughput, to, &other.throughput, from);
        put(&mut self.weight, to, &other.weight, from);
        put(&mut self.share, to, &other.share, from);
        self.sink[to] = other.sink[from];
        self.level[to] = other.level[from];
        self.medium[to] = other.medium[from];
        self.interior[to] = other.interior[from];
        let bit = |bits: u8, other: u8| bits & !(1 << to) | (other >> from & 1) << to;
        self.double_illuminate = bit(self.double_illuminate, other.double_illuminate);
        self.outside = bit(self.outside, other.outside);
        self.surface[to] = other.surface[from];
        self.part[to] = other.part[from];
        self.texture[to] = other.texture[from];
    }

    /// Where a mirror sends rays: directions of length 1, but for roundings.
    #[inline(always)]
    pub fn mirrored(&self) -> Vec3<L> {
        self.dir + self.normal * (self.cos * L::lit(2.0))
    }

    /// Lets rays leave the surface along `dir`.
    #[inline(always)]
    pub fn leave(&self, dir: &Vec3<L>, lines: &mut Lines<L>) {
        lines.rays.set(&self.point, dir);
        lines.left = self.surface;
        lines.part = self.part;
    }
}

/// Where eight rays meet the surfaces they hit, which is told to the query where it is not known well (see [`Query::loose`]).
#[inline]
pub fn resolve<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    query: &mut Query<S::Lane>,
) -> Surfaces<S::Lane> {
    let hits = query.hits();
    if hits == 0 {
        return Surfaces::default();
    }
    // Lanes without a hit repeat one with: nothing that they give is kept.
    let surfaces = query.met(hits);
    let kinds = each_number(&surfaces, |surface| scene.kind_of(surface));
    if kinds == [kinds[0]; LANES] {
        let rows = rows_of(scene, kinds[0], &surfaces);
        return resolve_kind(scene, query, kinds[0], &rows, hits);
    }
    // (One after the other in the place of the first: all that is known of eight hits is half a kilobyte.)
    let alike = |waiting: u8| {
        let kind = kinds[waiting.trailing_zeros() as usize & (LANES - 1)];
        let same = (0..LANES).fold(0, |same, k| same | u8::from(kinds[k] == kind) << k) & waiting;
        let first = surfaces[same.trailing_zeros() as usize & (LANES - 1)];
        (kind, same, rows_of(scene, kind, &choose(same, &surfaces, &[first; LANES])))
    };
    let (kind, same, rows) = alike(hits);
    let mut all = resolve_kind(scene, query, kind, &rows, same);
    let mut waiting = hits & !same;
    while waiting != 0 {
        let (kind, same, rows) = alike(waiting);
        waiting &= !same;
        let found = resolve_kind(scene, query, kind, &rows, same);
        all.put(&found, Mask::from_bits(same));
    }
    all
}

/// Rows of surfaces that are all of one kind.
#[inline(always)]
fn rows_of<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    kind: u8,
    surfaces: &[SurfaceId; LANES],
) -> [u32; LANES] {
    if kind == INSTANCE {
        return each_number(surfaces, |surface| scene.ranks.stretch(surface).unwrap_or(0) as u32);
    }
    if kind & PART == 0 {
        let base = scene.base[usize::from(kind)];
        return each_lane(|k| surfaces[k] - base);
    }
    each_number(surfaces, |surface| scene.csg.parts[(surface - scene.first_part) as usize].row)
}

/// Where rays meet surfaces of one kind.
#[inline]
fn resolve_kind<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    query: &mut Query<S::Lane>,
    kind: u8,
    rows: &[u32; LANES],
    lanes: u8,
) -> Surfaces<S::Lane> {
    if kind == INSTANCE {
        return resolve_instances(scene, query, rows, lanes);
    }
    if kind & PART == 0 {
        return scene.columns.with(kind, Resolve { rows, lanes, rays: &query.rays, t: &query.t });
    }
    let mut room = None;
    let (loose, t) = (query.loose & lanes, query.t.to_f64s());
    let kept = |t: f64x8| S::Lane::from_f64s(t).to_f64s();
    let part = ResolvePart { rows, loose, rays: query.rays.in_double(&mut room), t: &t, kept };
    let (t, found) = scene.parts.with(kind & !PART, part);
    if loose != 0 {
        query.t = Mask::from_bits(loose).select(S::Lane::from_f64s(t), query.t);
        query.loose &= !loose;
    }
    Surfaces {
        point: found.point.cast(),
        normal: found.normal.cast(),
        u: S::Lane::from_f64s(found.u),
        v: S::Lane::from_f64s(found.v),
        part: found.part,
    }
    .in_register()
}

/// The lanes that meet their surface from its inside.
pub fn seen_from_inside<S: Scalar, B: Scalar>(
    scene: &Compiled<S, B>,
    query: &Query<S::Lane>,
    found: &Surfaces<S::Lane>,
) -> u8 {
    let along = found.normal.dot(query.rays.dir).gt(S::Lane::zero()).bits();
    let hits = query.hits();
    (0..LANES).filter(|k| hits >> k & 1 == 1).fold(0, |inside, k| {
        let surface = query.surface[k];
        let inverse = || scene.owners[scene.geometry.owner_of(surface) as usize].inverse;
        let inverted = scene.geometry.is_inverted(surface).unwrap_or_else(inverse);
        inside | u8::from((along >> k & 1 == 1) != inverted) << k
    })
}

struct Resolve<'a, L> {
    rows: &'a [u32; LANES],
    lanes: u8,
    rays: &'a Rays<L>,
    t: &'a L,
}

impl<S: Scalar> WithBlock<S> for Resolve<'_, S::Lane> {
    type Output = Surfaces<S::Lane>;

    fn block<K: Block<S>>(self, block: &K) -> Surfaces<S::Lane> {
        block.resolve(self.rows, Mask::from_bits(self.lanes), self.rays, self.t.in_register()).in_register()
    }
}

/// The same of parts of composites, where lanes may be `loose`; and where they meet them, as it is `kept`.
struct ResolvePart<'a, K> {
    rows: &'a [u32; LANES],
    loose: u8,
    rays: &'a Rays<f64x8>,
    t: &'a f64x8,
    kept: K,
}

impl<K: Fn(f64x8) -> f64x8> WithBlock<f64> for ResolvePart<'_, K> {
    type Output = (f64x8, Surfaces<f64x8>);

    fn block<B: Block<f64>>(self, block: &B) -> (f64x8, Surfaces<f64x8>) {
        let Self { rows, loose, rays, t, kept } = self;
        let (t, found) = block.resolve_next_to(rows, Mask::from_bits(loose), rays, t.in_register(), kept);
        (t.in_register(), found.in_register())
    }
}

/// What is known of eight hits by what owns the surface; lanes without a hit repeat one with.
pub struct Looks {
    /// By number.
    pub owner: [u32; LANES],
    /// What is on the inside of the surface.
    pub interior: [u32; LANES],
    /// The texture seen, unless it is cut or blends.
    pub texture: [u32; LANES],
    /// Lanes that are lit from both sides.
    pub double_illuminate: u8,
    /// Lanes on cut faces without a look of their own.
    pub cuts: u8,
    /// Lanes on triangles that blend the textures of their corners.
    pub blends: u8,
}

impl Looks {
    /// Those of the `hits` of a packet, which were `found` there.
    pub fn of<S: Scalar, B: Scalar>(
        scene: &Compiled<S, B>,
        query: &Query<S::Lane>,
        found: &Surfaces<S::Lane>,
        hits: u8,
    ) -> Self {
        let surfaces = query.met(hits);
        let owner = each_number(&surfaces, |surface| scene.geometry.owner_of(surface));
        let first = &scene.owners[owner[0] as usize];
        let mut looks = Self {
            owner,
            interior: [first.interior; LANES],
            texture: [first.textures[0]; LANES],
            double_illuminate: 0,
            cuts: 0,
            blends: 0,
        };
        let mut waiting = !0u8;
        while waiting != 0 {
            let first = owner[waiting.trailing_zeros() as usize & (LANES - 1)];
            let same = equal_lanes(&owner, first);
            waiting &= !same;
            let owner = &scene.owners[first as usize];
            // Mostly all lanes have the first one's.
            if same != !0 {
                looks.interior = choose(same, &[owner.interior; LANES], &looks.interior);
                looks.texture = choose(same, &[owner.textures[0]; LANES], &looks.texture);
            }
            let all = |yes: bool| if yes { same } else { 0 };
            looks.double_illuminate |= all(owner.double_illuminate);
            let mut inside = 0;
            if let Some(texture) = owner.interior_texture {
                inside = same & seen_from_inside(scene, query, found);
                looks.texture = choose(inside, &[texture; LANES], &looks.texture);
            }
            looks.cuts |= all(owner.cut) & hits & !inside;
            looks.blends |= all(owner.textures != [owner.textures[0]; 3]) & hits & !inside;
        }
        looks
    }
}
