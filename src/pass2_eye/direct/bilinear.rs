//! Sampling of the unit square by a density that follows what is known at its corners (Hart et al., *Practical Product
//! Sampling by Fitting and Composing Warps*, 2020).

use crate::scene::QuadLight;
use glam::{Vec2, Vec3};

/// A density that is linear along each edge between its values at (0, 0), (1, 0), (0, 1) and (1, 1), up to a factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bilinear(pub(super) [f32; 4]);

/// A rectangle whose distance is this many times its diagonal, or more, is far: the light of its points falls off almost
/// evenly from corner to corner.
const FAR: f32 = 4.0;

impl Bilinear {
    /// The irradiance that the points of a far rectangle give to a surface with a normal: the height over the surface's plane
    /// over the distance to the fourth. `None` of a near one.
    pub(super) fn of_far(quad: &QuadLight, from: Vec3, normal: Vec3) -> Option<Self> {
        let to = quad.center - from;
        let (u, v) = (quad.half_u, quad.half_v);
        let spread = u.length_squared() + v.length_squared();
        let distance2 = to.length_squared() + spread;
        if distance2 < FAR * FAR * 4.0 * spread {
            return None;
        }
        let (along_u, along_v) = (2.0 * to.dot(u) / distance2, 2.0 * to.dot(v) / distance2);
        let (height, rise_u, rise_v) = (to.dot(normal), u.dot(normal), v.dot(normal));
        let corner = |x: f32, y: f32| {
            let distance2 = 1.0 + x * along_u + y * along_v;
            (height + x * rise_u + y * rise_v).max(0.0) / (distance2 * distance2)
        };
        Some(Self([corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)]))
    }

    /// The point for `u` uniform in the unit square, and the density there; `None` if all is dark.
    pub(super) fn sample(&self, u: Vec2) -> Option<(Vec2, f32)> {
        let [a, b, c, d] = self.0;
        let sum = a + b + c + d;
        if sum <= 0.0 {
            return None;
        }
        let y = linear(u.y, a + b, c + d);
        let (left, right) = (a + (c - a) * y, b + (d - b) * y);
        let x = linear(u.x, left, right);
        let density = 4.0 * (left + (right - left) * x) / sum;
        (density > 0.0).then_some((Vec2::new(x, y), density))
    }
}

/// Inverts the integral of the density that goes from `a` at 0 to `b` at 1.
fn linear(u: f32, a: f32, b: f32) -> f32 {
    let root = (a * a + u * (b * b - a * a)).max(0.0).sqrt();
    (u * (a + b) / (a + root).max(f32::MIN_POSITIVE)).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::SamplePoint;

    /// Over a stratified set of points the mean of any f/density is the integral of f, here of 1, x and xy; with 65,536 points
    /// of a scrambled net the deviation is far below 1e-3.
    #[test]
    fn samples_have_the_density_that_is_told() {
        for corners in
            [[1.0, 1.0, 1.0, 1.0], [0.1, 2.0, 0.5, 4.0], [0.0, 1.0, 0.0, 3.0], [0.0, 0.0, 1.0, 2.0]]
        {
            let n = 65_536;
            let mut sums = [0.0_f64; 3];
            for i in 0..n {
                let Some((p, density)) = Bilinear(corners).sample(SamplePoint::new(5, i).get_2d(0)) else {
                    continue;
                };
                let (x, y, density) = (f64::from(p.x), f64::from(p.y), f64::from(density));
                let here = corner_value(&corners, p) / density;
                sums.iter_mut().zip([here, x * here, x * y * here]).for_each(|(sum, value)| *sum += value);
            }
            let [a, b, c, d] = corners.map(f64::from);
            let of_x = (a + 2.0 * b + c + 2.0 * d) / 12.0;
            let of_xy = (a + 2.0 * b + 2.0 * c + 4.0 * d) / 36.0;
            let expected = [(a + b + c + d) / 4.0, of_x, of_xy];
            for (sum, expected) in sums.iter().zip(expected) {
                let mean = sum / f64::from(n);
                assert!((mean - expected).abs() < 1e-3 * expected, "{corners:?}: {mean} {expected}");
            }
        }
        assert_eq!(Bilinear([0.0; 4]).sample(Vec2::splat(0.5)), None);
    }

    /// Seen from afar, the light that each point gives over its density is nearly the same, and its mean the integral. Where
    /// the surface's plane cuts the rectangle it is less noisy than points drawn evenly. The sum over 512² points is good to 1e-5.
    #[test]
    fn the_light_of_a_far_rectangle_is_drawn_evenly() {
        let halves = [Vec3::new(0.5, 0.0, 0.2), Vec3::new(0.0, 0.4, 0.0)];
        let facing = halves[1].cross(halves[0]).normalize();
        let quad = QuadLight::new(Vec3::new(0.3, 0.2, 6.0), halves, facing, Vec3::ONE);
        let (slanting, cut) = (Vec3::new(0.9, 0.3, 0.3), Vec3::new(1.0, 0.2, -0.04));
        for (normal, noise) in [(Vec3::Z, Some(0.06)), (slanting, Some(0.06)), (cut, None)] {
            let normal = normal.normalize();
            let light = |p: Vec2| {
                let to = quad.point(p * 2.0 - 1.0).point;
                f64::from(to.dot(normal).max(0.0) / to.length_squared().powi(2))
            };
            let corners = Bilinear::of_far(&quad, Vec3::ZERO, normal).expect("far");
            let weight = |i: u32| {
                let (p, density) = corners.sample(SamplePoint::new(3, i).get_2d(0)).expect("lit");
                light(p) / f64::from(density)
            };
            let side = 512;
            let middle = |i: u32| Vec2::new((i % side) as f32 + 0.5, (i / side) as f32 + 0.5) / side as f32;
            let (mean, drawn) = spread((0..65_536).map(weight));
            let (expected, even) = spread((0..side * side).map(|i| light(middle(i))));
            assert!((mean - expected).abs() < 1e-3 * expected, "{normal}: {mean} {expected}");
            assert!(drawn < noise.unwrap_or(even), "{normal}: {drawn} {even}");
        }
    }

    /// Mean, and standard deviation over it.
    fn spread(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
        let count = values.clone().count() as f64;
        let mean = values.clone().sum::<f64>() / count;
        (mean, (values.map(|value| (value / mean - 1.0).powi(2)).sum::<f64>() / count).sqrt())
    }

    fn corner_value([a, b, c, d]: &[f32; 4], p: Vec2) -> f64 {
        let low = f64::from(*a) + f64::from(b - a) * f64::from(p.x);
        let high = f64::from(*c) + f64::from(d - c) * f64::from(p.x);
        low + (high - low) * f64::from(p.y)
    }
}
