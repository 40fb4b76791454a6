//! Uniform sampling of the solid angle of a rectangle (Ureña, Fajardo and King 2013).

use super::bilinear::Bilinear;
use crate::scene::QuadLight;
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::TAU;

/// A rectangle as seen from a point.
pub(super) struct SphericalRectangle {
    origin: DVec3,
    axes: [DVec3; 3],
    /// Extents in the local frame, whose z axis points away from the rectangle.
    x: [f64; 2],
    y: [f64; 2],
    z: f64,
    b: [f64; 2],
    /// Cosine and sine of the angle k at which u = 0 lies.
    k: [f64; 2],
    /// Steradians.
    pub(super) solid_angle: f32,
}

/// Below this solid angle (sr) the angles' sum minus 2π has lost its digits: the rectangle is flat.
const SMALL: f64 = 1e-9;

/// Of two complex numbers.
fn product([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a * c - b * d, a * d + b * c]
}

impl SphericalRectangle {
    /// `None` where the point lies in the rectangle's plane.
    pub(super) fn new(quad: &QuadLight, from: Vec3) -> Option<Self> {
        let origin = from.as_dvec3();
        let [(ax, width), (ay, height)] = quad.edges();
        let mut az = ax.cross(ay);
        let corner = quad.center.as_dvec3() - ax * (0.5 * width) - ay * (0.5 * height) - origin;
        let mut z = corner.dot(az);
        if z > 0.0 {
            z = -z;
            az = -az;
        }
        if z > -1e-12 * (corner.length() + width + height) {
            return None;
        }
        let x0 = corner.dot(ax);
        let y0 = corner.dot(ay);
        let (x, y) = ([x0, x0 + width], [y0, y0 + height]);
        // z components of the unit normals of the planes through the edges.
        let nz = [
            -y[0] / (z * z + y[0] * y[0]).sqrt(),
            x[1] / (z * z + x[1] * x[1]).sqrt(),
            y[1] / (z * z + y[1] * y[1]).sqrt(),
            -x[0] / (z * z + x[0] * x[0]).sqrt(),
        ];
        // The angles of the spherical polygon add up to 2π and the solid angle. As complex numbers of modulus 1 their product
        // tells the latter by one arc tangent, in place of four arc cosines.
        let angle = |a: f64, b: f64| {
            let cosine = -a * b;
            [cosine, (1.0 - cosine * cosine).max(0.0).sqrt()]
        };
        let g23 = product(angle(nz[2], nz[3]), angle(nz[3], nz[0]));
        let [cosine, sine] = product(product(angle(nz[0], nz[1]), angle(nz[1], nz[2])), g23);
        let b = [nz[0], nz[2]];
        let k = [g23[0], -g23[1]];
        let turn = libm::atan2(sine, cosine);
        let mut solid_angle = if turn < -SMALL { turn + TAU } else { turn };
        if solid_angle < SMALL {
            let middle = quad.center.as_dvec3() - origin;
            let distance2 = middle.length_squared();
            solid_angle = width * height * -z / (distance2 * distance2.sqrt());
        }
        Some(Self { origin, axes: [ax, ay, az], x, y, z, b, k, solid_angle: solid_angle as f32 })
    }

    /// Cosines toward the corners from a surface with this normal, as a density over the square that is drawn from.
    pub(super) fn cosines(&self, normal: Vec3) -> Bilinear {
        /// In a corner that the surface does not see, so that no point that it sees is missed.
        const LEAST: f64 = 0.1;
        let normal = normal.as_dvec3();
        let [x, y, z] = self.axes.map(|axis| axis.dot(normal));
        let corner = |i: usize, j: usize| {
            let (u, v) = (self.x[i], self.y[j]);
            let distance = (u * u + v * v + self.z * self.z).sqrt();
            ((x * u + y * v + z * self.z) / distance).max(LEAST) as f32
        };
        Bilinear([corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)])
    }

    /// A point of the rectangle, uniform in solid angle for `u` uniform in the unit square.
    pub(super) fn sample(&self, u: Vec2) -> Vec3 {
        let (u, v) = (f64::from(u.x), f64::from(u.y));
        let (x, y) = if f64::from(self.solid_angle) < SMALL {
            (self.x[0] + u * (self.x[1] - self.x[0]), self.y[0] + v * (self.y[1] - self.y[0]))
        } else {
            self.warp(u, v)
        };
        (self.origin + self.axes[0] * x + self.axes[1] * y + self.axes[2] * self.z).as_vec3()
    }

    fn warp(&self, u: f64, v: f64) -> (f64, f64) {
        let angle = u * f64::from(self.solid_angle);
        let [cosine, sine] = product([libm::cos(angle), libm::sin(angle)], self.k);
        let f = (cosine * self.b[0] - self.b[1]) / sine;
        let mut cu = 1.0 / (f * f + self.b[0] * self.b[0]).sqrt();
        if f < 0.0 {
            cu = -cu;
        }
        let cu = cu.clamp(-1.0, 1.0);
        let x = -(cu * self.z) / (1.0 - cu * cu).max(1e-300).sqrt();
        let x = x.clamp(self.x[0], self.x[1]);
        let d2 = x * x + self.z * self.z;
        let h0 = self.y[0] / (d2 + self.y[0] * self.y[0]).sqrt();
        let h1 = self.y[1] / (d2 + self.y[1] * self.y[1]).sqrt();
        let h = h0 + v * (h1 - h0);
        let h2 = h * h;
        let y = if h2 < 1.0 - 1e-12 { h * d2.sqrt() / (1.0 - h2).sqrt() } else { self.y[1] };
        (x, y.clamp(self.y[0], self.y[1]))
    }
}
