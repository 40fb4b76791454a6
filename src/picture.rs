//! The picture: the film with its caustics smoothed, in layers, and how far it may be from the truth.

use crate::film::{Film, PixelSums};
use crate::image_io::LinearImage;
use crate::light_path::PathClass;
use crate::smooth::{Smoothing, smooth};
use glam::Vec3;

/// A film with the smoothing of its caustics.
pub struct Picture<'a> {
    film: &'a Film,
    smoothing: Option<Smoothing>,
}

impl<'a> Picture<'a> {
    /// Smooths the film's caustics.
    #[must_use]
    pub fn new(film: &'a Film) -> Self {
        Self { film, smoothing: smooth(film) }
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
            PathClass::Emitted | PathClass::Direct => layer,
        }
    }

    fn corrected(&self, mut image: LinearImage) -> LinearImage {
        if let Some(smoothing) = &self.smoothing {
            for (pixel, correction) in image.pixels.iter_mut().zip(&smoothing.correction) {
                *pixel = (Vec3::from_array(*pixel) + *correction).to_array();
            }
        }
        image
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
        let image = self.image();
        let count = image.pixels.len() as f64;
        let mean = image.pixels.iter().map(|p| mean_channel(*p)).sum::<f64>() / count;
        if mean == 0.0 {
            return Some(0.0);
        }
        let floor = (0.1 * mean).powi(2);
        let relative = |(i, pixel): (usize, &PixelSums)| {
            let value = Vec3::from_array(image.pixels[i]).as_dvec3();
            let square = self.squared_error(i, pixel).as_dvec3();
            (square / (value * value + floor)).element_sum() / 3.0
        };
        let sum: f64 = self.film.pixels().iter().enumerate().map(relative).sum();
        Some((sum / count).sqrt() as f32)
    }

    /// Estimated squared error of a pixel per channel.
    fn squared_error(&self, index: usize, pixel: &PixelSums) -> Vec3 {
        let scale = self.film.mean_scale();
        let [a, b] = &pixel.halves;
        let mut difference = (a.classes.total() - b.classes.total()) * scale;
        let smoothed = self.smoothing.as_ref().and_then(|s| s.squared_error[index]);
        if smoothed.is_some() {
            difference -= pixel.guide.gain * scale * 0.5 * (a.mean_irradiance() - b.mean_irradiance());
        }
        difference * difference + Vec3::splat(smoothed.unwrap_or(0.0))
    }
}

/// Mean of a pixel's channels.
fn mean_channel(pixel: [f32; 3]) -> f64 {
    pixel.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0
}
