//! Problems with a known answer.
//!
//! A ring of R 1 m, r 0.18 m and 1 kg has `I1 = 5/8 r^2 + R^2 / 2` and `I3 = 3/4 r^2 + R^2` (kg m^2).

use sim_node::State;

/// A problem: a scene without `[time]` and `[method]`, and how wrong a state at its end is.
pub(crate) struct Problem {
    pub id: &'static str,
    pub title: &'static str,
    /// What moves, and what is compared.
    pub caption: &'static str,
    pub duration_s: f64,
    /// Numbers of steps to try.
    pub steps: Vec<u64>,
    pub rest: String,
    pub answer: Answer,
}

/// The error of a state.
pub(crate) type ErrorOf = Box<dyn Fn(&State) -> f64>;

/// How the right answer is known.
pub(crate) enum Answer {
    /// By a formula: the error of a state at the end.
    Formula(ErrorOf),
    /// By a much finer run: errors are distances of the bodies' places, the root of their mean square (m).
    FinerRun,
}

const R: f64 = 1.0;
const WIRE: f64 = 0.18;
const I1: f64 = 0.625 * WIRE * WIRE + 0.5 * R * R;
const I3: f64 = 0.75 * WIRE * WIRE + R * R;
const PI: f64 = core::f64::consts::PI;

fn ring(more: &str) -> String {
    format!(
        "[[ring]]\nmajor_radius_m = 1.0\nminor_radius_m = 0.18\nmass_kg = 1.0\nmaterial = \"wire\"\n{more}\n"
    )
}

/// `count` steps, and twice as many, and so on.
fn doubled(count: u64, times: u32) -> Vec<u64> {
    (0..times).map(|power| count << power).collect()
}

pub(crate) fn all(levels: u32) -> Vec<Problem> {
    vec![top(levels), fall(levels), bounce(levels, 0.0), bounce(levels, 0.2), pendulum(levels), sheet(levels)]
}

type Quaternion = [f64; 4];

/// The turn by a rotation vector, as (x, y, z, w).
fn turn(vector: [f64; 3]) -> Quaternion {
    let angle = (vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]).sqrt();
    let share = if angle > 0.0 { libm::sin(0.5 * angle) / angle } else { 0.5 };
    [vector[0] * share, vector[1] * share, vector[2] * share, libm::cos(0.5 * angle)]
}

fn product(a: Quaternion, b: Quaternion) -> Quaternion {
    [
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
        a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    ]
}

/// The angle between two orientations (rad).
fn angle(a: Quaternion, b: Quaternion) -> f64 {
    let [x, y, z, _] = product([-a[0], -a[1], -a[2], a[3]], b);
    2.0 * libm::asin((x * x + y * y + z * z).sqrt())
}

/// A torque-free top: `R(t) = exp(t L / I1) R0 exp(t w3 (1 - I3 / I1) e3)`.
fn top(levels: u32) -> Problem {
    let duration = 10.0;
    let (l, tilt) = ([0.3, -0.2, 1.1], 0.35);
    let start = turn([tilt, 0.0, 0.0]);
    let n = [0.0, -libm::sin(tilt), libm::cos(tilt)];
    let spin = (l[0] * n[0] + l[1] * n[1] + l[2] * n[2]) / I3;
    let own = spin * (1.0 - I3 / I1);
    let w: [f64; 3] = core::array::from_fn(|axis| l[axis] / I1 + n[axis] * own);
    let precession = turn(l.map(|component| component * duration / I1));
    let end = product(product(precession, start), turn([0.0, 0.0, own * duration]));
    Problem {
        id: "top",
        title: "Torque-free top",
        caption: "A ring spins freely for 10 s, some 21 rad. Error: the angle between its pose and the closed form (rad).",
        duration_s: duration,
        steps: doubled(20, levels + 1),
        rest: format!(
            "[material.wire]\n{}",
            ring(&format!(
                "position_m = [0.0, 0.0, 0.0]\norientation = {start:?}\nangular_velocity_rad_per_s = {w:?}"
            ))
        ),
        answer: Answer::Formula(Box::new(move |state| angle(state.bodies[0].orientation, end))),
    }
}

/// Fall with linear drag: `z = z0 + v t + (v0 - v) tau (1 - exp(-t / tau))`, with `v = -m g / c`, `tau = m / c`.
fn fall(levels: u32) -> Problem {
    let (duration, drag, g, v0) = (2.0, 1.5, 9.81, 5.0);
    let (tau, last) = (1.0 / drag, -g / drag);
    let z = last * duration - (v0 - last) * tau * libm::expm1(-duration / tau);
    Problem {
        id: "fall",
        title: "Throw with linear drag",
        caption: "A ring is thrown upwards at 5 m/s with a drag of 1.5 kg/s, and falls for 2 s. Error: of its height (m).",
        duration_s: duration,
        steps: doubled(4, levels + 1),
        rest: format!(
            "[forces]\ngravity_m_per_s2 = [0.0, 0.0, -{g:?}]\nlinear_drag_kg_per_s = {drag:?}\n[material.wire]\n{}",
            ring(&format!("position_m = [0.0, 0.0, 0.0]\nlinear_velocity_m_per_s = [0.0, 0.0, {v0:?}]"))
        ),
        answer: Answer::Formula(Box::new(move |state| (state.bodies[0].position_m[2] - z).abs())),
    }
}

/// A ring that falls flat on a plane touches all round: one spring of stiffness `K = 2 pi R k`. With a damping ratio
/// `z` that never pulls, contact ends when the force is 0: after `2 acos(z) / wd`, with the speed
/// `v0 exp(-2 z acos(z) / sqrt(1 - z^2))`, at the depth `c v / K`.
fn bounce(levels: u32, ratio: f64) -> Problem {
    let (k, v0, gap): (f64, f64, f64) = (1e4, 2.0, 0.01);
    let stiffness = 2.0 * PI * R * k;
    let omega = stiffness.sqrt();
    let root = (1.0 - ratio * ratio).sqrt();
    let quarter = libm::acos(ratio);
    let contact = 2.0 * quarter / (omega * root);
    let v1 = v0 * libm::exp(-2.0 * ratio * quarter / root);
    let damping = 2.0 * ratio * omega;
    let duration = gap / v0 + contact + 0.01;
    let end = WIRE - damping * v1 / stiffness + v1 * 0.01;
    let deepest = v0 / omega * libm::exp(-ratio * quarter / root);
    let line = damping / (2.0 * PI * R);
    Problem {
        id: if ratio > 0.0 { "bounce-damped" } else { "bounce" },
        title: if ratio > 0.0 { "Bounce with damping (Kelvin-Voigt)" } else { "Bounce without damping" },
        caption: "A ring falls flat on a plane at 2 m/s and leaves it again: one spring, k 1e4 N/m^2 along the ring; damping \
                  ratio 0.2 where damped. Error: of its height 10 ms after it has left, over the largest depth. Touching \
                  and leaving fall inside a step.",
        duration_s: duration,
        steps: doubled(40, levels + 2),
        rest: format!(
            "[material.wire]\nline_stiffness_n_per_m2 = {k:?}\nline_damping_n_s_per_m2 = {line:?}\n[[plane]]\nnormal = [0.0, 0.0, 1.0]\n\
             offset_m = 0.0\nmaterial = \"wire\"\n{}",
            ring(&format!(
                "position_m = [0.0, 0.0, {:?}]\nlinear_velocity_m_per_s = [0.0, 0.0, -{v0:?}]",
                WIRE + gap
            ))
        ),
        answer: Answer::Formula(Box::new(move |state| (state.bodies[0].position_m[2] - end).abs() / deepest)),
    }
}

/// A ring that hangs in a pinned one and swings.
fn pendulum(levels: u32) -> Problem {
    let pinned = ring("position_m = [0.0, 0.0, 0.0]\npinned = true");
    let hanging = ring(
        "position_m = [0.15, 0.0, -1.62]\norientation = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476]\n\
         linear_velocity_m_per_s = [0.3, 0.2, 0.0]",
    );
    Problem {
        id: "hanging-ring",
        title: "Ring that hangs in a ring",
        caption: "A ring swings in a pinned one for 0.5 s, without damping, k 1e5 N/m^2: always in contact but for small hops. \
                  Error: of its place (m).",
        duration_s: 0.5,
        steps: doubled(100, levels + 1),
        rest: format!(
            "[forces]\ngravity_m_per_s2 = [0.0, 0.0, -9.81]\n[material.wire]\nline_stiffness_n_per_m2 = 1e5\n{}{}",
            pinned.replace(
                "position_m",
                "orientation = [0.0, 0.7071067811865476, 0.0, 0.7071067811865476]\nposition_m"
            ),
            hanging
        ),
        answer: Answer::FinerRun,
    }
}

/// A small hanging sheet.
fn sheet(levels: u32) -> Problem {
    Problem {
        id: "sheet",
        title: "Sheet of 4 by 4 rings",
        caption: "A European 4-in-1 sheet falls into its first row for 0.3 s, without damping, k 1e5 N/m^2: contacts open and close all the \
                  time. Error: the root mean square of all places (m).",
        duration_s: 0.3,
        steps: doubled(75, levels + 1),
        rest: "[forces]\ngravity_m_per_s2 = [0.0, 9.81, 0.0]\n[material.wire]\nline_stiffness_n_per_m2 = 1e5\n[[weave]]\n\
               pattern = \"european-4-in-1\"\nrows = 4\ncolumns = 4\nmajor_radius_m = 1.0\nminor_radius_m = 0.18\nring_mass_kg = 1.0\n\
               material = \"wire\"\npins = [[0, 0], [0, 1], [0, 2], [0, 3]]\n"
            .to_owned(),
        answer: Answer::FinerRun,
    }
}
