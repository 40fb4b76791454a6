//! The penumbra of an edge under a square light, by the four ways to sample the light: how far each is off for the shadow
//! rays it takes, and how much its errors look alike from pixel to pixel.

use nephroid::image_io::LinearImage;
use nephroid::plan::Plan;
use nephroid::render::{Control, Render};
use nephroid::scene::{LightSampling, NoAssets, Scene};
use std::error::Error;
use std::fmt::Write as _;
use std::sync::Arc;

/// A floor seen from just below an edge that hides half of the light.
const SCENE: &str = r#"{ "nephroid": 1, "image": { "width": 96, "height": 72 },
  "camera": { "type": "perspective", "eye": [0, 0.9, 0], "target": [0, 0, 0], "up": [0, 0, -1], "fov": 70 },
  "materials": { "white": { "type": "diffuse", "albedo": [0.8, 0.8, 0.8] } },
  "objects": [
    { "type": "polygon", "material": "white", "vertices": [[-5, 0, 5], [5, 0, 5], [5, 0, -5], [-5, 0, -5]] },
    { "type": "polygon", "material": "white", "vertices": [[-9, 1, 9], [0.3, 1, 9], [-0.3, 1, -9], [-9, 1, -9]] } ],
  "lights": [{ "type": "quad", "center": [0, 3, 0], "size": [1.5, 1.5], "towards": [0, 0, 0], "radiance": [1, 1, 1] }],
  "render": { "stop": { "rounds": 1 } } }"#;

/// Rounds of the reference: its own error is that of the last point of the Sobol line, divided by 16.
const REFERENCE_ROUNDS: u32 = 1024;

/// One measurement.
struct Point {
    /// Shadow rays per pixel.
    rays: f64,
    /// RMS error over the mean of the reference.
    error: f64,
    /// Correlation of the errors of neighbours: 1 is a pattern, 0 is noise.
    likeness: f64,
}

/// A method and its measurements at growing effort.
struct Line {
    name: &'static str,
    color: &'static str,
    points: Vec<Point>,
}

/// All of them.
pub(crate) struct Chart {
    lines: Vec<Line>,
}

impl Chart {
    pub(crate) fn measure() -> Result<Self, Box<dyn Error>> {
        let (reference, _) = shown(LightSampling::Sobol, 1, REFERENCE_ROUNDS, 99)?;
        let colors = ["#2266cc", "#cc4422", "#998800", "#228844"];
        let mut lines = Vec::new();
        for ((name, method), color) in LightSampling::NAMED.into_iter().zip(colors) {
            let mut points = Vec::new();
            for step in 0..5 {
                let (grid, rounds) = match method {
                    LightSampling::Sobol => (1, 1 << (2 * step)),
                    LightSampling::Grid | LightSampling::Jittered | LightSampling::Adaptive => (1 << step, 1),
                };
                let (image, rays) = shown(method, grid, rounds, 1)?;
                points.push(Point::new(&image, &reference, rays));
            }
            lines.push(Line { name, color, points });
        }
        Ok(Self { lines })
    }

    /// Two panels: error, and likeness, against shadow rays.
    pub(crate) fn svg(&self) -> String {
        let mut svg = String::from(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 720 330\" font-family=\"sans-serif\" font-size=\"12\">\
             <rect width=\"720\" height=\"330\" fill=\"#fff\"/>\n",
        );
        let log = |x: f64, low: f64, high: f64| (x.clamp(low, high) / low).ln() / (high / low).ln();
        self.panel(&mut svg, 60.0, "RMS error / mean", &["0.001", "0.01", "0.1", "1"], |p| {
            log(p.error, 1e-3, 1.0)
        });
        self.panel(&mut svg, 420.0, "likeness of neighbours' errors", &["0", "0.5", "1"], |p| {
            p.likeness.clamp(0.0, 1.0)
        });
        svg.push_str("</svg>\n");
        svg
    }

    fn panel(
        &self,
        svg: &mut String,
        left: f64,
        title: &str,
        ticks: &[&str],
        height: impl Fn(&Point) -> f64,
    ) {
        let (width, tall, top) = (260.0, 220.0, 40.0);
        let x = |rays: f64| left + width * (rays.clamp(1.0, 1024.0)).log2() / 10.0;
        let y = |share: f64| top + tall * (1.0 - share);
        // Writing to a string cannot fail.
        let _ = writeln!(svg, "<text x=\"{left}\" y=\"24\" font-weight=\"bold\">{title}</text>");
        for (i, tick) in ticks.iter().enumerate() {
            let at = y(i as f64 / (ticks.len() - 1) as f64);
            let _ = writeln!(
                svg,
                "<line x1=\"{left}\" x2=\"{}\" y1=\"{at}\" y2=\"{at}\" stroke=\"#ccc\"/><text x=\"{}\" y=\"{}\" text-anchor=\"end\">{tick}</text>",
                left + width,
                left - 6.0,
                at + 4.0
            );
        }
        for power in [0, 2, 4, 6, 8, 10] {
            let at = x(f64::from(1 << power));
            let _ = writeln!(svg, "<text x=\"{at}\" y=\"276\" text-anchor=\"middle\">{}</text>", 1 << power);
        }
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"294\" text-anchor=\"middle\">shadow rays per pixel</text>",
            left + width / 2.0
        );
        for (i, line) in self.lines.iter().enumerate() {
            let path: Vec<String> =
                line.points.iter().map(|p| format!("{:.1},{:.1}", x(p.rays), y(height(p)))).collect();
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>",
                path.join(" "),
                line.color
            );
            for place in &path {
                let (cx, cy) = place.split_once(',').unwrap_or_default();
                let _ = writeln!(svg, "<circle cx=\"{cx}\" cy=\"{cy}\" r=\"3\" fill=\"{}\"/>", line.color);
            }
            let _ = writeln!(
                svg,
                "<text x=\"{}\" y=\"318\" fill=\"{}\">{}</text>",
                left + 66.0 * i as f64,
                line.color,
                line.name
            );
        }
    }

    /// The page's section with the chart and what it says.
    pub(crate) fn section(&self) -> String {
        let mut section = String::from(
            "## Shadow bands, noise, and the cure\n\n\
             | grid | jittered | adaptive | sobol |\n|---|---|---|---|\n\
             | ![bands](shadows-grid.png) | ![noise](shadows-jittered.png) | ![smooth](shadows-adaptive.png) | ![the default](shadows-sobol.png) |\n\n\
             A regular grid of points on the light gives every pixel the same shadow edges: bands. A random point in each of \
             its squares turns them into noise, which is smaller, which the eye forgives, and which more samples take away. \
             Adaptive division spends rays where the corners of a square disagree, but what is smaller than a square and \
             hides none of its corners is missed. The default takes one Owen-scrambled Sobol point per eye sample: noise that \
             falls faster than one over the root of the rays.\n\n![error and likeness](shadows.svg)\n\n\
             Measured in the penumbra of an edge; likeness is the correlation of what neighbouring pixels are off by: 1 is a \
             pattern, 0 is noise.\n\n| method | shadow rays per pixel | error | likeness |\n|---|---|---|---|\n",
        );
        for line in &self.lines {
            for p in &line.points {
                let _ = writeln!(
                    section,
                    "| {} | {:.0} | {:.4} | {:.2} |",
                    line.name, p.rays, p.error, p.likeness
                );
            }
        }
        section
    }
}

/// The picture by a method, and its shadow rays per pixel.
fn shown(
    method: LightSampling,
    grid: u32,
    rounds: u32,
    seed: u64,
) -> Result<(LinearImage, f64), Box<dyn Error>> {
    let mut scene = Scene::from_json(SCENE, &NoAssets)?;
    (scene.render.light_sampling, scene.render.light_grid, scene.render.seed) = (method, grid, seed);
    let scene = Arc::new(scene);
    let mut render = Render::new(Arc::clone(&scene), Plan::new(&scene));
    for _ in 0..rounds {
        render.run_round(&Control::new())?;
    }
    let image = render.image();
    let rays = render.stats().eye.shadow_rays as f64 / image.pixels.len() as f64;
    Ok((image, rays))
}

impl Point {
    fn new(image: &LinearImage, reference: &LinearImage, rays: f64) -> Self {
        let off: Vec<f64> =
            image.pixels.iter().zip(&reference.pixels).map(|(a, b)| f64::from(a[1] - b[1])).collect();
        let mean = reference.pixels.iter().map(|p| f64::from(p[1])).sum::<f64>() / off.len() as f64;
        let square: f64 = off.iter().map(|d| d * d).sum();
        let width = image.width as usize;
        let pairs: f64 =
            (0..off.len() - width).filter(|i| i % width + 1 < width).map(|i| off[i] * off[i + width]).sum();
        let error = (square / off.len() as f64).sqrt() / mean;
        Self { rays, error, likeness: if square > 0.0 { pairs / square } else { 0.0 } }
    }
}
