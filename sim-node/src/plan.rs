//! The plan: which parts of the simulator a scene needs, and why the others are left out.

use crate::Model;
use crate::body::Body;
use crate::broad::{self, Method};
use crate::momentum;
use crate::stability::Bound;
use schemas::plan::Plan;
use schemas::scene::{ContactLaw, Integrator, OnRisk, Scene};

/// What the plan took in, as the code asks for it: outside the inner loops, where each combination picks
/// its own compiled variant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Features {
    pub gravity: bool,
    pub drag: bool,
    pub quadratic_drag: bool,
    pub damping: bool,
    pub friction: bool,
}

/// Makes the plan of a scene, and the switches that honour it.
///
/// Pairs of shapes need no switch: a pair that cannot meet never becomes a candidate.
pub(crate) fn make(scene: &Scene, model: &Model, everything: bool) -> (Features, Plan) {
    let mut plan = Plan::default();
    broad_phase(scene, model, &mut plan);
    let mut choose = |part: &str, needed: bool, reason: String| {
        plan.push(part, needed || everything, if everything { "forced on".to_owned() } else { reason });
        needed || everything
    };
    let (rings, spheres, planes) = (model.ring_count(), scene.spheres.len(), model.planes().len());
    let free = |range: std::ops::Range<usize>| model.bodies()[range].iter().filter(|b| !b.pinned).count();
    let free_rings = free(0..rings);
    let free_spheres = free(rings..rings + spheres);

    let counted = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
    let (of_rings, of_spheres) = (counted(rings, "ring"), counted(spheres, "sphere"));
    let counts = format!("{of_rings} ({free_rings} free), {of_spheres}, {}", counted(planes, "plane"));
    let (no_ring, no_sphere) = ((rings == 0, "no ring"), (spheres == 0, "no sphere"));
    let no_plane = (planes == 0, "no plane");
    // What would leave a pair out, and after that what leaves it out where the shapes are there.
    let pairs = [
        ("contact/ring-ring", vec![(rings < 2, "fewer than two rings")], (free_rings, "no free ring")),
        (
            "contact/ring-sphere",
            vec![no_ring, no_sphere],
            (free_rings + free_spheres, "no free ring or sphere"),
        ),
        ("contact/ring-plane", vec![no_ring, no_plane], (free_rings, "no free ring")),
        (
            "contact/sphere-sphere",
            vec![(spheres < 2, "fewer than two spheres")],
            (free_spheres, "no free sphere"),
        ),
        ("contact/sphere-plane", vec![no_sphere, no_plane], (free_spheres, "no free sphere")),
    ];
    let mut contact = false;
    for (part, shapes, (free, none_free)) in pairs {
        let mut missing: Vec<_> = shapes.iter().filter(|shape| shape.0).map(|shape| shape.1).collect();
        if missing.is_empty() && free == 0 {
            missing.push(none_free);
        }
        let needed = missing.is_empty();
        contact |= needed;
        choose(part, needed, if needed { counts.clone() } else { missing.join(", ") });
    }

    let solids = [
        ("capsule", "capsules", scene.capsules.len()),
        ("box", "boxes", scene.boxes.len()),
        ("polynomial", "polynomials", scene.polynomials.len()),
    ];
    let any_free = free(0..model.body_count()) > 0;
    for (one, many, count) in solids {
        let needed = count > 0 && any_free;
        contact |= needed;
        let reason = match count {
            0 => format!("no {one}"),
            _ if !any_free => "no free body".to_owned(),
            1 => format!("1 {one}, and what it may meet"),
            _ => format!("{count} {many}, and what they may meet"),
        };
        choose(&format!("contact/{one}"), needed, reason);
    }

    let materials: Vec<_> = model.materials_that_meet().collect();
    let damped = materials.iter().any(|pair| pair.damped());
    let reason = if damped { "a material is damped" } else { "no material is damped" };
    let damping = choose("contact/damping", contact && damped, reason.to_owned());
    let largest = materials.iter().fold(0.0, |largest, pair| {
        if pair.friction_coefficient > largest { pair.friction_coefficient } else { largest }
    });
    let reason = format!("largest friction coefficient of a pair is {largest}");
    let friction = choose("contact/friction", contact && largest > 0.0, reason);

    let [x, y, z] = scene.forces.gravity_m_per_s2;
    let gravity = choose("force/gravity", [x, y, z] != [0.0; 3], format!("gravity is [{x}, {y}, {z}] m/s^2"));
    let drags = [
        ("force/linear-drag", "kg/s", (|body| body.linear_drag.drag) as fn(&Body) -> f64),
        ("force/angular-drag", "kg m^2/s", |body| body.axial_drag.drag),
        ("force/quadratic-drag", "kg/m", |body| body.quadratic_drag),
    ];
    let [linear, angular, quadratic_drag] = drags.map(|(part, unit, coefficient)| {
        let dragged = || model.bodies().iter().filter(|body| !body.pinned && coefficient(body) > 0.0);
        let largest =
            dragged().map(coefficient).fold(0.0, |largest, c| if c > largest { c } else { largest });
        choose(part, largest > 0.0, format!("up to {largest} {unit} on {} free bodies", dragged().count()))
    });
    let drag = linear || angular;

    let driven = model.driven().len();
    choose("motion/prescribed", driven > 0, format!("{driven} bodies in {} motions", model.drives().len()));

    let reason = match &scene.method.sleep {
        Some(limits) => {
            format!("slower than {} m/s and {} m/s^2", limits.speed_m_per_s, limits.acceleration_m_per_s2)
        }
        None => "no method.sleep".to_owned(),
    };
    plan.push("motion/sleep", scene.method.sleep.is_some(), reason);

    // All but one are always left out: they are different answers, not parts of one.
    for integrator in Integrator::ALL {
        let reason = format!("method.integrator is {}", model.integrator().name());
        plan.push(&format!("integrator/{}", integrator.name()), integrator == model.integrator(), reason);
    }
    let asymmetric = model.body_count() - model.top_count();
    plan.push(
        "integrator/asymmetric-bodies",
        asymmetric > 0,
        format!("{asymmetric} of {} bodies are no symmetric tops", model.body_count()),
    );
    for law in [ContactLaw::CentrelineArc, ContactLaw::CentrelineMinima, ContactLaw::SurfaceIntegral] {
        let needed = contact && law == model.contact_law();
        let mut reason = format!("method.contact_law is {}", model.contact_law().name());
        if needed && law == ContactLaw::SurfaceIntegral {
            let surface = model.surface();
            let (sampler, average) =
                (word(serde_json::to_value(surface.sampler)), word(serde_json::to_value(surface.average)));
            reason = format!("{reason}, sampler {sampler}, average {average}, {} samples", surface.samples);
        }
        plan.push(&format!("law/{}", law.name()), needed, reason);
    }
    plan.push("audit/links", free_rings > 0 && rings > 1, counts.clone());
    plan.push("audit/gap", contact, counts);
    let reason = match momentum::left_out(model) {
        Some(reason) => reason.to_owned(),
        None => format!("{} free bodies", free(0..model.body_count())),
    };
    plan.push("audit/momentum", momentum::left_out(model).is_none(), reason);
    (Features { gravity, drag, quadratic_drag, damping, friction }, plan)
}

/// One of them is taken in: they are different ways to the same pairs.
fn broad_phase(scene: &Scene, model: &Model, plan: &mut Plan) {
    let count = model.body_count();
    let (chosen, reason) = broad::choose(scene.method.broad_phase, count);
    for (part, method) in [
        ("broad-phase/grid", Method::Grid),
        ("broad-phase/range-tree", Method::RangeTree),
        ("broad-phase/sweep-and-prune", Method::SweepAndPrune),
        ("broad-phase/brute", Method::Brute),
    ] {
        plan.push(part, method == chosen && count > 1, reason.clone());
    }
}

/// The time step's lines of the plan: what it is, and what bounds it.
pub(crate) fn time_step(model: &Model, automatic: bool, bound: &Bound, plan: &mut Plan) {
    let time_step_s = model.time().time_step_s;
    let mut reason = format!("{time_step_s:e} s");
    if automatic {
        reason += " (\"auto\")";
    }
    reason += &match bound.largest_s.is_finite() {
        true => format!("; at most {:.4e} s, the bound set by {}", bound.largest_s, bound.cause),
        false => "; no bound".to_owned(),
    };
    plan.push("time/step", true, reason);
    let covered = model.covered_penetration();
    let mut reason = match covered.is_finite() {
        true => format!("covered up to {:.3} % of two rings' wires", 100.0 * covered),
        false => "any".to_owned(),
    };
    if bound.lying_s < time_step_s {
        reason += &format!("; rings that come to lie on each other all round need {:.4e} s", bound.lying_s);
    }
    plan.push("time/penetration", covered.is_finite(), reason);
    let (integrator, on_risk) = (model.integrator(), model.method().on_risk);
    let in_parts = on_risk == OnRisk::Subdivide && integrator != Integrator::Dopri5;
    plan.push("time/subdivide", in_parts, format!("method.on_risk with {}", integrator.name()));
}

/// A choice as the scene writes it.
fn word(choice: serde_json::Result<serde_json::Value>) -> String {
    choice.ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
}
