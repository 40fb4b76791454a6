//! Pass 2, `LD`: sampled points of lights that have a surface.

use super::spherical_rectangle::SphericalRectangle;
use super::{Incident, Receiver, short_of};
use crate::geometry::offset_origin;
use crate::sampling::{concentric_disc, cone_direction};
use crate::scene::{DiskLight, LightPoint, MeshLight, QuadLight, SphereLight};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// Rounding of a shadow ray's end, in ulps of the largest coordinate.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// A direction to the rectangle uniform in solid angle, so that near and slanting lights are no noisier than
/// the cosine at the receiver.
pub(super) fn from_quad(receiver: &Receiver<'_>, quad: &QuadLight, u: Vec2) -> Option<Incident> {
    let from = receiver.surface.point;
    if (from - quad.center).dot(quad.normal) <= 0.0 {
        return None;
    }
    let rectangle = SphericalRectangle::new(quad, from)?;
    let error = (quad.center.abs() + quad.half_u.abs() + quad.half_v.abs()).max_element() * f32::EPSILON;
    let target = LightPoint { point: rectangle.sample(u), normal: quad.normal, error: 4.0 * error };
    towards(receiver, &target, |_, _| quad.radiance * rectangle.solid_angle)
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
        let target = disk_point(disk, point);
        return towards(receiver, &target, |_, _| disk.radiance * rectangle.solid_angle);
    }
    let (x, y) = disk.normal.any_orthonormal_pair();
    let p = concentric_disc(u) * disk.radius;
    let target = disk_point(disk, disk.center + x * p.x + y * p.y);
    towards(receiver, &target, by_area(disk.radiance * disk.area()))
}

/// A point of a disk light.
pub(super) fn disk_point(disk: &DiskLight, point: Vec3) -> LightPoint {
    let error = (disk.center.abs().max_element() + disk.radius) * (4.0 * f32::EPSILON);
    LightPoint { point, normal: disk.normal, error }
}

/// Uniform in the area of all triangles.
pub(super) fn from_mesh(receiver: &Receiver<'_>, mesh: &MeshLight, u: Vec2) -> Option<Incident> {
    towards(receiver, &mesh.sample(u)?, by_area(mesh.radiance * mesh.area()))
}

/// Irradiance before the cosine at the receiver, of a point uniform over a light of this radiance times area.
pub(super) fn by_area(strength: Vec3) -> impl Fn(f32, f32) -> Vec3 {
    move |cosine, distance2| strength * (cosine / distance2)
}

/// Toward a point of a light. `strength` of the cosine there and the squared distance is the irradiance before
/// the cosine at the receiver.
pub(super) fn towards(
    receiver: &Receiver<'_>,
    light: &LightPoint,
    strength: impl Fn(f32, f32) -> Vec3,
) -> Option<Incident> {
    let from = receiver.surface.point;
    // A light in whose plane the receiver lies is seen edge-on: what is left of its cosine is rounding.
    if (from - light.point).dot(light.normal) <= receiver.surface.error + light.error {
        return None;
    }
    let target = offset_origin(light.point, light.error, light.normal, light.normal);
    let to = target - from;
    let distance2 = to.length_squared();
    let direction = to.try_normalize()?;
    let (cosine, at_light) = (receiver.normal.dot(direction), -light.normal.dot(direction));
    let irradiance = strength(at_light.max(0.0), distance2) * cosine;
    (cosine > 0.0).then_some(Incident { direction, distance: short_of(distance2.sqrt()), irradiance })
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
    let cosine = receiver.normal.dot(direction.as_vec3());
    if cosine <= 0.0 {
        return None;
    }
    let solid_angle = (2.0 * PI * height) as f32;
    Some(Incident {
        direction: direction.as_vec3(),
        distance: short_of(near_root(to, direction, f64::from(sphere.radius) + rounding) as f32),
        irradiance: sphere.radiance * (solid_angle * cosine),
    })
}

/// Where a ray that meets a sphere first meets one that is larger by the rounding of both: the ray's end can
/// then not fall behind the light, also where the ray only grazes it.
fn near_root(to_center: DVec3, direction: DVec3, radius: f64) -> f64 {
    let along = to_center.dot(direction);
    let off = (to_center - direction * along).length_squared();
    (along - (radius * radius - off).max(0.0).sqrt()).max(0.0)
}
