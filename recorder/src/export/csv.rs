//! Tables: comma-separated values with a line of names; SI units, World frame. Every number is written with as many
//! digits as it takes to read back the same bits. An empty field is a value that a step does not have.

use super::{ExportError, States};
use crate::message::Kind;
use crate::reader::Log;
use crate::states::StateSource;
use schemas::state::StateMessage;
use std::io::Write;

/// One line a step record: `steps.csv`.
///
/// # Errors
///
/// [`ExportError`] if the log cannot be read or the sink refuses.
pub fn steps(log: &Log, sink: &mut dyn Write) -> Result<(), ExportError> {
    writeln!(
        sink,
        "step,sim_time_s,candidate_pairs,contacts,kinetic_energy_j,gravity_energy_j,contact_energy_j,\
         dissipated_energy_j,drive_work_j,penetration_m,error_estimate_m,links,links_intact,gap_min_m,state_hash,\
         chained_hash"
    )?;
    for record in log.steps() {
        let record = record?;
        let audit = record.audit;
        writeln!(
            sink,
            "{},{:?},{},{},{:?},{:?},{:?},{:?},{},{:?},{},{},{},{},{},{}",
            record.step,
            record.sim_time_s,
            record.candidate_pairs,
            record.contacts,
            record.kinetic_energy_j,
            record.gravity_energy_j,
            record.contact_energy_j,
            record.dissipated_energy_j,
            field(record.drive_work_j),
            record.penetration_m,
            field(record.error_estimate_m),
            field(audit.map(|audit| audit.links)),
            field(audit.map(|audit| audit.links_intact)),
            field(audit.and_then(|audit| audit.gap_min_m)),
            record.state_hash,
            record.chained_hash
        )?;
    }
    Ok(())
}

/// One line a body and state: `bodies.csv`.
///
/// # Errors
///
/// As [`steps`].
pub fn bodies(
    log: &Log,
    states: States,
    source: &mut dyn StateSource,
    sink: &mut dyn Write,
) -> Result<(), ExportError> {
    let scene = log.scene()?.scene;
    writeln!(
        sink,
        "step,sim_time_s,body,name,x_m,y_m,z_m,qx,qy,qz,qw,vx_m_per_s,vy_m_per_s,vz_m_per_s,wx_rad_per_s,\
         wy_rad_per_s,wz_rad_per_s"
    )?;
    // Names are looked up once a body, not once a line.
    let names: Vec<String> = (0..scene.body_count()).map(|body| scene.body_name(body)).collect();
    for_each_state(log, states, source, &mut |state| {
        let (step, sim_time_s) = (state.header.step, state.header.sim_time_s);
        for (index, (body, name)) in state.bodies.iter().zip(&names).enumerate() {
            write!(sink, "{step},{sim_time_s:?},{index},{name}")?;
            let numbers = [
                &body.position_m[..],
                &body.orientation,
                &body.linear_velocity_m_per_s,
                &body.angular_velocity_rad_per_s,
            ];
            for number in numbers.into_iter().flatten() {
                write!(sink, ",{number:?}")?;
            }
            writeln!(sink)?;
        }
        Ok(())
    })
}

/// One line a contact history and state, in scenes with friction: `contacts.csv`.
///
/// # Errors
///
/// As [`steps`].
pub fn contacts(
    log: &Log,
    states: States,
    source: &mut dyn StateSource,
    sink: &mut dyn Write,
) -> Result<(), ExportError> {
    writeln!(sink, "step,sim_time_s,body_a,body_b,arc,mid_cos,mid_sin,spring_x_m,spring_y_m,spring_z_m")?;
    for_each_state(log, states, source, &mut |state| {
        for contact in &state.contacts {
            let [x, y, z] = contact.spring_m;
            writeln!(
                sink,
                "{},{:?},{},{},{},{:?},{:?},{x:?},{y:?},{z:?}",
                state.header.step,
                state.header.sim_time_s,
                contact.body_a,
                contact.body_b,
                contact.arc,
                contact.mid_cos,
                contact.mid_sin
            )?;
        }
        Ok(())
    })
}

fn for_each_state(
    log: &Log,
    states: States,
    source: &mut dyn StateSource,
    act: &mut dyn FnMut(&StateMessage) -> Result<(), ExportError>,
) -> Result<(), ExportError> {
    let time = log.scene()?.scene.time;
    for step in 0..log.count(Kind::Step) as u64 {
        if (states == States::All || time.frame_at(step).is_some())
            && let Some(state) = source.state(step)?
        {
            act(&state)?;
        }
    }
    Ok(())
}

fn field(value: Option<impl std::fmt::Debug>) -> String {
    value.map_or(String::new(), |value| format!("{value:?}"))
}
