//! Where the effort of a round goes: photons, eye samples or the paths that go on from these, and to which pixels.
//!
//! Variance falls with the number of samples n as V/n, and a sample costs c; the error is least for the time
//! spent if n ∝ sqrt(V/c). The film's own estimate of its error says what V is for the photons and for each
//! pixel's eye samples, counted rays say what c is; nothing is timed, so that the choice is the same on every
//! machine.

use crate::picture::PixelError;
use crate::sampling::hash;
use rayon::prelude::*;

/// What a round does more than the first one did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Effort {
    /// Each window's block is 2^`photon_shift` times the plan's.
    pub photon_shift: u32,
    /// Eye samples of each pixel and half; empty means one each.
    pub samples: Vec<u8>,
    /// Those among them that go on as paths; empty means one each, where they are asked for at all.
    pub paths: Vec<u8>,
}

/// What the film knows when the effort is decided.
pub struct Measured<'a> {
    /// Errors per pixel.
    pub errors: &'a [PixelError],
    /// Pixels across.
    pub width: usize,
    /// Eye samples per half of each pixel so far.
    pub samples: Vec<u32>,
    /// Those that went on as paths.
    pub paths: Vec<u32>,
    /// Photon weight so far, in blocks of the plan.
    pub photon_weight: f32,
    /// Rays per block of the plan; 0 if there are no photons.
    pub rays_per_block: f32,
    /// Rays per eye sample, up to the first D.
    pub rays_per_sample: f32,
    /// Rays that a path needs beyond.
    pub rays_per_path: f32,
}

/// A photon costs its rays and its place in the tree: about as much as another ray.
const PHOTON_OVERHEAD: f32 = 1.0;

/// The same of a path's rays: at every D photons are looked up too, and little of what it meets is in the cache.
const PATH_OVERHEAD: f32 = 2.0;

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

    /// Eye samples of a pixel and half that go on as paths.
    #[inline]
    #[must_use]
    pub fn paths(&self, pixel: usize) -> u32 {
        self.paths.get(pixel).map_or(1, |&n| u32::from(n))
    }

    /// The first round's: an eye sample for each pixel and half, and a path, but where paths will be smoothed only for one of
    /// each four pixels, which a key picks.
    #[must_use]
    pub fn first(smoothable: &[bool], (width, key): (usize, u64)) -> Self {
        let path = |(i, &smoothable): (usize, &bool)| {
            let (x, y) = (i % width, i / width);
            let block = hash(key, (y / 2 * width + x / 2) as u64);
            u8::from(!smoothable || block % 4 == (y % 2 * 2 + x % 2) as u64)
        };
        let paths = smoothable.iter().enumerate().map(path).collect();
        Self { photon_shift: 0, samples: Vec::new(), paths }
    }

    /// More eye samples, and paths, for the pixels that the first of all found to need them most. Of a number of samples in
    /// proportion to the need, with a mean of 0.3, pixels get what goes beyond the one they had: in the time that costs,
    /// about a tenth of a round's, the error falls most (tried from 0.1 to 1.5 on a glass ball and a ring). Of paths, which
    /// cost more, half as many.
    #[must_use]
    pub fn second_look(measured: &Measured<'_>, key: u64) -> Self {
        const SAMPLES: f32 = 0.3;
        const PATHS: f32 = 0.15;
        let more = |wanted: &Wanted, mean: f32| {
            let scale = if wanted.mean > 0.0 { mean / wanted.mean } else { 0.0 };
            let missing = |w: &f32| (w * scale - 1.0).clamp(0.0, MOST_GROWTH);
            let dithered = |(i, w): (usize, &f32)| (missing(w) + dither(key, i)).floor() as u8;
            wanted.pixels.par_iter().enumerate().map(dithered).collect()
        };
        let samples = more(&Wanted::samples(measured), SAMPLES);
        let paths = Wanted::paths(measured).map_or_else(Vec::new, |wanted| more(&wanted, PATHS));
        Self { photon_shift: 0, samples, paths }
    }

    /// Decides the next rounds' effort. `key` decides the rounding of fractions of a sample.
    #[must_use]
    pub fn decide(measured: &Measured<'_>, most_shift: u32, key: u64) -> Self {
        let (samples, paths) = (Wanted::samples(measured), Wanted::paths(measured));
        let mean = paths.as_ref().map_or(0.0, |paths| paths.mean).max(samples.mean);
        let photons: f64 = measured.errors.iter().map(|e| f64::from(e.photons)).sum();
        let per_block = photons as f32 * measured.photon_weight / (measured.rays_per_block * PHOTON_OVERHEAD);
        let (photon_shift, scale) = if measured.rays_per_block <= 0.0 || per_block <= 0.0 {
            (0, if mean > 0.0 { SAMPLES_ALONE / mean } else { 0.0 })
        } else {
            // In the same unit: blocks wanted.
            let blocks = per_block.sqrt();
            let most_shift = most_shift.min(MOST_SHIFT) as f32;
            let balanced = if mean > 0.0 { (blocks / mean).log2().round() } else { most_shift };
            let photon_shift = balanced.clamp(0.0, most_shift) as u32;
            (photon_shift, (1_u32 << photon_shift) as f32 / blocks)
        };
        let rays = samples.rays() + paths.as_ref().map_or(0.0, Wanted::rays);
        let scale = scale.min(measured.most_rays() / rays.max(f32::MIN_POSITIVE));
        let scaled = |paths: Wanted| paths.scaled(scale, &measured.paths, hash(key, 1));
        Self {
            photon_shift,
            samples: samples.scaled(scale, &measured.samples, key),
            paths: paths.map_or_else(Vec::new, scaled),
        }
    }

    /// As many samples and paths, the same number for every pixel, or samples as many times as its share.
    #[must_use]
    pub fn evened(self, shares: &[u8]) -> Self {
        let even = |mut counts: Vec<u8>| {
            let sum: usize = counts.iter().map(|&n| usize::from(n)).sum();
            let each = sum.div_ceil(counts.len().max(1)).max(1) as u8;
            counts.fill(each);
            counts
        };
        let mut samples = even(self.samples);
        samples.iter_mut().zip(shares).for_each(|(count, &share)| *count = count.saturating_mul(share));
        Self { samples, paths: even(self.paths), ..self }
    }
}

impl Measured<'_> {
    /// A round costs at most twice what all eye samples and paths before have cost: no single one overruns a limit of time by
    /// far.
    fn most_rays(&self) -> f32 {
        let spent = |counts: &[u32], rays: f32| counts.iter().map(|&n| n as f32).sum::<f32>() * rays.max(1.0);
        let paths = spent(&self.paths, self.rays_per_path * PATH_OVERHEAD);
        2.0 * (spent(&self.samples, self.rays_per_sample) + paths)
    }
}

/// What every pixel wants of something that is sampled, to a common factor: sqrt(V/c), V averaged over its neighbourhood.
struct Wanted {
    pixels: Vec<f32>,
    mean: f32,
    /// Rays that one costs.
    cost: f32,
}

impl Wanted {
    fn samples(measured: &Measured<'_>) -> Self {
        Self::of(measured, (|e| e.sampled, &measured.samples), measured.rays_per_sample)
    }

    /// `None` if no paths are asked for.
    fn paths(measured: &Measured<'_>) -> Option<Self> {
        let asked = measured.paths.iter().any(|&n| n > 0);
        asked.then(|| {
            Self::of(measured, (|e| e.paths, &measured.paths), measured.rays_per_path * PATH_OVERHEAD)
        })
    }

    fn of(measured: &Measured<'_>, (error, had): (fn(&PixelError) -> f32, &[u32]), rays: f32) -> Self {
        let width = measured.width;
        let height = measured.errors.len() / width.max(1);
        let variance: Vec<f32> = measured.errors.iter().zip(had).map(|(e, &n)| error(e) * n as f32).collect();
        let near = |at: usize, end: usize| at.saturating_sub(WINDOW)..(at + WINDOW + 1).min(end);
        let across = |i: usize| {
            let (x, y) = (i % width, i / width);
            variance[y * width..][near(x, width)].iter().sum::<f32>()
        };
        let across: Vec<f32> = (0..variance.len()).into_par_iter().map(across).collect();
        let around = |i: usize| {
            let (x, y) = (i % width, i / width);
            let (columns, rows) = (near(x, width), near(y, height));
            let count = (columns.len() * rows.len()) as f32;
            rows.map(|row| across[row * width + x]).sum::<f32>() / count
        };
        let cost = rays.max(1.0);
        let pixels: Vec<f32> =
            (0..variance.len()).into_par_iter().map(|i| (around(i) / cost).sqrt()).collect();
        let mean = pixels.iter().sum::<f32>() / pixels.len().max(1) as f32;
        Self { pixels, mean, cost }
    }

    /// Rays that all cost.
    fn rays(&self) -> f32 {
        self.mean * self.pixels.len() as f32 * self.cost
    }

    /// Samples of each pixel, of which it had some. Fractions of a sample are rounded up as often as they are large.
    fn scaled(&self, scale: f32, had: &[u32], key: u64) -> Vec<u8> {
        let round = |(i, (w, &had)): (usize, (&f32, &u32))| {
            let most = MOST_SAMPLES.min(MOST_GROWTH * had.max(1) as f32);
            ((w * scale).clamp(LEAST_SAMPLES, most) + dither(key, i)).floor() as u8
        };
        self.pixels.par_iter().zip(had).enumerate().map(round).collect()
    }
}

/// A number in [0, 1) for a pixel.
fn dither(key: u64, pixel: usize) -> f32 {
    (hash(key, pixel as u64) >> 40) as f32 / (1_u64 << 24) as f32
}
