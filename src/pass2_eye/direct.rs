//! Pass 2, `LD`: light that reaches a D straight from the lights, by shadow rays; where highlights are sharp, also by
//! rays that the surface scatters and that meet a light, both weighted by the power heuristic (Veach 1997, 9.2).

use crate::bsdf::Bsdf;
use crate::geometry::{Ray, SurfacePoint, offset_origin};
use crate::optics::transmittance;
use crate::pass1_light::Source;
use crate::plan::{Asking, LightTree};
use crate::sampling::{SamplePoint, cosine_hemisphere, hash};
use crate::scene::{Environment, Light, LightId, Scene, SpotLight};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

mod area;
mod bilinear;
mod spherical_rectangle;
mod strata;

pub(super) use area::density_toward;

use area::{from_disk, from_mesh, from_quad, from_sphere};
use strata::Strata;

/// The surface that is lit, as the eye sees it.
pub(super) struct Receiver<'a> {
    pub(super) scene: &'a Scene,
    pub(super) surface: &'a SurfacePoint,
    pub(super) bsdf: &'a Bsdf,
    /// When it is seen: the shadow rays' time.
    pub(super) time: f32,
    /// Which lights are asked, if not all.
    pub(super) tree: Option<&'a LightTree>,
}

/// A direction from which light may come.
struct Incident {
    /// Unit vector to the light.
    direction: Vec3,
    /// Where the light is, to the precision of the shadow ray; infinity for a direction.
    distance: f32,
    /// Irradiance it gives, if nothing is in between, to a surface that faces it, W·m⁻².
    irradiance: Vec3,
    /// Density per solid angle with which the direction was drawn; `None` of the only direction there is.
    pdf: Option<f32>,
}

impl Receiver<'_> {
    /// Whether light from a direction can be seen at all.
    #[inline]
    fn faces(&self, direction: Vec3) -> bool {
        let bsdf = self.bsdf;
        bsdf.transmits() || (direction.dot(bsdf.geometric) > 0.0 && direction.dot(bsdf.shading) > 0.0)
    }

    /// Radiance if nothing is in the way.
    fn radiance(&self, incident: &Incident) -> Vec3 {
        let value = self.bsdf.eval(incident.direction) * incident.irradiance;
        match incident.pdf {
            Some(pdf) if self.bsdf.albedo().is_none() => {
                value * power_heuristic(pdf, self.bsdf.pdf(incident.direction))
            }
            Some(_) | None => value,
        }
    }

    /// Radiance, as far as nothing is in the way. S surfaces are in the way too: what comes through them is the
    /// photons' part.
    fn visible(&self, incident: Option<Incident>, rays: &mut u64) -> Vec3 {
        let Some(incident) = incident else { return Vec3::ZERO };
        let radiance = self.radiance(&incident);
        if radiance.max_element() <= 0.0 {
            return Vec3::ZERO;
        }
        let Receiver { scene, surface, bsdf, time, .. } = self;
        let origin = offset_origin(surface.point, surface.error, bsdf.geometric, incident.direction);
        *rays += 1;
        let shadow_ray = Ray::new(origin, incident.direction).at_time(*time);
        if scene.geometry.any_hit(&shadow_ray, incident.distance) {
            return Vec3::ZERO;
        }
        // Nothing was met on the way, so that the light is in the same medium.
        let absorption = bsdf.media_toward(incident.direction).absorption(scene);
        radiance * transmittance(absorption, incident.distance)
    }
}

/// Weight of a sample drawn with density `pdf` beside another estimator that draws it with density `other`.
#[inline]
pub(super) fn power_heuristic(pdf: f32, other: f32) -> f32 {
    if other <= 0.0 {
        return 1.0;
    }
    let ratio = other / pdf;
    1.0 / (1.0 + ratio * ratio)
}

/// Lights that are picked at a D where there are too many to ask each. Measured on 1000 lamps: the error for the same time is
/// least between two and eight.
const PICKS: u32 = 4;

/// Tells the stream that picks lights from the others.
const PICK_STREAM: u64 = 0x11_9475;

/// How often a light is asked at a D, in the mean: density of one of its points times this is that of all samples.
pub(super) fn asked_times(tree: Option<&LightTree>, asking: &Asking, light: LightId) -> f32 {
    tree.map_or(1.0, |tree| PICKS as f32 * tree.probability(asking, light))
}

/// Tells the radiance from each light at a D, one shadow ray each unless the scene asks for more, or from a few of many.
pub(super) fn direct_light(
    receiver: &Receiver<'_>,
    sample: SamplePoint,
    shadow_rays: &mut u64,
    mut tell: impl FnMut(Source, Vec3),
) {
    let scene = receiver.scene;
    let mut ask = |id: LightId, sample: SamplePoint, times: Option<f32>| {
        tell(Source::Light(id), from_light(receiver, (id, times), sample, shadow_rays));
    };
    match receiver.tree {
        None => (0..scene.lights.len() as u32).for_each(|i| {
            ask(LightId(i), if i == 0 { sample } else { sample.branch(u64::from(i)) }, None);
        }),
        Some(tree) => {
            tree.always().iter().for_each(|&id| ask(id, sample.branch(u64::from(id.0)), None));
            // Where there are highlights, scattered rays must know the choice from the point alone.
            let one_sided = receiver.bsdf.albedo().is_some() && !receiver.bsdf.transmits();
            let normal = one_sided.then_some(receiver.bsdf.geometric);
            let asking = Asking { point: receiver.surface.point, normal };
            let jitter = sample.branch(PICK_STREAM).get(0);
            for pick in 0..PICKS {
                let u = (pick as f32 + jitter) / PICKS as f32;
                let Some((id, probability)) = tree.pick(&asking, u) else { continue };
                let sample = sample.branch(hash(PICK_STREAM, u64::from(pick)));
                ask(id, sample, Some(PICKS as f32 * probability));
            }
        }
    }
    if !scene.environment.is_black() {
        let incident = from_environment(receiver, &scene.environment, sample.get_2d(4));
        tell(Source::Environment, receiver.visible(incident, shadow_rays));
    }
}

/// Radiance from a light that is asked so many times in the mean, if not just once.
fn from_light(
    receiver: &Receiver<'_>,
    (id, times): (LightId, Option<f32>),
    sample: SamplePoint,
    shadow_rays: &mut u64,
) -> Vec3 {
    let light = &receiver.scene.lights[id.index()];
    let mut strata = Strata { receiver, light, shadow_rays };
    if let Some(radiance) = strata.radiance(sample) {
        return radiance;
    }
    let mut incident = match light {
        Light::Point { position, intensity } => from_point(receiver, *position, *intensity),
        Light::Directional { direction, irradiance } => from_afar(receiver, *direction, *irradiance),
        Light::Spot(spot) => from_spot(receiver, spot),
        Light::Quad(quad) => from_quad(receiver, quad, sample.get_2d(2)),
        Light::Disk(disk) => from_disk(receiver, disk, sample.get_2d(2)),
        Light::Sphere(sphere) => from_sphere(receiver, sphere, sample.get_2d(2)),
        Light::Mesh(mesh) => from_mesh(receiver, mesh, sample.get_2d(2)),
    };
    if let (Some(incident), Some(times)) = (&mut incident, times) {
        incident.irradiance /= times;
        incident.pdf = incident.pdf.map(|pdf| pdf * times);
    }
    receiver.visible(incident, shadow_rays)
}

fn from_point(receiver: &Receiver<'_>, position: Vec3, intensity: Vec3) -> Option<Incident> {
    let to = position - receiver.surface.point;
    let distance2 = to.length_squared();
    let distance = distance2.sqrt();
    // A light on the surface itself lights nothing: no direction leads to it.
    if distance <= receiver.surface.error {
        return None;
    }
    let direction = to / distance;
    let irradiance = intensity / distance2;
    let incident = Incident { direction, distance: short_of(distance), irradiance, pdf: None };
    receiver.faces(direction).then_some(incident)
}

fn from_spot(receiver: &Receiver<'_>, spot: &SpotLight) -> Option<Incident> {
    let mut incident = from_point(receiver, spot.position, Vec3::ONE)?;
    incident.irradiance *= spot.intensity_along(-incident.direction);
    Some(incident)
}

/// By the cosine where the light is the same from everywhere, else by how bright it is. Where highlights are sharp,
/// what is the same from everywhere is left to scattered rays.
fn from_environment(receiver: &Receiver<'_>, environment: &Environment, u: Vec2) -> Option<Incident> {
    let shading = receiver.bsdf.shading;
    let (direction, irradiance, pdf) = match environment {
        Environment::Constant(_) if receiver.bsdf.albedo().is_none() => return None,
        Environment::Constant(radiance) => {
            let direction = cosine_hemisphere(shading, u);
            // The density cosθ/π cancels the cosine of the BSDF.
            (direction, *radiance * (PI / direction.dot(shading).max(f32::MIN_POSITIVE)), None)
        }
        Environment::Image(_) => {
            let from = environment.sample(u)?;
            (from.direction, from.radiance / from.pdf, Some(from.pdf))
        }
    };
    let incident = Incident { direction, distance: f32::INFINITY, irradiance, pdf };
    receiver.faces(direction).then_some(incident)
}

/// Density per solid angle with which the environment is sampled at a surface with highlights.
pub(super) fn environment_density(environment: &Environment, direction: Vec3) -> f32 {
    match environment {
        Environment::Constant(_) => 0.0,
        Environment::Image(_) => environment.pdf(direction),
    }
}

fn from_afar(receiver: &Receiver<'_>, direction: Vec3, irradiance: Vec3) -> Option<Incident> {
    let incident = Incident { direction: -direction, distance: f32::INFINITY, irradiance, pdf: None };
    receiver.faces(-direction).then_some(incident)
}

/// A few ulps less, so that rounding of the distance cannot put the shadow ray's end behind the light.
fn short_of(distance: f32) -> f32 {
    distance * (1.0 - 4.0 * f32::EPSILON)
}
