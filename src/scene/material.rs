//! Materials: what a surface does to light, and whether that is a D or an S of the path notation.
//!
//! A material may be both: what scatters, where photons can rest, is its D part; what mirrors and refracts its S
//! part.

use super::Texture;
use crate::geometry::TextureCoordinates;
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
    /// Metal; reflects on both sides and takes up what it does not reflect.
    Metal {
        /// How its reflectance is known.
        conductor: Conductor,
        /// Width of the GGX distribution of its microfacets; `None` is smooth.
        alpha: Option<Alpha>,
    },
    /// Dielectric with Fresnel reflection and refraction.
    Glass {
        /// What is on the inner side (the side the normal points away from).
        dielectric: Dielectric,
        /// Width of the GGX distribution of its microfacets; `None` is smooth.
        alpha: Option<Alpha>,
    },
    /// The lecture's illumination equation, term by term.
    Phong(Box<Phong>),
    /// So much of one material, and the rest of another.
    Mix(Box<Mix>),
}

/// Width parameter of the GGX distribution (Walter et al. 2007): the square of the scene file's roughness. Above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alpha(f32);

impl Alpha {
    /// Below this the distribution's peak is no longer a float's.
    const LEAST: f32 = 1e-4;

    /// The width for a roughness of 0..1; `None` for a smooth surface.
    #[must_use]
    pub fn of_roughness(roughness: f32) -> Option<Self> {
        (roughness > 0.0).then(|| Self((roughness * roughness).clamp(Self::LEAST, 1.0)))
    }

    /// The width.
    #[inline]
    #[must_use]
    pub fn get(self) -> f32 {
        self.0
    }
}

/// What light can be inside of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction.
    pub ior: Ior,
    /// Absorption coefficient, m⁻¹: light falls to 1/e over its reciprocal.
    pub absorption: Vec3,
    /// Where several overlap, that of the highest priority is what is there; among equals the one entered last.
    pub priority: i32,
}

/// Index of refraction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ior {
    /// The same for all wavelengths.
    Constant(f32),
    /// Cauchy's equation: n = a + b / λ² + c / λ⁴, λ in μm.
    Cauchy([f32; 3]),
}

/// Wavelengths of Fraunhofer's lines C, d and F, μm.
pub const FRAUNHOFER: [f32; 3] = [0.656_281, 0.587_562, 0.486_134];

impl Ior {
    /// The first two terms of Cauchy's equation from the index at the d line and the Abbe number
    /// V = (n_d - 1) / (n_F - n_C).
    #[must_use]
    pub fn of_abbe(n_d: f64, abbe: f64) -> Self {
        let [c, d, f] = FRAUNHOFER.map(|line| 1.0 / f64::from(line).powi(2));
        let b = (n_d - 1.0) / (abbe * (f - c));
        Self::Cauchy([(n_d - b * d) as f32, b as f32, 0.0])
    }

    /// The index at a wavelength in μm; at the d line for light of all wavelengths.
    #[inline]
    #[must_use]
    pub fn at(self, wavelength: Option<f32>) -> f32 {
        match self {
            Self::Constant(n) => n,
            Self::Cauchy([a, b, c]) => {
                let inverse = wavelength.unwrap_or(FRAUNHOFER[1]).powi(2).recip();
                a + inverse * (b + inverse * c)
            }
        }
    }

    /// Whether it depends on the wavelength.
    #[inline]
    #[must_use]
    pub fn is_dispersive(self) -> bool {
        match self {
            Self::Constant(_) => false,
            Self::Cauchy([_, b, c]) => b != 0.0 || c != 0.0,
        }
    }
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

/// The illumination equation of the lecture (Phong 1975, with Whitted's terms): emission + ambient + for each light
/// (k_d cos θ + k_s cosⁿ α) + k_r reflection + k_t transmission, where α is the angle to the mirrored direction.
/// The two terms of lights are divided by π, so that k_d is the albedo of a Lambertian surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Phong {
    /// Radiance of its own, W·sr⁻¹·m⁻²; seen, but not thrown on others.
    pub emission: Vec3,
    /// k_a times the ambient light, W·sr⁻¹·m⁻².
    pub ambient: Vec3,
    /// Share scattered evenly.
    pub k_d: Texture,
    /// Share of the highlight.
    pub k_s: Vec3,
    /// n: sharpness of the highlight.
    pub exponent: f32,
    /// Form of the highlight.
    pub highlight: Highlight,
    /// Share mirrored.
    pub k_r: Vec3,
    /// Share let through.
    pub k_t: Vec3,
    /// What is on the inner side.
    pub dielectric: Dielectric,
}

/// Form of Phong's highlight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Highlight {
    /// The lecture's `k_s cosⁿ α`, not weighted by the cosine of incidence: a surface lit at a slant can reflect more
    /// than it receives, by up to 2 k_s / ((n + 2) cos θ).
    #[default]
    Lecture,
    /// `k_s (n + 2)/2 cosⁿ α cos θ`: never more than the share k_s (Lafortune and Willems 1994).
    Conserving,
}

impl Highlight {
    /// Every value and its name.
    pub const NAMED: [(&str, Self); 2] = [("lecture", Self::Lecture), ("conserving", Self::Conserving)];
}

/// So much of one material, and the rest of another.
#[derive(Clone, Debug, PartialEq)]
pub struct Mix {
    /// The two materials; neither is a mix.
    pub parts: [Material; 2],
    /// Share of the second: the mean of the channels.
    pub amount: Texture,
}

impl Mix {
    /// Both parts with their shares at a surface point.
    #[inline]
    #[must_use]
    pub fn shares(&self, at: TextureCoordinates) -> [(&Material, f32); 2] {
        let amount = (self.amount.eval(at).element_sum() / 3.0).clamp(0.0, 1.0);
        [(&self.parts[0], 1.0 - amount), (&self.parts[1], amount)]
    }
}

impl Material {
    /// Whether any of the light is mirrored or refracted: a path that meets it may meet an S.
    #[must_use]
    pub fn has_specular(&self) -> bool {
        match self {
            Self::Diffuse { .. } => false,
            Self::Mirror { .. } => true,
            Self::Metal { alpha, .. } | Self::Glass { alpha, .. } => alpha.is_none(),
            Self::Phong(phong) => phong.k_r != Vec3::ZERO || phong.k_t != Vec3::ZERO,
            Self::Mix(mix) => mix.parts.iter().any(Self::has_specular),
        }
    }

    /// Whether a photon may rest here and be seen: a path that meets it may meet a D.
    #[must_use]
    pub fn has_diffuse(&self) -> bool {
        match self {
            Self::Diffuse { albedo } => !albedo.is_black(),
            Self::Mirror { .. } => false,
            Self::Metal { alpha, .. } | Self::Glass { alpha, .. } => alpha.is_some(),
            Self::Phong(phong) => !phong.k_d.is_black() || phong.k_s != Vec3::ZERO,
            Self::Mix(mix) => mix.parts.iter().any(Self::has_diffuse),
        }
    }

    /// Whether all that it scatters is scattered evenly: its radiance then depends on its irradiance alone.
    #[must_use]
    pub fn is_lambertian(&self) -> bool {
        match self {
            Self::Diffuse { .. } | Self::Mirror { .. } => true,
            Self::Metal { alpha, .. } | Self::Glass { alpha, .. } => alpha.is_none(),
            Self::Phong(phong) => phong.k_s == Vec3::ZERO,
            Self::Mix(mix) => mix.parts.iter().all(Self::is_lambertian),
        }
    }

    /// What is on the inner side, if light can go there.
    #[inline]
    #[must_use]
    pub fn dielectric(&self) -> Option<&Dielectric> {
        match self {
            Self::Diffuse { .. } | Self::Mirror { .. } | Self::Metal { .. } => None,
            Self::Glass { dielectric, .. } => Some(dielectric),
            Self::Phong(phong) => (phong.k_t != Vec3::ZERO).then_some(&phong.dielectric),
            Self::Mix(mix) => mix.parts.iter().find_map(Self::dielectric),
        }
    }

    /// Whether the eye sees it without any light.
    #[must_use]
    pub fn glows(&self) -> bool {
        match self {
            Self::Diffuse { .. } | Self::Mirror { .. } | Self::Metal { .. } | Self::Glass { .. } => false,
            Self::Phong(phong) => phong.emission + phong.ambient != Vec3::ZERO,
            Self::Mix(mix) => mix.parts.iter().any(Self::glows),
        }
    }

    /// What the eye sees of it without any light: emission and ambient light of the Phong model.
    #[must_use]
    pub fn glow(&self, at: TextureCoordinates) -> Vec3 {
        match self {
            Self::Diffuse { .. } | Self::Mirror { .. } | Self::Metal { .. } | Self::Glass { .. } => {
                Vec3::ZERO
            }
            Self::Phong(phong) => phong.emission + phong.ambient,
            Self::Mix(mix) => mix.shares(at).into_iter().map(|(part, share)| part.glow(at) * share).sum(),
        }
    }
}
