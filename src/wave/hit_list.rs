//! Hits until they are shaded: which of them are together, eight to a packet, as they see one texture program.

use super::hits::{Hit, Looks, resolve};
use super::query::Query;
use super::queue::{Carriers, put};
use super::shown::Shown;
use crate::compile::Compiled;
use crate::lane::{LANES, Lane, Scalar, Vec3, bits, choose, each_number, equal_lanes};

/// A packet in which this many rays see one program is shaded as it is, the other lanes idle: cheaper than to move them.
const SHADED_WHOLE: u32 = 6;

/// Who sent rays: a refracted ray sees what the ray before it saw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sender {
    /// The camera.
    Camera,
    /// A mirror.
    Mirror,
}

/// Eight hits on surfaces of one texture program.
#[derive(Debug, Clone, Copy)]
pub struct Found<L: Lane> {
    /// Where, and what is known of them.
    pub hit: Hit<L>,
    /// The program's number.
    pub program: u32,
    /// Who sent the rays.
    pub sender: Sender,
}

/// Hits, until they are shaded.
#[derive(Debug, Default)]
pub struct HitList<L: Lane> {
    /// The first so many wait to be shaded; what comes after is of earlier use.
    found: Vec<Found<L>>,
    count: usize,
    /// Hits that share their packet with too few of their kind, until there are others: a packet being filled for each texture program
    /// and sender that has come up.
    open: Vec<Found<L>>,
    /// By program and sender: place in `open`, or [`NO_PLACE`].
    place: Vec<u32>,
    filled: usize,
}

const NO_PLACE: u32 = u32::MAX;

impl<L: Lane> HitList<L> {
    /// Forgets which programs have come up: the order in which they did hangs on the tiles before.
    pub fn begin_tile(&mut self) {
        self.open.clear();
        self.place.clear();
    }

    /// How many packets can be shaded.
    #[inline(always)]
    pub fn ready(&self) -> usize {
        self.count
    }

    /// Those, which wait no more.
    pub fn all_ready(&mut self) -> &[Found<L>] {
        &self.found[..std::mem::take(&mut self.count)]
    }

    /// Where the next packet that can be shaded is to be made; it holds what was there before.
    #[inline(always)]
    fn next(&mut self) -> &mut Found<L> {
        if self.found.len() == self.count {
            let (program, sender) = (0, Sender::Camera);
            self.found.push(Found { hit: Hit::default(), program, sender });
        }
        &mut self.found[self.count]
    }

    /// Takes the hits of a packet: those worth shading as they are can be, the others wait.
    #[inline]
    pub fn take<S: Scalar<Lane = L>, B: Scalar>(
        &mut self,
        scene: &Compiled<S, B>,
        carriers: &Carriers<L>,
        query: &mut Query<L>,
        sender: Sender,
        shown: &mut Shown,
    ) {
        let lanes = query.hits();
        if lanes == 0 {
            return;
        }
        let found = resolve(&scene.geometry, query);
        let looks = Looks::of(scene, query, &found, lanes);
        let facing = found.normal.dot(carriers.lines.rays.dir);
        let behind = facing.gt(L::zero());
        // (Field by field, as it would be made somewhere else and copied.)
        let Found { hit, program: seen, sender: from } = self.next();
        hit.point = found.point;
        hit.dir = carriers.lines.rays.dir;
        hit.normal = Vec3::select(behind, -found.normal, found.normal);
        hit.cos = facing.abs();
        hit.distance = query.t;
        hit.throughput = carriers.throughput;
        hit.weight = carriers.weight;
        hit.share = carriers.share;
        hit.sink = carriers.sink;
        hit.level = carriers.level;
        hit.medium = carriers.medium;
        hit.interior = looks.interior;
        hit.double_illuminate = looks.double_illuminate;
        hit.outside = !behind.bits();
        hit.surface = query.surface;
        hit.part = found.part;
        hit.texture = looks.texture;
        *from = sender;

        let program = |texture: u32| scene.textures.textures[texture as usize].program;
        let programs = each_number(&looks.texture, program);
        let mut waiting = lanes & !looks.cuts & !looks.blends;
        let (mut single, mut whole) = (0u8, 0u8);
        while waiting != 0 {
            let first = waiting.trailing_zeros() as usize & (LANES - 1);
            let same = equal_lanes(&programs, programs[first]) & waiting;
            waiting &= !same;
            if same.count_ones() < SHADED_WHOLE {
                single |= same;
                continue;
            }
            // (At most once: that many of eight are more than half.)
            whole = same;
            hit.texture = choose(same, &looks.texture, &[looks.texture[first]; LANES]);
            *seen = programs[first];
        }
        hit.active = whole;
        let others = single | looks.cuts | looks.blends;
        if others == 0 {
            self.count += 1;
            return;
        }
        let hit = *hit;
        self.count += usize::from(whole != 0);
        for k in bits(others) {
            for &(texture, share) in shown.find(scene, query, (&looks, &found), k) {
                self.put(&hit, k, (texture, share), (program(texture), sender));
            }
        }
    }

    /// Adds one lane of `hit`, seen with `texture` for a `share`, to the packet of its program and sender.
    fn put(
        &mut self,
        hit: &Hit<L>,
        lane: usize,
        (texture, share): (u32, f64),
        (program, sender): (u32, Sender),
    ) {
        let key = program as usize * 2 + sender as usize;
        if self.place.len() <= key {
            self.place.resize(key + 1, NO_PLACE);
        }
        if self.place[key] == NO_PLACE {
            self.place[key] = self.open.len() as u32;
            self.open.push(Found { hit: Hit::default(), program, sender });
        }
        let place = self.place[key] as usize;
        let open = &mut self.open[place].hit;
        let to = open.active.count_ones() as usize;
        open.put(to, hit, lane);
        open.texture[to] = texture;
        if share != 1.0 {
            let Hit { throughput, share: shown, weight, .. } = open;
            let Vec3 { x, y, z } = throughput;
            for scaled in [x, y, z, shown] {
                scaled.lanes_mut()[to] *= share as f32;
            }
            let product = *weight * L::lit(share);
            put(weight, to, &product, to);
        }
        open.active = open.active << 1 | 1;
        self.filled += 1;
        if to + 1 == LANES {
            self.close(place);
            self.filled -= LANES;
        }
    }

    /// The packet that is being filled at a place in `open` can be shaded, and is empty again.
    fn close(&mut self, place: usize) {
        *self.next() = self.open[place];
        self.count += 1;
        self.open[place].hit.active = 0;
    }

    /// Makes packets that are being filled ready, full or not; false if there are none.
    pub fn flush(&mut self) -> bool {
        if self.filled == 0 {
            return false;
        }
        for place in 0..self.open.len() {
            let hit = &mut self.open[place].hit;
            if hit.active != 0 {
                // Lanes without a hit repeat the first: nothing that they make is kept.
                let first = *hit;
                for to in hit.active.count_ones() as usize..LANES {
                    hit.put(to, &first, 0);
                }
                self.close(place);
            }
        }
        self.filled = 0;
        true
    }
}
