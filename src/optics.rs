//! S: what mirrors, smooth metal and glass do to a ray, in either direction of travel.

mod fresnel;

pub use fresnel::{fresnel, fresnel_conductor, metal_reflectance, reflect, refract, transmittance};

use crate::geometry::{Hit, Ray, SurfacePoint, offset_origin};
use crate::media::{Crossed, Interface, Media};
use crate::scene::{Material, MaterialId, Scene};
use crate::spectrum::Line;
use arrayvec::ArrayVec;
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
    /// What the ray is inside of from here.
    pub media: Media,
    /// Its wavelength from here, μm, if it has one; the weight for its choice is in `fraction`.
    pub wavelength: Option<f32>,
}

impl Outcome {
    /// Appends this way to a key that holds one bit per S after a leading 1.
    #[inline]
    #[must_use]
    pub fn extend_key(&self, key: u64) -> u64 {
        key << 1 | u64::from(self.event == Event::Refraction)
    }
}

/// All ways a ray can leave a surface's S part; what is missing of their fractions is absorbed, or the D part's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Interaction {
    /// Reflected part.
    pub reflected: Option<Outcome>,
    /// Refracted part; none in total internal reflection.
    pub refracted: Option<Outcome>,
}

/// A ray that arrives at a surface.
#[derive(Clone, Copy)]
pub struct Arrival<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Where it arrives.
    pub hit: &'a Hit,
    /// What the surface is made of.
    pub material: &'a Material,
    /// Unit direction in which it travels.
    pub direction: Vec3,
    /// What it has come through.
    pub media: Media,
    /// Its wavelength, μm; `None` is light of all wavelengths.
    pub wavelength: Option<f32>,
    /// Another dielectric's surface in the same place, to the precision of the hits.
    touching: Option<Crossed>,
    /// Bound on how far each coordinate of the point is from the true surfaces.
    error: f32,
}

impl<'a> Arrival<'a> {
    /// Corrects what the ray is known to have come through by the side on which it arrives.
    #[must_use]
    pub fn new(scene: &'a Scene, ray: &Ray, hit: &'a Hit, known: Media, wavelength: Option<f32>) -> Self {
        let (direction, error) = (ray.direction, hit.surface.error);
        let material = scene.material_of(hit.object);
        let mut arrival =
            Self { scene, hit, material, direction, media: known, wavelength, touching: None, error };
        if material.dielectric().is_some() {
            arrival.touch(ray);
            arrival.media = arrival.surfaces().into_iter().fold(known, Media::arriving);
        }
        arrival
    }

    /// Looks for the surface of another dielectric in the same place.
    fn touch(&mut self, ray: &Ray) {
        let (scene, surface) = (self.scene, &self.hit.surface);
        let slant = self.direction.dot(surface.normal).abs().max(1e-3);
        for other in &scene.touching {
            let material = scene.objects[other.object.index()].material;
            if other.object == self.hit.object || material == self.material_id() {
                continue;
            }
            let Some(hit) = other.geometry.closest_hit(ray) else { continue };
            let apart = (hit.t - self.hit.t).abs();
            let rounding = surface.error + hit.surface.error;
            if apart * slant <= 2.0 * rounding {
                let leaving = self.direction.dot(hit.surface.normal) > 0.0;
                self.touching = Some(Crossed { material, leaving });
                self.error = rounding + apart;
                return;
            }
        }
    }

    fn material_id(&self) -> MaterialId {
        self.scene.objects[self.hit.object.index()].material
    }

    fn leaves(&self) -> bool {
        self.direction.dot(self.hit.surface.normal) > 0.0
    }

    /// Where a ray in a direction sets out: off the surface, and off what touches it.
    #[inline]
    #[must_use]
    pub fn origin_toward(&self, direction: Vec3) -> Vec3 {
        offset_origin(self.hit.surface.point, self.error, self.hit.surface.normal, direction)
    }

    /// What the surface's S part does to the ray. `line` picks a wavelength where light of all is taken apart.
    #[must_use]
    pub fn interact(&self, line: impl Fn() -> Line) -> Interaction {
        let mut interaction = self.part(self.material, &line);
        for outcome in [&mut interaction.reflected, &mut interaction.refracted].into_iter().flatten() {
            outcome.wavelength = outcome.wavelength.or(self.wavelength);
        }
        interaction
    }

    fn part(&self, material: &Material, line: &impl Fn() -> Line) -> Interaction {
        match material {
            Material::Diffuse { .. } => Interaction::default(),
            Material::Mirror { reflectance } => self.mirror(*reflectance),
            Material::Metal { alpha: Some(_), .. } => Interaction::default(),
            Material::Metal { conductor, alpha: None } => {
                let cos_i = -Frame::new(self.direction, &self.hit.surface).shading.dot(self.direction);
                self.mirror(metal_reflectance(cos_i, conductor))
            }
            Material::Glass { alpha, .. } => self.glass(alpha.is_some(), line),
            Material::Phong(phong) => self.lecture(phong.k_r, phong.k_t, line),
            Material::Mix(mix) => {
                let [a, b] = mix.shares(self.hit.surface.texture);
                self.part(a.0, line).times(a.1).and(self.part(b.0, line).times(b.1))
            }
        }
    }

    fn mirror(&self, reflectance: Vec3) -> Interaction {
        let frame = Frame::new(self.direction, &self.hit.surface);
        let outcome = frame.reflected(self.direction, reflectance);
        Interaction { reflected: Some(Outcome { media: self.media, ..outcome }), refracted: None }
    }

    /// Fresnel's shares; of a rough surface only what something of a higher priority hides, which is passed.
    fn glass(&self, rough: bool, line: &impl Fn() -> Line) -> Interaction {
        let crossing = self.crossing(line);
        if crossing.hidden || !rough { crossing.by_fresnel(self) } else { Interaction::default() }
    }

    /// The lecture's k_r and k_t, which do not depend on the angle.
    fn lecture(&self, k_r: Vec3, k_t: Vec3, line: &impl Fn() -> Line) -> Interaction {
        if k_t == Vec3::ZERO {
            return if k_r == Vec3::ZERO { Interaction::default() } else { self.mirror(k_r) };
        }
        let crossing = self.crossing(line);
        if crossing.hidden {
            return crossing.by_fresnel(self);
        }
        match crossing.refracted(self, &Frame::new(self.direction, &self.hit.surface)) {
            Some(through) => {
                let refracted = Outcome { fraction: k_t * through.fraction, ..through };
                let reflected = (k_r != Vec3::ZERO).then(|| self.mirror(k_r).reflected).flatten();
                Interaction { reflected, refracted: Some(refracted) }
            }
            None => self.mirror(k_r + k_t),
        }
    }

    /// The surface as one between two media, for light of a wavelength in μm.
    #[must_use]
    pub fn interface(&self, wavelength: Option<f32>) -> Interface {
        self.media.interface(self.scene, &self.surfaces(), wavelength)
    }

    /// The dielectrics' surfaces that lie here, in an order that does not depend on which of them was found first.
    #[inline]
    fn surfaces(&self) -> ArrayVec<Crossed, 2> {
        let own = Crossed { material: self.material_id(), leaving: self.leaves() };
        let mut surfaces: ArrayVec<Crossed, 2> = std::iter::once(own).chain(self.touching).collect();
        surfaces.sort_unstable_by_key(|surface| surface.material);
        surfaces
    }

    fn crossing(&self, line: &impl Fn() -> Line) -> Crossing {
        let known = self.interface(self.wavelength);
        let line = (known.dispersive && !known.hidden && self.wavelength.is_none()).then(line);
        let eta = line.map_or(known.eta, |line| self.interface(Some(line.wavelength)).eta);
        Crossing { after: known.after, hidden: known.hidden, mean_eta: known.eta, eta, line }
    }
}

/// The surface between two media, for one ray.
struct Crossing {
    after: Media,
    hidden: bool,
    /// n_i/n_t for the share that is reflected, which is not taken apart.
    mean_eta: f32,
    /// n_i/n_t for the direction of what is refracted.
    eta: f32,
    /// The wavelength that was picked, if light was taken apart.
    line: Option<Line>,
}

impl Crossing {
    /// Smooth glass; a hidden surface lets all through.
    fn by_fresnel(&self, arrival: &Arrival<'_>) -> Interaction {
        if self.hidden {
            let straight = Outcome::through(arrival.direction);
            return Interaction {
                reflected: None,
                refracted: Some(Outcome { media: self.after, ..straight }),
            };
        }
        let frame = Frame::new(arrival.direction, &arrival.hit.surface);
        let reflectance = fresnel(-frame.shading.dot(arrival.direction), self.mean_eta);
        let refracted = self.refracted(arrival, &frame).map(|mut outcome| {
            outcome.fraction *= 1.0 - reflectance;
            outcome
        });
        let reflectance = if refracted.is_none() { 1.0 } else { reflectance };
        let reflected = (reflectance > 0.0).then(|| {
            let outcome = frame.reflected(arrival.direction, Vec3::splat(reflectance));
            Outcome { media: arrival.media, ..outcome }
        });
        Interaction { reflected, refracted }
    }

    /// All of the light, let through; `None` in total internal reflection.
    fn refracted(&self, arrival: &Arrival<'_>, frame: &Frame) -> Option<Outcome> {
        let outcome = frame.refracted(arrival.direction, self.eta)?;
        let fraction = self.line.map_or(Vec3::ONE, |line| line.weight);
        let wavelength = self.line.map(|line| line.wavelength);
        Some(Outcome { fraction, media: self.after, wavelength, ..outcome })
    }
}

impl Interaction {
    fn times(mut self, share: f32) -> Self {
        for outcome in [&mut self.reflected, &mut self.refracted].into_iter().flatten() {
            outcome.fraction *= share;
        }
        let some = |o: &Outcome| o.fraction != Vec3::ZERO;
        Self { reflected: self.reflected.filter(some), refracted: self.refracted.filter(some) }
    }

    /// Both together. Reflections leave in the same direction; no mix has two materials that refract.
    fn and(self, other: Self) -> Self {
        let reflected = match (self.reflected, other.reflected) {
            (Some(a), Some(b)) => Some(Outcome { fraction: a.fraction + b.fraction, ..a }),
            (a, b) => a.or(b),
        };
        Self { reflected, refracted: self.refracted.or(other.refracted) }
    }

    /// Share of the light that takes any of the ways.
    #[must_use]
    pub fn share(&self) -> Vec3 {
        [self.reflected, self.refracted].into_iter().flatten().map(|o| o.fraction).sum()
    }
}

impl Outcome {
    /// All light, as if there were no surface.
    fn through(direction: Vec3) -> Self {
        Self {
            direction,
            fraction: Vec3::ONE,
            event: Event::Refraction,
            radiance_scale: 1.0,
            flux_scale: 1.0,
            media: Media::default(),
            wavelength: None,
        }
    }
}

/// The two normals turned to the side a ray comes from.
struct Frame {
    geometric: Vec3,
    shading: Vec3,
}

impl Frame {
    fn new(direction: Vec3, surface: &SurfacePoint) -> Self {
        let from_outside = direction.dot(surface.normal) < 0.0;
        let sign = if from_outside { 1.0 } else { -1.0 };
        let geometric = surface.normal * sign;
        let shading = surface.shading_normal * sign;
        // A ray that comes from behind the interpolated surface sees the flat one.
        let shading = if direction.dot(shading) < 0.0 { shading } else { geometric };
        Self { geometric, shading }
    }

    fn reflected(&self, direction: Vec3, fraction: Vec3) -> Outcome {
        let mut out = reflect(direction, self.shading);
        let mut flux_scale = self.flux_scale(direction, out);
        if out.dot(self.geometric) <= 0.0 {
            out = reflect(direction, self.geometric);
            flux_scale = 1.0;
        }
        Outcome { fraction, event: Event::Reflection, flux_scale, ..Outcome::through(out.normalize()) }
    }

    fn refracted(&self, direction: Vec3, eta: f32) -> Option<Outcome> {
        let mut out = if eta == 1.0 { direction } else { refract(direction, self.shading, eta)? };
        let mut flux_scale = if eta == 1.0 { 1.0 } else { self.flux_scale(direction, out) };
        if out.dot(self.geometric) >= 0.0 {
            out = refract(direction, self.geometric, eta)?;
            flux_scale = 1.0;
        }
        Some(Outcome { radiance_scale: eta * eta, flux_scale, ..Outcome::through(out) })
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

/// Factor on the flux of a photon that comes to rest on a surface of interpolated normals, so that its irradiance is
/// that of the smooth surface: |in·s| / |in·g| (Veach 1997, 5.3), 0 where it comes from behind that surface.
#[inline]
#[must_use]
pub fn resting_scale(direction: Vec3, surface: &SurfacePoint) -> f32 {
    if surface.shading_normal == surface.normal {
        return 1.0;
    }
    let quotient = direction.dot(surface.shading_normal) / direction.dot(surface.normal);
    // As above, ten is beyond any tessellation that means a smooth surface; NaN becomes 0.
    if quotient > 0.0 { quotient.min(10.0) } else { 0.0 }
}
