//! Studies of the simulator's methods: what accuracy costs, where it breaks, what was left out.
//!
//! The one thing to know: a study fills a [`Report`] with numbers, and knows nothing of pages; `page`, `svg` and `files`
//! turn any report into one self-contained HTML file with CSV and SVG beside it.
//!
//! Errors and times come from separate runs: one for the error, with the clock off, and several for the time, the first
//! of which is thrown away. Errors and counts are the same on every machine; times are not.

// `!(x > 0.0)` is meant as written: a NaN must take the branch that finds nothing.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

mod accuracy;
mod contact;
mod energy;
mod files;
mod left_out;
mod page;
mod problem;
mod report;
mod scaling;
mod stability;
mod svg;
mod timing;

pub use files::{WriteError, write};
pub use report::{Axis, Figure, Map, Plot, Point, Report, Section, Series, Table};

use schemas::scene::Scene;

/// A study of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Study {
    /// Error against run time of the integrators.
    Accuracy,
    /// Error against run time of the contact laws.
    Contact,
    /// Where runs blow up, against the predicted limit.
    Stability,
    /// Energy over long runs.
    Energy,
    /// Time of a step against the number of rings, and threads.
    Scaling,
    /// What the plan left out of each scene, and what that saved.
    LeftOut,
}

impl Study {
    /// All of them, in the order of the report.
    pub const ALL: [Study; 6] =
        [Study::Accuracy, Study::Contact, Study::Stability, Study::Energy, Study::Scaling, Study::LeftOut];
}

/// How thorough to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Under two minutes on two cores: fewer points and repetitions, smaller scenes.
    Quick,
    /// Under forty minutes on two cores.
    Full,
}

impl Effort {
    /// The one or the other.
    pub(crate) fn pick<T>(self, quick: T, full: T) -> T {
        match self {
            Effort::Quick => quick,
            Effort::Full => full,
        }
    }
}

/// A scene of the user's, by a name.
#[derive(Clone, Debug)]
pub struct NamedScene {
    /// Its name in the report.
    pub name: String,
    /// The resolved scene.
    pub scene: Scene,
}

/// Told of the work done: how many of all parts, and what comes next.
pub type Progress<'a> = &'a mut dyn FnMut(usize, usize, &str);

/// Does some studies. `scenes` are those whose plans [`Study::LeftOut`] looks at; with `own` [`Study::Accuracy`] takes that
/// scene instead of the built-in problems.
pub fn run(
    studies: &[Study],
    effort: Effort,
    scenes: &[NamedScene],
    own: Option<&NamedScene>,
    progress: Progress,
) -> Report {
    let parts = |study: &Study| match study {
        Study::Accuracy => accuracy::parts(own),
        Study::Contact => contact::PARTS,
        Study::Stability => stability::PARTS,
        Study::Energy => energy::PARTS,
        Study::Scaling => scaling::parts(effort),
        Study::LeftOut => scenes.len(),
    };
    let total = studies.iter().map(parts).sum();
    let mut done = 0;
    let mut report = Report::new(effort);
    for study in studies {
        let mut step = |what: &str| {
            progress(done, total, what);
            done += 1;
        };
        report.sections.push(match study {
            Study::Accuracy => accuracy::study(effort, own, &mut step),
            Study::Contact => contact::study(effort, &mut step),
            Study::Stability => stability::study(effort, &mut step),
            Study::Energy => energy::study(effort, &mut step),
            Study::Scaling => scaling::study(effort, &mut step),
            Study::LeftOut => left_out::study(effort, scenes, &mut step),
        });
    }
    progress(total, total, "done");
    report
}
