//! Rays in columns, and what they hit: what goes into the workbench and what comes out.
//!
//! Plain numbers in single precision, as files hold them. It knows neither files nor how rays are traced.

/// `n` rays that are traced together; every column is `n` long.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RaySet {
    /// Starts by axis, in scene units.
    pub origin: [Vec<f32>; 3],
    /// Directions by axis, of any length but 0 (see [`RaySet::is_ray`]).
    pub dir: [Vec<f32>; 3],
    /// Hits at or before this do not count, in lengths of the direction.
    pub t_near: Vec<f32>,
    /// Hits at or beyond this do not count; may be infinite.
    pub t_far: Vec<f32>,
    /// What is asked of the rays.
    pub query: RayQuery,
}

/// What is asked of rays.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum RayQuery {
    /// What they hit first.
    #[default]
    Closest,
    /// Whether they hit anything.
    Any,
}

/// What rays hit, row by row of their [`RaySet`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RayHits {
    /// Closest hit: its distance in lengths of the direction, infinite for none. Any hit: minus infinity if there is
    /// one, else the ray's `t_far`.
    pub t: Vec<f32>,
    /// Closest hit: which primitive, counted in the order of the geometry's file; [`NO_PRIMITIVE`] for none. Any hit:
    /// 1 if there is one, else 0.
    pub primitive: Vec<u32>,
}

/// Nothing was hit.
pub const NO_PRIMITIVE: u32 = u32::MAX;

/// Two distances count as the same if they differ by less than this share of the greater: 80 to 170 roundings of single
/// precision, and far less than what moves a pixel.
pub const SAME_DISTANCE: f32 = 1e-5;

impl RaySet {
    /// Rays.
    pub fn len(&self) -> usize {
        self.t_far.len()
    }

    /// True without rays.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// True of a start and a direction that rays can have: finite, and somewhere.
    ///
    /// A direction counts as none if the squares of its numbers vanish in single precision.
    pub fn is_ray(origin: [f32; 3], dir: [f32; 3]) -> bool {
        let squares = dir.iter().map(|c| c * c).sum::<f32>();
        origin.iter().chain(&dir).all(|c| c.is_finite()) && squares > 0.0
    }

    /// Adds a ray.
    pub fn push(&mut self, origin: [f32; 3], dir: [f32; 3], (near, far): (f32, f32)) {
        for axis in 0..3 {
            self.origin[axis].push(origin[axis]);
            self.dir[axis].push(dir[axis]);
        }
        self.t_near.push(near);
        self.t_far.push(far);
    }
}

impl RayHits {
    /// Rays that hit something.
    pub fn count(&self, query: RayQuery) -> usize {
        match query {
            RayQuery::Closest => self.primitive.iter().filter(|&&p| p != NO_PRIMITIVE).count(),
            RayQuery::Any => self.primitive.iter().filter(|&&p| p != 0).count(),
        }
    }

    /// Rows where the two say something else: a hit against none, another distance (by more than [`SAME_DISTANCE`]),
    /// or another answer. Which of two primitives at one distance is named does not count.
    pub fn differing(&self, other: &Self, query: RayQuery) -> Vec<usize> {
        let same_distance = |a: f32, b: f32| a == b || (a - b).abs() <= SAME_DISTANCE * a.abs().max(b.abs());
        let same = |row: usize| match query {
            RayQuery::Any => self.primitive[row] == other.primitive[row],
            RayQuery::Closest => {
                let (a, b) = (self.primitive[row] == NO_PRIMITIVE, other.primitive[row] == NO_PRIMITIVE);
                a == b && (a || same_distance(self.t[row], other.t[row]))
            }
        };
        (0..self.primitive.len()).filter(|&row| !same(row)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hits_differ_in_answer_or_distance_but_not_in_name() {
        let found = RayHits { t: vec![1.0, 2.0, f32::INFINITY, 3.0], primitive: vec![0, 1, NO_PRIMITIVE, 3] };
        let other = RayHits { t: vec![1.000001, 2.1, 5.0, 3.0], primitive: vec![0, 1, 2, 4] };
        assert_eq!(found.differing(&other, RayQuery::Closest), [1, 2]);
        let any = |primitive: &[u32]| RayHits { t: vec![0.0; 2], primitive: primitive.to_vec() };
        assert_eq!(any(&[1, 0]).differing(&any(&[1, 1]), RayQuery::Any), [1]);
    }
}
