//! The plan for the paths that are asked for, as far as they can occur in the scene.

use super::{Plan, language};
use crate::light_path::{Bounce, Classes, Kinds, PathClass, Share};
use crate::pass1_light::Source;
use crate::render::Render;
use crate::scene::{Material, Scene};

/// Light that reaches a D over mirrors or glass, however the eye then sees that.
pub(super) const THROUGH_SPECULAR: &str = "LS+D(D|S)*E";

/// Light that reaches a D straight from the light.
pub(super) const STRAIGHT: &str = "LD(D|S)*E";

/// Whether any path of a pattern, made of `alphabet`, is asked for.
pub(super) fn any(scene: &Scene, pattern: &str, alphabet: &[Bounce]) -> bool {
    scene.render.paths.share_of(pattern, alphabet) != Share::Nothing
}

/// The classes of which any path that can occur is asked for.
pub(super) fn classes(scene: &Scene) -> Classes {
    let alphabet = alphabet(scene);
    PathClass::ALL.into_iter().filter(|class| any(scene, class.expression(), &alphabet)).collect()
}

/// What a path can meet.
fn alphabet(scene: &Scene) -> Vec<Bounce> {
    let has = |bounce: &Bounce| {
        scene.objects.iter().map(|object| &scene.materials[object.material.index()]).any(|m| match bounce {
            Bounce::Diffuse => m.has_diffuse(),
            Bounce::Specular => m.has_specular(),
        })
    };
    Bounce::ALL.into_iter().filter(has).collect()
}

impl Plan {
    /// What the walks must carry along to tell paths and layers apart.
    pub(super) fn decide_layers(&mut self, scene: &Scene) {
        self.layer_names = language::layer_names(scene);
        if self.layer_names.is_empty() && scene.render.paths.are_whole_classes() {
            return;
        }
        self.language = language::of(scene);
        if self.language.is_none() {
            // Reading a scene refuses such layers; other paths have been put in the place of the scene's.
            let message =
                "the expressions of paths and layers are too complex together: the layers are left out";
            self.warn("layers_left_out", message);
            self.layer_names.clear();
            self.language = language::of_paths(scene);
        }
        let names = self.layer_names.join(", ");
        let choice = if names.is_empty() { "no layers".to_owned() } else { format!("layers {names}") };
        let reason = match scene.render.paths.are_whole_classes() {
            true => "what each ray has met says which layers its light is in",
            false => {
                "what each ray has met says whether its path is asked for: classes are asked for in part"
            }
        };
        self.decide("light paths", true, choice, reason);
    }

    /// The kinds of photons from a source of light.
    pub(super) fn photon_kinds(&self, source: Source) -> Option<Kinds> {
        let light = match source {
            Source::Light(id) => Some(id.index()),
            Source::Environment => None,
        };
        Some(self.language.as_ref()?.photons_from(light).clone())
    }

    /// Whether what the eye sees of the lights themselves is needed: it costs no rays of its own.
    pub(super) fn decide_emitted(&mut self, scene: &Scene) {
        let (runs, choice, reason) = if !self.classes.contains(PathClass::Emitted) {
            (false, "nothing", format!("the paths asked for, {}, hold none of LS*E here", scene.render.paths))
        } else if !self.lights_can_be_met && !scene.materials.iter().any(Material::glows) {
            let reason = "no light has a surface, nothing glows, and the environment is black: no emitter can be seen, directly or through a specular chain";
            (false, "nothing", reason.to_owned())
        } else {
            let reason = "lights with a surface, what glows or the environment may be seen";
            (true, "where the eye's rays meet it", reason.to_owned())
        };
        self.decide("emitted light", runs, choice, reason);
    }

    /// The layers of this render: those of the classes, and the named ones.
    #[must_use]
    pub fn layers(&self, scene: &Scene) -> Vec<Layer> {
        let classes = scene.render.paths.classes().into_iter().map(Layer::Class);
        let named = self.layer_names.iter().cloned().enumerate();
        classes.chain(named.map(|(index, name)| Layer::Named { index, name })).collect()
    }
}

/// A part of the picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Layer {
    /// The paths of a class.
    Class(PathClass),
    /// A layer of the scene file.
    Named {
        /// Its number among these.
        index: usize,
        /// Its name.
        name: String,
    },
}

impl Layer {
    /// Its name on the wire and in file names.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Class(class) => class.name(),
            Self::Named { name, .. } => name,
        }
    }
}

impl Render {
    /// The layers of this render, each a part of the picture.
    #[must_use]
    pub fn layers(&self) -> Vec<Layer> {
        self.plan().layers(self.scene())
    }
}
