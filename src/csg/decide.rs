//! Which crossing of which part is the nearest surface of a composite: decided in single precision where that is beyond
//! doubt, and only that crossing computed in double.
//!
//! Every part that rays may meet is bracketed ([`Bracket`]), and every crossing held against the parts that have a say in it
//! ([`super::plan::Clause`]). Lanes in which anything is near to anything else are left to the walk along all crossings.

use super::best::Best;
use super::bracket::{Bracket, least, most};
use super::capsule::Beam;
use super::parts::{Many, PartSet};
use super::plan::{Decision, MOST_PARTS, Rule, Rules};
use super::scratch::{PartRoots, Scratch, Sketch};
use super::{Composite, CsgTree, NodeKind, Side, slice};
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Mask, Vec3, choose, f32x8, f64x8};

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

impl Sketch {
    #[inline(always)]
    fn of(&self, part: u32) -> &Bracket {
        &self.brackets[part as usize & (MOST_PARTS - 1)]
    }
}

/// What is asked of a composite, whose parts are numbered from `first` on.
struct Question<'a, P, Q> {
    first: u32,
    plan: &'a Decision<P>,
    rules: &'a Rules<P>,
    rays: &'a Rays<f64x8>,
    lines: &'a FootRays,
    any: bool,
    source: &'a Q,
    /// Rays start on some of its parts.
    starts: bool,
}

impl<P: PartSet, Q: PartRoots> Question<'_, P, Q> {
    /// Lanes that start on a part.
    #[inline(always)]
    fn on(&self, part: u32) -> u8 {
        if self.starts { self.source.on(self.first + part) } else { 0 }
    }
}

/// What of eight rays is still looked at, in distances from their feet.
struct Window {
    low: f32x8,
    high: f32x8,
    /// Where the crossing that rays start on lies.
    own: Between,
    /// What is surely before the end.
    before_end: f32x8,
    /// Lanes that look.
    live: u8,
    /// Lanes of which nothing can be told.
    doubt: u8,
}

impl Window {
    /// In the ball around all parts, between start and end.
    #[inline(always)]
    fn new<P>(plan: &Decision<P>, lines: &FootRays, (lanes, t_min, t_max): (u8, f64x8, f64x8)) -> Self {
        let FootRays { rays, shift, pad } = lines;
        let steady = shift.abs().le(f64x8::lit(plan.farthest));
        let start = f32x8::from_f64s(t_min - *shift);
        let end = f32x8::from_f64s(t_max - *shift);
        let chord = (f32x8::splat(plan.square) - rays.origin.fused_dot(rays.origin)).sqrt(); // NaN outside
        let (low, high) = (most(start - *pad, -chord), least(end + *pad, chord));
        let doubt = lanes & !steady.bits();
        Self {
            low,
            high,
            own: Between(f32x8::from_f64s(-*shift - t_min) - *pad, start + *pad),
            before_end: end - *pad,
            live: lanes & !doubt & low.le(high).bits(),
            doubt,
        }
    }

    /// Looks no farther than what a part lies between: whether anything is left.
    #[inline(always)]
    fn narrow(&mut self, [enter, leave]: [f32x8; 2]) -> bool {
        (self.low, self.high) = (most(self.low, enter), least(self.high, leave));
        self.live &= self.low.le(self.high).bits();
        self.live != 0
    }

    /// True if any ray looks at what a part lies between. (NaN comes last, and stays.)
    #[inline(always)]
    fn shows(&self, [enter, leave]: [f32x8; 2]) -> bool {
        most(self.low, enter).le(least(self.high, leave)).bits() & self.live != 0
    }

    /// Lanes in which the way in, and lanes in which the way out of a part may be the crossing that they start on.
    #[inline(always)]
    fn own_ends(&self, ends: [Between; 2]) -> [u8; 2] {
        ends.map(|end| end.meets(self.own.0, self.own.1).bits())
    }

    #[inline(always)]
    fn decided(&self, changed: u8) -> Decided {
        Decided { changed, doubt: self.doubt }
    }
}

/// The nearest surface so far.
struct Nearest {
    at: Between,
    /// The part it belongs to.
    which: f32x8,
    /// From here on something may be a surface, or nearer, that is not known to be.
    doubtful: f32x8,
    /// Lanes that have met anything, if that is all they ask.
    blocked: u8,
}

impl Nearest {
    /// In `lanes` nothing beyond `from` is known to be the nearest.
    #[inline(always)]
    fn doubt_from(&mut self, from: f32x8, lanes: Mask<f32x8>) {
        self.doubtful = lanes.select(least(self.doubtful, from), self.doubtful);
    }

    /// Takes a crossing of `part` where it is `sure` to be a surface.
    #[inline(always)]
    fn take(&mut self, end: Between, part: u32, sure: Mask<f32x8>) {
        let closer = sure & end.1.lt(self.at.0);
        let level = sure & !closer & end.0.le(self.at.1);
        self.doubt_from(least(end.0, self.at.0), level);
        self.at.0 = closer.select(end.0, self.at.0);
        self.at.1 = closer.select(end.1, self.at.1);
        self.which = closer.select(f32x8::lit(f64::from(part)), self.which);
    }
}

impl CsgTree {
    /// As [`CsgTree::nearest`], in the lanes where it can be told in single precision.
    #[inline(always)]
    pub(super) fn decide<P: PartSet>(
        &self,
        (composite, plan): (&Composite, &Decision<P>),
        rays: &Rays<f64x8>,
        (lanes, t_min, any): (u8, f64x8, bool),
        source: &impl PartRoots,
        scratch: &mut Scratch,
        best: &mut Best,
    ) -> Decided {
        let from = rays.origin - Vec3::splat(plan.middle);
        let shift = -from.fused_dot(rays.dir);
        let foot = rays.dir.fused(shift, from).cast::<f32x8>();
        let pad = f32x8::splat(plan.pad);
        let lines = FootRays { rays: Rays { origin: foot, dir: rays.dir.cast() }, shift, pad };
        let mut window = Window::new(plan, &lines, (lanes, t_min, best.t));
        if window.live == 0 {
            return window.decided(0);
        }
        let (first, starts) = (composite.parts.start, source.starts());
        let question =
            Question { first, plan, rules: P::rules(self), rays, lines: &lines, any, source, starts };
        let sketch = &mut scratch.sketch;
        sketch.crossings.clear();
        sketch.asked.clear();
        if !self.bracket_required(&question, sketch, &mut window) {
            return window.decided(0);
        }
        let near = plan.required | self.bracket_others(&question, sketch, &window);
        let nearest = self.nearest_bracketed(&question, (sketch, near), &mut window, best);
        if window.live == 0 {
            return window.decided(nearest.blocked);
        }
        let known = nearest.at.1.lt(f32x8::lit(f64::INFINITY));
        let unsure =
            (nearest.doubtful.lt(f32x8::lit(f64::INFINITY)) & nearest.doubtful.le(nearest.at.1)).bits();
        window.doubt |= unsure & window.live;
        let (mut found, mut changed) = (known.bits() & window.live & !unsure, nearest.blocked);
        while found != 0 {
            let part = nearest.which.lanes()[found.trailing_zeros() as usize & (LANES - 1)];
            let these = nearest.which.equal(f32x8::splat(part)).bits() & found;
            found &= !these;
            let number = first + part as u32;
            let t = self.crossing(number, &question, nearest.at, sketch);
            let known = t.equal(t).bits();
            window.doubt |= these & !known;
            let wanted = (t.gt(t_min) & t.le(best.t)).bits() & these & known;
            changed |= best.take(number, t, wanted);
        }
        window.decided(changed)
    }

    /// The same of many parts, by itself: few composites have so many, and this is large.
    #[inline(never)]
    pub(super) fn decide_many(
        &self,
        plan: (&Composite, &Decision<Many>),
        rays: &Rays<f64x8>,
        looking: (u8, f64x8, bool),
        source: &impl PartRoots,
        scratch: &mut Scratch,
        best: &mut Best,
    ) -> Decided {
        self.decide(plan, rays, looking, source, scratch, best)
    }

    /// Brackets the parts that all of the composite lies within: whether any ray still looks then.
    #[inline(always)]
    fn bracket_required<P: PartSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        sketch: &mut Sketch,
        window: &mut Window,
    ) -> bool {
        for part in question.plan.required.each() {
            if !self.bracket(part, question, sketch, |between| window.narrow(between)) {
                return false;
            }
            let on = question.on(part) & window.live;
            if on != 0 {
                // Whoever leaves it here has left the whole.
                let [enters, leaves] = window.own_ends(sketch.of(part).ends());
                window.live &= !(on & leaves & !enters);
                if window.live == 0 {
                    return false;
                }
            }
        }
        true
    }

    /// Brackets the other parts that rays may meet, and says which these are.
    #[inline(always)]
    fn bracket_others<P: PartSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        sketch: &mut Sketch,
        window: &Window,
    ) -> P {
        let &Question { plan, rules, lines, .. } = question;
        let mut waiting = plan.others;
        if !plan.capsules.is_empty() {
            waiting = waiting & self.passed_close(plan, lines, window.live);
        }
        let mut near = P::default();
        for these in [waiting & !plan.dependent, waiting & plan.dependent] {
            for part in these.each() {
                let rule = rules.of(plan, part);
                if !rule.mates.is_within(near | plan.required) {
                    continue;
                }
                if let Some([x, y, z, square]) = rule.ball {
                    let toward = Vec3::<f32x8>::broadcast([x, y, z]) - lines.rays.origin;
                    let ahead = toward.fused_dot(lines.rays.dir);
                    let across = toward.fused_dot(toward) - ahead * ahead;
                    if across.le(f32x8::splat(square)).bits() & window.live == 0 {
                        continue;
                    }
                }
                if self.bracket(part, question, sketch, |between| window.shows(between)) {
                    near = near | P::of(part);
                }
            }
        }
        near
    }

    /// The nearest of what has been bracketed that is a surface. With `any`, lanes are blocked in `best` as soon as they have met one,
    /// and look no more.
    #[inline(always)]
    fn nearest_bracketed<P: PartSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        (sketch, near): (&Sketch, P),
        window: &mut Window,
        best: &mut Best,
    ) -> Nearest {
        let &Question { first, plan, rules, any, .. } = question;
        let inf = f32x8::lit(f64::INFINITY);
        let mut nearest = Nearest { at: Between(inf, inf), which: f32x8::zero(), doubtful: inf, blocked: 0 };
        for part in (near & plan.seen).each() {
            let rule = rules.of(plan, part);
            if !rule.all.within.is_within(near) {
                continue;
            }
            let bracket = sketch.of(part);
            let ends = bracket.ends();
            let mut away = [!0; 2];
            let on = question.on(part) & window.live;
            if on != 0 {
                // The crossing where they start is none, if it is clear which that is.
                let [enters, leaves] = window.own_ends(ends);
                let unclear = on & !(enters ^ leaves);
                window.doubt |= unclear;
                window.live &= !unclear;
                away = [!(on & enters), !(on & leaves)];
            }
            let (met, sharp) = (bracket.is_met(), bracket.inner[0].le(bracket.inner[1]));
            // (Counted, as an iterator of two such pairs is written to memory first.)
            for k in 0..2 {
                let (end, away) = (ends[k], away[k]);
                let ahead = end.meets(window.low, least(window.high, nearest.at.1));
                let wanted = met & ahead & Mask::from_bits(window.live & away);
                if wanted.none() {
                    continue;
                }
                let (sure, maybe) = self.is_surface(question, rule, (sketch, near), end, wanted);
                let mut sure = sure & sharp & window.own.1.lt(end.0);
                if any {
                    sure &= end.1.lt(window.before_end);
                }
                nearest.doubt_from(end.0, maybe & !sure);
                if any {
                    let blocked = sure.bits();
                    best.surface = choose(blocked, &[best.first_part + first + part; LANES], &best.surface);
                    nearest.blocked |= blocked;
                    window.live &= !blocked;
                    if window.live == 0 {
                        return nearest;
                    }
                } else {
                    nearest.take(end, part, sure);
                }
            }
        }
        nearest
    }

    /// The parts that the rays of `live` may meet, and some that are none.
    #[inline(always)]
    fn passed_close<P: PartSet>(&self, plan: &Decision<P>, lines: &FootRays, live: u8) -> P {
        let beam = Beam::new(&lines.rays, live, plan.size);
        let blocks = slice(&self.capsules, &plan.capsules);
        let met = |(block, capsules)| P::of_block(block, beam.meets(capsules));
        blocks.iter().enumerate().map(met).fold(P::default(), |near, these| near | these)
    }

    /// Brackets a part, if after a look at the grown body `go_on` says so.
    #[inline(always)]
    fn bracket<P: PartSet>(
        &self,
        part: u32,
        question: &Question<P, impl PartRoots>,
        sketch: &mut Sketch,
        go_on: impl FnOnce([f32x8; 2]) -> bool,
    ) -> bool {
        let &Question { first, plan, rules, rays, lines, source, .. } = question;
        let Sketch { crossings, asked, brackets } = sketch;
        let ask = || {
            let start = crossings.len();
            source.crossings(first + part, rays, crossings);
            asked.push((first + part, start..crossings.len()));
            Bracket::of_crossings(&crossings[start..], lines.shift, lines.pad)
        };
        let place = &mut brackets[part as usize & (MOST_PARTS - 1)];
        rules.of(plan, part).body.bracket(&lines.rays, place, ask, go_on)
    }

    /// Lanes in which a crossing is surely a surface, and in which it may be.
    #[inline(always)]
    fn is_surface<P: PartSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        rule: &Rule<P>,
        (sketch, near): (&Sketch, P),
        at: Between,
        wanted: Mask<f32x8>,
    ) -> (Mask<f32x8>, Mask<f32x8>) {
        let (mut sure, mut maybe) = (wanted, wanted);
        for part in (rule.all.without & near).each() {
            let [surely, perhaps] = sketch.of(part).holds(at);
            (sure, maybe) = (sure & !perhaps, maybe & !surely);
        }
        for part in rule.all.within.each() {
            let [surely, perhaps] = sketch.of(part).holds(at);
            (sure, maybe) = (sure & surely, maybe & perhaps);
        }
        for clause in question.rules.clauses(rule) {
            if maybe.none() {
                break;
            }
            if !clause.without.is_within(near) {
                continue;
            }
            let (mut surely, mut perhaps) = (Mask::none_set(), Mask::none_set());
            for part in (clause.within & near).each() {
                let [within, touching] = sketch.of(part).holds(at);
                (surely, perhaps) = (surely | within, perhaps | touching);
            }
            for part in clause.without.each() {
                let [within, touching] = sketch.of(part).holds(at);
                (surely, perhaps) = (surely | !touching, perhaps | !within);
            }
            (sure, maybe) = (sure & surely, maybe & perhaps);
        }
        for condition in question.rules.conditions(rule) {
            if maybe.none() {
                break;
            }
            let [within, touching] = self.holds(condition.node, question.first, (sketch, near), at);
            let (surely, perhaps) = if condition.within { (within, touching) } else { (!touching, !within) };
            (sure, maybe) = (sure & surely, maybe & perhaps);
        }
        (sure, maybe)
    }

    /// Lanes in which a crossing is surely within a node, and in which it may be.
    fn holds<P: PartSet>(
        &self,
        number: u32,
        first: u32,
        (sketch, near): (&Sketch, P),
        at: Between,
    ) -> [Mask<f32x8>; 2] {
        let (none, all) = (Mask::none_set(), Mask::all_set());
        if !P::of_many(self.below[number as usize]).meets(near) {
            return match self.outside[number as usize] {
                Side::Inside => [all, all],
                Side::Outside => [none, none],
                Side::Either => [none, all],
            };
        }
        let node = &self.nodes[number as usize];
        let [surely, perhaps] = match &node.kind {
            NodeKind::Part(part) => sketch.of(part - first).holds(at),
            NodeKind::All(list) => {
                let mut every = [all, all];
                for &child in self.list(list) {
                    let [within, touching] = self.holds(child, first, (sketch, near), at);
                    every = [every[0] & within, every[1] & touching];
                    if every[1].none() {
                        break;
                    }
                }
                every
            }
            NodeKind::Any(list) | NodeKind::Merged(list) => {
                let mut some = [none, none];
                for &child in self.list(list) {
                    let [within, touching] = self.holds(child, first, (sketch, near), at);
                    some = [some[0] | within, some[1] | touching];
                    if some[0].all() {
                        break;
                    }
                }
                some
            }
            NodeKind::Odd(_) => [none, all],
        };
        if node.inverted { [!perhaps, !surely] } else { [surely, perhaps] }
    }

    /// A part's crossing that is bracketed, in double precision; NaN where there is none.
    #[inline(always)]
    fn crossing<P>(
        &self,
        number: u32,
        question: &Question<P, impl PartRoots>,
        at: Between,
        sketch: &mut Sketch,
    ) -> f64x8 {
        let &Question { rays, lines, source, .. } = question;
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
