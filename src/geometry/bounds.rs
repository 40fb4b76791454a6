//! Axis-aligned boxes.

use super::{HIT_ROUNDING, Ray};
use glam::Vec3;

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Least corner.
    pub min: Vec3,
    /// Greatest corner.
    pub max: Vec3,
}

impl Bounds {
    /// The box that holds nothing; the identity of [`Bounds::union`].
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The box between two corners.
    #[must_use]
    pub fn new(min: Vec3, max: Vec3) -> Self {
        Self { min, max }
    }

    /// The smallest box around some points.
    #[must_use]
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self::new(b.min.min(p), b.max.max(p)))
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self::new(self.min.min(other.min), self.max.max(other.max))
    }

    /// The box with each face moved out by two ulps of the largest coordinate, so that a flat surface has
    /// a box with some thickness and rounding in the slab test cannot lose it.
    #[must_use]
    pub fn padded(self) -> Self {
        let pad = self.min.abs().max(self.max.abs()) * (2.0 * f32::EPSILON) + f32::MIN_POSITIVE;
        Self::new(self.min - pad, self.max + pad)
    }

    /// The middle.
    #[must_use]
    pub fn center(&self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    /// Radius of the sphere around the box's middle that holds the box.
    #[must_use]
    pub fn radius(&self) -> f32 {
        (self.max - self.min).length() * 0.5
    }

    /// Half the area of its surface.
    #[must_use]
    pub fn half_area(&self) -> f32 {
        let size = self.max - self.min;
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    /// True if it holds no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// True if the ray may meet the box before `t_max`; false is certain.
    #[must_use]
    pub fn may_meet(&self, ray: &Ray, t_max: f32) -> bool {
        let (origin, inverse) = (ray.origin.as_dvec3(), ray.direction.as_dvec3().recip());
        // In f64 the distances are good to far less than the rounding of the box itself.
        let slack = f64::from((self.min - ray.origin).abs().max((self.max - ray.origin).abs()).max_element());
        let slack = slack * f64::from(HIT_ROUNDING);
        let (mut enter, mut leave) = (0.0_f64, f64::from(t_max));
        for axis in 0..3 {
            let low = (f64::from(self.min[axis]) - slack - origin[axis]) * inverse[axis];
            let high = (f64::from(self.max[axis]) + slack - origin[axis]) * inverse[axis];
            // Not a number where the ray runs within a plane: that axis says nothing then.
            if !low.is_nan() && !high.is_nan() {
                (enter, leave) = (enter.max(low.min(high)), leave.min(low.max(high)));
            }
        }
        enter <= leave
    }

    /// The eight corners.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 8] {
        std::array::from_fn(|i| {
            Vec3::select(glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0), self.max, self.min)
        })
    }
}
