//! Pass 1, `L`: draws a ray from a light through a window, and the flux it stands for.

use super::window::{Region, Source, Window};
use crate::geometry::Ray;
use crate::sampling::{SamplePoint, concentric_disc, uniform_sphere};
use crate::scene::{Light, ObjectId, QuadLight, Scene};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Draws photons for one window.
pub struct Emission<'a> {
    window: &'a Window,
    source: Sampler<'a>,
    /// Distance from the window at which rays from infinitely far away start: outside the scene.
    retreat: f32,
}

/// A light, or the environment's radiance.
enum Sampler<'a> {
    Light(&'a Light),
    Environment(Vec3),
}

/// A photon that sets out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmittedPhoton {
    /// Its ray.
    pub ray: Ray,
    /// Flux divided by the probability density with which it was drawn, W.
    pub power: Vec3,
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
            Source::Environment => Sampler::Environment(scene.environment),
        };
        let bounds = scene.geometry.bounds();
        Self { window, source, retreat: 2.5 * bounds.radius() }
    }

    /// The object that the window is for.
    #[must_use]
    pub fn caster(&self) -> ObjectId {
        self.window.caster
    }

    /// Draws a photon; `None` where the light gives nothing in the drawn direction.
    #[must_use]
    pub fn sample(&self, sample: SamplePoint) -> Option<EmittedPhoton> {
        let (through, density) = match &self.window.guide {
            Some(guide) => guide.warp(sample.get_2d(0)),
            None => (sample.get_2d(0), 1.0),
        };
        let mut photon = match &self.source {
            Sampler::Environment(radiance) => {
                self.emit_from_environment(*radiance, through, sample.get_2d(2))
            }
            Sampler::Light(Light::Directional { direction, irradiance }) => {
                self.emit_from_afar(*direction, *irradiance, through)
            }
            Sampler::Light(Light::Point { position, intensity }) => {
                let origin = Origin { point: *position, strength: *intensity, normal: None };
                self.emit_from_point(&origin, through)
            }
            Sampler::Light(Light::Quad(quad)) => {
                self.emit_from_point(&point_on_quad(quad, sample.get_2d(2)), through)
            }
        }?;
        photon.power /= density;
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
                Some(normal) => {
                    // Uniform over the hemisphere of the emitting side.
                    let d = uniform_sphere(through);
                    (if d.dot(normal) < 0.0 { -d } else { d }, 2.0 * PI)
                }
                None => (uniform_sphere(through), 4.0 * PI),
            },
            Region::Disc { .. } => return None,
        };
        let cosine = origin.normal.map_or(1.0, |n| n.dot(direction).max(0.0));
        let ray = Ray::new(origin.point, direction);
        Some(EmittedPhoton { ray, power: origin.strength * (cosine * solid_angle) })
    }

    /// Parallel light through a rectangle perpendicular to it.
    fn emit_from_afar(&self, direction: Vec3, irradiance: Vec3, through: Vec2) -> Option<EmittedPhoton> {
        let Region::Rectangle { corner, u, v } = &self.window.region else { return None };
        let target = *corner + *u * through.x + *v * through.y;
        let ray = Ray::new(target - direction * self.retreat, direction);
        Some(EmittedPhoton { ray, power: irradiance * u.cross(*v).length() })
    }

    /// From all around toward a sphere that holds the caster.
    fn emit_from_environment(&self, radiance: Vec3, through: Vec2, u: Vec2) -> Option<EmittedPhoton> {
        let Region::Disc { center, radius } = self.window.region else { return None };
        let direction = uniform_sphere(u);
        let (x, y) = direction.any_orthonormal_pair();
        let disc = concentric_disc(through) * radius;
        let target = center + x * disc.x + y * disc.y;
        let ray = Ray::new(target - direction * self.retreat, direction);
        Some(EmittedPhoton { ray, power: radiance * (4.0 * PI * PI * radius * radius) })
    }
}

fn point_on_quad(quad: &QuadLight, u: Vec2) -> Origin {
    let p = u * 2.0 - 1.0;
    // Off the light's own surface by the rounding of its corners.
    let point = quad.center + quad.half_u * p.x + quad.half_v * p.y;
    let error = (quad.center.abs() + quad.half_u.abs() + quad.half_v.abs()).max_element() * f32::EPSILON;
    Origin {
        point: crate::geometry::offset_origin(point, 2.0 * error, quad.normal, quad.normal),
        strength: quad.radiance * quad.area(),
        normal: Some(quad.normal),
    }
}
