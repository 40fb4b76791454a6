//! `nephroid plan`: what will run, what is left out, and why.

use super::Failure;
use super::files::{Loaded, load_scene, say};
use clap::Args;
use nephroid::plan::Plan;
use nephroid::report;
use std::path::PathBuf;

#[derive(Args, Debug)]
pub(super) struct PlanArguments {
    /// Scene file.
    scene: PathBuf,
    /// Print the plan as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &PlanArguments) -> Result<(), Failure> {
    let Loaded { scene, warnings } = load_scene(&arguments.scene)?;
    let plan = Plan::new(&scene);
    if arguments.json {
        say(format!("{:#}", report::plan_json(&scene, &plan)));
        return Ok(());
    }
    for decision in &plan.decisions {
        let mark = if decision.runs { "run " } else { "omit" };
        say(format!("{mark}  {:<13} {:<45} {}", decision.topic, decision.choice, decision.reason));
    }
    for warning in warnings.iter().chain(&plan.warnings) {
        say(format!("warning: {warning}"));
    }
    say(format!("memory: about {} MiB", plan.memory_bytes.div_ceil(1 << 20)));
    Ok(())
}
