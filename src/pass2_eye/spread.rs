//! Pass 2, `LS+DE`: light images and points of light over the pixels that see them without any S between.
//!
//! What the camera sees directly maps to the screen by its projection alone, so that a light image covers the
//! pixels that its outline encloses on the screen, each by its exact share. It gives its irradiance, flux over area, to
//! every pixel whose footprint lies on the same sheet, on the side that is lit.

use super::footprint::{Footprint, Footprints};
use super::outline::Coverage;
use crate::geometry::SheetId;
use crate::light_path::Kind;
use crate::pass1_light::{LightImage, Spread};
use crate::photon_map::Photon;
use crate::sampling::hash;
use crate::scene::Camera;
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Irradiance that the pixels' footprints get, row by row; 0 where a footprint is not seen directly, and empty if none
/// is.
#[derive(Debug, Default)]
pub struct Irradiance {
    pixels: Vec<Vec3>,
}

/// Rows of pixels that are one unit of parallel work.
const BAND: usize = 8;

/// The halves of an image thinner than this, in pixels, are spread as points.
const THINNEST: f32 = 0.1;

/// Points per pixel's width of a thin image.
const DENSITY: f32 = 2.0;

/// Most points along one side of a thin image.
const MOST_POINTS: f32 = 64.0;

/// An image that covers more pixels than this each way is spread as points: it lies almost in the eye.
const WIDEST: f32 = 4096.0;

/// What is spread, on the screen.
#[derive(Clone, Copy)]
enum Patch<'a> {
    /// A quadrilateral; the irradiance of its halves over its power.
    Even { image: &'a LightImage, corners: [Vec2; 4], per_power: [f32; 2] },
    /// A point that gets all of the power.
    Point { at: Vec2, light: Light },
}

/// Light on a surface.
#[derive(Clone, Copy)]
struct Light {
    position: Vec3,
    direction: Vec3,
    sheet: SheetId,
    power: Vec3,
}

impl Irradiance {
    /// Bytes per pixel of both halves.
    pub const BYTES_PER_PIXEL: u64 = 2 * size_of::<Vec3>() as u64;

    /// Spreads the light of one half, of the kinds that are picked, over the pixels.
    #[must_use]
    pub fn gather(
        camera: &Camera,
        footprints: &Footprints,
        spread: &Spread,
        pick: impl Fn(Kind) -> bool,
    ) -> Self {
        let (count, width) = footprints.size();
        if !footprints.any_direct() {
            return Self::default();
        }
        let mut patches = Vec::with_capacity(spread.images.len() + spread.points.len());
        let on_screen = Screen { camera, size: Vec2::new(width as f32, (count / width) as f32) };
        for image in spread.images.iter().filter(|image| pick(image.kind)) {
            let middle = image.corners.iter().sum::<Vec3>() / 4.0;
            if on_screen.sees(middle, image.direction, image.normal) {
                on_screen.place_image(image, &mut patches);
            }
        }
        for photon in spread.points.iter().filter(|photon| pick(photon.kind)) {
            if on_screen.sees(photon.position, photon.direction, photon.normal) {
                on_screen.place(Light::from(photon), &mut patches);
            }
        }
        let mut pixels = vec![Vec3::ZERO; count];
        pixels.par_chunks_mut(BAND * width).enumerate().for_each(|(band, pixels)| {
            let mut rows = Rows { footprints, width, first: band * BAND, pixels };
            let mut coverage = Coverage::default();
            patches.iter().for_each(|(low, high, patch)| {
                if *low < (rows.first + BAND) as f32 && *high >= rows.first as f32 {
                    rows.light(patch, &mut coverage);
                }
            });
        });
        Self { pixels }
    }

    /// Irradiance of a pixel whose footprint is seen directly.
    #[inline]
    #[must_use]
    pub fn get(&self, index: usize) -> Vec3 {
        self.pixels[index]
    }
}

impl From<&Photon> for Light {
    fn from(photon: &Photon) -> Self {
        let Photon { position, direction, sheet, power, .. } = *photon;
        Self { position, direction, sheet, power }
    }
}

/// Where things lie on the screen.
struct Screen<'a> {
    camera: &'a Camera,
    /// Pixels across and down.
    size: Vec2,
}

/// A patch with the rows of the screen between which it lies.
type Placed<'a> = (f32, f32, Patch<'a>);

impl Screen<'_> {
    /// Whether the eye looks at the side on which light comes to rest. What lies behind on the same sheet, on the far side of a
    /// ball, has its place on the screen too.
    fn sees(&self, position: Vec3, direction: Vec3, normal: Vec3) -> bool {
        // On the side of the surface that the light comes from.
        normal.dot(direction) * normal.dot(self.camera.to_eye(position)) < 0.0
    }

    fn place(&self, light: Light, patches: &mut Vec<Placed<'_>>) {
        let Some(at) = self.camera.raster(light.position) else { return };
        if at.cmpge(Vec2::ZERO).all() && at.cmplt(self.size).all() {
            patches.push((at.y, at.y, Patch::Point { at, light }));
        }
    }

    fn place_image<'a>(&self, image: &'a LightImage, patches: &mut Vec<Placed<'a>>) {
        let [a, b, c, d] = image.corners.map(|corner| self.camera.raster(corner));
        let (Some(a), Some(b), Some(c), Some(d)) = (a, b, c, d) else {
            self.place_points(image, Vec2::splat(MOST_POINTS), patches);
            return;
        };
        let corners = [a, b, c, d];
        let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        if high.cmplt(Vec2::ZERO).any() || low.cmpge(self.size).any() {
            return;
        }
        let world = |i: usize, j: usize, k: usize| {
            let [p, q, r] = [i, j, k].map(|n| image.corners[n]);
            0.5 * (q - p).cross(r - p).length()
        };
        let areas = [world(0, 1, 2), world(0, 2, 3)];
        let longest = (a - b).length().max((c - d).length()).max((a - d).length().max((b - c).length()));
        let thickness = |p: Vec2, q: Vec2, r: Vec2| (q - p).perp_dot(r - p).abs() / longest;
        let thin = thickness(a, b, c).min(thickness(a, c, d)) < THINNEST;
        let extent = (high - low).max_element();
        if thin || areas[0].min(areas[1]) <= 0.0 || extent >= WIDEST || extent.is_nan() {
            let across = (a - b).length().max((c - d).length());
            let down = (a - d).length().max((b - c).length());
            let counts = (Vec2::new(across, down) * DENSITY).ceil();
            self.place_points(image, counts.clamp(Vec2::ONE, Vec2::splat(MOST_POINTS)), patches);
            return;
        }
        patches.push((
            low.y,
            high.y,
            Patch::Even { image, corners, per_power: areas.map(|area| 0.5 / area) },
        ));
    }

    /// A grid of points in place of an image, jittered as a whole so that it lights in the mean what the image does: where
    /// many small images meet in a focus, middles alone would make it too sharp.
    fn place_points(&self, image: &LightImage, counts: Vec2, patches: &mut Vec<Placed<'_>>) {
        let [a, b, c, d] = image.corners;
        let (across, down) = (counts.x as u32, counts.y as u32);
        let power = image.power / (across * down) as f32;
        let jitter = jitter(image);
        for j in 0..down {
            let t = (j as f32 + jitter.y) / counts.y;
            for i in 0..across {
                let s = (i as f32 + jitter.x) / counts.x;
                let position = a.lerp(b, s).lerp(d.lerp(c, s), t);
                let light = Light { position, direction: image.direction, sheet: image.sheet, power };
                self.place(light, patches);
            }
        }
    }
}

/// Two numbers in [0, 1) that differ from image to image.
fn jitter(image: &LightImage) -> Vec2 {
    let [a, _, c, _] = image.corners.map(|corner| corner.to_array().map(f32::to_bits));
    let word = |x: u32, y: u32| u64::from(x) << 32 | u64::from(y);
    let bits = hash(hash(word(a[0], a[1]), word(a[2], c[0])), word(c[1], c[2]));
    let unit = |bits: u64| (bits & 0xff_ffff) as f32 / 16_777_216.0;
    Vec2::new(unit(bits >> 40), unit(bits))
}

/// A band of rows of pixels.
struct Rows<'a> {
    footprints: &'a Footprints,
    width: usize,
    first: usize,
    pixels: &'a mut [Vec3],
}

impl Rows<'_> {
    fn light(&mut self, patch: &Patch<'_>, coverage: &mut Coverage) {
        match patch {
            Patch::Point { at, light } => {
                let index = (at.y as usize - self.first) * self.width + at.x as usize;
                if let Some(footprint) = self.lit(index, light.sheet, light.position, light.direction) {
                    let area = footprint.area;
                    self.pixels[index] += light.power / area;
                }
            }
            Patch::Even { image, corners, per_power } => {
                let [a, b, c, d] = *corners;
                let middle = image.corners.iter().sum::<Vec3>() / 4.0;
                let last = self.pixels.len() / self.width + self.first;
                let columns = coverage.start(corners, self.width);
                for row in coverage.rows(self.first, last) {
                    coverage.clear();
                    coverage.add([a, b, c], per_power[0], row);
                    coverage.add([a, c, d], per_power[1], row);
                    let start = (row - self.first) * self.width;
                    for (column, share) in columns.clone().zip(coverage.shares(&columns)) {
                        let index = start + column;
                        if share > 0.0 && self.lit(index, image.sheet, middle, image.direction).is_some() {
                            self.pixels[index] += image.power * share;
                        }
                    }
                }
            }
        }
    }

    /// The footprint of a pixel of the band, if it is lit by light on a sheet, near a position.
    #[inline]
    fn lit(&self, index: usize, sheet: SheetId, position: Vec3, direction: Vec3) -> Option<&Footprint> {
        let footprint = self.footprints.get(self.first * self.width + index)?;
        let matches = footprint.direct && footprint.sheet == sheet && direction.dot(footprint.normal) < 0.0;
        if !matches {
            return None;
        }
        // Another fold of the same sheet may lie behind: what is lit lies within 45° of the footprint's plane.
        let to = position - footprint.corners[0];
        let height = to.dot(footprint.normal);
        (height * height <= 0.5 * to.length_squared()).then_some(footprint)
    }
}
