//! What is asked of a composite in single precision, for two packets of rays at once: where its parts lie along them, and which of
//! their crossings are surfaces.
//!
//! Every part that rays may meet is bracketed ([`Bracket`]), and every crossing held against the parts that have a say in it
//! ([`super::rule::Clause`]).

use super::asker::{Asker, by_packets, of_packet};
use super::bracket::{Body, Bracket};
use super::capsule::Beam;
use super::parts::PartSet;
use super::plan::{Decision, MOST_PARTS, RuleSet, Rules};
use super::rule::Rule;
use super::scratch::{PartRoots, Sketch};
use super::single::{least, most};
use super::{Composite, CsgTree, NodeKind, Side, slice};
use crate::kernel::{Looking, Rays};
use crate::lane::{Lane, Many, Mask, Sixteen, Vec3, f32x8, f32x16, f64x8};
use glam::DVec3;
use std::iter;

/// Rays from their points nearest to the middle of a composite.
pub(super) struct FootRays {
    rays: Rays<f32x16>,
    /// By packet, how far those points are from the starts.
    pub(super) shift: [f64x8; 2],
}

impl FootRays {
    #[inline(always)]
    pub(super) fn new<P, Q>(plan: &Decision<P>, [a, b]: [&Asker<Q>; 2]) -> Self {
        let ((origin, dir, shift), other) = (foot(plan.middle, a.rays), foot(plan.middle, b.rays));
        let rays = Rays { origin: side_by_side(origin, other.0), dir: side_by_side(dir, other.1) };
        let shift = [shift.in_register(), other.2.in_register()];
        Self { rays, shift }
    }

    /// Places relative to the middle, at these distances from the feet.
    #[inline(always)]
    pub(super) fn places(&self, at: f32x16) -> Vec3<f32x16> {
        self.rays.dir.fused(at, self.rays.origin)
    }
}

/// Eight rays from where they are nearest to a `middle`, relative to it, and how far that is from their starts.
#[inline(always)]
fn foot(middle: DVec3, rays: &Rays<f64x8>) -> (Vec3<f32x8>, Vec3<f32x8>, f64x8) {
    let from = rays.origin - Vec3::splat(middle);
    let shift = -from.fused_dot(rays.dir);
    (rays.dir.fused(shift, from).cast(), rays.dir.cast(), shift)
}

/// The vectors of one packet and of another.
#[inline(always)]
fn side_by_side(a: Vec3<f32x8>, b: Vec3<f32x8>) -> Vec3<f32x16> {
    let both = |a: f32x8, b: f32x8| f32x16::of(|k| if k == 0 { a } else { b }).in_register();
    Vec3::new(both(a.x, b.x), both(a.y, b.y), both(a.z, b.z))
}

/// A crossing by its bracket: between two distances.
#[derive(Clone, Copy)]
pub(super) struct Between(pub(super) f32x16, pub(super) f32x16);

impl Between {
    /// `yes` in `lanes`, `no` elsewhere.
    #[inline(always)]
    pub(super) fn choose(lanes: Mask<f32x16>, yes: Self, no: Self) -> Self {
        Self(lanes.select(yes.0, no.0), lanes.select(yes.1, no.1))
    }

    #[inline(always)]
    pub(super) fn meets(self, from: f32x16, to: f32x16) -> u16 {
        from.le(self.1).bits() & self.0.le(to).bits()
    }
}

impl Bracket {
    /// Where rays come in and where they go out; all along where they may miss it.
    #[inline(always)]
    pub(super) fn ends(&self) -> [Between; 2] {
        let ([a, d], [b, c]) = (self.outer, self.inner);
        [Between(a, least(b, d)), Between(most(c, a), d)]
    }

    /// Lanes in which a crossing is surely within, and in which it may be.
    #[inline(always)]
    pub(super) fn holds(&self, at: Between) -> [u16; 2] {
        let ([a, d], [b, c]) = (self.outer, self.inner);
        [b.le(at.0).bits() & at.1.le(c).bits(), at.meets(a, d)]
    }

    /// Lanes that meet the shrunk body.
    #[inline(always)]
    pub(super) fn is_sharp(&self) -> u16 {
        self.inner[0].le(self.inner[1]).bits()
    }

    /// Lanes that meet the grown body.
    #[inline(always)]
    pub(super) fn is_met(&self) -> u16 {
        self.outer[0].le(self.outer[1]).bits()
    }
}

impl Sketch {
    #[inline(always)]
    pub(super) fn of(&self, part: u32) -> &Bracket {
        &self.brackets[part as usize & (MOST_PARTS - 1)]
    }

    #[inline(always)]
    fn of_mut(&mut self, part: u32) -> &mut Bracket {
        &mut self.brackets[part as usize & (MOST_PARTS - 1)]
    }
}

/// What is asked of a composite, whose parts are numbered from `first` on.
pub(super) struct Question<'a, P, Q> {
    pub(super) first: u32,
    pub(super) plan: &'a Decision<P>,
    pub(super) rules: &'a Rules<P>,
    pub(super) askers: [&'a Asker<'a, Q>; 2],
    pub(super) lines: &'a FootRays,
    /// Rays start on some of its parts.
    starts: bool,
}

impl<'a, P: RuleSet, Q: PartRoots> Question<'a, P, Q> {
    #[inline(always)]
    pub(super) fn new(
        tree: &'a CsgTree,
        (composite, plan): (&Composite, &'a Decision<P>),
        (askers, lines): ([&'a Asker<'a, Q>; 2], &'a FootRays),
    ) -> Self {
        let (first, starts) = (composite.parts.start, askers.iter().any(|asker| asker.source.starts()));
        Self { first, plan, rules: P::rules(tree), askers, lines, starts }
    }
}

impl<P, Q: PartRoots> Question<'_, P, Q> {
    /// Lanes that start on a part.
    #[inline(always)]
    pub(super) fn on(&self, part: u32) -> u16 {
        if !self.starts {
            return 0;
        }
        by_packets(|k| {
            let source = &self.askers[k].source;
            if source.starts() { source.on(self.first + part) } else { 0 }
        })
    }
}

/// What of rays is still looked at, in distances from their feet.
#[derive(Clone, Copy)]
pub(super) struct Window {
    pub(super) low: f32x16,
    pub(super) high: f32x16,
    /// Where the crossing that rays start on lies.
    pub(super) own: Between,
    /// What is surely before the end.
    pub(super) before_end: f32x16,
    /// Lanes that look.
    pub(super) live: u16,
    /// Lanes of which nothing can be told.
    pub(super) doubt: u16,
}

impl Window {
    /// In the ball around all parts, between where those of the askers' `lanes` start to look and `t_max`.
    #[inline(always)]
    pub(super) fn new<P, Q>(
        plan: &Decision<P>,
        lines: &FootRays,
        (askers, lanes): ([&Asker<Q>; 2], u16),
        t_max: [f64x8; 2],
    ) -> Self {
        let (FootRays { rays, shift }, pad) = (lines, f32x16::splat(plan.pad));
        let singles = |of: &dyn Fn(usize) -> f64x8| f32x16::of(|k| f32x8::from_f64s(of(k)));
        let start = singles(&|k| askers[k].t_min - shift[k]);
        let end = singles(&|k| t_max[k] - shift[k]);
        let own = singles(&|k| -shift[k] - askers[k].t_min);
        let chord = (f32x16::splat(plan.square) - rays.origin.fused_dot(rays.origin)).sqrt(); // NaN outside
        let (low, high) = (most(start - pad, -chord), least(end + pad, chord));
        let steady = by_packets(|k| shift[k].abs().le(f64x8::lit(plan.farthest)).bits());
        let doubt = lanes & !steady;
        Self {
            low,
            high,
            own: Between(own - pad, start + pad),
            before_end: end - pad,
            live: lanes & !doubt & low.le(high).bits(),
            doubt,
        }
    }

    /// The end may be nearer by up to `slack`, packet by packet.
    #[inline(always)]
    pub(super) fn end_loosely(&mut self, slack: [f64; 2]) {
        self.before_end -= f32x16::of(|k| f32x8::splat(slack[k & 1] as f32));
    }

    /// Looks no farther than what a part lies between.
    #[inline(always)]
    fn narrow(&mut self, [enter, leave]: [f32x16; 2]) {
        (self.low, self.high) = (most(self.low, enter), least(self.high, leave));
        self.live &= self.low.le(self.high).bits();
    }

    /// True if any of these rays looks at what a part lies between. (NaN comes last, and stays.)
    #[inline(always)]
    fn shows(&self, [enter, leave]: [f32x16; 2], lanes: u16) -> bool {
        most(self.low, enter).le(least(self.high, leave)).bits() & lanes != 0
    }

    /// Lanes in which the way in, and lanes in which the way out of a part may be the crossing that they start on.
    #[inline(always)]
    pub(super) fn own_ends(&self, ends: [Between; 2]) -> [u16; 2] {
        ends.map(|end| end.meets(self.own.0, self.own.1))
    }

    /// Rays of `on`, which start on a part, that leave it there: they do not come back to it.
    #[inline(always)]
    pub(super) fn left_behind(&self, part: &Bracket, on: u16) -> u16 {
        if on == 0 {
            return 0;
        }
        let [enters, leaves] = self.own_ends(part.ends());
        on & leaves & !enters
    }

    /// The crossing where rays of `on` start, one of the two `ends` of a part, is none, if it is clear which that is: by end, lanes for
    /// which it is another.
    #[inline(always)]
    pub(super) fn leave_start(&mut self, ends: [Between; 2], on: u16) -> [u16; 2] {
        let on = on & self.live;
        if on == 0 {
            return [!0; 2];
        }
        let [enters, leaves] = self.own_ends(ends);
        self.give_up(on & !(enters ^ leaves));
        [!(on & enters), !(on & leaves)]
    }

    /// Of `lanes` nothing can be told.
    #[inline(always)]
    pub(super) fn give_up(&mut self, lanes: u16) {
        self.doubt |= lanes;
        self.live &= !lanes;
    }
}

impl CsgTree {
    /// Brackets the parts that all of the composite lies within, and bites that rays start on, and says which these are, if any ray still
    /// looks then.
    #[inline(always)]
    pub(super) fn bracket_required<P: PartSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        sketch: &mut Sketch,
        window: &mut Window,
    ) -> Option<P> {
        let &Decision { required, asked, .. } = question.plan;
        sketch.crossings.clear();
        sketch.asked.clear();
        if window.live == 0 {
            return None;
        }
        // What takes longest is left what the rest leaves.
        for these in [required & !asked, required & asked] {
            // (Two at a time, none of which waits for what the other leaves, unless they are asked.)
            let mut parts = these.each();
            while let Some(part) = parts.next() {
                let other = if these.meets(asked) { None } else { parts.next() };
                for part in iter::once(part).chain(other) {
                    self.bracket(part, question, sketch, (window, window.live));
                }
                for part in iter::once(part).chain(other) {
                    window.narrow(sketch.of(part).outer);
                    // Whoever leaves it here has left the whole.
                    window.live &= !window.left_behind(sketch.of(part), question.on(part) & window.live);
                }
                if window.live == 0 {
                    return None;
                }
            }
        }
        if !question.starts || required.is_empty() {
            return Some(required);
        }
        let near = required | self.leave_bites(question, sketch, window);
        (window.live != 0).then_some(near)
    }

    /// The parts, beside required ones, that the rays of `open` may meet, and some that are none.
    #[inline(always)]
    pub(super) fn others_near<P: PartSet>(&self, question: &Question<P, impl PartRoots>, open: u16) -> P {
        let &Question { plan, lines, .. } = question;
        if plan.capsules.is_empty() {
            plan.others
        } else {
            plan.others & self.passed_close(plan, lines, open)
        }
    }

    /// Brackets those of the `waiting` parts that the rays of `open` may meet, and adds them to those that are `near`, which are bracketed.
    #[inline(always)]
    pub(super) fn bracket_others<P: PartSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        sketch: &mut Sketch,
        (window, open): (&Window, u16),
        (waiting, mut near): (P, P),
    ) -> P {
        let &Question { plan, rules, lines, .. } = question;
        let waiting = waiting & !near;
        for these in [waiting & !plan.dependent, waiting & plan.dependent] {
            for part in these.each() {
                let rule = rules.of(plan, part);
                if !rule.mates.is_within(near) {
                    continue;
                }
                if let Some([x, y, z, square]) = rule.ball {
                    let toward = Vec3::<f32x16>::broadcast([x, y, z]) - lines.rays.origin;
                    let ahead = toward.fused_dot(lines.rays.dir);
                    let across = toward.fused_dot(toward) - ahead * ahead;
                    if across.le(f32x16::splat(square)).bits() & open == 0 {
                        continue;
                    }
                }
                // (No branch on whether it is met, which is so as often as not, and told late.)
                self.bracket(part, question, sketch, (window, open));
                near = near | P::of_if(part, window.shows(sketch.of(part).outer, open));
            }
        }
        near
    }

    /// The parts that the rays of `live` may meet, and some that are none.
    #[inline(never)]
    fn passed_close<P: PartSet>(&self, plan: &Decision<P>, lines: &FootRays, live: u16) -> P {
        let beam = Beam::new(&lines.rays, live, plan.size);
        let blocks = slice(&self.capsules, &plan.capsules);
        let met = |(block, capsules)| P::of_block(block, beam.meets(capsules));
        blocks.iter().enumerate().map(met).fold(P::default(), |near, these| near | these)
    }

    /// Brackets a part as far as rays look.
    #[inline(always)]
    pub(super) fn bracket<P: PartSet>(
        &self,
        part: u32,
        question: &Question<P, impl PartRoots>,
        sketch: &mut Sketch,
        (window, looking): (&Window, u16),
    ) {
        let &Question { plan, rules, lines, .. } = question;
        let body = &rules.of(plan, part).body;
        if !body.bracket(&lines.rays, sketch.of_mut(part)) {
            self.ask(part, question, sketch, (looking, [window.low, window.high]));
        }
    }

    /// The same by its crossings between two distances, and if it may be endless with all else that is to be known of it.
    #[inline(never)]
    fn ask<P: PartSet>(
        &self,
        part: u32,
        question: &Question<P, impl PartRoots>,
        sketch: &mut Sketch,
        (looking, ends): (u16, [f32x16; 2]),
    ) {
        let &Question { first, plan, rules, askers, lines, .. } = question;
        let body = &rules.of(plan, part).body;
        let (live, endless) = (body.may_meet(&lines.rays, ends, looking), matches!(body, Body::AskedWhole));
        let Sketch { crossings, asked, .. } = sketch;
        let number = first + part;
        let mut packets = [Bracket::missed(); 2];
        for (k, packet) in packets.iter_mut().enumerate() {
            let lanes = of_packet(live, k);
            if lanes == 0 {
                continue;
            }
            let (Asker { rays, source, .. }, shift) = (askers[k], lines.shift[k]);
            let (pad, start) = (f32x8::splat(plan.pad), crossings.len());
            *packet = if endless {
                let [from, to] = ends.map(|end| end.eight(k).to_f64s() + shift);
                let looking = Looking { from, to, lanes, any: false };
                let from_inside = source.between(number, rays, &looking, crossings);
                Bracket::of_endless(&crossings[start..], from_inside, shift, pad)
            } else {
                source.crossings(number, rays, lanes, crossings);
                Bracket::of_crossings(&crossings[start..], shift, pad)
            };
            asked.push(((k, number), start..crossings.len()));
        }
        *sketch.of_mut(part) = Bracket::of_packets(packets);
    }

    /// Lanes in which a crossing is surely a surface, and in which it may be.
    #[inline(always)]
    pub(super) fn is_surface<P: PartSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        rule: &Rule<P>,
        (sketch, near): (&Sketch, P),
        at: Between,
        wanted: u16,
    ) -> [u16; 2] {
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
            if maybe == 0 {
                break;
            }
            if !clause.without.is_within(near) {
                continue;
            }
            let (mut surely, mut perhaps) = (0, 0);
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
            if maybe == 0 {
                break;
            }
            let [within, touching] = self.holds(condition.node, question.first, (sketch, near), at);
            let (surely, perhaps) = if condition.within { (within, touching) } else { (!touching, !within) };
            (sure, maybe) = (sure & surely, maybe & perhaps);
        }
        [sure, maybe]
    }

    /// Lanes in which a crossing is surely within a node, and in which it may be.
    fn holds<P: PartSet>(
        &self,
        number: u32,
        first: u32,
        (sketch, near): (&Sketch, P),
        at: Between,
    ) -> [u16; 2] {
        let (none, all) = (0, !0);
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
                    if every[1] == none {
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
                    if some[0] == all {
                        break;
                    }
                }
                some
            }
            NodeKind::Odd(_) => [none, all],
        };
        if node.inverted { [!perhaps, !surely] } else { [surely, perhaps] }
    }

    /// A part's crossing that is bracketed, for `lanes` of packet `k` in double precision; NaN where there is none.
    #[inline(always)]
    pub(super) fn crossing<P>(
        &self,
        (k, number, lanes): (usize, u32, u8),
        question: &Question<P, impl PartRoots>,
        at: Between,
        sketch: &mut Sketch,
    ) -> f64x8 {
        let &Question { askers, lines, plan, .. } = question;
        let (Asker { rays, source, .. }, shift) = (askers[k], lines.shift[k]);
        let Sketch { crossings, asked, .. } = sketch;
        let known = asked.iter().find(|(other, _)| *other == (k, number)).map(|(_, range)| range.clone());
        let range = known.unwrap_or_else(|| {
            let start = crossings.len();
            source.crossings(number, rays, lanes, crossings);
            asked.push(((k, number), start..crossings.len()));
            start..crossings.len()
        });
        let pad = f32x8::splat(plan.pad);
        let (low, high) = (at.0.eight(k) - pad, at.1.eight(k) + pad);
        let mut t = f64x8::lit(f64::NAN);
        for &crossing in &crossings[range] {
            let here = f32x8::from_f64s(crossing - shift);
            let between = here.ge(low) & here.le(high);
            t = between.cast().select(crossing, t);
        }
        t
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same for both packets.
    fn twice(bracket: Bracket<f32x8>) -> Bracket {
        Bracket::of_packets([bracket; 2])
    }

    fn at(t: f64) -> Between {
        Between(f32x16::constant(t), f32x16::constant(t))
    }

    #[test]
    fn what_is_crossed_four_times_is_in_doubt_from_first_to_last() {
        let crossings = [1.0, 2.0, 4.0, 8.0].map(f64x8::lit);
        let bracket = twice(Bracket::of_crossings(&crossings, f64x8::zero(), f32x8::lit(1e-6)));
        for t in [1.0, 2.0, 3.0, 4.0, 6.0, 8.0] {
            assert!(bracket.ends().iter().all(|end| end.meets(at(t).0, at(t).1) == !0), "{t}");
            let [surely, perhaps] = bracket.holds(at(t));
            assert_eq!([surely, perhaps], [0, !0], "{t}");
        }
        let [_, perhaps] = bracket.holds(at(9.0));
        assert_eq!([perhaps, bracket.is_met()], [0, !0]);
    }

    #[test]
    fn what_is_missed_holds_nothing() {
        let none = [f64x8::lit(f64::NAN); 2];
        let bracket = twice(Bracket::of_crossings(&none, f64x8::zero(), f32x8::lit(1e-6)));
        let [surely, perhaps] = bracket.holds(at(0.0));
        assert_eq!([surely, perhaps, bracket.is_met()], [0; 3]);
    }

    #[test]
    fn what_has_no_end_is_within_where_it_was_not_left() {
        let none = f64::NAN;
        // By lane: comes from inside or not, and crosses never, once, twice; the last from outside three times.
        let crossings = [
            f64x8::new([none, none, 2.0, none, 2.0, 2.0, 2.0, none]),
            f64x8::new([none, 2.0, 4.0, none, none, 4.0, 4.0, none]),
            f64x8::new([none, none, none, none, none, none, 4.5, none]),
        ];
        let bracket = twice(Bracket::of_endless(&crossings, 0b11_1000, f64x8::zero(), f32x8::lit(1e-6)));
        let held = |t: f64| {
            let [surely, perhaps] = bracket.holds(at(t));
            (surely & 0b11_1111, perhaps & 0b11_1111)
        };
        // Who leaves and comes back is in doubt all along.
        assert_eq!(held(1.0), (0b01_1000, 0b11_1000));
        assert_eq!(held(2.0), (0b00_1000, 0b11_1110));
        assert_eq!(held(3.0), (0b00_1110, 0b10_1110));
        assert_eq!(held(5.0), (0b00_1010, 0b10_1010));
        assert_eq!(bracket.holds(at(5.0)).map(|lanes| lanes >> 6 & 1), [0, 1]);
        let ends = bracket.ends().map(|end| end.meets(at(2.0).0, at(2.0).1) & 0b11_1111);
        assert_eq!(ends, [0b10_0110, 0b11_0000]);
    }
}
