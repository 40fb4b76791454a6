//! The named layers of a film: parts of the picture that are summed beside it.

use super::{Film, PixelSums, RoundFilm, Tile};
use crate::image_io::LinearImage;
use crate::smooth::Gathered;
use glam::{DVec3, Vec3};

/// What both halves of a pixel have gathered for one named layer; sums as in [`HalfSums`](super::HalfSums).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LayerSums {
    /// Radiance that eye samples bring.
    pub sampled: Vec3,
    /// Radiance that those bring which go on as paths, from other D.
    pub bounced: Vec3,
    /// Radiance by photons that were looked up point by point.
    pub looked_up: Vec3,
    /// Irradiance that photons bring to the pixel's footprint.
    pub irradiance: Vec3,
    /// Irradiance that other D bring to it, in each half.
    pub indirect: [Vec3; 2],
}

impl LayerSums {
    /// Bytes of one.
    pub const BYTES: u64 = size_of::<Self>() as u64;

    pub(super) fn to_array(self) -> [f32; 18] {
        let [a, b] = self.indirect;
        let parts =
            [self.sampled, self.bounced, self.looked_up, self.irradiance, a, b].map(|part| part.to_array());
        std::array::from_fn(|i| parts[i / 3][i % 3])
    }

    pub(super) fn from_array(values: [f32; 18]) -> Self {
        let part = |i: usize| Vec3::from_slice(&values[3 * i..]);
        Self {
            sampled: part(0),
            bounced: part(1),
            looked_up: part(2),
            irradiance: part(3),
            indirect: [part(4), part(5)],
        }
    }

    /// Adds those of a round, whose photons count `photon_weight` times those of the first.
    pub(super) fn add(&mut self, round: &Self, photon_weight: f32) {
        self.sampled += round.sampled;
        self.bounced += round.bounced;
        self.looked_up += round.looked_up * photon_weight;
        self.irradiance += round.irradiance * photon_weight;
        for (mine, theirs) in self.indirect.iter_mut().zip(round.indirect) {
            *mine += theirs;
        }
    }

    /// Irradiance that other D bring to the pixel's footprint, mean of the halves.
    fn indirect_mean(&self, pixel: &PixelSums) -> Vec3 {
        let [a, b] = pixel.indirect_of(self.indirect).unwrap_or_default();
        0.5 * (a + b)
    }
}

impl RoundFilm {
    /// Adds what photons connected to the eye bring to a layer, in either half; row by row.
    pub(crate) fn add_to_layer(&mut self, layer: usize, radiance: &[DVec3]) {
        for (index, radiance) in radiance.iter().enumerate() {
            let (tile, pixel) = self.place(index);
            let Tile { pixels, layers } = &mut self.tiles[tile];
            let each = layers.len() / pixels.len();
            layers[pixel * each + layer].looked_up += radiance.as_vec3();
        }
    }
}

impl Film {
    /// A named layer, as it was gathered.
    #[must_use]
    pub fn named_layer(&self, index: usize) -> LinearImage {
        let each = self.layers.len() / self.pixels.len().max(1);
        let per_photon = if self.photon_weight > 0.0 { 0.5 / self.photon_weight } else { 0.0 };
        let value = |(sums, pixel): (&[LayerSums], &PixelSums)| {
            let LayerSums { sampled, bounced, looked_up, irradiance, .. } = sums[index];
            let [per_sample, per_path] = [pixel.samples, pixel.paths].map(|n| 0.5 / n.max(1) as f32);
            let gain = pixel.gain * per_sample;
            let photons = gain * irradiance + looked_up;
            let indirect = bounced * per_path + gain * sums[index].indirect_mean(pixel);
            (sampled * per_sample + indirect + photons * per_photon).to_array()
        };
        let pixels = self.layers.chunks_exact(each).zip(&self.pixels).map(value).collect();
        LinearImage { width: self.width, height: self.height, pixels }
    }

    /// The part of a named layer in what is smoothed, mean of the halves: irradiance of the pixels that have a footprint,
    /// radiance of the others.
    #[must_use]
    pub fn layer_part(
        &self,
        index: usize,
        gathered: Gathered,
        has_footprint: impl Fn(usize) -> bool,
    ) -> Vec<Vec3> {
        let each = self.layers.len() / self.pixels.len().max(1);
        let per_photon = if self.photon_weight > 0.0 { 0.5 / self.photon_weight } else { 0.0 };
        let part = |(i, (layers, pixel)): (usize, (&[LayerSums], &PixelSums))| {
            let sums = &layers[index];
            match (gathered, has_footprint(i)) {
                (Gathered::Photons, true) => sums.irradiance * per_photon,
                (Gathered::Photons, false) => sums.looked_up * per_photon,
                (Gathered::Indirect, true) => sums.indirect_mean(pixel),
                (Gathered::Indirect, false) => sums.bounced * (0.5 / pixel.paths.max(1) as f32),
            }
        };
        self.layers.chunks_exact(each).zip(&self.pixels).enumerate().map(part).collect()
    }
}
