//! Where the effort of a round goes: photons or eye samples, and to which pixels.
//!
//! Variance falls with the number of samples n as V/n, and a sample costs c; the error is least for the time
//! spent if n ∝ sqrt(V/c). The film's own estimate of its error says what V is for the photons and for each
//! pixel's eye samples, counted rays say what c is; nothing is timed, so that the choice is the same on every
//! machine.

use crate::picture::PixelError;
use crate::sampling::hash;

/// What a round does more than the first one did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Effort {
    /// Each window's block is 2^`photon_shift` times the plan's.
    pub photon_shift: u32,
    /// Eye samples of each pixel and half; empty means one each.
    pub samples: Vec<u8>,
}

/// What the film knows when the effort is decided.
pub struct Measured<'a> {
    /// Errors per pixel.
    pub errors: &'a [PixelError],
    /// Pixels across.
    pub width: usize,
    /// Eye samples per half of each pixel so far.
    pub samples: &'a [u32],
    /// Photon weight so far, in blocks of the plan.
    pub photon_weight: f32,
    /// Rays per block of the plan; 0 if there are no photons.
    pub rays_per_block: f32,
    /// Rays per eye sample.
    pub rays_per_sample: f32,
}

/// A photon costs its rays and its place in the tree: about as much as another ray.
const PHOTON_OVERHEAD: f32 = 1.0;

/// Most eye samples of a pixel and half in one round.
const MOST_SAMPLES: f32 = 32.0;

/// A round gives a pixel at most this many times the samples it had: few do not decide on many.
const MOST_GROWTH: f32 = 8.0;

/// Least, on average: so that what the first samples missed is found.
const LEAST_SAMPLES: f32 = 0.25;

/// With no photons to weigh against, this many samples go to a pixel on average.
const SAMPLES_ALONE: f32 = 2.0;

/// Blocks grow to at most this power of two of the plan's.
pub const MOST_SHIFT: u32 = 6;

/// Half width, in pixels, of the square over which an eye sample's variance is averaged.
const WINDOW: usize = 2;

impl Effort {
    /// Eye samples of a pixel and half.
    #[inline]
    #[must_use]
    pub fn samples(&self, pixel: usize) -> u32 {
        self.samples.get(pixel).map_or(1, |&n| u32::from(n))
    }

    /// More eye samples for the pixels that the first of all found to need them most. Of a number of samples in
    /// proportion to the need, with a mean of 0.3, pixels get what goes beyond the one they had: in the time that costs,
    /// about a tenth of a round's, the error falls most (tried from 0.1 to 1.5 on a glass ball and a ring).
    #[must_use]
    pub fn second_look(measured: &Measured<'_>, key: u64) -> Self {
        const MEAN: f32 = 0.3;
        let wanted = wanted_samples(measured);
        let mean = wanted.iter().sum::<f32>() / wanted.len().max(1) as f32;
        let scale = if mean > 0.0 { MEAN / mean } else { 0.0 };
        let more = wanted.iter().enumerate().map(|(i, w)| {
            let missing = (w * scale - 1.0).clamp(0.0, MOST_GROWTH);
            (missing + dither(key, i)).floor() as u8
        });
        Self { photon_shift: 0, samples: more.collect() }
    }

    /// Decides the next rounds' effort. `key` decides the rounding of fractions of a sample.
    #[must_use]
    pub fn decide(measured: &Measured<'_>, most_shift: u32, key: u64) -> Self {
        let wanted = wanted_samples(measured);
        let mean = wanted.iter().sum::<f32>() / wanted.len().max(1) as f32;
        let photons: f64 = measured.errors.iter().map(|e| f64::from(e.photons)).sum();
        let per_block = photons as f32 * measured.photon_weight / (measured.rays_per_block * PHOTON_OVERHEAD);
        if measured.rays_per_block <= 0.0 || per_block <= 0.0 {
            let scale = if mean > 0.0 { SAMPLES_ALONE / mean } else { 0.0 };
            return Self { photon_shift: 0, samples: samples(&wanted, measured.samples, scale, key) };
        }
        // In the same unit: blocks wanted.
        let blocks = per_block.sqrt();
        let most_shift = most_shift.min(MOST_SHIFT) as f32;
        let balanced = if mean > 0.0 { (blocks / mean).log2().round() } else { most_shift };
        let photon_shift = balanced.clamp(0.0, most_shift) as u32;
        let scale = (1_u32 << photon_shift) as f32 / blocks;
        Self { photon_shift, samples: samples(&wanted, measured.samples, scale, key) }
    }
}

/// sqrt(V/c) of every pixel, V averaged over its neighbourhood.
fn wanted_samples(measured: &Measured<'_>) -> Vec<f32> {
    let width = measured.width;
    let height = measured.errors.len() / width.max(1);
    let per_sample: Vec<f32> =
        measured.errors.iter().zip(measured.samples).map(|(e, &n)| e.sampled * n as f32).collect();
    let around = |i: usize| {
        let (x, y) = (i % width, i / width);
        let columns = x.saturating_sub(WINDOW)..(x + WINDOW + 1).min(width);
        let rows = y.saturating_sub(WINDOW)..(y + WINDOW + 1).min(height);
        let count = (columns.len() * rows.len()) as f32;
        let sum: f32 = rows.map(|row| per_sample[row * width..][columns.clone()].iter().sum::<f32>()).sum();
        sum / count
    };
    (0..per_sample.len()).map(|i| (around(i) / measured.rays_per_sample.max(1.0)).sqrt()).collect()
}

/// A number in [0, 1) for a pixel.
fn dither(key: u64, pixel: usize) -> f32 {
    (hash(key, pixel as u64) >> 40) as f32 / (1_u64 << 24) as f32
}

/// Samples of each pixel. Fractions of a sample are rounded up as often as they are large.
fn samples(wanted: &[f32], had: &[u32], scale: f32, key: u64) -> Vec<u8> {
    let round = |(i, (w, &had)): (usize, (&f32, &u32))| {
        let most = MOST_SAMPLES.min(MOST_GROWTH * had.max(1) as f32);
        ((w * scale).clamp(LEAST_SAMPLES, most) + dither(key, i)).floor() as u8
    };
    wanted.iter().zip(had).enumerate().map(round).collect()
}
