//! Polynomial bodies: contact against closed forms, energy and momentum, refusals.

use crate::support::{Run, check};
use geometry::Vec3;
use schemas::scene::Scene;
use sim_node::{Model, Scratch, mechanical_energy};

fn scene(time_step_s: f64, duration_s: f64, rest: &str) -> String {
    format!(
        r#"
        [time]
        duration_s = {duration_s:?}
        time_step_s = {time_step_s:?}
        frames_per_second = 1.0
        [material.matter]
        line_stiffness_n_per_m2 = 1e5
        point_stiffness_n_per_m = 1e5
        {rest}
        "#
    )
}

/// A torus with R = 0.6 m and r = 0.3 m.
const TORUS: &str = "[[polynomial]]\n formula = \"(x^2 + y^2 + z^2 + 3)^2 - 16*(x^2 + y^2)\"\n scale_m = 0.3\n \
                     bounding_radius_m = 0.95\n";

#[test]
fn a_polynomial_torus_moves_as_a_ring_does() {
    let first = "[[ring]]\n major_radius_m = 0.5\n minor_radius_m = 0.1\n mass_kg = 0.4\n \
                 material = \"matter\"\n position_m = [0.55, 0.1, 0.05]\n orientation = [0.6, 0.0, 0.0, 0.8]\n \
                 linear_velocity_m_per_s = [2.0, 0.3, 0.1]\n angular_velocity_rad_per_s = [0.0, 1.0, 2.0]\n";
    let place = "mass_kg = 1.5\n material = \"matter\"\n position_m = [0.0, 0.0, 0.0]\n \
                 angular_velocity_rad_per_s = [0.1, 0.3, 1.0]\n";
    let ring = format!("{first}[[ring]]\n major_radius_m = 0.6\n minor_radius_m = 0.3\n {place}");
    let polynomial = format!("{first}{TORUS}{place}");
    let (mut a, mut b) = (Run::new(&scene(1e-4, 0.5, &ring)), Run::new(&scene(1e-4, 0.5, &polynomial)));
    let start = Vec3::from(a.state.bodies[0].linear_velocity_m_per_s);
    a.finish();
    b.finish();
    let turned = (Vec3::from(a.state.bodies[0].linear_velocity_m_per_s) - start).norm();
    assert!(turned > 1.0, "they collide");
    for (index, (a, b)) in a.state.bodies.iter().zip(&b.state.bodies).enumerate() {
        let apart = (Vec3::from(a.position_m) - Vec3::from(b.position_m)).norm();
        // The moments of inertia differ by 7e-6 (quadrature), and the contact integrals by about 1e-5.
        check(&format!("body {index}, way apart (m)"), apart, 2e-5);
        let spin = Vec3::from(a.angular_velocity_rad_per_s) - Vec3::from(b.angular_velocity_rad_per_s);
        check(&format!("body {index}, spin apart (rad/s)"), spin.norm(), 2e-3);
    }
}

/// A tangle: a rounded cube with dents, 0.5 m wide.
const TANGLE: &str = "[[polynomial]]\n formula = \"x^4 - 5*x^2 + y^4 - 5*y^2 + z^4 - 5*z^2 + 11.8\"\n scale_m = 0.12\n \
                      bounding_radius_m = 0.42\n density_kg_per_m3 = 20.0\n material = \"matter\"\n \
                      position_m = [0.0, 0.0, 0.0]\n";

const VISITORS: &str = r#"
        [[ring]]
        major_radius_m = 0.3
        minor_radius_m = 0.05
        mass_kg = 0.4
        material = "matter"
        position_m = [0.9, 0.05, 0.1]
        linear_velocity_m_per_s = [-2.0, 0.0, 0.0]
        orientation = [0.3, 0.5, 0.1, 0.8062257748298549]
        [[sphere]]
        radius_m = 0.1
        mass_kg = 0.3
        material = "matter"
        position_m = [-0.8, 0.1, 0.1]
        linear_velocity_m_per_s = [2.0, 0.1, 0.0]
        [[capsule]]
        radius_m = 0.08
        half_length_m = 0.2
        mass_kg = 0.3
        material = "matter"
        position_m = [0.05, -0.8, 0.1]
        linear_velocity_m_per_s = [0.0, 2.0, 0.0]
        orientation = [0.3, 0.1, 0.4, 0.8602325267042627]
        "#;

#[test]
fn bodies_bounce_off_a_polynomial_and_energy_and_momentum_are_kept() {
    let mut run = Run::new(&scene(1e-4, 0.8, &format!("{VISITORS}{TANGLE}")));
    let momentum = |run: &Run| {
        let mut sum = Vec3::zeros();
        for (body, state) in run.model.bodies().iter().zip(&run.state.bodies) {
            sum += Vec3::from(state.linear_velocity_m_per_s) * body.mass_kg;
        }
        sum
    };
    let (before, _) = mechanical_energy(&run.model, &run.state);
    let start = momentum(&run);
    let mut pushed = [false; 4];
    let count = run.model.time().step_count();
    for _ in 0..count {
        let old: Vec<_> = run.state.bodies.iter().map(|body| body.linear_velocity_m_per_s).collect();
        run.step();
        for (pushed, (old, new)) in pushed.iter_mut().zip(old.iter().zip(&run.state.bodies)) {
            *pushed |= *old != new.linear_velocity_m_per_s;
        }
    }
    assert_eq!(pushed, [true; 4], "every body meets another one");
    let (after, _) = mechanical_energy(&run.model, &run.state);
    check("momentum (N s)", (momentum(&run) - start).norm(), 1e-13);
    // Of the contacts' stiffest mode, some 1,500 rad/s, (h w)^2 / 24 is 1e-3.
    check("energy, relative", (after / before - 1.0).abs(), 1e-3);
}

#[test]
fn polynomials_have_the_same_bits_with_everything_on_and_from_any_state() {
    let text = scene(1e-4, 0.4, &format!("{VISITORS}{TANGLE}"));
    let (mut run, mut all) = (Run::new(&text), Run::new(&text));
    all.model = Model::compile_everything_on(&Scene::parse(&text, &[]).unwrap()).unwrap().0;
    all.scratch = Scratch::new(&all.model, 1);
    for _ in 0..4 {
        run.steps(1000);
        all.steps(1000);
        assert_eq!(run.state, all.state);
        run.scratch = Scratch::new(&run.model, 1);
    }
}

#[test]
fn what_has_no_law_is_refused_with_the_reason() {
    let refuse = |rest: &str| {
        let text = scene(1e-4, 1.0, rest);
        Model::compile(&Scene::parse(&text, &[]).unwrap()).map(|_| ()).map_err(|error| error.to_string())
    };
    let floor = "[[plane]]\n normal = [0.0, 0.0, 1.0]\n offset_m = -2.0\n material = \"matter\"\n";
    let cuboid = "[[box]]\n half_extents_m = [0.1, 0.1, 0.1]\n mass_kg = 1.0\n material = \"matter\"\n \
                  position_m = [3.0, 0.0, 0.0]\n";
    let message = refuse(&format!("{TANGLE}{floor}")).unwrap_err();
    println!("{message}");
    assert!(
        message.starts_with("polynomial 0 and plane 0 could meet, and a plane has no law of contact with")
    );
    assert_eq!(
        refuse(&format!("{TANGLE}pinned = true\n{floor}{cuboid}")).unwrap_err(),
        refuse(&format!("{TANGLE}{cuboid}")).unwrap_err()
    );
    assert!(
        refuse(&format!("{TANGLE}{cuboid}")).unwrap_err().starts_with("box 0 and polynomial 0 could meet")
    );
    assert!(refuse(&format!("{TANGLE}{TANGLE}")).unwrap_err().starts_with("polynomial 0 and polynomial 1"));
    assert_eq!(refuse(&format!("{TANGLE}pinned = true\n{floor}{cuboid}pinned = true\n")), Ok(()));
    let broken = TANGLE.replace("x^4", "x^^4");
    let message = refuse(&broken).unwrap_err();
    println!("{message}");
    assert!(message.starts_with("polynomial 0: a whole power from 0 to 16 was expected, at character 3"));
    let message = refuse(&TANGLE.replace("0.42", "0.3")).unwrap_err();
    println!("{message}");
    assert!(message.starts_with("polynomial 0: F is -"));
}

#[test]
fn an_off_centre_body_starts_where_its_formula_says() {
    // A ball about (1, 2, 3) of the formula's frame, turned by a quarter about z and moved.
    let ball = "[[polynomial]]\n formula = \"(x - 1)^2 + (y - 2)^2 + (z - 3)^2 - 1\"\n bounding_radius_m = 5.0\n \
                mass_kg = 1.0\n material = \"matter\"\n position_m = [10.0, 0.0, 0.0]\n \
                orientation = [0.0, 0.0, 0.7071067811865476, 0.7071067811865476]\n";
    let run = Run::new(&scene(1e-4, 1.0, ball));
    let place = Vec3::from(run.state.bodies[0].position_m);
    // Quadrature with lines 10 m / 256 apart.
    check("centre (m)", (place - Vec3::new(8.0, 1.0, 3.0)).norm(), 2e-3);
}
