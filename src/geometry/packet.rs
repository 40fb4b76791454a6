//! Ray against triangles, without gaps at shared edges: eight at a time, and one by itself.
//!
//! The test of Woop, Benthin and Wald (*Watertight Ray/Triangle Intersection*, 2013): corners are moved into a
//! space in which the ray is the z axis, which gives the same numbers for every triangle that shares the corner,
//! and the signs of the three edge functions there are exact.

use super::bounds::Bounds;
use super::nearest::{Areas, Nearest, Place};
use super::simd::{Column, Lanes};
use super::{Ray, SurfacePoint, TextureCoordinates};
use glam::{Vec2, Vec3, Vec3A};

/// The corners of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Triangle(pub(super) [Vec3; 3]);

/// What is interpolated over a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TriangleShading {
    pub(super) normals: Option<[Vec3; 3]>,
    pub(super) uvs: [Vec2; 3],
}

impl TriangleShading {
    /// What a triangle without normals or texture coordinates has.
    pub(super) const FLAT: Self = Self { normals: None, uvs: [Vec2::ZERO, Vec2::X, Vec2::Y] };
}

/// A ray prepared for the test: the coordinate along which it runs most becomes z, and the other two are
/// sheared so that the ray is the z axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShearedRay {
    origin: Vec3,
    axes: [usize; 3],
    shear: Vec3,
}

impl ShearedRay {
    #[inline]
    pub(super) fn new(ray: &Ray) -> Self {
        /// The winding does not matter: both sides are hit.
        const AXES: [[usize; 3]; 4] = [[1, 2, 0], [2, 0, 1], [0, 1, 2], [0, 1, 2]];
        let d = ray.direction;
        let a = d.abs();
        // Without branches, which nothing could predict.
        let not_x = usize::from(a.x < a.y) | usize::from(a.x < a.z);
        let axes = AXES[not_x << usize::from(a.y < a.z)];
        let d = d.to_array();
        let shear = Vec3A::new(d[axes[0]], d[axes[1]], 1.0) / d[axes[2]];
        Self { origin: ray.origin, axes, shear: shear.into() }
    }

    /// A corner in the sheared space.
    #[inline]
    fn transform(&self, corner: Vec3) -> Vec3 {
        let p = (corner - self.origin).to_array();
        let [x, y, z] = [p[self.axes[0]], p[self.axes[1]], p[self.axes[2]]];
        Vec3::new(x - self.shear.x * z, y - self.shear.y * z, self.shear.z * z)
    }
}

impl Triangle {
    /// Distance along the ray in `(0, t_max)` and what the barycentric weights of the three corners follow from.
    #[inline(always)]
    pub(super) fn intersect(&self, ray: &ShearedRay, t_max: f32) -> Option<(f32, Areas)> {
        let [a, b, c] = self.0.map(|corner| ray.transform(corner));
        let mut u = c.x * b.y - c.y * b.x;
        let mut v = a.x * c.y - a.y * c.x;
        let mut w = b.x * a.y - b.y * a.x;
        if u == 0.0 || v == 0.0 || w == 0.0 {
            // On an edge in f32: decide in f64, where the products are exact.
            let exact =
                |p: Vec3, q: Vec3| (f64::from(p.x) * f64::from(q.y) - f64::from(p.y) * f64::from(q.x)) as f32;
            (u, v, w) = (exact(c, b), exact(a, c), exact(b, a));
        }
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        // A triangle seen from its edge has determinant 0 and a distance that is not a number.
        let t = (u * a.z + v * b.z + w * c.z) / determinant;
        (t > 0.0 && t < t_max).then(|| (t, Areas(Vec3::new(u, v, w))))
    }

    /// The surface at the point with these barycentric weights.
    #[inline(always)]
    pub(super) fn surface(&self, weights: Vec3, shading: &TriangleShading) -> SurfacePoint {
        let [a, b, c] = self.0;
        let point = a * weights.x + b * weights.y + c * weights.z;
        let size = (a * weights.x).abs() + (b * weights.y).abs() + (c * weights.z).abs();
        let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
        let shading_normal = match shading.normals {
            None => normal,
            Some([p, q, r]) => {
                let n = (p * weights.x + q * weights.y + r * weights.z).normalize_or(normal);
                // Vertex normals decide which side is outside only together with the winding.
                if n.dot(normal) < 0.0 { -n } else { n }
            }
        };
        let [p, q, r] = shading.uvs;
        SurfacePoint {
            point,
            // Seven rounded operations (gamma_7), half an ulp each.
            error: size.max_element() * (3.5 * f32::EPSILON),
            normal,
            shading_normal,
            texture: TextureCoordinates::Uv(p * weights.x + q * weights.y + r * weights.z),
        }
    }

    pub(super) fn bounds(&self) -> Bounds {
        Bounds::of(self.0).padded()
    }
}

/// Up to eight triangles in columns.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(super) struct Packet {
    /// `corners[k][axis]`: one coordinate of corner `k`; NaN in lanes that hold no triangle.
    corners: [[Column; 3]; 3],
    /// Number of the primitive in each lane.
    primitives: [u32; 8],
}

/// A sheared ray in every lane.
pub(super) struct LaneRay<L: Lanes> {
    origin: [L::F; 3],
    axes: [usize; 3],
    shear: [L::F; 3],
}

impl<L: Lanes> LaneRay<L> {
    #[inline(always)]
    pub(super) fn new(lanes: L, ray: &ShearedRay) -> Self {
        // As an array: a vector picks a component by branches.
        let origin = ray.origin.to_array();
        let [x, y, z] = ray.axes;
        Self {
            origin: [lanes.splat(origin[x]), lanes.splat(origin[y]), lanes.splat(origin[z])],
            axes: ray.axes,
            shear: [lanes.splat(ray.shear.x), lanes.splat(ray.shear.y), lanes.splat(ray.shear.z)],
        }
    }

    /// [`ShearedRay::transform`] of eight corners.
    #[inline(always)]
    fn transform(&self, lanes: L, corner: &[Column; 3]) -> [L::F; 3] {
        let [x, y, z] = self.axes;
        let x = lanes.sub(lanes.load(&corner[x % 3]), self.origin[0]);
        let y = lanes.sub(lanes.load(&corner[y % 3]), self.origin[1]);
        let z = lanes.sub(lanes.load(&corner[z % 3]), self.origin[2]);
        [
            lanes.sub(x, lanes.mul(self.shear[0], z)),
            lanes.sub(y, lanes.mul(self.shear[1], z)),
            lanes.mul(self.shear[2], z),
        ]
    }
}

/// What eight tests say.
struct Tested<F> {
    /// Lanes that are certainly hit, at a positive distance.
    hit: u32,
    /// Lanes whose edge the ray may touch: decided one by one in f64.
    edge: u32,
    /// Distances.
    t: F,
    /// [`Areas`] of the lanes.
    areas: (F, F, F),
}

impl Packet {
    /// Puts up to eight triangles with their numbers into one packet.
    pub(super) fn new(triangles: impl IntoIterator<Item = (u32, Triangle)>) -> Self {
        let mut packet = Self { corners: [[[f32::NAN; 8]; 3]; 3], primitives: [u32::MAX; 8] };
        for (lane, (primitive, Triangle(corners))) in triangles.into_iter().enumerate() {
            for (columns, corner) in packet.corners.iter_mut().zip(corners) {
                for (axis, column) in columns.iter_mut().enumerate() {
                    column[lane] = corner[axis];
                }
            }
            packet.primitives[lane] = primitive;
        }
        packet
    }

    /// The number in each lane.
    pub(super) fn primitives(&self) -> [u32; 8] {
        self.primitives
    }

    #[inline]
    pub(super) fn triangle(&self, lane: usize) -> Triangle {
        // By reference: moved, the columns are copied whole.
        let corner = |[x, y, z]: &[Column; 3]| Vec3::new(x[lane], y[lane], z[lane]);
        Triangle([corner(&self.corners[0]), corner(&self.corners[1]), corner(&self.corners[2])])
    }

    /// Finds the nearest hit among its triangles; `index` is its own place.
    #[inline(always)]
    pub(super) fn closest<L: Lanes>(
        &self,
        lanes: L,
        (ray, sheared): (&LaneRay<L>, &ShearedRay),
        index: usize,
        nearest: &mut Nearest,
    ) {
        let Tested { hit, edge, t, areas } = self.test(lanes, ray);
        let mut hit = hit & lanes.at_most(t, lanes.splat(nearest.t));
        if hit | edge == 0 {
            return;
        }
        let place = |lane: usize| Place::Triangle((index * 8 + lane) as u32);
        let t = lanes.store(t);
        let (u, v, w) = (lanes.store(areas.0), lanes.store(areas.1), lanes.store(areas.2));
        while hit != 0 {
            let lane = hit.trailing_zeros() as usize % 8;
            hit &= hit - 1;
            let areas = Areas(Vec3::new(u[lane], v[lane], w[lane]));
            nearest.offer(t[lane], self.primitives[lane], place(lane), areas);
        }
        if edge != 0 {
            self.closest_of(edge, sheared, index, nearest);
        }
    }

    /// Finds the nearest hit among some of its triangles one by one. Rays through edges are rare: this stays out of
    /// the walk, whose registers it would take.
    #[cold]
    #[inline(never)]
    fn closest_of(&self, lanes: u32, sheared: &ShearedRay, index: usize, nearest: &mut Nearest) {
        let among = (0..8).filter(|lane| lanes >> lane & 1 != 0);
        among.for_each(|lane| self.closest_in(lane, sheared, index, nearest));
    }

    #[inline]
    fn closest_in(&self, lane: usize, ray: &ShearedRay, index: usize, nearest: &mut Nearest) {
        if let Some((t, areas)) = self.triangle(lane).intersect(ray, nearest.limit()) {
            nearest.offer(t, self.primitives[lane], Place::Triangle((index * 8 + lane) as u32), areas);
        }
    }

    /// True if any of its triangles is hit before `t_max`.
    #[inline(always)]
    pub(super) fn any<L: Lanes>(
        &self,
        lanes: L,
        (ray, sheared): (&LaneRay<L>, &ShearedRay),
        t_max: f32,
    ) -> bool {
        let Tested { hit, edge, t, .. } = self.test(lanes, ray);
        if hit & lanes.less(t, lanes.splat(t_max)) != 0 {
            return true;
        }
        edge != 0 && self.any_of(edge, sheared, t_max)
    }

    /// True if any of some of its triangles is hit before `t_max`, as in [`Packet::closest_of`].
    #[cold]
    #[inline(never)]
    fn any_of(&self, lanes: u32, sheared: &ShearedRay, t_max: f32) -> bool {
        (0..8).any(|lane| lanes >> lane & 1 != 0 && self.triangle(lane).intersect(sheared, t_max).is_some())
    }

    /// [`Packet::closest`] without the instructions for eight at a time.
    pub(super) fn closest_one_by_one(&self, ray: &ShearedRay, index: usize, nearest: &mut Nearest) {
        (0..8).for_each(|lane| self.closest_in(lane, ray, index, nearest));
    }

    /// [`Packet::any`] without the instructions for eight at a time.
    pub(super) fn any_one_by_one(&self, ray: &ShearedRay, t_max: f32) -> bool {
        (0..8).any(|lane| self.triangle(lane).intersect(ray, t_max).is_some())
    }

    /// [`Triangle::intersect`] in every lane, operation by operation. An edge function that is not 0 in f32 has
    /// the right sign, since rounding keeps the order of the two products.
    #[inline(always)]
    fn test<L: Lanes>(&self, lanes: L, ray: &LaneRay<L>) -> Tested<L::F> {
        let a = ray.transform(lanes, &self.corners[0]);
        let b = ray.transform(lanes, &self.corners[1]);
        let c = ray.transform(lanes, &self.corners[2]);
        let u = edge_function(lanes, c, b);
        let v = edge_function(lanes, a, c);
        let w = edge_function(lanes, b, a);
        let zero = lanes.splat(0.0);
        let least = lanes.min(lanes.min(u, v), w);
        let most = lanes.max(lanes.max(u, v), w);
        let inside = !(lanes.less(least, zero) & lanes.less(zero, most)) & 0xff;
        if inside == 0 {
            return Tested { hit: 0, edge: 0, t: zero, areas: (zero, zero, zero) };
        }
        let edge = inside & (lanes.equal(least, zero) | lanes.equal(most, zero));
        let determinant = lanes.add(lanes.add(u, v), w);
        let weighted = lanes.add(lanes.add(lanes.mul(u, a[2]), lanes.mul(v, b[2])), lanes.mul(w, c[2]));
        let t = lanes.div(weighted, determinant);
        Tested { hit: inside & !edge & lanes.less(zero, t), edge, t, areas: (u, v, w) }
    }
}

#[inline(always)]
fn edge_function<L: Lanes>(lanes: L, p: [L::F; 3], q: [L::F; 3]) -> L::F {
    lanes.sub(lanes.mul(p[0], q[1]), lanes.mul(p[1], q[0]))
}
