//! What moves while the shutter is open: primitives at rest in a frame of their own, which moves as a whole. Rays
//! are taken into that frame as it stands at their time.

use super::instance::placed;
use super::nearest::Nearest;
use super::{Bounds, Geometry, Hit, HullPoint, Motion, Ray, SheetId, SurfacePoint};
use crate::scene::ObjectId;
use glam::Vec3;

/// Primitives that move together, and the structure over them.
#[derive(Debug)]
pub(super) struct Moving {
    part: Geometry,
    motion: Motion,
    /// Box over the whole time.
    bounds: Bounds,
    /// Its sheets have successive numbers from this on.
    first_sheet: u32,
}

/// With more points than this, the hull of what turns is that of its box.
const MOST_TURNED_POINTS: usize = 64;

impl Moving {
    pub(super) fn new(part: Geometry, motion: Motion, bounds: Bounds, first_sheet: u32) -> Self {
        Self { part, motion, bounds, first_sheet }
    }

    /// The ray in its frame; distances along it are the same numbers.
    #[inline]
    fn local(&self, ray: &Ray) -> Ray {
        if self.motion.turn.is_none() {
            let origin = (ray.origin.as_dvec3() - self.motion.shift(ray.time)).as_vec3();
            return Ray { origin, ..*ray };
        }
        let to_local = self.motion.pose(ray.time).inverse();
        Ray {
            origin: to_local.transform_point3(ray.origin.as_dvec3()).as_vec3(),
            direction: to_local.transform_vector3(ray.direction.as_dvec3()).as_vec3(),
            time: ray.time,
        }
    }

    /// Distance of the nearest hit in `(0, t_max)`.
    #[inline]
    pub(super) fn intersect(&self, ray: &Ray, t_max: f32) -> Option<f32> {
        let mut nearest = Nearest::before(t_max);
        self.part.find_nearest(&self.local(ray), &mut nearest);
        (nearest.place.is_some() && nearest.t < t_max).then_some(nearest.t)
    }

    #[inline]
    pub(super) fn any(&self, ray: &Ray, t_max: f32) -> bool {
        self.part.any_hit(&self.local(ray), t_max)
    }

    /// The hit at the distance that [`Moving::intersect`] found; the object is left to the caller.
    pub(super) fn hit(&self, ray: &Ray, t: f32) -> Option<Hit> {
        let local = self.local(ray);
        // Nothing is nearer: the walk is short.
        let mut nearest = Nearest::before(t);
        self.part.find_nearest(&local, &mut nearest);
        let hit = self.part.hit(&local, &nearest)?;
        let surface = if self.motion.turn.is_none() {
            let shift = self.motion.shift(ray.time);
            let point = (hit.surface.point.as_dvec3() + shift).as_vec3();
            // What its own frame has, and rounding to f32 in the world.
            let error = hit.surface.error + point.abs().max_element() * f32::EPSILON;
            SurfacePoint { point, error, ..hit.surface }
        } else {
            let to_world = self.motion.pose(ray.time);
            placed(hit.surface, &to_world, &to_world.matrix3.inverse().transpose())
        };
        Some(Hit { surface, sheet: SheetId(self.first_sheet + hit.sheet.0), ..hit })
    }

    /// The number after that of its last sheet.
    pub(super) fn end_of_sheets(&self) -> u32 {
        self.first_sheet + self.part.sheet_count()
    }

    pub(super) fn kernel_mass(&self, sheet: SheetId, point: Vec3, radius: f32, time: f32) -> f32 {
        let to_world = self.motion.pose(time);
        let local = to_world.inverse().transform_point3(point.as_dvec3()).as_vec3();
        // Where it is scaled unevenly, as wide as it is on average.
        let scale = libm::cbrt(to_world.matrix3.determinant()) as f32;
        self.part.kernel_mass(SheetId(sheet.0 - self.first_sheet), local, radius / scale, time)
    }

    pub(super) fn moves(&self) -> bool {
        !self.motion.is_still()
    }

    /// Box over the whole time.
    pub(super) fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Spheres whose convex hull holds it over the whole time.
    pub(super) fn hull(&self) -> Vec<HullPoint> {
        let object = ObjectId(0);
        let hull = self.part.hull(object);
        if self.motion.turn.is_some() && hull.len() > MOST_TURNED_POINTS {
            let corners = self.part.object_bounds(object).corners();
            return self.motion.swept(corners.iter().map(super::point));
        }
        self.motion.swept(hull)
    }

    pub(super) fn primitive_count(&self) -> usize {
        self.part.primitive_count()
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of::<Self>() + self.part.own_memory_bytes()
    }
}

/// Box over the whole time of what has the box `local` in its own frame.
pub(super) fn swept_bounds(local: Bounds, motion: &Motion) -> Bounds {
    if local.is_empty() {
        return Bounds::EMPTY;
    }
    let world = motion.swept_box(local);
    // Rays are rounded in a frame whose origin may be far away.
    let far = local.min.abs().max(local.max.abs()).max_element();
    let pad = 8.0 * f32::EPSILON * far * motion.largest_scale();
    Bounds::new(world.min - pad, world.max + pad).padded()
}
