//! F44 to F68, F75: photons, their map, and the other estimators of caustics.

use super::Case;
use super::build::{LIT, above, ball, block, floor, lamp, look, mean_over, quad, scene, square, sun, with};
use super::probes;
use crate::light_path::PathClass;
use serde_json::{Value, json};
use std::f64::consts::{PI, TAU};

pub(super) fn cases() -> Vec<Case> {
    vec![
        on_an_axis_parallel_floor(),
        none_there(),
        at_one_point(),
        probes::order_of_storing(),
        other_side(),
        corner(),
        rim(),
        curved(),
        nothing_specular(),
        no_light_reaches(),
        all_escape(),
        all_black(),
        to_the_horizon(),
        near_its_caster(),
        probes::long_sums(),
        light_in_a_mirror(),
        left_out(),
        cannot_be_met(),
        probes::shrinking_radius(),
        at_scale("F65", "a caustic a hundred times as small", 0.01),
        at_scale("F65", "a caustic a hundred times as large", 100.0),
        seen_through_glass(),
        eye_close_to_the_floor(),
        probes::not_finite(),
    ]
}

/// Under a sheet of index 1 in the sun the floor is lit by photons alone, as by the sun.
fn under_air(camera: Value, mut objects: Vec<Value>) -> Value {
    objects.push(block("air", [0.0, 1.1, 0.0], [2.2, 0.2, 2.2]));
    scene(camera, json!(objects), sun())
}

fn on_an_axis_parallel_floor() -> Case {
    let value = under_air(above([0.0; 3], 0.5, 0.4), vec![floor(1.0)]);
    Case::new("F44", "all photons on a floor y = 0", "a tree that cannot divide equal coordinates", value)
        .mean_of(PathClass::Caustic, LIT, 0.01)
}

/// What a mirror at x = 1 throws ends at |z| = 2 - x.
fn none_there() -> Case {
    let mirror = json!({ "type": "polygon", "material": "mirror", "vertices": [[1, 0, -1], [1, 0, 1], [1, 1, 1], [1, 1, -1]] });
    let value = scene(above([0.55, 0.0, 1.85], 3.0, 0.1), json!([floor(2.0), mirror]), lamp([0.0, 1.0, 0.0]));
    Case::new(
        "F45, F47",
        "a dark floor, 20 cm from the next photon",
        "the nearest photons, however far, light it",
        value,
    )
    .mean_of(PathClass::Caustic, 0.0, 0.0)
}

/// A bowl of focal length 1 that opens upwards, out to radius 1, with its true normals.
fn bowl() -> Value {
    let (rings, segments) = (24, 64);
    let (mut positions, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for ring in 0..=rings {
        let r = f64::from(ring) / f64::from(rings);
        for segment in 0..segments {
            let (sin, cos) = (TAU * f64::from(segment) / f64::from(segments)).sin_cos();
            positions.push([r * cos, 0.25 * r * r, r * sin]);
            normals.push([-0.5 * r * cos, 1.0, -0.5 * r * sin]);
            if ring < rings {
                let at = |ring: i32, segment: i32| ring * segments + segment % segments;
                let [a, b] = [at(ring, segment), at(ring, segment + 1)];
                let [c, d] = [at(ring + 1, segment), at(ring + 1, segment + 1)];
                // At the vertex itself they would have no area.
                if ring > 0 {
                    triangles.push([a, b, c]);
                }
                triangles.push([b, d, c]);
            }
        }
    }
    json!({ "type": "mesh", "material": "mirror", "positions": positions, "normals": normals, "triangles": triangles })
}

fn at_one_point() -> Case {
    let half = 0.1;
    let value = scene(above([0.0, 1.0, 0.0], -0.4, 0.19), json!([square("floor", half, 1.0), bowl()]), sun());
    // All that the bowl throws, but for the target's shadow, over the part of the target that is seen.
    let flux = 0.9 * (PI - 4.0 * half * half);
    Case::new(
        "F46, F52",
        "a bowl of mirror throws the sun's light onto one point",
        "a division by the distance of equal photons; caps that drop photons",
        value,
    )
    .mean_of(PathClass::Caustic, LIT * flux / 0.19_f64.powi(2), 0.05)
    .limit(
        "nearest",
        "a focus is narrower than the pixel of which single points are looked up: its noise has no bound",
    )
}

fn other_side() -> Case {
    let value = under_air(above([0.0; 3], -0.5, 0.4), vec![floor(1.0)]);
    Case::new("F49", "the dark side of a sheet that photons lie on", "light leaks through", value).mean_of(
        PathClass::Caustic,
        0.0,
        0.0,
    )
}

fn corner() -> Case {
    let wall = json!({ "type": "polygon", "material": "floor", "vertices": [[0, 0, 1], [0, 0, -1], [0, 1, -1], [0, 1, 1]] });
    // The sun grazes the wall: none of the floor's photons belongs on it.
    let camera =
        json!({ "type": "orthographic", "eye": [0.5, 0.1, 0], "target": [0, 0.1, 0], "height": 0.18 });
    Case::new(
        "F49",
        "a wall beside a bright floor",
        "the floor's photons light the wall",
        under_air(camera, vec![floor(1.0), wall]),
    )
    .mean_of(PathClass::Caustic, 0.0, 0.0)
}

fn rim() -> Case {
    let camera = json!({ "type": "orthographic", "eye": [0.95, 0.5, 0], "target": [0.95, 0, 0], "up": [0, 0, -1], "height": 0.1 });
    Case::new(
        "F50",
        "the last 10 cm of a bright floor",
        "a disc over the rim finds too little",
        under_air(camera, vec![floor(1.0)]),
    )
    .mean_of(PathClass::Caustic, LIT, 0.01)
    .limit("fixed", "a disc that hangs over a rim finds too few photons, down to half of them")
    .limit("nearest", "a disc that hangs over a rim finds too few photons, down to half of them")
    .limit("progressive", "a disc that hangs over a rim finds too few photons while it is wide")
}

fn curved() -> Case {
    let camera = json!({ "type": "orthographic", "eye": [0, 0.9, 0], "target": [0, 0, 0], "up": [0, 0, -1], "height": 0.06 });
    let radius = 0.05;
    // Irradiance is the cosine on the top of the ball.
    let known = mean_over(0.0, 0.0, 0.06, |x, z| (1.0 - (x * x + z * z) / (radius * radius)).max(0.0).sqrt());
    Case::new(
        "F51",
        "a ball of 5 cm that photons lie on",
        "a disc is wider than the ball",
        scene(
            camera,
            json!([ball("floor", [0.0; 3], radius), block("air", [0.0, 1.1, 0.0], [0.2, 0.2, 0.2])]),
            sun(),
        ),
    )
    .mean_of(PathClass::Caustic, LIT * known, 0.02)
    .limit("fixed", "a disc as wide as a ball finds what lies on its sides")
    .limit("nearest", "a disc as wide as a ball finds what lies on its sides")
}

fn nothing_specular() -> Case {
    let value = scene(above([0.0; 3], 0.5, 0.4), json!([floor(1.0)]), sun());
    Case::new("F53", "nothing that mirrors or bends light", "photons for nothing", value).mean(LIT, 0.01)
}

fn no_light_reaches() -> Case {
    let objects = json!([floor(2.0), ball("glass", [0.0, 1.0, 0.0], 0.5), square("floor", 9.0, 2.0)]);
    Case::new(
        "F54",
        "a glass ball that no light reaches",
        "photons are sent for ever",
        scene(above([0.0; 3], 1.9, 1.0), objects, lamp([0.0, 3.0, 0.0])),
    )
    .mean(0.0, 0.0)
    .warns(&["no_photon_hit_specular"])
}

fn all_escape() -> Case {
    let far = json!({ "type": "polygon", "material": "floor", "vertices": [[50, 0, 1], [51, 0, 1], [51, 0, 0], [50, 0, 0]] });
    let value =
        scene(above([0.0; 3], 2.0, 1.0), json!([far, square("mirror", 1.0, 1.0)]), lamp([0.0, 3.0, 0.0]));
    Case::new("F55", "a mirror that throws all light into the void", "an empty map, 0/0", value)
        .mean(0.0, 0.0)
        .warns(&["no_photon_stored"])
}

fn all_black() -> Case {
    let value = scene(
        above([0.0; 3], 2.0, 1.0),
        json!([floor(2.0), ball("glass", [0.0, 1.0, 0.0], 0.5)]),
        lamp([0.0, 3.0, 0.0]),
    );
    Case::new(
        "F55",
        "receivers that are all black",
        "photons for nothing",
        with(value, "/materials/floor/albedo", json!([0, 0, 0])),
    )
    .mean(0.0, 0.0)
    .warns(&["no_receiver"])
}

fn to_the_horizon() -> Case {
    let value = scene(
        above([0.0, 2.0, 0.0], -0.5, 0.8),
        json!([square("mirror", 1e5, 0.0), square("floor", 2.0, 2.0)]),
        lamp([0.0, 1.0, 0.0]),
    );
    let image_source = |x: f64, z: f64| 0.9 * 3.0 / (x * x + z * z + 9.0).powf(1.5);
    Case::new("F56", "a mirror to the horizon under a lamp", "no cone bounds it", value)
        .mean_of(PathClass::Caustic, LIT * mean_over(0.0, 0.0, 0.8, image_source), 0.02)
        .limit("fixed", HORIZON)
        .limit("nearest", HORIZON)
}

/// Why radii that depend on the scene's extent fail in a boundless one.
const HORIZON: &str = "a hundredth of the scene's extent is no radius where the scene reaches to the horizon";

fn near_its_caster() -> Case {
    let camera = look([1.5, 0.4, 0.0], [0.0, 0.0, 0.0], 8.0);
    let build = |objects: Value| scene(camera.clone(), objects, lamp([0.0, 1.5001, 0.0]));
    Case::new(
        "F57",
        "a lamp 0.1 mm above a ball of index 1",
        "no cone bounds what is so near",
        build(json!([floor(2.0), ball("air", [0.0, 1.0, 0.0], 0.5)])),
    )
    .same_as(build(json!([floor(2.0)])), 0.02)
}

fn light_in_a_mirror() -> Case {
    let value = scene(
        above([0.0; 3], 2.0, 0.1),
        json!([square("mirror", 2.0, 0.0)]),
        quad([0.0, 3.0, 0.0], 4.0, [0.0; 3]),
    );
    Case::new("F62", "a lamp seen in a mirror", "photons can never bring it", value).mean_of(
        PathClass::Emitted,
        0.9,
        0.001,
    )
}

fn left_out() -> Case {
    let value = scene(
        above([0.0; 3], 2.0, 1.0),
        json!([floor(2.0), ball("glass", [0.0, 1.0, 0.0], 0.5)]),
        lamp([0.0, 3.0, 0.0]),
    );
    Case::new(
        "F63",
        "a glass ball without caustics",
        "a black shadow, and nobody says why",
        with(value, "/render", json!({ "paths": "whitted" })),
    )
    .warns(&["caustics_left_out"])
}

fn cannot_be_met() -> Case {
    let value = scene(
        above([0.0; 3], 0.5, 0.4),
        json!([floor(1.0), block("air", [0.0, 1.1, 0.0], [4.0, 0.2, 4.0])]),
        lamp([0.0, 3.0, 0.0]),
    );
    let bare = scene(above([0.0; 3], 0.5, 0.4), json!([floor(1.0)]), lamp([0.0, 3.0, 0.0]));
    Case::new(
        "F63",
        "a point light and path tracing from the eye",
        "no path meets a point: a black shadow",
        with(value, "/render", json!({ "caustics": "backward" })),
    )
    .same_as(bare, 0.01)
    .warns(&["backward_cannot_meet_light"])
}

/// The picture does not depend on the unit of length.
fn at_scale(row: &'static str, title: &'static str, scale: f64) -> Case {
    let build = |s: f64| {
        let camera = look([-0.8 * s, s, 0.6 * s], [-0.8 * s, 0.0, -0.2 * s], 25.0);
        let objects = json!([floor(3.0 * s), ball("glass", [0.0, 0.55 * s, 0.0], 0.5 * s)]);
        scene(camera, objects, quad([1.2 * s, 3.0 * s, 0.6 * s], 2.0 * s, [0.0; 3]))
    };
    Case::new(row, title, "a first radius in metres that suits one size", build(scale))
        .same_as(build(1.0), 0.02)
        .limit("progressive", "its first rounds blur over four pixels, and over the picture's border")
        .limit("fixed", "its disc blurs over the picture's border")
        .limit(
            "nearest",
            "around a focus the nearest photons are those of the focus: light is found beside it too",
        )
}

fn seen_through_glass() -> Case {
    let camera = above([0.0; 3], 2.0, 0.4);
    let build = |objects: Value| scene(camera.clone(), objects, quad([0.5, 3.0, 0.0], 0.2, [0.0; 3]));
    Case::new(
        "F68",
        "a small lamp and the floor, both behind glass of index 1",
        "paths from the eye meet the lamp once in thousands: white dots",
        build(json!([floor(1.0), block("air", [0.0, 1.1, 0.0], [4.0, 0.2, 4.0])])),
    )
    .same_as(build(json!([floor(1.0)])), 0.02)
    .within(0.02)
}

fn eye_close_to_the_floor() -> Case {
    let camera = look([0.0, 0.02, 0.0], [-0.1, 0.0, 0.0], 10.0);
    let objects = json!([floor(1.0), block("air", [-0.1, 0.5, 0.0], [0.6, 0.2, 0.6])]);
    Case::new(
        "F69",
        "the eye 2 cm above a bright floor",
        "a photon right before the eye has a weight without bound",
        scene(camera, objects, sun()),
    )
    .mean_of(PathClass::Caustic, LIT, 0.03)
}
