//! Materials of a model: glass if more than half transmits, metal if more than half is metal, else diffuse.

use super::container::Model;
use super::{Import, ImportError, short, short3};
use gltf::material::AlphaMode;
use gltf::{Material, Primitive};
use serde_json::{Value, json};

/// Index of refraction of a material that does not say (KHR_materials_ior).
const DEFAULT_IOR: f32 = 1.5;

/// What a primitive is made of.
#[derive(Clone)]
pub(super) struct Surface {
    /// Name of the material in the scene.
    pub(super) name: String,
    /// Radiance of the front, if it emits.
    pub(super) emission: Option<Value>,
    /// Which texture coordinates it uses.
    pub(super) uv_set: u32,
}

impl Import {
    /// The surface of a primitive; its material is added with its first use.
    pub(super) fn surface(
        &mut self,
        model: &Model,
        primitive: &Primitive<'_>,
    ) -> Result<Surface, ImportError> {
        let material = primitive.material();
        if let Some(known) = self.surfaces.get(&material.index()) {
            return Ok(known.clone());
        }
        let described = self.describe(model, &material);
        let wanted = material.name().map(str::to_owned).filter(|name| !name.is_empty());
        let wanted = wanted.unwrap_or_else(|| match material.index() {
            Some(index) => format!("material {index}"),
            None => "default".to_owned(),
        });
        let name = self.unique(&wanted);
        let lets_through = described["type"] == "glass";
        let mut emission = self.emission(model, &material);
        if lets_through && emission.take().is_some() {
            self.warn("emission_ignored", format!("`{name}` is glass, which cannot emit"));
        }
        let uv_set =
            material.pbr_metallic_roughness().base_color_texture().map_or(0, |info| info.tex_coord());
        let surface = Surface { name: name.clone(), emission, uv_set };
        self.materials.insert(name, described);
        self.surfaces.insert(material.index(), surface.clone());
        Ok(surface)
    }

    fn describe(&mut self, model: &Model, material: &Material<'_>) -> Value {
        self.note_unread_pictures(material);
        let pbr = material.pbr_metallic_roughness();
        let [_, rough, metal] = match pbr.metallic_roughness_texture() {
            Some(info) => {
                let message = "pictures of roughness and metalness are not read, only their means";
                self.warn("texture_averaged", message);
                self.mean(model, &info, false)
            }
            None => [1.0; 3],
        };
        let roughness = fraction(pbr.roughness_factor() * rough);
        let [r, g, b, _] = pbr.base_color_factor().map(fraction);
        let transmission = material.transmission().map_or(0.0, |t| t.transmission_factor());
        if transmission > 0.5 {
            if [r, g, b] != [1.0; 3] || pbr.base_color_texture().is_some() {
                self.warn("glass_tint_ignored", "the colour of glass comes from its absorption alone");
            }
            let mut glass = self.glass(material);
            if roughness > 0.0 {
                glass["roughness"] = short(roughness);
            }
            return glass;
        }
        if pbr.metallic_factor() * metal > 0.5 {
            let mut f0 = [r, g, b];
            if let Some(info) = pbr.base_color_texture() {
                self.warn("texture_averaged", "pictures on metal are not read, only their means");
                let mean = self.mean(model, &info, true);
                f0 = [r * mean[0], g * mean[1], b * mean[2]].map(fraction);
            }
            let mut metal = json!({ "type": "metal", "f0": short3(f0) });
            if roughness > 0.0 {
                metal["roughness"] = short(roughness);
            }
            return metal;
        }
        let albedo = match pbr.base_color_texture() {
            Some(info) => self.textured(model, &info, [r, g, b]),
            None => short3([r, g, b]),
        };
        json!({ "type": "diffuse", "albedo": albedo })
    }

    fn glass(&mut self, material: &Material<'_>) -> Value {
        let ior = material.ior().filter(|ior| (1.0..=100.0).contains(ior)).unwrap_or(DEFAULT_IOR);
        let mut glass = json!({ "type": "glass", "ior": short(ior) });
        match material.volume() {
            Some(volume) => {
                let distance = volume.attenuation_distance();
                // Over this distance light falls to the colour.
                let coefficient = |c: f32| (-c.clamp(1e-4, 1.0).ln() / distance).clamp(0.0, 1e9);
                if distance.is_finite() && distance > 0.0 && volume.attenuation_color() != [1.0; 3] {
                    glass["absorption"] = short3(volume.attenuation_color().map(coefficient));
                }
            }
            None => self
                .warn("thin_glass", "glass without a volume is taken for solid: its surface must be closed"),
        }
        // KHR_materials_dispersion stores 20 / Abbe number.
        let dispersion = material.extension_value("KHR_materials_dispersion");
        let dispersion = dispersion.and_then(|value| value["dispersion"].as_f64()).unwrap_or(0.0) as f32;
        if dispersion > 0.0 {
            glass["abbe"] = short((20.0 / dispersion).clamp(1.0, 1000.0));
        }
        glass
    }

    fn emission(&mut self, model: &Model, material: &Material<'_>) -> Option<Value> {
        let strength = material.emissive_strength().unwrap_or(1.0).max(0.0);
        let mut factor = material.emissive_factor().map(|c| c.max(0.0) * strength);
        if factor.iter().all(|c| *c <= 0.0) {
            return None;
        }
        if let Some(info) = material.emissive_texture() {
            self.warn("texture_averaged", "pictures of emission are not read, only their means");
            let mean = self.mean(model, &info, true);
            factor = [factor[0] * mean[0], factor[1] * mean[1], factor[2] * mean[2]];
        }
        factor.iter().any(|c| *c > 0.0).then(|| short3(factor.map(|c| c.min(1e12))))
    }

    fn note_unread_pictures(&mut self, material: &Material<'_>) {
        if material.normal_texture().is_some() || material.occlusion_texture().is_some() {
            self.warn("texture_ignored", "pictures of normals and of occlusion are not read");
        }
        if material.alpha_mode() != AlphaMode::Opaque {
            self.warn("alpha_ignored", "surfaces are opaque: alpha is not read");
        }
    }
}

fn fraction(x: f32) -> f32 {
    x.clamp(0.0, 1.0)
}
