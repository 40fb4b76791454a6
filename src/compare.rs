//! How far a picture is from another: error measures, the worst places, and a picture of the difference.

pub mod flip;

use crate::image_io::LinearImage;

/// Side of a tile in pixels.
const TILE: u32 = 16;
/// How many of the worst tiles are listed.
const WORST_TILES: usize = 5;
/// The difference picture is fully coloured at this many times the root mean square error.
const FULL_COLOUR: f64 = 4.0;
/// Weight of the mean's square in [`Comparison::relmse`], which keeps dark pixels from ruling it.
const RELMSE_FLOOR: f64 = 0.01;

/// How far a picture is from a reference. All pixels and channels count the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Root mean square error, in the pictures' unit.
    pub rmse: f64,
    /// `rmse` divided by the mean of the reference.
    pub rel_rmse: f64,
    /// Mean of (x - r)² / (r² + 0.01 mean²), where mean is that of the reference.
    pub relmse: f64,
    /// Mean of the picture divided by mean of the reference.
    pub mean_ratio: f64,
    /// The same per channel; `None` where the reference is black.
    pub channel_mean_ratio: [Option<f64>; 3],
    /// How many pixels were compared.
    pub pixels: usize,
    /// The five tiles with the largest error, worst first.
    pub worst_tiles: Vec<Tile>,
    /// Red where the picture is brighter than the reference, blue where it is darker, white where they
    /// agree, grey where the mask leaves out pixels.
    pub difference: LinearImage,
    /// The difference (mean of the channels) that is shown fully red or blue.
    pub difference_scale: f64,
}

/// A square of the picture; at the borders, what is left of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tile {
    /// Leftmost column.
    pub x: u32,
    /// Topmost row.
    pub y: u32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Root mean square error of its compared pixels, divided by the mean of the whole reference.
    pub rel_rmse: f64,
}

/// Why two pictures cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CompareError {
    /// They differ in size.
    #[error("the pictures differ in size: {}×{} and {}×{}", test[0], test[1], reference[0], reference[1])]
    Size {
        /// Width and height of the picture.
        test: [u32; 2],
        /// Width and height of the reference.
        reference: [u32; 2],
    },
    /// A picture has more or fewer pixels than its size says.
    #[error("a picture has not as many pixels as its size says")]
    PixelCount,
    /// The mask does not fit.
    #[error("the mask has {found} values for {expected} pixels")]
    MaskSize {
        /// Values of the mask.
        found: usize,
        /// Pixels of the picture.
        expected: usize,
    },
    /// There are no pixels to compare.
    #[error("no pixels are left to compare")]
    Empty,
    /// A pixel is infinite or not a number.
    #[error("the pixel at ({x}, {y}) of the {picture} is not finite")]
    NotFinite {
        /// Which picture.
        picture: &'static str,
        /// Column.
        x: u32,
        /// Row.
        y: u32,
    },
    /// Errors relative to a black reference mean nothing.
    #[error("the mean of the reference is not above zero, so there is no relative error")]
    BlackReference,
}

/// Compares a picture with a reference, over the pixels for which the mask is true.
///
/// # Errors
/// See [`CompareError`].
pub fn compare(
    test: &LinearImage,
    reference: &LinearImage,
    mask: Option<&[bool]>,
) -> Result<Comparison, CompareError> {
    let pair = Pair::new(test, reference, mask)?;
    let total = pair.sums(0..test.pixels.len());
    let count = total.pixels as f64;
    if total.pixels == 0 {
        return Err(CompareError::Empty);
    }
    let mean = total.reference.iter().sum::<f64>() / (3.0 * count);
    if mean <= 0.0 {
        return Err(CompareError::BlackReference);
    }
    let rmse = (total.squared_error / (3.0 * count)).sqrt();
    let scale = FULL_COLOUR * rmse;
    let ratio = |c: usize| (total.reference[c] > 0.0).then(|| total.test[c] / total.reference[c]);
    Ok(Comparison {
        rmse,
        rel_rmse: rmse / mean,
        relmse: pair.relmse(mean) / (3.0 * count),
        mean_ratio: total.test.iter().sum::<f64>() / total.reference.iter().sum::<f64>(),
        channel_mean_ratio: [ratio(0), ratio(1), ratio(2)],
        pixels: total.pixels,
        worst_tiles: pair.worst_tiles(mean),
        difference: pair.difference(scale),
        difference_scale: scale,
    })
}

/// Two pictures of one size and the pixels that count.
struct Pair<'p> {
    test: &'p LinearImage,
    reference: &'p LinearImage,
    mask: Option<&'p [bool]>,
}

/// Sums over some pixels.
#[derive(Default)]
struct Sums {
    pixels: usize,
    test: [f64; 3],
    reference: [f64; 3],
    squared_error: f64,
}

impl<'p> Pair<'p> {
    fn new(
        test: &'p LinearImage,
        reference: &'p LinearImage,
        mask: Option<&'p [bool]>,
    ) -> Result<Self, CompareError> {
        let (size, other) = ([test.width, test.height], [reference.width, reference.height]);
        if size != other {
            return Err(CompareError::Size { test: size, reference: other });
        }
        let expected = test.width as usize * test.height as usize;
        if test.pixels.len() != expected || reference.pixels.len() != expected {
            return Err(CompareError::PixelCount);
        }
        if let Some(found) = mask.map(<[bool]>::len).filter(|found| *found != expected) {
            return Err(CompareError::MaskSize { found, expected });
        }
        let pair = Self { test, reference, mask };
        pair.check_finite()?;
        Ok(pair)
    }

    fn check_finite(&self) -> Result<(), CompareError> {
        for (picture, image) in [("picture", self.test), ("reference", self.reference)] {
            let bad = |(index, pixel): (usize, &[f32; 3])| {
                self.counts(index) && !pixel.iter().all(|x| x.is_finite())
            };
            if let Some(index) = image.pixels.iter().enumerate().position(bad) {
                let (x, y) = (index % image.width as usize, index / image.width as usize);
                return Err(CompareError::NotFinite { picture, x: x as u32, y: y as u32 });
            }
        }
        Ok(())
    }

    fn counts(&self, index: usize) -> bool {
        self.mask.is_none_or(|mask| mask[index])
    }

    /// The pixels with these indices that count, as (picture, reference).
    fn pixels(&self, indices: impl Iterator<Item = usize>) -> impl Iterator<Item = ([f64; 3], [f64; 3])> {
        indices.filter(|index| self.counts(*index)).map(|index| {
            (self.test.pixels[index].map(f64::from), self.reference.pixels[index].map(f64::from))
        })
    }

    fn sums(&self, indices: impl Iterator<Item = usize>) -> Sums {
        let mut sums = Sums::default();
        for (x, r) in self.pixels(indices) {
            sums.pixels += 1;
            for channel in 0..3 {
                sums.test[channel] += x[channel];
                sums.reference[channel] += r[channel];
                sums.squared_error += (x[channel] - r[channel]).powi(2);
            }
        }
        sums
    }

    /// Sum of the relative squared errors.
    fn relmse(&self, mean: f64) -> f64 {
        let floor = RELMSE_FLOOR * mean * mean;
        let of_pixel = |(x, r): ([f64; 3], [f64; 3])| -> f64 {
            x.iter().zip(&r).map(|(x, r)| (x - r).powi(2) / (r * r + floor)).sum()
        };
        self.pixels(0..self.test.pixels.len()).map(of_pixel).sum()
    }

    fn worst_tiles(&self, mean: f64) -> Vec<Tile> {
        let (width, height) = (self.test.width, self.test.height);
        let starts = |side: u32| (0..side).step_by(TILE as usize);
        let mut tiles: Vec<Tile> = starts(height)
            .flat_map(|y| starts(width).map(move |x| (x, y)))
            .filter_map(|(x, y)| {
                let (right, bottom) = (width.min(x + TILE), height.min(y + TILE));
                let index = |x: u32, y: u32| y as usize * width as usize + x as usize;
                let sums = self.sums((y..bottom).flat_map(|y| index(x, y)..index(right, y)));
                let rel_rmse = (sums.squared_error / (3.0 * sums.pixels as f64)).sqrt() / mean;
                let tile = Tile { x, y, width: right - x, height: bottom - y, rel_rmse };
                (sums.pixels > 0).then_some(tile)
            })
            .collect();
        tiles.sort_by(|a, b| b.rel_rmse.total_cmp(&a.rel_rmse));
        tiles.truncate(WORST_TILES);
        tiles
    }

    fn difference(&self, scale: f64) -> LinearImage {
        const GREY: [f32; 3] = [0.2; 3];
        let shade = |index: usize| {
            if !self.counts(index) {
                return GREY;
            }
            let mean = |image: &LinearImage| image.pixels[index].map(f64::from).iter().sum::<f64>() / 3.0;
            let signed = mean(self.test) - mean(self.reference);
            let strength = if scale > 0.0 { (signed.abs() / scale).min(1.0) as f32 } else { 0.0 };
            if signed > 0.0 {
                [1.0, 1.0 - strength, 1.0 - strength]
            } else {
                [1.0 - strength, 1.0 - strength, 1.0]
            }
        };
        let pixels = (0..self.test.pixels.len()).map(shade).collect();
        LinearImage { width: self.test.width, height: self.test.height, pixels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(width: u32, height: u32, value: [f32; 3]) -> LinearImage {
        LinearImage { width, height, pixels: vec![value; width as usize * height as usize] }
    }

    fn close(a: f64, b: f64) -> bool {
        // The pictures are floats; the sums are not.
        (a - b).abs() <= 1e-6 * b.abs()
    }

    #[test]
    fn a_picture_is_itself() {
        let picture = flat(20, 20, [0.2, 0.5, 0.9]);
        let same = compare(&picture, &picture, None).unwrap();
        assert_eq!((same.rmse, same.rel_rmse, same.relmse, same.mean_ratio), (0.0, 0.0, 0.0, 1.0));
        assert_eq!(same.difference.pixels, vec![[1.0; 3]; 400]);
    }

    #[test]
    fn the_measures_are_their_formulas() {
        let reference = flat(2, 1, [2.0, 4.0, 0.0]);
        let test = flat(2, 1, [3.0, 4.0, 0.0]);
        let c = compare(&test, &reference, None).unwrap();
        let (mean, rmse) = (2.0_f64, (1.0_f64 / 3.0).sqrt());
        assert!(close(c.rmse, rmse) && close(c.rel_rmse, rmse / mean), "{c:?}");
        assert!(close(c.relmse, 1.0 / (4.0 + 0.01 * mean * mean) / 3.0), "{c:?}");
        assert!(close(c.mean_ratio, 7.0 / 6.0), "{c:?}");
        assert_eq!(c.channel_mean_ratio, [Some(1.5), Some(1.0), None]);
    }

    #[test]
    fn the_worst_tiles_come_first() {
        let reference = flat(40, 20, [1.0; 3]);
        let mut test = reference.clone();
        test.pixels[18 * 40 + 35] = [9.0; 3];
        test.pixels[0] = [3.0; 3];
        let c = compare(&test, &reference, None).unwrap();
        let corners: Vec<_> = c.worst_tiles.iter().map(|t| (t.x, t.y, t.width, t.height)).collect();
        assert_eq!(corners[..2], [(32, 16, 8, 4), (0, 0, 16, 16)]);
        assert_eq!(c.worst_tiles.len(), 5);
        assert!(close(c.worst_tiles[0].rel_rmse, (64.0_f64 / 32.0).sqrt()));
    }

    #[test]
    fn the_difference_is_red_where_brighter_and_blue_where_darker() {
        let reference = flat(3, 1, [1.0; 3]);
        let mut test = reference.clone();
        (test.pixels[0], test.pixels[1]) = ([1.5; 3], [0.5; 3]);
        let c = compare(&test, &reference, None).unwrap();
        let [red, blue, white] = [0, 1, 2].map(|i| c.difference.pixels[i]);
        assert!(red[0] == 1.0 && red[2] < 1.0 && blue[2] == 1.0 && blue[0] < 1.0 && white == [1.0; 3]);
    }

    #[test]
    fn masked_pixels_do_not_count_whatever_they_are() {
        let reference = flat(2, 1, [1.0; 3]);
        let mut test = reference.clone();
        test.pixels[0] = [f32::NAN; 3];
        let c = compare(&test, &reference, Some(&[false, true])).unwrap();
        assert_eq!((c.rmse, c.pixels), (0.0, 1));
    }

    #[test]
    fn what_cannot_be_compared_is_an_error() {
        let one = flat(2, 1, [1.0; 3]);
        let error =
            |test: &LinearImage, reference: &LinearImage, mask| compare(test, reference, mask).unwrap_err();
        let sizes = CompareError::Size { test: [2, 1], reference: [1, 2] };
        assert_eq!(error(&one, &flat(1, 2, [1.0; 3]), None), sizes);
        assert_eq!(error(&one, &one, Some(&[true])), CompareError::MaskSize { found: 1, expected: 2 });
        assert_eq!(error(&one, &one, Some(&[false; 2])), CompareError::Empty);
        assert_eq!(error(&one, &flat(2, 1, [0.0; 3]), None), CompareError::BlackReference);
        assert_eq!(error(&flat(0, 0, [0.0; 3]), &flat(0, 0, [0.0; 3]), None), CompareError::Empty);
        let short = LinearImage { pixels: vec![[1.0; 3]], ..one.clone() };
        assert_eq!(error(&short, &one, None), CompareError::PixelCount);
        let mut bad = one.clone();
        bad.pixels[1][2] = f32::INFINITY;
        assert_eq!(error(&one, &bad, None), CompareError::NotFinite { picture: "reference", x: 1, y: 0 });
    }
}
