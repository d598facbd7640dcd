//! Laws that hold for any scene, tried on random ones; a scene that breaks one is shrunk to the smallest seed.

use super::{differences, picture, scene};
use glam::DVec3;
use octray::compile::Compiled;
use octray::render::{Engine, Precision};
use octray::scene::{Object, Scene, Transform};
use octray::{random, wave};
use proptest::prelude::*;
use std::sync::Arc;

fn random_scene(seed: u64) -> Scene {
    scene(&random::scene(seed))
}

fn bytes(film: &octray::film::Film) -> &[u8] {
    bytemuck::cast_slice(&film.pixels)
}

/// The two sides add the same light in another order.
const REORDERED: f64 = 1e-6;
/// Pixels of 768 that may hang on a tie.
const TIES: usize = 3;

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn threads_change_no_byte(seed in 0u64..1_000_000) {
        let scene = random_scene(seed);
        for precision in [Precision::Fast, Precision::Exact] {
            let one = picture(&scene, Engine::Packets, precision, 1);
            let three = picture(&scene, Engine::Packets, precision, 3);
            prop_assert!(bytes(&one) == bytes(&three), "{precision:?}");
        }
    }

    #[test]
    fn the_order_of_objects_and_lights_does_not_matter(seed in 0u64..1_000_000) {
        let scene = random_scene(seed);
        let mut turned = scene.clone();
        turned.objects.reverse();
        turned.lights.reverse();
        // Overlapping interiors are left in the order they were entered, and the eye enters them as declared.
        let first = picture(&scene, Engine::Packets, Precision::Exact, 1);
        let second = picture(&turned, Engine::Packets, Precision::Exact, 1);
        let over = differences(&second, &first).iter().filter(|d| !(**d <= REORDERED)).count();
        prop_assert!(over <= TIES, "{over} pixels");
    }

    /// Boxes in single precision are padded: they must not lose a hit.
    #[test]
    fn exact_and_strict_see_the_same(seed in 0u64..1_000_000) {
        let scene = random_scene(seed);
        let exact = picture(&scene, Engine::Packets, Precision::Exact, 1);
        let strict = picture(&scene, Engine::Packets, Precision::Strict, 1);
        let over = differences(&exact, &strict).iter().filter(|d| !(**d <= REORDERED)).count();
        prop_assert!(over <= TIES, "{over} pixels");
    }

    /// A scene and its rays moved by the same map meet at the moved points, under the moved normals.
    #[test]
    fn moving_all_moves_hits_and_normals(
        seed in 0u64..1_000_000,
        angles in prop::array::uniform3(-3.0..3.0f64),
        factors in prop::array::uniform3(0.5..2.0f64),
        offset in prop::array::uniform3(-5.0..5.0f64),
    ) {
        let scene = random_scene(seed);
        let map = Transform::scale(DVec3::from(factors))
            .then(&Transform::rotate(DVec3::from(angles)))
            .then(&Transform::translate(DVec3::from(offset)));
        let mut moved = scene.clone();
        for object in &mut moved.objects {
            *object = Arc::new(Object::clone(object).transformed(&map));
        }
        let eye = scene.camera.location;
        let rays: Vec<(DVec3, DVec3)> = (0..512)
            .map(|k| {
                let (s, t) = (f64::from(k % 32) / 16.0 - 0.97, f64::from(k / 32) / 8.0 - 0.94);
                (eye, scene.camera.direction.normalize() + (scene.camera.right.normalize() * s
                    + scene.camera.up.normalize() * t) * 0.6)
            })
            .collect();
        let moved_rays: Vec<_> = rays.iter().map(|(o, d)| (map.point(*o), map.vector(*d))).collect();
        let here = wave::nearest_hits(&Compiled::<f64, f32>::new(&scene), &rays);
        let there = wave::nearest_hits(&Compiled::<f64, f32>::new(&moved), &moved_rays);
        let mut lost = 0;
        for (here, there) in here.iter().zip(&there) {
            match (here, there) {
                (Some(a), Some(b)) => {
                    let point = map.point(a.point);
                    // Of order 10 units; near a silhouette half the digits go.
                    if point.distance(b.point) > 1e-6 {
                        lost += 1;
                        continue;
                    }
                    let normal = map.normal(a.normal).normalize();
                    lost += usize::from(!(normal.cross(b.normal).length() < 1e-5));
                }
                (None, None) => {}
                _ => lost += 1,
            }
        }
        // Rays along silhouettes and cut edges.
        prop_assert!(lost <= TIES, "{lost} of 512 rays");
    }
}
