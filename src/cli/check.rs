//! `nephroid check`: is the scene all right?

use super::Failure;
use super::files::{Loaded, load_scene, say};
use clap::Args;
use nephroid::plan::Plan;
use std::path::PathBuf;

#[derive(Args, Debug)]
pub(super) struct CheckArguments {
    /// Scene file.
    scene: PathBuf,
}

pub(super) fn run(arguments: &CheckArguments) -> Result<(), Failure> {
    let Loaded { scene, warnings } = load_scene(&arguments.scene)?;
    let plan = Plan::new(&scene);
    for warning in warnings.iter().chain(&plan.warnings) {
        say(format!("warning: {warning}"));
    }
    let primitives = scene.geometry.primitive_count();
    say(format!(
        "{}: all right; {} objects, {primitives} primitives, {} lights",
        arguments.scene.display(),
        scene.objects.iter().filter(|o| o.emitter.is_none()).count(),
        scene.lights.len(),
    ));
    Ok(())
}
