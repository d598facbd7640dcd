//! Which crossing of which part is the nearest surface of a composite: decided in single precision where that is beyond
//! doubt, and only that crossing computed in double.
//!
//! Or all surfaces, in the same way. Lanes in which anything is near to anything else are left to the walk along all crossings.

use super::asker::{Asker, in_packet, of_packet};
use super::best::Best;
use super::parts::{Many, PartSet};
use super::plan::{Decision, RuleSet};
use super::question::{Between, FootRays, Question, Window};
use super::scratch::{PartRoots, Sketch};
use super::single::least;
use super::way_in::WayIn;
use super::{Composite, CsgTree};
use crate::lane::{LANES, Lane, Mask, Sixteen, choose, f32x8, f32x16, f64x8};

/// What came of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Decided {
    /// Lanes whose best has changed, packet by packet.
    pub changed: u16,
    /// Lanes of which nothing is known.
    pub doubt: u16,
}

/// The nearest surface so far.
#[derive(Clone, Copy)]
struct Nearest {
    at: Between,
    /// The part it belongs to.
    which: f32x16,
    /// From here on something may be a surface, or nearer, that is not known to be.
    doubtful: f32x16,
    /// Lanes that have met anything, if that is all they ask.
    blocked: u16,
}

impl Nearest {
    /// Nothing is known yet.
    #[inline(always)]
    fn none() -> Self {
        let inf = f32x16::splat(f32::INFINITY);
        Self { at: Between(inf, inf), which: f32x16::default(), doubtful: inf, blocked: 0 }
    }

    /// Takes what is seen where rays come in, and with `any` blocks them by it, whichever part it is: those of `open` that still look.
    #[inline(always)]
    fn see(
        &mut self,
        way_in: &WayIn,
        (any, number, open): (bool, u32, u16),
        window: &mut Window,
        best: &mut [Best; 2],
    ) -> u16 {
        if any {
            self.block(way_in.seen & way_in.at.1.lt(window.before_end).bits(), number, window, best);
            return open & window.live;
        }
        let seen = Mask::from_bits(way_in.seen);
        self.at = Between::choose(seen, way_in.at, self.at);
        self.which = seen.select(way_in.part, self.which);
        open & window.live & !way_in.seen
    }

    /// In `lanes` nothing beyond `from` is known to be the nearest.
    #[inline(always)]
    fn doubt_from(&mut self, from: f32x16, lanes: u16) {
        self.doubtful = Mask::from_bits(lanes).select(least(self.doubtful, from), self.doubtful);
    }

    /// `lanes` have met part `number`, and look no more.
    #[inline(always)]
    fn block(&mut self, lanes: u16, number: u32, window: &mut Window, best: &mut [Best; 2]) {
        for (k, best) in best.iter_mut().enumerate() {
            let surface = [best.first_part + number; LANES];
            best.surface = choose(of_packet(lanes, k), &surface, &best.surface);
        }
        self.blocked |= lanes;
        window.live &= !lanes;
    }

    /// Takes a crossing of `part` where it is `sure` to be a surface.
    #[inline(always)]
    fn take(&mut self, end: Between, part: u32, sure: u16) {
        let closer = sure & end.1.lt(self.at.0).bits();
        let level = sure & !closer & end.0.le(self.at.1).bits();
        self.doubt_from(least(end.0, self.at.0), level);
        let closer = Mask::from_bits(closer);
        self.at = Between::choose(closer, end, self.at);
        self.which = closer.select(f32x16::splat(part as f32), self.which);
    }
}

impl CsgTree {
    /// As [`CsgTree::nearest`], in the lanes where it can be told in single precision.
    #[inline(always)]
    pub(super) fn decide<P: RuleSet>(
        &self,
        (composite, plan): (&Composite, &Decision<P>),
        (askers, lanes, any): ([&Asker<impl PartRoots>; 2], u16, bool),
        sketch: &mut Sketch,
        best: &mut [Best; 2],
    ) -> Decided {
        let lines = FootRays::new(plan, askers);
        let mut window = Window::new(plan, &lines, (askers, lanes), [best[0].t, best[1].t]);
        let question = Question::new(self, (composite, plan), (askers, &lines));
        let Some(near) = self.bracket_required(&question, sketch, &mut window) else {
            return Decided { changed: 0, doubt: window.doubt };
        };
        let nearest = self.nearest_surface(&question, (sketch, near, any), &mut window, best);
        if window.live == 0 {
            return Decided { changed: nearest.blocked, doubt: window.doubt };
        }
        let (inf, Nearest { at, doubtful, .. }) = (f32x16::splat(f32::INFINITY), &nearest);
        let unsure = (doubtful.lt(inf) & doubtful.le(at.1)).bits();
        window.doubt |= unsure & window.live;
        let (known, mut changed) = (at.1.lt(inf).bits() & window.live & !unsure, nearest.blocked);
        for (k, asker) in askers.iter().enumerate() {
            let (mut found, which) = (of_packet(known, k), nearest.which.eight(k));
            while found != 0 {
                let part = which.lanes()[found.trailing_zeros() as usize & (LANES - 1)];
                let these = which.equal(f32x8::splat(part)).bits() & found;
                found &= !these;
                let number = question.first + part as u32;
                let t = self.crossing((k, number, these), &question, *at, sketch);
                let known = t.equal(t).bits();
                window.doubt |= in_packet(these & !known, k);
                let wanted = (t.gt(asker.t_min) & t.le(best[k].t)).bits() & these & known;
                changed |= in_packet(best[k].take(number, t, wanted), k);
            }
        }
        Decided { changed, doubt: window.doubt }
    }

    /// The same of many parts, by itself: few composites have so many, and this is large.
    #[inline(never)]
    pub(super) fn decide_many(
        &self,
        plan: (&Composite, &Decision<Many>),
        looking: ([&Asker<impl PartRoots>; 2], u16, bool),
        sketch: &mut Sketch,
        best: &mut [Best; 2],
    ) -> Decided {
        self.decide(plan, looking, sketch, best)
    }

    /// The nearest surface along rays that meet all required parts, which are bracketed as all are that are `near` so far: where they come
    /// in, by the outside or through what is cut out, or what the other parts leave. With `any`, lanes are blocked in `best` as soon as they have met
    /// one, and look no more.
    #[inline(always)]
    fn nearest_surface<P: PartSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        (sketch, mut near, any): (&mut Sketch, P, bool),
        window: &mut Window,
        best: &mut [Best; 2],
    ) -> Nearest {
        let &Question { first, plan, .. } = question;
        let (mut nearest, mut open) = (Nearest::none(), window.live);
        let (mut waiting, mut into) = (None, WayIn::nowhere());
        let first_part = first + plan.carved.as_ref().map_or(0, |carved| carved.first);
        if let Some(carved) = &plan.carved {
            into = if carved.hull.is_empty() {
                WayIn::into_all(question, (&self.bites, carved), sketch, window)
            } else {
                let others = self.others_near(question, open);
                near = self.bracket_others(question, sketch, (window, open), (others & carved.hull, near));
                waiting = Some(others & !carved.hull);
                WayIn::into_any((question, near), (&self.bites, carved), sketch, window)
            };
            open = nearest.see(&into, (any, first_part, open), window, best);
            if open == 0 {
                return nearest;
            }
        }
        let waiting = waiting.unwrap_or_else(|| self.others_near(question, open));
        let near = self.bracket_others(question, sketch, (window, open), (waiting, near));
        if let Some(carved) = plan.carved.as_ref().filter(|carved| carved.shows_bites) {
            let through = self.way_through(question, (carved, near), sketch, (window, open), &into);
            open = nearest.see(&through, (any, first_part, open), window, best);
        }
        if open != 0 {
            // (In and out by value: what others write to is kept in memory all along.)
            (nearest, *window) =
                self.nearest_bracketed(question, (sketch, near, any), (*window, open), nearest, best);
        }
        nearest
    }

    /// What of the parts that have been bracketed is a surface, and nearer than what is known, along the rays of `open`. (By itself, as most
    /// rays need not ask.)
    #[inline(never)]
    fn nearest_bracketed<P: PartSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        (sketch, near, any): (&Sketch, P, bool),
        (mut window, open): (Window, u16),
        mut nearest: Nearest,
        best: &mut [Best; 2],
    ) -> (Nearest, Window) {
        let &Question { first, plan, rules, .. } = question;
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
                let wanted = met & ahead & window.live & open & away;
                if wanted == 0 {
                    continue;
                }
                let [sure, maybe] = self.is_surface(question, rule, (sketch, near), end, wanted);
                let mut sure = sure & sharp & window.own.1.lt(end.0).bits();
                if any {
                    sure &= end.1.lt(window.before_end).bits();
                }
                nearest.doubt_from(end.0, maybe & !sure);
                if any {
                    nearest.block(sure, first + part, &mut window, best);
                    if window.live == 0 {
                        return (nearest, window);
                    }
                } else {
                    nearest.take(end, part, sure);
                }
            }
        }
        (nearest, window)
    }

    /// As [`CsgTree::surfaces`], in the lanes where it can be told in single precision: those where it cannot.
    #[inline(always)]
    pub(super) fn decide_all<P: RuleSet>(
        &self,
        (composite, plan): (&Composite, &Decision<P>),
        (askers, lanes, t_max): ([&Asker<impl PartRoots>; 2], u16, [f64x8; 2]),
        sketch: &mut Sketch,
        found: &mut impl FnMut(usize, u32, f64x8, u8),
    ) -> u16 {
        let lines = FootRays::new(plan, askers);
        let mut window = Window::new(plan, &lines, (askers, lanes), t_max);
        let question = Question::new(self, (composite, plan), (askers, &lines));
        let Some(near) = self.bracket_required(&question, sketch, &mut window) else {
            return window.doubt;
        };
        let waiting = self.others_near(&question, window.live);
        let near = self.bracket_others(&question, sketch, (&window, window.live), (waiting, near));
        sketch.surfaces.clear();
        for part in (near & plan.seen).each() {
            let rule = question.rules.of(plan, part);
            if !rule.all.within.is_within(near) {
                continue;
            }
            let bracket = sketch.of(part);
            let (ends, met, sharp) = (bracket.ends(), bracket.is_met(), bracket.is_sharp());
            let away = window.leave_start(ends, question.on(part));
            for (end, away) in ends.into_iter().zip(away) {
                let wanted = met & end.meets(window.low, window.high) & window.live & away;
                if wanted == 0 {
                    continue;
                }
                let [sure, maybe] = self.is_surface(&question, rule, (sketch, near), end, wanted);
                let within = window.own.1.lt(end.0) & end.1.lt(window.before_end);
                let sure = sure & sharp & within.bits();
                window.give_up(maybe & !sure);
                let (number, sure) = (question.first + part, sure & window.live);
                for k in 0..askers.len() {
                    let sure = of_packet(sure, k);
                    if sure != 0 {
                        // (What is known of a part is asked for once, and is to do for its other crossings.)
                        let lanes = of_packet(window.live, k);
                        let t = self.crossing((k, number, lanes), &question, end, sketch);
                        window.give_up(in_packet(sure & !t.equal(t).bits(), k));
                        sketch.surfaces.push((k, number, t, sure));
                    }
                }
            }
        }
        for &(k, number, t, lanes) in &sketch.surfaces {
            let lanes = lanes & of_packet(window.live, k);
            if lanes != 0 {
                found(k, number, t, lanes);
            }
        }
        window.doubt
    }
}
