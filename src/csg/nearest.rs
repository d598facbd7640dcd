//! The nearest surface of a composite along the rays of two packets, and all of them.

use super::along::{Along, Place, TIE};
use super::asker::{Asker, by_packets, of_packet};
use super::best::Best;
use super::cull::{Near, PartCrossings, Span, Stretch};
use super::decide::Decided;
use super::scratch::{PartRoots, Scratch};
use super::{Composite, CsgTree, Plan, slice};
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, choose, f32x8, f64x8};

/// So many parts before it is asked, a part is fetched.
const AHEAD: usize = 4;

impl CsgTree {
    /// Puts the nearest surface of `composite` beyond two askers' `t_min` into their `best`, in the `lanes` that ask where it is nearer
    /// than what stands there; returns the lanes that changed. With `any`, a lane is done when it has changed
    /// once. The askers are packets `which` of those that `stretches` are kept of, once one has been asked for; the rays are of
    /// `classes`.
    #[inline(always)]
    pub fn nearest(
        &self,
        composite: &Composite,
        (askers, mut lanes): ([&Asker<impl PartRoots>; 2], [u8; 2]),
        (stretches, which): (&mut [Option<Stretch>], [usize; 2]),
        (any, classes): (bool, u8),
        scratch: &mut Scratch,
        best: &mut [Best; 2],
    ) -> [u8; 2] {
        for (k, lanes) in lanes.iter_mut().enumerate() {
            *lanes &= asked(composite, askers[k], &mut stretches[which[k]]);
        }
        let lanes = by_packets(|k| lanes[k]);
        let (looking, sketch) = ((askers, lanes, any), scratch.sketch.get_or_insert_default());
        let decided = match &composite.plan {
            Some(Plan::Few(plan)) => self.decide((composite, plan), looking, sketch, best),
            Some(Plan::Many(plan)) => self.decide_many((composite, plan), looking, sketch, best),
            None => Decided { changed: 0, doubt: lanes },
        };
        let mut changed = [0; 2];
        for (k, best) in best.iter_mut().enumerate() {
            let asker = (askers[k], &mut stretches[which[k]]);
            changed[k] = self.rest(composite, asker, (decided, k), (any, classes), scratch, best);
        }
        changed
    }

    /// Goes the way of all crossings for the lanes of packet `k` of which nothing is known: the lanes that have changed.
    #[inline(always)]
    fn rest(
        &self,
        composite: &Composite,
        (asker, stretch): (&Asker<impl PartRoots>, &mut Option<Stretch>),
        (decided, k): (Decided, usize),
        (any, classes): (bool, u8),
        scratch: &mut Scratch,
        best: &mut Best,
    ) -> u8 {
        let (changed, doubt) = (of_packet(decided.changed, k), of_packet(decided.doubt, k));
        if doubt == 0 {
            return changed;
        }
        let Asker { rays, source, t_min, all, .. } = asker;
        let stretch = stretch.get_or_insert_with(|| Stretch::new(rays, *all));
        if best.loose & doubt != 0 {
            best.settle(doubt, rays, source, scratch.room());
        }
        changed | self.walk(composite, (rays, stretch), (doubt, *t_min, any, classes), source, scratch, best)
    }

    /// The same by all crossings in double precision.
    #[inline(never)]
    fn walk(
        &self,
        composite: &Composite,
        (rays, stretch): (&Rays<f64x8>, &Stretch),
        (lanes, t_min, any, classes): (u8, f64x8, bool, u8),
        source: &impl PartRoots,
        scratch: &mut Scratch,
        best: &mut Best,
    ) -> u8 {
        let mut along = self.along(composite, rays, source, scratch);
        let Some((within, lanes)) = self.approach(&mut along, composite, stretch, (lanes, t_min, best.t))
        else {
            return 0;
        };
        along.sort(lanes);
        let mut changed = 0;
        let mut reach = f32x8::from_f64s(best.t);
        for k in 0..along.scratch.order.len() {
            if let Some(&(_, ahead)) = along.scratch.order.get(k + AHEAD) {
                source.prefetch(along.scratch.near[ahead as usize].number);
            }
            let place = along.scratch.order[k].1 as usize;
            let Near { number, span, .. } = along.scratch.near[place];
            let (enter, leave) = (span.enter.max(within.enter), span.leave.min(within.leave));
            let mut live = enter.le(leave.min(reach)).bits() & lanes;
            if any {
                live &= !changed;
            }
            let part = &self.parts[number as usize];
            if live == 0 || !part.seen || part.classes & classes == 0 {
                continue;
            }
            let PartCrossings { first, surface_end, .. } = along.crossed(place);
            for k in first..surface_end {
                let at = along.scratch.crossings[k as usize];
                let nearer = if any { at.lt(best.t) } else { at.le(best.t) };
                let mut wanted = (at.gt(t_min) & nearer).bits() & live;
                if any {
                    wanted &= !changed;
                }
                if wanted == 0 {
                    continue;
                }
                wanted = surface_between(&mut along, number, [enter, leave], (at, wanted));
                if any {
                    best.surface = choose(wanted, &[best.first_part + number; LANES], &best.surface);
                    changed |= wanted;
                    if changed == lanes {
                        return changed;
                    }
                    continue;
                }
                let taken = best.take(number, at, wanted);
                if taken != 0 {
                    reach = f32x8::from_f64s(best.t);
                    changed |= taken;
                }
            }
        }
        changed
    }

    /// Hands on all surfaces of `composite` before `t_max` where `lanes` of two askers look, in no order: which asker's, parts, distances and
    /// the lanes they hold for. Otherwise as [`CsgTree::nearest`].
    ///
    /// Asked for one by one, each but the first begins where the one before lies, which single precision does not tell apart: all of
    /// them would go the way of all crossings.
    #[inline(always)]
    pub fn surfaces(
        &self,
        composite: &Composite,
        (askers, mut lanes): ([&Asker<impl PartRoots>; 2], [u8; 2]),
        (stretches, which): (&mut [Option<Stretch>], [usize; 2]),
        (t_max, classes): ([f64x8; 2], u8),
        scratch: &mut Scratch,
        mut found: impl FnMut(usize, u32, f64x8, u8),
    ) {
        for (k, lanes) in lanes.iter_mut().enumerate() {
            *lanes &= asked(composite, askers[k], &mut stretches[which[k]]);
        }
        let looking = (askers, by_packets(|k| lanes[k]), t_max);
        let sketch = scratch.sketch.get_or_insert_default();
        let doubt = match &composite.plan {
            Some(Plan::Few(plan)) => self.decide_all((composite, plan), looking, sketch, &mut found),
            Some(Plan::Many(plan)) => self.decide_all((composite, plan), looking, sketch, &mut found),
            None => by_packets(|k| lanes[k]),
        };
        for (k, &Asker { rays, ref source, t_min, all }) in askers.into_iter().enumerate() {
            let doubt = of_packet(doubt, k);
            if doubt != 0 {
                let stretch = stretches[which[k]].get_or_insert_with(|| Stretch::new(rays, all));
                let looking = (doubt, [t_min, t_max[k]], classes);
                let found = |part, t, lanes| found(k, part, t, lanes);
                self.walk_all(composite, (rays, stretch), looking, source, scratch, found);
            }
        }
    }

    /// The same by all crossings in double precision.
    #[inline(never)]
    fn walk_all(
        &self,
        composite: &Composite,
        (rays, stretch): (&Rays<f64x8>, &Stretch),
        (lanes, [t_min, t_max], classes): (u8, [f64x8; 2], u8),
        source: &impl PartRoots,
        scratch: &mut Scratch,
        mut found: impl FnMut(u32, f64x8, u8),
    ) {
        let mut along = self.along(composite, rays, source, scratch);
        let Some((within, lanes)) = self.approach(&mut along, composite, stretch, (lanes, t_min, t_max))
        else {
            return;
        };
        for place in 0..along.scratch.near.len() {
            let Near { number, span, .. } = along.scratch.near[place];
            let (enter, leave) = (span.enter.max(within.enter), span.leave.min(within.leave));
            let live = enter.le(leave).bits() & lanes;
            let part = &self.parts[number as usize];
            if live == 0 || !part.seen || part.classes & classes == 0 {
                continue;
            }
            let PartCrossings { first, surface_end, .. } = along.crossed(place);
            for k in first..surface_end {
                let at = along.scratch.crossings[k as usize];
                let wanted = (at.gt(t_min) & at.lt(t_max)).bits() & live;
                if wanted != 0 {
                    let wanted = surface_between(&mut along, number, [enter, leave], (at, wanted));
                    if wanted != 0 {
                        found(number, at, wanted);
                    }
                }
            }
        }
    }

    /// Finds what is near of a composite between `t_min` and `t_max`: where all of that lies and the lanes in which there is any;
    /// none if there is nothing.
    #[inline(always)]
    fn approach<P: PartRoots>(
        &self,
        along: &mut Along<P>,
        composite: &Composite,
        stretch: &Stretch,
        (lanes, t_min, t_max): (u8, f64x8, f64x8),
    ) -> Option<(Span, u8)> {
        let mut lanes = lanes;
        let mut within = self.span(composite, stretch, Span::up_to(t_max), lanes)?;
        // What the whole lies within is crossed first: most rays that miss the whole miss that.
        for &number in slice(&self.required, &composite.required) {
            let behind;
            (within, behind) = along.narrowed(number, &within, t_min, stretch.slack());
            lanes &= within.lanes() & !behind;
            if lanes == 0 {
                return None;
            }
        }
        along.cull(stretch, &within, lanes).then_some((within, lanes))
    }

    /// Lanes whose rays start in the composite, as [`super::Surroundings`] have it.
    pub fn surrounds(
        &self,
        composite: &Composite,
        rays: &Rays<f64x8>,
        source: &impl PartRoots,
        scratch: &mut Scratch,
    ) -> u8 {
        let surroundings = &composite.surroundings;
        if surroundings.are_away_from(rays.origin) {
            return 0;
        }
        let line = Stretch::new(rays, !0);
        let mut along = self.along(composite, rays, source, scratch);
        let met = along.cull(&line, &Span::up_to(f64x8::lit(f64::INFINITY)), !0);
        if !met && surroundings.node == composite.root {
            return 0;
        }
        let start = along.place(f64x8::zero(), !0);
        along.is_within(surroundings.node, &start)
    }

    /// Adds to `found` the parts that the places at `t` (known to a share of `t_error`) along the rays lie in or on, with a bit
    /// for each lane that does: whose looks a cut face without one of its own shows (`cutaway_textures`).
    pub fn parts_at(
        &self,
        composite: &Composite,
        rays: &Rays<f64x8>,
        (lanes, t, t_error): (u8, f64x8, f64),
        source: &impl PartRoots,
        scratch: &mut Scratch,
        found: &mut Vec<(u32, u8)>,
    ) {
        let line = Stretch::new(rays, lanes);
        let mut along = self.along(composite, rays, source, scratch);
        if along.cull(&line, &Span::up_to(f64x8::lit(f64::INFINITY)), lanes) {
            along.tie = TIE + t_error;
            let at = along.place(t, lanes);
            along.collect_parts(composite.root, lanes, &at, found);
        }
    }
}

/// The lanes whose rays come to where a composite is asked for at all.
#[inline(always)]
fn asked<Q>(composite: &Composite, asker: &Asker<Q>, stretch: &mut Option<Stretch>) -> u8 {
    let Some([min, max]) = composite.asked_within else { return !0 };
    let stretch = stretch.get_or_insert_with(|| Stretch::new(asker.rays, asker.all));
    stretch.span(min, max, &Span::up_to(f64x8::lit(f64::INFINITY))).lanes()
}

/// Those of the `wanted` lanes in which the crossing of a part at `at` is a surface of the whole. Beyond the bounds of part or
/// whole, which leave what is between `enter` and `leave`, nothing is, and nothing is known of the other parts.
#[inline(always)]
fn surface_between<P: PartRoots>(
    along: &mut Along<P>,
    number: u32,
    [enter, leave]: [f32x8; 2],
    (at, wanted): (f64x8, u8),
) -> u8 {
    let place = along.place(at, wanted);
    let wanted = wanted & (enter.le(place.about) & place.about.le(leave)).bits();
    if wanted == 0 {
        return 0;
    }
    wanted & along.is_surface(number, &Place { lanes: wanted, ..place })
}
