//! One plain ray per shape, in numbers that are exact in both precisions.

use crate::support::{crossings, left_part, ray, surface};
use glam::{DAffine3, DMat3, DVec3};
use octray::kernel::*;
use octray::lane::{Lane, Scalar};
use octray::scene::Transform;

/// Where a ray crosses primitive 0, and the point, normal and part at the first crossing.
#[track_caller]
fn check<S: Scalar, B: Block<S>>(
    block: &B,
    (origin, dir): ([f64; 3], [f64; 3]),
    expected: &[f64],
    normal: [f64; 3],
    part: u8,
) {
    let rays = ray(origin, dir);
    assert_eq!(crossings(block, 0, &rays, None), expected);
    let s = surface(block, &rays, expected[0]);
    assert_eq!(s.point.lane(0), DVec3::from(origin) + DVec3::from(dir) * expected[0]);
    assert_eq!(s.normal.lane(0), DVec3::from(normal));
    assert_eq!(s.part[0], part);
    // From the point onward the first crossing is exactly 0, the others are as far as they were.
    let onward = Rays { origin: s.point, dir: rays.dir };
    let moved: Vec<f64> = expected.iter().map(|t| t - expected[0]).collect();
    assert_eq!(crossings(block, 0, &onward, Some(&left_part(part))), moved);
    let b = block.bounds(0);
    assert!(b.min.cmple(s.point.lane(0)).all() && s.point.lane(0).cmple(b.max).all());
}

/// Whether a ray's line begins inside primitive 0, and where that changes.
fn inner<S: Scalar, B: Block<S>>(block: &B, rays: &Rays<S::Lane>) -> (bool, Vec<f64>) {
    let changes = block.boundary(0, rays, None);
    let changes = changes.as_ref().iter().map(|t| t.to_array()[0].to_f64()).filter(|t| !t.is_nan());
    (block.starts_inside(0, rays).all(), changes.collect())
}

fn shapes<S: Scalar>() {
    let down_z = ([0.0, 0.0, -4.0], [0.0, 0.0, 1.0]);
    let stretched = Transform::scale(DVec3::new(1.0, 1.0, 2.0)).then(&Transform::translate(DVec3::Z));

    let mut spheres = Spheres::<S>::default();
    spheres.push(DVec3::ZERO, 1.0);
    check(&spheres, down_z, &[3.0, 5.0], [0.0, 0.0, -1.0], 0);

    let mut ellipsoids = Ellipsoids::<S>::default();
    ellipsoids.push(&stretched);
    check(&ellipsoids, down_z, &[3.0, 7.0], [0.0, 0.0, -1.0], 0);

    let mut planes = Planes::<S>::default();
    planes.push(&stretched, DVec3::Z, 0.5);
    check(&planes, down_z, &[6.0], [0.0, 0.0, 1.0], 0);
    assert!(planes.starts_inside(0, &ray(down_z.0, down_z.1)).all());
    assert!(planes.starts_inside(0, &ray(down_z.0, [0.0, 0.0, -1.0])).none());
    for (height, inside) in [(-5.0, true), (2.0, true), (5.0, false)] {
        let level = ray([0.0, 0.0, height], [1.0, 0.0, 0.0]);
        assert_eq!(crossings(&planes, 0, &level, None), [0.0; 0]);
        assert_eq!(planes.starts_inside(0, &level).all(), inside);
    }

    let mut boxes = Boxes::<S>::default();
    boxes.push(DVec3::NEG_ONE, DVec3::new(1.0, 1.0, 2.0));
    check(&boxes, down_z, &[3.0, 6.0], [0.0, 0.0, -1.0], 4);

    let mut oriented = OrientedBoxes::<S>::default();
    oriented.push(&stretched, DVec3::NEG_ONE, DVec3::new(1.0, 1.0, 2.0));
    check(&oriented, down_z, &[3.0, 9.0], [0.0, 0.0, -1.0], 4);

    let corners = [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, -1.0, 0.0), DVec3::new(0.0, 1.0, 0.0)];
    let mut triangles = Triangles::<S>::default();
    triangles.push(corners);
    // POV-Ray's side of a triangle: the one from which its corners go round the other way.
    check(&triangles, down_z, &[4.0], [0.0, 0.0, -1.0], 0);
    let s = surface(&triangles, &ray(down_z.0, down_z.1), 4.0);
    assert_eq!([s.u, s.v].map(|x| x.to_array()[0].to_f64()), [0.25, 0.5]);

    let mut smooth = SmoothTriangles::<S>::default();
    smooth.push(corners, [DVec3::X, DVec3::X, DVec3::X]);
    check(&smooth, down_z, &[4.0], [1.0, 0.0, 0.0], 0);

    let outline = |h: f64| [[-h, -h], [h, -h], [h, h], [-h, h]].map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec();
    let mut polygons = Polygons::<S>::default();
    polygons.push(&[outline(1.0), outline(0.5)]);
    check(&polygons, ([0.75, 0.0, -4.0], down_z.1), &[4.0], [0.0, 0.0, 1.0], 0);
    assert_eq!(crossings(&polygons, 0, &ray(down_z.0, down_z.1), None), [0.0; 0]);

    let mut discs = Discs::<S>::default();
    discs.push(&stretched, DVec3::ZERO, DVec3::Z, 2.0, 0.5);
    check(&discs, ([1.0, 0.0, -4.0], down_z.1), &[5.0], [0.0, 0.0, 1.0], 0);
    assert_eq!(crossings(&discs, 0, &ray(down_z.0, down_z.1), None), [0.0; 0]);
    assert_eq!(inner(&discs, &ray(down_z.0, down_z.1)), (true, vec![5.0]));

    let mut tori = Tori::<S>::default();
    let swap_yz = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y);
    tori.push(&Transform::from_affine(DAffine3::from_mat3(swap_yz)).unwrap(), 3.0, 1.0);
    check(&tori, ([3.0, 0.0, -4.0], down_z.1), &[3.0, 5.0], [0.0, 0.0, -1.0], 0);
    check(&tori, ([-8.0, 0.0, 0.0], [1.0, 0.0, 0.0]), &[4.0, 6.0, 10.0, 12.0], [-1.0, 0.0, 0.0], 0);
    assert_eq!(crossings(&tori, 0, &ray(down_z.0, down_z.1), None), [0.0; 0]);

    let across = ([-4.0, 0.0, 0.5], [1.0, 0.0, 0.0]);
    let mut cylinders = Cylinders::<S>::default();
    cylinders.push(&Transform::IDENTITY, (DVec3::ZERO, 2.0), (DVec3::Z, 2.0));
    check(&cylinders, down_z, &[4.0, 5.0], [0.0, 0.0, -1.0], 1);
    check(&cylinders, across, &[2.0, 6.0], [-1.0, 0.0, 0.0], 0);

    let mut cones = ClosedCones::<S>::default();
    cones.push(&Transform::IDENTITY, (DVec3::Z, 0.0), (DVec3::ZERO, 2.0));
    check(&cones, down_z, &[4.0, 5.0], [0.0, 0.0, -1.0], 1);
    assert_eq!(crossings(&cones, 0, &ray(across.0, across.1), None), [3.0, 5.0]);

    let mut open = OpenCylinders::<S>::default();
    open.push(&Transform::IDENTITY, (DVec3::ZERO, 2.0), (DVec3::Z, 2.0));
    check(&open, across, &[2.0, 6.0], [-1.0, 0.0, 0.0], 0);
    assert_eq!(crossings(&open, 0, &ray(down_z.0, down_z.1), None), [0.0; 0]);
    assert_eq!(inner(&open, &ray(down_z.0, down_z.1)), (false, vec![4.0, 5.0]));

    let mut open = OpenCones::<S>::default();
    open.push(&Transform::IDENTITY, (DVec3::ZERO, 2.0), (DVec3::Z * 2.0, 0.0));
    assert_eq!(crossings(&open, 0, &ray([1.0, 0.0, -4.0], down_z.1), None), [5.0]);
    assert_eq!(inner(&open, &ray([1.0, 0.0, -4.0], down_z.1)), (false, vec![4.0, 5.0]));
}

#[test]
fn plain_rays_hit_where_they_should() {
    shapes::<f32>();
    shapes::<f64>();
}
