//! The film: one layer per class of paths and half, summed over rounds.

use crate::geometry::SheetId;
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

/// What one half of a pixel has gathered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HalfSums {
    /// Radiance per class.
    pub classes: ClassSums,
    /// Irradiance that photons bring to the surface the eye sees first along its main way.
    pub irradiance: Vec3,
    /// How many samples reached that surface, relative to all.
    pub arrivals: f32,
}

impl HalfSums {
    /// Mean irradiance of the samples that reached the surface.
    #[must_use]
    pub fn mean_irradiance(&self) -> Vec3 {
        if self.arrivals > 0.0 { self.irradiance / self.arrivals } else { Vec3::ZERO }
    }
}

/// The surface that the eye's main way through a pixel leads to: what may be smoothed with what.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Guide {
    /// Radiance of the pixel per irradiance of that surface, summed over halves.
    pub gain: Vec3,
    /// A point of it, from the first sample.
    pub position: Vec3,
    /// Its normal there.
    pub normal: Vec3,
    /// Its sheet, by [`Guide::sheet_code`]; 0 if no sample reached a surface.
    pub sheet: u32,
}

impl Guide {
    /// Code of a pixel whose samples reached several sheets.
    pub const MIXED: u32 = u32::MAX;

    /// Code of a pixel whose samples all reached this sheet.
    #[must_use]
    pub fn sheet_code(sheet: SheetId) -> u32 {
        sheet.0 + 1
    }

    /// Adds another sample's, or another round's.
    pub(crate) fn add(&mut self, other: &Self) {
        if self.sheet == 0 {
            *self = *other;
            return;
        }
        self.gain += other.gain;
        if other.sheet != 0 && other.sheet != self.sheet {
            self.sheet = Self::MIXED;
        }
    }
}

/// One pixel: two independent halves, each an estimate of the same radiance, W·sr⁻¹·m⁻².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSums {
    /// Half A and half B.
    pub halves: [HalfSums; 2],
    /// The surface behind the pixel.
    pub guide: Guide,
}

impl PixelSums {
    pub(crate) fn scale(&mut self, factor: f32) {
        self.guide.gain *= factor;
        for half in &mut self.halves {
            half.irradiance *= factor;
            half.arrivals *= factor;
            for class in &mut half.classes.0 {
                *class *= factor;
            }
        }
    }

    fn add(&mut self, other: &Self) {
        self.guide.add(&other.guide);
        for (mine, theirs) in self.halves.iter_mut().zip(&other.halves) {
            mine.irradiance += theirs.irradiance;
            mine.arrivals += theirs.arrivals;
            for (a, b) in mine.classes.0.iter_mut().zip(&theirs.classes.0) {
                *a += *b;
            }
        }
    }

    /// The class that holds a number that is not finite, if any.
    pub(crate) fn not_finite(&self) -> Option<PathClass> {
        PathClass::ALL.into_iter().find(|&c| self.halves.iter().any(|h| !h.classes.get(c).is_finite()))
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

    /// All classes together, as they were gathered: nothing is smoothed.
    #[must_use]
    pub fn raw_image(&self) -> LinearImage {
        self.map(|pixel| pixel.halves[0].classes.total() + pixel.halves[1].classes.total())
    }

    /// One class, as it was gathered.
    #[must_use]
    pub fn raw_layer(&self, class: PathClass) -> LinearImage {
        self.map(|pixel| pixel.halves[0].classes.get(class) + pixel.halves[1].classes.get(class))
    }

    fn map(&self, sum: impl Fn(&PixelSums) -> Vec3) -> LinearImage {
        let scale = self.mean_scale();
        let pixels = self.pixels.iter().map(|p| (sum(p) * scale).to_array()).collect();
        LinearImage { width: self.width, height: self.height, pixels }
    }

    /// Factor from the sum of both halves over all rounds to a mean.
    pub(crate) fn mean_scale(&self) -> f32 {
        if self.rounds == 0 { 0.0 } else { 0.5 / self.rounds as f32 }
    }

    /// Pixels across and down.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.width as usize, self.height as usize)
    }

    /// The sums over all rounds, row by row.
    #[must_use]
    pub fn pixels(&self) -> &[PixelSums] {
        &self.pixels
    }

    /// Raw values for a checkpoint: rounds, then every number.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(4 + self.pixels.len() * PixelSums::WORDS * 4);
        bytes.extend(self.rounds.to_le_bytes());
        for pixel in &self.pixels {
            pixel.visit(|word| bytes.extend(word.to_le_bytes()));
        }
        bytes
    }

    /// The film of [`Film::to_bytes`]; `None` if the length does not fit the size.
    #[must_use]
    pub fn from_bytes(width: u32, height: u32, bytes: &[u8]) -> Option<Self> {
        let mut film = Self::new(width, height);
        let (rounds, values) = bytes.split_first_chunk::<4>()?;
        if values.len() != film.pixels.len() * PixelSums::WORDS * 4 {
            return None;
        }
        film.rounds = u32::from_le_bytes(*rounds);
        let mut words = values.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b));
        for pixel in &mut film.pixels {
            pixel.fill(|| words.next().unwrap_or(0));
        }
        Some(film)
    }
}

impl PixelSums {
    /// Number of 32-bit words in a pixel.
    const WORDS: usize = size_of::<Self>() / 4;

    /// The numbers of a pixel as 32-bit words, in a fixed order.
    fn visit(&self, mut word: impl FnMut(u32)) {
        let mut vector = |v: Vec3| v.to_array().into_iter().for_each(|x| word(x.to_bits()));
        for half in &self.halves {
            half.classes.0.iter().for_each(|v| vector(*v));
            vector(half.irradiance);
        }
        vector(self.guide.gain);
        vector(self.guide.position);
        vector(self.guide.normal);
        word(self.halves[0].arrivals.to_bits());
        word(self.halves[1].arrivals.to_bits());
        word(self.guide.sheet);
    }

    /// The inverse of [`PixelSums::visit`].
    fn fill(&mut self, mut word: impl FnMut() -> u32) {
        let mut vector = || Vec3::from_array(std::array::from_fn(|_| f32::from_bits(word())));
        for half in &mut self.halves {
            half.classes.0.iter_mut().for_each(|v| *v = vector());
            half.irradiance = vector();
        }
        self.guide.gain = vector();
        self.guide.position = vector();
        self.guide.normal = vector();
        self.halves[0].arrivals = f32::from_bits(word());
        self.halves[1].arrivals = f32::from_bits(word());
        self.guide.sheet = word();
    }
}
