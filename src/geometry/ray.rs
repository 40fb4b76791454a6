//! Rays, and the one rule that keeps a new ray off the surface it starts from.

use glam::{DVec3, Vec3};

/// A ray from `origin` along the unit vector `direction`, at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// When it travels, from 0 where the shutter opens to 1 where it closes: light takes no time on its way, so
    /// that all rays of a path have the same.
    pub time: f32,
}

impl Ray {
    /// A ray from `origin` along the unit vector `direction`, when the shutter opens.
    #[inline]
    #[must_use]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, time: 0.0 }
    }

    /// The same ray at another moment.
    #[inline]
    #[must_use]
    pub fn at_time(self, time: f32) -> Self {
        Self { time, ..self }
    }

    /// The next ray of the same path: it keeps the time.
    #[inline]
    #[must_use]
    pub fn continue_from(&self, origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, time: self.time }
    }

    /// The point at distance `t`.
    #[inline]
    #[must_use]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// A ray in f64, for primitives that are tested there.
#[derive(Clone, Copy, Debug)]
pub(super) struct WideRay {
    pub(super) origin: DVec3,
    pub(super) direction: DVec3,
    /// Squared length of the direction, which is 1 only to the rounding of f32.
    pub(super) square: f64,
    /// One over it.
    pub(super) inverse_square: f64,
}

impl WideRay {
    #[inline]
    pub(super) fn new(ray: &Ray) -> Self {
        Self::of(ray.origin.as_dvec3(), ray.direction.as_dvec3())
    }

    #[inline]
    pub(super) fn of(origin: DVec3, direction: DVec3) -> Self {
        let square = direction.length_squared();
        Self { origin, direction, square, inverse_square: 1.0 / square }
    }

    /// The point at distance `t`.
    #[inline]
    pub(super) fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }
}

/// Moves a surface point off its surface to the side of `direction`, by no more than the point may be
/// wrong: `error` bounds how far the rounded point lies from the true surface. A ray that starts at the
/// result and leaves to that side cannot meet the same flat or convex piece of surface again. There is no
/// scene-sized epsilon: the bound comes from the arithmetic that made the point (Pharr et al., *Physically
/// Based Rendering*, 6.8 "Managing rounding error").
#[inline]
#[must_use]
pub fn offset_origin(point: Vec3, error: f32, normal: Vec3, direction: Vec3) -> Vec3 {
    // The sum of the normal's components turns a bound per coordinate into one along the normal.
    let distance = error * normal.abs().element_sum();
    let side = if direction.dot(normal) < 0.0 { -normal } else { normal };
    let moved = point + side * distance;
    Vec3::new(away(point.x, moved.x, side.x), away(point.y, moved.y, side.y), away(point.z, moved.z, side.z))
}

/// Rounds `moved` one step further along `side`, so that rounding the sum cannot undo the move.
#[inline]
fn away(point: f32, moved: f32, side: f32) -> f32 {
    if side == 0.0 || (moved == point && side.abs() < 1e-3) {
        return moved;
    }
    if moved == 0.0 {
        return f32::from_bits(1).copysign(side);
    }
    // Floats of one sign are in the order of their bits.
    let outward = (moved > 0.0) == (side > 0.0);
    f32::from_bits(if outward { moved.to_bits() + 1 } else { moved.to_bits() - 1 })
}

/// Bound on how far [`offset_origin`] moves a point along the normal.
#[inline]
#[must_use]
pub fn offset_distance(point: Vec3, error: f32, normal: Vec3) -> f32 {
    (error + point.abs().max_element() * (2.0 * f32::EPSILON)) * normal.abs().element_sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_that_continues_another_keeps_its_time() {
        let ray = Ray::new(Vec3::ZERO, Vec3::X).at_time(0.25);
        let next = ray.continue_from(Vec3::X, Vec3::Y);
        assert_eq!(next, Ray { origin: Vec3::X, direction: Vec3::Y, time: 0.25 });
    }

    #[test]
    fn an_offset_point_lies_strictly_on_the_side_of_the_ray_at_every_scale() {
        for scale in [1e-6_f32, 1e-3, 1.0, 1e3, 1e6] {
            let point = Vec3::new(0.3, 1.7, -2.2) * scale;
            let normal = Vec3::new(0.6, 0.0, 0.8);
            let error = 2.2 * scale * f32::EPSILON;
            let up = offset_origin(point, error, normal, normal);
            let down = offset_origin(point, error, normal, -normal);
            let height = |p: Vec3| (p.as_dvec3() - point.as_dvec3()).dot(normal.as_dvec3());
            assert!(height(up) >= f64::from(error), "{scale}: {}", height(up));
            assert!(height(down) <= -f64::from(error), "{scale}: {}", height(down));
            assert!(height(up) < 20.0 * f64::from(error), "{scale}: moved too far");
            assert!(height(up) <= f64::from(offset_distance(point, error, normal)), "{scale}: not bounded");
        }
    }
}
