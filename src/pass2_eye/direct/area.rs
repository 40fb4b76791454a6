//! Pass 2, `LD`: sampled points of lights that have a surface.

use super::bilinear::Bilinear;
use super::spherical_rectangle::SphericalRectangle;
use super::{Incident, Receiver, short_of};
use crate::geometry::offset_distance;
use crate::sampling::cone_direction;
use crate::scene::{DiskLight, Light, LightPoint, MeshLight, QuadLight, SphereLight};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// Rounding of a shadow ray's end, in ulps of the largest coordinate.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// A direction to the rectangle. What scatters evenly draws it in proportion to the light that it would get from there: over a
/// far rectangle by what its corners give, over a near one uniform in solid angle but for the cosine toward the corners. Other
/// surfaces draw it uniform in solid angle.
pub(super) fn from_quad(receiver: &Receiver<'_>, quad: &QuadLight, u: Vec2) -> Option<Incident> {
    let from = receiver.surface.point;
    if (from - quad.center).dot(quad.normal) <= 0.0 {
        return None;
    }
    let bsdf = receiver.bsdf;
    let normal = bsdf.albedo().map(|_| bsdf.shading);
    if let Some(corners) = normal.and_then(|normal| Bilinear::of_far(quad, from, normal)) {
        let (place, density) = corners.sample(u)?;
        let drawn = by_area(quad.radiance, quad.area() / density);
        return towards(receiver, &quad.point(place * 2.0 - 1.0), drawn);
    }
    let rectangle = SphericalRectangle::new(quad, from)?;
    let (u, density) = match normal {
        Some(normal) => rectangle.cosines(normal).sample(u)?,
        None => (u, 1.0),
    };
    let drawn = |_, _| Drawn::new(quad.radiance, density / rectangle.solid_angle);
    towards(receiver, &quad.surface_point(rectangle.sample(u)), drawn)
}

/// Uniform in the solid angle of the square around a near disk, where what falls outside the disk gives
/// nothing; uniform in the area of one that is further away than its radius.
pub(super) fn from_disk(receiver: &Receiver<'_>, disk: &DiskLight, u: Vec2) -> Option<Incident> {
    let height = (receiver.surface.point - disk.center).dot(disk.normal);
    if height <= 0.0 {
        return None;
    }
    if height < disk.radius {
        let square = disk.square();
        let rectangle = SphericalRectangle::new(&square, receiver.surface.point)?;
        let point = rectangle.sample(u);
        if point.distance_squared(disk.center) > disk.radius * disk.radius {
            return None;
        }
        let target = LightPoint { point, ..disk.point(Vec2::ZERO) };
        return towards(receiver, &target, |_, _| Drawn::new(disk.radiance, 1.0 / rectangle.solid_angle));
    }
    towards(receiver, &disk.point(u), by_area(disk.radiance, disk.area()))
}

/// Uniform in the area of the whole surface; of a sphere that moves, in its solid angle.
pub(super) fn from_mesh(receiver: &Receiver<'_>, mesh: &MeshLight, u: Vec2) -> Option<Incident> {
    if let Some(sphere) = mesh.as_sphere(receiver.time) {
        return from_sphere(receiver, &sphere, u);
    }
    let (point, area) = mesh.sample(receiver.time, u)?;
    towards(receiver, &point, by_area(mesh.radiance, area))
}

/// What a drawn direction is worth.
pub(super) struct Drawn {
    /// Radiance over density.
    irradiance: Vec3,
    /// Density per solid angle.
    pdf: f32,
}

impl Drawn {
    fn new(radiance: Vec3, pdf: f32) -> Self {
        Self { irradiance: radiance / pdf, pdf }
    }
}

/// A point uniform over a light's area, by the cosine there and the squared distance.
pub(super) fn by_area(radiance: Vec3, area: f32) -> impl Fn(f32, f32) -> Drawn {
    move |cosine, distance2| Drawn::new(radiance, distance2 / (cosine * area))
}

/// Toward a point of a light. `drawn` is of the cosine there and the squared distance.
pub(super) fn towards(
    receiver: &Receiver<'_>,
    light: &LightPoint,
    drawn: impl Fn(f32, f32) -> Drawn,
) -> Option<Incident> {
    let from = receiver.surface.point;
    // A light in whose plane the receiver lies is seen edge-on: what is left of its cosine is rounding.
    if (from - light.point).dot(light.normal) <= receiver.surface.error + light.error {
        return None;
    }
    let to = light.point - from;
    let distance2 = to.length_squared();
    let direction = to.try_normalize()?;
    let at_light = -light.normal.dot(direction);
    if at_light <= 0.0 || !receiver.faces(direction) {
        return None;
    }
    // The shadow ray ends where it is as far before the light as rounding may put the light's surface.
    let short = offset_distance(light.point, light.error, light.normal) / at_light;
    let Drawn { irradiance, pdf } = drawn(at_light, distance2);
    let distance = short_of((distance2.sqrt() - short).max(0.0));
    Some(Incident { direction, distance, irradiance, pdf: Some(pdf) })
}

/// A direction to the sphere uniform in its solid angle.
pub(super) fn from_sphere(receiver: &Receiver<'_>, sphere: &SphereLight, u: Vec2) -> Option<Incident> {
    let from = receiver.surface.point.as_dvec3();
    let to = sphere.center.as_dvec3() - from;
    let distance = to.length();
    let largest = from.abs().max(sphere.center.abs().as_dvec3()).max_element();
    let rounding = f64::from(ROUNDING) * (largest + f64::from(sphere.radius));
    // From inside, and from its own surface, the light is dark.
    if distance <= f64::from(sphere.radius) + rounding {
        return None;
    }
    let sine = f64::from(sphere.radius) / distance;
    // 1 - cos without cancellation.
    let height = sine * sine / (1.0 + (1.0 - sine * sine).sqrt());
    let direction = cone_direction(to / distance, height, u);
    if !receiver.faces(direction.as_vec3()) {
        return None;
    }
    let solid_angle = (2.0 * PI * height) as f32;
    Some(Incident {
        direction: direction.as_vec3(),
        distance: short_of(near_root(to, direction, f64::from(sphere.radius) + rounding) as f32),
        irradiance: sphere.radiance * solid_angle,
        pdf: Some(1.0 / solid_angle),
    })
}

/// Density per solid angle with which the light is sampled from a point at a time in the direction of a point of its own surface;
/// `None` for lights that no ray can meet.
pub(in crate::pass2_eye) fn density_toward(
    light: &Light,
    (from, time): (Vec3, f32),
    at: &LightPoint,
) -> Option<f32> {
    let to = at.point - from;
    let distance2 = to.length_squared();
    let cosine = -at.normal.dot(to) / distance2.sqrt();
    let over_area = |area: f32| (cosine > 0.0).then(|| distance2 / (cosine * area));
    let over_rectangle = |quad: &QuadLight| Some(1.0 / SphericalRectangle::new(quad, from)?.solid_angle);
    let over_cone = |sphere: &SphereLight| {
        let sine2 = sphere.radius * sphere.radius / (sphere.center - from).length_squared();
        let height = sine2 / (1.0 + (1.0 - sine2).max(0.0).sqrt());
        (sine2 < 1.0).then(|| 1.0 / (2.0 * std::f32::consts::PI * height))
    };
    match light {
        Light::Point { .. } | Light::Spot(_) | Light::Directional { .. } => None,
        Light::Quad(quad) => over_rectangle(quad),
        Light::Disk(disk) if (from - disk.center).dot(disk.normal) < disk.radius => {
            over_rectangle(&disk.square())
        }
        Light::Disk(disk) => over_area(disk.area()),
        Light::Mesh(mesh) => match mesh.as_sphere(time) {
            Some(sphere) => over_cone(&sphere),
            None => over_area(mesh.area_at(time, at.normal)),
        },
        Light::Sphere(sphere) => over_cone(sphere),
    }
}

/// Where a ray that meets a sphere first meets one that is larger by the rounding of both: the ray's end can
/// then not fall behind the light, also where the ray only grazes it.
fn near_root(to_center: DVec3, direction: DVec3, radius: f64) -> f64 {
    let along = to_center.dot(direction);
    let off = (to_center - direction * along).length_squared();
    (along - (radius * radius - off).max(0.0).sqrt()).max(0.0)
}
