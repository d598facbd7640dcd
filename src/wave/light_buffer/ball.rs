//! Spheres as a light sees them: a disc fills three quarters of the square about it, and is as near as its box in one place only.

use super::Face;
use super::casters::Caster;
use super::raster::{CELL_ROUNDING, Light, axes};
use crate::compile::Kind;
use crate::kernel::Aabb;
use std::f64::consts::SQRT_2;

/// A sphere as a light outside of it sees it: in most cells of its box it is not.
pub(super) struct Ball {
    /// Along, across and up from the light, and how far that is.
    center: [f64; 3],
    distance: f64,
    /// Grown.
    radius: f64,
}

impl Ball {
    /// Of a sphere; `None` for anything else, and if the light may be in it.
    pub fn of(caster: &Caster, light: &Light) -> Option<Self> {
        let (along, across, up, backward) = axes(light.number);
        let Aabb { min, max } = caster.bounds;
        let center = caster.bounds.center() - light.location;
        let (distance, radius) = (center.length(), 0.5 * (max - min).max_element() + light.slack);
        let sign = if backward { -1.0 } else { 1.0 };
        let seen = caster.kind == Kind::Sphere as u8 && distance > radius;
        seen.then(|| Self { center: [sign * center[along], center[across], center[up]], distance, radius })
    }

    /// The least depth at which it can be met in the cell in a column and row; `None` if it is not seen through it.
    ///
    /// With `d` how far a way passes from its middle, a sphere is met first at `sqrt(distance^2 - d^2) - sqrt(radius^2 - d^2)`, which
    /// grows with `d`. From one way of a cell to another `d` changes by less than the distance times how far the two are apart
    /// at depth 1.
    pub fn depth_in(&self, cell: [u32; 2], face: &Face) -> Option<f64> {
        let half = (0.5 + CELL_ROUNDING) * face.width;
        let [x, y] = [0, 1].map(|side| face.place(side, f64::from(cell[side]) + 0.5));
        let ([along, across, up], square) = (self.center, |x: f64| x * x);
        let cross = square(across * y - up * x) + square(up - along * y) + square(along * x - across);
        let middle = (cross / (1.0 + x * x + y * y)).sqrt();
        let least = (middle - self.distance * half * SQRT_2).max(0.0);
        let [to_middle, within] = [self.distance, self.radius].map(|side| square(side) - square(least));
        if within < 0.0 {
            return None;
        }
        let longest = (1.0 + square(x.abs() + half) + square(y.abs() + half)).sqrt();
        Some((to_middle.sqrt() - within.sqrt()) / longest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::{NO_SURFACE, class};
    use crate::random::Random;
    use glam::DVec3;

    /// Ways through a cell meet the sphere no nearer than is said, and not where it is said to be missed.
    #[test]
    fn no_way_meets_a_sphere_before_its_cell_says() {
        let mut numbers = Random::new(11);
        let (mut met, mut missed, mut close) = (0, 0, 0);
        for round in 0..40_000 {
            let radius = 10f64.powf(numbers.between(-2.0, 0.5));
            let toward = numbers.vector(1.0);
            let center = toward * ((radius * 1.001).max(0.1) / toward.length() + numbers.between(0.0, 8.0));
            let location = numbers.vector(5.0);
            let bounds = Aabb { min: location + center - radius, max: location + center + radius };
            let (kind, surface) = (Kind::Sphere as u8, NO_SURFACE);
            let caster =
                Caster { bounds, kind, row: 0, classes: class::BLOCKS, surface, blocks: true, opaque: true };
            let face = Face { first: 0, columns: 16, rows: 16, corner: [-1.0; 2], scale: 8.0, width: 0.125 };
            let light = Light { location, number: round % 6, face, slack: 1e-12 };
            let Some(ball) = Ball::of(&caster, &light) else { continue };
            let cell = [(); 2].map(|()| numbers.between(0.0, 16.0) as u32);
            let depth = ball.depth_in(cell, &face);
            missed += u32::from(depth.is_none());
            let (along, across, up, backward) = axes(light.number);
            let mut least = f64::INFINITY;
            for way in 0..64 {
                let place =
                    |side: usize, share: usize| face.place(side, f64::from(cell[side]) + share as f64 / 7.0);
                let mut dir = DVec3::ZERO;
                dir[along] = if backward { -1.0 } else { 1.0 };
                (dir[across], dir[up]) = (place(0, way % 8), place(1, way / 8));
                let length = dir.length();
                let middle = center.dot(dir) / length;
                let within = radius * radius - (center.length_squared() - middle * middle);
                if middle > 0.0 && within >= 0.0 {
                    least = least.min((middle - within.sqrt()) / length);
                }
            }
            if least.is_finite() {
                let depth = depth.expect("a way meets the sphere");
                assert!(depth <= least, "{depth} {least} in round {round}");
                met += 1;
                close += u32::from(depth > least - 0.5 * radius);
            }
        }
        assert!(met > 500 && missed > 1000 && close > met / 2, "{met} met, {missed} missed, {close} close");
    }
}
