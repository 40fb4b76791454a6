//! What is allowed in a scene, but hardly meant: warnings, each with a stable code and its place, and the geometry
//! that tells.

use crate::geometry::MeshData;
use glam::{DAffine3, DVec2, DVec3, Vec3};
use std::f64::consts::TAU;
use std::fmt;

/// Something the user should know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Stable name of the kind of warning.
    pub code: &'static str,
    /// Where, as a JSON pointer (RFC 6901); `None` where it is about the scene as a whole.
    pub pointer: Option<String>,
    /// The warning in words.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(pointer) = &self.pointer {
            write!(f, "{pointer}: ")?;
        }
        write!(f, "{} [{}]", self.message, self.code)
    }
}

/// A piece of the border of a surface that is not closed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Border {
    /// The same for the borders of two surfaces that meet there.
    pub(super) key: BorderKey,
    /// Points of it, each with the unit direction in which the surface would go on.
    pub(super) samples: Vec<(DVec3, DVec3)>,
}

/// What a border is, to the bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum BorderKey {
    /// Both ends of an edge, in order.
    Edge([[u32; 3]; 2]),
    /// Centre and radius of a circle.
    Circle([u32; 3], u32),
}

/// Points on a circle at which it is looked at.
const CIRCLE_SAMPLES: u32 = 8;

/// Edges of a mesh's border that are looked at.
const MOST_EDGES: usize = 256;

/// Pairs of edges of a polygon that are tested for crossing; beyond, the polygon counts as simple.
const MOST_PAIRS: usize = 20_000_000;

fn bits(p: Vec3) -> [u32; 3] {
    // The sum turns -0 into 0.
    (p + Vec3::ZERO).to_array().map(f32::to_bits)
}

impl Border {
    /// An edge from `a` to `b` of a surface that lies towards `inside`.
    pub(super) fn edge(a: DVec3, b: DVec3, inside: DVec3) -> Self {
        let mut ends = [bits(a.as_vec3()), bits(b.as_vec3())];
        ends.sort_unstable();
        let along = (b - a).normalize_or_zero();
        let to = inside - a;
        let outwards = -(to - along * along.dot(to)).normalize_or_zero();
        Self { key: BorderKey::Edge(ends), samples: vec![(a.midpoint(b), outwards)] }
    }

    /// A circle about `axis`; the surface would go on along `along` if given, else away from the centre.
    pub(super) fn circle(center: DVec3, axis: DVec3, radius: f64, along: Option<DVec3>) -> Self {
        let (x, y) = axis.any_orthonormal_pair();
        let sample = |k: u32| {
            let angle = TAU * f64::from(k) / f64::from(CIRCLE_SAMPLES);
            let spoke = x * libm::cos(angle) + y * libm::sin(angle);
            (center + spoke * radius, along.unwrap_or(spoke))
        };
        let key = BorderKey::Circle(bits(center.as_vec3()), (radius as f32).to_bits());
        Self { key, samples: (0..CIRCLE_SAMPLES).map(sample).collect() }
    }
}

/// The edges that only one triangle has, where the mesh is after `to_world`; vertices in the same place are one. At
/// most [`MOST_EDGES`] of them, spread over all.
pub(super) fn mesh_borders(mesh: &MeshData, to_world: &DAffine3) -> Vec<Border> {
    let welded = weld(&mesh.positions);
    let mut edges: Vec<(u64, u32)> = Vec::with_capacity(3 * mesh.triangles.len());
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|v| u64::from(welded[v as usize]));
        if a == b || b == c || c == a {
            continue;
        }
        let key = |p: u64, q: u64| p.min(q) << 32 | p.max(q);
        edges.extend([key(a, b), key(b, c), key(c, a)].map(|key| (key, index as u32)));
    }
    edges.sort_unstable();
    let open: Vec<(u64, u32)> =
        edges.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1).map(|same| same[0]).collect();
    let step = open.len().div_ceil(MOST_EDGES).max(1);
    let place = |v: u32| to_world.transform_point3(mesh.positions[v as usize].as_dvec3());
    let border = |&(key, triangle): &(u64, u32)| {
        let corners = mesh.triangles[triangle as usize];
        let middle = corners.iter().map(|&v| place(v)).sum::<DVec3>() / 3.0;
        Border::edge(place((key >> 32) as u32), place(key as u32), middle)
    };
    open.iter().step_by(step).map(border).collect()
}

/// For each vertex the first one in the same place.
fn weld(positions: &[Vec3]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by_key(|&v| (bits(positions[v as usize]), v));
    let mut first = vec![0; positions.len()];
    for same in order.chunk_by(|&a, &b| bits(positions[a as usize]) == bits(positions[b as usize])) {
        same.iter().for_each(|&v| first[v as usize] = same[0]);
    }
    first
}

/// Volume that a closed mesh encloses, negative if its normals point inwards.
pub(super) fn signed_volume(mesh: &MeshData) -> f64 {
    let Some(origin) = mesh.positions.first().map(|p| p.as_dvec3()) else { return 0.0 };
    let corner = |v: u32| mesh.positions[v as usize].as_dvec3() - origin;
    let tetrahedron = |&[a, b, c]: &[u32; 3]| corner(a).dot(corner(b).cross(corner(c))) / 6.0;
    mesh.triangles.iter().map(tetrahedron).sum()
}

/// Two edges of a polygon that cross, each by the outline and the vertex that it starts from.
pub(super) fn crossing(outlines: &[&[[f64; 3]]]) -> Option<[(usize, usize); 2]> {
    let normal = newell(outlines.first()?);
    let (x, y) = normal.try_normalize()?.any_orthonormal_pair();
    let flat = |p: &[f64; 3]| DVec2::new(DVec3::from(*p).dot(x), DVec3::from(*p).dot(y));
    let mut edges: Vec<(DVec2, DVec2, (usize, usize))> = Vec::new();
    for (i, outline) in outlines.iter().enumerate() {
        for (k, from) in outline.iter().enumerate() {
            edges.push((flat(from), flat(&outline[(k + 1) % outline.len()]), (i, k)));
        }
    }
    let left = |e: &(DVec2, DVec2, _)| e.0.x.min(e.1.x);
    edges.sort_by(|a, b| left(a).total_cmp(&left(b)));
    let mut pairs = 0;
    for (i, a) in edges.iter().enumerate() {
        // Only edges that begin before this one ends can cross it.
        let right = a.0.x.max(a.1.x);
        for b in edges[i + 1..].iter().take_while(|b| left(b) <= right) {
            pairs += 1;
            if cross(a.0, a.1, b.0, b.1) {
                return Some([a.2.min(b.2), a.2.max(b.2)]);
            }
        }
        if pairs > MOST_PAIRS {
            return None;
        }
    }
    None
}

/// True if two edges cross between their ends; those that touch do not cross.
fn cross(a: DVec2, b: DVec2, c: DVec2, d: DVec2) -> bool {
    let size = (b - a).length() * (d - c).length();
    let side = |p: DVec2, q: DVec2, r: DVec2| {
        let area = (q - p).perp_dot(r - p);
        // What rounding can make of three points on a line.
        if area.abs() <= 1e-7 * size { 0.0 } else { area.signum() }
    };
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

fn newell(outline: &[[f64; 3]]) -> DVec3 {
    let point = |k: usize| DVec3::from(outline[k % outline.len()]);
    (1..outline.len()).map(|k| (point(k) - point(0)).cross(point(k + 1) - point(0))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An octahedron, with every corner given once for each of its triangles.
    fn octahedron() -> MeshData {
        let mut mesh = MeshData::default();
        for i in 0..8 {
            let sign = |bit: i32| if i & bit == 0 { 1.0 } else { -1.0 };
            let corners = [Vec3::X * sign(1), Vec3::Y * sign(2), Vec3::Z * sign(4)];
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(corners);
            // An odd number of mirrorings turns the winding.
            let odd = sign(1) * sign(2) * sign(4) < 0.0;
            mesh.triangles.push(if odd {
                [first, first + 2, first + 1]
            } else {
                [first, first + 1, first + 2]
            });
        }
        mesh
    }

    #[test]
    fn corners_in_one_place_close_a_mesh_and_a_missing_triangle_opens_it() {
        let mut mesh = octahedron();
        assert_eq!(mesh_borders(&mesh, &DAffine3::IDENTITY), []);
        assert!((signed_volume(&mesh) - 4.0 / 3.0).abs() < 1e-9);
        mesh.triangles.pop();
        assert_eq!(mesh_borders(&mesh, &DAffine3::IDENTITY).len(), 3);
        let inside_out: Vec<_> = octahedron().triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
        assert!(signed_volume(&MeshData { triangles: inside_out, ..octahedron() }) < -1.3);
    }

    #[test]
    fn only_edges_that_cross_between_their_ends_count() {
        let ring = |points: &[[f64; 2]]| points.iter().map(|&[x, z]| [x, 2.0, -z]).collect::<Vec<_>>();
        let square = ring(&[[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]]);
        let touching = ring(&[[0.0, 1.0], [1.0, 1.0], [1.0, 2.0]]);
        let leaving = ring(&[[1.0, 1.0], [4.0, 1.5], [1.0, 2.0]]);
        assert_eq!(crossing(&[&square, &touching]), None);
        assert_eq!(crossing(&[&square, &leaving]), Some([(0, 1), (1, 0)]));
        let bow = ring(&[[0.0, 0.0], [2.0, 0.0], [0.5, 3.0], [1.5, 3.0]]);
        assert_eq!(crossing(&[&bow]), Some([(0, 1), (0, 3)]));
        // A seam that runs to a hole and back along the same line.
        let seam = ring(&[
            [0.0, 0.0],
            [3.0, 0.0],
            [3.0, 3.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [1.0, 1.0],
            [2.0, 2.0],
            [3.0, 3.0],
            [0.0, 3.0],
        ]);
        assert_eq!(crossing(&[&seam]), None);
    }
}
