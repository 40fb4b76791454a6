//! FLIP: how far two pictures differ for an eye that flips between them (Andersson et al. 2020), and its form for high
//! dynamic range (2021): the largest difference over all useful exposures.

use super::{CompareError, Pair};
use crate::develop::{shown, tone_filmic};
use crate::image_io::LinearImage;
use crate::scene::ImageSettings;
use std::f64::consts::PI;

/// Pixels per degree of sight: a 4K display 0.7 m wide, seen from 0.7 m.
const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;
/// Exponents of the colour and of the feature difference.
const COLOUR_EXPONENT: f64 = 0.7;
const FEATURE_EXPONENT: f64 = 0.5;
/// Differences up to this part of the largest take up that part of the scale.
const KNEE: (f64, f64) = (0.4, 0.95);
/// From peak to trough of the eye's edge detector, degrees.
const EDGE_WIDTH: f64 = 0.082;
/// Weights a and widths b of the contrast sensitivity: Σ a √(π/b) exp(-π² r²/b), r in degrees.
const ACHROMATIC: &[(f64, f64)] = &[(1.0, 0.0047)];
const RED_GREEN: &[(f64, f64)] = &[(1.0, 0.0053)];
const BLUE_YELLOW: &[(f64, f64)] = &[(34.1, 0.04), (13.5, 0.025)];
/// The widest of them, which all are cut at three times.
const WIDEST: f64 = 0.04;
/// Reciprocal of the white point D65.
const INVERSE_WHITE: [f64; 3] = [1.052_156_925, 1.0, 0.918_357_670];
/// The tone-mapped value at which an exposure begins, or ends, to be useful.
const USEFUL: f64 = 0.85;

/// Differences, 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// Mean over the pixels.
    pub mean: f64,
    /// Row by row.
    pub map: Vec<f64>,
}

impl Flip {
    fn new(map: Vec<f64>) -> Self {
        Self { mean: map.iter().sum::<f64>() / map.len().max(1) as f64, map }
    }
}

/// LDR-FLIP of the pictures as a display shows them, exposed and tone-mapped.
///
/// # Errors
/// If the pictures differ in size, are empty or not finite.
pub fn ldr_flip(
    test: &LinearImage,
    reference: &LinearImage,
    settings: &ImageSettings,
) -> Result<Flip, CompareError> {
    check(test, reference)?;
    let gain = libm::exp2(f64::from(settings.exposure));
    Ok(Flip::new(difference(test, reference, &|x| shown(x, gain, settings.tone))))
}

/// HDR-FLIP: the largest LDR-FLIP of each pixel over exposures from where the brightest pixel is not yet white to where
/// the darker half is not yet bright, tone-mapped by the filmic curve.
///
/// # Errors
/// As [`ldr_flip`].
pub fn hdr_flip(test: &LinearImage, reference: &LinearImage) -> Result<Flip, CompareError> {
    check(test, reference)?;
    let (start, stop) = exposures(reference);
    let count = ((stop - start).ceil().max(2.0)) as u32;
    let mut largest = vec![0.0_f64; reference.pixels.len()];
    for step in 0..count {
        let exposure = start + f64::from(step) * (stop - start) / f64::from(count - 1);
        // 0.6: the curve as it was published is too bright by that much.
        let gain = 0.6 * libm::exp2(exposure);
        let map = difference(test, reference, &|x| tone_filmic(gain * f64::from(x)));
        largest.iter_mut().zip(map).for_each(|(largest, x)| *largest = largest.max(x));
    }
    Ok(Flip::new(largest))
}

fn check(test: &LinearImage, reference: &LinearImage) -> Result<(), CompareError> {
    Pair::new(test, reference, None)?;
    if reference.pixels.is_empty() { Err(CompareError::Empty) } else { Ok(()) }
}

/// First and last exposure, in stops.
fn exposures(reference: &LinearImage) -> (f64, f64) {
    let luminance =
        |p: &[f32; 3]| 0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2]);
    let mut sorted: Vec<f64> = reference.pixels.iter().map(luminance).collect();
    sorted.sort_by(f64::total_cmp);
    let (high, middle) = (sorted[sorted.len() - 1], sorted.len() / 2);
    if high <= 0.0 {
        return (0.0, 0.0);
    }
    let median = if sorted.len().is_multiple_of(2) {
        f64::midpoint(sorted[middle - 1], sorted[middle])
    } else {
        sorted[middle]
    };
    // Where the darker half is black, no exposure shows it: the dimmest of the rest takes its place.
    let low = if median > 0.0 { median } else { sorted.iter().copied().find(|&y| y > 0.0).unwrap_or(high) };
    let useful = filmic_inverse(USEFUL);
    (libm::log2(useful / high), libm::log2(useful / low))
}

/// What the filmic curve, after the factor of 0.6, maps to this.
fn filmic_inverse(y: f64) -> f64 {
    let (a, b, c) = (2.51 - 2.43 * y, 0.03 - 0.59 * y, -0.14 * y);
    (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a) / 0.6
}

/// One number per pixel.
#[derive(Clone)]
struct Plane {
    width: usize,
    values: Vec<f64>,
}

/// The difference of two pictures, of which a function says how much light the display gives.
fn difference(test: &LinearImage, reference: &LinearImage, display: &dyn Fn(f32) -> f64) -> Vec<f64> {
    let [test, reference] = [test, reference].map(|image| Seen::new(image, display));
    let green_to_blue = hyab(hunt([0.0, 1.0, 0.0]), hunt([0.0, 0.0, 1.0])).powf(COLOUR_EXPONENT);
    let pixel = |i: usize| {
        let colour = hyab(test.colours[i], reference.colours[i]).powf(COLOUR_EXPONENT);
        let features = [0, 1].map(|f| (test.features[f][i] - reference.features[f][i]).abs());
        let feature = (features[0].max(features[1]) / 2.0_f64.sqrt()).powf(FEATURE_EXPONENT);
        spread(colour, green_to_blue).powf(1.0 - feature)
    };
    (0..test.colours.len()).map(pixel).collect()
}

/// What the eye sees of a picture.
struct Seen {
    /// Blurred colours, in L*a*b* with Hunt's adjustment.
    colours: Vec<[f64; 3]>,
    /// Strength of edges and of points.
    features: [Vec<f64>; 2],
}

impl Seen {
    fn new(image: &LinearImage, display: &dyn Fn(f32) -> f64) -> Self {
        let opponent: Vec<[f64; 3]> =
            image.pixels.iter().map(|p| to_opponent(p.map(|x| display(x).clamp(0.0, 1.0)))).collect();
        let plane =
            |c: usize| Plane { width: image.width as usize, values: opponent.iter().map(|p| p[c]).collect() };
        let [y, x, z] = [(0, ACHROMATIC), (1, RED_GREEN), (2, BLUE_YELLOW)].map(|(c, f)| blur(&plane(c), f));
        let colour = |i: usize| hunt(from_opponent([y[i], x[i], z[i]]).map(|v| v.clamp(0.0, 1.0)));
        let mut grey = plane(0);
        grey.values.iter_mut().for_each(|v| *v = (*v + 16.0) / 116.0);
        let colours = (0..opponent.len()).map(colour).collect();
        Self { colours, features: [Feature::Edge, Feature::Point].map(|f| strength(&grey, f)) }
    }
}

/// Linear RGB to the opponent space YCxCz, a linear form of L*a*b*.
fn to_opponent(rgb: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = to_white(rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn from_opponent([y, cx, cz]: [f64; 3]) -> [f64; 3] {
    const ROWS: [[f64; 3]; 3] = [
        [3.241_003_275, -1.537_398_934, -0.498_615_861],
        [-0.969_224_334, 1.875_930_071, 0.041_554_224],
        [0.055_639_423, -0.204_011_202, 1.057_148_933],
    ];
    let y = (y + 16.0) / 116.0;
    let white = [y + cx / 500.0, y, y - cz / 200.0];
    let xyz: [f64; 3] = std::array::from_fn(|c| white[c] / INVERSE_WHITE[c]);
    ROWS.map(|row| row.iter().zip(xyz).map(|(a, b)| a * b).sum())
}

/// Linear RGB to XYZ over that of white.
fn to_white(rgb: [f64; 3]) -> [f64; 3] {
    const ROWS: [[f64; 3]; 3] = [
        [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
        [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
        [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
    ];
    std::array::from_fn(|c| INVERSE_WHITE[c] * ROWS[c].iter().zip(rgb).map(|(a, b)| a * b).sum::<f64>())
}

/// Linear RGB to L*a*b*, dark colours made less colourful (Hunt).
fn hunt(rgb: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let curve = |t: f64| {
        if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let [x, y, z] = to_white(rgb).map(curve);
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// Distance in lightness plus distance in hue and chroma.
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Maps 0..most to 0..1, with most of the room for small differences.
fn spread(value: f64, most: f64) -> f64 {
    let (part, room) = KNEE;
    let knee = part * most;
    if value < knee { room * value / knee } else { room + (value - knee) / (most - knee) * (1.0 - room) }
}

/// Blurred by the contrast sensitivity: a sum of Gaussians, each the product of one across and one down.
fn blur(plane: &Plane, gaussians: &[(f64, f64)]) -> Vec<f64> {
    let radius = (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let kernels: Vec<(f64, Vec<f64>)> = gaussians
        .iter()
        .map(|(a, b)| {
            let at = |i: i32| (-(PI * f64::from(i) / PIXELS_PER_DEGREE).powi(2) / b).exp();
            let kernel: Vec<f64> = (-radius..=radius).map(at).collect();
            (a * (PI / b).sqrt(), kernel)
        })
        .collect();
    let weight = |(a, k): &(f64, Vec<f64>)| a * k.iter().sum::<f64>().powi(2);
    let total: f64 = kernels.iter().map(weight).sum();
    let mut sum = vec![0.0; plane.values.len()];
    for (a, kernel) in &kernels {
        let blurred = filtered(plane, kernel, kernel);
        sum.iter_mut().zip(blurred.values).for_each(|(sum, x)| *sum += a / total * x);
    }
    sum
}

#[derive(Clone, Copy, PartialEq)]
enum Feature {
    Edge,
    Point,
}

/// How strong a feature is everywhere, in whatever direction.
fn strength(plane: &Plane, feature: Feature) -> Vec<f64> {
    let sigma = 0.5 * EDGE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * sigma).ceil() as i32;
    let places = || (-radius..=radius).map(f64::from);
    let gauss: Vec<f64> = places().map(|x| (-x * x / (2.0 * sigma * sigma)).exp()).collect();
    let total: f64 = gauss.iter().sum();
    let smooth: Vec<f64> = gauss.iter().map(|g| g / total).collect();
    let signed: Vec<f64> = places()
        .zip(&gauss)
        .map(|(x, g)| match feature {
            Feature::Edge => -x * g,
            Feature::Point => (x * x / (sigma * sigma) - 1.0) * g,
        })
        .collect();
    let sum = |sign: f64| signed.iter().map(|v| (sign * v).max(0.0)).sum::<f64>();
    let (plus, minus) = (sum(1.0), sum(-1.0));
    let detector: Vec<f64> = signed.iter().map(|v| if *v < 0.0 { v / minus } else { v / plus }).collect();
    let across = filtered(plane, &detector, &smooth);
    let down = filtered(plane, &smooth, &detector);
    across.values.iter().zip(&down.values).map(|(a, b)| a.hypot(*b)).collect()
}

/// Filtered across and down; borders are repeated.
fn filtered(plane: &Plane, across: &[f64], down: &[f64]) -> Plane {
    let width = plane.width;
    let height = plane.values.len() / width;
    let mut rows = Vec::with_capacity(plane.values.len());
    for row in plane.values.chunks_exact(width) {
        rows.extend((0..width).map(|x| tap(across, x, width, |x| row[x])));
    }
    let mut values = Vec::with_capacity(rows.len());
    for y in 0..height {
        values.extend((0..width).map(|x| tap(down, y, height, |y| rows[y * width + x])));
    }
    Plane { width, values }
}

fn tap(kernel: &[f64], middle: usize, size: usize, value: impl Fn(usize) -> f64) -> f64 {
    let radius = kernel.len() / 2;
    let place = |i: usize| (middle + i).saturating_sub(radius).min(size - 1);
    kernel.iter().enumerate().map(|(i, weight)| weight * value(place(i))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Tone;

    const SIZE: (u32, u32) = (32, 24);
    const PLAIN: ImageSettings =
        ImageSettings { width: SIZE.0, height: SIZE.1, exposure: 0.0, tone: Tone::Linear };

    fn picture(value: impl Fn(f64, f64) -> [f64; 3]) -> LinearImage {
        let pixels = (0..SIZE.1)
            .flat_map(|y| (0..SIZE.0).map(move |x| (f64::from(x), f64::from(y))))
            .map(|(x, y)| value(x, y).map(|v| v as f32))
            .collect();
        LinearImage { width: SIZE.0, height: SIZE.1, pixels }
    }

    fn checks(k: f64) -> impl Fn(f64, f64) -> [f64; 3] {
        move |x, y| {
            [
                (x * 7.0 + y * 3.0 + k * x * y) % 32.0 / 31.0,
                (x * 5.0 + y * 11.0 + k * (x + y)) % 29.0 / 28.0,
                (x * 2.0 + y * 13.0 + k * y) % 31.0 / 30.0,
            ]
        }
    }

    fn blob(shift: f64) -> impl Fn(f64, f64) -> [f64; 3] {
        move |x, y| {
            let squared = (x - 16.0 - shift).powi(2) + (y - 12.0).powi(2);
            [(-squared / 40.0).exp(), 0.3, x / 31.0]
        }
    }

    /// Reference and test.
    fn pairs() -> [(LinearImage, LinearImage); 2] {
        let mixed = |x, y| {
            let (a, b) = (checks(0.0)(x, y), checks(1.0)(x, y));
            std::array::from_fn(|c| 0.9 * a[c] + 0.1 * b[c])
        };
        [(picture(checks(0.0)), picture(mixed)), (picture(blob(0.0)), picture(blob(1.5)))]
    }

    /// Means that the authors' package `flip-evaluator` 1.7 gives for the same pictures, linear RGB.
    #[test]
    fn ldr_flip_is_that_of_its_authors() {
        for ((reference, test), expected) in pairs().into_iter().zip([0.056_066_375, 0.127_965_227]) {
            let flip = ldr_flip(&test, &reference, &PLAIN).unwrap();
            assert!((flip.mean - expected).abs() < 1e-4, "{} for {expected}", flip.mean);
            assert!(flip.map.iter().all(|x| (0.0..=1.0).contains(x)));
        }
    }

    /// The same, of 8 times the squared values.
    #[test]
    fn hdr_flip_is_that_of_its_authors() {
        let brighter = |image: &LinearImage| {
            let pixels = image.pixels.iter().map(|p| p.map(|x| 8.0 * x * x)).collect();
            LinearImage { pixels, ..image.clone() }
        };
        for ((reference, test), expected) in pairs().into_iter().zip([0.120_423_354, 0.166_622_803]) {
            let flip = hdr_flip(&brighter(&test), &brighter(&reference)).unwrap();
            assert!((flip.mean - expected).abs() < 1e-4, "{} for {expected}", flip.mean);
        }
    }

    #[test]
    fn a_picture_does_not_differ_from_itself() {
        let (picture, _) = &pairs()[0];
        assert_eq!(ldr_flip(picture, picture, &PLAIN).unwrap().mean, 0.0);
        assert_eq!(hdr_flip(picture, picture).unwrap().mean, 0.0);
        let black = LinearImage { pixels: vec![[0.0; 3]; picture.pixels.len()], ..picture.clone() };
        assert_eq!(hdr_flip(&black, &black).unwrap().mean, 0.0);
    }
}
