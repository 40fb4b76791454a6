//! Meshes of the scene file, inline or from assets, checked and made ready for rendering.

use super::super::assets::AssetSource;
use super::super::issue::{IssueCode, Issues};
use super::super::mesh_file;
use super::super::read::{MAX_LENGTH, MIN_LENGTH, quoted};
use super::super::shape_file::MeshFile;
use super::{Refusal, vec3};
use crate::geometry::MeshData;
use glam::{DVec3, Vec2, Vec3};
use std::collections::HashMap;
use std::rc::Rc;

/// Most triangles of a scene, over all objects: an asset may be used many times, and each use takes memory.
const MAX_TRIANGLES: usize = 1 << 24;

/// Loads meshes; each asset once, however many objects use it.
pub(super) struct MeshLoader<'a> {
    assets: &'a dyn AssetSource,
    loaded: HashMap<String, Result<Rc<MeshData>, Refusal>>,
    triangles: usize,
}

impl<'a> MeshLoader<'a> {
    pub(super) fn new(assets: &'a dyn AssetSource) -> Self {
        Self { assets, loaded: HashMap::new(), triangles: 0 }
    }

    /// The mesh of an object; `None` if it is wrong, which has then been noted.
    pub(super) fn load(
        &mut self,
        file: &MeshFile,
        pointer: &str,
        issues: &mut Issues,
    ) -> Option<Rc<MeshData>> {
        let inline = [
            ("positions", file.positions.is_some()),
            ("triangles", file.triangles.is_some()),
            ("normals", file.normals.is_some()),
            ("uvs", file.uvs.is_some()),
        ];
        let mesh = match &file.asset {
            Some(asset) => {
                for (field, _) in inline.iter().filter(|(_, given)| *given) {
                    let message = format!("`{field}` cannot be given together with `asset`");
                    issues.add(format!("{pointer}/{field}"), IssueCode::ConflictingFields, message);
                }
                self.asset(asset)
                    .map_err(|(code, why)| issues.add(format!("{pointer}/asset"), code, why))
                    .ok()?
            }
            None => Rc::new(inline_mesh(file, pointer, issues)?),
        };
        self.triangles = self.triangles.saturating_add(mesh.triangles.len());
        if self.triangles > MAX_TRIANGLES {
            let message = format!("the scene has more than {MAX_TRIANGLES} triangles");
            issues.add(pointer, IssueCode::TooLarge, message);
            return None;
        }
        Some(mesh)
    }

    /// A mesh that has been loaded before.
    pub(super) fn again(&self, file: &MeshFile) -> Option<Rc<MeshData>> {
        match &file.asset {
            Some(asset) => self.loaded.get(asset)?.as_ref().ok().cloned(),
            None => inline_mesh(file, "", &mut Issues::default()).map(Rc::new),
        }
    }

    fn asset(&mut self, name: &str) -> Result<Rc<MeshData>, Refusal> {
        if let Some(known) = self.loaded.get(name) {
            return known.clone();
        }
        let mesh = self.read_asset(name).map(Rc::new);
        self.loaded.insert(name.to_owned(), mesh.clone());
        mesh
    }

    fn read_asset(&self, name: &str) -> Result<MeshData, Refusal> {
        let bytes = self.assets.read(name).map_err(|e| (IssueCode::AssetUnavailable, e.to_string()))?;
        let invalid = |why: String| (IssueCode::AssetInvalid, format!("`{}`: {why}", quoted(name)));
        let mut mesh = mesh_file::decode(&bytes).map_err(|e| invalid(e.to_string()))?;
        clean(&mut mesh).map_err(invalid)?;
        Ok(mesh)
    }
}

/// A mesh whose numbers stand in the scene file, where the reader has checked each by itself.
fn inline_mesh(file: &MeshFile, pointer: &str, issues: &mut Issues) -> Option<MeshData> {
    let before = issues.count();
    for (field, given) in [("positions", file.positions.is_some()), ("triangles", file.triangles.is_some())] {
        if !given {
            let message = format!(
                "the field `{field}` is missing: a mesh has `positions` and `triangles`, or an `asset`"
            );
            issues.add(format!("{pointer}/{field}"), IssueCode::MissingField, message);
        }
    }
    let positions = file.positions.as_deref()?;
    for (field, length) in
        [("normals", file.normals.as_ref().map(Vec::len)), ("uvs", file.uvs.as_ref().map(Vec::len))]
    {
        if let Some(length) = length.filter(|length| *length != positions.len()) {
            let message =
                format!("expected one for each of the {} positions, found {length}", positions.len());
            issues.add(format!("{pointer}/{field}"), IssueCode::WrongLength, message);
        }
    }
    let triangles = file.triangles.as_deref()?;
    for (index, triangle) in triangles.iter().enumerate() {
        if let Some(vertex) = triangle.iter().position(|v| *v as usize >= positions.len()) {
            let message = format!("there are {} positions, counted from 0", positions.len());
            issues.add(format!("{pointer}/triangles/{index}/{vertex}"), IssueCode::IndexOutOfRange, message);
        }
    }
    (issues.count() == before).then(|| MeshData {
        positions: positions.iter().map(|p| vec3(*p)).collect(),
        triangles: triangles.to_vec(),
        normals: file.normals.iter().flatten().map(|n| DVec3::from(*n).normalize().as_vec3()).collect(),
        uvs: file.uvs.iter().flatten().map(|[u, v]| Vec2::new(*u as f32, *v as f32)).collect(),
    })
}

/// Checks what a file format does not promise, and normalises the normals.
fn clean(mesh: &mut MeshData) -> Result<(), String> {
    if mesh.triangles.is_empty() {
        return Err("the mesh has no triangles".to_owned());
    }
    let limit = MAX_LENGTH as f32;
    let far = |p: &Vec3| !p.is_finite() || p.abs().max_element() > limit;
    if let Some(index) = mesh.positions.iter().position(far) {
        return Err(format!("the position of vertex {index} is not a finite number below {MAX_LENGTH:e} m"));
    }
    if let Some(index) = mesh.uvs.iter().position(|uv| !uv.is_finite() || uv.abs().max_element() > limit) {
        return Err(format!("the texture coordinates of vertex {index} are not finite"));
    }
    for (index, normal) in mesh.normals.iter_mut().enumerate() {
        let wide = normal.as_dvec3();
        if !(wide.is_finite() && wide.length() >= MIN_LENGTH) {
            return Err(format!("the normal of vertex {index} has no direction"));
        }
        *normal = wide.normalize().as_vec3();
    }
    let vertices = mesh.positions.len();
    match mesh.triangles.iter().position(|t| t.iter().any(|v| *v as usize >= vertices)) {
        Some(index) => Err(format!("triangle {index} points at a vertex that does not exist")),
        None => Ok(()),
    }
}
