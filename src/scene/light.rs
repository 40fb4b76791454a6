//! Lights. Emission for pass 1 is in `pass1_light::emit`, sampling for pass 2 in `pass2_eye::direct`.

use crate::geometry::{Bounds, Motion};
use crate::sampling::{concentric_disc, uniform_sphere};
use glam::{DMat3, DVec3, Vec2, Vec3};
use std::f64::consts::TAU;

/// A source of light. Quantities are per channel.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Emits the same intensity in all directions from one point.
    Point {
        /// Where it is.
        position: Vec3,
        /// Radiant intensity, W·sr⁻¹.
        intensity: Vec3,
    },
    /// A point whose light is confined to a cone.
    Spot(SpotLight),
    /// Parallel light from infinitely far away.
    Directional {
        /// Unit vector in which the light travels.
        direction: Vec3,
        /// Irradiance on a surface that faces the light, W·m⁻².
        irradiance: Vec3,
    },
    /// A one-sided rectangle of constant radiance.
    Quad(QuadLight),
    /// A one-sided disk of constant radiance.
    Disk(DiskLight),
    /// A sphere of constant radiance.
    Sphere(SphereLight),
    /// Triangles of constant radiance, and whatever moves: an object with an emission.
    Mesh(MeshLight),
}

/// A point whose light is confined to a cone.
#[derive(Clone, Debug, PartialEq)]
pub struct SpotLight {
    /// Where it is.
    pub position: Vec3,
    /// Unit vector along the axis, away from the light.
    pub axis: Vec3,
    /// Radiant intensity inside the inner cone, W·sr⁻¹.
    pub intensity: Vec3,
    /// Cosine of the angle from the axis at which the light begins to fall.
    pub cos_inner: f32,
    /// Cosine of the angle from the axis at which it has fallen to nothing.
    pub cos_outer: f32,
}

impl SpotLight {
    /// Intensity in a direction away from the light: s² (3 - 2s) times that on the axis, where s runs from 0
    /// at the outer cone to 1 at the inner one, linear in the cosine.
    #[must_use]
    pub fn intensity_along(&self, direction: Vec3) -> Vec3 {
        let cosine = self.axis.dot(direction);
        if cosine >= self.cos_inner {
            return self.intensity;
        }
        if cosine <= self.cos_outer {
            return Vec3::ZERO;
        }
        let s = (cosine - self.cos_outer) / (self.cos_inner - self.cos_outer);
        self.intensity * (s * s * (3.0 - 2.0 * s))
    }
}

/// A one-sided disk of constant radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct DiskLight {
    /// Centre.
    pub center: Vec3,
    /// Radius.
    pub radius: f32,
    /// Unit normal of the side that emits.
    pub normal: Vec3,
    /// Radiance, W·sr⁻¹·m⁻².
    pub radiance: Vec3,
}

impl DiskLight {
    /// Area in m².
    #[must_use]
    pub fn area(&self) -> f32 {
        std::f32::consts::PI * self.radius * self.radius
    }

    /// A point uniform over the disk.
    #[must_use]
    pub fn point(&self, u: glam::Vec2) -> LightPoint {
        let (x, y) = self.normal.any_orthonormal_pair();
        let p = concentric_disc(u) * self.radius;
        let error = (self.center.abs().max_element() + self.radius) * (4.0 * f32::EPSILON);
        LightPoint { point: self.center + x * p.x + y * p.y, normal: self.normal, error }
    }

    /// The square around the disk, as a light of the same radiance.
    #[must_use]
    pub fn square(&self) -> QuadLight {
        let (x, y) = self.normal.any_orthonormal_pair();
        let (half_u, half_v) = (x * self.radius, y * self.radius);
        QuadLight::new(self.center, [half_u, half_v], self.normal, self.radiance)
    }
}

/// A sphere of constant radiance; it emits outwards.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereLight {
    /// Centre.
    pub center: Vec3,
    /// Radius.
    pub radius: f32,
    /// Radiance, W·sr⁻¹·m⁻².
    pub radiance: Vec3,
}

impl SphereLight {
    /// Area in m².
    #[must_use]
    pub fn area(&self) -> f32 {
        4.0 * std::f32::consts::PI * self.radius * self.radius
    }

    /// The point whose normal this is.
    #[must_use]
    pub fn point(&self, normal: DVec3) -> LightPoint {
        let point = (self.center.as_dvec3() + normal * f64::from(self.radius)).as_vec3();
        let error = point.abs().max(self.center.abs()).max_element() * f32::EPSILON;
        LightPoint { point, normal: normal.as_vec3(), error }
    }
}

/// A surface of constant radiance whose points are drawn by their area: triangles, each emitting to the side of its normal
/// by the right-hand rule, or an open cylinder that emits outwards; of what moves, also a sphere or a disk.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshLight {
    /// Radiance, W·sr⁻¹·m⁻².
    pub radiance: Vec3,
    surface: Emitting,
    /// How it moves while the shutter is open.
    motion: Option<Motion>,
}

#[derive(Clone, Debug, PartialEq)]
enum Emitting {
    Triangles {
        triangles: Vec<[Vec3; 3]>,
        /// Areas summed up to and with each triangle, m².
        sums: Vec<f64>,
    },
    Cylinder {
        from: DVec3,
        to: DVec3,
        radius: f64,
    },
    Sphere(SphereLight),
    Disk(DiskLight),
}

/// A point of a light's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightPoint {
    /// Position.
    pub point: Vec3,
    /// Unit normal of the side that emits.
    pub normal: Vec3,
    /// Bound on how far each coordinate of `point` is from the true surface.
    pub error: f32,
}

impl MeshLight {
    /// Triangles without area are left out.
    #[must_use]
    pub fn new(radiance: Vec3, corners: impl IntoIterator<Item = [Vec3; 3]>) -> Self {
        let (mut triangles, mut sums) = (Vec::new(), Vec::new());
        let mut sum = 0.0;
        for triangle in corners {
            let area = doubled_area(&triangle).length() / 2.0;
            if area > 0.0 {
                sum += area;
                triangles.push(triangle);
                sums.push(sum);
            }
        }
        Self { radiance, surface: Emitting::Triangles { triangles, sums }, motion: None }
    }

    /// The side of a cylinder without its ends, between two points that differ.
    #[must_use]
    pub fn cylinder(radiance: Vec3, from: DVec3, to: DVec3, radius: f64) -> Self {
        Self { radiance, surface: Emitting::Cylinder { from, to, radius }, motion: None }
    }

    /// An object's light as one that moves.
    #[must_use]
    pub fn moving(light: Light, motion: Motion) -> Light {
        let motion = Some(motion);
        Light::Mesh(match light {
            Light::Mesh(mesh) => Self { motion, ..mesh },
            Light::Sphere(sphere) => {
                Self { radiance: sphere.radiance, surface: Emitting::Sphere(sphere), motion }
            }
            Light::Disk(disk) => Self { radiance: disk.radiance, surface: Emitting::Disk(disk), motion },
            // No object is one of these.
            Light::Point { .. } | Light::Spot(_) | Light::Directional { .. } | Light::Quad(_) => {
                return light;
            }
        })
    }

    /// Area in m²; of what moves and grows, the largest that it may have.
    #[must_use]
    pub fn area(&self) -> f32 {
        let scale = self.motion.map_or(1.0, |motion| motion.largest_scale());
        self.area_at_rest() * (scale * scale)
    }

    fn area_at_rest(&self) -> f32 {
        match &self.surface {
            Emitting::Triangles { sums, .. } => sums.last().copied().unwrap_or(0.0) as f32,
            Emitting::Cylinder { from, to, radius } => (TAU * radius * (*to - *from).length()) as f32,
            Emitting::Sphere(sphere) => sphere.area(),
            Emitting::Disk(disk) => disk.area(),
        }
    }

    /// A box that holds it at all times.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let rest = Bounds::of(self.corners_at_rest());
        self.motion.map_or(rest, |motion| motion.swept_box(rest))
    }

    fn corners_at_rest(&self) -> Vec<Vec3> {
        match &self.surface {
            Emitting::Triangles { triangles, .. } => triangles.iter().flatten().copied().collect(),
            Emitting::Cylinder { from, to, radius } => [*from, *to]
                .iter()
                .flat_map(|end| [*end - *radius, *end + *radius])
                .map(|p| p.as_vec3())
                .collect(),
            Emitting::Sphere(sphere) => [-sphere.radius, sphere.radius].map(|r| sphere.center + r).to_vec(),
            Emitting::Disk(disk) => disk.square().corners().to_vec(),
        }
    }

    /// A point where it is at a time, uniform over the area at rest for `u` uniform in the unit square, and the area in m²
    /// that it stands for: of a surface that is stretched, that of the whole if it were stretched everywhere as it is
    /// there. `None` if there is no area.
    #[must_use]
    pub fn sample(&self, time: f32, u: glam::Vec2) -> Option<(LightPoint, f32)> {
        let (rest, area) = (self.sample_at_rest(u)?, self.area_at_rest());
        let Some(motion) = &self.motion else { return Some((rest, area)) };
        let to_world = motion.pose(time);
        let point = to_world.transform_point3(rest.point.as_dvec3()).as_vec3();
        let turned = cofactors(&to_world.matrix3) * rest.normal.as_dvec3();
        let stretch = turned.length();
        let error = rest.error * motion.largest_scale() + point.abs().max_element() * (2.0 * f32::EPSILON);
        Some((LightPoint { point, normal: (turned / stretch).as_vec3(), error }, area * stretch as f32))
    }

    /// The area that a point of the surface with this unit normal stands for at a time, as in [`MeshLight::sample`].
    #[must_use]
    pub fn area_at(&self, time: f32, normal: Vec3) -> f32 {
        let Some(motion) = &self.motion else { return self.area_at_rest() };
        let matrix = motion.pose(time).matrix3;
        // The cofactors are the inverse transposed times the determinant.
        let stretch = matrix.determinant() / (matrix.transpose() * normal.as_dvec3()).length();
        self.area_at_rest() * stretch as f32
    }

    /// A sphere that moves, where it is at a time; `None` if it is no sphere there.
    #[must_use]
    pub fn as_sphere(&self, time: f32) -> Option<SphereLight> {
        let (Emitting::Sphere(sphere), Some(motion)) = (&self.surface, &self.motion) else { return None };
        let scale = motion.even_scale(time)?;
        let center = motion.pose(time).transform_point3(sphere.center.as_dvec3()).as_vec3();
        Some(SphereLight { center, radius: (f64::from(sphere.radius) * scale) as f32, ..sphere.clone() })
    }

    fn sample_at_rest(&self, u: glam::Vec2) -> Option<LightPoint> {
        match &self.surface {
            Emitting::Triangles { triangles, sums } => {
                let target = f64::from(u.x) * sums.last()?;
                let index = sums.partition_point(|&sum| sum <= target).min(triangles.len() - 1);
                let before = if index == 0 { 0.0 } else { sums[index - 1] };
                let [a, b, c] = triangles[index];
                // What is left of u.x within its triangle is uniform again.
                let left = ((target - before) / (sums[index] - before)).clamp(0.0, 1.0);
                let root = left.sqrt() as f32;
                let point = a + (b - a) * (root * (1.0 - u.y)) + (c - a) * (root * u.y);
                let error = a.abs().max(b.abs()).max(c.abs()).max_element() * (4.0 * f32::EPSILON);
                Some(LightPoint { point, normal: doubled_area(&[a, b, c]).normalize().as_vec3(), error })
            }
            Emitting::Cylinder { from, to, radius } => {
                let along = *to - *from;
                let (x, y) = along.normalize().any_orthonormal_pair();
                let (sin, cos) = libm::sincos(TAU * f64::from(u.y));
                let normal = x * cos + y * sin;
                let point = *from + along * f64::from(u.x) + normal * *radius;
                let error = (point.abs().max_element() + radius) as f32 * (4.0 * f32::EPSILON);
                Some(LightPoint { point: point.as_vec3(), normal: normal.as_vec3(), error })
            }
            Emitting::Sphere(sphere) => Some(sphere.point(uniform_sphere(u).as_dvec3())),
            Emitting::Disk(disk) => Some(disk.point(u)),
        }
    }
}

/// What turns normals, and makes them as long as the area that a unit of area becomes.
fn cofactors(matrix: &DMat3) -> DMat3 {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = *matrix;
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y))
}

/// Normal by the right-hand rule, as long as twice the area.
fn doubled_area([a, b, c]: &[Vec3; 3]) -> DVec3 {
    (b.as_dvec3() - a.as_dvec3()).cross(c.as_dvec3() - a.as_dvec3())
}

/// A one-sided rectangle of constant radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct QuadLight {
    /// Centre.
    pub center: Vec3,
    /// From the centre to the middle of one edge; perpendicular to `half_v`.
    pub half_u: Vec3,
    /// From the centre to the middle of the next edge.
    pub half_v: Vec3,
    /// Unit normal of the side that emits.
    pub normal: Vec3,
    /// Radiance, W·sr⁻¹·m⁻².
    pub radiance: Vec3,
    /// Unit vectors along both edges, and the edges' lengths.
    edges: [(DVec3, f64); 2],
    /// Bound on how far each coordinate of a point of it is from the true surface.
    error: f32,
}

impl QuadLight {
    /// Of its centre, from there to the middles of two edges, perpendicular to each other, and the side that emits.
    #[must_use]
    pub fn new(center: Vec3, [half_u, half_v]: [Vec3; 2], normal: Vec3, radiance: Vec3) -> Self {
        let edge = |half: Vec3| {
            let length = half.as_dvec3().length();
            (half.as_dvec3() / length, 2.0 * length)
        };
        let edges = [edge(half_u), edge(half_v)];
        let error = (center.abs() + half_u.abs() + half_v.abs()).max_element() * (4.0 * f32::EPSILON);
        Self { center, half_u, half_v, normal, radiance, edges, error }
    }

    /// Unit vectors along both edges, and the edges' lengths.
    #[inline]
    #[must_use]
    pub fn edges(&self) -> [(DVec3, f64); 2] {
        self.edges
    }

    /// A point of its surface, of which each coordinate is right to a few roundings.
    #[inline]
    #[must_use]
    pub fn surface_point(&self, point: Vec3) -> LightPoint {
        LightPoint { point, normal: self.normal, error: self.error }
    }

    /// A point for a place in the square from -1 to 1.
    #[inline]
    #[must_use]
    pub fn point(&self, place: Vec2) -> LightPoint {
        self.surface_point(self.center + self.half_u * place.x + self.half_v * place.y)
    }

    /// Area in m².
    #[must_use]
    pub fn area(&self) -> f32 {
        (self.edges[0].1 * self.edges[1].1) as f32
    }

    /// The corners in order around the outline.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 4] {
        let (c, u, v) = (self.center, self.half_u, self.half_v);
        [c - u - v, c + u - v, c + u + v, c - u + v]
    }
}

impl Light {
    /// True if the light gives nothing.
    #[must_use]
    pub fn is_dark(&self) -> bool {
        let power = match self {
            Self::Point { intensity, .. } => *intensity,
            Self::Spot(spot) => spot.intensity,
            Self::Directional { irradiance, .. } => *irradiance,
            Self::Quad(quad) => quad.radiance * quad.area(),
            Self::Disk(disk) => disk.radiance,
            Self::Sphere(sphere) => sphere.radiance,
            Self::Mesh(mesh) => mesh.radiance * mesh.area(),
        };
        power == Vec3::ZERO
    }

    /// Radiance of the side of its surface that emits; `None` of a light that has no surface.
    #[must_use]
    pub fn surface_radiance(&self) -> Option<Vec3> {
        match self {
            Self::Point { .. } | Self::Spot(_) | Self::Directional { .. } => None,
            Self::Quad(quad) => Some(quad.radiance),
            Self::Disk(disk) => Some(disk.radiance),
            Self::Sphere(sphere) => Some(sphere.radiance),
            Self::Mesh(mesh) => Some(mesh.radiance),
        }
    }

    /// The light's kind, for reports.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Point { .. } => "point",
            Self::Spot(_) => "spot",
            Self::Directional { .. } => "directional",
            Self::Quad(_) => "quad",
            Self::Disk(_) => "disk",
            Self::Sphere(_) => "sphere",
            Self::Mesh(_) => "emissive",
        }
    }
}
