//! How things look through a window, from a light or an eye: convex polygons around what is seen of their bodies.

use super::casters::Caster;
use crate::compile::{COMPOSITE, Geometry, INSTANCE, WithBlock};
use crate::csg::{Composite, CsgNode, NodeKind};
use crate::kernel::{Aabb, Block, Lobe, Lobes};
use crate::lane::Scalar;
use glam::{DMat3, DVec3};
use std::f64::consts::TAU;

/// Sides of a polygon: what is round looks 1.3 % larger.
const SIDES: usize = 16;
/// The side that bounds it above, and the one below.
const ABOVE: usize = SIDES / 4;
const BELOW: usize = SIDES / 4 * 3;

/// Polygons are larger by this share of what their things measure: what stands in the columns is some roundings off what it was
/// made of, and an own space that is nearly flat more.
const ROOM: f64 = 1.0 / 4096.0;
/// And by this share of the places themselves, as roots of numbers near zero lose half of their digits.
const ROOT_ROUNDING: f64 = 1e-7;

/// What is built of more than so many levels is taken for its box.
const DEEPEST: usize = 16;

/// Somebody who looks somewhere.
pub struct Window {
    location: DVec3,
    /// From directions to what of them is ahead, across and up.
    to_own: DMat3,
    /// What lengths grow by that way, at most.
    growth: f64,
    /// The sides' directions: across and up, of length 1.
    directions: [[f64; 2]; SIDES],
}

/// What is seen of a convex body at depth 1: places `(a, u)` across and up with `d . (a, u) <= reach` for each direction.
#[derive(Debug, Clone, Copy)]
pub struct Figure {
    reach: [f64; SIDES],
}

impl Window {
    /// Of somebody at `location` who looks along an axis; across and up are the next two.
    pub fn along(location: DVec3, axis: usize, backward: bool) -> Self {
        let [ahead, across, up] = [0, 1, 2].map(|k| DVec3::AXES[(axis + k) % 3]);
        Self::new(location, [if backward { -ahead } else { ahead }, across, up])
    }

    /// Of somebody at `location`: what is ahead, across and up, as far as makes 1.
    pub fn new(location: DVec3, [ahead, across, up]: [DVec3; 3]) -> Self {
        let directions = std::array::from_fn(|k| match k * 4 / SIDES {
            quarter if k * 4 % SIDES == 0 => [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]][quarter],
            _ => [(k as f64 * TAU / SIDES as f64).cos(), (k as f64 * TAU / SIDES as f64).sin()],
        });
        let to_own = DMat3::from_cols(ahead, across, up).inverse();
        let squares = (0..3).map(|k| to_own.col(k).length_squared());
        Self { location, to_own, growth: squares.sum::<f64>().sqrt(), directions }
    }

    /// A vector's parts ahead, across and up.
    fn turn(&self, v: DVec3) -> [f64; 3] {
        (self.to_own * v).to_array()
    }

    /// True if a box is not ahead at all.
    pub fn is_behind(&self, bounds: Aabb) -> bool {
        bounds.corners().all(|corner| self.turn(corner - self.location)[0] <= 0.0)
    }

    /// Hands figures that hold together all that is seen of a caster to `with`; false if something of it is not ahead.
    pub fn each_figure<S: Scalar, B: Scalar>(
        &self,
        scene: &Geometry<S, B>,
        caster: &Caster,
        slack: f64,
        with: impl FnMut(&Figure),
    ) -> bool {
        let Caster { bounds, kind, row, .. } = caster;
        let room = slack + (bounds.max - bounds.min).length() * ROOM;
        let Some(boxed) = self.figure(&Lobe::corners(bounds), room) else { return false };
        let of_lobes = |lobes: Option<Lobes>| lobes.and_then(|lobes| self.figure(&lobes, room));
        match *kind {
            INSTANCE => std::iter::once(&boxed).for_each(with),
            COMPOSITE => {
                let composite = &scene.csg.composites[*row as usize];
                let of_part = |part: u32| {
                    let part = &scene.csg.parts[part as usize];
                    of_lobes(scene.parts.with(part.kind, LobesOf(part.row as usize)))
                };
                let figures = if is_solid(scene, composite) {
                    of_node(scene, (composite.root, false), DEEPEST, &of_part)
                } else {
                    None
                };
                let mut figures = figures.unwrap_or_else(|| vec![boxed]);
                figures.iter_mut().for_each(|figure| figure.keep_within(&boxed));
                figures.iter().for_each(with);
            }
            kind => {
                let own = of_lobes(scene.columns.with(kind, LobesOf(*row as usize)));
                std::iter::once(own.as_ref().unwrap_or(&boxed)).for_each(with);
            }
        }
        true
    }

    /// Of what is within `room` of a body; `None` if some of it is not ahead.
    ///
    /// A side's plane goes through the window's place and touches the body: with `n = (d, -c)`, for each lobe of center `x` and half axes `a`,
    /// `n . x + sqrt(sum (n . a)^2) <= 0`, and the least such `c` is the greater root of a quadratic.
    pub(in crate::wave) fn figure(&self, lobes: &[Lobe], room: f64) -> Option<Figure> {
        let (mut reach, mut near) = ([f64::NEG_INFINITY; SIDES], f64::INFINITY);
        for lobe in lobes {
            let [ahead, across, up] = self.turn(lobe.center - self.location);
            let axes = [lobe.half_axes.x_axis, lobe.half_axes.y_axis, lobe.half_axes.z_axis];
            let axes = axes.map(|axis| self.turn(axis));
            let sum = |a: usize, b: usize| axes.iter().map(|axis| axis[a] * axis[b]).sum::<f64>();
            let own = sum(0, 0);
            let nearest = ahead - own.sqrt();
            // (Also where it is no number.)
            if !(nearest > 0.0) {
                return None;
            }
            near = near.min(nearest);
            let (by_across, by_up) = (sum(0, 1), sum(0, 2));
            let (wide, tall, both) = (sum(1, 1), sum(2, 2), sum(1, 2));
            let square = ahead * ahead - own;
            for (reach, [x, y]) in reach.iter_mut().zip(self.directions) {
                let (middle, turn) = (x * across + y * up, x * by_across + y * by_up);
                let width = x * x * wide + y * y * tall + 2.0 * x * y * both;
                let half = middle * ahead - turn;
                let discriminant = half * half - square * (middle * middle - width);
                *reach = reach.max((half + discriminant.max(0.0).sqrt()) / square);
            }
        }
        let room = 2.0 * room * self.growth / near;
        let figure = Figure { reach: reach.map(|c| c + (room + ROOT_ROUNDING) * (1.0 + c.abs())) };
        (room < 0.5 && figure.reach.iter().all(|c| c.is_finite())).then_some(figure)
    }

    /// The least and the greatest place across that the figure has between two places up; the first is greater than the second if it has
    /// none there.
    pub fn across(&self, figure: &Figure, [low, high]: [f64; 2]) -> [f64; 2] {
        let mut ends = [f64::NEG_INFINITY, f64::INFINITY];
        for (reach, [x, y]) in figure.reach.iter().zip(self.directions) {
            let farthest = (reach - (y * low).min(y * high)) / x;
            if x > 0.0 {
                ends[1] = ends[1].min(farthest);
            } else if x < 0.0 {
                ends[0] = ends[0].max(farthest);
            }
        }
        ends
    }
}

impl Figure {
    /// The least and the greatest place up.
    pub fn up(&self) -> [f64; 2] {
        [-self.reach[BELOW], self.reach[ABOVE]]
    }

    /// Becomes what it has in common with another.
    fn keep_within(&mut self, other: &Self) {
        for (reach, other) in self.reach.iter_mut().zip(other.reach) {
            *reach = reach.min(other);
        }
    }
}

/// True if all surfaces of a composite are those of bodies, and lie in what its expression says.
fn is_solid<S: Scalar, B: Scalar>(scene: &Geometry<S, B>, composite: &Composite) -> bool {
    let parts = &scene.csg.parts[composite.parts.start as usize..composite.parts.end as usize];
    parts.iter().all(|part| part.solid && part.whole_skin && !part.partial_skin)
}

/// Figures that hold what is inside of a node, or outside if it is `inverted`; `None` if that may go anywhere.
fn of_node<S: Scalar, B: Scalar>(
    scene: &Geometry<S, B>,
    (number, inverted): (u32, bool),
    levels: usize,
    of_part: &impl Fn(u32) -> Option<Figure>,
) -> Option<Vec<Figure>> {
    let CsgNode { kind, inverted: turned, .. } = &scene.csg.nodes[number as usize];
    let inverted = inverted != *turned;
    let (list, every) = match kind {
        NodeKind::Part(part) => return if inverted { None } else { of_part(*part).map(|own| vec![own]) },
        NodeKind::All(list) => (list, !inverted),
        NodeKind::Any(list) | NodeKind::Merged(list) => (list, inverted),
        NodeKind::Odd(_) => return None,
    };
    let levels = levels.checked_sub(1)?;
    let mut children =
        scene.csg.list(list).iter().map(|&child| of_node(scene, (child, inverted), levels, of_part));
    if !every {
        return children.collect::<Option<Vec<_>>>().map(|all| all.concat());
    }
    // What bounds it by one figure bounds each of those that bound it together.
    let (mut fewest, mut single): (Option<Vec<Figure>>, Option<Figure>) = (None, None);
    for figures in children.by_ref().flatten() {
        if let [figure] = figures[..] {
            single.get_or_insert(figure).keep_within(&figure);
        } else if fewest.as_ref().is_none_or(|fewest| figures.len() < fewest.len()) {
            fewest = Some(figures);
        }
    }
    match (fewest, single) {
        (Some(mut figures), Some(single)) => {
            figures.iter_mut().for_each(|figure| figure.keep_within(&single));
            Some(figures)
        }
        (figures, single) => figures.or(single.map(|single| vec![single])),
    }
}

/// Asks a row for its lobes.
struct LobesOf(usize);

impl<S: Scalar> WithBlock<S> for LobesOf {
    type Output = Option<Lobes>;

    fn block<K: Block<S>>(self, block: &K) -> Option<Lobes> {
        block.lobes(self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::{OwnSpace, Solid};
    use crate::random::Random;

    /// Bodies of all kinds, round and flat, and places within them.
    fn body(random: &mut Random, kind: usize) -> (Lobes, impl Fn(&mut Random) -> DVec3 + use<>) {
        let axes = DMat3::from_cols(random.vector(1.0), random.vector(1.0), random.vector(0.4));
        let (center, half) = (random.vector(2.0), DVec3::new(0.7, 0.2, 0.5));
        let space = OwnSpace { center, map: axes.inverse() };
        let taper = random.between(0.1, 1.0);
        let solid = match kind {
            0 => Solid::Ball { center, radius: 0.8 },
            1 => Solid::Ellipsoid(space),
            2 => Solid::Box { min: center - half, max: center + half },
            3 => Solid::OrientedBox(space, half),
            4 => Solid::Cylinder(space),
            _ => Solid::Cone { space, taper },
        };
        let place = move |random: &mut Random| {
            let own = random.vector(1.0);
            match kind {
                0 => center + own.normalize() * 0.8,
                1 => center + axes * own.normalize(),
                2 => center + own.signum() * half,
                3 => center + axes * (own.signum() * half),
                _ => {
                    let height = random.between(0.0, 1.0);
                    let radius = if kind == 4 { 1.0 } else { 1.0 - taper * height };
                    center + axes * (own.with_z(0.0).normalize() * radius).with_z(height)
                }
            }
        };
        (solid.lobes().unwrap(), place)
    }

    /// What is seen of a body is within its figure, and goes nearly as far on every side.
    #[test]
    fn figures_hold_bodies_closely() {
        let random = &mut Random::new(7);
        for round in 0..1200 {
            let (lobes, place) = body(random, round % 6);
            let (along, backward) = (round / 6 % 3, round / 18 % 2 == 0);
            let mut away = random.vector(6.0);
            away[along] = random.between(4.0, 40.0) * if backward { 1.0 } else { -1.0 };
            let window = Window::along(away, along, backward);
            let Some(figure) = window.figure(&lobes, 1e-9) else {
                panic!("{lobes:?} is not ahead of {away}")
            };
            let mut far = [f64::NEG_INFINITY; SIDES];
            for _ in 0..400 {
                let [ahead, across, up] = window.turn(place(random) - away);
                for (far, [x, y]) in far.iter_mut().zip(window.directions) {
                    *far = far.max((x * across + y * up) / ahead);
                }
            }
            for (far, reach) in far.into_iter().zip(figure.reach) {
                assert!(far <= reach, "{round}: {far} is beyond {reach}");
                // (Places that are drawn by lot come within so much of the outermost.)
                let size = figure.up()[1] - figure.up()[0];
                assert!(reach - far < 0.3 * size + 1e-3, "{round}: {reach} is far beyond {far}");
            }
        }
    }

    /// Rows tell of every place in a figure.
    #[test]
    fn rows_hold_figures() {
        let random = &mut Random::new(9);
        for round in 0..300 {
            let (lobes, place) = body(random, round % 6);
            let window = Window::along(DVec3::new(1.0, 9.0, -2.0), 1, true);
            let figure = window.figure(&lobes, 1e-9).unwrap();
            for _ in 0..50 {
                let [ahead, across, up] = window.turn(place(random) - window.location);
                let (a, u) = (across / ahead, up / ahead);
                let [low, high] = figure.up();
                assert!(low <= u && u <= high);
                let [left, right] = window.across(&figure, [u - 0.01 * random.between(0.0, 1.0), u]);
                assert!(left <= a && a <= right, "{round}: {a} is not from {left} to {right}");
            }
            let [_, high] = figure.up();
            let [left, right] = window.across(&figure, [high + 1.0, high + 1.1]);
            assert!(left > right, "nothing is above the highest");
        }
    }

    #[test]
    fn what_is_not_ahead_has_no_figure() {
        let ball = |center: DVec3, radius: f64| Solid::Ball { center, radius }.lobes().unwrap();
        let window = Window::along(DVec3::ZERO, 2, false);
        assert!(window.figure(&ball(DVec3::Z * 2.0, 1.0), 1e-9).is_some());
        for lobes in [
            ball(DVec3::Z * -2.0, 1.0),
            ball(DVec3::Z, 1.0),
            ball(DVec3::X * 9.0, 1.0),
            ball(DVec3::NAN, 1.0),
            ball(DVec3::Z * 2.0, f64::NAN),
            ball(DVec3::Z * f64::INFINITY, 1.0),
        ] {
            assert!(window.figure(&lobes, 1e-9).is_none(), "{lobes:?}");
        }
        // Nor what is blurred by as much as it is away.
        assert!(window.figure(&ball(DVec3::Z * 2.0, 1.0), 0.5).is_none());
    }
}
