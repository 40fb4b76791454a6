//! The structures that find what a ray meets: all find the same, and none fails on odd scenes.

use crate::support::{camera_above, compile, floor, scene};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use nephroid::geometry::{Geometry, GeometryBuilder, Hit, MeshData, Ray, Structure};
use nephroid::plan::Plan;
use nephroid::sampling::{SamplePoint, uniform_sphere};
use nephroid::scene::ObjectId;
use serde_json::json;

const RIVALS: [Structure; 3] = [Structure::Grid, Structure::Bvh, Structure::Spheres];

fn random(seed: u64, i: u32) -> Vec3 {
    let sample = SamplePoint::new(seed, i);
    Vec3::new(sample.get(0), sample.get(1), sample.get(2)) * 2.0 - 1.0
}

/// Each structure over the same primitives, the list first.
fn all(fill: impl Fn(&mut GeometryBuilder)) -> Vec<Geometry> {
    let build = |structure| {
        let mut builder = GeometryBuilder::default();
        fill(&mut builder);
        builder.build_as(structure)
    };
    [Structure::List].into_iter().chain(RIVALS).map(build).collect()
}

/// A height field on `[-1, 1]²` with `2 * cells²` triangles; its vertices lie on a regular grid.
fn hills(cells: u8, height: f32) -> MeshData {
    let mut mesh = MeshData::default();
    let n = u32::from(cells);
    for i in 0..=cells {
        for j in 0..=cells {
            let (x, z) = (f32::from(j) / f32::from(cells), f32::from(i) / f32::from(cells));
            let y = height * ((9.0 * x).sin() * (7.0 * z).cos());
            mesh.positions.push(Vec3::new(2.0 * x - 1.0, y, 2.0 * z - 1.0));
        }
    }
    for i in 0..n {
        for j in 0..n {
            let at = i * (n + 1) + j;
            mesh.triangles.push([at, at + n + 1, at + 1]);
            mesh.triangles.push([at + 1, at + n + 1, at + n + 2]);
        }
    }
    mesh
}

/// Spheres, polygons and triangles of all sizes, many of them twice, touching and flat.
fn mixed(builder: &mut GeometryBuilder) {
    for i in 0..60 {
        let at = random(1, i);
        let size = 0.01 + 0.2 * SamplePoint::new(2, i).get(0);
        builder.sphere(ObjectId(i % 7), at, size);
        builder.sphere(ObjectId(7), at, size);
        let corners: Vec<Vec3> = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
            .map(|(a, b)| at + Vec3::new(a as f32, 0.0, b as f32) * size)
            .into();
        builder.polygon(ObjectId(8 + i), &[corners]).expect("a square is a polygon");
        builder.disk(ObjectId(80), at, random(6, i), size);
        builder.cylinder(ObjectId(81), at, at + random(7, i) * 0.2, 0.2 * size);
    }
    let shared = builder.share(&hills(12, 0.3));
    for i in 0..20 {
        let turn = DQuat::from_axis_angle(random(8, i).as_dvec3().normalize(), f64::from(i));
        let scale = DVec3::new(0.1, 0.2, 0.3) * f64::from(1 + i % 3);
        let place = DAffine3::from_scale_rotation_translation(scale, turn, random(9, i / 2).as_dvec3());
        builder.instance(ObjectId(82 + i), shared, place);
    }
    builder.instance(ObjectId(79), shared, DAffine3::IDENTITY);
    builder.mesh(ObjectId(70), &hills(12, 0.3));
    builder.mesh(ObjectId(71), &hills(12, 0.0));
    builder.mesh(ObjectId(72), &hills(12, 0.0));
}

/// Random rays, rays along axes (also with a negative zero) and through corners of the meshes and cells, from
/// near and from far away.
fn ray(i: u32) -> Ray {
    let far = [1.0, 1.5, 30.0, 3e4][i as usize / 8 % 4];
    let mut origin = random(3, i) * far;
    let target = (random(4, i) * 6.0).round() / 6.0;
    match i % 8 {
        0..3 => Ray::new(origin, uniform_sphere(SamplePoint::new(5, i).get_2d(0))),
        3 | 4 => Ray::new(origin, (target - origin).normalize()),
        5 => Ray::new(target, Vec3::new(1.0, 1.0, 1.0).normalize() * if i % 16 < 8 { 1.0 } else { -1.0 }),
        6 | 7 => {
            let axis = i as usize / 8 % 3;
            let mut direction = Vec3::splat(if i.is_multiple_of(2) { 0.0 } else { -0.0 });
            direction[axis] = if i.is_multiple_of(3) { 1.0 } else { -1.0 };
            origin = target;
            origin[axis] = -direction[axis] * far;
            Ray::new(origin, direction)
        }
        8.. => unreachable!(),
    }
}

/// F41, F39: every structure finds what testing every primitive finds, bit for bit.
#[test]
fn f39_f41_all_structures_find_the_same_bits() {
    let geometries = all(mixed);
    let [list, rivals @ ..] = &geometries[..] else { unreachable!() };
    let mut hits = 0;
    for i in 0..40_000 {
        let ray = ray(i);
        let expected: Option<Hit> = list.closest_hit(&ray);
        let t_max = if i.is_multiple_of(5) { f32::INFINITY } else { ray.origin.length() };
        let blocked = list.any_hit(&ray, t_max);
        assert_eq!(blocked, expected.is_some_and(|hit| hit.t < t_max), "{i}");
        for rival in rivals {
            assert_eq!(rival.closest_hit(&ray), expected, "{} {i}: {ray:?}", rival.structure());
            assert_eq!(rival.any_hit(&ray, t_max), blocked, "{} {i}: {ray:?}", rival.structure());
        }
        hits += u32::from(expected.is_some());
    }
    assert!((10_000..39_000).contains(&hits), "{hits}");
}

/// F39, F41: a million rays over things whose faces and corners lie on the cells of a grid: along all 26 axes and diagonals,
/// with zeros of either sign, from points in the planes of faces and of cells, and at random. Each structure finds what
/// testing every primitive finds.
#[test]
fn f39_f41_a_million_rays_through_planes_and_corners_of_cells() {
    let block = |builder: &mut GeometryBuilder, object: u32, at: Vec3| {
        let mut mesh = MeshData::default();
        let corner = |i: u8| Vec3::new(f32::from(i & 1), f32::from(i >> 1 & 1), f32::from(i >> 2 & 1));
        mesh.positions = (0..8).map(|i| at + corner(i)).collect();
        for [a, b, c, d] in
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        {
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
        builder.mesh(ObjectId(object), &mesh);
    };
    let geometries = all(|builder| {
        // In a cube of 4³ a grid's cells have their planes where the blocks have theirs.
        for (i, at) in
            [[0, 0, 0], [3, 3, 3], [0, 2, 1], [1, 2, 1], [2, 0, 3], [3, 1, 0]].into_iter().enumerate()
        {
            block(builder, i as u32, Vec3::from_array(at.map(|x: u8| f32::from(x))));
        }
        builder.sphere(ObjectId(9), Vec3::new(2.5, 3.5, 0.5), 0.5);
        let tile = [(1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0)].map(|(x, z)| Vec3::new(x, 1.0, z));
        builder.polygon(ObjectId(10), &[tile.to_vec()]).expect("a square is a polygon");
    });
    let [list, rivals @ ..] = &geometries[..] else { unreachable!() };
    let signed = |k: u32, zero: f32| [-1.0, zero, 1.0][k as usize % 3];
    let mut hits = 0;
    for i in 0..1_000_000_u32 {
        let random = SamplePoint::new(12, i);
        let place = Vec3::new(random.get(0), random.get(1), random.get(2)) * 6.0 - 1.0;
        let zero = if i.is_multiple_of(2) { 0.0 } else { -0.0 };
        let axis = Vec3::new(signed(i, zero), signed(i / 3, zero), signed(i / 9, zero));
        let ray = match i / 27 % 4 {
            // On corners of cells, in the middle of their sides, or anywhere in a plane.
            0 if axis != Vec3::ZERO => Ray::new((place * 2.0).round() / 2.0, axis.normalize()),
            1 if axis != Vec3::ZERO => {
                Ray::new(Vec3::new(place.x, place.y.round(), place.z), axis.normalize())
            }
            2 => Ray::new(place, ((place * 7.3).fract() * 4.0).round() - place),
            _ => Ray::new(place, uniform_sphere(random.get_2d(3))),
        };
        let Some(direction) = ray.direction.try_normalize() else { continue };
        let ray = Ray { direction, ..ray };
        let expected = list.closest_hit(&ray);
        hits += u32::from(expected.is_some());
        for rival in rivals {
            assert_eq!(rival.closest_hit(&ray), expected, "{} {i}: {ray:?}", rival.structure());
        }
    }
    assert!((200_000..900_000).contains(&hits), "{hits}");
}

/// F37: no, one and very many equal primitives.
#[test]
fn f37_empty_single_and_identical_primitives_do_no_harm() {
    let down = Ray::new(Vec3::new(0.1, 3.0, 0.05), Vec3::NEG_Y);
    for geometry in all(|_| ()) {
        assert!(geometry.closest_hit(&down).is_none() && !geometry.any_hit(&down, f32::INFINITY));
    }
    let count = 10_000;
    let triangle = MeshData {
        positions: vec![
            Vec3::new(-1.0, 1.0, 1.0),
            Vec3::new(1.0, 1.0, 1.0),
            Vec3::new(0.0, 1.0, -1.0),
            Vec3::ONE,
        ],
        triangles: vec![[0, 1, 2]],
        ..MeshData::default()
    };
    for (copies, index) in [(1, [0, 1, 2]), (count, [0, 1, 2]), (count, [3, 3, 3])] {
        let mut mesh = triangle.clone();
        mesh.triangles = vec![index; copies];
        mesh.triangles.push([0, 1, 2]);
        for geometry in all(|builder| {
            builder.mesh(ObjectId(0), &mesh);
            (0..copies).for_each(|_| builder.sphere(ObjectId(1), Vec3::ZERO, 0.5));
        }) {
            let hit = geometry.closest_hit(&down).unwrap();
            assert_eq!((hit.object, hit.t), (ObjectId(0), 2.0), "{}", geometry.structure());
            // From below the triangles, the spheres.
            let hit = geometry.closest_hit(&Ray::new(Vec3::new(0.0, 0.9, 0.0), Vec3::NEG_Y)).unwrap();
            assert_eq!(hit.object, ObjectId(1), "{}", geometry.structure());
        }
    }
}

/// F38: nested primitives whose sizes are a geometric series, from the largest to the smallest float that a
/// scene may hold, and ten thousand nested spheres of nearly one size.
#[test]
fn f38_nested_primitives_are_found_without_deep_recursion() {
    let nested = |step: f32, count: i32, start: f32| {
        all(|builder| {
            for i in 0..count {
                let size = start * step.powi(i);
                builder.sphere(ObjectId(0), Vec3::X * size, size);
                let [a, b, c] = [Vec3::ZERO, Vec3::X, Vec3::Z].map(|p| p * size);
                let mesh =
                    MeshData { positions: vec![a, b, c], triangles: vec![[0, 1, 2]], ..MeshData::default() };
                builder.mesh(ObjectId(1), &mesh);
            }
        })
    };
    for geometries in [nested(0.5, 60, 1e9), nested(0.999, 10_000, 1.0)] {
        let [list, rivals @ ..] = &geometries[..] else { unreachable!() };
        for i in 0..200 {
            let ray = Ray::new(random(1, i), uniform_sphere(SamplePoint::new(2, i).get_2d(0)));
            let expected = list.closest_hit(&ray);
            for rival in rivals {
                assert_eq!(rival.closest_hit(&ray), expected, "{} {i}", rival.structure());
            }
        }
    }
}

/// F43: from anywhere inside a closed mesh every ray hits, also through edges and corners, and from far outside
/// every ray that aims well inside.
#[test]
fn f43_a_fine_closed_mesh_has_no_holes_seen_from_near_and_far() {
    let segments = 120_u16;
    let mut mesh = MeshData::default();
    let angle = |k: u16| std::f64::consts::PI * f64::from(k) / f64::from(segments);
    for i in 0..=segments {
        for j in 0..2 * segments {
            let (theta, phi) = (angle(i), angle(j));
            let p = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            mesh.positions.push(p.as_vec3());
        }
    }
    let around = 2 * u32::from(segments);
    let at = |i: u32, j: u32| i * around + j % around;
    for i in 0..u32::from(segments) {
        for j in 0..around {
            mesh.triangles.push([at(i, j), at(i, j + 1), at(i + 1, j)]);
            mesh.triangles.push([at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]);
        }
    }
    let mut builder = GeometryBuilder::default();
    builder.mesh(ObjectId(0), &mesh);
    let geometry = builder.build();
    for i in 0..100_000_u32 {
        let [a, b, _] = mesh.triangles[i as usize % mesh.triangles.len()].map(|v| mesh.positions[v as usize]);
        let target = if i.is_multiple_of(3) { a } else { a.lerp(b, SamplePoint::new(3, i).get(0)) };
        let inside = random(4, i) * 0.5;
        let ray = Ray::new(inside, (target - inside).normalize());
        assert!(geometry.closest_hit(&ray).is_some(), "{i}: {ray:?}");
        let outside = random(5, i).normalize() * 10_f32.powi(i as i32 % 5 + 1);
        let ray = Ray::new(outside, (target * 0.9 - outside).normalize());
        assert!(geometry.closest_hit(&ray).is_some(), "{i}: {ray:?}");
    }
}

/// F40: a detailed thing in a large place. The grid puts nearly all of it into one cell, and says so; the
/// hierarchies see no difference.
#[test]
fn f40_a_teapot_in_a_stadium_defeats_the_grid_but_not_the_hierarchies() {
    let teapot = |builder: &mut GeometryBuilder, stadium: bool| {
        let mut mesh = hills(100, 0.3);
        mesh.positions.iter_mut().for_each(|p| *p *= 0.1);
        builder.mesh(ObjectId(0), &mesh);
        if stadium {
            let corners = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
            builder
                .polygon(
                    ObjectId(1),
                    &[corners.map(|(x, z)| Vec3::new(200.0 * x - 0.6, -1.0, 200.0 * z - 0.6)).into()],
                )
                .expect("a square is a polygon");
        }
    };
    let build = |structure, stadium| {
        let mut builder = GeometryBuilder::default();
        teapot(&mut builder, stadium);
        builder.build_as(structure)
    };
    let fullest = |stadium| build(Structure::Grid, stadium).structure_reason();
    assert!(fullest(true).ends_with("(99 %)") || fullest(true).ends_with("(100 %)"), "{}", fullest(true));
    assert!(fullest(false).ends_with("(0 %)") || fullest(false).ends_with("(1 %)"), "{}", fullest(false));
    // What they find is the same.
    let (grid, boxes) = (build(Structure::Grid, true), build(Structure::Bvh, true));
    for i in 0..500 {
        let from = Vec3::new(0.0, 0.4, 0.3) + random(1, i) * 0.1;
        let ray = Ray::new(from, (random(2, i) * Vec3::new(0.1, 0.0, 0.1) - from).normalize());
        assert_eq!(grid.closest_hit(&ray), boxes.closest_hit(&ray), "{i}");
    }
}

/// The scene file chooses the structure, the plan names it and says why, and the picture is the same.
#[test]
fn the_scene_file_chooses_the_structure_and_the_plan_says_why() {
    let ball = json!({ "type": "sphere", "center": [0, 1, 0], "radius": 0.5, "material": "mirror" });
    for (name, structure) in
        [("auto", "list"), ("list", "list"), ("grid", "grid"), ("bvh", "bvh"), ("spheres", "spheres")]
    {
        let mut value =
            scene(camera_above([0.0, 0.0, 0.0], 4.0, 2.0), json!([floor(3.0, 0.0), ball]), json!([]));
        value["render"]["structure"] = json!(name);
        let scene = compile(&value);
        assert_eq!(scene.geometry.structure(), structure);
        let plan = Plan::new(&scene);
        let decision = plan.decisions.iter().find(|d| d.topic == "structure").unwrap();
        assert_eq!((decision.choice.as_str(), decision.runs), (structure, structure != "list"));
        assert!(decision.reason.starts_with("2 primitives: "), "{}", decision.reason);
        assert_eq!(decision.reason.contains("as asked for"), name != "auto", "{}", decision.reason);
    }
}
