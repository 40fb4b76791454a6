//! The picture: the film with its caustics smoothed, in layers, and how far it may be from the truth.

use crate::film::{Film, PixelMeans};
use crate::image_io::LinearImage;
use crate::light_path::PathClass;
use crate::pass2_eye::Footprints;
use crate::plan::Layer;
use crate::scene::Caustics;
use crate::smooth::{Smoothing, smooth, smooth_part};
use glam::Vec3;
use std::borrow::Cow;

/// A film with the smoothing of its caustics.
pub struct Picture<'a> {
    film: &'a Film,
    footprints: &'a Footprints,
    smoothing: Option<Cow<'a, Smoothing>>,
}

impl<'a> Picture<'a> {
    /// Smooths the film's caustics.
    #[must_use]
    pub fn new(film: &'a Film, footprints: &'a Footprints) -> Self {
        Self { film, footprints, smoothing: smooth(film, footprints).map(Cow::Owned) }
    }

    /// A picture whose smoothing is known.
    #[must_use]
    pub fn with_smoothing(
        film: &'a Film,
        footprints: &'a Footprints,
        smoothing: Option<&'a Smoothing>,
    ) -> Self {
        Self { film, footprints, smoothing: smoothing.map(Cow::Borrowed) }
    }

    /// The smoothing, to keep.
    #[must_use]
    pub fn into_smoothing(self) -> Option<Smoothing> {
        self.smoothing.map(Cow::into_owned)
    }

    /// All classes together.
    #[must_use]
    pub fn image(&self) -> LinearImage {
        self.corrected(self.film.raw_image())
    }

    /// One class; the layers add up to the image.
    #[must_use]
    pub fn layer(&self, class: PathClass) -> LinearImage {
        let layer = self.film.raw_layer(class);
        match class {
            PathClass::Caustic => self.corrected(layer),
            PathClass::Emitted | PathClass::Direct | PathClass::Indirect => layer,
        }
    }

    /// A layer: a class, or a named one.
    #[must_use]
    pub fn part(&self, layer: &Layer) -> LinearImage {
        match layer {
            Layer::Class(class) => self.layer(*class),
            Layer::Named { index, .. } => self.named_layer(*index),
        }
    }

    /// A named layer, its part of the caustics smoothed as the whole is.
    fn named_layer(&self, index: usize) -> LinearImage {
        let layer = self.film.named_layer(index);
        let Some(smoothing) = &self.smoothing else { return layer };
        let irradiance = self.film.layer_irradiance(index);
        add(layer, &smooth_part(self.film, self.footprints, smoothing, &irradiance))
    }

    fn corrected(&self, image: LinearImage) -> LinearImage {
        match &self.smoothing {
            Some(smoothing) => add(image, &smoothing.correction),
            None => image,
        }
    }

    /// Estimated relative error of the image: the root of the mean over pixels and channels of
    /// (σ² + b²) / (L² + (0.1 L_mean)²). For what is sampled, σ² = (A - B)²/4 is the unbiased estimate of the
    /// mean's variance from its two independent halves; for smoothed caustics the estimate that chose the
    /// width, which holds the blur too. `None` before the first round.
    #[must_use]
    pub fn error_estimate(&self) -> Option<f32> {
        if self.film.rounds() == 0 {
            return None;
        }
        Some(PixelError::root_mean(&self.errors()))
    }

    /// Estimated relative squared error of every pixel, by what makes it.
    #[must_use]
    pub fn errors(&self) -> Vec<PixelError> {
        let image = self.image();
        let mean = image.pixels.iter().map(|p| mean_channel(Vec3::from_array(*p))).sum::<f32>();
        let floor = 0.1 * mean / image.pixels.len() as f32;
        let pixels = self.film.means().zip(&image.pixels).enumerate();
        pixels.map(|(i, (means, value))| self.error(i, &means, Vec3::from_array(*value), floor)).collect()
    }

    fn error(&self, index: usize, means: &PixelMeans, value: Vec3, floor: f32) -> PixelError {
        let scale = value * value + floor * floor;
        if scale.min_element() <= 0.0 {
            return PixelError::default();
        }
        let half = |class| 0.5 * (means.halves[0].get(class) - means.halves[1].get(class));
        let mut sampled = half(PathClass::Emitted) + half(PathClass::Direct) + half(PathClass::Indirect);
        let mut photons = half(PathClass::Caustic);
        if self.film.caustics() == Caustics::Backward {
            sampled += std::mem::take(&mut photons);
        }
        let smoothed = self.smoothing.as_ref().and_then(|s| s.squared_error[index]);
        if smoothed.is_some() {
            photons -= means.gain * 0.5 * (means.irradiance[0] - means.irradiance[1]);
        }
        let photons = photons * photons + Vec3::splat(smoothed.unwrap_or(0.0));
        PixelError {
            sampled: mean_channel(sampled * sampled / scale),
            photons: mean_channel(photons / scale),
        }
    }
}

/// Estimated squared error of a pixel, relative to its squared radiance; mean over channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelError {
    /// Of what eye samples bring: emitted and direct light.
    pub sampled: f32,
    /// Of what photons bring.
    pub photons: f32,
}

impl PixelError {
    /// Root of the mean over pixels.
    #[must_use]
    pub fn root_mean(errors: &[Self]) -> f32 {
        let sum: f64 = errors.iter().map(|e| f64::from(e.sampled + e.photons)).sum();
        (sum / errors.len().max(1) as f64).sqrt() as f32
    }
}

fn add(mut image: LinearImage, correction: &[Vec3]) -> LinearImage {
    for (pixel, correction) in image.pixels.iter_mut().zip(correction) {
        *pixel = (Vec3::from_array(*pixel) + *correction).to_array();
    }
    image
}

fn mean_channel(v: Vec3) -> f32 {
    v.element_sum() / 3.0
}
