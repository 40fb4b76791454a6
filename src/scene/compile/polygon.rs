//! Polygons of the scene file. Whether one has an area and is planar is for the geometry to say, which
//! knows what it can intersect; here its answer becomes an issue with a pointer.

use super::super::ObjectId;
use super::super::issue::{IssueCode, Issues};
use super::super::shape_file::PolygonFile;
use super::vec3;
use crate::geometry::{GeometryBuilder, PolygonError};
use glam::{DVec3, Vec3};

/// Adds a polygon to the geometry; if it cannot be rendered, why not is noted.
pub(super) fn add(
    polygon: &PolygonFile,
    object: ObjectId,
    geometry: &mut GeometryBuilder,
    pointer: &str,
    issues: &mut Issues,
) {
    let outlines: Vec<Vec<Vec3>> = std::iter::once(&polygon.vertices)
        .chain(&polygon.holes)
        .map(|outline| outline.iter().map(|v| vec3(*v)).collect())
        .collect();
    for (index, hole) in outlines.iter().skip(1).enumerate() {
        if !has_area(hole) {
            issues.add(format!("{pointer}/holes/{index}"), IssueCode::Degenerate, "the hole has no area");
        }
    }
    let Err(error) = geometry.polygon(object, &outlines) else { return };
    let code = match error {
        PolygonError::TooFewVertices(_) => IssueCode::WrongLength,
        PolygonError::NoArea => IssueCode::Degenerate,
        PolygonError::NotPlanar { .. } => IssueCode::NotPlanar,
    };
    issues.add(format!("{pointer}{}", place(&error, &outlines)), code, error.to_string());
}

/// Whether an outline encloses more than the rounding of its corners.
fn has_area(outline: &[Vec3]) -> bool {
    let Some(base) = outline.first().map(|p| p.as_dvec3()) else { return false };
    let spokes = || outline.iter().map(|p| p.as_dvec3() - base);
    let doubled_area: DVec3 = spokes().zip(spokes().skip(1)).map(|(a, b)| a.cross(b)).sum();
    let size = spokes().map(|s| s.length()).fold(0.0, f64::max);
    doubled_area.length() > size * size * 1e-9
}

/// Where the error is, below the polygon.
fn place(error: &PolygonError, outlines: &[Vec<Vec3>]) -> String {
    let PolygonError::NotPlanar { vertex, .. } = error else { return "/vertices".to_owned() };
    let mut index = *vertex;
    for (outline, corners) in outlines.iter().enumerate() {
        if index < corners.len() {
            return match outline.checked_sub(1) {
                None => format!("/vertices/{index}"),
                Some(hole) => format!("/holes/{hole}/{index}"),
            };
        }
        index -= corners.len();
    }
    "/vertices".to_owned()
}
