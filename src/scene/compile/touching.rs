//! Dielectrics that touch: where their faces fall together a ray finds only one of them, so that the others are also
//! kept by themselves.

use super::super::file::ObjectFile;
use super::super::shape_file::ShapeFile;
use super::super::{ObjectId, Scene, Touching};
use super::Compiler;
use crate::geometry::{Bounds, Structure};
use std::mem::{replace, take};

/// Boxes this much apart, as a share of the largest coordinate, may hold faces that fall together.
const NEAR: f32 = 1e-5;

impl Compiler<'_> {
    /// Every still dielectric whose box meets that of one of another material. Objects that are instanced, and their
    /// instances, are left out: what touches them has to overlap them by more than rounding.
    pub(super) fn touching(&mut self, objects: &[Option<ObjectFile>], scene: &Scene) -> Vec<Touching> {
        let candidates: Vec<(usize, ObjectId, Bounds)> = objects
            .iter()
            .enumerate()
            .filter(|(index, object)| object.as_ref().is_some_and(|o| self.stands_alone(*index, o)))
            .map(|(index, _)| (index, ObjectId(index as u32)))
            .filter(|(_, id)| scene.material_of(*id).dielectric().is_some())
            .map(|(index, id)| (index, id, scene.geometry.object_bounds(id)))
            .collect();
        let material = |id: ObjectId| scene.objects[id.index()].material;
        let meets = |(_, id, bounds): &(usize, ObjectId, Bounds)| {
            candidates
                .iter()
                .any(|(_, other, box_of)| material(*other) != material(*id) && near(bounds, box_of))
        };
        let touching: Vec<(usize, ObjectId)> =
            candidates.iter().filter(|c| meets(c)).map(|(index, id, _)| (*index, *id)).collect();
        touching
            .into_iter()
            .filter_map(|(index, id)| self.alone(objects[index].as_ref()?, id, index))
            .collect()
    }

    fn stands_alone(&self, index: usize, object: &ObjectFile) -> bool {
        let still = object.velocity == [0.0; 3] && object.motion.is_none();
        still && !self.originals.is_instanced(index) && !matches!(object.shape, ShapeFile::Instance(_))
    }

    /// The object in a geometry of its own.
    fn alone(&mut self, object: &ObjectFile, id: ObjectId, index: usize) -> Option<Touching> {
        let whole = take(&mut self.geometry);
        self.shape(id, &object.shape, index);
        let alone = replace(&mut self.geometry, whole);
        (alone.count() > 0).then(|| Touching { object: id, geometry: alone.build_as(Structure::Auto) })
    }
}

fn near(a: &Bounds, b: &Bounds) -> bool {
    let largest = a.min.abs().max(a.max.abs()).max(b.min.abs()).max(b.max.abs()).max_element();
    let pad = NEAR * largest;
    (a.min - pad).cmple(b.max).all() && (b.min - pad).cmple(a.max).all()
}
