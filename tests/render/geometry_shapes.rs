//! Disks, cylinders, boxes, height fields and instances: hits, normals, borders and what is refused.

use crate::support::{camera_above, compile, scene};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use nephroid::geometry::{Geometry, GeometryBuilder, MeshData, Ray, offset_origin};
use nephroid::sampling::{SamplePoint, uniform_sphere};
use nephroid::scene::{NoAssets, ObjectId, Scene};
use serde_json::{Value, json};

fn random(seed: u64, i: u32) -> Vec3 {
    let sample = SamplePoint::new(seed, i);
    Vec3::new(sample.get(0), sample.get(1), sample.get(2)) * 2.0 - 1.0
}

fn built(fill: impl FnOnce(&mut GeometryBuilder)) -> Geometry {
    let mut builder = GeometryBuilder::default();
    fill(&mut builder);
    builder.build()
}

/// A scene of some objects over nothing.
fn with_objects(objects: &Value) -> Value {
    scene(camera_above([0.0, 0.0, 0.0], 4.0, 2.0), objects.clone(), json!([]))
}

/// The pointers of what is wrong with a scene of these objects.
fn pointers(objects: &Value) -> Vec<String> {
    let errors =
        Scene::from_json(&with_objects(objects).to_string(), &NoAssets).expect_err("the scene is wrong");
    errors.issues.into_iter().map(|issue| issue.pointer).collect()
}

/// A disk is hit within its radius from both sides, and not edge on (F7).
#[test]
fn a_disk_has_its_area_and_no_edge() {
    let geometry = &built(|b| b.disk(ObjectId(0), Vec3::new(2.0, 1.0, 0.0), Vec3::new(0.0, 3.0, 0.0), 0.5));
    let inside = |side: f32| {
        (0..40_000).filter(move |i| {
            let (x, z) = ((i % 200) as f32 * 0.01 + 1.005, (i / 200) as f32 * 0.01 - 0.995);
            geometry.any_hit(&Ray::new(Vec3::new(x, 1.0 + side, z), Vec3::Y * -side), 2.0)
        })
    };
    for side in [1.0, -1.0] {
        let area = inside(side).count() as f64 * 1e-4;
        // Cells of a grid within a circle: the error goes with the circumference in cells to the 2/3.
        assert!((area - 0.25 * std::f64::consts::PI).abs() < 2e-3, "{area}");
    }
    for y in [1.0, 1.0 + 1e-7] {
        assert!(geometry.closest_hit(&Ray::new(Vec3::new(0.0, y, 0.0), Vec3::X)).is_none());
    }
    let hit = geometry.closest_hit(&Ray::new(Vec3::new(2.1, -1.0, 0.2), Vec3::Y)).unwrap();
    assert_eq!((hit.t, hit.surface.normal), (2.0, Vec3::Y));
}

/// An open cylinder: outside, inside through the open end, and along the axis; also from far away.
#[test]
fn a_cylinder_is_open_and_round() {
    let geometry = built(|b| b.cylinder(ObjectId(0), Vec3::ZERO, Vec3::Y * 2.0, 0.5));
    let hit = |origin: Vec3, direction: Vec3| geometry.closest_hit(&Ray::new(origin, direction.normalize()));
    let outside = hit(Vec3::new(3.0, 1.0, 0.0), Vec3::NEG_X).unwrap();
    assert_eq!((outside.t, outside.surface.normal), (2.5, Vec3::X));
    // Through the open end onto the inner side: 0.5 across for 2 down.
    let inner = hit(Vec3::new(0.0, 3.0, 0.0), Vec3::new(0.5, -2.0, 0.0)).unwrap();
    assert!((inner.surface.point - Vec3::new(0.5, 1.0, 0.0)).length() < 1e-6, "{inner:?}");
    assert!(hit(Vec3::new(0.1, 3.0, 0.0), Vec3::NEG_Y).is_none());
    assert!(hit(Vec3::new(3.0, 2.01, 0.0), Vec3::NEG_X).is_none());
    for i in 0..1000 {
        let target = Vec3::new(0.3, 1.0, 0.0) + random(1, i) * 0.1;
        let origin = random(2, i).with_y(0.0).normalize() * 1e5;
        let surface = hit(origin, target - origin).unwrap().surface;
        let off = (f64::from(surface.point.x).hypot(f64::from(surface.point.z)) - 0.5).abs();
        assert!(off <= f64::from(surface.error), "{off} {}", surface.error);
    }
}

/// T3 for the new shapes: a ray that leaves a disk or the outside of a cylinder does not meet it again.
#[test]
fn t3_rays_that_leave_a_disk_or_cylinder_do_not_meet_it_again() {
    for scale in [1e-3_f32, 1.0, 1e3] {
        for i in 0..2000 {
            let (center, axis) = (Vec3::new(3.0, -2.0, 1.0) * scale, random(1, i).normalize());
            let geometry = built(|b| match i % 2 {
                0 => b.disk(ObjectId(0), center, axis, scale),
                _ => b.cylinder(ObjectId(0), center - axis * scale, center + axis * scale, scale),
            });
            let from = center + (random(2, i) + axis * 3.0).normalize() * 4.0 * scale;
            let ray = Ray::new(from, (center + random(3, i) * 0.3 * scale - from).normalize());
            let Some(hit) = geometry.closest_hit(&ray) else { continue };
            let s = hit.surface;
            let away = uniform_sphere(SamplePoint::new(4, i).get_2d(0));
            let away = if away.dot(s.normal) < 0.0 { -away } else { away };
            let origin = offset_origin(s.point, s.error, s.normal, away);
            assert!(geometry.closest_hit(&Ray::new(origin, away)).is_none(), "{scale} {i}");
        }
    }
}

/// The kernel's mass on a disk and a cylinder, against a sum over a fine grid of the kernel.
#[test]
fn the_kernels_mass_near_a_rim_is_right() {
    let disk = built(|b| b.disk(ObjectId(0), Vec3::ZERO, Vec3::Y, 1.0));
    let cylinder = built(|b| b.cylinder(ObjectId(0), Vec3::ZERO, Vec3::Y, 1000.0));
    // From the point, a along and b towards the rim, in kernel radii.
    let sum = |inside: &dyn Fn(f64, f64) -> bool| {
        let n = 800;
        let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n) * 2.0 - 1.0;
        let kernel = |k: i32| {
            let (a, b) = (at(k % n), at(k / n));
            let weight = (1.0 - a * a - b * b).max(0.0) * 2.0 / std::f64::consts::PI;
            if inside(a, b) { weight } else { 0.0 }
        };
        (0..n * n).map(kernel).sum::<f64>() * 4.0 / f64::from(n * n)
    };
    for radius in [0.1_f64, 0.5, 1.2] {
        for distance in [0.0, 0.3, 0.8, 1.0] {
            let point = Vec3::new(distance as f32, 0.0, 0.0);
            let ray = Ray::new(point * 0.999 + Vec3::Y, Vec3::NEG_Y);
            let sheet = disk.closest_hit(&ray).unwrap().sheet;
            let mass = f64::from(disk.kernel_mass(sheet, point, radius as f32, 0.0));
            let right = sum(&|a, b| (a * radius).hypot(distance + b * radius) <= 1.0);
            assert!((mass - right).abs() < 3e-3, "disk {radius} {distance}: {mass} {right}");
            let height = 1.0 - distance;
            let point = Vec3::new(1000.0, height as f32, 0.0);
            let ray = Ray::new(Vec3::new(2000.0, 0.5, 0.0), Vec3::NEG_X);
            let sheet = cylinder.closest_hit(&ray).unwrap().sheet;
            let mass = f64::from(cylinder.kernel_mass(sheet, point, radius as f32, 0.0));
            let right = sum(&|_, b| (0.0..=1.0).contains(&(height + b * radius)));
            assert!((mass - right).abs() < 3e-3, "cylinder {radius} {distance}: {mass} {right}");
        }
    }
}

/// Hulls and boxes hold every point of the surface.
#[test]
fn hulls_and_boxes_hold_their_shapes() {
    for i in 0..50 {
        let axis = random(1, i);
        let geometry = built(|b| match i % 2 {
            0 => b.disk(ObjectId(0), random(2, i), axis, 0.7),
            _ => b.cylinder(ObjectId(0), random(2, i), random(2, i) + axis, 0.7),
        });
        let (hull, bounds) = (geometry.hull(ObjectId(0)), geometry.object_bounds(ObjectId(0)));
        for k in 0..400 {
            let from = random(2, i) + random(3, k) * 5.0;
            let target = random(2, i) + random(4, k) * 0.7;
            let Some(hit) = geometry.closest_hit(&Ray::new(from, (target - from).normalize())) else {
                continue;
            };
            let p = hit.surface.point;
            assert!(bounds.min.cmple(p).all() && bounds.max.cmpge(p).all(), "{i} {k}");
            let direction = uniform_sphere(SamplePoint::new(5, k).get_2d(0));
            let reach = hull.iter().map(|h| h.position.dot(direction) + h.radius).fold(f32::MIN, f32::max);
            assert!(
                p.dot(direction) <= reach,
                "{i} {k}: {p} beyond the hull by {}",
                p.dot(direction) - reach
            );
        }
    }
}

/// A box is closed and its sides face outwards.
#[test]
fn a_box_is_closed_and_faces_outwards() {
    let file = json!([{ "type": "box", "center": [1, 2, 3], "size": [2, 4, 1], "material": "glass" }]);
    let scene = compile(&with_objects(&file));
    let center = Vec3::new(1.0, 2.0, 3.0);
    for i in 0..5000 {
        let direction = uniform_sphere(SamplePoint::new(1, i).get_2d(0));
        let hit = scene.geometry.closest_hit(&Ray::new(center, direction)).unwrap();
        let local = (hit.surface.point - center) / Vec3::new(1.0, 2.0, 0.5);
        assert!((local.abs().max_element() - 1.0).abs() < 1e-6, "{local}");
        assert!(hit.surface.normal.dot(direction) > 0.0, "{i}");
    }
}

/// A height field through a plane is that plane, with its normal; over a bump the normals follow the heights.
#[test]
fn a_height_field_has_its_heights_and_normals() {
    let heights: Vec<Vec<f64>> =
        (0..4).map(|i| (0..5).map(|j| 0.25 * f64::from(j) - 0.5 * f64::from(i)).collect()).collect();
    let file = json!([{ "type": "heightfield", "center": [1, 2, 3], "size": [4, 6], "heights": heights,
        "material": "floor" }]);
    let scene = compile(&with_objects(&file));
    let normal = Vec3::new(-0.25, 1.0, 0.25).normalize();
    for i in 0..1000 {
        let (x, z) = (random(1, i).x * 1.99, random(1, i).z * 2.99);
        let ray = Ray::new(Vec3::new(1.0 + x, 9.0, 3.0 + z), Vec3::NEG_Y);
        let hit = scene.geometry.closest_hit(&ray).unwrap();
        let height = 2.0 + 0.25 * (x + 2.0) - 0.25 * (z + 3.0);
        assert!((hit.surface.point.y - height).abs() < 2e-6, "{i}: {}", hit.surface.point.y - height);
        assert!((hit.surface.shading_normal - normal).length() < 1e-5, "{i}");
    }
    let ragged = json!([{ "type": "heightfield", "size": [4, 6], "heights": [[0, 0], [0, 0, 0]], "material": "floor" }]);
    assert_eq!(pointers(&ragged), ["/objects/0/heights/1"]);
}

/// A bumpy closed mesh around the origin.
fn bumpy() -> MeshData {
    let n = 24_u16;
    let mut mesh = MeshData::default();
    let angle = |k: u16| std::f32::consts::PI * f32::from(k) / f32::from(n);
    for i in 0..=n {
        for j in 0..2 * n {
            let (theta, phi) = (angle(i), angle(j));
            let p = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            mesh.normals.push(p.normalize());
            mesh.positions.push(p * (1.0 + 0.1 * (5.0 * theta).sin()));
        }
    }
    let around = 2 * u32::from(n);
    let at = |i: u32, j: u32| i * around + j % around;
    for i in 0..u32::from(n) {
        for j in 0..around {
            mesh.triangles.push([at(i, j), at(i, j + 1), at(i + 1, j)]);
            mesh.triangles.push([at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]);
        }
    }
    mesh
}

/// An instance is the mesh with every vertex moved, up to rounding; at the identity it is the mesh itself.
#[test]
fn an_instance_is_the_transformed_mesh() {
    let mesh = bumpy();
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 0.7);
    let moved = DAffine3::from_scale_rotation_translation(
        DVec3::new(0.5, 2.0, 1.0),
        turn,
        DVec3::new(3.0, 1.0, -2.0),
    );
    for place in [DAffine3::IDENTITY, moved] {
        let instance = built(|b| {
            let shared = b.share(&mesh);
            b.instance(ObjectId(0), shared, place);
        });
        let mut copy = mesh.clone();
        copy.positions.iter_mut().for_each(|p| *p = place.transform_point3(p.as_dvec3()).as_vec3());
        let normals = place.matrix3.inverse().transpose();
        copy.normals.iter_mut().for_each(|n| *n = (normals * n.as_dvec3()).normalize().as_vec3());
        let baked = built(|b| b.mesh(ObjectId(0), &copy));
        let center = place.translation.as_vec3();
        for i in 0..3000 {
            let ray = Ray::new(center + random(1, i) * 4.0, uniform_sphere(SamplePoint::new(2, i).get_2d(0)));
            let (a, b) = (instance.closest_hit(&ray), baked.closest_hit(&ray));
            if place == DAffine3::IDENTITY {
                let place =
                    |hit: nephroid::geometry::Hit| (hit.t, hit.surface.point, hit.surface.texture.uv());
                assert_eq!(a.map(place), b.map(place), "{i}");
                continue;
            }
            assert_eq!(instance.any_hit(&ray, 2.0), a.is_some_and(|hit| hit.t < 2.0), "{i}");
            // A ray at the very silhouette may differ.
            let (Some(a), Some(b)) = (a, b) else { continue };
            if (a.t - b.t).abs() < 1e-4 {
                assert!((a.surface.point - b.surface.point).length() < 1e-4, "{i}");
                assert!(a.surface.normal.dot(b.surface.normal) > 0.999, "{i}");
                assert!(a.surface.normal.dot(a.surface.shading_normal) > 0.0, "{i}");
            }
        }
        let agree = (0..3000).filter(|&i| {
            let ray = Ray::new(center + random(1, i) * 4.0, uniform_sphere(SamplePoint::new(2, i).get_2d(0)));
            let t = |geometry: &Geometry| geometry.closest_hit(&ray).map_or(-1.0, |hit| hit.t);
            (t(&instance) - t(&baked)).abs() < 1e-4
        });
        assert!(agree.count() >= 2995);
    }
}

/// Many instances take hardly more memory than one.
#[test]
fn instances_share_their_mesh() {
    let bytes = |count: u32| {
        let geometry = built(|b| {
            let shared = b.share(&bumpy());
            for i in 0..count {
                let place = DAffine3::from_translation(random(1, i).as_dvec3() * 100.0);
                b.instance(ObjectId(i), shared, place);
            }
        });
        geometry.memory_bytes()
    };
    assert!(bytes(101) - bytes(1) < 100 * 500, "{} {}", bytes(1), bytes(101));
}

/// Instances of every shape through the scene file: scaled, turned, then moved.
#[test]
fn the_scene_file_places_instances_of_every_shape() {
    let shapes = [
        json!({ "type": "sphere", "center": [1, 0, 0], "radius": 0.5 }),
        json!({ "type": "box", "center": [1, 0, 0], "size": [1, 1, 1] }),
        json!({ "type": "disk", "center": [1, 0, 0], "radius": 0.5 }),
        json!({ "type": "cylinder", "from": [1, -0.5, 0], "to": [1, 0.5, 0], "radius": 0.5 }),
        json!({ "type": "polygon", "vertices": [[0.5, 0, 0.5], [1.5, 0, 0.5], [1.5, 0, -0.5], [0.5, 0, -0.5]] }),
        json!({ "type": "heightfield", "center": [1, 0, 0], "size": [1, 1], "heights": [[0, 0], [0, 0]] }),
        json!({ "type": "mesh", "positions": [[0.5, 0, 0.5], [1.5, 0, 0.5], [1, 0, -0.5]], "triangles": [[0, 1, 2]] }),
    ];
    for mut shape in shapes {
        shape["name"] = json!("original");
        shape["material"] = json!("floor");
        let copy = json!({ "type": "instance", "of": "original", "scale": 2, "rotate": { "angle": 90 },
            "translate": [10, 0, 0], "material": "mirror" });
        let scene = compile(&with_objects(&json!([copy, shape])));
        // The middle goes from (1, 0, 0) to (2, 0, 0), by 90 degrees about y to (0, 0, -2), and to (10, 0, -2).
        let middle = Vec3::new(10.0, 0.0, -2.0);
        let bounds = scene.geometry.object_bounds(ObjectId(0));
        assert!((bounds.center() - middle).length() < 1e-5, "{shape}: {bounds:?}");
        let from = middle + Vec3::new(3.0, 1.5, 0.4);
        let ray = Ray::new(from, (middle + Vec3::new(0.05, 0.0, 0.03) - from).normalize());
        let object = scene.geometry.closest_hit(&ray).map(|hit| hit.object);
        assert_eq!(object, Some(ObjectId(0)), "{shape}");
        let original = scene.geometry.object_bounds(ObjectId(1));
        assert!((original.center() - Vec3::X).length() < 1e-5, "{shape}: {original:?}");
    }
}

/// What cannot be placed is refused with a pointer.
#[test]
fn wrong_shapes_and_instances_are_refused_where_they_are_wrong() {
    let ball =
        json!({ "type": "sphere", "name": "ball", "center": [0, 0, 0], "radius": 1, "material": "floor" });
    let of = |name: &str| json!({ "type": "instance", "name": "copy", "of": name, "material": "floor" });
    assert_eq!(pointers(&json!([ball, of("bal")])), ["/objects/1/of"]);
    assert_eq!(pointers(&json!([ball, of("copy")])), ["/objects/1/of"]);
    assert_eq!(pointers(&json!([ball, ball, of("ball")])), ["/objects/2/of"]);
    let mut flat = of("ball");
    flat["scale"] = json!([1, 2, 1]);
    assert_eq!(pointers(&json!([ball, flat])), ["/objects/1/scale"]);
    flat["scale"] = json!(0);
    assert_eq!(pointers(&json!([ball, flat])), ["/objects/1/scale"]);
    let can =
        json!({ "type": "cylinder", "from": [1, 1, 1], "to": [1, 1, 1], "radius": 1, "material": "floor" });
    assert_eq!(pointers(&json!([can])), ["/objects/0/to"]);
    let crate_ = json!({ "type": "box", "center": [0, 0, 0], "size": [1, 0, 1], "material": "floor" });
    assert_eq!(pointers(&json!([crate_])), ["/objects/0/size/1"]);
}
