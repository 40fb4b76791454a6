//! Meshes of a model: each as it stands in the world, or as an instance of one that does.

use super::container::{Model, content};
use super::nodes::Placed;
use super::{Import, ImportError, ply};
use crate::geometry::MeshData;
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};
use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Mode;
use gltf::{Primitive, Semantic};
use serde_json::{Value, json};
use std::collections::HashMap;

/// Most triangles, and most vertices, that a model may have in all; as many triangles as a scene.
const MAX_TRIANGLES: usize = 1 << 24;

/// Largest coordinate that a scene may have, in metres.
const FARTHEST: f32 = 1e9;

/// How much an instance's transform may differ from its parts, relative to its largest entry.
const SHEAR: f64 = 1e-5;

/// Scales that an instance may have.
const SCALES: std::ops::RangeInclusive<f64> = 1e-6..=1e6;

/// A primitive that stands in the scene: the name of its object, and its transform.
struct Original {
    name: String,
    to_world: DAffine3,
}

impl Import {
    pub(super) fn objects(&mut self, model: &Model, placed: &Placed<'_>) -> Result<(), ImportError> {
        let mut originals: HashMap<(usize, usize), Original> = HashMap::new();
        let (mut triangles, mut vertices) = (0, 0);
        for (mesh, to_world, name) in &placed.meshes {
            for primitive in mesh.primitives() {
                let key = (mesh.index(), primitive.index());
                let surface = self.surface(model, &primitive)?;
                if let Some(original) = originals.get(&key)
                    && surface.emission.is_none()
                    && let Some(placement) = placement(*to_world * original.to_world.inverse())
                {
                    self.instance(&original.name, &placement, &surface.name, name);
                    continue;
                }
                let Some(data) = self.read(model, &primitive, surface.uv_set)? else { continue };
                let data = in_world(data, *to_world);
                triangles += data.triangles.len();
                vertices += data.positions.len();
                if triangles > MAX_TRIANGLES || vertices > MAX_TRIANGLES {
                    return Err(ImportError::TooLarge {
                        what: "triangles or vertices",
                        limit: MAX_TRIANGLES,
                    });
                }
                let name = self.object(&data, &surface.name, surface.emission, name)?;
                originals.entry(key).or_insert(Original { name, to_world: *to_world });
            }
        }
        if self.objects.is_empty() {
            return Err(content("meshes", "there is nothing to see in the scene"));
        }
        Ok(())
    }

    fn object(
        &mut self,
        data: &MeshData,
        material: &str,
        emission: Option<Value>,
        name: &str,
    ) -> Result<String, ImportError> {
        let name = self.unique(name);
        let far = |p: &Vec3| !p.is_finite() || p.abs().max_element() > FARTHEST;
        if let Some(index) = data.positions.iter().position(far) {
            let reason =
                format!("the position of vertex {index} is not a finite number below {FARTHEST:e} m");
            return Err(content(name, reason));
        }
        for position in &data.positions {
            self.include(*position);
        }
        let asset = self.keep(&name, "ply", ply::encode(data));
        let mut object = json!({ "type": "mesh", "name": name, "asset": asset, "material": material });
        if let Some(emission) = emission {
            object["emission"] = emission;
            self.emits = true;
        }
        self.objects.push(object);
        Ok(name)
    }

    fn instance(&mut self, of: &str, placement: &Value, material: &str, name: &str) {
        let name = self.unique(name);
        let mut object = json!({ "type": "instance", "name": name, "of": of, "material": material });
        for (field, value) in placement.as_object().into_iter().flatten() {
            object[field] = value.clone();
        }
        self.objects.push(object);
    }

    fn include(&mut self, position: Vec3) {
        let [min, max] = self.bounds.unwrap_or([position; 2]);
        self.bounds = Some([min.min(position), max.max(position)]);
    }

    /// The triangles of a primitive in its own space; `None` if it has none.
    fn read(
        &mut self,
        model: &Model,
        primitive: &Primitive<'_>,
        uv_set: u32,
    ) -> Result<Option<MeshData>, ImportError> {
        let positions = primitive.get(&Semantic::Positions);
        let positions = positions.ok_or_else(|| content("meshes", "a primitive has no positions"))?;
        model.check_accessor(&positions, Dimensions::Vec3, &[DataType::F32])?;
        let count = positions.count();
        let same_count = |semantic: &Semantic, dimensions, types: &[DataType]| {
            let Some(accessor) = primitive.get(semantic) else { return Ok(false) };
            model.check_accessor(&accessor, dimensions, types)?;
            match accessor.count() == count {
                true => Ok(true),
                false => {
                    Err(content(format!("accessors[{}]", accessor.index()), "not one item per position"))
                }
            }
        };
        let has_normals = same_count(&Semantic::Normals, Dimensions::Vec3, &[DataType::F32])?;
        let uv_types = [DataType::F32, DataType::U8, DataType::U16];
        let has_uvs = same_count(&Semantic::TexCoords(uv_set), Dimensions::Vec2, &uv_types)?;
        let reader = primitive.reader(|_| Some(model.data()));
        let mut mesh = MeshData {
            positions: reader.read_positions().into_iter().flatten().map(Vec3::from).collect(),
            ..MeshData::default()
        };
        if has_normals {
            mesh.normals = reader.read_normals().into_iter().flatten().map(Vec3::from).collect();
        }
        if has_uvs {
            let uvs = reader.read_tex_coords(uv_set).into_iter().flat_map(|uvs| uvs.into_f32());
            // Their v points down, ours up.
            mesh.uvs = uvs.map(|[u, v]| Vec2::new(u, 1.0 - v)).collect();
        }
        mesh.triangles = self.triangles(model, primitive, count)?;
        self.note_unread(primitive, &mut mesh);
        Ok((!mesh.triangles.is_empty()).then_some(mesh))
    }

    /// Notes what of a primitive is not read, and drops what cannot be used.
    fn note_unread(&mut self, primitive: &Primitive<'_>, mesh: &mut MeshData) {
        if primitive.get(&Semantic::Colors(0)).is_some() {
            self.warn("vertex_colors_ignored", "colours of vertices are not read");
        }
        if primitive.morph_targets().len() > 0 {
            self.warn("morph_ignored", "morph targets are not read");
        }
        if mesh.normals.iter().any(|n| !n.is_finite() || n.length_squared() < 1e-12) {
            self.warn("bad_normals", "normals without a direction: such meshes are flat instead");
            mesh.normals = Vec::new();
        }
        if mesh.uvs.iter().any(|uv| !uv.is_finite()) {
            self.warn("bad_uvs", "texture coordinates that are not finite are left out");
            mesh.uvs = Vec::new();
        }
    }

    fn triangles(
        &mut self,
        model: &Model,
        primitive: &Primitive<'_>,
        vertices: usize,
    ) -> Result<Vec<[u32; 3]>, ImportError> {
        if vertices > MAX_TRIANGLES {
            return Err(ImportError::TooLarge { what: "vertices", limit: MAX_TRIANGLES });
        }
        let corners: Vec<u32> = match primitive.indices() {
            Some(indices) => {
                model.check_accessor(
                    &indices,
                    Dimensions::Scalar,
                    &[DataType::U8, DataType::U16, DataType::U32],
                )?;
                let reader = primitive.reader(|_| Some(model.data()));
                let corners: Vec<u32> =
                    reader.read_indices().into_iter().flat_map(|i| i.into_u32()).collect();
                if let Some(at) = corners.iter().position(|index| *index as usize >= vertices) {
                    let reason = format!("item {at} points at a vertex that does not exist");
                    return Err(content(format!("accessors[{}]", indices.index()), reason));
                }
                corners
            }
            None => (0..vertices as u32).collect(),
        };
        let windows = || corners.windows(3).map(|w| [w[0], w[1], w[2]]);
        Ok(match primitive.mode() {
            Mode::Triangles => corners.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
            // Every second triangle of a strip is turned, so that all face the same side.
            Mode::TriangleStrip => windows()
                .enumerate()
                .map(|(i, [a, b, c])| if i % 2 == 0 { [a, b, c] } else { [b, a, c] })
                .filter(|[a, b, c]| a != b && b != c && c != a)
                .collect(),
            Mode::TriangleFan => {
                let first = corners.first().copied().unwrap_or_default();
                corners.get(1..).unwrap_or_default().windows(2).map(|w| [first, w[0], w[1]]).collect()
            }
            Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => {
                self.warn("not_triangles", "points and lines are left out");
                Vec::new()
            }
        })
    }
}

/// A mesh where it stands. A mirrored one is turned inside out once more.
fn in_world(mut mesh: MeshData, to_world: DAffine3) -> MeshData {
    for position in &mut mesh.positions {
        *position = to_world.transform_point3(position.as_dvec3()).as_vec3();
    }
    let determinant = to_world.matrix3.determinant();
    // Columns of the inverse transpose times the determinant, which is defined for flat scales too.
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = to_world.matrix3;
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * determinant.signum();
    let turned = |normal: &Vec3| (cofactors * normal.as_dvec3()).try_normalize().map(DVec3::as_vec3);
    mesh.normals = mesh.normals.iter().map(turned).collect::<Option<_>>().unwrap_or_default();
    if determinant < 0.0 {
        mesh.triangles.iter_mut().for_each(|[_, b, c]| std::mem::swap(b, c));
    }
    mesh
}

/// Scale, rotation and translation of an instance, if the transform is made of those alone.
fn placement(transform: DAffine3) -> Option<Value> {
    let (scale, rotation, translation) = transform.to_scale_rotation_translation();
    let again = DAffine3::from_scale_rotation_translation(scale, rotation, translation);
    let largest = |m: DMat3| m.to_cols_array().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let difference = largest(again.matrix3 - transform.matrix3);
    let good = transform.is_finite() && scale.to_array().iter().all(|s| SCALES.contains(s));
    if !good || difference > SHEAR * largest(transform.matrix3) {
        return None;
    }
    let (axis, angle) = rotation.to_axis_angle();
    let round = |x: f64| (x * 1e9).round() / 1e9;
    let all = |v: DVec3| json!(v.to_array().map(round));
    Some(json!({ "scale": all(scale), "rotate": { "axis": all(axis), "angle": round(angle.to_degrees()) },
                 "translate": all(translation) }))
}
