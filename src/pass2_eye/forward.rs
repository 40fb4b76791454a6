//! `LS+DE` by forward tracing: each photon that has come to rest is connected to the eye, and its light falls on the
//! pixel that sees it. What mirrors and glass show of it, `LS+DS+E`, has no such connection and is left out.

use super::specular::LENS_DIMENSION;
use crate::bsdf::Bsdf;
use crate::film::RoundFilm;
use crate::light_path::{PICTURE, PathClass, Pictures};
use crate::optics::{Arrival, transmittance};
use crate::pass1_light::RoundLists;
use crate::photon_map::Photon;
use crate::plan::Plan;
use crate::render::{Control, RenderError};
use crate::sampling::{SamplePoint, WAVELENGTH_DIMENSION, hash};
use crate::scene::Scene;
use crate::spectrum;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Photons connected between two looks at the cancel flag; also the unit of parallel work.
const BATCH: usize = 4096;

/// A photon counts as seen if the eye's ray ends this many times the rounding of both from it. A surface has no two
/// sides nearer to each other that photons tell apart.
const ROUNDING: f32 = 16.0;

/// The caustics of one round: mean radiance of each pixel, row by row, in both halves.
#[derive(Clone, Debug, PartialEq)]
pub struct Connected {
    halves: [Vec<DVec3>; 2],
    /// Those of each named layer, sum of both halves.
    layers: Vec<Vec<DVec3>>,
    /// Rays traced.
    pub rays: u64,
}

/// A photon's light on a pixel.
struct Splat {
    pixel: u32,
    radiance: Vec3,
    pictures: Pictures,
}

impl Connected {
    /// Adds what the photons brought to a round of eye samples.
    pub fn add_to(&self, film: &mut RoundFilm) {
        self.halves.iter().enumerate().for_each(|(half, radiance)| film.add_caustics(half, radiance));
        self.layers.iter().enumerate().for_each(|(layer, radiance)| film.add_to_layer(layer, radiance));
    }
}

/// Connects all photons of a round to the eye. Sums are formed in the order of the photons, in f64.
///
/// # Errors
/// [`RenderError::Cancelled`], or [`RenderError::NotFinite`] with the pixel that shows it.
pub fn connect(
    scene: &Scene,
    plan: &Plan,
    photons: &RoundLists,
    round: u32,
    control: &Control,
) -> Result<Connected, RenderError> {
    const FORWARD: u64 = 4;
    let (width, height) = (scene.image.width, scene.image.height);
    let pixels = width as usize * height as usize;
    let layers = vec![vec![DVec3::ZERO; pixels]; plan.layer_names.len()];
    let mut connected = Connected { halves: [Vec::new(), Vec::new()], layers, rays: 0 };
    for (half, list) in photons.halves.iter().enumerate() {
        let seed = hash(hash(hash(scene.render.seed, FORWARD), u64::from(round)), half as u64);
        let eye = Eye { scene, plan, seed, time: photons.times[half] };
        let batches = list
            .par_chunks(BATCH)
            .enumerate()
            .map(|(batch, photons)| {
                control.check()?;
                let first = batch * BATCH;
                Ok((first..).zip(photons).filter_map(|(i, photon)| eye.see(photon, i as u32)).collect())
            })
            .collect::<Result<Vec<Vec<Splat>>, RenderError>>()?;
        let mut sums = vec![DVec3::ZERO; pixels];
        for splat in batches.iter().flatten() {
            let (pixel, radiance) = (splat.pixel as usize, splat.radiance.as_dvec3());
            if splat.pictures & PICTURE != 0 {
                sums[pixel] += radiance;
            }
            for (layer, sums) in connected.layers.iter_mut().enumerate() {
                if splat.pictures >> (layer + 1) & 1 == 1 {
                    sums[pixel] += radiance;
                }
            }
        }
        if let Some(i) = sums.iter().position(|sum| !sum.is_finite()) {
            let (x, y) = (i as u32 % width, i as u32 / width);
            return Err(RenderError::NotFinite { x, y, round, class: PathClass::Caustic });
        }
        connected.halves[half] = sums;
        connected.rays += list.len() as u64;
    }
    Ok(connected)
}

/// The eye, as the photons of one half see it.
struct Eye<'a> {
    scene: &'a Scene,
    plan: &'a Plan,
    seed: u64,
    time: f32,
}

impl Eye<'_> {
    /// What a photon adds to the pixel that sees it: its power times radiance per irradiance, times the pixels per area
    /// of the surface, `cosθ / (d² ω)` for pixels of solid angle ω.
    fn see(&self, photon: &Photon, index: u32) -> Option<Splat> {
        let scene = self.scene;
        let pictures = self.pictures(photon);
        if pictures == 0 {
            return None;
        }
        let u = SamplePoint::new(self.seed, index).get_2d(LENS_DIMENSION);
        let view = scene.camera.project(photon.position, u)?;
        let ray = view.ray.at_time(self.time);
        let hit = scene.geometry.closest_hit(&ray)?;
        let cosine = ray.direction.dot(hit.surface.normal).abs();
        let rounding = hit.surface.error + view.distance * f32::EPSILON;
        if hit.sheet != photon.sheet || (hit.t - view.distance).abs() * cosine > ROUNDING * rounding {
            return None;
        }
        let arrival = Arrival::new(scene, &ray, &hit, self.plan.eye_media, None);
        let line = || spectrum::pick(SamplePoint::new(self.seed, index).get(WAVELENGTH_DIMENSION));
        let value = Bsdf::new(&arrival, line)?.per_irradiance_from(-photon.direction);
        let left = transmittance(arrival.media.absorption(scene), hit.t);
        let radiance = photon.power * value * left * (cosine * view.pixels_per_area);
        let pixel = view.raster.as_uvec2();
        let pixel = pixel.y * scene.image.width + pixel.x;
        (radiance != Vec3::ZERO).then_some(Splat { pixel, radiance, pictures })
    }

    /// The pictures that hold what the eye sees of a photon directly.
    fn pictures(&self, photon: &Photon) -> Pictures {
        match &self.plan.language {
            Some(language) => language.pictures(language.first_diffuse(0), photon.kind),
            None if self.plan.classes.contains(PathClass::Caustic) => PICTURE,
            None => 0,
        }
    }
}
