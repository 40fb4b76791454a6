//! What surrounds the scene, infinitely far away: the same from everywhere, or a picture of all directions.

use crate::sampling::{Density2d, uniform_sphere};
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};
use std::fmt;

/// Most cells of the table that directions are drawn from, across and down: 16 MiB.
const MAX_CELLS: [usize; 2] = [2048, 1024];

/// The light from all around.
#[derive(Clone, Debug, PartialEq)]
pub enum Environment {
    /// The same radiance from everywhere, W·sr⁻¹·m⁻².
    Constant(Vec3),
    /// A picture of all directions.
    Image(EnvironmentImage),
}

/// Radiance by direction: a picture whose rows are latitudes, +y above, and whose middle column lies at -z.
///
/// Directions are drawn in proportion to the luminance of the picture, from a table over it (Pharr, Jakob and
/// Humphreys, *Physically Based Rendering*, 12.5).
#[derive(Clone, PartialEq)]
pub struct EnvironmentImage {
    size: [usize; 2],
    /// Radiance, top row first.
    texels: Vec<[f32; 3]>,
    /// By how much of a turn the picture lies to the right of where a direction's azimuth says.
    shift: f32,
    /// `None` if all is black.
    density: Option<Density2d>,
}

/// A direction drawn from the environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentSample {
    /// Unit vector from the scene to where the light comes from.
    pub direction: Vec3,
    /// Radiance from there.
    pub radiance: Vec3,
    /// Density with which the direction was drawn, sr⁻¹.
    pub pdf: f32,
}

impl Environment {
    /// Radiance from a direction, a unit vector away from the scene.
    #[must_use]
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Constant(radiance) => *radiance,
            Self::Image(image) => image.eval(image.place(direction)),
        }
    }

    /// Draws a direction with `u` uniform in the unit square; `None` if no light comes from there.
    #[must_use]
    pub fn sample(&self, u: Vec2) -> Option<EnvironmentSample> {
        let sample = match self {
            Self::Constant(radiance) => {
                EnvironmentSample { direction: uniform_sphere(u), radiance: *radiance, pdf: 1.0 / (4.0 * PI) }
            }
            Self::Image(image) => {
                let (place, density) = image.density.as_ref()?.warp(u);
                let pdf = density / solid_angle(place);
                EnvironmentSample { direction: image.direction(place), radiance: image.eval(place), pdf }
            }
        };
        (sample.pdf.is_finite() && sample.radiance.max_element() > 0.0).then_some(sample)
    }

    /// Density with which [`Self::sample`] draws a direction, sr⁻¹.
    #[must_use]
    pub fn pdf(&self, direction: Vec3) -> f32 {
        match self {
            Self::Constant(_) => 1.0 / (4.0 * PI),
            Self::Image(image) => {
                let place = image.place(direction);
                image.density.as_ref().map_or(0.0, |density| density.density(place) / solid_angle(place))
            }
        }
    }

    /// True if no light comes from anywhere.
    #[must_use]
    pub fn is_black(&self) -> bool {
        match self {
            Self::Constant(radiance) => *radiance == Vec3::ZERO,
            Self::Image(image) => image.density.is_none(),
        }
    }

    /// Bytes of its picture and table in memory.
    #[must_use]
    pub fn memory_bytes(&self) -> u64 {
        match self {
            Self::Constant(_) => 0,
            Self::Image(image) => {
                let table = image.density.as_ref().map_or(0, Density2d::memory_bytes);
                (size_of_val(&image.texels[..]) + table) as u64
            }
        }
    }
}

impl EnvironmentImage {
    /// A picture of `size` pixels across and down, turned anticlockwise by `degrees` seen from above. Both sizes are
    /// above zero, and there are as many texels as they say, all finite and not negative.
    #[must_use]
    pub fn new(size: [usize; 2], texels: Vec<[f32; 3]>, degrees: f64) -> Self {
        let mut image = Self { size, texels, shift: (degrees / 360.0).rem_euclid(1.0) as f32, density: None };
        let cells = [size[0].min(MAX_CELLS[0]), size[1].min(MAX_CELLS[1])];
        image.density = Density2d::new(cells[0], &image.weights(cells));
        image
    }

    /// Weights of the cells: the mean luminance of the texels that each touches, times its solid angle.
    fn weights(&self, cells: [usize; 2]) -> Vec<f32> {
        let range = |cell: usize, axis: usize| {
            cell * self.size[axis] / cells[axis]..((cell + 1) * self.size[axis]).div_ceil(cells[axis])
        };
        let mut weights = Vec::with_capacity(cells[0] * cells[1]);
        for row in 0..cells[1] {
            let height = solid_angle(Vec2::new(0.5, (row as f32 + 0.5) / cells[1] as f32));
            let rows = range(row, 1);
            for column in 0..cells[0] {
                let columns = range(column, 0);
                let count = (rows.len() * columns.len()) as f32;
                let of_row = |y: usize| columns.clone().map(|x| self.luminance_around(x, y)).sum::<f32>();
                weights.push(rows.clone().map(of_row).sum::<f32>() / count * height);
            }
        }
        weights
    }

    /// Mean luminance over a texel of what is interpolated between it and its neighbours. It is not zero anywhere
    /// where light comes from, so that nothing is left out.
    fn luminance_around(&self, x: usize, y: usize) -> f32 {
        const WEIGHTS: [(i64, f32); 3] = [(-1, 0.125), (0, 0.75), (1, 0.125)];
        let (x, y) = (x as i64, y as i64);
        let row = |y: i64| WEIGHTS.iter().map(|(dx, w)| w * luminance(self.texel(x + dx, y))).sum::<f32>();
        WEIGHTS.iter().map(|(dy, w)| w * row(y + dy)).sum()
    }

    /// Radiance at a point of the picture, v downwards: bilinear between the centres of four texels.
    fn eval(&self, place: Vec2) -> Vec3 {
        let place = place * Vec2::new(self.size[0] as f32, self.size[1] as f32) - 0.5;
        let low = place.floor();
        let weight = place - low;
        let (x, y) = (low.x as i64, low.y as i64);
        let row = |y: i64| self.texel(x, y).lerp(self.texel(x + 1, y), weight.x);
        row(y).lerp(row(y + 1), weight.y)
    }

    /// A texel; the picture goes on at its sides, and ends at the poles.
    fn texel(&self, x: i64, y: i64) -> Vec3 {
        let column = x.rem_euclid(self.size[0] as i64) as usize;
        let row = y.clamp(0, self.size[1] as i64 - 1) as usize;
        self.texels.get(row * self.size[0] + column).map_or(Vec3::ZERO, |texel| Vec3::from(*texel))
    }

    /// The direction that a point of the picture shows.
    fn direction(&self, place: Vec2) -> Vec3 {
        let azimuth = (place.x - self.shift - 0.5) * TAU;
        let polar = place.y * PI;
        let (sine, cosine) = (libm::sinf(polar), libm::cosf(polar));
        Vec3::new(sine * libm::sinf(azimuth), cosine, -sine * libm::cosf(azimuth))
    }

    /// The point of the picture that shows a direction.
    fn place(&self, direction: Vec3) -> Vec2 {
        let turn = libm::atan2f(direction.x, -direction.z) / TAU + 0.5 + self.shift;
        // Not by the arc cosine, which has no digits left at the poles.
        let polar = libm::atan2f(libm::hypotf(direction.x, direction.z), direction.y);
        Vec2::new(turn - turn.floor(), polar / PI)
    }
}

impl fmt::Debug for EnvironmentImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "EnvironmentImage({} × {})", self.size[0], self.size[1])
    }
}

/// Solid angle per area of the picture: 2π across and π down, and narrower toward the poles.
fn solid_angle(place: Vec2) -> f32 {
    2.0 * PI * PI * libm::sinf(place.y * PI)
}

/// Relative luminance of linear sRGB (ITU-R BT.709).
fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::SamplePoint;

    /// A gradient with a small sun, 32 × 16.
    fn sky() -> EnvironmentImage {
        let texels = (0..512).map(|i| match i {
            150 => [900.0, 800.0, 700.0],
            _ => [0.2, 0.4 + 0.1 * (i / 32) as f32, 0.1 * (i % 32) as f32],
        });
        EnvironmentImage::new([32, 16], texels.collect(), 30.0)
    }

    /// Half of the texels are black, the others of one colour.
    fn hemisphere(degrees: f64) -> Environment {
        let texels = (0..64 * 32).map(|i| if i % 64 < 32 { [0.0; 3] } else { [1.0, 2.0, 3.0] });
        Environment::Image(EnvironmentImage::new([64, 32], texels.collect(), degrees))
    }

    #[test]
    fn a_direction_finds_its_place_and_back() {
        let image = sky();
        for i in 0..1000 {
            let direction = uniform_sphere(SamplePoint::new(1, i).get_2d(0));
            // Rounding of angles to f32.
            assert!(image.direction(image.place(direction)).distance(direction) < 1e-5, "{direction}");
        }
    }

    #[test]
    fn the_middle_of_the_picture_is_at_minus_z_and_its_right_at_plus_x() {
        let image = EnvironmentImage::new([4, 2], vec![[1.0; 3]; 8], 0.0);
        for (x, y, direction) in
            [(0.5, 0.5, Vec3::NEG_Z), (0.75, 0.5, Vec3::X), (0.25, 0.5, Vec3::NEG_X), (0.3, 0.0, Vec3::Y)]
        {
            assert!(image.direction(Vec2::new(x, y)).distance(direction) < 1e-6, "{x} {y}");
        }
    }

    #[test]
    fn a_quarter_turn_anticlockwise_brings_the_middle_to_minus_x() {
        let image = EnvironmentImage::new([4, 2], vec![[1.0; 3]; 8], 90.0);
        assert!(image.direction(Vec2::splat(0.5)).distance(Vec3::NEG_X) < 1e-6);
        for (degrees, lit, dark) in
            [(0.0, Vec3::X, Vec3::NEG_X), (90.0, Vec3::NEG_Z, Vec3::Z), (180.0, Vec3::NEG_X, Vec3::X)]
        {
            let sky = hemisphere(degrees);
            assert_eq!(sky.radiance(lit), Vec3::new(1.0, 2.0, 3.0), "{degrees}");
            assert_eq!(sky.radiance(dark), Vec3::ZERO, "{degrees}");
        }
    }

    /// By the midpoint rule over 2048 × 1024 points; its error at the poles is below 1e-4.
    #[test]
    fn the_density_integrates_to_one_over_all_directions() {
        for environment in [Environment::Image(sky()), Environment::Constant(Vec3::ONE), hemisphere(77.0)] {
            let (across, down) = (2048, 1024);
            let mut integral = 0.0;
            for i in 0..across * down {
                let place = Vec2::new(
                    ((i % across) as f32 + 0.5) / across as f32,
                    ((i / across) as f32 + 0.5) / down as f32,
                );
                let polar = place.y * PI;
                let azimuth = place.x * TAU;
                let direction =
                    Vec3::new(polar.sin() * azimuth.cos(), polar.cos(), polar.sin() * azimuth.sin());
                integral +=
                    f64::from(environment.pdf(direction) * solid_angle(place)) / f64::from(across * down);
            }
            assert!((integral - 1.0).abs() < 2e-3, "{environment:?}: {integral}");
        }
    }

    /// Independent draws against the density in 32 × 16 cells of equal area in the picture. Cells with fewer than 5
    /// draws expected are pooled; the 99.99 % quantile of chi-square with 500 degrees of freedom is 626.
    #[test]
    fn directions_are_drawn_with_the_density_that_is_said() {
        let image = sky();
        let environment = Environment::Image(image.clone());
        let draws = 200_000_u32;
        let mut counts = vec![0.0_f64; 512];
        for i in 0..draws {
            let u = SamplePoint::new(crate::sampling::hash(9, u64::from(i)), 0).get_2d(0);
            let sample = environment.sample(u).unwrap();
            let pdf = environment.pdf(sample.direction);
            assert!(
                (pdf / sample.pdf - 1.0).abs() < 1e-2 || near_border(&image, sample.direction),
                "{sample:?} {pdf}"
            );
            let place = image.place(sample.direction);
            counts[((place.y * 16.0) as usize).min(15) * 32 + ((place.x * 32.0) as usize).min(31)] += 1.0;
        }
        let density = image.density.as_ref().unwrap();
        let (mut chi2, mut cells, mut pool) = (0.0, 0, (0.0, 0.0));
        for (i, count) in counts.iter().enumerate() {
            let at = Vec2::new(((i % 32) as f32 + 0.5) / 32.0, ((i / 32) as f32 + 0.5) / 16.0);
            let expected = f64::from(draws) * f64::from(density.density(at)) / 512.0;
            if expected < 5.0 {
                pool = (pool.0 + expected, pool.1 + count);
                continue;
            }
            chi2 += (count - expected).powi(2) / expected;
            cells += 1;
        }
        if pool.0 > 0.0 {
            chi2 += (pool.1 - pool.0).powi(2) / pool.0;
        }
        assert!(cells > 400 && chi2 < 626.0, "{chi2} in {cells} cells");
    }

    /// Within rounding of the border of a cell, where the density jumps.
    fn near_border(image: &EnvironmentImage, direction: Vec3) -> bool {
        let cell = image.place(direction) * Vec2::new(32.0, 16.0);
        (cell - cell.round()).abs().min_element() < 1e-3
    }

    #[test]
    fn no_light_is_left_out_of_the_draws() {
        // One white texel: its light reaches into its neighbours, so that the draws must as well.
        let mut texels = vec![[0.0; 3]; 128];
        texels[70] = [1.0; 3];
        let environment = Environment::Image(EnvironmentImage::new([16, 8], texels, 0.0));
        for i in 0..10_000 {
            let direction = uniform_sphere(SamplePoint::new(2, i).get_2d(0));
            if environment.radiance(direction).x > 0.0 {
                assert!(environment.pdf(direction) > 0.0, "{direction}");
            }
        }
    }

    #[test]
    fn a_table_coarser_than_the_picture_leaves_nothing_out() {
        let size = [MAX_CELLS[0] + 300, 6];
        let mut texels = vec![[0.0; 3]; size[0] * size[1]];
        texels[size[0] * 3 + 777] = [5.0; 3];
        let environment = Environment::Image(EnvironmentImage::new(size, texels, 0.0));
        let Environment::Image(image) = &environment else { panic!("an image") };
        for dx in -8..=8 {
            let place = Vec2::new((777.5 + 0.12 * dx as f32) / size[0] as f32, 3.5 / 6.0);
            let direction = image.direction(place);
            assert!(environment.radiance(direction).x == 0.0 || environment.pdf(direction) > 0.0);
        }
        assert!(environment.radiance(image.direction(Vec2::new(777.5 / size[0] as f32, 3.5 / 6.0))).x > 4.0);
    }

    #[test]
    fn a_black_picture_is_black() {
        let black = Environment::Image(EnvironmentImage::new([4, 2], vec![[0.0; 3]; 8], 0.0));
        assert!(black.is_black() && Environment::Constant(Vec3::ZERO).is_black());
        assert_eq!(black.sample(Vec2::splat(0.5)), None);
        assert!(!Environment::Image(sky()).is_black());
    }
}
