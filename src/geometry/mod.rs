//! Surfaces, and how a ray finds the nearest of them.

mod accel;
mod bounds;
mod builder;
mod bvh;
mod disk;
mod grid;
mod instance;
mod leaves;
mod mesh;
mod motion;
mod moving;
mod nearest;
mod packet;
mod polygon;
mod ray;
mod sheets;
mod simd;
mod sphere;
mod sphere_tree;

pub use accel::Structure;
pub use bounds::Bounds;
pub use builder::{GeometryBuilder, SharedMeshId};
pub use mesh::MeshData;
pub use motion::{Motion, Turn};
pub use polygon::PolygonError;
pub use ray::{Ray, offset_distance, offset_origin};
pub use sphere::sphere_roots;

use crate::scene::ObjectId;
use accel::Accel;
use disk::{Cylinder, Disk};
use glam::{Vec2, Vec3};
use instance::{Instance, SharedMesh};
use leaves::{Child, Entry, Leaves, Run, Shape, Word};
use mesh::Mesh;
use moving::Moving;
use nearest::{Areas, Nearest, Place};
use packet::ShearedRay;
use polygon::{Edge, Polygon};
use ray::WideRay;
use sphere::Sphere;
use std::sync::Arc;

/// How far computed hits may lie off their primitive, as a multiple of the rounding of the largest coordinate
/// in the frame of the ray: three for the corners' place across the ray, nine for the distance along it, and
/// some more for the box test itself. Boxes are grown by this much, so none that holds a hit is missed.
const HIT_ROUNDING: f32 = 16.0 * f32::EPSILON;

/// All primitives of a scene and the structure over them.
#[derive(Debug)]
pub struct Geometry {
    spheres: Vec<Sphere>,
    polygons: Vec<Polygon>,
    edges: Vec<Edge>,
    disks: Vec<Disk>,
    cylinders: Vec<Cylinder>,
    instances: Vec<Instance>,
    shared: Vec<Arc<SharedMesh>>,
    meshes: Vec<Mesh>,
    moving: Vec<Moving>,
    /// The primitives in the order of the structure.
    leaves: Leaves,
    /// Whose each primitive is, in the order of their numbers.
    owners: Vec<Owner>,
    /// Number of primitives.
    count: usize,
    /// Box of each object; empty for an object without primitives.
    object_bounds: Vec<Bounds>,
    accel: Accel,
    /// The structure that was asked for.
    asked: Structure,
}

/// Primitives with successive numbers that belong to one object; triangles also to one mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Owner {
    first: u32,
    object: ObjectId,
    /// The triangles' mesh; `None` for other primitives.
    mesh: Option<u32>,
}

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Position.
    pub point: Vec3,
    /// Bound on how far each coordinate of `point` is from the true surface.
    pub error: f32,
    /// Unit geometric normal, on the outer side.
    pub normal: Vec3,
    /// Unit interpolated normal, on the same side.
    pub shading_normal: Vec3,
    /// Where that is on a texture.
    pub texture: TextureCoordinates,
}

/// Texture coordinates: of a sphere only once a texture asks for them, as they take arc functions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TextureCoordinates {
    /// Known.
    Uv(Vec2),
    /// Those of the point of a sphere with this unit normal.
    OnSphere(Vec3),
}

impl TextureCoordinates {
    /// The coordinates.
    #[must_use]
    pub fn uv(self) -> Vec2 {
        match self {
            Self::Uv(uv) => uv,
            Self::OnSphere(normal) => sphere::sphere_uv(normal),
        }
    }
}

/// Where a ray first meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray.
    pub t: f32,
    /// The point of the surface.
    pub surface: SurfacePoint,
    /// The object it belongs to.
    pub object: ObjectId,
    /// The flat piece or closed surface it lies on: photons are gathered from the same one only.
    pub sheet: SheetId,
}

/// A point, or a sphere around it, of an object's hull.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HullPoint {
    /// Its position.
    pub position: Vec3,
    /// Radius of the sphere; 0 for a point.
    pub radius: f32,
}

fn point(position: &Vec3) -> HullPoint {
    HullPoint { position: *position, radius: 0.0 }
}

/// Names a polygon, a sphere or a mesh as one sheet of surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SheetId(pub u32);

impl Geometry {
    /// The first surface along the ray.
    #[must_use]
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let mut nearest = Nearest::NONE;
        self.find_nearest(ray, &mut nearest);
        self.hit(ray, &nearest)
    }

    /// Finds a hit nearer than `nearest`.
    #[inline]
    fn find_nearest(&self, ray: &Ray, nearest: &mut Nearest) {
        let others = |run: Run, nearest: &mut Nearest| self.closest_of_run(run, ray, nearest);
        match &self.accel {
            Accel::List(words) => self.closest_of_list(words, ray, nearest),
            Accel::Bvh(bvh) => bvh.closest(&self.leaves, ray, nearest, others),
            Accel::Grid(grid) => {
                let sheared = ShearedRay::new(ray);
                grid.closest(ray, nearest, |place, nearest| {
                    self.closest_of_place(place, ray, &sheared, nearest);
                })
            }
            Accel::Spheres(tree) => {
                let sheared = ShearedRay::new(ray);
                tree.closest(ray, nearest, |place, nearest| {
                    self.closest_of_place(place, ray, &sheared, nearest);
                })
            }
        }
    }

    /// What is hit there.
    #[inline]
    fn hit(&self, ray: &Ray, nearest: &Nearest) -> Option<Hit> {
        // The place is not copied: a copy of the whole would wait for its parts.
        let slot = match nearest.place {
            None => return None,
            Some(Place::Triangle(slot)) => slot,
            Some(place) => return self.other_hit(ray, nearest, place),
        };
        let owner = self.owner(nearest.primitive);
        let shading = self.meshes[owner.mesh? as usize].shading(nearest.primitive - owner.first);
        let surface = self.leaves.triangle(slot).surface(nearest.areas.weights(), &shading);
        Some(Hit {
            t: nearest.t,
            surface,
            object: owner.object,
            sheet: self.sheet(Place::Triangle(slot), owner.object),
        })
    }

    /// What is hit of a primitive that is not a triangle of the scene itself.
    #[inline(never)]
    fn other_hit(&self, ray: &Ray, nearest: &Nearest, place: Place) -> Option<Hit> {
        let object = self.owner(nearest.primitive).object;
        let (Place::Entry(entry) | Place::Instance(entry, _)) = place else { return None };
        let surface = match (self.leaves.entries[entry as usize].shape, place) {
            (Shape::Sphere(i), _) => self.spheres[i as usize].surface(ray, nearest.t),
            (Shape::Polygon(i), _) => self.polygons[i as usize].surface(ray, nearest.t),
            (Shape::Disk(i), _) => self.disks[i as usize].surface(ray),
            (Shape::Cylinder(i), _) => self.cylinders[i as usize].surface(ray),
            (Shape::Moving(i), _) => {
                let hit = self.moving[i as usize].hit(ray, nearest.t)?;
                return Some(Hit { object, ..hit });
            }
            (Shape::Instance(i), Place::Instance(_, slot)) => {
                self.instances[i as usize].surface(slot, nearest.areas, &self.shared)
            }
            (Shape::Instance(_), Place::Entry(_) | Place::Triangle(_)) => return None,
        };
        Some(Hit { t: nearest.t, surface, object, sheet: self.sheet(place, object) })
    }

    /// True if any surface lies strictly between the ray's origin and the distance `t_max`.
    #[must_use]
    pub fn any_hit(&self, ray: &Ray, t_max: f32) -> bool {
        let others = |run: Run| self.any_of_run(run, ray, t_max);
        match &self.accel {
            Accel::List(words) => self.any_of_list(words, ray, t_max),
            Accel::Bvh(bvh) => bvh.any(&self.leaves, ray, t_max, others),
            Accel::Grid(grid) => {
                let sheared = ShearedRay::new(ray);
                grid.any(ray, t_max, |place| self.place_meets(place, ray, &sheared, t_max))
            }
            Accel::Spheres(tree) => {
                let sheared = ShearedRay::new(ray);
                tree.any(ray, t_max, |place| self.place_meets(place, ray, &sheared, t_max))
            }
        }
    }

    fn closest_of_place(&self, place: Place, ray: &Ray, sheared: &ShearedRay, nearest: &mut Nearest) {
        match place {
            Place::Triangle(slot) => {
                let hit = self.leaves.triangle(slot).intersect(sheared, nearest.limit());
                hit.into_iter()
                    .for_each(|(t, areas)| nearest.offer(t, self.leaves.number(slot), place, areas));
            }
            Place::Entry(entry) | Place::Instance(entry, _) => {
                self.closest_of_run(Run { first: entry as usize, count: 1 }, ray, nearest);
            }
        }
    }

    fn place_meets(&self, place: Place, ray: &Ray, sheared: &ShearedRay, t_max: f32) -> bool {
        match place {
            Place::Triangle(slot) => self.leaves.triangle(slot).intersect(sheared, t_max).is_some(),
            Place::Entry(entry) | Place::Instance(entry, _) => {
                self.any_of_run(Run { first: entry as usize, count: 1 }, ray, t_max)
            }
        }
    }

    fn closest_of_list(&self, words: &[Word], ray: &Ray, nearest: &mut Nearest) {
        for word in words {
            match word.child() {
                Child::Packet(index) => {
                    self.leaves.packets[index].closest_one_by_one(&ShearedRay::new(ray), index, nearest)
                }
                Child::Run(run) => self.closest_of_run(run, ray, nearest),
                Child::Node(_) => {}
            }
        }
    }

    fn any_of_list(&self, words: &[Word], ray: &Ray, t_max: f32) -> bool {
        words.iter().any(|word| match word.child() {
            Child::Packet(index) => self.leaves.packets[index].any_one_by_one(&ShearedRay::new(ray), t_max),
            Child::Run(run) => self.any_of_run(run, ray, t_max),
            Child::Node(_) => false,
        })
    }

    #[inline]
    fn closest_of_run(&self, run: Run, ray: &Ray, nearest: &mut Nearest) {
        let wide = WideRay::new(ray);
        for (index, entry) in self.entries(run) {
            let (t_max, index, mut areas) = (nearest.limit(), index as u32, Areas::NONE);
            let (hit, place) = match entry.shape {
                Shape::Sphere(i) => (self.spheres[i as usize].intersect(&wide, t_max), Place::Entry(index)),
                Shape::Polygon(i) => {
                    (self.polygons[i as usize].intersect(&wide, t_max, &self.edges), Place::Entry(index))
                }
                Shape::Disk(i) => (self.disks[i as usize].intersect(ray, t_max), Place::Entry(index)),
                Shape::Cylinder(i) => (self.cylinders[i as usize].intersect(ray, t_max), Place::Entry(index)),
                Shape::Moving(i) => (self.moving[i as usize].intersect(ray, t_max), Place::Entry(index)),
                Shape::Instance(i) => {
                    let hit = self.instances[i as usize].intersect(ray, t_max, &self.shared);
                    areas = hit.map_or(areas, |(_, _, areas)| areas);
                    (hit.map(|(t, ..)| t), Place::Instance(index, hit.map_or(0, |(_, slot, _)| slot)))
                }
            };
            if let Some(t) = hit {
                nearest.offer(t, entry.primitive, place, areas);
            }
        }
    }

    #[inline]
    fn entries(&self, run: Run) -> impl Iterator<Item = (usize, &Entry)> {
        (run.first..).zip(&self.leaves.entries[run.first..run.first + run.count])
    }

    #[inline]
    fn any_of_run(&self, run: Run, ray: &Ray, t_max: f32) -> bool {
        let wide = WideRay::new(ray);
        self.entries(run).any(|(_, entry)| match entry.shape {
            Shape::Polygon(i) => self.polygons[i as usize].intersect(&wide, t_max, &self.edges).is_some(),
            Shape::Sphere(i) => self.spheres[i as usize].intersect(&wide, t_max).is_some(),
            Shape::Disk(i) => self.disks[i as usize].intersect(ray, t_max).is_some(),
            Shape::Cylinder(i) => self.cylinders[i as usize].intersect(ray, t_max).is_some(),
            Shape::Instance(i) => self.instances[i as usize].any(ray, t_max, &self.shared),
            Shape::Moving(i) => self.moving[i as usize].any(ray, t_max),
        })
    }

    /// The owner of a primitive.
    fn owner(&self, primitive: u32) -> Owner {
        let after = self.owners.partition_point(|owner| owner.first <= primitive);
        self.owners[after - 1]
    }

    /// Box of one object, over the whole time that the shutter is open.
    #[must_use]
    pub fn object_bounds(&self, object: ObjectId) -> Bounds {
        self.object_bounds.get(object.index()).copied().unwrap_or(Bounds::EMPTY)
    }

    /// Points and spheres whose convex hull holds the object while the shutter is open.
    #[must_use]
    pub fn hull(&self, object: ObjectId) -> Vec<HullPoint> {
        let mut hull = Vec::new();
        for entry in self.leaves.entries.iter().filter(|e| self.owner(e.primitive).object == object) {
            match entry.shape {
                Shape::Sphere(i) => {
                    let Sphere { center, radius } = self.spheres[i as usize];
                    hull.push(HullPoint { position: center, radius });
                }
                Shape::Polygon(i) => hull.extend(self.polygons[i as usize].corners().iter().map(point)),
                Shape::Disk(i) => hull.extend(self.disks[i as usize].hull()),
                Shape::Cylinder(i) => hull.extend(self.cylinders[i as usize].hull()),
                Shape::Instance(i) => hull.extend(self.instances[i as usize].hull(&self.shared)),
                Shape::Moving(i) => hull.extend(self.moving[i as usize].hull()),
            }
        }
        for owner in self.owners.iter().filter(|o| o.object == object) {
            if let Some(mesh) = owner.mesh {
                hull.extend(self.meshes[mesh as usize].vertices().iter().map(point));
            }
        }
        hull
    }

    /// Box of everything.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.object_bounds.iter().fold(Bounds::EMPTY, |a, b| a.union(*b))
    }

    /// Number of primitives.
    #[must_use]
    pub fn primitive_count(&self) -> usize {
        // Each thing that moves is one primitive of the structure.
        self.count - self.moving.len() + self.moving.iter().map(Moving::primitive_count).sum::<usize>()
    }

    /// True if anything moves while the shutter is open.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.moving.iter().any(Moving::moves)
    }

    /// True if the ray may meet, before `t_max`, something that moves, at any time; false is certain.
    #[must_use]
    pub fn may_meet_moving(&self, ray: &Ray, t_max: f32) -> bool {
        self.moving.iter().any(|moving| moving.moves() && moving.bounds().may_meet(ray, t_max))
    }

    /// The structure a ray is tested against, in words.
    #[must_use]
    pub fn structure(&self) -> &'static str {
        self.accel.name()
    }

    /// Why this structure, or what came of it.
    #[must_use]
    pub fn structure_reason(&self) -> String {
        self.accel.reason(self.asked, self.count)
    }

    /// Bytes held by the primitives and the structure.
    #[must_use]
    pub fn memory_bytes(&self) -> u64 {
        let shared = self.shared.iter().map(|mesh| mesh.memory_bytes()).sum::<usize>();
        (shared + self.own_memory_bytes()) as u64
    }

    /// Without the meshes that instances share.
    fn own_memory_bytes(&self) -> usize {
        let arrays = size_of_val(&self.spheres[..])
            + size_of_val(&self.polygons[..])
            + size_of_val(&self.edges[..])
            + size_of_val(&self.disks[..])
            + size_of_val(&self.cylinders[..])
            + size_of_val(&self.instances[..])
            + self.moving.iter().map(Moving::memory_bytes).sum::<usize>()
            + size_of_val(&self.owners[..])
            + self.meshes.iter().map(Mesh::memory_bytes).sum::<usize>();
        arrays + self.leaves.memory_bytes() + self.accel.memory_bytes()
    }
}
