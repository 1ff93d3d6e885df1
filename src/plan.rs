//! `plan`: what a scene needs, and what is left out.

use crate::failure::{Failure, Outcome};
use crate::scene_file;
use crate::terminal::{print, print_json};
use clap::Args;
use schemas::plan::Plan;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Example:\n  chainmail plan scenes/drop.toml")]
pub struct Arguments {
    /// The scene file
    scene: PathBuf,
    /// Override a key of the scene, as key.path=value; may be given again
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let (scene, _) = scene_file::load(&arguments.scene, &arguments.set, None)?;
    let refused =
        |error: &dyn std::fmt::Display| Failure::input(format!("{}: {error}", arguments.scene.display()));
    #[cfg_attr(not(feature = "render"), expect(unused_mut))]
    let (_, mut plan) = sim_node::Model::compile(&scene).map_err(|error| refused(&error))?;
    #[cfg(feature = "render")]
    {
        let (_, looks) = render_node::RenderModel::try_compile(&scene).map_err(|error| refused(&error))?;
        plan.entries.extend(looks.entries);
    }
    if arguments.json { print_json(&plan) } else { print(&table(&plan)) }
}

fn table(plan: &Plan) -> String {
    let width = plan.entries.iter().map(|entry| entry.part.len()).max().unwrap_or(0);
    let line = |entry: &schemas::plan::PlanEntry| {
        let verdict = if entry.needed { "needed  " } else { "left out" };
        format!("{:width$}  {verdict}  {}\n", entry.part, entry.reason)
    };
    plan.entries.iter().map(line).collect()
}
