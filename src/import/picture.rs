//! Pictures of a model: taken over as they are, multiplied by a factor, or only their mean.

use super::container::Model;
use super::{Import, short3};
use crate::develop::{srgb_to_linear, to_byte};
use crate::scene::texture::decode_rgb8;
use glam::DVec3;
use gltf::image::Source;
use gltf::texture::WrappingMode;
use image::{ExtendedColorType, ImageEncoder, ImageFormat};
use serde_json::{Value, json};

/// Most pixels of a picture that has to be looked into.
const MAX_PIXELS: u64 = 1 << 26;

impl Import {
    /// An albedo of a picture times a factor; only the factor where the picture cannot be read.
    pub(super) fn textured(
        &mut self,
        model: &Model,
        info: &gltf::texture::Info<'_>,
        factor: [f32; 3],
    ) -> Value {
        let sampler = info.texture().sampler();
        if [sampler.wrap_s(), sampler.wrap_t()].iter().any(|wrap| *wrap != WrappingMode::Repeat) {
            self.warn("wrap_ignored", "pictures always repeat, other ways to wrap are not read");
        }
        let image = info.texture().source();
        let key = (image.index(), factor.map(f32::to_bits));
        if let Some(known) = self.pictures.get(&key) {
            return known.clone();
        }
        let albedo = match self.bytes(model, &image).and_then(|bytes| tinted(bytes, factor)) {
            Some((extension, bytes)) => {
                let stem = image.name().map_or_else(|| format!("image-{}", image.index()), str::to_owned);
                json!({ "image": self.keep(&stem, extension, bytes) })
            }
            None => {
                self.warn("image_ignored", format!("picture {} cannot be read", image.index()));
                short3(factor)
            }
        };
        self.pictures.insert(key, albedo.clone());
        albedo
    }

    /// Mean of a picture's channels, linear if they are a colour.
    pub(super) fn mean(&mut self, model: &Model, info: &gltf::texture::Info<'_>, color: bool) -> [f32; 3] {
        let image = info.texture().source();
        let decoded = self.bytes(model, &image).and_then(|(_, bytes)| decode_rgb8(bytes, MAX_PIXELS).ok());
        let Some(decoded) = decoded else {
            self.warn("image_ignored", format!("picture {} cannot be read", image.index()));
            return [1.0; 3];
        };
        let value = |byte: u8| {
            let x = f64::from(byte) / 255.0;
            if color { srgb_to_linear(x) } else { x }
        };
        let table: Vec<f64> = (0..=255).map(value).collect();
        let of = |pixel: &image::Rgb<u8>| DVec3::from(pixel.0.map(|byte| table[usize::from(byte)]));
        let sum: DVec3 = decoded.pixels().map(of).sum();
        (sum / f64::from(decoded.width()) / f64::from(decoded.height())).to_array().map(|x| x as f32)
    }

    /// The file of a picture that lies within the model.
    fn bytes<'m>(&self, model: &'m Model, image: &gltf::Image<'_>) -> Option<(&'static str, &'m [u8])> {
        let Source::View { view, .. } = image.source() else { return None };
        let bytes = model.view(&view);
        match image::guess_format(bytes).ok()? {
            ImageFormat::Png => Some(("png", bytes)),
            ImageFormat::Jpeg => Some(("jpg", bytes)),
            _ => None,
        }
    }
}

/// The picture as it is, or multiplied by the factor and encoded anew.
fn tinted((extension, bytes): (&'static str, &[u8]), factor: [f32; 3]) -> Option<(&'static str, Vec<u8>)> {
    if factor == [1.0; 3] {
        return Some((extension, bytes.to_vec()));
    }
    let mut picture = decode_rgb8(bytes, MAX_PIXELS).ok()?;
    let tables = factor.map(|factor| {
        let tint = |byte: usize| {
            let linear = srgb_to_linear(byte as f64 / 255.0) * f64::from(factor.clamp(0.0, 1.0));
            to_byte(linear)
        };
        (0..256).map(tint).collect::<Vec<u8>>()
    });
    for pixel in picture.pixels_mut() {
        for (byte, table) in pixel.0.iter_mut().zip(&tables) {
            *byte = table[usize::from(*byte)];
        }
    }
    let mut encoded = Vec::new();
    image::codecs::png::PngEncoder::new(&mut encoded)
        .write_image(&picture, picture.width(), picture.height(), ExtendedColorType::Rgb8)
        .ok()?;
    Some(("png", encoded))
}
