//! How far the density estimate reaches: over what is curved, and whatever the pixels' size.

use crate::support::{block_means, estimates, floor, mean_over_square, render, scene};
use nephroid::light_path::PathClass;
use serde_json::{Value, json};
use std::f64::consts::PI;

/// Side of the pictures of the ball, pixels.
const SIDE: u32 = 24;

/// A ball of albedo 1/2 and radius 1 from above, of a radius of so many pixels, in a sun that comes through a sheet of index 1:
/// photons alone light it, by the cosine.
fn ball(pixels: f64, rule: Value) -> Value {
    let ball = json!({ "type": "sphere", "material": "floor", "center": [0, 0, 0], "radius": 1 });
    let sheet = json!({ "type": "box", "material": "air", "center": [0, 8, 0], "size": [2.4, 0.2, 2.4] });
    let camera = json!({ "type": "orthographic", "eye": [0, 2, 0], "target": [0, 0, 0], "up": [0, 0, -1],
                         "height": f64::from(SIDE) / pixels });
    let sun = json!([{ "type": "directional", "direction": [0, -1, 0], "irradiance": [1, 1, 1] }]);
    let mut value = scene(camera, json!([ball, sheet]), sun);
    value["image"] = json!({ "width": SIDE, "height": SIDE });
    value["render"]["radius"] = rule;
    value["render"]["paths"] = json!("LS+DE");
    value
}

/// What becomes of a ball of so many pixels.
struct Ball {
    /// Light within 0.7 of its radius over what is known.
    within: f64,
    /// Root mean square error of all pixels, relative as the render's own estimate is.
    error: f64,
    /// That estimate.
    own: f64,
}

impl Ball {
    fn render(pixels: f64, rule: Value, log2_photons: u32) -> Self {
        let render = render(&ball(pixels, rule), 1, 4, log2_photons);
        let shown = render.layer(PathClass::Caustic);
        let middle = 0.5 * f64::from(SIDE - 1);
        let place = |i: usize| {
            let (column, row) = (i as u32 % SIDE, i as u32 / SIDE);
            ((f64::from(column) - middle) / pixels, (f64::from(row) - middle) / pixels)
        };
        let cosine = |x: f64, z: f64| (1.0 - x * x - z * z).max(0.0).sqrt();
        let known = |i: usize| {
            let (x, z) = place(i);
            0.5 / PI * mean_over_square(x, z, 1.0 / pixels, cosine)
        };
        let light: Vec<[f64; 2]> =
            shown.pixels.iter().enumerate().map(|(i, p)| [f64::from(p[1]), known(i)]).collect();
        let inner = light.iter().enumerate().filter(|(i, _)| {
            let (x, z) = place(*i);
            x.hypot(z) < 0.7
        });
        let sums = inner.fold([0.0; 2], |sum, (_, l)| [sum[0] + l[0], sum[1] + l[1]]);
        let floor = 0.1 * light.iter().map(|l| l[1]).sum::<f64>() / light.len() as f64;
        let square =
            light.iter().map(|l| (l[0] - l[1]).powi(2) / (l[1].powi(2) + floor.powi(2))).sum::<f64>();
        Self {
            within: sums[0] / sums[1],
            error: (square / light.len() as f64).sqrt(),
            own: f64::from(render.error_estimate().unwrap()),
        }
    }
}

/// F51: on a ball whose radius is a few pixels a disc of radius r finds the photons of a cap of height r²/2R, whose shadow is
/// 1 - r²/4R² of the disc; those that lie on what is turned by more than 45° are another surface's. The default reaches over 0.7
/// pixels at most, with the kernel 1 - d²/r², which loses a third less; where it smooths, it stops where the light bends away,
/// and knows what that leaves.
#[test]
fn f51_a_ball_of_a_few_pixels_is_lit_by_the_cosine() {
    for pixels in [2.0, 3.0, 5.0, 8.0, 11.0] {
        let default = Ball::render(pixels, json!("pixel"), 10);
        let kernel = (0.7 / pixels).powi(2) / 6.0;
        // 2000 photons or more per m² and round: half a percent.
        assert!((default.within - 1.0).abs() < 1.5 * kernel + 5e-3, "{pixels}: {}", default.within);
        // Its estimate is an upper end of what 576 pixels, of which many are dark, tell.
        assert!(default.error < 1.5 * default.own, "{pixels}: {} {}", default.error, default.own);
        for (radius, known) in [(0.5, 1.0 - 0.25 * 0.25), (1.0, 0.5)] {
            let fixed = Ball::render(pixels, json!({ "fixed": radius }), 10);
            assert!((fixed.within - known).abs() < 5e-3, "{pixels}, {radius}: {}", fixed.within);
        }
    }
    // A fixed radius knows nothing of what it blurs away.
    let fixed = Ball::render(8.0, json!({ "fixed": 1.0 }), 10);
    assert!(fixed.error > 1.5 * fixed.own, "{} {}", fixed.error, fixed.own);
}

/// What a glass ball throws on the floor under it, in a square picture that is `side` pixels wide.
fn beneath_a_ball(side: u32, settings: (&str, Value)) -> Value {
    let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 0.9, 0], "radius": 0.5 });
    let lights = json!([{ "type": "point", "position": [0.9, 3, 0.3], "intensity": [1, 1, 1] }]);
    let camera = json!({ "type": "orthographic", "eye": [-0.4, 0.3, 0], "target": [-0.4, 0, 0], "up": [0, 0, -1], "height": 1 });
    let mut value = scene(camera, json!([floor(3.0, 0.0), ball]), lights);
    value["image"] = json!({ "width": side, "height": side });
    value["render"]["paths"] = json!("LS+DE");
    value["render"][settings.0] = settings.1;
    value
}

/// Means of the four quarters of the picture, with their channels.
fn quarters(side: u32, settings: (&str, Value), [rounds, log2_photons]: [u32; 2], seed: u64) -> Vec<f64> {
    let render = render(&beneath_a_ball(side, settings), seed, rounds, log2_photons);
    block_means(&render.image(), side as usize / 2)
}

/// F65: a first radius that is a hundred times too long leaves the classic progressive map with an error of another class, for
/// any budget. It is four pixels, so that a picture of fewer shows it. The default has no first radius: with pixels ten times as
/// wide, or as narrow, no more than twice the budget comes to the same error.
#[test]
fn f65_the_default_has_no_first_radius_to_get_wrong() {
    // Photons that are connected to the eye know no radius.
    let seeds = 100..116;
    let known: Vec<Vec<f64>> =
        seeds.map(|seed| quarters(20, ("caustics", json!("forward")), [2, 12], seed)).collect();
    let known: Vec<f64> = estimates(&known).iter().map(|e| e.mean).collect();
    let mean = known.iter().sum::<f64>() / known.len() as f64;
    let error = |rule: &str, side: u32, rounds: u32| {
        let squares: Vec<f64> = (1..=4)
            .flat_map(|seed| quarters(side, ("radius", json!(rule)), [rounds, 8], seed))
            .zip(known.iter().cycle())
            .map(|(found, known)| ((found - known) / (known + 0.1 * mean)).powi(2))
            .collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    let [narrow, wide] = [200, 2].map(|side| error("progressive", side, 8));
    assert!(wide > 10.0 * narrow && error("progressive", 2, 16) > 0.8 * wide, "{narrow} {wide}");
    let usual = error("pixel", 20, 4);
    for side in [2, 200] {
        let found = error("pixel", side, 8);
        // The error of an error of twelve values that hang together, four times, is about a quarter.
        assert!(found < 1.5 * usual, "{side}: {found} {usual}");
    }
}
