//! The error of a picture against a reference that has noise of its own, told from two halves that share no random number.

use super::Reference;
use crate::compare::{CompareError, compare};
use crate::image_io::LinearImage;

/// An error is told if its square is this many times the standard error that the reference's noise gives it.
const TOLD: f64 = 3.0;

/// Side of the squares of pixels whose noise is estimated together.
const TILE: usize = 8;

/// Weight of the mean's square beside that of the pixel in a relative error, as in [`crate::compare::Comparison::relmse`].
const RELATIVE_FLOOR: f64 = 0.01;

/// How far a picture is from the truth that a reference estimates.
///
/// With halves A and B whose noise is independent and without bias, (x - A)(x - B) is in the mean the square of the picture's
/// own error: the reference's noise adds to its spread alone. So errors far below the reference's own can be told, since the
/// spread falls with the number of pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// Root mean square error over the mean of the reference; 0 where chance made the square negative.
    pub error: f64,
    /// The same with each pixel relative to itself, as the renderer's own estimate is: root of the mean of
    /// (x - A)(x - B) / (r² + (0.1 mean)²).
    pub relative: f64,
    /// False if the square of the error is less than three times its standard error.
    pub told: bool,
}

impl Reference {
    /// How a picture differs from what this reference estimates.
    ///
    /// # Errors
    /// If it has another size, or is not finite.
    pub fn judge(&self, image: &LinearImage) -> Result<Judgement, CompareError> {
        // Sizes and finite values are checked there.
        compare(image, &self.image, self.mask.as_deref())?;
        let mean = self.mean();
        let (mut squares, mut relative, mut variance, mut count) = (0.0, 0.0, 0.0, 0.0);
        for tile in self.tiles() {
            let mut square = 0.0;
            for &index in &tile {
                let [a, b] = self.pixel(index);
                let product = |c: usize| {
                    let x = f64::from(image.pixels[index][c]);
                    (x - a[c]) * (x - b[c])
                };
                let reference = self.image.pixels[index].map(f64::from);
                let over = |c: usize| product(c) / (reference[c].powi(2) + RELATIVE_FLOOR * mean * mean);
                square += of_channels(product);
                relative += of_channels(over);
            }
            squares += square;
            variance += self.noise(&tile, square);
            count += tile.len() as f64;
        }
        Ok(Judgement {
            error: (squares / count).max(0.0).sqrt() / mean,
            relative: (relative / count).max(0.0).sqrt(),
            told: squares > TOLD * variance.sqrt(),
        })
    }

    /// The smallest error that this reference tells: that of a picture of which the noise alone is seen.
    #[must_use]
    pub fn floor(&self) -> f64 {
        let variance: f64 = self.tiles().map(|tile| self.noise(&tile, 0.0)).sum();
        let count = self.tiles().map(|tile| tile.len()).sum::<usize>() as f64;
        (TOLD * variance.sqrt() / count).sqrt() / self.mean()
    }

    /// What the reference's noise adds to the variance of the sum of (x - A)(x - B) over a tile, where that was found to be
    /// `square`. With x off by d and A and B by u and v, a product is d² - d(u + v) + uv, of variance 2 d² σ² + σ⁴. The square of
    /// A - B is 2 σ² in the mean; over a tile, since a single bright path in one half is the luck of one pixel of many.
    fn noise(&self, tile: &[usize], square: f64) -> f64 {
        let difference = |&index: &usize| {
            let [a, b] = self.pixel(index);
            of_channels(|c| (a[c] - b[c]).powi(2))
        };
        let count = tile.len() as f64;
        let variance = tile.iter().map(difference).sum::<f64>() / (2.0 * count.max(1.0));
        2.0 * square.max(0.0) * variance + count * variance * variance
    }

    fn pixel(&self, index: usize) -> [[f64; 3]; 2] {
        [0, 1].map(|half: usize| self.halves[half].pixels[index].map(f64::from))
    }

    fn mean(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for index in self.tiles().flatten() {
            sum += of_channels(|c| f64::from(self.image.pixels[index][c]));
            count += 1.0;
        }
        sum / count
    }

    /// Indices of the pixels that count, in squares.
    fn tiles(&self) -> impl Iterator<Item = Vec<usize>> {
        let (width, height) = (self.image.width as usize, self.image.height as usize);
        let counts = |i: &usize| self.mask.as_ref().is_none_or(|mask| mask[*i]);
        let starts = |side: usize| (0..side).step_by(TILE);
        starts(height).flat_map(move |y| starts(width).map(move |x| (x, y))).map(move |(x, y)| {
            let row = |y: usize| y * width + x..y * width + width.min(x + TILE);
            (y..height.min(y + TILE)).flat_map(row).filter(counts).collect()
        })
    }
}

/// The mean over the channels.
fn of_channels(value: impl Fn(usize) -> f64) -> f64 {
    (0..3).map(value).sum::<f64>() / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::hash;

    /// A value 2 known by two halves with noise ±1, 50 % of it.
    fn noisy() -> Reference {
        let (width, height) = (200, 100);
        let half = |seed: u64| {
            let pixel = |i: u32| [if hash(seed, i.into()) < u64::MAX / 2 { 1.0 } else { 3.0 }; 3];
            LinearImage { width, height, pixels: (0..width * height).map(pixel).collect() }
        };
        let halves = [half(1), half(2)];
        let mean = |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|c| 0.5 * (a[c] + b[c]));
        let pixels = halves[0].pixels.iter().zip(&halves[1].pixels).map(mean).collect();
        let image = LinearImage { width, height, pixels };
        Reference {
            halves,
            image,
            error: 0.35,
            relative_error: 0.35,
            estimator: String::new(),
            rounds: 2,
            cpu: 0.0,
            rival: None,
            mask: None,
        }
    }

    fn even(value: f32) -> LinearImage {
        LinearImage { width: 200, height: 100, pixels: vec![[value; 3]; 20_000] }
    }

    /// The standard error of the mean product is 1/√20000 = 0.007: an error of 0.3, or 15 %, is told to about 5 % of itself although
    /// the reference's own is 35 %; the truth is told from nothing.
    #[test]
    fn errors_below_the_reference_s_own_are_told() {
        let reference = noisy();
        let off = reference.judge(&even(2.3)).unwrap();
        assert!(off.told && (off.error - 0.15).abs() < 0.02, "{off:?}");
        assert!(!reference.judge(&even(2.0)).unwrap().told);
        let known = (3.0 / 20_000.0_f64.sqrt()).sqrt() / 2.0;
        assert!((reference.floor() / known - 1.0).abs() < 0.02, "{} {known}", reference.floor());
    }
}
