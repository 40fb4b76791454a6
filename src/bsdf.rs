//! D: how a surface scatters light, as a sum of lobes. The eye sees photons that rest on it, and lights, by its values;
//! paths go on from it by its samples.

mod lobe;
mod microfacet;

use crate::geometry::SurfacePoint;
use crate::media::Media;
use crate::optics::Arrival;
use crate::sampling::cosine_hemisphere;
use crate::scene::Material;
use crate::spectrum::Line;
use arrayvec::ArrayVec;
use glam::{Vec2, Vec3};
use lobe::{Lobe, Local};
use std::f32::consts::PI;

/// Most lobes of one surface: a mix of two materials of two lobes each.
const MOST_LOBES: usize = 4;

/// Cosines of incidence below this count as this, where light per irradiance is asked for.
const LEAST_COSINE: f32 = 1e-4;

/// The D part of a surface, seen from one direction.
#[derive(Clone, Debug)]
pub struct Bsdf {
    /// Unit geometric normal on the side that is seen.
    pub geometric: Vec3,
    /// Unit interpolated normal on that side.
    pub shading: Vec3,
    tangents: [Vec3; 2],
    /// Direction to the viewer in the frame of the interpolated normal.
    viewer: Vec3,
    lobes: ArrayVec<Weighted, MOST_LOBES>,
    /// The albedo, if all lobes scatter evenly.
    albedo: Option<Vec3>,
    /// What the viewer is inside of, and what is on the other side.
    pub media: [Media; 2],
    transmits: bool,
    /// The wavelength that was picked, if light that is let through is taken apart.
    line: Option<Line>,
}

/// A lobe and how much of it there is.
#[derive(Clone, Copy, Debug)]
struct Weighted {
    lobe: Lobe,
    share: f32,
    /// Probability with which samples are drawn from it.
    chance: f32,
}

impl Weighted {
    fn albedo(&self) -> Option<Vec3> {
        match self.lobe {
            Lobe::Lambert { albedo } => Some(albedo * self.share),
            Lobe::Highlight { .. } | Lobe::Metal { .. } | Lobe::Glass { .. } => None,
        }
    }
}

/// A direction in which light is scattered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Unit direction away from the surface.
    pub direction: Vec3,
    /// BSDF times cosine, over the density.
    pub weight: Vec3,
    /// Probability density per solid angle with which the direction was drawn.
    pub pdf: f32,
    /// On the other side of the surface.
    pub transmitted: bool,
    /// The wavelength that light from there is of, μm, where the surface takes it apart; its weight is in `weight`.
    pub wavelength: Option<f32>,
}

impl Bsdf {
    /// The D part of the surface that a ray, coming backward from the eye, arrives at; `None` if it scatters nothing.
    /// `line` picks a wavelength where light of all is taken apart.
    #[must_use]
    pub fn new(arrival: &Arrival<'_>, line: impl Fn() -> Line) -> Option<Self> {
        let material = arrival.material;
        if !material.has_diffuse() {
            return None;
        }
        let mut bsdf = Self::bare(&arrival.hit.surface, arrival.direction, arrival.media);
        bsdf.add(material, 1.0, arrival, &line);
        let total: f32 = bsdf.lobes.iter().map(|l| l.chance).sum();
        if total <= 0.0 {
            return None;
        }
        bsdf.lobes.iter_mut().for_each(|l| l.chance /= total);
        bsdf.albedo = bsdf.lobes.iter().map(Weighted::albedo).sum();
        if bsdf.albedo.is_none() {
            bsdf.turn(-arrival.direction);
        }
        Some(bsdf)
    }

    fn bare(surface: &SurfacePoint, direction: Vec3, media: Media) -> Self {
        let sign = if direction.dot(surface.normal) > 0.0 { -1.0 } else { 1.0 };
        let geometric = surface.normal * sign;
        let shading = surface.shading_normal * sign;
        // A ray that comes from behind the interpolated surface sees the flat one.
        let shading = if direction.dot(shading) < 0.0 { shading } else { geometric };
        Self {
            geometric,
            shading,
            tangents: [Vec3::ZERO; 2],
            viewer: Vec3::ZERO,
            lobes: ArrayVec::new(),
            albedo: None,
            media: [media; 2],
            transmits: false,
            line: None,
        }
    }

    fn add(&mut self, material: &Material, share: f32, arrival: &Arrival<'_>, line: &impl Fn() -> Line) {
        let at = arrival.hit.surface.texture;
        match material {
            Material::Diffuse { albedo } => self.push(Lobe::Lambert { albedo: albedo.eval(at) }, share),
            Material::Mirror { .. }
            | Material::Metal { alpha: None, .. }
            | Material::Glass { alpha: None, .. } => {}
            Material::Metal { conductor, alpha: Some(alpha) } => {
                self.push(Lobe::Metal { conductor: *conductor, alpha: alpha.get() }, share);
            }
            Material::Glass { alpha: Some(alpha), .. } => {
                let known = arrival.interface(arrival.wavelength);
                if !known.hidden {
                    self.media = [known.before, known.after];
                    self.transmits = true;
                    self.line = (known.dispersive && arrival.wavelength.is_none()).then(line);
                    let eta = self.line.map_or(known.eta, |l| arrival.interface(Some(l.wavelength)).eta);
                    // What is reflected is not taken apart.
                    let let_through = self.line.map_or(Vec3::ONE, |line| line.weight);
                    self.push(Lobe::glass(eta, alpha.get(), let_through), share);
                }
            }
            Material::Phong(phong) => {
                self.push(Lobe::Lambert { albedo: phong.k_d.eval(at) }, share);
                let (k_s, exponent, form) = (phong.k_s, phong.exponent, phong.highlight);
                self.push(Lobe::Highlight { k_s, exponent, form }, share);
            }
            Material::Mix(mix) => {
                for (part, amount) in mix.shares(at) {
                    self.add(part, share * amount, arrival, line);
                }
            }
        }
    }

    fn push(&mut self, lobe: Lobe, share: f32) {
        let chance = share * lobe.strength();
        if chance > 0.0 {
            // A mix has two parts that are no mixes, so that there is room.
            let _ = self.lobes.try_push(Weighted { lobe, share, chance });
        }
    }

    /// Sets up the frame, which even scattering has no need of.
    fn turn(&mut self, to_viewer: Vec3) {
        let (x, y) = self.shading.any_orthonormal_pair();
        self.tangents = [x, y];
        self.viewer = Vec3::new(to_viewer.dot(x), to_viewer.dot(y), to_viewer.dot(self.shading));
    }

    /// The albedo of a surface that scatters evenly; `None` if it has other lobes.
    #[inline]
    #[must_use]
    pub fn albedo(&self) -> Option<Vec3> {
        self.albedo
    }

    /// Whether light from the other side comes through.
    #[inline]
    #[must_use]
    pub fn transmits(&self) -> bool {
        self.transmits
    }

    /// What fills the side of the surface that a direction leads to.
    #[inline]
    #[must_use]
    pub fn media_toward(&self, direction: Vec3) -> &Media {
        if direction.dot(self.geometric) >= 0.0 { &self.media[0] } else { &self.media[1] }
    }

    /// The direction in the surface's frame; `None` if the two normals disagree about its side.
    fn local(&self, incident: Vec3) -> Option<Local> {
        let wi = Vec3::new(
            incident.dot(self.tangents[0]),
            incident.dot(self.tangents[1]),
            incident.dot(self.shading),
        );
        let front = incident.dot(self.geometric) > 0.0;
        (front == (wi.z > 0.0)).then_some(Local { wo: self.viewer, wi })
    }

    /// BSDF times the cosine, for light that comes from a direction, sr⁻¹.
    #[must_use]
    pub fn eval(&self, incident: Vec3) -> Vec3 {
        if let Some(albedo) = self.albedo {
            let lit = incident.dot(self.geometric) > 0.0;
            return if lit { albedo * (incident.dot(self.shading).max(0.0) / PI) } else { Vec3::ZERO };
        }
        let Some(local) = self.local(incident) else { return Vec3::ZERO };
        self.lobes.iter().map(|l| l.lobe.eval(&local) * l.share).sum()
    }

    /// Radiance per irradiance, for light that comes from a direction.
    #[must_use]
    pub fn per_irradiance(&self, incident: Vec3) -> Vec3 {
        if let Some(albedo) = self.albedo {
            return albedo / PI;
        }
        self.eval(incident) / incident.dot(self.shading).abs().max(LEAST_COSINE)
    }

    /// The same, but nothing for light that arrives on a side from which it is not seen.
    #[must_use]
    pub fn per_irradiance_from(&self, incident: Vec3) -> Vec3 {
        let seen = self.transmits || incident.dot(self.geometric) > 0.0;
        if seen { self.per_irradiance(incident) } else { Vec3::ZERO }
    }

    /// Density per solid angle with which [`Bsdf::sample`] draws a direction.
    #[must_use]
    pub fn pdf(&self, incident: Vec3) -> f32 {
        if self.albedo.is_some() {
            return incident.dot(self.shading).max(0.0) / PI;
        }
        let Some(local) = self.local(incident) else { return 0.0 };
        self.lobes.iter().map(|l| l.lobe.pdf(&local) * l.chance).sum()
    }

    /// Draws a direction; `choice` picks the lobe.
    #[must_use]
    pub fn sample(&self, u: Vec2, choice: f32) -> Option<BsdfSample> {
        if self.albedo.is_some() {
            let direction = cosine_hemisphere(self.shading, u);
            return self.sampled(direction);
        }
        let mut left = choice;
        let (last, others) = self.lobes.split_last()?;
        let picked = others.iter().find(|l| {
            let here = left < l.chance;
            left -= if here { 0.0 } else { l.chance };
            here
        });
        let picked = picked.unwrap_or(last);
        let wi = picked.lobe.sample(self.viewer, u, left / picked.chance)?;
        let [x, y] = self.tangents;
        self.sampled((x * wi.x + y * wi.y + self.shading * wi.z).normalize())
    }

    fn sampled(&self, direction: Vec3) -> Option<BsdfSample> {
        let (value, pdf) = (self.eval(direction), self.pdf(direction));
        let transmitted = direction.dot(self.geometric) < 0.0;
        (pdf > 0.0 && value.max_element() > 0.0 && pdf.is_finite()).then(|| BsdfSample {
            direction,
            weight: value / pdf,
            pdf,
            transmitted,
            wavelength: self.line.filter(|_| transmitted).map(|line| line.wavelength),
        })
    }
}
