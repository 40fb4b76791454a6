//! Ray against disk.

use super::bounds::Bounds;
use super::polygon::epanechnikov_half_plane;
use super::{HullPoint, Ray, SurfacePoint, TextureCoordinates};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::{PI, TAU};

/// Corners of the polygon around a circle that stands for it in a hull.
const RING: u32 = 32;

/// A flat disk; its normal is the front.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Disk {
    center: DVec3,
    /// Unit normal.
    normal: DVec3,
    /// Unit vector in the disk: direction of u.
    along: DVec3,
    radius: f64,
}

impl Disk {
    /// The normal need not have length 1; the radius is positive.
    pub(super) fn new(center: Vec3, normal: Vec3, radius: f32) -> Self {
        let normal = normal.as_dvec3().normalize_or(DVec3::Y);
        let along = normal.any_orthonormal_vector();
        Self { center: center.as_dvec3(), normal, along, radius: f64::from(radius) }
    }

    /// Distance along the ray in `(0, t_max)`; a ray in the disk's own plane misses.
    #[inline]
    pub(super) fn intersect(&self, ray: &Ray, t_max: f32) -> Option<f32> {
        let (t, local) = self.meet(ray)?;
        let inside = local.length_squared() <= self.radius * self.radius;
        (inside && t > 0.0 && t < t_max).then_some(t)
    }

    /// Where the ray meets the plane: the distance, and the point from the centre.
    #[inline]
    fn meet(&self, ray: &Ray) -> Option<(f32, DVec3)> {
        let (from, direction) = (ray.origin.as_dvec3() - self.center, ray.direction.as_dvec3());
        let t = -self.normal.dot(from) / self.normal.dot(direction);
        // Parallel rays give an infinite or undefined distance.
        t.is_finite().then(|| (t as f32, from + direction * t))
    }

    pub(super) fn surface(&self, ray: &Ray) -> SurfacePoint {
        let local = self.meet(ray).map_or(DVec3::ZERO, |(_, local)| local);
        let local = local - self.normal * self.normal.dot(local);
        let point = (self.center + local).as_vec3();
        let normal = self.normal.as_vec3();
        SurfacePoint {
            point,
            // Half an ulp per coordinate from rounding to f32, doubled.
            error: point.abs().max(self.center.as_vec3().abs()).max_element() * f32::EPSILON,
            normal,
            shading_normal: normal,
            texture: TextureCoordinates::Uv(Vec2::new(
                local.dot(self.along) as f32,
                local.dot(self.normal.cross(self.along)) as f32,
            )),
        }
    }

    pub(super) fn bounds(&self) -> Bounds {
        let reach = (DVec3::ONE - self.normal * self.normal).max(DVec3::ZERO).map(f64::sqrt) * self.radius;
        Bounds::new((self.center - reach).as_vec3(), (self.center + reach).as_vec3()).padded()
    }

    /// Corners of a polygon around the disk.
    pub(super) fn hull(&self) -> impl Iterator<Item = HullPoint> + use<> {
        let (a, b) = (self.along, self.normal.cross(self.along));
        // A little more than the polygon's, for the rounding of its corners.
        let radius = self.radius * (1.0 + 1e-6) / libm::cos(PI / f64::from(RING));
        let center = self.center;
        (0..RING).map(move |k| {
            let angle = TAU * f64::from(k) / f64::from(RING);
            let position = center + (a * libm::cos(angle) + b * libm::sin(angle)) * radius;
            HullPoint { position: position.as_vec3(), radius: 0.0 }
        })
    }

    /// Share of the Epanechnikov kernel of radius `radius` around a point of the disk that lies on the disk.
    ///
    /// Integrated over rings around the point: of the ring of radius ρ a share of angles is inside. Good to
    /// 1e-3; at least a quarter, as for polygons.
    pub(super) fn kernel_mass(&self, point: Vec3, radius: f32) -> f32 {
        const STEPS: u32 = 32;
        let reach = f64::from(radius);
        let from_center = (point.as_dvec3() - self.center).length().min(self.radius);
        // Up to this radius rings lie inside whole.
        let whole = ((self.radius - from_center) / reach).min(1.0);
        let (centre, disk) = (from_center / reach, self.radius / reach);
        if centre < 1e-9 {
            return (whole * whole * (2.0 - whole * whole)).max(0.25) as f32;
        }
        let mut mass = whole * whole * (2.0 - whole * whole);
        for step in 0..STEPS {
            // Steps are squared: the share of angles starts like a square root.
            let at = |s: f64| whole + (1.0 - whole) * s * s;
            let (low, high) = (f64::from(step) / f64::from(STEPS), f64::from(step + 1) / f64::from(STEPS));
            let rho = at(0.5 * (low + high));
            let cosine = (centre * centre + rho * rho - disk * disk) / (2.0 * centre * rho);
            let outside = 1.0 - libm::acos(cosine.clamp(-1.0, 1.0)) / PI;
            mass += (1.0 - outside) * 4.0 * rho * (1.0 - rho * rho) * (at(high) - at(low));
        }
        mass.max(0.25) as f32
    }
}

/// An open cylinder; its normal points away from the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cylinder {
    /// Middle of the first end.
    from: DVec3,
    /// Unit vector towards the other end.
    axis: DVec3,
    length: f64,
    radius: f64,
}

impl Cylinder {
    /// The ends are apart and the radius is positive.
    pub(super) fn new(from: Vec3, to: Vec3, radius: f32) -> Self {
        let span = to.as_dvec3() - from.as_dvec3();
        let axis = span.normalize_or(DVec3::Y);
        Self { from: from.as_dvec3(), axis, length: span.length(), radius: f64::from(radius) }
    }

    /// Distance along the ray to the nearest point in `(0, t_max)`.
    #[inline]
    pub(super) fn intersect(&self, ray: &Ray, t_max: f32) -> Option<f32> {
        self.meet(ray).map(|(t, _)| t).filter(|t| *t < t_max)
    }

    /// Where the ray first meets it: the distance, and the point from the middle of the first end.
    #[inline]
    fn meet(&self, ray: &Ray) -> Option<(f32, DVec3)> {
        let (from, direction) = (ray.origin.as_dvec3() - self.from, ray.direction.as_dvec3());
        let across = |v: DVec3| v - self.axis * self.axis.dot(v);
        // Seen along the axis it is a circle; a ray along the axis gives no roots.
        let (near, far) = super::sphere_roots(across(from), across(direction), DVec3::ZERO, self.radius)?;
        [near, far].into_iter().find_map(|t| {
            let local = from + direction * t;
            let height = self.axis.dot(local);
            (t as f32 > 0.0 && height >= 0.0 && height <= self.length).then_some((t as f32, local))
        })
    }

    pub(super) fn surface(&self, ray: &Ray) -> SurfacePoint {
        let local = self.meet(ray).map_or(DVec3::ZERO, |(_, local)| local);
        let height = self.axis.dot(local).clamp(0.0, self.length);
        let first = self.axis.any_orthonormal_vector();
        let outwards = (local - self.axis * self.axis.dot(local)).normalize_or(first);
        let point = (self.from + self.axis * height + outwards * self.radius).as_vec3();
        let normal = outwards.as_vec3();
        let turn = libm::atan2(outwards.dot(self.axis.cross(first)), outwards.dot(first)) / TAU;
        SurfacePoint {
            point,
            // Half an ulp of rounding per coordinate, and the axis' own size where that is larger.
            error: point.abs().max(self.from.as_vec3().abs()).max_element() * f32::EPSILON,
            normal,
            shading_normal: normal,
            texture: TextureCoordinates::Uv(Vec2::new(turn as f32 + 0.5, (height / self.length) as f32)),
        }
    }

    /// Its two ends.
    fn ends(&self) -> [Disk; 2] {
        [self.from, self.from + self.axis * self.length].map(|center| Disk {
            center,
            normal: self.axis,
            along: self.axis.any_orthonormal_vector(),
            radius: self.radius,
        })
    }

    pub(super) fn bounds(&self) -> Bounds {
        let [a, b] = self.ends();
        a.bounds().union(b.bounds())
    }

    /// Corners of a prism around it.
    pub(super) fn hull(&self) -> impl Iterator<Item = HullPoint> + use<> {
        let [a, b] = self.ends();
        a.hull().chain(b.hull())
    }

    /// Share of the kernel that lies on it: cut at both ends, and the curvature unrolled.
    pub(super) fn kernel_mass(&self, point: Vec3, radius: f32) -> f32 {
        let height = self.axis.dot(point.as_dvec3() - self.from);
        let reach = f64::from(radius);
        let share = |distance: f64| epanechnikov_half_plane(distance / reach);
        (share(height) + share(self.length - height) - 1.0).max(0.25) as f32
    }
}
