//! Free motion at its limits: spin, denormal numbers, long times.

use std::time::{Duration, Instant};

use crate::support::{INTEGRATORS, Run, Vec3, check, head, parse, ring};
use schemas::scene::Time;

/// Angular momentum of a ring in World (kg m^2/s).
fn angular_momentum(run: &Run, [major, minor]: [f64; 2], mass: f64) -> Vec3 {
    let [x, y, z, w] = run.state.bodies[0].orientation;
    // The ring's own z axis in World.
    let axis = Vec3::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
    let transverse = (0.625 * minor * minor + 0.5 * major * major) * mass;
    let axial = (0.75 * minor * minor + major * major) * mass;
    let spin = run.spin(0);
    transverse * spin + (axial - transverse) * axis.dot(&spin) * axis
}

/// A spin of 1e4 rad/s, in a ring of the usual size and in one of a micrometre with an inertia of 1e-18 kg m^2.
#[test]
fn fast_spin_keeps_its_angular_momentum() {
    for (radii, mass) in [([1.0, 0.18], 1.0), ([1e-6, 0.18e-6], 1e-6)] {
        let more = "orientation = [0.17410813759359586, 0.0, 0.0, 0.9847265389049334]\n \
                    angular_velocity_rad_per_s = [3000.0, -2000.0, 9000.0]";
        let mut run = Run::new(&parse(&(head(1e-4, "verlet", 1e4, "") + &ring(radii, mass, [0.0; 3], more))));
        let before = angular_momentum(&run, radii, mass);
        let steps = 10_000;
        run.steps(steps);
        let drift = (angular_momentum(&run, radii, mass) - before).norm() / before.norm();
        // About ten roundings a step in the worst case, all of one sign.
        check("angular momentum, relative drift", drift, 10.0 * f64::EPSILON * steps as f64);
        let length = run.state.bodies[0].orientation.iter().map(|q| q * q).sum::<f64>();
        check("quaternion's length squared less 1", (length - 1.0).abs(), 1e-15);
    }
}

/// Drag takes a speed down through the denormal numbers. They are kept (nothing is flushed to zero), and the ring
/// comes to rest or to where a step's loss is less than the last bit.
#[test]
fn drag_leads_through_denormal_numbers() {
    for integrator in INTEGRATORS {
        let text = head(1e-3, integrator, 1e4, "")
            + "[forces]\n linear_drag_kg_per_s = 1.0\n angular_drag_kg_m2_per_s = 1.0\n"
            + &ring([1.0, 0.18], 1.0, [0.0; 3], "");
        let mut run = Run::new(&parse(&text));
        run.state.bodies[0].linear_velocity_m_per_s = [1e-305, -1e-306, 0.0];
        run.state.bodies[0].angular_velocity_rad_per_s = [0.0, 1e-305, 1e-305];
        let mut denormal = 0;
        let steps = if integrator == "verlet" { 1_000_000 } else { 100_000 };
        let (mut normal_time, mut denormal_time) = (Duration::ZERO, Duration::ZERO);
        for _ in 0..steps {
            let start = Instant::now();
            run.step();
            let is_denormal = run.velocity(0).x.is_subnormal();
            *if is_denormal { &mut denormal_time } else { &mut normal_time } += start.elapsed();
            denormal += u64::from(is_denormal);
        }
        println!(
            "{integrator}: {denormal} steps with a denormal speed, {:.2} times as long as the others, {:e} m/s at the end",
            denormal_time.as_secs_f64()
                / denormal as f64
                / (normal_time.as_secs_f64() / (steps - denormal) as f64),
            run.velocity(0).x
        );
        assert!(denormal > 30_000, "from 2e-308 down, 1e-3 a step, to a few hundred times 5e-324");
        // At most where half an ulp is a thousandth: 500 times the smallest number.
        assert!(run.velocity(0).norm() < 1e-320 && run.position(0).norm() < 1e-300);
    }
}

#[test]
fn time_is_a_product_and_steps_are_64_bits() {
    let mut run = Run::new(&parse(&(head(1e-3, "verlet", 1e4, "") + &ring([1.0, 0.18], 1.0, [0.0; 3], ""))));
    for before in [999_999_999, (1 << 32) - 1, 1 << 40, (1 << 53) - 1] {
        run.state.step = before;
        run.step();
        let step = before + 1;
        assert_eq!((run.state.step, run.state.sim_time_s), (step, step as f64 * 1e-3));
    }
    // A sum of a billion steps would be off by about a microsecond; the frames lie on their steps still.
    let time = Time { duration_s: 1e9, time_step_s: 1e-3, automatic: false, frames_per_second: 1.0 };
    for frame in [1, 4_000_000, 999_999_999] {
        let step = time.frame_step(frame);
        assert_eq!((step, time.frame_at(step), time.frame_at(step + 1)), (1000 * frame, Some(frame), None));
    }
}
