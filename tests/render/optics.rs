//! S: mirror and glass against the formulas.

use glam::Vec3;
use nephroid::optics::{fresnel, reflect, refract};

/// Eight ulps of f32, as a relative tolerance for results of a few operations.
const EIGHT_ULPS: f32 = 8.0 * f32::EPSILON;

fn at_angle(degrees: f64) -> Vec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    glam::DVec3::new(sin, -cos, 0.0).as_vec3()
}

/// T7: Snell's law at 30° into n = 1.5 and back, and a unit vector in both cases.
#[test]
fn t7_refraction_obeys_snell_and_keeps_length() {
    assert!(((0.5_f64 / 1.5).asin().to_degrees() - 19.471_221).abs() < 1e-6);
    for n in [1.5_f32, 1.33, 2.418] {
        let out = (0.5 / f64::from(n)).asin().to_degrees();
        let inside = refract(at_angle(30.0), Vec3::Y, 1.0 / n).unwrap();
        let expected = at_angle(out);
        assert!((inside - expected).length() < EIGHT_ULPS, "{n}: {inside} {expected}");
        assert!((inside.length() - 1.0).abs() < EIGHT_ULPS);
        let back = refract(inside, Vec3::Y, n).unwrap();
        assert!((back - at_angle(30.0)).length() < EIGHT_ULPS, "{n}: {back}");
    }
}

/// T7: total internal reflection begins at the critical angle. The tolerance is the angle at which an ulp of
/// sin² reaches 1 (0.02°).
#[test]
fn t7_total_reflection_begins_at_the_critical_angle() {
    for (n, critical) in [(1.5, 41.810_315), (1.33, 48.753_467), (2.418, 24.428_976)] {
        assert!(refract(at_angle(critical - 0.02), Vec3::Y, n).is_some(), "{n}");
        assert!(refract(at_angle(critical + 0.02), Vec3::Y, n).is_none(), "{n}");
    }
}

/// F15: reflection keeps length, and mirrors, for either sign of the normal.
#[test]
fn f15_reflection_keeps_length_for_either_sign_of_the_normal() {
    for degrees in [0.0, 30.0, 60.0, 89.0] {
        let down = at_angle(degrees);
        let up = Vec3::new(down.x, -down.y, 0.0);
        for normal in [Vec3::Y, Vec3::NEG_Y] {
            assert!((reflect(down, normal) - up).length() < EIGHT_ULPS, "{degrees}");
        }
    }
}

/// T9: unpolarised reflectance of n = 1.5 from outside.
#[test]
fn t9_fresnel_from_outside() {
    let table: [(f64, f32); 8] = [
        (0.0, 0.04),
        (30.0, 0.041_523),
        (45.0, 0.050_240),
        (56.309_9, 0.073_964),
        (60.0, 0.089_187),
        (75.0, 0.253_061),
        (85.0, 0.612_800),
        (89.0, 0.904_185),
    ];
    for (degrees, expected) in table {
        let r = fresnel(degrees.to_radians().cos() as f32, 1.0 / 1.5);
        assert!((r - expected).abs() < 1e-6, "{degrees}: {r}");
    }
}

/// T10: from inside; 1 beyond the critical angle. The nearer to it, the less is left of 1 - n² sin² after rounding: an ulp of the
/// cosine is worth some 1e-6 at 40°, and at 41.8°, where the slope is steepest, 1e-4.
#[test]
fn t10_fresnel_from_inside() {
    for (degrees, expected, tolerance) in [
        (30.0, 0.055_190, 1e-6),
        (40.0, 0.245_291, 1e-5),
        (41.8, 0.890_772, 1e-3),
        (41.82, 1.0, 0.0),
        (80.0, 1.0, 0.0),
    ] {
        let r = fresnel(f64::to_radians(degrees).cos() as f32, 1.5);
        assert!((r - expected).abs() <= tolerance, "{degrees}: {r}");
    }
}

/// F18: where both sides have the same index nothing is reflected, at any angle.
#[test]
fn f18_equal_indices_reflect_nothing() {
    for cos in [0.0, 1e-8, 1e-3, 1.0] {
        assert_eq!(fresnel(cos, 1.0), 0.0);
    }
}

/// F17: toward the critical angle reflectance rises to 1 without a jump: 1 - R falls as the cosine of the refracted ray, the
/// square root of what the cosine inside is beyond its critical value.
#[test]
fn f17_reflectance_rises_to_one_without_a_jump() {
    let critical = (1.0 - 1.0 / 2.25_f64).sqrt();
    let mut last = 0.0;
    for step in (0..=40).rev() {
        let beyond = 2.0_f64.powi(step - 43);
        let r = fresnel((critical + beyond) as f32, 1.5);
        // cosθt = n sqrt((cosθ)² - (cosθc)²), and 1 - R = 2 cosθt (1/(n cosθ) + n/cosθ) up to its square.
        let cos_t = 1.5 * ((critical + beyond).powi(2) - critical * critical).sqrt();
        let slope = 2.0 / critical * (1.0 / 1.5 + 1.5);
        // An ulp of the cosine next to it is worth this much of its own.
        let rounding = slope * 1.5 * (4.0 * f64::from(f32::EPSILON)).sqrt();
        if cos_t < 0.05 {
            let gap = f64::from(1.0 - r);
            assert!(
                (gap - slope * cos_t).abs() < 0.1 * slope * cos_t + rounding,
                "{beyond}: {gap} {}",
                slope * cos_t
            );
        }
        assert!(r >= last, "{beyond}: {r} after {last}");
        last = r;
    }
    assert_eq!(fresnel((critical - 1e-6) as f32, 1.5), 1.0);
}

/// F16, F17, F19: at and beyond the critical angle and at grazing incidence everything is finite.
#[test]
fn f16_f17_f19_grazing_and_critical_incidence_are_finite() {
    for cos in [0.0, 1e-30, 1e-6, 0.745_355_96, 0.745_355_99, 0.745_356_1] {
        for eta in [1.5, 1.0 / 1.5] {
            let r = fresnel(cos, eta);
            assert!((0.0..=1.0).contains(&r), "{cos} {eta}: {r}");
            let direction = Vec3::new((1.0 - cos * cos).sqrt(), -cos, 0.0);
            if let Some(t) = refract(direction, Vec3::Y, eta) {
                assert!((t.length() - 1.0).abs() < EIGHT_ULPS && t.y <= 0.0, "{cos} {eta}: {t}");
            }
        }
    }
}
