//! Decoders of numbers, points, directions and colours.

use super::super::issue::IssueCode;
use super::super::json::{Node, Value};
use super::{Context, Decode, Step, quoted};
use crate::develop::srgb_to_linear;

/// Largest coordinate or length, in metres: its fourth power is still a float.
pub(in crate::scene) const MAX_LENGTH: f64 = 1e9;
/// Smallest length above zero, in metres.
pub(in crate::scene) const MIN_LENGTH: f64 = 1e-9;
/// Largest amount of light per channel, in whatever unit.
const MAX_LIGHT: f64 = 1e12;

/// A real number within limits.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene) struct Real {
    what: &'static str,
    low: Bound,
    high: Bound,
}

#[derive(Clone, Copy, Debug)]
enum Bound {
    Closed(f64),
    Open(f64),
}

/// Any coordinate.
pub(in crate::scene) fn real(what: &'static str) -> Real {
    Real { what, low: Bound::Closed(-MAX_LENGTH), high: Bound::Closed(MAX_LENGTH) }
}

impl Real {
    /// From `low` to `high`, both allowed.
    pub(in crate::scene) fn between(self, low: f64, high: f64) -> Self {
        Self { low: Bound::Closed(low), high: Bound::Closed(high), ..self }
    }

    /// Above `low`.
    pub(in crate::scene) fn above(self, low: f64) -> Self {
        Self { low: Bound::Open(low), ..self }
    }

    /// Below `high`.
    pub(in crate::scene) fn below(self, high: f64) -> Self {
        Self { high: Bound::Open(high), ..self }
    }

    /// At most `high`.
    pub(in crate::scene) fn at_most(self, high: f64) -> Self {
        Self { high: Bound::Closed(high), ..self }
    }

    /// A length above zero.
    pub(in crate::scene) fn positive_length(self) -> Self {
        self.between(MIN_LENGTH, MAX_LENGTH)
    }

    fn allows(&self, x: f64) -> bool {
        let above = match self.low {
            Bound::Closed(low) => x >= low,
            Bound::Open(low) => x > low,
        };
        let below = match self.high {
            Bound::Closed(high) => x <= high,
            Bound::Open(high) => x < high,
        };
        above && below
    }

    fn describe(&self) -> String {
        let low = match self.low {
            Bound::Closed(low) => format!("at least {}", plain(low)),
            Bound::Open(low) => format!("above {}", plain(low)),
        };
        let high = match self.high {
            Bound::Closed(high) => format!("at most {}", plain(high)),
            Bound::Open(high) => format!("below {}", plain(high)),
        };
        format!("{}: a number {low} and {high}", self.what)
    }
}

impl Decode for Real {
    type Out = f64;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<f64> {
        let Value::Number(written) = node.value else {
            cx.wrong_type(&self.describe(), node);
            return None;
        };
        let x: f64 = written.parse().ok()?;
        if !x.is_finite() {
            let message = format!("`{}` is too large; expected {}", quoted(written), self.describe());
            cx.issue(IssueCode::NotFinite, message);
            return None;
        }
        if !self.allows(x) {
            let message = format!("expected {}, found {}", self.describe(), quoted(written));
            cx.issue(IssueCode::OutOfRange, message);
            return None;
        }
        Some(x)
    }
}

/// A limit as people write it.
fn plain(x: f64) -> String {
    if x != 0.0 && !(1e-3..1e6).contains(&x.abs()) { format!("{x:e}") } else { x.to_string() }
}

/// A whole number within limits.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene) struct Whole {
    what: &'static str,
    low: u64,
    high: u64,
}

/// A whole number from `low` to `high`.
pub(in crate::scene) fn count(what: &'static str, low: u32, high: u32) -> Count {
    Count(Whole { what, low: u64::from(low), high: u64::from(high) })
}

/// Any number of 64 bits.
pub(in crate::scene) fn seed() -> Whole {
    Whole { what: "seed", low: 0, high: u64::MAX }
}

/// A [`Whole`] of 32 bits.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene) struct Count(Whole);

impl Decode for Whole {
    type Out = u64;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<u64> {
        let expected = || format!("{}: a whole number from {} to {}", self.what, self.low, self.high);
        let Value::Number(written) = node.value else {
            cx.wrong_type(&expected(), node);
            return None;
        };
        let found = whole(written).filter(|n| (self.low..=self.high).contains(n));
        if found.is_none() {
            cx.issue(IssueCode::OutOfRange, format!("expected {}, found {}", expected(), quoted(written)));
        }
        found
    }
}

impl Decode for Count {
    type Out = u32;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<u32> {
        self.0.decode(node, cx).and_then(|n| u32::try_from(n).ok())
    }
}

/// A whole number as JSON may write it: `3`, `3.0`, `3e2`; exact up to 64 bits without a fraction.
fn whole(written: &str) -> Option<u64> {
    if let Ok(n) = written.parse() {
        return Some(n);
    }
    // Above 2^53 a float no longer tells neighbouring whole numbers apart.
    let x: f64 = written.parse().ok()?;
    (x.fract() == 0.0 && (0.0..=9_007_199_254_740_992.0).contains(&x)).then_some(x as u64)
}

/// An array of exactly `N` values of one kind.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene) struct Tuple<const N: usize, D> {
    what: &'static str,
    item: D,
}

impl<const N: usize, D> Tuple<N, D> {
    pub(super) fn new(what: &'static str, item: D) -> Self {
        Self { what, item }
    }
}

impl<const N: usize, D: Decode<Out: Copy + Default>> Decode for Tuple<N, D> {
    type Out = [D::Out; N];

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<Self::Out> {
        let Value::Array(items) = &node.value else {
            cx.wrong_type(self.what, node);
            return None;
        };
        if items.len() != N {
            let message = format!("expected {}, found {} elements", self.what, items.len());
            cx.issue(IssueCode::WrongLength, message);
            return None;
        }
        let mut out = [D::Out::default(); N];
        let mut good = true;
        for (index, (slot, item)) in out.iter_mut().zip(items).enumerate() {
            match cx.within(Step::Index(index), |cx| self.item.decode(item, cx)) {
                Some(value) => *slot = value,
                None => good = false,
            }
        }
        good.then_some(out)
    }
}

/// A point in space.
pub(in crate::scene) fn point() -> Tuple<3, Real> {
    Tuple::new("a point [x, y, z]", real("coordinate"))
}

/// Two values of one kind.
pub(in crate::scene) fn pair<D: Decode>(item: D) -> Tuple<2, D> {
    Tuple::new("an array of two", item)
}

/// Texture coordinates.
pub(in crate::scene) fn uv() -> Tuple<2, Real> {
    Tuple::new("texture coordinates [u, v]", real("texture coordinate"))
}

/// Width and height of a rectangle.
pub(in crate::scene) fn size2() -> Tuple<2, Real> {
    Tuple::new("a size [width, height]", real("length").positive_length())
}

/// The three sides of a box.
pub(in crate::scene) fn size3() -> Tuple<3, Real> {
    Tuple::new("a size [x, y, z]", real("length").positive_length())
}

/// A factor by which something is scaled.
pub(in crate::scene) fn scale() -> Real {
    real("scale").between(1e-6, 1e6)
}

/// A factor for each axis.
pub(in crate::scene) fn scale3() -> Tuple<3, Real> {
    Tuple::new("a scale or scales [x, y, z]", scale())
}

/// A vector that points somewhere; it need not have length 1.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene) struct Direction;

/// A vector that points somewhere.
pub(in crate::scene) fn direction() -> Direction {
    Direction
}

impl Decode for Direction {
    type Out = [f64; 3];

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<[f64; 3]> {
        let vector = Tuple::<3, Real>::new("a direction [x, y, z]", real("coordinate")).decode(node, cx)?;
        if vector.iter().all(|x| x.abs() < MIN_LENGTH) {
            cx.issue(IssueCode::Degenerate, "a direction must not have length zero");
            return None;
        }
        Some(vector)
    }
}

/// A colour: linear `[r, g, b]`, or `"#rrggbb"` in sRGB.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene) struct Color {
    what: &'static str,
    max: f64,
}

/// An amount of light per channel.
pub(in crate::scene) fn color(what: &'static str) -> Color {
    Color { what, max: MAX_LIGHT }
}

impl Color {
    /// A fraction of the light, 0 to 1.
    pub(in crate::scene) fn fraction(self) -> Self {
        Self { max: 1.0, ..self }
    }
}

impl Color {
    /// Up to `max` per channel.
    pub(in crate::scene) fn up_to(self, max: f64) -> Self {
        Self { max, ..self }
    }
}

impl Decode for Color {
    type Out = [f64; 3];

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<[f64; 3]> {
        match &node.value {
            Value::String(hex) => {
                let color = hex_color(hex);
                if color.is_none() {
                    let message = format!("expected {}: \"#rrggbb\", found \"{}\"", self.what, quoted(hex));
                    cx.issue(IssueCode::UnknownValue, message);
                }
                color
            }
            Value::Array(_) => {
                Tuple::<3, Real>::new("a colour [r, g, b]", real(self.what).between(0.0, self.max))
                    .decode(node, cx)
            }
            Value::Null | Value::Bool | Value::Number(_) | Value::Object(_) => {
                cx.wrong_type(&format!("{}: a colour [r, g, b] or \"#rrggbb\"", self.what), node);
                None
            }
        }
    }
}

fn hex_color(text: &str) -> Option<[f64; 3]> {
    let digits =
        text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let packed = u32::from_str_radix(digits, 16).ok()?;
    let [_, r, g, b] = packed.to_be_bytes();
    Some([r, g, b].map(|byte| srgb_to_linear(f64::from(byte) / 255.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_may_be_written_as_json_allows() {
        let cases = [
            ("3", Some(3)),
            ("3.0", Some(3)),
            ("3e2", Some(300)),
            ("-0", Some(0)),
            ("18446744073709551615", Some(u64::MAX)),
            ("18446744073709551616", None),
            ("0.5", None),
            ("-1", None),
            ("1e400", None),
        ];
        for (written, expected) in cases {
            assert_eq!(whole(written), expected, "{written}");
        }
    }

    #[test]
    fn hexadecimal_colours_are_srgb() {
        let [r, g, b] = hex_color("#ff0080").unwrap();
        assert_eq!((r, g), (1.0, 0.0));
        // The sRGB curve at 128/255.
        assert!((b - 0.215_860_5).abs() < 1e-6, "{b}");
        for bad in ["ff0080", "#ff008", "#ff00800", "#gg0000", "#", "", "#é00000", "#+12345"] {
            assert_eq!(hex_color(bad), None, "{bad}");
        }
    }
}
