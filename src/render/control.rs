//! The handle by which a render is watched and cancelled.

use super::RenderError;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Shared between the renderer and whoever waits for it: cancels, and tells how far the round is.
#[derive(Debug, Default)]
pub struct Control {
    cancelled: AtomicBool,
    tiles_done: AtomicU32,
    tiles: AtomicU32,
}

impl Control {
    /// A control that lets the render run.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the render to end; it does so within a tile or a batch of photons.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// True once [`Control::cancel`] was called.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// How much of the current round's picture is traced, 0..1.
    #[must_use]
    pub fn round_fraction(&self) -> f32 {
        let tiles = self.tiles.load(Ordering::Relaxed).max(1);
        self.tiles_done.load(Ordering::Relaxed) as f32 / tiles as f32
    }

    pub(crate) fn check(&self) -> Result<(), RenderError> {
        if self.is_cancelled() { Err(RenderError::Cancelled) } else { Ok(()) }
    }

    pub(crate) fn tile_done(&self, of: u32) {
        self.tiles.store(of, Ordering::Relaxed);
        self.tiles_done.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn start_round(&self) {
        self.tiles_done.store(0, Ordering::Relaxed);
    }
}
