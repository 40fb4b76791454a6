//! Rays against spheres, polygons and meshes, alone and through the structure.

use glam::{DVec3, Vec3};
use nephroid::geometry::{Geometry, GeometryBuilder, MeshData, Ray, offset_origin, sphere_roots};
use nephroid::sampling::{SamplePoint, uniform_sphere};
use nephroid::scene::ObjectId;

/// T1, F1: a small sphere ten million units away.
#[test]
fn t1_f1_a_distant_small_sphere_is_hit_to_1e_8() {
    let (near, far) = sphere_roots(DVec3::new(-1e7, 0.095, 0.0), DVec3::X, DVec3::ZERO, 0.1).unwrap();
    let half_chord = (0.1_f64.powi(2) - 0.095_f64.powi(2)).sqrt();
    assert!((half_chord - 0.031_224_99).abs() < 1e-8);
    // An ulp of 1e7 is 1.9e-9.
    assert!(
        (near - (1e7 - half_chord)).abs() < 1e-8 && (far - (1e7 + half_chord)).abs() < 1e-8,
        "{near} {far}"
    );
}

/// T2, F2: standing on a sphere of radius 1e8. The ray would meet a plane at 1.25; the sphere curves away by
/// 0.75² / 2e8 below it, which the slanting ray takes 3.5e-9 more to reach.
#[test]
fn t2_f2_a_huge_sphere_underfoot_is_hit_to_1e_12() {
    let (near, _) =
        sphere_roots(DVec3::Y, DVec3::new(0.6, -0.8, 0.0), DVec3::new(0.0, -1e8, 0.0), 1e8).unwrap();
    assert!((near - (1.25 + 3.515_625e-9)).abs() < 1e-12, "{near}");
}

/// T3: from a point of the sphere the root near zero is not a hit, at any scale and in any direction.
#[test]
fn t3_a_ray_that_leaves_a_sphere_does_not_meet_it_again() {
    for scale in [1e-3_f32, 1.0, 1e3] {
        let mut builder = GeometryBuilder::default();
        builder.sphere(ObjectId(0), Vec3::new(2.0, -1.0, 0.5) * scale, scale);
        let geometry = builder.build();
        for i in 0..2000 {
            let sample = SamplePoint::new(11, i);
            let outwards = uniform_sphere(sample.get_2d(0));
            let start = Vec3::new(2.0, -1.0, 0.5) * scale + outwards * (3.0 * scale);
            let Some(hit) = geometry.closest_hit(&Ray::new(start, -outwards)) else {
                panic!("missed at {i}")
            };
            let surface = hit.surface;
            let mut away = uniform_sphere(sample.get_2d(2));
            away = if away.dot(surface.normal) < 0.0 { -away } else { away };
            let origin = offset_origin(surface.point, surface.error, surface.normal, away);
            assert!(geometry.closest_hit(&Ray::new(origin, away)).is_none(), "{scale} {i}");
            // And inwards it crosses the ball once, to the other side.
            let origin = offset_origin(surface.point, surface.error, surface.normal, -away);
            let other = geometry.closest_hit(&Ray::new(origin, -away)).unwrap();
            let chord = 2.0 * scale * away.dot(surface.normal);
            // The offset of a few ulps of the coordinates counts the more the more the ray grazes.
            let tolerance = 2e-6 * scale / away.dot(surface.normal);
            assert!((other.t - chord).abs() < tolerance, "{scale} {i}: {} {chord}", other.t);
        }
    }
}

/// F4: at the silhouette a ray hits or misses, and nothing is NaN.
#[test]
fn f4_tangent_rays_are_finite() {
    for step in -3..=3_i64 {
        let y = f64::from_bits(1.0_f64.to_bits().wrapping_add_signed(step));
        if let Some((near, far)) = sphere_roots(DVec3::new(-5.0, y, 0.0), DVec3::X, DVec3::ZERO, 1.0) {
            assert!((near - 5.0).abs() < 1e-7 && (far - 5.0).abs() < 1e-7, "{near} {far}");
        }
    }
}

/// F5: a direction that is not of unit length gives the same points.
#[test]
fn f5_the_quadratic_does_not_assume_a_unit_direction() {
    let (near, far) = sphere_roots(DVec3::new(0.0, 0.0, -5.0), DVec3::Z * 2.0, DVec3::ZERO, 1.0).unwrap();
    assert!((near - 2.0).abs() < 1e-14 && (far - 3.0).abs() < 1e-14, "{near} {far}");
}

fn polygon(outlines: &[&[[f32; 2]]]) -> Geometry {
    let mut builder = GeometryBuilder::default();
    let outlines: Vec<Vec<Vec3>> =
        outlines.iter().map(|o| o.iter().map(|&[x, z]| Vec3::new(x, 0.0, -z)).collect()).collect();
    builder.polygon(ObjectId(0), &outlines).expect("the outlines span a plane");
    builder.build()
}

fn hits(geometry: &Geometry, x: f32, z: f32) -> bool {
    geometry.any_hit(&Ray::new(Vec3::new(x, 1.0, -z), Vec3::NEG_Y), f32::INFINITY)
}

/// T4, F9: half-open edges at vertices and along an edge.
#[test]
fn t4_f9_points_level_with_vertices_are_classified_right() {
    let diamond = polygon(&[&[[1.0, 0.0], [2.0, 1.0], [1.0, 2.0], [0.0, 1.0]]]);
    assert!(hits(&diamond, 0.5, 1.0) && hits(&diamond, 1.0, 1.0));
    assert!(!hits(&diamond, -0.5, 1.0) && !hits(&diamond, 2.5, 1.0));
    let square = polygon(&[&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]]);
    assert!(!hits(&square, -0.5, 0.0) && !hits(&square, 1.5, 0.0) && !hits(&square, 1.5, 1.0));
}

/// T5: the centre of a pentagram is a hole by the even-odd rule; its points are not.
#[test]
fn t5_the_centre_of_a_pentagram_is_a_hole() {
    let corner = |k: usize| {
        let angle = std::f64::consts::TAU * (2 * k) as f64 / 5.0 + std::f64::consts::FRAC_PI_2;
        [angle.cos() as f32, angle.sin() as f32]
    };
    let star = polygon(&[&[corner(0), corner(1), corner(2), corner(3), corner(4)]]);
    assert!(!hits(&star, 0.0, 0.0));
    assert!(hits(&star, 0.0, 0.8));
}

/// T6: four triangles round a square's centre cover every point of a grid exactly once, also on their shared
/// diagonals and sides of the half-open square.
#[test]
fn t6_polygons_that_share_edges_tile_without_gap_or_overlap() {
    let corners = [[0.0, 0.0], [64.0, 0.0], [64.0, 64.0], [0.0, 64.0]];
    let triangles: Vec<Geometry> =
        (0..4).map(|k| polygon(&[&[corners[k], corners[(k + 1) % 4], [32.0, 32.0]]])).collect();
    for x in 1..64_u8 {
        for z in 1..64_u8 {
            let count = triangles.iter().filter(|t| hits(t, f32::from(x), f32::from(z))).count();
            assert_eq!(count, 1, "({x}, {z})");
        }
    }
}

/// F12: areas of a concave outline and of a hole, by counting grid points in general position.
#[test]
fn f12_concave_outlines_and_holes_have_their_areas() {
    let u_shape: &[[f32; 2]] =
        &[[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [2.0, 3.0], [2.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
    let frame: &[&[[f32; 2]]] = &[
        &[[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]],
        &[[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]],
    ];
    for (geometry, area) in [(polygon(&[u_shape]), 7.0), (polygon(frame), 8.0)] {
        let inside = (0..300 * 300)
            .filter(|i| hits(&geometry, (i % 300) as f32 * 0.01 + 0.005, (i / 300) as f32 * 0.01 + 0.005))
            .count();
        assert_eq!(inside as f64 / 1e4, area);
    }
}

/// F7: rays in the polygon's plane miss.
#[test]
fn f7_rays_in_a_polygons_plane_miss() {
    let square = polygon(&[&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]]);
    for y in [0.0, 1e-30, -1e-12] {
        assert!(square.closest_hit(&Ray::new(Vec3::new(-1.0, y, -0.5), Vec3::X)).is_none());
    }
}

/// A closed ball of triangles in general position.
fn ball(segments: u32) -> MeshData {
    let mut mesh = MeshData::default();
    for i in 0..=segments {
        for j in 0..2 * segments {
            let theta = std::f64::consts::PI * f64::from(i) / f64::from(segments);
            let phi = std::f64::consts::PI * f64::from(j) / f64::from(segments);
            let p = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            mesh.positions.push(p.as_vec3());
        }
    }
    let at = |i: u32, j: u32| i * 2 * segments + j % (2 * segments);
    for i in 0..segments {
        for j in 0..2 * segments {
            mesh.triangles.push([at(i, j), at(i, j + 1), at(i + 1, j)]);
            mesh.triangles.push([at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]);
        }
    }
    mesh
}

/// F43: from inside a closed mesh every ray hits, also through its edges and corners.
#[test]
fn f43_a_closed_mesh_is_watertight() {
    let mesh = ball(16);
    let mut builder = GeometryBuilder::default();
    builder.mesh(ObjectId(0), &mesh);
    let geometry = builder.build();
    let from = Vec3::new(0.1, -0.2, 0.05);
    for i in 0..20_000 {
        let direction = uniform_sphere(SamplePoint::new(2, i).get_2d(0));
        assert!(geometry.closest_hit(&Ray::new(from, direction)).is_some(), "{i}");
    }
    for [a, b, _] in mesh.triangles {
        let (a, b) = (mesh.positions[a as usize], mesh.positions[b as usize]);
        for s in [0.0, 0.25, 0.5, 0.7] {
            let direction = (a.lerp(b, s) - from).normalize();
            assert!(geometry.closest_hit(&Ray::new(from, direction)).is_some(), "{a} {b} {s}");
        }
    }
}

/// F37, F39, F42: identical and flat primitives build and are hit along every axis.
#[test]
fn f37_f39_f42_identical_and_flat_primitives_are_found_along_every_axis() {
    let mut builder = GeometryBuilder::default();
    for _ in 0..1000 {
        builder.sphere(ObjectId(0), Vec3::ZERO, 0.5);
    }
    let mesh =
        MeshData { positions: vec![Vec3::ZERO; 3], triangles: vec![[0, 1, 2]; 100], ..MeshData::default() };
    builder.mesh(ObjectId(1), &mesh);
    let square = |axis: usize, at: f32| {
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[a, b]: [f32; 2]| {
            let mut p = Vec3::ZERO;
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (at, a, b);
            p
        })
    };
    for axis in 0..3 {
        builder.polygon(ObjectId(2), &[square(axis, 2.0).to_vec()]).unwrap();
        builder.polygon(ObjectId(2), &[square(axis, -2.0).to_vec()]).unwrap();
    }
    let geometry = builder.build();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            for (offset, object, t) in [(0.0, ObjectId(2), 1.0), (0.7, ObjectId(2), 1.0)] {
                let mut origin = Vec3::ZERO;
                origin[axis] = 3.0 * sign;
                origin[(axis + 1) % 3] = offset;
                let mut direction = Vec3::ZERO;
                direction[axis] = -sign;
                let hit = geometry.closest_hit(&Ray::new(origin, direction)).unwrap();
                assert_eq!((hit.object, hit.t), (object, t), "{axis} {sign} {offset}");
            }
        }
    }
}

/// The hierarchy finds what testing every primitive finds.
#[test]
fn the_hierarchy_agrees_with_testing_every_primitive() {
    let spheres: Vec<(Vec3, f32)> = (0..300)
        .map(|i| {
            let sample = SamplePoint::new(9, i);
            (Vec3::new(sample.get(0), sample.get(1), sample.get(2)) * 10.0, 0.05 + 0.3 * sample.get(3))
        })
        .collect();
    let mut builder = GeometryBuilder::default();
    for (i, (center, radius)) in spheres.iter().enumerate() {
        builder.sphere(ObjectId(i as u32), *center, *radius);
    }
    let geometry = builder.build();
    for i in 0..5000 {
        let sample = SamplePoint::new(10, i);
        let origin = Vec3::new(sample.get(0), sample.get(1), sample.get(2)) * 10.0;
        let direction = uniform_sphere(sample.get_2d(3));
        let nearest = spheres
            .iter()
            .enumerate()
            .filter_map(|(k, (center, radius))| {
                let (near, far) = sphere_roots(
                    origin.as_dvec3(),
                    direction.as_dvec3(),
                    center.as_dvec3(),
                    f64::from(*radius),
                )?;
                let t = if near > 0.0 { near } else { far };
                (t > 0.0).then_some((t, k))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let found = geometry.closest_hit(&Ray::new(origin, direction)).map(|h| h.object.index());
        assert_eq!(found, nearest.map(|(_, k)| k), "{i}");
    }
}
