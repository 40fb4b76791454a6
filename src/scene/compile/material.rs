//! Materials of the scene file.

use super::super::file::{MaterialFile, MetalFile};
use super::super::issue::{IssueCode, pointer_step};
use super::super::{Conductor, Material};
use super::{Compiler, vec3};

impl Compiler<'_> {
    /// A material; `None` if it is wrong, which has then been noted.
    pub(super) fn material(&mut self, name: &str, material: &MaterialFile) -> Option<Material> {
        Some(match material {
            MaterialFile::Diffuse(diffuse) => Material::Diffuse {
                albedo: self
                    .texture(&diffuse.albedo, &format!("{}/albedo", pointer_step("/materials", name)))?,
            },
            MaterialFile::Mirror(mirror) => Material::Mirror { reflectance: vec3(mirror.reflectance) },
            MaterialFile::Metal(metal) => Material::Metal(self.conductor(name, metal)?),
            MaterialFile::Glass(glass) => {
                Material::Glass { ior: glass.ior as f32, absorption: vec3(glass.absorption) }
            }
        })
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
        let pointer = pointer_step(&pointer_step("/materials", name), field);
        self.issues.add(pointer, code, message);
        None
    }
}
