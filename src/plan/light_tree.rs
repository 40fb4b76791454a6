//! Which of many lights a D asks: a tree over the lights (Conty Estévez and Kulla 2018, in the form of pbrt-v4).
//!
//! A node bounds where its lights are, where they shine to, and their power; from the point that is lit this bounds what
//! they can give. A pick goes down by these bounds. Every light that can give light there can be picked, each with a
//! probability that is known.

use crate::geometry::Bounds;
use crate::scene::{Light, LightId, Scene};
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

/// A tree over the lights that are somewhere; those infinitely far away are always asked.
#[derive(Clone, Debug, PartialEq)]
pub struct LightTree {
    nodes: Vec<Node>,
    /// The way to each light's leaf, from the lowest bit on, 1 for the second child; `None` of lights that are always
    /// asked, or dark.
    ways: Vec<Option<u32>>,
    always: Vec<LightId>,
}

#[derive(Clone, Debug, PartialEq)]
struct Node {
    center: Vec3,
    radius: f32,
    power: f32,
    cone: Cone,
    content: Content,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Content {
    Light(LightId),
    /// Index of the second child; the first is next.
    Second(u32),
}

/// Directions of emission: the lights face at most an angle from the axis, and shine that and another from it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cone {
    axis: Vec3,
    facing: f32,
    shining: f32,
}

/// A light for the tree.
struct Item {
    light: LightId,
    bounds: Bounds,
    power: f32,
    cone: Cone,
}

/// Where light is asked for: a point, and the normal of the side that is lit if light from behind it is of no use.
#[derive(Clone, Copy, Debug)]
pub struct Asking {
    /// The point.
    pub point: Vec3,
    /// The normal.
    pub normal: Option<Vec3>,
}

impl LightTree {
    /// The tree over the lights of a scene.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let ids = (0..scene.lights.len() as u32).map(LightId);
        let lit = || ids.clone().filter(|id| !scene.lights[id.index()].is_dark());
        let mut items: Vec<Item> = lit().filter_map(|id| Item::of(id, &scene.lights[id.index()])).collect();
        let far = |id: &LightId| matches!(scene.lights[id.index()], Light::Directional { .. });
        let always = lit().filter(far).collect();
        let mut tree = Self { nodes: Vec::new(), ways: vec![None; scene.lights.len()], always };
        if !items.is_empty() {
            tree.grow(&mut items, 0, 0);
        }
        tree
    }

    /// Lights that are asked whatever is picked.
    #[must_use]
    pub fn always(&self) -> &[LightId] {
        &self.always
    }

    /// Picks a light, for `u` in [0, 1); also the probability with which it is picked. `None` if what was come to gives
    /// nothing there.
    #[must_use]
    pub fn pick(&self, asking: &Asking, mut u: f32) -> Option<(LightId, f32)> {
        let mut index = 0;
        let mut probability = 1.0;
        loop {
            match self.nodes.get(index)?.content {
                Content::Light(light) => return Some((light, probability)),
                Content::Second(second) => {
                    let share = self.share_of_first(index, second as usize, asking)?;
                    if u < share {
                        (index, probability, u) = (index + 1, probability * share, u / share);
                    } else {
                        let rest = 1.0 - share;
                        (index, probability, u) = (second as usize, probability * rest, (u - share) / rest);
                    }
                }
            }
        }
    }

    /// The probability with which a light is picked.
    #[must_use]
    pub fn probability(&self, asking: &Asking, light: LightId) -> f32 {
        let Some(mut way) = self.ways[light.index()] else { return 1.0 };
        let mut index = 0;
        let mut probability = 1.0;
        while let Content::Second(second) = self.nodes[index].content {
            let Some(share) = self.share_of_first(index, second as usize, asking) else { return 0.0 };
            if way & 1 == 0 {
                (index, probability) = (index + 1, probability * share);
            } else {
                (index, probability) = (second as usize, probability * (1.0 - share));
            }
            way >>= 1;
        }
        probability
    }

    fn share_of_first(&self, index: usize, second: usize, asking: &Asking) -> Option<f32> {
        let [a, b] = [index + 1, second].map(|child| self.nodes[child].gives(asking));
        (a + b > 0.0).then(|| a / (a + b))
    }

    /// Halves the lights along the longest side of their box: no leaf is deeper than the logarithm of their number.
    fn grow(&mut self, items: &mut [Item], depth: u32, way: u32) {
        let index = self.nodes.len();
        if let [item] = &*items {
            self.nodes.push(Node::over(items, Content::Light(item.light)));
            self.ways[item.light.index()] = Some(way);
            return;
        }
        let centers = Bounds::of(items.iter().map(|item| item.bounds.center()));
        let size = centers.max - centers.min;
        let axis = (0..3).fold(0, |most, axis| if size[axis] > size[most] { axis } else { most });
        let along = |item: &Item| item.bounds.center()[axis];
        items.sort_by(|a, b| along(a).total_cmp(&along(b)).then(a.light.cmp(&b.light)));
        self.nodes.push(Node::over(items, Content::Second(0)));
        let (first, second) = items.split_at_mut(items.len() / 2);
        self.grow(first, depth + 1, way);
        self.nodes[index].content = Content::Second(self.nodes.len() as u32);
        self.grow(second, depth + 1, way | 1 << depth);
    }
}

impl Node {
    fn over(items: &[Item], content: Content) -> Self {
        let corners = items.iter().flat_map(|item| [item.bounds.min, item.bounds.max]);
        let bounds = Bounds::of(corners);
        let cone = items.iter().skip(1).fold(items[0].cone, |cone, item| cone.with(&item.cone));
        let power = items.iter().map(|item| item.power).sum();
        Self { center: bounds.center(), radius: bounds.radius(), power, cone, content }
    }

    /// What its lights can give: power by the squared distance, the cosine at the lights and that at the point, each as
    /// large as the bounds allow.
    fn gives(&self, asking: &Asking) -> f32 {
        let from = asking.point - self.center;
        let distance2 = from.length_squared();
        let radius2 = self.radius * self.radius;
        // From within all can be anywhere.
        if distance2 <= radius2 {
            return self.power / radius2.max(f32::MIN_POSITIVE);
        }
        let direction = from / distance2.sqrt();
        let apart = libm::asinf((radius2 / distance2).sqrt().min(1.0));
        let off = angle(self.cone.axis.dot(direction)) - self.cone.facing - apart;
        if off > self.cone.shining {
            return 0.0;
        }
        let at_light = libm::cosf(off.max(0.0));
        let at_point = asking.normal.map_or(1.0, |normal| {
            let off = angle(-normal.dot(direction)) - apart;
            if off > FRAC_PI_2 { 0.0 } else { libm::cosf(off.max(0.0)) }
        });
        self.power * at_light.max(LEAST) * at_point / distance2
    }
}

/// Least factor for a cosine that the bounds leave: what they allow at all must be picked now and then.
const LEAST: f32 = 1e-3;

fn angle(cosine: f32) -> f32 {
    libm::acosf(cosine.clamp(-1.0, 1.0))
}

impl Cone {
    const ALL: Self = Self { axis: Vec3::Y, facing: PI, shining: FRAC_PI_2 };

    /// The least cone around both.
    fn with(&self, other: &Self) -> Self {
        let shining = self.shining.max(other.shining);
        let (wide, narrow) = if self.facing >= other.facing { (self, other) } else { (other, self) };
        let apart = angle(wide.axis.dot(narrow.axis));
        if (apart + narrow.facing).min(PI) <= wide.facing {
            return Self { shining, ..*wide };
        }
        let facing = 0.5 * (wide.facing + apart + narrow.facing);
        let across = narrow.axis.reject_from_normalized(wide.axis).try_normalize();
        let Some(across) = across.filter(|_| facing < PI) else { return Self { shining, ..Self::ALL } };
        let turn = facing - wide.facing;
        let axis = (wide.axis * libm::cosf(turn) + across * libm::sinf(turn)).normalize();
        Self { axis, facing, shining }
    }
}

impl Item {
    fn of(light: LightId, what: &Light) -> Option<Self> {
        let mean = |color: Vec3| color.element_sum() / 3.0;
        let one_side = |axis: Vec3| Cone { axis, facing: 0.0, shining: FRAC_PI_2 };
        let all = |color: Vec3, area: f32| mean(color) * area * PI;
        let (bounds, power, cone) = match what {
            Light::Directional { .. } => return None,
            Light::Point { position, intensity } => {
                (Bounds::of([*position]), 4.0 * PI * mean(*intensity), Cone::ALL)
            }
            Light::Spot(spot) => {
                let [inner, outer] = [spot.cos_inner, spot.cos_outer].map(angle);
                // As strong where it shines as a point of the same intensity.
                let cone = Cone { axis: spot.axis, facing: inner, shining: outer - inner };
                (Bounds::of([spot.position]), 4.0 * PI * mean(spot.intensity), cone)
            }
            // A flat light's intensity along its normal is radiance times area: four times its power over that all around.
            Light::Quad(quad) => {
                (Bounds::of(quad.corners()), 4.0 * all(quad.radiance, quad.area()), one_side(quad.normal))
            }
            Light::Disk(disk) => {
                let corners = disk.square().corners();
                (Bounds::of(corners), 4.0 * all(disk.radiance, disk.area()), one_side(disk.normal))
            }
            Light::Sphere(sphere) => {
                let corners = [sphere.center - sphere.radius, sphere.center + sphere.radius];
                (Bounds::of(corners), all(sphere.radiance, sphere.area()), Cone::ALL)
            }
            Light::Mesh(mesh) => (mesh.bounds(), all(mesh.radiance, mesh.area()), Cone::ALL),
        };
        Some(Self { light, bounds, power, cone })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{SamplePoint, uniform_sphere};
    use crate::scene::{NoAssets, Scene};

    /// Lights of all kinds here and there.
    fn lights() -> Scene {
        let kinds = [
            r#"{ "type": "point", "position": P, "intensity": [1, 1, 1] }"#,
            r#"{ "type": "spot", "position": P, "direction": Q, "outer": 80, "intensity": [3, 3, 3] }"#,
            r#"{ "type": "quad", "center": P, "size": [0.2, 0.4], "towards": [0, 0, 0], "radiance": [9, 9, 9] }"#,
            r#"{ "type": "disk", "center": P, "radius": 0.1, "towards": [0, 1, 0], "radiance": [9, 9, 9] }"#,
            r#"{ "type": "sphere", "center": P, "radius": 0.1, "radiance": [9, 9, 9] }"#,
            r#"{ "type": "directional", "direction": Q, "irradiance": [1, 1, 1] }"#,
        ];
        let text = |v: Vec3| format!("[{}, {}, {}]", v.x, v.y, v.z);
        let lights: Vec<String> = (0..60)
            .map(|i| {
                let sample = SamplePoint::new(3, i);
                let place = uniform_sphere(sample.get_2d(0)) * (2.0 + 3.0 * sample.get(2));
                let turn = uniform_sphere(sample.get_2d(4));
                kinds[i as usize % kinds.len()].replace('P', &text(place)).replace('Q', &text(turn))
            })
            .collect();
        let scene = format!(
            r#"{{ "nephroid": 1, "camera": {{ "type": "perspective", "eye": [0, 0, 1], "target": [0, 0, 0], "fov": 50 }},
               "objects": [], "lights": [{}] }}"#,
            lights.join(", ")
        );
        Scene::from_json(&scene, &NoAssets).unwrap_or_else(|e| panic!("{e}"))
    }

    /// T20: picks are as frequent as is said, the probabilities of all lights add up to at most 1, and no light that gives
    /// light is ruled out.
    #[test]
    fn t20_lights_are_picked_as_often_as_is_said() {
        const PICKS: u32 = 4096;
        let scene = lights();
        let tree = LightTree::new(&scene);
        assert_eq!(tree.always().len(), 10);
        for i in 0..20 {
            let sample = SamplePoint::new(8, i);
            let normal = (i % 2 == 0).then(|| uniform_sphere(sample.get_2d(4)));
            let asking = Asking { point: uniform_sphere(sample.get_2d(0)) * (6.0 * sample.get(2)), normal };
            let mut counts = vec![0_u32; scene.lights.len()];
            for k in 0..PICKS {
                let u = (k as f32 + 0.5) / PICKS as f32;
                let Some((light, probability)) = tree.pick(&asking, u) else { continue };
                let said = tree.probability(&asking, light);
                assert!((probability - said).abs() <= 1e-5 * said, "{probability} {said}");
                counts[light.index()] += 1;
            }
            let near = |id: &LightId| !tree.always().contains(id);
            for id in (0..60).map(LightId).filter(near) {
                let expected = tree.probability(&asking, id) * PICKS as f32;
                // An interval of u holds the points in it up to one at each end; each level rounds once more.
                assert!((counts[id.index()] as f32 - expected).abs() <= 2.0, "{id:?} {expected}");
                assert!(expected > 0.0 || !shines_on(&scene.lights[id.index()], &asking), "{id:?}");
            }
        }
    }

    fn shines_on(light: &Light, asking: &Asking) -> bool {
        let sees = |place: Vec3| asking.normal.is_none_or(|normal| normal.dot(place - asking.point) > 1e-4);
        match light {
            Light::Point { position, .. } => sees(*position),
            Light::Spot(spot) => {
                let to = (asking.point - spot.position).normalize();
                sees(spot.position) && spot.intensity_along(to).x > 1e-4
            }
            Light::Quad(quad) => {
                (asking.point - quad.center).dot(quad.normal) > 1e-4 && quad.corners().into_iter().any(sees)
            }
            Light::Disk(disk) => (asking.point - disk.center).dot(disk.normal) > 1e-4 && sees(disk.center),
            Light::Sphere(sphere) => sees(sphere.center),
            Light::Directional { .. } | Light::Mesh(_) => false,
        }
    }
}
