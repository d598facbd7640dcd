//! The test of a run of primitives that are screened, by several packets.
//!
//! A look in single precision leaves few rays of most packets to a row's kernel, which takes as long for one as for eight. So all
//! packets are looked at first, and the rays that are left go to the kernel side by side, whichever packets they are of.

use super::query::Query;
use super::queue::{put, put3};
use super::rows::{Rows, accept, first_left, first_met};
use crate::bvh::{Count, GROUP, Packet, Packets, each_packet};
use crate::kernel::{Block, Left, Looking, Rays, Screened};
use crate::lane::{LANES, Lane, Mask, Scalar, bits_of_many};

/// A packet with this many rays for the kernel brings them as they stand: to move them takes a while, too.
const BROUGHT_WHOLE: u32 = 6;

/// Packets that rows are held against.
pub struct ScreenedPackets<'a, S: Scalar, B: Scalar, C: Count, const ANY: bool> {
    pub rows: Rows<'a>,
    pub packets: &'a mut [Packet<B>],
    pub queries: &'a mut [Query<S::Lane>],
    pub count: &'a mut C,
}

/// Rays for a row's kernel: by packet, a bit for each.
type Open = [u8; GROUP];

impl<S: Scalar, B: Scalar, C: Count, const ANY: bool> ScreenedPackets<'_, S, B, C, ANY> {
    /// Tests all rows against the packets of `which`: a bit for each that found something nearer.
    #[inline(always)]
    pub fn test<K: Block<S>>(&mut self, block: &K, which: Packets) -> Packets {
        let run = self.rows.run;
        let mut found = 0;
        for row in run.first..run.first + run.len {
            let mut met = Open::default();
            let [elsewhere, starting] = self.look(block, row, which, &mut met);
            self.settle(block, row, (&elsewhere, false), &mut met);
            self.settle(block, row, (&starting, true), &mut met);
            for k in each_packet(which) {
                if met[k] != 0 {
                    self.packets[k].found(met[k], self.queries[k].t, ANY);
                    found |= 1 << k;
                }
            }
        }
        found
    }

    /// Looks at a row in single precision: which rays that start elsewhere, and which that start on it, are left to its kernel.
    /// Adds those that have `met` it.
    #[inline(always)]
    fn look<K: Block<S>>(&mut self, block: &K, row: u32, which: Packets, met: &mut Open) -> [Open; 2] {
        let Rows { run, base, ranks } = self.rows;
        let surface = base + row;
        let [mut elsewhere, mut starting] = [Open::default(); 2];
        for k in each_packet(which) {
            let (query, lanes) = (&mut self.queries[k], self.packets[k].live());
            let mut waiting = lanes;
            if query.starts_within(base + run.first, run.len) {
                let on = query.lanes_on(surface) & lanes;
                let left = Left { on: Mask::from_bits(on), part: query.part };
                let gone = if on != 0 { block.left_behind(row as usize, &query.rays, &left) } else { 0 };
                starting[k] = on & !gone;
                waiting &= !on;
            }
            self.count.leaf(1, lanes.count_ones());
            if waiting == 0 {
                continue;
            }
            let screened = block.screen(row as usize, &query.rays, &query.looking(waiting, ANY));
            elsewhere[k] = screened.may_meet.bits();
            if ANY {
                met[k] = accept(query, screened.met_at.cast(), &[surface; LANES], waiting, ranks);
            }
        }
        [elsewhere, starting]
    }

    /// Asks a row's kernel about the rays that are `open`, which all are `starting` on it, or none; adds those that have `met` it.
    #[inline(always)]
    fn settle<K: Block<S>>(&mut self, block: &K, row: u32, (open, starting): (&Open, bool), met: &mut Open) {
        let (mut some, mut whole) = (0, 0);
        for (k, lanes) in open.iter().enumerate() {
            some |= Packets::from(*lanes != 0) << k;
            whole |= Packets::from(lanes.count_ones() >= BROUGHT_WHOLE) << k;
        }
        if some.count_ones() == 1 {
            whole = some;
        }
        let surface = self.rows.base + row;
        let mut rest = *open;
        for k in each_packet(whole) {
            let query = &mut self.queries[k];
            let (lanes, looking) = (std::mem::take(&mut rest[k]), query.looking(open[k], ANY));
            let t = first(block, row, (&query.rays, &query.part), &looking, starting);
            met[k] |= accept(query, t, &[surface; LANES], lanes, self.rows.ranks);
        }
        if some == whole {
            return;
        }
        let mut gathered = Gathered::default();
        for (k, lane) in each_ray(&rest) {
            gathered.add(&self.queries[k], (k, lane));
            if gathered.count == LANES {
                self.ask(block, row, (&mut gathered, starting), met);
            }
        }
        if gathered.count != 0 {
            self.ask(block, row, (&mut gathered, starting), met);
        }
    }

    /// Asks a row's kernel about gathered rays, which then are no more, and adds those that have `met` it.
    #[inline(always)]
    fn ask<K: Block<S>>(
        &mut self,
        block: &K,
        row: u32,
        (gathered, starting): (&mut Gathered<S::Lane>, bool),
        met: &mut Open,
    ) {
        let Gathered { rays, ends: [from, to], part, origins, count } = gathered;
        let lanes = u8::MAX >> (LANES - *count);
        let looking = Looking { from: *from, to: *to, lanes, any: ANY };
        let t = first(block, row, (rays, part), &looking, starting);
        let surface = self.rows.base + row;
        for (&(k, lane), &t) in origins[..*count].iter().zip(t.lanes()) {
            met[k] |= u8::from(self.queries[k].take(lane, t, surface, self.rows.ranks)) << lane;
        }
        *count = 0;
    }
}

/// Where rays that have been looked at meet a row first, by its kernel: all of them are `starting` on it, or none.
#[inline(always)]
fn first<S: Scalar, K: Block<S>>(
    block: &K,
    row: u32,
    (rays, part): (&Rays<S::Lane>, &[u8; LANES]),
    looking: &Looking<S::Lane>,
    starting: bool,
) -> S::Lane {
    if starting {
        let left = Left { on: Mask::from_bits(looking.lanes), part: *part };
        return first_left(block, row as usize, rays, &left, looking);
    }
    let screened = Screened::unknown(Mask::from_bits(looking.lanes));
    first_met(block, row as usize, rays, looking, screened)
}

/// The packets and lanes of the rays that are open.
#[inline(always)]
fn each_ray(open: &Open) -> impl Iterator<Item = (usize, usize)> {
    let (halves, _) = open.as_chunks::<LANES>();
    halves.iter().enumerate().flat_map(|(half, packets)| {
        bits_of_many::<{ LANES * LANES }>(u64::from_le_bytes(*packets))
            .map(move |ray| (half * LANES + ray / LANES, ray % LANES))
    })
}

/// Rays of several packets, side by side.
#[derive(Default)]
struct Gathered<L> {
    rays: Rays<L>,
    /// Between which distances they look.
    ends: [L; 2],
    /// Of the surfaces they start on.
    part: [u8; LANES],
    /// Their packets and lanes.
    origins: [(usize, usize); LANES],
    count: usize,
}

impl<L: Lane> Gathered<L> {
    /// Adds the ray in a lane of packet `k`. (There are fewer than eight.)
    #[inline(always)]
    fn add(&mut self, query: &Query<L>, (k, lane): (usize, usize)) {
        let to = self.count & (LANES - 1);
        put3(&mut self.rays.origin, to, &query.rays.origin, lane);
        put3(&mut self.rays.dir, to, &query.rays.dir, lane);
        for (end, of) in self.ends.iter_mut().zip([&query.t_min, &query.t]) {
            put(end, to, of, lane);
        }
        self.part[to] = query.part[lane];
        self.origins[to] = (k, lane);
        self.count = to + 1;
    }
}
