//! A mesh in many places: its triangles and the hierarchy over them are kept once, and rays are moved into its
//! frame.

use super::bvh::Bvh;
use super::leaves::{Leaves, Primitives, Source};
use super::mesh::{Mesh, MeshData};
use super::nearest::{Areas, Nearest, Place};
use super::{Bounds, HullPoint, Ray, SurfacePoint};
use glam::{DAffine3, DMat3, Vec3};
use std::sync::Arc;

/// A mesh in its own frame.
#[derive(Debug)]
pub(super) struct SharedMesh {
    mesh: Mesh,
    leaves: Leaves,
    bvh: Bvh,
    bounds: Bounds,
}

impl SharedMesh {
    pub(super) fn new(data: &MeshData) -> Self {
        let sources = (0..data.triangles.len() as u32).map(|index| Source::Triangle { mesh: 0, index });
        let mut primitives = Primitives { sources: sources.collect(), meshes: vec![Mesh::new(data)] };
        let triangles = 0..data.triangles.len() as u32;
        let bounds: Vec<Bounds> = triangles.map(|i| primitives.meshes[0].triangle(i).bounds()).collect();
        let mut leaves = Leaves::default();
        let bvh = Bvh::build(&bounds, &primitives, &mut leaves);
        let mut mesh = primitives.meshes.pop().unwrap_or_default();
        mesh.settle();
        let bounds = bounds.iter().fold(Bounds::EMPTY, |a, b| a.union(*b));
        Self { mesh, leaves, bvh, bounds }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.mesh.memory_bytes() + self.leaves.memory_bytes() + self.bvh.memory_bytes()
    }
}

/// A shared mesh in one place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instance {
    /// Index of the shared mesh.
    pub(super) shared: u32,
    to_world: DAffine3,
    to_mesh: DAffine3,
    /// Turns normals into the world.
    normals: DMat3,
}

impl Instance {
    /// The transform can be inverted.
    pub(super) fn new(shared: u32, to_world: DAffine3) -> Self {
        let to_mesh = to_world.inverse();
        Self { shared, to_world, to_mesh, normals: to_mesh.matrix3.transpose() }
    }

    /// The ray in the mesh's frame; distances along it are the same numbers.
    #[inline]
    fn local(&self, ray: &Ray) -> Ray {
        Ray {
            origin: self.to_mesh.transform_point3(ray.origin.as_dvec3()).as_vec3(),
            direction: self.to_mesh.transform_vector3(ray.direction.as_dvec3()).as_vec3(),
            time: ray.time,
        }
    }

    /// Distance in `(0, t_max)`, slot and areas of the nearest triangle.
    #[inline]
    pub(super) fn intersect(
        &self,
        ray: &Ray,
        t_max: f32,
        meshes: &[Arc<SharedMesh>],
    ) -> Option<(f32, u32, Areas)> {
        let shared = &meshes[self.shared as usize];
        let mut nearest = Nearest::before(t_max);
        shared.bvh.closest(&shared.leaves, &self.local(ray), &mut nearest, |_, _| {});
        match nearest.place {
            Some(Place::Triangle(slot)) if nearest.t < t_max => Some((nearest.t, slot, nearest.areas)),
            _ => None,
        }
    }

    /// True if any triangle is hit before `t_max`.
    #[inline]
    pub(super) fn any(&self, ray: &Ray, t_max: f32, meshes: &[Arc<SharedMesh>]) -> bool {
        let shared = &meshes[self.shared as usize];
        shared.bvh.any(&shared.leaves, &self.local(ray), t_max, |_| false)
    }

    /// The surface where a ray that cuts the triangle in a slot into these areas meets it.
    pub(super) fn surface(&self, slot: u32, areas: Areas, meshes: &[Arc<SharedMesh>]) -> SurfacePoint {
        let shared = &meshes[self.shared as usize];
        let triangle = shared.leaves.triangle(slot);
        let local = triangle.surface(areas.weights(), &shared.mesh.shading(shared.leaves.number(slot)));
        placed(local, &self.to_world, &self.normals)
    }

    pub(super) fn bounds(&self, meshes: &[Arc<SharedMesh>]) -> Bounds {
        let local = meshes[self.shared as usize].bounds;
        if local.is_empty() {
            return Bounds::EMPTY;
        }
        let corners = local.corners();
        let world = Bounds::of(corners.map(|p| self.to_world.transform_point3(p.as_dvec3()).as_vec3()));
        // Rays are rounded in the mesh's frame, whose origin may be far from the mesh.
        let far = local.min.abs().max(local.max.abs()).max_element();
        let m = self.to_world.matrix3;
        let stretch = (m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs()).max_element() as f32;
        let pad = 4.0 * f32::EPSILON * far * stretch;
        Bounds::new(world.min - pad, world.max + pad).padded()
    }

    pub(super) fn hull(&self, meshes: &[Arc<SharedMesh>]) -> impl Iterator<Item = HullPoint> {
        let vertices = meshes[self.shared as usize].mesh.vertices().iter();
        vertices.map(|v| HullPoint {
            position: self.to_world.transform_point3(v.as_dvec3()).as_vec3(),
            radius: 0.0,
        })
    }
}

/// A point of a surface, taken from its own frame into the world; `normals` turns its normals.
pub(super) fn placed(local: SurfacePoint, to_world: &DAffine3, normals: &DMat3) -> SurfacePoint {
    let point = to_world.transform_point3(local.point.as_dvec3()).as_vec3();
    let m = to_world.matrix3;
    let stretch = (m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs()).max_element() as f32;
    let turned = |n: Vec3| (*normals * n.as_dvec3()).normalize_or(n.as_dvec3()).as_vec3();
    SurfacePoint {
        point,
        // What its own frame has, stretched, and rounding to f32.
        error: local.error * stretch + point.abs().max_element() * f32::EPSILON,
        normal: turned(local.normal),
        shading_normal: turned(local.shading_normal),
        ..local
    }
}
