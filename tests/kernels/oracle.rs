//! The shapes once more, in their own spaces and in double-double: one ray at a time, by the plainest formulas.

use crate::dd::{Dd, V, ZERO, at, dot, polynomial, quadratic};
use crate::support::Rng;
use glam::{DMat3, DVec3};
use octray::scene::Transform;

/// A shape in its own space, of the order of 1 in size.
#[derive(Debug, Clone, Copy)]
pub enum Solid {
    /// Unit sphere.
    Ball,
    /// From `-half` to `half`.
    Box { half: DVec3 },
    /// Axis z from 0 to 1, radius from 1 down to `1 - taper`.
    Cone { taper: f64, open: bool },
    /// Across z, radius 1.
    Disc { hole: f64 },
    /// About z, radii that sum to 1.
    Torus { major: f64, minor: f64 },
    /// z = 0.
    Plane,
}

/// A ray in own space.
#[derive(Debug, Clone, Copy)]
pub struct OwnRay {
    pub origin: V,
    pub dir: V,
}

impl OwnRay {
    /// `origin` and `dir` through the map into own space.
    pub fn new(world_from_own: &Transform, origin: DVec3, dir: DVec3) -> Self {
        let center = world_from_own.forward.translation;
        let m = world_from_own.inverse.matrix3;
        let map = |v: V| {
            let row = |k: usize| {
                let r = m.row(k);
                dot([r.x.into(), r.y.into(), r.z.into()], v)
            };
            [row(0), row(1), row(2)]
        };
        let from_center = |k: usize| Dd::from(origin[k]) - center[k].into();
        Self {
            origin: map([from_center(0), from_center(1), from_center(2)]),
            dir: map([dir.x.into(), dir.y.into(), dir.z.into()]),
        }
    }
}

/// Sum of absolute products per row: how roundings of world coordinates appear in own space.
pub fn reach(m: &DMat3, v: DVec3) -> f64 {
    (DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs()) * v.abs()).max_element()
}

impl Solid {
    /// Crossings of the surface, rising.
    pub fn roots(&self, ray: &OwnRay) -> Vec<Dd> {
        self.grown_roots(ray, 0.0, 0.0)
    }

    /// The same for shapes that are larger and smaller by `slack`: what rounding may make of this one. An open one
    /// may also lose in height what it wins in width, and a flat one may be met higher or lower.
    pub fn neighbours(&self, ray: &OwnRay, slack: f64) -> Vec<Vec<Dd>> {
        let mut all = vec![self.grown_roots(ray, slack, slack), self.grown_roots(ray, -slack, -slack)];
        match self {
            Self::Cone { open: true, .. } => {
                all.extend([self.grown_roots(ray, slack, -slack), self.grown_roots(ray, -slack, slack)]);
            }
            Self::Disc { .. } => {
                let raised = |by: f64| {
                    let [x, y, z] = ray.origin;
                    OwnRay { origin: [x, y, z + by.into()], ..*ray }
                };
                for (by, grow) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
                    all.push(self.grown_roots(&raised(by * slack), grow * slack, 0.0));
                }
            }
            _ => (),
        }
        all
    }

    /// Crossings of the shape grown by `grow` on all sides, cones in their height by `stretch`.
    fn grown_roots(&self, ray: &OwnRay, grow: f64, stretch: f64) -> Vec<Dd> {
        let OwnRay { origin: o, dir: d } = *ray;
        let grow = Dd::from(grow);
        let one = Dd::from(1.0) + grow;
        match *self {
            Self::Ball => quadratic(dot(d, d), dot(o, d), dot(o, o) - one * one),
            Self::Box { half } => {
                let (mut near, mut far) = (Dd::from(f64::NEG_INFINITY), Dd::from(f64::INFINITY));
                for k in 0..3 {
                    let h = Dd::from(half[k]) + grow;
                    if h < ZERO {
                        return vec![];
                    }
                    if d[k] == ZERO {
                        if o[k].abs() > h {
                            return vec![];
                        }
                        continue;
                    }
                    let (a, b) = ((-h - o[k]) / d[k], (h - o[k]) / d[k]);
                    let (a, b) = if a < b { (a, b) } else { (b, a) };
                    near = if a > near { a } else { near };
                    far = if b < far { b } else { far };
                }
                if near <= far { vec![near, far] } else { vec![] }
            }
            Self::Cone { taper, open } => {
                let m = Dd::from(taper);
                let radius = |z: Dd| one - m * z;
                let (w, dw) = (radius(o[2]), -(m * d[2]));
                let side = quadratic(
                    d[0] * d[0] + d[1] * d[1] - dw * dw,
                    o[0] * d[0] + o[1] * d[1] - w * dw,
                    o[0] * o[0] + o[1] * o[1] - w * w,
                );
                let (bottom, top) = (-Dd::from(stretch), Dd::from(1.0) + stretch.into());
                let within = |t: &Dd| {
                    let z = o[2] + d[2] * *t;
                    z >= bottom && z <= top && radius(z) >= ZERO
                };
                let mut roots: Vec<Dd> = side.into_iter().filter(within).collect();
                if !open && d[2] != ZERO {
                    for z in [bottom, top] {
                        let t = (z - o[2]) / d[2];
                        let [x, y, _] = at(o, d, t);
                        if x * x + y * y <= radius(z) * radius(z) {
                            roots.push(t);
                        }
                    }
                }
                roots.sort_by(|a, b| a.partial_cmp(b).unwrap());
                if !open && roots.len() > 2 {
                    roots = vec![roots[0], roots[roots.len() - 1]]; // the rim is of both
                }
                roots
            }
            Self::Disc { hole } => {
                let t = -o[2] / d[2];
                let [x, y, _] = at(o, d, t);
                let square = x * x + y * y;
                let hole = (Dd::from(hole) - grow).f64().max(0.0);
                let on = square <= one * one && square >= Dd::from(hole) * hole.into();
                if t.f64().is_finite() && on { vec![t] } else { vec![] }
            }
            Self::Torus { major, minor } => {
                let (major, minor) = (Dd::from(major), Dd::from(minor) + grow);
                // From a point near the middle, in any unit of length that makes the polynomial tame.
                let shift = Dd::from(-(dot(o, d) / dot(d, d)).f64());
                let o = at(o, d, shift);
                let (dd, od, oo) = (dot(d, d), dot(o, d), dot(o, o));
                let k = oo + major * major - minor * minor;
                let rr = Dd::from(4.0) * major * major;
                let two = Dd::from(2.0);
                let p = [
                    k * k - rr * (o[0] * o[0] + o[1] * o[1]),
                    two * (two * od * k - rr * (o[0] * d[0] + o[1] * d[1])),
                    Dd::from(4.0) * od * od + two * dd * k - rr * (d[0] * d[0] + d[1] * d[1]),
                    Dd::from(4.0) * od * dd,
                    dd * dd,
                ];
                let reach = Dd::from(1.5) * (major + minor) / dd.sqrt();
                polynomial(&p, reach).into_iter().map(|t| t + shift).collect()
            }
            Self::Plane => {
                let t = -o[2] / d[2];
                if t.f64().is_finite() { vec![t] } else { vec![] }
            }
        }
    }

    /// Whether an error of `slack` is so much for this ray that there is nothing to test: over a hundredth of what is
    /// thinnest about the shape, or, for a flat one met at a low angle, of its breadth.
    pub fn hopeless(&self, ray: &OwnRay, slack: f64) -> bool {
        let flat = matches!(self, Self::Disc { .. } | Self::Plane);
        let [x, y, z] = ray.dir.map(|d| d.f64().abs());
        let thickness = if let Self::Torus { minor, .. } = *self { minor } else { 1.0 };
        slack > 0.01 * thickness || (flat && slack * (x + y) > 0.01 * z)
    }

    /// The unit normal at an own-space point near the surface, of the part that is nearest.
    pub fn normal(&self, p: DVec3) -> DVec3 {
        match *self {
            Self::Ball => p.normalize(),
            Self::Box { half } => {
                let gap = (p.abs() - half).abs();
                let k = if gap.x <= gap.y && gap.x <= gap.z {
                    0
                } else if gap.y <= gap.z {
                    1
                } else {
                    2
                };
                DVec3::AXES[k] * p[k].signum()
            }
            Self::Cone { taper, open } => {
                let radius = p.truncate().length();
                let side = (radius - (1.0 - taper * p.z)).abs();
                if !open && p.z.abs() < side {
                    DVec3::NEG_Z
                } else if (!open && (p.z - 1.0).abs() < side) || radius == 0.0 {
                    DVec3::Z
                } else {
                    (p.truncate() / radius).extend(taper).normalize()
                }
            }
            Self::Torus { major, minor } => {
                let radius = p.truncate().length();
                let major = if p.length_squared() + major * major < minor * minor { -major } else { major };
                (p - (p.truncate() / radius * major).extend(0.0)).normalize()
            }
            Self::Disc { .. } | Self::Plane => DVec3::Z,
        }
    }

    /// A random point of the surface.
    pub fn surface(&self, rng: &mut Rng) -> DVec3 {
        let turn = rng.angle();
        let round = |radius: f64, z: f64| DVec3::new(radius * turn.cos(), radius * turn.sin(), z);
        match *self {
            Self::Ball => rng.direction(),
            Self::Box { half } => {
                let mut p = rng.cube() * half;
                let k = (rng.unit() * 3.0) as usize;
                p[k] = half[k].copysign(rng.unit() - 0.5);
                p
            }
            Self::Cone { taper, open } => {
                let part = rng.unit();
                if open || part < 0.6 {
                    let z = rng.unit();
                    round(1.0 - taper * z, z)
                } else if part < 0.8 {
                    round(rng.unit(), 0.0)
                } else {
                    round(rng.unit() * (1.0 - taper), 1.0)
                }
            }
            Self::Disc { hole } => round(hole + (1.0 - hole) * rng.unit(), 0.0),
            Self::Torus { major, minor } => {
                let along = rng.angle();
                let radius = major + minor * along.cos();
                round(radius, minor * along.sin())
            }
            Self::Plane => (rng.cube() * 3.0).with_z(0.0),
        }
    }

    /// A random point of an edge, rim, corner or apex; any surface point for shapes that have none.
    pub fn feature(&self, rng: &mut Rng) -> DVec3 {
        let turn = rng.angle();
        let round = |radius: f64, z: f64| DVec3::new(radius * turn.cos(), radius * turn.sin(), z);
        match *self {
            Self::Box { half } => {
                let mut p = half.map(|h| h.copysign(rng.unit() - 0.5));
                if rng.unit() < 0.5 {
                    let k = (rng.unit() * 3.0) as usize;
                    p[k] *= rng.unit();
                }
                p
            }
            Self::Cone { taper, .. } => {
                if rng.unit() < 0.5 {
                    round(1.0, 0.0)
                } else {
                    round(1.0 - taper, 1.0)
                }
            }
            Self::Disc { hole } => round(if rng.unit() < 0.5 { 1.0 } else { hole }, 0.0),
            _ => self.surface(rng),
        }
    }
}
