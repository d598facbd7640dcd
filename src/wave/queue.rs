//! Rays that wait, in columns. Every column is as long as the queue; rows are rays.

use crate::compile::{NO_SURFACE, SurfaceId};
use crate::kernel::Rays;
use crate::lane::{LANES, Lane, Mask, Scalar, Vec3, each_lane};
use glam::DVec3;

/// Three columns of one vector each row.
#[derive(Debug, Clone, Default)]
pub struct Columns3<S> {
    x: Vec<S>,
    y: Vec<S>,
    z: Vec<S>,
}

impl<S: Scalar> Columns3<S> {
    /// Appends the lanes of `v`.
    #[inline(always)]
    pub fn push(&mut self, v: Vec3<S::Lane>, lanes: &LaneList) {
        lanes.push(&mut self.x, &v.x.to_array());
        lanes.push(&mut self.y, &v.y.to_array());
        lanes.push(&mut self.z, &v.z.to_array());
    }

    /// Eight rows by number.
    #[inline(always)]
    pub fn gather(&self, rows: &[u32; LANES]) -> Vec3<S::Lane> {
        Vec3::new(gather(&self.x, rows), gather(&self.y, rows), gather(&self.z, rows))
    }

    /// Eight rows from `first` on.
    #[inline(always)]
    pub fn load(&self, first: usize) -> Vec3<S::Lane> {
        Vec3::new(load(&self.x, first), load(&self.y, first), load(&self.z, first))
    }

    /// One row.
    pub fn row(&self, row: usize) -> DVec3 {
        DVec3::new(self.x[row].to_f64(), self.y[row].to_f64(), self.z[row].to_f64())
    }

    /// Rows from `len` on are dropped.
    pub fn truncate(&mut self, len: usize) {
        self.x.truncate(len);
        self.y.truncate(len);
        self.z.truncate(len);
    }
}

/// The lanes of a packet that go on, as a list: made once, used for every column.
#[derive(Debug, Clone, Copy)]
pub struct LaneList {
    lanes: [u8; LANES],
    len: usize,
}

impl LaneList {
    /// The set bits.
    #[inline(always)]
    pub fn new(bits: u8) -> Self {
        let mut list = Self { lanes: [0; LANES], len: 0 };
        for k in 0..LANES {
            list.lanes[list.len & 7] = k as u8;
            list.len += usize::from(bits >> k & 1);
        }
        list
    }

    /// Appends the list's lanes of `values` to a column.
    #[inline(always)]
    pub fn push<T: Copy>(&self, column: &mut Vec<T>, values: &[T; LANES]) {
        if self.len == LANES {
            column.extend_from_slice(values);
        } else {
            column.extend(self.lanes[..self.len].iter().map(|&k| values[usize::from(k & 7)]));
        }
    }
}

/// Eight rows of a column by number.
#[inline(always)]
pub fn gather<S: Scalar>(column: &[S], rows: &[u32; LANES]) -> S::Lane {
    S::Lane::from_fn(|k| column[rows[k] as usize])
}

/// Eight rows of a column from `first` on; past the end, the last row again.
#[inline(always)]
pub fn load<S: Scalar>(column: &[S], first: usize) -> S::Lane {
    match column.get(first..first + LANES) {
        Some(rows) => S::Lane::from_fn(|k| rows[k]),
        None => S::Lane::from_fn(|k| column[(first + k).min(column.len() - 1)]),
    }
}

/// Eight numbers from `first` on; past the end, `fill`.
#[inline(always)]
pub fn load_numbers<T: Copy + Default>(column: &[T], first: usize, fill: T) -> [T; LANES] {
    match column.get(first..first + LANES) {
        Some(rows) => each_lane(|k| rows[k]),
        None => each_lane(|k| column.get(first + k).copied().unwrap_or(fill)),
    }
}

/// Where rays start and go, and which surface they left.
#[derive(Debug, Default)]
pub struct Geometry<S> {
    /// Starts, in compiled space.
    pub origin: Columns3<S>,
    /// Unit directions.
    pub dir: Columns3<S>,
    /// The surface a ray starts on, or [`NO_SURFACE`].
    pub left: Vec<SurfaceId>,
    /// The part of it.
    pub part: Vec<u8>,
}

impl<S: Scalar> Geometry<S> {
    /// Rows.
    pub fn len(&self) -> usize {
        self.left.len()
    }

    /// Appends the lanes of the list.
    #[inline(always)]
    pub fn push(
        &mut self,
        rays: &Rays<S::Lane>,
        left: &[SurfaceId; LANES],
        part: &[u8; LANES],
        lanes: &LaneList,
    ) {
        self.origin.push(rays.origin, lanes);
        self.dir.push(rays.dir, lanes);
        lanes.push(&mut self.left, left);
        lanes.push(&mut self.part, part);
    }

    /// Rows from `len` on are dropped.
    pub fn truncate(&mut self, len: usize) {
        self.origin.truncate(len);
        self.dir.truncate(len);
        self.left.truncate(len);
        self.part.truncate(len);
    }

    /// Eight rows from `first` on, and which lanes hold one.
    pub fn load(&self, first: usize) -> (Rays<S::Lane>, [SurfaceId; LANES], [u8; LANES], u8) {
        let rays = Rays { origin: self.origin.load(first), dir: self.dir.load(first) };
        let lanes = Mask::<S::Lane>::first(self.len() - first).bits();
        (rays, load_numbers(&self.left, first, NO_SURFACE), load_numbers(&self.part, first, 0), lanes)
    }
}

/// Rays that carry light to a sum: camera, reflected or refracted ones.
#[derive(Debug, Default)]
pub struct RayQueue<S> {
    /// Their lines.
    pub geometry: Geometry<S>,
    /// What the light they bring is multiplied by.
    pub throughput: Columns3<S>,
    /// POV-Ray's weight, held against `adc_bailout`.
    pub weight: Vec<S>,
    /// Share of the pixel's transmit they would add if they hit nothing.
    pub share: Vec<S>,
    /// Which sum they add to.
    pub sink: Vec<u32>,
    /// Rays traced so far on the way from the eye, this one included.
    pub level: Vec<u16>,
    /// What they travel in: a list in the tile's [`super::medium::Media`].
    pub medium: Vec<u32>,
}

/// What [`RayQueue::push`] needs besides the lines.
#[derive(Debug, Clone, Copy)]
pub struct Cargo<L> {
    /// See [`RayQueue::throughput`].
    pub throughput: Vec3<L>,
    /// See [`RayQueue::weight`].
    pub weight: L,
    /// See [`RayQueue::share`].
    pub share: L,
    /// See [`RayQueue::sink`].
    pub sink: [u32; LANES],
    /// See [`RayQueue::level`].
    pub level: [u16; LANES],
    /// See [`RayQueue::medium`].
    pub medium: [u32; LANES],
}

impl<S: Scalar> RayQueue<S> {
    /// Rows.
    pub fn len(&self) -> usize {
        self.sink.len()
    }

    /// Appends the lanes whose bit is set.
    pub fn push(
        &mut self,
        rays: &Rays<S::Lane>,
        left: &[SurfaceId; LANES],
        part: &[u8; LANES],
        cargo: &Cargo<S::Lane>,
        lanes: u8,
    ) {
        if lanes == 0 {
            return;
        }
        let lanes = &LaneList::new(lanes);
        self.geometry.push(rays, left, part, lanes);
        self.throughput.push(cargo.throughput, lanes);
        lanes.push(&mut self.weight, &cargo.weight.to_array());
        lanes.push(&mut self.share, &cargo.share.to_array());
        lanes.push(&mut self.sink, &cargo.sink);
        lanes.push(&mut self.level, &cargo.level);
        lanes.push(&mut self.medium, &cargo.medium);
    }

    /// Moves the rows from `first` on to the empty queue `to`.
    pub fn split_off_into(&mut self, first: usize, to: &mut Self) {
        fn tail<T: Copy>(from: &mut Vec<T>, first: usize, to: &mut Vec<T>) {
            to.clear();
            to.extend_from_slice(&from[first..]);
            from.truncate(first);
        }
        fn tail3<S: Copy>(from: &mut Columns3<S>, first: usize, to: &mut Columns3<S>) {
            tail(&mut from.x, first, &mut to.x);
            tail(&mut from.y, first, &mut to.y);
            tail(&mut from.z, first, &mut to.z);
        }
        tail3(&mut self.geometry.origin, first, &mut to.geometry.origin);
        tail3(&mut self.geometry.dir, first, &mut to.geometry.dir);
        tail(&mut self.geometry.left, first, &mut to.geometry.left);
        tail(&mut self.geometry.part, first, &mut to.geometry.part);
        tail3(&mut self.throughput, first, &mut to.throughput);
        tail(&mut self.weight, first, &mut to.weight);
        tail(&mut self.share, first, &mut to.share);
        tail(&mut self.sink, first, &mut to.sink);
        tail(&mut self.level, first, &mut to.level);
        tail(&mut self.medium, first, &mut to.medium);
    }
}

/// Rays to one light.
#[derive(Debug, Default)]
pub struct ShadowQueue<S> {
    /// Their lines.
    pub geometry: Geometry<S>,
    /// Distance to the light.
    pub t_max: Vec<S>,
    /// Light that reaches the sum if nothing is in the way.
    pub light: Columns3<S>,
    /// Which sum.
    pub sink: Vec<u32>,
    /// What they start in.
    pub medium: Vec<u32>,
}

impl<S: Scalar> ShadowQueue<S> {
    /// Rows.
    pub fn len(&self) -> usize {
        self.sink.len()
    }

    /// Appends the lanes whose bit is set: rays from `surface` (number and part) over `distance`, to bring `light` to
    /// `sink` from within `medium`.
    pub fn push(
        &mut self,
        rays: &Rays<S::Lane>,
        surface: (&[SurfaceId; LANES], &[u8; LANES]),
        distance: S::Lane,
        light: Vec3<S::Lane>,
        (sink, medium): (&[u32; LANES], &[u32; LANES]),
        lanes: u8,
    ) {
        let lanes = &LaneList::new(lanes);
        self.geometry.push(rays, surface.0, surface.1, lanes);
        lanes.push(&mut self.t_max, &distance.to_array());
        self.light.push(light, lanes);
        lanes.push(&mut self.sink, sink);
        lanes.push(&mut self.medium, medium);
    }

    /// Drops all rows.
    pub fn clear(&mut self) {
        self.geometry.truncate(0);
        self.t_max.clear();
        self.light.truncate(0);
        self.sink.clear();
        self.medium.clear();
    }
}
