//! Pixels at borders: what was looked up around their eye samples, or what the pixels beside them lend.
//!
//! A look-up holds a handful of photons; what is lent is smoothed, but lies a pixel or two aside. With L what was looked up
//! and b what is borrowed, the halves of the film estimate the squared bias of borrowing, (L_A - b_A)(L_B - b_B), and the
//! noise of looking up, (L_A - L_B)²/4, both without bias. A pixel borrows until the bias stands out from the noise beyond
//! doubt: where photons are few, a spike in both halves looks like bias and not like noise, and to look up then would make
//! the picture brighter. For the same reason the noise is taken to be at least that of the lender's own few photons.

use super::ladder::Sums;
use super::{Sample, mean_channel};
use crate::film::{Film, Loan};
use glam::Vec3;

/// Half width of the window over which both are averaged, in pixels.
const WINDOW: usize = 8;

/// Looking up must have a squared error so many times less,
const CLEARLY: f64 = 2.0;

/// and the bias must be so many standard errors that mere noise would give it.
const SURE: f64 = 3.0;

/// What a pixel's irradiance is to those that borrow it.
pub(super) struct Lent {
    /// What smoothing adds to it.
    pub(super) change: Vec3,
    /// Estimated squared error that is left, mean over channels.
    pub(super) squared_error: f32,
}

impl Lent {
    /// Where nothing is smoothed.
    pub(super) fn raw(sample: &Sample) -> Self {
        let half = 0.5 * (sample.irradiance[0] - sample.irradiance[1]);
        Self { change: Vec3::ZERO, squared_error: mean_channel(half * half) }
    }
}

/// A pixel that borrows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Borrower {
    /// The pixel.
    pub pixel: u32,
    /// To be added to its caustic radiance.
    pub correction: Vec3,
    /// Estimated squared error of what is borrowed, mean over channels.
    pub squared_error: f32,
    /// Half the difference of the halves of what was looked up and is no more.
    pub replaced: Vec3,
    /// Half the difference of the halves that the places of the eye samples make.
    pub coverage: Vec3,
}

/// A pixel that may borrow.
#[derive(Clone, Copy)]
struct Border {
    borrower: Borrower,
    /// Weighted squared bias and noise.
    bias: f32,
    noise: f32,
    /// One over the squared radiance that errors are relative to.
    weight: f32,
}

/// The pixels that do better to borrow, in their order.
pub(super) fn borrowers(film: &Film, samples: &[Sample], lent: &[Lent], floor: f32) -> Vec<Borrower> {
    let borders: Vec<Border> = film
        .loans()
        .chunk_by(|a, b| a.borrower == b.borrower)
        .map(|loans| Border::new(film, loans, (samples, lent), floor))
        .collect();
    let size = film.size();
    let plane = |value: &dyn Fn(&Border) -> f32| {
        let mut plane = vec![0.0; samples.len()];
        borders.iter().for_each(|border| plane[border.borrower.pixel as usize] = f64::from(value(border)));
        Sums::new(size, plane.into_iter())
    };
    let bias = plane(&|border| border.bias);
    let noise = plane(&|border| border.noise);
    // The variance of a product of two halves without bias, whose own variances are twice that of their mean.
    let spread = plane(&|border| (2.0 * border.noise).powi(2));
    let counts = plane(&|_| 1.0);
    let choose = |border: &Border| {
        let mut borrower = border.borrower;
        let at = (borrower.pixel as usize % size.0, borrower.pixel as usize / size.0);
        let around = bias.around(at, WINDOW);
        borrower.squared_error += (around / counts.around(at, WINDOW)).max(0.0) as f32 / border.weight;
        let biased = around > CLEARLY * noise.around(at, WINDOW)
            && around > SURE * spread.around(at, WINDOW).max(0.0).sqrt();
        (!biased).then_some(borrower)
    };
    borders.iter().filter(|border| border.weight > 0.0).filter_map(choose).collect()
}

impl Border {
    fn new(film: &Film, loans: &[Loan], (samples, lent): (&[Sample], &[Lent]), floor: f32) -> Self {
        let pixel = loans[0].borrower;
        let (mut looked_up, mut borrowed) = ([Vec3::ZERO; 2], [Vec3::ZERO; 2]);
        let (mut smooth, mut coverage) = (Vec3::ZERO, Vec3::ZERO);
        let (mut squared_error, mut least_noise) = (0.0, 0.0);
        for loan in loans {
            let (gain, found) = (film.gain(loan), film.looked_up(loan));
            let (sample, lent) = (&samples[loan.lender as usize], &lent[loan.lender as usize]);
            for half in 0..2 {
                looked_up[half] += found[half];
                borrowed[half] += gain[half] * sample.irradiance[half];
            }
            let mean_gain = 0.5 * (gain[0] + gain[1]);
            let irradiance = 0.5 * (sample.irradiance[0] + sample.irradiance[1]) + lent.change;
            smooth += mean_gain * irradiance;
            coverage += 0.5 * (gain[0] - gain[1]) * irradiance;
            squared_error += lent.squared_error * mean_channel(mean_gain * mean_gain);
            least_noise += Lent::raw(sample).squared_error * mean_channel(mean_gain * mean_gain);
        }
        let radiance = mean_channel(samples[pixel as usize].rest) + floor;
        let weight = if radiance > 0.0 { radiance.powi(-2) } else { 0.0 };
        let replaced = 0.5 * (looked_up[0] - looked_up[1]);
        let bias = mean_channel((looked_up[0] - borrowed[0]) * (looked_up[1] - borrowed[1])) * weight;
        let noise = mean_channel(replaced * replaced).max(least_noise) * weight;
        let correction = smooth - 0.5 * (looked_up[0] + looked_up[1]);
        let borrower = Borrower { pixel, correction, squared_error, replaced, coverage };
        Self { borrower, bias, noise, weight }
    }
}
