//! The materials of the scene file: exactly what the JSON says, nothing computed.

use super::Highlight;
use super::issue::IssueCode;
use super::json::{Node, Value};
use super::read::{
    Context, Decode, MAX_LENGTH, MIN_LENGTH, Scale, any_is, choice, color, count, name, object, optional, or,
    pair, real, record, reference, required, tagged,
};
use super::schema::Definitions;
use serde_json::json;

/// Largest index of refraction.
const MAX_INDEX: f64 = 100.0;

tagged! {
    /// A material.
    MaterialFile {
        "diffuse" => Diffuse(DiffuseFile),
        "mirror" => Mirror(MirrorFile),
        "metal" => Metal(MetalFile),
        "glass" => Glass(GlassFile),
        "phong" => Phong(PhongFile),
        "mix" => Mix(MixFile),
    }
}

record! {
    /// Lambertian reflection.
    DiffuseFile {
        /// Fraction of the light reflected.
        albedo: AlbedoFile = required(Albedo),
    }
}

/// A colour, or a pattern of colours.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum AlbedoFile {
    /// The same everywhere.
    Color([f64; 3]),
    /// `{"checker": {…}}`.
    Checker(CheckerFile),
    /// `{"image": …}`.
    Image(ImageTextureFile),
}

record! {
    /// A pattern in the place of a colour.
    PatternFile {
        /// A checkerboard.
        checker: CheckerFile = required(object::<CheckerFile>()),
    }
}

record! {
    /// A checkerboard. Texture coordinates u and v, of which v points up: on a polygon and on each side of a box
    /// metres from the first corner, u along the first edge; on a disk metres from its centre; on a height field
    /// metres; on a sphere and a cylinder once around and from bottom to top 0 to 1, u to the right seen from
    /// outside; on a mesh its own.
    CheckerFile {
        /// Colours of the even and the odd squares.
        colors: [[f64; 3]; 2] = required(pair(color("albedo").fraction())),
        /// Side of a square, in texture coordinates (metres on a polygon).
        size: f64 = required(real("side of a square").between(MIN_LENGTH, MAX_LENGTH)),
    }
}

record! {
    /// A picture in the place of a colour; it repeats on all sides. The checker says what the coordinates are.
    ImageTextureFile {
        /// A PNG or JPEG file, sRGB; transparency is left out.
        image: String = required(name()),
        /// Width and height of one copy of the picture in texture coordinates (metres on a polygon).
        scale: [f64; 2] = or(Scale, [1.0; 2]),
    }
}

record! {
    /// A perfect mirror.
    MirrorFile {
        /// Fraction of the light reflected.
        reflectance: [f64; 3] = required(color("reflectance").fraction()),
    }
}

record! {
    /// Metal: either `f0`, or `n` and `k`.
    MetalFile {
        /// Fraction of the light reflected at normal incidence; more at an angle by Schlick's approximation.
        f0: Option<[f64; 3]> = optional(color("reflectance").fraction()),
        /// Real part of the index of refraction, per channel; at an angle Fresnel's equations hold.
        n: Option<[f64; 3]> = optional(color("real part of the index of refraction").up_to(MAX_INDEX)),
        /// Imaginary part of the index of refraction, per channel.
        k: Option<[f64; 3]> = optional(color("imaginary part of the index of refraction").up_to(MAX_INDEX)),
        /// Roughness: 0 mirrors, 1 is dull. The width of the microfacets' GGX distribution is its square.
        roughness: f64 = or(real("roughness").between(0.0, 1.0), 0.0),
    }
}

record! {
    /// Glass, or a liquid. Light is taken for unpolarised at each of its surfaces: a pane at 60° lets 1.4 % less through than
    /// with its polarisation kept.
    GlassFile {
        /// Index of refraction; of a glass that disperses light by `abbe`, at the d line (587.6 nm).
        ior: f64 = required(real("index of refraction").above(0.0).at_most(MAX_INDEX)),
        /// Absorption coefficient per channel, m⁻¹: inside, light falls to 1/e over its reciprocal.
        absorption: [f64; 3] = or(color("absorption per metre").unit("m⁻¹"), [0.0; 3]),
        /// Abbe number (n_d - 1) / (n_F - n_C): the smaller, the wider the spectrum. About 64 for crown glass, 36 for
        /// flint glass, 56 for water.
        abbe: Option<f64> = optional(real("Abbe number").between(1.0, 1000.0)),
        /// Terms b and c of Cauchy's equation n = a + b/λ² + c/λ⁴, λ in μm, where a is `ior`; instead of `abbe`.
        cauchy: Option<[f64; 2]> = optional(pair(real("term of Cauchy's equation").between(0.0, 1.0))),
        /// Where glass and liquids overlap, the one of the highest priority is what is there; of equal ones the one
        /// that a ray has entered last. Draw a drink a little into the wall of its glass, and give the glass 1.
        priority: u32 = or(count("priority", 0, 1000), 0),
        /// Roughness: 0 is clear, 1 is dull. The width of the microfacets' GGX distribution is its square.
        roughness: f64 = or(real("roughness").between(0.0, 1.0), 0.0),
    }
}

record! {
    /// The illumination equation of Phong and Whitted, term by term: emission + ambient + for each light
    /// (k_d cos θ + k_s cosⁿ α) + k_r reflection + k_t transmission.
    PhongFile {
        /// Radiance of its own, W·sr⁻¹·m⁻²; seen, but not thrown on others.
        emission: [f64; 3] = or(color("emission"), [0.0; 3]),
        /// Ambient light, W·sr⁻¹·m⁻².
        ambient: [f64; 3] = or(color("ambient light"), [0.0; 3]),
        /// Share of the ambient light that is seen.
        k_a: [f64; 3] = or(color("share of the ambient light").fraction(), [0.0; 3]),
        /// Share scattered evenly: the albedo. Nothing if left out.
        k_d: Option<AlbedoFile> = optional(Albedo),
        /// Share of the highlight.
        k_s: [f64; 3] = or(color("share of the highlight").fraction(), [0.0; 3]),
        /// Sharpness of the highlight.
        n: f64 = or(real("exponent").between(0.0, 1e5), 20.0),
        /// The highlight as in the lecture (`lecture`: not weighted by the cosine of incidence, so that a surface lit at
        /// a slant can reflect more than it receives), or one that never does (`conserving`).
        highlight: Highlight = or(choice(Highlight::NAMED.to_vec()), Highlight::Lecture),
        /// Share mirrored.
        k_r: [f64; 3] = or(color("share mirrored").fraction(), [0.0; 3]),
        /// Share let through.
        k_t: [f64; 3] = or(color("share let through").fraction(), [0.0; 3]),
        /// Index of refraction for what is let through; 1 lets it go straight.
        ior: f64 = or(real("index of refraction").above(0.0).at_most(MAX_INDEX), 1.0),
    }
}

record! {
    /// So much of one material, and the rest of another.
    MixFile {
        /// Name of the first material.
        first: String = required(reference()),
        /// Name of the second material.
        second: String = required(reference()),
        /// Share of the second: one number for all, or a pattern whose brightness says it.
        amount: AmountFile = required(Amount),
    }
}

/// A number, or a pattern.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum AmountFile {
    /// The same everywhere.
    Number(f64),
    /// The mean of the pattern's channels.
    Pattern(AlbedoFile),
}

struct Albedo;

impl Decode for Albedo {
    type Out = AlbedoFile;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<AlbedoFile> {
        match &node.value {
            Value::Object(members) if any_is(members, "image") => {
                object::<ImageTextureFile>().decode(node, cx).map(AlbedoFile::Image)
            }
            Value::Object(members) if any_is(members, "checker") => {
                object::<PatternFile>().decode(node, cx).map(|p| AlbedoFile::Checker(p.checker))
            }
            Value::Object(_) => {
                cx.issue(IssueCode::MissingField, "expected a field `checker` or `image`");
                None
            }
            _ => color("albedo").fraction().decode(node, cx).map(AlbedoFile::Color),
        }
    }

    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value {
        let color = color("albedo").fraction().schema(definitions);
        let checker = object::<PatternFile>().schema(definitions);
        json!({ "anyOf": [color, checker, object::<ImageTextureFile>().schema(definitions)] })
    }
}

struct Amount;

impl Decode for Amount {
    type Out = AmountFile;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<AmountFile> {
        match node.value {
            Value::Object(_) => Albedo.decode(node, cx).map(AmountFile::Pattern),
            _ => real("share of the second").between(0.0, 1.0).decode(node, cx).map(AmountFile::Number),
        }
    }

    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value {
        let number = real("share of the second").between(0.0, 1.0).schema(definitions);
        let checker = object::<PatternFile>().schema(definitions);
        json!({ "anyOf": [number, checker, object::<ImageTextureFile>().schema(definitions)] })
    }
}
