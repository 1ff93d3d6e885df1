//! Broad phase: which pairs of bodies can touch.
//!
//! The one thing to know: the list kept here is a superset, and it only saves time. The *candidate pairs*
//! of a step are those of it whose bounding spheres overlap at that moment, which is a function of the
//! state alone; when the list was made, and how, never reaches a bit of the result.

mod close;
mod grid;
mod levels;
mod pairs;
mod range_tree;
mod sweep;
mod validity;

pub(crate) use close::CloseList;
pub use pairs::{Method, Workspace, find_pairs};
pub use range_tree::RangeTree;

use crate::Model;
use crate::model::HalfSpace;
use geometry::{Circle, Vec3};
use pairs::Bodies;
use schemas::scene::BroadPhase;
use validity::Validity;

/// Bodies up to which looking at every pair is fastest, and those up to which sorting along one axis is: by
/// measurement (`cargo bench -p sim-node --bench broad`), much the same for sheets and heaps.
const BRUTE_COUNT: usize = 32;
const SWEEP_COUNT: usize = 100;

/// The method for a scene with so many bodies, and the reason. The grid itself gives way to the range tree
/// where bodies lie too far apart for it.
pub(crate) fn choose(asked: BroadPhase, count: usize) -> (Method, String) {
    let method = match asked {
        BroadPhase::Auto if count <= BRUTE_COUNT => Method::Brute,
        BroadPhase::Auto if count <= SWEEP_COUNT => Method::SweepAndPrune,
        BroadPhase::Auto | BroadPhase::Grid => Method::Grid,
        BroadPhase::RangeTree => Method::RangeTree,
        BroadPhase::SweepAndPrune => Method::SweepAndPrune,
        BroadPhase::Brute => Method::Brute,
    };
    let reason = match asked {
        BroadPhase::Auto => format!(
            "{count} bodies: brute up to {BRUTE_COUNT}, sweep-and-prune up to {SWEEP_COUNT}, then the grid"
        ),
        _ => "method.broad_phase says which".to_owned(),
    };
    (method, reason)
}

/// The pairs that can touch before two others have come closer by the skin.
#[derive(Debug, Default)]
pub(crate) struct Neighbours {
    /// Ordered by (first, second). The first body of a pair carries the contact arc.
    pairs: Vec<(u32, u32)>,
    /// Where the bodies were when the list was made.
    anchors: Vec<Vec3>,
    radii: Vec<f64>,
    workspace: Workspace,
    validity: Validity,
    pub(crate) rebuilds: u64,
}

/// Skin in bounding radii of the largest ring. Wider: fewer rebuilds, more pairs to look at. The result
/// does not depend on it.
const SKIN_SHARE: f64 = 0.25;

impl Neighbours {
    pub(crate) fn pairs(&self) -> &[(u32, u32)] {
        &self.pairs
    }

    /// Makes the list anew if bodies may have come too close for the old one.
    pub(crate) fn update(&mut self, model: &Model, circles: &[Circle]) {
        let centre = |body: usize| circles[body].centre;
        let known = self.anchors.len() == circles.len();
        if !known || !self.validity.holds(&self.anchors, model.planes(), centre) {
            self.rebuild(model, circles);
        }
    }

    fn rebuild(&mut self, model: &Model, circles: &[Circle]) {
        self.rebuilds += 1;
        self.anchors.clear();
        self.anchors.extend(circles.iter().map(|circle| circle.centre));
        let skin = model.grid_radius() * SKIN_SHARE;
        let bodies = model.bodies();
        self.radii.clear();
        self.radii.extend(bodies.iter().map(|body| body.bounding_radius));
        let near = Bodies { centres: &self.anchors, radii: &self.radii, skin };
        pairs::gather(model.broad_phase(), &near, &mut self.workspace, &mut self.pairs);
        self.pairs.retain_mut(|pair| {
            let (a, b) = *pair;
            *pair = model.ordered(a, b);
            model.interacts(a, b)
        });
        let above = |body: usize, plane: &HalfSpace| {
            plane.normal.dot(&self.anchors[body]) - plane.offset - bodies[body].bounding_radius
        };
        for (index, plane) in model.planes().iter().enumerate() {
            for body in (0..bodies.len()).filter(|&body| !bodies[body].pinned) {
                if above(body, plane) < skin {
                    self.pairs.push((body as u32, (bodies.len() + index) as u32));
                }
            }
        }
        self.workspace.sort(bodies.len(), &mut self.pairs);
        self.validity.start(&self.anchors, &self.radii, skin, model.planes(), |body, plane| {
            let slack = above(body, &model.planes()[plane]);
            (!bodies[body].pinned && !(slack < skin)).then_some(slack)
        });
    }
}
