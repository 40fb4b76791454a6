//! Every sample scene under lamps that are large enough for rays to meet them: what photons find, against path tracing.

use crate::sample_scenes::{BORDERS, folder, sample_scenes};
use crate::support::{Estimate, estimates, mean, with_seeds};
use glam::Vec3;
use nephroid::geometry::Ray;
use nephroid::plan::Plan;
use nephroid::render::{Control, Render};
use nephroid::sampling::{SamplePoint, uniform_sphere};
use nephroid::scene::{DirectoryAssets, ObjectId, Scene};
use serde_json::{Value, json};
use std::sync::Arc;

/// Some paths by photons and by path tracing.
struct Comparison {
    paths: &'static str,
    /// The layers whose means are compared, and a relative error that most scenes are to tell of each.
    layers: &'static [(&'static str, f64)],
}

/// The caustics, and of them what is seen in mirrors and through glass: so small a part that only large errors are told; and indirect
/// light, some of which are caustics that photons find on the D that it comes from.
const COMPARISONS: [Comparison; 2] = [
    Comparison { paths: "LS+DS*E", layers: &[("caustic", 0.2), ("in_specular", 0.4)] },
    Comparison { paths: "L(D|S)*DS*DS*E", layers: &[("indirect", 0.2)] },
];

/// Pictures by which a mean and its error are known: by photons, and by path tracing.
const SEEDS: [u64; 2] = [12, 24];

/// A relative error of a comparison's first layer that is to be told if few more samples suffice.
const ENOUGH: f64 = 0.15;

/// Rounds of a picture by path tracing; the second if the first do not tell [`ENOUGH`]. After neither of them anything is smoothed.
const ROUNDS: [u32; 2] = [1, 3];

/// Standard errors that means may differ by: Student's t of 11 degrees of freedom exceeds it in one of 2500 comparisons, so that of
/// the fifty here all are within it but once in fifty.
const LIMIT: f64 = 5.0;

/// A scene that is left out: rays through its glass of tea cost as much as all other scenes.
const SLOW: &str = "drink";

/// A point of a scene file.
fn point(value: &Value) -> Vec3 {
    Vec3::from_array(std::array::from_fn(|i| value[i].as_f64().unwrap() as f32))
}

fn scaled(colour: &Value, factor: f64) -> Value {
    colour.as_array().unwrap().iter().map(|c| json!(c.as_f64().unwrap() * factor)).collect()
}

fn compile(value: &Value, assets: &DirectoryAssets) -> Scene {
    Scene::from_json(&value.to_string(), assets).unwrap_or_else(|e| panic!("{e}"))
}

/// Where a lamp is, unless it is infinitely far away.
fn place(lamp: &Value) -> Option<Vec3> {
    lamp.get("center").or(lamp.get("position")).map(point)
}

/// The side to which a flat lamp shines.
fn front(lamp: &Value) -> Option<Vec3> {
    Some((point(lamp.get("towards")?) - place(lamp)?).normalize())
}

/// How far a lamp's place is from the nearest object that is not behind it, as far as is found out: by the objects' boxes, or, of
/// those whose box holds the place, by rays.
fn distance_to_objects(scene: &Scene, lamp: &Value) -> f32 {
    let (from, front) = (place(lamp).unwrap(), front(lamp));
    let before = |direction: Vec3| front.is_none_or(|front| front.dot(direction) >= 0.0);
    let objects = (0..scene.objects.len() as u32).map(ObjectId);
    let objects = objects
        .filter(|&id| scene.geometry.hull(id).iter().any(|p| p.radius > 0.0 || before(p.position - from)));
    let boxes = objects.map(|id| scene.geometry.object_bounds(id));
    let to_boxes = boxes.map(|b| from.distance(from.clamp(b.min, b.max))).filter(|d| *d > 0.0);
    let directions = (0..512).map(|i| uniform_sphere(SamplePoint::new(0, i).get_2d(0)));
    let rays = directions.filter(|direction| before(*direction)).map(|direction| Ray::new(from, direction));
    let hits = rays.filter_map(|ray| scene.geometry.closest_hit(&ray)).map(|hit| hit.t);
    to_boxes.chain(hits).fold(f32::INFINITY, f32::min)
}

/// The lamp with the same power and a radius, or half a diagonal, of `reach`, if it is smaller. A point becomes a sphere of the same
/// intensity, and a spot a disk that has it along its axis.
fn enlarged(lamp: &Value, reach: f64) -> Value {
    let mut large = lamp.clone();
    let number = |v: &Value| v.as_f64().unwrap();
    let radius = match lamp["type"].as_str().unwrap() {
        "quad" => number(&lamp["size"][0]).hypot(number(&lamp["size"][1])) / 2.0,
        "disk" | "sphere" => number(&lamp["radius"]),
        kind => {
            let radiance = scaled(&lamp["intensity"], 1.0 / (std::f64::consts::PI * reach * reach));
            large = json!({ "type": "sphere", "center": lamp["position"], "radius": reach, "radiance": radiance });
            if kind == "spot" {
                large["type"] = json!("disk");
                large["towards"] = lamp["towards"].clone();
            }
            return large;
        }
    };
    let factor = (reach / radius).max(1.0);
    large["radiance"] = scaled(&lamp["radiance"], 1.0 / (factor * factor));
    match lamp["type"].as_str().unwrap() {
        "quad" => large["size"] = scaled(&lamp["size"], factor),
        _ => large["radius"] = json!(radius * factor),
    }
    large
}

/// Enlarges all lamps of a scene to half the distance to what is nearest: an object, the eye or another lamp. Parallel light is
/// left out: no ray meets it, and a lamp that is near enough to be met would not be like it. False of a scene that has no lamps then:
/// the small sun in the picture of a sky is met too seldom as well.
fn enlarge_lamps(value: &mut Value, assets: &DirectoryAssets) -> bool {
    let lamps = value["lights"].as_array().cloned().unwrap_or_default();
    let lamps: Vec<Value> = lamps.into_iter().filter(|lamp| place(lamp).is_some()).collect();
    value["lights"] = json!([]);
    let bare = compile(value, assets);
    let places: Vec<Vec3> = lamps.iter().filter_map(place).chain([bare.camera.eye]).collect();
    let reach = |i: usize| {
        let others = places.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, p)| p.distance(places[i]));
        f64::from(others.fold(distance_to_objects(&bare, &lamps[i]), f32::min)) / 2.0
    };
    value["lights"] = lamps.iter().enumerate().map(|(i, lamp)| enlarged(lamp, reach(i))).collect();
    !lamps.is_empty()
}

/// Mean of each layer over the picture, of every pixel's equally many samples.
fn light(
    value: &Value,
    comparison: &Comparison,
    (rounds, seeds): (u32, u64),
    assets: &DirectoryAssets,
) -> Vec<Estimate> {
    let scene = compile(value, assets);
    let plan = Plan::new(&scene);
    let mut means = Vec::new();
    with_seeds(scene, seeds, |scene| {
        let mut render = Render::new(Arc::clone(scene), plan.clone()).evenly();
        for _ in 0..rounds {
            render.run_round(&Control::new()).unwrap();
        }
        let picture = render.picture();
        let layer = |name: &str| render.layers().into_iter().find(|layer| layer.name() == name).unwrap();
        means.push(comparison.layers.iter().map(|(name, _)| mean(&picture.part(&layer(name)))).collect());
    });
    estimates(&means)
}

fn error([a, b]: [Estimate; 2]) -> f64 {
    a.standard_error.hypot(b.standard_error)
}

/// Whether a relative error would be found.
fn tells(both: [Estimate; 2], relative: f64) -> bool {
    LIMIT * error(both) < relative * both[0].mean.max(both[1].mean)
}

/// The layers by photons and by path tracing, which draws other points of the lamps: by their area.
fn by_both(value: &Value, comparison: &Comparison, assets: &DirectoryAssets) -> Vec<[Estimate; 2]> {
    let mut value = value.clone();
    value["render"]["paths"] = json!(comparison.paths);
    let photons = light(&value, comparison, (1, SEEDS[0]), assets);
    let rival = json!({ "caustics": "backward", "light_sampling": "jittered", "light_grid": 1 });
    value["render"].as_object_mut().unwrap().extend(rival.as_object().unwrap().clone());
    let backward = |rounds| light(&value, comparison, (rounds, SEEDS[1]), assets);
    let few = backward(ROUNDS[0]);
    let enough = tells([photons[0], few[0]], ENOUGH) || few[0].mean == 0.0;
    let paths = if enough { few } else { backward(ROUNDS[1]) };
    photons.into_iter().zip(paths).map(|(a, b)| [a, b]).collect()
}

/// Three of four tell the error they are to tell.
#[test]
fn what_photons_find_in_every_sample_scene_agrees_with_path_tracing() {
    let assets = DirectoryAssets::new(folder());
    let (mut compared, mut told, mut done) = (0, 0, Vec::new());
    for (file, mut value) in sample_scenes() {
        value.as_object_mut().unwrap().remove("name");
        value["render"] = json!({ "layers": { "in_specular": "LS+DS+E" } });
        value["image"] = json!({ "width": 96, "height": 72 });
        // Some scenes are another one rendered in other ways.
        if file == SLOW || done.contains(&value) {
            continue;
        }
        done.push(value.clone());
        if !enlarge_lamps(&mut value, &assets) {
            continue;
        }
        for comparison in &COMPARISONS {
            let found = by_both(&value, comparison, &assets);
            for (both, (layer, relative)) in found.into_iter().zip(comparison.layers) {
                let [a, b] = both;
                if a.mean == 0.0 && b.mean == 0.0 {
                    continue;
                }
                compared += 1;
                told += u32::from(tells(both, *relative));
                let allowed = LIMIT * error(both) + BORDERS * b.mean;
                assert!((a.mean - b.mean).abs() <= allowed, "{file} {layer}: {a:?} {b:?}");
            }
        }
    }
    assert!(compared >= 40 && 4 * told >= 3 * compared, "{told} of {compared} tell their errors");
}
