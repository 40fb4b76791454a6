//! Pass 2, `LS+DS*E` in a pixel at a border, which has no footprint: what it shows of a surface is lit as the pixels beside
//! it are that show the same.
//!
//! A kernel around a point at the border would reach past it, under a thin wall, and find fewer photons than the footprints
//! next to it.

use super::footprint::Footprint;
use crate::light_path::Pictures;
use glam::Vec3;

/// What photons bring to the pixels beside one.
#[derive(Default)]
pub(super) struct Beside {
    neighbours: Vec<Neighbour>,
    /// Irradiance and the pictures that hold it, one neighbour's after the other's.
    parts: Vec<(Pictures, Vec3)>,
}

/// A pixel with a footprint.
struct Neighbour {
    view: u32,
    normal: Vec3,
    center: Vec3,
    parts: std::ops::Range<usize>,
}

/// Faces whose normals differ by more than this are two (cosine of 18°).
const SAME_FACE: f32 = 0.95;

/// Largest slope of the way from a pixel's middle to a point of the same piece of surface beside it.
const MOST_SLOPE: f32 = 0.35;

impl Beside {
    pub(super) fn clear(&mut self) {
        self.neighbours.clear();
        self.parts.clear();
    }

    /// Adds a pixel, and what photons bring to it.
    pub(super) fn add(&mut self, footprint: &Footprint, bring: impl FnOnce(&mut dyn FnMut(Pictures, Vec3))) {
        let first = self.parts.len();
        bring(&mut |pictures, irradiance| self.parts.push((pictures, irradiance)));
        let parts = first..self.parts.len();
        let Footprint { view, normal, .. } = *footprint;
        self.neighbours.push(Neighbour { view, normal, center: footprint.center(), parts });
    }

    /// Tells the irradiance of a point of a view whose seen side has a normal, and the pictures that hold it; false if no
    /// neighbour shows its surface.
    pub(super) fn irradiance(
        &self,
        view: u32,
        (point, normal): (Vec3, Vec3),
        mut tell: impl FnMut(Pictures, Vec3),
    ) -> bool {
        let shows = |neighbour: &&Neighbour| {
            let apart = point - neighbour.center;
            neighbour.view == view
                && neighbour.normal.dot(normal) > SAME_FACE
                && apart.dot(normal).abs() <= MOST_SLOPE * apart.length()
        };
        // The nearer a neighbour's middle, the more it tells.
        let weight = |neighbour: &Neighbour| neighbour.center.distance_squared(point).recip();
        let sum: f32 = self.neighbours.iter().filter(shows).map(weight).sum();
        if !(sum > 0.0 && sum.is_finite()) {
            return false;
        }
        for neighbour in self.neighbours.iter().filter(shows) {
            let share = weight(neighbour) / sum;
            let parts = &self.parts[neighbour.parts.clone()];
            parts.iter().for_each(|(pictures, irradiance)| tell(*pictures, *irradiance * share));
        }
        true
    }
}
