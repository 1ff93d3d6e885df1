//! Every value of the second half of a scene is checked here.

use super::super::SceneError;
use super::super::validate::{
    colour, cross, norm, not_negative, positive, refuse, refuse_number, unit_or_longer, vector,
};
use super::{Bsdf, Camera, Light, Look, Render};

pub(in super::super) fn validate(render: &Render) -> Result<(), SceneError> {
    validate_film(render)?;
    validate_camera(&render.camera)?;
    unit_or_longer("render.sky.up", &render.sky.up)?;
    colour("render.sky.zenith_radiance", &render.sky.zenith_radiance)?;
    colour("render.sky.horizon_radiance", &render.sky.horizon_radiance)?;
    for (index, light) in render.lights.iter().enumerate() {
        validate_light(light, &|field: &str| format!("render.light[{index}].{field}"))?;
    }
    for (name, look) in &render.looks {
        validate_look(look, &|field: &str| format!("render.look.{name}.{field}"))?;
    }
    Ok(())
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
    let radius = render.filter.radius_px;
    if !(radius > 0.0 && radius <= 16.0) {
        return Err(refuse_number("render.filter.radius_px", radius, "more than 0 and at most 16 pixels"));
    }
    positive("render.exposure", render.exposure)
}

fn validate_camera(camera: &Camera) -> Result<(), SceneError> {
    vector("render.camera.position_m", &camera.position_m)?;
    vector("render.camera.look_at_m", &camera.look_at_m)?;
    vector("render.camera.up", &camera.up)?;
    let angle = camera.vertical_field_of_view_rad;
    if !(angle > 0.0 && angle < std::f64::consts::PI) {
        return Err(refuse_number(
            "render.camera.vertical_field_of_view_rad",
            angle,
            "more than 0 and less than pi",
        ));
    }
    let view: [f64; 3] = std::array::from_fn(|axis| camera.look_at_m[axis] - camera.position_m[axis]);
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
                let expected = "a positive radius: a light without area sends no light at any radiance; make \
                                it small and its radiance large";
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
