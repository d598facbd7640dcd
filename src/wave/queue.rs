//! Rays that wait, eight to a packet.
//!
//! A packet that comes nearly full and whose rays share an octant is kept as it is: its rays are neighbours, and
//! nothing is moved. The rays of other packets are taken apart into one open packet per octant, so that what is traced
//! later is full and of one octant again, wherever its rays came from.

use crate::compile::{NO_SURFACE, SurfaceId};
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Vec3, f32x8};
use smallvec::SmallVec;

/// A packet with this many rays of one octant is not taken apart.
const KEPT_WHOLE: u32 = 7;
/// Octants of directions.
const OCTANTS: usize = 8;

/// Eight of something, some of which are there.
pub trait Packet: Copy + Default {
    /// A bit for each lane that holds one.
    fn lanes(&self) -> u8;
    /// Says which lanes hold one.
    fn set_lanes(&mut self, lanes: u8);
    /// By axis, a bit for each lane whose direction is negative.
    fn signs(&self) -> [u8; 3];
    /// Lane `from` of `other` becomes lane `to`.
    fn put(&mut self, to: usize, other: &Self, from: usize);
}

/// Lines in space, and which surface they start on.
#[derive(Debug, Clone, Copy)]
pub struct Lines<L> {
    /// Starts in compiled space, unit directions.
    pub rays: Rays<L>,
    /// The surface a ray starts on, or [`NO_SURFACE`].
    pub left: [SurfaceId; LANES],
    /// The part of it.
    pub part: [u8; LANES],
}

impl<L: Lane> Default for Lines<L> {
    fn default() -> Self {
        let rays = Rays { origin: Vec3::default(), dir: Vec3::default() };
        Self { rays, left: [NO_SURFACE; LANES], part: [0; LANES] }
    }
}

impl<L: Lane> Lines<L> {
    fn signs(&self) -> [u8; 3] {
        let dir = self.rays.dir;
        [dir.x, dir.y, dir.z].map(|d| d.lt(L::zero()).bits())
    }

    #[inline(always)]
    fn put(&mut self, to: usize, other: &Self, from: usize) {
        put3(&mut self.rays.origin, to, &other.rays.origin, from);
        put3(&mut self.rays.dir, to, &other.rays.dir, from);
        self.left[to] = other.left[from];
        self.part[to] = other.part[from];
    }
}

/// Lane `from` of `other` becomes lane `to` of `lane`.
#[inline(always)]
pub fn put<L: Lane>(lane: &mut L, to: usize, other: &L, from: usize) {
    lane.lanes_mut()[to] = other.lanes()[from];
}

/// Lane `from` of `other` becomes lane `to` of `v`.
#[inline(always)]
pub fn put3<L: Lane>(v: &mut Vec3<L>, to: usize, other: &Vec3<L>, from: usize) {
    put(&mut v.x, to, &other.x, from);
    put(&mut v.y, to, &other.y, from);
    put(&mut v.z, to, &other.z, from);
}

/// Rays that carry light to a sum: camera, reflected or refracted ones. (Light is in single precision whatever rays are
/// traced in, as POV-Ray's is and as a film keeps it.)
#[derive(Debug, Clone, Copy, Default)]
pub struct Carriers<L: Lane> {
    /// Where they go.
    pub lines: Lines<L>,
    /// What the light they bring is multiplied by.
    pub throughput: Vec3<f32x8>,
    /// POV-Ray's weight, held against `adc_bailout`.
    pub weight: L,
    /// Share of the pixel's transmit they would add if they hit nothing.
    pub share: f32x8,
    /// Which sum they add to.
    pub sink: [u32; LANES],
    /// Rays traced so far on the way from the eye, this one included.
    pub level: [u16; LANES],
    /// What they travel in: a list in the tile's [`super::medium::Media`].
    pub medium: [u32; LANES],
    /// Lanes that hold a ray.
    pub lanes: u8,
}

impl<L: Lane> Packet for Carriers<L> {
    fn lanes(&self) -> u8 {
        self.lanes
    }
    fn set_lanes(&mut self, lanes: u8) {
        self.lanes = lanes;
    }
    fn signs(&self) -> [u8; 3] {
        self.lines.signs()
    }
    #[inline(always)]
    fn put(&mut self, to: usize, other: &Self, from: usize) {
        self.lines.put(to, &other.lines, from);
        put3(&mut self.throughput, to, &other.throughput, from);
        put(&mut self.weight, to, &other.weight, from);
        put(&mut self.share, to, &other.share, from);
        self.sink[to] = other.sink[from];
        self.level[to] = other.level[from];
        self.medium[to] = other.medium[from];
    }
}

/// Rays to one light.
#[derive(Debug, Clone, Copy, Default)]
pub struct Feelers<L: Lane> {
    /// Where they go.
    pub lines: Lines<L>,
    /// Distance to the light.
    pub t_max: L,
    /// Light that reaches the sum if nothing is in the way.
    pub light: Vec3<f32x8>,
    /// Which sum.
    pub sink: [u32; LANES],
    /// What they start in.
    pub medium: [u32; LANES],
    /// Lanes that hold a ray.
    pub lanes: u8,
}

impl<L: Lane> Packet for Feelers<L> {
    fn lanes(&self) -> u8 {
        self.lanes
    }
    fn set_lanes(&mut self, lanes: u8) {
        self.lanes = lanes;
    }
    fn signs(&self) -> [u8; 3] {
        self.lines.signs()
    }
    #[inline(always)]
    fn put(&mut self, to: usize, other: &Self, from: usize) {
        self.lines.put(to, &other.lines, from);
        put(&mut self.t_max, to, &other.t_max, from);
        put3(&mut self.light, to, &other.light, from);
        self.sink[to] = other.sink[from];
        self.medium[to] = other.medium[from];
    }
}

/// Packets that stand together, and are taken out together.
#[derive(Debug, Clone, Default)]
pub struct Batch<P> {
    /// As many as there are `octants` are packets that wait; the next, if there is one, is where a packet is made. What comes after is
    /// of earlier use.
    packets: Vec<P>,
    /// Of each packet, that of its first ray.
    octants: Vec<u8>,
    /// Numbers of the packets, where they were put in an order.
    order: Vec<u32>,
}

impl<P> Batch<P> {
    /// The packets as they came.
    pub fn packets(&self) -> &[P] {
        &self.packets[..self.octants.len()]
    }

    /// The packets in groups of `size`, of which the last may be smaller: those of one octant together, else as they came.
    pub fn by_octant(
        &mut self,
        size: usize,
    ) -> impl Iterator<Item = impl ExactSizeIterator<Item = &P> + Clone> {
        let Self { packets, octants, order } = self;
        let mut places = [0; OCTANTS + 1];
        for &octant in &*octants {
            places[usize::from(octant) + 1] += 1;
        }
        for octant in 0..OCTANTS {
            places[octant + 1] += places[octant];
        }
        order.clear();
        order.resize(octants.len(), 0);
        for (number, &octant) in octants.iter().enumerate() {
            let place = &mut places[usize::from(octant)];
            order[*place as usize] = number as u32;
            *place += 1;
        }
        let packets = &*packets;
        order.chunks(size).map(move |group| group.iter().map(move |&number| &packets[number as usize]))
    }
}

/// Packets that wait. Nothing is allocated once the queue has been as long as it gets.
#[derive(Debug)]
pub struct Queue<P> {
    /// Packets that wait in all.
    ready: usize,
    /// Batches of `size` packets, or few more.
    full: Vec<Batch<P>>,
    /// The one that grows.
    last: Batch<P>,
    size: usize,
    /// So many packets a batch makes room for at first.
    room: usize,
    /// Empty ones.
    spare: Vec<Batch<P>>,
    /// One for each octant, filled ray by ray.
    open: Vec<P>,
    /// Packets may be of several octants.
    mixed: bool,
    rays: u64,
    taken: u64,
}

impl<P: Packet> Queue<P> {
    /// An empty one, of batches of `size` packets (at least 1), or few more, each of which makes room for `room` packets at first;
    /// with `mixed` packets may be of several octants (see [`Traversal::wants_octants`](crate::bvh::Traversal::wants_octants)).
    pub fn new(size: usize, room: usize, mixed: bool) -> Self {
        Self {
            ready: 0,
            full: Vec::new(),
            last: Batch::default(),
            size,
            room,
            spare: Vec::new(),
            open: vec![P::default(); OCTANTS],
            mixed,
            rays: 0,
            taken: 0,
        }
    }

    /// Where the next packet is to be made, for [`Queue::push`] to take; it holds what was there before.
    #[inline]
    pub fn next(&mut self) -> &mut P {
        let Batch { packets, octants, .. } = &mut self.last;
        if packets.len() == octants.len() {
            // A list that doubles again and again leaves lists of all lengths behind it: memory that the system had to clear first.
            packets.reserve_exact(if packets.is_empty() { self.room } else { 0 });
            packets.push(P::default());
        }
        &mut packets[octants.len()]
    }

    /// Takes the rays of the packet made in [`Queue::next`].
    #[inline]
    pub fn push(&mut self) {
        let Some(packet) = self.last.packets.get(self.last.octants.len()) else { return };
        let lanes = packet.lanes();
        if lanes == 0 {
            return;
        }
        self.rays += u64::from(lanes.count_ones());
        // To a queue that mixes octants all are one.
        let signs = if self.mixed { [0; 3] } else { packet.signs() };
        let one_octant = self.mixed || signs.iter().all(|&s| s & lanes == 0 || s & lanes == lanes);
        if one_octant && lanes.count_ones() >= KEPT_WHOLE {
            let octant = if self.mixed { 0 } else { octant_of(signs, lanes.trailing_zeros()) };
            self.add(&[octant]);
        } else {
            self.take_apart(lanes, signs);
        }
    }

    /// The next packets of the last batch are ready, which are of these octants.
    #[inline(always)]
    fn add(&mut self, octants: &[u8]) {
        self.last.octants.extend_from_slice(octants);
        self.ready += octants.len();
        if self.last.octants.len() >= self.size {
            self.full.push(std::mem::replace(&mut self.last, self.spare.pop().unwrap_or_default()));
        }
    }

    #[inline(never)]
    fn take_apart(&mut self, mut lanes: u8, signs: [u8; 3]) {
        let (place, mut filled) = (self.last.octants.len(), SmallVec::<[u8; OCTANTS]>::new());
        while lanes != 0 {
            let from = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let octant = octant_of(signs, from as u32);
            let (open, packets) = (&mut self.open[usize::from(octant)], &mut self.last.packets);
            let to = open.lanes().count_ones() as usize;
            open.put(to, &packets[place], from);
            open.set_lanes(open.lanes() << 1 | 1);
            if to + 1 == LANES {
                // Behind the one that is being taken apart.
                filled.push(octant);
                if packets.len() == place + filled.len() {
                    packets.push(P::default());
                }
                packets[place + filled.len()] = *open;
                open.set_lanes(0);
            }
        }
        // In whose place the last of them comes. (Together they may make a batch that is longer than others.)
        if !filled.is_empty() {
            self.last.packets[place] = self.last.packets[place + filled.len()];
            filled.rotate_right(1);
            self.add(&filled);
        }
    }

    /// Packets that are ready.
    pub fn len(&self) -> usize {
        self.ready
    }

    /// Rays pushed since the last call.
    pub fn take_count(&mut self) -> u64 {
        std::mem::take(&mut self.rays)
    }

    /// Packets taken out since the last call.
    pub fn take_packet_count(&mut self) -> u64 {
        std::mem::take(&mut self.taken)
    }

    /// Makes open packets ready, full or not.
    pub fn flush(&mut self) {
        for octant in 0..OCTANTS {
            // (Most are empty, and to copy one takes longer than to look.)
            if self.open[octant].lanes() == 0 {
                continue;
            }
            let open = self.open[octant];
            let next = self.next();
            *next = open;
            // Lanes without a ray hold numbers like the others.
            for to in open.lanes().count_ones() as usize..LANES {
                next.put(to, &open, 0);
            }
            self.add(&[octant as u8]);
            self.open[octant].set_lanes(0);
        }
    }

    /// Takes out a batch, in place of what has been worked off of `batch`: the last that is full, or what there is.
    pub fn take(&mut self, batch: &mut Batch<P>) {
        let taken = self.full.pop().unwrap_or_else(|| std::mem::take(&mut self.last));
        let mut spare = std::mem::replace(batch, taken);
        spare.octants.clear();
        self.spare.push(spare);
        if self.last.packets.is_empty() {
            self.last = self.spare.pop().unwrap_or_default();
        }
        self.ready -= batch.octants.len();
        self.taken += batch.octants.len() as u64;
    }
}

/// Bit `axis` set where the lane's direction is negative.
fn octant_of(signs: [u8; 3], lane: u32) -> u8 {
    let [x, y, z] = signs.map(|s| s >> (lane & 7) & 1);
    x | y << 1 | z << 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::f64x8;

    fn packet(lanes: u8, dir: impl Fn(usize) -> f64) -> Carriers<f64x8> {
        let mut packet = Carriers::<f64x8> { lanes, ..Carriers::default() };
        packet.lines.rays.dir = Vec3::new(f64x8::from_fn(&dir), f64x8::lit(1.0), f64x8::lit(1.0));
        packet.sink = std::array::from_fn(|k| k as u32);
        packet
    }

    fn push(queue: &mut Queue<Carriers<f64x8>>, packet: Carriers<f64x8>) {
        *queue.next() = packet;
        queue.push();
    }

    fn sinks(queue: &Queue<Carriers<f64x8>>) -> Vec<Vec<u32>> {
        let of =
            |p: &Carriers<f64x8>| (0..LANES).filter(|k| p.lanes >> k & 1 == 1).map(|k| p.sink[k]).collect();
        queue.last.packets().iter().map(of).collect()
    }

    #[test]
    fn nearly_full_packets_of_one_octant_stay_whole() {
        let mut queue = Queue::new(8, 8, false);
        push(&mut queue, packet(0b1111_0111, |_| 1.0));
        assert_eq!(sinks(&queue), [[0, 1, 2, 4, 5, 6, 7]]);
    }

    #[test]
    fn mixed_rays_are_sorted_by_octant() {
        let mut queue = Queue::new(8, 8, false);
        let alternating = packet(0xff, |k| if k % 2 == 0 { 1.0 } else { -1.0 });
        push(&mut queue, alternating);
        assert_eq!(queue.len(), 0);
        push(&mut queue, alternating);
        // Both get full at once; the last comes first.
        assert_eq!(sinks(&queue), [[1, 3, 5, 7, 1, 3, 5, 7], [0, 2, 4, 6, 0, 2, 4, 6]]);
        assert_eq!(queue.take_count(), 16);
        let mut taken = Batch::default();
        queue.take(&mut taken);
        assert_eq!((queue.len(), queue.take_packet_count()), (0, 2));
        let packets: Vec<_> = taken.by_octant(1).flatten().collect();
        assert_eq!(packets.len(), 2);
        for packet in packets {
            let negative = packet.lines.rays.dir.x.lt(f64x8::zero()).bits();
            assert!(negative == 0 || negative == 0xff);
        }
    }

    #[test]
    fn batches_come_whole_and_every_ray_once() {
        let mut queue = Queue::new(4, 4, false);
        let mut sent = 0;
        for k in 0..40u8 {
            // Some whole, others of two octants, of which both may get full at once.
            let split = packet(0xff, |lane| if k % 3 == 0 || lane < 4 { 1.0 } else { -1.0 });
            push(&mut queue, Carriers { sink: [u32::from(k); LANES], ..split });
            sent += LANES;
        }
        queue.flush();
        let (waiting, mut batch, mut found, mut lengths) =
            (queue.len(), Batch::default(), [0; 40], Vec::new());
        while queue.len() > 0 {
            queue.take(&mut batch);
            lengths.push(batch.packets().len());
            for packet in batch.by_octant(3).flatten() {
                let lanes = (0..LANES).filter(|lane| packet.lanes >> lane & 1 == 1);
                lanes.for_each(|lane| found[packet.sink[lane] as usize] += 1);
            }
        }
        assert_eq!((lengths.iter().sum::<usize>(), sent), (waiting, found.iter().sum()));
        assert!(found.iter().all(|&n| n == LANES));
        let (_, others) = lengths.split_last().unwrap();
        assert!(others.iter().all(|len| (4..12).contains(len)), "{lengths:?}");
    }

    #[test]
    fn what_is_open_waits_for_the_flush() {
        let mut queue = Queue::new(8, 8, false);
        push(&mut queue, packet(0b0000_0110, |_| 1.0));
        assert_eq!(queue.len(), 0);
        queue.flush();
        assert_eq!(sinks(&queue), [[1, 2]]);
        queue.flush();
        assert_eq!(queue.len(), 1);
    }
}
