//! Objects of the scene file that move while the shutter is open.

use super::super::ObjectId;
use super::super::file::{CameraFile, ObjectFile};
use super::super::issue::IssueCode;
use super::super::read::MAX_LENGTH;
use super::super::shape_file::{MotionFile, ShapeFile};
use super::Compiler;
use crate::geometry::{Bounds, GeometryBuilder, Motion, Turn};
use glam::DVec3;

impl Compiler<'_> {
    /// Notes when the shutter opens and closes.
    pub(super) fn shutter(&mut self, camera: &CameraFile) {
        let [open, close] = match camera {
            CameraFile::Perspective(c) => c.shutter,
            CameraFile::Orthographic(c) => c.shutter,
        };
        if close < open {
            let message = "the shutter must not close before it opens";
            self.issues.add("/camera/shutter", IssueCode::OutOfRange, message);
        }
        self.shutter = [open, close];
    }

    /// Adds an object's shape, at rest or in motion; tells how it moves.
    pub(super) fn place_object(&mut self, id: ObjectId, object: &ObjectFile, index: usize) -> Option<Motion> {
        let moves = object.velocity != [0.0; 3] || object.motion.is_some();
        let motion = self.motion(object);
        if motion.is_still() && motion.start == DVec3::ZERO {
            if moves && self.shutter[0] == self.shutter[1] {
                let message = "it does not move: the camera's `shutter` is open for no time";
                self.warn("shutter_closed", &format!("/objects/{index}"), message);
            }
            self.shape(id, &object.shape, index);
            return None;
        }
        // The shape is put into a part of its own, by the same code as one at rest.
        let part = self.geometry.part();
        let whole = std::mem::replace(&mut self.geometry, part);
        self.shape(id, &object.shape, index);
        let part = std::mem::replace(&mut self.geometry, whole);
        Some(self.add_moving(id, object, part, motion, index))
    }

    fn add_moving(
        &mut self,
        id: ObjectId,
        object: &ObjectFile,
        part: GeometryBuilder,
        mut motion: Motion,
        index: usize,
    ) -> Motion {
        let about = object.motion.as_ref().and_then(|motion| motion.about);
        if let Some(turn) = &mut motion.turn {
            turn.about = about.map_or_else(|| own_middle(&object.shape, &part), DVec3::from);
        }
        let before = self.geometry.count();
        self.geometry.moving(id, part, motion);
        let Bounds { min, max } = self.geometry.bounds_after(before);
        let farthest = f64::from(min.abs().max(max.abs()).max_element());
        if farthest.is_finite() && farthest > MAX_LENGTH {
            let field = if object.motion.is_some() { "motion" } else { "velocity" };
            let message = format!("it would move farther than {MAX_LENGTH:e} m from the origin");
            self.issues.add(format!("/objects/{index}/{field}"), IssueCode::OutOfRange, message);
        }
        motion
    }

    /// How an object moves; what it turns about is left to be filled in.
    fn motion(&self, object: &ObjectFile) -> Motion {
        let [open, close] = self.shutter;
        let velocity = DVec3::from(object.velocity);
        let mut motion = Motion { start: velocity * open, translate: velocity * (close - open), turn: None };
        let Some(file) = object.motion.as_ref().filter(|_| close > open) else { return motion };
        motion.translate += DVec3::from(file.translate);
        let MotionFile { rotate, scale, .. } = file;
        let (axis, angle) = match rotate {
            Some(rotate) => (DVec3::from(rotate.axis).normalize(), rotate.angle.to_radians()),
            None => (DVec3::Y, 0.0),
        };
        let turn = Turn { about: DVec3::ZERO, axis, angle, scale: DVec3::from(*scale) };
        motion.turn = (turn.angle != 0.0 || turn.scale != DVec3::ONE).then_some(turn);
        motion
    }
}

/// What an object turns about if it does not say: an instance about where the origin of its original has come to, any
/// other about the middle of its box.
fn own_middle(shape: &ShapeFile, part: &GeometryBuilder) -> DVec3 {
    match shape {
        ShapeFile::Instance(instance) => DVec3::from(instance.translate),
        ShapeFile::Sphere(_)
        | ShapeFile::Polygon(_)
        | ShapeFile::Mesh(_)
        | ShapeFile::Disk(_)
        | ShapeFile::Cylinder(_)
        | ShapeFile::Box(_)
        | ShapeFile::Heightfield(_) => {
            let bounds = part.bounds_after(0);
            if bounds.is_empty() { DVec3::ZERO } else { bounds.center().as_dvec3() }
        }
    }
}
