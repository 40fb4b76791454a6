//! Light-path expressions: text to a syntax tree.
//!
//! ```text
//! alternatives = sequence { "|" sequence }
//! sequence     = { repeated }
//! repeated     = atom { "*" | "+" | "?" | "{" m [ "," [ n ] ] "}" }
//! atom         = "L" | "D" | "S" | "E" | "." | "(" alternatives ")"
//! ```
//!
//! A dot stands for `(D|S)`; spaces mean nothing.

use std::iter::Peekable;
use std::str::Chars;

/// Why a text is not a light-path expression, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message} (column {column})")]
pub struct ExpressionError {
    /// The character, from 1.
    pub column: usize,
    /// One sentence.
    pub message: String,
}

impl ExpressionError {
    pub(super) fn new(column: usize, message: impl Into<String>) -> Self {
        Self { column, message: message.into() }
    }
}

/// What one place of an expression stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Symbol {
    Light,
    Diffuse,
    Specular,
    /// Either of the two.
    Any,
    Eye,
}

/// A part of an expression; `usize` is the column of a symbol.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Node {
    Symbol(Symbol, usize),
    Sequence(Vec<Node>),
    Alternatives(Vec<Node>),
    /// From `least` to `most` times; without end if there is no `most`. The column is that of the operator.
    Repeated {
        node: Box<Node>,
        least: u32,
        most: Option<u32>,
        column: usize,
    },
}

/// Deeper brackets than in any path that is meant.
const MOST_DEPTH: u32 = 64;

/// Most repetitions in braces.
const MOST_REPETITIONS: u32 = 1000;

/// Reads an expression.
pub(super) fn parse(text: &str) -> Result<Node, ExpressionError> {
    let mut parser = Parser { rest: text.chars().peekable(), column: 1, depth: 0 };
    let node = parser.alternatives()?;
    match parser.peek() {
        None => Ok(node),
        // Only a bracket ends the alternatives before the text does.
        Some(_) => Err(ExpressionError::new(parser.column, "this `)` closes no bracket")),
    }
}

struct Parser<'t> {
    rest: Peekable<Chars<'t>>,
    /// Of the next character.
    column: usize,
    depth: u32,
}

impl Parser<'_> {
    /// The next character that is no space, which is left where it is.
    fn peek(&mut self) -> Option<char> {
        while self.rest.next_if(|c| c.is_whitespace()).is_some() {
            self.column += 1;
        }
        self.rest.peek().copied()
    }

    fn take(&mut self) -> Option<char> {
        let next = self.peek()?;
        self.rest.next();
        self.column += 1;
        Some(next)
    }

    fn alternatives(&mut self) -> Result<Node, ExpressionError> {
        let mut parts = vec![self.sequence()?];
        while self.peek() == Some('|') {
            self.take();
            parts.push(self.sequence()?);
        }
        Ok(Node::Alternatives(parts))
    }

    fn sequence(&mut self) -> Result<Node, ExpressionError> {
        let mut parts = Vec::new();
        while !matches!(self.peek(), None | Some('|' | ')')) {
            parts.push(self.repeated()?);
        }
        if parts.is_empty() {
            return Err(ExpressionError::new(self.column, "expected L, D, S, E, `.` or `(`"));
        }
        Ok(Node::Sequence(parts))
    }

    fn repeated(&mut self) -> Result<Node, ExpressionError> {
        let mut node = self.atom()?;
        loop {
            let next = self.peek();
            let column = self.column;
            let (least, most) = match next {
                Some('*') => (0, None),
                Some('+') => (1, None),
                Some('?') => (0, Some(1)),
                Some('{') => {
                    self.take();
                    let (least, most) = self.counts()?;
                    node = Node::Repeated { node: Box::new(node), least, most, column };
                    continue;
                }
                _ => return Ok(node),
            };
            self.take();
            node = Node::Repeated { node: Box::new(node), least, most, column };
        }
    }

    fn atom(&mut self) -> Result<Node, ExpressionError> {
        let next = self.peek();
        let column = self.column;
        let symbol = match next {
            Some('L') => Symbol::Light,
            Some('D') => Symbol::Diffuse,
            Some('S') => Symbol::Specular,
            Some('E') => Symbol::Eye,
            Some('.') => Symbol::Any,
            Some('(') => return self.bracket(),
            Some(c @ ('*' | '+' | '?' | '{')) => {
                return Err(ExpressionError::new(column, format!("there is nothing before `{c}` to repeat")));
            }
            Some(c) => {
                let message = format!("`{c}` is not part of a light path: it is made of L, D, S and E");
                return Err(ExpressionError::new(column, message));
            }
            None => return Err(ExpressionError::new(column, "expected L, D, S, E, `.` or `(`")),
        };
        self.take();
        Ok(Node::Symbol(symbol, column))
    }

    fn bracket(&mut self) -> Result<Node, ExpressionError> {
        let opened = self.column;
        self.take();
        self.depth += 1;
        if self.depth > MOST_DEPTH {
            return Err(ExpressionError::new(opened, format!("more than {MOST_DEPTH} brackets in brackets")));
        }
        let inner = self.alternatives()?;
        if self.take() != Some(')') {
            return Err(ExpressionError::new(opened, "this `(` is not closed"));
        }
        self.depth -= 1;
        Ok(inner)
    }

    /// What follows an opening brace: `m}`, `m,}` or `m,n}`.
    fn counts(&mut self) -> Result<(u32, Option<u32>), ExpressionError> {
        let least = self.number()?;
        let most = match self.peek() {
            Some(',') => {
                self.take();
                if self.peek() == Some('}') { None } else { Some(self.number()?) }
            }
            _ => Some(least),
        };
        let column = self.column;
        if self.take() != Some('}') {
            return Err(ExpressionError::new(column, "expected `}`, as in {2}, {2,} or {2,4}"));
        }
        if most.is_some_and(|most| most < least) {
            let message = "the second number in braces is smaller than the first";
            return Err(ExpressionError::new(column - 1, message));
        }
        Ok((least, most))
    }

    fn number(&mut self) -> Result<u32, ExpressionError> {
        self.peek();
        let column = self.column;
        let mut value: Option<u32> = None;
        while let Some(digit) = self.rest.peek().and_then(|c| c.to_digit(10)) {
            self.take();
            let grown = value.unwrap_or(0) * 10 + digit;
            if grown > MOST_REPETITIONS {
                let message = format!("a number in braces is at most {MOST_REPETITIONS}");
                return Err(ExpressionError::new(column, message));
            }
            value = Some(grown);
        }
        value.ok_or_else(|| ExpressionError::new(column, "expected a number, as in {2}, {2,} or {2,4}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_name_the_column() {
        let cases = [
            ("LDX", 3, "`X` is not part"),
            ("", 1, "expected L"),
            ("L(D|S*E", 2, "not closed"),
            ("LD)E", 3, "closes no bracket"),
            ("L(D|)E", 5, "expected L"),
            ("L*|*", 4, "nothing before `*`"),
            ("LD{2", 5, "expected `}`"),
            ("LD{}E", 4, "expected a number"),
            ("LD{4,2}E", 6, "smaller than the first"),
            ("LD{4000}E", 4, "at most 1000"),
            ("L D {2} é", 9, "`é` is not part"),
        ];
        for (text, column, message) in cases {
            let error = parse(text).unwrap_err();
            assert_eq!(error.column, column, "{text}: {error}");
            assert!(error.message.contains(message), "{text}: {error}");
        }
        assert!(parse(&"(".repeat(100_000)).unwrap_err().message.contains("brackets in brackets"));
    }

    #[test]
    fn spaces_mean_nothing() {
        let columns = |node: Node| format!("{node:?}").replace(|c: char| c.is_ascii_digit(), "");
        let (a, b) = (parse("LS+DS*E").unwrap(), parse(" L S + D\tS * E ").unwrap());
        assert_eq!(columns(a), columns(b));
    }
}
