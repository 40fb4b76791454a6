//! The radius of the density estimate, in multiples of the pixel's width at the receiver.

/// How the radius depends on the round.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum RadiusRule {
    /// Photons are counted on each pixel's own footprint and smoothed as wide as their halves advise; where a
    /// pixel has no footprint, a kernel of about a pixel, the same in every round.
    #[default]
    Pixel,
    /// A kernel around random points of the pixel, wide at first and shrinking from round to round, so that noise
    /// and blur both vanish in the limit (Knaus and Zwicker 2011, α = 2/3); nothing is smoothed: the classic
    /// progressive photon map, for comparison.
    Progressive,
}

/// Radius of [`RadiusRule::Pixel`].
const PIXEL: f64 = 0.7;

/// First radius of [`RadiusRule::Progressive`]; the literature starts at several pixels.
const PROGRESSIVE_START: f64 = 4.0;

/// The share of new photons that is kept when the radius shrinks.
const ALPHA: f64 = 2.0 / 3.0;

impl RadiusRule {
    /// Every value and its name.
    pub const NAMED: [(&str, Self); 2] = [("pixel", Self::Pixel), ("progressive", Self::Progressive)];

    /// Radius in pixels in a round, counted from 0.
    #[must_use]
    pub fn pixels(self, round: u32) -> f64 {
        match self {
            Self::Pixel => PIXEL,
            Self::Progressive => PROGRESSIVE_START * progressive_shrink(round),
        }
    }
}

/// Radius of round `round` (from 0) over that of the first: r²ᵢ₊₁ / r²ᵢ = (i + α) / (i + 1), i from 1.
#[must_use]
pub fn progressive_shrink(round: u32) -> f64 {
    let squared: f64 = (1..=u64::from(round)).map(|i| (i as f64 + ALPHA) / (i as f64 + 1.0)).product();
    squared.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// T41: the radius after 10, 100, 1000 and 10,000 rounds; four digits are given.
    #[test]
    fn t41_the_progressive_radius_shrinks_as_knaus_and_zwicker_say() {
        for (rounds, expected) in [(10, 0.7022), (100, 0.4874), (1000, 0.3328), (10_000, 0.2267)] {
            let radius = progressive_shrink(rounds);
            assert!((radius - expected).abs() < 6e-5, "{rounds}: {radius}");
        }
    }
}
