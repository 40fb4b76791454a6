//! Objects with an emission: they become lights, and their surface tells which.

use super::super::file::ObjectFile;
use super::super::issue::IssueCode;
use super::super::shape_file::{PolygonFile, ShapeFile};
use super::super::{DiskLight, Light, LightId, MeshLight, ObjectId, SphereLight};
use super::shape::{sides, transform};
use super::{Compiler, vec3};
use crate::geometry::Motion;
use glam::{DAffine3, DVec2, DVec3, Vec3};

impl Compiler<'_> {
    /// Makes an object a light if it has an emission. Its shape has been added before, moving or at rest.
    pub(super) fn emission(
        &mut self,
        id: ObjectId,
        object: &ObjectFile,
        motion: Option<Motion>,
        index: usize,
    ) {
        let Some(radiance) = object.emission.map(vec3) else {
            if object.group.is_some() {
                let message = "an object without `emission` is no light: it has no light group";
                self.issues.add(format!("/objects/{index}/group"), IssueCode::ConflictingFields, message);
            }
            return;
        };
        let material = self.objects[id.index()].material;
        // Its light would have to begin on both sides at once.
        if self.materials.get(material.index()).is_some_and(|material| material.dielectric().is_some()) {
            let message = "what lets light through cannot emit: give the object an opaque material";
            self.issues.add(format!("/objects/{index}/emission"), IssueCode::ConflictingFields, message);
            return;
        }
        if self.issues.count() > 0 {
            return;
        }
        let Some(light) = self.emitter(&object.shape, radiance, index) else { return };
        let light = match motion {
            Some(motion) => MeshLight::moving(light, motion),
            None => light,
        };
        self.objects[id.index()].emitter = Some(LightId(self.lights.len() as u32));
        self.light_places.push(format!("/objects/{index}/emission"));
        self.lights.push(light);
        let group = self.light_group(object.group.as_deref(), &format!("/objects/{index}"));
        self.light_groups.of_light.push(group);
    }

    /// The light of a shape; `None` if the shape is wrong, which has then been noted.
    fn emitter(&mut self, shape: &ShapeFile, radiance: Vec3, index: usize) -> Option<Light> {
        match shape {
            ShapeFile::Instance(instance) => {
                let (of, original) = self.originals.find(&instance.of)?;
                // Round shapes are scaled alike along all axes, or have been refused.
                let place = Place { to_world: transform(instance), scale: instance.scale[0], index: of };
                self.emitter_at(&original.shape, radiance, &place)
            }
            ShapeFile::Sphere(_)
            | ShapeFile::Polygon(_)
            | ShapeFile::Mesh(_)
            | ShapeFile::Disk(_)
            | ShapeFile::Cylinder(_)
            | ShapeFile::Box(_)
            | ShapeFile::Heightfield(_) => {
                self.emitter_at(shape, radiance, &Place { to_world: DAffine3::IDENTITY, scale: 1.0, index })
            }
        }
    }

    fn emitter_at(&mut self, shape: &ShapeFile, radiance: Vec3, place: &Place) -> Option<Light> {
        let point = |p: [f64; 3]| place.to_world.transform_point3(DVec3::from(p));
        Some(match shape {
            ShapeFile::Sphere(sphere) => Light::Sphere(SphereLight {
                center: point(sphere.center).as_vec3(),
                radius: (sphere.radius * place.scale) as f32,
                radiance,
            }),
            ShapeFile::Disk(disk) => Light::Disk(DiskLight {
                center: point(disk.center).as_vec3(),
                radius: (disk.radius * place.scale) as f32,
                normal: place.to_world.transform_vector3(DVec3::from(disk.normal)).normalize().as_vec3(),
                radiance,
            }),
            ShapeFile::Cylinder(file) => {
                let (from, to) = (point(file.from), point(file.to));
                Light::Mesh(MeshLight::cylinder(radiance, from, to, file.radius * place.scale))
            }
            ShapeFile::Polygon(polygon) => {
                let ring = |ring: &Vec<[f64; 3]>| ring.iter().map(|p| point(*p).to_array()).collect();
                let vertices = ring(&polygon.vertices);
                let holes = polygon.holes.iter().map(ring).collect();
                Light::Mesh(MeshLight::new(radiance, triangles(&PolygonFile { vertices, holes })))
            }
            ShapeFile::Box(file) => {
                let halves = |[a, b, c, d]: [DVec3; 4]| [[a, b, c], [a, c, d]];
                let corners = sides(file).into_iter().flat_map(halves);
                let corners = corners.map(|t| t.map(|p| point(p.to_array()).as_vec3()));
                Light::Mesh(MeshLight::new(radiance, corners))
            }
            ShapeFile::Mesh(_) | ShapeFile::Heightfield(_) => {
                let mesh = self.mesh_of(shape, &format!("/objects/{}", place.index))?;
                let at =
                    |v: u32| place.to_world.transform_point3(mesh.positions[v as usize].as_dvec3()).as_vec3();
                Light::Mesh(MeshLight::new(radiance, mesh.triangles.iter().map(|t| t.map(at))))
            }
            // An instance of an instance has been refused.
            ShapeFile::Instance(_) => return None,
        })
    }
}

/// Where an emitter is put.
struct Place {
    to_world: DAffine3,
    scale: f64,
    /// The index of the object whose shape it has.
    index: usize,
}

/// A side of an outline, projected; `low` is below `high`.
#[derive(Clone, Copy)]
struct Side {
    low: DVec2,
    high: DVec2,
}

impl Side {
    fn x_at(&self, y: f64) -> f64 {
        self.low.x + (self.high.x - self.low.x) * ((y - self.low.y) / (self.high.y - self.low.y))
    }
}

/// Cuts a polygon with holes, by the even-odd rule, into triangles: slabs between the heights of its corners
/// and of the crossings of its sides hold nothing but trapezoids.
fn triangles(polygon: &PolygonFile) -> Vec<[Vec3; 3]> {
    let outline: Vec<DVec3> = polygon.vertices.iter().map(|v| DVec3::from(*v)).collect();
    let Some(&origin) = outline.first() else { return Vec::new() };
    let spokes = || outline.iter().map(|p| *p - origin);
    let normal = spokes().zip(spokes().skip(1)).map(|(a, b)| a.cross(b)).sum::<DVec3>().normalize_or_zero();
    let (x, y) = normal.any_orthonormal_pair();
    let flat = |v: &[f64; 3]| {
        let p = DVec3::from(*v) - origin;
        DVec2::new(p.dot(x), p.dot(y))
    };
    let sides: Vec<Side> = std::iter::once(&polygon.vertices)
        .chain(&polygon.holes)
        .flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)))
        .map(|(a, b)| (flat(a), flat(b)))
        .map(|(a, b)| if a.y < b.y { Side { low: a, high: b } } else { Side { low: b, high: a } })
        .filter(|side| side.low.y < side.high.y)
        .collect();
    let heights = heights(&sides);
    let lift = |p: DVec2| (origin + x * p.x + y * p.y).as_vec3();
    let mut triangles = Vec::new();
    for slab in heights.windows(2) {
        let (low, high) = (slab[0], slab[1]);
        let middle = 0.5 * (low + high);
        let mut cut: Vec<&Side> = sides.iter().filter(|s| s.low.y < middle && middle < s.high.y).collect();
        cut.sort_by(|a, b| a.x_at(middle).total_cmp(&b.x_at(middle)));
        for pair in cut.chunks_exact(2) {
            let at = |side: &Side, y: f64| DVec2::new(side.x_at(y), y);
            let [a, b] = [at(pair[0], low), at(pair[1], low)];
            let [c, d] = [at(pair[1], high), at(pair[0], high)];
            triangles.push([a, b, c].map(lift));
            triangles.push([a, c, d].map(lift));
        }
    }
    triangles
}

/// Heights of all corners and crossings, in order.
fn heights(sides: &[Side]) -> Vec<f64> {
    let mut heights: Vec<f64> = sides.iter().flat_map(|s| [s.low.y, s.high.y]).collect();
    for (i, a) in sides.iter().enumerate() {
        for b in &sides[i + 1..] {
            let (along_a, along_b) = (a.high - a.low, b.high - b.low);
            let cross = along_a.perp_dot(along_b);
            let s = (b.low - a.low).perp_dot(along_b) / cross;
            let t = (b.low - a.low).perp_dot(along_a) / cross;
            if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
                heights.push(a.low.y + along_a.y * s);
            }
        }
    }
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    heights
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(vertices: &[[f64; 2]], holes: &[&[[f64; 2]]]) -> f64 {
        let ring = |r: &[[f64; 2]]| r.iter().map(|&[x, z]| [x, 2.0, -z]).collect::<Vec<_>>();
        let polygon =
            PolygonFile { vertices: ring(vertices), holes: holes.iter().map(|h| ring(h)).collect() };
        let pieces = triangles(&polygon);
        for [a, b, c] in &pieces {
            let normal = (*b - *a).cross(*c - *a);
            assert!(normal.y >= 0.0, "emits upwards, as the outline faces: {normal}");
        }
        f64::from(MeshLight::new(Vec3::ONE, pieces).area())
    }

    #[test]
    fn concave_outlines_holes_and_stars_are_cut_into_their_area() {
        let u: &[[f64; 2]] =
            &[[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [2.0, 3.0], [2.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
        assert!((area(u, &[]) - 7.0).abs() < 1e-5);
        let square: &[[f64; 2]] = &[[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]];
        let hole: &[[f64; 2]] = &[[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]];
        assert!((area(square, &[hole]) - 8.0).abs() < 1e-5);
        // Two triangles that touch in the crossing; the larger gives the outline its sense.
        let crossed: &[[f64; 2]] = &[[0.0, 0.0], [2.0, 0.0], [0.5, 3.0], [1.5, 3.0]];
        // The sides cross at height 2: triangles of base 2, height 2 and base 1, height 1.
        assert!((area(crossed, &[]) - 2.5).abs() < 1e-5);
    }
}
