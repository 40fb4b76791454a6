//! The hot pieces of a render on one thread: photons, the tree of triangles, the photon map and its look-ups, and all of
//! them together. `cargo bench --bench passes -- <filter>`; a name is piece/scene or piece/size. Rays are in `rays`.

#[path = "common/cpu_time.rs"]
mod cpu_time;
#[path = "common/meshes.rs"]
mod meshes;

use cpu_time::{CpuCriterion, criterion};
use criterion::{BatchSize, Throughput};
use glam::Vec3;
use nephroid::geometry::GeometryBuilder;
use nephroid::pass1_light::{Block, Carries, trace_block, trace_images};
use nephroid::pass2_eye::Footprints;
use nephroid::photon_map::{Lookup, Nearest, Photon, PhotonMap};
use nephroid::plan::Plan;
use nephroid::render::{Control, Render};
use nephroid::scene::{DirectoryAssets, ObjectId, Scene};
use std::hint::black_box;
use std::sync::Arc;

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread can be had");
    pool.install(|| {
        let mut criterion = criterion();
        bench_tree(&mut criterion);
        for name in ["glass-ball", "ring", "pool"] {
            let (scene, plan) = planned(name);
            bench_photons(&mut criterion, (name, &scene, &plan));
            bench_render(&mut criterion, name);
        }
        bench_map(&mut criterion);
        criterion.final_summary();
    });
}

fn planned(name: &str) -> (Scene, Plan) {
    let text = std::fs::read_to_string(format!("scenes/{name}.json")).expect("run at the repository's root");
    let scene = Scene::from_json(&text, &DirectoryAssets::new("scenes")).expect("a sample scene is right");
    let plan = Plan::new(&scene);
    (scene, plan)
}

/// From a mesh to the structure that rays meet, per triangle.
fn bench_tree(criterion: &mut CpuCriterion) {
    let mut group = criterion.benchmark_group("tree");
    for (name, mesh) in meshes::both(223) {
        group.throughput(Throughput::Elements(mesh.triangles.len() as u64));
        group.bench_function(format!("{name}100k"), |b| {
            b.iter(|| {
                let mut builder = GeometryBuilder::default();
                builder.mesh(ObjectId(0), black_box(&mesh));
                builder.build()
            });
        });
    }
    group.finish();
}

/// Points sent through a scene's windows: as photons, and where the plan wants them, as light images.
fn bench_photons(criterion: &mut CpuCriterion, (name, scene, plan): (&str, &Scene, &Plan)) {
    let block = Block { first: 0, count: 1 << 14, seed: 1 };
    let control = Control::new();
    let sent = plan.photons.len() as u64 * u64::from(block.count);
    let mut group = criterion.benchmark_group("photons");
    group.throughput(Throughput::Elements(sent));
    group.bench_function(name, |b| {
        b.iter(|| {
            let rest = |window| trace_block(scene, window, block, &control).expect("nobody cancels").0.len();
            plan.photons.iter().map(|budget| rest(&budget.window)).sum::<usize>()
        });
    });
    group.finish();
    if plan.photons.iter().all(|budget| budget.carries == Carries::Points) {
        return;
    }
    let block = Block { count: 1 << 11, ..block };
    let mut group = criterion.benchmark_group("light_images");
    group.throughput(Throughput::Elements(plan.photons.len() as u64 * u64::from(block.count)));
    group.bench_function(name, |b| {
        b.iter(|| {
            let rays = |window| trace_images(scene, window, block, &control).expect("nobody cancels").1;
            plan.photons.iter().map(|budget| rays(&budget.window)).sum::<u64>()
        });
    });
    group.finish();
}

/// Four rounds of a small picture with all that belongs to them, per pixel.
fn bench_render(criterion: &mut CpuCriterion, name: &str) {
    const SIZE: [u32; 2] = [80, 60];
    let (mut scene, _) = planned(name);
    scene.set_size(SIZE[0], SIZE[1]);
    let scene = Arc::new(scene);
    let mut group = criterion.benchmark_group("render");
    group.throughput(Throughput::Elements(u64::from(SIZE[0] * SIZE[1])));
    group.bench_function(name, |b| {
        b.iter(|| {
            let mut render = Render::new(Arc::clone(&scene), Plan::new(&scene));
            for _ in 0..4 {
                render.run_round(&Control::new()).expect("a sample scene renders");
            }
            render.image()
        });
    });
    group.finish();
}

/// The photons of a pool's floor: into the map, per photon, and out of it, per look-up.
fn bench_map(criterion: &mut CpuCriterion) {
    let (mut scene, _) = planned("pool");
    scene.set_size(160, 120);
    let plan = Plan::new(&scene);
    let footprints = Footprints::trace(&scene, &plan.eye_media);
    for (name, log2_count) in [("64k", 16), ("1M", 20)] {
        let photons = photons_of(&scene, &plan, 1 << log2_count);
        let mut group = criterion.benchmark_group(format!("map{name}"));
        group.throughput(Throughput::Elements(photons.len() as u64));
        group.bench_function("build", |b| {
            b.iter_batched(|| photons.clone(), PhotonMap::build, BatchSize::LargeInput);
        });
        let map = PhotonMap::build(&photons);
        let pixels: Vec<_> = (0..footprints.size().0).filter_map(|i| footprints.get(i)).collect();
        group.throughput(Throughput::Elements(pixels.len() as u64));
        group.bench_function("footprint", |b| {
            b.iter(|| pixels.iter().map(|footprint| map.flux_within(black_box(footprint))).sum::<Vec3>());
        });
        let lookups = lookups_of(&photons);
        group.throughput(Throughput::Elements(lookups.len() as u64));
        group.bench_function("within", |b| {
            b.iter(|| lookups.iter().map(|lookup| map.irradiance(black_box(lookup))).sum::<Vec3>());
        });
        let nearest = Nearest { count: 50, least: 0.25 * lookups[0].radius };
        group.bench_function("nearest50", |b| {
            let found = |lookup| map.nearest_radiance(lookup, nearest, |_| Vec3::ONE).radiance;
            b.iter(|| lookups.iter().map(|lookup| found(black_box(lookup))).sum::<Vec3>());
        });
        group.finish();
    }
}

/// At least so many photons that rest, by sending as many as it takes.
fn photons_of(scene: &Scene, plan: &Plan, count: usize) -> Vec<Photon> {
    let mut photons = Vec::new();
    let mut block = Block { first: 0, count: 1 << 16, seed: 1 };
    while photons.len() < count {
        for budget in &plan.photons {
            let sent = trace_block(scene, &budget.window, block, &Control::new());
            photons.append(&mut sent.expect("nobody cancels").0);
        }
        block.first += block.count;
    }
    photons.truncate(count);
    photons
}

/// Where some of the photons lie, within so far that a disc of it would hold about fifty if they lay evenly.
fn lookups_of(photons: &[Photon]) -> Vec<Lookup> {
    const LOOKUPS: usize = 4096;
    let of = |f: fn(Vec3, Vec3) -> Vec3| photons.iter().map(|p| p.position).reduce(f).unwrap_or_default();
    let size = of(Vec3::max) - of(Vec3::min);
    let area = size.x * size.z;
    let radius = (50.0 * area / (std::f32::consts::PI * photons.len() as f32)).sqrt();
    let at = |photon: &Photon| Lookup {
        point: photon.position,
        normal: photon.normal,
        sheet: photon.sheet,
        radius,
        both_sides: true,
    };
    photons.iter().step_by(photons.len() / LOOKUPS).map(at).collect()
}
