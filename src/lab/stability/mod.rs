//! Scenes in which methods of this kind are known to break, rendered by every method that can run them: is the picture
//! finite, is it right, how long did it take, was anything said?
//!
//! The scenes are built in code ([`cases`]); each has a light that is known ([`Truth`]). [`run_case`] renders it and
//! judges ([`Outcome`]); [`page()`], [`csv`] and [`json`] write the table down.

mod build;
mod geometry;
mod judge;
mod lights;
mod page;
mod photons;
mod probes;
mod refused;
mod run;
mod specular;
mod table;

pub use judge::{Cell, Outcome};
pub use page::page;
pub use run::{Effort, Row, run_case};
pub use table::{csv, json};

use super::Method;
use crate::light_path::PathClass;
use crate::scene::IssueCode;
use serde_json::Value;

/// What is right for a scene.
#[derive(Clone, Debug)]
pub enum Truth {
    /// The picture, or one class of it, has this mean radiance (green), W·sr⁻¹·m⁻².
    Mean {
        /// The class; the whole picture if none is named.
        class: Option<PathClass>,
        /// Mean radiance; zero is meant exactly.
        value: f64,
    },
    /// The picture has the mean radiance of that of another scene.
    SameAs(Box<Value>),
    /// The scene is refused, with this code at this JSON pointer or within it.
    Refused(IssueCode, &'static str),
    /// Nothing is known but that it is finite.
    Finite,
    /// No scene shows it: a part of the renderer is asked directly. The relative error that it finds.
    Probe(fn() -> f64),
}

/// What is rendered.
#[derive(Clone, Debug)]
pub enum Input {
    /// A scene.
    Scene(Box<Value>),
    /// A text that should be one.
    Text(String),
    /// Nothing: see [`Truth::Probe`].
    None,
}

/// A scene in which a method breaks.
#[derive(Clone, Debug)]
pub struct Case {
    /// The numbers of the failures it stands for.
    pub rows: &'static str,
    /// The scene in a few words.
    pub title: &'static str,
    /// What goes wrong where this is not thought of.
    pub breaks: &'static str,
    /// What is rendered.
    pub input: Input,
    /// What is right.
    pub truth: Truth,
    /// Relative error that is right: what the truth leaves out, without the noise.
    pub tolerance: f64,
    /// The codes of the warnings that must be given.
    pub warns: &'static [&'static str],
    /// Methods that are known to be wrong here, by the start of their names, and why.
    pub limits: Vec<(&'static str, &'static str)>,
    /// Methods that only this case asks for.
    pub extra: Vec<Method>,
}

/// All cases, in the order of their numbers.
#[must_use]
pub fn cases() -> Vec<Case> {
    let mut all =
        [geometry::cases(), specular::cases(), lights::cases(), photons::cases(), refused::cases()].concat();
    all.sort_by_key(Case::number);
    all
}

impl Case {
    fn new(rows: &'static str, title: &'static str, breaks: &'static str, scene: Value) -> Self {
        Self {
            rows,
            title,
            breaks,
            input: Input::Scene(Box::new(scene)),
            truth: Truth::Finite,
            tolerance: 0.0,
            warns: &[],
            limits: Vec::new(),
            extra: Vec::new(),
        }
    }

    fn probe(rows: &'static str, title: &'static str, breaks: &'static str, error: fn() -> f64) -> Self {
        let truth = Truth::Probe(error);
        Self { input: Input::None, truth, ..Self::new(rows, title, breaks, Value::Null) }
    }

    fn mean(self, value: f64, tolerance: f64) -> Self {
        Self { truth: Truth::Mean { class: None, value }, tolerance, ..self }
    }

    fn mean_of(self, class: PathClass, value: f64, tolerance: f64) -> Self {
        Self { truth: Truth::Mean { class: Some(class), value }, tolerance, ..self }
    }

    fn same_as(self, scene: Value, tolerance: f64) -> Self {
        Self { truth: Truth::SameAs(Box::new(scene)), tolerance, ..self }
    }

    fn within(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    fn refused(self, code: IssueCode, pointer: &'static str) -> Self {
        Self { truth: Truth::Refused(code, pointer), ..self }
    }

    fn warns(self, warns: &'static [&'static str]) -> Self {
        Self { warns, ..self }
    }

    fn limit(mut self, method: &'static str, reason: &'static str) -> Self {
        self.limits.push((method, reason));
        self
    }

    fn also(mut self, method: Method) -> Self {
        self.extra.push(method);
        self
    }

    /// The first number in `rows`.
    #[must_use]
    pub fn number(&self) -> u32 {
        let digits: String = self.rows.chars().skip(1).take_while(char::is_ascii_digit).collect();
        digits.parse().unwrap_or(u32::MAX)
    }
}
