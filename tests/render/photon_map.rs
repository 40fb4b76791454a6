//! The density estimate against brute force, on the inputs that break kd-trees.

use glam::{Vec2, Vec3};
use nephroid::geometry::SheetId;
use nephroid::photon_map::{Lookup, Photon, PhotonMap};
use nephroid::sampling::SamplePoint;

fn photon(position: Vec3) -> Photon {
    Photon { position, direction: Vec3::NEG_Y, normal: Vec3::Y, sheet: SheetId(0), power: Vec3::ONE }
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
    let none = PhotonMap::build(&[]);
    assert!(none.is_empty());
    assert_eq!(none.irradiance(&lookup(Vec3::ZERO, 1.0)), Vec3::ZERO);
    agrees_with_brute_force(&[photon(Vec3::ZERO)], [lookup(Vec3::new(0.5, 0.0, 0.0), 1.0)].into_iter());
    let one = PhotonMap::build(&[photon(Vec3::ZERO)]);
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
        let found = count_of(&PhotonMap::build(&[stranger]), &lookup(here, 0.1));
        assert_eq!(found, 0, "{stranger:?}");
    }
    assert_eq!(count_of(&PhotonMap::build(&[photon(here)]), &lookup(here, 0.1)), 1);
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
