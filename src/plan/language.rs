//! What the expressions of a scene ask for, and its layers.

use crate::light_path::{Language, Layers};
use crate::scene::{Material, Scene, UNGROUPED};

/// Names of the layers besides those of the classes: those with an expression, the light groups, and what is in none.
#[must_use]
pub(crate) fn layer_names(scene: &Scene) -> Vec<String> {
    let expressions = scene.render.layers.iter().map(|layer| layer.name.clone());
    let groups = scene.light_groups.names.iter().cloned();
    expressions.chain(groups).chain(any_ungrouped(scene).then(|| UNGROUPED.to_owned())).collect()
}

/// The language that the walks carry; `None` if it is too complex.
#[must_use]
pub(crate) fn of(scene: &Scene) -> Option<Language> {
    let groups = &scene.light_groups;
    let rest = any_ungrouped(scene);
    let named = groups.names.len();
    let ungrouped = rest.then_some(named);
    let lights = groups.of_light.iter().map(|group| group.or(ungrouped));
    let layers = Layers {
        expressions: scene.render.layers.iter().map(|layer| &layer.paths).collect(),
        groups: named + usize::from(rest),
        group_of: lights.chain([groups.of_environment.or(ungrouped), ungrouped]).collect(),
    };
    Language::new(&scene.render.paths, &layers)
}

/// The same without the layers.
#[must_use]
pub(crate) fn of_paths(scene: &Scene) -> Option<Language> {
    let layers = Layers { group_of: vec![None; scene.lights.len() + 2], ..Layers::default() };
    Language::new(&scene.render.paths, &layers)
}

/// Whether there are light groups, and light that is in none.
fn any_ungrouped(scene: &Scene) -> bool {
    let groups = &scene.light_groups;
    let sky = !scene.environment.is_black() && groups.of_environment.is_none();
    let lights = groups.of_light.iter().any(Option::is_none);
    !groups.names.is_empty() && (sky || lights || scene.materials.iter().any(Material::glows))
}
