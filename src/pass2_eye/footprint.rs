//! Pass 2, `DS*E`: the area of each pixel on the surface that the eye's main way leads to.
//!
//! Where the way meets nothing that moves, the light that falls there is the mean over all times; a pixel that sees
//! what moves has no footprint.
//!
//! A pixel's share of a caustic is the light that falls on its footprint. The pixels' corners are traced once
//! along the main way, refracted where that is possible; the four landing points of a pixel bound its footprint,
//! and neighbours share them, so that every photon falls on exactly one pixel: nothing is blurred, and the even
//! spacing of low-discrepancy photons is not lost to random places of looking.

use crate::geometry::{SheetId, SurfacePoint};
use crate::media::Media;
use crate::optics::{Arrival, Interaction};
use crate::sampling::hash;
use crate::scene::Scene;
use crate::spectrum::Line;
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// The footprints of all pixels, row by row; `None` where a pixel's corners do not reach one smooth piece of
/// surface.
#[derive(Debug, Default)]
pub struct Footprints {
    width: usize,
    pixels: Vec<Option<Footprint>>,
    /// What the middles of the other pixels show; empty if all have footprints.
    sights: Vec<Option<Sight>>,
}

/// What the middle of a pixel shows, at the end of the main way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Names the sheet and the way there.
    pub view: u32,
    /// Where it is.
    pub point: Vec3,
    /// Unit normal on the side that is seen.
    pub normal: Vec3,
}

/// Where a pixel's corners land.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Landing points, in order around the pixel.
    pub corners: [Vec3; 4],
    /// Unit normal on the side that is seen.
    pub normal: Vec3,
    /// The sheet of surface.
    pub sheet: SheetId,
    /// Names the sheet and the way there.
    pub view: u32,
    /// Area, m².
    pub area: f32,
    /// True if the eye's ray does not split on the way: the main way is the only one.
    pub only_way: bool,
    /// True if it is seen without any S between.
    pub direct: bool,
    /// Number of S on the way.
    pub specular: u8,
}

/// Where one ray of the main way ends.
#[derive(Clone, Copy)]
struct Landing {
    point: Vec3,
    normal: Vec3,
    sheet: SheetId,
    key: u64,
    only_way: bool,
    specular: u8,
    /// Whether its irradiance tells what is seen, and it is the same for all colours and times.
    certain: bool,
}

/// Names a sheet seen by certain reflections and refractions. A wall seen through water and the same wall above
/// it are two views.
#[must_use]
pub(super) fn view_code(sheet: SheetId, way: u64) -> u32 {
    hash(u64::from(sheet.0), way) as u32
}

/// More S than this on the main way, and a pixel is gathered point by point.
const MOST_BOUNCES: u8 = 16;

/// Corners whose normals differ by more than this lie on different faces (cosine of 18°).
const SAME_FACE: f32 = 0.95;

/// How far the pixel's middle may land from the middle of its corners, as a fraction of the footprint's
/// diagonal, for the corners to tell where its light falls.
const STRAIGHTNESS: f32 = 0.1;

impl Footprints {
    /// Traces the corners of all pixels, and the middles of those whose corners bound no footprint. Through a lens a pixel sees
    /// more than lies between its corners: no pixel has a footprint.
    #[must_use]
    pub fn trace(scene: &Scene, eye_media: &Media) -> Self {
        let (width, height) = (scene.image.width as usize, scene.image.height as usize);
        let pixels = if scene.camera.lens().is_some() {
            vec![None; width * height]
        } else {
            Self::between_corners(scene, eye_media)
        };
        let mut footprints = Self { width, pixels, sights: Vec::new() };
        if footprints.pixels.iter().any(Option::is_none) {
            let sight = |i: usize| {
                if footprints.pixels[i].is_some() || footprints.at_border(i) {
                    return None;
                }
                let middle = Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
                let Landing { point, normal, sheet, key, .. } = follow_main_way(scene, eye_media, middle)?;
                Some(Sight { view: view_code(sheet, key), point, normal })
            };
            footprints.sights = (0..width * height).into_par_iter().map(sight).collect();
        }
        footprints
    }

    fn between_corners(scene: &Scene, eye_media: &Media) -> Vec<Option<Footprint>> {
        let (width, height) = (scene.image.width as usize, scene.image.height as usize);
        // One more across and down than there are pixels.
        let stride = width + 1;
        let corner = |i: usize| land(scene, eye_media, Vec2::new((i % stride) as f32, (i / stride) as f32));
        let corners: Vec<Option<Landing>> =
            (0..stride * (height + 1)).into_par_iter().with_max_len(stride).map(corner).collect();
        let pixel = |i: usize| {
            let (x, y) = (i % width, i / width);
            let at = y * stride + x;
            let around = [corners[at]?, corners[at + 1]?, corners[at + stride + 1]?, corners[at + stride]?];
            let middle = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            Footprint::between(&around, || land(scene, eye_media, middle))
        };
        (0..width * height).into_par_iter().map(pixel).collect()
    }

    /// What a pixel shows, if it is one thing: its footprint or, away from borders, what its middle shows.
    #[must_use]
    pub fn sight(&self, index: usize) -> Option<Sight> {
        match self.get(index) {
            Some(footprint) => {
                let Footprint { view, normal, .. } = *footprint;
                Some(Sight { view, point: footprint.center(), normal })
            }
            None => *self.sights.get(index)?,
        }
    }

    /// A pixel's footprint.
    #[inline]
    #[must_use]
    pub fn get(&self, index: usize) -> Option<&Footprint> {
        self.pixels.get(index)?.as_ref()
    }

    /// True for a pixel without footprint beside one that has one: it shows an edge of something.
    #[must_use]
    pub fn at_border(&self, index: usize) -> bool {
        if self.pixels.get(index).is_none_or(Option::is_some) {
            return false;
        }
        let (x, y) = (index % self.width, index / self.width);
        let columns = x.saturating_sub(1)..(x + 2).min(self.width);
        let mut rows = y.saturating_sub(1)..(y + 2).min(self.pixels.len() / self.width);
        rows.any(|row| self.pixels[row * self.width..][columns.clone()].iter().any(Option::is_some))
    }

    /// True if any footprint is seen without any S between.
    #[must_use]
    pub fn any_direct(&self) -> bool {
        self.pixels.iter().flatten().any(|footprint| footprint.direct)
    }

    /// Number of pixels, and pixels across.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.pixels.len(), self.width)
    }

    /// Bytes per pixel.
    pub const BYTES_PER_PIXEL: u64 = (size_of::<Option<Footprint>>() + size_of::<Option<Sight>>()) as u64;
}

impl Footprint {
    fn between(around: &[Landing; 4], middle: impl Fn() -> Option<Landing>) -> Option<Self> {
        let first = around[0];
        let alike = |l: &Landing| {
            l.sheet == first.sheet && l.key == first.key && l.normal.dot(first.normal) > SAME_FACE
        };
        if !around.iter().all(alike) {
            return None;
        }
        let corners = around.map(|l| l.point);
        let normal = around.iter().map(|l| l.normal).sum::<Vec3>().normalize();
        let turn = |i: usize| {
            let (a, b, c) = (corners[i], corners[(i + 1) % 4], corners[(i + 2) % 4]);
            (b - a).cross(c - b).dot(normal)
        };
        let turns = [turn(0), turn(1), turn(2), turn(3)];
        let convex = turns.iter().all(|t| *t > 0.0) || turns.iter().all(|t| *t < 0.0);
        let diagonals = (corners[2] - corners[0]).cross(corners[3] - corners[1]);
        let area = 0.5 * diagonals.dot(normal).abs();
        if !convex || area <= 0.0 || area.is_nan() {
            return None;
        }
        if first.key != 1 {
            let landing = middle()?;
            let center = corners.iter().sum::<Vec3>() / 4.0;
            let diagonal = (corners[2] - corners[0]).length().max((corners[3] - corners[1]).length());
            let straight = (landing.point - center).length() <= STRAIGHTNESS * diagonal;
            if !alike(&landing) || !straight {
                return None;
            }
        }
        let only_way = around.iter().all(|l| l.only_way);
        let view = view_code(first.sheet, first.key);
        let Landing { sheet, specular, .. } = first;
        Some(Self { corners, normal, sheet, view, area, only_way, direct: first.key == 1, specular })
    }

    /// Middle of the corners.
    #[must_use]
    pub fn center(&self) -> Vec3 {
        self.corners.iter().sum::<Vec3>() / 4.0
    }
}

/// Where the main way from a raster position ends; `None` if that has highlights, where irradiance alone does not say what
/// is seen, if light is taken apart on the way, or if something moves there.
fn land(scene: &Scene, eye_media: &Media, raster: Vec2) -> Option<Landing> {
    follow_main_way(scene, eye_media, raster).filter(|landing| landing.certain)
}

/// Follows the main way from a raster position to the first D.
fn follow_main_way(scene: &Scene, eye_media: &Media, raster: Vec2) -> Option<Landing> {
    let mut ray = scene.camera.ray(raster);
    let mut media = *eye_media;
    let mut key = 1_u64;
    let (mut only_way, mut certain) = (true, true);
    for specular in 0..MOST_BOUNCES {
        let hit = scene.geometry.closest_hit(&ray)?;
        certain &= !scene.geometry.may_meet_moving(&ray, hit.t);
        let arrival = Arrival::new(scene, &ray, &hit, media, None);
        let (material, surface) = (arrival.material, &hit.surface);
        let interaction =
            if material.has_specular() { arrival.interact(|| UNDISPERSED) } else { Interaction::default() };
        if material.has_diffuse() {
            let normal = facing(surface, ray.direction);
            only_way &= interaction.reflected.is_none() && interaction.refracted.is_none();
            certain &= material.is_lambertian();
            let (point, sheet) = (surface.point, hit.sheet);
            return Some(Landing { point, normal, sheet, key, only_way, specular, certain });
        }
        only_way &= interaction.reflected.is_none() || interaction.refracted.is_none();
        let outcome = interaction.refracted.or(interaction.reflected)?;
        certain &= outcome.wavelength.is_none();
        key = outcome.extend_key(key);
        media = outcome.media;
        let origin = arrival.origin_toward(outcome.direction);
        ray = ray.continue_from(origin, outcome.direction);
    }
    None
}

/// Stands for the wavelength of light that is taken apart.
const UNDISPERSED: Line = Line { wavelength: crate::scene::FRAUNHOFER[1], weight: Vec3::ONE };

/// The geometric normal on the side that a ray comes from.
fn facing(surface: &SurfacePoint, direction: Vec3) -> Vec3 {
    if direction.dot(surface.normal) > 0.0 { -surface.normal } else { surface.normal }
}
