//! The nearest hit so far.

use glam::Vec3;

/// Where a primitive lies in the structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// Lane `slot % 8` of packet `slot / 8`.
    Triangle(u32),
    /// Index among the other primitives.
    Entry(u32),
    /// Index of an instance among the other primitives, and the slot of a triangle in its mesh.
    Instance(u32, u32),
}

/// Areas of the three parts into which a hit cuts its triangle, up to a factor that they share. The test for the hit
/// has them, and the surface there follows from them, so that no triangle is tested twice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Areas(pub(super) Vec3);

impl Areas {
    pub(super) const NONE: Self = Self(Vec3::ZERO);

    /// The barycentric weights of the three corners.
    #[inline]
    pub(super) fn weights(self) -> Vec3 {
        let Vec3 { x, y, z } = self.0;
        self.0 / (x + y + z)
    }
}

/// The nearest hit so far. Of two at the same distance the primitive that came first in the scene counts, so
/// that the order in which a structure visits them does not show.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    /// Its distance; the largest float if there is none yet.
    pub(super) t: f32,
    /// Number of the primitive.
    pub(super) primitive: u32,
    /// Where it lies; `None` if there is no hit yet.
    pub(super) place: Option<Place>,
    /// [`Areas`] of a triangle; 0 for other primitives.
    pub(super) areas: Areas,
}

impl Nearest {
    pub(super) const NONE: Self = Self { t: f32::MAX, primitive: u32::MAX, place: None, areas: Areas::NONE };

    /// No hit yet, and none counts that is farther.
    pub(super) fn before(t_max: f32) -> Self {
        Self { t: t_max.min(f32::MAX), ..Self::NONE }
    }

    /// Takes a hit if it is nearer.
    #[inline]
    pub(super) fn offer(&mut self, t: f32, primitive: u32, place: Place, areas: Areas) {
        if t < self.t || (t == self.t && primitive < self.primitive) {
            *self = Self { t, primitive, place: Some(place), areas };
        }
    }

    /// Hits below this distance may still count.
    #[inline]
    pub(super) fn limit(&self) -> f32 {
        // The next float after one that is not negative.
        f32::from_bits(self.t.to_bits() + 1)
    }
}
