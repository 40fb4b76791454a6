//! Lights. Emission for pass 1 is in `pass1_light::emit`, sampling for pass 2 in `pass2_eye::direct`.

use glam::Vec3;

/// A source of light. Quantities are per channel.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Emits the same intensity in all directions from one point.
    Point {
        /// Where it is.
        position: Vec3,
        /// Radiant intensity, W·sr⁻¹.
        intensity: Vec3,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// Unit vector in which the light travels.
        direction: Vec3,
        /// Irradiance on a surface that faces the light, W·m⁻².
        irradiance: Vec3,
    },
    /// A one-sided rectangle of constant radiance.
    Quad(QuadLight),
}

/// A one-sided rectangle of constant radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct QuadLight {
    /// Centre.
    pub center: Vec3,
    /// From the centre to the middle of one edge; perpendicular to `half_v`.
    pub half_u: Vec3,
    /// From the centre to the middle of the next edge.
    pub half_v: Vec3,
    /// Unit normal of the side that emits.
    pub normal: Vec3,
    /// Radiance, W·sr⁻¹·m⁻².
    pub radiance: Vec3,
}

impl QuadLight {
    /// Area in m².
    #[must_use]
    pub fn area(&self) -> f32 {
        4.0 * self.half_u.length() * self.half_v.length()
    }

    /// The corners in order around the outline.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 4] {
        let (c, u, v) = (self.center, self.half_u, self.half_v);
        [c - u - v, c + u - v, c + u + v, c - u + v]
    }
}

impl Light {
    /// True if the light gives nothing.
    #[must_use]
    pub fn is_dark(&self) -> bool {
        let power = match self {
            Self::Point { intensity, .. } => *intensity,
            Self::Directional { irradiance, .. } => *irradiance,
            Self::Quad(quad) => quad.radiance * quad.area(),
        };
        power == Vec3::ZERO
    }
}
