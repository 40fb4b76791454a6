//! The density estimate against brute force, on the inputs that break kd-trees.

use crate::support::{camera_above, compile, scene};
use glam::{Vec2, Vec3};
use nephroid::geometry::SheetId;
use nephroid::photon_map::{Lookup, Nearest, Photon, PhotonMap};
use nephroid::sampling::{SamplePoint, hash};
use serde_json::json;

fn photon(position: Vec3) -> Photon {
    Photon { position, direction: Vec3::NEG_Y, normal: Vec3::Y, sheet: SheetId(0), kind: 0, power: Vec3::ONE }
}

fn lookup(point: Vec3, radius: f32) -> Lookup {
    Lookup { point, normal: Vec3::Y, sheet: SheetId(0), radius, both_sides: false }
}

/// Photons that a look-up finds.
fn count_of(map: &PhotonMap, lookup: &Lookup) -> u32 {
    let count = std::cell::Cell::new(0);
    let _ = map.radiance(lookup, |_| {
        count.set(count.get() + 1);
        Vec3::ONE
    });
    count.get()
}

/// The estimate by testing every photon.
fn brute_force(photons: &[Photon], lookup: &Lookup) -> (u32, f64) {
    let r2 = f64::from(lookup.radius).powi(2);
    let near: Vec<f64> = photons
        .iter()
        .map(|p| p.position.as_dvec3().distance_squared(lookup.point.as_dvec3()))
        .filter(|d2| *d2 <= r2)
        .collect();
    let sum: f64 = near.iter().map(|d2| 1.0 - d2 / r2).sum();
    (near.len() as u32, sum * 2.0 / (std::f64::consts::PI * r2))
}

fn agrees_with_brute_force(photons: &[Photon], queries: impl Iterator<Item = Lookup>) {
    let map = PhotonMap::build(photons);
    assert_eq!(map.len(), photons.len());
    for query in queries {
        let found = map.irradiance(&query);
        let (count, value) = brute_force(photons, &query);
        // The tree's rotated coordinates are rounded: a photon at the very rim may be in or out.
        let photons = count_of(&map, &query);
        assert!(photons.abs_diff(count) <= 1 + count / 1000, "{query:?}: {photons} {count}");
        let tolerance = 1e-4 * value + 1e-3 / f64::from(query.radius).powi(2);
        assert!((f64::from(found.y) - value).abs() < tolerance, "{query:?}: {} {value}", found.y);
    }
}

fn plane_point(seed: u64, i: u32) -> Vec3 {
    let Vec2 { x, y } = SamplePoint::new(seed, i).get_2d(0);
    Vec3::new(x, 0.0, y)
}

/// F44: all photons on the floor y = 0.
#[test]
fn f44_photons_on_an_axis_parallel_floor_are_all_found() {
    let photons: Vec<Photon> = (0..20_000).map(|i| photon(plane_point(1, i))).collect();
    agrees_with_brute_force(&photons, (0..100).map(|i| lookup(plane_point(2, i), 0.03)));
}

/// F44: all photons on a line.
#[test]
fn f44_photons_on_a_line_are_all_found() {
    let photons: Vec<Photon> = (0..20_000).map(|i| photon(plane_point(1, i).with_z(0.0))).collect();
    agrees_with_brute_force(&photons, (0..100).map(|i| lookup(plane_point(2, i).with_z(0.0), 0.01)));
}

/// F44, F46: all photons at one point; the radius is given, so that nothing divides by their distance.
#[test]
fn f44_f46_identical_photons_are_all_found() {
    let photons = vec![photon(Vec3::new(0.3, 0.0, 0.7)); 10_000];
    agrees_with_brute_force(&photons, [lookup(Vec3::new(0.3, 0.0, 0.7), 0.01)].into_iter());
    let beside = count_of(&PhotonMap::build(&photons), &lookup(Vec3::new(0.4, 0.0, 0.7), 0.01));
    assert_eq!(beside, 0);
}

/// F45: no photon, one photon, and radii without size.
#[test]
fn f45_few_photons_and_empty_radii_give_finite_estimates() {
    let none = PhotonMap::build(Vec::<Photon>::new());
    assert!(none.is_empty());
    assert_eq!(none.irradiance(&lookup(Vec3::ZERO, 1.0)), Vec3::ZERO);
    agrees_with_brute_force(&[photon(Vec3::ZERO)], [lookup(Vec3::new(0.5, 0.0, 0.0), 1.0)].into_iter());
    let one = PhotonMap::build([photon(Vec3::ZERO)]);
    for radius in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-30] {
        assert_eq!(one.irradiance(&lookup(Vec3::ZERO, radius)), Vec3::ZERO, "{radius}");
    }
}

/// Photons that are not finite are left out, and a query that is not finite finds nothing.
#[test]
fn photons_that_are_not_finite_are_left_out() {
    let mut photons: Vec<Photon> = (0..1000).map(|i| photon(plane_point(3, i))).collect();
    photons[17].position.x = f32::NAN;
    photons[18].position.y = f32::INFINITY;
    photons[19].power.z = f32::NAN;
    let map = PhotonMap::build(&photons);
    assert_eq!(map.len(), 997);
    assert!(map.irradiance(&lookup(Vec3::splat(0.5).with_y(0.0), 0.5)).is_finite());
    assert_eq!(count_of(&map, &lookup(Vec3::NAN, 0.5)), 0);
}

/// F49, T39: photons on the other side of a sheet, on another sheet, or on a wall do not count.
#[test]
fn f49_photons_of_other_surfaces_do_not_count() {
    let here = Vec3::new(0.5, 0.0, 0.5);
    let from_below = Photon { direction: Vec3::Y, ..photon(here) };
    let other_sheet = Photon { sheet: SheetId(1), ..photon(here) };
    let wall = Photon { normal: Vec3::X, direction: Vec3::new(-0.8, -0.6, 0.0), ..photon(here) };
    let above = photon(here + Vec3::Y * 0.09);
    for stranger in [from_below, other_sheet, wall, above] {
        let found = count_of(&PhotonMap::build([stranger]), &lookup(here, 0.1));
        assert_eq!(found, 0, "{stranger:?}");
    }
    assert_eq!(count_of(&PhotonMap::build([photon(here)]), &lookup(here, 0.1)), 1);
}

/// The kernel is unbiased where the density is uniform: n photons on the unit square make n per area. Standard
/// deviation of one look-up: sqrt(4 / (3 N)) of the mean for N photons within the radius.
#[test]
fn the_density_of_uniform_photons_is_their_number() {
    let n = 65_536;
    let photons: Vec<Photon> = (0..n).map(|i| photon(plane_point(4, i))).collect();
    let map = PhotonMap::build(&photons);
    let queries = 400;
    let radius = 0.05_f32;
    let sum: f64 = (0..queries)
        .map(|i| plane_point(5, i) * 0.8 + Vec3::new(0.1, 0.0, 0.1))
        .map(|p| f64::from(map.irradiance(&lookup(p, radius)).y))
        .sum();
    let within = f64::from(n) * std::f64::consts::PI * f64::from(radius * radius);
    let sigma = (4.0 / (3.0 * within) / f64::from(queries)).sqrt();
    let relative = sum / f64::from(queries) / f64::from(n) - 1.0;
    assert!(relative.abs() < 5.0 * sigma, "{relative} {sigma}");
}

const K: usize = 10;

fn nearest(map: &PhotonMap, point: Vec3, most: f32, count: usize, least: f32) -> (f64, bool) {
    let found = map.nearest_radiance(&lookup(point, most), Nearest { count, least }, |_| Vec3::ONE);
    (f64::from(found.radiance.y), found.short)
}

/// Photons at random, not at low-discrepancy points: each has a sequence of its own.
fn scattered(n: u32, seed: u64) -> Vec<Photon> {
    (0..n).map(|i| photon(plane_point(hash(seed, u64::from(i)), 1))).collect()
}

/// T37: where n photons lie at random on a unit square, the mean of k/(πr²) would be n k/(k - 1), 25 % too much for
/// k = 5; the estimate leaves the k-th out, and its mean is n. Its relative standard deviation is 1/sqrt(k - 2). One look-up per map,
/// so that look-ups are independent; 4 standard errors of 4096 (the deviation's own is a few per cent).
#[test]
fn t37_the_nearest_photons_without_the_last_are_unbiased() {
    let maps = 4096;
    let n = 400;
    for k in [5, 10, 50] {
        let values: Vec<f64> = (0..maps)
            .map(|seed| {
                let map = PhotonMap::build(scattered(n, hash(k as u64, seed)));
                nearest(&map, Vec3::new(0.5, 0.0, 0.5), 0.5, k, 1e-4).0 / f64::from(n)
            })
            .collect();
        let mean = values.iter().sum::<f64>() / maps as f64;
        let deviation = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / maps as f64).sqrt();
        let k = k as f64;
        let expected = 1.0 / (k - 2.0).sqrt();
        let error = expected / (maps as f64).sqrt();
        assert!((mean - 1.0).abs() < 4.0 * error, "k = {k}: {mean}, deviation {deviation}");
        // A finite number of photons in the square (binomial, not Poisson) takes off a little: k/(2n).
        assert!((deviation / expected - 1.0).abs() < 0.15 + k / f64::from(2 * n), "k = {k}: {deviation}");
    }
}

/// F45, F47: fewer photons than asked for count over the look-up's disc, however far apart they lie, and are told of.
#[test]
fn f45_f47_fewer_photons_than_asked_for_do_not_blur_beyond_the_greatest_radius() {
    let dark: Vec<Photon> = [0.1, 0.2, 3.0].map(|x| photon(Vec3::new(x, 0.0, 0.0))).into_iter().collect();
    let map = PhotonMap::build(&dark);
    let disc = |count: f64, radius: f64| count / (std::f64::consts::PI * radius * radius);
    let (near, short) = nearest(&map, Vec3::ZERO, 0.5, K, 0.01);
    assert!(short && (near / disc(2.0, 0.5) - 1.0).abs() < 1e-5, "{near}");
    assert_eq!(nearest(&map, Vec3::new(1.5, 0.0, 0.0), 0.5, K, 0.01), (0.0, true));
    assert_eq!(nearest(&PhotonMap::build(Vec::<Photon>::new()), Vec3::ZERO, 0.5, K, 0.01), (0.0, true));
    let (alone, short) = nearest(&PhotonMap::build(&dark[..1]), Vec3::ZERO, 0.5, K, 0.01);
    assert!(short && (alone / disc(1.0, 0.5) - 1.0).abs() < 1e-5, "{alone}");
    for radius in [0.0, -1.0, f32::NAN] {
        assert_eq!(nearest(&map, Vec3::ZERO, radius, K, 0.01).0, 0.0, "{radius}");
    }
}

/// F46: photons at one point have no distance to divide by: they count over the least disc.
#[test]
fn f46_identical_photons_are_spread_over_the_least_disc() {
    let at = Vec3::new(0.3, 0.0, 0.7);
    let map = PhotonMap::build(vec![photon(at); 100]);
    let (value, short) = nearest(&map, at, 0.5, K, 0.01);
    let expected = 100.0 / (std::f64::consts::PI * 1e-4);
    assert!(!short && (value / expected - 1.0).abs() < 1e-5, "{value} {expected}");
}

/// F48: photons at equal distances are told apart by what they carry, so that any order of storing gives the same bits.
#[test]
fn f48_ties_at_the_last_distance_do_not_depend_on_the_order_of_storing() {
    // Axis-parallel steps of 1/8 from a point of the same grid: 24 photons at each of few distances, of unlike powers.
    let mut photons: Vec<Photon> = (0..1024)
        .map(|i| {
            let at = Vec3::new((i % 32) as f32, 0.0, (i / 32) as f32) / 8.0;
            Photon { power: Vec3::splat(1.0 + (i * 7 % 11) as f32), ..photon(at) }
        })
        .collect();
    let center = Vec3::new(2.0, 0.0, 2.0);
    let estimate =
        |photons: &[Photon]| nearest(&PhotonMap::build(photons), center, 2.0, 12, 1e-3).0.to_bits();
    let first = estimate(&photons);
    photons.reverse();
    assert_eq!(estimate(&photons), first);
    photons
        .sort_by_key(|p| hash(1, u64::from(p.position.x.to_bits() ^ p.position.z.to_bits().rotate_left(9))));
    assert_eq!(estimate(&photons), first);
}

/// F52: nothing is dropped where photons lie dense: a million at a spot count as a million.
#[test]
fn f52_no_photon_is_dropped_where_they_lie_dense() {
    let n = 1_000_000;
    let photons: Vec<Photon> = (0..n).map(|i| photon(plane_point(6, i) * 0.01)).collect();
    let map = PhotonMap::build(&photons);
    let inside = lookup(Vec3::new(0.005, 0.0, 0.005), 0.02);
    assert_eq!(count_of(&map, &inside), n);
    let flux = map.disc_radiance(&inside, |_| Vec3::ONE).y * std::f32::consts::PI * 4e-4;
    // A million additions in f32, 6e-8 each at worst in one direction.
    assert!((f64::from(flux) / f64::from(n) - 1.0).abs() < 1e-2, "{flux}");
}

/// Mean of the disc's estimate of a unit density on x > 0 over many maps, at `s` radii from its edge.
fn beside_an_edge(s: f32, photons: impl Fn(u64) -> Vec<Photon>) -> f64 {
    let radius = 0.2_f32;
    let maps = 64;
    let sum: f64 = (0..maps)
        .map(|seed| {
            let list = photons(seed);
            let per_area = list.len() as f64;
            let point = lookup(Vec3::new(s * radius, 0.0, 0.5), radius);
            f64::from(PhotonMap::build(&list).disc_radiance(&point, |_| Vec3::ONE).y) / per_area
        })
        .sum();
    sum / f64::from(maps as u32)
}

/// T38: the point estimate of a uniform density loses light near a straight edge, s radii inside: the share of the disc
/// that lies on the surface. 64 maps of 4000 photons, 500 of them in the disc: a standard error of 0.6 %.
#[test]
fn t38_the_point_estimate_loses_the_known_light_at_a_border() {
    for (s, expected) in [(0.0, 0.5), (0.25, 0.6575), (0.5, 0.8045), (0.75, 0.9279), (1.0, 1.0)] {
        let mean = beside_an_edge(s, |seed| scattered(4000, hash(38, seed)));
        assert!((mean - expected).abs() < 0.02, "{s}: {mean}, expected {expected}");
    }
}

/// T39: beyond the edge it finds the light that leaks over: what is missing inside. On another sheet or from another
/// side, none.
#[test]
fn t39_light_leaks_over_a_shadows_edge_but_not_through_a_wall() {
    for (s, expected) in [(0.0, 0.5), (0.25, 0.3425), (0.5, 0.1955), (0.75, 0.0721)] {
        let mean = beside_an_edge(-s, |seed| scattered(4000, hash(39, seed)));
        assert!((mean - expected).abs() < 0.02, "{s}: {mean}, expected {expected}");
        let of_another = |change: fn(&mut Photon)| {
            beside_an_edge(-s, |seed| {
                let mut photons = scattered(4000, hash(39, seed));
                photons.iter_mut().for_each(change);
                photons
            })
        };
        assert_eq!(of_another(|p| p.sheet = SheetId(1)), 0.0);
        assert_eq!(of_another(|p| p.direction = Vec3::Y), 0.0);
        assert_eq!(of_another(|p| p.normal = Vec3::X), 0.0);
    }
}

/// T40: at the peak of E = 1 + cos(2πx) with the radius that suits N photons, r ~ N^(-1/6), the squared error falls as
/// N^(-2/3). Over two decades of N, 400 maps each: the error of the mean square is sqrt(2/400) = 7 %, that of the slope
/// 0.07 sqrt(2) / ln(100) = 0.022, and 0.05 is allowed for bias at the smallest N.
#[test]
fn t40_the_squared_error_falls_with_the_known_power_of_the_photons() {
    // Variance E/(N π r²) against the bias -E″r²/8 = -(2π)² r²/8 of a disc, E = 2: r⁶ = 2 · 2 / (2 N π b²).
    let b = (2.0 * std::f64::consts::PI).powi(2) / 8.0;
    let radius = |n: f64| (2.0 / (2.0 * n * std::f64::consts::PI * b * b)).powf(1.0 / 6.0);
    let squared_error = |n: u32| {
        let maps = 400;
        let r = radius(f64::from(n)) as f32;
        let sum: f64 = (0..maps)
            .map(|seed| {
                let mut photons = scattered(2 * n, hash(u64::from(n), seed));
                let mut keep = 0_u64;
                photons.retain(|p| {
                    keep += 1;
                    let density =
                        1.0 + f64::from(p.position.x - 0.5).mul_add(std::f64::consts::TAU, 0.0).cos();
                    f64::from(SamplePoint::new(hash(seed, keep), 1).get(2)) < 0.5 * density
                });
                let at = lookup(Vec3::new(0.5, 0.0, 0.5), r);
                let value = f64::from(PhotonMap::build(&photons).disc_radiance(&at, |_| Vec3::ONE).y);
                (value / f64::from(n) - 2.0).powi(2)
            })
            .sum();
        sum / f64::from(maps as u32)
    };
    let (few, many) = (300, 30_000);
    let slope = (squared_error(many) / squared_error(few)).ln() / (f64::from(many) / f64::from(few)).ln();
    assert!((slope + 2.0 / 3.0).abs() < 0.11, "{slope}");
}

/// F50: at a border the kernel is divided by its mass on the surface, so that a uniform density stays uniform up to the
/// edge. 64 maps of 4000 photons, 250 or more of them in the kernel: a standard error of 1 %.
#[test]
fn f50_the_kernels_mass_takes_the_bias_at_a_border_away() {
    let square = json!({ "name": "square", "type": "polygon", "material": "floor",
                         "vertices": [[0, 0, 1], [1, 0, 1], [1, 0, 0], [0, 0, 0]] });
    let geometry =
        compile(&scene(camera_above([0.5, 0.0, 0.5], 1.0, 1.0), json!([square]), json!([]))).geometry;
    let radius = 0.2;
    for (x, z) in [(0.0, 0.5), (0.05, 0.5), (0.1, 0.5), (0.0, 0.0), (0.5, 0.5)] {
        let point = Vec3::new(x, 0.0, z);
        let mass = geometry.kernel_mass(SheetId(0), point, radius, 0.0);
        let sum: f64 = (0..64)
            .map(|seed| PhotonMap::build(scattered(4000, hash(50, seed))).irradiance(&lookup(point, radius)))
            .map(|irradiance| f64::from(irradiance.y / mass) / 4000.0)
            .sum();
        assert!((sum / 64.0 - 1.0).abs() < 0.05, "{x} {z}: {}", sum / 64.0);
    }
}
