//! Geometry, pictures and cameras at the edge of what is allowed.

use crate::support::{camera_above, floor, mean, render, scene};
use glam::Vec3;
use nephroid::geometry::{Geometry, GeometryBuilder, Ray, offset_origin};
use nephroid::light_path::PathClass;
use nephroid::sampling::SamplePoint;
use nephroid::scene::ObjectId;
use serde_json::json;
use std::f64::consts::PI;

fn polygon(outline: &[Vec3]) -> Geometry {
    let mut builder = GeometryBuilder::default();
    builder.polygon(ObjectId(0), &[outline.to_vec()]).unwrap();
    builder.build()
}

/// F8: rays that approach a floor by 1e-9 and less per metre would meet its plane far outside of it.
#[test]
fn f8_rays_nearly_parallel_to_a_plane_miss_without_harm() {
    let floor = polygon(&[Vec3::ZERO, Vec3::Z, Vec3::new(1.0, 0.0, 1.0), Vec3::X]);
    for slope in [1e-9_f32, 1e-17, 1e-30, 1e-38, 1e-45] {
        for down in [slope, -slope] {
            let ray = Ray::new(Vec3::new(-1.0, 1.0, 0.5), Vec3::new(1.0, down, 0.0));
            assert_eq!(floor.closest_hit(&ray), None, "{down:e}");
            assert!(!floor.any_hit(&ray, f32::INFINITY), "{down:e}");
        }
    }
}

/// F10: a vertex given twice, or on the line between others, changes nothing.
#[test]
fn f10_repeated_and_straight_vertices_do_not_matter() {
    let corners = [Vec3::ZERO, Vec3::Z, Vec3::new(1.0, 0.0, 1.0), Vec3::X];
    let plain = polygon(&corners);
    let [a, b, c, d] = corners;
    let odd = polygon(&[a, a, b, b, b, b.midpoint(c), c, d, d, d.midpoint(a)]);
    for i in 0..2000 {
        let sample = SamplePoint::new(1, i);
        let ray = Ray::new(Vec3::new(sample.get(0) * 1.4 - 0.2, 1.0, sample.get(1) * 1.4 - 0.2), Vec3::NEG_Y);
        assert_eq!(plain.any_hit(&ray, 2.0), odd.any_hit(&ray, 2.0), "{i}");
    }
    let normal = |geometry: &Geometry| {
        geometry.closest_hit(&Ray::new(Vec3::new(0.3, 1.0, 0.3), Vec3::NEG_Y)).unwrap().surface.normal
    };
    assert!((normal(&plain) - normal(&odd)).length() < 1e-6);
}

/// F13: polygons that stand nearly on edge in two of the three projections have their area in the one that is used.
#[test]
fn f13_a_polygon_is_projected_along_the_largest_part_of_its_normal() {
    for (normal, along) in [
        (Vec3::new(1.0, 1e-6, 0.0), Vec3::Z),
        (Vec3::new(1e-7, 1.0, 1e-7), Vec3::X),
        (Vec3::new(0.0, 1e-5, -1.0), Vec3::X),
        (Vec3::new(1.0, 1.0, 1.0), Vec3::new(1.0, -1.0, 0.0)),
        (Vec3::new(1.0, -1.0, 1e-6), Vec3::Z),
    ] {
        let normal = normal.normalize();
        let u = along.reject_from_normalized(normal).normalize();
        let v = normal.cross(u);
        let square = polygon(&[Vec3::ZERO, u, u + v, v]);
        let hits = (0..4096)
            .filter(|&i| {
                let p = SamplePoint::new(2, i).get_2d(0) * 2.0 - 0.5;
                square.any_hit(&Ray::new(u * p.x + v * p.y + normal, -normal), 2.0)
            })
            .count();
        // A quarter of the rays, Sobol points: off by less than the points along the outline.
        assert!((hits as f64 / 4096.0 - 0.25).abs() < 0.005, "{normal}: {hits}");
    }
}

/// F14: no surface shadows itself, and no light its own surface: ball, floor and lamp are lit as they should be at
/// every scale and beside the origin, in every pixel.
#[test]
fn f14_nothing_shadows_itself_at_any_scale() {
    for (scale, at) in [(1.0, 0.0), (1e-3, 0.0), (1e3, 0.0), (1.0, 10.0)] {
        let p = |x: f64, y: f64, z: f64| json!([x * scale + at, y * scale, z * scale]);
        let ball =
            json!({ "type": "sphere", "material": "floor", "center": p(0.0, 0.0, 0.0), "radius": scale });
        let sun = json!([{ "type": "directional", "direction": [0, -1, 0], "irradiance": [1, 1, 1] }]);
        let camera = json!({ "type": "orthographic", "eye": p(0.0, 3.0, 0.0), "target": p(0.0, 0.0, 0.0),
                             "up": [0, 0, -1], "height": 1.2 * scale });
        let image = render(&scene(camera, json!([ball]), sun), 1, 4, 8).layer(PathClass::Direct);
        for (i, pixel) in image.pixels.iter().enumerate() {
            let x = ((i % 16) as f64 + 0.5) / 16.0 * 1.2 - 0.6;
            let z = ((i / 16) as f64 + 0.5) / 16.0 * 1.2 - 0.6;
            let cosine = (1.0 - x * x - z * z).sqrt();
            // 8 samples in a pixel over which the cosine varies by up to 10 %.
            let ratio = f64::from(pixel[1]) * PI / 0.5 / cosine;
            assert!((ratio - 1.0).abs() < 0.05, "{scale} {at} {i}: {ratio}");
        }
        // A lamp of the floor's own size close above it gives pi L, less what escapes at its border.
        let lamp = json!([{ "type": "quad", "center": p(0.0, 1e-3, 0.0), "size": [scale, scale],
                            "towards": p(0.0, 0.0, 0.0), "radiance": [1, 1, 1] }]);
        let below = json!([{ "type": "polygon", "material": "floor", "vertices": [
            p(-0.5, 0.0, 0.5), p(0.5, 0.0, 0.5), p(0.5, 0.0, -0.5), p(-0.5, 0.0, -0.5)] }]);
        let camera = json!({ "type": "orthographic", "eye": p(0.0, 5e-4, 0.0), "target": p(0.0, 0.0, 0.0),
                             "up": [0, 0, -1], "height": 0.8 * scale });
        let lit = mean(&render(&scene(camera, below, lamp), 1, 64, 8).layer(PathClass::Direct)) / 0.5;
        // Uniform in solid angle the cosine deviates by 58 %: 32768 samples give 0.3 %, stratified ones less.
        assert!((lit - 1.0).abs() < 0.01, "{scale} {at}: {lit}");
    }
}

/// F19: rays that leave a sphere at a grazing angle of 1e-3 and less neither tunnel nor meet it where they start.
#[test]
fn f19_grazing_rays_leave_the_surface_they_start_from() {
    let mut builder = GeometryBuilder::default();
    builder.sphere(ObjectId(0), Vec3::ZERO, 1.0);
    let ball = builder.build();
    for i in 0..2000 {
        let normal = nephroid::sampling::uniform_sphere(SamplePoint::new(4, i).get_2d(0));
        let hit = ball.closest_hit(&Ray::new(normal * 3.0, -normal)).unwrap().surface;
        let along = hit.normal.any_orthonormal_vector();
        for cosine in [1e-3_f32, 1e-6, 0.0] {
            let away = (along + hit.normal * cosine).normalize();
            let origin = offset_origin(hit.point, hit.error, hit.normal, hit.normal);
            assert!(ball.closest_hit(&Ray::new(origin, away)).is_none(), "{i} {cosine}");
        }
    }
}

/// F20: a camera inside a glass ball in a furnace of radiance 1 sees n² everywhere: all that leaves comes from
/// outside, however often it is reflected within, and radiance grows by n² on its way in.
#[test]
fn f20_a_camera_in_glass_sees_the_furnace_through_it() {
    for at in [[0.0, 0.0, 0.0], [0.3, -0.2, 0.1]] {
        let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 0, 0], "radius": 1 });
        let camera = json!({ "type": "perspective", "eye": at, "target": [1, 0.3, 0.2], "fov": 70 });
        let mut value = scene(camera, json!([ball]), json!([]));
        value["environment"] = json!({ "radiance": [1, 1, 1] });
        let image = render(&value, 1, 16, 8).layer(PathClass::Emitted);
        for (i, pixel) in image.pixels.iter().enumerate() {
            // No way is totally reflected from within 1/n of the centre; weak branches play roulette.
            assert!((f64::from(pixel[1]) - 2.25).abs() < 0.02, "{at:?} {i}: {}", pixel[1]);
        }
    }
    // Under flat water a caustic and its shadow are seen as from above: the camera knows what it is in.
    let pool = json!({ "type": "polygon", "material": "air", "vertices": [[-1, 1, 1], [1, 1, 1], [1, 1, -1], [-1, 1, -1]] });
    let sun = json!([{ "type": "directional", "direction": [0, -1, 0], "irradiance": [1, 1, 1] }]);
    let value = scene(camera_above([0.0; 3], 0.5, 0.5), json!([floor(1.0, 0.0), pool]), sun);
    let lit = mean(&render(&value, 1, 4, 14).layer(PathClass::Caustic)) * PI / 0.5;
    assert!((lit - 1.0).abs() < 0.02, "{lit}");
}

/// F72: pictures of one pixel, of one row and of one column are rendered, also with a caustic in them.
#[test]
fn f72_pictures_of_every_shape_are_rendered() {
    let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 0.5, 0], "radius": 0.3 });
    let lamp = json!([{ "type": "point", "position": [0, 3, 0], "intensity": [9, 9, 9] }]);
    for (width, height) in [(1, 1), (1, 40), (40, 1), (3, 7), (17, 16), (333, 2)] {
        let mut value =
            scene(camera_above([0.0; 3], 0.15, 0.3), json!([floor(2.0, 0.0), ball]), lamp.clone());
        value["image"] = json!({ "width": width, "height": height });
        let image = render(&value, 1, 3, 8).image();
        assert_eq!((image.width, image.height), (width, height));
        assert_eq!(image.pixels.len(), (width * height) as usize);
        assert!(image.pixels.iter().flatten().all(|x| x.is_finite()));
        assert!(mean(&image) > 0.0, "{width} x {height}");
    }
}
