//! The picture: the film with its caustics and its indirect light smoothed, in layers, and how far it may be from the truth.

use crate::film::{Film, PixelMeans};
use crate::image_io::LinearImage;
use crate::light_path::PathClass;
use crate::pass2_eye::Footprints;
use crate::plan::Layer;
use crate::scene::Caustics;
use crate::smooth::{Gathered, Smoothed, Smoothing, smooth, smooth_part};
use glam::Vec3;
use rayon::prelude::*;
use std::borrow::Cow;

/// A film with its smoothing.
pub struct Picture<'a> {
    film: &'a Film,
    footprints: &'a Footprints,
    smoothing: Cow<'a, Smoothing>,
}

impl<'a> Picture<'a> {
    /// Smooths the film.
    #[must_use]
    pub fn new(film: &'a Film, footprints: &'a Footprints) -> Self {
        Self { film, footprints, smoothing: Cow::Owned(smooth(film, footprints)) }
    }

    /// The film as it was gathered.
    #[must_use]
    pub fn unsmoothed(film: &'a Film, footprints: &'a Footprints) -> Self {
        Self { film, footprints, smoothing: Cow::Owned(Smoothing::default()) }
    }

    /// A picture whose smoothing is known.
    #[must_use]
    pub fn with_smoothing(film: &'a Film, footprints: &'a Footprints, smoothing: &'a Smoothing) -> Self {
        Self { film, footprints, smoothing: Cow::Borrowed(smoothing) }
    }

    /// The smoothing, to keep.
    #[must_use]
    pub fn into_smoothing(self) -> Smoothing {
        self.smoothing.into_owned()
    }

    /// All classes together.
    #[must_use]
    pub fn image(&self) -> LinearImage {
        let smoothed = [&self.smoothing.photons, &self.smoothing.indirect].into_iter().flatten();
        smoothed.fold(self.film.raw_image(), |image, smoothed| add(image, &smoothed.correction))
    }

    /// One class; the layers add up to the image.
    #[must_use]
    pub fn layer(&self, class: PathClass) -> LinearImage {
        let layer = self.film.raw_layer(class);
        let smoothed = match class {
            PathClass::Emitted | PathClass::Direct => &None,
            PathClass::Caustic => &self.smoothing.photons,
            PathClass::Indirect => &self.smoothing.indirect,
        };
        match smoothed {
            Some(smoothed) => add(layer, &smoothed.correction),
            None => layer,
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

    /// A named layer, its part of what is smoothed as the whole is.
    fn named_layer(&self, index: usize) -> LinearImage {
        let Smoothing { photons, indirect } = &*self.smoothing;
        let parts = [(photons, Gathered::Photons), (indirect, Gathered::Indirect)];
        parts.into_iter().fold(self.film.named_layer(index), |layer, (smoothed, gathered)| {
            let Some(smoothed) = smoothed else { return layer };
            let part = self.film.layer_part(index, gathered, |pixel| self.footprints.get(pixel).is_some());
            add(layer, &smooth_part((self.film, self.footprints), (gathered, smoothed), &part))
        })
    }

    /// Estimated relative error of the image: the root of the mean over pixels and channels of
    /// (σ² + b²) / (L² + (0.1 L_mean)²), at the upper end of that mean's own 95 % range. For what is sampled, σ² = (A - B)²/4 is
    /// the unbiased estimate of the mean's variance from its two independent halves; for what is smoothed the noise and
    /// the blur b of the chosen width. `None` before the first round.
    #[must_use]
    pub fn error_estimate(&self) -> Option<f32> {
        if self.film.rounds() == 0 {
            return None;
        }
        Some(PixelError::bound(&self.errors()))
    }

    /// Estimated relative squared error of every pixel, by what makes it.
    #[must_use]
    pub fn errors(&self) -> Vec<PixelError> {
        self.errors_of(&self.image())
    }

    /// The same where the image is known.
    pub(crate) fn errors_of(&self, image: &LinearImage) -> Vec<PixelError> {
        let mean = image.pixels.iter().map(|p| mean_channel(Vec3::from_array(*p))).sum::<f32>();
        let floor = 0.1 * mean / image.pixels.len() as f32;
        let (around, beside) = (around(image), beside(&self.film.emitted(), self.film.size()));
        let pixels = self.film.means().zip(image.pixels.par_iter().zip(around.into_par_iter().zip(beside)));
        let mut errors: Vec<PixelError> = pixels
            .enumerate()
            .map(|(i, (means, (value, (around, beside))))| {
                self.error(i, &means, (Vec3::from_array(*value), around, beside), floor)
            })
            .collect();
        self.share_noise(&mut errors);
        errors
    }

    /// Adds to the variance what smoothed pixels share: twice the products of the errors of any two whose noise is alike.
    fn share_noise(&self, errors: &mut [PixelError]) {
        type Part = fn(&PixelError) -> f32;
        let Smoothing { photons, indirect } = &*self.smoothing;
        let parts: [(_, Part); 2] = [(photons, |e| e.photons), (indirect, |e| e.paths)];
        for (smoothed, part) in parts {
            let Some(smoothed) = smoothed else { continue };
            let sharing = smoothed.sharing(self.film.size(), |i| part(&errors[i]));
            for (error, sharing) in errors.iter_mut().zip(sharing) {
                error.variance += 2.0 * part(error) * sharing;
            }
        }
    }

    /// The radiance that an error is relative to must not hold the error itself, or a single bright sample would never
    /// count for more than its pixel: it is the darker half's, or what the pixels `around` agree on, up to the pixel's own. Of a lamp
    /// that a pixel `beside` shows too it is no less than [`EDGE`] of what was found.
    fn error(
        &self,
        index: usize,
        means: &PixelMeans,
        (value, around, beside): (Vec3, Vec3, Vec3),
        floor: f32,
    ) -> PixelError {
        if floor <= 0.0 {
            return PixelError::default();
        }
        let half = |class| 0.5 * (means.halves[0].get(class) - means.halves[1].get(class));
        let mut sampled = half(PathClass::Emitted) + half(PathClass::Direct);
        let mut paths = half(PathClass::Indirect);
        let Smoothing { photons: caustics, indirect } = &*self.smoothing;
        let left = |smoothed: &Option<Smoothed>| smoothed.as_ref().and_then(|s| s.squared_error[index]);
        let bounced = left(indirect);
        let footprint = self.footprints.get(index).is_some();
        if bounced.is_some() {
            let [a, b] = means.indirect.unwrap_or_default();
            paths = if footprint { paths - means.gain * 0.5 * (a - b) } else { Vec3::ZERO };
        }
        let mut photons = half(PathClass::Caustic);
        if self.film.caustics() == Caustics::Backward {
            sampled += std::mem::take(&mut photons);
        }
        let smoothed = left(caustics);
        if smoothed.is_some() {
            let [a, b] = means.irradiance;
            photons = if footprint { photons - means.gain * 0.5 * (a - b) } else { Vec3::ZERO };
        }
        let darker = value - (sampled + paths + photons).abs();
        let photons = photons * photons + Vec3::splat(smoothed.unwrap_or(0.0));
        let paths = paths * paths + Vec3::splat(bounced.unwrap_or(0.0));
        let radiance = darker.max(value.min(around)).max(Vec3::ZERO);
        let relative_to = |l: Vec3, squares: Vec3| mean_channel(squares / (l * l + floor * floor));
        let relative = |squares: Vec3| relative_to(radiance, squares);
        let lamp = EDGE * means.class(PathClass::Emitted).min(beside);
        let sampled = relative_to(radiance.max(lamp), sampled * sampled);
        let (paths, photons) = (relative(paths), relative(photons));
        let alone = |error: f32, smoothed: Option<f32>| if smoothed.is_some() { 0.0 } else { error * error };
        let variance = 2.0 / 3.0 * (sampled * sampled + alone(paths, bounced) + alone(photons, smoothed));
        PixelError { sampled, paths, photons, variance }
    }
}

/// Estimated squared error of a pixel by what brings it, relative to a squared radiance that does not hold the error; mean
/// over channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelError {
    /// Of what eye samples bring, emitted and direct light.
    pub sampled: f32,
    /// Of what paths bring, indirect light.
    pub paths: f32,
    /// Of what photons bring.
    pub photons: f32,
    /// Variance of the sum over the picture of what the error truly is, one pixel's share: of a squared normal number it is
    /// twice its mean's square, or 2/3 of the mean of its own square; as often as pixels share their noise.
    pub variance: f32,
}

impl PixelError {
    /// Of all.
    #[must_use]
    pub fn total(&self) -> f32 {
        self.sampled + self.paths + self.photons
    }

    /// Root of the upper end of the mean's 95 % range: where few pixels hold most of the error, or many share theirs,
    /// the picture may be luckier or less lucky than its halves' difference says. Both vary, independently, by the same amount.
    #[must_use]
    pub fn bound(errors: &[Self]) -> f32 {
        /// Standard deviations between which 95 % of a normal distribution lie.
        const RANGE_95: f64 = 1.96;
        let sum: f64 = errors.iter().map(|e| f64::from(e.total())).sum();
        let variance: f64 = errors.iter().map(|e| f64::from(e.variance)).sum();
        ((sum + RANGE_95 * (2.0 * variance).sqrt()) / errors.len().max(1) as f64).sqrt() as f32
    }
}

/// A pixel at a lamp's edge shows an unknown share p of it. Where of n samples one has met the lamp, in the mean over p, uniform as at
/// an outline or with the density p^(-1/3) as at the rim of a blurred disc, the squared relative error of that and of the pixels in
/// which none has is about that of a pixel of so much of what was found.
const EDGE: f32 = 0.4;

/// The most that any neighbour of a pixel that shows anything shows, by channel.
fn beside(pixels: &[Vec3], (width, height): (usize, usize)) -> Vec<Vec3> {
    let most = |i: usize| {
        if pixels[i] == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let (x, y) = (i % width, i / width);
        let columns = x.saturating_sub(1)..=(x + 1).min(width - 1);
        let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
        let neighbours = rows.flat_map(|y| columns.clone().map(move |x| y * width + x)).filter(|&j| j != i);
        neighbours.map(|j| pixels[j]).fold(Vec3::ZERO, Vec3::max)
    };
    (0..pixels.len()).into_par_iter().map(most).collect()
}

/// What each pixel's neighbours agree on: the least mean of two that lie opposite to each other, by channel.
fn around(image: &LinearImage) -> Vec<Vec3> {
    let width = image.width as usize;
    let (pixels, count) = (&image.pixels, image.pixels.len());
    let mean = |i: usize, apart: usize| {
        0.5 * (Vec3::from_array(pixels[i - apart]) + Vec3::from_array(pixels[i + apart]))
    };
    let least = |i: usize| {
        let x = i % width;
        let (inside, between) = (x > 0 && x + 1 < width, i >= width && i + width < count);
        match (inside, between) {
            (true, true) => {
                let straight = mean(i, 1).min(mean(i, width));
                straight.min(mean(i, width + 1)).min(mean(i, width - 1))
            }
            (true, false) => mean(i, 1),
            (false, true) => mean(i, width),
            (false, false) => Vec3::ZERO,
        }
    };
    (0..count).into_par_iter().map(least).collect()
}

fn add(mut image: LinearImage, correction: &[Vec3]) -> LinearImage {
    image.pixels.par_iter_mut().zip(correction).for_each(|(pixel, correction)| {
        *pixel = (Vec3::from_array(*pixel) + *correction).to_array();
    });
    image
}

fn mean_channel(v: Vec3) -> f32 {
    v.element_sum() / 3.0
}
