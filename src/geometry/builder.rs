//! Collects the primitives of a scene.

use super::accel::{Accel, Structure};
use super::disk::{Cylinder, Disk};
use super::instance::{Instance, SharedMesh};
use super::leaves::{Primitives, Shape, Source};
use super::mesh::{Mesh, MeshData};
use super::motion::Motion;
use super::moving::{Moving, swept_bounds};
use super::polygon::{Edge, Polygon, PolygonError};
use super::sphere::Sphere;
use super::{Bounds, Geometry, Owner};
use crate::scene::ObjectId;
use glam::{DAffine3, Vec3};
use std::sync::Arc;

/// A mesh that instances place into the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SharedMeshId(u32);

/// Collects primitives; [`GeometryBuilder::build`] makes the structure over them.
#[derive(Debug, Default)]
pub struct GeometryBuilder {
    spheres: Vec<Sphere>,
    polygons: Vec<Polygon>,
    edges: Vec<Edge>,
    disks: Vec<Disk>,
    cylinders: Vec<Cylinder>,
    instances: Vec<Instance>,
    shared: Vec<Arc<SharedMesh>>,
    moving: Vec<Part>,
    primitives: Primitives,
    owners: Vec<Owner>,
}

/// Primitives that move together, before their structure is built.
#[derive(Debug)]
struct Part {
    builder: GeometryBuilder,
    motion: Motion,
    /// Box over the whole time.
    bounds: Bounds,
}

impl GeometryBuilder {
    /// A builder of primitives that move together; it knows the meshes that this one shares.
    #[must_use]
    pub fn part(&self) -> Self {
        Self { shared: self.shared.clone(), ..Self::default() }
    }

    /// Adds what was put into a [`GeometryBuilder::part`] of this as one object that moves. Meshes shared there are
    /// shared here from now on.
    pub fn moving(&mut self, object: ObjectId, mut part: Self, motion: Motion) {
        self.shared.clone_from(&part.shared);
        part.owners.iter_mut().for_each(|owner| owner.object = ObjectId(0));
        let bounds = swept_bounds(part.bounds_after(0), &motion);
        self.moving.push(Part { builder: part, motion, bounds });
        self.other(object, Shape::Moving(self.moving.len() as u32 - 1));
    }

    /// Adds a sphere. The radius is positive.
    pub fn sphere(&mut self, object: ObjectId, center: Vec3, radius: f32) {
        let shape = Shape::Sphere(self.spheres.len() as u32);
        self.spheres.push(Sphere { center, radius });
        self.other(object, shape);
    }

    /// Adds a planar polygon: an outline and the outlines of its holes, by the even-odd rule.
    ///
    /// # Errors
    /// See [`PolygonError`]; nothing is added then.
    pub fn polygon(&mut self, object: ObjectId, outlines: &[Vec<Vec3>]) -> Result<(), PolygonError> {
        let polygon = Polygon::new(outlines, &mut self.edges)?;
        let shape = Shape::Polygon(self.polygons.len() as u32);
        self.polygons.push(polygon);
        self.other(object, shape);
        Ok(())
    }

    /// Adds a disk. The normal has a direction and the radius is positive.
    pub fn disk(&mut self, object: ObjectId, center: Vec3, normal: Vec3, radius: f32) {
        self.disks.push(Disk::new(center, normal, radius));
        self.other(object, Shape::Disk(self.disks.len() as u32 - 1));
    }

    /// Adds an open cylinder around the line between two points. The radius is positive.
    pub fn cylinder(&mut self, object: ObjectId, from: Vec3, to: Vec3, radius: f32) {
        self.cylinders.push(Cylinder::new(from, to, radius));
        self.other(object, Shape::Cylinder(self.cylinders.len() as u32 - 1));
    }

    /// Keeps a mesh for instances; by itself it is not in the scene. Indices are in range.
    pub fn share(&mut self, mesh: &MeshData) -> SharedMeshId {
        self.shared.push(Arc::new(SharedMesh::new(mesh)));
        SharedMeshId(self.shared.len() as u32 - 1)
    }

    /// Adds a shared mesh in one place. The transform can be inverted.
    pub fn instance(&mut self, object: ObjectId, mesh: SharedMeshId, to_world: DAffine3) {
        self.instances.push(Instance::new(mesh.0, to_world));
        self.other(object, Shape::Instance(self.instances.len() as u32 - 1));
    }

    /// Adds a triangle mesh. Indices are in range.
    pub fn mesh(&mut self, object: ObjectId, mesh: &MeshData) {
        let index = self.primitives.meshes.len() as u32;
        let first = self.primitives.sources.len() as u32;
        self.owners.push(Owner { first, object, mesh: Some(index) });
        let triangles = 0..mesh.triangles.len() as u32;
        self.primitives.sources.extend(triangles.map(|i| Source::Triangle { mesh: index, index: i }));
        self.primitives.meshes.push(Mesh::new(mesh));
    }

    /// Number of primitives so far.
    #[must_use]
    pub fn count(&self) -> usize {
        self.primitives.sources.len()
    }

    /// Box of the primitives after the first `count`.
    #[must_use]
    pub fn bounds_after(&self, count: usize) -> Bounds {
        let sources = self.primitives.sources.iter().skip(count);
        sources.fold(Bounds::EMPTY, |all, source| all.union(self.bounds_of(*source)))
    }

    fn other(&mut self, object: ObjectId, shape: Shape) {
        let owner = Owner { first: self.primitives.sources.len() as u32, object, mesh: None };
        if self.owners.last().is_none_or(|last| (last.object, last.mesh) != (object, None)) {
            self.owners.push(owner);
        }
        self.primitives.sources.push(Source::Other(shape));
    }

    /// Builds the structure that suits the primitives.
    #[must_use]
    pub fn build(self) -> Geometry {
        self.build_as(Structure::Auto)
    }

    /// Builds a structure over all primitives.
    #[must_use]
    pub fn build_as(mut self, structure: Structure) -> Geometry {
        let sources = &self.primitives.sources;
        let bounds: Vec<Bounds> = sources.iter().map(|source| self.bounds_of(*source)).collect();
        let objects = self.owners.iter().map(|owner| owner.object.index() + 1).max().unwrap_or(0);
        let mut object_bounds = vec![Bounds::EMPTY; objects];
        let ends = self.owners.iter().skip(1).map(|next| next.first as usize).chain([sources.len()]);
        for (owner, end) in self.owners.iter().zip(ends) {
            let whole = &mut object_bounds[owner.object.index()];
            *whole = bounds[owner.first as usize..end].iter().fold(*whole, |a, b| a.union(*b));
        }
        let (accel, leaves) = Accel::build(structure, &bounds, &self.primitives);
        self.primitives.meshes.iter_mut().for_each(Mesh::settle);
        let parts = std::mem::take(&mut self.moving);
        let mut geometry = Geometry {
            spheres: self.spheres,
            polygons: self.polygons,
            edges: self.edges,
            disks: self.disks,
            cylinders: self.cylinders,
            instances: self.instances,
            shared: self.shared,
            meshes: self.primitives.meshes,
            moving: Vec::new(),
            leaves,
            owners: self.owners,
            count: self.primitives.sources.len(),
            object_bounds,
            accel,
            asked: structure,
        };
        let mut first_sheet = geometry.sheet_count();
        for Part { builder, motion, bounds } in parts {
            let moving = Moving::new(builder.build_as(structure), motion, bounds, first_sheet);
            first_sheet = moving.end_of_sheets();
            geometry.moving.push(moving);
        }
        geometry
    }

    fn bounds_of(&self, source: Source) -> Bounds {
        match source {
            Source::Triangle { mesh, index } => {
                self.primitives.meshes[mesh as usize].triangle(index).bounds()
            }
            Source::Other(Shape::Sphere(i)) => self.spheres[i as usize].bounds(),
            Source::Other(Shape::Polygon(i)) => self.polygons[i as usize].bounds(),
            Source::Other(Shape::Disk(i)) => self.disks[i as usize].bounds(),
            Source::Other(Shape::Cylinder(i)) => self.cylinders[i as usize].bounds(),
            Source::Other(Shape::Instance(i)) => self.instances[i as usize].bounds(&self.shared),
            Source::Other(Shape::Moving(i)) => self.moving[i as usize].bounds,
        }
    }
}
