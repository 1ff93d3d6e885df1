//! Equal bits for every kind of body and every integrator: twice, for any number of threads, from any state on.

use crate::support::Run;
use schemas::scene::Scene;
use schemas::{Hash, state};
use sim_node::{Model, Records, Scratch, State, step};
use std::fmt::Write;

pub fn bits(state: &State) -> Hash {
    let mut message = Vec::new();
    state::encode(&state.header(), &state.bodies, &state.contacts, &mut message)
}

/// Spheres, capsules and boxes that fall on rings over a floor, `copies` times; with a polynomial there is neither box nor
/// floor, for which it has no law. Implicit methods take rings and spheres alone.
pub fn heap(integrator: &str, copies: usize, polynomial: bool) -> String {
    let implicit = integrator == "backward-euler" || integrator == "energy-decaying";
    let friction = if implicit { 0.0 } else { 0.3 };
    let mut text = format!(
        "[time]\n duration_s = 0.2\n time_step_s = 2e-4\n[method]\n integrator = \"{integrator}\"\n[forces]\n \
         gravity_m_per_s2 = [0.0, 0.0, -9.81]\n[material.wire]\n line_stiffness_n_per_m2 = 4e3\n \
         point_stiffness_n_per_m = 1e3\n damping_s_per_m = 0.2\n friction_coefficient = {friction:?}\n \
         friction_stiffness_n_per_m = 1e3\n"
    );
    if !polynomial {
        text += "[[plane]]\n normal = [0.0, 0.0, 1.0]\n offset_m = 0.0\n material = \"wire\"\n";
    }
    let common = |place: [f64; 3], speed: f64| {
        format!(
            "material = \"wire\"\n position_m = {place:?}\n linear_velocity_m_per_s = [0.0, 0.0, {speed:?}]\n \
             angular_velocity_rad_per_s = [1.0, 2.0, -0.5]\n"
        )
    };
    for copy in 0..copies {
        let x = 5.0 * copy as f64;
        text += &format!(
            "[[ring]]\n major_radius_m = 1.0\n minor_radius_m = 0.18\n mass_kg = 1.0\n pinned = {}\n {}",
            copy % 2 == 0,
            common([x, 0.0, 0.6], -1.0).replace("[1.0, 2.0, -0.5]", "[0.0, 0.0, 0.0]")
        );
    }
    for copy in 0..copies {
        let x = 5.0 * copy as f64;
        let sphere =
            format!("[[sphere]]\n radius_m = 0.3\n mass_kg = 0.5\n {}", common([x + 1.0, 0.1, 1.12], -3.0));
        if implicit {
            text += &sphere;
            text += &format!(
                "[[ring]]\n major_radius_m = 0.8\n minor_radius_m = 0.1\n mass_kg = 0.5\n {}",
                common([x, 0.3, 1.75], -20.0)
            );
            continue;
        }
        text += &sphere;
        text += &format!(
            "[[capsule]]\n radius_m = 0.2\n half_length_m = 0.4\n mass_kg = 0.7\n {}",
            common([x - 1.0, 0.2, 1.5], -4.0)
        );
        if polynomial {
            continue;
        }
        text += &format!(
            "[[box]]\n half_extents_m = [0.3, 0.25, 0.35]\n edge_radius_m = 0.03\n mass_kg = 0.6\n {}",
            common([x, 1.2, 1.4], -4.0)
        );
    }
    if polynomial {
        text += &format!(
            "[[polynomial]]\n formula = \"6.25*x^2 + 11*y^2 + 25*z^2 - 1\"\n bounding_radius_m = 0.45\n \
             mass_kg = 0.6\n {}",
            common([0.0, -1.05, 1.05], -4.0)
        );
    }
    text
}

/// Integrators, whether a polynomial takes part, and steps that are enough for contacts of all kinds.
const METHODS: [(&str, bool, u64); 8] = [
    ("verlet", false, 400),
    ("verlet", true, 400),
    ("rk4", false, 300),
    ("rk4", true, 200),
    ("dopri5", false, 300),
    ("dopri5", true, 100),
    ("backward-euler", false, 300),
    ("energy-decaying", false, 300),
];

#[test]
fn memory_and_pauses_do_not_matter_for_any_body() {
    for (integrator, polynomial, steps) in METHODS {
        let mut run = Run::new(&heap(integrator, 2, polynomial));
        let (mut fresh, mut touched) = (run.state.clone(), 0);
        for done in 0..steps {
            run.step();
            // New memory for each step, and the state by way of its message now and then.
            if done % 97 == 5 {
                let mut message = Vec::new();
                state::encode(&fresh.header(), &fresh.bodies, &fresh.contacts, &mut message);
                fresh = State::from_message(&run.model, state::decode(&message).unwrap()).unwrap();
            }
            step(&run.model, &mut fresh, &mut Scratch::new(&run.model, 1)).unwrap();
            touched += run.state.contacts.len();
        }
        println!(
            "{integrator}: {} bodies, {touched} springs of friction in {steps} steps",
            run.model.body_count()
        );
        assert!(touched > 0 || run.model.integrator().is_implicit(), "they rub");
        assert!(run.state.dissipated_energy_j > 0.0, "they touch");
        assert_eq!(bits(&run.state), bits(&fresh), "{integrator}");
    }
}

/// A thousand bodies and more, from which on threads share the work.
#[test]
fn any_number_of_threads_gives_the_same_bits_for_any_body() {
    for (integrator, steps) in
        [("verlet", 150), ("rk4", 100), ("dopri5", 80), ("backward-euler", 80), ("energy-decaying", 80)]
    {
        let text = heap(integrator, 350, false).replace("duration_s = 0.2", "duration_s = 1.0");
        let (model, _) = Model::compile(&Scene::parse(&text, &[]).unwrap()).unwrap();
        assert!(model.body_count() > 1000);
        let run = |threads: usize| {
            let (mut state, mut scratch) = (State::initial(&model), Scratch::new(&model, threads));
            let mut records = Records::after(Hash::default());
            let mut contacts = 0;
            for _ in 0..steps {
                step(&model, &mut state, &mut scratch).unwrap();
                contacts += records.record(&model, &state, &scratch).contacts;
            }
            (bits(&state), records.chained_hash(), contacts)
        };
        let one = run(1);
        println!("{integrator}: {} contacts in {steps} steps", one.2);
        assert!(one.2 > 1000, "they touch");
        for threads in [1, 2, 3, 8] {
            assert_eq!(run(threads), one, "{integrator}, {threads} threads");
        }
    }
}

/// A thousand balls that fall onto a polynomial dome, so that several threads have closest points of it to find.
#[test]
fn any_number_of_threads_gives_the_same_bits_on_a_polynomial() {
    let mut text = "[time]\n duration_s = 1.0\n time_step_s = 2e-4\n[forces]\n gravity_m_per_s2 = [0.0, 0.0, -9.81]\n\
         [material.wire]\n point_stiffness_n_per_m = 1e3\n damping_s_per_m = 0.2\n friction_coefficient = 0.3\n \
         friction_stiffness_n_per_m = 1e3\n[[polynomial]]\n formula = \"0.01*x^2 + 0.01*y^2 + z^2 - 1\"\n \
         bounding_radius_m = 10.1\n mass_kg = 1.0\n material = \"wire\"\n position_m = [0.0, 0.0, 0.0]\n pinned = true\n"
        .to_owned();
    for (row, column) in (-19..=19).flat_map(|row| (-19..=19).map(move |column| (row, column))) {
        let (x, y) = (0.45 * f64::from(row), 0.45 * f64::from(column));
        let square: f64 = 0.01 * (x * x + y * y);
        if square < 0.72 {
            // Above the surface by the radius, as much as its slope asks for, and a little.
            let z = (1.0 - square).sqrt() + 0.205;
            text += &format!(
                "[[sphere]]\n radius_m = 0.2\n mass_kg = 0.5\n material = \"wire\"\n position_m = [{x:?}, {y:?}, {z:?}]\n \
                 linear_velocity_m_per_s = [0.1, 0.0, -3.0]\n"
            );
        }
    }
    let (model, _) = Model::compile(&Scene::parse(&text, &[]).unwrap()).unwrap();
    assert!(model.body_count() > 1024, "{}", model.body_count());
    let run = |threads: usize| {
        let (mut state, mut scratch) = (State::initial(&model), Scratch::new(&model, threads));
        for _ in 0..40 {
            step(&model, &mut state, &mut scratch).unwrap();
        }
        let dome = model.body_count() as u32 - 1;
        let touching = state.contacts.iter().filter(|contact| contact.body_b == dome).count();
        (bits(&state), touching)
    };
    let one = run(1);
    println!("{} of {} balls touch the polynomial", one.1, model.body_count() - 1);
    assert!(one.1 > 900);
    for threads in [2, 3] {
        assert_eq!(run(threads), one, "{threads} threads");
    }
}

/// The lines of `golden.txt` for what the scenes of rings do not have.
pub fn golden(text: &mut String) {
    for (integrator, polynomial, steps) in METHODS {
        let mut run = Run::new(&heap(integrator, 2, polynomial));
        for _ in 0..4 {
            run.steps(steps / 4);
            let name = if polynomial { "tangle" } else { "heap" };
            writeln!(text, "{name} {integrator} {} {}", run.state.step, bits(&run.state)).unwrap();
        }
    }
}
