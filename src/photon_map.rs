//! Photons and the kd-tree that finds them again; the only file that names `kiddo`.

use crate::geometry::SheetId;
use crate::light_path::Kind;
use crate::pass2_eye::Footprint;
use glam::{Mat3, Vec3};
use kiddo::leaf_strategy::FlatVec;
use kiddo::{Eytzinger, KdTree, SquaredEuclidean};
use std::borrow::Borrow;

mod classic;

pub use classic::{Found, Nearest};

/// Light that has come to rest on a surface, on its way along `LS+D`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Photon {
    /// Where it lies.
    pub position: Vec3,
    /// Unit direction in which it travelled.
    pub direction: Vec3,
    /// Unit geometric normal of the surface there.
    pub normal: Vec3,
    /// The sheet of surface it lies on.
    pub sheet: SheetId,
    /// Which light it is, and what it has met, where layers or expressions tell photons apart; else 0.
    pub kind: Kind,
    /// Power per channel, W.
    pub power: Vec3,
}

/// What a photon is in the tree besides its position: 24 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
struct Stored {
    power: [f32; 3],
    /// Sheet and kind.
    place: u32,
    direction: u32,
    normal: u32,
}

type Tree = KdTree<f32, Stored, Eytzinger, FlatVec<f32, Stored, 3, 32>, 3, 32>;

/// Bytes held per photon in the tree: twelve of position and 24 of `Stored`; the tree's arrays keep up to
/// half as much again in reserve. While it is built another 36 and four of index.
pub const BYTES_PER_PHOTON: u64 = 36;

/// A kd-tree over photons.
///
/// The tree splits its axes in turn, so that photons on an axis-parallel floor would share one coordinate
/// and leave leaves of any size; all coordinates are turned by one fixed rotation first.
pub struct PhotonMap {
    tree: Option<Tree>,
    count: usize,
}

/// Bits of a photon's place that name the sheet: more sheets than a scene has, whose primitives are far larger.
const SHEETS: u32 = 0xff_ffff;

/// Light that a look-up finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incoming {
    /// Unit direction to where it came from.
    pub direction: Vec3,
    /// Which light it is, and what it has met.
    pub kind: Kind,
    /// Where it lies, off the point that is looked from; 0 in the classic estimates, which do not ask.
    pub offset: Vec3,
}

/// Where and how wide to look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lookup {
    /// The surface point.
    pub point: Vec3,
    /// Unit normal there, on the side that is seen.
    pub normal: Vec3,
    /// The sheet of surface the point lies on.
    pub sheet: SheetId,
    /// Radius of the kernel, m.
    pub radius: f32,
    /// Photons that arrive on the other side count too: the surface lets light through.
    pub both_sides: bool,
}

/// The fixed rotation: every entry is a third or two, none near zero.
const ROTATION: Mat3 = Mat3::from_cols(
    Vec3::new(2.0 / 3.0, 2.0 / 3.0, -1.0 / 3.0),
    Vec3::new(-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0),
    Vec3::new(2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0),
);

/// Normals further apart than this belong to another face of the sheet (cosine of 45°).
const NORMAL_COSINE: f32 = 0.707;

impl PhotonMap {
    /// Builds the tree; photons with a coordinate or power that is not finite are left out. A list that is given away
    /// becomes the tree's entries in its own memory.
    #[must_use]
    pub fn build(photons: impl IntoIterator<Item: Borrow<Photon>>) -> Self {
        let entry = |photon: &Photon| (Stored::from(photon), (ROTATION * photon.position).to_array());
        let usable = |photon: &Photon| photon.position.is_finite() && photon.power.is_finite();
        let mut entries: Vec<(Stored, [f32; 3])> = photons
            .into_iter()
            .filter_map(|photon| usable(photon.borrow()).then(|| entry(photon.borrow())))
            .collect();
        if entries.is_empty() {
            return Self { tree: None, count: 0 };
        }
        entries.shrink_to_fit();
        let tree = Tree::builder().build_from_entries(&entries).ok();
        let count = if tree.is_some() { entries.len() } else { 0 };
        Self { tree, count }
    }

    /// Number of photons in the tree.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count
    }

    /// True if there are no photons.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Irradiance at a point.
    #[must_use]
    pub fn irradiance(&self, lookup: &Lookup) -> Vec3 {
        self.radiance(lookup, |_| Vec3::ONE)
    }

    /// Density estimate at a point with the Epanechnikov kernel 2/(πr²) (1 - d²/r²), which is unbiased where
    /// the density is uniform; `per_irradiance` of the direction to where a photon came from weighs it. Only photons
    /// on the same sheet, with a similar normal, arriving on the side that is seen, and near the tangent plane count.
    #[must_use]
    pub fn radiance(&self, lookup: &Lookup, per_irradiance: impl Fn(Incoming) -> Vec3) -> Vec3 {
        let radius2 = lookup.radius * lookup.radius;
        let mut sum = Vec3::ZERO;
        self.visit(lookup, lookup.radius, |distance2, offset, photon| {
            let power = Vec3::from_array(photon.power) * (1.0 - distance2 / radius2);
            sum += power * per_irradiance(photon.incoming(offset));
        });
        if sum == Vec3::ZERO { sum } else { sum * (2.0 / (std::f32::consts::PI * radius2)) }
    }

    /// Visits the photons of a look-up that are no further away than `within`, with their squared distances and where they
    /// lie off its point, in the tree's frame.
    fn visit(&self, lookup: &Lookup, within: f32, mut photon_at: impl FnMut(f32, Vec3, Stored)) {
        let Some(tree) = &self.tree else { return };
        let radius2 = lookup.radius * lookup.radius;
        // A radius of no size (or NaN) holds no photons and has no density.
        if !(within > 0.0 && within * within > 0.0 && radius2 > 0.0 && radius2.is_finite()) {
            return;
        }
        let center = ROTATION * lookup.point;
        let normal = ROTATION * lookup.normal;
        tree.query(&center.to_array())
            .within::<SquaredEuclidean<f32>>(within * within)
            .unsorted()
            .with_points()
            .visit(|hit| {
                let photon = hit.item;
                let same_sheet = photon.sheet() == lookup.sheet.0;
                let offset = Vec3::from_array(hit.point) - center;
                let height = offset.dot(normal);
                // The photon's plane may tilt by 45° over the kernel's radius at most.
                let near_plane = height * height <= 0.5 * hit.distance + radius2 * 1e-4;
                if same_sheet && near_plane && photon.is_aligned(lookup.normal) {
                    let travels = decode_direction(photon.direction);
                    if lookup.both_sides || travels.dot(lookup.normal) < 0.0 {
                        photon_at(hit.distance, offset, photon);
                    }
                }
            });
    }
}

impl PhotonMap {
    /// Power of the photons that lie on a pixel's footprint, W.
    #[must_use]
    pub fn flux_within(&self, footprint: &Footprint) -> Vec3 {
        self.flux_of(footprint, |_| true)
    }

    /// The same, of the kinds that are picked.
    #[must_use]
    pub fn flux_of(&self, footprint: &Footprint, pick: impl Fn(Kind) -> bool) -> Vec3 {
        let Some(tree) = &self.tree else { return Vec3::ZERO };
        let center = footprint.center();
        let corners = footprint.corners.map(|corner| corner - center);
        let radius2 = corners.iter().map(|c| c.length_squared()).fold(0.0, f32::max);
        let normal = ROTATION * footprint.normal;
        // Inward edge normals in the plane of the footprint, in the tree's frame: a point p is inside if
        // p · inward ≥ offset for all four edges.
        let turned = corners.map(|corner| ROTATION * corner);
        let side = (turned[1] - turned[0]).cross(turned[2] - turned[1]).dot(normal).signum();
        let edges: [(Vec3, f32); 4] = std::array::from_fn(|i| {
            let inward = normal.cross(turned[(i + 1) % 4] - turned[i]) * side;
            (inward, inward.dot(turned[i]))
        });
        let middle = ROTATION * center;
        let mut sum = Vec3::ZERO;
        tree.query(&middle.to_array())
            .within::<SquaredEuclidean<f32>>(radius2 * WIDER)
            .unsorted()
            .with_points()
            .visit(|hit| {
                let photon = hit.item;
                let at = Vec3::from_array(hit.point) - middle;
                let inside = edges.iter().all(|(inward, offset)| at.dot(*inward) >= *offset);
                if inside
                    && pick(photon.kind())
                    && photon.sheet() == footprint.sheet.0
                    && photon.arrives_on(footprint.normal)
                {
                    sum += Vec3::from_array(photon.power);
                }
            });
        sum
    }
}

/// Rounding must not lose a photon at a corner.
const WIDER: f32 = 1.0 + 1e-4;

impl From<&Photon> for Stored {
    fn from(photon: &Photon) -> Self {
        Self {
            power: photon.power.to_array(),
            place: photon.sheet.0 & SHEETS | u32::from(photon.kind) << SHEETS.trailing_ones(),
            direction: encode_direction(photon.direction),
            normal: encode_direction(photon.normal),
        }
    }
}

impl Stored {
    #[inline]
    fn sheet(&self) -> u32 {
        self.place & SHEETS
    }

    #[inline]
    fn kind(&self) -> Kind {
        (self.place >> SHEETS.trailing_ones()) as Kind
    }

    /// Where it came from; `offset` is in the tree's frame.
    #[inline]
    fn incoming(&self, offset: Vec3) -> Incoming {
        let offset = ROTATION.transpose() * offset;
        Incoming { direction: -decode_direction(self.direction), kind: self.kind(), offset }
    }

    /// True if the photon's surface faces the same way, or the opposite.
    #[inline]
    fn is_aligned(&self, normal: Vec3) -> bool {
        decode_direction(self.normal).dot(normal).abs() > NORMAL_COSINE
    }

    /// True if the photon came from the side of `normal` and its surface faces the same way.
    #[inline]
    fn arrives_on(&self, normal: Vec3) -> bool {
        self.is_aligned(normal) && decode_direction(self.direction).dot(normal) < 0.0
    }
}

/// Octahedral encoding of a unit vector in 2 × 16 bits (Cigolle et al. 2014); error below 4e-5 rad.
fn encode_direction(v: Vec3) -> u32 {
    let p = v / v.abs().element_sum();
    let (x, y) = if p.z >= 0.0 {
        (p.x, p.y)
    } else {
        ((1.0 - p.y.abs()) * 1.0_f32.copysign(p.x), (1.0 - p.x.abs()) * 1.0_f32.copysign(p.y))
    };
    let quantise = |c: f32| ((c.clamp(-1.0, 1.0) * 32767.0).round() as i16) as u16;
    u32::from(quantise(x)) | u32::from(quantise(y)) << 16
}

fn decode_direction(code: u32) -> Vec3 {
    let part = |bits: u32| f32::from(bits as u16 as i16) / 32767.0;
    let (x, y) = (part(code), part(code >> 16));
    let z = 1.0 - x.abs() - y.abs();
    let fold = (-z).max(0.0);
    Vec3::new(x - fold.copysign(x), y - fold.copysign(y), z).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_survive_the_octahedral_code() {
        for i in 0..1000 {
            let u = crate::sampling::SamplePoint::new(5, i).get_2d(0);
            let v = crate::sampling::uniform_sphere(u);
            let back = decode_direction(encode_direction(v));
            assert!((back - v).length() < 8e-5, "{v} {back}");
        }
        assert_eq!(decode_direction(encode_direction(Vec3::NEG_Z)).z, -1.0);
    }

    #[test]
    fn the_rotation_is_a_rotation() {
        assert!((ROTATION * ROTATION.transpose()).abs_diff_eq(Mat3::IDENTITY, 1e-6));
        assert!((ROTATION.determinant() - 1.0).abs() < 1e-6);
    }
}
