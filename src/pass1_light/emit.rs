//! Pass 1, `L`: draws a ray from a light through a window, and the flux it stands for.

use super::window::{Region, Source, Window};
use crate::geometry::{Ray, offset_origin};
use crate::sampling::{SamplePoint, concentric_disc, cone_direction, cosine_hemisphere, uniform_sphere};
use crate::scene::{Environment, Light, LightPoint, Scene, SphereLight, SpotLight};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Draws photons for one window.
pub struct Emission<'a> {
    window: &'a Window,
    source: Sampler<'a>,
    /// Distance from the window at which rays from infinitely far away start: outside the scene.
    retreat: f32,
}

/// What the photons come from.
enum Sampler<'a> {
    Light(&'a Light),
    Environment(&'a Environment),
}

/// A photon that sets out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmittedPhoton {
    /// Its ray.
    pub ray: Ray,
    /// Flux divided by the probability density with which it was drawn, W.
    pub power: Vec3,
}

/// A point of a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Aim {
    /// The point, in the window's unit square.
    through: Vec2,
    /// Density with which it was drawn.
    density: f32,
}

/// A point on a light and its one-sided emission there.
struct Origin {
    point: Vec3,
    /// Emission per solid angle along a direction (and per area, times the area, for a quad).
    strength: Vec3,
    /// Normal of the emitting side, if the emission falls with the cosine from it.
    normal: Option<Vec3>,
}

impl<'a> Emission<'a> {
    /// Prepares to draw photons for a window of `scene`.
    #[must_use]
    pub fn new(scene: &'a Scene, window: &'a Window) -> Self {
        let source = match window.source {
            Source::Light(id) => Sampler::Light(&scene.lights[id.index()]),
            Source::Environment => Sampler::Environment(&scene.environment),
        };
        let bounds = scene.geometry.bounds();
        Self { window, source, retreat: 2.5 * bounds.radius() }
    }

    /// The window.
    #[must_use]
    pub fn window(&self) -> &Window {
        self.window
    }

    /// Draws a photon that flies at a time; `None` where the light gives nothing in the drawn direction.
    #[must_use]
    pub fn sample(&self, sample: SamplePoint, time: f32) -> Option<EmittedPhoton> {
        self.emit(self.aim(sample), sample.get_2d(2), time)
    }

    /// The point of the window that a sample goes through.
    #[inline]
    pub(super) fn aim(&self, sample: SamplePoint) -> Aim {
        let (through, density) = match &self.window.guide {
            Some(guide) => guide.warp(sample.get_2d(0)),
            None => (sample.get_2d(0), 1.0),
        };
        Aim { through, density }
    }

    /// The photon from a point of the unit square, which the light's surface or directions are mapped to, through
    /// a point of the window.
    pub(super) fn emit(&self, aim: Aim, on_light: Vec2, time: f32) -> Option<EmittedPhoton> {
        let Aim { through, density } = aim;
        let mut photon = match &self.source {
            Sampler::Environment(environment) => self.emit_from_environment(environment, through, on_light),
            Sampler::Light(Light::Directional { direction, irradiance }) => {
                self.emit_from_afar(*direction, *irradiance, through)
            }
            Sampler::Light(Light::Point { position, intensity }) => {
                let origin = Origin { point: *position, strength: *intensity, normal: None };
                self.emit_from_point(&origin, through)
            }
            Sampler::Light(Light::Spot(spot)) => self.emit_from_spot(spot, through),
            Sampler::Light(Light::Quad(quad)) => {
                let point = quad.point(on_light * 2.0 - 1.0);
                self.emit_from_point(&Origin::on(&point, quad.radiance * quad.area()), through)
            }
            Sampler::Light(Light::Disk(disk)) => {
                let point = disk.point(on_light);
                self.emit_from_point(&Origin::on(&point, disk.radiance * disk.area()), through)
            }
            Sampler::Light(Light::Mesh(mesh)) => {
                let (point, area) = mesh.sample(time, on_light)?;
                self.emit_from_point(&Origin::on(&point, mesh.radiance * area), through)
            }
            Sampler::Light(Light::Sphere(sphere)) => self.emit_from_sphere(sphere, through, on_light),
        }?;
        photon.power /= density;
        photon.ray.time = time;
        (photon.power.max_element() > 0.0).then_some(photon)
    }

    /// From a point through the window, or in any direction.
    fn emit_from_point(&self, origin: &Origin, through: Vec2) -> Option<EmittedPhoton> {
        let (direction, solid_angle) = match &self.window.region {
            Region::Rectangle { corner, u, v } => {
                let to = *corner + *u * through.x + *v * through.y - origin.point;
                let distance2 = to.length_squared();
                let direction = to / distance2.sqrt();
                // |u × v| is the window's area; its scalar product with the direction is area times cosine.
                (direction, u.cross(*v).dot(direction).abs() / distance2)
            }
            Region::AllDirections => match origin.normal {
                // By the cosine: its density cosθ / π takes the place of the cosine below.
                Some(normal) => {
                    let ray = Ray::new(origin.point, cosine_hemisphere(normal, through));
                    return Some(EmittedPhoton { ray, power: origin.strength * PI });
                }
                None => (uniform_sphere(through), 4.0 * PI),
            },
            Region::Disc { .. } => return None,
        };
        let cosine = origin.normal.map_or(1.0, |n| n.dot(direction).max(0.0));
        let ray = Ray::new(origin.point, direction);
        Some(EmittedPhoton { ray, power: origin.strength * (cosine * solid_angle) })
    }

    /// From a point through the window, or uniformly into the cone.
    fn emit_from_spot(&self, spot: &SpotLight, through: Vec2) -> Option<EmittedPhoton> {
        let mut photon = match &self.window.region {
            Region::AllDirections => {
                let height = 1.0 - f64::from(spot.cos_outer);
                let direction = cone_direction(spot.axis.as_dvec3(), height, through).as_vec3();
                let ray = Ray::new(spot.position, direction);
                EmittedPhoton { ray, power: Vec3::splat(2.0 * PI * height as f32) }
            }
            Region::Rectangle { .. } | Region::Disc { .. } => {
                let origin = Origin { point: spot.position, strength: Vec3::ONE, normal: None };
                self.emit_from_point(&origin, through)?
            }
        };
        photon.power *= spot.intensity_along(photon.ray.direction);
        Some(photon)
    }

    /// Through a point of the window along a direction in which the sphere is seen from there, so that no
    /// photon is drawn on the sphere's far side; or from its whole surface by the cosine.
    fn emit_from_sphere(&self, sphere: &SphereLight, through: Vec2, u: Vec2) -> Option<EmittedPhoton> {
        let (center, radius) = (sphere.center.as_dvec3(), f64::from(sphere.radius));
        let Region::Rectangle { corner, u: across, v: up } = &self.window.region else {
            let normal = uniform_sphere(u);
            let point = sphere.point(normal.as_dvec3());
            let strength = sphere.radiance * sphere.area();
            return self.emit_from_point(&Origin::on(&point, strength), through);
        };
        let target = (*corner + *across * through.x + *up * through.y).as_dvec3();
        let to = center - target;
        let distance = to.length();
        if distance <= radius {
            return None;
        }
        let sine = radius / distance;
        let height = sine * sine / (1.0 + (1.0 - sine * sine).sqrt());
        let backward = cone_direction(to / distance, height, u);
        let along = to.dot(backward);
        let off = to - backward * along;
        let chord = (radius * radius - off.length_squared()).max(0.0).sqrt();
        let point = sphere.point((-off - backward * chord) / radius);
        let direction = -backward.as_vec3();
        let area = across.cross(*up).dot(direction).abs();
        let origin = offset_origin(point.point, point.error, point.normal, point.normal);
        let solid_angle = 2.0 * PI * height as f32;
        Some(EmittedPhoton {
            ray: Ray::new(origin, direction),
            power: sphere.radiance * (area * solid_angle),
        })
    }

    /// Parallel light through a rectangle perpendicular to it.
    fn emit_from_afar(&self, direction: Vec3, irradiance: Vec3, through: Vec2) -> Option<EmittedPhoton> {
        let Region::Rectangle { corner, u, v } = &self.window.region else { return None };
        let target = *corner + *u * through.x + *v * through.y;
        let ray = Ray::new(target - direction * self.retreat, direction);
        Some(EmittedPhoton { ray, power: irradiance * u.cross(*v).length() })
    }

    /// From all around toward a sphere that holds the caster.
    fn emit_from_environment(
        &self,
        environment: &Environment,
        through: Vec2,
        u: Vec2,
    ) -> Option<EmittedPhoton> {
        let Region::Disc { center, radius } = self.window.region else { return None };
        let from = environment.sample(u)?;
        let direction = -from.direction;
        let (x, y) = direction.any_orthonormal_pair();
        let disc = concentric_disc(through) * radius;
        let target = center + x * disc.x + y * disc.y;
        let ray = Ray::new(target - direction * self.retreat, direction);
        Some(EmittedPhoton { ray, power: from.radiance * (PI * radius * radius / from.pdf) })
    }
}

impl Origin {
    /// Just off a light's own surface, where it emits `strength` by the cosine.
    fn on(light: &LightPoint, strength: Vec3) -> Self {
        let point = offset_origin(light.point, light.error, light.normal, light.normal);
        Self { point, strength, normal: Some(light.normal) }
    }
}
