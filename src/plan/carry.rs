//! Whether the photons of a window carry the image of their light, or are plain.
//!
//! A plain photon lights one pixel; an image of the same flux lights as many as it covers, which divides its share of
//! the variance by that number at least, and costs the rays of about fifteen photons. Both are tried. What is seen
//! through mirrors and glass is lit by plain photons either way.

use crate::geometry::Geometry;
use crate::pass1_light::{Block, Carries, Source, Window, trace_block, trace_images};
use crate::radius::RadiusRule;
use crate::render::Control;
use crate::scene::{Caustics, Light, Scene};
use glam::{Vec2, Vec3};

/// Points of the window that are tried.
const TRIED: u32 = 512;

/// Images must divide the variance of what is seen directly by this number. It is less than what they cost, since it
/// does not count what low-discrepancy points gain where two dimensions are left in place of four. Measured: where it
/// is 10 (a glass ball) the time to an error of 1 % is about two thirds of that of plain photons, where it is 22 (a
/// ring) a third.
const LEAST_GAIN: f32 = 5.0;

/// Least share of the variance of plain photons that lies where it is seen directly; the rest gains nothing.
const LEAST_DIRECT: f32 = 0.2;

/// A point is seen if the eye's ray lands this near to it, in pixels.
const NEAR: f32 = 2.0;

/// How a point is seen.
enum Seen {
    /// Not at all, or not in the picture.
    Not,
    /// Without any S between.
    Directly,
    /// What is seen there is a mirror or glass: perhaps through that.
    ThroughSpecular,
}

/// Decides what a window's photons carry; `seed` scrambles the points that are tried.
pub(super) fn decide(scene: &Scene, window: &Window, seed: u64) -> Carries {
    if images_pay(scene, window, seed).unwrap_or(false) { Carries::LightImages } else { Carries::Points }
}

/// `None` where images cannot be had, or nothing is seen.
fn images_pay(scene: &Scene, window: &Window, seed: u64) -> Option<bool> {
    let Source::Light(light) = window.source else { return None };
    let flat = matches!(scene.lights[light.index()], Light::Quad(_));
    let counted = scene.render.radius == RadiusRule::Pixel && scene.camera.lens().is_none();
    let gathered = scene.render.caustics == Caustics::Photons;
    if !flat || !counted || !gathered || scene.geometry.moves() {
        return None;
    }
    let (block, control) = (Block { first: 0, count: TRIED, seed }, Control::new());
    let (photons, _) = trace_block(scene, window, block, &control).ok()?;
    let (spread, _) = trace_images(scene, window, block, &control).ok()?;
    // What each gives to the variance of what is seen, as if all were independent.
    let square = |power: Vec3| power.element_sum() * power.element_sum();
    let (mut plain, mut through) = (0.0, 0.0);
    for photon in &photons {
        match seen(scene, photon.position) {
            Seen::Not => {}
            Seen::Directly => plain += square(photon.power),
            Seen::ThroughSpecular => through += square(photon.power),
        }
    }
    let mut spread_out = 0.0;
    for image in &spread.images {
        let middle = image.corners.iter().sum::<Vec3>() / 4.0;
        if matches!(seen(scene, middle), Seen::Directly) {
            spread_out += square(image.power) / pixels(scene, &image.corners);
        }
    }
    for photon in &spread.points {
        if matches!(seen(scene, photon.position), Seen::Directly) {
            spread_out += square(photon.power);
        }
    }
    Some(plain >= LEAST_DIRECT * (plain + through) && plain >= LEAST_GAIN * spread_out && plain > 0.0)
}

fn seen(scene: &Scene, point: Vec3) -> Seen {
    let camera = &scene.camera;
    let Some(raster) = camera.raster(point) else { return Seen::Not };
    if raster.cmplt(Vec2::ZERO).any() || raster.cmpgt(camera.resolution).any() {
        return Seen::Not;
    }
    let geometry: &Geometry = &scene.geometry;
    let Some(hit) = geometry.closest_hit(&camera.ray(raster)) else { return Seen::Not };
    let pixel = camera.pixel_width((point - camera.eye).length());
    if (hit.surface.point - point).length() <= NEAR * pixel {
        return Seen::Directly;
    }
    if scene.material_of(hit.object).has_specular() { Seen::ThroughSpecular } else { Seen::Not }
}

/// Pixels that an image covers, at least 1.
fn pixels(scene: &Scene, corners: &[Vec3; 4]) -> f32 {
    let [Some(a), Some(b), Some(c), Some(d)] = corners.map(|corner| scene.camera.raster(corner)) else {
        return 1.0;
    };
    (0.5 * ((b - a).perp_dot(c - a).abs() + (c - a).perp_dot(d - a).abs())).max(1.0)
}
