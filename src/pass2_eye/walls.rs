//! Pass 2, `LS+DS*E` in a pixel at a border: how far a kernel around a point reaches before something stands in its way.
//!
//! Without it a kernel at the foot of a thin wall would count the photons behind the wall.

use crate::geometry::{Geometry, Ray, SurfacePoint};
use glam::Vec3;

/// Directions around a point in which is looked.
const SECTORS: usize = 16;

/// Height above the surface at which is looked, in kernel radii.
const HEIGHT: f32 = 0.05;

/// A straight wall is nearer in the middle of a sector than at its ends by up to the cosine of half of it.
const MIDDLE: f32 = 0.98;

/// What a kernel around a point sees of its surface.
pub(super) struct Walls {
    tangents: [Vec3; 2],
    /// Reach between one direction and the next.
    reach: [f32; SECTORS],
}

impl Walls {
    /// Looks around from just above a point, on the side of `normal`; `None` if nothing is in the way.
    pub(super) fn around(
        geometry: &Geometry,
        (surface, normal): (&SurfacePoint, Vec3),
        radius: f32,
        time: f32,
    ) -> Option<Self> {
        let origin = surface.point + normal * (HEIGHT * radius).max(4.0 * surface.error);
        let (x, y) = normal.any_orthonormal_pair();
        let ends: [f32; SECTORS] = std::array::from_fn(|i| {
            let angle = std::f32::consts::TAU * i as f32 / SECTORS as f32;
            let ray = Ray::new(origin, x * libm::cosf(angle) + y * libm::sinf(angle)).at_time(time);
            if !geometry.any_hit(&ray, radius) {
                return f32::INFINITY;
            }
            geometry.closest_hit(&ray).map_or(f32::INFINITY, |hit| hit.t)
        });
        let reach: [f32; SECTORS] = std::array::from_fn(|i| MIDDLE * ends[i].min(ends[(i + 1) % SECTORS]));
        reach.iter().any(|r| *r < radius).then_some(Self { tangents: [x, y], reach })
    }

    /// Whether nothing stands between the point and one that lies off it by `offset`.
    pub(super) fn reach(&self, offset: Vec3) -> bool {
        let (x, y) = (offset.dot(self.tangents[0]), offset.dot(self.tangents[1]));
        let turn = libm::atan2f(y, x).rem_euclid(std::f32::consts::TAU) / std::f32::consts::TAU;
        let sector = (turn * SECTORS as f32) as usize;
        offset.length() <= self.reach[sector.min(SECTORS - 1)]
    }

    /// Share of the mass of an Epanechnikov kernel that is within reach.
    pub(super) fn mass(&self, radius: f32) -> f32 {
        let within = |reach: &f32| {
            let x = (reach / radius).min(1.0).powi(2);
            x * (2.0 - x)
        };
        self.reach.iter().map(within).sum::<f32>() / SECTORS as f32
    }
}
