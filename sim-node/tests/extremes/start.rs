//! What is refused before the first step, and what is not.

use crate::support::{ACROSS, Run, bound, head, parse, ring};
use proptest::prelude::*;
use schemas::scene::Scene;
use sim_node::{Model, ModelError, Scratch, State, step};

fn pair(integrator: &str, stiffness: f64) -> String {
    head(1e-9, integrator, stiffness, "damping_s_per_m = 0.1\n friction_coefficient = 0.2")
        + "[forces]\n gravity_m_per_s2 = [0.0, -9.81, 0.0]\n linear_drag_kg_per_s = 0.1\n \
           angular_drag_kg_m2_per_s = 0.1\n"
        + "[motion.shaker]\n keyframe = [{ time_s = 0.5, translation_m = [0.0, 0.1, 0.0], angle_rad = 0.2 }]\n \
           shake = { translation_m = [0.02, 0.0, 0.0], frequency_hz = 3.0, ramp_s = 0.25 }\n"
        + &ring([1.0, 0.18], 1.0, [0.0; 3], &format!("{ACROSS}\n motion = \"shaker\""))
        + "[[capsule]]\n radius_m = 0.25\n half_length_m = 0.5\n mass_kg = 1.0\n material = \"wire\"\n \
           position_m = [3.0, 0.0, 0.0]\n\
           [[box]]\n half_extents_m = [0.25, 0.375, 0.5]\n edge_radius_m = 0.0625\n mass_kg = 1.0\n \
           material = \"wire\"\n position_m = [-3.0, 0.0, 0.0]\n"
        + &ring([1.0, 0.18], 1.0, [0.1, -1.5, 0.05], "")
        + "[[sphere]]\n radius_m = 0.5\n mass_kg = 1.0\n material = \"wire\"\n position_m = [0.3, -3.2, 1.2]\n\
           [[plane]]\n normal = [0.0, 1.0, 0.0]\n offset_m = -9.0\n material = \"wire\"\n"
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_time_step_beyond_the_bound_is_refused_with_it(
        share in 1.01..100.0_f64,
        exponent in 2..10_i32,
        rk4 in any::<bool>(),
    ) {
        let stiffness = libm::exp10(f64::from(exponent));
        let mut scene = parse(&pair(if rk4 { "rk4" } else { "verlet" }, stiffness));
        let largest = bound(&scene);
        scene.time.time_step_s = share * largest;
        let error = Model::compile(&scene).unwrap_err();
        prop_assert!(matches!(error, ModelError::TimeStep { largest_s, .. } if largest_s == largest), "{}", error);
        prop_assert!(error.to_string().contains(&format!("at most {largest:e} s")), "{}", error);
        scene.time.time_step_s = largest;
        prop_assert!(Model::compile(&scene).is_ok());
    }
}

#[test]
fn a_time_step_that_is_none_is_refused() {
    for bad in ["0", "-1", "nan", "inf", "-inf", "1e300", "5e-324", "-0.0"] {
        let error = Scene::parse(&pair("verlet", 1e4), &[format!("time.time_step_s={bad}")]).expect_err(bad);
        assert!(error.to_string().starts_with("time.time_step_s = "), "{error}");
    }
}

#[test]
fn nothing_one_ring_and_two_rings_far_apart_are_scenes() {
    let one = ring([1.0, 0.18], 1.0, [0.0; 3], "");
    let far = ring([1.0, 0.18], 1.0, [1e12, -1e12, 1e12], "linear_velocity_m_per_s = [1.0, 0.0, 0.0]");
    for bodies in ["".to_owned(), one.clone(), format!("{one}{far}")] {
        for choice in ["auto", "grid", "range-tree", "sweep-and-prune", "brute"] {
            let text = head(1e-3, "verlet", 1e4, "") + &bodies;
            let scene = Scene::parse(&text, &[format!("method.broad_phase={choice}")]).unwrap();
            Run::new(&scene).guarded(10).unwrap();
        }
    }
    for (position, value) in [("[1e300, 0.0, 0.0]", "1e300"), ("[0.0, 1.1e12, 0.0]", "1100000000000.0")] {
        let set = [format!("ring.0.position_m={position}")];
        let error = Scene::parse(&(head(1e-3, "verlet", 1e4, "") + &one), &set).expect_err(value).to_string();
        assert!(error.contains("ring[0].position_m") && error.contains(value), "{error}");
    }
}

/// Every number of a scene, set to every awkward value: refused by its name, or it runs.
#[test]
fn any_number_anywhere_is_refused_or_runs() {
    let text = toml::to_string(&parse(&pair("verlet", 1e4))).expect("a scene is TOML");
    let mut paths = Vec::new();
    numbers(&text.parse::<toml::Table>().unwrap().into(), String::new(), &mut paths);
    let (mut refused, mut ran, mut stopped) = (0, 0, 0);
    for path in &paths {
        for bad in [
            "nan", "inf", "-inf", "-0.0", "0.0", "-1.0", "5e-324", "1e-300", "1e-12", "1e12", "1e24", "1e308",
        ] {
            let scene = match Scene::parse(&text, &[format!("{path}={bad}")]) {
                Ok(scene) => scene,
                Err(error) => {
                    let last = path.rsplit('.').find(|part| part.parse::<usize>().is_err()).unwrap();
                    // Two values that do not go together may be refused under the other's name.
                    let table = path.split('.').next().unwrap();
                    let error = error.to_string();
                    assert!(error.contains(last) || error.contains(table), "{path} = {bad}: {error}");
                    refused += 1;
                    continue;
                }
            };
            assert!(!["nan", "inf", "-inf", "1e308"].contains(&bad), "{path} takes {bad}");
            let Ok((model, _)) = Model::compile(&scene) else {
                refused += 1;
                continue;
            };
            let mut state = State::initial(&model);
            let mut scratch = Scratch::new(&model, 1);
            match (0..3).find_map(|_| step(&model, &mut state, &mut scratch).err()) {
                Some(_) => stopped += 1,
                None => ran += 1,
            }
        }
    }
    println!("{} numbers: {refused} values refused, {ran} ran, {stopped} stopped", paths.len());
    assert!(paths.len() > 60 && refused > 300 && ran > 100);
}

fn numbers(value: &toml::Value, path: String, paths: &mut Vec<String>) {
    match value {
        toml::Value::Float(_) => paths.push(path),
        toml::Value::Array(items) => {
            items.iter().enumerate().for_each(|(i, item)| numbers(item, format!("{path}.{i}"), paths));
        }
        toml::Value::Table(table) => {
            for (key, item) in table {
                numbers(item, if path.is_empty() { key.clone() } else { format!("{path}.{key}") }, paths);
            }
        }
        _ => {}
    }
}

#[test]
fn friction_without_a_spring_and_negative_friction_are_refused() {
    for (key, value) in [
        ("friction_stiffness_n_per_m", "0.0"),
        ("friction_stiffness_n_per_m", "-1.0"),
        ("friction_coefficient", "-1e-9"),
        ("line_stiffness_n_per_m2", "0.0"),
    ] {
        let set = [format!("material.wire.{key}={value}")];
        let error = Scene::parse(&pair("verlet", 1e4), &set).expect_err(key).to_string();
        assert!(error.starts_with(&format!("material.wire.{key} = ")), "{error}");
    }
}
