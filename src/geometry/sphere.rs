//! Ray against sphere, by the quadratic that does not cancel.

use super::bounds::Bounds;
use super::{Ray, SurfacePoint};
use glam::{DVec3, Vec2, Vec3};

/// A sphere; its normal points outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sphere {
    /// Centre.
    pub(super) center: Vec3,
    /// Radius, positive.
    pub(super) radius: f32,
}

impl Sphere {
    /// Distance along the ray to the nearest point in `(0, t_max)`.
    #[inline]
    pub(super) fn intersect(&self, ray: &Ray, t_max: f32) -> Option<f32> {
        let (near, far) = roots(
            ray.origin.as_dvec3(),
            ray.direction.as_dvec3(),
            self.center.as_dvec3(),
            f64::from(self.radius),
        )?;
        let t = if near > 0.0 { near } else { far };
        (t > 0.0 && t < f64::from(t_max)).then_some(t as f32)
    }

    /// The surface where the ray meets it at about `t`, with the point put back onto the sphere.
    pub(super) fn surface(&self, ray: &Ray, t: f32) -> SurfacePoint {
        let center = self.center.as_dvec3();
        // The rounded distance is only a hint of which of the two roots was meant: far away it is too coarse
        // to tell where on a small sphere the ray arrives.
        let (near, far) =
            roots(ray.origin.as_dvec3(), ray.direction.as_dvec3(), center, f64::from(self.radius))
                .unwrap_or((f64::from(t), f64::from(t)));
        let t = if near > 0.0 { near } else { far };
        let arrival = ray.origin.as_dvec3() + ray.direction.as_dvec3() * t - center;
        let normal = arrival.normalize_or(DVec3::Y);
        let point = (center + normal * f64::from(self.radius)).as_vec3();
        let normal = normal.as_vec3();
        SurfacePoint {
            point,
            // Half an ulp of rounding per coordinate, and the centre's own size where that is larger.
            error: point.abs().max(self.center.abs()).max_element() * f32::EPSILON,
            normal,
            shading_normal: normal,
            uv: sphere_uv(normal),
        }
    }

    pub(super) fn bounds(&self) -> Bounds {
        Bounds::new(self.center - self.radius, self.center + self.radius).padded()
    }
}

/// Longitude and latitude, each 0..1.
fn sphere_uv(normal: Vec3) -> Vec2 {
    use std::f32::consts::{PI, TAU};
    let longitude = libm::atan2f(normal.z, normal.x) / TAU + 0.5;
    Vec2::new(longitude, libm::acosf(normal.y.clamp(-1.0, 1.0)) / PI)
}

/// Both distances at which a line meets a sphere, near one first; `None` if it misses.
///
/// Neither the discriminant nor the smaller root is a difference of large numbers: with `f = origin -
/// center` and `l` the part of `f` perpendicular to the ray, the discriminant is `r² - l·l`, and the root
/// that would cancel is `c / q` with `c = (|f| - r)(|f| + r)` (Haines et al., *Ray Tracing Gems*, ch. 7).
/// `direction` need not be exactly of unit length.
#[must_use]
pub fn roots(origin: DVec3, direction: DVec3, center: DVec3, radius: f64) -> Option<(f64, f64)> {
    let a = direction.length_squared();
    let f = origin - center;
    let b = f.dot(direction);
    let perpendicular = f - direction * (b / a);
    let discriminant = radius * radius - perpendicular.length_squared();
    if discriminant < 0.0 || discriminant.is_nan() {
        return None;
    }
    let distance = f.length();
    let c = (distance - radius) * (distance + radius);
    let half_chord = (a * discriminant).sqrt();
    // The sum of two numbers of one sign.
    let q = if b > 0.0 { -b - half_chord } else { -b + half_chord };
    if q == 0.0 {
        return None;
    }
    let (t0, t1) = (c / q, q / a);
    Some(if t0 < t1 { (t0, t1) } else { (t1, t0) })
}
