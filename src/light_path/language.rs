//! What the two walks carry where the classes alone do not say which paths are asked for, or in which layers they are.
//!
//! All expressions together are one deterministic automaton that puts out, at the end of a path, the set of pictures that
//! hold it. A photon that rests knows the automaton's state, which light alone decides (its kind). The eye's walk reads
//! the path from its end: what it knows is a function from the automaton's states to the pictures that hold the whole
//! path, if light comes to where it is in that state; such functions are few, and are the states of an automaton that
//! reads backward (its trail). Trail and kind together give the pictures.

use super::Bounce;
use super::automaton::{Automaton, explore, minimise};
use std::collections::HashMap;

/// A set of pictures: bit 0 is the picture itself, the others are its named layers.
pub type Pictures = u64;

/// The picture itself.
pub const PICTURE: Pictures = 1;

/// Most named layers.
pub const MOST_LAYERS: usize = 63;

/// What a ray from the eye has met so far, as far as it matters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trail(u16);

/// Which light it is, and what it has met so far, as far as that matters.
pub type Kind = u8;

/// Decides which pictures hold a path.
#[derive(Clone, Debug, PartialEq)]
pub struct Language {
    /// The trail after a D and an S.
    next: Vec<[u16; 2]>,
    /// Pictures by trail and kind.
    pictures: Vec<Pictures>,
    kinds: usize,
    /// Whether any path with another D can be asked for, by trail.
    goes_on: Vec<bool>,
    /// The sets of pictures that photons of different kinds give to, by trail.
    parts: Vec<Vec<Pictures>>,
    /// By source of light.
    sources: Vec<Kinds>,
    /// The source of each light; then the environment's, and that of what glows by itself.
    source_of: Vec<usize>,
    /// Number of named layers.
    layers: usize,
}

/// The kinds of light that comes from one source.
#[derive(Clone, Debug, PartialEq)]
pub struct Kinds {
    straight: Kind,
    /// Of light that has met one S, two, and so on; `None` if no picture holds what becomes of it. From the last on they
    /// repeat those from `repeats` on.
    after_specular: Vec<Option<Kind>>,
    repeats: usize,
}

/// Expressions of named layers and the groups of lights that are layers of their own.
#[derive(Clone, Debug, Default)]
pub struct Layers<'a> {
    /// The expressions.
    pub expressions: Vec<&'a super::Expression>,
    /// Number of groups.
    pub groups: usize,
    /// The group of each light, then of the environment, then of what glows by itself.
    pub group_of: Vec<Option<usize>>,
}

impl Language {
    /// The language of paths and layers, which hold no other paths; `None` if they are too complex together.
    #[must_use]
    pub fn new(paths: &super::Paths, layers: &Layers<'_>) -> Option<Self> {
        Self::of(&paths.automaton(), layers)
    }

    /// The language of a picture without layers.
    pub(super) fn of_picture(picture: &Automaton) -> Option<Self> {
        Self::of(picture, &Layers::default())
    }

    fn of(picture: &Automaton, layers: &Layers<'_>) -> Option<Self> {
        let named = layers.expressions.len() + layers.groups;
        if named > MOST_LAYERS {
            return None;
        }
        let (forward, outputs) = joint(picture, layers)?;
        let (backward, functions) = explore(outputs, |function: &Vec<Pictures>, bounce| {
            forward.iter().map(|next| function[next[bounce as usize]]).collect()
        })?;
        let mut kinds = KindTable { functions: &functions, known: HashMap::new() };
        let mut sources = Vec::new();
        let mut numbers = HashMap::new();
        let mut source_of = Vec::with_capacity(layers.group_of.len());
        for &group in &layers.group_of {
            let source = *numbers.entry(group).or_insert(sources.len());
            if source == sources.len() {
                sources.push(kinds.of_source(&forward, layers.allowed(group))?);
            }
            source_of.push(source);
        }
        let columns = kinds.columns();
        let count = columns.len();
        let pictures =
            (0..functions.len()).flat_map(|trail| columns.iter().map(move |c| c[trail])).collect::<Vec<_>>();
        let next: Vec<[u16; 2]> = backward.iter().map(|n| n.map(|state| state as u16)).collect();
        let mut language = Self {
            goes_on: goes_on(&backward, &functions),
            parts: Vec::new(),
            next,
            pictures,
            kinds: count,
            sources,
            source_of,
            layers: named,
        };
        language.parts = (0..functions.len()).map(|trail| language.photon_parts(trail as u16)).collect();
        Some(language)
    }

    /// Number of named layers.
    #[must_use]
    pub fn layers(&self) -> usize {
        self.layers
    }

    /// The trail of a ray that has met one more surface.
    #[inline]
    #[must_use]
    pub fn step(&self, trail: Trail, bounce: Bounce) -> Trail {
        Trail(self.next[usize::from(trail.0)][bounce as usize])
    }

    /// The trail of a ray that has met this many S, then a D.
    #[must_use]
    pub fn first_diffuse(&self, specular: u8) -> Trail {
        let through = (0..specular).fold(Trail::default(), |trail, _| self.step(trail, Bounce::Specular));
        self.step(through, Bounce::Diffuse)
    }

    /// Pictures that hold a path: the eye's part of it, and the light's.
    #[inline]
    #[must_use]
    pub fn pictures(&self, trail: Trail, kind: Kind) -> Pictures {
        self.pictures[usize::from(trail.0) * self.kinds + usize::from(kind)]
    }

    /// Whether any path with another D on it can be asked for.
    #[inline]
    #[must_use]
    pub fn goes_on(&self, trail: Trail) -> bool {
        self.goes_on[usize::from(trail.0)]
    }

    /// The kind of light that comes straight from a light.
    #[inline]
    #[must_use]
    pub fn straight_from(&self, light: usize) -> Kind {
        self.sources[self.source_of[light]].straight
    }

    /// The same of the environment.
    #[inline]
    #[must_use]
    pub fn straight_from_environment(&self) -> Kind {
        self.sources[self.source_of[self.source_of.len() - 2]].straight
    }

    /// The same of what glows by itself.
    #[inline]
    #[must_use]
    pub fn glow(&self) -> Kind {
        self.sources[self.source_of[self.source_of.len() - 1]].straight
    }

    /// Whether any picture holds light that comes straight from any light to where the ray is.
    #[inline]
    #[must_use]
    pub fn any_straight(&self, trail: Trail) -> bool {
        self.sources.iter().any(|source| self.pictures(trail, source.straight) != 0)
    }

    /// The different sets of pictures that photons give to.
    #[inline]
    #[must_use]
    pub fn parts(&self, trail: Trail) -> &[Pictures] {
        &self.parts[usize::from(trail.0)]
    }

    /// The kinds of photons of a light, or of the environment.
    #[must_use]
    pub fn photons_from(&self, light: Option<usize>) -> &Kinds {
        let place = light.unwrap_or(self.source_of.len() - 2);
        &self.sources[self.source_of[place]]
    }

    fn photon_parts(&self, trail: u16) -> Vec<Pictures> {
        let kinds = self.sources.iter().flat_map(|source| source.after_specular.iter().flatten());
        let mut parts: Vec<Pictures> =
            kinds.map(|&kind| self.pictures(Trail(trail), kind)).filter(|&pictures| pictures != 0).collect();
        parts.sort_unstable();
        parts.dedup();
        parts
    }
}

impl Layers<'_> {
    /// Pictures that may hold light of a group.
    fn allowed(&self, group: Option<usize>) -> Pictures {
        let first = 1 + self.expressions.len();
        let all: Pictures = ((1 << self.groups) - 1) << first;
        !all | group.map_or(0, |group| 1 << (first + group))
    }
}

/// All expressions as one automaton, and the pictures that each of its states puts out, all groups of lights among them.
fn joint(picture: &Automaton, layers: &Layers<'_>) -> Option<(Vec<[usize; 2]>, Vec<Pictures>)> {
    let expressions: Vec<&Automaton> = layers.expressions.iter().map(|e| &e.automaton).collect();
    let automata = || std::iter::once(picture).chain(expressions.iter().copied());
    let (next, states) = explore(vec![0; 1 + expressions.len()], |states: &Vec<usize>, bounce| {
        automata().zip(states).map(|(automaton, &state)| automaton.step(state, bounce)).collect()
    })?;
    let groups = !layers.allowed(None);
    let output = |states: &Vec<usize>| {
        if !picture.accepts(states[0]) {
            return 0;
        }
        let accepted = automata().zip(states).enumerate();
        let bits = accepted.map(|(bit, (automaton, &state))| u64::from(automaton.accepts(state)) << bit);
        bits.fold(groups, |all, bit| all | bit)
    };
    let outputs: Vec<Pictures> = states.iter().map(output).collect();
    Some(minimise(&next, &outputs))
}

/// Whether a D, after any number of S, leaves anything to be asked for.
fn goes_on(next: &[[usize; 2]], functions: &[Vec<Pictures>]) -> Vec<bool> {
    let live: Vec<bool> = functions.iter().map(|f| f.iter().any(|&pictures| pictures != 0)).collect();
    let after_diffuse = |trail: usize| live[next[trail][Bounce::Diffuse as usize]];
    let goes_on = |first: usize| {
        let mut trail = first;
        // After as many S as there are trails they repeat.
        next.iter().any(|_| {
            let found = after_diffuse(trail);
            trail = next[trail][Bounce::Specular as usize];
            found
        })
    };
    (0..next.len()).map(goes_on).collect()
}

/// Numbers what light can be: columns of pictures, by trail.
struct KindTable<'a> {
    functions: &'a [Vec<Pictures>],
    known: HashMap<Vec<Pictures>, Kind>,
}

impl KindTable<'_> {
    fn of_source(&mut self, forward: &[[usize; 2]], allowed: Pictures) -> Option<Kinds> {
        let straight = self.kind(0, allowed)?;
        let mut after_specular = Vec::new();
        let mut met = HashMap::new();
        let mut state = forward[0][Bounce::Specular as usize];
        while !met.contains_key(&state) {
            met.insert(state, after_specular.len());
            let kind = self.kind(state, allowed)?;
            let wanted = self.functions.iter().any(|function| function[state] & allowed != 0);
            after_specular.push(wanted.then_some(kind));
            state = forward[state][Bounce::Specular as usize];
        }
        Some(Kinds { straight, after_specular, repeats: met[&state] })
    }

    /// `None` if there are too many kinds.
    fn kind(&mut self, state: usize, allowed: Pictures) -> Option<Kind> {
        let column: Vec<Pictures> = self.functions.iter().map(|f| f[state] & allowed).collect();
        let fresh = self.known.len();
        if let Some(&kind) = self.known.get(&column) {
            return Some(kind);
        }
        let kind = Kind::try_from(fresh).ok()?;
        self.known.insert(column, kind);
        Some(kind)
    }

    fn columns(self) -> Vec<Vec<Pictures>> {
        let mut columns: Vec<_> = self.known.into_iter().collect();
        columns.sort_unstable_by_key(|(_, kind)| *kind);
        columns.into_iter().map(|(column, _)| column).collect()
    }
}

impl Kinds {
    /// The kind of a photon that has met this many S, at least one; `None` if it is not asked for.
    #[inline]
    #[must_use]
    pub fn after(&self, specular: u32) -> Option<Kind> {
        self.after_specular[self.index(specular)]
    }

    /// Whether a photon that has met this many S is asked for now or after more of them.
    #[must_use]
    pub fn any_from(&self, specular: u32) -> bool {
        // Within what repeats, all of it is still to come.
        let ahead = self.index(specular).min(self.repeats);
        self.after_specular[ahead..].iter().any(Option::is_some)
    }

    fn index(&self, specular: u32) -> usize {
        let (index, count) = (specular as usize - 1, self.after_specular.len());
        if index < count { index } else { self.repeats + (index - self.repeats) % (count - self.repeats) }
    }
}
