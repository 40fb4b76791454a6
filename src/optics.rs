//! S: what a mirror or smooth glass does to a ray, in either direction of travel.

use crate::geometry::SurfacePoint;
use glam::Vec3;

/// Which way a ray leaves a specular surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Back to the side it came from.
    Reflection,
    /// Through to the other side.
    Refraction,
}

/// One way a ray can leave a specular surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Unit direction in which it leaves.
    pub direction: Vec3,
    /// Fraction of the light that takes this way, per channel.
    pub fraction: Vec3,
    /// Reflection or refraction.
    pub event: Event,
    /// Factor on radiance carried backward along the ray: (n_i/n_t)² for refraction, since light spreads
    /// over another solid angle on the other side (Veach 1997, 5.2), else 1.
    pub radiance_scale: f32,
    /// Factor on the flux of a photon that travels forward over interpolated normals, whose projected areas
    /// do not cancel (Veach 1997, 5.3); 1 where the shading normal is the geometric one.
    pub flux_scale: f32,
}

impl Outcome {
    /// Appends this way to a key that holds one bit per S after a leading 1.
    #[inline]
    #[must_use]
    pub fn extend_key(&self, key: u64) -> u64 {
        key << 1 | u64::from(self.event == Event::Refraction)
    }
}

/// All ways a ray can leave a specular surface; what is missing of their fractions is absorbed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interaction {
    /// Reflected part.
    pub reflected: Option<Outcome>,
    /// Refracted part; none in total internal reflection.
    pub refracted: Option<Outcome>,
}

/// Mirrors the travelling direction at a surface: `I - 2 (N·I) N`, for either sign of the normal.
#[inline]
#[must_use]
pub fn reflect(direction: Vec3, normal: Vec3) -> Vec3 {
    direction - normal * (2.0 * normal.dot(direction))
}

/// Refracts the travelling direction by Snell's law; `normal` is on the side the ray comes from and `eta` is
/// n_i/n_t. `None` in total internal reflection.
#[inline]
#[must_use]
pub fn refract(direction: Vec3, normal: Vec3, eta: f32) -> Option<Vec3> {
    let cos_i = -normal.dot(direction);
    let sin2_t = eta * eta * (1.0 - cos_i * cos_i).max(0.0);
    if sin2_t >= 1.0 {
        return None;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    Some((direction * eta + normal * (eta * cos_i - cos_t)).normalize())
}

/// Unpolarised Fresnel reflectance of a smooth dielectric; `cos_i` is the cosine on the side of incidence,
/// `eta` is n_i/n_t. 1 in total internal reflection, 0 where the indices are equal.
#[inline]
#[must_use]
pub fn fresnel(cos_i: f32, eta: f32) -> f32 {
    if eta == 1.0 {
        return 0.0;
    }
    let cos_i = cos_i.clamp(0.0, 1.0);
    let sin2_t = eta * eta * (1.0 - cos_i * cos_i);
    if sin2_t >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let s = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let p = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    0.5 * (s * s + p * p)
}

/// What a mirror does.
#[must_use]
pub fn mirror(direction: Vec3, surface: &SurfacePoint, reflectance: Vec3) -> Interaction {
    let frame = Frame::new(direction, surface);
    Interaction { reflected: Some(frame.reflected(direction, reflectance)), refracted: None }
}

/// What smooth glass of index `ior` on the inner side does.
#[must_use]
pub fn glass(direction: Vec3, surface: &SurfacePoint, ior: f32) -> Interaction {
    let frame = Frame::new(direction, surface);
    let eta = if frame.from_outside { 1.0 / ior } else { ior };
    let reflectance = fresnel(-frame.shading.dot(direction), eta);
    let refracted = frame.refracted(direction, eta).map(|mut outcome| {
        outcome.fraction = Vec3::splat(1.0 - reflectance);
        outcome
    });
    let reflectance = if refracted.is_none() { 1.0 } else { reflectance };
    let reflected = (reflectance > 0.0).then(|| frame.reflected(direction, Vec3::splat(reflectance)));
    Interaction { reflected, refracted }
}

/// The two normals turned to the side a ray comes from.
struct Frame {
    geometric: Vec3,
    shading: Vec3,
    from_outside: bool,
}

impl Frame {
    fn new(direction: Vec3, surface: &SurfacePoint) -> Self {
        let from_outside = direction.dot(surface.normal) < 0.0;
        let sign = if from_outside { 1.0 } else { -1.0 };
        let geometric = surface.normal * sign;
        let shading = surface.shading_normal * sign;
        // A ray that comes from behind the interpolated surface sees the flat one.
        let shading = if direction.dot(shading) < 0.0 { shading } else { geometric };
        Self { geometric, shading, from_outside }
    }

    fn reflected(&self, direction: Vec3, fraction: Vec3) -> Outcome {
        let mut out = reflect(direction, self.shading);
        let mut flux_scale = self.flux_scale(direction, out);
        if out.dot(self.geometric) <= 0.0 {
            out = reflect(direction, self.geometric);
            flux_scale = 1.0;
        }
        Outcome {
            direction: out.normalize(),
            fraction,
            event: Event::Reflection,
            radiance_scale: 1.0,
            flux_scale,
        }
    }

    fn refracted(&self, direction: Vec3, eta: f32) -> Option<Outcome> {
        let mut out = if eta == 1.0 { direction } else { refract(direction, self.shading, eta)? };
        let mut flux_scale = if eta == 1.0 { 1.0 } else { self.flux_scale(direction, out) };
        if out.dot(self.geometric) >= 0.0 {
            out = refract(direction, self.geometric, eta)?;
            flux_scale = 1.0;
        }
        Some(Outcome {
            direction: out,
            fraction: Vec3::ONE,
            event: Event::Refraction,
            radiance_scale: eta * eta,
            flux_scale,
        })
    }

    /// |out·g| |in·s| / (|in·g| |out·s|).
    fn flux_scale(&self, direction: Vec3, out: Vec3) -> f32 {
        if self.shading == self.geometric {
            return 1.0;
        }
        let numerator = out.dot(self.geometric) * direction.dot(self.shading);
        let denominator = direction.dot(self.geometric) * out.dot(self.shading);
        // At grazing angles the quotient is not bounded; ten is beyond any tessellation that means a smooth
        // surface.
        (numerator / denominator).abs().clamp(0.0, 10.0)
    }
}
