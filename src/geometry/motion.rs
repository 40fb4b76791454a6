//! Where a moving object is at any moment while the shutter is open.

use super::{Bounds, HullPoint};
use glam::{DAffine3, DMat3, DQuat, DVec3};

/// How an object moves while the shutter is open, from time 0 to time 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// By how much it is off its place in the scene file when the shutter opens.
    pub start: DVec3,
    /// By how much it moves, on a straight line, until the shutter closes.
    pub translate: DVec3,
    /// By how much it is turned and scaled meanwhile.
    pub turn: Option<Turn>,
}

/// Turns and scales an object evenly while the shutter is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// The point about which it is turned and scaled; it moves with the object.
    pub about: DVec3,
    /// Unit axis.
    pub axis: DVec3,
    /// Radians, anticlockwise seen against the axis; more than a full turn is possible.
    pub angle: f64,
    /// Scale along each axis when the shutter closes, positive.
    pub scale: DVec3,
}

/// Largest angle, in radians, that an object is turned by in one of the pieces of the shutter in which its place
/// is bounded.
const ANGLE_PER_PIECE: f64 = 0.1;

/// Most pieces of the shutter: the bounds of faster turns are wider.
const MOST_PIECES: u32 = 64;

impl Motion {
    /// True if it has the same place all the time.
    #[must_use]
    pub fn is_still(&self) -> bool {
        let turns = |turn: &Turn| turn.angle != 0.0 || turn.scale != DVec3::ONE;
        self.translate == DVec3::ZERO && !self.turn.as_ref().is_some_and(turns)
    }

    /// By how much it is off its place in the scene file, turning left aside.
    #[inline]
    pub(super) fn shift(&self, time: f32) -> DVec3 {
        self.start + self.translate * f64::from(time)
    }

    /// From its frame, in which it is where the scene file says, to the world.
    #[inline]
    #[must_use]
    pub fn pose(&self, time: f32) -> DAffine3 {
        let shift = self.shift(time);
        let Some(turn) = &self.turn else { return DAffine3::from_translation(shift) };
        let matrix = turn.matrix(f64::from(time));
        DAffine3 { matrix3: matrix, translation: turn.about + shift - matrix * turn.about }
    }

    /// The scale at a time if it is the same along all axes.
    #[must_use]
    pub fn even_scale(&self, time: f32) -> Option<f64> {
        let Some(turn) = &self.turn else { return Some(1.0) };
        let even = turn.scale.x == turn.scale.y && turn.scale.y == turn.scale.z;
        even.then(|| 1.0 + (turn.scale.x - 1.0) * f64::from(time))
    }

    /// The largest scale along any axis at any time.
    #[must_use]
    pub fn largest_scale(&self) -> f32 {
        self.turn.map_or(1.0, |turn| turn.scale.max_element().max(1.0) as f32)
    }

    /// A box that holds a box of its frame at all times.
    #[must_use]
    pub fn swept_box(&self, local: Bounds) -> Bounds {
        if local.is_empty() {
            return Bounds::EMPTY;
        }
        let spheres = self.swept(local.corners().iter().map(super::point));
        spheres.iter().fold(Bounds::EMPTY, |all, sphere| {
            all.union(Bounds::new(sphere.position - sphere.radius, sphere.position + sphere.radius))
        })
    }

    /// Spheres whose convex hull holds some spheres of its frame at all times.
    pub(super) fn swept(&self, hull: impl IntoIterator<Item = HullPoint>) -> Vec<HullPoint> {
        hull.into_iter().flat_map(|point| self.swept_point(point)).collect()
    }

    fn swept_point(&self, point: HullPoint) -> Vec<HullPoint> {
        let HullPoint { position, radius } = point;
        let position = position.as_dvec3();
        let Some(turn) = &self.turn else {
            // The hull of a sphere that moves along a line is that of its first and its last place.
            let ends = [self.start, self.start + self.translate].map(|shift| (position + shift).as_vec3());
            return ends.map(|position| HullPoint { position, radius }).to_vec();
        };
        let pieces = ((turn.angle.abs() / ANGLE_PER_PIECE).ceil() as u32).clamp(8, MOST_PIECES);
        let reach = (position - turn.about).length() + f64::from(radius);
        // How fast any point within reach may be, times half a piece: it strays no further from where it is in
        // the piece's middle.
        let speed = self.translate.length() + turn.speed(reach);
        let stray = (0.5 * speed / f64::from(pieces)) as f32;
        let radius = radius * self.largest_scale() + stray * (1.0 + 4.0 * f32::EPSILON);
        let middle = |piece: u32| (f64::from(piece) + 0.5) / f64::from(pieces);
        let at = |piece| self.pose(middle(piece) as f32).transform_point3(position).as_vec3();
        (0..pieces).map(|piece| HullPoint { position: at(piece), radius }).collect()
    }
}

impl Turn {
    /// Scales, then turns. The angle grows evenly, as in spherical linear interpolation, and so does the scale.
    fn matrix(&self, time: f64) -> DMat3 {
        let half = 0.5 * self.angle * time;
        let v = self.axis * libm::sin(half);
        let turn = DMat3::from_quat(DQuat::from_xyzw(v.x, v.y, v.z, libm::cos(half)));
        turn * DMat3::from_diagonal(DVec3::ONE.lerp(self.scale, time))
    }

    /// Bound on the speed, per shutter, that it gives to a point at a distance of up to `reach`.
    fn speed(&self, reach: f64) -> f64 {
        let largest = self.scale.max_element().max(1.0);
        reach * (self.angle.abs() * largest + (self.scale - DVec3::ONE).abs().max_element())
    }
}
