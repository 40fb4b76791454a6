//! From linear radiance to the numbers of a display: exposure, tone curve, sRGB.

use crate::image_io::LinearImage;
use crate::scene::{ImageSettings, Tone};
use rayon::prelude::*;
use std::sync::LazyLock;

/// The picture as 8-bit sRGB, three bytes per pixel, top row first. Pixels must be finite; NaN becomes 0.
#[must_use]
pub fn develop(image: &LinearImage, settings: &ImageSettings) -> Vec<u8> {
    let gain = libm::exp2(f64::from(settings.exposure));
    let byte = |x: f32| to_byte(shown(x, gain, settings.tone));
    let pixels: Vec<[u8; 3]> = image.pixels.par_iter().map(|pixel| pixel.map(byte)).collect();
    pixels.into_flattened()
}

/// How much light the display is asked for, of which it gives 1 at most.
pub(crate) fn shown(x: f32, gain: f64, tone: Tone) -> f64 {
    let exposed = f64::from(x) * gain;
    match tone {
        Tone::Linear => exposed,
        Tone::Filmic => tone_filmic(exposed),
    }
}

/// The ACES-like fit of Narkowicz (2015), which maps 0..∞ to 0..1.
pub(crate) fn tone_filmic(x: f64) -> f64 {
    // Above this the curve is flat, and the squares below may overflow.
    let x = x.clamp(0.0, 1e6);
    (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)
}

/// The nearest code of the sRGB curve, by looking for the value among those at which the code changes: exact,
/// and several times as fast as the curve's power.
pub(crate) fn to_byte(linear: f64) -> u8 {
    THRESHOLDS.partition_point(|&threshold| threshold <= linear) as u8
}

/// The linear values from which on the codes 1 to 255 are nearest.
static THRESHOLDS: LazyLock<[f64; 255]> =
    LazyLock::new(|| std::array::from_fn(|code| srgb_to_linear((code as f64 + 0.5) / 255.0)));

/// The inverse of the sRGB curve (IEC 61966-2-1), 0..1 to 0..1.
#[must_use]
pub fn srgb_to_linear(x: f64) -> f64 {
    if x <= 0.040_45 { x / 12.92 } else { libm::pow((x + 0.055) / 1.055, 2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(value: f32, exposure: f32, tone: Tone) -> u8 {
        let image = LinearImage { width: 1, height: 1, pixels: vec![[value; 3]] };
        develop(&image, &ImageSettings { width: 1, height: 1, exposure, tone })[0]
    }

    #[test]
    fn t43_the_srgb_curve_is_the_standard_one() {
        for (linear, byte) in [(0.18, 118), (0.5, 188), (1.0, 255), (0.0, 0), (-1.0, 0), (9.0, 255)] {
            assert_eq!(shown(linear, 0.0, Tone::Linear), byte, "{linear}");
        }
    }

    #[test]
    fn one_stop_doubles_the_light() {
        assert_eq!(shown(0.25, 1.0, Tone::Linear), 188);
        assert_eq!(shown(1.0, -1.0, Tone::Linear), 188);
    }

    #[test]
    fn every_byte_survives_the_way_to_linear_and_back() {
        for byte in 0..=255 {
            assert_eq!(shown(srgb_to_linear(f64::from(byte) / 255.0) as f32, 0.0, Tone::Linear), byte);
        }
    }

    #[test]
    fn the_filmic_curve_rises_and_never_passes_white() {
        let bytes: Vec<u8> =
            [0.0, 0.1, 0.5, 1.0, 4.0, f32::MAX].map(|x| shown(x, 0.0, Tone::Filmic)).to_vec();
        assert!(bytes.is_sorted(), "{bytes:?}");
        // Narkowicz's curve gives 2.54 / 3.16 = 0.8038 at 1, which sRGB shows as 231.6.
        assert_eq!((bytes[0], bytes[3], bytes[5]), (0, 232, 255));
    }
}
