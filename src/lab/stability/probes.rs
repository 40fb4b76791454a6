//! What no scene shows: parts of the renderer that are asked directly.

use super::Case;
use super::build::{above, floor, quad, scene};
use crate::geometry::SheetId;
use crate::image_io::{LinearImage, encode_png};
use crate::pass1_light::Tally;
use crate::photon_map::{Lookup, Nearest, Photon, PhotonMap};
use crate::plan::Plan;
use crate::radius::RadiusRule;
use crate::render::{Control, Render};
use crate::scene::{ImageSettings, NoAssets, Scene, Tone};
use glam::{DVec3, Vec3};
use serde_json::json;
use std::sync::Arc;

pub(super) fn structured_noise() -> Case {
    Case::probe(
        "F35",
        "the noise of neighbouring pixels",
        "one stream of random numbers for all: structured noise",
        correlation,
    )
    .within(0.05)
}

/// The largest correlation of what neighbouring pixels are off by, in a half shadow; 1 if it cannot be rendered. Its own
/// noise over 8 pictures of 32 × 32 pixels is 1/sqrt(8192) = 0.011.
fn correlation() -> f64 {
    const SIDE: usize = 32;
    let edge = json!({ "type": "polygon", "material": "floor", "vertices": [[-9, 0.5, 9], [0, 0.5, 9], [0, 0.5, -9], [-9, 0.5, -9]] });
    let mut value =
        scene(above([0.0; 3], 0.45, 0.1), json!([floor(2.0), edge]), quad([0.0, 1.0, 0.0], 1.0, [0.0; 3]));
    value["image"] = json!({ "width": SIDE, "height": SIDE });
    let mut pictures = Vec::new();
    for seed in 1..=8 {
        value["render"] = json!({ "seed": seed });
        let Ok(scene) = Scene::from_json(&value.to_string(), &NoAssets) else { return 1.0 };
        let scene = Arc::new(scene);
        let mut render = Render::new(Arc::clone(&scene), Plan::new(&scene));
        if render.run_round(&Control::new()).is_err() {
            return 1.0;
        }
        pictures.push(render.image().pixels.iter().map(|p| f64::from(p[1])).collect::<Vec<_>>());
    }
    let mean: Vec<f64> = (0..SIDE * SIDE)
        .map(|i| pictures.iter().map(|p| p[i]).sum::<f64>() / pictures.len() as f64)
        .collect();
    let of_step = |step: usize| {
        let (mut together, mut alone) = (0.0, 0.0);
        for picture in &pictures {
            for i in (0..SIDE * (SIDE - 1)).filter(|i| i % SIDE < SIDE - 1) {
                let (a, b) = (picture[i] - mean[i], picture[i + step] - mean[i + step]);
                together += a * b;
                alone += 0.5 * (a * a + b * b);
            }
        }
        if alone > 0.0 { (together / alone).abs() } else { 1.0 }
    };
    [1, SIDE, SIDE + 1].map(of_step).into_iter().fold(0.0, f64::max)
}

pub(super) fn order_of_storing() -> Case {
    Case::probe(
        "F48",
        "photons at equal distances, stored in another order",
        "which of them count depends on it",
        order_error,
    )
}

/// The relative difference of an estimate from photons of unlike power on a lattice, and the same reversed.
fn order_error() -> f64 {
    let mut photons: Vec<Photon> = (0..1024_u16)
        .map(|i| Photon {
            position: Vec3::new(f32::from(i % 32), 0.0, f32::from(i / 32)) / 8.0,
            direction: Vec3::NEG_Y,
            normal: Vec3::Y,
            sheet: SheetId(0),
            kind: 0,
            power: Vec3::splat(1.0 + f32::from(i * 7 % 11)),
        })
        .collect();
    let at = Lookup {
        point: Vec3::new(2.0, 0.0, 2.0),
        normal: Vec3::Y,
        sheet: SheetId(0),
        radius: 2.0,
        both_sides: false,
    };
    let nearest = Nearest { count: 12, least: 1e-3 };
    let estimate = |photons: &[Photon]| {
        f64::from(PhotonMap::build(photons).nearest_radiance(&at, nearest, |_| Vec3::ONE).radiance.y)
    };
    let first = estimate(&photons);
    photons.reverse();
    estimate(&photons) / first - 1.0
}

pub(super) fn long_sums() -> Case {
    Case::probe(
        "F59",
        "2³³ photons, and a sum of 2²⁴ powers of 1e-8",
        "counters that run over; a sum of floats that stalls",
        sum_error,
    )
    .within(1e-6)
}

fn sum_error() -> f64 {
    let mut part = Tally { sent: 1 << 31, ..Tally::default() };
    let mut sum = Tally::default();
    (0..4).for_each(|_| sum.add(&part));
    if sum.sent != 1 << 33 {
        return 1.0;
    }
    part.energy.stored = DVec3::splat(1e-8);
    let additions = 1 << 24;
    // A float would stall at 0.125: half of its step there is more than 1e-8 from then on.
    sum.energy.stored = DVec3::splat(0.5);
    (0..additions).for_each(|_| sum.add(&part));
    sum.energy.stored.y / (0.5 + f64::from(additions) * 1e-8) - 1.0
}

pub(super) fn shrinking_radius() -> Case {
    Case::probe(
        "F64",
        "the progressive radius after a million rounds",
        "it shrinks to nothing: noise, and 0/0",
        radius_error,
    )
}

/// 0 if the radius is that of half a pixel, its least.
fn radius_error() -> f64 {
    RadiusRule::Progressive.pixels(1_000_000).map_or(1.0, |pixels| pixels / 0.5 - 1.0)
}

pub(super) fn not_finite() -> Case {
    Case::probe("F75", "a picture with a pixel that is no number", "a black dot", dot_error)
}

/// 0 if it is refused.
fn dot_error() -> f64 {
    let settings = ImageSettings { width: 2, height: 1, exposure: 0.0, tone: Tone::Linear };
    let image = LinearImage { width: 2, height: 1, pixels: vec![[0.0; 3], [0.0, f32::NAN, 0.0]] };
    f64::from(u8::from(encode_png(&image, &settings).is_ok()))
}
