//! How many of eight lanes work: counted by a walk of its own, so that it costs nothing where nobody asks.

use serde::Serialize;
use std::ops::AddAssign;

/// What a walk tells of its tests. A test is one of eight lanes, whatever they hold: a node's boxes against a group, a
/// box against a group's packets or against rays, a primitive against rays, primitives against a ray.
pub trait Count: Default {
    /// A test of boxes with so many lanes at work.
    fn boxes(&mut self, lanes: u32);
    /// So many tests of primitives, each with so many lanes at work.
    fn leaf(&mut self, tests: u32, lanes: u32);
    /// All tests of another walk.
    fn add(&mut self, other: Self);
}

/// Nothing is counted.
impl Count for () {
    #[inline(always)]
    fn boxes(&mut self, _lanes: u32) {}
    #[inline(always)]
    fn leaf(&mut self, _tests: u32, _lanes: u32) {}
    #[inline(always)]
    fn add(&mut self, _other: Self) {}
}

/// Tests of eight lanes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Tests {
    /// How many.
    pub tests: u64,
    /// Lanes at work in all of them together.
    pub lanes: u64,
}

impl Tests {
    /// Lanes at work in a test, 0 to 8; `None` without tests.
    pub fn mean_lanes(&self) -> Option<f64> {
        (self.tests != 0).then(|| self.lanes as f64 / self.tests as f64)
    }

    fn count(&mut self, tests: u32, lanes: u32) {
        self.tests += u64::from(tests);
        self.lanes += u64::from(tests) * u64::from(lanes);
    }
}

/// What walks have tested.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Occupancy {
    /// Tests of boxes.
    #[serde(rename = "box")]
    pub boxes: Tests,
    /// Tests of primitives.
    pub leaf: Tests,
}

impl Count for Occupancy {
    fn boxes(&mut self, lanes: u32) {
        self.boxes.count(1, lanes);
    }

    fn leaf(&mut self, tests: u32, lanes: u32) {
        self.leaf.count(tests, lanes);
    }

    fn add(&mut self, other: Self) {
        *self += other;
    }
}

impl AddAssign for Occupancy {
    fn add_assign(&mut self, other: Self) {
        for (to, from) in [(&mut self.boxes, other.boxes), (&mut self.leaf, other.leaf)] {
            to.tests += from.tests;
            to.lanes += from.lanes;
        }
    }
}
