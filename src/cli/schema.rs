//! `nephroid schema`: what a scene file may hold.

use super::Failure;
use super::files::say;
use clap::Args;
use nephroid::scene::{schema, schema_markdown};

#[derive(Args, Debug)]
pub(super) struct SchemaArguments {
    /// Print a page in Markdown for people instead.
    #[arg(long)]
    markdown: bool,
}

pub(super) fn run(arguments: &SchemaArguments) -> Result<(), Failure> {
    if arguments.markdown {
        say(schema_markdown().trim_end());
    } else {
        say(format!("{:#}", schema()));
    }
    Ok(())
}
