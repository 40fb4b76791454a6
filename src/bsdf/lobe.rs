//! D: one lobe of a surface, in a frame whose z is the normal on the side that is seen. Values hold the cosine.

use super::microfacet::Ggx;
use crate::optics::{fresnel, metal_reflectance, reflect, refract};
use crate::sampling::cosine_hemisphere;
use crate::scene::{Conductor, Highlight};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// One way in which a surface scatters.
#[derive(Clone, Copy, Debug)]
pub(super) enum Lobe {
    /// Evenly.
    Lambert { albedo: Vec3 },
    /// Phong's highlight.
    Highlight { k_s: Vec3, exponent: f32, form: Highlight },
    /// Microfacets of metal.
    Metal { conductor: Conductor, alpha: f32 },
    /// Microfacets of glass; `eta` is the index on the viewer's side over that of the other, `let_through` a factor on
    /// what comes from there.
    Glass { eta: f32, alpha: f32, let_through: Vec3 },
}

/// Directions to the viewer and to where the light comes from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local {
    pub(super) wo: Vec3,
    pub(super) wi: Vec3,
}

/// Refraction by microfacets has no density where the indices are equal: they are kept apart by this much.
const LEAST_CONTRAST: f32 = 1e-3;

impl Lobe {
    pub(super) fn glass(eta: f32, alpha: f32, let_through: Vec3) -> Self {
        let eta = if (eta - 1.0).abs() < LEAST_CONTRAST { 1.0 + LEAST_CONTRAST } else { eta };
        Self::Glass { eta, alpha, let_through }
    }

    /// About how much of the light it scatters.
    pub(super) fn strength(&self) -> f32 {
        let mean = |v: Vec3| v.element_sum() / 3.0;
        match self {
            Self::Lambert { albedo } => mean(*albedo),
            Self::Highlight { k_s, exponent, form: Highlight::Lecture } => {
                mean(*k_s) * 2.0 / (exponent + 2.0)
            }
            Self::Highlight { k_s, form: Highlight::Conserving, .. } => mean(*k_s),
            Self::Metal { conductor, .. } => mean(metal_reflectance(1.0, conductor)),
            Self::Glass { .. } => 1.0,
        }
    }

    pub(super) fn eval(&self, local: &Local) -> Vec3 {
        let Local { wo, wi } = *local;
        match self {
            Self::Lambert { albedo } => *albedo * (wi.z.max(0.0) / PI),
            Self::Highlight { k_s, exponent, form } => {
                let cos_alpha = mirrored(wo).dot(wi);
                if wi.z <= 0.0 || cos_alpha <= 0.0 {
                    return Vec3::ZERO;
                }
                let scale = match form {
                    Highlight::Lecture => 1.0 / PI,
                    Highlight::Conserving => (exponent + 2.0) / (2.0 * PI) * wi.z,
                };
                *k_s * (libm::powf(cos_alpha, *exponent) * scale)
            }
            Self::Metal { conductor, alpha } => {
                if wi.z <= 0.0 || wo.z <= 0.0 {
                    return Vec3::ZERO;
                }
                let Some(h) = (wo + wi).try_normalize() else { return Vec3::ZERO };
                let ggx = Ggx { alpha: *alpha };
                metal_reflectance(wo.dot(h), conductor)
                    * (ggx.density(h) * ggx.both_seen(wo, wi) / (4.0 * wo.z))
            }
            Self::Glass { eta, alpha, let_through } => {
                let factor = if wi.z < 0.0 { *let_through } else { Vec3::ONE };
                factor * glass(*eta, Ggx { alpha: *alpha }, local).value
            }
        }
    }

    pub(super) fn pdf(&self, local: &Local) -> f32 {
        let Local { wo, wi } = *local;
        match self {
            Self::Lambert { .. } => wi.z.max(0.0) / PI,
            Self::Highlight { exponent, .. } => {
                let cos_alpha = mirrored(wo).dot(wi).max(0.0);
                if wi.z <= 0.0 {
                    0.0
                } else {
                    (exponent + 1.0) / (2.0 * PI) * libm::powf(cos_alpha, *exponent)
                }
            }
            Self::Metal { alpha, .. } => {
                let ggx = Ggx { alpha: *alpha };
                match (wo + wi).try_normalize() {
                    Some(h) if wi.z > 0.0 && wo.z > 0.0 => ggx.visible_density(wo, h) / (4.0 * wo.dot(h)),
                    Some(_) | None => 0.0,
                }
            }
            Self::Glass { eta, alpha, .. } => glass(*eta, Ggx { alpha: *alpha }, local).pdf,
        }
    }

    /// Draws where the light comes from; `choice` tells a facet's reflection from its refraction.
    pub(super) fn sample(&self, wo: Vec3, u: Vec2, choice: f32) -> Option<Vec3> {
        match self {
            Self::Lambert { .. } => Some(cosine_hemisphere(Vec3::Z, u)),
            Self::Highlight { exponent, .. } => {
                let axis = mirrored(wo);
                let cosine = libm::powf(1.0 - u.x, 1.0 / (exponent + 1.0));
                let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
                let (x, y) = axis.any_orthonormal_pair();
                let angle = 2.0 * PI * u.y;
                let wi = x * (sine * libm::cosf(angle)) + y * (sine * libm::sinf(angle)) + axis * cosine;
                (wi.z > 0.0).then_some(wi)
            }
            Self::Metal { alpha, .. } => {
                let h = Ggx { alpha: *alpha }.sample_visible(wo, u);
                let wi = reflect(-wo, h);
                (wi.z > 0.0).then_some(wi)
            }
            Self::Glass { eta, alpha, .. } => {
                let h = Ggx { alpha: *alpha }.sample_visible(wo, u);
                let reflectance = fresnel(wo.dot(h), *eta);
                let wi = if choice < reflectance { reflect(-wo, h) } else { refract(-wo, h, *eta)? };
                ((choice < reflectance) == (wi.z > 0.0)).then_some(wi)
            }
        }
    }
}

/// The direction to the viewer mirrored at the normal.
fn mirrored(wo: Vec3) -> Vec3 {
    Vec3::new(-wo.x, -wo.y, wo.z)
}

/// Value and density of the microfacets of glass (Walter et al. 2007, equations 20 and 21), for radiance.
struct GlassValue {
    value: f32,
    pdf: f32,
}

fn glass(eta: f32, ggx: Ggx, local: &Local) -> GlassValue {
    const NOTHING: GlassValue = GlassValue { value: 0.0, pdf: 0.0 };
    let Local { wo, wi } = *local;
    if wo.z <= 0.0 || wi.z == 0.0 {
        return NOTHING;
    }
    if wi.z > 0.0 {
        let Some(h) = (wo + wi).try_normalize() else { return NOTHING };
        let reflectance = fresnel(wo.dot(h), eta);
        let value = ggx.density(h) * ggx.both_seen(wo, wi) * reflectance / (4.0 * wo.z);
        return GlassValue { value, pdf: reflectance * ggx.visible_density(wo, h) / (4.0 * wo.dot(h)) };
    }
    let Some(h) = (wo * eta + wi).try_normalize() else { return NOTHING };
    let h = if h.z > 0.0 { h } else { -h };
    let (cos_o, cos_i) = (wo.dot(h), wi.dot(h));
    if cos_o <= 0.0 || cos_i >= 0.0 {
        return NOTHING;
    }
    let transmittance = 1.0 - fresnel(cos_o, eta);
    let squeeze = -cos_i / (eta * cos_o + cos_i).powi(2);
    let seen = ggx.seen(wo) * ggx.seen(wi);
    let value = cos_o * squeeze * eta * eta * transmittance * ggx.density(h) * seen / wo.z;
    GlassValue { value, pdf: transmittance * ggx.visible_density(wo, h) * squeeze }
}
