//! D: the GGX distribution of microfacets (Walter et al. 2007) with Smith's shadowing, in a frame whose z is the normal.

use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Microfacets of width parameter `alpha`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ggx {
    pub(super) alpha: f32,
}

impl Ggx {
    /// Facets per solid angle and area, facing `h`.
    pub(super) fn density(self, h: Vec3) -> f32 {
        if h.z <= 0.0 {
            return 0.0;
        }
        let a2 = self.alpha * self.alpha;
        // cos² (α² - 1) + 1 without cancellation near the normal.
        let t = (h.x * h.x + h.y * h.y) + a2 * h.z * h.z;
        a2 / (PI * t * t)
    }

    /// Λ of Smith (Heitz 2014, equation 72).
    fn lambda(self, w: Vec3) -> f32 {
        let tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z).max(f32::MIN_POSITIVE);
        0.5 * ((1.0 + self.alpha * self.alpha * tan2).sqrt() - 1.0)
    }

    /// Share of the facets' area that is seen from a direction.
    pub(super) fn seen(self, w: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(w))
    }

    /// Share that is seen from both, on one side: heights are correlated (Heitz 2014, equation 99).
    pub(super) fn both_seen(self, wo: Vec3, wi: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(wo) + self.lambda(wi))
    }

    /// Density of the facets that are seen from `wo`, per solid angle.
    pub(super) fn visible_density(self, wo: Vec3, h: Vec3) -> f32 {
        self.density(h) * self.seen(wo) * wo.dot(h).max(0.0) / wo.z.max(f32::MIN_POSITIVE)
    }

    /// Draws a facet in proportion to how it is seen from `wo` (Dupuy and Benyoub 2023).
    pub(super) fn sample_visible(self, wo: Vec3, u: Vec2) -> Vec3 {
        let stretched = Vec3::new(self.alpha * wo.x, self.alpha * wo.y, wo.z).normalize();
        let angle = 2.0 * PI * u.y;
        let z = (1.0 - u.x) * (1.0 + stretched.z) - stretched.z;
        let sine = (1.0 - z * z).clamp(0.0, 1.0).sqrt();
        let cap = Vec3::new(sine * libm::cosf(angle), sine * libm::sinf(angle), z);
        let h = cap + stretched;
        Vec3::new(self.alpha * h.x, self.alpha * h.y, h.z.max(0.0)).normalize_or(Vec3::Z)
    }
}
