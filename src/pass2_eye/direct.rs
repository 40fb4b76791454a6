//! Pass 2, `LD`: light that reaches a D straight from the lights, by shadow rays.

use crate::geometry::{Ray, SurfacePoint, offset_origin};
use crate::optics::transmittance;
use crate::sampling::{SamplePoint, cosine_hemisphere};
use crate::scene::{Environment, Light, Scene, SpotLight};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

mod area;
mod spherical_rectangle;
mod strata;

use area::{from_disk, from_mesh, from_quad, from_sphere};
use strata::Strata;

/// The surface that is lit, on the side that is seen.
pub(super) struct Receiver<'a> {
    pub(super) surface: &'a SurfacePoint,
    /// Normal on the side that is seen.
    pub(super) normal: Vec3,
    /// Absorption coefficient of the medium on that side.
    pub(super) absorption: Vec3,
}

/// A direction from which light may come.
struct Incident {
    /// Unit vector to the light.
    direction: Vec3,
    /// Where the light is, to the precision of the shadow ray; infinity for a direction.
    distance: f32,
    /// Irradiance it gives if nothing is in between, W·m⁻².
    irradiance: Vec3,
}

/// Irradiance of all lights at a D, one shadow ray each unless the scene asks for more.
pub(super) fn direct_light(
    scene: &Scene,
    receiver: &Receiver<'_>,
    sample: SamplePoint,
    shadow_rays: &mut u64,
) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for (i, light) in scene.lights.iter().enumerate() {
        let sample = if i == 0 { sample } else { sample.branch(i as u64) };
        let mut strata = Strata { scene, receiver, light, shadow_rays };
        if let Some(irradiance) = strata.irradiance(sample) {
            sum += irradiance;
            continue;
        }
        let incident = match light {
            Light::Point { position, intensity } => from_point(receiver, *position, *intensity),
            Light::Directional { direction, irradiance } => from_afar(receiver, *direction, *irradiance),
            Light::Spot(spot) => from_spot(receiver, spot),
            Light::Quad(quad) => from_quad(receiver, quad, sample.get_2d(2)),
            Light::Disk(disk) => from_disk(receiver, disk, sample.get_2d(2)),
            Light::Sphere(sphere) => from_sphere(receiver, sphere, sample.get_2d(2)),
            Light::Mesh(mesh) => from_mesh(receiver, mesh, sample.get_2d(2)),
        };
        sum += visible(scene, receiver, incident, shadow_rays);
    }
    let incident = from_environment(receiver, &scene.environment, sample.get_2d(4));
    sum + visible(scene, receiver, incident, shadow_rays)
}

/// The irradiance if nothing is in the way. S surfaces are in the way too: what comes through them is the
/// photons' part.
fn visible(scene: &Scene, receiver: &Receiver<'_>, incident: Option<Incident>, rays: &mut u64) -> Vec3 {
    let Some(incident) = incident else { return Vec3::ZERO };
    if incident.irradiance.max_element() <= 0.0 {
        return Vec3::ZERO;
    }
    let surface = receiver.surface;
    let origin = offset_origin(surface.point, surface.error, receiver.normal, incident.direction);
    *rays += 1;
    if scene.geometry.any_hit(&Ray::new(origin, incident.direction), incident.distance) {
        return Vec3::ZERO;
    }
    // Nothing was met on the way, so that the light is in the same medium.
    incident.irradiance * transmittance(receiver.absorption, incident.distance)
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
    let cosine = receiver.normal.dot(direction);
    let irradiance = intensity * (cosine.max(0.0) / distance2);
    (cosine > 0.0).then_some(Incident { direction, distance: short_of(distance), irradiance })
}

fn from_spot(receiver: &Receiver<'_>, spot: &SpotLight) -> Option<Incident> {
    let mut incident = from_point(receiver, spot.position, Vec3::ONE)?;
    incident.irradiance *= spot.intensity_along(-incident.direction);
    Some(incident)
}

/// By the cosine where the light is the same from everywhere, else by how bright it is.
fn from_environment(receiver: &Receiver<'_>, environment: &Environment, u: Vec2) -> Option<Incident> {
    let (direction, irradiance) = match environment {
        // The density cosθ/π cancels the cosine.
        Environment::Constant(radiance) => (cosine_hemisphere(receiver.normal, u), *radiance * PI),
        Environment::Image(_) => {
            let from = environment.sample(u)?;
            (from.direction, from.radiance * (receiver.normal.dot(from.direction).max(0.0) / from.pdf))
        }
    };
    Some(Incident { direction, distance: f32::INFINITY, irradiance })
}

fn from_afar(receiver: &Receiver<'_>, direction: Vec3, irradiance: Vec3) -> Option<Incident> {
    let cosine = -receiver.normal.dot(direction);
    (cosine > 0.0).then_some(Incident {
        direction: -direction,
        distance: f32::INFINITY,
        irradiance: irradiance * cosine,
    })
}

/// A few ulps less, so that rounding of the distance cannot put the shadow ray's end behind the light.
fn short_of(distance: f32) -> f32 {
    distance * (1.0 - 4.0 * f32::EPSILON)
}
