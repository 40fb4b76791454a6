//! The text of a scene file as a tree that remembers where each value stands.
//!
//! A parser of our own, because the errors of a scene need what a `serde_json::Value` forgets: the
//! place of each value, duplicate keys, and numbers as they were written.

use super::issue::pointer_step;
use super::read::quoted;
use std::borrow::Cow;

/// Deepest nesting; the format itself needs eight levels.
const MAX_DEPTH: usize = 64;
/// Most values in a document. Each takes at most 80 bytes, so a hostile text cannot ask for more than
/// 320 MiB.
const MAX_VALUES: usize = 4 << 20;

/// A JSON value and the byte at which it starts.
#[derive(Debug)]
pub(super) struct Node<'t> {
    pub(super) offset: usize,
    pub(super) value: Value<'t>,
}

/// What a [`Node`] holds.
#[derive(Debug)]
pub(super) enum Value<'t> {
    Null,
    Bool,
    /// As it was written; it has the form of a JSON number.
    Number(&'t str),
    String(Cow<'t, str>),
    Array(Vec<Node<'t>>),
    /// Duplicate keys are kept.
    Object(Vec<Member<'t>>),
}

/// One `"key": value` of an object.
#[derive(Debug)]
pub(super) struct Member<'t> {
    pub(super) key: Cow<'t, str>,
    pub(super) key_offset: usize,
    pub(super) node: Node<'t>,
}

/// Why a text is not a document.
#[derive(Debug)]
pub(super) struct ParseError {
    pub(super) kind: ParseErrorKind,
    pub(super) message: String,
    pub(super) offset: usize,
    /// Keys and indices of the place, innermost first.
    path: Vec<String>,
}

/// What kind of thing is wrong with a text.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum ParseErrorKind {
    Syntax,
    TooDeep,
    TooLarge,
}

impl Node<'_> {
    /// What the value is, as a reader would call it.
    pub(super) fn kind(&self) -> &'static str {
        match &self.value {
            Value::Null => "null",
            Value::Bool => "true or false",
            Value::Number(_) => "a number",
            Value::String(_) => "a string",
            Value::Array(_) => "an array",
            Value::Object(_) => "an object",
        }
    }

    /// Offset of the place a JSON pointer names, or of the innermost value on the way that exists.
    pub(super) fn locate(&self, pointer: &str) -> usize {
        let mut node = self;
        for step in pointer.split('/').skip(1) {
            let step = step.replace("~1", "/").replace("~0", "~");
            let next = match &node.value {
                Value::Array(items) => step.parse::<usize>().ok().and_then(|i| items.get(i)),
                Value::Object(members) => members.iter().find(|m| m.key == step).map(|m| &m.node),
                Value::Null | Value::Bool | Value::Number(_) | Value::String(_) => None,
            };
            let Some(next) = next else { break };
            node = next;
        }
        node.offset
    }
}

/// Parses a whole text; a byte order mark at its start is skipped.
pub(super) fn parse(text: &str) -> Result<Node<'_>, ParseError> {
    let start = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
    let mut parser = Parser { text, at: start, values: 0 };
    let root = parser.value(0)?;
    parser.skip_space();
    if parser.at < text.len() {
        return Err(parser.syntax("the end of the text"));
    }
    Ok(root)
}

struct Parser<'t> {
    text: &'t str,
    at: usize,
    values: usize,
}

impl<'t> Parser<'t> {
    fn value(&mut self, depth: usize) -> Result<Node<'t>, ParseError> {
        self.skip_space();
        let offset = self.at;
        self.values += 1;
        if self.values > MAX_VALUES {
            let message = format!("more than {MAX_VALUES} values; large meshes belong in a mesh asset");
            return Err(self.error(ParseErrorKind::TooLarge, message));
        }
        if depth > MAX_DEPTH {
            let message = format!("nested more than {MAX_DEPTH} levels deep");
            return Err(self.error(ParseErrorKind::TooDeep, message));
        }
        let value = match self.peek() {
            Some(b'{') => self.object(depth)?,
            Some(b'[') => self.array(depth)?,
            Some(b'"') => Value::String(self.string()?),
            Some(b'-' | b'0'..=b'9') => Value::Number(self.number()?),
            Some(_) => self.word()?,
            None => return Err(self.syntax("a value")),
        };
        Ok(Node { offset, value })
    }

    fn object(&mut self, depth: usize) -> Result<Value<'t>, ParseError> {
        self.at += 1;
        let mut members = Vec::new();
        if self.next_is(b'}') {
            return Ok(Value::Object(members));
        }
        loop {
            self.skip_space();
            let key_offset = self.at;
            if self.peek() != Some(b'"') {
                return Err(self.syntax("a field name in double quotes"));
            }
            let key = self.string()?;
            if !self.next_is(b':') {
                return Err(self.syntax("`:`").within(key.into_owned()));
            }
            let node = match self.value(depth + 1) {
                Ok(node) => node,
                Err(error) => return Err(error.within(key.into_owned())),
            };
            members.push(Member { key, key_offset, node });
            if self.next_is(b'}') {
                // Small objects would keep room for four members.
                members.shrink_to_fit();
                return Ok(Value::Object(members));
            }
            if !self.next_is(b',') {
                return Err(self.syntax("`,` or `}`"));
            }
        }
    }

    fn array(&mut self, depth: usize) -> Result<Value<'t>, ParseError> {
        self.at += 1;
        let mut items = Vec::new();
        if self.next_is(b']') {
            return Ok(Value::Array(items));
        }
        loop {
            let item = self.value(depth + 1).map_err(|error| error.within(items.len().to_string()))?;
            items.push(item);
            if self.next_is(b']') {
                items.shrink_to_fit();
                return Ok(Value::Array(items));
            }
            if !self.next_is(b',') {
                return Err(self.syntax("`,` or `]`"));
            }
        }
    }

    fn word(&mut self) -> Result<Value<'t>, ParseError> {
        let words = [("null", Value::Null), ("true", Value::Bool), ("false", Value::Bool)];
        for (word, value) in words {
            if self.rest().starts_with(word) {
                self.at += word.len();
                return Ok(value);
            }
        }
        Err(self.syntax("a value"))
    }

    fn number(&mut self) -> Result<&'t str, ParseError> {
        let start = self.at;
        if self.peek() == Some(b'-') {
            self.at += 1;
        }
        let leading_zero = self.peek() == Some(b'0');
        if self.digits()? > 1 && leading_zero {
            self.at = start;
            return Err(self.syntax("a number without leading zeros"));
        }
        if self.peek() == Some(b'.') {
            self.at += 1;
            self.digits()?;
        }
        if matches!(self.peek(), Some(b'e' | b'E')) {
            self.at += 1;
            if matches!(self.peek(), Some(b'+' | b'-')) {
                self.at += 1;
            }
            self.digits()?;
        }
        Ok(self.text.get(start..self.at).unwrap_or_default())
    }

    fn digits(&mut self) -> Result<usize, ParseError> {
        let count = self.rest().bytes().take_while(u8::is_ascii_digit).count();
        self.at += count;
        if count == 0 { Err(self.syntax("a digit")) } else { Ok(count) }
    }

    fn string(&mut self) -> Result<Cow<'t, str>, ParseError> {
        let start = self.at;
        let mut escaped = false;
        self.at += 1;
        loop {
            match self.peek() {
                Some(b'"') => break,
                Some(b'\\') => {
                    escaped = true;
                    self.at += 1;
                    self.skip_char();
                }
                Some(0..=0x1f) | None => return Err(self.syntax("the end of the string")),
                Some(_) => self.skip_char(),
            }
        }
        self.at += 1;
        let quoted = self.text.get(start..self.at).unwrap_or_default();
        if escaped {
            let unescaped = serde_json::from_str(quoted).map_err(|_| {
                self.at = start;
                self.syntax("a string with valid escapes")
            })?;
            Ok(Cow::Owned(unescaped))
        } else {
            Ok(Cow::Borrowed(quoted.trim_matches('"')))
        }
    }

    fn rest(&self) -> &'t str {
        self.text.get(self.at..).unwrap_or_default()
    }

    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    fn skip_char(&mut self) {
        self.at += self.rest().chars().next().map_or(0, char::len_utf8);
    }

    fn skip_space(&mut self) {
        while matches!(self.peek(), Some(b' ' | b'\t' | b'\n' | b'\r')) {
            self.at += 1;
        }
    }

    /// Skips space, and `byte` if it comes next.
    fn next_is(&mut self, byte: u8) -> bool {
        self.skip_space();
        let found = self.peek() == Some(byte);
        self.at += usize::from(found);
        found
    }

    fn syntax(&self, expected: &str) -> ParseError {
        let found = match self.rest().chars().next() {
            Some(c) => format!("`{}`", c.escape_default()),
            None => "the end of the text".to_owned(),
        };
        self.error(ParseErrorKind::Syntax, format!("not valid JSON: expected {expected}, found {found}"))
    }

    fn error(&self, kind: ParseErrorKind, message: String) -> ParseError {
        ParseError { kind, message, offset: self.at, path: Vec::new() }
    }
}

impl ParseError {
    /// The place as a JSON pointer.
    pub(super) fn pointer(&self) -> String {
        self.path.iter().rev().fold(String::new(), |pointer, step| pointer_step(&pointer, &quoted(step)))
    }

    fn within(mut self, step: String) -> Self {
        self.path.push(step);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where the parser and serde_json differ on purpose: numbers too large, depth, duplicate keys.
    #[test]
    fn accepts_what_serde_json_accepts() {
        let texts = [
            "{}",
            "[]",
            "[1,2]",
            "[1,]",
            "{\"a\":1,}",
            "01",
            "-0",
            "-",
            "1.",
            ".5",
            "1e5",
            "1e",
            "1E+2",
            "nul",
            "null",
            "\"\\u00e9\"",
            "\"\\ud800\"",
            "\"\\x\"",
            "\"\t\"",
            "\"a",
            "NaN",
            "Infinity",
            "[1 2]",
            "{1:2}",
            "\"\\\\\"",
            "\"\\\"\"",
            "",
            " ",
            "1 1",
            "{\"a\"}",
            "+1",
            "\u{e9}",
            "\"\u{e9}\"",
            "[\"\\\u{e9}\"]",
        ];
        for text in texts {
            let expected = serde_json::from_str::<serde_json::Value>(text).is_ok();
            assert_eq!(parse(text).is_ok(), expected, "{text:?}");
        }
    }

    #[test]
    fn strings_keep_their_quotes_and_escapes() {
        let root = parse(r#"["\"", "a\"b", "", "\\"]"#).unwrap();
        let Value::Array(items) = root.value else { panic!("an array") };
        let strings: Vec<_> = items
            .iter()
            .map(|node| match &node.value {
                Value::String(s) => s.as_ref(),
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(strings, ["\"", "a\"b", "", "\\"]);
    }

    #[test]
    fn a_depth_bomb_is_refused_without_recursing_into_it() {
        let error = parse(&"[".repeat(1_000_000)).unwrap_err();
        assert_eq!(error.kind, ParseErrorKind::TooDeep);
    }

    #[test]
    fn a_node_takes_as_little_as_the_limit_assumes() {
        assert!(size_of::<Member>() <= 80);
    }

    #[test]
    fn an_error_knows_its_path() {
        let error = parse(r#"{"a": [1, {"b": x}]}"#).unwrap_err();
        assert_eq!(error.pointer(), "/a/1/b");
        assert_eq!(error.offset, 16);
    }
}
