//! Materials of the scene file.

use super::super::issue::{IssueCode, pointer_step};
use super::super::material_file::{AmountFile, GlassFile, MaterialFile, MetalFile, MixFile, PhongFile};
use super::super::{Alpha, Conductor, Dielectric, Ior, Material, Mix, Phong, Texture};
use super::{Compiler, vec3};
use glam::Vec3;

impl Compiler<'_> {
    /// A material that is no mix; `None` if it is wrong, which has then been noted, or a mix.
    pub(super) fn material(&mut self, name: &str, material: &MaterialFile) -> Option<Material> {
        Some(match material {
            MaterialFile::Diffuse(diffuse) => {
                Material::Diffuse { albedo: self.texture(&diffuse.albedo, &material_field(name, "albedo"))? }
            }
            MaterialFile::Mirror(mirror) => Material::Mirror { reflectance: vec3(mirror.reflectance) },
            MaterialFile::Metal(metal) => Material::Metal {
                conductor: self.conductor(name, metal)?,
                alpha: Alpha::of_roughness(metal.roughness as f32),
            },
            MaterialFile::Glass(glass) => Material::Glass {
                dielectric: self.dielectric(name, glass)?,
                alpha: Alpha::of_roughness(glass.roughness as f32),
            },
            MaterialFile::Phong(phong) => {
                let k_d = match &phong.k_d {
                    Some(albedo) => self.texture(albedo, &material_field(name, "k_d"))?,
                    None => Texture::Constant(Vec3::ZERO),
                };
                Material::Phong(Box::new(lecture(phong, k_d)))
            }
            MaterialFile::Mix(_) => return None,
        })
    }

    /// A mix of two materials that have been compiled.
    pub(super) fn mix(&mut self, name: &str, mix: &MixFile) -> Option<Material> {
        let first = self.part(name, "first", &mix.first)?;
        let second = self.part(name, "second", &mix.second)?;
        if first.dielectric().is_some() && second.dielectric().is_some() {
            let message = "a mix cannot have two materials that let light through";
            self.issues.add(material_field(name, "second"), IssueCode::ConflictingFields, message);
            return None;
        }
        let amount = match &mix.amount {
            AmountFile::Number(share) => Texture::Constant(Vec3::splat(*share as f32)),
            AmountFile::Pattern(pattern) => self.texture(pattern, &material_field(name, "amount"))?,
        };
        Some(Material::Mix(Box::new(Mix { parts: [first, second], amount })))
    }

    fn part(&mut self, name: &str, field: &str, part: &str) -> Option<Material> {
        if self.mixes.contains(part) {
            let message = format!("`{part}` is a mix itself: name its parts");
            self.issues.add(material_field(name, field), IssueCode::ConflictingFields, message);
            return None;
        }
        // The reader has refused names that no material has; what is missing here has been noted as wrong.
        let id = self.material_ids.get(part)?;
        self.materials.get(id.index()).cloned()
    }

    fn conductor(&mut self, name: &str, metal: &MetalFile) -> Option<Conductor> {
        let (field, code, message) = match (metal.f0, metal.n, metal.k) {
            (Some(f0), None, None) => return Some(Conductor::Normal(vec3(f0))),
            (None, Some(n), Some(k)) => return Some(Conductor::Complex { n: vec3(n), k: vec3(k) }),
            (Some(_), Some(_) | None, Some(_) | None) => {
                ("f0", IssueCode::ConflictingFields, "`f0` cannot be given together with `n` and `k`")
            }
            (None, None, None) => {
                ("f0", IssueCode::MissingField, "the field `f0` is missing: a metal has that, or `n` and `k`")
            }
            (None, Some(_), None) => ("k", IssueCode::MissingField, "the field `k` is missing beside `n`"),
            (None, None, Some(_)) => ("n", IssueCode::MissingField, "the field `n` is missing beside `k`"),
        };
        self.issues.add(material_field(name, field), code, message);
        None
    }

    fn dielectric(&mut self, name: &str, glass: &GlassFile) -> Option<Dielectric> {
        let ior = match (glass.abbe, glass.cauchy) {
            (None, None) => Ior::Constant(glass.ior as f32),
            (Some(abbe), None) => Ior::of_abbe(glass.ior, abbe),
            (None, Some([b, c])) => Ior::Cauchy([glass.ior as f32, b as f32, c as f32]),
            (Some(_), Some(_)) => {
                let message = "`cauchy` cannot be given together with `abbe`";
                self.issues.add(material_field(name, "cauchy"), IssueCode::ConflictingFields, message);
                return None;
            }
        };
        let priority = i32::try_from(glass.priority).unwrap_or(i32::MAX);
        Some(Dielectric { ior, absorption: vec3(glass.absorption), priority })
    }
}

fn lecture(phong: &PhongFile, k_d: Texture) -> Phong {
    Phong {
        emission: vec3(phong.emission),
        ambient: vec3(phong.k_a) * vec3(phong.ambient),
        k_d,
        k_s: vec3(phong.k_s),
        exponent: phong.n as f32,
        highlight: phong.highlight,
        k_r: vec3(phong.k_r),
        k_t: vec3(phong.k_t),
        dielectric: Dielectric { ior: Ior::Constant(phong.ior as f32), absorption: Vec3::ZERO, priority: 0 },
    }
}

fn material_field(name: &str, field: &str) -> String {
    pointer_step(&pointer_step("/materials", name), field)
}
