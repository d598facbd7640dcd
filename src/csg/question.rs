//! What is asked of a composite in single precision: where its parts lie along eight rays, and which of their crossings are surfaces.
//!
//! Every part that rays may meet is bracketed ([`Bracket`]), and every crossing held against the parts that have a say in it
//! ([`super::plan::Clause`]).

use super::bracket::{Bracket, least, most};
use super::capsule::Beam;
use super::parts::PartSet;
use super::plan::{Decision, MOST_PARTS, Rule, Rules};
use super::scratch::{PartRoots, Sketch};
use super::{Composite, CsgTree, NodeKind, Side, slice};
use crate::kernel::{Looking, Rays};
use crate::lane::{Lane, Mask, Vec3, f32x8, f64x8};

/// Eight rays from their points nearest to the middle of a composite.
pub(super) struct FootRays {
    rays: Rays<f32x8>,
    /// How far those points are from the starts.
    shift: f64x8,
    /// What crossings may be off by.
    pad: f32x8,
}

impl FootRays {
    #[inline(always)]
    pub(super) fn new<P>(plan: &Decision<P>, rays: &Rays<f64x8>) -> Self {
        let from = rays.origin - Vec3::splat(plan.middle);
        let shift = -from.fused_dot(rays.dir);
        let foot = rays.dir.fused(shift, from).cast::<f32x8>();
        let pad = f32x8::splat(plan.pad);
        Self { rays: Rays { origin: foot, dir: rays.dir.cast() }, shift, pad }
    }
}

/// A crossing by its bracket: between two distances.
#[derive(Clone, Copy)]
pub(super) struct Between(pub(super) f32x8, pub(super) f32x8);

impl Between {
    #[inline(always)]
    pub(super) fn meets(self, from: f32x8, to: f32x8) -> Mask<f32x8> {
        self.1.ge(from) & self.0.le(to)
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
    pub(super) fn holds(&self, at: Between) -> [Mask<f32x8>; 2] {
        let ([a, d], [b, c]) = (self.outer, self.inner);
        [b.le(at.0) & at.1.le(c), at.meets(a, d)]
    }

    /// Lanes that meet the shrunk body.
    #[inline(always)]
    pub(super) fn is_sharp(&self) -> Mask<f32x8> {
        self.inner[0].le(self.inner[1])
    }

    /// Lanes that meet the grown body.
    #[inline(always)]
    pub(super) fn is_met(&self) -> Mask<f32x8> {
        self.outer[0].le(self.outer[1])
    }
}

impl Sketch {
    #[inline(always)]
    pub(super) fn of(&self, part: u32) -> &Bracket {
        &self.brackets[part as usize & (MOST_PARTS - 1)]
    }
}

/// What is asked of a composite, whose parts are numbered from `first` on.
pub(super) struct Question<'a, P, Q> {
    pub(super) first: u32,
    pub(super) plan: &'a Decision<P>,
    pub(super) rules: &'a Rules<P>,
    rays: &'a Rays<f64x8>,
    lines: &'a FootRays,
    source: &'a Q,
    /// Rays start on some of its parts.
    starts: bool,
}

impl<'a, P: PartSet, Q: PartRoots> Question<'a, P, Q> {
    #[inline(always)]
    pub(super) fn new(
        tree: &'a CsgTree,
        (composite, plan): (&Composite, &'a Decision<P>),
        (rays, lines): (&'a Rays<f64x8>, &'a FootRays),
        source: &'a Q,
    ) -> Self {
        let (first, starts) = (composite.parts.start, source.starts());
        Self { first, plan, rules: P::rules(tree), rays, lines, source, starts }
    }

    /// Lanes that start on a part.
    #[inline(always)]
    pub(super) fn on(&self, part: u32) -> u8 {
        if self.starts { self.source.on(self.first + part) } else { 0 }
    }
}

/// What of eight rays is still looked at, in distances from their feet.
pub(super) struct Window {
    pub(super) low: f32x8,
    pub(super) high: f32x8,
    /// Where the crossing that rays start on lies.
    pub(super) own: Between,
    /// What is surely before the end.
    pub(super) before_end: f32x8,
    /// Lanes that look.
    pub(super) live: u8,
    /// Lanes of which nothing can be told.
    pub(super) doubt: u8,
}

impl Window {
    /// In the ball around all parts, between start and end.
    #[inline(always)]
    pub(super) fn new<P>(
        plan: &Decision<P>,
        lines: &FootRays,
        (lanes, t_min, t_max): (u8, f64x8, f64x8),
    ) -> Self {
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

    /// Lanes that look, and from where to where.
    #[inline(always)]
    fn within(&self) -> (u8, [f32x8; 2]) {
        (self.live, [self.low, self.high])
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

    /// The crossing where rays of `on` start, one of the two `ends` of a part, is none, if it is clear which that is: by end, lanes for
    /// which it is another.
    #[inline(always)]
    pub(super) fn leave_start(&mut self, ends: [Between; 2], on: u8) -> [u8; 2] {
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
    pub(super) fn give_up(&mut self, lanes: u8) {
        self.doubt |= lanes;
        self.live &= !lanes;
    }
}

impl CsgTree {
    /// Brackets what the rays of a window may meet: which parts that are; none if no ray looks any more.
    #[inline(always)]
    pub(super) fn bracket_near<P: PartSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        sketch: &mut Sketch,
        window: &mut Window,
    ) -> Option<P> {
        sketch.crossings.clear();
        sketch.asked.clear();
        (window.live != 0 && self.bracket_required(question, sketch, window))
            .then(|| question.plan.required | self.bracket_others(question, sketch, window))
    }

    /// Brackets the parts that all of the composite lies within: whether any ray still looks then.
    #[inline(always)]
    fn bracket_required<P: PartSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        sketch: &mut Sketch,
        window: &mut Window,
    ) -> bool {
        let &Decision { required, asked, .. } = question.plan;
        // What takes longest is left what the rest leaves.
        for these in [required & !asked, required & asked] {
            for part in these.each() {
                let within = window.within();
                if !self.bracket(part, question, (sketch, within), |between| window.narrow(between)) {
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
                let within = window.within();
                if self.bracket(part, question, (sketch, within), |between| window.shows(between)) {
                    near = near | P::of(part);
                }
            }
        }
        near
    }

    /// The parts that the rays of `live` may meet, and some that are none.
    #[inline(always)]
    fn passed_close<P: PartSet>(&self, plan: &Decision<P>, lines: &FootRays, live: u8) -> P {
        let beam = Beam::new(&lines.rays, live, plan.size);
        let blocks = slice(&self.capsules, &plan.capsules);
        let met = |(block, capsules)| P::of_block(block, beam.meets(capsules));
        blocks.iter().enumerate().map(met).fold(P::default(), |near, these| near | these)
    }

    /// Brackets a part as far as rays look, if after a look at the grown body `go_on` says so.
    #[inline(always)]
    fn bracket<P: PartSet>(
        &self,
        part: u32,
        question: &Question<P, impl PartRoots>,
        (sketch, (live, ends)): (&mut Sketch, (u8, [f32x8; 2])),
        go_on: impl FnOnce([f32x8; 2]) -> bool,
    ) -> bool {
        let &Question { first, plan, rules, rays, lines, source, .. } = question;
        let Sketch { crossings, asked, brackets, .. } = sketch;
        let ask = |whole: bool| {
            let (number, start) = (first + part, crossings.len());
            let bracket = if whole {
                let [from, to] = ends.map(|end| end.to_f64s() + lines.shift);
                let looking = Looking { from, to, lanes: live, any: false };
                let from_inside = source.between(number, rays, &looking, crossings);
                Bracket::of_endless(&crossings[start..], from_inside, lines.shift, lines.pad)
            } else {
                source.crossings(number, rays, crossings);
                Bracket::of_crossings(&crossings[start..], lines.shift, lines.pad)
            };
            asked.push((number, start..crossings.len()));
            bracket
        };
        let place = &mut brackets[part as usize & (MOST_PARTS - 1)];
        rules.of(plan, part).body.bracket(&lines.rays, place, ask, go_on)
    }

    /// Lanes in which a crossing is surely a surface, and in which it may be.
    #[inline(always)]
    pub(super) fn is_surface<P: PartSet>(
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
    pub(super) fn crossing<P>(
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
            asked.push((number, start..crossings.len()));
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

    #[test]
    fn what_has_no_end_is_within_where_it_was_not_left() {
        let none = f64::NAN;
        // By lane: comes from inside or not, and crosses never, once, twice; the last from outside three times.
        let crossings = [
            f64x8::new([none, none, 2.0, none, 2.0, 2.0, 2.0, none]),
            f64x8::new([none, 2.0, 4.0, none, none, 4.0, 4.0, none]),
            f64x8::new([none, none, none, none, none, none, 4.5, none]),
        ];
        let bracket = Bracket::of_endless(&crossings, 0b11_1000, f64x8::zero(), f32x8::lit(1e-6));
        let at = |t: f64| {
            let [surely, perhaps] = bracket.holds(Between(f32x8::lit(t), f32x8::lit(t)));
            (surely.bits() & 0b11_1111, perhaps.bits() & 0b11_1111)
        };
        // Who leaves and comes back is in doubt all along.
        assert_eq!(at(1.0), (0b01_1000, 0b11_1000));
        assert_eq!(at(2.0), (0b00_1000, 0b11_1110));
        assert_eq!(at(3.0), (0b00_1110, 0b10_1110));
        assert_eq!(at(5.0), (0b00_1010, 0b10_1010));
        let beyond = Between(f32x8::lit(5.0), f32x8::lit(5.0));
        assert_eq!(bracket.holds(beyond).map(|lanes| lanes.bits() >> 6 & 1), [0, 1]);
        let ends = bracket.ends().map(|end| end.meets(f32x8::lit(2.0), f32x8::lit(2.0)).bits() & 0b11_1111);
        assert_eq!(ends, [0b10_0110, 0b11_0000]);
    }
}
