//! Curves through points: `spline` (manual section 3.1.9; the rules as measured on POV-Ray 3.7).

/// Values at rising places, and how to go between them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spline {
    /// Which curve.
    pub kind: SplineKind,
    /// How many of a value's five components there are.
    pub components: u8,
    /// `(place, value)`, places rising.
    points: Vec<(f64, [f64; 5])>,
    /// The lowest and the highest place so far.
    reach: (f64, f64),
    /// Of natural splines, the second derivative at each point.
    bends: Vec<[f64; 5]>,
}

/// How a spline goes between its points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SplineKind {
    /// Straight.
    #[default]
    Linear,
    /// The parabola through the two points and the one before.
    Quadratic,
    /// Through all but the first and the last point; the slope at a point is the mean of those to its neighbours.
    Cubic,
    /// Curvature is continuous, and none at the ends.
    Natural,
}

impl Spline {
    /// Adds a point in place of one that is there already; but the last of two or more stays as it is (measured).
    /// [`Spline::settle`] must follow.
    pub fn insert(&mut self, place: f64, value: [f64; 5]) {
        let (low, high) = if self.points.is_empty() { (place, place) } else { self.reach };
        if low < high && place == high {
            return;
        }
        self.reach = (low.min(place), high.max(place));
        self.points.push((place, value));
    }

    /// How many points it has.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// True before the first [`Spline::insert`].
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Puts the points in order, and computes what a natural spline needs to know of all its points at once (Press et al., Numerical Recipes,
    /// section 3.3: a tridiagonal system).
    pub fn settle(&mut self) {
        // Of points at one place the last to come is the last still: the sort is stable, and knows one zero.
        self.points.sort_by(|a, b| (a.0 + 0.0).total_cmp(&(b.0 + 0.0)));
        self.points.dedup_by(|later, first| {
            let same = later.0 == first.0;
            if same {
                *first = *later;
            }
            same
        });
        let n = self.points.len();
        self.bends = vec![[0.0; 5]; n];
        if self.kind != SplineKind::Natural || n < 3 {
            return;
        }
        for c in 0..5 {
            let slope = |i: usize| {
                let (a, b) = (&self.points[i], &self.points[i + 1]);
                (b.1[c] - a.1[c]) / (b.0 - a.0)
            };
            let mut diagonal = vec![0.0; n];
            let mut right = vec![0.0; n];
            for i in 1..n - 1 {
                let (before, after) =
                    (self.points[i].0 - self.points[i - 1].0, self.points[i + 1].0 - self.points[i].0);
                diagonal[i] = 2.0 * (before + after);
                right[i] = 6.0 * (slope(i) - slope(i - 1));
                if i > 1 {
                    let share = before / diagonal[i - 1];
                    diagonal[i] -= share * before;
                    right[i] -= share * right[i - 1];
                }
            }
            for i in (1..n - 1).rev() {
                let after = self.points[i + 1].0 - self.points[i].0;
                self.bends[i][c] = (right[i] - after * self.bends[i + 1][c]) / diagonal[i];
            }
        }
    }

    /// The same points with another kind of curve between them.
    pub fn of_kind(&self, kind: SplineKind) -> Spline {
        let mut spline = Spline { kind, ..self.clone() };
        spline.settle();
        spline
    }

    /// The value at `t`; before the first and behind the last point it stays what it is there.
    pub fn value(&self, t: f64) -> [f64; 5] {
        let n = self.points.len();
        let (Some(first), Some(last)) = (self.points.first(), self.points.last()) else { return [0.0; 5] };
        if self.kind == SplineKind::Cubic && n < 4 {
            // No segment has a neighbour on either side: the middle of the points (measured).
            let (a, b) = (self.points[(n - 1) / 2].1, self.points[n / 2].1);
            return std::array::from_fn(|c| 0.5 * (a[c] + b[c]));
        }
        if !(t > first.0) {
            return if self.kind == SplineKind::Cubic { self.points[1].1 } else { first.1 };
        }
        if t >= last.0 {
            return if self.kind == SplineKind::Cubic { self.points[n - 2].1 } else { last.1 };
        }
        // The segment from point `i` to the next.
        let i = self.points.partition_point(|point| point.0 <= t) - 1;
        let mut value = [0.0; 5];
        for (c, value) in value.iter_mut().enumerate() {
            *value = match self.kind {
                SplineKind::Quadratic if n > 2 => self.parabola(i.max(1), c, t),
                SplineKind::Cubic => self.cubic(i, c, t),
                SplineKind::Natural => self.natural(i, c, t),
                _ => self.straight(i, c, t),
            };
        }
        value
    }

    fn point(&self, i: usize, c: usize) -> (f64, f64) {
        (self.points[i].0, self.points[i].1[c])
    }

    fn straight(&self, i: usize, c: usize, t: f64) -> f64 {
        let ((t0, v0), (t1, v1)) = (self.point(i, c), self.point(i + 1, c));
        let share = (t - t0) / (t1 - t0);
        v0 * (1.0 - share) + v1 * share
    }

    fn parabola(&self, i: usize, c: usize, t: f64) -> f64 {
        let ((t0, v0), (t1, v1), (t2, v2)) = (self.point(i - 1, c), self.point(i, c), self.point(i + 1, c));
        v0 * (t - t1) * (t - t2) / ((t0 - t1) * (t0 - t2))
            + v1 * (t - t0) * (t - t2) / ((t1 - t0) * (t1 - t2))
            + v2 * (t - t0) * (t - t1) / ((t2 - t0) * (t2 - t1))
    }

    fn cubic(&self, i: usize, c: usize, t: f64) -> f64 {
        let n = self.points.len();
        // The ends only give a direction.
        if i == 0 {
            return self.points[1].1[c];
        }
        if i + 2 >= n {
            return self.points[n - 2].1[c];
        }
        let slope = |i: usize| {
            let ((t0, v0), (t1, v1)) = (self.point(i, c), self.point(i + 1, c));
            (v1 - v0) / (t1 - t0)
        };
        let ((t0, v0), (t1, v1)) = (self.point(i, c), self.point(i + 1, c));
        let (from, to) = ((slope(i - 1) + slope(i)) / 2.0, (slope(i) + slope(i + 1)) / 2.0);
        let (width, u) = (t1 - t0, (t - t0) / (t1 - t0));
        // Hermite's form.
        let (u2, u3) = (u * u, u * u * u);
        v0 * (2.0 * u3 - 3.0 * u2 + 1.0)
            + v1 * (3.0 * u2 - 2.0 * u3)
            + width * (from * (u3 - 2.0 * u2 + u) + to * (u3 - u2))
    }

    fn natural(&self, i: usize, c: usize, t: f64) -> f64 {
        let ((t0, v0), (t1, v1)) = (self.point(i, c), self.point(i + 1, c));
        let width = t1 - t0;
        let (a, b) = ((t1 - t) / width, (t - t0) / width);
        let bend = |i: usize| self.bends.get(i).map_or(0.0, |bend| bend[c]);
        a * v0 + b * v1 + ((a * a * a - a) * bend(i) + (b * b * b - b) * bend(i + 1)) * width * width / 6.0
    }
}
