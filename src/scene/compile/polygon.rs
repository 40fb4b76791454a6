//! Checks of polygons: planar, and with an area.

use super::super::file::PolygonFile;
use super::super::issue::{IssueCode, Issues};
use super::vec3;
use glam::{DVec3, Vec3};

/// Largest distance of a vertex from the plane, as a fraction of the polygon's extent.
const MAX_UNEVENNESS: f64 = 1e-4;
/// Least area, as a fraction of the squared extent: below it floats do not tell its sides apart.
const MIN_AREA: f64 = 1e-7;

/// The outline and then the holes.
pub(super) fn outlines(polygon: &PolygonFile) -> Vec<Vec<Vec3>> {
    std::iter::once(&polygon.vertices)
        .chain(&polygon.holes)
        .map(|outline| outline.iter().map(|v| vec3(*v)).collect())
        .collect()
}

/// Whether the polygon can be rendered; if not, why not is noted.
pub(super) fn check(polygon: &PolygonFile, pointer: &str, issues: &mut Issues) -> bool {
    let before = issues.count();
    let outline = Outline::of(&polygon.vertices);
    let at = format!("{pointer}/vertices");
    let Some(plane) = outline.plane() else {
        let message = "the polygon has no area (or crosses itself so that its parts cancel)";
        issues.add(at, IssueCode::Degenerate, message);
        return false;
    };
    if !plane.holds(&polygon.vertices, &at, issues) {
        return false;
    }
    for (index, hole) in polygon.holes.iter().enumerate() {
        let at = format!("{pointer}/holes/{index}");
        if Outline::of(hole).plane().is_none() {
            issues.add(at, IssueCode::Degenerate, "the hole has no area");
        } else {
            plane.holds(hole, &at, issues);
        }
    }
    issues.count() == before
}

struct Outline {
    center: DVec3,
    extent: f64,
    /// Normal of length twice the area (Newell).
    doubled_area: DVec3,
}

struct Plane {
    point: DVec3,
    normal: DVec3,
    tolerance: f64,
}

impl Outline {
    fn of(vertices: &[[f64; 3]]) -> Self {
        let points = || vertices.iter().map(|v| DVec3::from(*v));
        let center = points().sum::<DVec3>() / vertices.len().max(1) as f64;
        let extent = 2.0 * points().map(|p| p.distance(center)).fold(0.0, f64::max);
        let next = points().cycle().skip(1);
        let doubled_area = points().zip(next).map(|(a, b)| (a - center).cross(b - center)).sum();
        Self { center, extent, doubled_area }
    }

    fn plane(&self) -> Option<Plane> {
        if self.doubled_area.length() <= 2.0 * MIN_AREA * self.extent * self.extent {
            return None;
        }
        let normal = self.doubled_area.try_normalize()?;
        Some(Plane { point: self.center, normal, tolerance: MAX_UNEVENNESS * self.extent })
    }
}

impl Plane {
    /// Whether all vertices are in the plane; if not, this is noted.
    fn holds(&self, vertices: &[[f64; 3]], pointer: &str, issues: &mut Issues) -> bool {
        let off = vertices
            .iter()
            .map(|v| (DVec3::from(*v) - self.point).dot(self.normal).abs())
            .fold(0.0, f64::max);
        if off > self.tolerance {
            let message = format!(
                "not planar: a vertex is {off:.1e} m off the polygon's plane, {:.1e} m are allowed",
                self.tolerance
            );
            issues.add(pointer, IssueCode::NotPlanar, message);
        }
        off <= self.tolerance
    }
}
