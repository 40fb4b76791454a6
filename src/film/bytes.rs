//! The film as bytes, for checkpoints.

use super::{Film, LayerSums, PixelSums};
use glam::Vec3;

impl Film {
    /// Raw values for a checkpoint: rounds, then every number.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(8 + self.pixels.len() * PixelSums::WORDS * 4);
        bytes.extend(self.rounds.to_le_bytes());
        bytes.extend(self.photon_weight.to_le_bytes());
        for pixel in &self.pixels {
            pixel.visit(|word| bytes.extend(word.to_le_bytes()));
        }
        for layer in &self.layers {
            layer.to_array().into_iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        }
        bytes
    }

    /// The film of [`Film::to_bytes`] for an empty one of the same kind; `None` if the length does not fit the size.
    #[must_use]
    pub fn read(&self, bytes: &[u8]) -> Option<Self> {
        let mut film = Self { rounds: 0, photon_weight: 0.0, ..self.clone() };
        let (rounds, rest) = bytes.split_first_chunk::<4>()?;
        let (photon_weight, values) = rest.split_first_chunk::<4>()?;
        let (pixels, layers) = values.split_at_checked(film.pixels.len() * PixelSums::WORDS * 4)?;
        if layers.len() != film.layers.len() * LayerSums::BYTES as usize {
            return None;
        }
        film.rounds = u32::from_le_bytes(*rounds);
        film.photon_weight = f32::from_le_bytes(*photon_weight);
        let mut words = pixels.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b));
        for pixel in &mut film.pixels {
            pixel.fill(|| words.next().unwrap_or(0));
        }
        let mut numbers = layers.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b));
        for layer in &mut film.layers {
            *layer = LayerSums::from_array(std::array::from_fn(|_| numbers.next().unwrap_or(0.0)));
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
            vector(half.indirect);
        }
        vector(self.gain);
        self.halves.iter().for_each(|half| word(half.departures));
        [self.samples, self.paths].into_iter().for_each(word);
    }

    /// The inverse of [`PixelSums::visit`].
    fn fill(&mut self, mut word: impl FnMut() -> u32) {
        let mut vector = || Vec3::from_array(std::array::from_fn(|_| f32::from_bits(word())));
        for half in &mut self.halves {
            half.classes.0.iter_mut().for_each(|v| *v = vector());
            half.irradiance = vector();
            half.indirect = vector();
        }
        self.gain = vector();
        self.halves.iter_mut().for_each(|half| half.departures = word());
        (self.samples, self.paths) = (word(), word());
    }
}
