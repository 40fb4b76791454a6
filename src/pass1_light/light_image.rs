//! Pass 1, `LS+D`, of lights with a surface: the image of the light that each point of a window throws.
//!
//! A plain photon comes from one point of the light. All points of the light, through the same point of the window,
//! land on one patch of the receiver: the light's image, whose corners are where the rays from the light's corners
//! land. The flux through that point of the window is spread evenly over the patch, so that the light's extent is
//! integrated and only the window, two dimensions, is left to sampling; no kernel blurs.
//!
//! The light is quartered where the map from light to receiver is not linear to a fraction of a pixel, or where its
//! corners' rays take other ways; where quarters of quarters do not agree, one random point of the light stands for
//! the rest, as in a plain photon. All rays of an image are drawn with the same random numbers: each is a plain photon's
//! way from its point of the light, and the mean over the light has the plain photons' expectation.

use super::emit::{Aim, Emission};
use super::energy::Tally;
use super::walk::{PhotonWalk, Step};
use crate::geometry::SheetId;
use crate::light_path::Kind;
use crate::photon_map::Photon;
use crate::sampling::{SamplePoint, hash};
use crate::scene::Camera;
use glam::{Vec2, Vec3};

/// Flux spread evenly over a quadrilateral on a receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightImage {
    /// Its corners, in order around it.
    pub corners: [Vec3; 4],
    /// Unit direction in which the light travelled, in the middle.
    pub direction: Vec3,
    /// Unit geometric normal of the surface, in the middle.
    pub normal: Vec3,
    /// The sheet of surface it lies on.
    pub sheet: SheetId,
    /// Which light it is, and what it has met.
    pub kind: Kind,
    /// Power per channel, W.
    pub power: Vec3,
}

/// The light of some photons in images where there are, in points elsewhere.
#[derive(Clone, Debug, Default)]
pub struct Spread {
    /// Light spread over patches.
    pub images: Vec<LightImage>,
    /// Light at points.
    pub points: Vec<Photon>,
}

/// The light is quartered at most this often; then chance decides.
const MOST_DEPTH: u32 = 2;

/// How far the probe may land from where it would between the corners' landing points, in pixels. So far off may the light
/// of a focus be that is smaller than a pixel.
const STRAIGHTNESS: f32 = 0.1;

/// A part of a light is probed at one of these points, by chance. In the middle what is odd would not show (three images
/// of one point near a cusp), on the diagonals not a saddle, which is 0 there as at the corners.
const PROBES: [(f32, f32); 4] = [(0.275, 0.1), (0.9, 0.275), (0.725, 0.9), (0.1, 0.725)];

/// What the mean of a quadratic map over a square is beyond that of its corners, over what it is beyond them at a
/// probe, in the mean over the probes: of a square, -2/3 over the mean of 0.45² - 1 and 0.8² - 1.
const MEAN_OVER_PROBE: f32 = 1.152;

/// Tells the stream that draws the probe from the others.
const PROBE_STREAM: u64 = 0x9_0be;

/// Draws light images for one window.
pub(super) struct ImageTracer<'a> {
    pub(super) emission: &'a Emission<'a>,
    pub(super) walk: &'a PhotonWalk<'a>,
    pub(super) camera: &'a Camera,
}

/// A point of a window's sequence.
#[derive(Clone, Copy)]
pub(super) struct Shot {
    pub(super) sample: SamplePoint,
    pub(super) aim: Aim,
    /// Share of the window's flux.
    pub(super) share: f32,
    pub(super) time: f32,
}

/// Where the ray from one point of the light lands.
#[derive(Clone, Copy, Debug)]
enum Node {
    /// On no D.
    Dark,
    /// On one D; the number names the way there.
    Lands(Photon, u64),
    /// On several D: some surface on the way is partly S.
    Scatters,
}

/// A square part of the light, in its unit square.
#[derive(Clone, Copy)]
struct Part {
    corner: Vec2,
    side: f32,
    depth: u32,
}

impl Spread {
    /// Takes all of another's light.
    pub fn append(&mut self, other: &mut Self) {
        self.images.append(&mut other.images);
        self.points.append(&mut other.points);
    }
}

impl ImageTracer<'_> {
    /// Traces the light's image through one point of the window.
    /// Returns the number of rays it took.
    pub(super) fn trace(&self, shot: Shot, spread: &mut Spread) -> u64 {
        let whole = Part { corner: Vec2::ZERO, side: 1.0, depth: 0 };
        let mut tally = Tally::default();
        let nodes = whole.corners().map(|at| self.node(&shot, at, &mut tally));
        self.spread(&shot, whole, nodes, (&mut tally, spread));
        tally.rays
    }

    fn spread(&self, shot: &Shot, part: Part, nodes: [Node; 4], (tally, spread): (&mut Tally, &mut Spread)) {
        let (x, y) = PROBES[(shot.sample.branch(PROBE_STREAM).get(0) * 4.0) as usize];
        let probe = self.node(shot, part.at(x, y), tally);
        if let Some(image) = self.image(&nodes, (&probe, x, y), part) {
            spread.images.push(image);
            return;
        }
        let lit = |node: &Node| matches!(node, Node::Lands(..));
        let hopeless = part.depth >= MOST_DEPTH
            || matches!(probe, Node::Scatters)
            || !(lit(&probe) || nodes.iter().any(lit));
        if hopeless {
            self.plain(shot, part, (tally, spread));
            return;
        }
        let between = [(0.5, 0.0), (1.0, 0.5), (0.5, 1.0), (0.0, 0.5)];
        let between = between.map(|(x, y)| self.node(shot, part.at(x, y), tally));
        let middle = self.node(shot, part.at(0.5, 0.5), tally);
        for (i, quarter) in part.quarters().into_iter().enumerate() {
            // In a quarter, the corner that it shares with the whole keeps its number.
            let mut around = [middle; 4];
            around[i] = nodes[i];
            around[(i + 1) % 4] = between[i];
            around[(i + 3) % 4] = between[(i + 3) % 4];
            self.spread(shot, quarter, around, (tally, spread));
        }
    }

    /// The image of a part of the light; `None` if its rays do not go one way, or bend too much.
    fn image(&self, nodes: &[Node; 4], (probe, x, y): (&Node, f32, f32), part: Part) -> Option<LightImage> {
        let Node::Lands(probe, way) = probe else { return None };
        let mut corners = [Vec3::ZERO; 4];
        let mut powers = [Vec3::ZERO; 4];
        for ((corner, power), node) in corners.iter_mut().zip(&mut powers).zip(nodes) {
            match node {
                Node::Lands(photon, same) if same == way => {
                    (*corner, *power) = (photon.position, photon.power);
                }
                Node::Lands(..) | Node::Dark | Node::Scatters => return None,
            }
        }
        let expected = |[a, b, c, d]: [Vec3; 4]| a.lerp(b, x).lerp(d.lerp(c, x), y);
        let bend = probe.position - expected(corners);
        let depth = (probe.position - self.camera.eye).dot(self.camera.forward);
        let pixel = self.camera.pixel_width(depth.max(0.0));
        if bend.length() > STRAIGHTNESS * pixel && !self.out_of_view(&corners) {
            return None;
        }
        let shift = bend * MEAN_OVER_PROBE + lean(&corners, &powers);
        let corners = corners.map(|corner| corner + shift);
        let mean = powers.iter().sum::<Vec3>() / 4.0 + (probe.power - expected(powers)) * MEAN_OVER_PROBE;
        let Photon { direction, normal, sheet, kind, .. } = *probe;
        Some(LightImage { corners, direction, normal, sheet, kind, power: mean * (part.side * part.side) })
    }

    /// True if all corners lie beyond one border of the picture.
    fn out_of_view(&self, corners: &[Vec3; 4]) -> bool {
        let size = self.camera.resolution;
        let [Some(a), Some(b), Some(c), Some(d)] = corners.map(|corner| self.camera.raster(corner)) else {
            return false;
        };
        let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        high.cmplt(Vec2::ZERO).any() || low.cmpgt(size).any()
    }

    /// One random point of a part of the light stands for all of it.
    fn plain(&self, shot: &Shot, part: Part, (tally, spread): (&mut Tally, &mut Spread)) {
        let u = shot.sample.get_2d(2);
        let Some(mut photon) = self.emission.emit(shot.aim, part.at(u.x, u.y), shot.time) else { return };
        photon.power *= shot.share * part.side * part.side;
        self.walk.trace(photon, shot.sample, tally, |step| match step {
            Step::Rests(photon) => spread.points.push(photon),
            Step::Meets(..) => {}
        });
    }

    fn node(&self, shot: &Shot, at: Vec2, tally: &mut Tally) -> Node {
        let Some(mut photon) = self.emission.emit(shot.aim, at, shot.time) else { return Node::Dark };
        photon.power *= shot.share;
        let mut node = Node::Dark;
        let mut way = 0;
        self.walk.trace(photon, shot.sample, tally, |step| match step {
            Step::Meets(object, event) => way = hash(way, u64::from(object.0) << 1 | event as u64),
            Step::Rests(photon) => {
                node = match node {
                    Node::Dark => Node::Lands(photon, hash(way, u64::from(photon.sheet.0))),
                    Node::Lands(..) | Node::Scatters => Node::Scatters,
                }
            }
        });
        node
    }
}

/// How far the light of an image, whose power varies linearly from corner to corner, is centred from its middle: the
/// image is spread evenly, so that it is moved there. A focus would else lie some hundredths of a pixel aside.
fn lean(corners: &[Vec3; 4], powers: &[Vec3; 4]) -> Vec3 {
    let strengths = powers.map(|power| power.element_sum());
    let strength = strengths.iter().sum::<f32>() / 4.0;
    if strength <= 0.0 {
        return Vec3::ZERO;
    }
    let middle = corners.iter().sum::<Vec3>() / 4.0;
    // Of 1 + g s over -h..h, the mean of h s is g h / 3; the corners' sum is 4 g h.
    let pull = |(corner, s): (&Vec3, f32)| (*corner - middle) * (s / strength - 1.0);
    corners.iter().zip(strengths).map(pull).sum::<Vec3>() / 12.0
}

impl Part {
    fn at(self, x: f32, y: f32) -> Vec2 {
        self.corner + Vec2::new(x, y) * self.side
    }

    fn corners(self) -> [Vec2; 4] {
        [self.at(0.0, 0.0), self.at(1.0, 0.0), self.at(1.0, 1.0), self.at(0.0, 1.0)]
    }

    /// Its quarters, each at the corner of its number.
    fn quarters(self) -> [Self; 4] {
        [(0.0, 0.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5)].map(|(x, y)| Self {
            corner: self.at(x, y),
            side: 0.5 * self.side,
            depth: self.depth + 1,
        })
    }
}
