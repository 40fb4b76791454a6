//! Surfaces, and how a ray finds the nearest of them.

mod accel;
mod bounds;
mod mesh;
mod polygon;
mod ray;
mod sphere;

pub use bounds::Bounds;
pub use mesh::MeshData;
pub use polygon::PolygonError;
pub use ray::{Ray, offset_origin};
pub use sphere::roots as sphere_roots;

use crate::scene::ObjectId;
use accel::Accel;
use glam::{Vec2, Vec3};
use mesh::{ShearedRay, Triangle, TriangleShading};
use polygon::{Edge, Polygon};
use sphere::Sphere;

/// All primitives of a scene and the structure over them.
#[derive(Debug)]
pub struct Geometry {
    spheres: Vec<Sphere>,
    polygons: Vec<Polygon>,
    edges: Vec<Edge>,
    triangles: Vec<Triangle>,
    shading: Vec<TriangleShading>,
    /// What the structure's slots hold, in its order.
    primitives: Vec<Primitive>,
    /// Box of each object; empty for an object without primitives.
    object_bounds: Vec<Bounds>,
    accel: Accel,
}

/// One thing a ray can hit.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Primitive {
    shape: Shape,
    object: ObjectId,
}

/// A primitive's kind and its index in that kind's array.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Sphere(u32),
    Polygon(u32),
    Triangle(u32),
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
    /// Texture coordinates.
    pub uv: Vec2,
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

/// The nearest primitive and what its test has computed.
struct Nearest {
    slot: usize,
    t: f32,
    weights: Vec3,
}

impl Geometry {
    /// The first surface along the ray.
    #[must_use]
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let sheared = ShearedRay::new(ray);
        let mut nearest: Option<Nearest> = None;
        self.accel.closest(ray, |slot, t_max| {
            let (t, weights) = self.intersect(slot, ray, &sheared, t_max)?;
            nearest = Some(Nearest { slot, t, weights });
            Some(t)
        });
        let nearest = nearest?;
        let Primitive { shape, object } = self.primitives[nearest.slot];
        let surface = match shape {
            Shape::Sphere(i) => self.spheres[i as usize].surface(ray, nearest.t),
            Shape::Polygon(i) => self.polygons[i as usize].surface(ray, nearest.t),
            Shape::Triangle(i) => {
                self.triangles[i as usize].surface(nearest.weights, &self.shading[i as usize])
            }
        };
        Some(Hit { t: nearest.t, surface, object, sheet: self.sheet(shape, object) })
    }

    /// True if any surface lies strictly between the ray's origin and the distance `t_max`.
    #[must_use]
    pub fn any_hit(&self, ray: &Ray, t_max: f32) -> bool {
        let sheared = ShearedRay::new(ray);
        self.accel.any(ray, t_max, |slot| self.intersect(slot, ray, &sheared, t_max).is_some())
    }

    #[inline]
    fn intersect(&self, slot: usize, ray: &Ray, sheared: &ShearedRay, t_max: f32) -> Option<(f32, Vec3)> {
        match self.primitives[slot].shape {
            Shape::Triangle(i) => self.triangles[i as usize].intersect(sheared, t_max),
            Shape::Polygon(i) => {
                self.polygons[i as usize].intersect(ray, t_max, &self.edges).map(|t| (t, Vec3::ZERO))
            }
            Shape::Sphere(i) => self.spheres[i as usize].intersect(ray, t_max).map(|t| (t, Vec3::ZERO)),
        }
    }

    /// Polygons are sheets of their own, since each clips the kernel at its own outline; an object's
    /// triangles form one sheet, and a sphere is one.
    fn sheet(&self, shape: Shape, object: ObjectId) -> SheetId {
        match shape {
            Shape::Polygon(i) => SheetId(i),
            Shape::Sphere(_) | Shape::Triangle(_) => SheetId(self.polygons.len() as u32 + object.0),
        }
    }

    /// Share of the density estimate's kernel around `point` that lies on the sheet (1 where unknown).
    #[must_use]
    pub fn kernel_mass(&self, sheet: SheetId, point: Vec3, radius: f32) -> f32 {
        self.polygons.get(sheet.0 as usize).map_or(1.0, |p| p.kernel_mass(point, radius, &self.edges))
    }

    /// Box of one object.
    #[must_use]
    pub fn object_bounds(&self, object: ObjectId) -> Bounds {
        self.object_bounds.get(object.index()).copied().unwrap_or(Bounds::EMPTY)
    }

    /// Points and spheres whose convex hull holds the object.
    #[must_use]
    pub fn hull(&self, object: ObjectId) -> Vec<HullPoint> {
        let mut hull = Vec::new();
        for primitive in self.primitives.iter().filter(|p| p.object == object) {
            match primitive.shape {
                Shape::Sphere(i) => {
                    let Sphere { center, radius } = self.spheres[i as usize];
                    hull.push(HullPoint { position: center, radius });
                }
                Shape::Polygon(i) => hull.extend(self.polygons[i as usize].corners().iter().map(point)),
                Shape::Triangle(i) => hull.extend(self.triangles[i as usize].0.iter().map(point)),
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
        self.primitives.len()
    }

    /// The structure a ray is tested against, in words.
    #[must_use]
    pub fn structure(&self) -> &'static str {
        self.accel.name()
    }

    /// Bytes held by the primitives and the structure.
    #[must_use]
    pub fn memory_bytes(&self) -> u64 {
        let arrays = size_of_val(&self.spheres[..])
            + size_of_val(&self.polygons[..])
            + size_of_val(&self.edges[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.shading[..])
            + size_of_val(&self.primitives[..]);
        arrays as u64 + self.accel.memory_bytes()
    }
}

/// Collects primitives; [`GeometryBuilder::build`] makes the structure over them.
#[derive(Debug, Default)]
pub struct GeometryBuilder {
    spheres: Vec<Sphere>,
    polygons: Vec<Polygon>,
    edges: Vec<Edge>,
    triangles: Vec<Triangle>,
    shading: Vec<TriangleShading>,
    primitives: Vec<Primitive>,
}

impl GeometryBuilder {
    /// Adds a sphere. The radius is positive.
    pub fn sphere(&mut self, object: ObjectId, center: Vec3, radius: f32) {
        let shape = Shape::Sphere(self.spheres.len() as u32);
        self.spheres.push(Sphere { center, radius });
        self.primitives.push(Primitive { shape, object });
    }

    /// Adds a planar polygon: an outline and the outlines of its holes, by the even-odd rule.
    ///
    /// # Errors
    /// See [`PolygonError`]; nothing is added then.
    pub fn polygon(&mut self, object: ObjectId, outlines: &[Vec<Vec3>]) -> Result<(), PolygonError> {
        let polygon = Polygon::new(outlines, &mut self.edges)?;
        let shape = Shape::Polygon(self.polygons.len() as u32);
        self.polygons.push(polygon);
        self.primitives.push(Primitive { shape, object });
        Ok(())
    }

    /// Adds a triangle mesh. Indices are in range.
    pub fn mesh(&mut self, object: ObjectId, mesh: &MeshData) {
        for &indices in &mesh.triangles {
            let shape = Shape::Triangle(self.triangles.len() as u32);
            let corner = |k: usize| indices[k] as usize;
            self.triangles.push(Triangle(std::array::from_fn(|k| mesh.positions[corner(k)])));
            let normals =
                (!mesh.normals.is_empty()).then(|| std::array::from_fn(|k| mesh.normals[corner(k)]));
            let uvs = if mesh.uvs.is_empty() {
                [Vec2::ZERO, Vec2::X, Vec2::Y]
            } else {
                std::array::from_fn(|k| mesh.uvs[corner(k)])
            };
            self.shading.push(TriangleShading { normals, uvs });
            self.primitives.push(Primitive { shape, object });
        }
    }

    /// Builds the structure over all primitives.
    #[must_use]
    pub fn build(self) -> Geometry {
        let bounds: Vec<Bounds> = self.primitives.iter().map(|p| self.bounds_of(p.shape)).collect();
        let objects = self.primitives.iter().map(|p| p.object.index() + 1).max().unwrap_or(0);
        let mut object_bounds = vec![Bounds::EMPTY; objects];
        for (primitive, b) in self.primitives.iter().zip(&bounds) {
            let whole = &mut object_bounds[primitive.object.index()];
            *whole = whole.union(*b);
        }
        let (accel, order) = Accel::build(&bounds);
        let mut geometry = Geometry {
            spheres: self.spheres,
            polygons: self.polygons,
            edges: self.edges,
            triangles: Vec::new(),
            shading: Vec::new(),
            primitives: order.iter().map(|&i| self.primitives[i as usize]).collect(),
            object_bounds,
            accel,
        };
        // Triangles are laid out in the order in which the structure visits them.
        for primitive in &mut geometry.primitives {
            if let Shape::Triangle(i) = &mut primitive.shape {
                geometry.triangles.push(self.triangles[*i as usize]);
                geometry.shading.push(self.shading[*i as usize]);
                *i = geometry.triangles.len() as u32 - 1;
            }
        }
        geometry
    }

    fn bounds_of(&self, shape: Shape) -> Bounds {
        match shape {
            Shape::Sphere(i) => self.spheres[i as usize].bounds(),
            Shape::Polygon(i) => self.polygons[i as usize].bounds(),
            Shape::Triangle(i) => self.triangles[i as usize].bounds(),
        }
    }
}
