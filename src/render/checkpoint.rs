//! A render in progress as bytes: it continues to the same picture as if it had never stopped.

use super::{PassTime, Render};
use crate::pass1_light::Tally;
use crate::pass2_eye::EyeCounts;
use crate::plan::Plan;
use crate::scene::Scene;
use glam::DVec3;
use std::sync::Arc;

/// First bytes of a checkpoint; the digit is the version of the layout.
const MAGIC: &[u8; 12] = b"nephroid-cp4";

/// Why a checkpoint cannot be continued.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CheckpointError {
    /// Not a checkpoint, or one of another version.
    #[error("not a checkpoint of this version")]
    Unknown,
    /// Cut short, or of a render with another plan or image size.
    #[error("the checkpoint does not fit this scene")]
    Mismatch,
}

impl Render {
    /// All finished rounds, as bytes.
    #[must_use]
    pub fn checkpoint(&self) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        for time in [self.pass1, self.pass2] {
            put_f64(&mut out, time.wall);
            put_f64(&mut out, time.cpu);
        }
        for count in self.eye.to_array().into_iter().chain([self.windows.len() as u64]) {
            put_u64(&mut out, count);
        }
        for tally in &self.windows {
            put_tally(&mut out, tally);
        }
        for count in [self.blocks, self.effort.photon_shift] {
            out.extend(count.to_le_bytes());
        }
        for counts in [&self.effort.samples, &self.effort.paths] {
            out.extend((counts.len() as u32).to_le_bytes());
            out.extend(counts);
        }
        // A non-negative float's bits plus one: zero means none.
        let error = self.error.map_or(0, |e| e.to_bits() + 1);
        out.extend(error.to_le_bytes());
        out.extend(self.film.to_bytes());
        out
    }

    /// Continues the render of [`Render::checkpoint`], which was of the same scene and plan.
    ///
    /// # Errors
    /// See [`CheckpointError`].
    pub fn resume(scene: Arc<Scene>, plan: Plan, checkpoint: &[u8]) -> Result<Self, CheckpointError> {
        let rest = checkpoint.strip_prefix(MAGIC.as_slice()).ok_or(CheckpointError::Unknown)?;
        let mut render = Self::new(scene, plan);
        render.read(rest).ok_or(CheckpointError::Mismatch)?;
        // The picture may be asked for before another round, if this was the last.
        render.trace_footprints();
        Ok(render)
    }

    fn read(&mut self, bytes: &[u8]) -> Option<()> {
        let mut bytes = bytes;
        for time in [&mut self.pass1, &mut self.pass2] {
            *time = PassTime { wall: take_f64(&mut bytes)?, cpu: take_f64(&mut bytes)? };
        }
        let mut counts = EyeCounts::default().to_array();
        for count in &mut counts {
            *count = take_u64(&mut bytes)?;
        }
        self.eye = EyeCounts::from_array(counts);
        if take_u64(&mut bytes)? != self.windows.len() as u64 {
            return None;
        }
        for tally in &mut self.windows {
            *tally = take_tally(&mut bytes)?;
        }
        self.blocks = take_u32(&mut bytes)?;
        self.effort.photon_shift = take_u32(&mut bytes)?.min(self.plan.most_photon_shift());
        for counts in [&mut self.effort.samples, &mut self.effort.paths] {
            let pixels = take_u32(&mut bytes)? as usize;
            let (values, rest) = bytes.split_at_checked(pixels)?;
            *counts = values.to_vec();
            bytes = rest;
        }
        self.error = take_u32(&mut bytes)?.checked_sub(1).map(f32::from_bits);
        self.film = self.film.read(bytes)?;
        Some(())
    }
}

fn put_u64(out: &mut Vec<u8>, value: u64) {
    out.extend(value.to_le_bytes());
}

fn put_f64(out: &mut Vec<u8>, value: f64) {
    put_u64(out, value.to_bits());
}

fn take_u64(bytes: &mut &[u8]) -> Option<u64> {
    let (value, rest) = bytes.split_first_chunk::<8>()?;
    *bytes = rest;
    Some(u64::from_le_bytes(*value))
}

fn take_u32(bytes: &mut &[u8]) -> Option<u32> {
    let (value, rest) = bytes.split_first_chunk::<4>()?;
    *bytes = rest;
    Some(u32::from_le_bytes(*value))
}

fn take_f64(bytes: &mut &[u8]) -> Option<f64> {
    take_u64(bytes).map(f64::from_bits)
}

fn put_tally(out: &mut Vec<u8>, tally: &Tally) {
    for count in [tally.sent, tally.hit_caster, tally.stored, tally.escaped, tally.cut, tally.rays] {
        put_u64(out, count);
    }
    let e = &tally.energy;
    for power in [e.emitted, e.stored, e.absorbed, e.escaped, e.cut, e.missed] {
        power.to_array().into_iter().for_each(|channel| put_f64(out, channel));
    }
}

fn take_tally(bytes: &mut &[u8]) -> Option<Tally> {
    let mut tally = Tally::default();
    let counts = [&mut tally.sent, &mut tally.hit_caster, &mut tally.stored];
    for count in counts.into_iter().chain([&mut tally.escaped, &mut tally.cut, &mut tally.rays]) {
        *count = take_u64(bytes)?;
    }
    let e = &mut tally.energy;
    let powers = [&mut e.emitted, &mut e.stored, &mut e.absorbed, &mut e.escaped, &mut e.cut, &mut e.missed];
    for power in powers {
        *power = DVec3::new(take_f64(bytes)?, take_f64(bytes)?, take_f64(bytes)?);
    }
    Some(tally)
}
