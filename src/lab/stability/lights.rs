//! F27 to F35, F70, F72: lights, their samples, and cameras at the edge of what is allowed.

use super::Case;
use super::build::{LIT, above, ball, floor, lamp, look, quad, scene, sun, with};
use super::probes;
use crate::lab::Method;
use crate::light_path::PathClass;
use serde_json::{Value, json};
use std::f64::consts::PI;

pub(super) fn cases() -> Vec<Case> {
    vec![
        on_the_floor(),
        behind_the_floor(),
        at_the_point(),
        coplanar(),
        no_power(),
        starved(),
        half_space(),
        bands(),
        hidden_disc(),
        probes::structured_noise(),
        near_a_wall(),
        closed_box(),
        pinhole(),
        one_row("F72", "a picture of one pixel", [1, 1]),
        one_row("F72", "a picture of one column", [1, 40]),
    ]
}

fn on_the_floor() -> Case {
    let value = scene(above([0.0; 3], 2.0, 1.0), json!([floor(2.0)]), lamp([0.3, 0.0, 0.0]));
    Case::new("F27", "a lamp in the plane of the floor", "1/0 where the cosine is 0", value)
        .mean(0.0, 0.0)
        .warns(&["light_inside_wall"])
}

fn behind_the_floor() -> Case {
    let value = scene(above([0.0; 3], 2.0, 1.0), json!([floor(2.0)]), lamp([0.0, -1.0, 0.0]));
    Case::new("F27", "a lamp under the floor", "a negative cosine lights it", value).mean(0.0, 0.0)
}

fn at_the_point() -> Case {
    let value = scene(above([0.0; 3], 2.0, 1.0), json!([floor(2.0)]), lamp([0.0, 1e-6, 0.0]));
    Case::new("F28", "a lamp a micrometre above what is seen", "1/d² overflows", value)
}

fn coplanar() -> Case {
    let value =
        scene(above([-1.0, 0.0, 0.0], 3.0, 0.1), json!([floor(4.0)]), quad([0.0; 3], 0.5, [1.0, 0.0, 0.0]));
    Case::new("F29", "a lamp seen edge on", "0/0 in its density", value).mean(0.0, 0.0)
}

fn no_power() -> Case {
    let dark = json!([{ "type": "point", "position": [0, 3, 0], "intensity": [0, 0, 0] }]);
    let value =
        scene(above([0.0; 3], 2.0, 1.0), json!([floor(2.0), ball("glass", [0.0, 1.0, 0.0], 0.5)]), dark);
    Case::new("F30", "a lamp without power", "a choice among lights of total power 0", value)
        .mean(0.0, 0.0)
        .warns(&["zero_power_light", "no_light"])
}

fn starved() -> Case {
    let near = [floor(2.0), ball("air", [0.0, 1.0, 0.0], 0.5)];
    let far = [
        json!({ "type": "box", "material": "floor", "center": [9, 2, 0], "size": [4, 4, 4] }),
        ball("glass", [9.0, 1.0, 0.0], 0.5),
    ];
    let camera = look([0.0, 0.4, 1.5], [0.0, 0.0, 0.0], 12.0);
    let weak = lamp([0.0, 3.0, 0.0])[0].clone();
    let strong = json!({ "type": "point", "position": [9, 3, 0], "intensity": [1e6, 1e6, 1e6] });
    let value = scene(camera.clone(), json!([near, far].concat()), json!([strong, weak]));
    Case::new(
        "F31",
        "a lamp of 1 W·sr⁻¹, and one of 1e6 in a closed box beside",
        "all photons go to the strong one",
        value,
    )
    .same_as(scene(camera, json!([floor(2.0)]), json!([weak])), 0.03)
}

fn half_space() -> Case {
    let build = |light: Value| scene(above([0.0; 3], 0.5, 0.4), json!([floor(2.0)]), json!([light]));
    let spot = json!({ "type": "spot", "position": [0, 1, 0], "direction": [0, -1, 0], "outer": 180, "inner": 180, "intensity": [1, 1, 1] });
    Case::new("F32", "a spot of 180°", "a cone without a tangent", build(spot))
        .same_as(build(lamp([0.0, 1.0, 0.0])[0].clone()), 1e-3)
}

/// A distant unit light, and halfway to it something that hides a part of it.
fn hidden(blocker: Value) -> Value {
    let lights = json!([{ "type": "quad", "center": [0, 200, 0], "size": [1, 1], "edge": [1, 0, 0], "towards": [0, 0, 0],
                          "radiance": [40_000, 40_000, 40_000] }]);
    scene(above([0.0; 3], 0.5, 1e-4), json!([floor(4.0), blocker]), lights)
}

fn bands() -> Case {
    // Lengths at half the height are half of those on the light: 0.06 of it is hidden besides one half.
    let edge = json!({ "type": "polygon", "material": "floor", "vertices": [[-2, 100, -0.03], [2, 100, -0.03], [2, 100, 4], [-2, 100, 4]] });
    Case::new(
        "F33",
        "a half shadow whose edge is parallel to a grid of samples",
        "bands: all pixels are off alike, by up to 1/2n",
        hidden(edge),
    )
    .mean(0.44 * LIT, 0.02)
    .limit("grid", "a regular grid is off by up to 1/2n along an edge parallel to it, in every pixel alike")
    .limit("adaptive", "squares are divided a few times, and no further")
}

fn hidden_disc() -> Case {
    let corner = |k: u32| {
        let (sin, cos) = (f64::from(k) / 64.0 * 2.0 * PI).sin_cos();
        json!([0.225 * cos, 100, 0.225 * sin])
    };
    let disc = json!({ "type": "polygon", "material": "floor", "vertices": (0..64).map(corner).collect::<Vec<_>>() });
    let whole = json!({ "light_sampling": "adaptive", "light_grid": 1 });
    Case::new(
        "F34",
        "a disc before a lamp, all of whose corners are seen",
        "squares are not divided: 1 for the true 0.364",
        hidden(disc),
    )
    .mean((1.0 - PI * 0.45 * 0.45) * LIT, 0.03)
    .also(Method::new("adaptive 1×1", whole))
    .limit("grid", "a regular grid counts whole squares along a border")
    .limit("adaptive 1×1", "divides only where corners disagree: it needs squares to begin with")
}

fn near_a_wall() -> Case {
    let wall = json!({ "type": "polygon", "material": "floor", "vertices": [[-1, 0, -1], [1, 0, -1], [1, 2, -1], [-1, 2, -1]] });
    let camera = json!({ "type": "orthographic", "eye": [0, 1, 3], "target": [0, 1, -1], "height": 1.6 });
    let value = scene(camera, json!([wall]), lamp([0.0, 1.0, -0.9]));
    // I h / (r² + h²)^(3/2) over the square of side 1.6.
    let height = 0.1;
    let known =
        super::build::mean_over(0.0, 0.0, 1.6, |x, z| height / (x * x + z * z + height * height).powf(1.5));
    Case::new("F69", "a lamp 10 cm before a wall", "weights without bound: single white pixels", value)
        .mean(known * LIT, 0.02)
}

fn closed_box() -> Case {
    let mut value = scene(
        look([0.0, 1.0, 0.5], [0.0, 1.0, -1.0], 60.0),
        json!([{ "type": "box", "material": "white", "center": [0, 1, 0], "size": [2, 2, 2] }]),
        lamp([0.0, 1.5, 0.0]),
    );
    value["materials"]["white"] = json!({ "type": "diffuse", "albedo": [1, 1, 1] });
    value["render"] = json!({ "paths": "complete" });
    Case::new("F58", "a closed box that loses no light", "paths that never end", value)
}

fn pinhole() -> Case {
    let build = |aperture: f64| {
        let mut camera = above([0.0; 3], 3.0, 1.0);
        camera["aperture"] = json!(aperture);
        scene(camera, json!([floor(2.0)]), quad([0.0, 4.0, 2.0], 1.0, [0.0; 3]))
    };
    let mut without = build(0.0);
    if let Some(camera) = without["camera"].as_object_mut() {
        camera.remove("aperture");
    }
    Case::new("F70", "a lens of aperture 0", "a division by it", build(0.0)).same_as(without, 0.01)
}

fn one_row(row: &'static str, title: &'static str, [width, height]: [u32; 2]) -> Case {
    let value =
        scene(above([0.0; 3], 0.5, 0.2), json!([floor(2.0), ball("air", [0.0, 1.0, 0.0], 0.3)]), sun());
    let value = with(value, "/image", json!({ "width": width, "height": height }));
    Case::new(row, title, "sizes divided by, windows of samples that hold none", value)
        .mean_of(PathClass::Caustic, LIT, 0.03)
        .limit("progressive", "its first radius is four pixels, wider than the caustic")
}
