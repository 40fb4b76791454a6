//! Materials: what a surface does to light, and whether that is a D or an S of the path notation.

use super::Texture;
use crate::light_path::Bounce;
use glam::Vec3;

/// What a surface is made of.
#[derive(Clone, Debug, PartialEq)]
pub enum Material {
    /// Lambertian reflection, BRDF = albedo / π.
    Diffuse {
        /// Fraction of light reflected, per channel, 0..1.
        albedo: Texture,
    },
    /// Perfect mirror; reflects the same fraction at every angle, on both sides.
    Mirror {
        /// Fraction of light reflected, per channel, 0..1.
        reflectance: Vec3,
    },
    /// Smooth metal; reflects on both sides and takes up what it does not reflect.
    Metal(Conductor),
    /// Smooth dielectric with Fresnel reflection and refraction.
    Glass {
        /// Index of refraction on the inner side (the side the normal points away from); 1 outside.
        ior: f32,
        /// Absorption coefficient on the inner side, m⁻¹: light falls to 1/e over its reciprocal.
        absorption: Vec3,
    },
}

/// How a metal's reflectance is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Conductor {
    /// From the reflectance at normal incidence, by Schlick's approximation.
    Normal(Vec3),
    /// From the complex index of refraction n + ik, by Fresnel's equations.
    Complex {
        /// Real part, per channel.
        n: Vec3,
        /// Imaginary part, per channel.
        k: Vec3,
    },
}

impl Material {
    /// Whether a path that meets this surface has met a D or an S.
    #[must_use]
    pub fn bounce(&self) -> Bounce {
        match self {
            Self::Diffuse { .. } => Bounce::Diffuse,
            Self::Mirror { .. } | Self::Metal(_) | Self::Glass { .. } => Bounce::Specular,
        }
    }
}
