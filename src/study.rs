//! `study`: error against run time, stability, scaling, measured on this machine and written as a report.

use crate::failure::{Exit, Failure, Outcome};
use crate::progress::{Meter, Progress};
use crate::terminal::{print, say};
use crate::{output, scene_file};
use clap::{Args, ValueEnum};
use schemas::scene::Scene;
use std::path::PathBuf;
use studies::{Effort, NamedScene, Study};

#[derive(Args)]
#[command(after_help = "Examples:
  chainmail study all --quick                            a first look, in two minutes; writes out/study/
  chainmail study all --out report                       the whole report
  chainmail study accuracy --scene scenes/stiff.toml     each integrator on a scene of your own")]
pub struct Arguments {
    /// What to study
    kind: Kind,
    /// For `accuracy`: this scene instead of the built-in problems
    #[arg(long)]
    scene: Option<PathBuf>,
    /// Override a key of that scene, as key.path=value; may be given again
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "scene")]
    set: Vec<String>,
    /// Fewer points, fewer repetitions, smaller scenes
    #[arg(long)]
    quick: bool,
    /// The folder to write into; otherwise a new one, out/study
    #[arg(long)]
    out: Option<PathBuf>,
    /// Replace the report in a folder that is not empty
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// Error against run time of the integrators
    Accuracy,
    /// Error against run time of the contact laws
    Contact,
    /// Where runs blow up, against the predicted limit
    Stability,
    /// Energy over long runs
    Energy,
    /// Time of a step against the number of rings and threads
    Scaling,
    /// What the plan left out of each scene, and what that saved
    LeftOut,
    /// All of them
    All,
}

impl Kind {
    fn studies(self) -> &'static [Study] {
        match self {
            Kind::Accuracy => &[Study::Accuracy],
            Kind::Contact => &[Study::Contact],
            Kind::Stability => &[Study::Stability],
            Kind::Energy => &[Study::Energy],
            Kind::Scaling => &[Study::Scaling],
            Kind::LeftOut => &[Study::LeftOut],
            Kind::All => &Study::ALL,
        }
    }
}

/// The scenes that the program comes with.
const SHIPPED: [(&str, &str); 11] = [
    ("two-rings", include_str!("../scenes/two-rings.toml")),
    ("drop", include_str!("../scenes/drop.toml")),
    ("ball", include_str!("../scenes/ball.toml")),
    ("drape", include_str!("../scenes/drape.toml")),
    ("sheet", include_str!("../scenes/sheet.toml")),
    ("chain", include_str!("../scenes/chain.toml")),
    ("pull", include_str!("../scenes/pull.toml")),
    ("japanese", include_str!("../scenes/japanese.toml")),
    ("polynomial", include_str!("../scenes/polynomial.toml")),
    ("stiff", include_str!("../scenes/stiff.toml")),
    ("big", include_str!("../scenes/big.toml")),
];

pub fn run(arguments: &Arguments) -> Outcome {
    let own = match &arguments.scene {
        Some(path) if arguments.kind == Kind::Accuracy => {
            let (scene, _) = scene_file::load(path, &arguments.set, None)?;
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            Some(NamedScene { name, scene })
        }
        Some(_) => return Err(Failure::input("--scene goes with `study accuracy` only")),
        None => None,
    };
    let scenes = SHIPPED
        .iter()
        .map(|(name, text)| {
            let scene =
                Scene::parse(text, &[]).map_err(|error| Failure::input(format!("{name}: {error}")))?;
            Ok(NamedScene { name: (*name).to_owned(), scene })
        })
        .collect::<Result<Vec<_>, Failure>>()?;
    let folder = output::make(arguments.out.as_deref(), "study", arguments.force)?;
    let effort = if arguments.quick { Effort::Quick } else { Effort::Full };
    let mut meter = Meter::for_this_process("study", "parts");
    let report =
        studies::run(arguments.kind.studies(), effort, &scenes, own.as_ref(), &mut |done, total, what| {
            tracing::debug!(part = what, "studying");
            meter.show(Progress { done: done as u64, total: total as u64 });
        });
    meter.finish();
    let page = studies::write(&report, &folder).map_err(Failure::lost)?;
    print(&format!("{}\n", page.display()))?;
    let faults: Vec<&String> = report.sections.iter().flat_map(|section| &section.faults).collect();
    for fault in &faults {
        say(format!("error: {fault}"));
    }
    Ok(if faults.is_empty() { Exit::Done } else { Exit::Differs })
}
