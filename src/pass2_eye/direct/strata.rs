//! Pass 2, `LD`: the classical ways to sample an area light with many shadow rays: a regular grid, jittered strata,
//! and strata that are divided where their corners disagree. They are kept to be compared with the default.

use super::area::{by_area, towards};
use super::{Incident, Receiver};
use crate::sampling::SamplePoint;
use crate::scene::{Light, LightSampling};
use glam::{Vec2, Vec3};

/// How often a stratum whose corners disagree is divided in four.
const DIVISIONS: u32 = 3;

/// A light whose surface is the image of the unit square, equal areas to equal areas.
pub(super) struct Strata<'a> {
    pub(super) receiver: &'a Receiver<'a>,
    pub(super) light: &'a Light,
    pub(super) shadow_rays: &'a mut u64,
}

impl Strata<'_> {
    /// Radiance due to the light by the scene's rule; `None` where that is the default, or the light has no strata, or
    /// the surface has highlights.
    pub(super) fn radiance(&mut self, sample: SamplePoint) -> Option<Vec3> {
        if !matches!(self.light, Light::Quad(_) | Light::Disk(_)) || self.receiver.bsdf.albedo().is_none() {
            return None;
        }
        let render = &self.receiver.scene.render;
        let across = render.light_grid;
        let size = 1.0 / across as f32;
        let mut sum = Vec3::ZERO;
        for i in 0..across * across {
            let corner = Vec2::new((i % across) as f32, (i / across) as f32) * size;
            sum += match render.light_sampling {
                LightSampling::Sobol => return None,
                LightSampling::Grid => self.lit(corner + 0.5 * size),
                LightSampling::Jittered => {
                    // The key 1 << 32 keeps the strata's numbers apart from those of lights and branches.
                    let within = sample.branch(1 << 32 | u64::from(i)).get_2d(2);
                    self.lit(corner + within * size)
                }
                LightSampling::Adaptive => self.divided(corner, size, DIVISIONS),
            };
        }
        Some(sum * (size * size))
    }

    /// Mean over a square of which only the corners are looked at, unless they disagree: what lies between them
    /// and hides none of them is not noticed.
    fn divided(&mut self, corner: Vec2, size: f32, divisions: u32) -> Vec3 {
        let at = |i: u32, size: f32| corner + Vec2::new((i & 1) as f32, (i >> 1) as f32) * size;
        let seen = (0..4).filter(|&i| self.lit(at(i, size)) != Vec3::ZERO).count();
        if seen == 0 || seen == 4 || divisions == 0 {
            let open = self.incident(corner + 0.5 * size).map_or(Vec3::ZERO, |i| self.receiver.radiance(&i));
            return open * (seen as f32 / 4.0);
        }
        let half = 0.5 * size;
        (0..4).map(|i| self.divided(at(i, half), half, divisions - 1)).sum::<Vec3>() * 0.25
    }

    fn lit(&mut self, u: Vec2) -> Vec3 {
        let incident = self.incident(u);
        self.receiver.visible(incident, self.shadow_rays)
    }

    fn incident(&self, u: Vec2) -> Option<Incident> {
        match self.light {
            Light::Quad(quad) => {
                towards(self.receiver, &quad.point(u * 2.0 - 1.0), by_area(quad.radiance, quad.area()))
            }
            Light::Disk(disk) => towards(self.receiver, &disk.point(u), by_area(disk.radiance, disk.area())),
            Light::Point { .. }
            | Light::Spot(_)
            | Light::Directional { .. }
            | Light::Sphere(_)
            | Light::Mesh(_) => None,
        }
    }
}
