//! Layers and light groups: their names, and whether all expressions together stay small.

use super::super::issue::IssueCode;
use super::super::read::quoted;
use super::super::{NamedLayer, Scene};
use super::Compiler;
use crate::light_path::{Expression, MOST_LAYERS, PathClass};
use crate::plan::language;

/// Longest name of a layer.
const MOST_LETTERS: usize = 64;

/// The layer of all lights that are in no group, if there are groups.
pub(crate) const UNGROUPED: &str = "ungrouped";

impl Compiler<'_> {
    /// The named layers; `None` if one is wrong, which has then been noted.
    pub(super) fn layers(&mut self, layers: &[(String, Option<Expression>)]) -> Option<Vec<NamedLayer>> {
        let given = layers.iter().filter_map(|(name, paths)| Some((name, paths.as_ref()?)));
        let mut named = Vec::new();
        for (name, paths) in given {
            let pointer = format!("/render/layers/{}", quoted(name));
            if !self.is_layer_name(name, &pointer) {
                continue;
            }
            if self.light_groups.names.contains(name) {
                let message = format!("`{name}` is a light group, and so the name of a layer already");
                self.issues.add(pointer, IssueCode::ConflictingFields, message);
                continue;
            }
            named.push(NamedLayer { name: name.clone(), paths: paths.clone() });
        }
        (named.len() == layers.len()).then_some(named)
    }

    /// The group of a light at `pointer`, by the name that it is given.
    pub(super) fn light_group(&mut self, name: Option<&str>, pointer: &str) -> Option<usize> {
        let name = name?;
        if let Some(known) = self.light_groups.names.iter().position(|known| known == name) {
            return Some(known);
        }
        if !self.is_layer_name(name, &format!("{pointer}/group")) {
            return None;
        }
        self.light_groups.names.push(name.to_owned());
        Some(self.light_groups.names.len() - 1)
    }

    /// Layers become files: their names are plain, and are not those of the classes.
    fn is_layer_name(&mut self, name: &str, pointer: &str) -> bool {
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
        if name.len() > MOST_LETTERS || !name.chars().all(plain) {
            let message =
                format!("a layer's name is made of at most {MOST_LETTERS} of a-z, A-Z, 0-9, - and _");
            self.issues.add(pointer, IssueCode::UnknownValue, message);
            return false;
        }
        let taken = PathClass::ALL.iter().any(|class| class.name() == name) || name == UNGROUPED;
        if taken {
            let message = format!("`{name}` is the name of a layer that there is anyway");
            self.issues.add(pointer, IssueCode::ConflictingFields, message);
        }
        !taken
    }

    /// What the walks carry must be small: all expressions are followed at once.
    pub(super) fn check_layers(&mut self, scene: &Scene) -> Option<()> {
        let names = language::layer_names(scene).len();
        if names > MOST_LAYERS {
            let message =
                format!("there are {names} named layers and light groups; at most {MOST_LAYERS} can be");
            self.issues.add("/render/layers", IssueCode::TooLarge, message);
            return None;
        }
        if names > 0 && language::of(scene).is_none() {
            let message =
                "the expressions of paths and layers, for all light groups, are too complex together";
            self.issues.add("/render/layers", IssueCode::TooLarge, message);
            return None;
        }
        Some(())
    }
}
