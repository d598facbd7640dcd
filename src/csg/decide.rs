//! Which crossing of which part is the nearest surface of a composite: decided in single precision where that is beyond
//! doubt, and only that crossing computed in double.
//!
//! Or all surfaces, in the same way. Lanes in which anything is near to anything else are left to the walk along all crossings.

use super::best::Best;
use super::bracket::least;
use super::parts::{Many, PartSet};
use super::plan::Decision;
use super::question::{Between, FootRays, Question, Window};
use super::scratch::{PartRoots, Scratch, Sketch};
use super::{Composite, CsgTree};
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Mask, choose, f32x8, f64x8};

/// What came of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Decided {
    /// Lanes whose best has changed.
    pub changed: u8,
    /// Lanes of which nothing is known.
    pub doubt: u8,
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
        let lines = FootRays::new(plan, rays);
        let mut window = Window::new(plan, &lines, (lanes, t_min, best.t));
        let question = Question::new(self, (composite, plan), (rays, &lines), source);
        let (sketch, first) = (&mut scratch.sketch, question.first);
        let Some(near) = self.bracket_near(&question, sketch, &mut window) else {
            return Decided { changed: 0, doubt: window.doubt };
        };
        let nearest = self.nearest_bracketed(&question, (sketch, near, any), &mut window, best);
        if window.live == 0 {
            return Decided { changed: nearest.blocked, doubt: window.doubt };
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
        Decided { changed, doubt: window.doubt }
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

    /// The nearest of what has been bracketed that is a surface. With `any`, lanes are blocked in `best` as soon as they have met one,
    /// and look no more.
    #[inline(always)]
    fn nearest_bracketed<P: PartSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        (sketch, near, any): (&Sketch, P, bool),
        window: &mut Window,
        best: &mut Best,
    ) -> Nearest {
        let &Question { first, plan, rules, .. } = question;
        let inf = f32x8::lit(f64::INFINITY);
        let mut nearest = Nearest { at: Between(inf, inf), which: f32x8::zero(), doubtful: inf, blocked: 0 };
        for part in (near & plan.seen).each() {
            let rule = rules.of(plan, part);
            if !rule.all.within.is_within(near) {
                continue;
            }
            let bracket = sketch.of(part);
            let ends = bracket.ends();
            let away = window.leave_start(ends, question.on(part));
            let (met, sharp) = (bracket.is_met(), bracket.is_sharp());
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

    /// As [`CsgTree::surfaces`], in the lanes where it can be told in single precision: those where it cannot.
    #[inline(always)]
    pub(super) fn decide_all<P: PartSet>(
        &self,
        (composite, plan): (&Composite, &Decision<P>),
        rays: &Rays<f64x8>,
        (lanes, [t_min, t_max]): (u8, [f64x8; 2]),
        source: &impl PartRoots,
        scratch: &mut Scratch,
        found: &mut impl FnMut(u32, f64x8, u8),
    ) -> u8 {
        let lines = FootRays::new(plan, rays);
        let mut window = Window::new(plan, &lines, (lanes, t_min, t_max));
        let question = Question::new(self, (composite, plan), (rays, &lines), source);
        let sketch = &mut scratch.sketch;
        let Some(near) = self.bracket_near(&question, sketch, &mut window) else { return window.doubt };
        sketch.surfaces.clear();
        for part in (near & plan.seen).each() {
            let rule = question.rules.of(plan, part);
            if !rule.all.within.is_within(near) {
                continue;
            }
            let bracket = *sketch.of(part);
            let ends = bracket.ends();
            let away = window.leave_start(ends, question.on(part));
            let (met, sharp) = (bracket.is_met(), bracket.is_sharp());
            for (end, away) in ends.into_iter().zip(away) {
                let wanted = met & end.meets(window.low, window.high) & Mask::from_bits(window.live & away);
                if wanted.none() {
                    continue;
                }
                let (sure, maybe) = self.is_surface(&question, rule, (sketch, near), end, wanted);
                let sure = sure & sharp & window.own.1.lt(end.0) & end.1.lt(window.before_end);
                window.give_up((maybe & !sure).bits());
                if (sure.bits() & window.live) != 0 {
                    let number = question.first + part;
                    let t = self.crossing(number, &question, end, sketch);
                    let known = t.equal(t).bits();
                    window.give_up(sure.bits() & !known);
                    sketch.surfaces.push((number, t, sure.bits()));
                }
            }
        }
        for &(number, t, lanes) in &sketch.surfaces {
            if lanes & window.live != 0 {
                found(number, t, lanes & window.live);
            }
        }
        window.doubt
    }
}
