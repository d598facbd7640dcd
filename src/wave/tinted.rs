//! What see-through surfaces leave of light, where each lets through one colour wherever it is met: all that is asked of a way is what it
//! crosses, in which order.

use super::crossings::{Crossing, InTheWay, T_ROUNDINGS, Transparent, each_crossing};
use super::emit::NO_LIGHT;
use super::query::{Query, rounded, rounding_at, start_rounding};
use crate::compile::{Geometry, SurfaceId};
use crate::lane::{Lane, Mask, Scalar, Vec3, f32x8, f64x8};
use glam::DVec3;
use smallvec::SmallVec;

/// Lets `tint` of the light through that is left by `filter`, in some lanes: those where that leaves any.
#[inline(always)]
pub fn dim(filter: &mut Vec3<f32x8>, tint: Vec3<f32x8>, lanes: u8) -> u8 {
    let through = filter.mul(tint);
    let worth = through.abs().max_element().ge(f32x8::lit(NO_LIGHT));
    let left = through.map(|f| worth.keep(f));
    *filter = Vec3::select(Mask::from_bits(lanes), left, *filter);
    lanes & worth.bits()
}

/// What is left of the light of the rays `lanes` of `query` by a surface that lets through `tint` wherever it is crossed.
#[inline(always)]
pub fn tinted_by<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    (query, lanes): (&Query<S::Lane>, u8),
    surface: SurfaceId,
    tint: Vec3<f32x8>,
) -> Vec3<f32x8> {
    let (mut filter, mut after, mut live) = (Vec3::lit(1.0), query.t_min.in_register(), lanes);
    each_crossing(scene, query, surface, lanes, |t| {
        let crossed = t.gt(after) & t.lt(query.t) & Mask::from_bits(live);
        let hits = crossed.bits();
        if hits != 0 {
            live &= dim(&mut filter, tint, hits) | !hits;
            let point = query.rays.origin + query.rays.dir * t;
            after = crossed.select(t + start_rounding(&point), after);
        }
    });
    filter
}

/// Composites with more crossings than this are gone through ray by ray: looking for the nearest, again and again, takes the square of them.
const FEW_CROSSINGS: usize = 8;

/// What is left of the light of the rays `lanes` of `query` by composites in their `way`, each of whose surfaces lets through one colour: if
/// that is all they meet, each of them meets one, and there are few crossings. To the bit as [`super::crossings::Crossings::find`] and
/// [`tinted`] have it, which go ray by ray.
pub fn tinted_by_composites<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    (query, lanes): (&Query<S::Lane>, u8),
    way: &InTheWay,
    mut tint: impl FnMut(SurfaceId) -> Option<[f32; 3]>,
) -> Option<Vec3<f32x8>> {
    let mut once = 0;
    for &(thing, met) in way.things.iter().filter(|(_, met)| met & lanes != 0) {
        let Transparent::Composite { first, end } = thing else { return None };
        if met & lanes & once != 0 || (end - first) as usize > FEW_CROSSINGS {
            return None;
        }
        once |= met & lanes;
    }
    let mut filter = Vec3::lit(1.0);
    for &(thing, met) in &way.things {
        if let (Transparent::Composite { first, end }, true) = (thing, met & lanes != 0) {
            let mut crossings = SmallVec::<[Colored; FEW_CROSSINGS]>::new();
            for &(surface, t, crossed) in way.crossed(first, end) {
                let (rank, tint) = (scene.ranks.of(surface), tint(surface)?);
                crossings.push(Colored { rank, t, crossed, tint });
            }
            // Of surfaces at one place the first declared counts.
            crossings.sort_unstable_by_key(|crossing| crossing.rank);
            pass(&crossings, (query, met & lanes), &mut filter);
        }
    }
    Some(filter)
}

/// Where rays cross a surface that lets through one colour.
struct Colored {
    rank: u32,
    t: f64x8,
    /// Rays that cross it there.
    crossed: u8,
    tint: [f32; 3],
}

/// Dims the light of the rays `live` of `query` by a composite's crossings, which come by rank.
fn pass<L: Lane>(crossings: &[Colored], (query, mut live): (&Query<L>, u8), filter: &mut Vec3<f32x8>) {
    let inf = f64x8::lit(f64::INFINITY);
    let (mut beyond, mut after) = (-inf, query.t_min.in_register());
    loop {
        let (mut next, mut tint) = (inf, Vec3::lit(0.0));
        for crossing in crossings {
            let &Colored { t, crossed, .. } = crossing;
            let nearer = Mask::from_bits(crossed & live) & t.gt(beyond) & t.lt(next);
            next = nearer.select(t, next);
            tint = Vec3::select(nearer.cast(), Vec3::broadcast(crossing.tint), tint);
        }
        let found = next.lt(inf);
        if found.none() {
            return;
        }
        let t = L::from_f64s(next);
        let rounding = start_rounding(&(query.rays.origin + query.rays.dir * t));
        // What is at one place with the one before is passed over. (At the origin that has no width in single precision.)
        let apart = rounding.max(t * L::lit(T_ROUNDINGS * L::Scalar::UNIT_ROUNDOFF));
        beyond = found.select((t + apart).to_f64s().max(next), beyond);
        let counts = found.cast() & t.gt(after);
        live &= dim(filter, tint, counts.bits()) | !counts.bits();
        after = counts.select(t + rounding, after);
    }
}

/// What is left of the light along `line` behind all crossings beyond `after`, if each lets through one colour: to the bit as
/// [`tinted_by`] and [`Passage::cross`](super::filters) have it, so that it does not matter to a ray what its neighbours meet.
pub fn tinted<S: Scalar>(crossings: &[Crossing], line: (DVec3, DVec3), mut after: f64) -> Option<[f32; 3]> {
    let mut filter = [1.0f32; 3];
    for &Crossing { t, tint, .. } in crossings {
        if t <= after {
            continue;
        }
        let tint = tint?;
        filter = [0, 1, 2].map(|channel| filter[channel] * tint[channel]);
        if !filter.iter().any(|x| f64::from(x.abs()) >= NO_LIGHT) {
            return Some([0.0; 3]);
        }
        after = rounded::<S>(t + rounding_at::<S>(line, t));
    }
    Some(filter)
}

#[cfg(test)]
mod tests {
    use super::super::crossings::settle;
    use super::super::queue::Lines;
    use super::*;
    use crate::lane::{LANES, bits};
    use crate::random::Random;

    /// Ray by ray, of crossings in any order.
    fn one_by_one<S: Scalar>(crossings: &[Colored], query: &Query<S::Lane>, lane: usize) -> [f32; 3] {
        let here = crossings.iter().filter(|crossing| crossing.crossed >> lane & 1 == 1);
        let mut found: Vec<_> = here
            .map(|&Colored { rank, t, tint, .. }| {
                let (t, tint) = (t.lanes()[lane], Some(tint));
                Crossing { t, rank, surface: 0, tint }
            })
            .collect();
        found.sort_unstable_by(Crossing::order);
        let line = (query.rays.origin.lane(lane), query.rays.dir.lane(lane));
        settle::<S>(&mut found, 0, line);
        tinted::<S>(&found, line, query.t_min.lanes()[lane].to_f64()).unwrap_or([f32::NAN; 3])
    }

    /// Few crossings and many, apart, at one place, and nearly so; rays from anywhere and from the very origin.
    fn check<S: Scalar>() {
        let mut numbers = Random::new(5);
        let mut dimmed = 0;
        for round in 0..2000 {
            let mut lines = Lines::<S::Lane>::default();
            let size = if round % 8 == 0 { 0.0 } else { 3.0 };
            let mut vectors = |size: f64| std::array::from_fn::<_, LANES, _>(|_| numbers.vector(1.0) * size);
            let (origin, dir) = (vectors(size), vectors(1.0));
            (lines.rays.origin, lines.rays.dir) = (Vec3::from_fn(|k| origin[k]), Vec3::from_fn(|k| dir[k]));
            let mut query = Query::new(&lines, S::Lane::lit(100.0), !0);
            query.t_min = S::Lane::lit([0.0, 1e-3][round % 2]);
            let apart = [1.0, 1e-7, 1e-15, 0.0][round / 2 % 4];
            let mut crossings: Vec<_> = (0..1 + round % 6)
                .map(|k| {
                    let whole = [0.0, 1.0, 2.0, 1e-50][numbers.below(4)];
                    let t = f64x8::from_fn(|_| whole + apart * numbers.between(0.0, 1.0));
                    let crossed = numbers.below(256) as u8;
                    let tint = [(); 3].map(|()| [0.0, 0.25, 0.7, 1.0][numbers.below(4)]);
                    Colored { rank: k as u32, t, crossed, tint }
                })
                .collect();
            let mut filter = Vec3::lit(1.0);
            let lanes = numbers.below(256) as u8;
            pass(&crossings, (&query, lanes), &mut filter);
            crossings.reverse();
            for lane in bits(lanes) {
                let expected = one_by_one::<S>(&crossings, &query, lane);
                let found = [filter.x, filter.y, filter.z].map(|channel| channel.lanes()[lane]);
                assert_eq!(found, expected, "{round} {lane}");
                dimmed += u32::from(found != [1.0; 3]);
            }
        }
        assert!(dimmed > 2000, "{dimmed}");
    }

    #[test]
    fn eight_rays_are_dimmed_as_one_by_one() {
        check::<f32>();
        check::<f64>();
    }
}
