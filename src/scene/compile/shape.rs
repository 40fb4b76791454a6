//! Shapes of the scene file that are made of simpler ones, and instances of other objects.

use super::super::ObjectId;
use super::super::file::ObjectFile;
use super::super::issue::IssueCode;
use super::super::read::MAX_LENGTH;
use super::super::shape_file::{BoxFile, HeightfieldFile, InstanceFile, RotateFile, ShapeFile};
use super::Compiler;
use crate::geometry::{Bounds, MeshData, SharedMeshId};
use glam::{DAffine3, DQuat, DVec3, Vec2, Vec3};
use std::collections::HashMap;

/// Largest relative difference between the scales along the axes that counts as none.
const UNIFORM: f64 = 1e-6;

/// Objects that instances may name.
#[derive(Default)]
pub(super) struct Originals<'f> {
    /// Each name's object and its index; `None` if several objects have the name.
    by_name: HashMap<&'f str, Option<(usize, &'f ObjectFile)>>,
    /// Meshes that are kept once, by the index of their object; `None` if one is wrong.
    shared: HashMap<usize, Option<SharedMeshId>>,
    /// Indices of the objects that are instanced.
    instanced: Vec<usize>,
}

impl<'f> Originals<'f> {
    /// The object of a name that only one has, and its index.
    pub(super) fn find(&self, name: &str) -> Option<(usize, &'f ObjectFile)> {
        self.by_name.get(name).copied().flatten()
    }

    /// Whether there are instances of the object with this index.
    pub(super) fn is_instanced(&self, index: usize) -> bool {
        self.instanced.contains(&index)
    }

    pub(super) fn new(objects: &'f [Option<ObjectFile>]) -> Self {
        let mut originals = Self::default();
        let objects = || objects.iter().enumerate().filter_map(|(i, o)| Some((i, o.as_ref()?)));
        for (index, object) in objects() {
            if let Some(name) = &object.name {
                let known = originals.by_name.entry(name).or_insert(Some((index, object)));
                *known = known.filter(|(first, _)| *first == index);
            }
        }
        for (_, object) in objects() {
            if let ShapeFile::Instance(instance) = &object.shape
                && let Some(Some((index, _))) = originals.by_name.get(instance.of.as_str())
            {
                originals.instanced.push(*index);
            }
        }
        originals
    }

    /// The index of the one object of a name.
    pub(super) fn index_of(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied().flatten().map(|(index, _)| index)
    }
}

/// The outlines of a box's six sides, seen from outside. Each begins where a picture on it has its lower left
/// corner: upright on the four walls, with x to the right on top and bottom.
pub(super) fn sides(file: &BoxFile) -> [[DVec3; 4]; 6] {
    let (center, half) = (DVec3::from(file.center), DVec3::from(file.size) * 0.5);
    std::array::from_fn(|side| {
        let (axis, sign) = (side / 2, if side % 2 == 0 { 1.0 } else { -1.0 });
        let mut corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        corners.rotate_left([3, 1, 1, 1, 0, 0][side]);
        corners.map(|(a, b)| {
            let mut p = DVec3::ZERO;
            // Of the two directions within the side one is turned with the sign, so that all face outwards.
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (sign, a * sign, b);
            center + p * half
        })
    })
}

/// The triangles of a height field. Normals are those of the smooth surface through the heights.
pub(super) fn heightfield(file: &HeightfieldFile) -> MeshData {
    let (rows, columns) = (file.heights.len(), file.heights[0].len());
    let step = DVec3::new(file.size[0] / (columns - 1) as f64, 1.0, file.size[1] / (rows - 1) as f64);
    let corner = DVec3::from(file.center) - DVec3::new(file.size[0], 0.0, file.size[1]) * 0.5;
    let mut mesh = MeshData::default();
    for i in 0..rows {
        for j in 0..columns {
            let height = |i: usize, j: usize| file.heights[i][j];
            mesh.positions.push((corner + DVec3::new(j as f64, height(i, j), i as f64) * step).as_vec3());
            let (left, right) = (j.saturating_sub(1), (j + 1).min(columns - 1));
            let (back, front) = (i.saturating_sub(1), (i + 1).min(rows - 1));
            let slope_x = (height(i, right) - height(i, left)) / ((right - left) as f64 * step.x);
            let slope_z = (height(front, j) - height(back, j)) / ((front - back) as f64 * step.z);
            mesh.normals.push(DVec3::new(-slope_x, 1.0, -slope_z).normalize().as_vec3());
            let uv = DVec3::new(j as f64, 0.0, i as f64) * step;
            mesh.uvs.push(Vec2::new(uv.x as f32, uv.z as f32));
            if i + 1 < rows && j + 1 < columns {
                let at = (i * columns + j) as u32;
                let below = at + columns as u32;
                mesh.triangles.extend([[at, below, at + 1], [at + 1, below, below + 1]]);
            }
        }
    }
    mesh
}

impl<'f> Compiler<'f> {
    pub(super) fn box_sides(&mut self, file: &BoxFile, object: ObjectId, to_world: DAffine3, pointer: &str) {
        for side in sides(file) {
            let outline = side.map(|p| to_world.transform_point3(p).as_vec3()).to_vec();
            self.polygon_of(vec![outline], object, pointer);
        }
    }

    fn polygon_of(&mut self, outlines: Vec<Vec<Vec3>>, object: ObjectId, pointer: &str) {
        if let Err(error) = self.geometry.polygon(object, &outlines) {
            self.issues.add(pointer, IssueCode::Degenerate, error.to_string());
        }
    }

    /// A shape that is made of triangles; `None` if it is wrong, which has then been noted.
    pub(super) fn mesh_of(&mut self, shape: &ShapeFile, pointer: &str) -> Option<MeshData> {
        match shape {
            ShapeFile::Mesh(mesh) => {
                self.meshes.load(mesh, pointer, self.issues).map(|mesh| mesh.as_ref().clone())
            }
            ShapeFile::Heightfield(file) => {
                let columns = file.heights.first().map_or(0, Vec::len);
                if let Some(row) = file.heights.iter().position(|row| row.len() != columns) {
                    let message = format!("the first row has {columns} heights, this has another number");
                    self.issues.add(format!("{pointer}/heights/{row}"), IssueCode::WrongLength, message);
                    return None;
                }
                Some(heightfield(file))
            }
            ShapeFile::Sphere(_)
            | ShapeFile::Polygon(_)
            | ShapeFile::Disk(_)
            | ShapeFile::Cylinder(_)
            | ShapeFile::Box(_)
            | ShapeFile::Instance(_) => None,
        }
    }

    /// Adds a shape made of triangles: by itself, or if there are instances of it as the first of them.
    pub(super) fn add_mesh(&mut self, shape: &ShapeFile, index: usize, object: ObjectId) {
        if self.originals.instanced.contains(&index) {
            if let Some(shared) = self.shared_mesh(shape, index) {
                self.geometry.instance(object, shared, DAffine3::IDENTITY);
            }
        } else if let Some(mesh) = self.mesh_of(shape, &format!("/objects/{index}")) {
            self.geometry.mesh(object, &mesh);
        }
    }

    fn shared_mesh(&mut self, shape: &ShapeFile, index: usize) -> Option<SharedMeshId> {
        if let Some(known) = self.originals.shared.get(&index) {
            return *known;
        }
        let mesh = self.mesh_of(shape, &format!("/objects/{index}"));
        let shared = mesh.map(|mesh| self.geometry.share(&mesh));
        self.originals.shared.insert(index, shared);
        shared
    }

    /// Adds an instance of another object.
    pub(super) fn instance(&mut self, file: &InstanceFile, object: ObjectId, pointer: &str) {
        let refuse = |compiler: &mut Self, code, message: String| {
            compiler.issues.add(format!("{pointer}/of"), code, message);
        };
        let (index, original) = match self.originals.by_name.get(file.of.as_str()) {
            Some(Some(original)) => *original,
            Some(None) => {
                let message = format!("more than one object has the name `{}`", file.of);
                return refuse(self, IssueCode::ConflictingFields, message);
            }
            None => {
                let message = format!("there is no object `{}`", file.of);
                return refuse(self, IssueCode::UnknownReference, message);
            }
        };
        if matches!(original.shape, ShapeFile::Instance(_)) {
            let message = "an instance cannot be of another instance: name its original".to_owned();
            return refuse(self, IssueCode::ConflictingFields, message);
        }
        let placed = Placed { file, object, pointer, to_world: transform(file) };
        let before = self.geometry.count();
        self.place(&original.shape, index, &placed);
        let Bounds { min, max } = self.geometry.bounds_after(before);
        let farthest = f64::from(min.abs().max(max.abs()).max_element());
        if self.geometry.count() > before && (farthest > MAX_LENGTH || farthest.is_nan()) {
            let message = format!("this would be farther than {MAX_LENGTH:e} m from the origin");
            self.issues.add(pointer, IssueCode::OutOfRange, message);
        }
    }

    fn place(&mut self, shape: &ShapeFile, index: usize, placed: &Placed<'_>) {
        let Placed { object, to_world, pointer, .. } = *placed;
        let point = |p: [f64; 3]| to_world.transform_point3(DVec3::from(p)).as_vec3();
        match shape {
            ShapeFile::Mesh(_) | ShapeFile::Heightfield(_) => {
                if let Some(shared) = self.shared_mesh(shape, index) {
                    self.geometry.instance(object, shared, to_world);
                }
            }
            ShapeFile::Box(file) => self.box_sides(file, object, to_world, pointer),
            ShapeFile::Polygon(file) => {
                let outlines = std::iter::once(&file.vertices).chain(&file.holes);
                let outlines = outlines.map(|o| o.iter().map(|p| point(*p)).collect()).collect();
                self.polygon_of(outlines, object, pointer);
            }
            ShapeFile::Sphere(file) => {
                if let Some(scale) = self.uniform_scale(placed) {
                    self.geometry.sphere(object, point(file.center), (file.radius * scale) as f32);
                }
            }
            ShapeFile::Disk(file) => {
                if let Some(scale) = self.uniform_scale(placed) {
                    let normal = to_world.transform_vector3(DVec3::from(file.normal).normalize() / scale);
                    self.geometry.disk(
                        object,
                        point(file.center),
                        normal.as_vec3(),
                        (file.radius * scale) as f32,
                    );
                }
            }
            ShapeFile::Cylinder(file) => {
                if let Some(scale) = self.uniform_scale(placed) {
                    let radius = (file.radius * scale) as f32;
                    self.geometry.cylinder(object, point(file.from), point(file.to), radius);
                }
            }
            ShapeFile::Instance(_) => {}
        }
    }

    /// The scale, if it is the same along all axes: round shapes stay round only then.
    fn uniform_scale(&mut self, placed: &Placed<'_>) -> Option<f64> {
        let scale = DVec3::from(placed.file.scale);
        if scale.max_element() - scale.min_element() <= UNIFORM * scale.max_element() {
            return Some(scale.x);
        }
        let message = format!("`{}` is round: it can only be scaled alike along all axes", placed.file.of);
        self.issues.add(format!("{}/scale", placed.pointer), IssueCode::ConflictingFields, message);
        None
    }
}

/// An instance and where it goes.
struct Placed<'a> {
    file: &'a InstanceFile,
    object: ObjectId,
    pointer: &'a str,
    to_world: DAffine3,
}

/// Scaled first, then turned, then moved.
pub(super) fn transform(file: &InstanceFile) -> DAffine3 {
    let turn = file.rotate.as_ref().map_or(DQuat::IDENTITY, |RotateFile { axis, angle }| {
        let half = 0.5 * angle.to_radians();
        let v = DVec3::from(*axis).normalize() * libm::sin(half);
        DQuat::from_xyzw(v.x, v.y, v.z, libm::cos(half))
    });
    DAffine3::from_scale_rotation_translation(
        DVec3::from(file.scale),
        turn.normalize(),
        DVec3::from(file.translate),
    )
}
