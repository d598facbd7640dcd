//! Whole scenes, each small enough to know the answer.

use super::*;
use crate::film::Film;
use crate::scene::*;
use smallvec::smallvec;
use std::sync::{Arc, Mutex};

fn render(scene: &Scene, width: usize, height: usize) -> (Film, RayCounts) {
    let film = Mutex::new(Film::new(width, height));
    let counts = super::render(scene, width, height, &|row, pixels, _| {
        film.lock().unwrap().lay((0, row), width, pixels);
    });
    (film.into_inner().unwrap(), counts)
}

/// Looks from the origin along z at a single point.
fn scene(objects: Vec<Object>) -> Scene {
    let camera = Camera { right: DVec3::X * 1e-9, up: DVec3::Y * 1e-9, ..Camera::default() };
    Scene { camera, objects: objects.into_iter().map(Arc::new).collect(), ..Scene::default() }
}

fn textured(shape: Shape, color: Color, finish: Finish) -> Object {
    let layers = smallvec![Layer { pigment: Pigment::solid(color), finish: finish.into(), normal: None }];
    Object { texture: Some(Arc::new(Texture { layers, ..Texture::default() })), ..Object::new(shape) }
}

/// Shows its colour, whatever the light.
fn glowing(shape: Shape, r: f64, g: f64, b: f64) -> Object {
    textured(shape, Color::opaque(r, g, b), glow())
}

fn glow() -> Finish {
    Finish { ambient: Rgb::ZERO, emission: Rgb::ONE, diffuse: 0.0, ..Finish::default() }
}

/// Clear, with an interior of its own.
fn clear(shape: Shape, interior: Interior) -> Object {
    let color = Color { rgb: Rgb::ONE, filter: 0.0, transmit: 1.0 };
    Object { interior: Some(Arc::new(interior)), ..textured(shape, color, glow()) }
}

fn sphere(x: f64, y: f64, z: f64, radius: f64) -> Shape {
    Shape::Sphere { center: DVec3::new(x, y, z), radius }
}

fn cuboid(min: [f64; 3], max: [f64; 3]) -> Shape {
    Shape::Box { min: min.into(), max: max.into() }
}

fn plane(normal: DVec3, distance: f64) -> Shape {
    Shape::Plane { normal, distance }
}

fn csg(op: CsgOp, children: Vec<Object>) -> Object {
    let children = children.into_iter().map(Arc::new).collect();
    Object::new(Shape::Csg { op, children, cutaway_textures: false })
}

/// What a ray from the origin along z sees.
fn seen(scene: &Scene) -> [f64; 3] {
    render(scene, 1, 1).0.pixel(0, 0).rgb.map(f64::from)
}

fn check(scene: &Scene, expected: [f64; 3], bound: f64) {
    let seen = seen(scene);
    let off = seen.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off <= bound, "{seen:?} for {expected:?}");
}

/// The film is single precision: half an ulp of 1.
const FILM: f64 = 6e-8;

fn hit(objects: Vec<Object>, origin: [f64; 3], dir: [f64; 3]) -> Option<f64> {
    nearest_hit(&scene(objects), origin.into(), dir.into()).map(|hit| hit.t)
}

// --- constructive geometry -------------------------------------------------------------------------------------------

/// Rays from all around, aimed near the origin: `(origin, dir)`.
fn bundle() -> impl Iterator<Item = ([f64; 3], [f64; 3])> {
    (0..500).map(|i| {
        let a = i as f64;
        let from = 5.0 * DVec3::new(a.sin(), (1.7 * a).cos(), (0.6 * a + 2.0).sin()).normalize();
        let target = 0.7 * DVec3::new((2.3 * a).cos(), (3.1 * a).sin(), (1.1 * a).cos());
        (from.to_array(), (target - from).to_array())
    })
}

#[test]
fn solid_within_itself_is_itself() {
    let solids =
        [sphere(0.1, 0.2, 0.3, 1.0), cuboid([-1.0; 3], [1.0; 3]), Shape::Torus { major: 0.8, minor: 0.3 }];
    for solid in solids {
        let one = || Object::new(solid.clone());
        let turned = || one().transformed(&Transform::rotate(DVec3::new(0.3, 0.4, 0.5)));
        for (origin, dir) in bundle() {
            let alone = hit(vec![turned()], origin, dir);
            let both = hit(vec![csg(CsgOp::Intersection, vec![turned(), turned()])], origin, dir);
            assert_eq!(alone, both, "{solid:?} from {origin:?}");
        }
    }
}

#[test]
fn solid_less_itself_is_nothing() {
    for solid in
        [sphere(0.1, 0.2, 0.3, 1.0), cuboid([-1.0; 3], [1.0; 3]), Shape::Torus { major: 0.8, minor: 0.3 }]
    {
        // The same solid, once placed by its numbers and once by a transform, so that its roundings differ.
        let here = Object::new(solid.clone()).transformed(&Transform::translate(DVec3::splat(0.1)));
        let there = Object::new(solid.clone())
            .transformed(&Transform::scale(DVec3::splat(3.0)))
            .transformed(&Transform::scale(DVec3::splat(1.0 / 3.0)))
            .transformed(&Transform::translate(DVec3::splat(0.1)));
        for (origin, dir) in bundle() {
            let rest = csg(CsgOp::Difference, vec![here.clone(), there.clone()]);
            assert_eq!(hit(vec![rest], origin, dir), None, "{solid:?} from {origin:?}");
        }
    }
}

/// Its meetings are at no finite distance: the same ones were joined for ever, and took all memory.
#[test]
fn a_sphere_beyond_all_measure_ends() {
    for radius in [1e160, 1e300, f64::MAX] {
        let cut = vec![Object::new(cuboid([-1.0; 3], [1.0; 3])), Object::new(sphere(0.0, 0.0, 0.0, radius))];
        let found = hit(vec![csg(CsgOp::Difference, cut)], [0.1, 0.2, -5.0], [0.0, 0.0, 1.0]);
        assert!(found.is_none_or(|t| t.is_finite()), "{found:?}");
    }
}

#[test]
fn flush_cut_leaves_no_skin() {
    // A hole through a box, flush with both faces; and one that sticks out ever less.
    for stick_out in [0.0, 1e-9, 1e-7] {
        let hole = cuboid([-0.5, -0.5, -1.0 - stick_out], [0.5, 0.5, 1.0 + stick_out]);
        let pierced = || {
            csg(CsgOp::Difference, vec![Object::new(cuboid([-1.0; 3], [1.0; 3])), Object::new(hole.clone())])
        };
        for i in 0..100 {
            let (x, y) = (0.49 * (i as f64).sin(), 0.49 * (1.3 * i as f64).cos());
            assert_eq!(hit(vec![pierced()], [x, y, -5.0], [0.0, 0.0, 1.0]), None, "{stick_out:e}");
        }
        assert_eq!(hit(vec![pierced()], [0.75, 0.0, -5.0], [0.0, 0.0, 1.0]), Some(4.0));
    }
}

#[test]
fn solid_and_its_inverse_share_nothing() {
    let solid = || Object::new(sphere(0.0, 0.0, 0.0, 1.0));
    let inverse = Object { flags: Flags { inverse: true, ..Flags::default() }, ..solid() };
    for (origin, dir) in bundle() {
        assert_eq!(hit(vec![csg(CsgOp::Intersection, vec![solid(), inverse.clone()])], origin, dir), None);
    }
}

#[test]
fn thin_lens_is_met_where_the_spheres_meet() {
    // Two unit spheres whose centres are 2 (1 - 1e-7) apart share a lens 2e-7 thick.
    let c = 1.0 - 1e-7;
    let lens = csg(
        CsgOp::Intersection,
        vec![Object::new(sphere(0.0, 0.0, -c, 1.0)), Object::new(sphere(0.0, 0.0, c, 1.0))],
    );
    let t = hit(vec![lens.clone()], [0.0, 0.0, -5.0], [0.0, 0.0, 1.0]).expect("the lens is there");
    assert!((t - (5.0 - 1e-7)).abs() < 1e-14, "{t}");
    // Its rim is at radius √(1 - c²) = 4.47e-4.
    assert!(hit(vec![lens.clone()], [4.4e-4, 0.0, -5.0], [0.0, 0.0, 1.0]).is_some());
    assert!(hit(vec![lens], [4.5e-4, 0.0, -5.0], [0.0, 0.0, 1.0]).is_none());
}

#[test]
fn union_keeps_its_inner_surfaces_and_merge_does_not() {
    let parts = || vec![Object::new(sphere(0.0, 0.0, 4.0, 1.0)), Object::new(sphere(0.0, 0.0, 5.0, 1.0))];
    let through = |op| {
        let glass = |object: Object| Object {
            texture: clear(plane(DVec3::Y, 0.0), Interior::default()).texture,
            ..object
        };
        let counts = render(&scene(vec![glass(csg(op, parts()))]), 1, 1).1;
        counts.refract
    };
    assert_eq!((through(CsgOp::Union), through(CsgOp::Merge)), (4, 2));
}

#[test]
fn inner_surface_of_a_union_survives_a_cut() {
    // Camera inside both spheres: the smaller is seen, in the union alone and in its intersection with a box.
    let both = || {
        csg(
            CsgOp::Union,
            vec![Object::new(sphere(0.0, 0.0, 0.0, 1.0)), Object::new(sphere(0.0, 0.0, 0.0, 2.0))],
        )
    };
    let cut = csg(CsgOp::Intersection, vec![both(), Object::new(cuboid([-9.0; 3], [9.0; 3]))]);
    assert_eq!(hit(vec![cut], [0.0; 3], [0.0, 0.0, 1.0]), Some(1.0));
    // Turned inside out it is an intersection, and its inner surfaces are gone.
    let inverse = Object { flags: Flags { inverse: true, ..Flags::default() }, ..both() };
    assert_eq!(hit(vec![inverse], [0.0; 3], [0.0, 0.0, 1.0]), Some(2.0));
}

#[test]
fn merge_of_boxes_that_share_a_face_has_no_wall_between() {
    let merged = csg(
        CsgOp::Merge,
        vec![
            Object::new(cuboid([-1.0, -1.0, 1.0], [1.0, 1.0, 2.0])),
            Object::new(cuboid([-1.0, -1.0, 2.0], [1.0, 1.0, 3.0])),
        ],
    );
    let glass = Object { texture: clear(plane(DVec3::Y, 0.0), Interior::default()).texture, ..merged };
    assert_eq!(render(&scene(vec![glass]), 1, 1).1.refract, 2);
}

#[test]
fn nested_six_deep_and_a_thousand_cutters() {
    let mut object = Object::new(cuboid([-1.0; 3], [1.0; 3]));
    for level in 0..6 {
        let cutter = Object::new(sphere(0.0, 0.0, -1.0, 0.1 + 0.1 * level as f64));
        object = csg(CsgOp::Difference, vec![object, cutter]);
    }
    let t = hit(vec![object], [0.0, 0.0, -5.0], [0.0, 0.0, 1.0]).unwrap();
    assert!((t - 4.6).abs() < 1e-14, "{t}");

    let mut parts = vec![Object::new(cuboid([-1.0; 3], [1.0; 3]))];
    parts.extend((0..1000).map(|i| Object::new(sphere(0.0, 0.0, -1.0 + 0.0005 * i as f64, 0.01))));
    let t = hit(vec![csg(CsgOp::Difference, parts)], [0.0, 0.0, -5.0], [0.0, 0.0, 1.0]).unwrap();
    assert!((t - (5.0 - 0.5005 + 0.01)).abs() < 1e-13, "{t}");
}

#[test]
fn clip_takes_away_and_adds_no_surface() {
    let mut half = Object::new(sphere(0.0, 0.0, 4.0, 1.0));
    half.more_mut().clipped_by = vec![Arc::new(Object::new(plane(DVec3::NEG_Z, -4.0)))];
    assert_eq!(hit(vec![half], [0.0; 3], [0.0, 0.0, 1.0]), Some(5.0));
}

#[test]
fn planes_alone_bound_a_cube() {
    let faces = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let planes = faces.map(|normal| Object::new(plane(normal, 1.0))).to_vec();
    for (origin, dir) in bundle() {
        let solid = hit(vec![csg(CsgOp::Intersection, planes.clone())], origin, dir);
        let direct = hit(vec![Object::new(cuboid([-1.0; 3], [1.0; 3]))], origin, dir);
        match (solid, direct) {
            (Some(a), Some(b)) => assert!((a - b).abs() < 1e-14),
            (a, b) => assert_eq!(a, b),
        }
    }
}

#[test]
fn of_surfaces_that_coincide_a_plane_or_the_first_declared_is_seen() {
    let (red, green, blue) = (
        glowing(plane(DVec3::NEG_Z, -3.0), 1.0, 0.0, 0.0),
        glowing(cuboid([-1.0, -1.0, 3.0], [1.0, 1.0, 4.0]), 0.0, 1.0, 0.0),
        glowing(cuboid([-2.0, -2.0, 3.0], [2.0, 2.0, 5.0]), 0.0, 0.0, 1.0),
    );
    check(&scene(vec![green.clone(), blue.clone()]), [0.0, 1.0, 0.0], 0.0);
    check(&scene(vec![blue.clone(), green.clone()]), [0.0, 0.0, 1.0], 0.0);
    check(&scene(vec![red.clone(), green.clone(), blue.clone()]), [1.0, 0.0, 0.0], 0.0);
    check(&scene(vec![blue.clone(), green.clone(), red.clone()]), [1.0, 0.0, 0.0], 0.0);
    check(&scene(vec![csg(CsgOp::Union, vec![green, red]), blue]), [1.0, 0.0, 0.0], 0.0);
}

#[test]
fn cut_face_shows_the_mean_of_what_it_cuts() {
    // Measured in POV-Ray 3.7: an untextured cutter of two overlapping solids, red and green, with `cutaway_textures`.
    let solids = vec![
        glowing(cuboid([-1.0, -1.0, 4.0], [1.0, 1.0, 6.0]), 1.0, 0.0, 0.0),
        glowing(cuboid([-2.0, -2.0, 3.0], [2.0, 2.0, 7.0]), 0.0, 1.0, 0.0),
    ];
    let cut = csg(
        CsgOp::Difference,
        vec![csg(CsgOp::Intersection, solids), Object::new(sphere(0.0, 0.0, 4.0, 0.5))],
    );
    check(&scene(vec![cut]), [0.5, 0.5, 0.0], 0.0);
}

// --- light and shadow ------------------------------------------------------------------------------------------------

fn lamp(x: f64, y: f64, z: f64) -> Light {
    Light {
        location: DVec3::new(x, y, z),
        color: Rgb::ONE,
        kind: LightKind::Point,
        point_at: DVec3::Z,
        parallel: false,
        shadowless: false,
        fade: None,
        more: None,
    }
}

/// A white wall at z = 4 that shows nothing but light.
fn wall() -> Object {
    textured(
        plane(DVec3::NEG_Z, -4.0),
        Color::opaque(1.0, 1.0, 1.0),
        Finish { ambient: Rgb::ZERO, diffuse: 1.0, ..Finish::default() },
    )
}

#[test]
fn wall_answers_by_the_cosine() {
    let lit = Scene { lights: vec![lamp(3.0, 0.0, 0.0)], ..scene(vec![wall()]) };
    check(&lit, [0.8; 3], FILM);
}

#[test]
fn light_fades_by_its_law() {
    let fading = Light { fade: Some(Fade { distance: 2.5, power: 2.0 }), ..lamp(3.0, 0.0, 0.0) };
    check(&Scene { lights: vec![fading], ..scene(vec![wall()]) }, [0.8 * 2.0 / (1.0 + 4.0); 3], FILM);
}

#[test]
fn filtered_shadow_takes_the_colour_twice() {
    let color = Color { rgb: Rgb::new(1.0, 0.5, 0.2), filter: 0.6, transmit: 0.1 };
    let pane = textured(cuboid([1.0, -1.0, 2.0], [2.0, 1.0, 3.0]), color, Finish::default());
    let shaded = Scene { lights: vec![lamp(3.0, 0.0, 0.0)], ..scene(vec![wall(), pane]) };
    check(&shaded, [0.8 * 0.7 * 0.7, 0.8 * 0.4 * 0.4, 0.8 * 0.22 * 0.22], FILM);
}

#[test]
fn shadow_fades_within_the_interior() {
    let fade = Interior { fade_distance: 2.0, fade_power: 2.0, ..Interior::default() };
    // The way to the light is at a slope of 4/3: a slab of depth 1 in z is 1.25 long.
    let pane = clear(cuboid([-9.0, -9.0, 2.0], [9.0, 9.0, 3.0]), fade);
    let camera = Object { flags: Flags { no_image: true, ..Flags::default() }, ..pane };
    let shaded = Scene { lights: vec![lamp(3.0, 0.0, 0.0)], ..scene(vec![wall(), camera]) };
    check(&shaded, [0.8 / (1.0 + (1.25f64 / 2.0).powi(2)); 3], FILM);
}

#[test]
fn contact_shadow_has_no_leak() {
    // A slab at any gap above the wall, of any thickness, shades it.
    for gap in [0.0, 1e-12, 1e-9, 1e-6, 1e-3] {
        for thickness in [1e-12, 1e-6, 1e-3] {
            let slab = cuboid([-1.0, -1.0, 4.0 - gap - thickness], [1.0, 1.0, 4.0 - gap]);
            let slab = Object { flags: Flags { no_image: true, ..Flags::default() }, ..Object::new(slab) };
            let slab = Object { texture: Some(Arc::default()), ..slab };
            let shaded = Scene { lights: vec![lamp(0.3, 0.0, 0.0)], ..scene(vec![wall(), slab]) };
            check(&shaded, [0.0; 3], 0.0);
        }
    }
}

#[test]
fn sphere_shades_itself_up_to_the_terminator() {
    // Light from the side of a sphere: the lit half is lit and the other is dark, to within an ulp of the edge.
    let ball = textured(
        sphere(0.0, 0.0, 0.0, 1.0),
        Color::opaque(1.0, 1.0, 1.0),
        Finish { ambient: Rgb::ZERO, diffuse: 1.0, ..Finish::default() },
    );
    let far = 1e9;
    for x in [-0.9, -0.1, -1e-6, 1e-6, 1e-3, 0.5, 0.99] {
        let mut lit = Scene { lights: vec![lamp(far, 0.0, 0.0)], ..scene(vec![ball.clone()]) };
        lit.camera.location = DVec3::new(x, 0.0, -5.0);
        // The light is at the height of the camera's point but not infinitely far: its cosine is off by 1/far.
        check(&lit, [x.max(0.0); 3], FILM + 2.0 / far);
    }
}

// --- mirrors and glass -----------------------------------------------------------------------------------------------

#[test]
fn two_mirrors_give_a_geometric_series() {
    // Measured in POV-Ray 3.7: emission 0.03, reflection 0.8, by max_trace_level, then by adc_bailout.
    for (level, adc, expected) in [
        (1, None, 0.030000),
        (2, None, 0.054000),
        (3, None, 0.073200),
        (5, None, 0.100848),
        (20, None, 0.148271),
        (20, Some(0.5), 0.088560),
        (200, Some(0.01), 0.148616),
    ] {
        let finish = Finish {
            reflection: Reflection { min: Rgb::splat(0.8), max: Rgb::splat(0.8), ..Reflection::default() },
            emission: Rgb::splat(0.03),
            ..glow()
        };
        let mirror = |shape| textured(shape, Color::opaque(1.0, 1.0, 1.0), finish.clone());
        let mut room = scene(vec![mirror(plane(DVec3::NEG_Z, -1.0)), mirror(plane(DVec3::Z, -1.0))]);
        room.globals.max_trace_level = level;
        room.globals.adc_bailout = adc.unwrap_or(room.globals.adc_bailout);
        check(&room, [expected; 3], 5e-7);
    }
}

#[test]
fn slab_shifts_sight_by_snell_s_law() {
    // From 1 in front of a slab 2 thick, at 3/4 slope: sin = 0.6 outside, 0.4 inside.
    let mut glass = scene(vec![
        clear(cuboid([-50.0, -50.0, 1.0], [50.0, 50.0, 3.0]), Interior { ior: 1.5, ..Interior::default() }),
        textured(plane(DVec3::NEG_Z, -4.0), Color::default(), glow()),
    ]);
    let ramp =
        ColorMap { entries: vec![(0.0, Color::opaque(0.0, 0.0, 0.0)), (1.0, Color::opaque(1.0, 1.0, 1.0))] };
    let pigment = Pigment {
        kind: PigmentKind::Mapped(Box::new(Mapped {
            pattern: Pattern::Gradient(DVec3::X),
            wave: Wave::Ramp,
            frequency: 1.0,
            phase: 0.0,
            generator: None,
            map: ramp,
        })),
        transform: Transform::scale(DVec3::splat(10.0)).into(),
    };
    let layers = smallvec![Layer { pigment, finish: glow().into(), normal: None }];
    let screen = Object::clone(&glass.objects[1]);
    glass.objects[1] =
        Arc::new(Object { texture: Some(Arc::new(Texture { layers, ..Texture::default() })), ..screen });
    glass.camera.direction = DVec3::new(0.6, 0.0, 0.8);
    let inside = 2.0 * 0.4 / (1.0f64 - 0.16).sqrt();
    check(&glass, [(0.75 + inside + 0.75) / 10.0; 3], FILM);
}

#[test]
fn total_internal_reflection_starts_at_the_critical_angle() {
    // From within glass of 1.5 towards its face: beyond asin(2/3) the red wall outside gives way to the green one inside.
    let glass =
        clear(cuboid([-50.0, -50.0, -50.0], [50.0, 50.0, 1.0]), Interior { ior: 1.5, ..Interior::default() });
    let outside = glowing(plane(DVec3::NEG_Z, -2.0), 1.0, 0.0, 0.0);
    let inside = glowing(cuboid([20.0, -50.0, -50.0], [21.0, 50.0, 0.5]), 0.0, 1.0, 0.0);
    for (off, expected) in [(-1e-9, [1.0, 0.0, 0.0]), (1e-9, [0.0, 1.0, 0.0])] {
        let mut tank = scene(vec![glass.clone(), outside.clone(), inside.clone()]);
        let angle = (2.0f64 / 3.0).asin() + off;
        tank.camera.direction = DVec3::new(angle.sin(), 0.0, angle.cos());
        tank.camera.right *= 1e-9;
        tank.camera.up *= 1e-9;
        check(&tank, expected, 0.0);
    }
}

#[test]
fn glass_fades_over_its_depth() {
    let white = || glowing(plane(DVec3::NEG_Z, -9.0), 1.0, 1.0, 1.0);
    for (power, expected) in [(1.0, 1.0 / (1.0 + 1.5)), (2.0, 1.0 / (1.0 + 2.25)), (1001.0, (-1.5f64).exp())]
    {
        let interior = Interior { fade_distance: 2.0, fade_power: power, ..Interior::default() };
        let glass = clear(cuboid([-1.0, -1.0, 2.0], [1.0, 1.0, 5.0]), interior);
        check(&scene(vec![glass, white()]), [expected; 3], FILM);
    }
}

#[test]
fn straight_rays_use_up_no_level_and_bent_ones_do() {
    let panes = |ior: f64| {
        let pane = |i: usize| {
            clear(
                cuboid([-1.0, -1.0, i as f64], [1.0, 1.0, i as f64 + 0.5]),
                Interior { ior, ..Interior::default() },
            )
        };
        let mut objects: Vec<_> = (1..20).map(pane).collect();
        objects.push(glowing(plane(DVec3::NEG_Z, -30.0), 1.0, 1.0, 1.0));
        scene(objects)
    };
    check(&panes(1.0), [1.0; 3], 0.0);
    check(&panes(1.1), [0.0; 3], 0.0);
}

#[test]
fn alpha_is_what_the_surfaces_leave() {
    let color = Color { rgb: Rgb::splat(0.5), filter: 0.0, transmit: 0.4 };
    let veil = textured(cuboid([-1.0, -1.0, 1.0], [1.0, 1.0, 2.0]), color, glow());
    let empty = Color { transmit: 1.0, ..Color::default() };
    let pixel = render(&Scene { background: empty, ..scene(vec![veil]) }, 1, 1).0.pixel(0, 0);
    assert!((f64::from(pixel.transmit) - 0.16).abs() < FILM);
    // Premultiplied: 0.5 seen by 0.6, and again through 0.4.
    assert!((f64::from(pixel.rgb[0]) - 0.42).abs() < FILM);
}

#[test]
fn camera_inside_glass_leaves_it_first() {
    // A red wall seen from inside glass: one surface, and no refraction ratio but that of leaving.
    let glass = clear(
        sphere(0.0, 0.0, 0.0, 2.0),
        Interior { ior: 1.5, fade_distance: 2.0, fade_power: 1.0, ..Interior::default() },
    );
    let wall = glowing(plane(DVec3::NEG_Z, -9.0), 1.0, 0.0, 0.0);
    check(&scene(vec![glass, wall]), [0.5, 0.0, 0.0], FILM);
}

#[test]
fn visibility_switches_hide_from_their_rays_only() {
    let mirror = textured(
        plane(DVec3::NEG_Z, -2.0),
        Color::default(),
        Finish { reflection: Reflection { min: Rgb::ONE, max: Rgb::ONE, ..Reflection::default() }, ..glow() },
    );
    let behind = |flags| Object { flags, ..glowing(plane(DVec3::Z, -2.0), 1.0, 0.0, 0.0) };
    let before =
        |flags| Object { flags, ..glowing(cuboid([-1.0, -1.0, 0.5], [1.0, 1.0, 1.0]), 0.0, 1.0, 0.0) };
    let none = Flags::default();
    check(&scene(vec![mirror.clone(), behind(none)]), [1.0, 0.0, 0.0], 0.0);
    check(&scene(vec![mirror.clone(), behind(Flags { no_reflection: true, ..none })]), [0.0; 3], 0.0);
    check(
        &scene(vec![mirror.clone(), behind(none), before(Flags { no_image: true, ..none })]),
        [0.0, 1.0, 0.0],
        0.0,
    );
}

// --- numbers ---------------------------------------------------------------------------------------------------------

/// One of everything, `factor` times as large.
fn everything(factor: f64) -> Scene {
    let grow = Transform::scale(DVec3::splat(factor));
    let glass = Interior { ior: 1.5, fade_distance: 1.5 * factor, fade_power: 1.0, ..Interior::default() };
    let shiny = Finish {
        phong: 0.5,
        specular: 0.3,
        reflection: Reflection { min: Rgb::splat(0.1), max: Rgb::splat(0.4), ..Reflection::default() },
        ..Finish::default()
    };
    let white = Color::opaque(0.9, 0.8, 0.7);
    let floor = Pigment {
        kind: PigmentKind::Blocks(Box::new(Blocks::new(
            BlockPattern::Checker,
            vec![white, Color::opaque(0.1, 0.2, 0.1)],
        ))),
        transform: Default::default(),
    };
    let floor = Texture {
        layers: smallvec![Layer { pigment: floor, finish: shiny.clone().into(), normal: None }],
        ..Texture::default()
    };
    let turned =
        Transform::rotate(DVec3::new(0.5, 0.3, 0.1)).then(&Transform::translate(DVec3::new(1.3, 1.2, 6.0)));
    let objects = [
        Object { texture: Some(Arc::new(floor)), ..Object::new(plane(DVec3::Y, -1.0)) },
        clear(sphere(-1.0, 0.2, 4.0, 0.9), glass),
        textured(Shape::Torus { major: 0.8, minor: 0.3 }, white, shiny.clone()).transformed(&turned),
        csg(
            CsgOp::Difference,
            vec![
                textured(cuboid([-0.5; 3], [0.5; 3]), white, shiny.clone()),
                textured(sphere(0.0, 0.5, -0.5, 0.45), Color::opaque(1.0, 0.0, 0.0), shiny.clone()),
            ],
        )
        .transformed(&Transform::translate(DVec3::new(0.3, -0.4, 3.0))),
        textured(
            Shape::Cone { base: DVec3::ZERO, base_radius: 0.5, cap: DVec3::Y, cap_radius: 0.1, open: false },
            white,
            shiny,
        )
        .transformed(&Transform::translate(DVec3::new(-0.4, -1.0, 7.0))),
    ];
    let mut light = lamp(3.0 * factor, 5.0 * factor, -2.0 * factor);
    light.fade = Some(Fade { distance: 8.0 * factor, power: 2.0 });
    let camera = Camera { location: DVec3::new(0.1, 0.7, -2.0) * factor, ..Camera::default() };
    let objects = objects.into_iter().map(|object| Arc::new(object.transformed(&grow))).collect();
    Scene {
        camera,
        lights: vec![light],
        objects,
        background: Color::opaque(0.2, 0.3, 0.4),
        ..Scene::default()
    }
}

#[test]
fn scene_of_any_size_gives_the_same_bits() {
    let (one, counts) = render(&everything(1.0), 48, 36);
    assert!(counts.shadow > 0 && counts.reflect > 0 && counts.refract > 0);
    for power in [-20, -3, 7, 20] {
        let other = render(&everything(2f64.powi(power)), 48, 36);
        assert!(one == other.0 && counts == other.1, "scaled by 2^{power}");
    }
}

#[test]
fn number_of_threads_changes_nothing() {
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&everything(1.0), 32, 24))
    };
    assert!(on(1) == on(3));
}

#[test]
fn picture_without_pixels_is_no_panic() {
    for (width, height) in [(0, 0), (0, 5), (5, 0)] {
        assert_eq!(render(&everything(1.0), width, height).1, RayCounts::default());
    }
}
