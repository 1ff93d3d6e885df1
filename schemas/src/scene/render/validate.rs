//! Every value of the second half of a scene is checked here.

use super::super::SceneError;
use super::super::validate::{
    colour, cross, norm, not_negative, positive, refuse, refuse_number, unit_or_longer, vector,
};
use super::surface::validate_surfaces;
use super::{Bsdf, Camera, Light, Look, Projection, Render};

pub(in super::super) fn validate(render: &Render) -> Result<(), SceneError> {
    validate_film(render)?;
    validate_camera(&render.camera)?;
    unit_or_longer("render.sky.up", &render.sky.up)?;
    colour("render.sky.zenith_radiance", &render.sky.zenith_radiance)?;
    colour("render.sky.horizon_radiance", &render.sky.horizon_radiance)?;
    if let Some(environment) = &render.environment {
        if environment.file.is_empty() {
            return Err(refuse("render.environment.file", "\"\"", "the name of an .exr or .hdr file"));
        }
        positive("render.environment.scale", environment.scale)?;
        vector("render.environment.turn_rad", &[environment.turn_rad])?;
    }
    for (index, light) in render.lights.iter().enumerate() {
        validate_light(light, &|field: &str| format!("render.light[{index}].{field}"))?;
    }
    for (name, look) in &render.looks {
        validate_look(look, &|field: &str| format!("render.look.{name}.{field}"))?;
    }
    validate_surfaces(render)
}

fn validate_film(render: &Render) -> Result<(), SceneError> {
    for (key, size) in [("render.width_px", render.width_px), ("render.height_px", render.height_px)] {
        if size == 0 || size > 65_536 {
            return Err(refuse(key, size, "1 to 65536 pixels"));
        }
    }
    if u64::from(render.width_px) * u64::from(render.height_px) > 1 << 28 {
        let size = format!("{} x {}", render.width_px, render.height_px);
        return Err(refuse("render.width_px x render.height_px", size, "at most 2^28 pixels"));
    }
    if let Some([left, top, width, height]) = render.crop_px {
        let within = |start: u32, size: u32, all: u32| {
            size > 0 && u64::from(start) + u64::from(size) <= u64::from(all)
        };
        if !within(left, width, render.width_px) || !within(top, height, render.height_px) {
            let expected = format!(
                "left, top, width and height of a part of {} x {} pixels",
                render.width_px, render.height_px
            );
            return Err(refuse("render.crop_px", format!("{:?}", [left, top, width, height]), &expected));
        }
    }
    if render.samples_per_pixel == 0 {
        return Err(refuse("render.samples_per_pixel", 0, "1 or more"));
    }
    if let Some(noise) = render.noise_max
        && !(noise > 0.0 && noise < 1.0)
    {
        return Err(refuse_number(
            "render.noise_max",
            noise,
            "more than 0 and less than 1; 0.02 is hardly visible",
        ));
    }
    render.colouring.max.map_or(Ok(()), |max| positive("render.colouring.max", max))?;
    render.indirect_max.map_or(Ok(()), |most| positive("render.indirect_max", most))?;
    let radius = render.filter.radius_px;
    if !(radius > 0.0 && radius <= 16.0) {
        return Err(refuse_number("render.filter.radius_px", radius, "more than 0 and at most 16 pixels"));
    }
    positive("render.exposure", render.exposure)
}

fn validate_camera(camera: &Camera) -> Result<(), SceneError> {
    vector("render.camera.up", &camera.up)?;
    let key = |field: &str| format!("render.camera.{field}");
    let angle = camera.vertical_field_of_view_rad;
    validate_view(&key, camera, &camera.position_m, &camera.look_at_m, angle)?;
    match (camera.projection, camera.view_height_m) {
        (Projection::Orthographic, None) => {
            return Err(refuse(
                &key("view_height_m"),
                "missing",
                "what an orthographic picture shows, in metres",
            ));
        }
        (Projection::Perspective, Some(height)) => {
            let expected = "no such key unless projection is \"orthographic\"";
            return Err(refuse_number(&key("view_height_m"), height, expected));
        }
        (_, height) => height.map_or(Ok(()), |height| positive(&key("view_height_m"), height))?,
    }
    not_negative(&key("lens_radius_m"), camera.lens_radius_m)?;
    if camera.lens_radius_m > 0.0 && camera.projection == Projection::Orthographic {
        let expected = "0: an orthographic picture is sharp everywhere";
        return Err(refuse_number(&key("lens_radius_m"), camera.lens_radius_m, expected));
    }
    camera.focus_distance_m.map_or(Ok(()), |distance| positive(&key("focus_distance_m"), distance))?;
    not_negative(&key("shutter_s"), camera.shutter_s)?;
    let moments = camera.shutter_moments;
    if !(moments.is_power_of_two() && moments <= 256) {
        return Err(refuse(&key("shutter_moments"), moments, "a power of two from 1 to 256"));
    }
    let mut last = f64::NEG_INFINITY;
    for (index, viewpoint) in camera.path.iter().enumerate() {
        let key = |field: &str| format!("render.camera.path[{index}].{field}");
        vector(&key("time_s"), &[viewpoint.time_s])?;
        if viewpoint.time_s <= last {
            let expected = format!("later than the {last:?} of the viewpoint before");
            return Err(refuse_number(&key("time_s"), viewpoint.time_s, &expected));
        }
        last = viewpoint.time_s;
        let angle = viewpoint.vertical_field_of_view_rad.unwrap_or(angle);
        validate_view(&key, camera, &viewpoint.position_m, &viewpoint.look_at_m, angle)?;
    }
    Ok(())
}

fn validate_view(
    key: &dyn Fn(&str) -> String,
    camera: &Camera,
    position_m: &[f64; 3],
    look_at_m: &[f64; 3],
    angle: f64,
) -> Result<(), SceneError> {
    vector(&key("position_m"), position_m)?;
    vector(&key("look_at_m"), look_at_m)?;
    if !(angle > 0.0 && angle < std::f64::consts::PI) {
        return Err(refuse_number(&key("vertical_field_of_view_rad"), angle, "more than 0 and less than pi"));
    }
    let view: [f64; 3] = std::array::from_fn(|axis| look_at_m[axis] - position_m[axis]);
    let side = cross(&view, &camera.up);
    // All of them are finite: that was checked above.
    if norm(&side) <= 1e-9 * norm(&view) * norm(&camera.up) {
        let value = format!("{:?}", camera.up);
        return Err(refuse(
            "render.camera.up",
            value,
            "a direction that is not along the view, and look_at_m apart from position_m",
        ));
    }
    Ok(())
}

fn validate_light(light: &Light, key: &dyn Fn(&str) -> String) -> Result<(), SceneError> {
    match light {
        Light::Sphere { position_m, radius_m, radiance } => {
            vector(&key("position_m"), position_m)?;
            if *radius_m == 0.0 {
                let expected = "a positive radius: without area there is no light at any radiance; a light \
                                of no size is shape = \"point\" with an intensity (pi r^2 times the radiance)";
                return Err(refuse_number(&key("radius_m"), *radius_m, expected));
            }
            positive(&key("radius_m"), *radius_m)?;
            colour(&key("radiance"), radiance)
        }
        Light::Rectangle { corner_m, edge_u_m, edge_v_m, radiance } => {
            vector(&key("corner_m"), corner_m)?;
            vector(&key("edge_u_m"), edge_u_m)?;
            vector(&key("edge_v_m"), edge_v_m)?;
            unit_or_longer(&key("edge_u_m x edge_v_m"), &cross(edge_u_m, edge_v_m))?;
            colour(&key("radiance"), radiance)
        }
        Light::Point { position_m, intensity } => {
            vector(&key("position_m"), position_m)?;
            colour(&key("intensity"), intensity)
        }
        Light::Sun { direction, angular_radius_rad, irradiance } => {
            unit_or_longer(&key("direction"), direction)?;
            if !(*angular_radius_rad >= 1e-6 && *angular_radius_rad <= std::f64::consts::FRAC_PI_2) {
                let expected = "from 1e-6 to pi/2; the sun's is 0.00465";
                return Err(refuse_number(&key("angular_radius_rad"), *angular_radius_rad, expected));
            }
            colour(&key("irradiance"), irradiance)
        }
    }
}

fn validate_look(look: &Look, key: &dyn Fn(&str) -> String) -> Result<(), SceneError> {
    use Bsdf::{Conductor, Emitter, Lambertian, Plastic};
    let belongs: [(&str, bool, &[Bsdf]); 7] = [
        ("checker_albedo", look.checker_albedo.is_some(), &[Lambertian, Plastic]),
        ("metal", look.metal.is_some(), &[Conductor]),
        ("eta", look.eta.is_some(), &[Conductor]),
        ("k", look.k.is_some(), &[Conductor]),
        ("roughness", look.roughness.is_some(), &[Conductor, Plastic]),
        ("refractive_index", look.refractive_index.is_some(), &[Plastic]),
        ("radiance", look.radiance.is_some(), &[Emitter]),
    ];
    for (field, given, owners) in belongs {
        if given && !owners.contains(&look.bsdf) {
            let names: Vec<_> = owners.iter().map(|bsdf| format!("\"{}\"", bsdf.name())).collect();
            let expected = format!("no such key unless bsdf is {}", names.join(" or "));
            return Err(refuse(
                &key(field),
                format!("given with bsdf = \"{}\"", look.bsdf.name()),
                &expected,
            ));
        }
    }
    for (field, albedo) in [("albedo", Some(&look.albedo)), ("checker_albedo", look.checker_albedo.as_ref())]
    {
        if let Some(albedo) = albedo
            && !albedo.iter().all(|share| (0.0..=1.0).contains(share))
        {
            return Err(refuse(&key(field), format!("{albedo:?}"), "three numbers from 0 to 1"));
        }
    }
    if let Some(roughness) = look.roughness
        && !(0.0..=1.0).contains(&roughness)
    {
        return Err(refuse_number(&key("roughness"), roughness, "from 0 (polished) to 1"));
    }
    if let Some(index) = look.refractive_index
        && !(index > 1.0 && index <= 5.0)
    {
        return Err(refuse_number(&key("refractive_index"), index, "more than 1 and at most 5"));
    }
    if look.bsdf == Emitter && look.radiance.is_none() {
        return Err(refuse(&key("radiance"), "missing", "three numbers: what the emitter emits"));
    }
    look.radiance.map_or(Ok(()), |radiance| colour(&key("radiance"), &radiance))?;
    match (look.eta, look.k) {
        (None, None) => Ok(()),
        (Some(eta), Some(k)) => {
            if look.metal.is_some() {
                return Err(refuse(&key("eta"), format!("{eta:?}"), "metal, or eta and k, not both"));
            }
            eta.iter().try_for_each(|&eta| positive(&key("eta"), eta))?;
            k.iter().try_for_each(|&k| not_negative(&key("k"), k))
        }
        (Some(eta), None) => Err(refuse(&key("eta"), format!("{eta:?}"), "k beside it")),
        (None, Some(k)) => Err(refuse(&key("k"), format!("{k:?}"), "eta beside it")),
    }
}
