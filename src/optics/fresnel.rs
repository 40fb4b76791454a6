//! S: the formulas of mirror and glass.

use crate::scene::Conductor;
use glam::Vec3;

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
