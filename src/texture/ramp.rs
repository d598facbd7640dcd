//! Colour maps in lanes.

use super::Colors;
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, each_lane, f32x8};
use crate::scene::{Color, ColorMap};

/// A colour map, ready to be looked up in.
///
/// Entries are looked up by the first place not below the value; before the first and from the last on they hold on, also where
/// places do not rise: from the last entry's on it is that one. What is no number has the first entry's colour.
#[derive(Debug, Clone)]
pub struct Ramp {
    places: Vec<f64>,
    /// Places rise, or stay.
    rising: bool,
    /// Before each place, and behind the last.
    stretches: Vec<Stretch>,
}

/// Between two places.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    /// Where it begins and ends, and how wide it is; of no width where all of it has the colour of its end.
    before: f64,
    end: f64,
    width: f64,
    /// Red, green, blue, filter, transmit where it begins, and what is added up to its end.
    from: [f32; 5],
    change: [f32; 5],
}

/// Of so many places, or fewer, it takes less to hold eight numbers against each than to look for eight stretches one by one.
const FEW_PLACES: usize = 16;

impl Stretch {
    fn new((before, from): &(f64, Color), (end, to): &(f64, Color)) -> Self {
        let numbers = |color: &Color| [color.rgb.x, color.rgb.y, color.rgb.z, color.filter, color.transmit];
        let (a, b) = (numbers(from), numbers(to));
        let change = std::array::from_fn(|k| (b[k] - a[k]) as f32);
        // (What is added up to the end need not come to it in single precision; so it is added also where there is no width.)
        Self { before: *before, end: *end, width: (end - before).max(0.0), from: a.map(|x| x as f32), change }
    }

    /// All of one colour.
    fn flat(color: &Color) -> Self {
        Self::new(&(0.0, *color), &(0.0, *color))
    }
}

impl Ramp {
    /// Of a map; one without entries is black.
    pub fn new(map: &ColorMap) -> Self {
        let entries = &map.entries;
        let first = entries.first().map_or(Color::default(), |(_, color)| *color);
        let last = entries.last().map_or(first, |(_, color)| *color);
        let mut stretches = vec![Stretch::flat(&first)];
        stretches.extend(entries.windows(2).map(|pair| Stretch::new(&pair[0], &pair[1])));
        stretches.push(Stretch::flat(&last));
        let places: Vec<f64> = entries.iter().map(|(place, _)| *place).collect();
        Self { rising: places.is_sorted(), places, stretches }
    }

    /// The colours of eight numbers.
    pub fn look_up<L: Lane>(&self, value: L) -> Colors {
        let at = self.stretches_at(value);
        let of = |k: usize| &self.stretches[at[k] as usize];
        if at == [at[0]; LANES] {
            let &Stretch { before, end, width, from, change } = of(0);
            let share = share(value, [before, end, width].map(L::lit));
            return mixed(share, |c| f32x8::splat(from[c]), |c| f32x8::splat(change[c]));
        }
        let number = |number: fn(&Stretch) -> f64| L::from_fn(|k| L::Scalar::from_f64(number(of(k))));
        let stretch = [number(|s| s.before), number(|s| s.end), number(|s| s.width)];
        let share = share(value, stretch);
        mixed(share, |c| f32x8::from_fn(|k| of(k).from[c]), |c| f32x8::from_fn(|k| of(k).change[c]))
    }

    /// The stretches that eight numbers lie in.
    #[inline(always)]
    fn stretches_at<L: Lane>(&self, value: L) -> [u32; LANES] {
        let lanes = value.lanes();
        let end = match self.places.last() {
            Some(&end) if self.places.len() <= FEW_PLACES => L::lit(end),
            _ => return each_lane(|k| self.stretch_at(lanes[k]) as u32),
        };
        // As below, place by place: those before the first that a number is not above.
        let (mut above, mut count, one) = (Mask::<L>::all_set(), L::zero(), L::lit(1.0));
        for &place in &self.places {
            above &= !value.le(L::lit(place));
            count += above.keep(one);
        }
        let len = L::lit(self.places.len() as f64);
        let at = value.ge(end).select(len, count.lt(len).keep(count));
        at.cast::<f32x8>().trunc_int().to_array().map(|at| at as u32)
    }

    /// The stretch that a number lies in.
    #[inline(always)]
    fn stretch_at<S: Scalar>(&self, value: S) -> usize {
        let Some(&end) = self.places.last() else { return 0 };
        if value >= S::from_f64(end) {
            return self.places.len();
        }
        let below = |place: &f64| !(value <= S::from_f64(*place));
        let first = match self.rising {
            true => self.places.partition_point(below),
            false => self.places.iter().position(|place| !below(place)).unwrap_or(self.places.len()),
        };
        // What is no number lies below no place.
        if first == self.places.len() { 0 } else { first }
    }
}

/// How far into stretches numbers are, by their `before`, `end` and `width`.
#[inline(always)]
fn share<L: Lane>(value: L, [before, end, width]: [L; 3]) -> f32x8 {
    let one = L::lit(1.0);
    let inside = width.gt(L::zero());
    let share = inside.select((value - before) / width, one);
    value.equal(end).select(one, share).cast()
}

#[inline(always)]
fn mixed(share: f32x8, from: impl Fn(usize) -> f32x8, change: impl Fn(usize) -> f32x8) -> Colors {
    let [r, g, b, filter, transmit] = [0, 1, 2, 3, 4].map(|c| from(c) + change(c) * share);
    Colors { rgb: Vec3::new(r, g, b), filter, transmit }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::f64x8;

    /// As a list is read from its front: the first entry at or above the number.
    fn plain(map: &ColorMap, v: f64) -> f64 {
        let (end, last) = map.entries.last().expect("an entry");
        if v >= *end {
            return last.rgb.x;
        }
        let k = map.entries.iter().position(|(place, _)| v <= *place).unwrap_or(0);
        let (place, color) = map.entries[k];
        if k == 0 || v == place {
            return color.rgb.x;
        }
        let (before, from) = map.entries[k - 1];
        if place > before {
            from.rgb.x + (color.rgb.x - from.rgb.x) * ((v - before) / (place - before))
        } else {
            color.rgb.x
        }
    }

    #[test]
    fn numbers_have_the_colours_of_the_list() {
        for places in [
            vec![0.5],
            vec![0.0, 1.0],
            vec![0.1, 0.4, 0.4, 0.9],
            vec![0.8, 0.2, 0.5],
            vec![0.0, 0.3, 0.3, 0.3, 0.2, 1.0],
            (0..=FEW_PLACES).map(|k| k as f64 / FEW_PLACES as f64).collect(),
        ] {
            let grey = |k: usize| Color::opaque(((k * 7 + 3) % 11) as f64 / 11.0, 0.0, 0.0);
            let map =
                ColorMap { entries: places.iter().enumerate().map(|(k, &place)| (place, grey(k))).collect() };
            let ramp = Ramp::new(&map);
            let mut numbers: Vec<f64> = (-8..=24).map(|k| f64::from(k) / 16.0).collect();
            numbers.extend(&places);
            numbers.extend([f64::NAN, f64::INFINITY, f64::NEG_INFINITY]);
            for eight in numbers.chunks(LANES) {
                let lanes = f64x8::from_fn(|k| eight.get(k).copied().unwrap_or(0.3));
                let found = ramp.look_up(lanes).rgb.x.to_array();
                for (v, found) in eight.iter().zip(found) {
                    let same = ramp.look_up(f64x8::splat(*v)).rgb.x.to_array()[0];
                    let expected = plain(&map, *v);
                    assert!(
                        (f64::from(found) - expected).abs() < 1e-7 && found == same,
                        "{v}: {found} for {expected} in {places:?}"
                    );
                }
            }
        }
        assert_eq!(
            Ramp::new(&ColorMap { entries: vec![] }).look_up(f64x8::zero()).rgb.x.to_array(),
            [0.0; LANES]
        );
    }
}
