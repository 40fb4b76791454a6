//! The pieces that the scenes are built of.

use serde_json::{Value, json};
use std::f64::consts::PI;

/// Radiance of the floor, of albedo 1/2, under an irradiance of 1.
pub(super) const LIT: f64 = 0.5 / PI;

/// Over a floor of albedo 1/2, 16 × 16 pixels.
pub(super) fn scene(camera: Value, objects: Value, lights: Value) -> Value {
    json!({ "nephroid": 1, "image": { "width": 16, "height": 16 }, "camera": camera,
        "materials": { "floor": { "type": "diffuse", "albedo": [0.5, 0.5, 0.5] },
                       "mirror": { "type": "mirror", "reflectance": [0.9, 0.9, 0.9] },
                       "perfect": { "type": "mirror", "reflectance": [1, 1, 1] },
                       "glass": { "type": "glass", "ior": 1.5 },
                       "air": { "type": "glass", "ior": 1.0 } },
        "objects": objects, "lights": lights })
}

/// A sky of radiance 1 all around, and no other light: what bends or reflects all light is not seen at all, and what
/// has an albedo of 1/2 and hides nothing from itself is half as bright.
pub(super) fn furnace(camera: Value, objects: Value) -> Value {
    with(scene(camera, objects, json!([])), "/environment", json!({ "radiance": [1, 1, 1] }))
}

/// A scene with one value set at a JSON pointer whose parent exists.
pub(super) fn with(mut scene: Value, pointer: &str, value: Value) -> Value {
    if let Some((parent, key)) = pointer.rsplit_once('/')
        && let Some(parent) = scene.pointer_mut(parent)
    {
        match parent {
            Value::Array(items) => {
                if let Some(item) = key.parse().ok().and_then(|i: usize| items.get_mut(i)) {
                    *item = value;
                }
            }
            other => other[key] = value,
        }
    }
    scene
}

/// A camera at `height` above a point (below it, if negative) that sees a square of side `width` around it.
pub(super) fn above(point: [f64; 3], height: f64, width: f64) -> Value {
    let fov = 2.0 * (0.5 * width / height.abs()).atan().to_degrees();
    json!({ "type": "perspective", "eye": [point[0], point[1] + height, point[2]], "target": point,
            "up": [0, 0, -1], "fov": fov })
}

/// Parallel rays straight down from `height` onto a square of side `width` around the origin.
pub(super) fn down(height: f64, width: f64) -> Value {
    json!({ "type": "orthographic", "eye": [0, height, 0], "target": [0, 0, 0], "up": [0, 0, -1], "height": width })
}

/// A camera that looks from one point at another.
pub(super) fn look(eye: [f64; 3], target: [f64; 3], fov: f64) -> Value {
    json!({ "type": "perspective", "eye": eye, "target": target, "fov": fov })
}

/// A horizontal square of side `2 * half` at height `y`, its front up.
pub(super) fn square(material: &str, half: f64, y: f64) -> Value {
    json!({ "type": "polygon", "material": material,
            "vertices": [[-half, y, half], [half, y, half], [half, y, -half], [-half, y, -half]] })
}

pub(super) fn floor(half: f64) -> Value {
    square("floor", half, 0.0)
}

pub(super) fn ball(material: &str, center: [f64; 3], radius: f64) -> Value {
    json!({ "type": "sphere", "material": material, "center": center, "radius": radius })
}

pub(super) fn block(material: &str, center: [f64; 3], size: [f64; 3]) -> Value {
    json!({ "type": "box", "material": material, "center": center, "size": size })
}

pub(super) fn lamp(position: [f64; 3]) -> Value {
    json!([{ "type": "point", "position": position, "intensity": [1, 1, 1] }])
}

/// A sun straight down, of irradiance 1.
pub(super) fn sun() -> Value {
    json!([{ "type": "directional", "direction": [0, -1, 0], "irradiance": [1, 1, 1] }])
}

/// A square lamp of radiance 1 that faces a point.
pub(super) fn quad(center: [f64; 3], side: f64, towards: [f64; 3]) -> Value {
    json!([{ "type": "quad", "center": center, "size": [side, side], "towards": towards, "radiance": [1, 1, 1] }])
}

/// Mean of `f` over a square of side `width` around (x, z), by the midpoint rule.
pub(super) fn mean_over(x: f64, z: f64, width: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
    let n = 64;
    let at = |i: i32| ((f64::from(i) + 0.5) / f64::from(n) - 0.5) * width;
    let sum: f64 = (0..n * n).map(|k| f(x + at(k % n), z + at(k / n))).sum();
    sum / f64::from(n * n)
}
