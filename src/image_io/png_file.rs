//! Pictures in PNG files: developed for a display, 8 bits per channel.

use super::{ImageError, LinearImage, MAX_SIDE};
use crate::develop::{develop, srgb_to_linear};
use crate::scene::ImageSettings;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, ImageReader, Limits};
use std::io::Cursor;

/// The picture as a PNG file, exposed, tone-mapped and sRGB-encoded.
///
/// # Errors
/// If the picture is empty or a pixel is not finite.
pub fn encode_png(image: &LinearImage, settings: &ImageSettings) -> Result<Vec<u8>, ImageError> {
    image.check()?;
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(&develop(image, settings), image.width, image.height, ExtendedColorType::Rgb8)
        .map_err(|error| ImageError::Encode(error.to_string()))?;
    Ok(bytes)
}

/// Reads a PNG of 8 or 16 bits; an alpha channel is left out.
pub(super) fn decode(bytes: &[u8]) -> Result<LinearImage, ImageError> {
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE as u32);
    limits.max_image_height = Some(MAX_SIDE as u32);
    let mut reader = ImageReader::with_format(Cursor::new(bytes), image::ImageFormat::Png);
    reader.limits(limits);
    let image = reader
        .decode()
        .map_err(|error| ImageError::Malformed { format: "PNG", reason: error.to_string() })?
        .into_rgb16();
    let linear = |x: u16| srgb_to_linear(f64::from(x) / f64::from(u16::MAX)) as f32;
    let pixels = image.pixels().map(|pixel| pixel.0.map(linear)).collect();
    Ok(LinearImage { width: image.width(), height: image.height(), pixels })
}
