//! Random and low-discrepancy numbers, keyed by what is computed and never by who computes it.
//!
//! Both passes draw from Owen-scrambled Sobol sequences (Joe and Kuo 2008; scrambling by hash, Burley 2020
//! with the hash of Vegdahl 2021). Beyond [`SOBOL_DIMENSIONS`] dimensions a hash takes over.

mod density;

pub use density::Density2d;

/// Number of dimensions that are low-discrepancy; later ones are independent random numbers.
pub const SOBOL_DIMENSIONS: u32 = 19;

/// Dimension of a path's time.
pub const TIME_DIMENSION: u32 = 16;

/// Dimension of a path's wavelength, in either pass.
pub const WAVELENGTH_DIMENSION: u32 = 17;

/// Events take two dimensions each; these, which have uses of their own, are none of them.
const RESERVED_DIMENSIONS: std::ops::Range<u32> = 16..20;

/// First dimension of the event number `event` of a path whose events begin at `first` (an even number).
#[inline]
#[must_use]
pub fn event_dimension(first: u32, event: u32) -> u32 {
    let dimension = first + 2 * event;
    let past = dimension >= RESERVED_DIMENSIONS.start;
    dimension + if past { RESERVED_DIMENSIONS.end - RESERVED_DIMENSIONS.start } else { 0 }
}

/// One point of one scrambled sequence: the index within it and the seed that scrambles it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SamplePoint {
    index: u32,
    seed: u64,
}

impl SamplePoint {
    /// Point number `index` of the sequence scrambled by `seed`.
    #[inline]
    #[must_use]
    pub fn new(seed: u64, index: u32) -> Self {
        Self { index, seed }
    }

    /// The same index of a sequence of its own, for an independent use (another branch of a ray tree).
    #[inline]
    #[must_use]
    pub fn branch(self, key: u64) -> Self {
        Self { index: self.index, seed: hash(self.seed, key) }
    }

    /// One coordinate, in [0, 1).
    #[inline]
    #[must_use]
    pub fn get(self, dimension: u32) -> f32 {
        let scramble = hash(self.seed, u64::from(dimension));
        let bits = if dimension < SOBOL_DIMENSIONS {
            owen_scramble(sobol(self.index, dimension as usize), scramble as u32)
        } else {
            (hash(scramble, u64::from(self.index)) >> 32) as u32
        };
        // The upper 24 bits fill an f32's mantissa; the result stays below 1.
        (bits >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// Two coordinates.
    #[inline]
    #[must_use]
    pub fn get_2d(self, dimension: u32) -> glam::Vec2 {
        glam::Vec2::new(self.get(dimension), self.get(dimension + 1))
    }
}

/// A 64-bit hash of two words (the finaliser of SplitMix64, Steele et al. 2014).
#[inline]
#[must_use]
pub fn hash(a: u64, b: u64) -> u64 {
    let mut z = a.wrapping_add(b.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Nested uniform scrambling of the digits of `x`: Owen's, by a hash in which each bit depends only on the
/// bits above it.
#[inline]
fn owen_scramble(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// One coordinate of the unscrambled sequence as a 32-bit fraction.
#[inline]
fn sobol(index: u32, dimension: usize) -> u32 {
    let table = &SOBOL[dimension];
    let [a, b, c, d] = index.to_le_bytes().map(usize::from);
    table[0][a] ^ table[1][b] ^ table[2][c] ^ table[3][d]
}

/// Primitive polynomials and initial direction numbers (s, a, m) of dimensions 2 to 19, from Joe and Kuo's
/// table new-joe-kuo-6.21201.
const JOE_KUO: [(usize, u32, [u32; 6]); 18] = [
    (1, 0, [1, 0, 0, 0, 0, 0]),
    (2, 1, [1, 3, 0, 0, 0, 0]),
    (3, 1, [1, 3, 1, 0, 0, 0]),
    (3, 2, [1, 1, 1, 0, 0, 0]),
    (4, 1, [1, 1, 3, 3, 0, 0]),
    (4, 4, [1, 3, 5, 13, 0, 0]),
    (5, 2, [1, 1, 5, 5, 17, 0]),
    (5, 4, [1, 1, 5, 5, 5, 0]),
    (5, 7, [1, 1, 7, 11, 19, 0]),
    (5, 11, [1, 1, 5, 1, 1, 0]),
    (5, 13, [1, 1, 1, 3, 11, 0]),
    (5, 14, [1, 3, 5, 5, 31, 0]),
    (6, 1, [1, 3, 3, 9, 7, 49]),
    (6, 13, [1, 1, 1, 15, 21, 21]),
    (6, 16, [1, 3, 1, 13, 27, 49]),
    (6, 19, [1, 1, 1, 15, 7, 5]),
    (6, 22, [1, 3, 1, 15, 13, 25]),
    (6, 25, [1, 1, 5, 5, 19, 61]),
];

/// For each dimension and byte of the index, the exclusive or of the direction numbers of its set bits.
static SOBOL: [[[u32; 256]; 4]; SOBOL_DIMENSIONS as usize] = sobol_tables();

const fn direction_numbers(dimension: usize) -> [u32; 32] {
    let mut v = [0_u32; 32];
    let mut k = 0;
    if dimension == 0 {
        while k < 32 {
            v[k] = 1 << (31 - k);
            k += 1;
        }
        return v;
    }
    let (s, a, m) = JOE_KUO[dimension - 1];
    while k < 32 {
        if k < s {
            v[k] = m[k] << (31 - k);
        } else {
            v[k] = v[k - s] ^ (v[k - s] >> s);
            let mut j = 1;
            while j < s {
                if (a >> (s - 1 - j)) & 1 == 1 {
                    v[k] ^= v[k - j];
                }
                j += 1;
            }
        }
        k += 1;
    }
    v
}

const fn sobol_tables() -> [[[u32; 256]; 4]; SOBOL_DIMENSIONS as usize] {
    let mut tables = [[[0_u32; 256]; 4]; SOBOL_DIMENSIONS as usize];
    let mut d = 0;
    while d < SOBOL_DIMENSIONS as usize {
        let v = direction_numbers(d);
        let mut byte = 0;
        while byte < 4 {
            let mut value = 1_usize;
            while value < 256 {
                let low = value.trailing_zeros() as usize;
                tables[d][byte][value] = tables[d][byte][value & (value - 1)] ^ v[8 * byte + low];
                value += 1;
            }
            byte += 1;
        }
        d += 1;
    }
    tables
}

/// Maps the unit square to the unit disc with little distortion (Shirley and Chiu 1997).
#[must_use]
pub fn concentric_disc(u: glam::Vec2) -> glam::Vec2 {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};
    let p = u * 2.0 - 1.0;
    if p == glam::Vec2::ZERO {
        return p;
    }
    let (r, angle) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * (p.y / p.x))
    } else {
        (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y))
    };
    glam::Vec2::new(libm::cosf(angle), libm::sinf(angle)) * r
}

/// A direction uniform over the sphere.
#[must_use]
pub fn uniform_sphere(u: glam::Vec2) -> glam::Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let angle = std::f32::consts::TAU * u.y;
    glam::Vec3::new(r * libm::cosf(angle), r * libm::sinf(angle), z)
}

/// A direction uniform in the cone around the unit vector `axis` whose solid angle is 2π `height`; `height` is
/// 1 - cos of the angle between axis and side.
#[must_use]
pub fn cone_direction(axis: glam::DVec3, height: f64, u: glam::Vec2) -> glam::DVec3 {
    let below = f64::from(u.x) * height;
    let r = (below * (2.0 - below)).max(0.0).sqrt();
    let angle = std::f64::consts::TAU * f64::from(u.y);
    let (x, y) = axis.any_orthonormal_pair();
    (x * (r * libm::cos(angle)) + y * (r * libm::sin(angle)) + axis * (1.0 - below)).normalize()
}

/// A direction around `normal` with density cosθ / π.
#[must_use]
pub fn cosine_hemisphere(normal: glam::Vec3, u: glam::Vec2) -> glam::Vec3 {
    let disc = concentric_disc(u);
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let z = (1.0 - disc.length_squared()).max(0.0).sqrt();
    (tangent * disc.x + bitangent * disc.y + normal * z).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every elementary interval of the first two dimensions holds exactly one of the first 2^8 points: the
    /// (0, 2)-net property, which Owen scrambling keeps.
    #[test]
    fn the_first_two_dimensions_form_a_net_after_scrambling() {
        for seed in [0, 7, u64::MAX] {
            for across in 0..=8 {
                let (nx, ny) = (1_usize << across, 1_usize << (8 - across));
                let mut seen = vec![0; nx * ny];
                for i in 256..512 {
                    let p = SamplePoint::new(seed, i).get_2d(0);
                    seen[(p.x * nx as f32) as usize * ny + (p.y * ny as f32) as usize] += 1;
                }
                assert!(seen.iter().all(|&n| n == 1), "seed {seed}, {nx} x {ny}");
            }
        }
    }

    #[test]
    fn every_dimension_is_stratified() {
        for dimension in 0..SOBOL_DIMENSIONS {
            let mut seen = [0; 1024];
            for i in 0..1024 {
                seen[(SamplePoint::new(3, i).get(dimension) * 1024.0) as usize] += 1;
            }
            assert!(seen.iter().all(|&n| n == 1), "dimension {dimension}");
        }
    }

    /// Mean of N uniform numbers: standard deviation 1/sqrt(12 N); 5 sigma.
    #[test]
    fn later_dimensions_are_uniform() {
        let n = 65_536;
        let mean = (0..n).map(|i| f64::from(SamplePoint::new(1, i).get(40))).sum::<f64>() / f64::from(n);
        assert!((mean - 0.5).abs() < 5.0 / (12.0 * f64::from(n)).sqrt(), "{mean}");
    }
}
