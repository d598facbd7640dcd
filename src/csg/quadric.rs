//! Quadrics whose inside is convex (elliptic cylinders, paraboloids, ellipsoids) in single precision: where rays come in and go out.

use super::single::{GROWTH, LEAST_SIZE, least, most, rising_roots, single};
use crate::kernel::{OwnSpace, Quadric, Rays};
use crate::lane::{Many, Scalar, Vec3, f32x16};
use glam::{DMat3, DVec3};

/// Squares of a ray's distance count at least by this share of what they could matter: so there are two roots, though one may be far off.
const LEAST_SQUARE: f64 = 8.0 * f32::UNIT_ROUNDOFF;

/// Curvatures of less than this share of the greatest are none, either way.
const FLAT: f64 = 1.0 / (1u64 << 40) as f64;

/// A convex quadric relative to a middle: `|p|^2 + 2 linear . x + level`, where `p = rows (x - center)` and `linear` runs along what the rows
/// do not tell of.
#[derive(Debug, Clone, Copy)]
pub struct ConvexQuadric {
    center: [f32; 3],
    rows: [[f32; 3]; 3],
    linear: [f32; 3],
    /// Of the grown one, and of the shrunk one.
    levels: [f32; 2],
    /// The least square of the length of a direction in its space.
    least_square: f32,
    /// Rays are looked at so far from the middle.
    size: f32,
}

impl ConvexQuadric {
    /// As rays see it that stay within `size` of `middle`; none of what is not convex, or too thin.
    pub(super) fn new(space: &OwnSpace, quadric: &Quadric, middle: DVec3, size: f64) -> Option<Self> {
        let (values, axes) = principal_axes(quadric.matrix);
        let greatest = values.abs().max_element();
        if !(values.min_element() >= -FLAT * greatest) {
            return None;
        }
        // In units that make the greatest curvature 1.
        let unit = 1.0 / greatest;
        let curved = values.cmpgt(DVec3::splat(FLAT * greatest));
        let values = DVec3::select(curved, values * unit, DVec3::ZERO);
        let along = axes.transpose() * quadric.linear * (0.5 * unit);
        let center = axes * DVec3::select(curved, -along / values, DVec3::ZERO);
        let level = (quadric.matrix * center + quadric.linear).dot(center) * unit + quadric.constant * unit;
        let linear = axes * DVec3::select(curved, DVec3::ZERO, along);
        let rows = DMat3::from_diagonal(values.map(f64::sqrt)) * axes.transpose() * space.map;
        let center = space.center + space.map.inverse() * center - middle;
        let linear = space.map.transpose() * linear;
        let level = level - 2.0 * linear.dot(center);
        // How far rays reach in its space, how far the surface does, and what its values come of: these are off by the same share of
        // that as places are of how far they reach.
        let reach = sum(rows) * (center.length() + size);
        let slope = 2.0 * linear.abs().element_sum() * (center.length() + size);
        let within = level.abs() + slope;
        let flat = FLAT * (sum(space.map) * (center.length() + size)).powi(2);
        let by = GROWTH * (2.0 * within.sqrt() * reach + within + GROWTH * reach * reach) + 3.0 * flat;
        if !(by * LEAST_SIZE <= within && GROWTH * LEAST_SIZE * center.length() <= size) {
            return None;
        }
        Some(Self {
            center: single(center),
            rows: [0, 1, 2].map(|k| single(rows.row(k))),
            linear: single(linear),
            levels: [(level - by) as f32, (level + by) as f32],
            least_square: (LEAST_SQUARE / GROWTH * by / (4.0 * size * size)) as f32,
            size: size as f32,
        })
    }

    /// Where rays come in and go out.
    #[inline(always)]
    pub(super) fn ends(&self, rays: &Rays<f32x16>) -> impl Fn(usize) -> [f32x16; 2] {
        let Self { center, rows, linear, levels, least_square, size } = *self;
        let (rows, linear) = (rows.map(Vec3::<f32x16>::broadcast), Vec3::broadcast(linear));
        let Rays { origin, dir } = *rays;
        let own = (origin - Vec3::broadcast(center)).fused_under(&rows);
        let toward = dir.fused_under(&rows);
        let square = most(toward.fused_dot(toward), f32x16::splat(least_square));
        let inv = f32x16::constant(1.0) / square;
        // From where it is nearest to the axis, or as far as is looked: what is counted from there is small where it matters.
        let size = f32x16::splat(size);
        let shift = most(-size, least(size, -own.fused_dot(toward) * inv));
        let (own, origin) = (toward.fused(shift, own), dir.fused(shift, origin));
        let slope = own.fused_dot(toward) + linear.fused_dot(dir);
        let twice = linear.fused_dot(origin);
        let level = own.fused_dot(own) + (twice + twice);
        move |k| {
            let level = level + f32x16::splat(levels[k]);
            let root = slope.times_plus(slope, -(square * level)).sqrt();
            rising_roots(inv, slope, level, root).map(|t| shift + t)
        }
    }
}

/// The sum of a matrix' magnitudes.
fn sum(m: DMat3) -> f64 {
    [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.abs().element_sum()).into_iter().sum()
}

/// Eigenvalues and unit eigenvectors, as columns, of a symmetric matrix (Golub and Van Loan 2013, Matrix Computations, section 8.5:
/// Jacobi's method).
fn principal_axes(mut m: DMat3) -> (DVec3, DMat3) {
    let mut axes = DMat3::IDENTITY;
    // (Each round squares what is left beside the diagonal.)
    for _ in 0..8 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let beside = m.col(p)[q];
            if beside == 0.0 {
                continue;
            }
            let tau = (m.col(q)[q] - m.col(p)[p]) / (2.0 * beside);
            let tangent = 1f64.copysign(tau) / (tau.abs() + (1.0 + tau * tau).sqrt());
            let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
            let sine = tangent * cosine;
            let mut turn = DMat3::IDENTITY;
            (turn.col_mut(p)[p], turn.col_mut(q)[q]) = (cosine, cosine);
            (turn.col_mut(p)[q], turn.col_mut(q)[p]) = (-sine, sine);
            m = turn.transpose() * m * turn;
            axes *= turn;
        }
    }
    (DVec3::new(m.x_axis.x, m.y_axis.y, m.z_axis.z), axes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn principal_axes_are_those_of_the_matrix() {
        let mut numbers = Random::new(2);
        for round in 0..300 {
            let (a, b) = (numbers.vector(1.0), numbers.vector(1.0));
            let scale = 10f64.powi(round % 30 - 15);
            let diagonal = DMat3::from_diagonal(a * scale);
            let mut m = diagonal + DMat3::from_cols(b * b.x, b * b.y, b * b.z) * scale;
            if round % 3 == 0 {
                m = diagonal;
            }
            let (values, axes) = principal_axes(m);
            let back = axes * DMat3::from_diagonal(values) * axes.transpose();
            assert!(sum(back - m) <= 1e-14 * sum(m), "{round}: {back} for {m}");
            assert!(sum(axes * axes.transpose() - DMat3::IDENTITY) < 1e-14);
        }
    }
}
