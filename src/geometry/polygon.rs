//! Ray against planar polygon: the even-odd rule with half-open edges, so that polygons that share an edge
//! neither overlap nor leave a gap.

use super::bounds::Bounds;
use super::ray::WideRay;
use super::{Ray, SurfacePoint, TextureCoordinates};
use glam::{DVec2, DVec3, Vec2, Vec3};

/// A planar polygon, concave or with holes. Its corners, projected along the normal's largest component,
/// are a range of the scene's array of [`Edge`]s.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Polygon {
    /// Unit normal by the right-hand rule over the outline.
    normal: DVec3,
    /// The plane is `normal · p = offset`.
    offset: f64,
    /// Which two coordinates span the projection.
    axes: [usize; 2],
    /// First corner of the outline: origin of the texture coordinates.
    origin: DVec3,
    /// Unit vector along the first edge: direction of u.
    along: DVec3,
    /// Range of the polygon's edges.
    edges: std::ops::Range<u32>,
    bounds: Bounds,
    /// Corners of the outline.
    corners: Vec<Vec3>,
}

/// One edge of a polygon, projected. It is the same one for all polygons that share it, so that they agree on which side
/// of it a point lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Edge {
    /// The lower end.
    low: DVec2,
    high: DVec2,
    /// How far it goes across per height.
    slope: f64,
}

impl Edge {
    fn new(a: DVec2, b: DVec2) -> Self {
        let (low, high) = if a.y < b.y { (a, b) } else { (b, a) };
        Self { low, high, slope: (high.x - low.x) / (high.y - low.y) }
    }
}

/// What is wrong with a polygon.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PolygonError {
    /// Fewer than three corners.
    #[error("an outline needs at least 3 vertices, not {0}")]
    TooFewVertices(usize),
    /// No area, so no normal.
    #[error("the polygon has no area")]
    NoArea,
    /// The corners do not lie in a plane.
    #[error("vertex {vertex} is {distance:.3e} away from the plane of the polygon")]
    NotPlanar {
        /// Index of the worst corner, counted through all outlines.
        vertex: usize,
        /// Its distance from the plane.
        distance: f64,
    },
}

/// How far a corner may lie off the plane, as a fraction of the polygon's size: the rounding of corners
/// given in f32 or with seven decimal digits, with room to spare.
const PLANARITY: f64 = 1e-5;

impl Polygon {
    /// Makes a polygon of an outline and the outlines of its holes, and appends its edges to `edges`.
    ///
    /// # Errors
    /// See [`PolygonError`].
    pub(super) fn new(outlines: &[Vec<Vec3>], edges: &mut Vec<Edge>) -> Result<Self, PolygonError> {
        let plane = Plane::of(outlines)?;
        let first = edges.len() as u32;
        for outline in outlines {
            for (i, a) in outline.iter().enumerate() {
                let b = outline[(i + 1) % outline.len()];
                edges.push(Edge::new(plane.project(*a), plane.project(b)));
            }
        }
        let outline = &outlines[0];
        let origin = outline[0].as_dvec3();
        let along = outline.iter().map(|p| p.as_dvec3() - origin).find_map(DVec3::try_normalize);
        Ok(Self {
            normal: plane.normal,
            offset: plane.offset,
            axes: plane.axes,
            origin,
            along: along.unwrap_or(DVec3::X),
            edges: first..edges.len() as u32,
            corners: outline.clone(),
            bounds: Bounds::of(outlines.iter().flatten().copied()).padded(),
        })
    }

    /// Distance along the ray in `(0, t_max)`; a ray in the polygon's own plane misses.
    #[inline]
    pub(super) fn intersect(&self, ray: &WideRay, t_max: f32, edges: &[Edge]) -> Option<f32> {
        let t = self.plane_distance(ray)?;
        if !(t > 0.0 && (t as f32) < t_max) {
            return None;
        }
        let p = ray.at(t);
        self.contains(DVec2::new(p[self.axes[0]], p[self.axes[1]]), edges).then_some(t as f32)
    }

    #[inline]
    fn plane_distance(&self, ray: &WideRay) -> Option<f64> {
        let t = (self.offset - self.normal.dot(ray.origin)) / self.normal.dot(ray.direction);
        // Parallel rays give an infinite or undefined distance.
        t.is_finite().then_some(t)
    }

    /// Even-odd rule; an edge counts if exactly its upper end lies strictly above the point.
    #[inline]
    fn contains(&self, p: DVec2, edges: &[Edge]) -> bool {
        let mut inside = false;
        for edge in &edges[self.edges.start as usize..self.edges.end as usize] {
            let x = edge.low.x + (p.y - edge.low.y) * edge.slope;
            inside ^= (edge.low.y <= p.y) & (p.y < edge.high.y) & (p.x < x);
        }
        inside
    }

    pub(super) fn surface(&self, ray: &Ray, t: f32) -> SurfacePoint {
        let ray = WideRay::new(ray);
        let p = ray.at(self.plane_distance(&ray).unwrap_or(f64::from(t)));
        let p = p - self.normal * (self.normal.dot(p) - self.offset);
        let local = p - self.origin;
        let across = self.normal.cross(self.along);
        let point = p.as_vec3();
        let normal = self.normal.as_vec3();
        SurfacePoint {
            point,
            // Half an ulp per coordinate from rounding to f32; doubled for the plane's own rounding.
            error: point.abs().max_element() * f32::EPSILON,
            normal,
            shading_normal: normal,
            texture: TextureCoordinates::Uv(Vec2::new(
                local.dot(self.along) as f32,
                local.dot(across) as f32,
            )),
        }
    }

    pub(super) fn corners(&self) -> &[Vec3] {
        &self.corners
    }

    pub(super) fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Share of a disc kernel around a point of the polygon that lies on the polygon, for the Epanechnikov
    /// kernel of radius `radius`: the kernel is divided by it, so that light is not lost at borders.
    ///
    /// Exact for one straight edge within reach; for two edges the shares are multiplied, which is exact at
    /// a right-angled corner's apex to 10 %.
    pub(super) fn kernel_mass(&self, point: Vec3, radius: f32, edges: &[Edge]) -> f32 {
        let p = point.as_dvec3();
        let dropped = 3 - self.axes[0] - self.axes[1];
        let projected = DVec2::new(p[self.axes[0]], p[self.axes[1]]);
        // An edge's distance in the projection is at most its distance in space.
        let reach = f64::from(radius);
        let mut mass = 1.0;
        for edge in &edges[self.edges.start as usize..self.edges.end as usize] {
            let low = edge.low.min(edge.high) - reach;
            let high = edge.low.max(edge.high) + reach;
            if projected.cmplt(low).any() || projected.cmpgt(high).any() {
                continue;
            }
            let from = self.lift(edge.low, dropped);
            let to = self.lift(edge.high, dropped);
            let s = ((p - from).dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
            let distance = (p - from.lerp(to, s)).length();
            if distance < reach {
                mass *= epanechnikov_half_plane(distance / reach);
            }
        }
        // A sliver narrower than the kernel cannot be trusted to less than a quarter of it.
        mass.max(0.25) as f32
    }

    fn lift(&self, p: DVec2, dropped: usize) -> DVec3 {
        let mut q = DVec3::ZERO;
        q[self.axes[0]] = p.x;
        q[self.axes[1]] = p.y;
        q[dropped] = (self.offset - self.normal.dot(q)) / self.normal[dropped];
        q
    }
}

/// Mass of the 2-D Epanechnikov kernel of radius 1 on the side of a line at distance `s` that holds its
/// centre: 1/2 + ∫₀ˢ (8/3π)(1-x²)^{3/2} dx.
pub(super) fn epanechnikov_half_plane(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    let root = (1.0 - s * s).sqrt();
    let integral = (s * root * (5.0 - 2.0 * s * s) + 3.0 * libm::asin(s)) / 8.0;
    0.5 + integral * 8.0 / (3.0 * std::f64::consts::PI)
}

/// The plane of a polygon and the projection along its largest component.
struct Plane {
    normal: DVec3,
    offset: f64,
    axes: [usize; 2],
}

impl Plane {
    /// Newell's normal of the outline.
    fn of(outlines: &[Vec<Vec3>]) -> Result<Self, PolygonError> {
        let outline = outlines.first().ok_or(PolygonError::TooFewVertices(0))?;
        if let Some(short) = outlines.iter().find(|o| o.len() < 3) {
            return Err(PolygonError::TooFewVertices(short.len()));
        }
        let base = outline[0].as_dvec3();
        let doubled_area: DVec3 = (1..outline.len() - 1)
            .map(|i| (outline[i].as_dvec3() - base).cross(outline[i + 1].as_dvec3() - base))
            .sum();
        let size = outline.iter().map(|p| (p.as_dvec3() - base).length()).fold(0.0, f64::max);
        // Less area than the rounding of the corners can make.
        if doubled_area.length() <= size * size * 1e-9 || !doubled_area.is_finite() {
            return Err(PolygonError::NoArea);
        }
        let normal = doubled_area.normalize();
        let count = outline.len() as f64;
        let offset = outline.iter().map(|p| normal.dot(p.as_dvec3())).sum::<f64>() / count;
        // Corners far from the origin are rounded more coarsely.
        let farthest = outline.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
        let tolerance = PLANARITY * size + 2.0 * f64::from(f32::EPSILON * farthest);
        for (vertex, p) in outlines.iter().flatten().enumerate() {
            let distance = (normal.dot(p.as_dvec3()) - offset).abs();
            if distance > tolerance {
                return Err(PolygonError::NotPlanar { vertex, distance });
            }
        }
        let size = normal.abs();
        let axes = if size.x >= size.y && size.x >= size.z {
            [1, 2]
        } else if size.y >= size.z {
            [0, 2]
        } else {
            [0, 1]
        };
        Ok(Self { normal, offset, axes })
    }

    fn project(&self, p: Vec3) -> DVec2 {
        DVec2::new(f64::from(p[self.axes[0]]), f64::from(p[self.axes[1]]))
    }
}
