//! What a ray is inside of: the glass and liquids whose surfaces it has come through.
//!
//! Where dielectrics overlap, the one of the highest priority is what is there (Schmidt and Budge 2002): a liquid
//! drawn a little into the wall of its glass meets the glass without a gap, and a surface that changes nothing is
//! passed as if it were not there. Overlapping pieces of one material are one piece.

use crate::geometry::{Ray, offset_origin};
use crate::scene::{Dielectric, Light, MaterialId, Scene};
use glam::{Vec2, Vec3};

/// The dielectric materials that a ray is inside of: the last four it has entered. One that it has entered twice, by the
/// surfaces of two objects that overlap, stands there twice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Media {
    /// One number of a material, plus one, in each 16 bits; the last entered lowest, 0 where there are no more.
    lanes: u64,
}

/// Bits per lane.
const LANE: u32 = 16;

/// Materials that can be told apart.
pub const MOST_MATERIALS: usize = (1 << LANE) - 1;

/// A dielectric's surface that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crossed {
    /// The dielectric.
    pub material: MaterialId,
    /// The ray comes from within.
    pub leaving: bool,
}

/// A surface between two media.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// What the ray was inside of.
    pub before: Media,
    /// What it is inside of if it goes through.
    pub after: Media,
    /// Index of refraction on the side it comes from, over that of the other side.
    pub eta: f32,
    /// Whether the index of refraction depends on the wavelength on either side.
    pub dispersive: bool,
    /// The surface lies within something of a higher priority: nothing changes there.
    pub hidden: bool,
}

impl Media {
    /// The last entered first.
    #[inline]
    fn entered(self) -> impl Iterator<Item = MaterialId> {
        let mut left = self.lanes;
        std::iter::from_fn(move || {
            let lane = left & ((1 << LANE) - 1);
            left >>= LANE;
            (lane != 0).then(|| MaterialId(lane as u32 - 1))
        })
    }

    /// Without the last entry into a material.
    #[inline]
    #[must_use]
    pub fn without(self, material: MaterialId) -> Self {
        let Some(lane) = self.entered().position(|m| m == material) else { return self };
        let shift = LANE * lane as u32;
        let below = self.lanes & ((1 << shift) - 1);
        let above = self.lanes.checked_shr(shift + LANE).unwrap_or(0);
        Self { lanes: above << shift | below }
    }

    /// With a material entered last. Of too many, the first is forgotten.
    #[inline]
    #[must_use]
    pub fn with(self, material: MaterialId) -> Self {
        Self { lanes: self.lanes << LANE | u64::from(material.0 + 1) }
    }

    /// The material that fills the place; `None` in air.
    #[inline]
    #[must_use]
    pub fn filler(self, scene: &Scene) -> Option<MaterialId> {
        if self.lanes >> LANE == 0 {
            return self.entered().next();
        }
        let priority =
            |m: MaterialId| scene.materials[m.index()].dielectric().map_or(i32::MIN, |d| d.priority);
        // Of equal ones the last entered.
        self.entered().reduce(|best, other| if priority(other) > priority(best) { other } else { best })
    }

    #[inline]
    fn dielectric(self, scene: &Scene) -> Option<&Dielectric> {
        self.filler(scene).and_then(|material| scene.materials[material.index()].dielectric())
    }

    /// Absorption coefficient of what fills the place.
    #[inline]
    #[must_use]
    pub fn absorption(self, scene: &Scene) -> Vec3 {
        self.dielectric(scene).map_or(Vec3::ZERO, |d| d.absorption)
    }

    /// What a ray that arrives at the surface of a dielectric has come through: one that arrives from within was
    /// inside, whatever was known.
    #[inline]
    #[must_use]
    pub fn arriving(self, surface: Crossed) -> Self {
        let Crossed { material, leaving } = surface;
        if leaving && self.entered().all(|m| m != material) { self.with(material) } else { self }
    }

    /// The surface of a dielectric, or of several in one place, met by a ray of a wavelength in μm (`None`: of all) that
    /// has come through these media; of each whether the ray leaves it there.
    #[inline]
    #[must_use]
    pub fn interface(self, scene: &Scene, surfaces: &[Crossed], wavelength: Option<f32>) -> Interface {
        let before = surfaces.iter().fold(self, |media, surface| media.arriving(*surface));
        let after = surfaces.iter().filter(|s| s.leaving).fold(before, |m, s| m.without(s.material));
        let after = surfaces.iter().filter(|s| !s.leaving).fold(after, |m, s| m.with(s.material));
        let hidden = before.filler(scene) == after.filler(scene);
        let [from, to] = [before.dielectric(scene), after.dielectric(scene)];
        let index = |d: Option<&Dielectric>| d.map_or(1.0, |d| d.ior.at(wavelength));
        let dispersive = [from, to].into_iter().flatten().any(|d| d.ior.is_dispersive());
        Interface { before, after, eta: index(from) / index(to), dispersive, hidden }
    }

    /// What a point is inside of: of the dielectrics that a ray from it meets, those whose surface it first meets
    /// from within.
    #[must_use]
    pub fn around(scene: &Scene, point: Vec3) -> Self {
        /// No axis, and no diagonal.
        const DIRECTION: Vec3 = Vec3::new(0.1, 0.974_679_4, 0.2);
        /// More surfaces than this in a row are not looked at.
        const MOST_SURFACES: usize = 256;
        let mut ray = Ray::new(point, DIRECTION.normalize());
        let mut met: Vec<MaterialId> = Vec::new();
        let mut inside: Vec<MaterialId> = Vec::new();
        for _ in 0..MOST_SURFACES {
            let Some(hit) = scene.geometry.closest_hit(&ray) else { break };
            let material = scene.objects[hit.object.index()].material;
            if scene.materials[material.index()].dielectric().is_some() && !met.contains(&material) {
                met.push(material);
                if ray.direction.dot(hit.surface.normal) > 0.0 {
                    inside.push(material);
                }
            }
            let surface = &hit.surface;
            let origin = offset_origin(surface.point, surface.error, surface.normal, ray.direction);
            ray = Ray::new(origin, ray.direction);
        }
        // What is left first was entered last.
        inside.into_iter().rev().fold(Self::default(), |media, material| media.with(material))
    }

    /// What a light is inside of, when the shutter opens if it moves; one infinitely far away is in air.
    #[must_use]
    pub fn around_light(scene: &Scene, light: &Light) -> Self {
        match light {
            Light::Directional { .. } => Self::default(),
            Light::Point { position, .. } => Self::around(scene, *position),
            Light::Spot(spot) => Self::around(scene, spot.position),
            Light::Quad(quad) => Self::around(scene, quad.center),
            Light::Disk(disk) => Self::around(scene, disk.center),
            Light::Sphere(sphere) => Self::around(scene, sphere.center),
            Light::Mesh(mesh) => {
                let middle = mesh.sample(0.0, Vec2::splat(0.5));
                middle.map_or_else(Self::default, |(at, _)| Self::around(scene, at.point))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn media_are_entered_and_left_in_any_order() {
        let [a, b, c] = [1, 2, 3].map(MaterialId);
        let all = Media::default().with(a).with(b).with(c);
        assert_eq!(all.without(b), Media::default().with(a).with(c));
        assert_eq!(all.with(a).without(a), all);
        assert_eq!(all.without(a), Media::default().with(b).with(c));
        assert_eq!(all.without(c), Media::default().with(a).with(b));
        assert_eq!(all.without(MaterialId(9)), all);
        let many = (0..6).fold(Media::default(), |m, i| m.with(MaterialId(i)));
        assert_eq!(many.entered().map(|m| m.0).collect::<Vec<_>>(), [5, 4, 3, 2]);
        assert_eq!(many.without(MaterialId(2)).entered().count(), 3);
    }

    /// A surface met from within tells that the ray was inside, whatever it knew.
    #[test]
    fn arriving_from_within_overrules_what_was_known() {
        let a = MaterialId(4);
        let from_within = Crossed { material: a, leaving: true };
        assert_eq!(Media::default().arriving(from_within), Media::default().with(a));
        assert_eq!(Media::default().with(a).arriving(from_within), Media::default().with(a));
    }
}
