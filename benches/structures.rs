//! The four structures on the same rays: a handful of shapes, an even sheet of triangles, and small things in a large
//! place, where a uniform grid fails. `cargo bench --bench structures`.

#[path = "common/cpu_time.rs"]
mod cpu_time;

use cpu_time::{CpuCriterion, criterion};
use criterion::Throughput;
use glam::Vec2;
use nephroid::geometry::{Ray, Structure};
use nephroid::scene::{DirectoryAssets, Scene};
use serde_json::{Value, json};
use std::hint::black_box;

/// Rays across and down the picture.
const RAYS: [u32; 2] = [80, 60];

/// Structures but `auto`, and whether they are worth trying on thousands of primitives.
const STRUCTURES: [(&str, Structure, bool); 4] = [
    ("list", Structure::List, false),
    ("grid", Structure::Grid, true),
    ("bvh", Structure::Bvh, true),
    ("spheres", Structure::Spheres, true),
];

fn main() {
    let mut criterion = criterion();
    for name in ["phong", "shapes", "pool", "stadium"] {
        bench(&mut criterion, name);
    }
    criterion.final_summary();
}

fn bench(criterion: &mut CpuCriterion, name: &str) {
    let text = std::fs::read_to_string(format!("scenes/{name}.json")).expect("run at the repository's root");
    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements(u64::from(RAYS[0] * RAYS[1])));
    for (word, structure, many) in STRUCTURES {
        let mut file: Value = serde_json::from_str(&text).expect("a sample scene is JSON");
        file["render"]["structure"] = json!(word);
        let mut scene = Scene::from_json(&file.to_string(), &DirectoryAssets::new("scenes"))
            .expect("a sample scene is right");
        assert_eq!(scene.render.structure, structure);
        if !many && scene.geometry.primitive_count() > 1000 {
            continue;
        }
        scene.set_size(RAYS[0], RAYS[1]);
        let rays: Vec<Ray> = (0..RAYS[0] * RAYS[1])
            .map(|i| scene.camera.ray(Vec2::new((i % RAYS[0]) as f32 + 0.5, (i / RAYS[0]) as f32 + 0.5)))
            .collect();
        group.bench_function(word, |b| {
            b.iter(|| rays.iter().filter(|ray| scene.geometry.closest_hit(black_box(ray)).is_some()).count());
        });
    }
    group.finish();
}
