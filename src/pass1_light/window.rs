//! Pass 1: windows, the directions from one light that bound one specular object.
//!
//! A photon drawn for a window counts only if the first surface it meets is that object, so that windows may
//! overlap and no light is counted twice.

use super::guide::Guide;
use crate::geometry::{Bounds, Geometry, HullPoint};
use crate::light_path::Kinds;
use crate::media::Media;
use crate::scene::{Aiming, Light, LightId, ObjectId, Scene, SphereLight};
use glam::{Vec2, Vec3};

/// What sends light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// A light of the scene.
    Light(LightId),
    /// The environment.
    Environment,
}

/// Directions from one source that bound one specular object, its caster.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Where the light comes from.
    pub source: Source,
    /// What the source is inside of.
    pub media: Media,
    /// The object the photons must meet first; any that is specular if `None`.
    pub caster: Option<ObjectId>,
    /// The bound.
    pub region: Region,
    /// Where in it the photons come from that arrive, if a pilot has found that out.
    pub guide: Option<Guide>,
    /// What its photons are told apart by; `None` if they need not be.
    pub kinds: Option<Kinds>,
}

/// The shape of a window.
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    /// A rectangle in space; rays go from the light through it.
    Rectangle {
        /// One corner.
        corner: Vec3,
        /// Edge from the corner.
        u: Vec3,
        /// The other edge, perpendicular to `u`.
        v: Vec3,
    },
    /// Every direction the light sends to: the caster is too near, or around the light.
    AllDirections,
    /// A disc, turned to face each direction; for light from all around.
    Disc {
        /// Centre of the sphere around the caster.
        center: Vec3,
        /// Its radius.
        radius: f32,
    },
}

/// A point of the caster seen at more than this angle from the window's axis makes the window useless
/// (tangent of 80°): a rectangle would be larger than the hemisphere is worth.
const WIDEST_TANGENT: f32 = 5.67;

/// Share of a window added on each side for rounding.
const MARGIN: f32 = 1e-4;

/// The window of every light that gives light and every object that is specular.
#[must_use]
pub fn windows(scene: &Scene) -> Vec<Window> {
    let casters: Vec<ObjectId> = (0..scene.objects.len() as u32)
        .map(ObjectId)
        .filter(|&o| scene.material_of(o).has_specular())
        .filter(|&o| !scene.geometry.object_bounds(o).is_empty())
        .collect();
    let mut sources: Vec<Source> = (0..scene.lights.len() as u32)
        .map(LightId)
        .filter(|id| !scene.lights[id.index()].is_dark())
        .map(Source::Light)
        .collect();
    if !scene.environment.is_black() {
        sources.push(Source::Environment);
    }
    if scene.render.aiming == Aiming::Everywhere && !casters.is_empty() {
        return sources.into_iter().map(|source| everywhere(scene, source)).collect();
    }
    let hulls: Vec<Vec<HullPoint>> = casters.iter().map(|&o| scene.geometry.hull(o)).collect();
    let mut windows = Vec::new();
    for &source in &sources {
        let media = media_around(scene, source);
        for (&caster, hull) in casters.iter().zip(&hulls) {
            let region = match source {
                Source::Light(id) => region(&scene.lights[id.index()], &scene.geometry, caster, hull),
                Source::Environment => enclosing_disc(&scene.geometry.object_bounds(caster)),
            };
            windows.push(Window { source, media, caster: Some(caster), region, guide: None, kinds: None });
        }
    }
    windows
}

fn media_around(scene: &Scene, source: Source) -> Media {
    match source {
        Source::Light(id) => Media::around_light(scene, &scene.lights[id.index()]),
        Source::Environment => Media::default(),
    }
}

/// All that a source sends; what comes from infinitely far away is bounded by the scene.
fn everywhere(scene: &Scene, source: Source) -> Window {
    let bounds = scene.geometry.bounds();
    let region = match source {
        Source::Environment => enclosing_disc(&bounds),
        Source::Light(id) => match &scene.lights[id.index()] {
            Light::Directional { direction, .. } => {
                let hull = bounds.corners().map(|position| HullPoint { position, radius: 0.0 });
                parallel_window(bounds.center(), *direction, &hull)
            }
            _ => Region::AllDirections,
        },
    };
    Window { source, media: media_around(scene, source), caster: None, region, guide: None, kinds: None }
}

fn region(light: &Light, geometry: &Geometry, caster: ObjectId, hull: &[HullPoint]) -> Region {
    let center = geometry.object_bounds(caster).center();
    match light {
        Light::Directional { direction, .. } => parallel_window(center, *direction, hull),
        Light::Point { position, .. } => seen_from(&[*position], center, hull),
        // A projection through a fixed point maps the light's convex hull to a convex hull, so that the corners
        // of a hull bound what any of its points sees.
        Light::Quad(quad) => seen_from(&quad.corners(), center, hull),
        Light::Disk(disk) => seen_from(&disk.square().corners(), center, hull),
        Light::Sphere(sphere) => seen_from(&cube_around(sphere, center), center, hull),
        Light::Mesh(mesh) => seen_from(&mesh.bounds().corners(), center, hull),
        Light::Spot(spot) => {
            let region = seen_from(&[spot.position], center, hull);
            let cone = 2.0 * std::f32::consts::PI * (1.0 - spot.cos_outer);
            match &region {
                // The whole cone where it is narrower than the window.
                Region::Rectangle { u, v, .. }
                    if u.length() * v.length() > cone * spot.position.distance_squared(center) =>
                {
                    Region::AllDirections
                }
                _ => region,
            }
        }
    }
}

/// Corners of a cube around the sphere, turned to face `target`: across, it is no wider than the sphere.
fn cube_around(sphere: &SphereLight, target: Vec3) -> [Vec3; 8] {
    let normal = (sphere.center - target).normalize_or(Vec3::Y);
    let (x, y) = normal.any_orthonormal_pair();
    std::array::from_fn(|i| {
        let sign = |bit: usize| if i & bit == 0 { -sphere.radius } else { sphere.radius };
        sphere.center + x * sign(1) + y * sign(2) + normal * sign(4)
    })
}

fn enclosing_disc(bounds: &Bounds) -> Region {
    Region::Disc { center: bounds.center(), radius: bounds.radius() * (1.0 + MARGIN) }
}

/// Bounding rectangle in the plane through the caster's centre that faces the light.
fn seen_from(eyes: &[Vec3], center: Vec3, hull: &[HullPoint]) -> Region {
    let middle = eyes.iter().sum::<Vec3>() / eyes.len() as f32;
    let Some(normal) = (middle - center).try_normalize() else { return Region::AllDirections };
    let (x, y) = normal.any_orthonormal_pair();
    let mut extent = Extent::default();
    for eye in eyes {
        let from = *eye - center;
        let (ex, ey, height) = (from.dot(x), from.dot(y), from.dot(normal));
        // A light that reaches below the plane through the caster's centre sees it from all around.
        if height <= 0.0 {
            return Region::AllDirections;
        }
        for point in hull {
            let q = point.position - center;
            let h = q.dot(normal);
            let (Some(across), Some(up)) = (
                interval(Vec2::new(ex, height), Vec2::new(q.dot(x), h), point.radius),
                interval(Vec2::new(ey, height), Vec2::new(q.dot(y), h), point.radius),
            ) else {
                return Region::AllDirections;
            };
            extent.include(Vec2::new(across[0], up[0]));
            extent.include(Vec2::new(across[1], up[1]));
        }
    }
    extent.rectangle(center, x, y)
}

/// Where the tangents from `eye` to a disc of radius `radius` around `point` cross the axis y = 0, in the
/// plane; `None` if one of them hardly crosses it.
fn interval(eye: Vec2, point: Vec2, radius: f32) -> Option<[f32; 2]> {
    let to = point - eye;
    let distance = to.length();
    if distance <= radius || distance == 0.0 {
        return None;
    }
    let half = libm::asinf(radius / distance);
    // Angle from the downward axis.
    let middle = libm::atan2f(to.x, -to.y);
    let mut ends = [0.0; 2];
    for (end, angle) in ends.iter_mut().zip([middle - half, middle + half]) {
        let tangent = libm::tanf(angle);
        if angle.abs() >= std::f32::consts::FRAC_PI_2 || tangent.abs() > WIDEST_TANGENT {
            return None;
        }
        *end = eye.x + eye.y * tangent;
    }
    Some(ends)
}

fn parallel_window(center: Vec3, direction: Vec3, hull: &[HullPoint]) -> Region {
    let (x, y) = direction.any_orthonormal_pair();
    let mut extent = Extent::default();
    for point in hull {
        let q = point.position - center;
        let q = Vec2::new(q.dot(x), q.dot(y));
        extent.include(q - point.radius);
        extent.include(q + point.radius);
    }
    extent.rectangle(center, x, y)
}

/// A growing 2-D box.
struct Extent {
    min: Vec2,
    max: Vec2,
}

impl Default for Extent {
    fn default() -> Self {
        Self { min: Vec2::INFINITY, max: Vec2::NEG_INFINITY }
    }
}

impl Extent {
    fn include(&mut self, p: Vec2) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    fn rectangle(&self, center: Vec3, x: Vec3, y: Vec3) -> Region {
        let size = self.max - self.min;
        // At least as wide as the rounding of the coordinates, so that a mirror seen edge-on has a window.
        let pad = (size * MARGIN).max(Vec2::splat(center.abs().max_element() * f32::EPSILON));
        let (min, size) = (self.min - pad, size + 2.0 * pad);
        Region::Rectangle { corner: center + x * min.x + y * min.y, u: x * size.x, v: y * size.y }
    }
}
