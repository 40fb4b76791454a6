//! Warnings of what a scene hardly means: glass that is not closed, surfaces inside out, lights in walls.

use super::super::check::{Border, BorderKey, Warning, crossing, mesh_borders, signed_volume};
use super::super::file::ObjectFile;
use super::super::shape_file::{PolygonFile, ShapeFile};
use super::super::{Light, ObjectId, Scene};
use super::Compiler;
use super::shape::{heightfield, transform};
use crate::geometry::{MeshData, Ray};
use glam::{DAffine3, DVec3, Vec3};
use std::collections::HashMap;
use std::rc::Rc;

/// How far from its border, as a fraction of its size, a surface looks for what closes it.
const REACH: f32 = 0.01;

/// Directions in none of which a light within a closed object gets out: nearly along the axes, so that few openings
/// are overlooked, and none along an edge of what stands straight.
const DIRECTIONS: [Vec3; 8] = [
    Vec3::new(0.02, 0.9997, 0.015),
    Vec3::new(0.015, -0.9997, 0.02),
    Vec3::new(0.9997, 0.02, 0.015),
    Vec3::new(-0.9997, 0.015, 0.02),
    Vec3::new(0.015, 0.02, 0.9997),
    Vec3::new(0.02, 0.015, -0.9997),
    Vec3::new(0.36, 0.48, 0.8),
    Vec3::new(-0.6, -0.64, -0.48),
];

/// Surfaces that a ray is followed through, to find out what a light is in.
const MOST_LAYERS: usize = 64;

impl Compiler<'_> {
    /// Looks at what is in the scene, now that all of it is.
    pub(super) fn checks(&mut self, objects: &[Option<ObjectFile>], scene: &Scene) -> Vec<Warning> {
        let objects: Vec<&ObjectFile> = objects.iter().flatten().collect();
        let mut borders = Vec::new();
        for (index, object) in objects.iter().enumerate() {
            let pointer = format!("/objects/{index}");
            let glass = scene.material_of(ObjectId(index as u32)).dielectric().is_some();
            let (shape, to_world) = self.shape_of(object, &objects);
            if let ShapeFile::Polygon(polygon) = shape {
                self.check_crossing(polygon, &pointer);
            }
            let mesh = if glass || object.emission.is_some() { self.triangles_of(shape) } else { None };
            if let Some(mesh) = &mesh
                && signed_volume(mesh) < 0.0
                && mesh_borders(mesh, &DAffine3::IDENTITY).is_empty()
            {
                let message =
                    "its normals point inwards: its triangles must run anticlockwise seen from outside";
                self.warn("inward_normals", &pointer, message);
            }
            if glass {
                borders.push((index, borders_of(shape, mesh.as_deref(), &to_world)));
            }
        }
        self.check_borders(&borders, scene);
        self.check_lights(scene);
        std::mem::take(&mut self.warnings)
    }

    /// The shape of an object, that of its original for an instance, and where it is placed.
    fn shape_of<'o>(&self, object: &'o ObjectFile, all: &[&'o ObjectFile]) -> (&'o ShapeFile, DAffine3) {
        if let ShapeFile::Instance(instance) = &object.shape
            && let Some(index) = self.originals.index_of(&instance.of)
        {
            return (&all[index].shape, transform(instance));
        }
        (&object.shape, DAffine3::IDENTITY)
    }

    fn triangles_of(&mut self, shape: &ShapeFile) -> Option<Rc<MeshData>> {
        match shape {
            ShapeFile::Mesh(file) => self.meshes.again(file),
            ShapeFile::Heightfield(file) => Some(Rc::new(heightfield(file))),
            ShapeFile::Sphere(_)
            | ShapeFile::Polygon(_)
            | ShapeFile::Disk(_)
            | ShapeFile::Cylinder(_)
            | ShapeFile::Box(_)
            | ShapeFile::Instance(_) => None,
        }
    }

    fn check_crossing(&mut self, polygon: &PolygonFile, pointer: &str) {
        let outlines: Vec<&[[f64; 3]]> =
            std::iter::once(&polygon.vertices).chain(&polygon.holes).map(Vec::as_slice).collect();
        let Some([(outline, vertex), (other, end)]) = crossing(&outlines) else { return };
        let at = |outline: usize, vertex: usize| match outline.checked_sub(1) {
            None => format!("/vertices/{vertex}"),
            Some(hole) => format!("/holes/{hole}/{vertex}"),
        };
        let message = format!(
            "the edges from {} and {} cross: what lies within an even number of outlines is left out",
            at(outline, vertex),
            at(other, end)
        );
        self.warn("self_crossing_polygon", pointer, message);
    }

    /// Glass whose border neither meets that of other glass nor a surface that closes it.
    fn check_borders(&mut self, borders: &[(usize, Vec<Border>)], scene: &Scene) {
        let mut counts: HashMap<BorderKey, u32> = HashMap::new();
        for border in borders.iter().flat_map(|(_, borders)| borders) {
            *counts.entry(border.key).or_default() += 1;
        }
        for (index, borders) in borders {
            let own = ObjectId(*index as u32);
            let open = borders
                .iter()
                .filter(|border| counts.get(&border.key) == Some(&1))
                .any(|border| border.samples.iter().any(|sample| !ends_at_wall(scene, own, *sample)));
            if open {
                let message = "this glass is not closed: there is glass behind its front and air before it, and \
                               light that gets round its border never leaves; a pane has two faces";
                self.warn("open_dielectric", &format!("/objects/{index}"), message);
            }
        }
    }

    /// Lights without size that no light gets away from.
    fn check_lights(&mut self, scene: &Scene) {
        let places = std::mem::take(&mut self.light_places);
        for (light, pointer) in scene.lights.iter().zip(&places) {
            if light.is_dark() {
                self.warn("zero_power_light", pointer, "it gives no light");
            }
            let position = match light {
                Light::Point { position, .. } => *position,
                Light::Spot(spot) => spot.position,
                Light::Directional { .. }
                | Light::Quad(_)
                | Light::Disk(_)
                | Light::Sphere(_)
                | Light::Mesh(_) => continue,
            };
            if let Some(wall) = wall_around(scene, position) {
                let name = &scene.objects[wall.index()].name;
                let message = format!("it is inside `{name}`, which is opaque, or on its surface");
                self.warn("light_inside_wall", pointer, message);
            }
        }
    }
}

/// The border of a piece of glass by itself.
fn borders_of(shape: &ShapeFile, mesh: Option<&MeshData>, to_world: &DAffine3) -> Vec<Border> {
    let place = |p: [f64; 3]| to_world.transform_point3(DVec3::from(p));
    // Round shapes are scaled alike along all axes.
    let scale = to_world.matrix3.x_axis.length();
    match shape {
        ShapeFile::Sphere(_) | ShapeFile::Box(_) | ShapeFile::Instance(_) => Vec::new(),
        ShapeFile::Mesh(_) | ShapeFile::Heightfield(_) => {
            mesh.map_or_else(Vec::new, |mesh| mesh_borders(mesh, to_world))
        }
        ShapeFile::Polygon(file) => {
            let middle = file.vertices.iter().map(|v| place(*v)).sum::<DVec3>() / file.vertices.len() as f64;
            let edges = |outline: &Vec<[f64; 3]>| {
                let next = outline.iter().cycle().skip(1);
                let pairs = outline.iter().zip(next).map(|(a, b)| (place(*a), place(*b)));
                pairs.map(|(a, b)| Border::edge(a, b, middle)).collect::<Vec<_>>()
            };
            std::iter::once(&file.vertices).chain(&file.holes).flat_map(edges).collect()
        }
        ShapeFile::Disk(file) => {
            let normal = to_world.transform_vector3(DVec3::from(file.normal)).normalize_or(DVec3::Y);
            vec![Border::circle(place(file.center), normal, file.radius * scale, None)]
        }
        ShapeFile::Cylinder(file) => {
            let (from, to) = (place(file.from), place(file.to));
            let axis = (to - from).normalize_or(DVec3::Y);
            let radius = file.radius * scale;
            [(from, -axis), (to, axis)]
                .map(|(end, out)| Border::circle(end, axis, radius, Some(out)))
                .to_vec()
        }
    }
}

/// True if a surface that ends at a point meets another one there.
fn ends_at_wall(scene: &Scene, own: ObjectId, (point, outwards): (DVec3, DVec3)) -> bool {
    let reach = f64::from(REACH * scene.geometry.object_bounds(own).radius());
    let start = (point - outwards * reach).as_vec3();
    let mut ray = Ray::new(start, outwards.as_vec3());
    let mut left = 1.01 * reach as f32;
    for _ in 0..MOST_LAYERS {
        let Some(hit) = scene.geometry.closest_hit(&ray).filter(|hit| hit.t <= left) else { return false };
        if hit.object != own {
            return true;
        }
        left -= hit.t;
        ray = beyond(&ray, &hit);
    }
    false
}

fn beyond(ray: &Ray, hit: &crate::geometry::Hit) -> Ray {
    let surface = &hit.surface;
    let origin = crate::geometry::offset_origin(surface.point, surface.error, surface.normal, ray.direction);
    ray.continue_from(origin, ray.direction)
}

/// The opaque object that a point is in, while the camera is not, or on whose surface it lies to rounding.
fn wall_around(scene: &Scene, point: Vec3) -> Option<ObjectId> {
    let opaque = |object: ObjectId| scene.material_of(object).dielectric().is_none();
    let rounding =
        16.0 * f32::EPSILON * point.abs().max_element().max(1e-3 * scene.geometry.bounds().radius());
    for direction in DIRECTIONS.map(Vec3::normalize) {
        let ray = Ray::new(point - direction * rounding, direction);
        let on = scene.geometry.closest_hit(&ray).filter(|hit| hit.t <= 2.0 * rounding);
        if let Some(hit) = on.filter(|hit| opaque(hit.object)) {
            return Some(hit.object);
        }
    }
    let around = enclosing(scene, point);
    let seen = enclosing(scene, scene.camera.eye);
    around.into_iter().find(|object| opaque(*object) && !seen.contains(object))
}

/// Objects that every way out of a point crosses an odd number of times.
fn enclosing(scene: &Scene, point: Vec3) -> Vec<ObjectId> {
    let mut candidates: Option<Vec<ObjectId>> = None;
    for direction in DIRECTIONS.map(Vec3::normalize) {
        let mut crossed: Vec<ObjectId> = Vec::new();
        let mut ray = Ray::new(point, direction);
        for _ in 0..MOST_LAYERS {
            let Some(hit) = scene.geometry.closest_hit(&ray) else { break };
            match crossed.iter().position(|object| *object == hit.object) {
                Some(index) => _ = crossed.swap_remove(index),
                None => crossed.push(hit.object),
            }
            ray = beyond(&ray, &hit);
        }
        candidates = Some(match candidates {
            None => crossed,
            Some(before) => before.into_iter().filter(|object| crossed.contains(object)).collect(),
        });
        if candidates.as_ref().is_some_and(Vec::is_empty) {
            break;
        }
    }
    candidates.unwrap_or_default()
}
