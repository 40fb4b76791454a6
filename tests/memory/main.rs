//! Memory of a photon map. The one test has its process to itself: it asks the system for the most that this has held.

use glam::Vec3;
use nephroid::geometry::SheetId;
use nephroid::photon_map::{BYTES_PER_PHOTON, Lookup, Photon, PhotonMap};
use nephroid::sampling::SamplePoint;

const PHOTONS: u32 = 10_000_000;

/// On a floor, in the order of a sequence, as pass 1 gives them.
fn photon(index: u32) -> Photon {
    let at = SamplePoint::new(1, index).get_2d(0);
    Photon {
        position: Vec3::new(at.x, 0.0, at.y),
        direction: Vec3::NEG_Y,
        normal: Vec3::Y,
        sheet: SheetId(0),
        kind: 0,
        power: Vec3::splat(1.0 / PHOTONS as f32),
    }
}

/// Bytes of a line of the process's status; `None` where the system does not tell.
fn resident(line: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let value = status.lines().find_map(|l| l.strip_prefix(line))?;
    value.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kibibytes| kibibytes * 1024)
}

/// The list that is given away, the entries that it becomes in its own memory, and the tree: together less than a gigabyte.
#[test]
fn a_map_of_ten_million_photons_is_built_within_a_gigabyte() {
    let before = resident("VmRSS");
    let map = PhotonMap::build((0..PHOTONS).map(photon).collect::<Vec<_>>());
    assert_eq!(map.len(), PHOTONS as usize);
    let here = Vec3::new(0.5, 0.0, 0.5);
    let lookup = Lookup { point: here, normal: Vec3::Y, sheet: SheetId(0), radius: 0.1, both_sides: false };
    let irradiance = map.irradiance(&lookup).y;
    assert!((irradiance - 1.0).abs() < 0.01, "{irradiance}");
    let (Some(before), Some(after), Some(most)) = (before, resident("VmRSS"), resident("VmHWM")) else {
        return;
    };
    let each = (after - before) as f64 / f64::from(PHOTONS);
    eprintln!("{each:.1} bytes per photon, {} MB at most", most / 1_000_000);
    assert!(most < 1_000_000_000, "{most}");
    // Beyond what a photon is: the planes of the tree, one for 16 photons or more, and pages at the ends of arrays.
    assert!((each - BYTES_PER_PHOTON as f64).abs() < 4.0, "{each} bytes per photon");
}
