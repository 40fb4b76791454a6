//! Pictures in Radiance files (`.hdr`): linear, with an exponent that the three channels share.

use super::{ImageError, LinearImage, check_size};
use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Reads a Radiance file of at most `most_pixels` pixels.
pub(super) fn decode(bytes: &[u8], most_pixels: u64) -> Result<LinearImage, ImageError> {
    let malformed =
        |error: image::ImageError| ImageError::Malformed { format: "HDR", reason: error.to_string() };
    // Not strict: the signature of many files is `#?RGBE`.
    let decoder = HdrDecoder::new_nonstrict(bytes).map_err(malformed)?;
    let (width, height) = decoder.dimensions();
    let (width, height) = check_size(width as usize, height as usize, most_pixels)?;
    // The values are those of the scene times the exposure, if the header has one.
    let exposure = decoder.metadata().exposure.filter(|e| e.is_finite() && *e > 0.0).unwrap_or(1.0);
    let mut raw = vec![0; decoder.total_bytes() as usize];
    // Runs of length zero make this decoder (image 0.25.10) multiply beyond 64 bits, which is a panic in builds that check
    // for it.
    let read = catch_unwind(AssertUnwindSafe(|| decoder.read_image(&mut raw)));
    let too_long = ImageError::Malformed { format: "HDR", reason: "a run of pixels is too long".to_owned() };
    read.map_err(|_| too_long)?.map_err(malformed)?;
    let value = |b: &[u8]| b.first_chunk().map_or(0.0, |b| f32::from_ne_bytes(*b)) / exposure;
    let pixels = raw.chunks_exact(12).map(|p| [value(p), value(&p[4..]), value(&p[8..])]).collect();
    Ok(LinearImage { width, height, pixels })
}
