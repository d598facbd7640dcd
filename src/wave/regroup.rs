//! Shadow rays whose neighbours start far away, put together anew.
//!
//! Rays to one light are near each other where their starts are. Where neighbouring pixels see things far apart, the bounds of eight
//! neighbours hold much that none of them comes to, and those of a group nearly all that any does: such rays are put in
//! the order of the cells of a grid (Morton 1966, A computer oriented geodetic data base and a new technique in file sequencing; here
//! an axis has as many bits as makes cells about cubes).

use crate::bvh::Traversal;
use crate::lane::{LANES, Lane, Mask, Vec3, f32x8, first_and_last, highest, lowest};

/// Packets that are put in order at a time.
pub const WINDOW: usize = 256;
/// Fewer are left as they are.
const FEWEST: usize = 2 * LANES;
/// So many of them tell where it is not worth it, and so many where it is. (All tell no better, but the memory takes its time.)
const SAMPLES: [usize; 2] = [8, 32];
/// Bits of a cell's number: more do not help windows of this size.
const CELL_BITS: usize = 8;
/// Cells of the grid.
const CELLS: usize = 1 << CELL_BITS;

/// Neighbours lie apart where the ends of a packet do by more than this, as a share of the window's size, times the square root of
/// the number of packets, which is about the share that a packet has of a smooth surface's length. (0.3 to 0.8 on
/// meshes, 1.2 to 1.8 in a soup of triangles or among balls. Half of it costs frames of solids and of tori 1 to 2 %.)
const APART: f32 = 1.3;

/// Puts rays in order; with its buffers.
#[derive(Debug)]
pub struct Regrouping {
    asked_for: bool,
    /// By packet and lane, in which cell a ray starts.
    cells: Vec<[u8; LANES]>,
    order: Vec<u32>,
}

impl Regrouping {
    /// For rays that go through the tree this way: who asks for a way of his own has them as they come.
    pub fn new(traversal: Traversal) -> Self {
        Self { asked_for: traversal == Traversal::Auto, cells: Vec::new(), order: Vec::new() }
    }

    /// The order in which the live rays of up to [`WINDOW`] packets had better be traced, given where they start and which lanes live: for
    /// each ray the packet's number times eight and the lane. `None` if that is as they come.
    pub fn order<'a, L: Lane>(
        &mut self,
        packets: impl ExactSizeIterator<Item = (&'a Vec3<L>, u8)> + Clone,
    ) -> Option<&[u32]> {
        let count = packets.len();
        if !self.asked_for || count < FEWEST {
            return None;
        }
        let sample = |size: usize| Starts::of(packets.clone().step_by(count.div_ceil(size)));
        if !SAMPLES.into_iter().all(|size| sample(size).lie_apart(count)) {
            return None;
        }
        let grid = Grid::around(&Starts::of(packets.clone()))?;
        self.cells.clear();
        let mut places = [0u32; CELLS + 1];
        for (start, lanes) in packets.clone() {
            let cells = grid.cells(start);
            for (k, &cell) in cells.iter().enumerate() {
                places[usize::from(cell) + 1] += u32::from(lanes >> k & 1);
            }
            self.cells.push(cells);
        }
        for cell in 0..CELLS {
            places[cell + 1] += places[cell];
        }
        self.order.clear();
        self.order.resize(places[CELLS] as usize, 0);
        for (number, ((_, lanes), cells)) in packets.zip(&self.cells).enumerate() {
            for (k, &cell) in cells.iter().enumerate().filter(|(k, _)| lanes >> k & 1 == 1) {
                let place = &mut places[usize::from(cell)];
                self.order[*place as usize] = (LANES * number + k) as u32;
                *place += 1;
            }
        }
        Some(&self.order)
    }
}

/// Fills `packets` with rays in this order, which `put` takes to a lane of one from a packet and lane of those that were ordered.
/// Lanes of the last for which there is no ray hold one of the others.
#[inline(always)]
pub fn gather<P: Default + Clone>(
    order: &[u32],
    packets: &mut Vec<P>,
    put: impl Fn(&mut P, usize, (usize, usize)),
) {
    packets.resize(order.len().div_ceil(LANES), P::default());
    for (packet, rays) in packets.iter_mut().zip(order.chunks(LANES)) {
        for to in 0..LANES {
            let ray = rays[to.min(rays.len() - 1)] as usize;
            put(packet, to, (ray / LANES, ray % LANES));
        }
    }
}

/// Where the rays of some packets start.
struct Starts {
    /// The lowest corner of what is around them, by axis.
    low: [f32; 3],
    /// And its size.
    size: [f32; 3],
    /// How far the first ray of a packet starts from the last, on average: the differences by axis, summed.
    apart: f32,
}

impl Starts {
    #[inline(always)]
    fn of<'a, L: Lane>(packets: impl Iterator<Item = (&'a Vec3<L>, u8)>) -> Self {
        let infinite = f32x8::lit(f64::INFINITY);
        let (mut low, mut high) = ([infinite; 3], [-infinite; 3]);
        let (mut apart, mut count) = (0.0, 0.0);
        for (start, lanes) in packets.filter(|&(_, lanes)| lanes != 0) {
            let (live, (first, last)) = (Mask::from_bits(lanes), first_and_last(lanes));
            for (axis, x) in [start.x, start.y, start.z].into_iter().enumerate() {
                let x = x.cast::<f32x8>();
                low[axis] = live.select(x, low[axis]).min(low[axis]);
                high[axis] = live.select(x, high[axis]).max(high[axis]);
                apart += (x.lanes()[last] - x.lanes()[first]).abs();
            }
            count += 1.0;
        }
        let low = low.map(lowest);
        let size = [0, 1, 2].map(|axis| highest(high[axis]) - low[axis]);
        Self { low, size, apart: apart / count }
    }

    /// True if neighbours do, in a window of `count` packets of which these are a sample.
    fn lie_apart(&self, count: usize) -> bool {
        self.apart * (count as f32).sqrt() > APART * self.size.iter().sum::<f32>()
    }
}

/// A grid around starts.
struct Grid {
    low: [f32; 3],
    /// Cells a unit, by axis.
    scale: [f32; 3],
    /// The last cell along an axis.
    last: [f32; 3],
    /// What the place along an axis adds to a cell's number.
    bits: [[u8; CELLS]; 3],
}

impl Grid {
    /// Around `starts`; none if they are nowhere.
    fn around(starts: &Starts) -> Option<Self> {
        let &Starts { low, mut size, .. } = starts;
        if !size.iter().all(|size| size.is_finite()) {
            return None;
        }
        let (mut bits, mut count) = ([[0; CELLS]; 3], [1; 3]);
        let whole = size;
        for bit in (0..CELL_BITS).rev() {
            let longest = (0..3).fold(0, |a, b| if size[b] > size[a] { b } else { a });
            let (bits, count) = (&mut bits[longest], &mut count[longest]);
            // What was one cell becomes two.
            for place in (0..*count).rev() {
                let before: u8 = bits[place];
                (bits[2 * place], bits[2 * place + 1]) = (before, before | 1 << bit);
            }
            *count *= 2;
            size[longest] *= 0.5;
        }
        let scale =
            [0, 1, 2].map(|axis| if whole[axis] > 0.0 { count[axis] as f32 / whole[axis] } else { 0.0 });
        Some(Self { low, scale, last: count.map(|count| (count - 1) as f32), bits })
    }

    /// The numbers of the cells where eight rays start.
    #[inline(always)]
    fn cells<L: Lane>(&self, start: &Vec3<L>) -> [u8; LANES] {
        let mut cells = [0; LANES];
        for (axis, x) in [start.x, start.y, start.z].into_iter().enumerate() {
            let place = (x.cast::<f32x8>() - f32x8::splat(self.low[axis])) * f32x8::splat(self.scale[axis]);
            let place = Lane::max(Lane::min(place, f32x8::splat(self.last[axis])), f32x8::zero());
            // (What is no number is put somewhere.)
            for (cell, place) in cells.iter_mut().zip(place.trunc_int().to_array()) {
                *cell |= self.bits[axis][place as usize % CELLS];
            }
        }
        cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::f64x8;
    use crate::random::Random;
    use glam::DVec3;

    /// 128 packets of 4 by 2 pixels of a picture 32 wide, whose rays start at `depth`.
    fn seen(mut depth: impl FnMut(usize, usize) -> f64) -> Vec<(Vec3<f64x8>, u8)> {
        let ray = |x: usize, y: usize, z: f64| DVec3::new(x as f64 * 0.01, y as f64 * 0.01, z);
        let packet = |number: usize, depth: &mut dyn FnMut(usize, usize) -> f64| {
            let (x, y) = (number % 8 * 4, number / 8 * 2);
            Vec3::from_fn(|k| ray(x + k % 4, y + k / 4, depth(x + k % 4, y + k / 4)))
        };
        (0..128).map(|number| (packet(number, &mut depth), !(1 << (number % 9) as u8))).collect()
    }

    fn order(packets: &[(Vec3<f64x8>, u8)]) -> Option<Vec<u32>> {
        let mut regrouping = Regrouping::new(Traversal::Auto);
        regrouping.order(packets.iter().map(|(start, lanes)| (start, *lanes))).map(<[u32]>::to_vec)
    }

    #[test]
    fn what_starts_together_stays_as_it_is() {
        assert_eq!(order(&seen(|x, y| 0.002 * (x * x + y) as f64)), None);
        // Half of it nearer than the other.
        assert_eq!(order(&seen(|x, _| if x > 16 { 1.0 } else { 2.0 })), None);
        let far = seen(|x, y| ((x * 7 + y * 11) % 13) as f64);
        let mut regrouping = Regrouping::new(Traversal::Packet);
        assert_eq!(regrouping.order(far.iter().map(|(start, lanes)| (start, *lanes))), None);
        assert!(order(&far).is_some());
    }

    #[test]
    fn scattered_rays_come_near_each_other_and_each_once() {
        let mut numbers = Random::new(3);
        let packets = seen(|_, _| numbers.between(1.0, 2.0));
        let found = order(&packets).unwrap();
        let mut sorted = found.clone();
        sorted.sort_unstable();
        let live = |ray: &u32| packets[*ray as usize / LANES].1 >> (ray % 8) & 1 == 1;
        let all: Vec<u32> = (0..8 * packets.len() as u32).filter(live).collect();
        assert_eq!(sorted, all);
        let depth = |ray: &u32| packets[*ray as usize / LANES].0.z.to_array()[*ray as usize % LANES];
        let thick = |rays: &[u32]| {
            let ends = |(low, high): (f64, f64), z: f64| (low.min(z), high.max(z));
            let (low, high) = rays.iter().map(depth).fold((f64::INFINITY, 0.0), ends);
            high - low
        };
        let mean = |rays: &[u32]| rays.chunks(LANES).map(thick).sum::<f64>() / (rays.len() / LANES) as f64;
        // Of eight in a row most lie in one cell, and cells are about a twelfth of the whole.
        assert!(mean(&all) > 0.7 && mean(&found) < 0.25, "{} {}", mean(&all), mean(&found));
    }

    #[test]
    fn starts_without_measure_do_no_harm() {
        for x in [f64::NAN, f64::INFINITY, 1e300, -1e38] {
            let packets = seen(|x1, y| if (x1 + y) % 5 == 0 { x } else { (x1 * 7 % 5) as f64 });
            let count = packets.iter().map(|(_, lanes)| lanes.count_ones()).sum::<u32>();
            if let Some(order) = order(&packets) {
                assert_eq!(order.len(), count as usize);
            }
        }
        let nowhere: Vec<_> = (0..128).map(|_| (Vec3::splat(DVec3::ONE), !0)).collect();
        assert_eq!(order(&nowhere), None);
    }
}
