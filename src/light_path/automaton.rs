//! Light-path expressions as automata over D and S: what stands between L and E, read as light travels.
//!
//! A syntax tree becomes the automaton of its positions (Glushkov 1961), which has no empty steps; that becomes
//! deterministic by the subset construction and is made minimal by refinement of partitions (Moore 1956).

use super::Bounce;
use super::expression::{ExpressionError, Node, Symbol};
use std::collections::{BTreeSet, HashMap};

/// Places of an expression, copies by repetition counted.
const MOST_POSITIONS: usize = 1000;

/// Steps while it is unrolled: repetitions of nothing give no places.
const MOST_STEPS: usize = 20_000;

/// States of an automaton.
pub(super) const MOST_STATES: usize = 1024;

/// A deterministic automaton; state 0 is the first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Automaton {
    /// The next state of each after a D and after an S.
    next: Vec<[usize; 2]>,
    accepts: Vec<bool>,
}

/// A part of an expression while its places are linked.
struct Fragment {
    can_be_empty: bool,
    first: Vec<usize>,
    last: Vec<usize>,
}

/// The automaton of positions while it grows.
#[derive(Default)]
struct Positions {
    symbols: Vec<(Symbol, usize)>,
    follow: Vec<BTreeSet<usize>>,
    steps: usize,
}

impl Automaton {
    /// The automaton of an expression, all of whose words must be `L(D|S)*E`.
    pub(super) fn of(node: &Node) -> Result<Self, ExpressionError> {
        let mut positions = Positions::default();
        let whole = positions.link(node)?;
        positions.check(&whole)?;
        let light = whole.first.iter().copied().collect();
        let step = |set: &BTreeSet<usize>, bounce: Bounce| {
            let after = set.iter().flat_map(|&p| &positions.follow[p]).copied();
            after.filter(|&p| positions.symbols[p].0.is(bounce)).collect()
        };
        let accepts = |set: &BTreeSet<usize>| {
            let mut after = set.iter().flat_map(|&p| &positions.follow[p]);
            after.any(|&p| positions.symbols[p].0 == Symbol::Eye)
        };
        let (next, sets) = explore(light, step)
            .ok_or_else(|| ExpressionError::new(1, format!("needs more than {MOST_STATES} states")))?;
        let automaton = Self { next, accepts: sets.iter().map(accepts).collect() };
        Ok(automaton.minimal())
    }

    /// The next state.
    #[inline]
    pub(super) fn step(&self, state: usize, bounce: Bounce) -> usize {
        self.next[state][bounce as usize]
    }

    /// Whether a path may end here.
    #[inline]
    pub(super) fn accepts(&self, state: usize) -> bool {
        self.accepts[state]
    }

    /// Whether these bounces, in the order light travels, are one of its words.
    pub(super) fn matches(&self, bounces: &[Bounce]) -> bool {
        self.accepts(bounces.iter().fold(0, |state, &bounce| self.step(state, bounce)))
    }

    /// Whether any word of both, made of `alphabet` alone, is taken by `pick` of whether each accepts it.
    pub(super) fn any_with(
        &self,
        other: &Self,
        alphabet: &[Bounce],
        pick: impl Fn(bool, bool) -> bool,
    ) -> bool {
        let mut seen = BTreeSet::from([(0, 0)]);
        let mut left = vec![(0, 0)];
        while let Some((a, b)) = left.pop() {
            if pick(self.accepts(a), other.accepts(b)) {
                return true;
            }
            for &bounce in alphabet {
                let after = (self.step(a, bounce), other.step(b, bounce));
                if seen.insert(after) {
                    left.push(after);
                }
            }
        }
        false
    }

    fn minimal(self) -> Self {
        let outputs: Vec<u64> = self.accepts.iter().map(|&accepts| u64::from(accepts)).collect();
        let (next, outputs) = minimise(&self.next, &outputs);
        Self { next, accepts: outputs.iter().map(|&output| output != 0).collect() }
    }
}

impl Symbol {
    fn is(self, bounce: Bounce) -> bool {
        match self {
            Self::Any => true,
            Self::Diffuse => bounce == Bounce::Diffuse,
            Self::Specular => bounce == Bounce::Specular,
            Self::Light | Self::Eye => false,
        }
    }
}

/// All states that can be reached, each a value of its own, with the next of each after D and S; `None` if there are too
/// many.
pub(super) fn explore<T: Clone + Eq + std::hash::Hash>(
    first: T,
    step: impl Fn(&T, Bounce) -> T,
) -> Option<(Vec<[usize; 2]>, Vec<T>)> {
    let mut states = vec![first.clone()];
    let mut numbers = HashMap::from([(first, 0)]);
    let mut next = Vec::new();
    while next.len() < states.len() {
        let state = states[next.len()].clone();
        next.push([Bounce::Diffuse, Bounce::Specular].map(|bounce| {
            let after = step(&state, bounce);
            *numbers.entry(after).or_insert_with_key(|after| {
                states.push(after.clone());
                states.len() - 1
            })
        }));
        if states.len() > MOST_STATES {
            return None;
        }
    }
    Some((next, states))
}

/// Joins states that no word tells apart by what it puts out; state 0 stays the first.
pub(super) fn minimise(next: &[[usize; 2]], outputs: &[u64]) -> (Vec<[usize; 2]>, Vec<u64>) {
    let mut class: Vec<usize> = number(outputs.iter());
    loop {
        let refined = number((0..next.len()).map(|s| (class[s], next[s].map(|after| class[after]))));
        if refined == class {
            break;
        }
        class = refined;
    }
    let count = class.iter().max().map_or(0, |most| most + 1);
    let mut joined = (vec![[0; 2]; count], vec![0; count]);
    for (state, &c) in class.iter().enumerate() {
        joined.0[c] = next[state].map(|after| class[after]);
        joined.1[c] = outputs[state];
    }
    joined
}

/// Numbers values in the order in which they first appear.
fn number<T: Eq + std::hash::Hash>(values: impl Iterator<Item = T>) -> Vec<usize> {
    let mut numbers = HashMap::new();
    values
        .map(|value| {
            let fresh = numbers.len();
            *numbers.entry(value).or_insert(fresh)
        })
        .collect()
}

impl Positions {
    fn link(&mut self, node: &Node) -> Result<Fragment, ExpressionError> {
        match node {
            Node::Symbol(symbol, column) => {
                let position = self.symbols.len();
                if position == MOST_POSITIONS {
                    let message = format!("longer than {MOST_POSITIONS} letters, repetitions counted");
                    return Err(ExpressionError::new(*column, message));
                }
                self.symbols.push((*symbol, *column));
                self.follow.push(BTreeSet::new());
                Ok(Fragment { can_be_empty: false, first: vec![position], last: vec![position] })
            }
            Node::Sequence(parts) => {
                let mut whole = Fragment::empty();
                for part in parts {
                    let part = self.link(part)?;
                    whole = self.then(whole, part);
                }
                Ok(whole)
            }
            Node::Alternatives(parts) => {
                let mut whole = Fragment { can_be_empty: false, first: Vec::new(), last: Vec::new() };
                for part in parts {
                    let part = self.link(part)?;
                    whole.can_be_empty |= part.can_be_empty;
                    whole.first.extend(part.first);
                    whole.last.extend(part.last);
                }
                Ok(whole)
            }
            Node::Repeated { node, least, most, column } => self.repeat(node, *least, *most, *column),
        }
    }

    /// `x{m,n}` is m times x and n - m times x?; `x{m,}` is m times x, the last of them any number of times.
    fn repeat(
        &mut self,
        node: &Node,
        least: u32,
        most: Option<u32>,
        column: usize,
    ) -> Result<Fragment, ExpressionError> {
        let mut whole = Fragment::empty();
        let copies = most.unwrap_or(least.max(1));
        for copy in 0..copies {
            self.steps += 1;
            if self.steps > MOST_STEPS {
                return Err(ExpressionError::new(column, "repeats too much"));
            }
            let mut part = self.link(node)?;
            if most.is_none() && copy + 1 == copies {
                self.chain(&part.last, &part.first);
            }
            part.can_be_empty |= copy >= least;
            whole = self.then(whole, part);
        }
        Ok(whole)
    }

    fn then(&mut self, a: Fragment, b: Fragment) -> Fragment {
        self.chain(&a.last, &b.first);
        let first = if a.can_be_empty { [a.first, b.first.clone()].concat() } else { a.first };
        let last = if b.can_be_empty { [a.last, b.last].concat() } else { b.last };
        Fragment { can_be_empty: a.can_be_empty && b.can_be_empty, first, last }
    }

    fn chain(&mut self, from: &[usize], to: &[usize]) {
        for &position in from {
            self.follow[position].extend(to);
        }
    }

    /// Every position is part of some word, so that what stands where it must not is found where it is.
    fn check(&self, whole: &Fragment) -> Result<(), ExpressionError> {
        let wrong = |position: usize, message: &str| {
            Err(ExpressionError::new(self.symbols[position].1, message.to_owned()))
        };
        let is = |position: usize, symbol: Symbol| self.symbols[position].0 == symbol;
        if whole.can_be_empty {
            return Err(ExpressionError::new(1, "a path has at least an L and an E: this may be empty"));
        }
        if let Some(&position) = whole.first.iter().find(|&&p| !is(p, Symbol::Light)) {
            return wrong(position, "a path begins with L, the light");
        }
        if let Some(&position) = whole.last.iter().rev().find(|&&p| !is(p, Symbol::Eye)) {
            return wrong(position, "a path ends with E, the eye");
        }
        if let Some(&position) = self.follow.iter().flatten().find(|&&p| is(p, Symbol::Light)) {
            return wrong(position, "L stands only at the beginning of a path");
        }
        let beyond = self.follow.iter().zip(0..).find(|(after, p)| is(*p, Symbol::Eye) && !after.is_empty());
        match beyond {
            Some((_, position)) => wrong(position, "E stands only at the end of a path"),
            None => Ok(()),
        }
    }
}

impl Fragment {
    fn empty() -> Self {
        Self { can_be_empty: true, first: Vec::new(), last: Vec::new() }
    }
}
