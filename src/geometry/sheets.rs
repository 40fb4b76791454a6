//! Sheets of surface: what photons are gathered from together, and how much of a kernel lies on one.

use super::leaves::Shape;
use super::nearest::Place;
use super::{Geometry, SheetId};
use crate::scene::ObjectId;
use glam::Vec3;

impl Geometry {
    /// What has a border is a sheet of its own, since each clips the kernel at its own outline; an object's
    /// triangles form one sheet, and a sphere is one. Polygons come first, then disks, cylinders and objects, and
    /// last the sheets of what moves.
    pub(super) fn sheet(&self, place: Place, object: ObjectId) -> SheetId {
        let (polygons, disks) = (self.polygons.len() as u32, self.disks.len() as u32);
        let rest = polygons + disks + self.cylinders.len() as u32 + object.0;
        SheetId(match place {
            Place::Entry(entry) => match self.leaves.entries[entry as usize].shape {
                Shape::Polygon(i) => i,
                Shape::Disk(i) => polygons + i,
                Shape::Cylinder(i) => polygons + disks + i,
                Shape::Sphere(_) | Shape::Instance(_) | Shape::Moving(_) => rest,
            },
            Place::Triangle(_) | Place::Instance(..) => rest,
        })
    }

    /// Number of sheets, those of what moves left aside.
    pub(super) fn sheet_count(&self) -> u32 {
        let own = self.polygons.len() + self.disks.len() + self.cylinders.len();
        (own + self.object_bounds.len()) as u32
    }

    /// Share of the density estimate's kernel around `point` that lies on the sheet (1 where unknown), where the
    /// sheet is at `time`.
    #[must_use]
    pub fn kernel_mass(&self, sheet: SheetId, point: Vec3, radius: f32, time: f32) -> f32 {
        let index = sheet.0 as usize;
        if let Some(polygon) = self.polygons.get(index) {
            return polygon.kernel_mass(point, radius, &self.edges);
        }
        let index = index - self.polygons.len();
        if let Some(disk) = self.disks.get(index) {
            return disk.kernel_mass(point, radius);
        }
        if let Some(cylinder) = self.cylinders.get(index - self.disks.len()) {
            return cylinder.kernel_mass(point, radius);
        }
        let after = self.moving.partition_point(|moving| moving.end_of_sheets() <= sheet.0);
        match self.moving.get(after) {
            Some(moving) if sheet.0 >= self.sheet_count() => moving.kernel_mass(sheet, point, radius, time),
            Some(_) | None => 1.0,
        }
    }
}
