//! Rays against triangle meshes on one thread: this library's structure and, for comparison, `obvhs`' CWBVH.
//!
//! `cargo bench --bench rays -- <filter>`; a name is mesh/kind of rays/structure. Primary rays come in the
//! order of the pixels; bounces leave in all directions; shadow rays ask for any hit on the way to a lamp.

use criterion::{Criterion, Throughput};
use glam::{Vec3, Vec3A};
use nephroid::geometry::{Geometry, GeometryBuilder, MeshData, Ray, Structure, offset_origin};
use nephroid::sampling::{SamplePoint, uniform_sphere};
use nephroid::scene::ObjectId;
use obvhs::BvhBuildParams;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Pixels across and down.
const SIDE: u16 = 256;

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(1200))
        .configure_from_args();
    rays(&mut criterion);
    criterion.final_summary();
}

fn rays(criterion: &mut Criterion) {
    for count in [1, 2, 4, 8, 16] {
        bench_handful(criterion, count);
    }
    for (name, cells) in [("10k", 70_u16), ("100k", 223), ("1M", 707)] {
        bench_mesh(criterion, &format!("terrain{name}"), &terrain(cells));
        bench_mesh(criterion, &format!("ball{name}"), &ball(cells));
    }
}

/// A handful of spheres and squares, where a list competes with the hierarchy.
fn bench_handful(criterion: &mut Criterion, count: u32) {
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

fn bench_mesh(criterion: &mut Criterion, name: &str, mesh: &MeshData) {
    let mut builder = GeometryBuilder::default();
    builder.mesh(ObjectId(0), mesh);
    let start = Instant::now();
    let geometry = builder.build();
    eprintln!("{name}: built in {:?}", start.elapsed());
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

struct RaySet {
    primary: Vec<Ray>,
    bounce: Vec<Ray>,
    shadow: Vec<(Ray, f32)>,
}

impl RaySet {
    fn new(geometry: &Geometry) -> Self {
        let eye = Vec3::new(0.4, 1.9, 2.6);
        let forward = (Vec3::new(0.0, -0.1, 0.0) - eye).normalize();
        let right = forward.cross(Vec3::Y).normalize();
        let up = right.cross(forward);
        let lamp = Vec3::new(-0.7, 4.0, 0.9);
        let mut set = Self { primary: Vec::new(), bounce: Vec::new(), shadow: Vec::new() };
        for index in 0..u32::from(SIDE) * u32::from(SIDE) {
            let at = |i: u32| (i as f32 + 0.5) / f32::from(SIDE) - 0.5;
            let (x, y) = (at(index % u32::from(SIDE)), at(index / u32::from(SIDE)));
            let ray = Ray::new(eye, (forward + right * x * 0.8 - up * y * 0.8).normalize());
            if let Some(hit) = geometry.closest_hit(&ray) {
                let s = hit.surface;
                let sample = SamplePoint::new(3, index);
                let facing = if s.normal.dot(ray.direction) > 0.0 { -s.normal } else { s.normal };
                let away = (facing + uniform_sphere(sample.get_2d(0)) * 0.999).normalize();
                set.bounce.push(Ray::new(offset_origin(s.point, s.error, s.normal, away), away));
                let to_lamp = lamp + uniform_sphere(sample.get_2d(2)) * 0.3 - s.point;
                let away = to_lamp.normalize();
                let start = offset_origin(s.point, s.error, s.normal, away);
                set.shadow.push((Ray::new(start, away), to_lamp.length()));
            }
            set.primary.push(ray);
        }
        set
    }
}

/// A square of hills with `2 * cells²` triangles.
fn terrain(cells: u16) -> MeshData {
    grid(cells, cells, |u, v| {
        let (x, z) = (4.0 * u - 2.0, 4.0 * v - 2.0);
        let wave = |k: f32, a: f32| a * (k * x + 0.7 * k * z).sin() * (0.9 * k * z - 0.3 * k * x).cos();
        Vec3::new(x, wave(2.1, 0.3) + wave(7.3, 0.08) + wave(31.0, 0.02) + wave(113.0, 0.006), z)
    })
}

/// A dented ball with `2 * cells²` triangles.
fn ball(cells: u16) -> MeshData {
    grid(cells, cells, |u, v| {
        let (phi, theta) = (u * std::f32::consts::TAU, v * std::f32::consts::PI);
        let radius = 1.0 + 0.02 * (20.0 * phi).sin() * (17.0 * theta).sin();
        Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()) * radius
    })
}

fn grid(across: u16, down: u16, point: impl Fn(f32, f32) -> Vec3) -> MeshData {
    let mut mesh = MeshData::default();
    for i in 0..=down {
        for j in 0..=across {
            mesh.positions.push(point(f32::from(j) / f32::from(across), f32::from(i) / f32::from(down)));
        }
    }
    let at = |i: u16, j: u16| u32::from(i) * (u32::from(across) + 1) + u32::from(j);
    for i in 0..down {
        for j in 0..across {
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
            mesh.triangles.push([at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)]);
        }
    }
    mesh
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
