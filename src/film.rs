//! The film: one layer per class of paths and half, summed over rounds.

mod bytes;
mod layers;

pub use layers::LayerSums;

use crate::image_io::LinearImage;
use crate::light_path::PathClass;
use crate::scene::Caustics;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

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

/// What one half of a pixel has gathered. The emitted and direct classes are sums over eye samples; what
/// photons bring is a sum over rounds, weighted by the rounds' photons; the indirect class is a sum over the eye
/// samples that go on as paths.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HalfSums {
    /// Radiance per class; of the caustic class, what was looked up point by point.
    pub classes: ClassSums,
    /// Irradiance that photons bring to the pixel's footprint.
    pub irradiance: Vec3,
    /// Irradiance that other D bring to the pixel's footprint; the indirect class holds only what falls elsewhere.
    pub indirect: Vec3,
    /// Number of paths that left it.
    pub departures: u32,
}

/// Means of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelMeans {
    /// Radiance per class in each half.
    pub halves: [ClassSums; 2],
    /// Irradiance of the pixel's footprint by photons, in each half.
    pub irradiance: [Vec3; 2],
    /// Irradiance of the pixel's footprint by other D, in each half; `None` if no path has asked for it.
    pub indirect: Option<[Vec3; 2]>,
    /// Radiance of the pixel per irradiance of its footprint.
    pub gain: Vec3,
}

impl PixelMeans {
    /// Radiance per class, mean of the halves.
    #[must_use]
    pub fn class(&self, class: PathClass) -> Vec3 {
        0.5 * (self.halves[0].get(class) + self.halves[1].get(class))
    }

    /// Radiance of all classes, mean of the halves.
    #[must_use]
    pub fn total(&self) -> Vec3 {
        0.5 * (self.halves[0].total() + self.halves[1].total())
    }
}

/// One pixel: two independent halves, each an estimate of the same radiance, W·sr⁻¹·m⁻².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSums {
    /// Half A and half B.
    pub halves: [HalfSums; 2],
    /// Radiance per irradiance of the pixel's footprint, summed over the eye samples of both halves.
    pub gain: Vec3,
    /// Eye samples in each half.
    pub samples: u32,
    /// Those among them that went on from the first D as paths.
    pub paths: u32,
}

impl PixelSums {
    /// Scales what was looked up point by point, to the mean over the look-ups of a round.
    pub(crate) fn average_lookups(&mut self, factor: f32) {
        for half in &mut self.halves {
            half.classes.0[PathClass::Caustic as usize] *= factor;
        }
    }

    /// Scales all that photons brought by the round's weight.
    fn weigh_photons(&mut self, weight: f32, caustics: Caustics) {
        match caustics {
            Caustics::Photons | Caustics::Forward => self.average_lookups(weight),
            Caustics::Backward => {}
        }
        for half in &mut self.halves {
            half.irradiance *= weight;
        }
    }

    fn add(&mut self, other: &Self) {
        self.gain += other.gain;
        self.samples += other.samples;
        self.paths += other.paths;
        for (mine, theirs) in self.halves.iter_mut().zip(&other.halves) {
            mine.irradiance += theirs.irradiance;
            mine.indirect += theirs.indirect;
            mine.departures += theirs.departures;
            for (a, b) in mine.classes.0.iter_mut().zip(&theirs.classes.0) {
                *a += *b;
            }
        }
    }

    fn means(&self, photon_weight: f32, caustics: Caustics) -> PixelMeans {
        let per_sample = self.per_sample();
        let per_path = 1.0 / self.paths.max(1) as f32;
        let per_photon = if photon_weight > 0.0 { 1.0 / photon_weight } else { 0.0 };
        let gain = self.gain * (0.5 * per_sample);
        let irradiance = self.halves.map(|half| half.irradiance * per_photon);
        let factors = PathClass::ALL.map(|class| match class {
            PathClass::Emitted | PathClass::Direct => per_sample,
            PathClass::Indirect => per_path,
            PathClass::Caustic => match caustics {
                Caustics::Photons | Caustics::Forward => per_photon,
                Caustics::Backward => per_sample,
            },
        });
        let halves = std::array::from_fn(|half| {
            let sums = &self.halves[half].classes.0;
            let mut means = ClassSums(std::array::from_fn(|class| sums[class] * factors[class]));
            means.add(PathClass::Caustic, gain * irradiance[half]);
            means
        });
        let indirect = self.indirect_of(self.halves.map(|half| half.indirect));
        let mut means = PixelMeans { halves, irradiance, indirect, gain };
        for (half, indirect) in means.halves.iter_mut().zip(means.indirect.iter().flatten()) {
            half.add(PathClass::Indirect, gain * *indirect);
        }
        means
    }

    fn per_sample(&self) -> f32 {
        1.0 / self.samples.max(1) as f32
    }

    /// Means of what the paths of each half have found; `None` if there were none. A half without paths is told what the
    /// other has found.
    fn indirect_of(&self, sums: [Vec3; 2]) -> Option<[Vec3; 2]> {
        let mean = |half: usize| {
            let departures = self.halves[half].departures;
            (departures > 0).then(|| sums[half] / departures as f32)
        };
        let [a, b] = [mean(0), mean(1)];
        Some([a.or(b)?, b.or(a)?])
    }

    /// The class that holds a number that is not finite, if any.
    pub(crate) fn not_finite(&self) -> Option<PathClass> {
        let of_half = |half: &HalfSums| half.classes.total() + half.irradiance + half.indirect;
        if (self.gain + of_half(&self.halves[0]) + of_half(&self.halves[1])).is_finite() {
            return None;
        }
        PathClass::ALL
            .into_iter()
            .find(|&c| self.halves.iter().any(|h| !h.classes.get(c).is_finite()))
            .or_else(|| {
                let counted = self.gain + self.halves[0].irradiance + self.halves[1].irradiance;
                (!counted.is_finite()).then_some(PathClass::Caustic)
            })
            .or_else(|| {
                let counted = self.halves[0].indirect + self.halves[1].indirect;
                (!counted.is_finite()).then_some(PathClass::Indirect)
            })
    }
}

/// A square of pixels, or less at the right and at the bottom, in which a round is made; row by row.
pub struct Tile {
    /// What each pixel has gathered.
    pub(crate) pixels: Vec<PixelSums>,
    /// The named layers of each, one pixel after the other.
    pub(crate) layers: Vec<LayerSums>,
}

/// One round's estimate of every pixel, in tiles, row by row from the top.
pub struct RoundFilm {
    width: usize,
    side: usize,
    tiles: Vec<Tile>,
}

impl RoundFilm {
    /// Of tiles of this side.
    pub(crate) fn new(width: u32, side: u32, tiles: Vec<Tile>) -> Self {
        Self { width: width as usize, side: side as usize, tiles }
    }

    /// Adds to the caustic class of one half; row by row.
    pub(crate) fn add_caustics(&mut self, half: usize, radiance: &[DVec3]) {
        for (index, radiance) in radiance.iter().enumerate() {
            let (tile, pixel) = self.place(index);
            let sums = &mut self.tiles[tile].pixels[pixel].halves[half];
            sums.classes.add(PathClass::Caustic, radiance.as_vec3());
        }
    }

    /// The tile that holds a pixel of the picture, and the pixel's place in it.
    fn place(&self, index: usize) -> (usize, usize) {
        let (width, side) = (self.width, self.side);
        let (x, y) = (index % width, index / width);
        let across = side.min(width - x / side * side);
        (y / side * width.div_ceil(side) + x / side, y % side * across + x % side)
    }

    /// Adds tiles' values to those of the picture, of which each pixel has `each`.
    fn add_to<V: Send, T: Sync>(
        &self,
        sums: &mut [V],
        each: usize,
        of: impl Fn(&Tile) -> &[T] + Sync,
        add: impl Fn(&mut V, &T) + Sync,
    ) {
        let (row, side) = (self.width * each, self.side * each);
        if row == 0 {
            return;
        }
        let bands = sums.par_chunks_mut(row * self.side).zip(self.tiles.par_chunks(row.div_ceil(side)));
        bands.for_each(|(band, tiles)| {
            for (tile, start) in tiles.iter().zip((0..row).step_by(side)) {
                let across = side.min(row - start);
                for (line, from) in band.chunks_exact_mut(row).zip(of(tile).chunks_exact(across)) {
                    line[start..start + across].iter_mut().zip(from).for_each(|(sum, value)| add(sum, value));
                }
            }
        });
    }
}

/// The sum of finished rounds. Rounds are added in their order, one after the other, so that the same rounds
/// give the same bits; f32 suffices since a round's share of the sum is never below its rounding.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    rounds: u32,
    /// What the caustic class is a sum of: photons, by their weight, or eye samples.
    caustics: Caustics,
    /// Sum of the rounds' photon weights.
    photon_weight: f32,
    pixels: Vec<PixelSums>,
    /// The named layers of each pixel, one pixel after the other.
    layers: Vec<LayerSums>,
}

impl Film {
    /// An empty film, for caustics by this estimator, with this many named layers.
    #[must_use]
    pub fn new(width: u32, height: u32, caustics: Caustics, layers: usize) -> Self {
        let count = width as usize * height as usize;
        // In parallel, as it is the first to touch the memory.
        let pixels = rayon::iter::repeat_n(PixelSums::default(), count).collect();
        let layers = rayon::iter::repeat_n(LayerSums::default(), count * layers).collect();
        Self { width, height, rounds: 0, caustics, photon_weight: 0.0, pixels, layers }
    }

    /// Bytes a film of this size holds.
    #[must_use]
    pub fn bytes(width: u32, height: u32) -> u64 {
        u64::from(width) * u64::from(height) * size_of::<PixelSums>() as u64
    }

    /// Adds the next round, whose photons count `photon_weight` times those of the first.
    pub fn add_round(&mut self, round: &RoundFilm, photon_weight: f32) {
        self.rounds += 1;
        self.add(round, photon_weight);
    }

    /// Adds eye samples to the last round.
    pub fn add_samples(&mut self, samples: &RoundFilm) {
        self.add(samples, 0.0);
    }

    fn add(&mut self, round: &RoundFilm, photon_weight: f32) {
        self.photon_weight += photon_weight;
        let (caustics, each) = (self.caustics, self.layers.len() / self.pixels.len().max(1));
        let add = |sum: &mut PixelSums, pixel: &PixelSums| {
            let mut pixel = *pixel;
            pixel.weigh_photons(photon_weight, caustics);
            sum.add(&pixel);
        };
        round.add_to(&mut self.pixels, 1, |tile| &tile.pixels, add);
        let add = |sum: &mut LayerSums, layer: &LayerSums| sum.add(layer, photon_weight);
        round.add_to(&mut self.layers, each, |tile| &tile.layers, add);
    }

    /// Means of every pixel, row by row.
    pub fn means(&self) -> impl IndexedParallelIterator<Item = PixelMeans> + '_ {
        self.pixels.par_iter().map(|pixel| pixel.means(self.photon_weight, self.caustics))
    }

    /// The estimator of the caustics.
    #[must_use]
    pub fn caustics(&self) -> Caustics {
        self.caustics
    }

    /// Sum of the rounds' photon weights.
    #[must_use]
    pub fn photon_weight(&self) -> f32 {
        self.photon_weight
    }

    /// Number of rounds added.
    #[must_use]
    pub fn rounds(&self) -> u32 {
        self.rounds
    }

    /// All classes together, as they were gathered: nothing is smoothed.
    #[must_use]
    pub fn raw_image(&self) -> LinearImage {
        self.map(|means| means.total())
    }

    /// What is emitted to the eye, as it was gathered: [`Film::raw_layer`] without all the others.
    pub(crate) fn emitted(&self) -> Vec<Vec3> {
        let mean = |pixel: &PixelSums| {
            let [a, b] = pixel.halves.each_ref().map(|half| half.classes.get(PathClass::Emitted));
            (a + b) * (0.5 * pixel.per_sample())
        };
        self.pixels.par_iter().map(mean).collect()
    }

    /// One class, as it was gathered.
    #[must_use]
    pub fn raw_layer(&self, class: PathClass) -> LinearImage {
        self.map(|means| means.class(class))
    }

    /// All classes together in one of the two halves, as they were gathered.
    #[must_use]
    pub fn raw_half(&self, half: usize) -> LinearImage {
        self.map(|means| means.halves[half].total())
    }

    fn map(&self, value: impl Fn(&PixelMeans) -> Vec3 + Sync) -> LinearImage {
        let pixels = self.means().map(|means| value(&means).to_array()).collect();
        LinearImage { width: self.width, height: self.height, pixels }
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
}

#[cfg(test)]
mod tests {
    use super::*;

    /// F75: a number that is not finite is found in whatever class, and named.
    #[test]
    fn f75_what_is_not_finite_is_found_in_its_class() {
        assert_eq!(PixelSums::default().not_finite(), None);
        for class in PathClass::ALL {
            for wrong in [f32::NAN, f32::INFINITY] {
                let mut pixel = PixelSums::default();
                pixel.halves[1].classes.add(class, Vec3::new(0.0, wrong, 0.0));
                assert_eq!(pixel.not_finite(), Some(class));
            }
        }
        let mut pixel = PixelSums::default();
        pixel.halves[0].irradiance.z = f32::NAN;
        assert_eq!(pixel.not_finite(), Some(PathClass::Caustic));
        let mut pixel = PixelSums::default();
        pixel.halves[0].indirect.x = f32::INFINITY;
        assert_eq!(pixel.not_finite(), Some(PathClass::Indirect));
    }
}
