//! How far the density estimate reaches for photons.

/// How the reach depends on the round.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum RadiusRule {
    /// Photons are counted on each pixel's own footprint and smoothed as wide as their halves advise; where a
    /// pixel has no footprint, a kernel of about a pixel, the same in every round.
    #[default]
    Pixel,
    /// A kernel around random points of the pixel, wide at first and shrinking from round to round, so that noise
    /// and blur both vanish in the limit (Knaus and Zwicker 2011, α = 2/3); nothing is smoothed: the classic
    /// progressive photon map, for comparison.
    Progressive,
    /// All photons within a distance count alike (the photon map with a fixed search radius), for comparison.
    Fixed {
        /// The distance, m.
        radius: f32,
    },
    /// So many of the nearest photons count (Jensen 1996), for comparison.
    Nearest {
        /// Their number, at least 2.
        count: u32,
        /// None further away than this, m.
        most: f32,
    },
}

/// How far the look-ups of one round reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reach {
    /// A kernel of this many pixels' widths.
    Pixels(f32),
    /// A disc of this radius, m.
    Disc(f32),
    /// So many of the nearest photons, at least 2.
    Nearest {
        /// Their number.
        count: usize,
        /// None further away than this, m.
        most: f32,
    },
}

/// Radius of [`RadiusRule::Pixel`]; also the least of [`RadiusRule::Nearest`].
pub(crate) const PIXEL: f64 = 0.7;

/// First radius of [`RadiusRule::Progressive`]; the literature starts at several pixels.
const PROGRESSIVE_START: f64 = 4.0;

/// Its last: a blur of less than a pixel is not seen, and costs noise.
const PROGRESSIVE_LEAST: f64 = 0.5;

/// The share of new photons that is kept when the radius shrinks.
const ALPHA: f64 = 2.0 / 3.0;

impl RadiusRule {
    /// The values that have no numbers, and their names.
    pub const NAMED: [(&str, Self); 2] = [("pixel", Self::Pixel), ("progressive", Self::Progressive)];

    /// Radius in pixels in a round, counted from 0, where it is measured in pixels.
    #[must_use]
    pub fn pixels(self, round: u32) -> Option<f64> {
        match self {
            Self::Pixel => Some(PIXEL),
            Self::Progressive => Some((PROGRESSIVE_START * progressive_shrink(round)).max(PROGRESSIVE_LEAST)),
            Self::Fixed { .. } | Self::Nearest { .. } => None,
        }
    }

    /// How far the look-ups of a round reach, counted from 0.
    #[must_use]
    pub fn reach(self, round: u32) -> Reach {
        match self {
            Self::Pixel | Self::Progressive => Reach::Pixels(self.pixels(round).unwrap_or(PIXEL) as f32),
            Self::Fixed { radius } => Reach::Disc(radius),
            Self::Nearest { count, most } => Reach::Nearest { count: count as usize, most },
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

    /// F64: however many rounds there are, the radius stays a good part of a pixel.
    #[test]
    fn f64_the_progressive_radius_does_not_shrink_to_nothing() {
        let radius = |round| RadiusRule::Progressive.pixels(round).unwrap();
        assert_eq!((radius(0), radius(1_000_000)), (PROGRESSIVE_START, PROGRESSIVE_LEAST));
        assert!(radius(1000) > radius(2000));
    }
}
