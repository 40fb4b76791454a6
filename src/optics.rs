//! S: what mirrors, smooth metal and glass do to a ray, in either direction of travel.

use crate::geometry::SurfacePoint;
use crate::scene::{Conductor, Material};
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

/// Unpolarised Fresnel reflectance of a conductor of complex index `n` + i`k` in air, one channel.
#[must_use]
pub fn fresnel_conductor(cos_i: f32, n: f32, k: f32) -> f32 {
    if cos_i <= 0.0 {
        return 1.0;
    }
    let cos2 = cos_i.min(1.0) * cos_i.min(1.0);
    let sin2 = 1.0 - cos2;
    let (n2, k2) = (n * n, k * k);
    let t = n2 - k2 - sin2;
    // (a + ib)² = (n + ik)² - sin².
    let length = (t * t + 4.0 * n2 * k2).sqrt();
    let a = (0.5 * (length + t)).max(0.0).sqrt();
    let cross = 2.0 * a * cos_i.min(1.0);
    let s = (length + cos2 - cross) / (length + cos2 + cross);
    let (sum, mixed) = (cos2 * length + sin2 * sin2, cross * sin2);
    let p = s * (sum - mixed) / (sum + mixed);
    0.5 * (s + p)
}

/// Reflectance of a metal per channel.
#[must_use]
pub fn metal_reflectance(cos_i: f32, conductor: &Conductor) -> Vec3 {
    match conductor {
        Conductor::Normal(f0) => {
            let m = 1.0 - cos_i.clamp(0.0, 1.0);
            *f0 + (Vec3::ONE - *f0) * (m * m * m * m * m)
        }
        Conductor::Complex { n, k } => {
            let channel = |i: usize| fresnel_conductor(cos_i, n[i], k[i]);
            Vec3::new(channel(0), channel(1), channel(2))
        }
    }
}

/// What a surface does to a ray if it is an S, `None` if it is a D.
#[must_use]
pub fn interact(material: &Material, direction: Vec3, surface: &SurfacePoint) -> Option<Interaction> {
    match material {
        Material::Diffuse { .. } => None,
        Material::Mirror { reflectance } => Some(mirror(direction, surface, *reflectance)),
        Material::Metal(conductor) => {
            let cos_i = -Frame::new(direction, surface).shading.dot(direction);
            Some(mirror(direction, surface, metal_reflectance(cos_i, conductor)))
        }
        Material::Glass { ior, .. } => Some(glass(direction, surface, *ior)),
    }
}

/// Absorption coefficient of what a ray has come through: of the surface's own glass if it arrives from within,
/// else what was known of its way.
#[inline]
#[must_use]
pub fn absorption_before(material: &Material, direction: Vec3, surface: &SurfacePoint, known: Vec3) -> Vec3 {
    match material {
        Material::Glass { absorption, .. } if direction.dot(surface.normal) > 0.0 => *absorption,
        Material::Glass { .. } | Material::Diffuse { .. } | Material::Mirror { .. } | Material::Metal(_) => {
            known
        }
    }
}

/// Absorption coefficient of what a ray goes on through; `before` is that of what it came through.
#[inline]
#[must_use]
pub fn absorption_after(
    material: &Material,
    outcome: &Outcome,
    surface: &SurfacePoint,
    before: Vec3,
) -> Vec3 {
    match material {
        Material::Glass { absorption, .. } if outcome.event == Event::Refraction => {
            if outcome.direction.dot(surface.normal) < 0.0 { *absorption } else { Vec3::ZERO }
        }
        Material::Glass { .. } | Material::Diffuse { .. } | Material::Mirror { .. } | Material::Metal(_) => {
            before
        }
    }
}

/// Share of the light that is left after a way through an absorbing medium (Beer and Lambert).
#[inline]
#[must_use]
pub fn transmittance(absorption: Vec3, distance: f32) -> Vec3 {
    if absorption == Vec3::ZERO {
        return Vec3::ONE;
    }
    // A channel that is not absorbed is not over an infinite way either.
    let left = |a: f32| if a > 0.0 { libm::expf(-a * distance) } else { 1.0 };
    Vec3::new(left(absorption.x), left(absorption.y), left(absorption.z))
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
