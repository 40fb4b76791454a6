//! Where the light of pass 1 goes: emitted = stored + absorbed + escaped + cut + missed, per channel.

use glam::DVec3;

/// Power per channel, W, by what became of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Sent through the window.
    pub emitted: DVec3,
    /// Rests on a D after at least one S.
    pub stored: DVec3,
    /// Taken up by mirrors.
    pub absorbed: DVec3,
    /// Left the scene after at least one S.
    pub escaped: DVec3,
    /// Lost to the bounce limit, or to roulette (which gives as much as it takes on average).
    pub cut: DVec3,
    /// Met something other than the window's caster first: another window or the direct light has it.
    pub missed: DVec3,
}

/// Counts and energy of some photons.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Photons drawn.
    pub sent: u64,
    /// Photons whose first surface was the window's caster.
    pub hit_caster: u64,
    /// Photons stored.
    pub stored: u64,
    /// Photons that left the scene.
    pub escaped: u64,
    /// Photons ended by roulette or the bounce limit.
    pub cut: u64,
    /// Rays traced.
    pub rays: u64,
    /// Power.
    pub energy: Energy,
}

impl Energy {
    /// What the balance misses, per channel; 0 up to rounding.
    #[must_use]
    pub fn imbalance(&self) -> DVec3 {
        self.emitted - (self.stored + self.absorbed + self.escaped + self.cut + self.missed)
    }

    fn add(&mut self, other: &Self) {
        self.emitted += other.emitted;
        self.stored += other.stored;
        self.absorbed += other.absorbed;
        self.escaped += other.escaped;
        self.cut += other.cut;
        self.missed += other.missed;
    }
}

impl Tally {
    /// Adds another's counts and energy.
    pub fn add(&mut self, other: &Self) {
        self.sent += other.sent;
        self.hit_caster += other.hit_caster;
        self.stored += other.stored;
        self.escaped += other.escaped;
        self.cut += other.cut;
        self.rays += other.rays;
        self.energy.add(&other.energy);
    }
}
