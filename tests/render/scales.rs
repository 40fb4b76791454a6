//! Sample scenes need no radius, number of photons or threshold of their own: at any scale, and with lights of any size,
//! the defaults show the same.

use crate::support::{Estimate, SEEDS, T_LIMIT, block_means, estimates, render_shared, with_seeds};
use nephroid::develop::develop;
use nephroid::light_path::PathClass;
use nephroid::scene::{MemoryAssets, Scene};
use serde_json::{Value, json};
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

/// Sides of the lights in the scenes' metres; 0 is a point.
const SIZES: [f64; 4] = [0.0, 0.01, 0.2, 2.0];

/// A sample scene, whose one light is a quad.
struct Sample {
    value: Value,
    /// Its mesh, unpacked.
    mesh: Option<Vec<u8>>,
}

/// The fields of sample scenes that are lengths or points.
const LENGTHS: [&str; 8] = ["eye", "target", "vertices", "center", "radius", "size", "towards", "position"];

fn sample(name: &str) -> Sample {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let text = std::fs::read_to_string(folder.join(name)).unwrap();
    let mut value: Value = serde_json::from_str(&text).unwrap();
    value["image"]["width"] = json!(40);
    value["image"]["height"] = json!(30);
    value["render"]["stop"] = json!({ "rounds": 4 });
    let mut mesh = None;
    for object in value["objects"].as_array_mut().unwrap() {
        if let Some(asset) = object["asset"].as_str() {
            let file = std::fs::File::open(folder.join(asset)).unwrap();
            let mut bytes = Vec::new();
            flate2::read::GzDecoder::new(file).read_to_end(&mut bytes).unwrap();
            mesh = Some(bytes);
            object["asset"] = json!("mesh.ply");
        }
    }
    Sample { value, mesh }
}

fn multiply(value: &mut Value, scale: f64) {
    match value {
        Value::Number(x) => *value = json!(x.as_f64().unwrap() * scale),
        Value::Array(items) => items.iter_mut().for_each(|item| multiply(item, scale)),
        _ => panic!("{value} is no length"),
    }
}

fn scale_lengths(value: &mut Value, scale: f64) {
    match value {
        Value::Object(members) => {
            for (name, member) in members {
                if LENGTHS.contains(&name.as_str()) {
                    multiply(member, scale)
                } else {
                    scale_lengths(member, scale)
                }
            }
        }
        Value::Array(items) => items.iter_mut().for_each(|item| scale_lengths(item, scale)),
        _ => {}
    }
}

/// The vertices of a binary mesh are six numbers each, of which three are a position.
fn scaled_mesh(mesh: &[u8], scale: f64) -> Vec<u8> {
    let end = b"end_header\n";
    let start = mesh.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let header = std::str::from_utf8(&mesh[..start]).unwrap();
    let count: usize =
        header.split("element vertex ").nth(1).unwrap().lines().next().unwrap().parse().unwrap();
    let mut scaled = mesh.to_vec();
    for vertex in scaled[start..][..24 * count].chunks_exact_mut(24) {
        for number in vertex[..12].chunks_exact_mut(4) {
            let x = f64::from(f32::from_le_bytes(number.try_into().unwrap())) * scale;
            number.copy_from_slice(&(x as f32).to_le_bytes());
        }
    }
    scaled
}

impl Sample {
    /// With its light as large as `size`, of the same power toward the middle, and all lengths multiplied.
    fn scene(&self, (size, scale): (f64, f64), render: &Value) -> Scene {
        let mut value = self.value.clone();
        scale_lengths(&mut value, scale);
        let light = &mut value["lights"][0];
        let area = |l: &Value| l["size"][0].as_f64().unwrap() * l["size"][1].as_f64().unwrap();
        let intensity: Vec<f64> =
            light["radiance"].as_array().unwrap().iter().map(|l| l.as_f64().unwrap() * area(light)).collect();
        if size == 0.0 {
            *light = json!({ "type": "point", "position": light["center"], "intensity": intensity });
        } else {
            let side = size * scale;
            light["size"] = json!([side, side]);
            light["radiance"] = json!(intensity.iter().map(|i| i / (side * side)).collect::<Vec<_>>());
        }
        for (name, setting) in render.as_object().unwrap() {
            value["render"][name] = setting.clone();
        }
        let mut assets = MemoryAssets::default();
        if let Some(mesh) = &self.mesh {
            assets.files.insert("mesh.ply".to_owned(), scaled_mesh(mesh, scale));
        }
        Scene::from_json(&value.to_string(), &assets).unwrap_or_else(|e| panic!("{e}"))
    }
}

/// The default's picture, with the plan's own number of photons, at scales of a thousandth and a thousand. Where lengths are
/// multiplied by what is no power of two, a rounding may decide on another width of smoothing for a patch, or on whether a
/// light is divided once more: at most one code in thirty is off by more than one.
fn same_at_all_scales(name: &str) {
    let sample = sample(name);
    for size in SIZES {
        let shown = |scale: f64| {
            let scene = Arc::new(sample.scene((size, scale), &json!({})));
            let render = render_shared(&scene, 4, None);
            (develop(&render.image(), &render.scene().image), render.image())
        };
        let (here, linear) = shown(1.0);
        let light: f64 = linear.pixels.iter().flatten().map(|x| f64::from(*x)).sum();
        for scale in [1e-3, 1e3] {
            let (there, other) = shown(scale);
            let apart = here.iter().zip(&there).filter(|(a, b)| a.abs_diff(**b) > 1).count();
            assert!(apart * 30 <= here.len(), "{name}, {size}, {scale}: {apart} of {} codes", here.len());
            let off = linear
                .pixels
                .iter()
                .flatten()
                .zip(other.pixels.iter().flatten())
                .map(|(a, b)| f64::from((a - b).abs()));
            let off = off.sum::<f64>() / light;
            assert!(off < 0.01, "{name}, {size}, {scale}: {off}");
        }
    }
}

#[test]
fn the_glass_ball_needs_no_numbers_at_any_scale_and_under_any_light() {
    same_at_all_scales("glass-ball.json");
}

#[test]
fn the_ring_needs_no_numbers_at_any_scale_and_under_any_light() {
    same_at_all_scales("ring.json");
}

#[test]
fn the_pool_needs_no_numbers_at_any_scale_and_under_any_light() {
    same_at_all_scales("pool.json");
}

#[test]
fn the_box_needs_no_numbers_at_any_scale_and_under_any_light() {
    same_at_all_scales("cornell.json");
}

/// Blocks across and down, of which means are compared.
const BLOCKS: [u32; 2] = [4, 3];

/// Pixels across each by default.
const PIXELS: u32 = 20;

/// Estimates of the blocks' light as it is gathered, from the halves of [`SEEDS`] / 2 renders, and smoothed means of the same.
fn blocks(
    sample: &Sample,
    size: f64,
    settings: &Value,
    (pixels, rounds): (u32, u32),
) -> (Vec<Estimate>, Vec<f64>) {
    let mut sample = Sample { value: sample.value.clone(), mesh: sample.mesh.clone() };
    sample.value["image"] = json!({ "width": pixels * BLOCKS[0], "height": pixels * BLOCKS[1] });
    let (mut halves, mut smoothed) = (Vec::new(), Vec::new());
    with_seeds(sample.scene((size, 1.0), settings), SEEDS / 2, |scene| {
        let render = render_shared(scene, rounds, None);
        halves.extend(render.raw_halves().iter().map(|half| block_means(half, pixels as usize)));
        smoothed.push(block_means(&render.layer(PathClass::Caustic), pixels as usize));
    });
    (estimates(&halves), estimates(&smoothed).iter().map(|e| e.mean).collect())
}

/// The default agrees with another estimator of the same `paths`, which has no windows, footprints, light images or smoothing, or
/// not all of these.
fn agrees(name: &str, size: f64, (paths, rival): (&str, Value), cost: (u32, u32)) {
    let sample = sample(name);
    let mut settings = rival.clone();
    settings["paths"] = json!(paths);
    let (gathered, smoothed) = blocks(&sample, size, &json!({ "paths": paths }), (PIXELS, 2));
    let (other, _) = blocks(&sample, size, &settings, cost);
    let mean = other.iter().map(|e| e.mean).sum::<f64>() / other.len() as f64;
    for (i, ((a, smoothed), b)) in gathered.iter().zip(&smoothed).zip(&other).enumerate() {
        let context =
            || format!("{name}, {size}, {rival}, block {}: {a:?}, smoothed {smoothed}, {b:?}", i / 3);
        let noise = T_LIMIT * a.standard_error.hypot(b.standard_error);
        assert!(noise < 0.5 * (b.mean + 0.2 * mean), "too noisy to tell: {}", context());
        // At the rim of what hides a brighter place a pixel's kernel blurs over a pixel, which may be beside a focus; between
        // blocks smoothing blurs over as many as noise asks for.
        let allowed = noise + 0.05 * b.mean + 0.02 * mean;
        assert!((a.mean - b.mean).abs() <= allowed && (smoothed - b.mean).abs() <= allowed, "{}", context());
    }
}

/// What can be seen without a mirror or glass between, by photons that are connected to the eye; under a large light by paths
/// that meet it, in one round (later ones send more where the first has met it), of many pixels.
fn agrees_under_all_lights(name: &str) {
    for size in [0.0, 0.01, 0.2] {
        agrees(name, size, ("LS+DE", json!({ "caustics": "forward" })), (PIXELS, 2));
    }
    agrees(name, 2.0, ("LS+DS*E", json!({ "caustics": "backward" })), (160, 1));
}

#[test]
fn the_glass_ball_is_lit_as_other_estimators_say_under_any_light() {
    agrees_under_all_lights("glass-ball.json");
}

#[test]
fn the_ring_is_lit_as_other_estimators_say_under_any_light() {
    agrees_under_all_lights("ring.json");
}

#[test]
fn the_box_is_lit_as_other_estimators_say_under_any_light() {
    agrees_under_all_lights("cornell.json");
}

/// All of the pool is seen through water: a fixed radius of about half a pixel takes the place of connections.
#[test]
fn the_pool_is_lit_as_other_estimators_say_under_any_light() {
    for size in [0.0, 0.01, 0.2] {
        agrees("pool.json", size, ("LS+DS*E", json!({ "radius": { "fixed": 0.03 } })), (PIXELS, 2));
    }
    agrees("pool.json", 2.0, ("LS+DS*E", json!({ "caustics": "backward" })), (80, 1));
}
