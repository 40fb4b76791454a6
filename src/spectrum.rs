//! Wavelengths, for the chains of light that a dispersive glass takes apart, and their colours.
//!
//! A scene's light is RGB. Each channel is taken for a band of wavelengths whose shape is the sensitivity of an eye
//! that sees linear sRGB; where it sees less than nothing, nothing. Light that meets a dispersive glass picks a
//! wavelength with the mean of the three sensitivities as its density, and each channel is weighted by its own
//! sensitivity over that mean: on average over wavelengths every channel keeps its light.

use glam::Vec3;
use std::sync::LazyLock;

/// Ends of the visible spectrum, μm.
pub const VISIBLE: [f32; 2] = [0.38, 0.72];

/// Steps of the tables: finer than the sensitivities' details by far.
const STEPS: usize = 512;

/// One wavelength picked out of white light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Wavelength, μm.
    pub wavelength: f32,
    /// Weight per channel; their mean is 1.
    pub weight: Vec3,
}

/// Sensitivities and their sums at the steps' ends.
struct Tables {
    /// Mean sensitivity summed up to each step, 0 to 1.
    sums: [f32; STEPS + 1],
    /// Weight per channel in each step.
    weights: [Vec3; STEPS],
}

static TABLES: LazyLock<Tables> = LazyLock::new(Tables::new);

/// The wavelength at `u` of 0..1 in the distribution of wavelengths.
#[must_use]
pub fn pick(u: f32) -> Line {
    let tables = &*TABLES;
    let after = tables.sums.partition_point(|&sum| sum <= u).clamp(1, STEPS);
    let (low, high) = (tables.sums[after - 1], tables.sums[after]);
    let within = if high > low { ((u - low) / (high - low)).clamp(0.0, 1.0) } else { 0.5 };
    let at = (after - 1) as f32 + within;
    let wavelength = VISIBLE[0] + (VISIBLE[1] - VISIBLE[0]) * (at / STEPS as f32);
    Line { wavelength, weight: tables.weights[after - 1] }
}

impl Tables {
    fn new() -> Self {
        let width = (VISIBLE[1] - VISIBLE[0]) / STEPS as f32;
        let raw: [Vec3; STEPS] = std::array::from_fn(|i| sensitivity(VISIBLE[0] + width * (i as f32 + 0.5)));
        let total: Vec3 = raw.iter().sum();
        let even: [Vec3; STEPS] = raw.map(|s| s / total);
        let mean = |s: Vec3| s.element_sum() / 3.0;
        let mut sums = [0.0; STEPS + 1];
        for (i, s) in even.iter().enumerate() {
            sums[i + 1] = sums[i] + mean(*s);
        }
        let weights = even.map(|s| if mean(s) > 0.0 { s / mean(s) } else { Vec3::ONE });
        Self { sums, weights }
    }
}

/// Sensitivity of the three channels of linear sRGB at a wavelength in μm, not below zero.
fn sensitivity(wavelength: f32) -> Vec3 {
    let nm = wavelength * 1000.0;
    // The CIE 1931 colour matching functions as sums of Gaussian lobes (Wyman, Sloan and Shirley 2013).
    let lobe = |height: f32, center: f32, left: f32, right: f32| {
        let t = (nm - center) * if nm < center { left } else { right };
        height * libm::expf(-0.5 * t * t)
    };
    let x = lobe(0.362, 442.0, 0.0624, 0.0374)
        + lobe(1.056, 599.8, 0.0264, 0.0323)
        + lobe(-0.065, 501.1, 0.0490, 0.0382);
    let y = lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322);
    let z = lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725);
    let rgb = Vec3::new(
        3.2406 * x - 1.5372 * y - 0.4986 * z,
        -0.9689 * x + 1.8758 * y + 0.0415 * z,
        0.0557 * x - 0.2040 * y + 1.0570 * z,
    );
    rgb.max(Vec3::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of the weights over the distribution is 1 in every channel: white stays white. The midpoint rule over
    /// 2^16 points is off by less than one part in 2^16 per step of the tables.
    #[test]
    fn white_light_taken_apart_is_white_again() {
        let n = 1 << 16;
        let mean: Vec3 = (0..n).map(|i| pick((i as f32 + 0.5) / n as f32).weight).sum::<Vec3>() / n as f32;
        assert!((mean - Vec3::ONE).abs().max_element() < 2e-3, "{mean}");
    }

    #[test]
    fn the_ends_of_the_spectrum_are_red_and_violet() {
        let red = pick(0.999).weight;
        assert!(red.x > 2.5 && red.y < 0.3 && red.z < 0.1, "{red}");
        let blue = pick(0.1).weight;
        assert!(blue.z > 2.0, "{blue}");
        let (first, last) = (pick(0.0).wavelength, pick(1.0).wavelength);
        assert!(first >= VISIBLE[0] && last <= VISIBLE[1] + 1e-6, "{first} {last}");
    }
}
