//! What moves while the shutter is open: where it is at every moment, and how its light and shadow are blurred.

use crate::support::{compile, floor, render, scene};
use glam::Vec3;
use nephroid::geometry::{Ray, Structure};
use nephroid::light_path::PathClass;
use nephroid::plan::Plan;
use nephroid::render::{Control, Render};
use nephroid::sampling::{SamplePoint, uniform_sphere};
use nephroid::scene::{IssueCode, NoAssets, ObjectId, Scene};
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::sync::Arc;

/// Parallel rays straight down on a strip of 5 m by 1 m around the point above which it stands.
fn strip(x: f64, height: f64) -> Value {
    json!({ "type": "orthographic", "eye": [x, height, 0], "target": [x, 0, 0], "up": [0, 0, -1], "height": 1 })
}

fn open(mut camera: Value) -> Value {
    camera["shutter"] = json!([0, 1]);
    camera
}

fn sun() -> Value {
    json!([{ "type": "directional", "direction": [0, -1, 0], "irradiance": [1, 1, 1] }])
}

/// A square of side 1 at x from -0.5 to 0.5 at this height.
fn square(height: f64, material: &str) -> Value {
    json!({ "type": "polygon", "material": material,
        "vertices": [[-0.5, height, 0.6], [0.5, height, 0.6], [0.5, height, -0.6], [-0.5, height, -0.6]] })
}

/// Irradiance by column on a floor of albedo 1/2, mean of all rows.
fn columns(render: &Render, class: PathClass) -> Vec<f64> {
    let image = render.layer(class);
    let (width, height) = (image.width as usize, image.height as usize);
    let column = |x: usize| (0..height).map(|y| f64::from(image.pixels[y * width + x][1])).sum::<f64>();
    (0..width).map(|x| column(x) / height as f64 * PI / 0.5).collect()
}

/// How much of the time a square of side 1 that moves by 4 covers x, where its middle starts at 0.
fn trapezoid(x: f64) -> f64 {
    ((x + 0.5).clamp(0.0, 4.0) - (x - 0.5).clamp(0.0, 4.0)) / 4.0
}

/// T23: a square of side w = 1 moves along L = 4: the plateau is min(1, w/L) = 1/4, the whole is w + L = 5 wide.
#[test]
fn t23_motion_blur_of_a_square_is_a_trapezoid() {
    let mut moving = square(0.0, "floor");
    moving["velocity"] = json!([4, 0, 0]);
    let mut value = scene(open(strip(2.0, 1.0)), json!([moving]), sun());
    value["image"] = json!({ "width": 120, "height": 20 });
    let rounds = 64;
    let found = columns(&render(&value, 1, rounds, 8), PathClass::Direct);
    for (i, found) in found.iter().enumerate() {
        let x = 2.0 + (i as f64 + 0.5 - 60.0) / 20.0;
        let expected = trapezoid(x);
        // 2 x 64 stratified times in each of 20 rows: an edge is off by less than one of them in each row.
        assert!((found - expected).abs() < 1.0 / 64.0, "{x}: {found}, not {expected}");
    }
    let lit = found.iter().filter(|&&e| e > 0.0).count();
    assert!((99..=101).contains(&lit), "5 m are 100 pixels, not {lit}");
}

/// The shadow that a moving square casts, and the light that goes through it if it is glass of index 1 (T25), are
/// the same trapezoid: together they are the light of the sun.
#[test]
fn t23_t25_a_moving_caustic_is_a_trapezoid_and_fills_its_shadow() {
    let mut moving = square(0.5, "air");
    moving["velocity"] = json!([4, 0, 0]);
    // From below the square, and from above through it: with footprints and without.
    for height in [0.25, 1.0] {
        let mut value = scene(open(strip(2.0, height)), json!([floor(5.0, 0.0), moving]), sun());
        value["image"] = json!({ "width": 120, "height": 20 });
        let render = render(&value, 1, 128, 12);
        let (direct, caustic) = (columns(&render, PathClass::Direct), columns(&render, PathClass::Caustic));
        for (i, (direct, caustic)) in direct.iter().zip(&caustic).enumerate() {
            let x = 2.0 + (i as f64 + 0.5 - 60.0) / 20.0;
            let expected = trapezoid(x);
            // 256 moments, each common to all pixels: two edges, each off by one of them in 128; the photons of all
            // rounds add their noise, and smoothing its bias at the trapezoid's four corners.
            assert!((caustic - expected).abs() < 0.025, "{height} {x}: {caustic}, not {expected}");
            assert!(
                (direct + expected - 1.0).abs() < 0.015,
                "{height} {x}: {direct}, not {}",
                1.0 - expected
            );
        }
    }
}

/// A floor that rises from -1 to 0 under a lamp at height 1, with a pane of glass of index 1 between or none: photons
/// rest where the floor is at their moment. Straight below, E = I / d² has the mean I / (1 · 2) over d from 2 to 1.
#[test]
fn t25_photons_rest_on_a_moving_floor_where_it_is() {
    let mut rising = floor(3.0, -1.0);
    rising["velocity"] = json!([0, 1, 0]);
    let lamp = json!([{ "type": "point", "position": [0, 1, 0], "intensity": [1, 1, 1] }]);
    let pane = json!({ "type": "polygon", "material": "air",
        "vertices": [[-0.5, 0.5, 0.5], [0.5, 0.5, 0.5], [0.5, 0.5, -0.5], [-0.5, 0.5, -0.5]] });
    let camera = json!({ "type": "orthographic", "eye": [0, 0.2, 0], "target": [0, -1, 0], "up": [0, 0, -1],
                         "height": 0.1, "shutter": [0, 1] });
    for (objects, class) in
        [(json!([rising]), PathClass::Direct), (json!([rising, pane]), PathClass::Caustic)]
    {
        let value = scene(camera.clone(), objects, lamp.clone());
        let render = render(&value, 1, 128, 12);
        let image = render.layer(class);
        let mean = image.pixels.iter().map(|p| f64::from(p[1])).sum::<f64>() / 256.0 * PI / 0.5;
        // 1/d² varies by a factor 4 over 2 x 128 stratified moments: its mean is good to 1/128 of that. The corners
        // of the 0.1 m square are 0.3 % darker.
        assert!((mean - 0.5).abs() < 0.01, "{class:?}: {mean}");
    }
}

/// Every shape and where it is; each is some way off the origin.
fn shapes() -> Value {
    json!([
        { "type": "sphere", "center": [0.3, 0.5, -0.2], "radius": 0.4 },
        { "type": "polygon", "vertices": [[-0.6, 0.09, 0.5], [0.7, 0.22, 0.5], [0.6, 0.21, -0.5], [-0.7, 0.08, -0.5]],
          "holes": [[[-0.1, 0.14, 0.1], [0.1, 0.16, 0.1], [0.1, 0.16, -0.1]]] },
        { "type": "disk", "center": [0.2, 0.3, 0.1], "normal": [1, 2, 1], "radius": 0.5 },
        { "type": "cylinder", "from": [0, 0, 0.3], "to": [0.3, 0.8, 0], "radius": 0.3 },
        { "type": "box", "center": [0.1, 0.3, 0.2], "size": [0.5, 0.6, 0.7] },
        { "type": "mesh", "positions": [[0, 0, 0.4], [0.7, 0, 0], [0, 0.9, 0], [-0.4, 0.1, -0.3]],
          "triangles": [[0, 1, 2], [0, 2, 3], [1, 3, 2]], "normals": [[0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, -1]] },
        { "type": "heightfield", "center": [0.1, 0.2, 0], "size": [1.2, 1], "heights": [[0, 0.1, 0.3], [0.2, 0.4, 0.1], [0, 0.1, 0.2]] },
        { "type": "instance", "of": "original", "translate": [0.2, 0.3, 0], "rotate": { "axis": [1, 1, 0], "angle": 70 }, "scale": [1, 0.5, 0.7] }
    ])
}

/// One of the shapes by itself; the original of the instance is far away.
fn alone(shape: &Value, structure: &str) -> Scene {
    let mut shape = shape.clone();
    shape["material"] = json!("floor");
    let original = json!({ "type": "mesh", "name": "original", "material": "floor",
        "positions": [[0, 100, 0], [1, 100, 0], [0, 100, 1]], "triangles": [[0, 1, 2]] });
    let mut value = scene(open(strip(0.0, 1.0)), json!([shape, original]), json!([]));
    if value["objects"][0]["type"] == "instance" {
        // In its own frame the original is near.
        value["objects"][1]["positions"] = json!([[0, 0, 0], [1, 0, 0.2], [0.1, 1, 0]]);
        value["objects"][1]["name"] = json!("original");
    }
    value["render"]["structure"] = json!(structure);
    compile(&value)
}

fn ray(i: u32) -> Ray {
    let sample = SamplePoint::new(7, i);
    let around = Vec3::new(sample.get(0), sample.get(1), sample.get(2)) - 0.3;
    let origin = around + uniform_sphere(sample.get_2d(3)) * 4.0;
    let target = Vec3::new(sample.get(5), sample.get(6), sample.get(7)) - 0.3;
    Ray::new(origin, (target - origin).normalize())
}

/// Hits of the first object at a moment are those of the same object at rest there, up to the rounding of the ray
/// (half an ulp of 4 m on either side, more where it is grazing).
fn moves_like(moving: &Scene, at_rest: &Scene, time: f32, what: &str) {
    let mut hits = 0;
    let mut differ = 0;
    for i in 0..8000 {
        let ray = ray(i).at_time(time);
        let first = |scene: &Scene| scene.geometry.closest_hit(&ray).filter(|hit| hit.object == ObjectId(0));
        let (a, b) = (first(moving), first(at_rest));
        let Some((a, b)) = a.zip(b) else {
            differ += u32::from(a.is_some() != b.is_some());
            continue;
        };
        hits += 1;
        // A ray that only grazes arrives some way off for a rounding error of its origin.
        let cosine = ray.direction.dot(b.surface.normal).abs().max(1e-3);
        let slack = 4e-6 / cosine;
        if (a.t - b.t).abs() > slack {
            differ += 1;
            continue;
        }
        assert!(a.surface.point.distance(b.surface.point) < 2.0 * slack, "{what} {i}: {a:?} {b:?}");
        assert!(a.surface.normal.dot(b.surface.normal) > 0.999, "{what} {i}: {a:?} {b:?}");
        assert!(a.surface.shading_normal.dot(b.surface.shading_normal) > 0.999, "{what} {i}");
    }
    // What differs are rays that meet an edge to rounding.
    assert!(hits > 50 && differ <= 4, "{what}: {hits} hits, {differ} differ");
}

#[test]
fn every_shape_with_a_velocity_is_at_every_moment_where_it_would_rest() {
    for shape in shapes().as_array().unwrap() {
        let mut moving = shape.clone();
        moving["velocity"] = json!([0.75, -0.5, 0.25]);
        let moving = alone(&moving, "auto");
        for time in [0.0_f32, 0.25, 1.0] {
            let mut rest = shape.clone();
            let t = f64::from(time);
            // An instance of the shape in the place it has then.
            let by = [0.75 * t, -0.5 * t, 0.25 * t];
            if rest["type"] == "instance" {
                rest["translate"] = json!([0.2 + by[0], 0.3 + by[1], by[2]]);
                moves_like(&moving, &alone(&rest, "auto"), time, "instance");
                continue;
            }
            moves_like(
                &moving,
                &placed(&rest, &json!({ "translate": by })),
                time,
                &shape["type"].to_string(),
            );
        }
    }
}

/// The shape as an instance of itself; the original is out of the way.
fn placed(shape: &Value, pose: &Value) -> Scene {
    let mut instance = pose.clone();
    instance["type"] = json!("instance");
    instance["of"] = json!("shape");
    instance["material"] = json!("floor");
    let mut shape = shape.clone();
    shape["name"] = json!("shape");
    shape["material"] = json!("floor");
    let mut value = scene(strip(0.0, 1.0), json!([instance, shape]), json!([]));
    value["objects"][1]["velocity"] = json!([0, 0, 1000]);
    value["camera"]["shutter"] = json!([1, 1]);
    compile(&value)
}

#[test]
fn what_turns_and_moves_is_at_every_moment_where_an_instance_would_be() {
    for shape in shapes().as_array().unwrap() {
        if shape["type"] == "instance" {
            continue;
        }
        let mut moving = shape.clone();
        moving["motion"] = json!({ "about": [0, 0, 0], "translate": [0.4, 0.2, -0.4],
            "rotate": { "axis": [1, 2, -1], "angle": 200 }, "scale": 1.5 });
        let moving = alone(&moving, "auto");
        for time in [0.25_f32, 0.75, 1.0] {
            let t = f64::from(time);
            let pose = json!({ "translate": [0.4 * t, 0.2 * t, -0.4 * t],
                "rotate": { "axis": [1, 2, -1], "angle": 200.0 * t }, "scale": 1.0 + 0.5 * t });
            moves_like(&moving, &placed(shape, &pose), time, &shape["type"].to_string());
        }
    }
}

#[test]
fn what_turns_stays_about_its_own_middle_if_nothing_else_is_said() {
    let turned = |mut shape: Value| {
        shape["motion"] = json!({ "rotate": { "angle": 90 } });
        alone(&shape, "auto")
    };
    // A stick of 2 m along x, seen from above, lies along z in the end.
    let stick = turned(json!({ "type": "box", "center": [5, 0, 5], "size": [2, 0.1, 0.1] }));
    let meets = |x: f32, z: f32, time: f32| {
        let down = Ray::new(Vec3::new(x, 3.0, z), Vec3::NEG_Y).at_time(time);
        stick.geometry.any_hit(&down, 5.0)
    };
    assert!(meets(5.9, 5.0, 0.0) && !meets(5.0, 5.9, 0.0));
    assert!(!meets(5.9, 5.0, 1.0) && meets(5.0, 5.9, 1.0));
    assert!(meets(5.0, 5.0, 0.3));
}

#[test]
fn all_structures_find_the_same_bits_of_what_moves() {
    let mut objects: Vec<Value> = Vec::new();
    for (i, shape) in shapes().as_array().unwrap().iter().enumerate() {
        if shape["type"] == "instance" {
            continue;
        }
        let mut shape = shape.clone();
        shape["material"] = json!("floor");
        objects.push(shape.clone());
        match i % 3 {
            0 => shape["velocity"] = json!([0.3, 0.1 * i as f64, -0.4]),
            1 => shape["motion"] = json!({ "rotate": { "axis": [0, 1, 1], "angle": 50 * i } }),
            _ => shape["motion"] = json!({ "translate": [0, 0.4, 0], "scale": [1, 2, 0.5] }),
        }
        objects.push(shape);
    }
    let built = |structure: Structure| {
        let mut value = scene(open(strip(0.0, 1.0)), json!(objects), json!([]));
        let name = Structure::NAMED.iter().find(|(_, s)| *s == structure).map(|(name, _)| *name);
        value["render"]["structure"] = json!(name);
        compile(&value)
    };
    let list = built(Structure::List);
    let rivals = [Structure::Grid, Structure::Bvh, Structure::Spheres].map(built);
    let mut hits = 0;
    for i in 0..20_000 {
        let time = SamplePoint::new(9, i).get(0);
        let ray = ray(i).at_time(time);
        let (expected, t_max) = (list.geometry.closest_hit(&ray), 1.0 + 5.0 * SamplePoint::new(9, i).get(1));
        hits += u32::from(expected.is_some());
        let blocked = list.geometry.any_hit(&ray, t_max);
        for rival in &rivals {
            let name = rival.geometry.structure();
            assert_eq!(rival.geometry.closest_hit(&ray), expected, "{name} {i}");
            assert_eq!(rival.geometry.any_hit(&ray, t_max), blocked, "{name} {i}");
        }
        assert_eq!(blocked, expected.is_some_and(|hit| hit.t < t_max), "{i}");
    }
    assert!(hits > 5000, "{hits}");
}

#[test]
fn boxes_and_hulls_hold_what_moves_at_all_times() {
    for shape in shapes().as_array().unwrap() {
        let mut moving = shape.clone();
        moving["velocity"] = json!([0.2, 0.1, -0.4]);
        moving["motion"] = json!({ "rotate": { "axis": [1, 0, 1], "angle": 500 }, "scale": [0.7, 1.6, 1] });
        let scene = alone(&moving, "list");
        let bounds = scene.geometry.object_bounds(ObjectId(0));
        let hull = scene.geometry.hull(ObjectId(0));
        let mut hits = 0;
        for i in 0..4000 {
            let ray = ray(i).at_time(SamplePoint::new(9, i).get(0));
            let Some(hit) = scene.geometry.closest_hit(&ray).filter(|h| h.object == ObjectId(0)) else {
                continue;
            };
            hits += 1;
            let (point, error) = (hit.surface.point, hit.surface.error);
            assert!(
                (point + error).cmpge(bounds.min).all() && (point - error).cmple(bounds.max).all(),
                "{i}"
            );
            // No plane has the hull on one side and the point on the other.
            for k in 0..16 {
                let normal = uniform_sphere(SamplePoint::new(3, k).get_2d(0));
                let reach = hull.iter().map(|h| h.position.dot(normal) + h.radius);
                let reach = reach.fold(f32::NEG_INFINITY, f32::max);
                assert!(point.dot(normal) <= reach + 1e-5, "{} {i} {k}", shape["type"]);
            }
        }
        assert!(hits > 100, "{hits}");
    }
}

/// With the shutter open for no time nothing moves: the same bytes, and no time is drawn; the plan says so.
#[test]
fn a_shutter_open_for_no_time_freezes_what_moves() {
    let mut ball = json!({ "type": "sphere", "material": "glass", "center": [0, 0.5, 0], "radius": 0.3 });
    let with = |ball: &Value, camera: Value| {
        scene(
            camera,
            json!([floor(2.0, 0.0), ball]),
            json!([{ "type": "quad", "center": [0, 3, 1], "size": [0.5, 0.5],
            "towards": [0, 0, 0], "radiance": [9, 9, 9] }]),
        )
    };
    let still = with(&ball, strip(0.0, 2.0));
    ball["velocity"] = json!([1, 0, 0]);
    ball["motion"] = json!({ "translate": [0, 1, 0] });
    let frozen = with(&ball, strip(0.0, 2.0));
    assert_eq!(render(&still, 1, 2, 10).image().pixels, render(&frozen, 1, 2, 10).image().pixels);
    let plan = Plan::new(&compile(&frozen));
    let warned: Vec<_> = plan.warnings.iter().map(|w| (w.code, w.pointer.as_deref())).collect();
    assert_eq!(warned, [("shutter_closed", Some("/objects/1"))]);
    let time = |plan: &Plan| plan.decisions.iter().find(|d| d.topic == "time").unwrap().clone();
    assert!(!time(&plan).runs && time(&plan).reason.contains("nothing moves"));
    let moving = Plan::new(&compile(&with(&ball, open(strip(0.0, 2.0)))));
    assert!(time(&moving).runs && moving.warnings.is_empty());
    // At 0.5 s, for an instant, it has moved by half a metre.
    let mut camera = strip(0.0, 2.0);
    camera["shutter"] = json!([0.5, 0.5]);
    let later = compile(&with(&ball, camera));
    assert!(!later.geometry.moves());
    assert!((later.geometry.object_bounds(ObjectId(1)).center() - Vec3::new(0.5, 0.5, 0.0)).length() < 1e-5);
}

#[test]
fn a_resumed_render_of_a_moving_scene_gives_the_same_bytes() {
    let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 0.5, 0], "radius": 0.3, "velocity": [1, 0, 0] });
    let value = scene(open(strip(0.5, 2.0)), json!([floor(2.0, 0.0), ball]), sun());
    let scene = Arc::new(compile(&value));
    let control = Control::new();
    let mut whole = Render::new(Arc::clone(&scene), Plan::new(&scene));
    for _ in 0..2 {
        whole.run_round(&control).unwrap();
    }
    let mut resumed = Render::resume(Arc::clone(&scene), Plan::new(&scene), &whole.checkpoint()).unwrap();
    for render in [&mut whole, &mut resumed] {
        for _ in 0..3 {
            render.run_round(&control).unwrap();
        }
    }
    assert_eq!(whole.image().pixels, resumed.image().pixels);
}

#[test]
fn motion_that_cannot_be_rendered_is_refused_where_it_is_wrong() {
    let ball = |more: Value| {
        let mut ball = json!({ "type": "sphere", "material": "floor", "center": [0, 0, 0], "radius": 1 });
        ball.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        ball
    };
    let mut reversed = strip(0.0, 1.0);
    reversed["shutter"] = json!([1, 0]);
    for (camera, object, pointer, code) in [
        (reversed, ball(json!({})), "/camera/shutter", IssueCode::OutOfRange),
        (
            open(strip(0.0, 1.0)),
            ball(json!({ "velocity": [1e9, 0, 0] })),
            "/objects/0/velocity",
            IssueCode::OutOfRange,
        ),
        (
            open(strip(0.0, 1.0)),
            ball(json!({ "motion": { "scale": 0 } })),
            "/objects/0/motion/scale",
            IssueCode::OutOfRange,
        ),
        (
            open(strip(0.0, 1.0)),
            ball(json!({ "motion": { "turn": 3 } })),
            "/objects/0/motion/turn",
            IssueCode::UnknownField,
        ),
    ] {
        let value = scene(camera, json!([object]), json!([]));
        let errors = Scene::from_json(&value.to_string(), &NoAssets).expect_err(pointer);
        let found: Vec<_> = errors.issues.iter().map(|i| (i.pointer.as_str(), i.code)).collect();
        assert_eq!(found, [(pointer, code)]);
    }
}
