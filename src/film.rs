//! The film: one layer per class of paths and half, as a mean over rounds.

use crate::image_io::LinearImage;
use crate::light_path::PathClass;
use glam::Vec3;

const CLASSES: usize = PathClass::ALL.len();

/// Sums of one half, per class.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClassSums([Vec3; CLASSES]);

impl ClassSums {
    /// Adds radiance to a class.
    #[inline]
    pub fn add(&mut self, class: PathClass, radiance: Vec3) {
        self.0[class as usize] += radiance;
    }

    /// Radiance of one class.
    #[inline]
    #[must_use]
    pub fn get(&self, class: PathClass) -> Vec3 {
        self.0[class as usize]
    }

    /// Radiance of all classes.
    #[inline]
    #[must_use]
    pub fn total(&self) -> Vec3 {
        self.0.iter().sum()
    }
}

/// One pixel: two independent halves, each an estimate of the same radiance, W·sr⁻¹·m⁻².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSums {
    /// Half A and half B.
    pub halves: [ClassSums; 2],
}

impl PixelSums {
    pub(crate) fn scale(&mut self, factor: f32) {
        for half in &mut self.halves {
            for class in &mut half.0 {
                *class *= factor;
            }
        }
    }

    fn add(&mut self, other: &Self) {
        for (mine, theirs) in self.halves.iter_mut().zip(&other.halves) {
            for (a, b) in mine.0.iter_mut().zip(&theirs.0) {
                *a += *b;
            }
        }
    }

    /// The class that holds a number that is not finite, if any.
    pub(crate) fn not_finite(&self) -> Option<PathClass> {
        PathClass::ALL.into_iter().find(|&c| self.halves.iter().any(|h| !h.get(c).is_finite()))
    }
}

/// One round's estimate of every pixel, row by row from the top.
pub struct RoundFilm {
    width: u32,
    pixels: Vec<PixelSums>,
}

impl RoundFilm {
    pub(crate) fn new(width: u32, height: u32) -> Self {
        Self { width, pixels: vec![PixelSums::default(); width as usize * height as usize] }
    }

    /// Puts a tile's pixels, row by row, at (x, y).
    pub(crate) fn put(&mut self, x: u32, y: u32, tile_width: u32, pixels: &[PixelSums]) {
        for (row, values) in pixels.chunks_exact(tile_width as usize).enumerate() {
            let start = (y as usize + row) * self.width as usize + x as usize;
            self.pixels[start..start + values.len()].copy_from_slice(values);
        }
    }
}

/// The sum of finished rounds. Rounds are added in their order, one after the other, so that the same rounds
/// give the same bits; f32 suffices since a round's share of the sum is never below its rounding.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    rounds: u32,
    pixels: Vec<PixelSums>,
}

impl Film {
    /// An empty film.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        let pixels = vec![PixelSums::default(); width as usize * height as usize];
        Self { width, height, rounds: 0, pixels }
    }

    /// Bytes a film of this size holds.
    #[must_use]
    pub fn bytes(width: u32, height: u32) -> u64 {
        u64::from(width) * u64::from(height) * size_of::<PixelSums>() as u64
    }

    /// Adds the next round.
    pub fn add_round(&mut self, round: &RoundFilm) {
        self.rounds += 1;
        for (sum, pixel) in self.pixels.iter_mut().zip(&round.pixels) {
            sum.add(pixel);
        }
    }

    /// Number of rounds added.
    #[must_use]
    pub fn rounds(&self) -> u32 {
        self.rounds
    }

    /// All classes together.
    #[must_use]
    pub fn image(&self) -> LinearImage {
        self.map(|pixel| pixel.halves[0].total() + pixel.halves[1].total())
    }

    /// One class.
    #[must_use]
    pub fn layer(&self, class: PathClass) -> LinearImage {
        self.map(|pixel| pixel.halves[0].get(class) + pixel.halves[1].get(class))
    }

    fn map(&self, sum: impl Fn(&PixelSums) -> Vec3) -> LinearImage {
        let scale = if self.rounds == 0 { 0.0 } else { 0.5 / self.rounds as f32 };
        let pixels = self.pixels.iter().map(|p| (sum(p) * scale).to_array()).collect();
        LinearImage { width: self.width, height: self.height, pixels }
    }

    /// Estimated relative error of the image: the root of the mean over pixels and channels of
    /// σ² / (L² + (0.1 L_mean)²), with σ² = (A - B)²/4 the unbiased estimate of the mean's variance from its
    /// two independent halves. Systematic error of the density estimate is not in it. `None` before the
    /// first round.
    #[must_use]
    pub fn error_estimate(&self) -> Option<f32> {
        if self.rounds == 0 {
            return None;
        }
        let scale = 0.5 / self.rounds as f32;
        let halves = |p: &PixelSums| (p.halves[0].total() * scale, p.halves[1].total() * scale);
        let count = self.pixels.len() as f64;
        let mean = self.pixels.iter().map(|p| luminous(halves(p).0 + halves(p).1)).sum::<f64>() / count;
        let floor = (0.1 * mean).powi(2);
        if mean == 0.0 {
            return Some(0.0);
        }
        let relative = |p: &PixelSums| {
            let (a, b) = halves(p);
            let value = (a + b).as_dvec3();
            let deviation = (a - b).as_dvec3();
            (deviation * deviation / (value * value + floor)).element_sum() / 3.0
        };
        Some((self.pixels.iter().map(relative).sum::<f64>() / count).sqrt() as f32)
    }

    /// Raw values for a checkpoint: rounds, then every number.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(4 + self.pixels.len() * size_of::<PixelSums>());
        bytes.extend(self.rounds.to_le_bytes());
        for value in self.pixels.iter().flat_map(|p| p.halves.iter().flat_map(|h| h.0.iter())) {
            for channel in value.to_array() {
                bytes.extend(channel.to_le_bytes());
            }
        }
        bytes
    }

    /// The film of [`Film::to_bytes`]; `None` if the length does not fit the size.
    #[must_use]
    pub fn from_bytes(width: u32, height: u32, bytes: &[u8]) -> Option<Self> {
        let mut film = Self::new(width, height);
        let (rounds, values) = bytes.split_first_chunk::<4>()?;
        if values.len() != film.pixels.len() * size_of::<PixelSums>() {
            return None;
        }
        film.rounds = u32::from_le_bytes(*rounds);
        let mut channels = values.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b));
        for value in film.pixels.iter_mut().flat_map(|p| p.halves.iter_mut().flat_map(|h| h.0.iter_mut())) {
            *value = Vec3::new(channels.next()?, channels.next()?, channels.next()?);
        }
        Some(film)
    }
}

fn luminous(v: Vec3) -> f64 {
    f64::from(v.element_sum()) / 3.0
}
