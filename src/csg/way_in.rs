//! Where rays come into a composite, by its outside or through what is cut out, and where they leave it that way.

use super::bites::KNOWN_TO;
use super::carved::Carved;
use super::parts::PartSet;
use super::plan::Decision;
use super::question::{Between, Question, Window};
use super::scratch::{PartRoots, Sketch};
use super::single::{least, most};
use super::{Bites, CsgTree};
use crate::lane::{Mask, Sixteen, f32x16};

/// Rays go through no more bites than this one after the other, unless crossings are held against all parts.
const MOST_THROUGH: usize = 4;

/// Where rays come into a composite, or into the parts that hold all of it.
pub(super) struct WayIn {
    /// Where that is,
    pub(super) at: Between,
    /// and by which part.
    pub(super) part: f32x16,
    /// Lanes in which it is surely there, with nothing of the composite before it,
    known: u16,
    /// and a surface.
    pub(super) seen: u16,
}

impl WayIn {
    /// Known of no ray.
    #[inline(always)]
    pub(super) fn nowhere() -> Self {
        let zero = f32x16::default();
        Self { at: Between(zero, zero), part: zero, known: 0, seen: 0 }
    }

    /// Of a composite that lies within every one of some parts.
    #[inline(always)]
    pub(super) fn into_all<P: PartSet>(
        question: &Question<P, impl PartRoots>,
        carved: (&Bites, &Carved<P>),
        sketch: &Sketch,
        window: &Window,
    ) -> Self {
        let inf = f32x16::splat(f32::INFINITY);
        let (mut early, mut late, mut out) = (-inf, -inf, inf);
        let (mut part, mut sharp, mut next) = (f32x16::default(), window.live, -inf);
        for number in question.plan.required.each() {
            let bracket = sketch.of(number);
            let ([a, _], [b, c]) = (bracket.outer, bracket.inner);
            sharp &= bracket.is_sharp();
            // The latest way in, and the latest of the others.
            let later = early.lt(a);
            next = most(later.select(late, b), next);
            part = later.select(f32x16::splat(number as f32), part);
            (early, late) = (later.select(a, early), later.select(b, late));
            out = least(c, out);
        }
        let known = next.lt(early) & late.lt(out) & window.own.1.lt(early);
        Self::new(question, carved, (Between(early, late), part), known.bits() & sharp)
    }

    /// Of a composite that lies within some of a few parts, those of which that are `near` are known. Rays that come into none of them
    /// look no more.
    #[inline(always)]
    pub(super) fn into_any<P: PartSet>(
        (question, near): (&Question<P, impl PartRoots>, P),
        carved: (&Bites, &Carved<P>),
        sketch: &Sketch,
        window: &mut Window,
    ) -> Self {
        let inf = f32x16::splat(f32::INFINITY);
        let (mut early, mut late, mut next, mut part) = (inf, inf, inf, f32x16::default());
        let (mut sharp, mut starts_within) = (0, 0);
        for number in near.each() {
            let bracket = sketch.of(number);
            let ([a, d], [b, _]) = (bracket.outer, bracket.inner);
            let left = window.left_behind(bracket, question.on(number));
            let met = bracket.is_met() & window.own.0.le(d).bits() & !left;
            let ahead = met & window.own.1.lt(a).bits();
            starts_within |= met & !ahead;
            // The first way in, and the first of the others.
            let first = ahead & a.lt(early).bits();
            sharp = (first & bracket.is_sharp()) | (sharp & !first);
            let (sooner, later) = (Mask::from_bits(first), Mask::from_bits(ahead & !first));
            next = later.select(least(a, next), sooner.select(early, next));
            part = sooner.select(f32x16::splat(number as f32), part);
            (early, late) = (sooner.select(a, early), sooner.select(b, late));
        }
        window.live &= starts_within | early.le(window.high).bits();
        let known = sharp & late.lt(next).bits() & !starts_within;
        Self::new(question, carved, (Between(early, late), part), known & window.live)
    }

    /// In the lanes where it is `known` which part is come into there, it is a surface unless that has been bitten off.
    #[inline(always)]
    fn new<P: PartSet>(
        question: &Question<P, impl PartRoots>,
        (bites, carved): (&Bites, &Carved<P>),
        (at, part): (Between, f32x16),
        known: u16,
    ) -> Self {
        let known_to = f32x16::splat(question.plan.size * KNOWN_TO as f32);
        let told = known & (at.1 - at.0).le(known_to).bits();
        let held = if told == 0 { 0 } else { bites.hold(&carved.bitten, &question.lines.places(at.0)) };
        Self { at, part, known, seen: told & !held }
    }
}

/// Lanes in which a place is surely within the whole that a composite is carved out of, and those in which that may be so there or farther on.
#[inline(always)]
fn whole_holds<P: PartSet>(
    question: &Question<P, impl PartRoots>,
    (carved, near): (&Carved<P>, P),
    sketch: &Sketch,
    at: Between,
) -> [u16; 2] {
    if carved.hull.is_empty() {
        // (Required parts are convex, or in doubt from where rays come in first to where they go out last.)
        let within = question.plan.required.each().map(|part| sketch.of(part).holds(at));
        return within.fold([!0; 2], |[surely, perhaps], [a, b]| [surely & a, perhaps & b]);
    }
    // Who leaves a part of a union may come into another.
    let within = (carved.hull & near).each().map(|part| sketch.of(part).holds(at));
    [within.fold(0, |surely, [a, _]| surely | a), !0]
}

impl CsgTree {
    /// Where rays come to a composite through what is cut out: those of `open` that come `into` the whole within a bite, or start on one and
    /// go into it.
    ///
    /// There is nothing of a composite within a bite. So these rays go on to where they leave it, and if that is within another bite to
    /// where they leave that. What they come to then is the nearest surface, if it is in the whole; and if they have left that, there is
    /// none.
    #[inline(always)]
    pub(super) fn way_through<P: PartSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        (carved, near): (&Carved<P>, P),
        sketch: &Sketch,
        (window, open): (&mut Window, u16),
        into: &WayIn,
    ) -> WayIn {
        let bites = carved.bites & near;
        let &WayIn { mut at, mut part, known, .. } = into;
        let mut going = known & open;
        let mut by_outside = going;
        for number in bites.each() {
            let on = question.on(number) & open;
            if on == 0 {
                continue;
            }
            let bracket = sketch.of(number);
            let ends = bracket.ends();
            let [enters, leaves] = window.own_ends(ends);
            let [_, leave] = ends;
            let into = on & enters & !leaves & bracket.is_sharp() & window.own.1.lt(leave.0).bits();
            (going, by_outside) = (going | into, by_outside & !into);
            let into = Mask::from_bits(into);
            (at, part) = (Between::choose(into, leave, at), into.select(f32x16::splat(number as f32), part));
        }
        let mut seen = 0;
        for _ in 0..MOST_THROUGH {
            if going & !by_outside != 0 {
                let [surely, perhaps] = whole_holds(question, (carved, near), sketch, at);
                let ahead = at.0.le(window.high).bits();
                window.live &= !(going & !((by_outside | perhaps) & ahead));
                going &= (by_outside | surely) & ahead;
            }
            if going == 0 {
                break;
            }
            let (mut within, mut unsure) = (0, 0);
            let (mut last, mut by) = (at, part);
            for number in bites.each() {
                let bracket = sketch.of(number);
                let number = f32x16::splat(number as f32);
                let others = going & !part.equal(number).bits();
                let [surely, perhaps] = bracket.holds(at);
                let (surely, perhaps) = (surely & others, perhaps & others);
                (within, unsure) = (within | surely, unsure | (perhaps & !surely));
                let [_, leave] = bracket.ends();
                let later = Mask::from_bits(surely & last.0.lt(leave.0).bits());
                (last, by) = (Between::choose(later, leave, last), later.select(number, by));
            }
            going &= !unsure;
            seen |= going & !within;
            going &= within;
            (at, part, by_outside) = (last, by, 0);
        }
        WayIn { at, part, known: 0, seen }
    }

    /// Rays that start on a bite and leave the required parts while they are within that bite look no more. The bites that rays start on.
    #[inline(always)]
    pub(super) fn leave_bites<P: PartSet>(
        &self,
        question: &Question<P, impl PartRoots>,
        sketch: &mut Sketch,
        window: &mut Window,
    ) -> P {
        let &Decision { required, asked, ref carved, .. } = question.plan;
        let bites = carved.as_ref().map_or(P::default(), |carved| carved.bites & !asked);
        let mut bracketed = P::default();
        for part in bites.each() {
            let on = question.on(part) & window.live;
            if on == 0 {
                continue;
            }
            bracketed = bracketed | P::of(part);
            self.bracket(part, question, sketch, (window, on));
            let ends = required.each().map(|part| sketch.of(part).outer[1]);
            let out = ends.fold(f32x16::splat(f32::INFINITY), |out, end| least(end, out));
            // (Bites are convex, as all bodies that are not asked are.)
            window.live &= !(on & out.le(sketch.of(part).inner[1]).bits());
            if window.live == 0 {
                break;
            }
        }
        bracketed
    }
}
