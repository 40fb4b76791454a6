//! Rays against triangle meshes on one thread: this library's structure and, for comparison, `obvhs`' CWBVH.
//!
//! `cargo bench --bench rays -- <filter>`; a name is mesh/kind of rays/structure. Primary rays come in the
//! order of the pixels; bounces leave in all directions; shadow rays ask for any hit on the way to a lamp.

#[path = "common/cpu_time.rs"]
mod cpu_time;
#[path = "common/meshes.rs"]
mod meshes;
#[path = "common/ray_sets.rs"]
mod ray_sets;

use cpu_time::{CpuCriterion, criterion};
use criterion::Throughput;
use glam::{Vec3, Vec3A};
use nephroid::geometry::{GeometryBuilder, MeshData, Ray, Structure};
use nephroid::sampling::{SamplePoint, uniform_sphere};
use nephroid::scene::ObjectId;
use obvhs::BvhBuildParams;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use ray_sets::{RaySet, SIZES};
use std::hint::black_box;
use std::time::Duration;

fn main() {
    let mut criterion = criterion();
    rays(&mut criterion);
    criterion.final_summary();
}

fn rays(criterion: &mut CpuCriterion) {
    for count in [1, 2, 4, 8, 16] {
        bench_handful(criterion, count);
    }
    for (size, cells) in SIZES {
        for (name, mesh) in meshes::both(cells) {
            bench_mesh(criterion, &format!("{name}{size}"), &mesh);
        }
    }
}

/// A handful of spheres and squares, where a list competes with the hierarchy.
fn bench_handful(criterion: &mut CpuCriterion, count: u32) {
    let fill = |structure| {
        let mut builder = GeometryBuilder::default();
        for i in 0..count {
            let at = uniform_sphere(SamplePoint::new(7, i).get_2d(0));
            if i.is_multiple_of(2) {
                builder.sphere(ObjectId(i), at, 0.4);
                continue;
            }
            let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
            let outline = corners.map(|(x, z)| at + Vec3::new(x, 0.0, z)).to_vec();
            builder.polygon(ObjectId(i), &[outline]).expect("a square is a polygon");
        }
        builder.build_as(structure)
    };
    let rays = RaySet::new(&fill(Structure::List));
    let mut group = criterion.benchmark_group(format!("handful{count}"));
    for (name, structure) in [("list", Structure::List), ("bvh", Structure::Bvh)] {
        let geometry = fill(structure);
        group.throughput(Throughput::Elements(rays.primary.len() as u64));
        group.bench_function(format!("primary/{name}"), |b| {
            b.iter(|| {
                rays.primary
                    .iter()
                    .filter_map(|r| geometry.closest_hit(black_box(r)))
                    .map(|h| h.t)
                    .sum::<f32>()
            });
        });
        group.throughput(Throughput::Elements(rays.shadow.len() as u64));
        group.bench_function(format!("shadow/{name}"), |b| {
            b.iter(|| rays.shadow.iter().filter(|(r, t)| geometry.any_hit(black_box(r), *t)).count());
        });
    }
    group.finish();
}

fn bench_mesh(criterion: &mut CpuCriterion, name: &str, mesh: &MeshData) {
    let mut builder = GeometryBuilder::default();
    builder.mesh(ObjectId(0), mesh);
    let geometry = builder.build();
    let other = Cwbvh::new(mesh);
    let rays = RaySet::new(&geometry);
    eprintln!(
        "{name}: {:.1} bytes per triangle",
        geometry.memory_bytes() as f64 / mesh.triangles.len() as f64
    );
    let mut group = criterion.benchmark_group(name);
    for (kind, set) in [("primary", &rays.primary), ("bounce", &rays.bounce)] {
        group.throughput(Throughput::Elements(set.len() as u64));
        group.bench_function(format!("{kind}/nephroid"), |b| {
            b.iter(|| {
                set.iter().filter_map(|r| geometry.closest_hit(black_box(r))).map(|h| h.t).sum::<f32>()
            });
        });
        group.bench_function(format!("{kind}/cwbvh"), |b| {
            b.iter(|| set.iter().filter_map(|r| other.closest(black_box(r))).sum::<f32>());
        });
    }
    group.throughput(Throughput::Elements(rays.shadow.len() as u64));
    group.bench_function("shadow/nephroid", |b| {
        b.iter(|| rays.shadow.iter().filter(|(r, t)| geometry.any_hit(black_box(r), *t)).count());
    });
    group.bench_function("shadow/cwbvh", |b| {
        b.iter(|| rays.shadow.iter().filter(|(r, t)| other.any(black_box(r), *t)).count());
    });
    group.finish();
}

/// The other structure, with its own triangle test, and a surface normal for the nearest hit.
struct Cwbvh {
    bvh: CwBvh,
    triangles: Vec<RtTriangle>,
}

impl Cwbvh {
    fn new(mesh: &MeshData) -> Self {
        let corner = |i: u32| Vec3A::from(mesh.positions[i as usize]);
        let triangles: Vec<Triangle> = mesh
            .triangles
            .iter()
            .map(|&[a, b, c]| Triangle { v0: corner(a), v1: corner(b), v2: corner(c) })
            .collect();
        let mut time = Duration::ZERO;
        let bvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut time);
        let triangles = bvh.primitive_indices.iter().map(|&i| (&triangles[i as usize]).into()).collect();
        Self { bvh, triangles }
    }

    fn closest(&self, ray: &Ray) -> Option<f32> {
        let ray = ObvhsRay::new(ray.origin.into(), ray.direction.into(), 0.0, f32::INFINITY);
        let mut hit = RayHit::none();
        self.bvh.ray_traverse(ray, &mut hit, |ray, i| self.triangles[i].intersect(ray)).then_some(hit.t)
    }

    fn any(&self, ray: &Ray, t_max: f32) -> bool {
        let ray = ObvhsRay::new(ray.origin.into(), ray.direction.into(), 0.0, t_max);
        !self.bvh.ray_traverse_miss(ray, |ray, i| self.triangles[i].intersect(ray))
    }
}
