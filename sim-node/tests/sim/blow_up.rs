//! Scenes that press bodies against each other as hard as the stability bound is stated for, run at any share of
//! it: what `stability.rs` asserts and the bench `stability` measures.

use schemas::Hash;
use schemas::scene::Scene;
use schemas::step::StepRecord;
use sim_node::{Compile, Model, Records, Scratch, State, audit, check_audit, evaluate, step};

/// A scene for the bound, without time step and integrator.
pub struct Case {
    pub name: &'static str,
    text: String,
    duration_s: f64,
}

/// How a case went at some step.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// The largest energy from nowhere, over the largest that the motion has in a run at a fifth of the bound.
    pub gained_share: f64,
    /// Deepest contact, as a share of both wires' radii together.
    pub penetration_share: f64,
    /// What the run's own audits said first.
    pub stop: Option<String>,
    /// Broken links, numbers that are not finite, or ten times the energy that there is.
    pub blown_up: bool,
}

const ACROSS: &str = "orientation = [0.0, 0.7071067811865476, 0.0, 0.7071067811865476]";

fn ring(position: [f64; 3], more: &str) -> String {
    format!(
        "[[ring]]\n major_radius_m = 1.0\n minor_radius_m = 0.18\n mass_kg = 1.0\n material = \"wire\"\n \
         position_m = {position:?}\n {more}\n"
    )
}

fn sphere(radius_m: f64, position: [f64; 3], more: &str) -> String {
    format!(
        "[[sphere]]\n radius_m = {radius_m:?}\n mass_kg = 1.0\n material = \"wire\"\n position_m = {position:?}\n \
         {more}\n"
    )
}

fn weave(pattern: &str, rows: u32, columns: u32) -> String {
    let pinned = if pattern == "chain" { 1 } else { columns };
    let pins: Vec<String> = (0..pinned).map(|column| format!("[0, {column}]")).collect();
    format!(
        "[[weave]]\n pattern = \"{pattern}\"\n rows = {rows}\n columns = {columns}\n major_radius_m = 1.0\n minor_radius_m = 0.18\n \
         ring_mass_kg = 0.63956\n material = \"wire\"\n pins = [{}]\n",
        pins.join(", ")
    )
}

/// All cases, the largest last. Stiffnesses and speeds are such that rings that cross press in by about the twentieth that the bound is
/// stated for; elsewhere the stiffness does not depend on the depth.
pub fn cases() -> Vec<Case> {
    let case = |name, stiffness: f64, damping: f64, gravity: [f64; 3], bodies: String, duration_s| {
        let text = format!(
            "[forces]\n gravity_m_per_s2 = {gravity:?}\n[material.wire]\n line_stiffness_n_per_m2 = {stiffness:?}\n \
             point_stiffness_n_per_m = {stiffness:?}\n damping_s_per_m = {damping:?}\n{bodies}"
        );
        Case { name, text, duration_s }
    };
    let down = [0.0, 0.0, -9.81];
    let along = [0.0, 9.81, 0.0];
    let floor = "[[plane]]\n normal = [0.0, 0.0, 1.0]\n offset_m = 0.0\n material = \"wire\"\n";
    let crossed = ring([0.0; 3], &format!("{ACROSS}\n pinned = true"))
        + &ring([0.1, -1.5, 0.05], "linear_velocity_m_per_s = [0.0, -1.9, 0.0]");
    let free = ring([0.0; 3], ACROSS)
        + &ring(
            [0.1, -1.3, 0.2],
            "linear_velocity_m_per_s = [0.3, -2.0, 0.5]\n angular_velocity_rad_per_s = [1.0, 2.0, 0.0]",
        );
    let pinned = |z: f64| ring([0.0, 0.0, z], "pinned = true");
    let stack = pinned(0.0)
        + &ring([0.0, 0.0, 0.6], "linear_velocity_m_per_s = [0.0, 0.0, 3.0]")
        + &ring([0.0, 0.0, 1.2], "linear_velocity_m_per_s = [0.0, 0.0, -3.0]")
        + &pinned(1.8);
    let seat = pinned(0.0) + &sphere(1.0, [0.0, 0.0, 1.0], "");
    vec![
        case("two linked rings, one pinned, undamped", 1e5, 0.0, [0.0, -9.81, 0.0], crossed, 4.0),
        case("two linked rings, free and turning, undamped", 1e5, 0.0, [0.0; 3], free, 4.0),
        case("chain of 12, hanging", 1e5, 0.3, [9.81, 0.0, 0.0], weave("chain", 1, 12), 3.0),
        case("sheet 8x8, hanging", 1.5e4, 0.3, along, weave("european-4-in-1", 8, 8), 3.0),
        case("sheet 8x8, hanging, undamped", 1.5e4, 0.0, along, weave("european-4-in-1", 8, 8), 3.0),
        case("coaxial rings that bounce, undamped", 1e5, 0.0, [0.0; 3], stack, 4.0),
        case("sphere that drops into a ring, undamped", 1e4, 0.0, down, seat, 6.0),
        case(
            "ring that drops flat on a plane, undamped",
            1e4,
            0.0,
            down,
            format!("{floor}{}", ring([0.0, 0.0, 0.4], "")),
            6.0,
        ),
        case(
            "ring that drops aslant on a plane, undamped",
            1e4,
            0.0,
            down,
            format!(
                "{floor}{}",
                ring([0.0, 0.0, 0.9], "orientation = [0.0, 0.19866933079506122, 0.0, 0.9800665778412416]")
            ),
            6.0,
        ),
        case(
            "sphere that drops on a plane, undamped",
            1e4,
            0.0,
            down,
            format!("{floor}{}", sphere(0.5, [0.0, 0.0, 0.8], "")),
            6.0,
        ),
        case("sheet 16x16, hanging", 3e4, 0.3, along, weave("european-4-in-1", 16, 16), 3.0),
    ]
}

impl Case {
    fn scene(&self, integrator: &str, time_step_s: f64) -> Scene {
        let text = format!(
            "[time]\n duration_s = {:?}\n time_step_s = {time_step_s:?}\n frames_per_second = {:?}\n[method]\n \
             integrator = \"{integrator}\"\n{}",
            self.duration_s,
            0.1 / time_step_s,
            self.text
        );
        Scene::parse(&text, &[]).unwrap_or_else(|error| panic!("{}: {error}\n{text}", self.name))
    }

    fn compile(&self, integrator: &str, time_step_s: f64) -> Model {
        let how = Compile { beyond_stability_bound: true, ..Compile::default() };
        let scene = self.scene(integrator, time_step_s);
        Model::compile_as(&scene, how).unwrap_or_else(|error| panic!("{}: {error}", self.name)).0
    }

    /// The bound on the step (s).
    pub fn bound(&self, integrator: &str) -> f64 {
        self.compile(integrator, 1e-4).largest_time_step_s()
    }

    /// The largest energy that the motion has (J): in a run of `verlet` at a fifth of the bound.
    pub fn energy(&self) -> f64 {
        let model = self.compile("verlet", 0.2 * self.bound("verlet"));
        let mut largest = 0.0;
        let mut start = None;
        follow(&model, |record, _| {
            let start = *start.get_or_insert(record.gravity_energy_j);
            let motion = record.kinetic_energy_j
                + record.contact_energy_j.abs()
                + (record.gravity_energy_j - start).abs();
            largest = if motion > largest { motion } else { largest };
            true
        });
        largest
    }

    /// Runs it at a share of the bound; `energy` is that of [`Case::energy`].
    pub fn run(&self, integrator: &str, share: f64, energy: f64) -> Outcome {
        let model = self.compile(integrator, share * self.bound(integrator));
        let mut outcome = Outcome::default();
        let mut start = None;
        let finite = follow(&model, |record, stop| {
            let total = record.kinetic_energy_j
                + record.gravity_energy_j
                + record.contact_energy_j
                + record.dissipated_energy_j;
            let gained = (total - *start.get_or_insert(total)) / energy;
            if gained > outcome.gained_share {
                outcome.gained_share = gained;
            }
            let share = record.penetration_m / 0.36;
            if share > outcome.penetration_share {
                outcome.penetration_share = share;
            }
            let broken = record.audit.is_some_and(|audit| audit.links_intact < audit.links);
            outcome.blown_up |= broken || gained > 10.0;
            if outcome.stop.is_none() {
                outcome.stop = stop;
            }
            !outcome.blown_up
        });
        outcome.blown_up |= !finite;
        outcome
    }
}

/// Makes the steps of a model and shows their records, with what the audits say of them; false from the caller ends
/// it. Returns whether all numbers stayed finite.
fn follow(model: &Model, mut look: impl FnMut(&StepRecord, Option<String>) -> bool) -> bool {
    let (mut state, mut scratch) = (State::initial(model), Scratch::new(model, 1));
    let mut records = Records::after(Hash::default());
    evaluate(model, &state, &mut scratch);
    loop {
        let mut record = records.record(model, &state, &scratch);
        // Links are looked at every tenth step.
        if state.step.is_multiple_of(10) {
            record.audit = Some(audit(model, &state));
        }
        let linked = record.audit.map_or(Ok(()), |audit| check_audit(model, &state, &audit));
        let stop = linked.and_then(|()| records.check_energy(&record)).err().map(|stop| stop.to_string());
        if !look(&record, stop) || state.step == model.time().step_count() {
            return true;
        }
        if step(model, &mut state, &mut scratch).is_err() {
            return false;
        }
    }
}
