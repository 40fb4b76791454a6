//! Ray against sphere, by the quadratic that does not cancel.

use super::bounds::Bounds;
use super::ray::WideRay;
use super::{Ray, SurfacePoint, TextureCoordinates};
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
    pub(super) fn intersect(&self, ray: &WideRay, t_max: f32) -> Option<f32> {
        let t = self.first_root(ray)? as f32;
        (t > 0.0 && t < t_max).then_some(t)
    }

    /// The nearer root that lies before the ray, or the farther.
    #[inline]
    fn first_root(&self, ray: &WideRay) -> Option<f64> {
        let (near, far) = roots(ray, self.center.as_dvec3(), f64::from(self.radius))?;
        Some(if near > 0.0 { near } else { far })
    }

    /// The surface where the ray meets it at about `t`, with the point put back onto the sphere.
    pub(super) fn surface(&self, ray: &Ray, t: f32) -> SurfacePoint {
        let (center, ray) = (self.center.as_dvec3(), WideRay::new(ray));
        // The rounded distance is too coarse, far away, to tell where on a small sphere the ray arrives.
        let t = self.first_root(&ray).unwrap_or(f64::from(t));
        let arrival = ray.at(t) - center;
        let normal = arrival.normalize_or(DVec3::Y);
        let point = (center + normal * f64::from(self.radius)).as_vec3();
        let normal = normal.as_vec3();
        SurfacePoint {
            point,
            // Half an ulp of rounding per coordinate, and the centre's own size where that is larger.
            error: point.abs().max(self.center.abs()).max_element() * f32::EPSILON,
            normal,
            shading_normal: normal,
            texture: TextureCoordinates::OnSphere(normal),
        }
    }

    pub(super) fn bounds(&self) -> Bounds {
        Bounds::new(self.center - self.radius, self.center + self.radius).padded()
    }
}

/// Once around, to the right seen from outside, and from bottom to top, each 0..1; the middle faces +z.
pub(super) fn sphere_uv(normal: Vec3) -> Vec2 {
    use std::f32::consts::{PI, TAU};
    let longitude = libm::atan2f(normal.x, normal.z) / TAU + 0.5;
    Vec2::new(longitude, 1.0 - libm::acosf(normal.y.clamp(-1.0, 1.0)) / PI)
}

/// Both distances at which a line meets a sphere, near one first; `None` if it misses.
///
/// Neither the discriminant nor the smaller root is a difference of large numbers: with `f = origin -
/// center` and `l` the part of `f` perpendicular to the ray, the discriminant is `r² - l·l`, and the root
/// that would cancel is `c / q` with `c = |f|² - r²` summed without rounding (Haines et al., *Ray Tracing Gems*, ch. 7).
/// `direction` need not be of unit length.
#[must_use]
pub fn sphere_roots(origin: DVec3, direction: DVec3, center: DVec3, radius: f64) -> Option<(f64, f64)> {
    roots(&WideRay::of(origin, direction), center, radius)
}

#[inline]
fn roots(ray: &WideRay, center: DVec3, radius: f64) -> Option<(f64, f64)> {
    let WideRay { origin, direction, square, inverse_square } = *ray;
    let f = origin - center;
    let b = f.dot(direction);
    let perpendicular = f - direction * (b * inverse_square);
    let discriminant = radius * radius - perpendicular.length_squared();
    if discriminant < 0.0 || discriminant.is_nan() {
        return None;
    }
    let c = squared_length_minus(f, radius);
    let half_chord = (square * discriminant).sqrt();
    // The sum of two numbers of one sign.
    let q = if b > 0.0 { -b - half_chord } else { -b + half_chord };
    if q == 0.0 {
        return None;
    }
    let (t0, t1) = (c / q, q * inverse_square);
    Some(if t0 < t1 { (t0, t1) } else { (t1, t0) })
}

/// |f|² - r², right to the last digits also where the two almost cancel: near a sphere of radius 1e8 their
/// rounding alone would move the hit by 4e-9 of the distance.
fn squared_length_minus(f: DVec3, radius: f64) -> f64 {
    let rounded = f.length_squared() - radius * radius;
    if rounded.abs() > 1e-4 * radius * radius {
        return rounded;
    }
    let squares = [two_square(f.x), two_square(f.y), two_square(f.z), two_square(radius)];
    let [x, y, z, r] = squares;
    let (xy, e0) = two_sum(x.0, y.0);
    let (xyz, e1) = two_sum(xy, z.0);
    let (all, e2) = two_sum(xyz, -r.0);
    all + (e0 + e1 + e2 + x.1 + y.1 + z.1 - r.1)
}

/// a² as a rounded value and its error (Dekker 1971).
fn two_square(a: f64) -> (f64, f64) {
    const SPLITTER: f64 = 134_217_729.0; // 2^27 + 1
    let square = a * a;
    let c = SPLITTER * a;
    let high = c - (c - a);
    let low = a - high;
    (square, ((high * high - square) + 2.0 * high * low) + low * low)
}

/// a + b as a rounded value and its error (Knuth).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let bb = sum - a;
    (sum, (a - (sum - bb)) + (b - bb))
}
