//! Which crossing of which part is the nearest surface of a composite: decided in single precision where that is beyond
//! doubt.
//!
//! Only that crossing is computed in double, and that mostly not here: where nothing else is met nearby, rays are loose
//! ([`Best::loose`]), and whoever works out what the surface is like has to work out the crossing as well.
//!
//! Or all surfaces, in the same way. Lanes in which anything is near to anything else are left to the walk along all crossings.

use super::asker::{Asker, by_packets, in_packet, of_packet};
use super::best::Best;
use super::parts::{Many, PartSet};
use super::plan::{Decision, RuleSet};
use super::question::{Between, FootRays, Question, Window};
use super::scratch::{PartRoots, Sketch};
use super::single::least;
use super::way_in::WayIn;
use super::{Composite, CsgTree};
use crate::lane::{LANES, Lane, Mask, Scalar, Sixteen, choose, f32x8, f32x16, f64x8};

/// Rays are [loose](Best::loose) that meet a part within this share of the composite's size.
const LOOSE_BY: f64 = 1.0 / 1024.0;

/// Such parts are as thick there, in those shares: enough that of their crossings one alone is near.
const THICK: f32 = 4.0;

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
        if best[0].loose | best[1].loose != 0 {
            window.end_loosely([best[0].leeway(), best[1].leeway()]);
        }
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
        let known = (at.1.lt(inf) & at.0.le(window.high)).bits() & window.live & !unsure;
        let loose = self.take_loosely(&question, (sketch, known), &window, &nearest, best);
        let changed = nearest.blocked | loose;
        let known = known & !loose;
        if known == 0 {
            return Decided { changed, doubt: window.doubt };
        }
        let (others, doubt) = self.take_exactly(&question, (sketch, known), &nearest, best);
        Decided { changed: changed | others, doubt: window.doubt | doubt }
    }

    /// Takes what is nearest in those lanes of `known` where it is told well enough, and before all else that is known: those lanes, which are
    /// loose.
    #[inline(always)]
    fn take_loosely<P: RuleSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        (sketch, known): (&Sketch, u16),
        window: &Window,
        &Nearest { at, which, .. }: &Nearest,
        best: &mut [Best; 2],
    ) -> u16 {
        let (plan, shift) = (question.plan, &question.lines.shift);
        let (pad, width) = (f32x16::splat(plan.pad), f32x16::splat(plan.size * LOOSE_BY as f32));
        let sharp = window.own.1.lt(at.0) & at.1.lt(window.before_end) & (at.1 - at.0).le(width);
        let (mut waiting, mut loose) = (known & sharp.bits(), 0);
        if best[0].roundoff > f64::UNIT_ROUNDOFF {
            // (Single precision may not tell as much, that far off.)
            let farthest = f64x8::lit(f64::from(plan.size) * LOOSE_BY / (8.0 * best[0].roundoff));
            waiting &= by_packets(|k| shift[k].abs().le(farthest).bits());
        }
        while waiting != 0 {
            let part = which.number(waiting.trailing_zeros() as usize);
            let these = which.equal(f32x16::splat(part)).bits() & waiting;
            waiting &= !these;
            let part = part as u32;
            if plan.asked.meets(P::of(part)) {
                continue;
            }
            // Where it is crossed another time, that is far enough away.
            let [enter, leave] = sketch.of(part).inner;
            let these = these & (width * f32x16::splat(THICK)).le(leave - enter).bits() & !question.on(part);
            for (k, best) in best.iter_mut().enumerate() {
                let surface = [best.first_part + question.first + part; LANES];
                best.surface = choose(of_packet(these, k), &surface, &best.surface);
            }
            loose |= these;
        }
        if loose == 0 {
            return 0;
        }
        // (A quarter more, as single precision may keep the distance.)
        let slack = f64::from(plan.size) * (1.25 * LOOSE_BY) + 2.0 * f64::from(plan.pad);
        for (k, best) in best.iter_mut().enumerate() {
            let lanes = of_packet(loose, k);
            let t = (at.1 + pad).eight(k).to_f64s() + shift[k];
            best.t = Mask::from_bits(lanes).select(t, best.t);
            best.slack = best.leeway().max(slack);
            best.loose |= lanes;
        }
        loose
    }

    /// Takes what is nearest in the lanes of `known`, where it is nearer than what stands there, in double precision: the lanes that change,
    /// and those of which nothing is known.
    #[inline(never)]
    fn take_exactly<P: RuleSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        (sketch, known): (&mut Sketch, u16),
        &Nearest { at, which, .. }: &Nearest,
        best: &mut [Best; 2],
    ) -> (u16, u16) {
        let (mut changed, mut doubt) = (0, 0);
        for (k, best) in best.iter_mut().enumerate() {
            let (asker, mut found, which) = (question.askers[k], of_packet(known, k), which.eight(k));
            if found & best.loose != 0 {
                best.settle(found, asker.rays, &asker.source, &mut sketch.loose);
            }
            while found != 0 {
                let part = which.lanes()[found.trailing_zeros() as usize & (LANES - 1)];
                let these = which.equal(f32x8::splat(part)).bits() & found;
                found &= !these;
                let number = question.first + part as u32;
                let t = self.crossing((k, number, these), question, at, sketch);
                let known = t.equal(t).bits();
                doubt |= in_packet(these & !known, k);
                let wanted = (t.gt(asker.t_min) & t.le(best.t)).bits() & these & known;
                changed |= in_packet(best.take(number, t, wanted), k);
            }
        }
        (changed, doubt)
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
