//! Decoders of numbers, points and directions.

use super::super::issue::IssueCode;
use super::super::json::{Node, Value};
use super::super::schema::Definitions;
use super::{Context, Decode, Encode, Step, quoted};
use serde_json::json;

/// Largest coordinate or length, in metres: its fourth power is still a float.
pub(in crate::scene) const MAX_LENGTH: f64 = 1e9;
/// Smallest length above zero, in metres.
pub(in crate::scene) const MIN_LENGTH: f64 = 1e-9;

/// A real number within limits.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene) struct Real {
    what: &'static str,
    unit: Option<&'static str>,
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
    Real { what, unit: None, low: Bound::Closed(-MAX_LENGTH), high: Bound::Closed(MAX_LENGTH) }
}

impl Real {
    /// The unit it is given in, for the schema.
    pub(in crate::scene) fn unit(self, unit: &'static str) -> Self {
        Self { unit: Some(unit), ..self }
    }

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
        self.between(MIN_LENGTH, MAX_LENGTH).unit("m")
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

    fn schema(&self, _definitions: &mut Definitions) -> serde_json::Value {
        let (low, at_low) = match self.low {
            Bound::Closed(low) => ("minimum", low),
            Bound::Open(low) => ("exclusiveMinimum", low),
        };
        let (high, at_high) = match self.high {
            Bound::Closed(high) => ("maximum", high),
            Bound::Open(high) => ("exclusiveMaximum", high),
        };
        let mut schema = json!({ "type": "number", low: number(at_low), high: number(at_high) });
        if let Some(unit) = self.unit {
            schema["x-unit"] = unit.into();
        }
        schema
    }
}

impl Encode for Real {
    fn encode(&self, value: &f64) -> serde_json::Value {
        number(*value)
    }
}

/// A number without a needless `.0`.
pub(super) fn number(x: f64) -> serde_json::Value {
    // Below 2^53 a whole float is exactly that integer.
    if x.fract() == 0.0 && x.abs() < 9_007_199_254_740_992.0 { json!(x as i64) } else { json!(x) }
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

    fn schema(&self, _definitions: &mut Definitions) -> serde_json::Value {
        json!({ "type": "integer", "minimum": self.low, "maximum": self.high })
    }
}

impl Decode for Count {
    type Out = u32;

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<u32> {
        self.0.decode(node, cx).and_then(|n| u32::try_from(n).ok())
    }

    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value {
        self.0.schema(definitions)
    }
}

impl Encode for Whole {
    fn encode(&self, value: &u64) -> serde_json::Value {
        json!(value)
    }
}

impl Encode for Count {
    fn encode(&self, value: &u32) -> serde_json::Value {
        json!(value)
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

    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value {
        let items = self.item.schema(definitions);
        json!({ "title": self.what, "type": "array", "items": items, "minItems": N, "maxItems": N })
    }
}

impl<const N: usize, D: Encode<Out: Copy + Default>> Encode for Tuple<N, D> {
    fn encode(&self, value: &Self::Out) -> serde_json::Value {
        value.iter().map(|item| self.item.encode(item)).collect()
    }
}

/// A point in space.
pub(in crate::scene) fn point() -> Tuple<3, Real> {
    Tuple::new("a point [x, y, z]", real("coordinate").unit("m"))
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

impl Encode for Direction {
    fn encode(&self, value: &[f64; 3]) -> serde_json::Value {
        value.iter().copied().map(number).collect()
    }
}

/// One factor, or one for each of `N` axes.
pub(in crate::scene) struct Scale<const N: usize>;

impl<const N: usize> Scale<N> {
    fn one() -> Real {
        real("scale").between(1e-6, 1e6)
    }

    fn each() -> Tuple<N, Real> {
        Tuple::new(
            if N == 2 { "a scale or scales [u, v]" } else { "a scale or scales [x, y, z]" },
            Self::one(),
        )
    }
}

impl<const N: usize> Decode for Scale<N> {
    type Out = [f64; N];

    fn decode(&self, node: &Node<'_>, cx: &mut Context<'_>) -> Option<[f64; N]> {
        match node.value {
            Value::Array(_) => Self::each().decode(node, cx),
            Value::Null | Value::Bool | Value::Number(_) | Value::String(_) | Value::Object(_) => {
                Self::one().decode(node, cx).map(|s| [s; N])
            }
        }
    }

    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value {
        json!({ "anyOf": [Self::one().schema(definitions), Self::each().schema(definitions)] })
    }
}

impl<const N: usize> Encode for Scale<N> {
    fn encode(&self, value: &[f64; N]) -> serde_json::Value {
        Self::each().encode(value)
    }
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

    fn schema(&self, definitions: &mut Definitions) -> serde_json::Value {
        let mut schema =
            Tuple::<3, Real>::new("a direction [x, y, z]", real("coordinate")).schema(definitions);
        schema["contains"] = json!({ "anyOf": [{ "minimum": MIN_LENGTH }, { "maximum": -MIN_LENGTH }] });
        schema
    }
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
}
