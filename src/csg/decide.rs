//! Which crossing of which part is the nearest surface of a composite: decided in single precision where that is beyond
//! doubt, and only that crossing computed in double.
//!
//! Every part that rays may meet is bracketed ([`Bracket`]), and every crossing held against the parts that have a say in it
//! ([`super::plan::Clause`]). Lanes in which anything is near to anything else are left to the walk along all crossings.

use super::best::Best;
use super::bracket::{Bracket, least, most};
use super::capsule::Beam;
use super::plan::{Clause, MOST_PARTS, Plan};
use super::scratch::{PartRoots, Scratch, Sketch};
use super::{Composite, CsgTree};
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Mask, Vec3, choose, f32x8, f64x8};
use std::ops::Range;

/// What came of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Decided {
    /// Lanes whose best has changed.
    pub changed: u8,
    /// Lanes of which nothing is known.
    pub doubt: u8,
}

/// Eight rays from their points nearest to the middle of a composite.
struct FootRays {
    rays: Rays<f32x8>,
    /// How far those points are from the starts.
    shift: f64x8,
    /// What crossings may be off by.
    pad: f32x8,
}

/// A crossing by its bracket: between two distances.
#[derive(Clone, Copy)]
struct Between(f32x8, f32x8);

impl Between {
    fn meets(self, from: f32x8, to: f32x8) -> Mask<f32x8> {
        self.1.ge(from) & self.0.le(to)
    }
}

impl Bracket {
    /// Where rays come in and where they go out; all along where they may miss it.
    #[inline(always)]
    fn ends(&self) -> [Between; 2] {
        let ([a, d], [b, c]) = (self.outer, self.inner);
        [Between(a, least(b, d)), Between(most(c, a), d)]
    }

    /// Lanes in which a crossing is surely within, and in which it may be.
    #[inline(always)]
    fn holds(&self, at: Between) -> [Mask<f32x8>; 2] {
        let ([a, d], [b, c]) = (self.outer, self.inner);
        [b.le(at.0) & at.1.le(c), at.meets(a, d)]
    }

    /// Lanes that meet the grown body.
    #[inline(always)]
    fn is_met(&self) -> Mask<f32x8> {
        self.outer[0].le(self.outer[1])
    }
}

/// The bits of a word.
#[inline(always)]
fn bits(mut word: u64) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let bit = word.trailing_zeros();
        (word != 0).then(|| {
            word &= word - 1;
            bit
        })
    })
}

impl Sketch {
    #[inline(always)]
    fn of(&self, part: u32) -> &Bracket {
        &self.brackets[part as usize & (MOST_PARTS - 1)]
    }
}

impl CsgTree {
    /// As [`CsgTree::nearest`], in the lanes where it can be told in single precision.
    #[inline(always)]
    pub(super) fn decide(
        &self,
        (composite, plan): (&Composite, &Plan),
        rays: &Rays<f64x8>,
        (lanes, t_min, any): (u8, f64x8, bool),
        source: &impl PartRoots,
        scratch: &mut Scratch,
        best: &mut Best,
    ) -> Decided {
        let first = composite.parts.start;
        let from = rays.origin - Vec3::splat(plan.middle);
        let shift = -from.dot(rays.dir);
        let foot = (from + rays.dir * shift).cast::<f32x8>();
        let pad = f32x8::splat(plan.pad);
        let lines = FootRays { rays: Rays { origin: foot, dir: rays.dir.cast() }, shift, pad };
        let steady = shift.abs().le(f64x8::lit(plan.farthest));
        let mut doubt = lanes & !steady.bits();
        let mut live = lanes & !doubt;

        // What is left of the rays: in the ball around all, between start and end, in what the whole lies within.
        let start = f32x8::from_f64s(t_min - shift);
        let end = f32x8::from_f64s(best.t - shift);
        let chord = (f32x8::splat(plan.square) - foot.fused_dot(foot)).sqrt(); // NaN outside
        let mut low = most(start - pad, -chord);
        let mut high = least(end + pad, chord);
        live &= low.le(high).bits();
        if live == 0 {
            return Decided { changed: 0, doubt };
        }
        let sketch = &mut scratch.sketch;
        sketch.near = plan.required;
        sketch.crossings.clear();
        sketch.asked.clear();
        let (starts, beyond) = (source.starts(), start + pad);
        let on = |part: u32| if starts { source.on(first + part) } else { 0 };
        // The crossing that rays start on lies between these two.
        let reach = f32x8::from_f64s(-shift - t_min) - pad;
        for part in bits(plan.required) {
            let reached = |[enter, leave]: [f32x8; 2]| {
                (low, high) = (most(low, enter), least(high, leave));
                live &= low.le(high).bits();
                live != 0
            };
            if !self.bracket((first, part), (rays, &lines), source, sketch, reached) {
                return Decided { changed: 0, doubt };
            }
            let on = on(part) & live;
            if on != 0 {
                // Whoever leaves it here has left the whole.
                let [enters, leaves] = sketch.of(part).ends().map(|end| end.meets(reach, beyond).bits());
                live &= !(on & leaves & !enters);
                if live == 0 {
                    return Decided { changed: 0, doubt };
                }
            }
        }
        let mut waiting = plan.others;
        if !plan.capsules.is_empty() {
            waiting &= self.passed_close(plan, &lines, live);
        }
        for part in bits(waiting) {
            if let Some([x, y, z, square]) = self.rules[(first + part) as usize].ball {
                let toward = Vec3::<f32x8>::broadcast([x, y, z]) - foot;
                let ahead = toward.fused_dot(lines.rays.dir);
                let across = toward.fused_dot(toward) - ahead * ahead;
                if across.le(f32x8::splat(square)).bits() & live == 0 {
                    continue;
                }
            }
            // NaN comes last, and stays.
            let reached =
                |[enter, leave]: [f32x8; 2]| most(low, enter).le(least(high, leave)).bits() & live != 0;
            if self.bracket((first, part), (rays, &lines), source, sketch, reached) {
                sketch.near |= 1 << part;
            }
        }

        let inf = f32x8::lit(f64::INFINITY);
        let before_end = end - pad;
        let (mut nearest, mut which, mut doubtful) = (Between(inf, inf), f32x8::zero(), inf);
        let mut changed = 0;
        for part in bits(sketch.near & plan.seen) {
            let rule = &self.rules[(first + part) as usize];
            if rule.all.within & !sketch.near != 0 {
                continue;
            }
            let bracket = sketch.of(part);
            let ends = bracket.ends();
            let mut away = [!0; 2];
            let on = on(part) & live;
            if on != 0 {
                // The crossing where they start is none, if it is clear which that is.
                let [enters, leaves] = ends.map(|end| end.meets(reach, beyond).bits());
                let unclear = on & !(enters ^ leaves);
                doubt |= unclear;
                live &= !unclear;
                away = [!(on & enters), !(on & leaves)];
            }
            let (met, sharp) = (bracket.is_met(), bracket.inner[0].le(bracket.inner[1]));
            for k in 0..2 {
                let (end, away) = (ends[k], away[k]);
                let wanted = met & end.meets(low, least(high, nearest.1)) & Mask::from_bits(live & away);
                if wanted.none() {
                    continue;
                }
                let (sure, maybe) = self.is_surface(&rule.all, rule.clauses.clone(), sketch, end, wanted);
                let mut sure = sure & sharp & beyond.lt(end.0);
                if any {
                    sure &= end.1.lt(before_end);
                }
                let vague = maybe & !sure;
                doubtful = vague.select(least(doubtful, end.0), doubtful);
                if any {
                    let blocked = sure.bits();
                    best.surface = choose(blocked, &[best.first_part + first + part; LANES], &best.surface);
                    changed |= blocked;
                    live &= !blocked;
                    if live == 0 {
                        return Decided { changed, doubt };
                    }
                    continue;
                }
                let closer = sure & end.1.lt(nearest.0);
                let level = sure & !closer & end.0.le(nearest.1);
                doubtful = level.select(least(doubtful, least(end.0, nearest.0)), doubtful);
                nearest.0 = closer.select(end.0, nearest.0);
                nearest.1 = closer.select(end.1, nearest.1);
                which = closer.select(f32x8::lit(f64::from(part)), which);
            }
        }
        let unsure = (doubtful.lt(inf) & doubtful.le(nearest.1)).bits() & live;
        doubt |= unsure;
        let mut found = nearest.1.lt(inf).bits() & live & !unsure;
        while found != 0 {
            let part = which.lanes()[found.trailing_zeros() as usize & (LANES - 1)];
            let these = which.equal(f32x8::splat(part)).bits() & found;
            found &= !these;
            let number = first + part as u32;
            let t = self.crossing(number, rays, nearest, &lines, source, sketch);
            let known = t.equal(t).bits();
            doubt |= these & !known;
            let wanted = (t.gt(t_min) & t.le(best.t)).bits() & these & known;
            changed |= best.take(number, t, wanted);
        }
        Decided { changed, doubt }
    }

    /// A bit for each part that the rays of `live` may meet, and for some that are none.
    #[inline(always)]
    fn passed_close(&self, plan: &Plan, lines: &FootRays, live: u8) -> u64 {
        let beam = Beam::new(&lines.rays, live, plan.size);
        let blocks = &self.capsules[plan.capsules.start as usize..plan.capsules.end as usize];
        let met = |(block, capsules)| u64::from(beam.meets(capsules)) << (block * LANES);
        blocks.iter().enumerate().map(met).fold(0, |near, these| near | these)
    }

    /// Brackets a part, if after a look at the grown body `go_on` says so.
    #[inline(always)]
    fn bracket(
        &self,
        (first, part): (u32, u32),
        (rays, lines): (&Rays<f64x8>, &FootRays),
        source: &impl PartRoots,
        sketch: &mut Sketch,
        go_on: impl FnOnce([f32x8; 2]) -> bool,
    ) -> bool {
        let Sketch { crossings, asked, brackets, .. } = sketch;
        let ask = || {
            let start = crossings.len();
            source.crossings(first + part, rays, crossings);
            asked.push((first + part, start..crossings.len()));
            Bracket::of_crossings(&crossings[start..], lines.shift, lines.pad)
        };
        let place = &mut brackets[part as usize & (MOST_PARTS - 1)];
        self.rules[(first + part) as usize].body.bracket(&lines.rays, place, ask, go_on)
    }

    /// Lanes in which a crossing is surely a surface, and in which it may be.
    #[inline(always)]
    fn is_surface(
        &self,
        all: &Clause,
        clauses: Range<u32>,
        sketch: &Sketch,
        at: Between,
        wanted: Mask<f32x8>,
    ) -> (Mask<f32x8>, Mask<f32x8>) {
        let (mut sure, mut maybe) = (wanted, wanted);
        for part in bits(all.without & sketch.near) {
            let [surely, perhaps] = sketch.of(part).holds(at);
            (sure, maybe) = (sure & !perhaps, maybe & !surely);
        }
        for part in bits(all.within) {
            let [surely, perhaps] = sketch.of(part).holds(at);
            (sure, maybe) = (sure & surely, maybe & perhaps);
        }
        for clause in &self.clauses[clauses.start as usize..clauses.end as usize] {
            if maybe.none() {
                break;
            }
            if clause.without & !sketch.near != 0 {
                continue;
            }
            let (mut surely, mut perhaps) = (Mask::none_set(), Mask::none_set());
            for part in bits(clause.within & sketch.near) {
                let [within, touching] = sketch.of(part).holds(at);
                (surely, perhaps) = (surely | within, perhaps | touching);
            }
            for part in bits(clause.without) {
                let [within, touching] = sketch.of(part).holds(at);
                (surely, perhaps) = (surely | !touching, perhaps | !within);
            }
            (sure, maybe) = (sure & surely, maybe & perhaps);
        }
        (sure, maybe)
    }

    /// A part's crossing that is bracketed, in double precision; NaN where there is none.
    #[inline(always)]
    fn crossing(
        &self,
        number: u32,
        rays: &Rays<f64x8>,
        at: Between,
        lines: &FootRays,
        source: &impl PartRoots,
        sketch: &mut Sketch,
    ) -> f64x8 {
        let Sketch { crossings, asked, .. } = sketch;
        let known = asked.iter().find(|(other, _)| *other == number).map(|(_, range)| range.clone());
        let range = known.unwrap_or_else(|| {
            let start = crossings.len();
            source.crossings(number, rays, crossings);
            start..crossings.len()
        });
        let mut t = f64x8::lit(f64::NAN);
        for &crossing in &crossings[range] {
            let here = f32x8::from_f64s(crossing - lines.shift);
            let between = here.ge(at.0 - lines.pad) & here.le(at.1 + lines.pad);
            t = between.cast().select(crossing, t);
        }
        t
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_crossed_four_times_is_in_doubt_from_first_to_last() {
        let crossings = [1.0, 2.0, 4.0, 8.0].map(f64x8::lit);
        let bracket = Bracket::of_crossings(&crossings, f64x8::zero(), f32x8::lit(1e-6));
        let at = |t: f64| Between(f32x8::lit(t), f32x8::lit(t));
        for t in [1.0, 2.0, 3.0, 4.0, 6.0, 8.0] {
            assert!(bracket.ends().iter().all(|end| end.meets(f32x8::lit(t), f32x8::lit(t)).all()), "{t}");
            let [surely, perhaps] = bracket.holds(at(t));
            assert!(surely.none() && perhaps.all(), "{t}");
        }
        let [_, perhaps] = bracket.holds(at(9.0));
        assert!(perhaps.none() && bracket.is_met().all());
    }

    #[test]
    fn what_is_missed_holds_nothing() {
        let none = [f64x8::lit(f64::NAN); 2];
        let bracket = Bracket::of_crossings(&none, f64x8::zero(), f32x8::lit(1e-6));
        let at = Between(f32x8::zero(), f32x8::zero());
        let [surely, perhaps] = bracket.holds(at);
        assert!(surely.none() && perhaps.none() && bracket.is_met().none());
    }
}
