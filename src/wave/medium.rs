//! What a ray travels in: POV-Ray's ordered list of the interiors it has entered and not left.
//!
//! Lists are few and rays many, so lists are kept once and rays carry a number. Number 0 is the empty list.

use crate::scene::{Interior, Rgb};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

/// Lists of interiors by number, for one thread.
#[derive(Debug, Default)]
pub struct Media {
    lists: Vec<SmallVec<[u32; 4]>>,
    numbers: FxHashMap<SmallVec<[u32; 4]>, u32>,
    crossings: FxHashMap<(u32, u32), Crossing>,
    /// What was asked for last: mostly it is asked for again.
    last: Option<((u32, u32), Crossing)>,
}

/// What happens to a ray's list at a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// The list behind the surface.
    pub next: u32,
    /// Index of refraction before over that behind: `sin` behind = `eta * sin` before.
    pub eta: f64,
    /// The ray was already in the interior: it leaves it now.
    pub leaves: bool,
    /// Index of refraction that Fresnel's formula takes, relative to what the ray is in.
    pub fresnel_ior: f64,
}

/// Lists kept from tile to tile; a scene with more different ones starts over.
const MOST_LISTS: usize = 1 << 12;

impl Media {
    /// Between tiles no ray holds a number.
    pub fn begin_tile(&mut self) {
        if self.lists.len() > MOST_LISTS {
            *self = Self::default();
        }
        self.number(SmallVec::new());
    }

    /// The number of a list.
    pub fn number(&mut self, list: SmallVec<[u32; 4]>) -> u32 {
        if self.lists.is_empty() {
            self.lists.push(SmallVec::new());
            self.numbers.insert(SmallVec::new(), 0);
        }
        // (Most of those that orthographic cameras ask for, at every packet.)
        if list.is_empty() {
            return 0;
        }
        if let Some(&number) = self.numbers.get(&list) {
            return number;
        }
        let number = self.lists.len() as u32;
        self.lists.push(list.clone());
        self.numbers.insert(list, number);
        number
    }

    /// A ray in `list` meets a surface of `interior` (its number in `interiors`).
    ///
    /// Entering pushes. Leaving what was entered last pops. Leaving something else takes it out of the list and
    /// bends nothing: the ray stays in what it entered last.
    pub fn cross(&mut self, list: u32, interior: u32, interiors: &[Interior]) -> Crossing {
        if let Some((asked, crossing)) = self.last
            && asked == (list, interior)
        {
            return crossing;
        }
        let crossing = match self.crossings.get(&(list, interior)) {
            Some(&crossing) => crossing,
            None => self.new_crossing(list, interior, interiors),
        };
        self.last = Some(((list, interior), crossing));
        crossing
    }

    fn new_crossing(&mut self, list: u32, interior: u32, interiors: &[Interior]) -> Crossing {
        let ior = |i: u32| interiors[i as usize].ior;
        let own = ior(interior);
        let mut entered = self.lists.get(list as usize).cloned().unwrap_or_default();
        let last = entered.last().copied();
        // Two parts of one union are of one interior, and an eye in both is in it twice.
        let place = if last == Some(interior) {
            Some(entered.len() - 1)
        } else {
            entered.iter().position(|&i| i == interior)
        };
        let fresnel_ior = match (last, place) {
            (None, _) => own,
            (Some(last), Some(_)) => (if entered.len() == 1 { 1.0 } else { ior(last) }) / own,
            (Some(last), None) => own / ior(last),
        };
        let eta = match (last, place) {
            (_, Some(place)) if place + 1 == entered.len() => {
                entered.pop();
                own / entered.last().map_or(1.0, |&behind| ior(behind))
            }
            (_, Some(place)) => {
                entered.remove(place);
                1.0
            }
            (last, None) => {
                entered.push(interior);
                last.map_or(1.0, ior) / own
            }
        };
        let crossing = Crossing { next: self.number(entered), eta, leaves: place.is_some(), fresnel_ior };
        self.crossings.insert((list, interior), crossing);
        crossing
    }
}

/// Share of light left after `distance` in `interior` (manual section 3.4.6.5.4).
pub fn fade_over(interior: &Interior, distance: f64) -> Rgb {
    if interior.fade_distance == 0.0 {
        return Rgb::ONE;
    }
    let depth = distance / interior.fade_distance;
    if interior.fade_power >= 1000.0 {
        return ((interior.fade_color - Rgb::ONE) * depth).exp();
    }
    // (Most interiors have one of these two, and a power takes longer than all else here.)
    let power = match interior.fade_power {
        1.0 => depth,
        2.0 => depth * depth,
        power => depth.powf(power),
    };
    interior.fade_color + (Rgb::ONE - interior.fade_color) / (1.0 + power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_parts_of_one_interior_are_left_one_by_one() {
        let interiors = [1.0, 1.5].map(|ior| Interior { ior, ..Interior::default() });
        let mut media = Media::default();
        let both = media.number(SmallVec::from_slice(&[1, 1]));
        let first = media.cross(both, 1, &interiors);
        assert_eq!((first.eta, first.leaves), (1.0, true));
        let second = media.cross(first.next, 1, &interiors);
        assert_eq!((second.eta, second.leaves, second.next), (1.5, true, 0));
    }

    #[test]
    fn overlaps_bend_by_what_was_entered_last() {
        let of = |ior| Interior { ior, ..Interior::default() };
        let interiors = [of(1.0), of(1.5), of(1.2)];
        let mut media = Media::default();
        let glass = media.cross(0, 1, &interiors);
        assert_eq!((glass.eta, glass.leaves), (1.0 / 1.5, false));
        let both = media.cross(glass.next, 2, &interiors);
        assert_eq!((both.eta, both.leaves), (1.5 / 1.2, false));
        // Leaving the glass first: still in the other, nothing bends.
        let other = media.cross(both.next, 1, &interiors);
        assert_eq!((other.eta, other.leaves), (1.0, true));
        let air = media.cross(other.next, 2, &interiors);
        assert_eq!((air.eta, air.leaves, air.next), (1.2, true, 0));
    }
}
